//! The ledger of a trace fit: every iterate is made once, and written before it is counted.
//!
//! An iterate follows from the one before and from nothing else, so that a search that was killed goes on
//! with the same bits. At most the iterates that were being made are lost.

use super::FitError;
use super::evaluation::EvaluationStage;
use super::ledger::FitProgress;
use super::trace::{Checkpoint, Iterate, UncertaintyRun};
use super::trace_checkpoint::{IterateRecord, TraceCheckpoint, TraceHeader};
use crate::checkpoint::{CheckpointSink, format_header_line, format_record_line, sample_records};
use std::collections::{BTreeMap, HashMap};
use std::ops::ControlFlow;

/// How far a trace fit has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TraceProgress {
    /// Number of the chain: that of the start, or of a [`UncertaintyRun`].
    pub start: usize,
    /// Iterates of all searches so far, those of the journal included.
    pub iterates: usize,
    /// Those of them that were taken from the journal.
    pub replayed: usize,
    /// Number of the stage, from 0.
    pub stage: usize,
    /// Cost of the last iterate.
    pub cost: f64,
    /// Segments that fit worse than noise ever does.
    pub bad_segments: usize,
    pub segments: usize,
}

/// The same as of any fit: an iterate counts as an evaluation.
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

/// Called with every iterate; `Break` ends the fit, and what was found so far is kept.
pub(crate) type OnIterate<'a> = dyn FnMut(&TraceProgress) -> ControlFlow<()> + Send + 'a;

/// Why no more iterates are made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum TraceStopReason {
    /// It was asked to stop.
    Interrupted,
    /// As many iterates as were allowed have been made.
    Budget,
    /// The journal cannot be written.
    Journal(String),
}

/// The iterates of all searches of a trace fit, and where they are written.
pub(crate) struct TraceLedger<'a> {
    journal: &'a mut dyn CheckpointSink,
    on_iterate: &'a mut OnIterate<'a>,
    /// Iterates of the journal that is resumed.
    known: HashMap<(usize, usize), Iterate>,
    /// Lines of the journal.
    lines: usize,
    /// The header of a new journal, until it is written.
    opening: Option<String>,
    /// Iterates by the number of their start.
    counts: BTreeMap<usize, usize>,
    replayed: usize,
    most: usize,
    stopped: Option<TraceStopReason>,
}

impl<'a> TraceLedger<'a> {
    /// Searches that go on from a journal, or begin one with this header; `most` is the number of iterates
    /// allowed, those of the journal included.
    ///
    /// # Errors
    /// [`FitError`] when the journal is that of another fit.
    pub(crate) fn new(
        header: &TraceHeader,
        resume: Option<(&str, &TraceCheckpoint)>,
        most: usize,
        journal: &'a mut dyn CheckpointSink,
        on_iterate: &'a mut OnIterate<'a>,
    ) -> Result<Self, FitError> {
        if let Some((file, found)) = resume {
            check_seed(file, found.header.body.seed, header.body.seed)?;
            found.header.check_matches::<IterateRecord>(file, header)?;
        }
        let records = resume.map_or(&[][..], |(_, journal)| &journal.records);
        let known = records.iter();
        let known = known.map(|step| ((step.start, step.step), step.iterate.clone())).collect();
        let opening = resume.is_none().then(|| format_header_line(header));
        let (lines, counts, replayed, stopped) = (records.len(), BTreeMap::new(), 0, None);
        Ok(Self { journal, on_iterate, known, lines, opening, counts, replayed, most, stopped })
    }

    /// Iterates so far, those of the journal included.
    pub(crate) fn count_iterates(&self) -> usize {
        self.counts.values().sum()
    }

    /// The same of one start, from 0.
    pub(crate) fn count_start_iterates(&self, start: usize) -> usize {
        self.counts.get(&start).copied().unwrap_or(0)
    }

    /// Why nothing more was made.
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
            bad_segments: iterate.segments.iter().filter(|segment| segment.is_bad()).count(),
            segments: iterate.segments.len(),
        };
        (self.on_iterate)(&now)
    }

    fn write_iterate(&mut self, (start, step): (usize, usize), iterate: &Iterate) -> Result<(), String> {
        let made = IterateRecord { start, step, iterate: iterate.clone() };
        let lines = self.opening.take().unwrap_or_default() + &format_record_line(&made, self.lines);
        self.journal.append(&lines)?;
        self.lines += 1;
        Ok(())
    }

    fn stop_for(&mut self, why: TraceStopReason) -> ControlFlow<()> {
        self.stopped.get_or_insert(why);
        ControlFlow::Break(())
    }
}

fn check_seed(file: &str, found: u64, expected: u64) -> Result<(), FitError> {
    if found == expected {
        return Ok(());
    }
    Err(FitError::OtherSeed { file: file.to_owned(), found, expected })
}

impl Checkpoint for TraceLedger<'_> {
    fn find_iterate(&mut self, start: usize, step: usize) -> Option<Iterate> {
        let known = self.known.get(&(start, step))?.clone();
        self.replayed += 1;
        if self.count_iterate(start, &known).is_break() {
            self.stopped.get_or_insert(TraceStopReason::Interrupted); // (the next new iterate is not made any more)
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
        if let Err(problem) = self.write_iterate((start, step), iterate) {
            return self.stop_for(TraceStopReason::Journal(problem));
        }
        match self.count_iterate(start, iterate) {
            ControlFlow::Break(()) => self.stop_for(TraceStopReason::Interrupted),
            ControlFlow::Continue(()) => ControlFlow::Continue(()),
        }
    }
}

/// Makes some iterates of a journal again, each from the one before, and compares them to the last bit: a
/// search that is resumed believes none that the model does not give. `next` gives the iterate after one of a
/// chain, and the first one.
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
    // others each time, as it grows
    let seed = journal.header.body.seed.wrapping_add(records.len() as u64);
    for place in sample_records(records.len(), seed) {
        let stored = &records[place];
        let before = stored.step.checked_sub(1).map(|before| places.get(&(stored.start, before)));
        let again = match before {
            None => next(stored.start, None),
            Some(Some(before)) => next(stored.start, Some(before)),
            Some(None) => continue, // (nothing that it follows from is in the journal)
        };
        if let Some(iterate) = again {
            journal.check_recomputed(file, place, &IterateRecord { iterate, ..stored.clone() })?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
