//! What a change of a constant, or of the head's motion, adds to the equations of the derivatives.

#![allow(clippy::needless_range_loop)] // indices are those of the equations

use super::lane_vector::LaneVector;
use super::linkage_tangent::LinkageConstant;
use super::motion_samples::{LinkAttitudes, MotionSamples};
use super::{ReferenceMotion, lanes_per_link};
use crate::model::series::ContactMode;
use crate::model::shoulder::ShoulderContact;

/// What one change does at a few instants, over the unit of the change; or the factors of the same in a sum.
#[derive(Debug, Clone, Copy, Default)]
pub struct ForcingTerms {
    /// Moves the head along the sweep, m.
    pub head: LaneVector,
    /// Moves the tip where the angles stay, m, with the first two derivatives in time.
    pub tip: [LaneVector; 3],
    /// Lowers the head likewise, m.
    pub drop: LaneVector,
    pub normal: LaneVector,
    /// Friction force in slip, N, at the same normal force and speed of the blade's own.
    pub force: LaneVector,
    /// What is added to each equation.
    pub equations: [LaneVector; 3],
}

/// A change of the head's motion along the sweep at a few instants, m, with the first two derivatives.
pub(crate) type HeadMotionChange = [LaneVector; 3];

/// What a constant does directly.
#[derive(Default)]
struct DirectForcing {
    effect: ForcingTerms,
    /// To the equation of each link over its cosine.
    links: [LaneVector; 2],
    drop_acceleration: LaneVector,
}

impl ForcingTerms {
    /// Sum of the products with the factors of another.
    pub(crate) fn dot(&self, factors: &Self) -> LaneVector {
        let numbers = |e: &Self| {
            let ([t_0, t_1, t_2], [e_0, e_1, e_2]) = (e.tip, e.equations);
            [e.head, t_0, t_1, t_2, e.drop, e.normal, e.force, e_0, e_1, e_2]
        };
        let mut sum = LaneVector::ZERO;
        numbers(self).into_iter().zip(numbers(factors)).for_each(|(a, b)| sum += a * b);
        sum
    }
}

impl<const K: usize> ReferenceMotion<'_, K> {
    /// Whether a constant matters in this course.
    pub(crate) fn depends_on(&self, constant: LinkageConstant) -> bool {
        match constant {
            LinkageConstant::FrictionA | LinkageConstant::FrictionB | LinkageConstant::FrictionC => {
                matches!(self.touch, ContactMode::Slip(_))
            }
            LinkageConstant::ContactAngle
            | LinkageConstant::ShoulderStiffness
            | LinkageConstant::ShoulderDamping => self.lean != ShoulderContact::Off,
            _ => true,
        }
    }

    /// What a unit of a constant does.
    #[inline(always)]
    pub(crate) fn constant_forcing(&self, at: &MotionSamples, constant: LinkageConstant) -> ForcingTerms {
        let mut direct = DirectForcing::default();
        if let LinkageConstant::FrictionA | LinkageConstant::FrictionB | LinkageConstant::FrictionC = constant
        {
            // (nothing but a force, and there are often three of them)
            direct.effect.force = self.friction_law_forcing(at, constant);
            let l = self.lengths();
            direct.effect.equations[0] = -l[0] * direct.effect.force;
            direct.effect.equations[1] = -l[1] * direct.effect.force;
            return direct.effect;
        }
        self.add_direct_forcing(&mut direct, at, constant);
        self.complete_forcing(at, direct)
    }

    /// Whether a constant moves tip or head where the angles stay; only then there is [`Self::displacement_terms`].
    pub(crate) fn displaces_points(&self, constant: LinkageConstant) -> bool {
        matches!(constant, LinkageConstant::Length(_))
    }

    /// Where a unit of a constant moves tip and head; no forces.
    pub(crate) fn displacement_terms(&self, at: &LinkAttitudes, constant: LinkageConstant) -> ForcingTerms {
        let mut effect = ForcingTerms::default();
        if let LinkageConstant::Length(j) = constant {
            (effect.tip[0], effect.tip[1]) = (at.sin[j], at.cos[j] * at.rate[j]);
            effect.drop = LaneVector::splat(1.0) - at.cos[j];
        }
        effect
    }

    /// What a change of the head's motion does.
    #[inline(always)]
    pub(crate) fn head_motion_forcing(&self, at: &MotionSamples, shift: &HeadMotionChange) -> ForcingTerms {
        let m = self.moments();
        let effect = ForcingTerms { head: shift[0], tip: *shift, ..ForcingTerms::default() };
        self.complete_forcing(
            at,
            DirectForcing { effect, links: lanes_per_link(|i| m[i] * shift[2]), ..DirectForcing::default() },
        )
    }

    #[inline(always)]
    fn add_direct_forcing(&self, direct: &mut DirectForcing, at: &MotionSamples, constant: LinkageConstant) {
        let DirectForcing { effect, links, drop_acceleration } = direct;
        let [secant, tangent] = [&at.secant[0], &at.tangent[0]];
        match constant {
            LinkageConstant::Mass => effect.normal = -at.drop_acceleration,
            LinkageConstant::Length(j) => {
                let head = self.linkage.head;
                *drop_acceleration = at.across[j];
                effect.tip = [at.sin[j], at.cos[j] * at.rate[j], at.along[j]];
                effect.drop = LaneVector::splat(1.0) - at.cos[j];
                effect.normal = -head.stiffness * effect.drop
                    - head.damping * (at.sin[j] * at.rate[j])
                    - self.linkage.mass_kg * at.across[j];
                links[j] = -(at.friction + tangent[j] * at.normal);
            }
            LinkageConstant::Moment(j) => {
                effect.normal = at.across[j];
                links[j] = at.head_acceleration - tangent[j] * at.drop_acceleration;
            }
            LinkageConstant::Coupling => {
                *links = lanes_per_link(|i| at.along[1 - i] + tangent[i] * at.across[1 - i])
            }
            LinkageConstant::Inertia(i) => links[i] = secant[i] * at.acceleration[i],
            LinkageConstant::HeadStiffness => {
                effect.normal =
                    LaneVector::splat(self.linkage.preload_displacement_m) - self.sample_head_drop(at)[0];
            }
            LinkageConstant::HeadDamping => effect.normal = -self.sample_head_drop(at)[1],
            LinkageConstant::Preload => effect.normal = LaneVector::splat(self.linkage.head.stiffness),
            _ => self.add_spring_forcing(links, at, constant),
        }
    }

    /// What the springs and dampers of the links do.
    #[inline(always)]
    fn add_spring_forcing(&self, links: &mut [LaneVector; 2], at: &MotionSamples, constant: LinkageConstant) {
        let secant = &at.secant[0];
        let [theta, phi] = self.sample_angles(at);
        let [theta_rate, phi_rate] = at.rate;
        let lip = |moment: LaneVector| [-secant[0] * moment, secant[1] * moment];
        let side = self.lean.angle_sign();
        match (constant, &self.linkage.shoulder) {
            (LinkageConstant::NeckStiffness, _) => links[0] = secant[0] * theta,
            (LinkageConstant::NeckDamping, _) | (LinkageConstant::ShoulderDamping, Some(_)) => {
                links[0] = secant[0] * theta_rate;
            }
            (LinkageConstant::LipStiffness, _) => *links = lip(phi - theta),
            (LinkageConstant::LipDamping, _) => *links = lip(phi_rate - theta_rate),
            (LinkageConstant::ShoulderStiffness, Some(s)) => {
                links[0] = secant[0] * (theta - LaneVector::splat(side * s.contact_angle_rad));
            }
            (LinkageConstant::ContactAngle, Some(s)) => {
                links[0] = (-side * s.stiffness_n_m_per_rad) * secant[0]
            }
            _ => {}
        }
    }

    /// What the law of friction does to its force in slip.
    #[inline(always)]
    fn friction_law_forcing(&self, at: &MotionSamples, constant: LinkageConstant) -> LaneVector {
        let direction = self.touch.slip_direction();
        match constant {
            LinkageConstant::FrictionA => -direction * at.normal * self.friction_decay(at, direction),
            LinkageConstant::FrictionB => self.sample_tip_velocity(at.x) * at.falling,
            _ => -direction * at.normal,
        }
    }

    #[inline(always)]
    fn complete_forcing(&self, at: &MotionSamples, direct: DirectForcing) -> ForcingTerms {
        let (l, m, n) = (self.lengths(), self.moments(), self.normal_force_arms(at));
        let DirectForcing { mut effect, links, drop_acceleration } = direct;
        effect.force += self.friction_per_speed(at) * effect.tip[1];
        for i in 0..2 {
            effect.equations[i] = links[i] - (m[i] * at.tangent[0][i]) * drop_acceleration
                + n[i] * effect.normal
                - l[i] * effect.force;
        }
        if self.is_in_flight() {
            effect.equations[2] = -effect.normal;
        }
        effect
    }
}
