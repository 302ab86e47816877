//! A journal as it is read.

use super::checksum::LineChecksum;
use super::error::CheckpointError;
use super::header::{CheckpointHeader, HeaderPrefix, LAYOUT};
use super::record::CheckpointRecord;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::io::{BufRead, Read};

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
    pub(crate) fn read_all(mut self) -> Result<CheckpointFile<R>, CheckpointError> {
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
    pub(crate) fn check_recomputed(
        &self,
        file: &str,
        place: usize,
        again: &R,
    ) -> Result<(), CheckpointError> {
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

// The lines of a file, whichever system or editor ended them: LF, CR LF or CR.

/// A line without its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RawLine<'a> {
    pub bytes: &'a [u8],
    /// Whether it has an end, which the last one may lack.
    pub ended: bool,
    /// Bytes of the file before the next line.
    pub end_offset: usize,
}

/// The lines of a file in order; none of an empty one.
pub(super) fn split_lines(bytes: &[u8]) -> impl Iterator<Item = RawLine<'_>> {
    let mut from = 0;
    std::iter::from_fn(move || {
        let rest = bytes.get(from..).filter(|rest| !rest.is_empty())?;
        let end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
        let length = end.unwrap_or(rest.len());
        from += length + end.map_or(0, |at| if rest[at..].starts_with(b"\r\n") { 2 } else { 1 });
        Some(RawLine { bytes: &rest[..length], ended: end.is_some(), end_offset: from })
    })
}

/// The line without the byte-order mark that an editor may have put before it.
pub(super) fn strip_byte_order_mark(line: &[u8]) -> &[u8] {
    line.strip_prefix("\u{feff}".as_bytes()).unwrap_or(line)
}

// Which records of a journal are computed again before it is believed.

/// Records of a journal that are computed again when it is resumed: a machine or a build that calculates
/// otherwise shows in nearly every record, and few of them cost little.
pub const RECHECKED_RECORDS: usize = 8;

/// Places of [`RECHECKED_RECORDS`] records, or of all where there are no more: one of each of as many equal parts,
/// drawn by the seed.
#[must_use]
pub fn sample_records(records: usize, seed: u64) -> Vec<usize> {
    let parts = RECHECKED_RECORDS.min(records);
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..parts)
        .map(|part| generator.random_range(part * records / parts..(part + 1) * records / parts))
        .collect()
}

// A journal line by line: of one that is larger than memory no more than a line is held.

/// Longest line, bytes: many times what the program writes, so that no file fills the memory as one line.
const LONGEST_LINE: u64 = 1 << 28;

/// A journal that is being read.
///
/// What follows the last complete line is dropped: part of a line that was being written when the program
/// was killed, and the zero bytes that a file system may leave in its place when the power fails.
#[derive(Debug)]
pub struct CheckpointReader<R: CheckpointRecord, S> {
    file: String,
    header: CheckpointHeader<R::Body>,
    line_reader: LineReader<S>,
    line: usize,
    end: CheckpointEnd,
}

/// How a journal ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CheckpointEnd {
    /// Bytes up to the end of the last complete line: the file is cut to them before anything is appended.
    pub intact_bytes: usize,
    /// Whether an incomplete line follows, which is dropped.
    pub torn: bool,
    /// Whether the last complete line has no end, which is added before anything is appended.
    pub unended: bool,
}

/// A record as it stands in a journal.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredRecord<R> {
    /// The record.
    pub record: R,
    /// Its line, counted from 1.
    pub line: usize,
}

impl<R: CheckpointRecord, S: BufRead> CheckpointReader<R, S> {
    /// Reads the header; `file` is the name in refusals. A file without a complete header is `None`.
    ///
    /// # Errors
    /// [`CheckpointError`] where it cannot be read, or the program did not write its first line.
    pub(crate) fn open(file: &str, from: S) -> Result<Option<Self>, CheckpointError> {
        let mut text = LineReader { from, chunk: Vec::new(), start: 0, used: 0 };
        let unreadable = |problem| CheckpointError::Unreadable { file: file.to_owned(), problem };
        let Some(first) = text.next_line().map_err(unreadable)?.filter(is_complete) else { return Ok(None) };
        let header = parse_header::<R>(file, first.bytes)?;
        let end = CheckpointEnd { intact_bytes: first.end_offset, torn: false, unended: !first.ended };
        Ok(Some(Self { file: file.to_owned(), header, line_reader: text, line: FIRST_LINE, end }))
    }

    /// Its name in refusals.
    pub(super) fn file_name(&self) -> &str {
        &self.file
    }

    pub(crate) fn header(&self) -> &CheckpointHeader<R::Body> {
        &self.header
    }

    /// The next record; `None` behind the last complete line.
    ///
    /// # Errors
    /// [`CheckpointError`] where it cannot be read, or at a complete line that the program did not write.
    pub(crate) fn next_record(&mut self) -> Result<Option<StoredRecord<R>>, CheckpointError> {
        let Self { file, header, line_reader: text, line, end } = self;
        let unreadable = |problem| CheckpointError::Unreadable { file: file.clone(), problem };
        let Some(found) = text.next_line().map_err(unreadable)? else { return Ok(None) };
        if end.torn || !is_complete(&found) {
            end.torn = true;
            return Ok(None);
        }
        let refused = |problem| line_error::<R>(file, *line, problem);
        let row = parse_row::<R>(found.bytes).map_err(refused)?;
        let expected = *line - FIRST_LINE;
        if let Some(index) = R::line_index(&row).filter(|index| *index != expected) {
            let problem = format!("`index`: found {index}, expected {expected}; lines are missing before it");
            return Err(refused(problem));
        }
        let record = R::from_row(row, &header.body).map_err(refused)?;
        *end = CheckpointEnd { intact_bytes: found.end_offset, torn: false, unended: !found.ended };
        *line += 1;
        Ok(Some(StoredRecord { record, line: *line - 1 }))
    }

    /// How it ends, once there is no further record.
    pub(crate) fn end(&self) -> CheckpointEnd {
        self.end
    }
}

/// The lines of a file that is read piece by piece.
#[derive(Debug)]
struct LineReader<S> {
    from: S,
    /// What was read last: up to a line feed, which is a line but where an editor ended lines otherwise.
    chunk: Vec<u8>,
    /// Where it starts in the file.
    start: usize,
    /// Bytes of it that were given out.
    used: usize,
}

impl<S: BufRead> LineReader<S> {
    fn next_line(&mut self) -> Result<Option<RawLine<'_>>, String> {
        if self.used == self.chunk.len() {
            self.start += self.chunk.len();
            self.used = 0;
            self.chunk.clear();
            let mut from = (&mut self.from).take(LONGEST_LINE);
            let read = from.read_until(b'\n', &mut self.chunk).map_err(|error| error.to_string())?;
            if read as u64 == LONGEST_LINE {
                return Err(format!("found a line of more than {LONGEST_LINE} bytes, expected a journal"));
            }
        }
        let Some(line) = split_lines(&self.chunk[self.used..]).next() else { return Ok(None) };
        let from = self.used;
        self.used += line.end_offset;
        Ok(Some(RawLine { end_offset: self.start + from + line.end_offset, ..line }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_end_of_a_line_counts_once() {
        let found: Vec<_> =
            split_lines(b"a\nbc\r\nd\re\n\nf").map(|l| (l.bytes, l.ended, l.end_offset)).collect();
        let expected: [(&[u8], bool, usize); 6] = [
            (b"a", true, 2),
            (b"bc", true, 6),
            (b"d", true, 8),
            (b"e", true, 10),
            (b"", true, 11),
            (b"f", false, 12),
        ];
        assert_eq!(found, expected);
        assert_eq!(split_lines(b"").count(), 0);
    }

    #[test]
    fn a_sample_is_spread_over_the_records_and_follows_from_the_seed() {
        assert_eq!(sample_records(0, 1), [0; 0]);
        assert_eq!(sample_records(3, 1), [0, 1, 2]);
        for seed in 0..50 {
            let places = sample_records(801, seed);
            assert_eq!((places.len(), places.clone()), (RECHECKED_RECORDS, sample_records(801, seed)));
            assert!(
                places.iter().enumerate().all(|(i, at)| (100 * i..=100 * (i + 1)).contains(at)),
                "{places:?}"
            );
        }
        assert_ne!(sample_records(801, 1), sample_records(801, 2));
    }
}
