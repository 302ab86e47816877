//! Traces of a job: which recordings are fitted frame by frame, and what is not known of their cameras.

use super::as_written;
use super::conditions::{
    DEFAULT_OFFSET_SD_M, DEFAULT_SCALE_SD, MAX_OFFSET_SD_M, MAX_SCALE_SD, check_camera_sd,
};
use super::conditions::{HeadSource, JobCondition, parse_head_source};
use super::targets::JobEntry;
use super::{JobRefusal, check_above_zero, refuse};
use crate::recording::channel::Window;
use crate::toml_file::suggest_key;
use serde::Serialize;
use std::f64::consts::PI;

/// Most lengths of segments: each doubles the one before, so that eight reach from 4 ms to half a second.
const MOST_STAGES: usize = 8;
/// Standard deviation of the camera's tilt unless the job says otherwise, degrees: of a camera that was set
/// up with a spirit level.
const TILT_SD_DEG: f64 = 0.3;
/// Largest of it, degrees: beyond it a recording has to be levelled first.
const MOST_TILT_SD_DEG: f64 = 10.0;
/// Largest of the drift of a marker, m/s: more is no drift, but a motion that has to be tracked.
const MOST_DRIFT_SD_M_PER_S: f64 = 0.01;
/// Standard deviation of the camera's clock against the drive's where the scene drives the head, s: of a
/// camera that is started by a trigger. Where the recording's own head drives, one camera took both.
const CLOCK_SD_S: f64 = 1e-3;
/// Largest of it, s: more is an alignment that has to be made first.
const MOST_CLOCK_SD_S: f64 = 0.1;

/// A recording whose trace is fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TraceTarget {
    /// Number of its condition, from 0.
    pub condition: usize,
    /// What of it is fitted; `None` for what it has of `tip-x` and `head-drop`.
    pub channels: Option<Vec<TraceChannel>>,
    /// Lengths of the segments of each stage, rising, s; `None` for the usual ones.
    pub segment_s: Option<Vec<f64>>,
    /// Frames that are fitted; `None` for all.
    pub window: Option<Window>,
    /// Standard deviation of a tracked coordinate, m; `None` for the measured one.
    pub noise_m: Option<f64>,
    /// What drives the head of its model; `None` for the recording's own where it tracks the head.
    pub head: Option<HeadSource>,
    /// What is not known of its camera.
    pub camera: CameraPriorSds,
}

/// A tracked quantity that a trace fit compares frame by frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TraceChannel {
    /// Place of the tip along the sweep.
    TipX,
    /// How far the head is below its upright place.
    HeadDrop,
    /// Place of the tip against the head, along the sweep.
    Deflection,
}

impl TraceChannel {
    /// Every channel with its word in a job.
    const WORDS: [(Self, &'static str); 3] =
        [(Self::TipX, "tip-x"), (Self::HeadDrop, "head-drop"), (Self::Deflection, "deflection")];

    /// The word in a job and in a result.
    pub(crate) fn name(self) -> &'static str {
        Self::WORDS[self as usize].1
    }
}

/// Standard deviations of what is not known of a camera; one that is 0 is held at its nominal value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CameraPriorSds {
    /// Of the angle from the picture's x axis to the glass, rad.
    pub tilt_sd_rad: f64,
    /// Of the scale, relative.
    pub scale_sd: f64,
    /// Of the place of either marker against the point that it stands for, m.
    pub offset_sd_m: f64,
    /// Of the speed at which these places drift, m/s.
    pub drift_sd_m_per_s: f64,
    /// Of the camera's clock where it is given, s.
    clock_sd_s: Option<f64>,
}

impl CameraPriorSds {
    /// Of the camera's clock against the drive's, s, with this drive.
    pub(crate) fn clock_sd_s(&self, head: HeadSource) -> f64 {
        self.clock_sd_s.unwrap_or(match head {
            HeadSource::Recording => 0.0,
            HeadSource::Scene => CLOCK_SD_S,
        })
    }
}

pub(super) fn check_traces(
    written: &[as_written::JobTraceTable],
    conditions: &[JobCondition],
) -> Result<Vec<TraceTarget>, JobRefusal> {
    let mut traces: Vec<TraceTarget> = Vec::new();
    for (number, written) in (1..).zip(written) {
        let entry = JobEntry { what: format!("trace {number}") };
        let trace = check_trace(&entry, written, conditions)?;
        check_trace_consistency(&entry, &trace, &traces, conditions)?;
        traces.push(trace);
    }
    Ok(traces)
}

/// One trace a recording, and the stages of the others.
fn check_trace_consistency(
    entry: &JobEntry,
    trace: &TraceTarget,
    before: &[TraceTarget],
    conditions: &[JobCondition],
) -> Result<(), JobRefusal> {
    if before.iter().any(|other| other.condition == trace.condition) {
        let name = &conditions[trace.condition].name;
        return refuse(
            entry.key_path("recording"),
            format!("`{name}` has a [[trace]] already, and its camera is one; remove one of them"),
        );
    }
    match before.first().filter(|first| first.segment_s != trace.segment_s) {
        Some(_) => refuse(
            entry.key_path("segment_s"),
            "differs from that of trace 1, expected the same: all recordings go through the stages together",
        ),
        None => Ok(()),
    }
}

fn check_trace(
    entry: &JobEntry,
    written: &as_written::JobTraceTable,
    conditions: &[JobCondition],
) -> Result<TraceTarget, JobRefusal> {
    let place = entry.find_condition(written.recording.as_ref(), conditions, None)?;
    let name = &conditions[place.index].name;
    if !place.measured {
        return refuse(
            entry.key_path("recording"),
            format!("`{name}` has no recording; a [[trace]] needs a [[recording]]"),
        );
    }
    if place.held_out {
        return refuse(
            entry.key_path("recording"),
            format!("`{name}` is held out of the fit; remove `held_out`, or the [[trace]]"),
        );
    }
    let window =
        |text: &String| Window::parse(text).or_else(|e| refuse(entry.key_path("window"), e.to_string()));
    Ok(TraceTarget {
        condition: place.index,
        channels: written.channels.as_deref().map(|found| check_channels(entry, found)).transpose()?,
        segment_s: written
            .segment_s
            .as_deref()
            .map(|found| check_segment_lengths(entry, found))
            .transpose()?,
        window: written.window.as_ref().map(window).transpose()?,
        noise_m: written
            .noise_m
            .map(|noise| check_above_zero(entry.key_path("noise_m"), noise))
            .transpose()?,
        head: written
            .drive
            .as_deref()
            .map(|word| parse_head_source(entry.key_path("drive"), word))
            .transpose()?,
        camera: check_trace_camera(entry, &written.camera)?,
    })
}

fn check_channels(entry: &JobEntry, words: &[String]) -> Result<Vec<TraceChannel>, JobRefusal> {
    let key = || entry.key_path("channels");
    let known = TraceChannel::WORDS.map(|(_, word)| word);
    let one = |word: &String| {
        let found = TraceChannel::WORDS.iter().find(|(_, known)| known == word);
        found.map_or_else(
            || refuse(key(), format!("found \"{word}\"; {}", suggest_key(word, &known))),
            |(channel, _)| Ok(*channel),
        )
    };
    let found = words.iter().map(one).collect::<Result<Vec<_>, _>>()?;
    if found.is_empty() {
        return refuse(key(), "found none, expected one at least, such as [\"tip-x\"]; leave it out for all");
    }
    if let Some(twice) = (1..found.len()).find(|at| found[..*at].contains(&found[*at])) {
        return refuse(key(), format!("found \"{}\" twice; remove one of them", words[twice]));
    }
    if found.contains(&TraceChannel::TipX) && found.contains(&TraceChannel::Deflection) {
        return refuse(
            key(),
            "found \"tip-x\" and \"deflection\", which both have the noise of the tip; remove one of them",
        );
    }
    Ok(found)
}

fn check_segment_lengths(entry: &JobEntry, found: &[f64]) -> Result<Vec<f64>, JobRefusal> {
    let key = || entry.key_path("segment_s");
    if !(1..=MOST_STAGES).contains(&found.len()) {
        return refuse(
            key(),
            format!(
                "found {} lengths, expected 1 to {MOST_STAGES}, such as [0.004, 0.008, 0.016]",
                found.len()
            ),
        );
    }
    found.iter().try_for_each(|length| check_above_zero(key(), *length).map(|_| ()))?;
    match found.windows(2).find(|pair| pair[0] >= pair[1]) {
        Some(pair) => refuse(
            key(),
            format!(
                "found {} after {}, expected rising lengths: each stage starts from the one before",
                pair[1], pair[0]
            ),
        ),
        None => Ok(found.to_vec()),
    }
}

fn check_trace_camera(
    entry: &JobEntry,
    written: &as_written::JobTraceCameraTable,
) -> Result<CameraPriorSds, JobRefusal> {
    let sd = |key: &str, found, most| check_camera_sd(entry.key_path(&format!("camera.{key}")), found, most);
    let tilt_sd_deg = sd("tilt_sd_deg", written.tilt_sd_deg, MOST_TILT_SD_DEG)?;
    Ok(CameraPriorSds {
        tilt_sd_rad: tilt_sd_deg.unwrap_or(TILT_SD_DEG) * PI / 180.0,
        scale_sd: sd("scale_sd", written.scale_sd, MAX_SCALE_SD)?.unwrap_or(DEFAULT_SCALE_SD),
        drift_sd_m_per_s: sd("drift_sd_m_per_s", written.drift_sd_m_per_s, MOST_DRIFT_SD_M_PER_S)?
            .unwrap_or(0.0),
        offset_sd_m: sd("offset_sd_m", written.offset_sd_m, MAX_OFFSET_SD_M)?.unwrap_or(DEFAULT_OFFSET_SD_M),
        clock_sd_s: sd("clock_sd_s", written.clock_sd_s, MOST_CLOCK_SD_S)?,
    })
}
