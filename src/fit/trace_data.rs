//! Traces of a job against the recordings themselves: what each has, which frames are fitted, and in which
//! segments.

use super::job::{CameraPriorSds, HeadSource, Job, TraceChannel, TraceTarget};
use crate::recording::Recording;
use crate::recording::channel::{Channel, ReversalInstants, Window};
use crate::simulate::drive::smooth_head_motion;
use crate::simulate::scene::Scene;
use std::ops::Range;

/// Lengths of segments unless the job says otherwise, s: from 4 ms on, the first converges from the middle of
/// the bounds, and the last is as long as starting states are carried over safely.
pub(crate) const DEFAULT_SEGMENT_S: [f64; 3] = [0.004, 0.008, 0.016];
/// Frames a second below which one more stage has segments of [`EXTRA_SEGMENT_S`]: with few frames the bias of short
/// segments is larger.
const SLOW_HZ: f64 = 4_000.0;
const EXTRA_SEGMENT_S: f64 = 0.032;
/// Fewest frames of a segment: four of them pay for the starting state.
pub(crate) const MIN_SEGMENT_FRAMES: usize = 8;
/// Fewest frames in which a channel is tracked: a handful more than one segment has.
const MIN_TRACKED_FRAMES: usize = 10;

/// A trace with everything that its recording decides.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TraceData {
    /// Number of its condition, from 0.
    pub condition: usize,
    /// What is fitted, at least one.
    pub channels: Vec<TraceChannel>,
    /// Frames that are fitted.
    pub frames: Range<usize>,
    /// Standard deviation of a tracked coordinate where the job gives it, m.
    pub noise_m: Option<f64>,
    /// What drives the head of the model.
    pub head: HeadSource,
    /// What is not known of its camera.
    pub camera: CameraPriorSds,
}

/// Why a trace does not go with its recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("trace {number}, `{key}`: {problem}")]
pub struct TraceError {
    /// Number of the trace, from 1.
    pub number: usize,
    /// The key of the job.
    pub key: &'static str,
    /// What was found, what was expected and what to do.
    pub problem: String,
}

/// Why a trace does not go with its recording: key and problem.
type TraceRefusal = (&'static str, String);

/// The traces of a job on its recordings, one for each condition that has one, and the lengths of the
/// segments of each stage, s.
///
/// # Errors
/// [`TraceError`] at the first that does not fit.
pub(crate) fn prepare_traces(
    job: &Job,
    scenes: &[Scene],
    recordings: &[Option<Recording>],
) -> Result<(Vec<TraceData>, Vec<f64>), TraceError> {
    let mut found = Vec::new();
    let rates_hz = job.traces.iter().filter_map(|aim| Some(recordings.get(aim.condition)?.as_ref()?.grid()));
    let slowest_hz = rates_hz.map(|grid| grid.frame_rate_hz).fold(f64::INFINITY, f64::min);
    let usual = || {
        if slowest_hz < SLOW_HZ {
            [&DEFAULT_SEGMENT_S[..], &[EXTRA_SEGMENT_S]].concat()
        } else {
            DEFAULT_SEGMENT_S.into()
        }
    };
    let mut stages = job.traces.first().and_then(|trace| trace.segment_s.clone()).unwrap_or_else(usual);
    for (number, aim) in (1..).zip(&job.traces) {
        let at = |(key, problem)| TraceError { number, key, problem };
        let Some(recording) = recordings.get(aim.condition).and_then(Option::as_ref) else {
            return Err(at(("recording", "it is not at hand".to_owned())));
        };
        let one = prepare_trace(aim, recording).map_err(at)?;
        check_drive(job, one.head).map_err(at)?;
        if let Some(scene) = scenes.get(aim.condition) {
            check_span(scene, &one, recording).map_err(at)?;
        }
        stages = possible_stages(aim, &one, recording, &stages).map_err(at)?;
        found.push(one);
    }
    Ok((found, stages))
}

fn prepare_trace(aim: &TraceTarget, recording: &Recording) -> Result<TraceData, TraceRefusal> {
    let frames = fitted_frames(aim.window.as_ref(), recording)?;
    Ok(TraceData {
        condition: aim.condition,
        channels: fitted_channels(aim, recording, &frames)?,
        head: head_source(aim, recording)?,
        frames,
        noise_m: aim.noise_m,
        camera: aim.camera,
    })
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
    let tracked =
        |channel: TraceChannel| channel_samples(channel, recording)[frames.clone()].iter().flatten().count();
    let has = |channel: TraceChannel| tracked(channel) >= MIN_TRACKED_FRAMES;
    let Some(wanted) = &aim.channels else {
        let usual = [TraceChannel::TipX, TraceChannel::HeadDrop];
        let found: Vec<_> = usual.into_iter().filter(|channel| has(*channel)).collect();
        if found.is_empty() {
            let words = "shows neither the tip nor the head in enough frames; track the tip";
            return Err(("channels", format!("`{}` {words}", recording.name())));
        }
        return Ok(found);
    };
    match wanted.iter().find(|channel| !has(**channel)) {
        None => Ok(wanted.clone()),
        Some(lacks) => Err((
            "channels",
            format!(
                "found \"{}\", which `{}` shows in {} of {} frames, expected {MIN_TRACKED_FRAMES} at least; leave it out, or track the point",
                lacks.name(),
                recording.name(),
                tracked(*lacks),
                frames.len()
            ),
        )),
    }
}

/// The channel in every frame, m.
fn channel_samples(channel: TraceChannel, recording: &Recording) -> Vec<Option<f64>> {
    let channel = match channel {
        TraceChannel::TipX => Channel::TipX,
        TraceChannel::HeadDrop => Channel::HeadDrop,
        TraceChannel::Deflection => Channel::Deflection,
    };
    channel.samples(recording)
}

/// The recording's own head where it is tracked, unless the job says otherwise.
fn head_source(aim: &TraceTarget, recording: &Recording) -> Result<HeadSource, TraceRefusal> {
    let tracked = smooth_head_motion(recording);
    match (aim.head, tracked) {
        (Some(HeadSource::Recording), Err(error)) => {
            Err(("drive", format!("{error}; or write drive = \"scene\"")))
        }
        (Some(head), _) => Ok(head),
        (None, Ok(_)) => Ok(HeadSource::Recording),
        (None, Err(_)) => Ok(HeadSource::Scene),
    }
}

/// A drive that the recording gives cannot be searched.
fn check_drive(job: &Job, head: HeadSource) -> Result<(), TraceRefusal> {
    let free = job.parameters.iter().find(|free| free.name.starts_with("drive."));
    match (free, head) {
        (Some(free), HeadSource::Recording) => Err((
            "drive",
            format!(
                "the recording's own head drives the model, and the parameter `{}` is free; remove it, or write drive = \"scene\"",
                free.name
            ),
        )),
        _ => Ok(()),
    }
}

/// The head of a scene moves by the scene's own clock, which has to be that of the recording.
fn check_span(scene: &Scene, one: &TraceData, recording: &Recording) -> Result<(), TraceRefusal> {
    let grid = recording.grid();
    let [first_s, last_s] = [one.frames.start, one.frames.end - 1].map(|frame| grid.time_s(frame));
    let (start_s, stop_s) = (scene.start_s, scene.run.stop_s);
    if one.head == HeadSource::Recording || (first_s <= stop_s && start_s <= last_s) {
        return Ok(());
    }
    Err((
        "drive",
        format!(
            "found \"scene\", whose head runs from {start_s} to {stop_s} s, and frames from {first_s} to {last_s} s in `{}`, expected times in common; shift the scene's times, or track the head and leave `drive` out",
            recording.name()
        ),
    ))
}

/// The stages that a recording can hold; those that the job gives it must hold.
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
    Err((
        "segment_s",
        format!(
            "found {wrong} s, which is {} frames of `{}` at {rate_hz} frames/s, expected {MIN_SEGMENT_FRAMES} to {} frames: {} s at least",
            count(wrong),
            recording.name(),
            trace.frames.len(),
            MIN_SEGMENT_FRAMES as f64 / rate_hz,
        ),
    ))
}
