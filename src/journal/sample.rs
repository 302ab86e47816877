//! Which records of a journal are computed again before it is believed.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Records of a journal that are computed again when it is resumed: a machine or a build that calculates
/// otherwise shows in nearly every record, and few of them cost little.
pub const RECHECKED_RECORDS: usize = 8;

/// Places of [`RECHECKED_RECORDS`] records, or of all where there are no more: one of each of as many equal parts,
/// drawn by the seed.
#[must_use]
pub fn sample_records(records: usize, seed: u64) -> Vec<usize> {
    let parts = RECHECKED_RECORDS.min(records);
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..parts)
        .map(|part| generator.random_range(part * records / parts..(part + 1) * records / parts))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_spread_over_the_records_and_follows_from_the_seed() {
        assert_eq!(sample_records(0, 1), [0; 0]);
        assert_eq!(sample_records(3, 1), [0, 1, 2]);
        for seed in 0..50 {
            let places = sample_records(801, seed);
            assert_eq!((places.len(), places.clone()), (RECHECKED_RECORDS, sample_records(801, seed)));
            assert!(
                places.iter().enumerate().all(|(i, at)| (100 * i..=100 * (i + 1)).contains(at)),
                "{places:?}"
            );
        }
        assert_ne!(sample_records(801, 1), sample_records(801, 2));
    }
}
