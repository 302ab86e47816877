//! The ledger of a run: every evaluation is made once, in parallel where possible, and entered in an order
//! that does not depend on the number of threads.

use super::evaluation::Evaluation;
use super::failure::FailureReason;
use super::journal::{Entry, key};
use super::objective::Objective;
use super::stage::Stage;
use crate::journal::{Sink, line};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::ops::ControlFlow;

/// How far a fit has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// What the last evaluations were made for.
    pub stage: Stage,
    /// Evaluations so far, replayed ones included.
    pub evaluations: usize,
    /// Those of them that were taken from the journal.
    pub replayed: usize,
    /// Lowest cost so far.
    pub best_cost: f64,
}

/// Called with every entry; `Break` ends the search, and what was found so far is the result.
pub type OnProgress<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + Send + 'a;

/// Why no more evaluations are made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stop {
    /// The evaluations allowed are used up.
    Budget,
    /// It was asked to stop.
    Interrupted,
    /// The journal cannot be written.
    Journal(String),
}

/// The evaluations of one run and where they are written.
pub struct Ledger<'a> {
    objective: &'a Objective<'a>,
    journal: &'a mut dyn Sink,
    on_progress: &'a mut OnProgress<'a>,
    replay: HashMap<Vec<u64>, Evaluation>,
    lines: usize,
    run: Vec<Evaluation>,
    replayed: usize,
    places: HashMap<Vec<u64>, usize>,
    best: Option<Evaluation>,
    limit: usize,
    stop: Option<Stop>,
    /// Evaluations that are not yet written; `None` when they are written as they come.
    held: Option<Vec<(Stage, usize)>>,
}

impl<'a> Ledger<'a> {
    /// A ledger that takes what `journaled` already holds from there; `limit` is the number of evaluations of
    /// this run.
    #[must_use]
    pub fn new(
        objective: &'a Objective<'a>,
        journaled: &[Entry],
        journal: &'a mut dyn Sink,
        on_progress: &'a mut OnProgress<'a>,
        limit: usize,
    ) -> Self {
        let priced = |entry: &Entry| (key(&entry.outcome.unit), objective.price(entry.outcome.clone()));
        let replay = journaled.iter().map(priced).collect();
        let (run, places, lines) = (Vec::new(), HashMap::new(), journaled.len());
        Self {
            objective,
            journal,
            on_progress,
            replay,
            lines,
            run,
            replayed: 0,
            places,
            best: None,
            limit,
            stop: None,
            held: None,
        }
    }

    /// The evaluations at `points` of the unit box, in their order; a point known from this run is not
    /// evaluated again.
    ///
    /// # Errors
    /// [`Stop`] when not all of them could be made; what was made is kept.
    pub fn evaluate(&mut self, stage: Stage, points: &[Vec<f64>]) -> Result<Vec<&Evaluation>, Stop> {
        if let Some(stop) = &self.stop {
            return Err(stop.clone());
        }
        let (new, complete) = self.new_points(points);
        // entered chunk by chunk so that little is lost when the program is killed; the order is that of the
        // points
        for chunk in new.chunks(2 * rayon::current_num_threads()) {
            let (objective, replay) = (self.objective, &self.replay);
            let made: Vec<(Evaluation, bool)> =
                chunk.par_iter().map(|point| make(objective, replay, point)).collect();
            self.write(stage, &made)?;
            for (evaluation, replayed) in made {
                self.enter(stage, evaluation, replayed);
            }
            if let Some(stop) = &self.stop {
                return Err(stop.clone());
            }
        }
        if !complete {
            return Err(Stop::Budget);
        }
        Ok(points.iter().filter_map(|point| self.find(point)).collect())
    }

    /// Holds new lines back until [`Self::release`]: what is refused at the gate leaves no journal.
    pub fn hold(&mut self) {
        self.held = Some(Vec::new());
    }

    /// Writes `opening`, then every line that was held back.
    ///
    /// # Errors
    /// Why the journal cannot be written.
    pub fn release(&mut self, opening: &str) -> Result<(), String> {
        let held = self.held.take().unwrap_or_default();
        let entries: Vec<_> =
            held.into_iter().filter_map(|(stage, at)| Some((stage, self.run.get(at)?.clone()))).collect();
        let lines = opening.to_owned() + &self.lines_of(entries.into_iter());
        if lines.is_empty() { Ok(()) } else { self.journal.append(&lines) }
    }

    /// The next lines of the journal.
    fn lines_of(&mut self, entries: impl Iterator<Item = (Stage, Evaluation)>) -> String {
        let mut text = String::new();
        for (stage, evaluation) in entries {
            text += &line(&Entry { stage, outcome: evaluation.into() }, self.lines);
            self.lines += 1;
        }
        text
    }

    /// Writes what was newly made, as one: the disk is waited for once, and nothing is counted or reported
    /// before it has the lines.
    fn write(&mut self, stage: Stage, made: &[(Evaluation, bool)]) -> Result<(), Stop> {
        if let Some(held) = &mut self.held {
            let places = made.iter().zip(self.run.len()..).filter(|((_, replayed), _)| !replayed);
            held.extend(places.map(|(_, at)| (stage, at)));
            return Ok(());
        }
        let new = made.iter().filter(|(_, replayed)| !replayed);
        let lines = self.lines_of(new.map(|(evaluation, _)| (stage, evaluation.clone())));
        if lines.is_empty() {
            return Ok(());
        }
        self.journal.append(&lines).map_err(|problem| self.stop_for(Stop::Journal(problem)))
    }

    /// Counts what is known and what will be by another objective of the same model and features.
    pub(crate) fn reprice(&mut self, objective: &'a Objective<'a>) {
        self.objective = objective;
        let known = self.run.iter_mut().chain(self.replay.values_mut());
        known.for_each(|evaluation| *evaluation = objective.price(evaluation.clone().into()));
        let mut best: Option<&Evaluation> = None;
        for evaluation in &self.run {
            best = best.filter(|best| best.cost <= evaluation.cost).or(Some(evaluation));
        }
        self.best = best.cloned();
    }

    /// What is evaluated.
    #[must_use]
    pub fn objective(&self) -> &'a Objective<'a> {
        self.objective
    }

    /// Evaluations of this run in order.
    #[must_use]
    pub fn run(&self) -> &[Evaluation] {
        &self.run
    }

    /// The known evaluation of lowest cost, the earliest among equals.
    #[must_use]
    pub fn best(&self) -> Option<&Evaluation> {
        self.best.as_ref()
    }

    /// Evaluations that this run may still make.
    #[must_use]
    pub fn remaining(&self) -> usize {
        self.limit.saturating_sub(self.run.len())
    }

    /// The number of evaluations of this run, at most.
    #[must_use]
    pub fn limit(&self) -> usize {
        self.limit
    }

    /// Changes the number of evaluations of this run.
    pub(crate) fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// Why nothing more can be evaluated at all, other than the budget.
    #[must_use]
    pub fn stopped(&self) -> Option<&Stop> {
        self.stop.as_ref()
    }

    /// Failed evaluations of this run, counted by reason.
    #[must_use]
    pub fn failures(&self) -> BTreeMap<FailureReason, usize> {
        let mut counts = BTreeMap::new();
        for failure in self.run.iter().filter_map(|e| e.failure.as_ref()) {
            *counts.entry(failure.reason).or_insert(0) += 1;
        }
        counts
    }

    /// The points of which this run knows nothing, each once, as many as the budget allows; and whether those
    /// are all.
    fn new_points(&self, points: &[Vec<f64>]) -> (Vec<Vec<f64>>, bool) {
        let mut new: Vec<Vec<f64>> = Vec::new();
        for point in points.iter().filter(|point| self.find(point).is_none()) {
            if !new.contains(point) {
                new.push(point.clone());
            }
        }
        let complete = new.len() <= self.remaining();
        new.truncate(self.remaining());
        (new, complete)
    }

    /// Counts and reports what was written; asked to stop, it counts the rest of what was written with it.
    fn enter(&mut self, stage: Stage, evaluation: Evaluation, replayed: bool) {
        self.replayed += usize::from(replayed);
        self.places.insert(key(&evaluation.unit), self.run.len());
        if self.best.as_ref().is_none_or(|best| evaluation.cost < best.cost) {
            self.best = Some(evaluation.clone());
        }
        self.run.push(evaluation);
        let best_cost = self.best.as_ref().map_or(f64::MAX, |best| best.cost);
        let progress = Progress { stage, evaluations: self.run.len(), replayed: self.replayed, best_cost };
        if (self.on_progress)(&progress).is_break() {
            self.stop = Some(Stop::Interrupted);
        }
    }

    fn stop_for(&mut self, stop: Stop) -> Stop {
        self.stop = Some(stop.clone());
        stop
    }

    /// What this run knows of a point.
    #[must_use]
    pub fn find(&self, point: &[f64]) -> Option<&Evaluation> {
        self.places.get(&key(point)).and_then(|at| self.run.get(*at))
    }
}

/// The evaluation at `point`, and whether it came from a journal.
fn make(objective: &Objective, replay: &HashMap<Vec<u64>, Evaluation>, point: &[f64]) -> (Evaluation, bool) {
    match replay.get(&key(point)) {
        Some(known) => (known.clone(), true),
        None => (objective.evaluate(point), false),
    }
}
