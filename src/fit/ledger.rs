//! Ledger of a run: it evaluates every point only once, in parallel where possible, and records the
//! evaluations in an order that does not depend on the number of threads.

use super::evaluation::{Evaluation, EvaluationStage, FailureReason};
use super::feature_checkpoint::{EvaluationRecord, point_key};
use super::objective::Objective;
use crate::checkpoint::{CheckpointSink, format_record_line};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::ops::ControlFlow;

/// Progress of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitProgress {
    /// Purpose of the latest evaluations.
    pub stage: EvaluationStage,
    /// Number of evaluations so far, including those replayed from the journal.
    pub evaluations: usize,
    /// Number of evaluations that were replayed from the journal.
    pub replayed: usize,
    /// Lowest cost so far.
    pub best_cost: f64,
}

/// Called after every evaluation; `Break` ends the search with the result found so far.
pub(crate) type OnProgress<'a> = dyn FnMut(&FitProgress) -> ControlFlow<()> + Send + 'a;

/// Reason why no more evaluations are made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StopReason {
    /// The evaluations allowed are used up.
    Budget,
    /// The progress callback asked to stop.
    Interrupted,
    /// The journal cannot be written.
    Journal(String),
}

/// The evaluations of one run and their journal.
pub struct Ledger<'a> {
    objective: &'a Objective<'a>,
    journal: &'a mut dyn CheckpointSink,
    on_progress: &'a mut OnProgress<'a>,
    replay: HashMap<Vec<u64>, Evaluation>,
    lines: usize,
    evaluations: Vec<Evaluation>,
    replayed: usize,
    places: HashMap<Vec<u64>, usize>,
    best: Option<Evaluation>,
    limit: usize,
    stop: Option<StopReason>,
    /// Evaluations that are not yet written to the journal; `None` if evaluations are written at once.
    held_lines: Option<Vec<(EvaluationStage, usize)>>,
}

impl<'a> Ledger<'a> {
    /// A ledger that replays the evaluations of a journal. `limit` is the maximum number of evaluations
    /// of this run.
    #[must_use]
    pub fn new(
        objective: &'a Objective<'a>,
        journaled: &[EvaluationRecord],
        journal: &'a mut dyn CheckpointSink,
        on_progress: &'a mut OnProgress<'a>,
        limit: usize,
    ) -> Self {
        let replay = |EvaluationRecord { outcome, .. }: &EvaluationRecord| {
            (point_key(&outcome.unit), objective.add_costs(outcome.clone()))
        };
        Self {
            objective,
            journal,
            on_progress,
            replay: journaled.iter().map(replay).collect(),
            lines: journaled.len(),
            evaluations: Vec::new(),
            replayed: 0,
            places: HashMap::new(),
            best: None,
            limit,
            stop: None,
            held_lines: None,
        }
    }

    /// Evaluates the model at `points` of the unit box and returns the evaluations in the order of the
    /// points. A point that this run has already evaluated is not evaluated again.
    ///
    /// # Errors
    /// [`StopReason`] if some points could not be evaluated; the completed evaluations are kept.
    pub(crate) fn evaluate_points(
        &mut self,
        stage: EvaluationStage,
        points: &[Vec<f64>],
    ) -> Result<Vec<&Evaluation>, StopReason> {
        if let Some(stop) = &self.stop {
            return Err(stop.clone());
        }
        let (new, complete) = self.new_points(points);
        // evaluations are recorded in chunks, in the order of the points, so that little is lost if the
        // program is killed
        for chunk in new.chunks(2 * rayon::current_num_threads()) {
            let (objective, replay) = (self.objective, &self.replay);
            let make = |point: &Vec<f64>| match replay.get(&point_key(point)) {
                Some(known) => (known.clone(), true),
                None => (objective.evaluate(point), false),
            };
            let made: Vec<(Evaluation, bool)> = chunk.par_iter().map(make).collect();
            self.write_lines(stage, &made)?;
            for (evaluation, replayed) in made {
                self.count_evaluation(stage, evaluation, replayed);
            }
            if let Some(stop) = &self.stop {
                return Err(stop.clone());
            }
        }
        if !complete {
            return Err(StopReason::Budget);
        }
        Ok(points.iter().filter_map(|point| self.find_evaluation(point)).collect())
    }

    /// Delays writing new lines to the journal until [`Self::release_lines`], so that a refused job creates
    /// no journal.
    pub(crate) fn hold_lines(&mut self) {
        self.held_lines = Some(Vec::new());
    }

    /// Writes `opening` to the journal, then the lines that were delayed.
    ///
    /// # Errors
    /// The reason why the journal cannot be written.
    pub(crate) fn release_lines(&mut self, opening: &str) -> Result<(), String> {
        let held = self.held_lines.take().unwrap_or_default();
        let entries: Vec<_> =
            held.into_iter().map(|(stage, at)| (stage, self.evaluations[at].clone())).collect();
        let lines = opening.to_owned() + &self.format_lines(entries.into_iter());
        if lines.is_empty() { Ok(()) } else { self.journal.append(&lines) }
    }

    fn format_lines(&mut self, entries: impl Iterator<Item = (EvaluationStage, Evaluation)>) -> String {
        let mut text = String::new();
        for (stage, evaluation) in entries {
            text += &format_record_line(&EvaluationRecord { stage, outcome: evaluation.into() }, self.lines);
            self.lines += 1;
        }
        text
    }

    /// Writes new evaluations in one call, so that the run waits for the disk only once. The evaluations are
    /// counted and reported after they are written.
    fn write_lines(&mut self, stage: EvaluationStage, made: &[(Evaluation, bool)]) -> Result<(), StopReason> {
        if let Some(held) = &mut self.held_lines {
            let places = made.iter().zip(self.evaluations.len()..).filter(|((_, replayed), _)| !replayed);
            held.extend(places.map(|(_, at)| (stage, at)));
            return Ok(());
        }
        let new = made.iter().filter(|(_, replayed)| !replayed);
        let lines = self.format_lines(new.map(|(evaluation, _)| (stage, evaluation.clone())));
        if lines.is_empty() {
            return Ok(());
        }
        self.journal.append(&lines).map_err(|problem| self.stop.insert(StopReason::Journal(problem)).clone())
    }

    /// Replaces the objective by another objective with the same model and features, and recomputes all
    /// costs.
    pub(crate) fn change_objective(&mut self, objective: &'a Objective<'a>) {
        self.objective = objective;
        let known = self.evaluations.iter_mut().chain(self.replay.values_mut());
        known.for_each(|evaluation| *evaluation = objective.add_costs(evaluation.clone().into()));
        let mut best: Option<&Evaluation> = None;
        for evaluation in &self.evaluations {
            best = best.filter(|best| best.cost <= evaluation.cost).or(Some(evaluation));
        }
        self.best = best.cloned();
    }

    pub(crate) fn objective(&self) -> &'a Objective<'a> {
        self.objective
    }

    /// Evaluations of this run, in order.
    #[must_use]
    pub fn run_evaluations(&self) -> &[Evaluation] {
        &self.evaluations
    }

    /// The evaluation with the lowest cost; if several have this cost, the earliest of them.
    #[must_use]
    pub fn best_evaluation(&self) -> Option<&Evaluation> {
        self.best.as_ref()
    }

    /// Number of evaluations that this run may still make.
    pub(crate) fn remaining_evaluations(&self) -> usize {
        self.limit.saturating_sub(self.evaluations.len())
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

    /// Number of failed evaluations of this run by reason.
    #[must_use]
    pub fn count_failures(&self) -> BTreeMap<FailureReason, usize> {
        let mut counts = BTreeMap::new();
        for failure in self.evaluations.iter().filter_map(|e| e.failure.as_ref()) {
            *counts.entry(failure.reason).or_insert(0) += 1;
        }
        counts
    }

    /// The points that still have to be evaluated, without repetitions and within the budget, and whether the
    /// budget covers all of them.
    fn new_points(&self, points: &[Vec<f64>]) -> (Vec<Vec<f64>>, bool) {
        let mut new: Vec<Vec<f64>> = Vec::new();
        for point in points.iter().filter(|point| self.find_evaluation(point).is_none()) {
            if !new.contains(point) {
                new.push(point.clone());
            }
        }
        let complete = new.len() <= self.remaining_evaluations();
        new.truncate(self.remaining_evaluations());
        (new, complete)
    }

    /// Counts an evaluation, after it was written, and reports the progress.
    fn count_evaluation(&mut self, stage: EvaluationStage, evaluation: Evaluation, replayed: bool) {
        self.replayed += usize::from(replayed);
        self.places.insert(point_key(&evaluation.unit), self.evaluations.len());
        if self.best.as_ref().is_none_or(|best| evaluation.cost < best.cost) {
            self.best = Some(evaluation.clone());
        }
        self.evaluations.push(evaluation);
        let best_cost = self.best.as_ref().map_or(f64::MAX, |best| best.cost);
        let progress =
            FitProgress { stage, evaluations: self.evaluations.len(), replayed: self.replayed, best_cost };
        if (self.on_progress)(&progress).is_break() {
            self.stop = Some(StopReason::Interrupted);
        }
    }

    /// The evaluation that this run has made or replayed at a point, if any.
    pub(crate) fn find_evaluation(&self, point: &[f64]) -> Option<&Evaluation> {
        self.places.get(&point_key(point)).and_then(|at| self.evaluations.get(*at))
    }
}
