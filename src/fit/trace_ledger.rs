//! Ledger of a trace fit: every iterate is computed once, and written to the journal before it is counted.
//!
//! An iterate depends only on the previous one, so a search that was killed continues with exactly the same
//! numbers. Only the iterates that were being computed are lost.

use super::FitError;
use super::evaluation::EvaluationStage;
use super::ledger::FitProgress;
use super::trace::{Checkpoint, Iterate, UncertaintyRun};
use super::trace_checkpoint::{IterateRecord, TraceCheckpoint, TraceHeader};
use crate::checkpoint::{CheckpointSink, format_header_line, format_record_line, sample_records};
use std::collections::{BTreeMap, HashMap};
use std::ops::ControlFlow;

/// Progress of a trace fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TraceProgress {
    /// Number of the chain of the latest iterate: the number of a start, or that of an [`UncertaintyRun`].
    pub start: usize,
    /// Number of iterates of all chains so far, including those from the journal.
    pub iterates: usize,
    /// Number of iterates that were taken from the journal.
    pub replayed: usize,
    /// Index of the stage of the latest iterate.
    pub stage: usize,
    /// Cost of the latest iterate.
    pub cost: f64,
    /// Number of segments of the latest iterate that fit worse than noise explains.
    pub bad_segments: usize,
    pub segments: usize,
}

/// Each iterate counts as one evaluation.
impl From<TraceProgress> for FitProgress {
    fn from(now: TraceProgress) -> Self {
        let stage = match UncertaintyRun::from_chain_number(now.start) {
            None => EvaluationStage::Local,
            Some(UncertaintyRun::Twin(_)) => EvaluationStage::Bootstrap,
            Some(UncertaintyRun::Shorter | UncertaintyRun::Side { .. }) => EvaluationStage::Profile,
        };
        Self { stage, evaluations: now.iterates, replayed: now.replayed, best_cost: now.cost }
    }
}

/// Called after every iterate; `Break` ends the fit with the result found so far.
pub(crate) type OnIterate<'a> = dyn FnMut(&TraceProgress) -> ControlFlow<()> + Send + 'a;

/// Reason why a search stopped.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum TraceStopReason {
    /// The callback asked to stop.
    Interrupted,
    /// The maximum number of iterates is reached.
    Budget,
    /// The journal cannot be written, for this reason.
    Journal(String),
}

/// Counts and stores the iterates of a trace fit.
pub(crate) struct TraceLedger<'a> {
    journal: &'a mut dyn CheckpointSink,
    on_iterate: &'a mut OnIterate<'a>,
    /// Iterates of the journal that is resumed, by number of the chain and number within the chain.
    known: HashMap<(usize, usize), Iterate>,
    /// Number of records in the journal.
    lines: usize,
    /// Header line of a new journal; `None` once it is written.
    opening: Option<String>,
    /// Number of iterates of each chain so far.
    counts: BTreeMap<usize, usize>,
    replayed: usize,
    most: usize,
    stopped: Option<TraceStopReason>,
}

impl<'a> TraceLedger<'a> {
    /// A ledger that continues the journal `resume`, or begins a new journal with `header`. `most` is the
    /// maximum number of iterates, including those from the journal.
    ///
    /// # Errors
    /// [`FitError`] when the journal belongs to another fit.
    pub(crate) fn new(
        header: &TraceHeader,
        resume: Option<(&str, &TraceCheckpoint)>,
        most: usize,
        journal: &'a mut dyn CheckpointSink,
        on_iterate: &'a mut OnIterate<'a>,
    ) -> Result<Self, FitError> {
        if let Some((file, found)) = resume {
            let (expected, seed) = (header.body.seed, found.header.body.seed);
            if seed != expected {
                return Err(FitError::OtherSeed { file: file.to_owned(), found: seed, expected });
            }
            found.header.check_matches::<IterateRecord>(file, header)?;
        }
        let records = resume.map_or(&[][..], |(_, journal)| &journal.records);
        let known = records.iter().map(|step| ((step.start, step.step), step.iterate.clone())).collect();
        let opening = resume.is_none().then(|| format_header_line(header));
        let (lines, counts, replayed, stopped) = (records.len(), BTreeMap::new(), 0, None);
        Ok(Self { journal, on_iterate, known, lines, opening, counts, replayed, most, stopped })
    }

    /// Number of iterates so far, including those from the journal.
    pub(crate) fn count_iterates(&self) -> usize {
        self.counts.values().sum()
    }

    /// Number of iterates of one chain.
    pub(crate) fn count_start_iterates(&self, start: usize) -> usize {
        self.counts.get(&start).copied().unwrap_or(0)
    }

    /// Reason why the search stopped; `None` while it runs.
    pub(crate) fn stop_reason(&self) -> Option<&TraceStopReason> {
        self.stopped.as_ref()
    }

    fn count_iterate(&mut self, start: usize, iterate: &Iterate) -> ControlFlow<()> {
        *self.counts.entry(start).or_default() += 1;
        let now = TraceProgress {
            start,
            iterates: self.count_iterates(),
            replayed: self.replayed,
            stage: iterate.stage,
            cost: iterate.cost,
            bad_segments: iterate.count_bad_segments(),
            segments: iterate.segments.len(),
        };
        (self.on_iterate)(&now)
    }

    fn stop_for(&mut self, why: TraceStopReason) -> ControlFlow<()> {
        self.stopped.get_or_insert(why);
        ControlFlow::Break(())
    }
}

impl Checkpoint for TraceLedger<'_> {
    fn find_iterate(&mut self, start: usize, step: usize) -> Option<Iterate> {
        let known = self.known.get(&(start, step))?.clone();
        self.replayed += 1;
        if self.count_iterate(start, &known).is_break() {
            self.stopped.get_or_insert(TraceStopReason::Interrupted); // (the next new iterate is refused)
        }
        Some(known)
    }

    fn store_iterate(&mut self, start: usize, step: usize, iterate: &Iterate) -> ControlFlow<()> {
        if let Some(why) = self.stopped.clone() {
            return self.stop_for(why);
        }
        if self.count_iterates() >= self.most {
            return self.stop_for(TraceStopReason::Budget);
        }
        let made = IterateRecord { start, step, iterate: iterate.clone() };
        let lines = self.opening.take().unwrap_or_default() + &format_record_line(&made, self.lines);
        if let Err(problem) = self.journal.append(&lines) {
            return self.stop_for(TraceStopReason::Journal(problem));
        }
        self.lines += 1;
        if self.count_iterate(start, iterate).is_break() {
            return self.stop_for(TraceStopReason::Interrupted);
        }
        ControlFlow::Continue(())
    }
}

/// Recomputes a sample of the iterates in a journal, each from the previous iterate, and compares every bit:
/// a resumed search must not continue from iterates that the model does not reproduce. `next` computes the
/// first iterate of a chain, or the iterate that follows a given iterate.
///
/// # Errors
/// [`FitError::Journal`] with the line that differs.
pub(crate) fn recheck_iterates(
    file: &str,
    journal: &TraceCheckpoint,
    next: impl Fn(usize, Option<&Iterate>) -> Option<Iterate>,
) -> Result<(), FitError> {
    let records = &journal.records;
    let places: HashMap<(usize, usize), &Iterate> =
        records.iter().map(|step| ((step.start, step.step), &step.iterate)).collect();
    // the sample of recomputed iterates changes as the journal grows
    let seed = journal.header.body.seed.wrapping_add(records.len() as u64);
    for place in sample_records(records.len(), seed) {
        let stored = &records[place];
        let before = stored.step.checked_sub(1).map(|before| places.get(&(stored.start, before)));
        let again = match before {
            None => next(stored.start, None),
            Some(Some(before)) => next(stored.start, Some(before)),
            Some(None) => continue, // (the journal does not contain the previous iterate)
        };
        if let Some(iterate) = again {
            journal.check_recomputed(file, place, &IterateRecord { iterate, ..stored.clone() })?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
