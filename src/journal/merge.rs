//! Journals of one problem as one.

use super::error::JournalError;
use super::read::{FIRST_LINE, Journal};
use super::record::{Record, header_line, line};
use std::collections::HashMap;

/// Several journals as one.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Merged {
    /// The text of the journal.
    pub text: String,
    /// Records of each file that those before it did not have.
    pub new: Vec<usize>,
}

/// The first journal, and then from each other one, in order, the records that were not there yet; names are
/// those of the files.
///
/// The header is the first one's. Merging a journal with itself, or again with one that it already holds,
/// changes nothing.
///
/// # Errors
/// [`JournalError`] when they are of different problems, data or versions, disagree about an outcome, or have
/// no checksums.
pub fn merge<R: Record>(journals: &[(&str, &Journal<R>)]) -> Result<Merged, JournalError> {
    let Some((_, first)) = journals.first() else { return Ok(Merged::default()) };
    let into = &first.header;
    let mut merged = Merged { text: header_line(into), new: Vec::new() };
    let mut known: HashMap<R::Identity, Place<R>> = HashMap::new();
    for (file, journal) in journals {
        if journal.is_unchecked() {
            return Err(JournalError::Unchecked { file: (*file).to_owned(), kind: R::KIND });
        }
        journal.check_problem(file, into)?;
        let before = known.len();
        for (record, number) in journal.records.iter().zip(FIRST_LINE..) {
            let here = Place { file, line: number, record };
            if let Some(there) = known.get(&record.identity()) {
                there.agrees(&here)?;
                continue;
            }
            merged.text += &line(&record.moved(&journal.header.body, &into.body), known.len());
            known.insert(record.identity(), here);
        }
        merged.new.push(known.len() - before);
    }
    Ok(merged)
}

/// Where a record stands.
struct Place<'a, R> {
    file: &'a str,
    line: usize,
    record: &'a R,
}

impl<R: Record> Place<'_, R> {
    fn agrees(&self, later: &Self) -> Result<(), JournalError> {
        let Some([expected, found]) = self.record.difference(later.record) else { return Ok(()) };
        Err(JournalError::Conflict {
            file: later.file.to_owned(),
            line: later.line,
            found,
            other_file: self.file.to_owned(),
            other_line: self.line,
            expected,
        })
    }
}
