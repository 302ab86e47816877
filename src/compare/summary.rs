//! Numbers of a comparison, as written to `report.json`.

use super::condition::{ConditionComparison, FitWindow, TimedRecording, group_fit_windows};
use super::ridge::TrackedRidge;
use super::tables::recording_kind;
use crate::recording::alignment::AlignmentPoint;
use crate::recording::channel::Channel;
use crate::recording::motion_traces::{MOTION_CHANNELS, MotionTraces};
use crate::text::format_digits;
use serde::Serialize;
use serde_json::{Map, Value, json};

/// A recording compared with the model at the estimates; without a recording, the model alone.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ComparisonSummary {
    /// Name of the condition.
    pub condition: String,
    /// Name of the recording.
    pub recording: Option<String>,
    /// Kind of the data that the model is compared with: `measured`, `synthetic` or `published`.
    pub recording_kind: &'static str,
    /// Time added to the times of the model to align it with the recording, s.
    pub clock_shift_s: Option<f64>,
    /// Standard deviation of the shift between the clocks of model and recording, s. Infinite if the path
    /// does not determine the shift; `None` if no path was aligned.
    pub clock_shift_sd_s: Option<f64>,
    /// Offset added to the positions of head and tip of the model along the sweep, m.
    pub along_m: Option<f64>,
    /// Offset added to the head drop of the model, m.
    pub drop_m: Option<f64>,
    /// The point of the blade whose paths in model and recording were aligned.
    pub followed: Option<AlignmentPoint>,
    /// Whether the head in the recording turns in the opposite direction to the head of the model.
    pub opposite_turn: bool,
    /// Residuals of one run of the model, one for each channel.
    pub residuals: Vec<ResidualSummary>,
    /// Residuals of the model that restarts at every segment of the fit, one for each fitted channel; empty
    /// without a fit to traces.
    pub restarted: Vec<ResidualSummary>,
    /// Cycles of stick and slip by which one run of the model gets ahead of the recording; `None` if they
    /// show no common cycle.
    pub drift_cycles: Option<f64>,
    /// The channel on which the model is judged; `None` if the heads of recording and model turn in opposite
    /// directions or the noise is unknown.
    pub judged: Option<&'static str>,
    /// The windows of the job's targets.
    pub windows: Vec<WindowSummary>,
    /// The ridges of the deflection after the release of the tip.
    pub ridge: RidgeSummaries,
    /// Number of changes of contact mode in the run of the model.
    pub transitions: usize,
}

/// Residual of a channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResidualSummary {
    /// Name of the channel.
    pub channel: &'static str,
    /// Root mean square of measured minus model, m.
    pub rms_m: f64,
    /// Standard deviation of the noise of the recorded channel, m.
    pub noise_m: Option<f64>,
    /// `rms_m / noise_m`.
    pub rms_over_noise: Option<f64>,
}

/// A window of the targets of a job. Each interval is from the start of the first frame to the end of the
/// last frame, s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WindowSummary {
    /// Names of the targets in the window.
    pub features: Vec<String>,
    /// Name of the channel.
    pub channel: &'static str,
    /// Start and end of the window in the recording, s.
    pub measured_s: Option<[f64; 2]>,
    /// Start and end of the window in the model, on the clock of the recording, s.
    pub model_s: Option<[f64; 2]>,
}

/// The ridges of recording and model.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RidgeSummaries {
    /// Ridge of the recording.
    pub measured: Option<RidgeSummary>,
    /// Ridge of the model.
    pub model: Option<RidgeSummary>,
}

/// Numbers of a ridge.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RidgeSummary {
    /// Length of a segment, s.
    pub segment_s: f64,
    /// Frequency band that was searched for the ridge, Hz.
    pub band_hz: [f64; 2],
    /// Number of segments.
    pub segments: usize,
    /// Number of segments with a component above the noise.
    pub points: usize,
    /// Number of segments that belong to parts of the ridge that follow one component.
    pub course_points: usize,
    /// Lowest and highest frequency of the parts of the ridge that follow one component, Hz.
    pub range_hz: Option<[f64; 2]>,
}

impl ComparisonSummary {
    /// Residual of the channel on which the model is judged, in one run of the model.
    pub(crate) fn judged_residual(&self) -> Option<&ResidualSummary> {
        self.residuals.iter().find(|line| Some(line.channel) == self.judged)
    }

    /// The part of `comparison.json` on this condition.
    fn to_json(&self) -> Value {
        let ratios = |lines: &[ResidualSummary]| -> Map<String, Value> {
            let line = |r: &ResidualSummary| {
                (
                    r.channel.to_owned(),
                    json!({ "residual_over_noise": r.rms_over_noise, "residual_rms_m": r.rms_m, "noise_m": r.noise_m }),
                )
            };
            lines.iter().map(line).collect()
        };
        let mut single_run = ratios(&self.residuals);
        single_run.insert("drift_cycles".to_owned(), json!(self.drift_cycles));
        json!({
            "condition": self.condition,
            "recording_kind": self.recording_kind,
            "restarted": ratios(&self.restarted),
            "single_run": single_run,
        })
    }

    /// The numbers of a condition.
    pub(crate) fn summarize(case: &ConditionComparison) -> Self {
        let alignment = case.recording().map(|_| case.alignment);
        let windows = group_fit_windows(case.job, case.condition);
        let [measured, model] = [&case.ridges.measured, &case.ridges.model]
            .map(|ridge| ridge.as_ref().map(RidgeSummary::summarize));
        Self {
            condition: case.name().to_owned(),
            recording: case.recording().map(|r| r.name().to_owned()),
            recording_kind: recording_kind(case.recording()),
            clock_shift_s: alignment.map(|a| a.shift_s),
            clock_shift_sd_s: alignment.and_then(|a| a.shift_sd_s),
            along_m: alignment.map(|a| a.along_m),
            drop_m: alignment.map(|a| a.drop_m),
            followed: alignment.map(|a| a.followed),
            opposite_turn: case.alignment.opposite_turn,
            residuals: summarize_residuals(case, case.residual.as_ref()),
            restarted: summarize_residuals(case, case.restarted.as_ref()),
            drift_cycles: case.drift_cycles(),
            judged: case.judged_channel().map(|(channel, _)| channel.name()),
            windows: windows.iter().map(|window| summarize_window(case, window)).collect(),
            ridge: RidgeSummaries { measured, model },
            transitions: case.model.motion.transitions.len(),
        }
    }
}

/// Clause on the drift of a run, such as "0.3 cycles ahead at its end".
pub(crate) fn describe_drift(cycles: f64) -> String {
    let where_to = if cycles < 0.0 { "behind" } else { "ahead" };
    format!("{} cycles {where_to} at its end", format_digits(cycles.abs(), 2))
}

/// Contents of `comparison.json`: the numbers of the condition `farthest`, and those of all conditions.
pub(crate) fn format_comparison_json(conditions: &[ComparisonSummary], farthest: usize) -> String {
    let mut whole = conditions.get(farthest).map_or_else(|| json!({}), ComparisonSummary::to_json);
    whole["conditions"] = conditions.iter().map(ComparisonSummary::to_json).collect();
    // serialisation cannot fail: keys are strings, and numbers that are not finite become `null`
    serde_json::to_string_pretty(&whole).unwrap_or_default() + "\n"
}

fn summarize_residuals(case: &ConditionComparison, residual: Option<&MotionTraces>) -> Vec<ResidualSummary> {
    let Some(residual) = residual else { return Vec::new() };
    let line = |channel: Channel| {
        let rms_m = residual.rms_m(channel, None)?;
        let noise_m = case.noise_m(channel);
        let rms_over_noise = noise_m.map(|noise_m| rms_m / noise_m);
        Some(ResidualSummary { channel: channel.name(), rms_m, noise_m, rms_over_noise })
    };
    MOTION_CHANNELS.into_iter().filter_map(line).collect()
}

fn summarize_window(case: &ConditionComparison, window: &FitWindow) -> WindowSummary {
    let span = |side: &TimedRecording, shift_s: f64| {
        let (frames, grid) = (side.window_frames(&window.window)?, side.recording.grid());
        Some([grid.time_s(frames.start) + shift_s, grid.time_s(frames.end) + shift_s])
    };
    WindowSummary {
        features: window.feature_names(),
        channel: window.channel.name(),
        measured_s: case.measured_side().and_then(|side| span(&side, 0.0)),
        model_s: span(&case.model_side(), case.alignment.shift_s),
    }
}

impl RidgeSummary {
    fn summarize(followed: &TrackedRidge) -> Self {
        Self {
            segment_s: followed.ridge.segment_s,
            band_hz: followed.band_hz.into(),
            segments: followed.spectrogram.time_s.len(),
            points: followed.ridge.points.len(),
            course_points: followed.courses.iter().map(Vec::len).sum(),
            range_hz: followed.frequency_range_hz().map(Into::into),
        }
    }
}
