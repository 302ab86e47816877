//! Evaluations of a journal once more: a resumed fit believes none that the model does not give.

use super::context::FitContext;
use super::error::FitError;
use super::journal::{EvaluationRecord, FeatureCheckpoint, point_key};
use super::objective::Objective;
use crate::journal::{CheckpointError, sample_records};
use rayon::prelude::*;

/// Makes some evaluations of the journal that is resumed again, and compares them to the last bit.
pub(super) fn recheck_sample(objective: &Objective, context: &FitContext, seed: u64) -> Result<(), FitError> {
    let Some((file, journal)) = context.resume else { return Ok(()) };
    let records = journal.records.len();
    let places = sample_records(records, seed.wrapping_add(records as u64)); // others each time, as it grows
    let checked: Vec<Result<(), CheckpointError>> =
        places.into_par_iter().map(|place| recheck_record(objective, file, journal, place)).collect();
    Ok(checked.into_iter().collect::<Result<(), _>>()?)
}

/// The same for the evaluation at a point, if the journal has it.
pub(super) fn recheck_at(objective: &Objective, context: &FitContext, unit: &[f64]) -> Result<(), FitError> {
    let Some((file, journal)) = context.resume else { return Ok(()) };
    let place = journal.records.iter().position(|entry| point_key(&entry.outcome.unit) == point_key(unit));
    Ok(place.map_or(Ok(()), |place| recheck_record(objective, file, journal, place))?)
}

fn recheck_record(
    objective: &Objective,
    file: &str,
    journal: &FeatureCheckpoint,
    place: usize,
) -> Result<(), CheckpointError> {
    let Some(stored) = journal.records.get(place) else { return Ok(()) };
    let outcome = objective.evaluate(&stored.outcome.unit).into();
    journal.check_recomputed(file, place, &EvaluationRecord { outcome, ..stored.clone() })
}
