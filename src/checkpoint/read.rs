//! Reading of journals.

use super::checksum::LineChecksum;
use super::error::CheckpointError;
use super::header::{CheckpointHeader, HeaderPrefix, LAYOUT};
use super::record::CheckpointRecord;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::collections::HashMap;
use std::io::{BufRead, Read};

/// Line number of the first record, counted from 1.
pub(crate) const FIRST_LINE: usize = 2;

/// A journal in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckpointFile<R: CheckpointRecord> {
    /// Header of the journal.
    pub header: CheckpointHeader<R::Body>,
    /// Records in file order, from line 2 on.
    pub records: Vec<R>,
    /// End of the journal.
    pub end: CheckpointEnd,
}

/// Reads a journal; `file` is its name in messages. A file without a complete header gives `None`.
///
/// Everything after the last complete line is dropped: a part of a line that was being written when the
/// program was killed, and zero bytes that a file system may leave after a power failure.
///
/// # Errors
/// [`CheckpointError`] at the first complete line that is not valid.
pub fn read_checkpoint<R: CheckpointRecord>(
    file: &str,
    bytes: impl AsRef<[u8]>,
) -> Result<Option<CheckpointFile<R>>, CheckpointError> {
    CheckpointReader::<R, _>::open(file, bytes.as_ref())?.map(CheckpointReader::read_all).transpose()
}

impl<R: CheckpointRecord, S: BufRead> CheckpointReader<R, S> {
    /// Reads all records into memory.
    ///
    /// # Errors
    /// [`CheckpointError`] at the first complete line that is not valid, or at a repeated record.
    pub(crate) fn read_all(mut self) -> Result<CheckpointFile<R>, CheckpointError> {
        let (mut records, mut lines) = (Vec::new(), HashMap::new());
        while let Some(StoredRecord { record, line }) = self.next_record()? {
            if let Some(before) = lines.insert(record.identity(), line) {
                let found = StoredRecord { record, line };
                return Err(duplicate_record_error(&self.file, &found, &format!("of line {before} ")));
            }
            records.push(record);
        }
        Ok(CheckpointFile { header: self.header, records, end: self.end })
    }
}

/// Makes the error for a record that repeats an earlier one. `before` is a part of the message: it is empty
/// or names the earlier line, such as `of line 3 `.
#[must_use]
pub fn duplicate_record_error<R: CheckpointRecord>(
    file: &str,
    found: &StoredRecord<R>,
    before: &str,
) -> CheckpointError {
    line_error::<R>(file, found.line, format!("the {} {before}a second time", R::KIND.record()))
}

/// Whether a line is complete: it has a line end or a checksum. The checksum is the last part of a line
/// before the line end.
fn is_complete(line: &RawLine) -> bool {
    line.ended || LineChecksum::check(strip_byte_order_mark(line.bytes)) != LineChecksum::Absent
}

/// Compares a record with the result of the same computation made again.
///
/// # Errors
/// [`CheckpointError::Recomputed`] if they differ in any bit.
pub fn check_recomputed<R: CheckpointRecord>(
    file: &str,
    stored: &StoredRecord<R>,
    again: &R,
) -> Result<(), CheckpointError> {
    let Some([found, computed]) = describe_difference(&stored.record, again) else { return Ok(()) };
    let (file, line, kind) = (file.to_owned(), stored.line, R::KIND);
    Err(CheckpointError::Recomputed { file, line, kind, found, computed })
}

/// First difference between two outcomes of the same computation, as a text for each outcome; `None` if they
/// are equal.
pub(crate) fn describe_difference<R: CheckpointRecord>(one: &R, other: &R) -> Option<[String; 2]> {
    let [one, other] = [one, other].map(|record| serde_json::to_value(record).unwrap_or_default());
    let (key, values) = first_difference(&one, &other)?;
    Some(values.map(|value| format!("{} {value}", key.trim_start_matches('.'))))
}

/// Key and values of the first difference between two JSON values. Numbers are compared as texts, which
/// keep every bit.
fn first_difference(one: &Value, other: &Value) -> Option<(String, [String; 2])> {
    let named = |key: String| move |(inner, values): (String, [String; 2])| (format!("{key}{inner}"), values);
    match (one, other) {
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            let mut pairs = a.iter().zip(b.values());
            pairs.find_map(|((key, a), b)| first_difference(a, b).map(named(format!(".{key}"))))
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let mut pairs = a.iter().zip(b).enumerate();
            pairs.find_map(|(at, (a, b))| first_difference(a, b).map(named(format!("[{at}]"))))
        }
        _ => {
            let values = [one, other].map(Value::to_string);
            (values[0] != values[1]).then(|| (String::new(), values))
        }
    }
}

fn parse_header<R: CheckpointRecord>(
    file: &str,
    line: &[u8],
) -> Result<CheckpointHeader<R::Body>, CheckpointError> {
    let (file, kind) = (file.to_owned(), R::KIND);
    let at_header = |problem| CheckpointError::Header { file: file.clone(), problem };
    let line = strip_byte_order_mark(line);
    let object = check_line(line);
    // a header without a checksum may have an older layout, for which there is a more specific error
    let json = match &object {
        Ok(object) => object.as_slice(),
        Err(problem) if problem == MISSING_CHECKSUM => line,
        Err(problem) => return Err(at_header(problem.clone())),
    };
    let HeaderPrefix { journal, layout } = parse_json(json, "journal header").map_err(at_header)?;
    if journal != kind {
        return Err(CheckpointError::OtherKind { file, found: journal, expected: kind });
    }
    if layout != LAYOUT {
        return Err(CheckpointError::Layout { file, kind, found: layout });
    }
    object.and_then(|object| parse_json(&object, "journal header")).map_err(at_header)
}

const MISSING_CHECKSUM: &str = "found no checksum at the end of the line, expected `\"sha256\":\"...\"}`";

/// Checks the checksum of a line. Returns the JSON object without the checksum, or a description of the
/// problem.
fn check_line(line: &[u8]) -> Result<Vec<u8>, String> {
    match LineChecksum::check(line) {
        LineChecksum::Valid(object) => Ok(object),
        LineChecksum::Broken { found, computed } => {
            Err(format!("the line has the checksum {computed}, but says {found}: it was changed"))
        }
        LineChecksum::Absent => Err(MISSING_CHECKSUM.to_owned()),
    }
}

fn parse_json<T: DeserializeOwned>(line: &[u8], what: &str) -> Result<T, String> {
    serde_json::from_slice(line).map_err(|error| format!("no {what}: {error}"))
}

fn line_error<R: CheckpointRecord>(file: &str, line: usize, problem: String) -> CheckpointError {
    CheckpointError::Line { file: file.to_owned(), line, problem, kind: R::KIND }
}

// Lines of a file, which may end in LF, CR LF or CR.

/// A line without its line end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RawLine<'a> {
    pub bytes: &'a [u8],
    /// Whether the line has a line end; the last line of a file may lack it.
    pub ended: bool,
    /// Offset of the next line from the start of the file, in bytes.
    pub end_offset: usize,
}

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

/// The line without a byte-order mark, which some editors add.
pub(super) fn strip_byte_order_mark(line: &[u8]) -> &[u8] {
    line.strip_prefix("\u{feff}".as_bytes()).unwrap_or(line)
}

/// Number of records that are recomputed when a journal is resumed. A few suffice: on a machine or in a build
/// with different arithmetic, nearly every record differs.
pub const RECHECKED_RECORDS: usize = 8;

/// Random indices of at most [`RECHECKED_RECORDS`] of `records` records: the journal is divided into equal
/// parts, and one record is drawn from each. Equal seeds give equal indices.
#[must_use]
pub fn sample_records(records: usize, seed: u64) -> Vec<usize> {
    let parts = RECHECKED_RECORDS.min(records);
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let draw = |part| generator.random_range(part * records / parts..(part + 1) * records / parts);
    (0..parts).map(draw).collect()
}

/// Maximum length of a line that is read, in bytes. It is far above the length of any line that the program
/// writes, and prevents a file of another kind from filling the memory.
const LONGEST_LINE: u64 = 1 << 28;

/// Reads a journal line by line, so that it may be larger than the memory.
///
/// Everything after the last complete line is dropped, as by [`read_checkpoint`].
#[derive(Debug)]
pub struct CheckpointReader<R: CheckpointRecord, S> {
    file: String,
    header: CheckpointHeader<R::Body>,
    line_reader: LineReader<S>,
    line: usize,
    end: CheckpointEnd,
}

/// The end of a journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CheckpointEnd {
    /// Number of bytes up to the end of the last complete line. The file is truncated to this length before
    /// lines are appended.
    pub intact_bytes: usize,
    /// Whether an incomplete line follows the last complete line; it is dropped.
    pub torn: bool,
    /// Whether the last complete line lacks its line end, which is added before lines are appended.
    pub unended: bool,
}

/// A record and its line number in the journal.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredRecord<R> {
    /// The record.
    pub record: R,
    /// Line number, counted from 1.
    pub line: usize,
}

impl<R: CheckpointRecord, S: BufRead> CheckpointReader<R, S> {
    /// Reads the header; `file` is the name in messages. A file without a complete header gives `None`.
    ///
    /// # Errors
    /// [`CheckpointError`] if the file cannot be read or its first line is not valid.
    pub(crate) fn open(file: &str, from: S) -> Result<Option<Self>, CheckpointError> {
        let mut text = LineReader { from, chunk: Vec::new(), start: 0, used: 0 };
        let unreadable = |problem| CheckpointError::Unreadable { file: file.to_owned(), problem };
        let Some(first) = text.next_line().map_err(unreadable)?.filter(is_complete) else { return Ok(None) };
        let header = parse_header::<R>(file, first.bytes)?;
        let end = CheckpointEnd { intact_bytes: first.end_offset, torn: false, unended: !first.ended };
        Ok(Some(Self { file: file.to_owned(), header, line_reader: text, line: FIRST_LINE, end }))
    }

    pub(crate) fn header(&self) -> &CheckpointHeader<R::Body> {
        &self.header
    }

    /// The next record; `None` after the last complete line.
    ///
    /// # Errors
    /// [`CheckpointError`] if the file cannot be read or a complete line is not valid.
    pub(crate) fn next_record(&mut self) -> Result<Option<StoredRecord<R>>, CheckpointError> {
        let Self { file, header, line_reader: text, line, end } = self;
        let unreadable = |problem| CheckpointError::Unreadable { file: file.clone(), problem };
        let Some(found) = text.next_line().map_err(unreadable)? else { return Ok(None) };
        if end.torn || !is_complete(&found) {
            end.torn = true;
            return Ok(None);
        }
        let refused = |problem| line_error::<R>(file, *line, problem);
        let record = check_line(found.bytes).and_then(|object| parse_json::<R>(&object, R::KIND.record()));
        let record = record.map_err(refused)?;
        record.check_against(&header.body).map_err(refused)?;
        *end = CheckpointEnd { intact_bytes: found.end_offset, torn: false, unended: !found.ended };
        *line += 1;
        Ok(Some(StoredRecord { record, line: *line - 1 }))
    }

    /// End of the part of the journal that has been read so far. After the last record, this is the end of
    /// the journal.
    pub(crate) fn end(&self) -> CheckpointEnd {
        self.end
    }
}

/// Reads a file line by line.
#[derive(Debug)]
struct LineReader<S> {
    from: S,
    /// The bytes that were read last, up to a line feed. They are several lines if the lines of the file end
    /// in CR only.
    chunk: Vec<u8>,
    /// Offset of the chunk from the start of the file, in bytes.
    start: usize,
    /// Number of bytes of the chunk that have been returned.
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
