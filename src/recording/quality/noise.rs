//! Measurements on one column: missing frames, noise, and the step of its values.

use crate::recording::channel::median_in_place;

/// Median absolute deviation of a normal distribution in units of its standard deviation.
const MAD_OF_NORMAL: f64 = 0.674_489_750_196_081_7;
/// Variances of the differences of white noise of unit variance, for orders 0 to 5: sums of squared binomial
/// weights, such as 1 + 9 + 9 + 1 for order 3.
const DIFFERENCE_VARIANCES: [f64; 6] = [1.0, 2.0, 6.0, 20.0, 70.0, 252.0];
/// Minimum number of differences between frames for an estimate of noise or step: the median of fewer is
/// uncertain.
const FEWEST_DIFFERENCES: usize = 8;
/// Largest remainder of a division that counts as zero, as a fraction of the largest position. It allows for
/// the rounding of decimal numbers.
const ROUNDING: f64 = 1e-10;
/// Maximum ratio of the largest difference between neighbouring frames to the quantisation step. A larger
/// ratio means that the common divisor is a coincidence of many digits.
const MOST_STEPS: f64 = 20_000.0;

/// Standard deviation of white noise on the samples, in their unit: the median absolute third difference of
/// four consecutive present frames, divided by `0.6745 sqrt(20)`. A third difference removes motion up to a
/// parabola. An oscillation within a few frames remains and makes the estimate too high; errors that change
/// slowly from frame to frame do not contribute.
#[must_use]
pub fn noise_floor(samples: &[Option<f64>]) -> Option<f64> {
    let third = |w: &[Option<f64>]| match *w {
        [Some(a), Some(b), Some(c), Some(d)] => Some((d - 3.0 * c + 3.0 * b - a).abs()),
        _ => None,
    };
    noise_of_differences(samples.windows(4).filter_map(third), 3)
}

/// Standard deviation of the white noise whose absolute differences of this order have the same median as
/// `sizes`.
pub(super) fn noise_of_differences(sizes: impl Iterator<Item = f64>, order: usize) -> Option<f64> {
    let mut sizes: Vec<f64> = sizes.collect();
    if sizes.len() < FEWEST_DIFFERENCES {
        return None;
    }
    Some(median_in_place(&mut sizes)? / (MAD_OF_NORMAL * DIFFERENCE_VARIANCES[order].sqrt()))
}

/// Binomial weights of the differences of orders 0 to 5.
const DIFFERENCE_WEIGHTS: [&[f64]; 6] = [
    &[1.0],
    &[1.0, -1.0],
    &[1.0, -2.0, 1.0],
    &[1.0, -3.0, 3.0, -1.0],
    &[1.0, -4.0, 6.0, -4.0, 1.0],
    &[1.0, -5.0, 10.0, -10.0, 5.0, -1.0],
];

/// The difference of an order up to 5 that ends at `frame`.
pub(super) fn difference_at(samples: &[Option<f64>], frame: usize, order: usize) -> Option<f64> {
    let stencil = samples.get(frame.checked_sub(order)?..=frame)?;
    let weighted = stencil.iter().rev().zip(DIFFERENCE_WEIGHTS[order]);
    weighted.map(|(sample, weight)| Some((*sample)? * weight)).sum()
}

/// Quantisation step of the samples, in their unit: the greatest common divisor of the differences between
/// neighbouring frames. `None` if there is no such step.
#[must_use]
pub fn quantisation_step(samples: &[Option<f64>]) -> Option<f64> {
    let rounding = ROUNDING * samples.iter().flatten().fold(0.0_f64, |most, v| most.max(v.abs()));
    let moves = || samples.windows(2).filter_map(|w| Some((w[1]? - w[0]?).abs())).filter(|&d| d > rounding);
    let largest = moves().fold(0.0, f64::max);
    if moves().take(FEWEST_DIFFERENCES).count() < FEWEST_DIFFERENCES {
        return None;
    }
    let mut step = moves().next()?;
    for distance in moves() {
        step = approximate_common_divisor(distance, step, rounding);
        if step < largest / MOST_STEPS {
            return None;
        }
    }
    Some(step)
}

/// Euclid's algorithm, in which a remainder within `rounding` of zero is zero.
fn approximate_common_divisor(mut larger: f64, mut smaller: f64, rounding: f64) -> f64 {
    while smaller > rounding {
        let remainder = (larger - (larger / smaller).round() * smaller).abs();
        (larger, smaller) = (smaller, remainder);
    }
    larger
}

/// Numbers and lengths of the runs of consecutive missing frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct FrameGaps {
    pub missing: usize,
    pub runs: usize,
    /// Length of the longest run, frames.
    pub longest: usize,
    pub longest_from: usize,
    /// Greatest common divisor of the distances between present frames: n if every n-th frame was tracked, 0
    /// if fewer than two frames are present.
    pub stride: usize,
}

impl FrameGaps {
    pub(crate) fn count_gaps(present: impl Iterator<Item = bool>) -> Self {
        let (mut gaps, mut run, mut last) = (Self::default(), 0, None);
        for (frame, present) in present.enumerate() {
            if present {
                gaps.stride = last.map_or(0, |last| greatest_common_divisor(gaps.stride, frame - last));
                last = Some(frame);
            }
            run = if present { 0 } else { run + 1 };
            gaps.missing += usize::from(!present);
            gaps.runs += usize::from(run == 1);
            if run > gaps.longest {
                (gaps.longest, gaps.longest_from) = (run, frame + 1 - run);
            }
        }
        gaps
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All third differences of the samples 0, 1, 0, 1, ... have the size 4, so that their median is known.
    #[test]
    fn the_noise_floor_is_the_median_third_difference_over_its_factor() {
        let samples: Vec<Option<f64>> = (0..40).map(|i| Some(f64::from(i % 2))).collect();
        let expected = 4.0 / (MAD_OF_NORMAL * 20.0_f64.sqrt());
        assert!((noise_floor(&samples).unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn the_stride_is_what_all_distances_between_frames_present_share() {
        let stride =
            |present: &[usize]| FrameGaps::count_gaps((0..100).map(|frame| present.contains(&frame))).stride;
        assert_eq!([stride(&[]), stride(&[3]), stride(&[3, 4, 90])], [0, 0, 1]);
        assert_eq!([stride(&[1, 38, 75]), stride(&[0, 6, 15, 99]), stride(&[2, 4, 8])], [37, 3, 2]);
    }

    #[test]
    fn a_parabola_has_no_noise_and_a_short_trace_no_estimate() {
        let parabola: Vec<Option<f64>> = (0..40).map(|i| Some(f64::from(i * i))).collect();
        assert_eq!(noise_floor(&parabola), Some(0.0));
        assert_eq!(noise_floor(&parabola[..10]), None);
    }

    #[test]
    fn a_step_is_found_where_there_is_one() {
        let moves = [3, 5, 2, 9, 4, 4, 7, 1, 12, 6, 3, 5];
        let pixels: Vec<Option<f64>> = moves.iter().map(|&i| Some(f64::from(i) * 21.5e-6)).collect();
        assert!((quantisation_step(&pixels).unwrap() - 21.5e-6).abs() < 1e-12);
        let smooth: Vec<Option<f64>> = (0..40).map(|i| Some(f64::from(i).sin())).collect();
        assert_eq!(quantisation_step(&smooth), None);
    }

    #[test]
    fn gaps_at_both_ends_and_the_first_of_equal_ones_count() {
        let present = [false, true, false, false, true, true, false, false];
        assert_eq!(
            FrameGaps::count_gaps(present.into_iter()),
            FrameGaps { missing: 5, runs: 3, longest: 2, longest_from: 2, stride: 1 }
        );
        assert_eq!(
            FrameGaps::count_gaps([true; 3].into_iter()),
            FrameGaps { stride: 1, ..FrameGaps::default() }
        );
    }
}
