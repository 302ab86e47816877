//! The shoulder of the head: beyond a contact angle the neck leans on it and stiffens.
//!
//! The law is an assumption (the paper only says that the neck gets more rigid): for `|theta| > theta_s` the
//! moment `k_s (|theta| - theta_s) sign(theta) + c_s dtheta/dt` is added to the neck's.

use portable_math as math;
use serde::{Deserialize, Serialize};

/// A shoulder on both sides of the neck.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Shoulder {
    /// Angle at which the neck meets the shoulder, `theta_s`, rad.
    pub contact_angle_rad: f64,
    /// Stiffness that the shoulder adds to the neck, `k_s`, N m/rad.
    pub stiffness_n_m_per_rad: f64,
    /// Damping that the shoulder adds to the neck, `c_s`, N m s/rad.
    pub damping_n_m_s_per_rad: f64,
}

impl Shoulder {
    /// Moment of the shoulder on the neck, N m, while the neck leans on the side `side` (+1 or -1).
    #[inline]
    #[must_use]
    pub fn moment(&self, theta: f64, theta_rate: f64, side: f64) -> f64 {
        self.stiffness_n_m_per_rad * (theta - side * self.contact_angle_rad)
            + self.damping_n_m_s_per_rad * theta_rate
    }

    /// Side of the shoulder on which a neck at this angle leans.
    #[must_use]
    pub fn contact_at(&self, theta: f64) -> ShoulderContact {
        match theta {
            t if t > self.contact_angle_rad => ShoulderContact::Forward,
            t if t < -self.contact_angle_rad => ShoulderContact::Backward,
            _ => ShoulderContact::Off,
        }
    }

    /// Energy stored in the shoulder at the neck angle `theta`, J.
    pub(crate) fn energy_j(&self, theta: f64) -> f64 {
        0.5 * self.stiffness_n_m_per_rad * math::powi((theta.abs() - self.contact_angle_rad).max(0.0), 2)
    }
}

/// Whether the neck leans on the shoulder, and on which side of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShoulderContact {
    /// The neck does not touch the shoulder.
    Off,
    /// The neck leans on the side of positive angles.
    Forward,
    /// The neck leans on the side of negative angles.
    Backward,
}

impl ShoulderContact {
    /// Sign of the neck's angle on this side, 0 off the shoulder.
    #[inline]
    #[must_use]
    pub fn angle_sign(self) -> f64 {
        match self {
            Self::Off => 0.0,
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }
}
