//! Records of a journal, the form of their lines, and the sink for the lines.

use super::checksum::append_checksum;
use super::header::{CheckpointHeader, CheckpointKind, LAYOUT};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt::Debug;
use std::hash::Hash;

/// A computation and its outcome: one line of a journal.
pub trait CheckpointRecord: Serialize + DeserializeOwned + Clone + Debug + PartialEq {
    /// Kind of the journals that contain such records.
    const KIND: CheckpointKind;
    /// Part of the header that only journals of this kind have.
    type Body: Serialize + DeserializeOwned + Clone + Debug + PartialEq;
    /// Identifies the computation: records with equal identity must have equal outcomes.
    type Identity: Eq + Hash;

    /// Identity of the computation.
    fn identity(&self) -> Self::Identity;

    /// Checks that the record belongs to a journal with the header `body`.
    ///
    /// # Errors
    /// A text that says what was found and what was expected.
    fn check_against(&self, body: &Self::Body) -> Result<(), String>;

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

/// Formats a record as a line of a journal.
#[must_use]
pub fn format_record_line<R: CheckpointRecord>(record: &R) -> String {
    format_json_line(record)
}

fn format_json_line<T: Serialize>(value: &T) -> String {
    // serializing string keys and numbers cannot fail; if it did, the empty line would be refused by a reader
    append_checksum(&serde_json::to_string(value).unwrap_or_default()) + "\n"
}

/// Reads `null` as infinity, for the attribute `#[serde(deserialize_with)]`: JSON has no infinity.
pub(crate) fn or_infinite<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
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

impl<S: CheckpointSink> CheckpointSink for &mut S {
    fn append(&mut self, lines: &str) -> Result<(), String> {
        (**self).append(lines)
    }
}

/// Collects the lines of a journal in memory.
impl CheckpointSink for String {
    fn append(&mut self, lines: &str) -> Result<(), String> {
        self.push_str(lines);
        Ok(())
    }
}
