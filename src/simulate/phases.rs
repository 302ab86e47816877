//! Slip and stick of the blade as smooth phases with guards.

use super::mode::Mode;
use super::scene::Drive;
use crate::blade::series::{MotionSeries, Touch};
use crate::blade::shoulder::Lean;
use crate::blade::{Contact, Directions, HeadMotion, Linkage, Pose};
use crate::ode::Phase;
use crate::ode::polynomial::{Series, TERMS};
use crate::ode::taylor::{Expand, Expansion};

/// Number of guards of either phase.
pub const GUARDS: usize = 7;
/// Guards at the neck's angle, the same in both phases: the shoulder's forward and backward corner.
pub const SHOULDER_GUARDS: [usize; 2] = [3, 4];
/// Guards that neck and lip stay short of level, the same in both phases: beyond it the hinge would be below the glass.
pub const LEVEL_GUARDS: [usize; 2] = [5, 6];

/// Slip: the tip's velocity, the normal force and the Painlevé indicator stay positive in the direction of slip.
pub const TIP_STOPS: usize = 0;
/// The normal force of slip reaches zero.
pub const SLIP_CONTACT_LOST: usize = 1;
/// The Painlevé indicator reaches zero.
pub const JAMS: usize = 2;
/// Stick: the holding force reaches the static limit towards +v.
pub const FORWARD_LIMIT: usize = 0;
/// Stick: the holding force reaches the static limit towards -v.
pub const BACKWARD_LIMIT: usize = 1;
/// The normal force of stick reaches zero.
pub const STICK_CONTACT_LOST: usize = 2;

/// A blade on its drive, with the magnitudes below which errors are absolute.
#[derive(Debug, Clone, Copy)]
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
    fn motion(&self, t: f64, pose: &Pose, touch: Touch, lean: Lean, order: usize) -> MotionSeries<TERMS> {
        let mut motion = MotionSeries::default();
        self.drive.series(t, &mut motion.head_velocity[..=order]);
        motion.expand(&self.linkage, touch, lean, pose, order);
        motion
    }

    /// Series of the guards that both phases share: the shoulder's corners and the level of both links, short by the given cosines.
    #[inline]
    fn write_shared_guards(&self, motion: &MotionSeries<TERMS>, lean: Lean, least_cosines: [f64; 2], order: usize, guards: &mut [Series; GUARDS]) {
        let corners = self.corners(motion.angle[0][0], lean);
        for ((guard, sign), corner) in SHOULDER_GUARDS.into_iter().zip(corner_signs(lean)).zip(corners) {
            guards[guard][0] = corner;
            if corner < f64::INFINITY {
                write(&mut guards[guard][1..=order], motion.angle[1..].iter().map(|angle| sign * angle[0]));
            }
        }
        for (link, guard) in LEVEL_GUARDS.into_iter().enumerate() {
            write(&mut guards[guard][..=order], motion.cos.iter().map(|cos| cos[link]));
            guards[guard][0] -= least_cosines[link];
        }
    }
}

/// Signs with which the neck's angle enters the two corners' guards.
fn corner_signs(lean: Lean) -> [f64; 2] {
    match lean {
        Lean::Off => [-1.0, 1.0],
        Lean::Forward | Lean::Backward => [1.0, -1.0],
    }
}

#[inline]
fn write(out: &mut [f64], values: impl Iterator<Item = f64>) {
    out.iter_mut().zip(values).for_each(|(out, value)| *out = value);
}

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
pub fn pose_of(y: &[f64; 4]) -> Pose {
    Pose { theta: y[0], phi: y[1], theta_rate: y[2], phi_rate: y[3] }
}

impl Slip<'_> {
    /// Speed of the tip in the direction of slip, m/s, and the forces there: `f = -sigma mu N` with `N = n_free / (1 + sigma mu nu)`.
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
        // the force without friction has the sign of the normal force and no pole where the indicator vanishes
        [speed, at.contact.n_free, forces.indicator, forward, backward, at.directions.cos_theta, at.directions.cos_phi]
    }

    fn scale(&self) -> [f64; 4] {
        let System { angle_scale, rate_scale, .. } = *self.system;
        [angle_scale, angle_scale, rate_scale, rate_scale]
    }
}

impl Expand<4, GUARDS> for Slip<'_> {
    fn expand(&self, t: f64, y: &[f64; 4], out: &mut Expansion<4, GUARDS>) {
        let order = out.order;
        let motion = self.system.motion(t, &pose_of(y), Touch::Slip(self.direction), self.lean, order);
        for link in 0..2 {
            write(&mut out.states[link][..=order], motion.angle.iter().map(|a| a[link]));
            write(&mut out.states[link + 2][..=order], motion.rate.iter().map(|r| r[link]));
        }
        let guards = &mut out.guards;
        write(&mut guards[TIP_STOPS][..=order], motion.tip_velocity.iter().map(|v| self.direction * v));
        write(&mut guards[SLIP_CONTACT_LOST][..=order], motion.normal_n.iter().copied());
        // no series: towards the indicator's zero the accelerations have a pole, which no step crosses
        guards[JAMS] = [0.0; TERMS];
        guards[JAMS][0] = motion.indicator;
        self.system.write_shared_guards(&motion, self.lean, [0.0; 2], order, guards);
    }
}

/// The tip is held at `place_m`; the states are angle and rate of the free link, the other link follows from the place of the tip:
/// `l1 sin theta + l2 sin phi = place - v(t)`, so the tip cannot drift.
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
    /// Cosine of the follower at which stick counts as level, 1e-3 rad short of it. The place of the tip turns back at level, so the
    /// follower's rate is 0/0 there and its cosine keeps its sign; a thousandth of a radian costs about nine bits of the state, not all.
    const LEAST_COSINE: f64 = 1e-3;

    /// Holds the tip where it is in this pose, both links short of level.
    #[must_use]
    pub fn hold(system: &'a System, t: f64, pose: &Pose, lean: Lean) -> Self {
        let directions = Directions::of(pose);
        let (neck, lip) = (system.linkage.l1_m * directions.cos_theta, system.linkage.l2_m * directions.cos_phi);
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

    /// Pose and directions of the two states: the follower from the tip's place, its rate from the tip's rest.
    #[inline]
    pub(super) fn pose(&self, head: &HeadMotion, y: &[f64; 2]) -> (Pose, Directions) {
        let (l1, l2) = (self.system.linkage.l1_m, self.system.linkage.l2_m);
        let (own, other) = match self.follower {
            Link::Lip => (l1, l2),
            Link::Neck => (l2, l1),
        };
        let (sin, cos) = y[0].sin_cos();
        let follower_sin = (self.place_m - head.position_m - own * sin) / other;
        let follower_cos = (1.0 - follower_sin * follower_sin).sqrt();
        let angle = follower_sin.asin();
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
    fn expand(&self, t: f64, y: &[f64; 2], out: &mut Expansion<2, GUARDS>) {
        let order = out.order;
        let (pose, _) = self.pose(&self.system.drive.at(t), y);
        let motion = self.system.motion(t, &pose, Touch::Stick, self.lean, order);
        let (leader, least_cosines) = match self.follower {
            Link::Lip => (0, [0.0, Self::LEAST_COSINE]),
            Link::Neck => (1, [Self::LEAST_COSINE, 0.0]),
        };
        write(&mut out.states[0][..=order], motion.angle.iter().map(|a| a[leader]));
        write(&mut out.states[1][..=order], motion.rate.iter().map(|r| r[leader]));
        let mu = self.system.linkage.friction.at_rest();
        let forces = || motion.normal_n.iter().zip(&motion.friction_n);
        write(&mut out.guards[FORWARD_LIMIT][..=order], forces().map(|(n, f)| mu * n + f));
        write(&mut out.guards[BACKWARD_LIMIT][..=order], forces().map(|(n, f)| mu * n - f));
        write(&mut out.guards[STICK_CONTACT_LOST][..=order], motion.normal_n.iter().copied());
        self.system.write_shared_guards(&motion, self.lean, least_cosines, order, &mut out.guards);
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
