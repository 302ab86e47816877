//! `section.toml` as people write it and as validated.

use super::keys::{KEYS, Key};
use super::shape::{Hinge, LinkSection};
use crate::plausibility::{self, Finding};
use crate::toml_file::{self, TomlError};
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::{Spanned, Value};

/// Why a section was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SectionError {
    /// The file is not TOML of this format.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// A key is unknown, missing, no number or out of range.
    #[error("{place}: key `{key}`: found {found}, expected {expected}; {advice}")]
    Key {
        /// File, with the line where there is one.
        place: String,
        /// Table and key.
        key: String,
        /// What the file says.
        found: String,
        /// What the key takes.
        expected: String,
        /// What to do.
        advice: String,
    },
}

type Numbers = BTreeMap<String, Spanned<Value>>;

/// As written: the table of keys says what each number may be, so that the schema leaves them open.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SectionFile {
    format: u32,
    title: String,
    #[schemars(with = "Option<serde_json::Value>")]
    length_m: Option<Spanned<Value>>,
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    #[serde(default)]
    rubber: Numbers,
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    #[serde(default)]
    head: Numbers,
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    #[serde(default)]
    neck: Numbers,
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    #[serde(default)]
    lip: Numbers,
}

/// A validated section: every number that the file has, by key.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    title: String,
    values: BTreeMap<&'static str, f64>,
}

impl Section {
    /// Reads and validates a section; `file` is the name used in refusals.
    ///
    /// # Errors
    /// [`SectionError`] with file, line, key, what was found, what was expected and what to do.
    pub fn parse(file: &str, text: &str) -> Result<Self, SectionError> {
        let written: SectionFile = toml_file::parse(file, text)?;
        toml_file::check_format(file, written.format)?;
        let length = written.length_m.map(|value| ("length_m".to_owned(), value));
        let tables = [
            ("rubber", written.rubber),
            ("head", written.head),
            ("neck", written.neck),
            ("lip", written.lip),
        ];
        let numbers = tables.into_iter().flat_map(|(table, numbers)| {
            numbers.into_iter().map(move |(key, value)| (format!("{table}.{key}"), value))
        });
        let values = length.into_iter().chain(numbers).map(|(name, value)| {
            let (line, _) = toml_file::line_and_column(text, value.span().start);
            let written = text.get(value.span()).unwrap_or_default();
            number(&format!("{file}:{line}"), &name, value.get_ref(), written)
        });
        let values = values.collect::<Result<BTreeMap<_, _>, _>>()?;
        check_complete(file, &values)?;
        Ok(Self { title: written.title, values })
    }

    /// Title of the section.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Length of the piece of blade, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.number("length_m")
    }

    /// What is hard to believe in it.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        let value = |key: &str| self.values.get(key).copied();
        plausibility::findings(plausibility::SECTION, &value, &|key| key)
    }

    /// The neck.
    #[must_use]
    pub fn neck(&self) -> LinkSection {
        self.link("neck")
    }

    /// The lip.
    #[must_use]
    pub fn lip(&self) -> LinkSection {
        self.link("lip")
    }

    pub(super) fn number(&self, key: &str) -> f64 {
        self.values.get(key).copied().unwrap_or(0.0) // completeness was checked
    }

    /// The keys that the file has.
    pub(super) fn keys(&self) -> impl Iterator<Item = &'static Key> {
        KEYS.iter().filter(|key| self.values.contains_key(key.name))
    }

    /// The same section with another value, admissible or not: for differences.
    pub(super) fn with(&self, key: &'static str, value: f64) -> Self {
        let mut section = self.clone();
        section.values.insert(key, value);
        section
    }

    fn link(&self, table: &str) -> LinkSection {
        let of = |key: &str| self.values.get(format!("{table}.{key}").as_str()).copied();
        let number = |key: &str| of(key).unwrap_or(0.0); // completeness was checked
        let hinge = of("hinge_thickness_m").zip(of("hinge_height_m"));
        LinkSection {
            height_m: number("height_m"),
            top_thickness_m: number("top_thickness_m"),
            bottom_thickness_m: number("bottom_thickness_m"),
            hinge: hinge.map(|(thickness_m, height_m)| Hinge { thickness_m, height_m }),
        }
    }
}

fn refuse<T>(place: &str, key: &str, found: &str, expected: &str, advice: &str) -> Result<T, SectionError> {
    let [place, key, found, expected, advice] = [place, key, found, expected, advice].map(str::to_owned);
    Err(SectionError::Key { place, key, found, expected, advice })
}

/// A number of the table, from its value and from what the file says.
fn number(
    place: &str,
    name: &str,
    value: &Value,
    written: &str,
) -> Result<(&'static str, f64), SectionError> {
    let Some(key) = KEYS.iter().find(|key| key.name == name) else {
        let table = name.split_once('.').map_or("", |(table, _)| table);
        let known: Vec<&str> =
            KEYS.iter().map(|key| key.name).filter(|known| known.split('.').next() == Some(table)).collect();
        let advice = toml_file::nearest(name, &known);
        return refuse(place, name, "an unknown key", "a key of the section format", &advice);
    };
    let expected = key.expected();
    let found = match value {
        Value::Float(number) => *number,
        Value::Integer(number) => *number as f64,
        other => {
            let advice = format!("write the number alone; the unit is {}", key.unit);
            return refuse(place, name, &shown(other), &expected, &advice);
        }
    };
    if key.admits(found) {
        return Ok((key.name, found));
    }
    refuse(place, name, written, &expected, "correct the value")
}

/// A value that is no number.
fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => format!("the text {text:?}"),
        Value::Boolean(value) => value.to_string(),
        Value::Array(_) => "a list".to_owned(),
        Value::Table(_) => "a table".to_owned(),
        other => other.to_string(),
    }
}

/// Every key is given that has to be, and a hinge has both of its own.
fn check_complete(file: &str, values: &BTreeMap<&'static str, f64>) -> Result<(), SectionError> {
    let hinge_of = |name: &str| name.split_once(".hinge_").map(|(link, _)| link.to_owned());
    let hinged = |link: &str| values.keys().any(|name| hinge_of(name).as_deref() == Some(link));
    for key in KEYS.iter().filter(|key| !values.contains_key(key.name)) {
        let half_a_hinge = hinge_of(key.name).is_some_and(|link| hinged(&link));
        if !key.optional || half_a_hinge {
            let expected = key.expected();
            let advice = if half_a_hinge { "add it, or leave the hinge out" } else { "add it" };
            return refuse(file, key.name, "nothing", &expected, advice);
        }
    }
    Ok(())
}
