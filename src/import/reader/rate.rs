//! Frame rates, each with the largest error that its source allows.

use super::track_file::{Clock, TrackFile};
use crate::recording::clock::{self, FrameFit};
use crate::text::format_rate;
use portable_math as math;
use std::borrow::Cow;

/// Largest allowed relative difference between two statements of the frame rate, in addition to their errors.
/// If they differ by more, the import is refused.
pub(crate) const RATE_AGREEMENT: f64 = 0.01;
/// Largest relative error of the frequency of an inexpensive oscillator: 50 parts in a million.
const OSCILLATOR_ERROR: f64 = 5e-5;
/// Minimum length of a step, in units of the last digit of the times, for the assumption that a program
/// rounded the step before it added up the times. If the step is shorter, this rounding would change it by
/// more than an eighth.
const FEWEST_DIGITS_PER_STEP: f64 = 4.0;
/// Largest allowed relative difference between two steps, or two rates, that count as equal.
const EQUAL_STEPS: f64 = 1e-6;

/// Largest allowed distance of a time from the grid, in frames, in addition to the rounding of the times.
/// This distance shifts the phase of a component at a fifth of the frame rate by 7 degrees.
pub(crate) const EVEN_FRAMES: f64 = 0.1;
/// Largest allowed fraction of rows that are farther than [`EVEN_FRAMES`] from the grid. If the fraction is
/// larger, the clock has no grid; otherwise these few rows are damaged.
const UNEVEN_ROWS: f64 = 0.05;
/// Largest allowed relative difference between the declared rate and the rate of a clock without a grid,
/// which is the inverse of its median step.
pub(crate) const UNEVEN_RATE: f64 = 0.2;

/// Whether the times of a clock lie on no grid of equal steps, whatever its rate.
pub(crate) fn is_uneven(clock: &Clock) -> bool {
    *clock.uneven.get_or_init(|| {
        fit_own_grid(clock).is_some_and(|fit| {
            let times = clock.times();
            let limit = EVEN_FRAMES + rounding_s(clock) / fit.frame_s;
            let far = (0..times.len()).filter(|row| fit.distance(&times, *row) > limit).count();
            far > 1 && far as f64 > UNEVEN_ROWS * times.len() as f64
        })
    })
}

/// The grid that fits the times of a clock from their median step; `None` if that is not positive.
pub(crate) fn fit_own_grid(clock: &Clock) -> Option<&FrameFit> {
    let fit = || {
        let times = clock.times();
        let step_s = clock::median_step_s(&times).filter(|step_s| *step_s > 0.0)?;
        clock::number_frames(&times, step_s)
    };
    clock.fit.get_or_init(fit).as_ref()
}

/// Whether an export has a clock without frame numbers whose times lie on no grid.
pub(crate) fn has_uneven_clock(export: &TrackFile) -> bool {
    export.clocks.iter().any(|clock| clock.frame.is_none() && is_uneven(clock))
}

/// A frame rate with its uncertainty and its source.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrameRate {
    /// The rate, 1/s.
    pub hz: f64,
    /// Largest error, as a fraction of the rate.
    pub error: f64,
    /// Text that says where the rate comes from.
    pub source: String,
}

impl FrameRate {
    /// A rate that a person or a camera states. Its error is half a unit of its last decimal place, but at
    /// least [`OSCILLATOR_ERROR`]. A rate without decimals has the error [`OSCILLATOR_ERROR`].
    pub(crate) fn from_statement(hz: f64, source: impl Into<String>) -> Self {
        let written = hz.to_string();
        let decimals = written.split_once('.').map_or(0, |(_, decimals)| decimals.len());
        let half_digit = if decimals > 0 { 0.5 / math::powi(10.0, decimals as i32) } else { 0.0 };
        Self { hz, error: OSCILLATOR_ERROR.max(half_digit / hz), source: source.into() }
    }

    /// Standard deviation of the rate, 1/s. The true rate is assumed to be uniformly distributed within the
    /// largest error on either side.
    pub(crate) fn sd_hz(&self) -> f64 {
        self.hz * self.error / 3.0_f64.sqrt()
    }

    /// Magnitude of the difference from another rate, as a fraction of the other rate.
    pub(crate) fn difference(&self, other: &Self) -> f64 {
        (self.hz / other.hz - 1.0).abs()
    }

    /// The rate with its error in words: `2000 +- 2`.
    pub(crate) fn describe(&self) -> String {
        format!("{} +- {}", format_rate(self.hz), format_rate(self.hz * self.error))
    }
}

/// The frame rate that the times of an export's longest clock imply.
pub(crate) fn implied_rate(export: &TrackFile) -> Option<FrameRate> {
    let timed = export.clocks.iter().filter(|clock| clock.time.is_some());
    let longest = timed.max_by_key(|clock| clock.len())?;
    let (frames, times, hz) = number_rows(longest)?;
    let quantum_s = find_quantum_s(longest);
    let hz = clock::simplest_rate(hz, |rate| times_fit_rate(&times, &frames, rate, quantum_s));
    let source = format!("the times of {}", export.file);
    let rounding_s = rounding_s(longest);
    let written_s = if longest.digit > 0.0 { longest.digit } else { rounding_s };
    Some(FrameRate { hz, error: times_error(&times, &frames, rounding_s, written_s), source })
}

/// Frame numbers and times of the rows of a clock, and the frame rate, 1/s. If the file has frame numbers,
/// the rate is that between the first and last row; otherwise it is the rate of the grid that fits the times.
fn number_rows(clock: &Clock) -> Option<(Vec<f64>, Cow<'_, [f64]>, f64)> {
    if let (Some(frames), Some(times)) = (&clock.frame, &clock.time) {
        let rows = frames.iter().zip(times.iter()).filter_map(|(frame, time)| frame.zip(time));
        let (frames, times): (Vec<f64>, Vec<f64>) = rows.unzip();
        let hz = (frames.last()? - frames.first()?) / (times.last()? - times.first()?);
        return (hz.is_finite() && hz > 0.0).then_some((frames, times.into(), hz));
    }
    let fit = fit_own_grid(clock)?;
    let frames = fit.frames.iter().map(|frame| *frame as f64).collect();
    Some((frames, clock.times(), 1.0 / fit.frame_s))
}

/// Largest relative error of the frame rate that times imply. `digit_s` is the value of their last digit that
/// is not always zero, and `written_s` that of the last written digit, s. If each time was rounded
/// separately, the error is the last digit divided by the time from the first to the last row. If all steps
/// are equal, the step itself may have been rounded, with an error of half its last digit. A rate of at most
/// two significant digits counts as exact, unless another common rate would have been written with the same
/// step.
fn times_error(times: &[f64], frames: &[f64], digit_s: f64, written_s: f64) -> f64 {
    let span = |values: &[f64]| values.last().zip(values.first()).map_or(0.0, |(last, first)| last - first);
    let frame_s = span(times) / span(frames);
    let mut steps = times.windows(2).zip(frames.windows(2));
    let equal = steps.all(|(time, frame)| {
        ((time[1] - time[0]) / (frame[1] - frame[0]) / frame_s - 1.0).abs() <= EQUAL_STEPS
    });
    let of_ends = digit_s / span(times);
    let digits = (frame_s / digit_s).round();
    let few = !digits.is_finite() || digits < FEWEST_DIGITS_PER_STEP;
    match (equal, is_round(1.0 / frame_s)) {
        (true, true) if few => return OSCILLATOR_ERROR,
        (true, true) => {}
        (true, false) if !few => return 0.5 / digits,
        _ => return of_ends,
    }
    let same_step = |hz: &&f64| (1.0 / (**hz * written_s)).round() == (frame_s / written_s).round();
    clock::COMMON_RATES_HZ
        .iter()
        .filter(same_step)
        .map(|hz| (hz * frame_s - 1.0).abs())
        .fold(OSCILLATOR_ERROR, f64::max)
}

/// Whether a rate has at most two significant digits.
fn is_round(hz: f64) -> bool {
    format!("{hz:.1e}").parse::<f64>().is_ok_and(|round| (hz / round - 1.0).abs() <= EQUAL_STEPS)
}

/// Step to which the times of a clock are rounded, s: the largest power of ten of which all times are
/// multiples, and at least the value of their last digit.
pub(crate) fn rounding_s(clock: &Clock) -> f64 {
    find_quantum_s(clock).unwrap_or(clock.digit).max(clock.digit)
}

/// Steps to which programs round times, s.
const QUANTA_S: [f64; 8] = [1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];

/// Whether times lie on the grid of `rate_hz` that starts at the first time, within their rounding to
/// multiples of `quantum_s`.
fn times_fit_rate(times: &[f64], frames: &[f64], rate_hz: f64, quantum_s: Option<f64>) -> bool {
    let (Some(start), Some(first)) = (times.first(), frames.first()) else { return false };
    let half_quantum = quantum_s.map_or(1e-9, |q| q / 2.0 * (1.0 + 1e-6));
    // (two half steps of rounding, because the first time is rounded too)
    let fits =
        |(time, frame): (&f64, &f64)| (start + (frame - first) / rate_hz - time).abs() <= 2.0 * half_quantum;
    times.iter().zip(frames).all(fits)
}

/// Largest step of `QUANTA_S`, s, of which all times of a clock are multiples; `None` if there is none.
pub(crate) fn find_quantum_s(clock: &Clock) -> Option<f64> {
    *clock.quantum_s.get_or_init(|| {
        let times = clock.times();
        QUANTA_S.into_iter().find(|quantum| are_multiples(&times, *quantum))
    })
}

/// Whether every time is a multiple of `quantum_s`.
fn are_multiples(times: &[f64], quantum_s: f64) -> bool {
    times.iter().all(|t| (t / quantum_s - math::round(t / quantum_s)).abs() <= 1e-6)
}
