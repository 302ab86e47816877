//! Recognises a moving average and a Savitzky-Golay filter by the zeros in the spectrum of the noise.
//!
//! A filter multiplies the flat spectrum of white noise by the square of its frequency response. The median
//! power of short segments is compared with this shape for every usual window, above a fifth of the Nyquist
//! frequency, where little motion is left.

use super::prefilter::{SEGMENT, SegmentSpectrum};
use crate::recording::channel::find_median;
use portable_math as math;
use std::f64::consts::TAU;

/// Lengths of the filter windows that are tried, frames: shorter windows hardly smooth, longer ones leave
/// less than two bins between their zeros.
const WINDOWS: std::ops::RangeInclusive<usize> = 3..=25;
/// Minimum number of segments: the median power is then known to about 40 %.
const FEWEST_SEGMENTS: usize = 12;
/// First frequency bin that is compared; motion and trend are at lower frequencies.
const FIRST_BIN: usize = 12;
/// Powers of the white noise that is added to the response of a filter before the comparison, as fractions of
/// the response at zero frequency. This noise represents rounding in the export.
const FLOORS: [f64; 3] = [0.0, 1e-3, 1e-2];
/// Largest allowed root mean square deviation of the logarithm of the power from the shape of a filter. With
/// few segments, the medians alone scatter by 0.4.
const MATCHES: f64 = 0.6;
/// Smallest root mean square deviation of the logarithm of the power from a flat spectrum, and smallest ratio
/// of this deviation to the deviation from the shape of the filter. In 360 columns of clean films no filter
/// reaches this ratio.
const NOT_WHITE: (f64, f64) = (0.8, 2.0);

/// A filter that fits a polynomial to a window and takes its value in the middle.
pub(super) struct Smoothing {
    /// Length of the window, frames.
    window: usize,
    /// Degree of the polynomial; 0 is the moving average.
    degree: usize,
    /// Frequency at which half the power passes, in units of the frame rate.
    pub cutoff: f64,
    /// Root mean square deviation of the spectrum from that of white noise, dB.
    white_db: f64,
}

impl Smoothing {
    /// Name of the filter with its window, and the deviation from white noise.
    pub(super) fn describe(&self) -> String {
        let Self { window, degree, white_db, .. } = self;
        let filter = match degree {
            0 => format!("a moving average over {window} frames"),
            _ => format!("a Savitzky-Golay filter of degree {degree} over {window} frames"),
        };
        format!("the noise has the spectrum of {filter}; it is {white_db:.1} dB (rms) from white")
    }
}

/// The filter whose frequency response fits the spectrum of the noise; `None` for too few segments, or if no
/// filter fits far better than a flat spectrum.
pub(super) fn find_smoothing(spectrum: &SegmentSpectrum) -> Option<Smoothing> {
    if spectrum.segments < FEWEST_SEGMENTS {
        return None;
    }
    let powers: Vec<f64> = spectrum.bins.iter().map(|bin| bin.median).collect();
    let white = log_deviation(&powers, &[1.0; SEGMENT / 2])?;
    if white < NOT_WHITE.0 {
        return None;
    }
    let degrees =
        |window: usize| [0, 2, 4].into_iter().filter(move |d| *d == 0 || (window % 2 == 1 && window > d + 2));
    let filters = WINDOWS.flat_map(|window| degrees(window).map(move |degree| (window, degree)));
    let deviation = |(window, degree)| {
        let shape = response_powers(&smoothing_weights(window, degree));
        let half = shape.iter().position(|power| *power < 0.5)?;
        Some((window, degree, half, log_deviation(&powers, &shape)?))
    };
    let (window, degree, half, least) = filters.filter_map(deviation).min_by(|a, b| a.3.total_cmp(&b.3))?;
    let found = least < MATCHES && white > NOT_WHITE.1 * least;
    let white_db = 10.0 / math::ln(10.0) * white;
    found.then(|| Smoothing { window, degree, cutoff: half as f64 / SEGMENT as f64, white_db })
}

/// Root mean square deviation of the logarithm of the powers from that of a spectral shape. The level of the
/// shape is fitted (median), and the added white noise of [`FLOORS`] with the smallest deviation is used.
fn log_deviation(powers: &[f64], shape: &[f64]) -> Option<f64> {
    let with_floor = |floor: f64| {
        let log = |bin: usize| math::ln(powers[bin] / (shape[bin] + floor));
        let logs: Vec<f64> = (FIRST_BIN..powers.len()).map(log).collect();
        let middle = find_median(logs.iter().copied())?;
        let mean_square = logs.iter().map(|log| math::powi(log - middle, 2)).sum::<f64>() / logs.len() as f64;
        mean_square.is_finite().then(|| mean_square.sqrt())
    };
    FLOORS.into_iter().filter_map(with_floor).min_by(f64::total_cmp)
}

/// Weights of the samples of a window in the value of their least-squares polynomial at the middle (Savitzky
/// and Golay 1964), computed from polynomials that are orthogonal on the window.
fn smoothing_weights(window: usize, degree: usize) -> Vec<f64> {
    let half = (window as f64 - 1.0) / 2.0;
    let mut weights = vec![0.0; window];
    let mut basis: Vec<Vec<f64>> = vec![];
    // (the odd polynomials are zero in the middle)
    for exponent in (0..=degree).step_by(2) {
        let mut next: Vec<f64> =
            (0..window).map(|i| math::powi((i as f64 - half) / half, exponent as i32)).collect();
        for known in &basis {
            let along: f64 = known.iter().zip(&next).map(|(a, b)| a * b).sum();
            next.iter_mut().zip(known).for_each(|(x, known)| *x -= along * known);
        }
        let size = next.iter().map(|x| x * x).sum::<f64>().sqrt();
        next.iter_mut().for_each(|x| *x /= size);
        weights.iter_mut().zip(&next).for_each(|(weight, x)| *weight += next[window / 2] * x);
        basis.push(next);
    }
    weights
}

/// Squared frequency response at every bin of a segment, smoothed as by a Hann window.
fn response_powers(weights: &[f64]) -> Vec<f64> {
    let power = |bin: usize| {
        let angle = |i: usize| TAU * (bin * i) as f64 / SEGMENT as f64;
        let sum =
            |part: fn(f64) -> f64| weights.iter().enumerate().map(|(i, w)| w * part(angle(i))).sum::<f64>();
        math::powi(sum(math::cos), 2) + math::powi(sum(math::sin), 2)
    };
    let powers: Vec<f64> = (0..=SEGMENT / 2).map(power).collect();
    let smooth = |bin: usize| (4.0 * powers[bin] + powers[bin.abs_diff(1)] + powers[bin + 1]) / 6.0;
    (0..SEGMENT / 2).map(smooth).collect()
}
