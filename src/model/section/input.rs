//! `section.toml` as people write it and as validated.

use super::{LinkSection, RubberHinge};
use crate::model::plausibility;
use crate::model::plausibility::PlausibilityFinding;
use crate::toml_file;
use crate::toml_file::TomlError;
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
    /// One dimension of a hinge without the other.
    #[error("{file}: key `{key}`: found nothing, expected {expected}; add it, or leave the hinge out")]
    HalfAHinge {
        /// File as named by the user.
        file: String,
        /// Table and key.
        key: &'static str,
        /// What the key takes.
        expected: String,
    },
}

type SectionNumbers = BTreeMap<String, f64>;

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
    #[schemars(schema_with = "rubber")]
    rubber: SectionNumbers,
    /// What moves with the head, per metre of blade.
    #[schemars(schema_with = "head")]
    head: SectionNumbers,
    /// The neck.
    #[schemars(schema_with = "neck")]
    neck: SectionNumbers,
    /// The lip.
    #[schemars(schema_with = "lip")]
    lip: SectionNumbers,
}

fn length(_: &mut SchemaGenerator) -> Schema {
    KEYS.iter().find(|key| key.name == "length_m").map_or_else(Schema::default, SectionKey::schema)
}

fn rubber(_: &mut SchemaGenerator) -> Schema {
    number_table_schema("rubber")
}

fn head(_: &mut SchemaGenerator) -> Schema {
    number_table_schema("head")
}

fn neck(_: &mut SchemaGenerator) -> Schema {
    number_table_schema("neck")
}

fn lip(_: &mut SchemaGenerator) -> Schema {
    number_table_schema("lip")
}

/// The keys of a table.
fn number_table_schema(table: &str) -> Schema {
    let keys = || KEYS.iter().filter_map(|key| Some((key.name.split_once('.')?, key)));
    let keys = || keys().filter(|((of, _), _)| *of == table);
    let required: Vec<&str> = keys().filter(|(_, key)| !key.optional).map(|((_, name), _)| name).collect();
    toml_file::table_schema(
        keys().map(|((_, name), key)| (name.to_owned(), key.schema().to_value())),
        &required,
    )
}

/// A validated section: every number that the file has, by key.
#[derive(Debug, Clone, PartialEq)]
pub struct BladeSection {
    title: String,
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
        let tables = [
            ("rubber", written.rubber),
            ("head", written.head),
            ("neck", written.neck),
            ("lip", written.lip),
        ];
        let numbers = tables.into_iter().flat_map(|(table, numbers)| {
            numbers.into_iter().map(move |(key, value)| (format!("{table}.{key}"), value))
        });
        let numbers = numbers.chain([("length_m".to_owned(), written.length_m)]);
        // (the schema knows the same keys)
        let known =
            |(name, value): (String, f64)| Some((KEYS.iter().find(|key| key.name == name)?.name, value));
        let values = numbers.filter_map(known).collect();
        check_hinges(file, &values)?;
        Ok(Self { title: written.title, values })
    }

    /// The JSON Schema of section.toml: for editors, and for messages.
    #[must_use]
    pub fn schema() -> Value {
        toml_file::schema_of::<SectionFile>()
    }

    /// Title of the section.
    pub(crate) fn title(&self) -> &str {
        &self.title
    }

    /// Length of the piece of blade, m.
    pub(crate) fn length_m(&self) -> f64 {
        self.number("length_m")
    }

    /// What is hard to believe in it.
    #[must_use]
    pub fn find_implausible(&self) -> Vec<PlausibilityFinding> {
        let value = |key: &str| self.values.get(key).copied();
        plausibility::find_implausible(plausibility::SECTION_RANGES, &value, &|key| key)
    }

    pub(crate) fn neck(&self) -> LinkSection {
        self.link_section("neck")
    }

    pub(crate) fn lip(&self) -> LinkSection {
        self.link_section("lip")
    }

    pub(super) fn number(&self, key: &str) -> f64 {
        self.values.get(key).copied().unwrap_or(0.0) // completeness was checked
    }

    /// The keys that the file has.
    pub(super) fn present_keys(&self) -> impl Iterator<Item = &'static SectionKey> {
        KEYS.iter().filter(|key| self.values.contains_key(key.name))
    }

    /// The same section with another value, admissible or not: for differences.
    pub(super) fn with_value(&self, key: &'static str, value: f64) -> Self {
        let mut section = self.clone();
        section.values.insert(key, value);
        section
    }

    fn link_section(&self, table: &str) -> LinkSection {
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

/// A hinge has both of its dimensions or none.
fn check_hinges(file: &str, values: &BTreeMap<&'static str, f64>) -> Result<(), SectionError> {
    let hinge_of = |name: &str| name.split_once(".hinge_").map(|(link, _)| link.to_owned());
    let hinged = |link: &str| values.keys().any(|name| hinge_of(name).as_deref() == Some(link));
    let absent = KEYS.iter().filter(|key| !values.contains_key(key.name));
    let half = absent.into_iter().find(|key| hinge_of(key.name).is_some_and(|link| hinged(&link)));
    half.map_or(Ok(()), |key| {
        Err(SectionError::HalfAHinge {
            file: file.to_owned(),
            key: key.name,
            expected: key.describe_expected(),
        })
    })
}

// The one table of a section's numbers: key, unit, how well it is usually known, and meaning.

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
    pub(crate) fn schema(&self) -> Schema {
        json_schema!({
            "type": "number",
            "minimum": LEAST_VALUE,
            "maximum": GREATEST_VALUE,
            "description": format!("{}, {}", self.meaning, self.unit),
        })
    }

    /// What it takes, in words.
    pub(crate) fn describe_expected(&self) -> String {
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
