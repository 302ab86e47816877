//! Tables of a comparison as CSV; times are on the clocks of the recordings.

use super::condition::{ConditionComparison, FittedRecording};
use super::model_run::ModelRun;
use super::ridge::TrackedRidge;
use crate::fit::job::Job;
use crate::recording::Recording;
use crate::recording::channel::Channel;
use crate::recording::motion_traces::{MOTION_CHANNELS, MotionTraces};
use crate::simulate::Transition;
use short_spectra::time_frequency::RidgePoint;

/// File name of [`comparison_table`].
pub(crate) const COMPARISON_FILE: &str = "comparison.csv";

/// A CSV file of a comparison.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ComparisonTable {
    /// Name of the file.
    pub file: &'static str,
    /// Contents of the file.
    pub text: String,
}

/// Tables of residuals, ridges and transitions of every condition, in the order of the job. The first two
/// columns are the condition and the kind of its recording.
pub(crate) fn comparison_tables(cases: &[ConditionComparison]) -> Vec<ComparisonTable> {
    let table = |file, header: &str, rows: fn(&ConditionComparison) -> Vec<Vec<String>>| {
        let rows = cases.iter().flat_map(|case| {
            let start = [case.name().to_owned(), recording_kind(case.recording()).to_owned()];
            rows(case).into_iter().map(move |row| start.iter().cloned().chain(row).collect::<Vec<_>>())
        });
        let header = ["condition", "recording"].into_iter().chain(header.split(','));
        let header = header.map(str::to_owned).collect();
        ComparisonTable { file, text: format_csv(std::iter::once(header).chain(rows)) }
    };
    vec![
        table("residuals.csv", "time_s,tip_x_m,head_x_m,deflection_m,head_drop_m", residual_rows),
        table("ridge.csv", "source,time_s,frequency_hz,frequency_sd_hz,amplitude_m,course", ridge_rows),
        table("transitions.csv", "time_s,from,to,cause", transition_rows),
    ]
}

/// Table with the positions in every frame of every recording, and the positions of the model at the same
/// times. The recordings are in the order of the job. The model is aligned with the clock and the origin of
/// each recording. `None` without a recording.
pub(crate) fn comparison_table(
    job: &Job,
    measured: &[FittedRecording<'_>],
    models: &[ModelRun],
) -> Option<ComparisonTable> {
    let names = MOTION_CHANNELS.iter().map(|channel| channel.name().replace('-', "_"));
    let columns = names.flat_map(|name| [format!("{name}_m"), format!("{name}_model_m")]);
    let header = ["condition", "recording", "time_s"].map(str::to_owned).into_iter().chain(columns);
    let mut rows = vec![header.collect::<Vec<_>>()];
    for ((condition, measured), model) in job.conditions.iter().zip(measured).zip(models) {
        let (recording, view) = (measured.recording, &model.view.recording);
        let alignment = model.alignment(recording);
        let seen = model.measured_motion(recording);
        let model = MotionTraces::from_model_at_frames(recording, view, &alignment);
        for (i, time_s) in seen.time_s.iter().enumerate() {
            let pair = |&channel: &Channel| [&seen, &model].map(|traces| trace_cell(traces, channel, i));
            let cells = MOTION_CHANNELS.iter().flat_map(pair);
            let start =
                [condition.name.clone(), recording_kind(Some(recording)).to_owned(), time_s.to_string()];
            rows.push(start.into_iter().chain(cells).collect());
        }
    }
    (!measured.is_empty()).then(|| ComparisonTable { file: COMPARISON_FILE, text: format_csv(rows) })
}

fn format_csv(rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    // writing rows of equal length to memory cannot fail
    rows.into_iter().for_each(|row| writer.write_record(row).unwrap_or_default());
    String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
}

/// Kind of the data that the model is compared with.
pub(super) fn recording_kind(recording: Option<&Recording>) -> &'static str {
    match recording {
        None => "published",
        Some(recording) if recording.is_synthetic() => "synthetic",
        Some(_) => "measured",
    }
}

/// Cell of a channel in frame `i`, m; empty if the value is missing.
fn trace_cell(traces: &MotionTraces, channel: Channel, i: usize) -> String {
    let value_m = traces.column(channel).get(i).copied().flatten();
    value_m.map_or_else(String::new, |m| format!("{m:e}"))
}

/// Table rows with the residuals (measured minus model), one row per frame.
fn residual_rows(case: &ConditionComparison) -> Vec<Vec<String>> {
    let Some(residual) = &case.residual else { return Vec::new() };
    let row = |(i, time_s): (usize, &f64)| {
        let cells = MOTION_CHANNELS.iter().map(|&channel| trace_cell(residual, channel, i));
        std::iter::once(time_s.to_string()).chain(cells).collect()
    };
    residual.time_s.iter().enumerate().map(row).collect()
}

fn ridge_rows(case: &ConditionComparison) -> Vec<Vec<String>> {
    let rows = |source, ridge: &Option<TrackedRidge>, shift_s| {
        ridge.as_ref().map_or_else(Vec::new, |ridge| tracked_ridge_rows(source, ridge, shift_s))
    };
    let measured = rows("measured", &case.ridges.measured, 0.0);
    [measured, rows("model", &case.ridges.model, case.alignment.shift_s)].concat()
}

/// Rows of all points of a ridge. Each row has the number, counted from 1, of the part of the ridge that
/// follows one component; the number is empty outside these parts.
fn tracked_ridge_rows(source: &str, followed: &TrackedRidge, shift_s: f64) -> Vec<Vec<String>> {
    let row = |point: &RidgePoint| {
        let course = followed.courses.iter().position(|course| course.contains(point));
        vec![
            source.to_owned(),
            (followed.start_s + point.time_s + shift_s).to_string(),
            point.frequency_hz.to_string(),
            point.frequency_sd_hz.to_string(),
            format!("{:e}", point.amplitude_m),
            course.map_or_else(String::new, |number| (number + 1).to_string()),
        ]
    };
    followed.ridge.points.iter().map(row).collect()
}

fn transition_rows(case: &ConditionComparison) -> Vec<Vec<String>> {
    let row = |transition: &Transition| {
        let time_s = transition.time_s + case.alignment.shift_s;
        let modes = [transition.from.name(), transition.to.name(), transition.cause.name()];
        std::iter::once(format!("{time_s:.16e}")).chain(modes.map(str::to_owned)).collect()
    };
    case.model.motion.transitions.iter().map(row).collect()
}
