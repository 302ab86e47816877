//! Traces of a job matched with their recordings: channels, frames and segment lengths.

use super::job::{CameraPriorSds, HeadSource, Job, TraceChannel, TraceTarget};
use crate::fit::trace::first_segment_s;
use crate::recording::Recording;
use crate::recording::channel::{Channel, ReversalInstants, Window};
use crate::recording::noise::RecordingNoise;
use crate::simulate::drive::smooth_head_motion;
use crate::simulate::scene::Scene;
use std::ops::Range;
use std::sync::Arc;

/// Default segment lengths of the stages, in units of the first segment length of the blade. The first is
/// short enough for convergence from the middle of the bounds; the last is the longest for which the motion
/// fitted with shorter segments reliably gives starting states.
const DEFAULT_SEGMENTS: [f64; 3] = [1.0, 2.0, 4.0];
/// If the shortest segments have fewer frames than this, a stage with longer segments is added, because short
/// segments with few frames bias the estimates more strongly.
const FEW_FRAMES: f64 = 16.0;
/// Length of the segments of this stage, in units of the first segment length.
const EXTRA_SEGMENT: f64 = 8.0;
/// Minimum number of frames in a segment. The starting state of a segment uses up four degrees of freedom.
pub(crate) const MIN_SEGMENT_FRAMES: usize = 8;
/// Minimum number of frames in which a fitted channel must be tracked: slightly more than one segment.
const MIN_TRACKED_FRAMES: usize = 10;

/// A trace of the job, with the channels and frames that are fitted on its recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TraceData {
    /// Index of the condition to which the trace belongs.
    pub condition: usize,
    /// Fitted channels, at least one.
    pub channels: Vec<TraceChannel>,
    /// Indices of the fitted frames.
    pub frames: Range<usize>,
    /// Standard deviation of a tracked coordinate, m, if the job gives it.
    pub noise_m: Option<f64>,
    /// Source of the head's motion in the model.
    pub head: HeadSource,
    /// Standard deviations of the priors of the camera's errors.
    pub camera: CameraPriorSds,
    /// Noise of the recording, if it has been measured before.
    pub noise: Option<Arc<RecordingNoise>>,
}

/// Reason why a trace cannot be fitted to its recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("trace {number}, `{key}`: {problem}")]
pub struct TraceError {
    /// Number of the trace in the job, counted from 1.
    pub number: usize,
    /// Key of the job that has to be changed.
    pub key: &'static str,
    /// Value found, value expected, and advice.
    pub problem: String,
}

/// Key of the job to be changed, and description of the problem, for a [`TraceError`].
type TraceRefusal = (&'static str, String);

/// The traces of a job matched with their recordings, and the segment length of each stage, s.
///
/// # Errors
/// [`TraceError`] at the first trace that cannot be fitted.
pub(crate) fn prepare_traces(
    job: &Job,
    scenes: &[Scene],
    recordings: &[Option<Recording>],
) -> Result<(Vec<TraceData>, Vec<f64>), TraceError> {
    let mut found = Vec::new();
    let rates_hz = job.traces.iter().filter_map(|aim| Some(recordings.get(aim.condition)?.as_ref()?.grid()));
    let slowest_hz = rates_hz.map(|grid| grid.frame_rate_hz).fold(f64::INFINITY, f64::min);
    let usual = || {
        let shortest_s =
            scenes.iter().map(|scene| first_segment_s(&scene.linkage)).fold(f64::INFINITY, f64::min);
        let extra = (slowest_hz * shortest_s < FEW_FRAMES).then_some(EXTRA_SEGMENT);
        DEFAULT_SEGMENTS.into_iter().chain(extra).map(|length| length * shortest_s).collect()
    };
    let mut stages = job.traces.first().and_then(|trace| trace.segment_s.clone()).unwrap_or_else(usual);
    for (number, aim) in (1..).zip(&job.traces) {
        let at = |(key, problem)| TraceError { number, key, problem };
        let Some(recording) = recordings.get(aim.condition).and_then(Option::as_ref) else {
            return Err(at(("recording", "it is not at hand".to_owned())));
        };
        let frames = fitted_frames(aim.window.as_ref(), recording).map_err(at)?;
        let channels = fitted_channels(aim, recording, &frames).map_err(at)?;
        let head = head_source(aim, recording).map_err(at)?;
        let TraceTarget { condition, noise_m, camera, .. } = *aim;
        let one = TraceData { condition, channels, head, frames, noise_m, camera, noise: None };
        check_drive(job, one.head).map_err(at)?;
        if let Some(scene) = scenes.get(condition) {
            check_span(scene, &one, recording).map_err(at)?;
        }
        stages = possible_stages(aim, &one, recording, &stages).map_err(at)?;
        found.push(one);
    }
    Ok((found, stages))
}

fn fitted_frames(window: Option<&Window>, recording: &Recording) -> Result<Range<usize>, TraceRefusal> {
    let Some(window) = window else { return Ok(0..recording.grid().frames) };
    let found = window.resolve_frames(recording, &ReversalInstants::find_instants(recording));
    found.map_err(|error| ("window", format!("`{}`: {error}", recording.name())))
}

fn fitted_channels(
    aim: &TraceTarget,
    recording: &Recording,
    frames: &Range<usize>,
) -> Result<Vec<TraceChannel>, TraceRefusal> {
    let tracked = |channel: TraceChannel| {
        let channel = match channel {
            TraceChannel::TipX => Channel::TipX,
            TraceChannel::HeadDrop => Channel::HeadDrop,
            TraceChannel::Deflection => Channel::Deflection,
        };
        channel.samples(recording)[frames.clone()].iter().flatten().count()
    };
    let has = |channel: TraceChannel| tracked(channel) >= MIN_TRACKED_FRAMES;
    let name = recording.name();
    let problem = if let Some(wanted) = &aim.channels {
        let Some(lacks) = wanted.iter().find(|channel| !has(**channel)) else { return Ok(wanted.clone()) };
        let (channel, tracked, frames) = (lacks.name(), tracked(*lacks), frames.len());
        format!(
            "found \"{channel}\", which `{name}` shows in {tracked} of {frames} frames, expected {MIN_TRACKED_FRAMES} at least; leave it out, or track the point"
        )
    } else {
        let usual = [TraceChannel::TipX, TraceChannel::HeadDrop];
        let found: Vec<_> = usual.into_iter().filter(|channel| has(*channel)).collect();
        if !found.is_empty() {
            return Ok(found);
        }
        format!("`{name}` shows neither the tip nor the head in enough frames; track the tip")
    };
    Err(("channels", problem))
}

/// Source of the head's motion: the source that the job names, if it names one. Otherwise it is the recorded
/// head if the head is tracked, and the scene if not.
fn head_source(aim: &TraceTarget, recording: &Recording) -> Result<HeadSource, TraceRefusal> {
    match (aim.head, smooth_head_motion(recording)) {
        (Some(HeadSource::Recording), Err(error)) => {
            Err(("drive", format!("{error}; or write drive = \"scene\"")))
        }
        (Some(head), _) => Ok(head),
        (None, Ok(_)) => Ok(HeadSource::Recording),
        (None, Err(_)) => Ok(HeadSource::Scene),
    }
}

/// Refuses a job that frees a parameter of the drive although the recorded head drives the model.
fn check_drive(job: &Job, head: HeadSource) -> Result<(), TraceRefusal> {
    let free = job.parameters.iter().map(|free| free.name.as_str()).chain(job.constants.listed_names());
    let mut free = free.filter(|name| head == HeadSource::Recording && name.starts_with("drive."));
    let Some(name) = free.next() else { return Ok(()) };
    let problem = format!(
        "the recording's own head drives the model, and `{name}` is free; remove it, or write drive = \"scene\""
    );
    Err(("drive", problem))
}

/// Refuses a scene whose run does not overlap with the fitted frames, if the scene drives the head.
fn check_span(scene: &Scene, one: &TraceData, recording: &Recording) -> Result<(), TraceRefusal> {
    let grid = recording.grid();
    let [first_s, last_s] = [one.frames.start, one.frames.end - 1].map(|frame| grid.time_s(frame));
    let (start_s, stop_s) = (scene.start_s, scene.run.stop_s);
    if one.head == HeadSource::Recording || (first_s <= stop_s && start_s <= last_s) {
        return Ok(());
    }
    let problem = format!(
        "found \"scene\", whose head runs from {start_s} to {stop_s} s, and frames from {first_s} to {last_s} s in `{}`, expected times in common; shift the scene's times and `drive.delay_s` by the same, or track the head and leave `drive` out",
        recording.name()
    );
    Err(("drive", problem))
}

/// Segment lengths of the stages whose segments fit into the recording, s. If the job gives the stages, all
/// of them must fit.
fn possible_stages(
    aim: &TraceTarget,
    trace: &TraceData,
    recording: &Recording,
    stages: &[f64],
) -> Result<Vec<f64>, TraceRefusal> {
    let rate_hz = recording.grid().frame_rate_hz;
    let count = |length_s: f64| (length_s * rate_hz).round() as usize;
    let holds = |length_s: &f64| (MIN_SEGMENT_FRAMES..=trace.frames.len()).contains(&count(*length_s));
    let found: Vec<f64> = stages.iter().copied().filter(holds).collect();
    if !found.is_empty() && (aim.segment_s.is_none() || found.len() == stages.len()) {
        return Ok(found);
    }
    let wrong = stages.iter().copied().find(|stage| !holds(stage)).unwrap_or_default();
    let (wrong_frames, most, least_s) =
        (count(wrong), trace.frames.len(), MIN_SEGMENT_FRAMES as f64 / rate_hz);
    let problem = format!(
        "found {wrong} s, which is {wrong_frames} frames of `{}` at {rate_hz} frames/s, expected {MIN_SEGMENT_FRAMES} to {most} frames: {least_s} s at least",
        recording.name(),
    );
    Err(("segment_s", problem))
}
