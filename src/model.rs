//! The linkage of the blade: head, neck and lip with the lip tip on the glass, equations (1) to (3) of the
//! paper in SI units.
//!
//! Letters are those of the paper: `theta`, `phi` angles of neck and lip from the vertical (positive when the
//! lower end lies towards +v), `v(t)` the prescribed head position, `u` the head's drop, `v3 = v + l1 sin
//! theta + l2 sin phi` the tip's position. Eliminating `N` from (1) and (2) by (3) gives, with `q = (theta,
//! phi)`,
//!
//! ```text
//! A qdd + b = f w,   N = n.qdd + N0,   w = (l1 cos theta, l2 cos phi)
//! A11 = m_theta + l1 (M l1 - 2 m_a) sin^2 theta        A22 = m_phi + l2 (M l2 - 2 m_b) sin^2 phi
//! A12 = m_c cos(theta - phi) + (M l1 l2 - m_a l2 - m_b l1) sin theta sin phi
//! n   = ((m_a - M l1) sin theta, (m_b - M l2) sin phi)
//! ```
//!
//! Contact needs two solutions of this 2x2 system ([`FrictionResponse`]): the motion without friction and the
//! motion per unit of friction force.

pub mod flight;
pub mod friction;
pub mod modes;
pub mod parameter_spread;
pub mod parameters;
pub mod plausibility;
pub mod section;
pub mod series;
pub mod shoulder;
mod slider;
pub mod tangent;

use friction::FrictionLaw;
use portable_math as math;
use serde::{Deserialize, Serialize};
use shoulder::{Shoulder, ShoulderContact};
pub(crate) use slider::Slider;

/// Inertial and elastic constants of a blade; the paper's letters, SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Linkage {
    /// Total mass `M = m0 + m1 + m2`, kg.
    pub mass_kg: f64,
    /// Length of the neck `l1`, m.
    pub l1_m: f64,
    /// Length of the lip `l2`, m.
    pub l2_m: f64,
    /// First moment of the mass of neck and lip about the upper hinge of the neck, with the mass of the lip
    /// concentrated at the hinge between neck and lip: `m_a = m1 g1 + m2 l1`, kg m.
    pub m_a: f64,
    /// First moment of the mass of the lip about its upper hinge, `m_b = m2 g2`, kg m.
    pub m_b: f64,
    /// Inertial coupling of neck and lip, `m_c = m2 l1 g2`, kg m2.
    pub m_c: f64,
    /// Moment of inertia of the neck about its upper hinge, with the mass of the lip concentrated at the
    /// hinge between neck and lip: `m_theta = J1 + m1 g1^2 + m2 l1^2`, kg m2.
    pub m_theta: f64,
    /// Moment of inertia of the lip about its upper hinge, `m_phi = J2 + m2 g2^2`, kg m2.
    pub m_phi: f64,
    /// Stiffness and damping of the head's support, `k0`, N/m, and `c0`, N s/m.
    pub head: Spring,
    /// Stiffness and damping of the neck, `k1`, N m/rad, and `c1`, N m s/rad.
    pub neck: Spring,
    /// Stiffness and damping of the lip, `k2`, N m/rad, and `c2`, N m s/rad.
    pub lip: Spring,
    /// Displacement `h_d` by which the head's support is pressed towards the glass when the blade is upright,
    /// m.
    pub preload_displacement_m: f64,
    /// Friction between lip tip and glass.
    pub friction: FrictionLaw,
    /// Shoulder of the head; `None` for a blade without one.
    pub shoulder: Option<Shoulder>,
}

/// A linear spring with a parallel damper; the units depend on whether its coordinate is a length or an
/// angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spring {
    /// Force per displacement, N/m, or moment per angle, N m/rad.
    pub stiffness: f64,
    /// Force per velocity, N s/m, or moment per angular rate, N m s/rad.
    pub damping: f64,
}

/// Angles and rates of both links, rad and rad/s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Angle of the neck from the vertical, `theta`, rad.
    pub theta: f64,
    /// Angle of the lip from the vertical, `phi`, rad.
    pub phi: f64,
    /// Angular rate of the neck, rad/s.
    pub theta_rate: f64,
    /// Angular rate of the lip, rad/s.
    pub phi_rate: f64,
}

/// Position, velocity and acceleration of the head along the sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadMotion {
    /// Position `v`, m.
    pub position_m: f64,
    /// Velocity `dv/dt`, m/s.
    pub velocity_m_per_s: f64,
    /// Acceleration `d2v/dt2`, m/s2.
    pub acceleration_m_per_s2: f64,
}

/// Sines and cosines of both angles.
#[derive(Debug, Clone, Copy)]
pub struct LinkDirections {
    /// `sin theta`.
    pub sin_theta: f64,
    /// `cos theta`.
    pub cos_theta: f64,
    /// `sin phi`.
    pub sin_phi: f64,
    /// `cos phi`.
    pub cos_phi: f64,
}

impl LinkDirections {
    /// Directions of both links in a pose.
    #[inline]
    #[must_use]
    pub fn from_pose(pose: &Pose) -> Self {
        let (sin_theta, cos_theta) = math::sin_cos(pose.theta);
        let (sin_phi, cos_phi) = math::sin_cos(pose.phi);
        Self { sin_theta, cos_theta, sin_phi, cos_phi }
    }
}

/// How the blade responds to a friction force `f` at one instant. Angular accelerations:
/// `qdd = free + f * per_force`; tip acceleration: `v3dd = a_free + f * kappa`; normal force:
/// `N = n_free + f * nu`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionResponse {
    /// Angular accelerations without friction, rad/s2.
    pub free: [f64; 2],
    /// Angular accelerations per newton of friction, `A^-1 w`.
    pub per_force: [f64; 2],
    /// Tip acceleration without friction, m/s2.
    pub a_free: f64,
    /// Tip acceleration per newton of friction, `kappa = w.A^-1 w > 0`, 1/kg.
    pub kappa: f64,
    /// Normal force without friction, N.
    pub n_free: f64,
    /// Normal force per newton of friction, `nu = n.A^-1 w`.
    pub nu: f64,
}

impl Linkage {
    /// Solves equations (1) to (3) for accelerations and normal force as linear functions of the friction
    /// force.
    #[inline]
    #[must_use]
    pub fn friction_response(
        &self,
        pose: &Pose,
        d: &LinkDirections,
        head: &HeadMotion,
        lean: ShoulderContact,
    ) -> FrictionResponse {
        let LinkDirections { sin_theta: st, cos_theta: ct, sin_phi: sp, cos_phi: cp } = *d;
        let (mass, l1, l2) = (self.mass_kg, self.l1_m, self.l2_m);
        let (dt, dp) = (pose.theta_rate, pose.phi_rate);
        let (dt2, dp2) = (dt * dt, dp * dp);
        let cos_difference = ct * cp + st * sp;
        let sin_difference = st * cp - ct * sp;
        let (arm1, arm2) = (self.m_a - mass * l1, self.m_b - mass * l2);

        // normal force at zero angular acceleration, equation (3)
        let drop = l1 * (1.0 - ct) + l2 * (1.0 - cp);
        let drop_rate = l1 * st * dt + l2 * sp * dp;
        let n0 = arm1 * ct * dt2 + arm2 * cp * dp2
            - self.head.stiffness * (drop - self.preload_displacement_m)
            - self.head.damping * drop_rate;

        // equations (1) and (2) with N eliminated
        let a11 = self.m_theta + l1 * (mass * l1 - 2.0 * self.m_a) * st * st;
        let a22 = self.m_phi + l2 * (mass * l2 - 2.0 * self.m_b) * sp * sp;
        let a12 = self.m_c * cos_difference + (mass * l1 * l2 - self.m_a * l2 - self.m_b * l1) * st * sp;
        let lip = self.lip.stiffness * (pose.phi - pose.theta) + self.lip.damping * (dp - dt);
        let neck =
            self.neck.stiffness * pose.theta + self.neck.damping * dt + self.shoulder_moment(pose, lean);
        let acceleration = head.acceleration_m_per_s2;
        let b1 = -self.m_a * l1 * ct * st * dt2
            + (self.m_c * sin_difference - self.m_a * l2 * cp * st) * dp2
            + self.m_a * acceleration * ct
            - lip
            + neck
            - n0 * l1 * st;
        let b2 = -(self.m_c * sin_difference + self.m_b * l1 * ct * sp) * dt2 - self.m_b * l2 * cp * sp * dp2
            + self.m_b * acceleration * cp
            + lip
            - n0 * l2 * sp;

        let inverse_determinant = 1.0 / (a11 * a22 - a12 * a12);
        let (w1, w2) = (l1 * ct, l2 * cp);
        let free = [inverse_determinant * (a12 * b2 - a22 * b1), inverse_determinant * (a12 * b1 - a11 * b2)];
        let per_force =
            [inverse_determinant * (a22 * w1 - a12 * w2), inverse_determinant * (a11 * w2 - a12 * w1)];
        let (n1, n2) = (arm1 * st, arm2 * sp);
        FrictionResponse {
            free,
            per_force,
            a_free: acceleration - l1 * st * dt2 - l2 * sp * dp2 + w1 * free[0] + w2 * free[1],
            kappa: w1 * per_force[0] + w2 * per_force[1],
            n_free: n0 + n1 * free[0] + n2 * free[1],
            nu: n1 * per_force[0] + n2 * per_force[1],
        }
    }

    #[inline]
    fn shoulder_moment(&self, pose: &Pose, lean: ShoulderContact) -> f64 {
        match (lean, &self.shoulder) {
            (ShoulderContact::Off, _) | (_, None) => 0.0,
            (side, Some(shoulder)) => shoulder.moment(pose.theta, pose.theta_rate, side.angle_sign()),
        }
    }

    /// Three numbers for the neck: its stiffness, its damping, and its moment at zero angle and rate. All
    /// include the shoulder if the neck leans on it.
    fn neck_spring(&self, lean: ShoulderContact) -> [f64; 3] {
        let Spring { stiffness, damping } = self.neck;
        match (lean, &self.shoulder) {
            (ShoulderContact::Off, _) | (_, None) => [stiffness, damping, 0.0],
            (side, Some(s)) => [
                stiffness + s.stiffness_n_m_per_rad,
                damping + s.damping_n_m_s_per_rad,
                -s.stiffness_n_m_per_rad * side.angle_sign() * s.contact_angle_rad,
            ],
        }
    }

    /// Position of the tip along the sweep, `v3`, m.
    #[inline]
    pub(crate) fn tip_position_m(&self, d: &LinkDirections, head: &HeadMotion) -> f64 {
        head.position_m + self.l1_m * d.sin_theta + self.l2_m * d.sin_phi
    }

    /// Velocity of the tip along the sweep, `dv3/dt`, m/s.
    #[inline]
    #[must_use]
    pub fn tip_velocity_m_per_s(&self, pose: &Pose, d: &LinkDirections, head: &HeadMotion) -> f64 {
        head.velocity_m_per_s
            + self.l1_m * d.cos_theta * pose.theta_rate
            + self.l2_m * d.cos_phi * pose.phi_rate
    }

    /// Drop of the head towards the glass while the tip touches it, `u`, m.
    #[inline]
    pub fn head_drop_m(&self, d: &LinkDirections) -> f64 {
        self.l1_m * (1.0 - d.cos_theta) + self.l2_m * (1.0 - d.cos_phi)
    }

    /// Rate of the head's drop, m/s.
    #[inline]
    pub(crate) fn head_drop_rate_m_per_s(&self, pose: &Pose, d: &LinkDirections) -> f64 {
        self.l1_m * d.sin_theta * pose.theta_rate + self.l2_m * d.sin_phi * pose.phi_rate
    }

    /// Kinetic energy plus the energy of every spring (the preload included) with the tip on the glass, J.
    /// Gravity is not in the model.
    #[must_use]
    pub fn energy_j(&self, pose: &Pose, d: &LinkDirections, head: &HeadMotion) -> f64 {
        self.energy_with_drop_j(pose, d, head, (self.head_drop_m(d), self.head_drop_rate_m_per_s(pose, d)))
    }

    /// Energy as in [`Self::energy_j`], J, for a given drop of the head, m, and its rate, m/s; valid in
    /// flight too.
    #[must_use]
    pub fn energy_with_drop_j(
        &self,
        pose: &Pose,
        d: &LinkDirections,
        head: &HeadMotion,
        (drop, drop_rate): (f64, f64),
    ) -> f64 {
        let (dt, dp, speed) = (pose.theta_rate, pose.phi_rate, head.velocity_m_per_s);
        let along = 0.5 * self.mass_kg * speed * speed
            + speed * (self.m_a * d.cos_theta * dt + self.m_b * d.cos_phi * dp);
        let down = 0.5 * self.mass_kg * drop_rate * drop_rate
            - drop_rate * (self.m_a * d.sin_theta * dt + self.m_b * d.sin_phi * dp);
        let turning = 0.5 * (self.m_theta * dt * dt + self.m_phi * dp * dp)
            + self.m_c * (d.cos_theta * d.cos_phi + d.sin_theta * d.sin_phi) * dt * dp;
        let support = self.preload_displacement_m - drop;
        let springs = 0.5
            * (self.head.stiffness * support * support
                + self.neck.stiffness * math::powi(pose.theta, 2)
                + self.lip.stiffness * math::powi(pose.phi - pose.theta, 2));
        along + down + turning + springs + self.shoulder.map_or(0.0, |s| s.energy_j(pose.theta))
    }

    /// Net power supplied to the blade, W: the powers of the drive and of the friction force, minus the power
    /// dissipated in the dampers. `force` is the friction force on the tip, N. The force of the drive follows
    /// from the momentum balance along the sweep.
    #[must_use]
    pub fn power_w(
        &self,
        pose: &Pose,
        d: &LinkDirections,
        head: &HeadMotion,
        lean: ShoulderContact,
        force: f64,
        accelerations: [f64; 2],
    ) -> f64 {
        let drop_rate = self.head_drop_rate_m_per_s(pose, d);
        self.power_with_drop_w(pose, d, head, lean, force, accelerations, drop_rate)
    }

    /// Power as in [`Self::power_w`], W, for a given rate of the head's drop, m/s. It is valid in flight too.
    #[allow(clippy::too_many_arguments)] // a state and its forces, named as in the equations
    #[must_use]
    pub fn power_with_drop_w(
        &self,
        pose: &Pose,
        d: &LinkDirections,
        head: &HeadMotion,
        lean: ShoulderContact,
        force: f64,
        accelerations: [f64; 2],
        drop_rate: f64,
    ) -> f64 {
        let (dt, dp) = (pose.theta_rate, pose.phi_rate);
        let drive_force = self.mass_kg * head.acceleration_m_per_s2
            + self.m_a * (d.cos_theta * accelerations[0] - d.sin_theta * dt * dt)
            + self.m_b * (d.cos_phi * accelerations[1] - d.sin_phi * dp * dp)
            - force;
        let dampers = self.head.damping * math::powi(drop_rate, 2)
            + self.neck.damping * dt * dt
            + self.lip.damping * math::powi(dp - dt, 2);
        let shoulder = if lean == ShoulderContact::Off {
            0.0
        } else {
            self.shoulder.map_or(0.0, |s| s.damping_n_m_s_per_rad * dt * dt)
        };
        drive_force * head.velocity_m_per_s + force * self.tip_velocity_m_per_s(pose, d, head)
            - dampers
            - shoulder
    }
}
