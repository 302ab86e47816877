//! Computes the `[blade]` table of a scene from the cross section of a rubber blade.
//!
//! Neck and lip are trapezoids of rubber of density `rho` over a length `b` of blade: height `h`, thickness
//! `t1` at the top and `t2` at the bottom.
//!
//! ```text
//! mass       m = rho b h (t1 + t2)/2
//! centre     g = h (t1 + 2 t2)/(3 (t1 + t2)), from the top
//! inertia    J = rho b (h^3 (t1^2 + 4 t1 t2 + t2^2)/(36 (t1 + t2)) + h (t1 + t2) (t1^2 + t2^2)/48)
//! ```
//!
//! For a rectangle this is `g = h/2` and `J = m (h^2 + t^2)/12`. A blade is long compared with its thickness
//! and bends as a plate, with `E' = E/(1 - nu^2)` in place of Young's modulus; rubber keeps its volume, so
//! `nu = 1/2`. A link turns on a hinge of thickness `t` and height `L`. A link without a hinge bends over its
//! own height; the spring of the model is then chosen so that a force at the bottom of the link displaces the
//! bottom by the same distance as the bending does. With `s` the height above the bottom:
//!
//! ```text
//! with a hinge     k = E' b t^3/(12 L)
//! without          1/k = 12/(E' b h^2) int_0^h s^2/t(s)^3 ds     (rectangle: k = 3 E' b t^3/(12 h))
//! ```
//!
//! A loss factor `eta` gives a resonance the damping ratio `eta/2`. Lengths of the section, ratios and
//! frequencies do not depend on `b`; all other numbers are proportional to it.

mod input;

use crate::text::{escape_controls, round_to_digits};
pub use input::{BladeSection, SectionError};
use input::{InputDeviation, SectionKey};
use portable_math::{gauss_legendre, powi};
use serde::Serialize;
use std::fmt::Write;

/// Significant digits of a number in the `[blade]` table; its uncertainty would justify fewer.
const DIGITS: usize = 4;
/// Number of entries in the `[blade]` table.
const COUNT: usize = 15;
/// Lower limit of an input that is varied in a finite difference, as a fraction of its given value. It keeps
/// a dimension above zero even if the standard deviation exceeds the dimension.
const LEAST_SHARE: f64 = 0.1;

/// A number of the `[blade]` table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BladeTableEntry {
    /// Key in the table.
    pub key: &'static str,
    /// Value, in the unit of the key.
    pub value: f64,
    /// Standard deviation divided by the value, as propagated from the standard deviations of the inputs
    /// alone.
    pub relative_uncertainty: f64,
    /// Equation of the value, in the letters of [`super::section`].
    pub equation: &'static str,
}

/// The `[blade]` table of a section.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BladeEstimate {
    /// Title of the section.
    pub title: String,
    /// Length of blade to which the numbers apply, m.
    pub length_m: f64,
    /// The numbers, in the order of the table.
    pub blade: Vec<BladeTableEntry>,
}

const MASS: &str = "rho b h (t1 + t2)/2";
const CENTRE: &str = "h (t1 + 2 t2)/(3 (t1 + t2))";
const INERTIA: &str = "rho b (h^3 (t1^2 + 4 t1 t2 + t2^2)/(36 (t1 + t2)) + h (t1 + t2) (t1^2 + t2^2)/48)";
const HINGE: &str = "E/(1 - nu^2) b t^3/(12 L), nu = 1/2, of the hinge";
const BENDING: &str = "E/(1 - nu^2) b h^2/(12 int s^2/t(s)^3 ds), nu = 1/2, of the link's own bending";
const RATIO: &str = "eta/2";

impl BladeEstimate {
    /// Computes the table of a section.
    #[must_use]
    pub fn from_section(section: &BladeSection) -> Self {
        let entry = |(at, (key, value, equation))| {
            let changes = section.present_keys().map(|input| entry_change(section, input, at));
            let variance: f64 = changes.map(|d| d * d).sum();
            BladeTableEntry { key, value, equation, relative_uncertainty: variance.sqrt() / value }
        };
        let blade = compute_entries(section).into_iter().enumerate().map(entry).collect();
        Self { title: section.title.clone(), length_m: section.number("length_m"), blade }
    }

    /// Value of the key `key` in the `[blade]` table; `None` for a key that is not in the table.
    #[must_use]
    pub fn value(&self, key: &str) -> Option<f64> {
        self.blade.iter().find(|quantity| quantity.key == key).map(|quantity| quantity.value)
    }

    /// The table as TOML for a scene, with comments.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = format!(
            "# An estimate from the section of a blade, for the start of a fit: no measurement of the blade's motion.\n\
             # Section: {}\n\
             # Masses, inertias, stiffnesses and the preload are those of {} mm of blade, all together.\n\
             # The percentages are standard deviations from those of the inputs alone. That rubber stiffens with\n\
             # frequency, and that a link is no rigid body, comes on top.\n\
             # The head's damping does not follow from a section: add head_damping_ratio from a ring-down.\n\
             [blade]\n",
            escape_controls(&self.title),
            round_to_digits(1e3 * self.length_m, DIGITS)
        );
        for BladeTableEntry { key, value, relative_uncertainty, equation } in &self.blade {
            let value = round_to_digits(*value, DIGITS);
            let percent = round_to_digits(100.0 * relative_uncertainty, 2);
            let _ = writeln!(text, "{key} = {value:?} # +-{percent} %: {equation}"); // a String never fails
        }
        text
    }
}

/// Key, value and equation of every entry.
fn compute_entries(section: &BladeSection) -> [(&'static str, f64, &'static str); COUNT] {
    let b = section.number("length_m");
    let rho = section.number("rubber.density_kg_per_m3");
    let modulus = plate_modulus_pa(section.number("rubber.youngs_modulus_pa"));
    let ratio = 0.5 * section.number("rubber.loss_factor");
    let [neck, lip] = ["neck", "lip"].map(|link| section.link_section(link));
    let bending = |link: &LinkSection| if link.hinge.is_some() { HINGE } else { BENDING };
    let stiffness = |link: &LinkSection| b * link.stiffness_n_per_rad(modulus);
    let of_head = |key: &str| b * section.number(key);
    [
        ("head_mass_kg", of_head("head.mass_kg_per_m"), "head.mass_kg_per_m b"),
        ("neck_mass_kg", rho * b * neck.area_m2(), MASS),
        ("lip_mass_kg", rho * b * lip.area_m2(), MASS),
        ("neck_length_m", neck.height_m, "neck.height_m"),
        ("lip_length_m", lip.height_m, "lip.height_m"),
        ("neck_centre_m", neck.centre_m(), CENTRE),
        ("lip_centre_m", lip.centre_m(), CENTRE),
        ("neck_inertia_kg_m2", rho * b * neck.polar_moment_m4(), INERTIA),
        ("lip_inertia_kg_m2", rho * b * lip.polar_moment_m4(), INERTIA),
        ("head_stiffness_n_per_m", of_head("head.stiffness_n_per_m2"), "head.stiffness_n_per_m2 b"),
        ("neck_stiffness_n_m_per_rad", stiffness(&neck), bending(&neck)),
        ("lip_stiffness_n_m_per_rad", stiffness(&lip), bending(&lip)),
        ("neck_damping_ratio", ratio, RATIO),
        ("lip_damping_ratio", ratio, RATIO),
        ("preload_force_n", of_head("head.press_force_n_per_m"), "head.press_force_n_per_m b"),
    ]
}

/// Change of the entry with index `at` if an input changes by one standard deviation; computed by a central
/// difference.
fn entry_change(section: &BladeSection, input: &SectionKey, at: usize) -> f64 {
    let value = section.number(input.name);
    let deviation = match input.deviation {
        InputDeviation::Absolute(deviation) => deviation,
        InputDeviation::Relative(share) => share * value,
    };
    let (low, high) = ((value - deviation).max(LEAST_SHARE * value), value + deviation);
    let moved = |value: f64| compute_entries(&section.with_value(input.name, value))[at].1;
    (moved(high) - moved(low)) / (high - low) * deviation
}

/// Poisson's ratio of rubber: its volume hardly changes.
const POISSON_RATIO: f64 = 0.5;
/// Number of parts of the bending integral of a link; each part is integrated by the five-point
/// Gauss-Legendre rule. The relative error is 1e-12 for a link that is 20 times thinner at its edge than at
/// its top.
const PARTS: u32 = 256;

/// Modulus of a wide plate, `E/(1 - nu^2)`, Pa, from Young's modulus `E`, Pa.
#[must_use]
pub fn plate_modulus_pa(youngs_modulus_pa: f64) -> f64 {
    youngs_modulus_pa / (1.0 - POISSON_RATIO * POISSON_RATIO)
}

/// Trapezoidal section of a link; dimensions in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkSection {
    /// Height `h` of the link, from its hinge to the next hinge or to the edge.
    pub height_m: f64,
    /// Thickness `t1` at the top of the link.
    pub top_thickness_m: f64,
    /// Thickness `t2` at the bottom of the link.
    pub bottom_thickness_m: f64,
    /// Hinge at the top of the link, if it has one.
    pub hinge: Option<RubberHinge>,
}

/// A thin strip of rubber that bends in place of the link below it; dimensions in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RubberHinge {
    /// Thickness `t` of the hinge.
    pub thickness_m: f64,
    /// Height `L` of the hinge.
    pub height_m: f64,
}

impl RubberHinge {
    /// Stiffness of the hinge under a moment, per length of blade, N m/rad/m: `E' t^3/(12 L)`.
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

    /// Distance of the centroid of the section from the top of the link, m: `h (t1 + 2 t2)/(3 (t1 + t2))`.
    #[must_use]
    pub fn centre_m(&self) -> f64 {
        let (t1, t2) = (self.top_thickness_m, self.bottom_thickness_m);
        self.height_m * (t1 + 2.0 * t2) / (3.0 * (t1 + t2))
    }

    /// Polar second moment of the section's area about its centroid, m4. Multiplied by density and length of
    /// blade, it is the moment of inertia of the link.
    #[must_use]
    pub fn polar_moment_m4(&self) -> f64 {
        let (h, t1, t2) = (self.height_m, self.top_thickness_m, self.bottom_thickness_m);
        powi(h, 3) * (t1 * t1 + 4.0 * t1 * t2 + t2 * t2) / (36.0 * (t1 + t2))
            + h * (t1 + t2) * (t1 * t1 + t2 * t2) / 48.0
    }

    /// Stiffness of the model's spring at the top of the link, per length of blade, N m/rad/m: the stiffness
    /// of the hinge, or that of the link's bending under a force at its bottom.
    #[must_use]
    pub fn stiffness_n_per_rad(&self, plate_modulus_pa: f64) -> f64 {
        match self.hinge {
            Some(hinge) => hinge.stiffness_n_per_rad(plate_modulus_pa),
            None => plate_modulus_pa * powi(self.height_m, 2) / (12.0 * self.bending_integral()),
        }
    }

    /// Integral `int_0^h s^2/t(s)^3 ds` of the bending of the link, dimensionless; `s` is the height above
    /// the bottom and `t(s)` the thickness at that height, m.
    fn bending_integral(&self) -> f64 {
        let part = self.height_m / f64::from(PARTS);
        let (top, bottom) = (self.top_thickness_m, self.bottom_thickness_m);
        let thickness = |s: f64| bottom + (top - bottom) * s / self.height_m;
        (0..PARTS)
            .flat_map(|i| gauss_legendre::nodes_and_weights(part * f64::from(i), part * f64::from(i + 1)))
            .map(|(s, weight)| weight * s * s / powi(thickness(s), 3))
            .sum()
    }
}
