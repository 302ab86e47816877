//! The journal of a running fit: every evaluation is made once, and written before it is counted.
//!
//! A fit that continues a journal asks for its evaluations in the same order as before, and takes those in
//! the journal from it. It computes a sample of them again, and stops if the model gives other numbers.

use super::FitError;
use super::checkpoint::{FitHeader, FitRecord, iterate_key};
use super::context::FitContext;
use super::trace::Iterate;
use crate::checkpoint::{
    self, CheckpointError, CheckpointHeader, CheckpointRecord, CheckpointSink, FIRST_LINE, StoredRecord,
    format_header_line, format_record_line, sample_records,
};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::ops::ControlFlow;

/// Progress of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FitProgress {
    /// Number of evaluations so far, including those from the journal. Each iterate of a trace fit is one
    /// evaluation.
    pub evaluations: usize,
    /// Number of evaluations that were taken from the journal.
    pub replayed: usize,
    /// Number of evaluations in the journal.
    pub journaled: usize,
    /// What the fit does, and its cost, in words.
    pub activity: String,
}

/// Called after every evaluation; `Break` ends the fit with the result found so far.
pub(crate) type OnProgress<'a> = dyn FnMut(&FitProgress) -> ControlFlow<()> + Send + 'a;

/// Reason why no more evaluations are made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StopReason {
    /// The evaluations allowed are used up.
    #[error("the evaluations allowed are used up")]
    Budget,
    /// The progress callback asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// The journal cannot be written.
    #[error("the journal cannot be written: {0}")]
    Journal(String),
    /// The model does not give what a line of the resumed journal says.
    #[error(transparent)]
    Refused(CheckpointError),
}

/// Counts and stores the evaluations of a fit.
pub struct Journal<'a> {
    sink: &'a mut dyn CheckpointSink,
    on_progress: &'a mut OnProgress<'a>,
    /// Name of the resumed journal.
    file: &'a str,
    /// Records of the resumed journal, with their line numbers.
    known: HashMap<Vec<u64>, (usize, &'a FitRecord)>,
    /// Line numbers of the records that are computed again.
    checked: HashSet<usize>,
    /// Lines that are not yet written.
    pending: String,
    /// Whether lines wait for [`Self::release_lines`].
    held: bool,
    made: usize,
    replayed: usize,
    limit: usize,
    stop: Option<StopReason>,
}

impl<'a> Journal<'a> {
    /// Continues the journal of the context, or begins a new one with `header`.
    ///
    /// # Errors
    /// [`FitError`] if the journal belongs to another fit, or if no evaluation is allowed.
    pub fn new(
        context: &FitContext<'a>,
        header: FitHeader,
        sink: &'a mut dyn CheckpointSink,
        on_progress: &'a mut OnProgress<'a>,
    ) -> Result<Self, FitError> {
        let limit = context.max_evaluations.unwrap_or(usize::MAX);
        let header = CheckpointHeader::new::<FitRecord>(context.fingerprint, context.version, header);
        let (mut known, mut checked, mut pending) = (HashMap::new(), HashSet::new(), String::new());
        match context.resume {
            None => pending = format_header_line(&header),
            Some((file, journal)) => {
                journal.header.check_matches::<FitRecord>(file, &header)?;
                let (found, expected) = (journal.header.body.seed, header.body.seed);
                if found != expected {
                    return Err(FitError::OtherSeed { file: file.to_owned(), found, expected });
                }
                let (records, count) = (journal.records.iter().enumerate(), journal.records.len());
                known = records.map(|(at, record)| (record.identity(), (FIRST_LINE + at, record))).collect();
                // the sample changes as the journal grows
                let sample = sample_records(count, expected.wrapping_add(count as u64));
                checked = sample.into_iter().map(|at| FIRST_LINE + at).collect();
            }
        }
        let file = context.resume.map_or("", |(file, _)| file);
        let (held, made, replayed, stop) = (false, 0, 0, None);
        Ok(Self { sink, on_progress, file, known, checked, pending, held, made, replayed, limit, stop })
    }

    /// Makes the evaluations with the given keys in parallel, or takes them from the resumed journal.
    /// `compute(i)` makes the evaluation with the key `keys[i]`; `None` is not stored. `count` is called with
    /// every evaluation in order, after it is written, and describes what the fit does.
    ///
    /// # Errors
    /// [`StopReason`] if some evaluations could not be made; those that were made are kept.
    pub(crate) fn compute_records(
        &mut self,
        keys: &[Vec<u64>],
        compute: &(dyn Fn(usize) -> Option<FitRecord> + Sync),
        count: &mut dyn FnMut(FitRecord) -> String,
    ) -> Result<(), StopReason> {
        let within = keys.len().min(self.remaining_evaluations());
        // evaluations are written in chunks, in the order of the keys, so that little is lost if the program
        // is killed
        let places: Vec<usize> = (0..within).collect();
        for places in places.chunks(2 * rayon::current_num_threads()) {
            if let Some(stop) = &self.stop {
                return Err(stop.clone());
            }
            let (known, checked) = (&self.known, &self.checked);
            let make = |at: &usize| match known.get(&keys[*at]) {
                Some(found) => (Some(*found), checked.contains(&found.0).then(|| compute(*at)).flatten()),
                None => (None, compute(*at)),
            };
            let made: Vec<_> = places.par_iter().map(make).collect();
            for (stored, computed) in &made {
                match (stored, computed) {
                    (Some(stored), Some(again)) => self.check_again(*stored, again.clone())?,
                    (None, Some(new)) => self.pending += &format_record_line(new),
                    _ => {}
                }
            }
            self.write_pending()?;
            for (stored, computed) in made {
                self.replayed += usize::from(stored.is_some());
                if let Some(record) = stored.map(|(_, record)| record.clone()).or(computed) {
                    self.report_progress(count(record));
                }
            }
        }
        if within == keys.len() { Ok(()) } else { Err(self.stop.clone().unwrap_or(StopReason::Budget)) }
    }

    /// Makes iterates of a trace fit in parallel, or takes them from the resumed journal. Each of `keys` is
    /// the number of a chain and the number of an iterate in this chain. `compute(i)` makes the iterate with
    /// the key `keys[i]`, or returns `None` at the end of the chain. `describe` describes an iterate of a
    /// chain. Returns the iterates in the order of `keys`.
    ///
    /// # Errors
    /// [`StopReason`] if some iterates could not be made.
    pub(crate) fn compute_iterates(
        &mut self,
        keys: &[(usize, usize)],
        compute: &(dyn Fn(usize) -> Option<Iterate> + Sync),
        describe: &dyn Fn(usize, &Iterate) -> String,
    ) -> Result<Vec<Iterate>, StopReason> {
        let make = |at: usize| {
            let (chain, step) = keys[at];
            compute(at).map(|iterate| FitRecord::Iterate { chain, step, iterate })
        };
        let mut found = Vec::new();
        let mut count = |record| match record {
            FitRecord::Iterate { chain, iterate, .. } => {
                let words = describe(chain, &iterate);
                found.push(iterate);
                words
            }
            FitRecord::Evaluation { .. } => String::new(),
        };
        let bits: Vec<Vec<u64>> = keys.iter().map(|(chain, step)| iterate_key(*chain, *step)).collect();
        // the limit stops only new iterates: not those of the journal, and not the ends of chains
        let limit = self.limit;
        let is_new = |at: usize| !self.known.contains_key(&bits[at]) && compute(at).is_some();
        if self.remaining_evaluations() < keys.len() && !(0..keys.len()).any(is_new) {
            self.limit = usize::MAX;
        }
        let computed = self.compute_records(&bits, &make, &mut count);
        self.limit = limit;
        computed.map(|()| found)
    }

    /// Compares a record of the resumed journal with the same evaluation made again.
    fn check_again(
        &mut self,
        (line, stored): (usize, &FitRecord),
        mut again: FitRecord,
    ) -> Result<(), StopReason> {
        // a point may be evaluated again for another purpose
        if let (FitRecord::Evaluation { stage: stored, .. }, FitRecord::Evaluation { stage, .. }) =
            (stored, &mut again)
        {
            *stage = *stored;
        }
        let stored = StoredRecord { record: stored.clone(), line };
        checkpoint::check_recomputed(self.file, &stored, &again)
            .map_err(|error| self.stop.insert(StopReason::Refused(error)).clone())
    }

    /// Compares an evaluation that is made again with the resumed journal, if it contains this evaluation.
    pub(crate) fn check_if_known(&mut self, compute: impl FnOnce() -> FitRecord, key: &[u64]) {
        if let Some(stored) = self.known.get(key).copied() {
            let _ = self.check_again(stored, compute()); // (`stop` keeps the difference)
        }
    }

    /// Delays writing lines until [`Self::release_lines`], so that a refused job creates no journal.
    pub(crate) fn hold_lines(&mut self) {
        self.held = true;
    }

    /// Writes the lines that were delayed.
    pub(crate) fn release_lines(&mut self) {
        self.held = false;
        let _ = self.write_pending(); // (`stop` keeps the failure)
    }

    /// Writes new lines in one call, so that the run waits for the disk only once.
    fn write_pending(&mut self) -> Result<(), StopReason> {
        if self.held || self.pending.is_empty() {
            return Ok(());
        }
        let lines = std::mem::take(&mut self.pending);
        self.sink.append(&lines).map_err(|problem| self.stop.insert(StopReason::Journal(problem)).clone())
    }

    /// Counts an evaluation, after it was written, and reports the progress.
    fn report_progress(&mut self, activity: String) {
        self.made += 1;
        let (evaluations, replayed) = (self.made, self.replayed);
        let journaled = if self.held { 0 } else { evaluations };
        let progress = FitProgress { evaluations, replayed, journaled, activity };
        if (self.on_progress)(&progress).is_break() {
            self.stop.get_or_insert(StopReason::Interrupted);
        }
    }

    /// Reports what the fit does after its last evaluation.
    ///
    /// # Errors
    /// [`StopReason`] if the fit is to end.
    pub(crate) fn announce(&mut self, activity: String) -> Result<(), StopReason> {
        let (evaluations, replayed) = (self.made, self.replayed);
        let progress = FitProgress { evaluations, replayed, journaled: evaluations, activity };
        if self.stop.is_none() && (self.on_progress)(&progress).is_break() {
            self.stop = Some(StopReason::Interrupted);
        }
        self.stop.clone().map_or(Ok(()), Err)
    }

    /// Number of evaluations of this run, including those from the journal.
    pub(crate) fn count_evaluations(&self) -> usize {
        self.made
    }

    /// Number of evaluations that this run may still make.
    pub(crate) fn remaining_evaluations(&self) -> usize {
        self.limit.saturating_sub(self.made)
    }

    /// Maximum number of evaluations of this run.
    pub(crate) fn evaluation_limit(&self) -> usize {
        self.limit
    }

    /// Sets the maximum number of evaluations of this run.
    pub(crate) fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// Reason why no more evaluations can be made; `None` if there is none. A used-up budget is not reported
    /// here.
    pub(crate) fn stop_reason(&self) -> Option<&StopReason> {
        self.stop.as_ref()
    }

    /// Whether the journal can be written and agrees with the model.
    ///
    /// # Errors
    /// [`FitError::JournalWrite`] or [`FitError::Journal`].
    pub(crate) fn check_sound(&self) -> Result<(), FitError> {
        match &self.stop {
            Some(StopReason::Journal(problem)) => Err(FitError::JournalWrite { problem: problem.clone() }),
            Some(StopReason::Refused(error)) => Err(FitError::Journal(error.clone())),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;
