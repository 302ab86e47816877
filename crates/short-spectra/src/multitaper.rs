//! Power density of noise-like motion, with its uncertainty and a test for steady lines, from several tapers
//! of one record.
//!
//! Each sine taper gives a nearly independent estimate of the density. The result is the mean of these
//! estimates; its uncertainty follows from their scatter (jackknife over the tapers). Thomson's harmonic F
//! measures how well one steady sine explains the estimates of all tapers. A line is spread over `tapers + 1`
//! resolutions, so other estimators give its frequency more accurately.
//!
//! Sources: Riedel and Sidorenko 1995 (IEEE Trans. Signal Process. 43, 188) for the tapers; Thomson 1982
//! (Proc. IEEE 70, 1055) for F; Thomson and Chave 1991 (in Haykin, Advances in Spectrum Analysis and Array
//! Processing) for the jackknife.

use super::error::find_unusable;
use super::periodogram::upper_median;
use super::transform::{Complex, RealTransform};
use nalgebra::{DMatrix, DVector};
use portable_math as math;
use rayon::prelude::*;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, PI};
use std::ops::RangeInclusive;

/// Default number of tapers: a density with 14 degrees of freedom scatters by 38 %, and a line is 8
/// resolutions wide, 53 Hz in 0.15 s, so that 78 Hz is still separate from zero and from 900 Hz.
pub const TAPERS: usize = 7;
/// Smallest and largest allowed number of tapers: a single taper has no scatter, and more than fifty smooth
/// away every feature.
pub(crate) const TAPER_RANGE: RangeInclusive<usize> = 2..=50;
/// Smallest allowed width of the running median that gives a noise floor, in widths of a line, so that a line
/// does not raise the floor under itself.
pub(crate) const FLOOR_LINES: f64 = 5.0;
/// Largest allowed length, in samples, of a padded record; memory limits it, because the transform of every
/// taper is kept.
const MOST_PADDED: usize = 1 << 24;
/// Smallest number of values for which the work is divided among threads; fewer values take a millisecond or
/// two.
const PARALLEL_FROM: usize = 1 << 17;
/// If the sum of the powers of all tapers but one is below this fraction of the sum over all tapers, it is
/// rounding error.
const ROUNDING: f64 = 1e-15;

/// A multitaper estimate; one value per bin, from 0 to half the frame rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Multitaper {
    /// Frequencies of the bins, Hz.
    pub frequency_hz: Vec<f64>,
    /// One-sided power density, m^2/Hz: white noise of variance `s^2` has `2 s^2 / rate`, and the sum over
    /// the bins times their distance is the mean square of the record, weighted by the tapers. At 0 and at
    /// half the frame rate, which have no mirror image, the density is half as large.
    pub density_m2_per_hz: Vec<f64>,
    /// Standard deviation of the density's natural logarithm, by the delete-one jackknife over the tapers.
    pub log_density_sd: Vec<f64>,
    /// Thomson's F for one steady sine in noise, with 2 and `2 * tapers - 2` degrees of freedom. It is valid
    /// in bins whose distance from 0 and from half the frame rate is more than half the width of a line.
    /// Infinite if the sine explains the bin completely.
    pub line_f: Vec<f64>,
    /// Amplitude, m, of the steady sine that best explains the transforms of all tapers in the bin.
    pub line_amplitude_m: Vec<f64>,
    /// Number of tapers used; long gaps may leave room for fewer than requested.
    pub tapers: usize,
    /// Reciprocal, Hz, of the time from the first to the last frame present.
    pub resolution_hz: f64,
    /// Half the width of a steady line, Hz: `(requested tapers + 1) / 2` resolutions.
    pub half_bandwidth_hz: f64,
    /// Limit of Student's t for the 95 % interval.
    student_t: f64,
}

/// Reason for which a record has no multitaper estimate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MultitaperError {
    /// The number of tapers is outside the permitted range.
    #[error("tapers: found {found}, expected {} to {}; {TAPERS} are usual", TAPER_RANGE.start(), TAPER_RANGE.end())]
    Tapers {
        /// Number of tapers requested.
        found: usize,
    },
    /// Too few frames have a value.
    #[error(
        "found {found} frames with a value, expected at least {expected} for this number of tapers; widen the window or take fewer tapers"
    )]
    TooFew {
        /// Number of frames with a value.
        found: usize,
        /// Twice the number of tapers.
        expected: usize,
    },
    /// The frames present lie in so few clumps that they leave room for only one taper.
    #[error(
        "the {found} frames with a value lie in clumps that leave room for one taper, expected room for two; choose a window with fewer gaps"
    )]
    Clumped {
        /// Number of frames with a value.
        found: usize,
    },
    /// A sample is not a usable number.
    #[error(
        "frame {frame} of the record: found {found}, expected a finite number below 1e100; remove the frame"
    )]
    NotFinite {
        /// Number of the frame, counted from 0.
        frame: usize,
        /// The value.
        found: f64,
    },
    /// The frame rate is not a positive finite number.
    #[error("frame rate: found {found} Hz, expected a finite number above 0")]
    FrameRate {
        /// The value, Hz.
        found: f64,
    },
    /// The padded record would be too long.
    #[error(
        "found a record of {frames} frames padded to {padded} samples, expected at most {MOST_PADDED}; shorten the window or the padding"
    )]
    TooLong {
        /// Number of frames.
        frames: usize,
        /// Padded length, samples.
        padded: usize,
    },
}

impl Multitaper {
    /// The estimate for a record without its trend, m, one sample per frame (`None` for a missing frame),
    /// from `tapers` tapers, usually [`TAPERS`]. The record is padded with zeros to the smallest power of two
    /// that holds both the record and `padded` samples.
    ///
    /// # Errors
    /// [`MultitaperError`] if the record, the frame rate, the padding or the number of tapers allows no
    /// estimate.
    pub fn new(
        residual_m: &[Option<f64>],
        frame_rate_hz: f64,
        padded: usize,
        tapers: usize,
    ) -> Result<Self, MultitaperError> {
        check_input(residual_m, frame_rate_hz, tapers)?;
        let samples = trim_missing_ends(residual_m);
        let frames = samples.len();
        let padded = padded.max(frames).checked_next_power_of_two().filter(|n| *n <= MOST_PADDED);
        let padded = padded.ok_or(MultitaperError::TooLong { frames, padded: frames })?;
        let made = SineTapers::new(samples, tapers);
        if made.rows.nrows() < *TAPER_RANGE.start() {
            return Err(MultitaperError::Clumped { found: samples.iter().flatten().count() });
        }
        let bins = estimate_bins(&made, samples, padded, frame_rate_hz);
        let (tapers_used, resolution_hz) = (made.rows.nrows(), frame_rate_hz / frames as f64);
        let column = |of: fn(&MultitaperBin) -> f64| bins.iter().map(of).collect();
        Ok(Self {
            frequency_hz: (0..bins.len()).map(|k| k as f64 * (frame_rate_hz / padded as f64)).collect(),
            density_m2_per_hz: column(|b| b.density_m2_per_hz),
            log_density_sd: column(|b| b.log_density_sd),
            line_f: column(|b| b.line_f),
            line_amplitude_m: column(|b| b.line_amplitude_m),
            tapers: tapers_used,
            resolution_hz,
            half_bandwidth_hz: (tapers + 1) as f64 / 2.0 * resolution_hz,
            student_t: student_t_quantile(0.95, tapers_used - 1),
        })
    }

    /// Degrees of freedom of the density in a bin: two for each taper.
    #[must_use]
    pub fn degrees_of_freedom(&self) -> usize {
        2 * self.tapers
    }

    /// The 95 % interval of the density in a bin, m^2/Hz, from the jackknife with Student's t, which has one
    /// degree of freedom less than there are tapers; `None` for a bin outside the spectrum.
    #[must_use]
    pub fn interval_95(&self, bin: usize) -> Option<(f64, f64)> {
        let (density, sd) = (self.density_m2_per_hz.get(bin)?, self.log_density_sd.get(bin)?);
        let factor = math::exp(self.student_t * sd);
        Some((density / factor, density * factor))
    }

    /// Probability that noise alone, flat within the width of a line, gives an F at least as large as that of
    /// a bin: `(1 + F/(K-1))^-(K-1)` for `K` tapers. In a record of `n` frames, a probability below `1/n`
    /// counts as a line (Thomson's rule). `None` for a bin outside the spectrum.
    #[must_use]
    pub fn line_probability(&self, bin: usize) -> Option<f64> {
        let others = (self.tapers - 1) as f64;
        Some(math::powf(1.0 + self.line_f.get(bin)? / others, -others))
    }

    /// Mean density of the noise in every bin, m^2/Hz, from the running median of the density over
    /// `width_hz`, at least `FLOOR_LINES` lines wide. Bins far above the median are left out of it. The curve
    /// follows a steady slope of the density, and is flat over half the width of the median at both ends.
    #[must_use]
    pub fn noise_density(&self, width_hz: f64) -> Vec<f64> {
        let bin_hz = self.frequency_hz.get(1).copied().unwrap_or(f64::INFINITY);
        let width_hz = width_hz.max(2.0 * FLOOR_LINES * self.half_bandwidth_hz);
        let window = ((width_hz / bin_hz).ceil() as usize).min(2 * self.density_m2_per_hz.len());
        noise_floor_curve(&self.density_m2_per_hz, window, self.degrees_of_freedom() as f64)
    }
}

fn check_input(samples: &[Option<f64>], frame_rate_hz: f64, tapers: usize) -> Result<(), MultitaperError> {
    if !TAPER_RANGE.contains(&tapers) {
        return Err(MultitaperError::Tapers { found: tapers });
    }
    if !(frame_rate_hz.is_finite() && frame_rate_hz > 0.0) {
        return Err(MultitaperError::FrameRate { found: frame_rate_hz });
    }
    if let Some((frame, found)) = find_unusable(samples) {
        return Err(MultitaperError::NotFinite { frame, found });
    }
    let (found, expected) = (samples.iter().flatten().count(), 2 * tapers);
    if found < expected { Err(MultitaperError::TooFew { found, expected }) } else { Ok(()) }
}

/// The samples from the first to the last frame present: missing frames at the ends are not gaps.
fn trim_missing_ends(samples: &[Option<f64>]) -> &[Option<f64>] {
    let first = samples.iter().position(Option::is_some).unwrap_or(0);
    let end = samples.iter().rposition(Option::is_some).map_or(first, |last| last + 1);
    samples.get(first..end).unwrap_or_default()
}

/// The `count` values `of(0)`, `of(1)`, ..., computed in parallel if `work` is large.
fn map_parallel_above<T: Send>(count: usize, work: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    if work < PARALLEL_FROM {
        (0..count).map(&of).collect()
    } else {
        (0..count).into_par_iter().map(&of).collect()
    }
}

/// Estimates at one frequency.
struct MultitaperBin {
    density_m2_per_hz: f64,
    log_density_sd: f64,
    line_f: f64,
    line_amplitude_m: f64,
}

/// A taper's transform of the record, and the sum of the taper's weights.
struct TaperTransform {
    values: Vec<Complex>,
    sum: f64,
}

fn estimate_bins(
    tapers: &SineTapers,
    samples: &[Option<f64>],
    padded: usize,
    frame_rate_hz: f64,
) -> Vec<MultitaperBin> {
    let transform = RealTransform::new(padded);
    let tapered = |taper: usize| {
        let (row, mut sum) = (tapers.coefficients(taper), 0.0);
        let values = samples.iter().enumerate().map(|(frame, sample)| {
            sample.map_or(0.0, |sample| {
                let weight = tapers.value(&row, frame);
                sum += weight;
                weight * sample
            })
        });
        TaperTransform { values: transform.spectrum_values(values), sum }
    };
    let tapered = map_parallel_above(tapers.rows.nrows(), padded, tapered);
    let half = padded / 2;
    let sided = |bin: usize| if bin == 0 || bin == half { 1.0 } else { 2.0 };
    map_parallel_above(half + 1, padded, |bin| estimate_bin(&tapered, bin, sided(bin) / frame_rate_hz))
}

fn estimate_bin(tapered: &[TaperTransform], bin: usize, scale: f64) -> MultitaperBin {
    let values = || tapered.iter().map(|t| (t.values[bin], t.sum));
    let power: f64 = values().map(|(y, _)| y.norm_sqr()).sum();
    let own: f64 = values().map(|(_, u)| u * u).sum();
    let line = values().map(|(y, u)| y * u).sum::<Complex>() / own;
    let rest: f64 = values().map(|(y, u)| (y - line * u).norm_sqr()).sum();
    let explained = (tapered.len() - 1) as f64 * line.norm_sqr() * own;
    MultitaperBin {
        density_m2_per_hz: scale * power / tapered.len() as f64,
        log_density_sd: jackknife_log_sd(power, || values().map(|(y, _)| y.norm_sqr())),
        line_f: if explained > 0.0 { explained / rest } else { 0.0 },
        line_amplitude_m: 2.0 * math::hypot(line.re, line.im),
    }
}

/// Standard deviation of the logarithm of the mean of `powers`, whose sum is `total`, by the jackknife: from
/// the means that omit one of the powers.
fn jackknife_log_sd<I: Iterator<Item = f64>>(total: f64, powers: impl Fn() -> I) -> f64 {
    if total <= 0.0 {
        return 0.0;
    }
    // (all means have the same divisor, so it does not affect the standard deviation)
    let logs = || powers().map(|p| math::ln(((total - p) / total).max(ROUNDING)));
    let (count, sum, squares) = logs().fold((0.0, 0.0, 0.0), |(n, s, q), x| (n + 1.0, s + x, q + x * x));
    let scatter: f64 = squares - sum * sum / count;
    ((count - 1.0) / count * scatter.max(0.0)).sqrt()
}

// The noise under the lines of a density: a running median without the lines.

/// Number of knots of the curve in the width of its window; the logarithm is linear between knots.
const KNOTS_PER_WINDOW: usize = 4;
/// Ratio of the density in a bin to the noise curve above which the bin counts as part of a line. With 14
/// degrees of freedom, one bin of noise in seventy exceeds this ratio.
const LINE_RATIO: f64 = 2.0;
/// Number of passes, each without the lines found before it; after three, the skirts of a line 60 dB above
/// the noise are excluded.
const FLOOR_PASSES: usize = 3;

/// Mean of the noise in every bin; `window` is the width of the median, bins, and `degrees` the number of
/// degrees of freedom of the density in a bin.
pub(super) fn noise_floor_curve(density: &[f64], window: usize, degrees: f64) -> Vec<f64> {
    let all = running_median(density, window, |_| true);
    let without_lines =
        |curve: Vec<f64>, _| running_median(density, window, |bin| density[bin] <= LINE_RATIO * curve[bin]);
    let mean_over_median = math::powi(1.0 - 2.0 / (9.0 * degrees), -3); // Wilson and Hilferty 1931
    (0..FLOOR_PASSES).fold(all, without_lines).into_iter().map(|m| m * mean_over_median).collect()
}

/// Running median over the bins that `counts` selects. A window that contains fewer of these bins than half
/// its width is widened until it contains enough; at the ends of the spectrum it is cut off.
fn running_median(density: &[f64], window: usize, counts: impl Fn(usize) -> bool + Sync) -> Vec<f64> {
    let Some(last) = density.len().checked_sub(1) else { return Vec::new() };
    let (half, step) = ((window / 2).max(1), (window / KNOTS_PER_WINDOW).max(1));
    let knots = last.div_ceil(step) + 1;
    let within = |centre: usize, half: usize| -> Vec<f64> {
        let bins = centre.saturating_sub(half)..centre.saturating_add(half + 1).min(density.len());
        bins.filter(|bin| counts(*bin)).map(|bin| density[bin]).collect()
    };
    let of_knot = |knot: usize| {
        let centre = (knot * step).min(last);
        let (mut reach, mut values) = (half, within(centre, half));
        while values.len() < half && reach < last {
            reach *= 2;
            values = within(centre, reach);
        }
        let median = upper_median(values).unwrap_or(density[centre]);
        math::ln(median.max(f64::MIN_POSITIVE))
    };
    let logs = map_parallel_above(knots, density.len(), of_knot);
    let between = |bin: usize| {
        let knot = bin / step;
        let (from, to) = (knot * step, ((knot + 1) * step).min(last));
        let share = (bin - from) as f64 / (to.max(from + 1) - from) as f64;
        let next = logs.get(knot + 1).unwrap_or(&logs[knot]);
        math::exp(logs[knot] + share * (next - logs[knot]))
    };
    map_parallel_above(density.len(), density.len(), between)
}

// Quantiles of Student's t for whole degrees of freedom.

/// The limit `t` for which a value with `degrees` degrees of freedom, at least one, lies between `-t` and `t`
/// with the probability `inside`.
pub(super) fn student_t_quantile(inside: f64, degrees: usize) -> f64 {
    /// Number of halvings after which only the last bit of an angle is uncertain.
    const HALVINGS: usize = 60;
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..HALVINGS {
        let angle = (low + high) / 2.0;
        *(if student_t_probability(angle, degrees) < inside { &mut low } else { &mut high }) = angle;
    }
    (degrees as f64).sqrt() * math::tan(low)
}

/// Probability that Student's t lies within `sqrt(degrees) tan(angle)` of zero (Abramowitz and Stegun 26.7.3,
/// 26.7.4).
fn student_t_probability(angle: f64, degrees: usize) -> f64 {
    let (sine, cosine) = math::sin_cos(angle);
    let odd = degrees % 2;
    let mut term = if odd == 1 { cosine } else { 1.0 };
    let mut sum = 0.0;
    for power in (odd..=degrees.saturating_sub(2)).step_by(2) {
        sum += term;
        term *= cosine * cosine * (power + 1) as f64 / (power + 2) as f64;
    }
    match (odd, degrees) {
        (_, 1) => FRAC_2_PI * angle,
        (1, _) => FRAC_2_PI * (angle + sine * sum),
        _ => sine * sum,
    }
}

// Sine tapers, orthonormal over the frames present.
//
// Over `n` frames without gaps the tapers `sqrt(2/(n+1)) sin(pi k m/(n+1))`, `m = 1..n`, `k = 1..K`, are
// orthonormal (Riedel and Sidorenko 1995, eq. 2). With missing frames they are not. If `G` are their inner
// products over the frames present, `G^(-1/2)` times the tapers are orthonormal, and of all orthonormal sets
// this is the nearest to the tapers.

/// Number of frames whose inner products are summed at a time, so that the sum does not depend on the number
/// of threads.
const PRODUCT_BLOCK: usize = 1 << 15;
/// Smallest energy of a combination of tapers on the frames present, relative to the largest such energy. A
/// combination with less energy lies in the gaps and is dropped; scaled to unit energy, it would leak over
/// the whole spectrum.
const LEAST_ENERGY_SHARE: f64 = 0.1;

/// Tapers that are linear combinations of sine tapers.
pub(super) struct SineTapers {
    /// Phase step, rad, of the first sine taper from one frame to the next.
    turn: f64,
    /// Coefficients of the sines, one row for each taper.
    rows: DMatrix<f64>,
}

impl SineTapers {
    /// At most `count` tapers for a record; fewer if the gaps of the record allow no more.
    pub(super) fn new(samples: &[Option<f64>], count: usize) -> Self {
        let turn = PI / (samples.len() + 1) as f64;
        let sines = DMatrix::identity(count, count) * (2.0 / (samples.len() + 1) as f64).sqrt();
        let rows = if samples.iter().all(Option::is_some) {
            sines
        } else {
            orthonormal_combinations(&taper_inner_products(samples, turn, count))
        };
        Self { turn, rows }
    }

    /// Value of the taper with the coefficients `row` in a frame, by Clenshaw's recurrence.
    pub(super) fn value(&self, row: &[f64], frame: usize) -> f64 {
        let (sine, cosine) = math::sin_cos(self.turn * (frame + 1) as f64);
        let next = |(b1, b2): (f64, f64), c: &f64| (c + 2.0 * cosine * b1 - b2, b1);
        sine * row.iter().rev().fold((0.0, 0.0), next).0
    }

    /// Coefficients of the sines in the taper with this index.
    pub(super) fn coefficients(&self, taper: usize) -> Vec<f64> {
        self.rows.row(taper).iter().copied().collect()
    }
}

/// `sum sin(j a) sin(k a)` over the frames present, where `a` is the phase of the first sine taper in the
/// frame.
fn taper_inner_products(samples: &[Option<f64>], turn: f64, count: usize) -> DMatrix<f64> {
    let block = |index: usize| {
        let mut sum = DMatrix::zeros(count, count);
        let mut sines = DVector::zeros(count);
        let frames = index * PRODUCT_BLOCK..samples.len().min((index + 1) * PRODUCT_BLOCK);
        for frame in frames.filter(|frame| samples[*frame].is_some()) {
            let (sine, cosine) = math::sin_cos(turn * (frame + 1) as f64);
            let (mut before, mut now) = (0.0, sine);
            for value in &mut sines {
                *value = now;
                (before, now) = (now, 2.0 * cosine * now - before);
            }
            sum.ger(1.0, &sines, &sines, 1.0);
        }
        sum
    };
    map_parallel_above(samples.len().div_ceil(PRODUCT_BLOCK), samples.len(), block).into_iter().sum()
}

/// Coefficients of orthonormal tapers, one row each: `G^(-1/2)` for the inner products `G`. If some
/// combinations of tapers lie in the gaps, these are dropped, and the other combinations are scaled to unit
/// energy.
fn orthonormal_combinations(products: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = products.clone().symmetric_eigen();
    let least = LEAST_ENERGY_SHARE * eigen.eigenvalues.max();
    let kept: Vec<usize> = (0..eigen.eigenvalues.len()).filter(|i| eigen.eigenvalues[*i] > least).collect();
    let directions = eigen.eigenvectors.select_columns(&kept);
    let scales = kept.iter().map(|i| eigen.eigenvalues[*i].sqrt().recip());
    let scale = DMatrix::from_diagonal(&DVector::from_iterator(kept.len(), scales));
    if kept.len() == eigen.eigenvalues.len() {
        &directions * scale * directions.transpose()
    } else {
        scale * directions.transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_monotonous_density_is_followed_and_a_line_is_not() {
        let slope = |bin: usize| (-(bin as f64) / 300.0).exp();
        let mut density: Vec<f64> = (0..1000).map(slope).collect();
        density[480..520].iter_mut().for_each(|d| *d *= 1e6);
        // with many degrees of freedom the mean and the median agree
        let curve = noise_floor_curve(&density, 200, 1e9);
        assert_eq!(curve.len(), 1000);
        // next to the line, the median is off by at most 20 bins to one side: 7 %
        assert!((100..900).all(|bin| (curve[bin] / slope(bin) - 1.0).abs() < 0.07), "{:?}", &curve[380..620]);
        assert!([150, 300, 700, 850].iter().all(|bin| (curve[*bin] / slope(*bin) - 1.0).abs() < 1e-3));
    }

    #[test]
    fn few_bins_have_a_curve_too() {
        assert!(noise_floor_curve(&[], 10, 14.0).is_empty());
        assert!(noise_floor_curve(&[2.0], 10, 1e15).iter().all(|d| (d - 2.0).abs() < 1e-12));
        assert!(noise_floor_curve(&[2.0; 7], 3, 1e15).iter().all(|d| (d - 2.0).abs() < 1e-12));
    }

    #[test]
    fn the_quantiles_are_those_of_the_tables() {
        // (Abramowitz and Stegun, table 26.10)
        for (degrees, tabled) in [
            (1, 12.706),
            (2, 4.303),
            (3, 3.182),
            (4, 2.776),
            (5, 2.571),
            (6, 2.447),
            (7, 2.365),
            (13, 2.160),
            (30, 2.042),
        ] {
            let found = student_t_quantile(0.95, degrees);
            assert!((found - tabled).abs() < 6e-4, "{degrees}: {found}");
        }
    }

    fn table(samples: &[Option<f64>], count: usize) -> Vec<Vec<f64>> {
        let tapers = SineTapers::new(samples, count);
        let taper = |k: usize| {
            (0..samples.len())
                .map(|i| samples[i].map_or(0.0, |_| tapers.value(&tapers.coefficients(k), i)))
                .collect()
        };
        (0..tapers.rows.nrows()).map(taper).collect()
    }

    fn worst(tapers: &[Vec<f64>]) -> f64 {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut worst = 0.0_f64;
        for (j, a) in tapers.iter().enumerate() {
            for (k, b) in tapers.iter().enumerate() {
                worst = worst.max((product(a, b) - f64::from(u8::from(j == k))).abs());
            }
        }
        worst
    }

    #[test]
    fn without_gaps_they_are_the_sines_and_orthonormal() {
        let tapers = table(&[Some(0.0); 750], 7);
        assert_eq!(tapers.len(), 7);
        assert!((tapers[4][99] - (2.0_f64 / 751.0).sqrt() * (PI * 5.0 * 100.0 / 751.0).sin()).abs() < 1e-14);
        assert!(worst(&tapers) < 1e-12, "{:e}", worst(&tapers));
    }

    #[test]
    fn with_gaps_they_are_orthonormal_over_the_frames_present() {
        let scattered: Vec<_> = (0..750).map(|i| (i * i % 7 != 2 && i % 11 != 5).then_some(0.0)).collect();
        let one_long: Vec<_> = (0..750).map(|i| (!(300..420).contains(&i)).then_some(0.0)).collect();
        for (samples, missing) in [(&scattered, 263), (&one_long, 120)] {
            assert_eq!(samples.iter().filter(|x| x.is_none()).count(), missing);
            let tapers = table(samples, 7);
            assert_eq!(tapers.len(), 7);
            assert!(worst(&tapers) < 1e-12, "{:e}", worst(&tapers));
        }
    }

    #[test]
    fn combinations_that_lie_in_a_gap_are_left_out() {
        let half: Vec<_> = (0..750).map(|i| (!(200..550).contains(&i)).then_some(0.0)).collect();
        let tapers = table(&half, 7);
        assert!((2..7).contains(&tapers.len()), "{}", tapers.len());
        assert!(worst(&tapers) < 1e-12, "{:e}", worst(&tapers));
    }
}
