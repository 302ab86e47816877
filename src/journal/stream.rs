//! A journal line by line: of one that is larger than memory no more than a line is held.

use super::error::CheckpointError;
use super::header::CheckpointHeader;
use super::lines::{RawLine, split_lines};
use super::read::{FIRST_LINE, is_complete, line_error, parse_header, parse_row};
use super::record::CheckpointRecord;
use std::io::{BufRead, Read};

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
    pub fn open(file: &str, from: S) -> Result<Option<Self>, CheckpointError> {
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

    /// Its header.
    pub fn header(&self) -> &CheckpointHeader<R::Body> {
        &self.header
    }

    /// The next record; `None` behind the last complete line.
    ///
    /// # Errors
    /// [`CheckpointError`] where it cannot be read, or at a complete line that the program did not write.
    pub fn next_record(&mut self) -> Result<Option<StoredRecord<R>>, CheckpointError> {
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
    pub fn end(&self) -> CheckpointEnd {
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
