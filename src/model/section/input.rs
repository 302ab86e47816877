//! Reads and validates the file `section.toml`.

use super::{LinkSection, RubberHinge};
use crate::model::plausibility::{self, PlausibilityFinding};
use crate::toml_file::{self, TomlError};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// Why a section was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SectionError {
    /// The file is not TOML of this format.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// The file has only one of the two dimensions of a hinge.
    #[error("{file}: key `{key}`: found nothing, expected {expected}; add it, or leave the hinge out")]
    HalfAHinge {
        /// File as named by the user.
        file: String,
        /// Table and key that is missing.
        key: &'static str,
        /// Range, meaning and unit of the key.
        expected: String,
    },
}

/// The section of a blade, from which `wiperlab blade` computes the table of a scene.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "section.toml")]
struct SectionFile {
    /// Version of the format: 1.
    format: u32,
    /// Title of the section.
    title: String,
    #[schemars(schema_with = "length")]
    length_m: f64,
    /// The rubber of neck and lip.
    #[schemars(schema_with = "number_table::<0>")]
    rubber: BTreeMap<String, f64>,
    /// Parts that move with the head, per metre of blade.
    #[schemars(schema_with = "number_table::<1>")]
    head: BTreeMap<String, f64>,
    /// The neck.
    #[schemars(schema_with = "number_table::<2>")]
    neck: BTreeMap<String, f64>,
    /// The lip.
    #[schemars(schema_with = "number_table::<3>")]
    lip: BTreeMap<String, f64>,
}

fn length(_: &mut SchemaGenerator) -> Schema {
    KEYS.iter().find(|key| key.name == "length_m").map_or_else(Schema::default, SectionKey::schema)
}

const TABLES: [&str; 4] = ["rubber", "head", "neck", "lip"];

/// Schema of the keys of one of the [`TABLES`].
fn number_table<const TABLE: usize>(_: &mut SchemaGenerator) -> Schema {
    let keys = || KEYS.iter().filter_map(|key| Some((key.name.split_once('.')?, key)));
    let keys = || keys().filter(|((of, _), _)| *of == TABLES[TABLE]);
    let required: Vec<&str> = keys().filter(|(_, key)| !key.optional).map(|((_, name), _)| name).collect();
    let schemas = keys().map(|((_, name), key)| (name.to_owned(), key.schema().to_value()));
    toml_file::table_schema(schemas, &required)
}

/// A validated section: its title and its numbers by key.
#[derive(Debug, Clone, PartialEq)]
pub struct BladeSection {
    pub(super) title: String,
    values: BTreeMap<&'static str, f64>,
}

impl BladeSection {
    /// Reads and validates a section; `file` is the name used in refusals.
    ///
    /// # Errors
    /// [`SectionError`] with file, line, key, what was found, what was expected and what to do.
    pub fn parse(file: &str, text: &str) -> Result<Self, SectionError> {
        let written: SectionFile = toml_file::parse_toml(file, text)?;
        toml_file::check_format(file, written.format)?;
        let tables = TABLES.into_iter().zip([written.rubber, written.head, written.neck, written.lip]);
        let numbers = tables.flat_map(|(table, numbers)| {
            numbers.into_iter().map(move |(key, value)| (format!("{table}.{key}"), value))
        });
        let numbers = numbers.chain([("length_m".to_owned(), written.length_m)]);
        // (the schema allows exactly the keys in `KEYS`, so that no number is dropped)
        let known =
            |(name, value): (String, f64)| Some((KEYS.iter().find(|key| key.name == name)?.name, value));
        let values = numbers.filter_map(known).collect();
        check_hinges(file, &values)?;
        Ok(Self { title: written.title, values })
    }

    /// JSON Schema of section.toml, for editors and messages.
    #[must_use]
    pub fn schema() -> Value {
        toml_file::schema_of::<SectionFile>()
    }

    /// Findings on numbers outside their plausible range.
    #[must_use]
    pub fn find_implausible(&self) -> Vec<PlausibilityFinding> {
        let value = |key: &str| self.values.get(key).copied();
        plausibility::find_implausible(plausibility::SECTION_RANGES, &value, &|key| key)
    }

    pub(super) fn number(&self, key: &str) -> f64 {
        self.values.get(key).copied().unwrap_or(0.0) // completeness was checked
    }

    /// Keys that the file contains.
    pub(super) fn present_keys(&self) -> impl Iterator<Item = &'static SectionKey> {
        KEYS.iter().filter(|key| self.values.contains_key(key.name))
    }

    /// The same section with another value of one key, for finite differences; the value is not checked.
    pub(super) fn with_value(&self, key: &'static str, value: f64) -> Self {
        let mut section = self.clone();
        section.values.insert(key, value);
        section
    }

    /// Cross section of a link; `table` is the name of its table in the file, which belongs to the neck or
    /// the lip.
    pub(super) fn link_section(&self, table: &str) -> LinkSection {
        let of = |key: &str| self.values.get(format!("{table}.{key}").as_str()).copied();
        let number = |key: &str| of(key).unwrap_or(0.0); // completeness was checked
        let hinge = of("hinge_thickness_m").zip(of("hinge_height_m"));
        LinkSection {
            height_m: number("height_m"),
            top_thickness_m: number("top_thickness_m"),
            bottom_thickness_m: number("bottom_thickness_m"),
            hinge: hinge.map(|(thickness_m, height_m)| RubberHinge { thickness_m, height_m }),
        }
    }
}

/// Checks that each hinge has both of its dimensions or neither.
fn check_hinges(file: &str, values: &BTreeMap<&'static str, f64>) -> Result<(), SectionError> {
    let hinge_of = |name: &str| name.split_once(".hinge_").map(|(link, _)| link.to_owned());
    let hinged = |link: &str| values.keys().any(|name| hinge_of(name).as_deref() == Some(link));
    let mut absent = KEYS.iter().filter(|key| !values.contains_key(key.name));
    let half = absent.find(|key| hinge_of(key.name).is_some_and(|link| hinged(&link)));
    let Some(SectionKey { name: key, unit, meaning, .. }) = half else { return Ok(()) };
    let expected = format!("a number from {LEAST_VALUE:e} to {GREATEST_VALUE:e} ({meaning}, {unit})");
    Err(SectionError::HalfAHinge { file: file.to_owned(), key, expected })
}

/// Standard deviation of an input number that is measured with simple means.
#[derive(Debug, Clone, Copy)]
pub(super) enum InputDeviation {
    /// In the unit of the key.
    Absolute(f64),
    /// Relative to the value.
    Relative(f64),
}

/// Standard deviation of a dimension measured with a calliper on soft rubber, or in a picture of the section,
/// m.
const CALLIPER: InputDeviation = InputDeviation::Absolute(5e-5);
/// Standard deviation of a length measured with a ruler along the blade, m.
const RULER: InputDeviation = InputDeviation::Absolute(5e-4);
/// Standard deviation of a density from the weight and the volume of a piece.
const DENSITY: InputDeviation = InputDeviation::Relative(0.03);
/// Standard deviation of Young's modulus from the hardness, or from the bending of a strip.
const MODULUS: InputDeviation = InputDeviation::Relative(0.3);
/// Standard deviation of a loss factor from a table, or from the ring-down of a strip.
const LOSS: InputDeviation = InputDeviation::Relative(0.3);
/// Standard deviation of the head's mass, measured with a kitchen scale; it is uncertain which parts move
/// with the head.
const HEAD: InputDeviation = InputDeviation::Relative(0.05);
/// Standard deviation of a force or a stiffness measured with a force gauge, or with a scale below the blade.
const FORCE: InputDeviation = InputDeviation::Relative(0.1);

/// Lower limit of every number of a section, in the unit of its key; `GREATEST_VALUE` is the upper limit. The
/// numbers of every real blade are within these limits, and no product of such numbers overflows.
const LEAST_VALUE: f64 = 1e-9;
const GREATEST_VALUE: f64 = 1e12;

/// A row of the table of keys.
#[derive(Debug, Clone, Copy)]
pub(super) struct SectionKey {
    pub name: &'static str,
    pub unit: &'static str,
    pub deviation: InputDeviation,
    pub meaning: &'static str,
    /// Whether a file may leave out the key.
    pub optional: bool,
}

impl SectionKey {
    pub(crate) fn schema(&self) -> Schema {
        json_schema!({
            "type": "number",
            "minimum": LEAST_VALUE,
            "maximum": GREATEST_VALUE,
            "description": format!("{}, {}", self.meaning, self.unit),
        })
    }
}

/// Makes the rows from key, unit, deviation and meaning; the row of an optional key ends with `optional`.
macro_rules! section_keys {
    (@optional) => { false };
    (@optional optional) => { true };
    ($($name:literal $unit:literal $deviation:expr, $meaning:literal $($optional:ident)?;)*) => {
        /// Every number of a section.
        pub(super) const KEYS: &[SectionKey] = &[$(SectionKey {
            name: $name, unit: $unit, deviation: $deviation, meaning: $meaning,
            optional: section_keys!(@optional $($optional)?),
        }),*];
    };
}

section_keys! {
    "length_m" "m" RULER, "length of the piece of blade";
    "rubber.density_kg_per_m3" "kg/m3" DENSITY, "density of the rubber";
    "rubber.youngs_modulus_pa" "Pa" MODULUS, "Young's modulus of the rubber";
    "rubber.loss_factor" "1" LOSS, "loss factor of the rubber";
    "head.mass_kg_per_m" "kg/m" HEAD, "mass of what moves with the head, per metre of blade";
    "head.stiffness_n_per_m2" "N/m2" FORCE, "stiffness of the head's support, N/m per metre of blade";
    "head.press_force_n_per_m" "N/m" FORCE, "force on the glass per metre of blade";
    "neck.height_m" "m" CALLIPER, "height of the neck, from its hinge to that of the lip";
    "neck.top_thickness_m" "m" CALLIPER, "thickness of the neck at its top";
    "neck.bottom_thickness_m" "m" CALLIPER, "thickness of the neck at its bottom";
    "neck.hinge_thickness_m" "m" CALLIPER, "thickness of the hinge above the neck" optional;
    "neck.hinge_height_m" "m" CALLIPER, "height of the hinge above the neck" optional;
    "lip.height_m" "m" CALLIPER, "height of the lip, from its hinge to the edge";
    "lip.top_thickness_m" "m" CALLIPER, "thickness of the lip at its top";
    "lip.bottom_thickness_m" "m" CALLIPER, "thickness of the lip at its edge";
    "lip.hinge_thickness_m" "m" CALLIPER, "thickness of the hinge above the lip" optional;
    "lip.hinge_height_m" "m" CALLIPER, "height of the hinge above the lip" optional;
}
