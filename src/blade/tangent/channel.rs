//! Quantities of the blade by the derivatives of its angles.

#![allow(clippy::needless_range_loop)] // indices are those of the equations

use super::course::Course;
use super::equations::Matrices;
use super::instants::{Attitude, Instants};
use super::row::Row;
use super::source::Effect;
use crate::blade::series::Touch;

/// A quantity whose derivatives follow from those of the angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Position of the tip along the sweep, m.
    TipX,
    /// Drop of the head towards the glass, m.
    HeadDrop,
    /// Position of the head along the sweep, m.
    HeadX,
    /// Height of the tip above the glass, m; zero in contact.
    TipHeight,
    /// Angle of the neck, rad.
    NeckAngle,
    /// Angle of the lip, rad.
    LipAngle,
    /// Angular rate of the neck, rad/s.
    NeckRate,
    /// Angular rate of the lip, rad/s.
    LipRate,
    /// Velocity of the tip along the sweep, m/s.
    TipVelocity,
    /// Normal force, N.
    NormalForce,
    /// Friction force, N.
    FrictionForce,
}

/// A quantity's derivative as a sum: factors at a few instants.
#[derive(Debug, Clone, Default)]
pub struct Form {
    /// Of `y1`, `y2` and the gap.
    pub value: [Row; 3],
    /// Of their rates.
    pub rate: [Row; 3],
    /// Of their second derivatives; nothing once they are resolved.
    second: [Row; 3],
    /// Of the place where the tip sticks.
    pub place: Row,
    /// Of what a change adds.
    pub own: Effect,
}

impl<const K: usize> Course<'_, K> {
    /// The place of the tip, at any instants, as [`Self::form`] has it.
    #[must_use]
    pub fn tip_form(&self) -> Form {
        let (mut form, l) = (Form::default(), self.lengths());
        let one = Row::all(1.0);
        if self.touch == Touch::Stick {
            form.place = one;
        } else {
            (form.value[0], form.value[1], form.own.tip[0]) = (Row::all(l[0]), Row::all(l[1]), one);
        }
        form
    }

    /// The place of the head along the sweep, likewise.
    #[must_use]
    pub fn head_form(&self) -> Form {
        let mut form = Form::default();
        form.own.head = Row::all(1.0);
        form
    }

    /// A quantity at these instants; in stick without `y2`, which follows. A force needs all of them:
    /// [`Self::force_form`].
    #[must_use]
    pub fn form(&self, at: &Attitude, quantity: Quantity) -> Form {
        let mut form = Form::default();
        let l = self.lengths();
        let one = Row::all(1.0);
        let gap = if self.flies() { one } else { Row::ZERO };
        let secant = |i: usize| at.cos[i].inverse();
        match quantity {
            Quantity::TipX => return self.tip_form(),
            Quantity::TipVelocity => {
                (form.rate[0], form.rate[1], form.own.tip[1]) = (Row::all(l[0]), Row::all(l[1]), one);
            }
            Quantity::HeadX => return self.head_form(),
            Quantity::HeadDrop => {
                for i in 0..2 {
                    form.value[i] = l[i] * (at.sin[i] * secant(i));
                }
                (form.value[2], form.own.drop) = (-gap, one);
            }
            Quantity::TipHeight => form.value[2] = gap,
            Quantity::NeckAngle => form.value[0] = secant(0),
            Quantity::LipAngle => form.value[1] = secant(1),
            Quantity::NeckRate | Quantity::LipRate => {
                let i = usize::from(quantity == Quantity::LipRate);
                let secant = secant(i);
                form.value[i] = at.sin[i] * at.rate[i] * secant * secant;
                form.rate[i] = secant;
            }
            Quantity::NormalForce | Quantity::FrictionForce => {}
        }
        if self.touch == Touch::Stick {
            self.hold(&mut form);
        }
        form
    }

    /// A force at these instants, likewise; there is none in flight.
    #[must_use]
    pub fn force_form(&self, at: &Instants, quantity: Quantity) -> Form {
        let mut form = match (quantity, self.touch) {
            (_, Touch::Flight(..)) => return Form::default(),
            (Quantity::NormalForce, _) => self.normal_form(at),
            (_, Touch::Stick) => self.holding_form(&self.matrices(at)),
            (_, Touch::Slip(_)) => self.sliding_form(at),
        };
        self.resolve(&mut form, &self.matrices(at));
        form
    }

    /// `dN = sum arm S'' - k0 l S - c0 l S' + ...`.
    fn normal_form(&self, at: &Instants) -> Form {
        let mut form = Form::default();
        let (l, arms, head) = (self.lengths(), self.arms(), self.linkage.head);
        for j in 0..2 {
            let [t, t_1, t_2] = [at.tangent[0][j], at.tangent[1][j], at.tangent[2][j]];
            let (by_rate, by_value) = (-head.damping * l[j], -head.stiffness * l[j]);
            form.second[j] = arms[j] * t;
            form.rate[j] = (2.0 * arms[j]) * t_1 + by_rate * t;
            form.value[j] = arms[j] * t_2 + by_rate * t_1 + by_value * t;
        }
        form.own.normal = Row::all(1.0);
        form
    }

    /// `df = -sigma mu dN + b N E d v3' + ...`.
    fn sliding_form(&self, at: &Instants) -> Form {
        let mut form = self.normal_form(at);
        let (l, per_speed) = (self.lengths(), self.per_speed(at));
        for j in 0..2 {
            form.second[j] = -at.mu * form.second[j];
            form.rate[j] = l[j] * per_speed - at.mu * form.rate[j];
            form.value[j] = -at.mu * form.value[j];
        }
        (form.own.normal, form.own.force) = (-at.mu, Row::all(1.0));
        form
    }

    /// What the neck's equation leaves for the force that holds the tip.
    fn holding_form(&self, matrices: &Matrices) -> Form {
        let mut form = Form::default();
        let share = 1.0 / self.linkage.l1_m;
        for j in 0..2 {
            form.second[j] = share * matrices.mass[0][j];
            form.rate[j] = share * matrices.damping[0][j];
            form.value[j] = share * matrices.stiffness[0][j];
        }
        form.own.equations[0] = Row::all(share);
        form
    }

    /// Puts what the equations say in place of the second derivatives.
    fn resolve(&self, form: &mut Form, matrices: &Matrices) {
        if self.touch == Touch::Stick {
            self.hold(form);
            return self.resolve_held(form, matrices);
        }
        let [[a, b], [c, d]] = [0, 1].map(|i| [matrices.mass[i][0], matrices.mass[i][1]]);
        let share = (a * d - b * c).inverse();
        let [first, second] = [form.second[0], form.second[1]];
        let by_equation = [share * (first * d - second * c), share * (second * a - first * b)];
        for (i, factor) in by_equation.into_iter().enumerate() {
            for j in 0..2 {
                form.rate[j] -= factor * matrices.damping[i][j];
                form.value[j] -= factor * matrices.stiffness[i][j];
            }
            form.own.equations[i] -= factor;
        }
        form.second = [Row::ZERO; 3];
    }

    /// The same where the tip sticks: `y1''` follows from the one equation.
    fn resolve_held(&self, form: &mut Form, matrices: &Matrices) {
        let (single, l) = (self.single(matrices), self.lengths());
        let factor = form.second[0] * single.first[0].inverse();
        form.rate[0] -= factor * single.first[1];
        form.value[0] -= factor * single.first[2];
        let share = 1.0 / l[1];
        form.place -= share * (factor * single.second[2]);
        for k in 0..3 {
            // (the second derivative comes first in the equation)
            form.own.tip[k] += share * (factor * single.second[2 - k]);
        }
        form.own.equations[0] -= l[1] * factor;
        form.own.equations[1] += l[0] * factor;
        form.second = [Row::ZERO; 3];
    }

    /// Puts `y2 = (place - tip - l1 y1) / l2` and its derivatives in place of `y2`.
    fn hold(&self, form: &mut Form) {
        let l = self.lengths();
        let (ratio, share) = (l[0] / l[1], 1.0 / l[1]);
        let Form { value, rate, second, place, own } = form;
        *place += share * value[1];
        for (k, factors) in [value, rate, second].into_iter().enumerate() {
            own.tip[k] -= share * factors[1];
            factors[0] -= ratio * factors[1];
            factors[1] = Row::ZERO;
        }
    }
}
