//! A journal as it is read.

use super::error::JournalError;
use super::header::{Header, LAYOUT, Start, without_mark};
use super::record::Record;
use serde::de::DeserializeOwned;
use std::collections::HashMap;

/// Line on which the first record stands, counted from 1.
pub(super) const FIRST_LINE: usize = 2;

/// A journal as read.
#[derive(Debug, Clone, PartialEq)]
pub struct Journal<R: Record> {
    /// Its header.
    pub header: Header<R::Body>,
    /// Its records, in file order.
    pub records: Vec<R>,
    /// Length of the part that ends with a complete line, bytes: the file is cut to it before anything is
    /// appended.
    pub intact_bytes: usize,
    /// Whether an incomplete last line was dropped.
    pub torn: bool,
}

/// Reads a journal; `file` is its name in refusals. An empty file, or one whose header is torn, is `None`.
///
/// What follows the last complete line is dropped: part of a line that was being written when the program was
/// killed, and the zero bytes that a file system may leave in its place when the power fails.
///
/// # Errors
/// [`JournalError`] at the first complete line that the program did not write.
pub fn read<R: Record>(file: &str, bytes: impl AsRef<[u8]>) -> Result<Option<Journal<R>>, JournalError> {
    let bytes = bytes.as_ref();
    let intact_bytes = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
    let torn = intact_bytes < bytes.len();
    let mut lines = bytes[..intact_bytes].split_inclusive(|byte| *byte == b'\n').zip(1..);
    let Some((first, _)) = lines.next() else { return Ok(None) };
    let header: Header<R::Body> = header::<R>(file, without_mark(first))?;
    let (mut records, mut places) = (Vec::new(), HashMap::new());
    for (text, line) in lines {
        let record: R =
            record(text, line - FIRST_LINE, &header.body).map_err(|problem| at(file, line, problem))?;
        if let Some(before) = places.insert(record.identity(), line) {
            let problem = format!("the {} of line {before} a second time", R::KIND.record());
            return Err(at(file, line, problem));
        }
        records.push(record);
    }
    Ok(Some(Journal { header, records, intact_bytes, torn }))
}

impl<R: Record> Journal<R> {
    /// Refuses a journal of another problem, data or program than the header `expected` has.
    ///
    /// # Errors
    /// [`JournalError::OtherVersion`], [`JournalError::OtherProblem`], or [`JournalError::Line`] when the
    /// header was edited.
    pub fn check_problem(&self, file: &str, expected: &Header<R::Body>) -> Result<(), JournalError> {
        let (found, name) = (&self.header, file.to_owned());
        if found.version != expected.version {
            let (found, expected) = (found.version.clone(), expected.version.clone());
            return Err(JournalError::OtherVersion { file: name, found, expected });
        }
        if found.fingerprint != expected.fingerprint {
            let (found, expected) = (found.fingerprint.clone(), expected.fingerprint.clone());
            return Err(JournalError::OtherProblem { file: name, kind: R::KIND, found, expected });
        }
        R::other_problem(&found.body, &expected.body).map_or(Ok(()), |problem| Err(at(file, 1, problem)))
    }
}

fn header<R: Record>(file: &str, line: &[u8]) -> Result<Header<R::Body>, JournalError> {
    let start: Start = parse(line, "journal header").map_err(|problem| at(file, 1, problem))?;
    let Some((found, layout)) = start.kind_and_layout() else {
        return Err(at(file, 1, "no journal header: found neither `journal` nor `layout`".to_owned()));
    };
    let (file, expected) = (file.to_owned(), R::KIND);
    if found != expected {
        return Err(JournalError::OtherKind { file, found, expected });
    }
    if layout != LAYOUT {
        return Err(JournalError::Layout { file, found: layout, expected: LAYOUT });
    }
    parse(line, "journal header").map_err(|problem| at(&file, 1, problem))
}

fn record<R: Record>(line: &[u8], at: usize, body: &R::Body) -> Result<R, String> {
    R::from_row(parse(line, R::KIND.record())?, at, body)
}

/// The one place in which a line becomes a value.
fn parse<T: DeserializeOwned>(line: &[u8], what: &str) -> Result<T, String> {
    serde_json::from_slice(line).map_err(|error| format!("no {what}: {error}"))
}

fn at(file: &str, line: usize, problem: String) -> JournalError {
    JournalError::Line { file: file.to_owned(), line, problem }
}
