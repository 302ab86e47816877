//! Frame times that lie on no grid: the mean rate, the gaps, interpolation between the times, and the grid on
//! which spectra and fits work.

use super::clock::{self, FRAMES_WITHOUT_ROWS, MAX_FRAMES};
use super::{
    FrameGrid, ON_FRAME_TOLERANCE, Recording, RecordingError, STENCIL, Traces, lagrange_through_nodes,
};
use portable_math as math;
use short_spectra::{SampledRecord, SpectralAnalysis, SpectrumError, SpectrumSettings};
use std::borrow::Cow;

/// A step from frame to frame is a gap if it is longer than this multiple of the median of the steps around
/// it: half way from one frame to two.
const GAP_STEPS: f64 = 1.5;
/// Number of steps on either side that enter this median. Single lost frames do not change it. Where the rate
/// of the camera changes, each step is compared mostly with steps of its own rate.
const STEPS_AROUND: usize = 5;

/// Strictly increasing times of frames, s.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FrameTimes {
    pub times_s: Vec<f64>,
    /// Mean rate over the steps that are no gaps, 1/s.
    pub mean_rate_hz: f64,
    /// Frames after which a gap follows, in ascending order.
    gaps: Vec<usize>,
    /// Largest distance of a time from the grid of the mean rate, frames.
    departure_frames: f64,
}

impl FrameTimes {
    fn new(times_s: Vec<f64>) -> Result<Self, RecordingError> {
        let unordered = |i: &usize| !times_s[*i].is_finite() || (*i > 0 && times_s[*i] <= times_s[*i - 1]);
        if let Some(frame) = (0..times_s.len()).find(unordered) {
            let found = format!("time_s, frame {frame}: found {}", times_s[frame]);
            let expected = "expected a finite time after that of the frame before; correct the times";
            return Err(RecordingError(format!("{found}, {expected}")));
        }
        let [first_s, .., last_s] = times_s[..] else {
            return Err(RecordingError(format!("found {} frames, expected at least 2", times_s.len())));
        };
        let steps = times_s.len() - 1;
        let step_s = |i: usize| times_s[i + 1] - times_s[i];
        let is_gap = |i: &usize| {
            let around = i.saturating_sub(STEPS_AROUND)..(i + STEPS_AROUND + 2).min(times_s.len());
            step_s(*i) > GAP_STEPS * clock::median_step_s(&times_s[around]).unwrap_or(f64::INFINITY)
        };
        let gaps: Vec<usize> = (0..steps).filter(is_gap).collect();
        let gaps_s: f64 = gaps.iter().map(|i| step_s(*i)).sum();
        let mean_rate_hz = (steps - gaps.len()) as f64 / (last_s - first_s - gaps_s);
        let span = (last_s - first_s) * mean_rate_hz;
        let longest = FRAMES_WITHOUT_ROWS.0 + (1 + FRAMES_WITHOUT_ROWS.1) * times_s.len();
        if !(mean_rate_hz.is_finite() && (0.0..=MAX_FRAMES.min(longest as f64)).contains(&span)) {
            return Err(RecordingError(format!(
                "time_s: the times span {span:.0} frames, and only {} of them have a row; expected one \
                 continuous recording: correct the times",
                times_s.len()
            )));
        }
        let (mut on_grid, mut departure_frames) = (0.0, 0.0_f64);
        let mut gap = gaps.iter().peekable();
        for i in 0..steps {
            let lost = gap.next_if_eq(&&i).is_some();
            on_grid += if lost { (step_s(i) * mean_rate_hz).round() } else { 1.0 };
            let off = (times_s[i + 1] - first_s) * mean_rate_hz - on_grid;
            departure_frames = departure_frames.max(off.abs());
        }
        Ok(Self { times_s, mean_rate_hz, gaps, departure_frames })
    }

    /// Value of a column at a time, s, as [`Recording::interpolate_column`] describes it.
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
        let gap = self.gaps.partition_point(|gap| gap < &before);
        if self.gaps.get(gap) == Some(&before) {
            return None;
        }
        let first = after.checked_sub(STENCIL / 2);
        let curved = first.and_then(|first| {
            let unbroken = self.gaps[..gap].last().is_none_or(|gap| *gap < first)
                && self.gaps.get(gap).is_none_or(|gap| gap + 1 >= first + STENCIL);
            let nodes = times.get(first..first + STENCIL).filter(|_| unbroken)?;
            lagrange_through_nodes(column.get(first..)?, nodes.try_into().ok()?, time_s)
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
    /// [`RecordingError`] naming the frame of a time that does not lie after the one before, or the column
    /// and the frame at fault.
    pub fn from_times(
        name: impl Into<String>,
        times_s: Vec<f64>,
        traces: Traces,
        synthetic: bool,
    ) -> Result<Self, RecordingError> {
        let times = FrameTimes::new(times_s)?;
        let (start_s, frames) = (times.times_s[0], times.times_s.len());
        let grid = FrameGrid { start_s, frame_rate_hz: times.mean_rate_hz, frames };
        Ok(Self { times: Some(times), ..Self::new(name, grid, traces, synthetic)? })
    }

    /// The true times of the frames, s, of a recording whose frames lie on no grid.
    #[must_use]
    pub fn frame_times_s(&self) -> Option<&[f64]> {
        self.times.as_ref().map(|times| times.times_s.as_slice())
    }

    /// This recording with all tracks on the grid of its mean rate, from the first time on; a recording on a
    /// grid is returned as it is. Between frames a track is interpolated as in `interpolate_column`; in gaps
    /// of the times and next to missing frames it stays missing. Spectra, features and fits use this grid.
    #[must_use]
    pub fn resample_to_grid(&self) -> Cow<'_, Self> {
        let Some(times) = &self.times else { return Cow::Borrowed(self) };
        let last_s = times.times_s.last().copied().unwrap_or(self.grid.start_s);
        let span = (last_s - self.grid.start_s) * times.mean_rate_hz;
        let grid = FrameGrid { frames: (span + ON_FRAME_TOLERANCE) as usize + 1, ..self.grid };
        let track = |column: &Vec<Option<f64>>| -> Vec<Option<f64>> {
            (0..grid.frames).map(|frame| self.interpolate_column(column, grid.time_s(frame))).collect()
        };
        let confidence = |column: &Option<Vec<Option<f64>>>| {
            let column = column.as_ref().map(track);
            column.map(|column| column.into_iter().map(|c| c.map(|c| c.clamp(0.0, 1.0))).collect())
        };
        let traces = Traces {
            tip_x_m: track(&self.traces.tip_x_m),
            tip_y_m: track(&self.traces.tip_y_m),
            head_x_m: track(&self.traces.head_x_m),
            head_y_m: track(&self.traces.head_y_m),
            tip_confidence: confidence(&self.traces.tip_confidence),
            head_confidence: confidence(&self.traces.head_confidence),
        };
        let resampled_frames = Some(times.departure_frames);
        Cow::Owned(Self { grid, traces, times: None, resampled_frames, name: self.name.clone(), ..*self })
    }

    /// This recording on a grid, as [`Self::resample_to_grid`] gives it.
    #[must_use]
    pub(crate) fn move_to_grid(self) -> Self {
        if let Cow::Owned(resampled) = self.resample_to_grid() {
            return resampled;
        }
        self
    }

    /// Largest distance of the true times from the grid that [`Self::resample_to_grid`] makes, frames; `None`
    /// for a recording that was taken on a grid.
    pub(crate) fn clock_departure_frames(&self) -> Option<f64> {
        self.times.as_ref().map(|times| times.departure_frames).or(self.resampled_frames)
    }

    /// That the tracks are interpolated to a grid, with its rate and the distance of the true times from it;
    /// `None` for a recording that was taken on a grid.
    pub(crate) fn describe_resampling(&self) -> Option<String> {
        let (off, rate_hz) = (self.clock_departure_frames()?, self.grid.frame_rate_hz);
        Some(format!(
            "the times of the frames lie up to {off:.2} frames off a grid of {rate_hz:.6} frames/s; the tracks \
             are interpolated to this grid, which changes their noise"
        ))
    }

    /// Standard deviation of a frequency, Hz, with that of the clock: `sqrt(sd^2 + (f * rate_sd / rate)^2)`.
    pub(crate) fn add_clock_sd(&self, frequency_hz: f64, sd_hz: f64) -> f64 {
        if self.frame_rate_sd_hz == 0.0 {
            return sd_hz;
        }
        math::hypot(sd_hz, frequency_hz * self.frame_rate_sd_hz / self.grid.frame_rate_hz)
    }

    /// Analyses consecutive samples of a channel on the grid of this recording. The standard deviations of
    /// the frequencies of its components include that of the clock.
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
            if let Some(range) = &mut c.range_hz {
                range.low_sd_hz = self.add_clock_sd(range.low_hz, range.low_sd_hz);
                range.high_sd_hz = self.add_clock_sd(range.high_hz, range.high_sd_hz);
            }
        }
        Ok(analysis)
    }
}
