//! A journal without some of its lines.

use super::error::JournalError;
use super::header::{Header, LAYOUT};
use super::lines::lines;
use super::read::{FIRST_LINE, Journal, at, is_complete, read, row};
use super::record::{Record, text};
use std::ops::RangeInclusive;

/// A journal without some of its lines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Without {
    /// The text of the journal that is left.
    pub text: String,
    /// Records that are left.
    pub kept: usize,
    /// Lines that were removed.
    pub removed: usize,
}

/// The journal without the lines of these ranges, counted from 1 as in messages, up to the last line where
/// a range ends with [`usize::MAX`]; what is left is numbered anew, and a torn last line is dropped. `None`
/// where there is no header.
///
/// # Errors
/// [`JournalError`] when a line is not there, is the header, or another line is damaged too.
pub fn without<R: Record>(
    file: &str,
    bytes: &[u8],
    drop: &[RangeInclusive<usize>],
) -> Result<Option<Without>, JournalError> {
    let whole: Vec<_> = lines(bytes).take_while(is_complete).collect();
    let header = whole.first().map_or(&[][..], |line| &bytes[..line.upto]);
    let Some(Journal::<R> { header, .. }) = read(file, header)? else { return Ok(None) };
    if header.layout < LAYOUT {
        return Err(JournalError::Unchecked { file: file.to_owned(), kind: R::KIND });
    }
    let count = whole.len();
    let ends = drop.iter().flat_map(|range| [*range.start(), *range.end()]);
    if let Some(line) = ends.filter(|end| *end != usize::MAX).find(|end| !(FIRST_LINE..=count).contains(end))
    {
        return Err(JournalError::NoSuchLine { file: file.to_owned(), line, lines: count });
    }
    let kept =
        whole.iter().zip(1..).skip(1).filter(|(_, line)| !drop.iter().any(|range| range.contains(line)));
    let records = kept.map(|(found, line)| {
        record::<R>(found.bytes, &header).map_err(|problem| at::<R>(file, line, problem))
    });
    let records = records.collect::<Result<Vec<R>, _>>()?;
    let (kept, removed) = (records.len(), count - 1 - records.len());
    Ok(Some(Without { text: text(&header, &records), kept, removed }))
}

/// A line wherever it stands: lines before it may have been removed.
fn record<R: Record>(line: &[u8], header: &Header<R::Body>) -> Result<R, String> {
    R::from_row(row::<R>(line, header.layout)?, &header.body)
}
