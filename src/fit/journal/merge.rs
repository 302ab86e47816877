//! Journals of one problem put together.

use super::lines::FIRST_LINE;
use super::{Journal, JournalError, check_problem, entry_line, header_line, key};
use crate::fit::objective::Evaluation;
use std::collections::HashMap;

/// Several journals as one.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Merged {
    /// The text of the journal.
    pub text: String,
    /// What each file had that those before it had not, in evaluations.
    pub new: Vec<usize>,
}

/// The first journal, and then from each other one, in order, the evaluations at points that were not there
/// yet; names are those of the files.
///
/// The header is the first one's. Evaluations of searches with another seed are marked with it: a fit that is
/// resumed from the merged journal counts them as known, and replays the unmarked ones alone. Merging a
/// journal with itself, or again with one that it already holds, changes nothing.
///
/// # Errors
/// [`JournalError`] when they are of different problems, data or versions, or disagree about a point.
pub fn merge(journals: &[(&str, &Journal)]) -> Result<Merged, JournalError> {
    let Some((_, first)) = journals.first() else { return Ok(Merged::default()) };
    let mut merged = Merged { text: header_line(&first.header), new: Vec::new() };
    let mut known: HashMap<Vec<u64>, Place> = HashMap::new();
    for (file, journal) in journals {
        check_problem(file, &journal.header, &first.header)?;
        let before = known.len();
        for (entry, line) in journal.entries.iter().zip(FIRST_LINE..) {
            let (key, here) =
                (key(&entry.evaluation.unit), Place { file, line, evaluation: &entry.evaluation });
            if let Some(there) = known.get(&key) {
                there.agrees(&here)?;
                continue;
            }
            let from =
                Some(entry.from.unwrap_or(journal.header.seed)).filter(|seed| *seed != first.header.seed);
            merged.text += &entry_line(known.len(), entry.stage, from, &entry.evaluation);
            known.insert(key, here);
        }
        merged.new.push(known.len() - before);
    }
    Ok(merged)
}

/// Where an evaluation stands.
struct Place<'a> {
    file: &'a str,
    line: usize,
    evaluation: &'a Evaluation,
}

impl Place<'_> {
    /// Features and failures of a point are the model's; what they cost depends on the scatter that a search
    /// met.
    fn agrees(&self, later: &Self) -> Result<(), JournalError> {
        if (&self.evaluation.features, &self.evaluation.failure)
            == (&later.evaluation.features, &later.evaluation.failure)
        {
            return Ok(());
        }
        let values = |place: &Self| place.evaluation.features.iter().map(|f| f.value()).collect::<Vec<_>>();
        let differ = values(self) != values(later);
        let words = |place: &Self| {
            if differ {
                format!("features {:?}", values(place))
            } else {
                format!("features {:?}", place.evaluation.features)
            }
        };
        Err(JournalError::Conflict {
            file: later.file.to_owned(),
            line: later.line,
            found: words(later),
            other_file: self.file.to_owned(),
            other_line: self.line,
            expected: words(self),
        })
    }
}
