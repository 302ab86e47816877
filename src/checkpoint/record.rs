//! What a line of a journal holds.

use super::checksum::append_checksum;
use super::header::{CheckpointHeader, CheckpointKind, LAYOUT};
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt::Debug;
use std::hash::Hash;

/// A computation with its outcome, as one line of a journal.
pub trait CheckpointRecord: Clone + Debug + PartialEq {
    /// What its journals are of.
    const KIND: CheckpointKind;
    /// What the header of such a journal says for all of its lines.
    type Body: Serialize + DeserializeOwned + Clone + Debug + PartialEq;
    /// The record as it stands in a line.
    type IterateRow: Serialize + DeserializeOwned;
    /// Records with the same identity are the same computation, and have the same outcome.
    type Identity: Eq + Hash;

    /// Which computation it is.
    fn identity(&self) -> Self::Identity;

    /// The record as it stands in line `at`, counted from 0 behind the header.
    fn to_row(&self, at: usize) -> Self::IterateRow;

    /// The number of its line, counted from 0 behind the header, where a row says it.
    fn line_index(row: &Self::IterateRow) -> Option<usize>;

    /// The record of a row.
    ///
    /// # Errors
    /// What was found and what was expected.
    fn from_row(row: Self::IterateRow, body: &Self::Body) -> Result<Self, String>;

    /// What differs between two outcomes of the same computation: this one's and the other's, in words.
    fn difference(&self, other: &Self) -> Option<[String; 2]>;

    /// What differs between the problems of two journals with the same fingerprint, in words.
    fn problem_difference(found: &Self::Body, expected: &Self::Body) -> Option<String>;
}

impl<B: Serialize> CheckpointHeader<B> {
    /// The header of a journal of such records.
    pub(crate) fn new<R: CheckpointRecord<Body = B>>(fingerprint: &str, version: &str, body: B) -> Self {
        let (fingerprint, version) = (fingerprint.to_owned(), version.to_owned());
        Self { journal: R::KIND, layout: LAYOUT, fingerprint, version, body }
    }
}

/// A header as a line.
#[must_use]
pub fn format_header_line<B: Serialize>(header: &CheckpointHeader<B>) -> String {
    format_json_line(header)
}

/// A record as line `at`, counted from 0 behind the header.
#[must_use]
pub fn format_record_line<R: CheckpointRecord>(record: &R, at: usize) -> String {
    format_json_line(&record.to_row(at))
}

fn format_json_line<T: Serialize>(value: &T) -> String {
    // string keys and finite numbers only: the writer has nothing to refuse, and a line that it did refuse
    // would be refused when it is read
    append_checksum(&serde_json::to_string(value).unwrap_or_default()) + "\n"
}

// Numbers of which every bit comes back.

/// A finite number as the shortest decimal that gives the same bits back, in quotes.
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

// Where the lines of a journal go.

/// Takes lines as they are made. When it returns they are where they stay: the program has written them to a
/// file, and the disk has them. Only then is a record counted or reported.
pub trait CheckpointSink: Send {
    /// Appends one line or several, each with its newline.
    ///
    /// # Errors
    /// The reason in words; the computation stops.
    fn append(&mut self, lines: &str) -> Result<(), String>;
}

/// Keeps nothing: for a computation that will not be resumed.
#[derive(Debug, Clone, Copy, Default)]
pub struct NullSink;

impl CheckpointSink for NullSink {
    fn append(&mut self, _: &str) -> Result<(), String> {
        Ok(())
    }
}

/// Keeps the lines in memory.
impl CheckpointSink for String {
    fn append(&mut self, lines: &str) -> Result<(), String> {
        self.push_str(lines);
        Ok(())
    }
}
