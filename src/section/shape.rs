//! Closed forms of a link's section (equations in [`crate::section`]).

use crate::math::{gauss, powi};

/// Poisson's ratio of rubber: its volume hardly changes.
const POISSON_RATIO: f64 = 0.5;
/// Parts over which the bending of a link is integrated by the five-point rule. A link that is 20 times
/// thinner at its edge is still integrated to 1e-12.
const PARTS: u32 = 256;

/// Modulus of a wide plate `E/(1 - nu^2)`, Pa, from Young's modulus, Pa.
#[must_use]
pub fn plate_modulus_pa(youngs_modulus_pa: f64) -> f64 {
    youngs_modulus_pa / (1.0 - POISSON_RATIO * POISSON_RATIO)
}

/// The trapezoid of a link, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkSection {
    /// Height `h`, from hinge to hinge or to the edge.
    pub height_m: f64,
    /// Thickness at the top `t1`.
    pub top_thickness_m: f64,
    /// Thickness at the bottom `t2`.
    pub bottom_thickness_m: f64,
    /// The hinge at its top, where it has one.
    pub hinge: Option<RubberHinge>,
}

/// A thin neck of rubber that bends in place of the link below it, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RubberHinge {
    /// Thickness `t`.
    pub thickness_m: f64,
    /// Height `L`.
    pub height_m: f64,
}

impl RubberHinge {
    /// Stiffness per length of blade under a moment, N m/rad/m: `E' t^3/(12 L)`.
    #[must_use]
    pub fn stiffness_n_per_rad(&self, plate_modulus_pa: f64) -> f64 {
        plate_modulus_pa * powi(self.thickness_m, 3) / (12.0 * self.height_m)
    }
}

impl LinkSection {
    /// Area of the section, m2: `h (t1 + t2)/2`.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        0.5 * self.height_m * (self.top_thickness_m + self.bottom_thickness_m)
    }

    /// Centre of the area from the top, m: `h (t1 + 2 t2)/(3 (t1 + t2))`.
    #[must_use]
    pub fn centre_m(&self) -> f64 {
        let (t1, t2) = (self.top_thickness_m, self.bottom_thickness_m);
        self.height_m * (t1 + 2.0 * t2) / (3.0 * (t1 + t2))
    }

    /// Polar second moment of the area about its centre, m4: the inertia per density and length of blade.
    #[must_use]
    pub fn polar_moment_m4(&self) -> f64 {
        let (h, t1, t2) = (self.height_m, self.top_thickness_m, self.bottom_thickness_m);
        let along = powi(h, 3) * (t1 * t1 + 4.0 * t1 * t2 + t2 * t2) / (36.0 * (t1 + t2));
        let across = h * (t1 + t2) * (t1 * t1 + t2 * t2) / 48.0;
        along + across
    }

    /// Stiffness at the top per length of blade, N m/rad/m: that of the hinge, or of the link's own bending
    /// under a force at its bottom.
    #[must_use]
    pub fn stiffness_n_per_rad(&self, plate_modulus_pa: f64) -> f64 {
        match self.hinge {
            Some(hinge) => hinge.stiffness_n_per_rad(plate_modulus_pa),
            None => plate_modulus_pa * powi(self.height_m, 2) / (12.0 * self.bending_integral()),
        }
    }

    /// `int_0^h s^2/t(s)^3 ds` with `s` from the bottom.
    fn bending_integral(&self) -> f64 {
        let part = self.height_m / f64::from(PARTS);
        let thickness = |s: f64| {
            self.bottom_thickness_m + (self.top_thickness_m - self.bottom_thickness_m) * s / self.height_m
        };
        (0..PARTS)
            .flat_map(|i| gauss::nodes_and_weights(part * f64::from(i), part * f64::from(i + 1)))
            .map(|(s, weight)| weight * s * s / powi(thickness(s), 3))
            .sum()
    }
}
