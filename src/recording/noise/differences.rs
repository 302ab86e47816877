//! Noise and step of one column, from the differences between neighbouring frames.

use crate::recording::channel::{collect_numbers, median_in_place};
use portable_math as math;

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
    noise_of_differences(third_differences(samples).map(f64::abs), 3)
}

/// Standard deviation of white noise from the mean square of the third differences. Steps of a sensor that
/// are as large as its noise do not change it, as they change [`noise_floor`]; outliers do.
pub(crate) fn mean_square_noise(samples: &[Option<f64>]) -> Option<f64> {
    let squares: Vec<f64> = third_differences(samples).map(|d| d * d).collect();
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    (squares.len() >= FEWEST_DIFFERENCES).then(|| (mean / DIFFERENCE_VARIANCES[3]).sqrt())
}

/// Standard deviation of the white noise whose absolute differences of this order have the same median as
/// `sizes`.
pub(crate) fn noise_of_differences(sizes: impl Iterator<Item = f64>, order: usize) -> Option<f64> {
    let mut sizes = collect_numbers(sizes);
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
#[inline(always)] // (the order is mostly known to the compiler, which leaves one case)
pub(crate) fn difference_at(samples: &[Option<f64>], frame: usize, order: usize) -> Option<f64> {
    let stencil = samples.get(frame.checked_sub(order)?..=frame)?;
    match *stencil {
        [Some(a), Some(b)] => Some(b - a),
        [Some(a), Some(b), Some(c)] => Some(c - 2.0 * b + a),
        [Some(a), Some(b), Some(c), Some(d)] => Some(d - 3.0 * c + 3.0 * b - a),
        [_, _] | [_, _, _] | [_, _, _, _] => None,
        _ => weighted_difference(stencil),
    }
}

fn weighted_difference(stencil: &[Option<f64>]) -> Option<f64> {
    let weighted = stencil.iter().rev().zip(DIFFERENCE_WEIGHTS[stencil.len() - 1]);
    weighted.map(|(sample, weight)| Some((*sample)? * weight)).sum()
}

/// The third differences of all frames in which they exist.
fn third_differences(samples: &[Option<f64>]) -> impl Iterator<Item = f64> {
    samples.windows(4).filter_map(|stencil| difference_at(stencil, 3, 3))
}

/// The third difference that is centred between `frame` and the frame before it. A jump of size 1 between
/// these two frames gives -2 here, and 1 for the frames before and after it.
#[inline]
pub(crate) fn difference_across(samples: &[Option<f64>], frame: usize) -> Option<f64> {
    difference_at(samples, frame + 1, 3)
}

/// The third difference at the frame `beside`, which is next to a jump at the frame `jump`, as a fraction of
/// that at the jump; positive if their signs differ. Without noise, it is 0.5 for a jump of the position, and
/// 1 for a jump of the speed.
pub(crate) fn fraction_beside_jump(samples: &[Option<f64>], jump: usize, beside: usize) -> Option<f64> {
    Some(-difference_across(samples, beside)? / difference_across(samples, jump)?)
}

/// Quantisation step of the samples, in their unit: the greatest common divisor of the differences between
/// neighbouring frames. `None` if there is no such step.
#[must_use]
pub fn quantisation_step(samples: &[Option<f64>]) -> Option<f64> {
    let (mut farthest_place, mut largest) = (0.0_f64, 0.0_f64);
    let mut last = None;
    for sample in samples {
        farthest_place = farthest_place.max(sample.map_or(0.0, f64::abs));
        largest = largest.max(sample.zip(last).map_or(0.0, |(place, last): (f64, f64)| (place - last).abs()));
        last = *sample;
    }
    let rounding = ROUNDING * farthest_place;
    let moves = || samples.windows(2).filter_map(|w| Some((w[1]? - w[0]?).abs())).filter(|&d| d > rounding);
    if moves().take(FEWEST_DIFFERENCES).count() < FEWEST_DIFFERENCES {
        return None;
    }
    let mut step = moves().next()?;
    let mut farthest = step;
    for distance in moves() {
        let divisor = approximate_common_divisor(distance, step, rounding);
        if divisor == step && distance <= farthest {
            continue; // (nearly every distance is a multiple of the step, which the correction then keeps)
        }
        // (rounding errors grow with each remainder of Euclid's algorithm; the largest distance, which is a
        // whole number of steps, corrects the step)
        farthest = distance.max(farthest);
        step = farthest / math::round(farthest / divisor);
        if step < largest / MOST_STEPS {
            return None;
        }
    }
    Some(step)
}

/// Euclid's algorithm, in which a remainder within `rounding` of zero is zero.
fn approximate_common_divisor(mut larger: f64, mut smaller: f64, rounding: f64) -> f64 {
    while smaller > rounding {
        let remainder = (larger - math::round(larger / smaller) * smaller).abs();
        (larger, smaller) = (smaller, remainder);
    }
    larger
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

    /// White noise of variance 1 by the sums of twelve uniform numbers, in steps of 1.5.
    #[test]
    fn steps_of_a_sensor_add_a_twelfth_of_their_square() {
        let mut state = 1u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let samples: Vec<Option<f64>> = (0..4000).map(|_| Some(1.5 * (normal() / 1.5).round())).collect();
        let expected = (1.0 + 1.5 * 1.5 / 12.0_f64).sqrt();
        assert!((mean_square_noise(&samples).unwrap() / expected - 1.0).abs() < 0.04);
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
        // pixels with decimals, in metres: the differences are multiples of the step only within rounding
        for (decimals, scale) in [(100.0, 20e-6), (1000.0, 21.37e-6), (1000.0, 1e-3 / 47.3)] {
            let pixels = (0..3000).map(|i| 2000.0 + 0.6 * f64::from(i) + 300.0 * (f64::from(i) / 97.0).sin());
            let metres: Vec<_> =
                pixels.map(|x: f64| Some((x * decimals).round() / decimals * scale)).collect();
            let step = quantisation_step(&metres).unwrap();
            assert!((step / scale * decimals - 1.0).abs() < 1e-6, "{step}");
        }
        let smooth: Vec<Option<f64>> = (0..40).map(|i| Some(f64::from(i).sin())).collect();
        assert_eq!(quantisation_step(&smooth), None);
    }
}
