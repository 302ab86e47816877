//! What a change of a constant, or of the head's motion, adds to the equations of the derivatives.

#![allow(clippy::needless_range_loop)] // indices are those of the equations

use super::course::{Course, rows};
use super::instants::{Attitude, Instants};
use super::linkage::Constant;
use super::row::Row;
use crate::blade::series::Touch;
use crate::blade::shoulder::Lean;

/// What one change does at a few instants, over the unit of the change; or the factors of the same in a sum.
#[derive(Debug, Clone, Copy, Default)]
pub struct Effect {
    /// Moves the head along the sweep, m.
    pub head: Row,
    /// Moves the tip where the angles stay, m, with the first two derivatives in time.
    pub tip: [Row; 3],
    /// Lowers the head likewise, m.
    pub drop: Row,
    /// Normal force, N.
    pub normal: Row,
    /// Friction force in slip, N, at the same normal force and speed of the blade's own.
    pub force: Row,
    /// What is added to each equation.
    pub equations: [Row; 3],
}

/// A change of the head's motion along the sweep at a few instants, m, with the first two derivatives.
pub type HeadShift = [Row; 3];

/// What a constant does directly.
#[derive(Default)]
struct Direct {
    effect: Effect,
    /// To the equation of each link over its cosine.
    links: [Row; 2],
    /// To `u''`.
    drop_acceleration: Row,
}

impl Effect {
    /// Sum of the products with the factors of another.
    #[must_use]
    pub fn dot(&self, factors: &Self) -> Row {
        let numbers = |e: &Self| {
            let ([t_0, t_1, t_2], [e_0, e_1, e_2]) = (e.tip, e.equations);
            [e.head, t_0, t_1, t_2, e.drop, e.normal, e.force, e_0, e_1, e_2]
        };
        let mut sum = Row::ZERO;
        numbers(self).into_iter().zip(numbers(factors)).for_each(|(a, b)| sum += a * b);
        sum
    }
}

impl<const K: usize> Course<'_, K> {
    /// Whether a constant matters in this course.
    #[must_use]
    pub fn uses(&self, constant: Constant) -> bool {
        match constant {
            Constant::FrictionA | Constant::FrictionB | Constant::FrictionC => {
                matches!(self.touch, Touch::Slip(_))
            }
            Constant::ContactAngle | Constant::ShoulderStiffness | Constant::ShoulderDamping => {
                self.lean != Lean::Off
            }
            _ => true,
        }
    }

    /// What a unit of a constant does.
    #[inline(always)]
    #[must_use]
    pub fn effect(&self, at: &Instants, constant: Constant) -> Effect {
        let mut direct = Direct::default();
        if let Constant::FrictionA | Constant::FrictionB | Constant::FrictionC = constant {
            // (nothing but a force, and there are often three of them)
            direct.effect.force = self.rub(at, constant);
            let l = self.lengths();
            direct.effect.equations[0] = -l[0] * direct.effect.force;
            direct.effect.equations[1] = -l[1] * direct.effect.force;
            return direct.effect;
        }
        self.act(&mut direct, at, constant);
        self.complete(at, direct)
    }

    /// Whether a constant moves tip or head where the angles stay; only then there is [`Self::moved`].
    #[must_use]
    pub fn moves(&self, constant: Constant) -> bool {
        matches!(constant, Constant::Length(_))
    }

    /// Where a unit of a constant moves tip and head; no forces.
    #[must_use]
    pub fn moved(&self, at: &Attitude, constant: Constant) -> Effect {
        let mut effect = Effect::default();
        if let Constant::Length(j) = constant {
            (effect.tip[0], effect.tip[1]) = (at.sin[j], at.cos[j] * at.rate[j]);
            effect.drop = Row::all(1.0) - at.cos[j];
        }
        effect
    }

    /// What a change of the head's motion does.
    #[inline(always)]
    #[must_use]
    pub fn head_effect(&self, at: &Instants, shift: &HeadShift) -> Effect {
        let m = self.moments();
        let effect = Effect { head: shift[0], tip: *shift, ..Effect::default() };
        self.complete(at, Direct { effect, links: rows(|i| m[i] * shift[2]), ..Direct::default() })
    }

    #[inline(always)]
    fn act(&self, direct: &mut Direct, at: &Instants, constant: Constant) {
        let Direct { effect, links, drop_acceleration } = direct;
        let [secant, tangent] = [&at.secant[0], &at.tangent[0]];
        match constant {
            Constant::Mass => effect.normal = -at.drop_acceleration,
            Constant::Length(j) => {
                let head = self.linkage.head;
                *drop_acceleration = at.across[j];
                effect.tip = [at.sin[j], at.cos[j] * at.rate[j], at.along[j]];
                effect.drop = Row::all(1.0) - at.cos[j];
                effect.normal = -head.stiffness * effect.drop
                    - head.damping * (at.sin[j] * at.rate[j])
                    - self.linkage.mass_kg * at.across[j];
                links[j] = -(at.friction + tangent[j] * at.normal);
            }
            Constant::Moment(j) => {
                effect.normal = at.across[j];
                links[j] = at.head_acceleration - tangent[j] * at.drop_acceleration;
            }
            Constant::Coupling => *links = rows(|i| at.along[1 - i] + tangent[i] * at.across[1 - i]),
            Constant::Inertia(i) => links[i] = secant[i] * at.acceleration[i],
            Constant::HeadStiffness => {
                effect.normal = Row::all(self.linkage.preload_displacement_m) - self.drop(at)[0];
            }
            Constant::HeadDamping => effect.normal = -self.drop(at)[1],
            Constant::Preload => effect.normal = Row::all(self.linkage.head.stiffness),
            _ => self.bend(links, at, constant),
        }
    }

    /// What the springs and dampers of the links do.
    #[inline(always)]
    fn bend(&self, links: &mut [Row; 2], at: &Instants, constant: Constant) {
        let secant = &at.secant[0];
        let [theta, phi] = self.angles(at);
        let [theta_rate, phi_rate] = at.rate;
        let lip = |moment: Row| [-secant[0] * moment, secant[1] * moment];
        let side = self.lean.sign();
        match (constant, &self.linkage.shoulder) {
            (Constant::NeckStiffness, _) => links[0] = secant[0] * theta,
            (Constant::NeckDamping, _) | (Constant::ShoulderDamping, Some(_)) => {
                links[0] = secant[0] * theta_rate;
            }
            (Constant::LipStiffness, _) => *links = lip(phi - theta),
            (Constant::LipDamping, _) => *links = lip(phi_rate - theta_rate),
            (Constant::ShoulderStiffness, Some(s)) => {
                links[0] = secant[0] * (theta - Row::all(side * s.contact_angle_rad));
            }
            (Constant::ContactAngle, Some(s)) => links[0] = (-side * s.stiffness_n_m_per_rad) * secant[0],
            _ => {}
        }
    }

    /// What the law of friction does to its force in slip.
    #[inline(always)]
    fn rub(&self, at: &Instants, constant: Constant) -> Row {
        let direction = self.touch.direction();
        match constant {
            Constant::FrictionA => -direction * at.normal * self.decay(at, direction),
            Constant::FrictionB => self.tip_velocity(at.x) * at.falling,
            _ => -direction * at.normal,
        }
    }

    #[inline(always)]
    fn complete(&self, at: &Instants, direct: Direct) -> Effect {
        let (l, m, n) = (self.lengths(), self.moments(), self.per_normal(at));
        let Direct { mut effect, links, drop_acceleration } = direct;
        effect.force += self.per_speed(at) * effect.tip[1];
        for i in 0..2 {
            effect.equations[i] = links[i] - (m[i] * at.tangent[0][i]) * drop_acceleration
                + n[i] * effect.normal
                - l[i] * effect.force;
        }
        if self.flies() {
            effect.equations[2] = -effect.normal;
        }
        effect
    }
}
