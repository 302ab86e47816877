//! Where the points of a study lie: on a grid, every value of a parameter with every value of the others, or
//! in the box of a sample.

use super::sample::SamplePlan;
use crate::blade::parameters::ModelParameter;
use crate::math;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Significant digits of a value between two ends: a grid is the same on every machine, and reads like one.
const DIGITS: usize = 12;

/// How values lie along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AxisSpacing {
    /// By differences.
    #[default]
    Linear,
    /// By factors.
    Log,
}

/// A parameter and the values that it takes, rising, in its own SI unit.
#[derive(Debug, Clone)]
pub struct SweepAxis {
    /// Its row in the table of parameters.
    pub parameter: &'static ModelParameter,
    /// At least two, rising; the ends of the range where points are sampled.
    pub values: Vec<f64>,
    /// How they are drawn, and how they were spread if they were.
    pub spacing: AxisSpacing,
}

impl AxisSpacing {
    /// The value at a share of the way from one end to the other.
    #[must_use]
    pub fn interpolate_value(self, from: f64, to: f64, share: f64) -> f64 {
        round_value(match self {
            Self::Linear => from + share * (to - from),
            Self::Log => from * math::exp(share * math::ln(to / from)),
        })
    }

    /// `points` values (two or more) from one end to the other, both included and exact.
    #[must_use]
    pub fn spread_values(self, from: f64, to: f64, points: usize) -> Vec<f64> {
        let last = points.saturating_sub(1);
        let inner = |i: usize| self.interpolate_value(from, to, i as f64 / last as f64);
        let ends = |i: usize| {
            if i == 0 {
                from
            } else if i == last {
                to
            } else {
                inner(i)
            }
        };
        (0..points).map(ends).collect()
    }
}

/// A range that is walked in one way.
#[derive(Debug, Clone, Copy)]
pub struct AxisValues<'a> {
    /// The values, rising.
    pub of: &'a [f64],
    /// How they are spread.
    pub spacing: AxisSpacing,
}

/// Value of every axis at point `index`; the first axis of a grid is the slowest.
#[must_use]
pub fn point_values(axes: &[AxisValues], sample: Option<&SamplePlan>, index: usize) -> Vec<f64> {
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

fn round_value(value: f64) -> f64 {
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

/// Places of point `index` along axes of these lengths; the first axis is the slowest.
#[must_use]
pub fn grid_indices(lengths: &[usize], index: usize) -> Vec<usize> {
    let mut rest = index;
    let mut places: Vec<usize> = lengths
        .iter()
        .rev()
        .map(|length| {
            let place = rest % length.max(&1);
            rest /= length.max(&1);
            place
        })
        .collect();
    places.reverse();
    places
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
}
