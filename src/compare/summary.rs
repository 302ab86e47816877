//! What a comparison says in numbers, as `report.json` holds it.

use super::case::{Case, Side};
use super::ridge::FollowedRidge;
use super::windows::{FitWindow, fit_windows};
use crate::recording::alignment::Point;
use crate::recording::channel::Channel;
use crate::recording::motion_traces::CHANNELS;
use serde::Serialize;

/// A recording against the model at the estimates; of a condition without a recording, the model alone.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Summary {
    /// Name of the condition.
    pub condition: String,
    /// Name of its recording.
    pub recording: Option<String>,
    /// What is added to the model's times, s.
    pub clock_shift_s: Option<f64>,
    /// Its standard deviation, s; infinite where the path does not fix it, `None` where none was followed.
    pub clock_shift_sd_s: Option<f64>,
    /// What is added to the model's head and tip along the sweep, m.
    pub along_m: Option<f64>,
    /// What is added to the model's head drop, m.
    pub drop_m: Option<f64>,
    /// The point whose path was followed.
    pub followed: Option<Point>,
    /// Whether the recorded head turns the other way than the model's.
    pub opposite_turn: bool,
    /// What is left, channel by channel.
    pub residuals: Vec<ResidualLine>,
    /// The channel by which the model is judged; `None` where the two cannot agree, or where the noise is
    /// unknown.
    pub judged: Option<&'static str>,
    /// The windows that the fit reads.
    pub windows: Vec<WindowLine>,
    /// The ridges of the deflection after the release of the tip.
    pub ridge: RidgeLines,
    /// Changes of mode in the model's run.
    pub transitions: usize,
}

/// What is left of a channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResidualLine {
    /// Name of the channel.
    pub channel: &'static str,
    /// Root mean square of measured minus model, m.
    pub rms_m: f64,
    /// Noise of the recorded channel, m.
    pub noise_m: Option<f64>,
    /// The one over the other.
    pub rms_over_noise: Option<f64>,
}

/// A window of the fit in both clocks, from first frame to behind the last, s of the recording's time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WindowLine {
    /// Names of what is read in it.
    pub features: Vec<String>,
    /// Name of the channel.
    pub channel: &'static str,
    /// Where it lies in the recording.
    pub measured_s: Option<[f64; 2]>,
    /// Where it lies in the model, on the clock of the recording.
    pub model_s: Option<[f64; 2]>,
}

/// The ridges of both sides.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RidgeLines {
    /// Of the recording.
    pub measured: Option<RidgeLine>,
    /// Of the model.
    pub model: Option<RidgeLine>,
}

/// A ridge in short.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RidgeLine {
    /// Length of a segment, s.
    pub segment_s: f64,
    /// Where it was sought, Hz.
    pub band_hz: [f64; 2],
    /// Number of segments.
    pub segments: usize,
    /// Segments in which a component stands out of the noise.
    pub points: usize,
    /// Those of them that make a course.
    pub course_points: usize,
    /// Least and greatest frequency of the course, Hz.
    pub range_hz: Option<[f64; 2]>,
}

impl Summary {
    /// What is left of the channel by which the model is judged.
    #[must_use]
    pub fn left(&self) -> Option<&ResidualLine> {
        self.residuals.iter().find(|line| Some(line.channel) == self.judged)
    }

    /// The numbers of a condition.
    #[must_use]
    pub fn of(case: &Case) -> Self {
        let alignment = case.recording().map(|_| case.alignment);
        let windows = fit_windows(case.job, case.condition);
        Self {
            condition: case.name().to_owned(),
            recording: case.recording().map(|r| r.name().to_owned()),
            clock_shift_s: alignment.map(|a| a.shift_s),
            clock_shift_sd_s: alignment.and_then(|a| a.shift_sd_s),
            along_m: alignment.map(|a| a.along_m),
            drop_m: alignment.map(|a| a.drop_m),
            followed: alignment.map(|a| a.followed),
            opposite_turn: case.alignment.opposite_turn,
            residuals: residuals(case),
            judged: case.judged().map(|(channel, _)| channel.name()),
            windows: windows.iter().map(|window| window_line(case, window)).collect(),
            ridge: RidgeLines {
                measured: case.ridges.measured.as_ref().map(RidgeLine::of),
                model: case.ridges.model.as_ref().map(RidgeLine::of),
            },
            transitions: case.model.motion.transitions.len(),
        }
    }
}

fn residuals(case: &Case) -> Vec<ResidualLine> {
    let Some(residual) = case.residual.as_ref() else {
        return Vec::new();
    };
    let line = |channel: Channel| {
        let rms_m = residual.rms_m(channel, None)?;
        let noise_m = case.noise_m(channel);
        let rms_over_noise = noise_m.map(|noise_m| rms_m / noise_m);
        Some(ResidualLine { channel: channel.name(), rms_m, noise_m, rms_over_noise })
    };
    CHANNELS.into_iter().filter_map(line).collect()
}

fn window_line(case: &Case, window: &FitWindow) -> WindowLine {
    let span = |side: &Side, shift_s: f64| {
        let (frames, grid) = (side.frames(&window.window)?, side.recording.grid());
        Some([grid.time_s(frames.start) + shift_s, grid.time_s(frames.end) + shift_s])
    };
    WindowLine {
        features: window.names(),
        channel: window.channel.name(),
        measured_s: case.measured_side().and_then(|side| span(&side, 0.0)),
        model_s: span(&case.model_side(), case.alignment.shift_s),
    }
}

impl RidgeLine {
    fn of(followed: &FollowedRidge) -> Self {
        Self {
            segment_s: followed.ridge.segment_s,
            band_hz: followed.band_hz.into(),
            segments: followed.spectrogram.time_s.len(),
            points: followed.ridge.points.len(),
            course_points: followed.courses.iter().map(Vec::len).sum(),
            range_hz: followed.range_hz().map(Into::into),
        }
    }
}
