//! Derivatives of guards, and of impacts with respect to the state before them.

use super::seeds::{BlockSeed, DIFFERENCE_STEP, central_difference};
use super::stretch::{SeriesReference, TangentStretch};
use super::tangent_blocks::TangentBlocks;
use super::tangent_segment::{Channel, ChannelWeights, DerivativeSum};
use crate::model::shoulder::ShoulderContact;
use crate::model::tangent::{LANES, LaneVector, StateTangent};
use crate::model::{HeadMotion, LinkDirections, Linkage, Pose};
use crate::simulate::event_loop::TipStrike;
use crate::simulate::flight::LANDING;
use crate::simulate::mode::TipMode;
use crate::simulate::phases::{
    BACKWARD_LIMIT, DrivenBlade, FORWARD_LIMIT, SHOULDER_GUARDS, SLIP_CONTACT_LOST, STICK_CONTACT_LOST,
    TIP_STOPS, TaylorMotion,
};
use hybrid_ode::WorkCounters;

/// A guard at a time of a stretch, at which it is zero or has a minimum.
#[derive(Clone, Copy)]
pub(super) struct GuardInstant<'a> {
    pub mode: TipMode,
    pub guard: usize,
    /// Time from the start of the motion's series, s.
    pub x: f64,
    pub span: &'a TangentStretch<'a>,
}

/// Rate of change of a guard, per s.
#[derive(Debug, Clone, Copy)]
pub(super) struct GuardSlope {
    pub rate: f64,
    /// Sum of the absolute values of the terms of the rate; if the rate is far smaller, the guard grazes
    /// zero.
    pub size: f64,
}

/// A term of a guard: a channel and its factor.
type GuardTerm = (Channel, f64);

impl GuardInstant<'_> {
    /// Terms of the guard; no terms for a guard without a derivative.
    fn guard_terms(&self) -> [Option<GuardTerm>; 2] {
        let TangentStretch { system, course, .. } = self.span;
        let [forwards, backwards] = system.static_limits().map(|limit| Some((Channel::NormalForce, limit)));
        if let Some(side) = SHOULDER_GUARDS.iter().position(|&corner| corner == self.guard) {
            return [Some((Channel::NeckAngle, system.corner_signs(course.lean)[side])), None];
        }
        match (self.mode, self.guard) {
            (TipMode::Flight, LANDING) => [Some((Channel::TipHeight, 1.0)), None],
            (TipMode::SlipForward | TipMode::SlipBackward, TIP_STOPS) => {
                [Some((Channel::TipVelocity, self.mode.direction())), None]
            }
            (TipMode::SlipForward | TipMode::SlipBackward, SLIP_CONTACT_LOST)
            | (TipMode::Stick, STICK_CONTACT_LOST) => [Some((Channel::NormalForce, 1.0)), None],
            (TipMode::Stick, FORWARD_LIMIT) => [forwards, Some((Channel::FrictionForce, 1.0))],
            (TipMode::Stick, BACKWARD_LIMIT) => [backwards, Some((Channel::FrictionForce, -1.0))],
            _ => [None; 2],
        }
    }

    /// Rate of the guard, with the sum of the absolute terms of the rate; `None` for a guard without a
    /// derivative.
    pub(crate) fn guard_slope(&self) -> Option<GuardSlope> {
        let (terms, motion) = (self.guard_terms(), self.span.course.motion);
        terms[0]?;
        let (mut slope, mut power) = (GuardSlope { rate: 0.0, size: 0.0 }, 1.0);
        for k in 1..=motion.order {
            let coefficient = |(channel, factor): GuardTerm| {
                factor
                    * match channel {
                        Channel::TipVelocity => motion.tip_velocity[k],
                        Channel::NormalForce => motion.normal_n(k),
                        Channel::FrictionForce => motion.friction_n[k],
                        Channel::NeckAngle => motion.angle[k][0],
                        _ => motion.gap_rate[k - 1] / k as f64,
                    }
            };
            let sum: f64 = terms.into_iter().flatten().map(coefficient).sum();
            slope.rate += k as f64 * sum * power;
            slope.size += (k as f64 * sum * power).abs();
            power *= self.x;
        }
        Some(slope)
    }

    /// The guard at a minimum between its own time and `end`, s from the start of the motion's series; `None`
    /// unless the guard falls at the first of these times and rises at the second.
    pub(super) fn next_minimum(self, end: f64) -> Option<Self> {
        /// Halvings of the interval: the value at a minimum hardly depends on its time.
        const HALVINGS: usize = 20;
        let at = |x: f64| Self { x, ..self };
        let rises = |x: f64| at(x).guard_slope().is_some_and(|slope| slope.rate > 0.0);
        if self.guard_slope()?.rate >= 0.0 || !rises(end) {
            return None;
        }
        let (mut falling, mut rising) = (self.x, end);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (falling + rising);
            if rises(middle) { rising = middle } else { falling = middle }
        }
        Some(at(falling))
    }

    /// Value of the guard along a series about the start of the step, which may have more terms than that of
    /// the step. `None` for a landing and for a guard without a derivative.
    pub(super) fn value_along(&self, longer: &TaylorMotion) -> Option<f64> {
        let (terms, TangentStretch { system, course, .. }) = (self.guard_terms(), self.span);
        let mut sum = 0.0;
        for (channel, factor) in terms.into_iter().flatten() {
            let series: &dyn Fn(usize) -> f64 = match channel {
                Channel::TipVelocity => &|k| longer.tip_velocity[k],
                Channel::NormalForce => &|k| longer.normal_n(k),
                Channel::FrictionForce => &|k| longer.friction_n[k],
                Channel::NeckAngle => &|k| longer.angle[k][0],
                _ => return None,
            };
            // forces are known to one order less
            sum += factor * (0..longer.order).rev().fold(0.0, |sum, k| sum * self.x + series(k));
        }
        let constant = match terms[0]?.0 {
            Channel::TipVelocity => -system.linkage.friction.piece_ends_m_per_s(longer.law_piece)[0],
            Channel::NeckAngle => {
                let side = SHOULDER_GUARDS.iter().position(|&corner| corner == self.guard)?;
                let (theta, sign) = (longer.angle[0][0], system.corner_signs(course.lean)[side]);
                system.corner_distances(theta, course.lean)[side] - sign * theta
            }
            _ => 0.0,
        };
        Some(sum + constant)
    }

    /// Sets the derivatives of the guard with respect to all directions.
    pub(crate) fn set_guard_derivatives(&self, blocks: &mut TangentBlocks<'_>) {
        let SeriesReference { motion, lean, .. } = self.span.course;
        let weights = ChannelWeights::at_time(self.x, motion.order);
        let terms = self.guard_terms();
        let sums = terms.map(|term| {
            term.map(|(channel, factor)| (DerivativeSum::new(self.span, channel, &weights), factor))
        });
        let normal: f64 = (0..=motion.order).rev().fold(0.0, |sum, k| sum * self.x + motion.normal_n(k));
        for (block, seed) in blocks.iter_with_seeds() {
            block.guard = LaneVector::ZERO;
            for (sum, factor) in sums.iter().flatten() {
                let row = sum.block_derivatives(block, seed);
                block.guard.add_scaled(*factor, &row);
            }
            let Some(own) = &seed.linkage else { continue };
            match terms[0] {
                // the guards of both corners contain the contact angle, with a plus sign while the neck is
                // off the shoulder and a minus sign while it leans on it
                Some((Channel::NeckAngle, _)) if lean == ShoulderContact::Off => {
                    block.guard += own.contact_angle_rad
                }
                Some((Channel::NeckAngle, _)) => block.guard -= own.contact_angle_rad,
                Some((Channel::NormalForce, _)) if terms[1].is_some() => {
                    let law = &self.span.system.linkage.friction;
                    let direction = if self.guard == FORWARD_LIMIT { 1.0 } else { -1.0 };
                    block.guard += normal * own.static_coefficient_change(law, direction);
                }
                _ => {}
            }
        }
    }
}

/// Data from which the derivatives of a strike are computed.
pub(super) struct StrikeTangent<'a> {
    pub system: &'a DrivenBlade,
    pub head: HeadMotion,
    pub strike: TipStrike,
}

impl StrikeTangent<'_> {
    /// Computes the derivatives of the state just after an impact from those just before it. Both are
    /// derivatives at the time of the impact, which itself varies. `d_velocity` contains the derivatives of
    /// the head's velocity at this time, m/s per unit of the direction. `None` if the derivatives do not
    /// exist.
    pub(super) fn state_after(
        &self,
        seed: &BlockSeed,
        before: &StateTangent,
        d_velocity: LaneVector,
    ) -> Option<StateTangent> {
        let mut after = StateTangent { gap_m: LaneVector::ZERO, ..*before };
        for lane in 0..LANES {
            let [neck, lip, gap] = self.lane_after(seed, before, d_velocity[lane], lane)?;
            (after.rate[0][lane], after.rate[1][lane], after.gap_rate[lane]) = (neck, lip, gap);
        }
        Some(after)
    }

    fn lane_after(
        &self,
        seed: &BlockSeed,
        before: &StateTangent,
        d_velocity: f64,
        lane: usize,
    ) -> Option<[f64; 3]> {
        /// Relative tolerance with which impacts are solved for a central difference; it is far smaller than
        /// the relative differences between these impacts.
        const TOLERANCE: f64 = 1e-14;
        let TipStrike { pose, restitution, .. } = self.strike;
        let d = [before.angle[0], before.angle[1], before.rate[0], before.rate[1]].map(|row| row[lane]);
        // an impact that closes a train of rebounds has no restitution
        let d_restitution = if restitution == 0.0 { 0.0 } else { seed.restitution[lane] };
        let d_normal = before.gap_rate[lane];
        let relative =
            self.relative_change(d, d_normal, d_velocity).max(seed.relative[lane]).max(d_restitution.abs());
        if relative == 0.0 {
            return Some([d[2], d[3], 0.0]);
        }
        central_difference(DIFFERENCE_STEP / relative, |x| {
            let (own, linkage) = (seed.linkage.as_ref(), self.system.linkage);
            let linkage = own.map_or(linkage, |own| own.displace_linkage(&linkage, lane, x));
            let pose = Pose {
                theta: pose.theta + x * d[0],
                phi: pose.phi + x * d[1],
                theta_rate: pose.theta_rate + x * d[2],
                phi_rate: pose.phi_rate + x * d[3],
            };
            let velocity_m_per_s = self.head.velocity_m_per_s + x * d_velocity;
            let (d, head) = (LinkDirections::from_pose(&pose), HeadMotion { velocity_m_per_s, ..self.head });
            let mut strike = TipStrike { pose, restitution: restitution + x * d_restitution, ..self.strike };
            strike.before.normal += x * d_normal;
            strike.before.tangential = linkage.tip_velocity_m_per_s(&pose, &d, &head);
            let (after, _) = strike.solve_on_blade(&linkage, TOLERANCE, &mut WorkCounters::default())?;
            Some([after.pose.theta_rate, after.pose.phi_rate, after.gap_rate_m_per_s])
        })
    }

    /// Largest relative change of the inputs of an impact per unit of the direction.
    fn relative_change(&self, d: [f64; 4], d_normal: f64, d_velocity: f64) -> f64 {
        let TipStrike { before, .. } = self.strike;
        let Linkage { l1_m: l1, l2_m: l2, friction, .. } = self.system.linkage;
        let speed = before.normal.abs().max(before.tangential.abs());
        let along = l1 * d[2].abs() + l2 * d[3].abs() + d_velocity.abs();
        // friction changes appreciably over a speed of `1 / b`
        let scale = if friction.b_s_per_m > 0.0 { speed.min(1.0 / friction.b_s_per_m) } else { speed };
        let normal = if d_normal == 0.0 { 0.0 } else { (d_normal / before.normal).abs() };
        d[0].abs().max(d[1].abs()).max(along / scale).max(normal)
    }
}
