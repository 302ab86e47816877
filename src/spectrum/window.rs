//! The Hann window over the frames present.

use crate::math;

/// Sums over the weights of a record.
#[derive(Debug, Clone, Copy)]
pub(super) struct WindowSums {
    /// Of the weights.
    pub first: f64,
    /// Of their squares.
    pub second: f64,
    /// Frames that hold a value.
    pub present: usize,
}

impl WindowSums {
    pub(super) fn from_weights(weights: &[f64]) -> Self {
        let add = |s: Self, w: &f64| Self {
            first: s.first + w,
            second: s.second + w * w,
            present: s.present + usize::from(*w > 0.0),
        };
        weights.iter().fold(Self { first: 0.0, second: 0.0, present: 0 }, add)
    }
}

/// Weights `sin^2(pi (i + 1/2) / n)`: symmetric, nowhere zero on a frame that holds a value, zero on one that
/// does not.
pub(super) fn hann_weights(samples: &[Option<f64>]) -> Vec<f64> {
    let n = samples.len() as f64;
    let weight = |i: usize| math::powi(math::sin(std::f64::consts::PI * (i as f64 + 0.5) / n), 2);
    samples.iter().enumerate().map(|(i, x)| if x.is_some() { weight(i) } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sums_are_those_of_the_hann_window() {
        let sums = WindowSums::from_weights(&hann_weights(&[Some(1.0); 64]));
        assert!((sums.first - 32.0).abs() < 1e-12 && (sums.second - 24.0).abs() < 1e-12);
        assert_eq!(sums.present, 64);
    }

    #[test]
    fn a_missing_frame_has_no_weight() {
        let weights = hann_weights(&[Some(1.0), None, Some(1.0), Some(1.0)]);
        assert_eq!(weights[1], 0.0);
        assert!((weights[2] - 0.853_553_390_593_273_8).abs() < 1e-15);
    }
}
