//! Points of a study that are drawn from a box instead of a grid.

use rand::{RngCore, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sobol::Sobol;
use sobol::params::JoeKuoD6;
use std::sync::OnceLock;

/// Most dimensions: more than a scene has parameters.
const MOST_DIMENSIONS: usize = 64;
/// Bits of a coordinate, and so of the number of a point.
const BITS: usize = 32;

/// How the points of a sampled study are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SamplePlan {
    /// Sequence that fills the box.
    #[serde(default)]
    pub method: SampleSequence,
    /// Number of points; a power of two fills the box most evenly.
    pub points: usize,
    /// Another seed gives another sample of the same quality.
    #[serde(default)]
    pub seed: u64,
}

/// A sequence that fills a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SampleSequence {
    /// The Sobol sequence (direction numbers of Joe and Kuo, SIAM J. Sci. Comput. 30 (2008) 2635), shifted
    /// digit by digit by random numbers from the seed.
    #[default]
    Sobol,
}

impl SamplePlan {
    /// Coordinates of point `index` in a unit box, each above 0 and below 1; any point by itself, without
    /// those before it.
    pub fn unit_coordinates(&self, index: usize) -> impl Iterator<Item = f64> {
        let SampleSequence::Sobol = self.method;
        let mut shifts = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let gray = index as u64 ^ (index as u64 >> 1);
        direction_numbers().iter().map(move |directions| {
            let set = directions.iter().enumerate().filter(|(bit, _)| gray >> bit & 1 == 1);
            let digits = set.fold(shifts.next_u32(), |digits, (_, direction)| digits ^ direction);
            (f64::from(digits) + 0.5) / (1_u64 << BITS) as f64
        })
    }
}

/// Direction numbers, a row a dimension and the first for the lowest bit of a point's number.
fn direction_numbers() -> &'static [Vec<u32>] {
    static DIRECTIONS: OnceLock<Vec<Vec<u32>>> = OnceLock::new();
    DIRECTIONS.get_or_init(|| Sobol::<u32>::init_direction_vals(MOST_DIMENSIONS, BITS, &JoeKuoD6::minimal()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unshifted(index: usize, dimensions: usize) -> Vec<u32> {
        let sample =
            |index| SamplePlan { method: SampleSequence::Sobol, points: 1, seed: 5 }.unit_coordinates(index);
        let digits = |share: f64| (share * 4_294_967_296.0) as u32;
        sample(index).zip(sample(0)).take(dimensions).map(|(a, b)| digits(a) ^ digits(b)).collect()
    }

    /// Every point is that of the crate's sequence, which makes one from the one before.
    #[test]
    fn a_point_by_itself_is_that_of_the_sequence() {
        let sequence = Sobol::<u32>::new(12, &JoeKuoD6::minimal());
        for (index, point) in sequence.take(3000).enumerate() {
            assert_eq!(unshifted(index, 12), point, "{index}");
        }
    }

    /// 2^k points have one coordinate in each of 2^k equal parts, whatever the seed and the dimension.
    #[test]
    fn every_coordinate_is_stratified() {
        for seed in [0, 1, 99] {
            let sample = SamplePlan { method: SampleSequence::Sobol, points: 256, seed };
            let points: Vec<Vec<f64>> =
                (0..256).map(|index| sample.unit_coordinates(index).take(25).collect()).collect();
            for dimension in 0..25 {
                let mut parts: Vec<usize> = points.iter().map(|p| (p[dimension] * 256.0) as usize).collect();
                parts.sort_unstable();
                assert_eq!(parts, (0..256).collect::<Vec<_>>(), "seed {seed}, dimension {dimension}");
            }
        }
    }

    /// The integral of a product whose value is known, by 4,096 points in six dimensions: a plain random
    /// sample is off by 0.01.
    #[test]
    fn a_sample_integrates_better_than_random_numbers() {
        let sample = SamplePlan { method: SampleSequence::Sobol, points: 4096, seed: 3 };
        let value = |index| sample.unit_coordinates(index).take(6).map(|x| 1.0 + (x - 0.5)).product::<f64>();
        let mean = (0..4096).map(value).sum::<f64>() / 4096.0;
        assert!((mean - 1.0).abs() < 1e-3, "{mean}");
    }
}
