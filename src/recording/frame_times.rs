//! Frame times that lie on no grid: the mean rate, the gaps, interpolation between the times, and the grid on
//! which spectra and fits work.

use super::clock::{self, FRAMES_WITHOUT_ROWS, MAX_FRAMES};
use super::{
    FrameGrid, LARGEST_M, ON_FRAME_TOLERANCE, Recording, RecordingError, STENCIL, Traces,
    lagrange_through_nodes,
};
use portable_math as math;
use short_spectra::time_frequency::FrequencyRange;
use short_spectra::{SampledRecord, SpectralAnalysis, SpectrumError, SpectrumSettings};
use std::borrow::Cow;

/// A step is the time from a frame to the next. It is a gap if it exceeds the median of the steps around it
/// by more than this fraction of the median, and if the sum of the step and its two neighbours exceeds three
/// medians by more than the same amount. A frame that is only late makes the next step shorter, so the sum
/// stays near three medians.
const LOST_STEPS: f64 = 0.5;
/// Number of steps on either side of a step that enter the median with which the step is compared. Single
/// lost frames hardly change this median. Where the rate of the camera changes, each step is compared mostly
/// with steps of its own rate.
const STEPS_AROUND: usize = 5;

/// Strictly increasing times of frames, s.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FrameTimes {
    pub times_s: Vec<f64>,
    /// Mean frame rate without the gaps, 1/s.
    pub mean_rate_hz: f64,
    /// For each step from frame to frame, whether it is a gap.
    gaps: Vec<bool>,
    /// Largest distance of a time from a grid at the mean rate, in frames.
    departure_frames: f64,
}

impl FrameTimes {
    fn new(times_s: Vec<f64>) -> Result<Self, RecordingError> {
        let unordered = |i: &usize| !times_s[*i].is_finite() || (*i > 0 && times_s[*i] <= times_s[*i - 1]);
        if let Some(frame) = (0..times_s.len()).find(unordered) {
            let expected = "expected a finite time after that of the frame before; correct the times";
            return Err(RecordingError(format!(
                "time_s, frame {frame}: found {}, {expected}",
                times_s[frame]
            )));
        }
        let [first_s, .., last_s] = times_s[..] else {
            return Err(RecordingError(format!("found {} frames, expected at least 2", times_s.len())));
        };
        let steps = times_s.len() - 1;
        let step_s = |i: usize| times_s[i + 1] - times_s[i];
        let is_gap = |i: usize| {
            let around = i.saturating_sub(STEPS_AROUND)..(i + STEPS_AROUND + 2).min(times_s.len());
            let median_s = clock::median_step_s(&times_s[around]).unwrap_or(f64::INFINITY);
            let (from, to) = (i.saturating_sub(1), (i + 2).min(steps));
            let excess = (times_s[to] - times_s[from]) / median_s - (to - from) as f64;
            (step_s(i) / median_s - 1.0).min(excess) > LOST_STEPS
        };
        let gaps: Vec<bool> = (0..steps).map(is_gap).collect();
        let gaps_s: Vec<f64> = (0..steps).filter(|i| gaps[*i]).map(step_s).collect();
        let mean_rate_hz = (steps - gaps_s.len()) as f64 / (last_s - first_s - gaps_s.iter().sum::<f64>());
        let span = (last_s - first_s) * mean_rate_hz;
        let longest = FRAMES_WITHOUT_ROWS.0 + (1 + FRAMES_WITHOUT_ROWS.1) * times_s.len();
        if !(mean_rate_hz.is_finite() && (0.0..=MAX_FRAMES.min(longest as f64)).contains(&span)) {
            let found = format!("time_s: the times of {} frames span {span:.0} mean steps", times_s.len());
            return Err(RecordingError(format!("{found}, expected one continuous recording; correct them")));
        }
        let (mut on_grid, mut departure_frames) = (0.0, 0.0_f64);
        for (i, is_gap) in gaps.iter().enumerate() {
            on_grid += if *is_gap { (step_s(i) * mean_rate_hz).round() } else { 1.0 };
            let off = (times_s[i + 1] - first_s) * mean_rate_hz - on_grid;
            departure_frames = departure_frames.max(off.abs());
        }
        Ok(Self { times_s, mean_rate_hz, gaps, departure_frames })
    }

    /// Value of a column at a time, s, as [`Recording::interpolate_column`] describes it. Near a gap or an
    /// end of the recording, the polynomial passes through four or five frames on one side of the time and
    /// two or one on the other side.
    pub(super) fn interpolate(&self, column: &[Option<f64>], time_s: f64) -> Option<f64> {
        let times = &self.times_s;
        let after = times.partition_point(|t| *t < time_s);
        let is_near = |frame: &usize| {
            times.get(*frame).is_some_and(|t| (t - time_s).abs() * self.mean_rate_hz < ON_FRAME_TOLERANCE)
        };
        if let Some(frame) = [after, after.wrapping_sub(1)].into_iter().find(is_near) {
            return *column.get(frame)?;
        }
        let before = after.checked_sub(1)?;
        let (low, high) = ((*column.get(before)?)?, (*column.get(after)?)?);
        if self.gaps[before] {
            return None;
        }
        let curved = [3, 2, 4, 1, 5].into_iter().find_map(|frames_before| {
            let first = after.checked_sub(frames_before)?;
            let nodes = times.get(first..first + STENCIL)?.try_into().ok()?;
            let unbroken = !self.gaps[first..first + STENCIL - 1].contains(&true);
            lagrange_through_nodes(column.get(first..).filter(|_| unbroken)?, nodes, time_s)
        });
        let part = (time_s - times[before]) / (times[after] - times[before]);
        Some(curved.unwrap_or(low + part * (high - low)))
    }
}

impl Recording {
    /// Checks traces with one true time per frame, s, and builds the recording. The times are kept as they
    /// are; the rate of [`Self::grid`] is their mean rate without gaps.
    ///
    /// # Errors
    /// [`RecordingError`] naming the frame whose time is not finite or not after the time of the previous
    /// frame, or the column and the frame at fault.
    pub fn from_times(
        name: impl Into<String>,
        times_s: Vec<f64>,
        traces: Traces,
        synthetic: bool,
    ) -> Result<Self, RecordingError> {
        let times = FrameTimes::new(times_s)?;
        let (start_s, frames) = (times.times_s[0], times.times_s.len());
        let grid = FrameGrid { start_s, frame_rate_hz: times.mean_rate_hz, frames };
        let departure_frames = Some(times.departure_frames);
        Ok(Self { times: Some(times), departure_frames, ..Self::new(name, grid, traces, synthetic)? })
    }

    /// True times of the frames, s; `None` if the frames lie on a grid.
    #[must_use]
    pub fn frame_times_s(&self) -> Option<&[f64]> {
        self.times.as_ref().map(|times| times.times_s.as_slice())
    }

    /// This recording with all tracks on the grid of its mean rate, from the first time on; a recording that
    /// is already on a grid is returned unchanged. Between frames, tracks are interpolated by
    /// `interpolate_column`; in gaps of the times and next to missing frames, they stay missing. Spectra,
    /// features and fits use this grid.
    #[must_use]
    pub fn resample_to_grid(&self) -> Cow<'_, Self> {
        let Some(times) = &self.times else { return Cow::Borrowed(self) };
        let last_s = times.times_s.last().copied().unwrap_or(self.grid.start_s);
        let span = (last_s - self.grid.start_s) * times.mean_rate_hz;
        let grid = FrameGrid { frames: (span + ON_FRAME_TOLERANCE) as usize + 1, ..self.grid };
        let columns = self.traces.columns().map(|(name, column)| {
            let value = |frame| self.interpolate_column(column, grid.time_s(frame));
            // the polynomial may overshoot, so confidences are limited to the range from 0 to 1
            let within = if name.ends_with("confidence") { (0.0, 1.0) } else { (-LARGEST_M, LARGEST_M) };
            (0..grid.frames).map(|frame| Some(value(frame)?.clamp(within.0, within.1))).collect()
        });
        let confidences = [&self.traces.tip_confidence, &self.traces.head_confidence];
        let traces = Traces::from_columns(columns, confidences.map(Option::is_some));
        Cow::Owned(Self { grid, traces, times: None, name: self.name.clone(), ..*self })
    }

    /// This recording on a grid, as [`Self::resample_to_grid`] gives it.
    #[must_use]
    pub(crate) fn move_to_grid(self) -> Self {
        if let Cow::Owned(resampled) = self.resample_to_grid() {
            return resampled;
        }
        self
    }

    /// Whether the tracks are interpolated to a grid on which the frames were not taken.
    pub(crate) fn is_resampled(&self) -> bool {
        self.departure_frames.is_some()
    }

    /// Statement in words that the tracks are interpolated to a grid, with the rate of the grid and the
    /// largest distance of the true times from it; `None` for a recording that was taken on a grid.
    pub(crate) fn describe_resampling(&self) -> Option<String> {
        let (off, rate_hz) = (self.departure_frames?, self.grid.frame_rate_hz);
        Some(format!(
            "the times of the frames lie up to {off:.2} frames off a grid of {rate_hz:.6} frames/s; the tracks \
             are interpolated to this grid, which changes their noise"
        ))
    }

    /// Standard deviation of a frequency, Hz, including the uncertainty of the frame rate:
    /// `sqrt(sd^2 + (frequency * rate_sd / rate)^2)`, where `sd` is the standard deviation without it.
    pub(crate) fn add_clock_sd(&self, frequency_hz: f64, sd_hz: f64) -> f64 {
        let of_clock_hz = |rate_sd_hz| frequency_hz * rate_sd_hz / self.grid.frame_rate_hz;
        self.frame_rate_sd_hz.map_or(sd_hz, |rate_sd_hz| math::hypot(sd_hz, of_clock_hz(rate_sd_hz)))
    }

    /// A frequency range in which the standard deviations of both ends include the uncertainty of the frame
    /// rate.
    pub(crate) fn widen_range(&self, range: FrequencyRange) -> FrequencyRange {
        let low_sd_hz = self.add_clock_sd(range.low_hz, range.low_sd_hz);
        FrequencyRange { low_sd_hz, high_sd_hz: self.add_clock_sd(range.high_hz, range.high_sd_hz), ..range }
    }

    /// Analyses consecutive samples of a channel on the grid of this recording. The standard deviations of
    /// the component frequencies include the uncertainty of the frame rate.
    pub(crate) fn analyse_samples(
        &self,
        samples: &[Option<f64>],
        exposure_s: Option<f64>,
        settings: &SpectrumSettings,
    ) -> Result<SpectralAnalysis, SpectrumError> {
        let record = SampledRecord { samples, frame_rate_hz: self.grid.frame_rate_hz, exposure_s };
        let mut analysis = SpectralAnalysis::from_record(&record, settings)?;
        for c in &mut analysis.spectrum.components {
            c.frequency_sd_hz = self.add_clock_sd(c.frequency_hz, c.frequency_sd_hz);
            c.range_hz = c.range_hz.map(|range| self.widen_range(range));
        }
        Ok(analysis)
    }
}
