//! A journal as it is read.

use super::checksum::Seal;
use super::error::JournalError;
use super::header::{Header, LAYOUT, Start};
use super::lines::{Line, without_mark};
use super::record::Record;
use super::stream::{End, Found, Stream};
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::io::BufRead;

/// Line on which the first record stands, counted from 1.
pub(super) const FIRST_LINE: usize = 2;

/// A journal as read.
#[derive(Debug, Clone, PartialEq)]
pub struct Journal<R: Record> {
    /// Its header.
    pub header: Header<R::Body>,
    /// Its records, in file order: the first stands in line 2.
    pub records: Vec<R>,
    /// How it ends.
    pub end: End,
}

/// Reads a journal; `file` is its name in refusals. A file without a complete header is `None`.
///
/// What follows the last complete line is dropped: part of a line that was being written when the program was
/// killed, and the zero bytes that a file system may leave in its place when the power fails.
///
/// # Errors
/// [`JournalError`] at the first complete line that the program did not write.
pub fn read<R: Record>(file: &str, bytes: impl AsRef<[u8]>) -> Result<Option<Journal<R>>, JournalError> {
    Stream::<R, _>::open(file, bytes.as_ref())?.map(Stream::whole).transpose()
}

impl<R: Record, S: BufRead> Stream<R, S> {
    /// All that follows, in memory.
    ///
    /// # Errors
    /// [`JournalError`] at the first complete line that the program did not write, and at a record that
    /// stands in a line before too.
    pub fn whole(mut self) -> Result<Journal<R>, JournalError> {
        let (mut records, mut lines) = (Vec::new(), HashMap::new());
        while let Some(Found { record, line }) = self.record()? {
            if let Some(before) = lines.insert(record.identity(), line) {
                let found = Found { record, line };
                return Err(again(self.file(), &found, &format!("of line {before} ")));
            }
            records.push(record);
        }
        Ok(Journal { header: self.header().clone(), records, end: self.end() })
    }
}

/// The refusal of a record that stands in a line before too; `before` says in which, if that is known.
#[must_use]
pub fn again<R: Record>(file: &str, found: &Found<R>, before: &str) -> JournalError {
    at::<R>(file, found.line, format!("the {} {before}a second time", R::KIND.record()))
}

/// A line has its end, or a checksum, which is what is written last.
pub(super) fn is_complete(line: &Line) -> bool {
    line.ended || Seal::of(without_mark(line.bytes)) != Seal::Absent
}

impl<R: Record> Journal<R> {
    /// Refuses a record of which a new computation gave something else.
    ///
    /// # Errors
    /// [`JournalError::Recomputed`].
    pub fn check_again(&self, file: &str, place: usize, again: &R) -> Result<(), JournalError> {
        let Some(stored) = self.records.get(place) else { return Ok(()) };
        check_again(file, &Found { record: stored.clone(), line: place + FIRST_LINE }, again)
    }
}

/// Refuses a record of which a new computation gave something else.
///
/// # Errors
/// [`JournalError::Recomputed`].
pub fn check_again<R: Record>(file: &str, stored: &Found<R>, again: &R) -> Result<(), JournalError> {
    let Some([found, computed]) = stored.record.difference(again) else { return Ok(()) };
    Err(JournalError::Recomputed { file: file.to_owned(), line: stored.line, kind: R::KIND, found, computed })
}

pub(super) fn header<R: Record>(file: &str, line: &[u8]) -> Result<Header<R::Body>, JournalError> {
    let at_header = |problem| JournalError::Header { file: file.to_owned(), problem };
    let line = without_mark(line);
    let seal = Seal::of(line);
    let object = match &seal {
        Seal::Holds(object) => object.as_slice(),
        Seal::Absent => line,
        Seal::Broken { .. } => return Err(at_header(broken_words(&seal))),
    };
    let Start { journal, layout } = parse(object, "journal header").map_err(at_header)?;
    if journal != R::KIND {
        return Err(JournalError::OtherKind { file: file.to_owned(), found: journal, expected: R::KIND });
    }
    if layout != LAYOUT {
        return Err(JournalError::Layout { file: file.to_owned(), kind: R::KIND, found: layout });
    }
    if seal == Seal::Absent {
        return Err(at_header(ABSENT.to_owned()));
    }
    parse(object, "journal header").map_err(at_header)
}

/// A line as its row.
pub(super) fn row<R: Record>(line: &[u8]) -> Result<R::Row, String> {
    match Seal::of(line) {
        Seal::Holds(object) => parse(&object, R::KIND.record()),
        seal => Err(broken_words(&seal)),
    }
}

const ABSENT: &str = "found no checksum at the end of the line, expected `\"sha256\":\"...\"}`";

fn broken_words(seal: &Seal) -> String {
    match seal {
        Seal::Broken { found, computed } => {
            format!("the line has the checksum {computed}, but says {found}: it was changed")
        }
        _ => ABSENT.to_owned(),
    }
}

/// The one place in which a line becomes a value.
fn parse<T: DeserializeOwned>(line: &[u8], what: &str) -> Result<T, String> {
    serde_json::from_slice(line).map_err(|error| format!("no {what}: {error}"))
}

pub(super) fn at<R: Record>(file: &str, line: usize, problem: String) -> JournalError {
    JournalError::Line { file: file.to_owned(), line, problem, kind: R::KIND }
}
