//! Derivatives of the blade's quantities as linear forms of the derivatives of its angles.

#![allow(clippy::needless_range_loop)] // indices are those of the equations

use super::{ForcingTerms, LaneVector, LinkAttitudes, MotionSamples, ReferenceMotion, TangentMatrices};
use crate::model::series::ContactMode;

/// A quantity of the blade whose derivatives are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelChannel {
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
    /// Normal force on the tip, N.
    NormalForce,
    /// Friction force on the tip, N.
    FrictionForce,
}

/// Derivative of a quantity as a linear form: its coefficients at a few instants.
#[derive(Debug, Clone, Default)]
pub struct LinearForm {
    /// Coefficients of the unknowns: `y1` and `y2` (the derivatives of the sines of the angles of neck and
    /// lip) and the derivative of the gap.
    pub value: [LaneVector; 3],
    /// Coefficients of the first time derivatives of the unknowns: `y1` and `y2` (the derivatives of the
    /// sines of the angles of neck and lip) and the derivative of the gap.
    pub rate: [LaneVector; 3],
    /// Coefficients of the second time derivatives of the unknowns: `y1` and `y2` (the derivatives of the
    /// sines of the angles of neck and lip) and the derivative of the gap. They are zero after the second
    /// time derivatives are eliminated.
    second: [LaneVector; 3],
    /// Coefficient of the derivative of the position at which the tip sticks.
    pub place: LaneVector,
    /// Coefficients of the forcing terms.
    pub forcing: ForcingTerms,
}

impl<const K: usize> ReferenceMotion<'_, K> {
    /// Linear form of the tip's position along the sweep; its coefficients are the same at all instants.
    pub(crate) fn tip_position_form(&self) -> LinearForm {
        let (mut form, l, one) = (LinearForm::default(), self.lengths(), LaneVector::splat(1.0));
        if self.touch == ContactMode::Stick {
            form.place = one;
        } else {
            (form.value[0], form.value[1], form.forcing.tip[0]) =
                (LaneVector::splat(l[0]), LaneVector::splat(l[1]), one);
        }
        form
    }

    /// Linear form of the head's position along the sweep; its coefficients are the same at all instants.
    pub(crate) fn head_position_form(&self) -> LinearForm {
        let mut form = LinearForm::default();
        form.forcing.head = LaneVector::splat(1.0);
        form
    }

    /// Linear form of a quantity at the sampled instants; in stick, `y2` (of the lip) is eliminated. The
    /// result for a force is zero: [`Self::force_form`] computes the form of a force.
    pub(crate) fn channel_form(&self, at: &LinkAttitudes, quantity: ModelChannel) -> LinearForm {
        let (mut form, l, one) = (LinearForm::default(), self.lengths(), LaneVector::splat(1.0));
        let gap = if self.is_in_flight() { one } else { LaneVector::ZERO };
        let secant = |i: usize| at.cos[i].inverse();
        match quantity {
            ModelChannel::TipX => return self.tip_position_form(),
            ModelChannel::TipVelocity => {
                (form.rate[0], form.rate[1], form.forcing.tip[1]) =
                    (LaneVector::splat(l[0]), LaneVector::splat(l[1]), one);
            }
            ModelChannel::HeadX => return self.head_position_form(),
            ModelChannel::HeadDrop => {
                (0..2).for_each(|i| form.value[i] = l[i] * (at.sin[i] * secant(i)));
                (form.value[2], form.forcing.drop) = (-gap, one);
            }
            ModelChannel::TipHeight => form.value[2] = gap,
            ModelChannel::NeckAngle => form.value[0] = secant(0),
            ModelChannel::LipAngle => form.value[1] = secant(1),
            ModelChannel::NeckRate | ModelChannel::LipRate => {
                let i = usize::from(quantity == ModelChannel::LipRate);
                let secant = secant(i);
                form.value[i] = at.sin[i] * at.rate[i] * secant * secant;
                form.rate[i] = secant;
            }
            ModelChannel::NormalForce | ModelChannel::FrictionForce => {}
        }
        if self.touch == ContactMode::Stick {
            self.eliminate_lip(&mut form);
        }
        form
    }

    /// Linear form of a force at the sampled instants, with the second time derivatives eliminated; zero in
    /// flight.
    pub(crate) fn force_form(&self, at: &MotionSamples, quantity: ModelChannel) -> LinearForm {
        let mut form = match (quantity, self.touch) {
            (_, ContactMode::Flight(..)) => return LinearForm::default(),
            (ModelChannel::NormalForce, _) => self.normal_force_form(at),
            (_, ContactMode::Stick) => self.stick_friction_form(&self.tangent_matrices(at)),
            (_, ContactMode::Slip(_)) => self.slip_friction_form(at),
        };
        self.eliminate_accelerations(&mut form, &self.tangent_matrices(at));
        form
    }

    /// Linear form of the normal force, `dN = sum arm S'' - k0 l S - c0 l S' + ...`.
    fn normal_force_form(&self, at: &MotionSamples) -> LinearForm {
        let mut form = LinearForm::default();
        let (l, arms, head) = (self.lengths(), self.arms(), self.linkage.head);
        for j in 0..2 {
            let [t, t_1, t_2] = [at.tangent[0][j], at.tangent[1][j], at.tangent[2][j]];
            let (by_rate, by_value) = (-head.damping * l[j], -head.stiffness * l[j]);
            form.second[j] = arms[j] * t;
            form.rate[j] = (2.0 * arms[j]) * t_1 + by_rate * t;
            form.value[j] = arms[j] * t_2 + by_rate * t_1 + by_value * t;
        }
        form.forcing.normal = LaneVector::splat(1.0);
        form
    }

    /// Linear form of friction in slip, `df = -sigma mu dN + b N E d v3' + ...`.
    fn slip_friction_form(&self, at: &MotionSamples) -> LinearForm {
        let mut form = self.normal_force_form(at);
        let (l, per_speed) = (self.lengths(), self.friction_per_speed(at));
        for j in 0..2 {
            form.second[j] = -at.mu * form.second[j];
            form.rate[j] = l[j] * per_speed - at.mu * form.rate[j];
            form.value[j] = -at.mu * form.value[j];
        }
        (form.forcing.normal, form.forcing.force) = (-at.mu, LaneVector::splat(1.0));
        form
    }

    /// Linear form of friction in stick, from the equation of the neck; for a slider, from the equation of
    /// the lip.
    fn stick_friction_form(&self, matrices: &TangentMatrices) -> LinearForm {
        let (mut form, link) = (LinearForm::default(), usize::from(self.linkage.is_slider()));
        let share = 1.0 / self.lengths()[link];
        for j in 0..2 {
            form.second[j] = share * matrices.mass[link][j];
            form.rate[j] = share * matrices.damping[link][j];
            form.value[j] = share * matrices.stiffness[link][j];
        }
        form.forcing.equations[link] = LaneVector::splat(share);
        form
    }

    /// Eliminates the second time derivatives from a linear form, by the equations of the variation.
    fn eliminate_accelerations(&self, form: &mut LinearForm, matrices: &TangentMatrices) {
        if self.touch == ContactMode::Stick {
            self.eliminate_lip(form);
            return self.eliminate_in_stick(form, matrices);
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
            form.forcing.equations[i] -= factor;
        }
        form.second = [LaneVector::ZERO; 3];
    }

    /// Eliminates `y1''` (of the neck) from a linear form, by the equation of the variation in stick.
    fn eliminate_in_stick(&self, form: &mut LinearForm, matrices: &TangentMatrices) {
        let (single, l) = (self.stick_equation(matrices), self.lengths());
        let factor = form.second[0] * single.first[0].inverse();
        form.rate[0] -= factor * single.first[1];
        form.value[0] -= factor * single.first[2];
        let share = 1.0 / l[1];
        form.place -= share * (factor * single.second[2]);
        for k in 0..3 {
            // (the coefficient of the second derivative comes first in the equation)
            form.forcing.tip[k] += share * (factor * single.second[2 - k]);
        }
        form.forcing.equations[0] -= l[1] * factor;
        form.forcing.equations[1] += l[0] * factor;
        form.second = [LaneVector::ZERO; 3];
    }

    /// Eliminates `y2` (of the lip) and its time derivatives from a linear form in stick, by `y2 = (place -
    /// tip - l1 y1) / l2`.
    fn eliminate_lip(&self, form: &mut LinearForm) {
        let l = self.lengths();
        let (ratio, share) = (l[0] / l[1], 1.0 / l[1]);
        let LinearForm { value, rate, second, place, forcing: own } = form;
        *place += share * value[1];
        for (k, factors) in [value, rate, second].into_iter().enumerate() {
            own.tip[k] -= share * factors[1];
            factors[0] -= ratio * factors[1];
            factors[1] = LaneVector::ZERO;
        }
    }
}
