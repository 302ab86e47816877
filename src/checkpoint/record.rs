//! Records of a journal, the form of their lines and numbers, and the sink for the lines.

use super::checksum::append_checksum;
use super::header::{CheckpointHeader, CheckpointKind, LAYOUT};
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt::Debug;
use std::hash::Hash;

/// A computation and its outcome: one line of a journal.
pub trait CheckpointRecord: Clone + Debug + PartialEq {
    /// Kind of the journals that contain such records.
    const KIND: CheckpointKind;
    /// Part of the header that only journals of this kind have.
    type Body: Serialize + DeserializeOwned + Clone + Debug + PartialEq;
    /// Serialized form of the record.
    type Row: Serialize + DeserializeOwned;
    /// Identifies the computation: records with equal identity must have equal outcomes.
    type Identity: Eq + Hash;

    /// Identity of the computation.
    fn identity(&self) -> Self::Identity;

    /// Serialized form of the record in line `at`; the first line after the header is line 0.
    fn to_row(&self, at: usize) -> Self::Row;

    /// Line number that a row contains, if any; the first line after the header is line 0.
    fn line_index(row: &Self::Row) -> Option<usize>;

    /// Makes a record from a row.
    ///
    /// # Errors
    /// A text that says what was found and what was expected.
    fn from_row(row: Self::Row, body: &Self::Body) -> Result<Self, String>;

    /// First difference between two outcomes of the same computation, as a text for each outcome; `None` if
    /// they are equal.
    fn difference(&self, other: &Self) -> Option<[String; 2]>;

    /// Sentence on the difference between the bodies of two headers with equal fingerprints; `None` if the
    /// bodies are equal.
    fn problem_difference(found: &Self::Body, expected: &Self::Body) -> Option<String>;
}

impl<B: Serialize> CheckpointHeader<B> {
    /// Header of a journal with records of type `R`.
    pub(crate) fn new<R: CheckpointRecord<Body = B>>(fingerprint: &str, version: &str, body: B) -> Self {
        let (fingerprint, version) = (fingerprint.to_owned(), version.to_owned());
        Self { journal: R::KIND, layout: LAYOUT, fingerprint, version, body }
    }
}

/// Formats a header as a line of a journal.
#[must_use]
pub fn format_header_line<B: Serialize>(header: &CheckpointHeader<B>) -> String {
    format_json_line(header)
}

/// Formats a record as line `at` of a journal; the first line after the header is line 0.
#[must_use]
pub fn format_record_line<R: CheckpointRecord>(record: &R, at: usize) -> String {
    format_json_line(&record.to_row(at))
}

fn format_json_line<T: Serialize>(value: &T) -> String {
    // serializing string keys and finite numbers cannot fail; if it did, the empty line would be refused by a
    // reader
    append_checksum(&serde_json::to_string(value).unwrap_or_default()) + "\n"
}

/// A finite number, serialized as a string with the shortest decimal that keeps every bit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactNumber(pub f64);

impl Serialize for ExactNumber {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{:?}", self.0))
    }
}

impl<'de> Deserialize<'de> for ExactNumber {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Self(number)),
            _ => Err(D::Error::custom(format!("found \"{text}\", expected a finite number in quotes"))),
        }
    }
}

/// Serializes a number as an [`ExactNumber`], for the attribute `#[serde(with)]`.
pub(crate) mod exact {
    use super::ExactNumber;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        ExactNumber(*number).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        ExactNumber::deserialize(deserializer).map(|number| number.0)
    }
}

/// Stores lines durably: when `append` returns, they are on disk. A record is counted or reported only after
/// that.
pub trait CheckpointSink: Send {
    /// Appends one or more lines, each with its newline.
    ///
    /// # Errors
    /// Reason why the lines cannot be stored; the computation then stops.
    fn append(&mut self, lines: &str) -> Result<(), String>;
}

/// Discards all lines, for a computation that is never resumed.
#[derive(Debug, Clone, Copy, Default)]
pub struct NullSink;

impl CheckpointSink for NullSink {
    fn append(&mut self, _: &str) -> Result<(), String> {
        Ok(())
    }
}

/// Collects the lines of a journal in memory.
impl CheckpointSink for String {
    fn append(&mut self, lines: &str) -> Result<(), String> {
        self.push_str(lines);
        Ok(())
    }
}
