//! Flight of the blade as a smooth phase with guards: no contact forces, ended by the tip's landing.

use super::phases::{GUARDS, System};
use crate::blade::flight::Airborne;
use crate::blade::shoulder::Lean;
use crate::blade::{Directions, Pose};
use crate::ode::Phase;

/// The gap falls to zero. The guards of shoulder and level are those of the phases of contact; the rest do not apply.
pub const LANDS: usize = 0;

/// The tip is off the glass; states `(theta, phi, gap, theta_rate, phi_rate, gap_rate)`.
#[derive(Debug, Clone, Copy)]
pub struct Flight<'a> {
    /// The blade on its drive.
    pub system: &'a System,
    /// Side of the shoulder.
    pub lean: Lean,
}

/// The state behind the six numbers.
#[inline]
#[must_use]
pub fn airborne_of(y: &[f64; 6]) -> Airborne {
    Airborne { pose: Pose { theta: y[0], phi: y[1], theta_rate: y[3], phi_rate: y[4] }, gap_m: y[2], gap_rate_m_per_s: y[5] }
}

/// The six numbers of a state.
#[must_use]
pub fn states_of(state: &Airborne) -> [f64; 6] {
    let Airborne { pose, gap_m, gap_rate_m_per_s } = *state;
    [pose.theta, pose.phi, gap_m, pose.theta_rate, pose.phi_rate, gap_rate_m_per_s]
}

impl Phase<6, GUARDS> for Flight<'_> {
    #[inline]
    fn derivative(&self, t: f64, y: &[f64; 6]) -> [f64; 6] {
        let state = airborne_of(y);
        let accelerations = self.system.linkage.flight(&state, &Directions::of(&state.pose), &self.system.drive.at(t), self.lean);
        [y[3], y[4], y[5], accelerations.links[0], accelerations.links[1], accelerations.gap_m_per_s2]
    }

    #[inline]
    fn guards(&self, _: f64, y: &[f64; 6]) -> [f64; GUARDS] {
        let [forward, backward] = self.system.corners(y[0], self.lean);
        [y[2], f64::INFINITY, f64::INFINITY, forward, backward, y[0].cos(), y[1].cos()]
    }

    fn scale(&self) -> [f64; 6] {
        let System { angle_scale, rate_scale, linkage, .. } = self.system;
        let length = linkage.l1_m + linkage.l2_m;
        [*angle_scale, *angle_scale, length * angle_scale, *rate_scale, *rate_scale, length * rate_scale]
    }
}
