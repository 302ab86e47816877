//! The `[blade]` table that follows from a section, with the equation and the uncertainty of each number.

use super::input::BladeSection;
use super::keys::{InputDeviation, SectionKey};
use super::shape::{LinkSection, plate_modulus_pa};
use crate::text::{escape_controls, round_to_digits};
use serde::Serialize;
use std::fmt::Write;

/// Significant digits of a number in the table: more than any of them is known to.
const DIGITS: usize = 4;
/// Numbers of the table.
const COUNT: usize = 15;
/// A dimension that may be wrong by more than itself is varied down to this share of it, as it stays above
/// zero.
const LEAST_SHARE: f64 = 0.1;

/// A number of the `[blade]` table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BladeTableEntry {
    /// Key in the table.
    pub key: &'static str,
    /// Value, in the unit of the key.
    pub value: f64,
    /// Standard deviation over the value: from those of the inputs alone.
    pub relative_uncertainty: f64,
    /// How it follows from the section; letters of [`crate::section`], `b` is `length_m`.
    pub equation: &'static str,
}

/// The `[blade]` table of a section.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BladeEstimate {
    /// Title of the section.
    pub title: String,
    /// Length of blade that every number is for, m.
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
    /// Of a section.
    #[must_use]
    pub fn from_section(section: &BladeSection) -> Self {
        let numbers = compute_entries(section);
        let blade = numbers.iter().enumerate().map(|(at, &(key, value, equation))| {
            let variance: f64 =
                section.present_keys().map(|input| entry_change(section, input, at)).map(|d| d * d).sum();
            BladeTableEntry { key, value, equation, relative_uncertainty: variance.sqrt() / value }
        });
        Self { title: section.title().to_owned(), length_m: section.length_m(), blade: blade.collect() }
    }

    /// The value of a key of the table.
    #[must_use]
    pub fn value(&self, key: &str) -> Option<f64> {
        self.blade.iter().find(|quantity| quantity.key == key).map(|quantity| quantity.value)
    }

    /// The table as a scene has it, with comments.
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
            let (value, percent) =
                (round_to_digits(*value, DIGITS), round_to_digits(100.0 * relative_uncertainty, 2));
            let _ = writeln!(text, "{key} = {value:?} # +-{percent} %: {equation}"); // cannot fail
        }
        text
    }
}

/// Key, value and equation of every number.
fn compute_entries(section: &BladeSection) -> [(&'static str, f64, &'static str); COUNT] {
    let b = section.length_m();
    let rho = section.number("rubber.density_kg_per_m3");
    let modulus = plate_modulus_pa(section.number("rubber.youngs_modulus_pa"));
    let ratio = 0.5 * section.number("rubber.loss_factor");
    let (neck, lip) = (section.neck(), section.lip());
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

/// How far a standard deviation of an input moves the number `at`, from a central difference over it.
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
