//! Forcing terms: contributions of a change of a constant, or of the head's motion, to the equations of the
//! variation.

#![allow(clippy::needless_range_loop)] // indices are those of the equations

use super::lane_vector::LaneVector;
use super::linkage_tangent::LinkageConstant;
use super::motion_samples::{LinkAttitudes, MotionSamples};
use super::{ReferenceMotion, lanes_per_link};
use crate::model::series::ContactMode;
use crate::model::shoulder::ShoulderContact;

/// Forcing terms of a change at a few instants, per unit of the change. In a [`super::LinearForm`], each
/// field is the factor of that term.
#[derive(Debug, Clone, Copy, Default)]
pub struct ForcingTerms {
    /// Displacement of the head along the sweep, m.
    pub head: LaneVector,
    /// Displacement of the tip along the sweep at constant angles, m, and its first two derivatives in time.
    pub tip: [LaneVector; 3],
    /// Change of the head's drop at constant angles, m.
    pub drop: LaneVector,
    /// Change of the normal force at constant angles, N.
    pub normal: LaneVector,
    /// Change of the friction force in slip at constant angles and constant normal force, N.
    pub force: LaneVector,
    /// Forcing term of each equation of the variation.
    pub equations: [LaneVector; 3],
}

/// Change of the head's position along the sweep at a few instants, m, and its first two derivatives in time.
pub(crate) type HeadMotionChange = [LaneVector; 3];

/// Forcing terms of a change, before the effects of these terms on each other are added.
#[derive(Default)]
struct DirectForcing {
    effect: ForcingTerms,
    /// Term in the equation of each link, divided by the cosine of the link's angle.
    links: [LaneVector; 2],
    drop_acceleration: LaneVector,
}

impl ForcingTerms {
    /// Sum of the products of these terms with the factors in a linear form.
    pub(crate) fn dot(&self, factors: &Self) -> LaneVector {
        let numbers = |e: &Self| {
            let ([t_0, t_1, t_2], [e_0, e_1, e_2]) = (e.tip, e.equations);
            [e.head, t_0, t_1, t_2, e.drop, e.normal, e.force, e_0, e_1, e_2]
        };
        let products = numbers(self).into_iter().zip(numbers(factors));
        products.fold(LaneVector::ZERO, |sum, (a, b)| sum + a * b)
    }
}

impl<const K: usize> ReferenceMotion<'_, K> {
    /// Whether the motion depends on a constant of the linkage in the present mode of contact.
    pub(crate) fn depends_on(&self, constant: LinkageConstant) -> bool {
        match constant {
            LinkageConstant::FrictionA
            | LinkageConstant::FrictionB
            | LinkageConstant::FrictionC
            | LinkageConstant::FrictionExponent
            | LinkageConstant::ViscousFriction => matches!(self.touch, ContactMode::Slip(_)),
            LinkageConstant::BackwardRatio => self.touch.slip_direction() < 0.0,
            LinkageConstant::StaticRatio => false,
            LinkageConstant::ContactAngle
            | LinkageConstant::ShoulderStiffness
            | LinkageConstant::ShoulderDamping => self.lean != ShoulderContact::Off,
            _ => true,
        }
    }

    /// Forcing terms of a unit change of a constant of the linkage.
    #[inline(always)]
    pub(crate) fn constant_forcing(&self, at: &MotionSamples, constant: LinkageConstant) -> ForcingTerms {
        let mut direct = DirectForcing::default();
        if let Some(force) = self.friction_law_forcing(at, constant) {
            // (a shortcut: these constants change only the friction force, and fits often vary several)
            direct.effect.force = force;
            let l = self.lengths();
            direct.effect.equations[0] = -l[0] * direct.effect.force;
            direct.effect.equations[1] = -l[1] * direct.effect.force;
            return direct.effect;
        }
        self.add_direct_forcing(&mut direct, at, constant);
        self.complete_forcing(at, direct)
    }

    /// Whether a change of a constant displaces tip or head at constant angles, so that the
    /// [`Self::displacement_terms`] are not zero.
    pub(crate) fn displaces_points(&self, constant: LinkageConstant) -> bool {
        matches!(constant, LinkageConstant::Length(_))
    }

    /// Displacements of tip and head by a unit change of a constant at constant angles; the terms of forces
    /// are zero.
    pub(crate) fn displacement_terms(&self, at: &LinkAttitudes, constant: LinkageConstant) -> ForcingTerms {
        let mut effect = ForcingTerms::default();
        if let LinkageConstant::Length(j) = constant {
            (effect.tip[0], effect.tip[1]) = (at.sin[j], at.cos[j] * at.rate[j]);
            effect.drop = LaneVector::splat(1.0) - at.cos[j];
        }
        effect
    }

    /// Forcing terms of a change of the head's motion.
    #[inline(always)]
    pub(crate) fn head_motion_forcing(&self, at: &MotionSamples, shift: &HeadMotionChange) -> ForcingTerms {
        let m = self.moments();
        let effect = ForcingTerms { head: shift[0], tip: *shift, ..ForcingTerms::default() };
        let links = lanes_per_link(|i| m[i] * shift[2]);
        self.complete_forcing(at, DirectForcing { effect, links, ..DirectForcing::default() })
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

    /// Adds the forcing terms of the springs and dampers of the links.
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

    /// Derivative of the friction force in slip with respect to a constant of the friction law; `None` for
    /// another constant.
    #[inline(always)]
    fn friction_law_forcing(&self, at: &MotionSamples, constant: LinkageConstant) -> Option<LaneVector> {
        let (direction, law) = (self.touch.slip_direction(), &self.linkage.friction);
        let factor = -direction * law.direction_factor(direction);
        Some(match constant {
            LinkageConstant::FrictionA => factor * at.normal * self.friction_decay(at, direction),
            LinkageConstant::FrictionB => self.sample_tip_velocity(at.x) * at.falling,
            LinkageConstant::FrictionC => factor * at.normal,
            LinkageConstant::FrictionExponent => {
                (factor * law.a) * at.normal * self.sample_varying_part(at, direction, 2)
            }
            LinkageConstant::ViscousFriction => {
                (direction * factor) * at.normal * self.sample_tip_velocity(at.x)
            }
            LinkageConstant::BackwardRatio => (1.0 / law.backward_ratio) * at.friction,
            _ => return None,
        })
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
