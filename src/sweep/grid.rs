//! Points of a study: a grid of all combinations of the values of the axes, or a sample of the box that they
//! span.

use crate::model::parameters::ModelParameter;
use portable_math as math;
use rand::{RngCore, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sobol::Sobol;
use sobol::params::JoeKuoD6;
use std::sync::OnceLock;

/// Number of significant digits to which the values between the two ends of an axis are rounded, so that they
/// are short and the same on every machine.
const DIGITS: usize = 12;

/// Spacing of the values of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AxisSpacing {
    /// Equal differences between successive values.
    #[default]
    Linear,
    /// Equal ratios of successive values.
    Log,
}

/// A parameter and its rising values, in SI units.
#[derive(Debug, Clone)]
pub struct SweepAxis {
    /// Row of the parameter in the table of parameters.
    pub parameter: &'static ModelParameter,
    /// At least two rising values; for a sample, the two ends of the range.
    pub values: Vec<f64>,
    /// Spacing of the values, also on the axis of a figure.
    pub spacing: AxisSpacing,
}

impl AxisSpacing {
    /// Value at the fraction `share` of the range, rounded to [`DIGITS`] significant digits.
    pub(crate) fn interpolate_value(self, from: f64, to: f64, share: f64) -> f64 {
        let value = match self {
            Self::Linear => from + share * (to - from),
            Self::Log => from * math::exp(share * math::ln(to / from)),
        };
        format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
    }

    /// `points` values (at least two) spread over the range; both ends are exact.
    pub(crate) fn spread_values(self, from: f64, to: f64, points: usize) -> Vec<f64> {
        let last = points.saturating_sub(1);
        let value = |i: usize| match i {
            0 => from,
            _ if i == last => to,
            _ => self.interpolate_value(from, to, i as f64 / last as f64),
        };
        (0..points).map(value).collect()
    }
}

/// Values of an axis and their spacing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AxisValues<'a> {
    pub of: &'a [f64],
    pub spacing: AxisSpacing,
}

/// Value of every axis at point `index`; the first axis of a grid changes slowest.
pub(crate) fn point_values(axes: &[AxisValues], sample: Option<&SamplePlan>, index: usize) -> Vec<f64> {
    match sample {
        Some(sample) => {
            let sampled = |(axis, share): (&AxisValues, f64)| {
                Some(axis.spacing.interpolate_value(*axis.of.first()?, *axis.of.last()?, share))
            };
            axes.iter().zip(sample.unit_coordinates(index)).filter_map(sampled).collect()
        }
        None => {
            let lengths: Vec<usize> = axes.iter().map(|axis| axis.of.len()).collect();
            let places = grid_indices(&lengths, index).into_iter().zip(axes);
            places.filter_map(|(place, axis)| axis.of.get(place).copied()).collect()
        }
    }
}

/// Indices of point `index` along axes with these lengths; the first axis changes slowest.
pub(crate) fn grid_indices(lengths: &[usize], index: usize) -> Vec<usize> {
    let mut rest = index;
    let mut places = vec![0; lengths.len()];
    for (place, length) in places.iter_mut().zip(lengths).rev() {
        (*place, rest) = (rest % length.max(&1), rest / length.max(&1));
    }
    places
}

// Sampled points.

/// Maximum number of dimensions of a sample; a scene has fewer parameters.
const MOST_DIMENSIONS: usize = 64;
/// Number of bits of a coordinate and of the index of a point.
const BITS: usize = 32;

/// Choice of the points of a sampled study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SamplePlan {
    /// Sequence of points that fills the box.
    #[serde(default)]
    pub method: SampleSequence,
    /// Number of points; a power of two fills the box most evenly.
    pub points: usize,
    /// Seed of the sample; another seed gives another sample of the same quality.
    #[serde(default)]
    pub seed: u64,
}

/// A sequence of points that fills a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SampleSequence {
    /// The Sobol sequence (direction numbers of Joe and Kuo, SIAM J. Sci. Comput. 30 (2008) 2635), shifted
    /// digit by digit by random numbers from the seed.
    #[default]
    Sobol,
}

impl SamplePlan {
    /// Coordinates of point `index` in the unit box, each above 0 and below 1. They are computed directly
    /// from the Gray code of the index, without the preceding points.
    pub(crate) fn unit_coordinates(&self, index: usize) -> impl Iterator<Item = f64> {
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

/// Direction numbers: one row per dimension, whose first number belongs to the lowest bit of an index.
fn direction_numbers() -> &'static [Vec<u32>] {
    static DIRECTIONS: OnceLock<Vec<Vec<u32>>> = OnceLock::new();
    DIRECTIONS.get_or_init(|| Sobol::<u32>::init_direction_vals(MOST_DIMENSIONS, BITS, &JoeKuoD6::minimal()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_spread_from_end_to_end_and_read_like_written() {
        assert_eq!(AxisSpacing::Linear.spread_values(0.1, 0.6, 6), [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
        assert_eq!(AxisSpacing::Log.spread_values(1e-3, 1e3, 7), [1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3]);
        assert_eq!(AxisSpacing::Log.spread_values(1.0 / 3.0, 2.0 / 3.0, 2), [1.0 / 3.0, 2.0 / 3.0]);
    }

    #[test]
    fn the_first_axis_is_the_slowest() {
        let axes =
            [&[1.0, 2.0][..], &[5.0, 6.0, 7.0]].map(|of| AxisValues { of, spacing: AxisSpacing::Linear });
        let all: Vec<_> = (0..6).map(|i| point_values(&axes, None, i)).collect();
        assert_eq!(all, [[1.0, 5.0], [1.0, 6.0], [1.0, 7.0], [2.0, 5.0], [2.0, 6.0], [2.0, 7.0]]);
        assert_eq!(grid_indices(&[2, 3], 4), [1, 1]);
    }

    fn unshifted(index: usize, dimensions: usize) -> Vec<u32> {
        let sample =
            |index| SamplePlan { method: SampleSequence::Sobol, points: 1, seed: 5 }.unit_coordinates(index);
        let digits = |share: f64| (share * 4_294_967_296.0) as u32;
        sample(index).zip(sample(0)).take(dimensions).map(|(a, b)| digits(a) ^ digits(b)).collect()
    }

    /// The crate computes each point of the sequence from the previous one; here each comes from its index
    /// only.
    #[test]
    fn a_point_by_itself_is_that_of_the_sequence() {
        let sequence = Sobol::<u32>::new(12, &JoeKuoD6::minimal());
        for (index, point) in sequence.take(3000).enumerate() {
            assert_eq!(unshifted(index, 12), point, "{index}");
        }
    }

    /// In every dimension and with every seed, 2^k points have exactly one coordinate in each of 2^k equal
    /// parts.
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

    /// Integrates a product whose integral is known, with 4,096 points in six dimensions; with random points
    /// the error is about 0.01.
    #[test]
    fn a_sample_integrates_better_than_random_numbers() {
        let sample = SamplePlan { method: SampleSequence::Sobol, points: 4096, seed: 3 };
        let value = |index| sample.unit_coordinates(index).take(6).map(|x| 1.0 + (x - 0.5)).product::<f64>();
        let mean = (0..4096).map(value).sum::<f64>() / 4096.0;
        assert!((mean - 1.0).abs() < 1e-3, "{mean}");
    }
}
