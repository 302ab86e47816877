//! Errors that the steps of a run add to its state: the terms of the Taylor series that a step leaves out,
//! and rounding.

use super::seeds::{ROUNDING_LANE, TRUNCATION_LANE};
use crate::model::Pose;
use crate::model::series::ContactMode;
use crate::model::shoulder::ShoulderContact;
use crate::model::tangent::StateTangent;
use crate::simulate::phases::{DrivenBlade, TaylorMotion};
use portable_math as math;

/// A step of the run: contact, start and length, s, and the series that it uses.
pub(super) struct ErrorStep<'a> {
    pub touch: ContactMode,
    pub lean: ShoulderContact,
    pub start_s: f64,
    pub length_s: f64,
    pub motion: &'a TaylorMotion,
    /// Index of the link whose state is integrated in stick; the angle of the other one follows.
    pub leader: Option<usize>,
}

impl ErrorStep<'_> {
    /// Errors of the state at the end of the step, computed minus exact.
    ///
    /// Truncation: the next two terms of the series, of which the second is usually far smaller. Rounding: a
    /// unit in the last place of every state and of its scale, with a pseudo-random sign. `longer` is a
    /// workspace.
    pub(super) fn state_errors(&self, system: &DrivenBlade, longer: &mut TaylorMotion) -> StateTangent {
        /// Number of terms beyond the step's own.
        const MORE: usize = 2;
        let Self { touch, lean, start_s, length_s: h, motion, leader } = *self;
        // stick expands one order more than its states use
        let used = motion.order - usize::from(touch == ContactMode::Stick);
        let ([theta, phi], [theta_rate, phi_rate]) = (motion.angle[0], motion.rate[0]);
        longer.law_piece = motion.law_piece;
        longer.gap_rate[0] = motion.gap_rate[0];
        let pose = Pose { theta, phi, theta_rate, phi_rate };
        system.expand_motion(start_s, &pose, touch, lean, used + MORE, longer);
        let rest = |term: &dyn Fn(usize) -> f64| {
            let beyond = (used + 1..=used + MORE).rev().fold(0.0, |sum, k| sum * h + term(k));
            (0..=used).fold(beyond, |product, _| product * h)
        };
        let mut state = StateTangent::default();
        for link in 0..2 {
            let (angle, rate) = (&mut state.angle[link], &mut state.rate[link]);
            angle[TRUNCATION_LANE] = -rest(&|k| longer.angle[k][link]);
            rate[TRUNCATION_LANE] = -rest(&|k| longer.rate[k][link]);
            angle[ROUNDING_LANE] =
                draw_rounding(motion.angle[0][link].abs() + system.angle_scale, start_s, 2 * link);
            rate[ROUNDING_LANE] =
                draw_rounding(motion.rate[0][link].abs() + system.rate_scale, start_s, 2 * link + 1);
        }
        if let ContactMode::Flight(..) = touch {
            state.gap_m[TRUNCATION_LANE] = -rest(&|k| longer.gap_rate[k - 1] / k as f64);
            state.gap_rate[TRUNCATION_LANE] = -rest(&|k| longer.gap_rate[k]);
            let length_m = system.linkage.l1_m + system.linkage.l2_m;
            state.gap_m[ROUNDING_LANE] = draw_rounding(length_m * system.angle_scale, start_s, 4);
            state.gap_rate[ROUNDING_LANE] = draw_rounding(length_m * system.rate_scale, start_s, 5);
        }
        if let Some(leader) = leader {
            self.hold_tip(system, leader, &mut state);
        }
        state
    }

    /// Sets the errors of the link that follows in stick so that the tip does not move.
    fn hold_tip(&self, system: &DrivenBlade, leader: usize, state: &mut StateTangent) {
        let (follower, motion) = (1 - leader, self.motion);
        let at_end = |row: &[[f64; 2]], i: usize| {
            row[..=motion.order].iter().rev().fold(0.0, |sum, c| sum * self.length_s + c[i])
        };
        let (angle, rate) =
            ([0, 1].map(|i| at_end(&motion.angle, i)), [0, 1].map(|i| at_end(&motion.rate, i)));
        let (cos, sin) = (angle.map(math::cos), angle.map(math::sin));
        let lengths = [system.linkage.l1_m, system.linkage.l2_m];
        let share = lengths[leader] / lengths[follower];
        for lane in [TRUNCATION_LANE, ROUNDING_LANE] {
            let (d_angle, d_rate) = (state.angle[leader][lane], state.rate[leader][lane]);
            let follows = -share * cos[leader] * d_angle / cos[follower];
            let turned = cos[leader] * d_rate - sin[leader] * rate[leader] * d_angle;
            state.angle[follower][lane] = follows;
            state.rate[follower][lane] =
                (sin[follower] * rate[follower] * follows - share * turned) / cos[follower];
        }
    }
}

/// One unit in the last place of a number of this size; the sign is a hash of the bits of the time.
fn draw_rounding(size: f64, time_s: f64, which: usize) -> f64 {
    let mixed = (time_s.to_bits() ^ ((which as u64) << 56)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let sign = if mixed >> 63 == 0 { 1.0 } else { -1.0 };
    sign * f64::EPSILON * size
}
