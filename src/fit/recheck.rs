//! Evaluations of a journal once more: a resumed fit believes none that the model does not give.

use super::context::Context;
use super::error::FitError;
use super::journal::{Entry, Journal, key};
use super::objective::Objective;
use crate::journal::{JournalError, sample};
use rayon::prelude::*;

/// Makes some evaluations of the journal that is resumed again, and compares them to the last bit.
pub(super) fn some(objective: &Objective, context: &Context, seed: u64) -> Result<(), FitError> {
    let Some((file, journal)) = context.resume else { return Ok(()) };
    let records = journal.records.len();
    let places = sample(records, seed.wrapping_add(records as u64)); // others each time, as it grows
    let checked: Vec<Result<(), JournalError>> =
        places.into_par_iter().map(|place| check(objective, file, journal, place)).collect();
    Ok(checked.into_iter().collect::<Result<(), _>>()?)
}

/// The same for the evaluation at a point, if the journal has it.
pub(super) fn at(objective: &Objective, context: &Context, unit: &[f64]) -> Result<(), FitError> {
    let Some((file, journal)) = context.resume else { return Ok(()) };
    let place = journal.records.iter().position(|entry| key(&entry.outcome.unit) == key(unit));
    Ok(place.map_or(Ok(()), |place| check(objective, file, journal, place))?)
}

fn check(objective: &Objective, file: &str, journal: &Journal, place: usize) -> Result<(), JournalError> {
    let Some(stored) = journal.records.get(place) else { return Ok(()) };
    let outcome = objective.evaluate(&stored.outcome.unit).into();
    journal.check_again(file, place, &Entry { outcome, ..stored.clone() })
}
