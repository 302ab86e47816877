//! The one table of a section's numbers: key, unit, how well it is usually known, and meaning.

use schemars::{Schema, json_schema};

/// How far a number that was measured with simple means may be wrong, one standard deviation.
#[derive(Debug, Clone, Copy)]
pub(super) enum InputDeviation {
    /// In the unit of the key.
    Absolute(f64),
    /// Relative to the value.
    Relative(f64),
}

/// A calliper on soft rubber, or the pixels of a picture of the section, m.
const CALLIPER: InputDeviation = InputDeviation::Absolute(5e-5);
/// A ruler along the blade, m.
const RULER: InputDeviation = InputDeviation::Absolute(5e-4);
/// Weight over volume of a piece.
const DENSITY: InputDeviation = InputDeviation::Relative(0.03);
/// Young's modulus from hardness, or from the bending of a strip.
const MODULUS: InputDeviation = InputDeviation::Relative(0.3);
/// A loss factor from a table or a ring-down of a strip.
const LOSS: InputDeviation = InputDeviation::Relative(0.3);
/// A kitchen scale and what belongs to the head.
const HEAD: InputDeviation = InputDeviation::Relative(0.05);
/// A force gauge over the way that it pushed, or the scale below a blade.
const FORCE: InputDeviation = InputDeviation::Relative(0.1);

/// What every number may be: beyond it nothing is a blade; within it no product overflows.
const LEAST_VALUE: f64 = 1e-9;
const GREATEST_VALUE: f64 = 1e12;

/// A row of the table.
#[derive(Debug, Clone, Copy)]
pub(super) struct SectionKey {
    pub name: &'static str,
    pub unit: &'static str,
    pub deviation: InputDeviation,
    pub meaning: &'static str,
    /// Whether a file may leave it out.
    pub optional: bool,
}

impl SectionKey {
    pub fn schema(&self) -> Schema {
        json_schema!({
            "type": "number",
            "minimum": LEAST_VALUE,
            "maximum": GREATEST_VALUE,
            "description": format!("{}, {}", self.meaning, self.unit),
        })
    }

    /// What it takes, in words.
    pub fn describe_expected(&self) -> String {
        format!("a number from {LEAST_VALUE:e} to {GREATEST_VALUE:e} ({}, {})", self.meaning, self.unit)
    }
}

const fn required_key(
    name: &'static str,
    unit: &'static str,
    deviation: InputDeviation,
    meaning: &'static str,
) -> SectionKey {
    SectionKey { name, unit, deviation, meaning, optional: false }
}

const fn optional_key(key: SectionKey) -> SectionKey {
    SectionKey { optional: true, ..key }
}

/// Every number of a section.
pub(super) const KEYS: &[SectionKey] = &[
    required_key("length_m", "m", RULER, "length of the piece of blade"),
    required_key("rubber.density_kg_per_m3", "kg/m3", DENSITY, "density of the rubber"),
    required_key("rubber.youngs_modulus_pa", "Pa", MODULUS, "Young's modulus of the rubber"),
    required_key("rubber.loss_factor", "1", LOSS, "loss factor of the rubber"),
    required_key("head.mass_kg_per_m", "kg/m", HEAD, "mass of what moves with the head, per metre of blade"),
    required_key(
        "head.stiffness_n_per_m2",
        "N/m2",
        FORCE,
        "stiffness of the head's support, N/m per metre of blade",
    ),
    required_key("head.press_force_n_per_m", "N/m", FORCE, "force on the glass per metre of blade"),
    required_key("neck.height_m", "m", CALLIPER, "height of the neck, from its hinge to that of the lip"),
    required_key("neck.top_thickness_m", "m", CALLIPER, "thickness of the neck at its top"),
    required_key("neck.bottom_thickness_m", "m", CALLIPER, "thickness of the neck at its bottom"),
    optional_key(required_key(
        "neck.hinge_thickness_m",
        "m",
        CALLIPER,
        "thickness of the hinge above the neck",
    )),
    optional_key(required_key("neck.hinge_height_m", "m", CALLIPER, "height of the hinge above the neck")),
    required_key("lip.height_m", "m", CALLIPER, "height of the lip, from its hinge to the edge"),
    required_key("lip.top_thickness_m", "m", CALLIPER, "thickness of the lip at its top"),
    required_key("lip.bottom_thickness_m", "m", CALLIPER, "thickness of the lip at its edge"),
    optional_key(required_key(
        "lip.hinge_thickness_m",
        "m",
        CALLIPER,
        "thickness of the hinge above the lip",
    )),
    optional_key(required_key("lip.hinge_height_m", "m", CALLIPER, "height of the hinge above the lip")),
];
