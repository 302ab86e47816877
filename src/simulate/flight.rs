//! Flight as a smooth phase with guards: no contact force acts on the tip until it lands.

use super::phases::{DrivenBlade, GUARDS, GuardedExpansion, LEVEL_GUARDS, SHOULDER_GUARDS, TaylorMotion};
use crate::model::flight::FlightState;
use crate::model::series::ContactMode;
use crate::model::shoulder::ShoulderContact;
use crate::model::{LinkDirections, Pose};
use hybrid_ode::HybridPhase;
use hybrid_ode::taylor::TaylorPhase;
use portable_math as math;

/// Index of the guard of landing: the gap between tip and glass, which falls to zero. The guards of the
/// shoulder and of level links are the same as in contact; the other guards of contact do not apply.
pub(crate) const LANDING: usize = 0;

/// The phase of flight; the states are `(theta, phi, gap, theta_rate, phi_rate, gap_rate)`.
#[derive(Debug, Clone, Copy)]
pub struct FlightPhase<'a> {
    /// The blade on its drive.
    pub system: &'a DrivenBlade,
    /// Side of the shoulder on which the neck leans.
    pub lean: ShoulderContact,
}

/// State of flight from its six numbers, in the order of [`FlightPhase`].
#[inline]
pub(crate) fn flight_state_from(y: &[f64; 6]) -> FlightState {
    FlightState {
        pose: Pose { theta: y[0], phi: y[1], theta_rate: y[3], phi_rate: y[4] },
        gap_m: y[2],
        gap_rate_m_per_s: y[5],
    }
}

/// The six numbers of a state of flight, in the order of [`FlightPhase`].
#[must_use]
pub fn flight_state_vector(state: &FlightState) -> [f64; 6] {
    let FlightState { pose, gap_m, gap_rate_m_per_s } = *state;
    [pose.theta, pose.phi, gap_m, pose.theta_rate, pose.phi_rate, gap_rate_m_per_s]
}

impl HybridPhase<6, GUARDS> for FlightPhase<'_> {
    #[inline]
    fn derivative(&self, t: f64, y: &[f64; 6]) -> [f64; 6] {
        let state = flight_state_from(y);
        let (d, head) = (LinkDirections::from_pose(&state.pose), self.system.drive.motion_at(t));
        let accelerations = self.system.linkage.flight_accelerations(&state, &d, &head, self.lean);
        [y[3], y[4], y[5], accelerations.links[0], accelerations.links[1], accelerations.gap_m_per_s2]
    }

    #[inline]
    fn guards(&self, _: f64, y: &[f64; 6]) -> [f64; GUARDS] {
        let [forward, backward] = self.system.corner_distances(y[0], self.lean);
        [
            y[2],
            f64::INFINITY,
            f64::INFINITY,
            forward,
            backward,
            math::cos(y[0]),
            math::cos(y[1]),
            f64::INFINITY,
        ]
    }

    fn scale(&self) -> [f64; 6] {
        let DrivenBlade { angle_scale, rate_scale, linkage, .. } = self.system;
        let length = linkage.l1_m + linkage.l2_m;
        [*angle_scale, *angle_scale, length * angle_scale, *rate_scale, *rate_scale, length * rate_scale]
    }
}

impl TaylorPhase<6, GUARDS> for FlightPhase<'_> {
    type Tape = TaylorMotion;

    fn expand_series(&self, t: f64, y: &[f64; 6], motion: &mut TaylorMotion, out: &mut GuardedExpansion<6>) {
        let state = flight_state_from(y);
        let directions = LinkDirections::from_pose(&state.pose);
        let (drop, drop_rate) = self.system.linkage.drop_in_flight(&state, &directions);
        let touch = ContactMode::Flight(drop, drop_rate);
        self.system.expand_motion(t, &state.pose, touch, self.lean, out.order, motion);
        motion.gap_rate[0] = state.gap_rate_m_per_s;
        let corners = self.system.corner_signs(self.lean);
        let ([forward, backward], [neck, lip]) = (SHOULDER_GUARDS, LEVEL_GUARDS);
        let mut gap = state.gap_m;
        for k in 0..=out.order {
            let ([theta, phi], [theta_rate, phi_rate], gap_rate) =
                (motion.angle[k], motion.rate[k], motion.gap_rate[k]);
            out.states[k] = [theta, phi, gap, theta_rate, phi_rate, gap_rate];
            let guards = &mut out.guards[k];
            [guards[neck], guards[lip]] = motion.cosines(k);
            [guards[forward], guards[backward]] = corners.map(|sign| sign * theta);
            guards[LANDING] = gap;
            gap = gap_rate / (k + 1) as f64;
        }
        out.guards[0] = self.guards(t, y);
    }
}
