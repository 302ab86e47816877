//! Reads TOML files into typed values. Every error states file, line, column, key and the nearest known key,
//! and all problems of a file are listed together.

mod hint;
mod key_reference;
mod schema_check;

pub use key_reference::{KeyEntry, KeyTable, list_key_tables};

use crate::text::escape_controls;
use schemars::{JsonSchema, Schema, json_schema, schema_for};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Reason why a TOML file was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TomlError {
    /// The text is not TOML, or a value has the wrong type.
    #[error("{file}:{line}:{column}: {problem}")]
    Syntax {
        /// File as named by the user.
        file: String,
        /// 1-based line.
        line: usize,
        /// 1-based column, in characters.
        column: usize,
        /// Problem: what was found and what was expected.
        problem: String,
    },
    /// A key that the format does not have.
    #[error("{file}:{line}:{column}: unknown key `{key}`; {advice}")]
    UnknownKey {
        /// File as named by the user.
        file: String,
        /// 1-based line.
        line: usize,
        /// 1-based column, in characters.
        column: usize,
        /// The key that was found.
        key: String,
        /// The nearest known key, or the list of known keys.
        advice: String,
    },
    /// More than one problem, in the order of the lines.
    #[error("{}", lines(.0))]
    Several(Vec<TomlError>),
    /// The file declares a version of the format that this program does not read.
    #[error(
        "{file}: key `format`: found {found}, expected {expected}; convert the file or use the version of wiperlab that wrote it"
    )]
    Format {
        /// File as named by the user.
        file: String,
        /// The declared version.
        found: u32,
        /// The version that this program reads.
        expected: u32,
    },
}

/// Version of every TOML format of this program.
pub const FORMAT: u32 = 1;

/// Reads `text` as `T`; errors call it `file`.
///
/// # Errors
/// [`TomlError`] with the places of all problems that the schema of `T` shows; otherwise with the first
/// problem.
pub(crate) fn parse_toml<T: DeserializeOwned + JsonSchema>(file: &str, text: &str) -> Result<T, TomlError> {
    let mut problems = schema_check::find_problems(file, text, schema_for!(T).as_value());
    match problems.len() {
        0 => toml::from_str(text).map_err(|error| error_from_toml(file, text, &error)),
        1 => Err(problems.remove(0)),
        _ => Err(TomlError::Several(problems)),
    }
}

/// The JSON Schema of a file that is read as `T`.
pub(crate) fn schema_of<T: JsonSchema>() -> serde_json::Value {
    schema_for!(T).to_value()
}

/// Makes the schema of a table from its keys, each with the schema of its value, and from the names of the
/// required keys.
pub(crate) fn table_schema(
    keys: impl IntoIterator<Item = (String, serde_json::Value)>,
    required: &[&str],
) -> Schema {
    json_schema!({
        "type": "object",
        "properties": keys.into_iter().collect::<serde_json::Map<_, _>>(),
        "required": required,
        "additionalProperties": false,
    })
}

/// Reads `text` as a table with any keys.
///
/// # Errors
/// [`TomlError`] with the place of the first syntax error.
pub(crate) fn parse_table(file: &str, text: &str) -> Result<toml::Table, TomlError> {
    toml::from_str(text).map_err(|error| error_from_toml(file, text, &error))
}

/// The messages of all problems, one line for each problem; control characters in quoted text are escaped.
fn lines(problems: &[TomlError]) -> String {
    problems.iter().map(|problem| escape_controls(&problem.to_string())).collect::<Vec<_>>().join("\n")
}

/// Checks the key `format` at the start of every file.
///
/// # Errors
/// [`TomlError::Format`] unless the version is [`FORMAT`].
pub(crate) fn check_format(file: &str, found: u32) -> Result<(), TomlError> {
    if found == FORMAT {
        return Ok(());
    }
    Err(TomlError::Format { file: file.to_owned(), found, expected: FORMAT })
}

/// Two numbers, such as the ends of a band.
// not `[f64; 2]`, which would accept the first two of three numbers
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(try_from = "Vec<f64>")]
pub struct NumberPair(pub [f64; 2]);

impl TryFrom<Vec<f64>> for NumberPair {
    type Error = String;

    fn try_from(found: Vec<f64>) -> Result<Self, String> {
        let count = found.len();
        let words = |found| format!("found {found:?} ({count}), expected two numbers, as in [40.0, 140.0]");
        found.try_into().map(Self).map_err(words)
    }
}

/// A refusal of a key, without the name of the file. The first string is the key; the second says what was
/// found, what was expected and what to do.
pub(crate) type KeyRefusal = (String, String);

pub(crate) fn refuse_key<T>(key: impl Into<String>, problem: impl Into<String>) -> Result<T, KeyRefusal> {
    Err((key.into(), problem.into()))
}

pub(crate) fn check_above_zero(key: impl Into<String>, found: f64) -> Result<f64, KeyRefusal> {
    if found.is_finite() && found > 0.0 {
        return Ok(found);
    }
    refuse_key(key, format!("found {found}, expected a finite number above 0"))
}

/// Advice on an unknown key: the nearest known key, ignoring case, or all known keys.
pub(crate) fn suggest_key(key: &str, known: &[&str]) -> String {
    /// Jaro-Winkler similarity above which a known key is suggested; below it, all known keys are listed.
    const SIMILAR: f64 = 0.75;
    /// Similarity assigned to a short key with one typing error (a letter added, missing or wrong, or two
    /// letters swapped). The Jaro-Winkler similarity of short keys is far too low for this.
    const ONE_SLIP: f64 = 0.9;
    let key = key.to_lowercase();
    let one_slip = |known: &str| key.chars().count() > 2 && strsim::osa_distance(&key, known) == 1;
    let similarity = |known: &str| {
        let known = known.to_lowercase();
        strsim::jaro_winkler(&key, &known).max(if one_slip(&known) { ONE_SLIP } else { 0.0 })
    };
    let best = known.iter().map(|k| (similarity(k), *k)).max_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        Some((similarity, name)) if similarity >= SIMILAR => format!("did you mean `{name}`?"),
        _ if known.is_empty() => "no key is allowed here; remove it".to_owned(),
        _ => format!("known keys here: {}", known.join(", ")),
    }
}

/// Advice on a path in a TOML file that contains a control character because `\t` or the like was parsed as
/// an escape; empty for any other path.
pub(crate) fn path_hint(path: &str) -> &'static str {
    if path.chars().any(char::is_control) {
        "; a backslash between double quotes starts an escape: write the path with `/`, or between single quotes"
    } else {
        ""
    }
}

/// 1-based line and column of a byte offset.
pub(crate) fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..offset.min(text.len())];
    let line = before.iter().filter(|&&b| b == b'\n').count() + 1;
    let start = before.iter().rposition(|&b| b == b'\n').map_or(0, |p| p + 1);
    (line, String::from_utf8_lossy(&before[start..]).chars().count() + 1)
}

fn error_from_toml(file: &str, text: &str, error: &toml::de::Error) -> TomlError {
    let (line, column) = line_and_column(text, error.span().map_or(0, |s| s.start));
    let file = file.to_owned();
    let message = error.message();
    match split_unknown_field(message) {
        Some((key, known)) => {
            let (key, advice) = (key.to_owned(), suggest_key(key, &known));
            TomlError::UnknownKey { file, line, column, key, advice }
        }
        None => TomlError::Syntax { file, line, column, problem: message.trim().replace('\n', "; ") },
    }
}

/// Splits serde's fixed wording "unknown field `a`, expected one of `b`, `c`" into the unknown key and the
/// known keys.
fn split_unknown_field(message: &str) -> Option<(&str, Vec<&str>)> {
    let quoted = message.strip_prefix("unknown field ")?;
    let mut names = quoted.split('`').skip(1).step_by(2);
    Some((names.next()?, names.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    struct Sample {
        /// End of the run, s.
        #[allow(dead_code)]
        stop_s: f64,
        #[allow(dead_code)]
        sample_rate_hz: Option<f64>,
    }

    #[test]
    fn an_unknown_key_names_its_place_and_the_nearest_known_key() {
        let error = parse_toml::<Sample>("a.toml", "stop_s = 1.0\nsample_rate = 2\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "a.toml:2:1: unknown key `sample_rate`; did you mean `sample_rate_hz`?"
        );
    }

    #[test]
    fn two_exchanged_letters_of_a_short_key_are_one_slip() {
        assert_eq!(suggest_key("tpi", &["head", "tip"]), "did you mean `tip`?");
        assert_eq!(suggest_key("x", &["a", "b"]), "known keys here: a, b");
    }

    #[test]
    fn a_wrong_type_names_its_place() {
        let error = parse_toml::<Sample>("a.toml", "stop_s = \"soon\"\n").unwrap_err();
        assert!(
            error.to_string() == "a.toml:1:10: key `stop_s`: found the text \"soon\", expected a number",
            "{error}"
        );
    }

    #[test]
    fn a_missing_key_is_named() {
        let error = parse_toml::<Sample>("a.toml", "sample_rate_hz = 1\n").unwrap_err();
        assert!(
            error
                .to_string()
                .contains("key `stop_s`: found nothing, expected a number; add it: End of the run, s"),
            "{error}"
        );
    }
}
