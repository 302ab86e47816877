//! The paper's scheme, for comparison: classical Runge-Kutta with fixed steps on all four states. Stick is
//! the constraint `Phi = v3 - alpha = 0` on accelerations, stabilised after Baumgarte (Comp. Meth. Appl.
//! Mech. Eng. 1, 1972),
//!
//! ```text
//! Phi'' + 2 a Phi' + b^2 Phi = 0,   a = b
//! ```
//!
//! Transitions happen at the end of a step or are located by the slack variable method. The paper states
//! neither the step nor the gain.

use super::phases::{ContactInstant, DrivenBlade, GUARDS, TipForces, apply_friction, pose_from_states};
use crate::model::shoulder::ShoulderContact;
use crate::model::{LinkDirections, Pose};
use hybrid_ode::HybridPhase;
pub(crate) use hybrid_ode::fixed_step::FixedStepLocator;
use hybrid_ode::fixed_step::FixedStepOptions;

/// Default gain of the stabilisation, 1/s: a drift of the tip decays within 0.1 ms, a tenth of a stick-slip
/// cycle.
pub(crate) const DEFAULT_GAIN_PER_S: f64 = 1e4;
/// Largest stable product of gain and step for the double pole at `-a` (Hairer and Wanner, "Solving Ordinary
/// Differential Equations II", section IV.2).
pub(crate) const LARGEST_GAIN_TIMES_STEP: f64 = 2.785;

/// Settings of the paper's fixed-step scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedStepScheme {
    /// Length of a step, s.
    pub step_s: f64,
    /// Method of locating transitions.
    pub locate: FixedStepLocator,
    /// Gains `a = b` of the stabilisation of stick, 1/s. If the gain is zero, the tip's remaining velocity is
    /// set to zero at the transition, because it would not decay in stick.
    pub gain_per_s: f64,
}

impl FixedStepScheme {
    /// Settings of the fixed-step integrator.
    pub(crate) fn integrator_options(&self) -> FixedStepOptions {
        FixedStepOptions { step_s: self.step_s, locate: self.locate }
    }
}

/// Stick in which the stabilisation returns the tip to `place_m`; the states are `(theta, phi, theta_rate,
/// phi_rate)`, and the guards are those of [`super::phases::StickPhase`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct StabilisedStickPhase<'a> {
    /// The blade on its drive.
    pub system: &'a DrivenBlade,
    /// Target position of the tip, `alpha`, m.
    pub place_m: f64,
    /// Side of the shoulder on which the neck leans.
    pub lean: ShoulderContact,
    /// Gains of the stabilisation, 1/s.
    pub gain_per_s: f64,
}

impl<'a> StabilisedStickPhase<'a> {
    /// Stick that holds the tip at the position that it has in `pose`.
    pub(crate) fn from_pose(
        system: &'a DrivenBlade,
        t: f64,
        pose: &Pose,
        lean: ShoulderContact,
        gain_per_s: f64,
    ) -> Self {
        let (d, head) = (LinkDirections::from_pose(pose), system.drive.motion_at(t));
        let place_m = system.linkage.tip_position_m(&d, &head);
        Self { system, place_m, lean, gain_per_s }
    }

    /// Forces on the tip that return it to its target position; the friction force `f` satisfies
    /// `a_free + kappa * f = -2 * a * Phi' - a^2 * Phi`.
    #[inline]
    pub(super) fn stabilised_forces(&self, pose: &Pose, at: &ContactInstant) -> TipForces {
        let ContactInstant { head, directions, contact } = at;
        let (linkage, gain) = (&self.system.linkage, self.gain_per_s);
        let drift = linkage.tip_position_m(directions, head) - self.place_m;
        let wanted = -gain * (2.0 * linkage.tip_velocity_m_per_s(pose, directions, head) + gain * drift);
        let friction = (wanted - contact.a_free) / contact.kappa;
        apply_friction(contact, friction, contact.n_free + contact.nu * friction, 1.0)
    }
}

impl HybridPhase<4, GUARDS> for StabilisedStickPhase<'_> {
    #[inline]
    fn derivative(&self, t: f64, y: &[f64; 4]) -> [f64; 4] {
        let pose = pose_from_states(y);
        let forces = self.stabilised_forces(&pose, &self.system.contact_instant(t, &pose, self.lean));
        [y[2], y[3], forces.accelerations[0], forces.accelerations[1]]
    }

    #[inline]
    fn guards(&self, t: f64, y: &[f64; 4]) -> [f64; GUARDS] {
        let pose = pose_from_states(y);
        let at = self.system.contact_instant(t, &pose, self.lean);
        let forces = self.stabilised_forces(&pose, &at);
        let [forwards, backwards] = self.system.static_limits();
        let [forward, backward] = self.system.corner_distances(y[0], self.lean);
        let LinkDirections { cos_theta, cos_phi, .. } = at.directions;
        let TipForces { friction_n: force, normal_n: normal, .. } = forces;
        let limits = [forwards * normal + force, backwards * normal - force];
        [limits[0], limits[1], normal, forward, backward, cos_theta, cos_phi, f64::INFINITY]
    }

    fn scale(&self) -> [f64; 4] {
        let DrivenBlade { angle_scale, rate_scale, .. } = *self.system;
        [angle_scale, angle_scale, rate_scale, rate_scale]
    }
}
