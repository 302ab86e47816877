//! Ledger of a fit of features: it evaluates every point only once, and keeps the evaluations in an order
//! that does not depend on the number of threads.

use super::FitError;
use super::checkpoint::{FitRecord, point_key};
use super::evaluation::{Evaluation, EvaluationStage, FailureReason};
use super::journal::{Journal, StopReason};
use super::objective::Objective;
use std::collections::{BTreeMap, HashMap};

/// The evaluations of one run and their journal.
pub struct Ledger<'a> {
    objective: &'a Objective<'a>,
    journal: Journal<'a>,
    evaluations: Vec<Evaluation>,
    places: HashMap<Vec<u64>, usize>,
    best: Option<Evaluation>,
}

impl<'a> Ledger<'a> {
    /// A ledger without evaluations, which writes to `journal`.
    #[must_use]
    pub fn new(objective: &'a Objective<'a>, journal: Journal<'a>) -> Self {
        Self { objective, journal, evaluations: Vec::new(), places: HashMap::new(), best: None }
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
        if let Some(stop) = self.journal.stop_reason() {
            return Err(stop.clone());
        }
        let new = self.new_points(points);
        let keys: Vec<Vec<u64>> = new.iter().map(|point| point_key(point)).collect();
        let Self { objective, journal, evaluations, places, best } = self;
        let evaluate = |at: usize| Some(record_point(objective, stage, &new[at]));
        let mut count = |record| {
            if let FitRecord::Evaluation { mut outcome, .. } = record {
                places.insert(point_key(&outcome.unit), evaluations.len());
                outcome.values = objective.values(&outcome.unit);
                let evaluation = objective.add_costs(outcome);
                if best.as_ref().is_none_or(|best| evaluation.cost < best.cost) {
                    *best = Some(evaluation.clone());
                }
                evaluations.push(evaluation);
            }
            format!("{}, cost {:.4}", stage.name(), best.as_ref().map_or(f64::MAX, |best| best.cost))
        };
        journal.compute_records(&keys, &evaluate, &mut count)?;
        Ok(points.iter().filter_map(|point| self.find_evaluation(point)).collect())
    }

    /// Writes the header of the journal and the lines that were delayed.
    ///
    /// # Errors
    /// [`FitError::JournalWrite`] if the journal cannot be written.
    pub(crate) fn release_lines(&mut self) -> Result<(), FitError> {
        self.journal.release_lines();
        self.journal.check_sound()
    }

    /// Evaluates a point again, if the resumed journal contains it, and compares every bit.
    ///
    /// # Errors
    /// [`FitError`] if the journal cannot be written, or if the model gives another outcome than the journal.
    pub(crate) fn check_journal(&mut self, objective: &Objective, unit: &[f64]) -> Result<(), FitError> {
        self.journal
            .check_if_known(|| record_point(objective, EvaluationStage::Local, unit), &point_key(unit));
        self.journal.check_sound()
    }

    /// Replaces the objective by another objective with the same model and features, and recomputes all
    /// costs.
    pub(crate) fn change_objective(&mut self, objective: &'a Objective<'a>) {
        self.objective = objective;
        for evaluation in &mut self.evaluations {
            *evaluation = objective.add_costs(evaluation.clone().into());
        }
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
        self.journal.remaining_evaluations()
    }

    /// Maximum number of evaluations of this run.
    pub(crate) fn evaluation_limit(&self) -> usize {
        self.journal.evaluation_limit()
    }

    /// Sets the maximum number of evaluations of this run.
    pub(crate) fn set_limit(&mut self, limit: usize) {
        self.journal.set_limit(limit);
    }

    /// Reason why no more evaluations can be made; `None` if there is none. A used-up budget is not reported
    /// here.
    pub(crate) fn stop_reason(&self) -> Option<&StopReason> {
        self.journal.stop_reason()
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

    /// The points that still have to be evaluated, without repetitions.
    fn new_points(&self, points: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut new: Vec<Vec<f64>> = Vec::new();
        for point in points.iter().filter(|point| self.find_evaluation(point).is_none()) {
            if !new.contains(point) {
                new.push(point.clone());
            }
        }
        new
    }

    /// The evaluation that this run has made or replayed at a point, if any.
    pub(crate) fn find_evaluation(&self, point: &[f64]) -> Option<&Evaluation> {
        self.places.get(&point_key(point)).and_then(|at| self.evaluations.get(*at))
    }
}

fn record_point(objective: &Objective, stage: EvaluationStage, point: &[f64]) -> FitRecord {
    FitRecord::Evaluation { stage, outcome: objective.evaluate(point).into() }
}
