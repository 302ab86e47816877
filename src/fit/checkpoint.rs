//! Records and header of the journal of a fit.

use super::evaluation::{EvaluationOutcome, EvaluationStage};
use super::trace::{Iterate, SegmentState};
use crate::checkpoint::{CheckpointFile, CheckpointKind, CheckpointRecord};
use serde::{Deserialize, Serialize};

/// The journal of a fit.
pub type FitCheckpoint = CheckpointFile<FitRecord>;

/// One evaluation of a fit, or one iterate of a trace fit: a line of its journal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum FitRecord {
    /// Features of the model at a point.
    Evaluation {
        /// Purpose of the evaluation.
        stage: EvaluationStage,
        /// Outcome of the model. Costs are not stored: they depend on the scatter that a search estimates.
        outcome: EvaluationOutcome,
    },
    /// An iterate of a trace fit, with everything on which the next iterate depends.
    Iterate {
        /// Number of the chain: the number of a start or lobe, or of an uncertainty run.
        chain: usize,
        /// Number of the iterate in its chain, counted from 0. Each iterate is computed from the one before.
        step: usize,
        /// The iterate.
        iterate: Iterate,
    },
}

/// The part of the header that is specific to a fit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitHeader {
    /// Seed of the search.
    pub seed: u64,
    /// Names of the unknowns, in the order of the coordinates of a point.
    pub unknowns: Vec<String>,
    /// Names of the fitted features, in the order of their values; in a trace fit, of the recordings.
    pub data: Vec<String>,
    /// Length of the segments in each stage of a trace fit, s.
    pub segment_s: Vec<f64>,
}

/// The coordinates of a point in the unit box as bit patterns, to look up the point.
pub(crate) fn point_key(unit: &[f64]) -> Vec<u64> {
    unit.iter().map(|u| u.to_bits()).collect()
}

/// The key of an iterate: the number of its chain, and its number in the chain.
pub(crate) fn iterate_key(chain: usize, step: usize) -> Vec<u64> {
    vec![chain as u64, step as u64]
}

impl CheckpointRecord for FitRecord {
    const KIND: CheckpointKind = CheckpointKind::Fit;
    type Body = FitHeader;
    type Identity = Vec<u64>;

    fn identity(&self) -> Vec<u64> {
        match self {
            Self::Evaluation { outcome, .. } => point_key(&outcome.unit),
            Self::Iterate { chain, step, .. } => iterate_key(*chain, *step),
        }
    }

    fn check_against(&self, body: &FitHeader) -> Result<(), String> {
        match self {
            Self::Evaluation { outcome, .. } => check_outcome(outcome, body),
            Self::Iterate { iterate, .. } => check_iterate(iterate, body),
        }
    }

    fn problem_difference(found: &FitHeader, expected: &FitHeader) -> Option<String> {
        // `Journal::new` refuses another seed with its own advice
        let differs = FitHeader { seed: expected.seed, ..found.clone() } != *expected;
        differs.then(|| {
            "the header has other unknowns, features, recordings or segments than the fit".to_owned()
        })
    }
}

fn check_outcome(outcome: &EvaluationOutcome, body: &FitHeader) -> Result<(), String> {
    let EvaluationOutcome { unit, features, failure, .. } = outcome;
    check_count("unit", unit.len(), body.unknowns.len())?;
    check_count("features", features.len(), if failure.is_some() { 0 } else { body.data.len() })?;
    match unit.iter().find(|u| !(0.0..=1.0).contains(*u)) {
        Some(outside) => Err(format!("`unit`: found {outside}, expected 0 to 1")),
        None => Ok(()),
    }
}

fn check_iterate(iterate: &Iterate, body: &FitHeader) -> Result<(), String> {
    check_count("point", iterate.point.len(), body.unknowns.len())?;
    let (stage, stages, recordings) = (iterate.stage, body.segment_s.len(), body.data.len());
    if stage >= stages {
        return Err(format!("`stage`: found {stage}, expected below {stages}"));
    }
    let wrong = iterate.segments.iter().find(|s| s.recording >= recordings || s.first >= s.last);
    wrong.map_or(Ok(()), |SegmentState { recording, first, last, .. }| {
        Err(format!(
            "`segments`: found frames {first} to {last} of recording {recording}, expected rising frames of {recordings} recordings"
        ))
    })
}

fn check_count(key: &str, found: usize, expected: usize) -> Result<(), String> {
    if found == expected { Ok(()) } else { Err(format!("`{key}`: found {found}, expected {expected}")) }
}

#[cfg(test)]
pub(in crate::fit) mod tests;
