//! Points of a journal once more: a resumed study believes none that the model does not give.

use super::journal::{Journal, Point};
use super::point::Outcome;
use super::study::Study;
use crate::journal::{JournalError, sample};
use crate::simulate::scene::Scene;
use rayon::prelude::*;

/// Runs some points of the journal that is resumed again, and compares them to the last bit; `file` is its
/// name in refusals.
///
/// # Errors
/// [`JournalError::Recomputed`] at the first that differs.
pub fn recheck(study: &Study, scene: &Scene, file: &str, journal: &Journal) -> Result<(), JournalError> {
    let records = &journal.records;
    let places = sample(records.len(), records.len() as u64); // others each time, as it grows
    let check = |place: usize| {
        let Some(Point { index, .. }) = records.get(place) else { return Ok(()) };
        let again = Point { index: *index, outcome: Outcome::of(study, scene, *index) };
        journal.check_again(file, place, &again)
    };
    let checked: Vec<Result<(), JournalError>> = places.into_par_iter().map(check).collect();
    checked.into_iter().collect()
}
