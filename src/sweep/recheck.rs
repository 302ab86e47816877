//! Points of a journal once more: a resumed study believes none that the model does not give.

use super::journal::SweepPoint;
use super::point::PointOutcome;
use super::study::Study;
use crate::journal::{CheckpointError, RECHECKED_RECORDS, StoredRecord, check_recomputed};
use crate::simulate::scene::Scene;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

/// Points drawn from a journal while it is read, each as likely as every other.
#[derive(Debug)]
pub struct PointRecheck {
    drawn: Vec<StoredRecord<SweepPoint>>,
    offered: usize,
    generator: Xoshiro256PlusPlus,
}

impl PointRecheck {
    /// None drawn yet; others are drawn for every `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { drawn: Vec::new(), offered: 0, generator: Xoshiro256PlusPlus::seed_from_u64(seed) }
    }

    /// The next point of the journal.
    pub fn offer_point(&mut self, found: StoredRecord<SweepPoint>) {
        self.offered += 1;
        if self.drawn.len() < RECHECKED_RECORDS {
            self.drawn.push(found);
        } else if let Some(place) = self.drawn.get_mut(self.generator.random_range(0..self.offered)) {
            *place = found;
        }
    }

    /// Runs the points that were drawn again, and compares them to the last bit; `file` is the name of the
    /// journal in refusals.
    ///
    /// # Errors
    /// [`CheckpointError::Recomputed`] at the first that differs.
    pub fn check_points(&self, study: &Study, scene: &Scene, file: &str) -> Result<(), CheckpointError> {
        let check = |found: &StoredRecord<SweepPoint>| {
            let index = found.record.index;
            check_recomputed(
                file,
                found,
                &SweepPoint { index, outcome: PointOutcome::run_point(study, scene, index) },
            )
        };
        let checked: Vec<Result<(), CheckpointError>> = self.drawn.par_iter().map(check).collect();
        checked.into_iter().collect()
    }
}
