//! The one table of a section's numbers: key, unit, how well it is usually known, and meaning.

use schemars::{Schema, json_schema};

/// How far a number that was measured with simple means may be wrong, one standard deviation.
#[derive(Debug, Clone, Copy)]
pub(super) enum Deviation {
    /// In the unit of the key.
    Absolute(f64),
    /// Relative to the value.
    Relative(f64),
}

/// A calliper on soft rubber, or the pixels of a picture of the section, m.
const CALLIPER: Deviation = Deviation::Absolute(5e-5);
/// A ruler along the blade, m.
const RULER: Deviation = Deviation::Absolute(5e-4);
/// Weight over volume of a piece.
const DENSITY: Deviation = Deviation::Relative(0.03);
/// Young's modulus from hardness, or from the bending of a strip.
const MODULUS: Deviation = Deviation::Relative(0.3);
/// A loss factor from a table or a ring-down of a strip.
const LOSS: Deviation = Deviation::Relative(0.3);
/// A kitchen scale and what belongs to the head.
const HEAD: Deviation = Deviation::Relative(0.05);
/// A force gauge over the way that it pushed, or the scale below a blade.
const FORCE: Deviation = Deviation::Relative(0.1);

/// What every number may be: beyond it nothing is a blade; within it no product overflows.
const LEAST: f64 = 1e-9;
const GREATEST: f64 = 1e12;

/// A row of the table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Key {
    pub name: &'static str,
    pub unit: &'static str,
    pub deviation: Deviation,
    pub meaning: &'static str,
    /// Whether a file may leave it out.
    pub optional: bool,
}

impl Key {
    pub fn schema(&self) -> Schema {
        json_schema!({
            "type": "number",
            "minimum": LEAST,
            "maximum": GREATEST,
            "description": format!("{}, {}", self.meaning, self.unit),
        })
    }

    /// What it takes, in words.
    pub fn expected(&self) -> String {
        format!("a number from {LEAST:e} to {GREATEST:e} ({}, {})", self.meaning, self.unit)
    }
}

const fn key(name: &'static str, unit: &'static str, deviation: Deviation, meaning: &'static str) -> Key {
    Key { name, unit, deviation, meaning, optional: false }
}

const fn optional(key: Key) -> Key {
    Key { optional: true, ..key }
}

/// Every number of a section.
pub(super) const KEYS: &[Key] = &[
    key("length_m", "m", RULER, "length of the piece of blade"),
    key("rubber.density_kg_per_m3", "kg/m3", DENSITY, "density of the rubber"),
    key("rubber.youngs_modulus_pa", "Pa", MODULUS, "Young's modulus of the rubber"),
    key("rubber.loss_factor", "1", LOSS, "loss factor of the rubber"),
    key("head.mass_kg_per_m", "kg/m", HEAD, "mass of what moves with the head, per metre of blade"),
    key("head.stiffness_n_per_m2", "N/m2", FORCE, "stiffness of the head's support, N/m per metre of blade"),
    key("head.press_force_n_per_m", "N/m", FORCE, "force on the glass per metre of blade"),
    key("neck.height_m", "m", CALLIPER, "height of the neck, from its hinge to that of the lip"),
    key("neck.top_thickness_m", "m", CALLIPER, "thickness of the neck at its top"),
    key("neck.bottom_thickness_m", "m", CALLIPER, "thickness of the neck at its bottom"),
    optional(key("neck.hinge_thickness_m", "m", CALLIPER, "thickness of the hinge above the neck")),
    optional(key("neck.hinge_height_m", "m", CALLIPER, "height of the hinge above the neck")),
    key("lip.height_m", "m", CALLIPER, "height of the lip, from its hinge to the edge"),
    key("lip.top_thickness_m", "m", CALLIPER, "thickness of the lip at its top"),
    key("lip.bottom_thickness_m", "m", CALLIPER, "thickness of the lip at its edge"),
    optional(key("lip.hinge_thickness_m", "m", CALLIPER, "thickness of the hinge above the lip")),
    optional(key("lip.hinge_height_m", "m", CALLIPER, "height of the hinge above the lip")),
];
