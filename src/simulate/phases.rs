//! Slip and stick as smooth phases with guards.

use super::drive::Drive;
use super::mode::TipMode;
use crate::model::friction::FrictionShape;
use crate::model::series::{ContactMode, MotionSeries};
use crate::model::shoulder::ShoulderContact;
use crate::model::{FrictionResponse, HeadMotion, LinkDirections, Linkage, Pose};
use hybrid_ode::HybridPhase;
use hybrid_ode::polynomial::TERMS;
use hybrid_ode::taylor::{TaylorExpansion, TaylorPhase};
use portable_math as math;

/// Number of guards of a phase. A guard is a function of time and state; the phase ends when one falls to
/// zero.
pub const GUARDS: usize = 8;
/// Indices of the two guards of the neck's angle in all phases: the neck meets or leaves the forward or the
/// backward side of the shoulder.
pub(crate) const SHOULDER_GUARDS: [usize; 2] = [3, 4];
/// Indices of the guards of neck and lip in all phases; a guard falls to zero when its link is level. Past
/// level, the hinge would be below the glass.
pub(crate) const LEVEL_GUARDS: [usize; 2] = [5, 6];

/// Index of a guard of slip: the tip's speed in the direction of slip falls to the start of the piece of the
/// friction law. If the piece starts at zero speed, the tip stops.
pub(crate) const TIP_STOPS: usize = 0;
/// Index of a guard of slip: the normal force reaches zero.
pub const SLIP_CONTACT_LOST: usize = 1;
/// Index of a guard of slip: the Painlevé indicator reaches zero.
pub const JAMS: usize = 2;
/// Index of a guard of slip: the tip's speed in the direction of slip rises to the end of the piece of the
/// friction law.
pub(crate) const LAW_PIECE_ENDS: usize = 7;
/// Index of a guard of stick: the holding force reaches the static friction limit, and the tip starts to slip
/// towards +v.
pub(crate) const FORWARD_LIMIT: usize = 0;
/// Index of a guard of stick: the holding force reaches the static friction limit, and the tip starts to slip
/// towards -v.
pub(crate) const BACKWARD_LIMIT: usize = 1;
/// Index of a guard of stick: the normal force reaches zero.
pub(crate) const STICK_CONTACT_LOST: usize = 2;

/// A blade and its drive, with scales of angle and angular rate; for values below these scales, the tolerance
/// is absolute instead of relative.
#[derive(Debug, Clone)]
pub struct DrivenBlade {
    /// The blade.
    pub linkage: Linkage,
    /// The head's motion.
    pub drive: Drive,
    /// Angle below which the tolerance is absolute, rad.
    pub angle_scale: f64,
    /// Angular rate below which the tolerance is absolute, rad/s.
    pub rate_scale: f64,
}

/// Motion of the head, directions of the links, and response of the blade to friction at one instant.
pub(super) struct ContactInstant {
    pub head: HeadMotion,
    pub directions: LinkDirections,
    pub contact: FrictionResponse,
}

impl DrivenBlade {
    #[inline]
    pub(super) fn contact_instant(&self, t: f64, pose: &Pose, lean: ShoulderContact) -> ContactInstant {
        let (directions, head) = (LinkDirections::from_pose(pose), self.drive.motion_at(t));
        let contact = self.linkage.friction_response(pose, &directions, &head, lean);
        ContactInstant { head, directions, contact }
    }

    /// Largest friction coefficients at rest before the tip slips towards +v and towards -v.
    #[inline]
    pub(super) fn static_limits(&self) -> [f64; 2] {
        [1.0, -1.0].map(|direction| self.linkage.friction.static_coefficient(direction))
    }

    /// Guards of the two corners of the shoulder (the neck angles at which contact with the shoulder starts
    /// or ends), rad; a guard is positive while the neck stays on its side of the corner.
    #[inline]
    pub(super) fn corner_distances(&self, theta: f64, lean: ShoulderContact) -> [f64; 2] {
        match (&self.linkage.shoulder, lean) {
            (None, _) => [f64::INFINITY; 2],
            (Some(s), ShoulderContact::Off) => [s.contact_angle_rad - theta, s.contact_angle_rad + theta],
            (Some(s), ShoulderContact::Forward) => [theta - s.contact_angle_rad, f64::INFINITY],
            (Some(s), ShoulderContact::Backward) => [f64::INFINITY, -theta - s.contact_angle_rad],
        }
    }

    /// Computes Taylor coefficients of the blade's motion about `t`.
    #[inline]
    pub(super) fn expand_motion(
        &self,
        t: f64,
        pose: &Pose,
        touch: ContactMode,
        lean: ShoulderContact,
        order: usize,
        motion: &mut TaylorMotion,
    ) {
        self.drive.velocity_series(t, &mut motion.head_velocity[..=order]);
        motion.expand(&self.linkage, touch, lean, pose, order);
    }

    /// Factors of the neck's angle in the guards of both corners, +1 or -1; 0 for a corner that does not
    /// apply.
    pub(super) fn corner_signs(&self, lean: ShoulderContact) -> [f64; 2] {
        match (&self.linkage.shoulder, lean) {
            (None, _) => [0.0, 0.0],
            (_, ShoulderContact::Off) => [-1.0, 1.0],
            (_, ShoulderContact::Forward) => [1.0, 0.0],
            (_, ShoulderContact::Backward) => [0.0, -1.0],
        }
    }
}

/// Taylor coefficients of the blade's motion, one order higher than the states need, because forces are known
/// to one order less.
pub(crate) type TaylorMotion = MotionSeries<{ TERMS + 2 }>;
/// Taylor coefficients of the `N` states and of the guards.
pub(super) type GuardedExpansion<const N: usize> = TaylorExpansion<N, GUARDS>;

/// Forces on the tip and the angular accelerations that they cause.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TipForces {
    /// Friction force on the tip, N.
    pub friction_n: f64,
    /// Normal force on the tip, N.
    pub normal_n: f64,
    /// Painlevé indicator of slip, `1 + sigma * mu * nu`; 1 in stick.
    pub indicator: f64,
    /// Angular accelerations of neck and lip, rad/s^2.
    pub accelerations: [f64; 2],
}

/// The phase of slip in one direction; the states are `(theta, phi, theta_rate, phi_rate)`.
#[derive(Debug, Clone, Copy)]
pub struct SlipPhase<'a> {
    /// The blade on its drive.
    pub system: &'a DrivenBlade,
    /// Direction of slip, +1 or -1.
    pub direction: f64,
    /// Side of the shoulder on which the neck leans.
    pub lean: ShoulderContact,
    /// Piece of the friction law.
    pub piece: usize,
}

/// Pose from the four states of slip.
#[inline]
pub(crate) fn pose_from_states(y: &[f64; 4]) -> Pose {
    Pose { theta: y[0], phi: y[1], theta_rate: y[2], phi_rate: y[3] }
}

impl SlipPhase<'_> {
    /// Speed of the tip in the direction of slip, m/s, and the forces on the tip: the friction force
    /// `f = -sigma * mu * N` with the normal force `N = n_free / (1 + sigma * mu * nu)`.
    #[inline]
    pub(super) fn slip_forces(&self, pose: &Pose, at: &ContactInstant) -> (f64, TipForces) {
        let speed = self.direction * self.system.linkage.tip_velocity_m_per_s(pose, &at.directions, &at.head);
        let law = &self.system.linkage.friction;
        let mu = self.direction * law.dynamic_coefficient(speed, self.direction);
        let indicator = 1.0 + mu * at.contact.nu;
        let normal_n = at.contact.n_free / indicator;
        (speed, apply_friction(&at.contact, -mu * normal_n, normal_n, indicator))
    }
}

#[inline]
pub(super) fn apply_friction(
    contact: &FrictionResponse,
    friction_n: f64,
    normal_n: f64,
    indicator: f64,
) -> TipForces {
    let acceleration = |i: usize| contact.free[i] + friction_n * contact.per_force[i];
    TipForces { friction_n, normal_n, indicator, accelerations: [acceleration(0), acceleration(1)] }
}

impl HybridPhase<4, GUARDS> for SlipPhase<'_> {
    #[inline]
    fn derivative(&self, t: f64, y: &[f64; 4]) -> [f64; 4] {
        let pose = pose_from_states(y);
        let (_, forces) = self.slip_forces(&pose, &self.system.contact_instant(t, &pose, self.lean));
        [y[2], y[3], forces.accelerations[0], forces.accelerations[1]]
    }

    #[inline]
    fn guards(&self, t: f64, y: &[f64; 4]) -> [f64; GUARDS] {
        let pose = pose_from_states(y);
        let at = self.system.contact_instant(t, &pose, self.lean);
        let (speed, forces) = self.slip_forces(&pose, &at);
        let [forward, backward] = self.system.corner_distances(y[0], self.lean);
        let LinkDirections { cos_theta, cos_phi, .. } = at.directions;
        // `n_free` has the sign of the normal force, but no pole where the indicator is zero
        let [from, to] = self.system.linkage.friction.piece_ends_m_per_s(self.piece);
        [speed - from, at.contact.n_free, forces.indicator, forward, backward, cos_theta, cos_phi, to - speed]
    }

    fn scale(&self) -> [f64; 4] {
        let DrivenBlade { angle_scale, rate_scale, .. } = *self.system;
        [angle_scale, angle_scale, rate_scale, rate_scale]
    }
}

impl TaylorPhase<4, GUARDS> for SlipPhase<'_> {
    type Tape = TaylorMotion;

    fn expand_series(&self, t: f64, y: &[f64; 4], motion: &mut TaylorMotion, out: &mut GuardedExpansion<4>) {
        let (pose, touch) = (pose_from_states(y), ContactMode::Slip(self.direction));
        motion.law_piece = self.piece;
        self.system.expand_motion(t, &pose, touch, self.lean, out.order, motion);
        let corners = self.system.corner_signs(self.lean);
        for k in 0..=out.order {
            let ([theta, phi], [theta_rate, phi_rate]) = (motion.angle[k], motion.rate[k]);
            let [cos_theta, cos_phi] = motion.cosines(k);
            out.states[k] = [theta, phi, theta_rate, phi_rate];
            // the indicator needs no series: the accelerations have a pole at its zero, and no step crosses a
            // pole
            let speed = self.direction * motion.tip_velocity[k];
            let [forward, backward] = corners.map(|sign| sign * theta);
            out.guards[k] = [speed, motion.normal_n(k), 0.0, forward, backward, cos_theta, cos_phi, -speed];
        }
        out.guards[0][JAMS] = motion.indicator;
        let friction = &self.system.linkage.friction;
        let [from, to] = friction.piece_ends_m_per_s(self.piece);
        out.guards[0][TIP_STOPS] -= from;
        out.guards[0][LAW_PIECE_ENDS] += to;
        let falls = friction.a > 0.0 && friction.b_s_per_m > 0.0;
        let exponent = |k: usize| friction.b_s_per_m * self.direction * motion.tip_velocity[k];
        out.exponent = match friction.shape {
            FrictionShape::Exponential if falls => Some(std::array::from_fn(exponent)),
            FrictionShape::Stribeck => Some(std::array::from_fn(|k| motion.law.argument(k))),
            _ => None,
        };
        let [forward, backward] = SHOULDER_GUARDS;
        [out.guards[0][forward], out.guards[0][backward]] = self.system.corner_distances(y[0], self.lean);
    }
}

/// The phase of stick, with the tip held at `place_m`. The states are angle and rate of the free link; the
/// other link, the follower, satisfies `l1 sin theta + l2 sin phi = place - v(t)`, so that the tip cannot
/// drift.
#[derive(Debug, Clone, Copy)]
pub struct StickPhase<'a> {
    /// The blade on its drive.
    pub system: &'a DrivenBlade,
    /// Position of the tip, `alpha`, m.
    pub place_m: f64,
    /// Side of the shoulder on which the neck leans.
    pub lean: ShoulderContact,
    /// The follower, the link whose angle follows from that of the free link: the link that moves the tip
    /// more.
    follower: Link,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Link {
    Neck,
    Lip,
}

impl<'a> StickPhase<'a> {
    /// Cosine at which the follower counts as level, 1e-3 rad before it actually is level. At level itself,
    /// the follower's rate is 0/0 and its cosine does not change sign. At 1e-3 rad before level, the state
    /// has lost about nine bits of precision.
    const LEAST_COSINE: f64 = 1e-3;

    /// Stick that holds the tip at the position that it has in `pose`; both links must be above level.
    #[must_use]
    pub fn from_pose(system: &'a DrivenBlade, t: f64, pose: &Pose, lean: ShoulderContact) -> Self {
        let directions = LinkDirections::from_pose(pose);
        let Linkage { l1_m, l2_m, .. } = system.linkage;
        let (neck, lip) = (l1_m * directions.cos_theta, l2_m * directions.cos_phi);
        let follower = if lip >= neck { Link::Lip } else { Link::Neck };
        let place_m = system.linkage.tip_position_m(&directions, &system.drive.motion_at(t));
        Self { system, place_m, lean, follower }
    }

    /// Index of the free link: 0 for the neck, 1 for the lip.
    pub(super) fn leader(&self) -> usize {
        usize::from(self.follower == Link::Neck)
    }

    /// States of a pose: angle and rate of the free link.
    #[must_use]
    pub fn free_states(&self, pose: &Pose) -> [f64; 2] {
        match self.follower {
            Link::Lip => [pose.theta, pose.theta_rate],
            Link::Neck => [pose.phi, pose.phi_rate],
        }
    }

    /// Pose and directions from the two states. The follower's angle follows from the position of the tip,
    /// its rate from the condition that the tip is at rest.
    #[inline]
    pub(super) fn full_pose(&self, head: &HeadMotion, y: &[f64; 2]) -> (Pose, LinkDirections) {
        let (l1, l2) = (self.system.linkage.l1_m, self.system.linkage.l2_m);
        let (own, other) = match self.follower {
            Link::Lip => (l1, l2),
            Link::Neck => (l2, l1),
        };
        let (sin, cos) = math::sin_cos(y[0]);
        let other_sin = (self.place_m - head.position_m - own * sin) / other;
        let other_cos = (1.0 - other_sin * other_sin).sqrt();
        let angle = math::asin(other_sin);
        let rate = -(head.velocity_m_per_s + own * cos * y[1]) / (other * other_cos);
        match self.follower {
            Link::Lip => (
                Pose { theta: y[0], phi: angle, theta_rate: y[1], phi_rate: rate },
                LinkDirections { sin_theta: sin, cos_theta: cos, sin_phi: other_sin, cos_phi: other_cos },
            ),
            Link::Neck => (
                Pose { theta: angle, phi: y[0], theta_rate: rate, phi_rate: y[1] },
                LinkDirections { sin_theta: other_sin, cos_theta: other_cos, sin_phi: sin, cos_phi: cos },
            ),
        }
    }

    /// The forces that hold the tip: the friction force `f` makes the tip acceleration `a_free + kappa * f`
    /// zero.
    #[inline]
    pub(super) fn holding_forces(&self, at: &ContactInstant) -> TipForces {
        let friction = super::mode::holding_force(&at.contact);
        apply_friction(&at.contact, friction, at.contact.n_free + at.contact.nu * friction, 1.0)
    }

    #[inline]
    pub(super) fn contact_instant(&self, t: f64, y: &[f64; 2]) -> (Pose, ContactInstant) {
        let head = self.system.drive.motion_at(t);
        let (pose, directions) = self.full_pose(&head, y);
        let contact = self.system.linkage.friction_response(&pose, &directions, &head, self.lean);
        (pose, ContactInstant { head, directions, contact })
    }
}

impl HybridPhase<2, GUARDS> for StickPhase<'_> {
    #[inline]
    fn derivative(&self, t: f64, y: &[f64; 2]) -> [f64; 2] {
        let (_, at) = self.contact_instant(t, y);
        let forces = self.holding_forces(&at);
        [y[1], forces.accelerations[self.leader()]]
    }

    #[inline]
    fn guards(&self, t: f64, y: &[f64; 2]) -> [f64; GUARDS] {
        let (pose, at) = self.contact_instant(t, y);
        let forces = self.holding_forces(&at);
        let [forwards, backwards] = self.system.static_limits();
        let (normal, force) = (forces.normal_n, forces.friction_n);
        let [forward, backward] = self.system.corner_distances(pose.theta, self.lean);
        let LinkDirections { cos_theta, cos_phi, .. } = at.directions;
        let [neck, lip] = match self.follower {
            Link::Lip => [cos_theta, cos_phi - Self::LEAST_COSINE],
            Link::Neck => [cos_theta - Self::LEAST_COSINE, cos_phi],
        };
        // the force that prevents forward slip points backward
        let limits = [forwards * normal + force, backwards * normal - force];
        [limits[0], limits[1], normal, forward, backward, neck, lip, f64::INFINITY]
    }

    fn scale(&self) -> [f64; 2] {
        [self.system.angle_scale, self.system.rate_scale]
    }
}

impl TaylorPhase<2, GUARDS> for StickPhase<'_> {
    type Tape = TaylorMotion;

    fn expand_series(&self, t: f64, y: &[f64; 2], motion: &mut TaylorMotion, out: &mut GuardedExpansion<2>) {
        let (pose, _) = self.full_pose(&self.system.drive.motion_at(t), y);
        self.system.expand_motion(t, &pose, ContactMode::Stick, self.lean, out.order + 1, motion);
        let leader = self.leader();
        let follower = 1 - leader;
        let corners = self.system.corner_signs(self.lean);
        let [forwards, backwards] = self.system.static_limits();
        for k in 0..=out.order {
            let (theta, [cos_theta, cos_phi]) = (motion.angle[k][0], motion.cosines(k));
            let (normal, force) = (motion.normal_n(k), motion.friction_n[k]);
            let [forward, backward] = corners.map(|sign| sign * theta);
            let limits = [forwards * normal + force, backwards * normal - force];
            out.states[k] = [motion.angle[k][leader], motion.rate[k][leader]];
            out.guards[k] = [limits[0], limits[1], normal, forward, backward, cos_theta, cos_phi, 0.0];
        }
        out.guards[0][LAW_PIECE_ENDS] = f64::INFINITY;
        let [forward, backward] = SHOULDER_GUARDS;
        [out.guards[0][forward], out.guards[0][backward]] =
            self.system.corner_distances(pose.theta, self.lean);
        out.guards[0][LEVEL_GUARDS[follower]] -= Self::LEAST_COSINE;
        let DrivenBlade { angle_scale, rate_scale, .. } = *self.system;
        let angle = angle_scale.max(motion.angle[0][follower].abs());
        let rate = rate_scale.max(motion.rate[0][follower].abs());
        out.followers = [out.order - 1, out.order]
            .map(|k| (motion.angle[k][follower].abs() / angle).max(motion.rate[k][follower].abs() / rate));
    }
}

/// Mode that follows when a guard of stick falls to zero; `None` unless the guard is a friction limit.
pub(crate) fn mode_after_release(guard: usize) -> Option<TipMode> {
    match guard {
        FORWARD_LIMIT => Some(TipMode::SlipForward),
        BACKWARD_LIMIT => Some(TipMode::SlipBackward),
        _ => None,
    }
}
