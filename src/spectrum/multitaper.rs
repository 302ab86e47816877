//! Power density of noise-like motion, with its uncertainty and a test for steady lines, from several tapers
//! of one record.
//!
//! Each sine taper (`multitaper/tapers.rs`) gives an estimate of its own, nearly independent of the others';
//! their mean is the density, their scatter its uncertainty (jackknife over the tapers), and how well one
//! steady sine explains them all is Thomson's harmonic F. A line is spread over `tapers + 1` resolutions, so
//! the frequency of a component is better read elsewhere.
//!
//! Sources: Riedel and Sidorenko 1995 (IEEE Trans. Signal Process. 43, 188) for the tapers; Thomson 1982
//! (Proc. IEEE 70, 1055) for F; Thomson and Chave 1991 (in Haykin, Advances in Spectrum Analysis and Array
//! Processing) for the jackknife.

mod floor;
mod student;
mod tapers;

use super::transform::{Complex, RealTransform};
use crate::math;
use rayon::prelude::*;
use std::ops::RangeInclusive;
use tapers::SineTapers;

/// Tapers unless asked for otherwise: a density of 14 degrees of freedom scatters by 38 %, and a line takes 8
/// resolutions, 53 Hz in 0.15 s, so that 78 Hz is still apart from zero and from 900 Hz.
pub const TAPERS: usize = 7;
/// Numbers of tapers that can be asked for: one has no scatter, and more than fifty hide what a spectrum is
/// for.
pub(crate) const TAPER_RANGE: RangeInclusive<usize> = 2..=50;
/// The window of a noise floor is at least this many times as wide as a line, so that a line does not set its
/// own floor.
pub(crate) const FLOOR_LINES: f64 = 5.0;
/// Longest padded record, samples: every taper keeps its transform.
const MOST_PADDED: usize = 1 << 24;
/// Values from which work is shared among threads: below, it takes a millisecond or two.
const PARALLEL_FROM: usize = 1 << 17;
/// Squares of larger samples overflow.
const LARGEST_M: f64 = 1e100;
/// Share of the sum of powers below which what one taper leaves is rounding.
const ROUNDING: f64 = 1e-15;

/// A multitaper estimate; one value a bin, from 0 to half the frame rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Multitaper {
    /// Frequencies of the bins, Hz.
    pub frequency_hz: Vec<f64>,
    /// One-sided power density, m^2/Hz: white noise of variance `s^2` reads `2 s^2 / rate`, and the sum over
    /// the bins times their distance is the mean square of the record as the tapers weigh it. At 0 and half
    /// the frame rate, which have no mirror image, it is half of that.
    pub density_m2_per_hz: Vec<f64>,
    /// Standard deviation of the density's natural logarithm, by the delete-one jackknife over the tapers.
    pub log_density_sd: Vec<f64>,
    /// Thomson's F for one steady sine against noise, of 2 and `2 tapers - 2` degrees of freedom; holds where
    /// a line's half width is clear of 0 and of half the frame rate. Infinite where the sine leaves nothing.
    pub line_f: Vec<f64>,
    /// Amplitude of that sine, m.
    pub line_amplitude_m: Vec<f64>,
    /// Tapers used; fewer than asked for where long gaps leave room for fewer.
    pub tapers: usize,
    /// One over the time from the first to the last frame present, Hz.
    pub resolution_hz: f64,
    /// Half the width of a steady line, Hz: `(tapers asked for + 1) / 2` resolutions.
    pub half_bandwidth_hz: f64,
    /// Student's t within which 95 % lie.
    student_t: f64,
}

/// Why a record has no multitaper estimate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MultitaperError {
    /// Not a number of tapers.
    #[error("tapers: found {found}, expected {} to {}; {TAPERS} are usual", TAPER_RANGE.start(), TAPER_RANGE.end())]
    Tapers {
        /// Tapers asked for.
        found: usize,
    },
    /// Too few frames hold a value.
    #[error(
        "found {found} frames with a value, expected at least {expected} for this number of tapers; widen the window or take fewer tapers"
    )]
    TooFew {
        /// Frames with a value.
        found: usize,
        /// Twice the tapers.
        expected: usize,
    },
    /// The frames present lie in so few clumps that one taper alone fits them.
    #[error(
        "the {found} frames with a value lie in clumps that leave room for one taper, expected room for two; choose a window with fewer gaps"
    )]
    Clumped {
        /// Frames with a value.
        found: usize,
    },
    /// A sample is no usable number.
    #[error(
        "frame {frame} of the record: found {found}, expected a finite number below 1e100; remove the frame"
    )]
    NotFinite {
        /// 0-based frame.
        frame: usize,
        /// The value.
        found: f64,
    },
    /// The frame rate is no rate.
    #[error("frame rate: found {found} Hz, expected a finite number above 0")]
    FrameRate {
        /// The value, Hz.
        found: f64,
    },
    /// The padded record would not fit.
    #[error(
        "found a record of {frames} frames padded to {padded} samples, expected at most {MOST_PADDED}; shorten the window or the padding"
    )]
    TooLong {
        /// Frames.
        frames: usize,
        /// Padded length, samples.
        padded: usize,
    },
}

impl Multitaper {
    /// The estimate for a record less its trend, m, one sample a frame (`None` where there is none), padded
    /// with zeros to the next power of two that holds the record and `padded` samples, from `tapers` tapers,
    /// [`TAPERS`] as a rule.
    ///
    /// # Errors
    /// [`MultitaperError`] when record, rate, padding or tapers cannot give one.
    pub fn new(
        residual_m: &[Option<f64>],
        frame_rate_hz: f64,
        padded: usize,
        tapers: usize,
    ) -> Result<Self, MultitaperError> {
        check_input(residual_m, frame_rate_hz, tapers)?;
        let samples = trim_missing_ends(residual_m);
        let padded = padded.max(samples.len()).checked_next_power_of_two().filter(|n| *n <= MOST_PADDED);
        let padded =
            padded.ok_or(MultitaperError::TooLong { frames: samples.len(), padded: samples.len() })?;
        let made = SineTapers::new(samples, tapers);
        if made.len() < *TAPER_RANGE.start() {
            return Err(MultitaperError::Clumped { found: samples.iter().flatten().count() });
        }
        let bins = estimate_bins(&made, samples, padded, frame_rate_hz);
        let resolution_hz = frame_rate_hz / samples.len() as f64;
        let column = |of: fn(&MultitaperBin) -> f64| bins.iter().map(of).collect();
        Ok(Self {
            frequency_hz: (0..bins.len()).map(|k| k as f64 * (frame_rate_hz / padded as f64)).collect(),
            density_m2_per_hz: column(|b| b.density_m2_per_hz),
            log_density_sd: column(|b| b.log_density_sd),
            line_f: column(|b| b.line_f),
            line_amplitude_m: column(|b| b.line_amplitude_m),
            tapers: made.len(),
            resolution_hz,
            half_bandwidth_hz: (tapers + 1) as f64 / 2.0 * resolution_hz,
            student_t: student::student_t_quantile(0.95, made.len() - 1),
        })
    }

    /// Degrees of freedom of the density in a bin: two for each taper.
    #[must_use]
    pub fn degrees_of_freedom(&self) -> usize {
        2 * self.tapers
    }

    /// The 95 % interval of the density in a bin, m^2/Hz, from the jackknife with Student's t of one degree
    /// of freedom less than tapers; `None` for a bin that is not there.
    #[must_use]
    pub fn interval_95(&self, bin: usize) -> Option<(f64, f64)> {
        let (density, sd) = (self.density_m2_per_hz.get(bin)?, self.log_density_sd.get(bin)?);
        let factor = math::exp(self.student_t * sd);
        Some((density / factor, density * factor))
    }

    /// The chance that noise alone, level within a line's width, gives so large an F as in a bin (`(1 +
    /// F/(K-1))^-(K-1)` for `K` tapers); a search over a record of `n` frames takes less than `1/n` for a
    /// line (Thomson's rule). `None` for a bin that is not there.
    #[must_use]
    pub fn line_probability(&self, bin: usize) -> Option<f64> {
        let others = (self.tapers - 1) as f64;
        Some(math::powf(1.0 + self.line_f.get(bin)? / others, -others))
    }

    /// Mean density of the noise in every bin, m^2/Hz: the running median of the density over `width_hz`, at
    /// least `FLOOR_LINES` lines wide, without bins that stand out of it. It follows a density that falls
    /// or rises steadily, and is level over half its width at both ends.
    #[must_use]
    pub fn noise_density(&self, width_hz: f64) -> Vec<f64> {
        let bin_hz = self.frequency_hz.get(1).copied().unwrap_or(f64::INFINITY);
        let width_hz = width_hz.max(2.0 * FLOOR_LINES * self.half_bandwidth_hz);
        let window = ((width_hz / bin_hz).ceil() as usize).min(2 * self.density_m2_per_hz.len());
        floor::noise_floor_curve(&self.density_m2_per_hz, window, self.degrees_of_freedom() as f64)
    }
}

fn check_input(samples: &[Option<f64>], frame_rate_hz: f64, tapers: usize) -> Result<(), MultitaperError> {
    if !TAPER_RANGE.contains(&tapers) {
        return Err(MultitaperError::Tapers { found: tapers });
    }
    if !(frame_rate_hz.is_finite() && frame_rate_hz > 0.0) {
        return Err(MultitaperError::FrameRate { found: frame_rate_hz });
    }
    let unusable = |x: &f64| x.is_nan() || x.abs() > LARGEST_M;
    if let Some((frame, found)) =
        samples.iter().enumerate().find_map(|(i, x)| x.filter(unusable).map(|x| (i, x)))
    {
        return Err(MultitaperError::NotFinite { frame, found });
    }
    let (found, expected) = (samples.iter().flatten().count(), 2 * tapers);
    if found < expected { Err(MultitaperError::TooFew { found, expected }) } else { Ok(()) }
}

/// From the first to the last frame present: what is missing at the ends is no gap.
fn trim_missing_ends(samples: &[Option<f64>]) -> &[Option<f64>] {
    let first = samples.iter().position(Option::is_some).unwrap_or(0);
    let end = samples.iter().rposition(Option::is_some).map_or(first, |last| last + 1);
    samples.get(first..end).unwrap_or_default()
}

/// The values of `of` in order, made in parallel where `work` is long.
fn map_parallel_above<T: Send>(count: usize, work: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    if work < PARALLEL_FROM {
        (0..count).map(&of).collect()
    } else {
        (0..count).into_par_iter().map(&of).collect()
    }
}

/// What the tapers say of one frequency.
struct MultitaperBin {
    density_m2_per_hz: f64,
    log_density_sd: f64,
    line_f: f64,
    line_amplitude_m: f64,
}

/// A taper's transform of the record, and the taper's own at zero.
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
    let tapered = map_parallel_above(tapers.len(), padded, tapered);
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

/// Standard deviation of the logarithm of the mean of `powers`, whose sum is `total`, from the means that
/// lack one of them.
fn jackknife_log_sd<I: Iterator<Item = f64>>(total: f64, powers: impl Fn() -> I) -> f64 {
    if total <= 0.0 {
        return 0.0;
    }
    // (the divisor of the means is the same for all, so it moves no deviation)
    let logs = || powers().map(|p| math::ln(((total - p) / total).max(ROUNDING)));
    let (count, sum, squares) = logs().fold((0.0, 0.0, 0.0), |(n, s, q), x| (n + 1.0, s + x, q + x * x));
    let scatter: f64 = squares - sum * sum / count;
    ((count - 1.0) / count * scatter.max(0.0)).sqrt()
}
