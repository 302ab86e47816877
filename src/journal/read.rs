//! A journal as it is read.

use super::checksum::LineChecksum;
use super::error::CheckpointError;
use super::header::{CheckpointHeader, HeaderPrefix, LAYOUT};
use super::lines::{RawLine, strip_byte_order_mark};
use super::record::CheckpointRecord;
use super::stream::{CheckpointEnd, CheckpointReader, StoredRecord};
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::io::BufRead;

/// Line on which the first record stands, counted from 1.
pub(super) const FIRST_LINE: usize = 2;

/// A journal as read.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckpointFile<R: CheckpointRecord> {
    /// Its header.
    pub header: CheckpointHeader<R::Body>,
    /// Its records, in file order: the first stands in line 2.
    pub records: Vec<R>,
    /// How it ends.
    pub end: CheckpointEnd,
}

/// Reads a journal; `file` is its name in refusals. A file without a complete header is `None`.
///
/// What follows the last complete line is dropped: part of a line that was being written when the program was
/// killed, and the zero bytes that a file system may leave in its place when the power fails.
///
/// # Errors
/// [`CheckpointError`] at the first complete line that the program did not write.
pub fn read_checkpoint<R: CheckpointRecord>(
    file: &str,
    bytes: impl AsRef<[u8]>,
) -> Result<Option<CheckpointFile<R>>, CheckpointError> {
    CheckpointReader::<R, _>::open(file, bytes.as_ref())?.map(CheckpointReader::read_all).transpose()
}

impl<R: CheckpointRecord, S: BufRead> CheckpointReader<R, S> {
    /// All that follows, in memory.
    ///
    /// # Errors
    /// [`CheckpointError`] at the first complete line that the program did not write, and at a record that
    /// stands in a line before too.
    pub fn read_all(mut self) -> Result<CheckpointFile<R>, CheckpointError> {
        let (mut records, mut lines) = (Vec::new(), HashMap::new());
        while let Some(StoredRecord { record, line }) = self.next_record()? {
            if let Some(before) = lines.insert(record.identity(), line) {
                let found = StoredRecord { record, line };
                return Err(duplicate_record_error(self.file_name(), &found, &format!("of line {before} ")));
            }
            records.push(record);
        }
        Ok(CheckpointFile { header: self.header().clone(), records, end: self.end() })
    }
}

/// The refusal of a record that stands in a line before too; `before` says in which, if that is known.
#[must_use]
pub fn duplicate_record_error<R: CheckpointRecord>(
    file: &str,
    found: &StoredRecord<R>,
    before: &str,
) -> CheckpointError {
    line_error::<R>(file, found.line, format!("the {} {before}a second time", R::KIND.record()))
}

/// A line has its end, or a checksum, which is what is written last.
pub(super) fn is_complete(line: &RawLine) -> bool {
    line.ended || LineChecksum::check(strip_byte_order_mark(line.bytes)) != LineChecksum::Absent
}

impl<R: CheckpointRecord> CheckpointFile<R> {
    /// Refuses a record of which a new computation gave something else.
    ///
    /// # Errors
    /// [`CheckpointError::Recomputed`].
    pub fn check_recomputed(&self, file: &str, place: usize, again: &R) -> Result<(), CheckpointError> {
        let Some(stored) = self.records.get(place) else { return Ok(()) };
        check_recomputed(file, &StoredRecord { record: stored.clone(), line: place + FIRST_LINE }, again)
    }
}

/// Refuses a record of which a new computation gave something else.
///
/// # Errors
/// [`CheckpointError::Recomputed`].
pub fn check_recomputed<R: CheckpointRecord>(
    file: &str,
    stored: &StoredRecord<R>,
    again: &R,
) -> Result<(), CheckpointError> {
    let Some([found, computed]) = stored.record.difference(again) else { return Ok(()) };
    Err(CheckpointError::Recomputed {
        file: file.to_owned(),
        line: stored.line,
        kind: R::KIND,
        found,
        computed,
    })
}

pub(super) fn parse_header<R: CheckpointRecord>(
    file: &str,
    line: &[u8],
) -> Result<CheckpointHeader<R::Body>, CheckpointError> {
    let at_header = |problem| CheckpointError::Header { file: file.to_owned(), problem };
    let line = strip_byte_order_mark(line);
    let seal = LineChecksum::check(line);
    let object = match &seal {
        LineChecksum::Valid(object) => object.as_slice(),
        LineChecksum::Absent => line,
        LineChecksum::Broken { .. } => return Err(at_header(checksum_problem(&seal))),
    };
    let HeaderPrefix { journal, layout } = parse_json(object, "journal header").map_err(at_header)?;
    if journal != R::KIND {
        return Err(CheckpointError::OtherKind { file: file.to_owned(), found: journal, expected: R::KIND });
    }
    if layout != LAYOUT {
        return Err(CheckpointError::Layout { file: file.to_owned(), kind: R::KIND, found: layout });
    }
    if seal == LineChecksum::Absent {
        return Err(at_header(MISSING_CHECKSUM.to_owned()));
    }
    parse_json(object, "journal header").map_err(at_header)
}

/// A line as its row.
pub(super) fn parse_row<R: CheckpointRecord>(line: &[u8]) -> Result<R::IterateRow, String> {
    match LineChecksum::check(line) {
        LineChecksum::Valid(object) => parse_json(&object, R::KIND.record()),
        seal => Err(checksum_problem(&seal)),
    }
}

const MISSING_CHECKSUM: &str = "found no checksum at the end of the line, expected `\"sha256\":\"...\"}`";

fn checksum_problem(seal: &LineChecksum) -> String {
    match seal {
        LineChecksum::Broken { found, computed } => {
            format!("the line has the checksum {computed}, but says {found}: it was changed")
        }
        _ => MISSING_CHECKSUM.to_owned(),
    }
}

/// The one place in which a line becomes a value.
fn parse_json<T: DeserializeOwned>(line: &[u8], what: &str) -> Result<T, String> {
    serde_json::from_slice(line).map_err(|error| format!("no {what}: {error}"))
}

pub(super) fn line_error<R: CheckpointRecord>(file: &str, line: usize, problem: String) -> CheckpointError {
    CheckpointError::Line { file: file.to_owned(), line, problem, kind: R::KIND }
}
