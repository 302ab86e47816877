//! Points of a journal once more: a resumed study believes none that the model does not give.

use super::journal::Point;
use super::point::Outcome;
use super::study::Study;
use crate::journal::{Found, JournalError, RECHECKED, check_again};
use crate::simulate::scene::Scene;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

/// Points drawn from a journal while it is read, each as likely as every other.
#[derive(Debug)]
pub struct Recheck {
    drawn: Vec<Found<Point>>,
    offered: usize,
    generator: Xoshiro256PlusPlus,
}

impl Recheck {
    /// None drawn yet; others are drawn for every `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { drawn: Vec::new(), offered: 0, generator: Xoshiro256PlusPlus::seed_from_u64(seed) }
    }

    /// The next point of the journal.
    pub fn offer(&mut self, found: Found<Point>) {
        self.offered += 1;
        if self.drawn.len() < RECHECKED {
            self.drawn.push(found);
        } else if let Some(place) = self.drawn.get_mut(self.generator.random_range(0..self.offered)) {
            *place = found;
        }
    }

    /// Runs the points that were drawn again, and compares them to the last bit; `file` is the name of the
    /// journal in refusals.
    ///
    /// # Errors
    /// [`JournalError::Recomputed`] at the first that differs.
    pub fn check(&self, study: &Study, scene: &Scene, file: &str) -> Result<(), JournalError> {
        let check = |found: &Found<Point>| {
            let index = found.record.index;
            check_again(file, found, &Point { index, outcome: Outcome::of(study, scene, index) })
        };
        let checked: Vec<Result<(), JournalError>> = self.drawn.par_iter().map(check).collect();
        checked.into_iter().collect()
    }
}
