//! Slip and stick of the blade as smooth phases with guards.

use super::drive::Drive;
use super::mode::Mode;
use crate::blade::series::{MotionSeries, Touch};
use crate::blade::shoulder::Lean;
use crate::blade::{Contact, Directions, HeadMotion, Linkage, Pose};
use crate::math;
use crate::ode::Phase;
use crate::ode::polynomial::TERMS;
use crate::ode::taylor::{Expand, Expansion};

/// Number of guards of either phase.
pub const GUARDS: usize = 7;
/// Guards at the neck's angle, the same in both phases: the shoulder's forward and backward corner.
pub(crate) const SHOULDER_GUARDS: [usize; 2] = [3, 4];
/// Guards that neck and lip stay short of level, the same in both phases: beyond it the hinge would be below
/// the glass.
pub(crate) const LEVEL_GUARDS: [usize; 2] = [5, 6];

/// Slip: the tip's velocity, the normal force and the Painlevé indicator stay positive in the direction of
/// slip.
pub(crate) const TIP_STOPS: usize = 0;
/// The normal force of slip reaches zero.
pub const SLIP_CONTACT_LOST: usize = 1;
/// The Painlevé indicator reaches zero.
pub const JAMS: usize = 2;
/// Stick: the holding force reaches the static limit towards +v.
pub(crate) const FORWARD_LIMIT: usize = 0;
/// Stick: the holding force reaches the static limit towards -v.
pub(crate) const BACKWARD_LIMIT: usize = 1;
/// The normal force of stick reaches zero.
pub(crate) const STICK_CONTACT_LOST: usize = 2;

/// A blade on its drive, with the magnitudes below which errors are absolute.
#[derive(Debug, Clone)]
pub struct System {
    /// The blade.
    pub linkage: Linkage,
    /// The head's motion.
    pub drive: Drive,
    /// Angle below which its error is absolute, rad.
    pub angle_scale: f64,
    /// Angular rate below which its error is absolute, rad/s.
    pub rate_scale: f64,
}

/// Everything about one instant that forces need.
pub(super) struct Instant {
    pub head: HeadMotion,
    pub directions: Directions,
    pub contact: Contact,
}

impl System {
    #[inline]
    pub(super) fn instant(&self, t: f64, pose: &Pose, lean: Lean) -> Instant {
        self.instant_with(t, pose, Directions::of(pose), lean)
    }

    #[inline]
    fn instant_with(&self, t: f64, pose: &Pose, directions: Directions, lean: Lean) -> Instant {
        let head = self.drive.at(t);
        let contact = self.linkage.contact(pose, &directions, &head, lean);
        Instant { head, directions, contact }
    }

    /// Distances to the shoulder's corners that keep the neck on its side, rad.
    #[inline]
    pub(super) fn corners(&self, theta: f64, lean: Lean) -> [f64; 2] {
        match (&self.linkage.shoulder, lean) {
            (None, _) => [f64::INFINITY; 2],
            (Some(s), Lean::Off) => [s.contact_angle_rad - theta, s.contact_angle_rad + theta],
            (Some(s), Lean::Forward) => [theta - s.contact_angle_rad, f64::INFINITY],
            (Some(s), Lean::Backward) => [f64::INFINITY, -theta - s.contact_angle_rad],
        }
    }
}

impl System {
    /// Taylor coefficients of the blade's motion about `t`.
    #[inline]
    pub(super) fn expand(
        &self,
        t: f64,
        pose: &Pose,
        touch: Touch,
        lean: Lean,
        order: usize,
        motion: &mut Motion,
    ) {
        self.drive.series(t, &mut motion.head_velocity[..=order]);
        motion.expand(&self.linkage, touch, lean, pose, order);
    }

    /// Signs of the neck's angle in the guards of the two corners, 0 for one that does not apply.
    pub(super) fn corner_signs(&self, lean: Lean) -> [f64; 2] {
        match (&self.linkage.shoulder, lean) {
            (None, _) => [0.0, 0.0],
            (_, Lean::Off) => [-1.0, 1.0],
            (_, Lean::Forward) => [1.0, 0.0],
            (_, Lean::Backward) => [0.0, -1.0],
        }
    }
}

/// Taylor coefficients of the blade's motion, one order more than is used of the states: forces are known to
/// one less.
pub type Motion = MotionSeries<{ TERMS + 2 }>;

/// Friction and normal force at one instant, N, with the angular accelerations they cause, rad/s2.
#[derive(Debug, Clone, Copy)]
pub struct Forces {
    /// Friction force on the tip, N.
    pub friction_n: f64,
    /// Normal force on the tip, N.
    pub normal_n: f64,
    /// Painlevé indicator `1 + sigma mu nu` of slip; 1 in stick, where it has no part.
    pub indicator: f64,
    /// Angular accelerations of neck and lip, rad/s2.
    pub accelerations: [f64; 2],
}

/// The tip slides in one direction; states `(theta, phi, theta_rate, phi_rate)`.
#[derive(Debug, Clone, Copy)]
pub struct Slip<'a> {
    /// The blade on its drive.
    pub system: &'a System,
    /// Direction of slip, +1 or -1.
    pub direction: f64,
    /// Side of the shoulder.
    pub lean: Lean,
}

/// The pose of the four slip states.
#[inline]
#[must_use]
pub(crate) fn pose_of(y: &[f64; 4]) -> Pose {
    Pose { theta: y[0], phi: y[1], theta_rate: y[2], phi_rate: y[3] }
}

impl Slip<'_> {
    /// Speed of the tip in the direction of slip, m/s, and the forces there: `f = -sigma mu N` with `N =
    /// n_free / (1 + sigma mu nu)`.
    #[inline]
    pub(super) fn forces(&self, pose: &Pose, at: &Instant) -> (f64, Forces) {
        let speed = self.direction * self.system.linkage.tip_velocity_m_per_s(pose, &at.directions, &at.head);
        let mu = self.direction * self.system.linkage.friction.dynamic(speed);
        let indicator = 1.0 + mu * at.contact.nu;
        let normal_n = at.contact.n_free / indicator;
        (speed, with_force(&at.contact, -mu * normal_n, normal_n, indicator))
    }
}

#[inline]
pub(super) fn with_force(contact: &Contact, friction_n: f64, normal_n: f64, indicator: f64) -> Forces {
    let acceleration = |i: usize| contact.free[i] + friction_n * contact.per_force[i];
    Forces { friction_n, normal_n, indicator, accelerations: [acceleration(0), acceleration(1)] }
}

impl Phase<4, GUARDS> for Slip<'_> {
    #[inline]
    fn derivative(&self, t: f64, y: &[f64; 4]) -> [f64; 4] {
        let pose = pose_of(y);
        let (_, forces) = self.forces(&pose, &self.system.instant(t, &pose, self.lean));
        [y[2], y[3], forces.accelerations[0], forces.accelerations[1]]
    }

    #[inline]
    fn guards(&self, t: f64, y: &[f64; 4]) -> [f64; GUARDS] {
        let pose = pose_of(y);
        let at = self.system.instant(t, &pose, self.lean);
        let (speed, forces) = self.forces(&pose, &at);
        let [forward, backward] = self.system.corners(y[0], self.lean);
        // the force without friction has the sign of the normal force and no pole where the indicator
        // vanishes
        [
            speed,
            at.contact.n_free,
            forces.indicator,
            forward,
            backward,
            at.directions.cos_theta,
            at.directions.cos_phi,
        ]
    }

    fn scale(&self) -> [f64; 4] {
        let System { angle_scale, rate_scale, .. } = *self.system;
        [angle_scale, angle_scale, rate_scale, rate_scale]
    }
}

impl Expand<4, GUARDS> for Slip<'_> {
    type Tape = Motion;

    fn expand(&self, t: f64, y: &[f64; 4], motion: &mut Motion, out: &mut Expansion<4, GUARDS>) {
        self.system.expand(t, &pose_of(y), Touch::Slip(self.direction), self.lean, out.order, motion);
        let corners = self.system.corner_signs(self.lean);
        for k in 0..=out.order {
            let ([theta, phi], [theta_rate, phi_rate]) = (motion.angle[k], motion.rate[k]);
            let [cos_theta, cos_phi] = motion.cosines(k);
            out.states[k] = [theta, phi, theta_rate, phi_rate];
            // the indicator has no series here: towards its zero the accelerations have a pole, which no step
            // crosses
            let speed = self.direction * motion.tip_velocity[k];
            out.guards[k] =
                [speed, motion.normal_n(k), 0.0, corners[0] * theta, corners[1] * theta, cos_theta, cos_phi];
        }
        out.guards[0][JAMS] = motion.indicator;
        let friction = &self.system.linkage.friction;
        let falls = friction.a > 0.0 && friction.b_s_per_m > 0.0;
        out.exponent = falls
            .then(|| std::array::from_fn(|k| friction.b_s_per_m * self.direction * motion.tip_velocity[k]));
        let [forward, backward] = SHOULDER_GUARDS;
        [out.guards[0][forward], out.guards[0][backward]] = self.system.corners(y[0], self.lean);
    }
}

/// The tip is held at `place_m`; the states are angle and rate of the free link, the other link follows from
/// the place of the tip: `l1 sin theta + l2 sin phi = place - v(t)`, so the tip cannot drift.
#[derive(Debug, Clone, Copy)]
pub struct Stick<'a> {
    /// The blade on its drive.
    pub system: &'a System,
    /// Where the tip is held, `alpha`, m.
    pub place_m: f64,
    /// Side of the shoulder.
    pub lean: Lean,
    /// The link whose angle follows: the one that moves the tip more.
    follower: Link,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Link {
    Neck,
    Lip,
}

impl<'a> Stick<'a> {
    /// Cosine of the follower at which stick counts as level, 1e-3 rad short of it. The place of the tip
    /// turns back at level, so the follower's rate is 0/0 there and its cosine keeps its sign; a thousandth
    /// of a radian costs about nine bits of the state, not all.
    const LEAST_COSINE: f64 = 1e-3;

    /// Holds the tip where it is in this pose, both links short of level.
    #[must_use]
    pub fn hold(system: &'a System, t: f64, pose: &Pose, lean: Lean) -> Self {
        let directions = Directions::of(pose);
        let (neck, lip) =
            (system.linkage.l1_m * directions.cos_theta, system.linkage.l2_m * directions.cos_phi);
        let follower = if lip >= neck { Link::Lip } else { Link::Neck };
        let place_m = system.linkage.tip_position_m(&directions, &system.drive.at(t));
        Self { system, place_m, lean, follower }
    }

    /// The two states of a pose.
    #[must_use]
    pub fn states(&self, pose: &Pose) -> [f64; 2] {
        match self.follower {
            Link::Lip => [pose.theta, pose.theta_rate],
            Link::Neck => [pose.phi, pose.phi_rate],
        }
    }

    /// Pose and directions of the two states: the follower from the tip's place, its rate from the tip's
    /// rest.
    #[inline]
    pub(super) fn pose(&self, head: &HeadMotion, y: &[f64; 2]) -> (Pose, Directions) {
        let (l1, l2) = (self.system.linkage.l1_m, self.system.linkage.l2_m);
        let (own, other) = match self.follower {
            Link::Lip => (l1, l2),
            Link::Neck => (l2, l1),
        };
        let (sin, cos) = math::sin_cos(y[0]);
        let follower_sin = (self.place_m - head.position_m - own * sin) / other;
        let follower_cos = (1.0 - follower_sin * follower_sin).sqrt();
        let angle = math::asin(follower_sin);
        let rate = -(head.velocity_m_per_s + own * cos * y[1]) / (other * follower_cos);
        match self.follower {
            Link::Lip => (
                Pose { theta: y[0], phi: angle, theta_rate: y[1], phi_rate: rate },
                Directions { sin_theta: sin, cos_theta: cos, sin_phi: follower_sin, cos_phi: follower_cos },
            ),
            Link::Neck => (
                Pose { theta: angle, phi: y[0], theta_rate: rate, phi_rate: y[1] },
                Directions { sin_theta: follower_sin, cos_theta: follower_cos, sin_phi: sin, cos_phi: cos },
            ),
        }
    }

    /// The forces that hold the tip: `v3dd = a_free + kappa f = 0`.
    #[inline]
    pub(super) fn forces(&self, at: &Instant) -> Forces {
        let friction = super::mode::holding_force(&at.contact);
        with_force(&at.contact, friction, at.contact.n_free + at.contact.nu * friction, 1.0)
    }

    #[inline]
    pub(super) fn instant(&self, t: f64, y: &[f64; 2]) -> (Pose, Instant) {
        let head = self.system.drive.at(t);
        let (pose, directions) = self.pose(&head, y);
        let contact = self.system.linkage.contact(&pose, &directions, &head, self.lean);
        (pose, Instant { head, directions, contact })
    }
}

impl Phase<2, GUARDS> for Stick<'_> {
    #[inline]
    fn derivative(&self, t: f64, y: &[f64; 2]) -> [f64; 2] {
        let (_, at) = self.instant(t, y);
        let forces = self.forces(&at);
        [y[1], forces.accelerations[if self.follower == Link::Lip { 0 } else { 1 }]]
    }

    #[inline]
    fn guards(&self, t: f64, y: &[f64; 2]) -> [f64; GUARDS] {
        let (pose, at) = self.instant(t, y);
        let forces = self.forces(&at);
        let limit = self.system.linkage.friction.at_rest() * forces.normal_n;
        let [forward, backward] = self.system.corners(pose.theta, self.lean);
        let Directions { cos_theta, cos_phi, .. } = at.directions;
        let [neck, lip] = match self.follower {
            Link::Lip => [cos_theta, cos_phi - Self::LEAST_COSINE],
            Link::Neck => [cos_theta - Self::LEAST_COSINE, cos_phi],
        };
        // friction that holds the tip from sliding forward points backward
        [limit + forces.friction_n, limit - forces.friction_n, forces.normal_n, forward, backward, neck, lip]
    }

    fn scale(&self) -> [f64; 2] {
        [self.system.angle_scale, self.system.rate_scale]
    }
}

impl Expand<2, GUARDS> for Stick<'_> {
    type Tape = Motion;

    fn expand(&self, t: f64, y: &[f64; 2], motion: &mut Motion, out: &mut Expansion<2, GUARDS>) {
        let (pose, _) = self.pose(&self.system.drive.at(t), y);
        self.system.expand(t, &pose, Touch::Stick, self.lean, out.order + 1, motion);
        let (leader, follower) = if self.follower == Link::Lip { (0, 1) } else { (1, 0) };
        let corners = self.system.corner_signs(self.lean);
        let mu = self.system.linkage.friction.at_rest();
        for k in 0..=out.order {
            let (theta, [cos_theta, cos_phi]) = (motion.angle[k][0], motion.cosines(k));
            let (normal, force) = (motion.normal_n(k), motion.friction_n[k]);
            out.states[k] = [motion.angle[k][leader], motion.rate[k][leader]];
            out.guards[k] = [
                mu * normal + force,
                mu * normal - force,
                normal,
                corners[0] * theta,
                corners[1] * theta,
                cos_theta,
                cos_phi,
            ];
        }
        let [forward, backward] = SHOULDER_GUARDS;
        [out.guards[0][forward], out.guards[0][backward]] = self.system.corners(pose.theta, self.lean);
        out.guards[0][LEVEL_GUARDS[follower]] -= Self::LEAST_COSINE;
        let System { angle_scale, rate_scale, .. } = *self.system;
        let (angle, rate) = (
            angle_scale.max(motion.angle[0][follower].abs()),
            rate_scale.max(motion.rate[0][follower].abs()),
        );
        out.followers = [out.order - 1, out.order]
            .map(|k| (motion.angle[k][follower].abs() / angle).max(motion.rate[k][follower].abs() / rate));
    }
}

/// Mode that follows when a guard of stick falls to the friction limit.
#[must_use]
pub fn released(guard: usize) -> Option<Mode> {
    match guard {
        FORWARD_LIMIT => Some(Mode::SlipForward),
        BACKWARD_LIMIT => Some(Mode::SlipBackward),
        _ => None,
    }
}
