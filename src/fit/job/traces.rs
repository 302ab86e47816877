//! Traces of a job: the recordings that are fitted frame by frame, and the uncertain numbers
//! of their cameras.

use super::conditions::{self, HeadSource, JobCondition, check_camera_sd, parse_head_source};
use super::targets::JobEntry;
use super::{KeyRefusal, as_written, check_above_zero};
use crate::recording::channel::Window;
use crate::toml_file::suggest_key;
use serde::Serialize;
use std::f64::consts::PI;

/// Maximum number of stages: segment lengths usually double from stage to stage, and eight stages cover 4 ms
/// to half a second.
const MOST_STAGES: usize = 8;
/// Default standard deviation, degrees, of the camera's tilt from the horizontal. It applies to a camera that
/// is levelled with a spirit level.
const TILT_SD_DEG: f64 = 0.3;
/// Largest allowed standard deviation, degrees, of the camera's tilt. A recording with a larger tilt must be
/// levelled before the fit.
const MOST_TILT_SD_DEG: f64 = 10.0;
/// Largest allowed standard deviation, m/s, of the speed at which a marker drifts. A faster motion must be
/// tracked instead.
const MOST_DRIFT_SD_M_PER_S: f64 = 0.01;
/// Default standard deviation, s, of the camera's clock relative to the clock of the drive, for a camera that
/// is started by a trigger. It applies if the drive of the scene moves the head. A recorded head motion is
/// already on the clock of the camera.
const CLOCK_SD_S: f64 = 1e-3;
/// Largest allowed standard deviation, s, of the camera's clock relative to the clock of the drive. A larger
/// shift must be removed before the fit.
const MOST_CLOCK_SD_S: f64 = 0.1;

/// A recording whose trace is fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TraceTarget {
    /// Index of the condition of this recording, counted from 0.
    pub condition: usize,
    /// Fitted channels; `None` means `tip-x` and `head-drop`, if the recording has them.
    pub channels: Option<Vec<TraceChannel>>,
    /// Segment length of each stage, s, in ascending order; `None` for the default lengths.
    pub segment_s: Option<Vec<f64>>,
    /// Window of the fitted frames; `None` for all frames.
    pub window: Option<Window>,
    /// Standard deviation of a tracked coordinate, m; `None` if it is to be measured on the recording.
    pub noise_m: Option<f64>,
    /// Source of the head's motion; `None` for the recorded head if it is tracked, else the scene.
    pub head: Option<HeadSource>,
    /// Standard deviations of the priors of the camera's errors.
    pub camera: CameraPriorSds,
}

/// A tracked quantity that a trace fit compares frame by frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TraceChannel {
    /// Position of the tip along the sweep.
    TipX,
    /// Drop of the head: distance of the head below its height with an upright blade.
    HeadDrop,
    /// Position of the tip relative to the head, along the sweep.
    Deflection,
}

impl TraceChannel {
    /// Every channel with its name in a job, in the order of the variants.
    const WORDS: [(Self, &'static str); 3] =
        [(Self::TipX, "tip-x"), (Self::HeadDrop, "head-drop"), (Self::Deflection, "deflection")];

    /// Name of the channel in a job and in a result.
    pub(crate) fn name(self) -> &'static str {
        Self::WORDS[self as usize].1
    }
}

/// Standard deviations of the priors of a camera's errors; 0 fixes an error at its nominal value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CameraPriorSds {
    /// Standard deviation, rad, of the angle from the picture's x axis to the glass.
    pub tilt_sd_rad: f64,
    /// Relative standard deviation of the scale.
    pub scale_sd: f64,
    /// Standard deviation, m, of the position of either marker relative to the point that it marks.
    pub offset_sd_m: f64,
    /// Standard deviation, m/s, of the speed at which the positions of the markers drift.
    pub drift_sd_m_per_s: f64,
    /// Standard deviation, s, of the camera's clock relative to the clock of the drive; `None` if the job
    /// does not give it.
    clock_sd_s: Option<f64>,
}

impl CameraPriorSds {
    /// Standard deviation, s, of the camera's clock relative to the clock of the drive, if `head` is the
    /// source of the head's motion.
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
) -> Result<Vec<TraceTarget>, KeyRefusal> {
    let mut traces: Vec<TraceTarget> = Vec::new();
    for (number, written) in (1..).zip(written) {
        let entry = JobEntry { what: format!("trace {number}") };
        let trace = check_trace(&entry, written, conditions)?;
        if traces.iter().any(|other| other.condition == trace.condition) {
            let name = &conditions[trace.condition].name;
            refuse!(
                entry.key_path("recording"),
                "`{name}` has a [[trace]] already, and its camera is one; remove one of them"
            );
        }
        if traces.first().is_some_and(|first| first.segment_s != trace.segment_s) {
            refuse!(
                entry.key_path("segment_s"),
                "differs from that of trace 1, expected the same: all recordings go through the stages together"
            );
        }
        traces.push(trace);
    }
    Ok(traces)
}

fn check_trace(
    entry: &JobEntry,
    written: &as_written::JobTraceTable,
    conditions: &[JobCondition],
) -> Result<TraceTarget, KeyRefusal> {
    let (condition, JobCondition { name, recording, held_out, .. }) =
        entry.find_condition(written.recording.as_ref(), conditions)?;
    if recording.is_none() {
        refuse!(entry.key_path("recording"), "`{name}` has no recording; a [[trace]] needs a [[recording]]");
    }
    if *held_out {
        refuse!(
            entry.key_path("recording"),
            "`{name}` is held out of the fit; remove `held_out`, or the [[trace]]"
        );
    }
    let lengths = |found: &Vec<f64>| check_segment_lengths(entry, found);
    let window = |text| Window::parse(text).or_else(|e| refuse!(entry.key_path("window"), "{e}"));
    let noise = |found| check_above_zero(entry.key_path("noise_m"), found);
    Ok(TraceTarget {
        condition,
        channels: written.channels.as_deref().map(|found| check_channels(entry, found)).transpose()?,
        segment_s: written.segment_s.as_ref().map(lengths).transpose()?,
        window: written.window.as_deref().map(window).transpose()?,
        noise_m: written.noise_m.map(noise).transpose()?,
        head: parse_head_source(|| entry.key_path("drive"), written.drive.as_deref())?,
        camera: check_trace_camera(entry, &written.camera)?,
    })
}

fn check_channels(entry: &JobEntry, words: &[String]) -> Result<Vec<TraceChannel>, KeyRefusal> {
    let key = || entry.key_path("channels");
    let known = TraceChannel::WORDS.map(|(_, word)| word);
    let one = |word: &String| match TraceChannel::WORDS.iter().find(|(_, known)| known == word) {
        Some((channel, _)) => Ok(*channel),
        None => refuse!(key(), "found \"{word}\"; {}", suggest_key(word, &known)),
    };
    let found = words.iter().map(one).collect::<Result<Vec<_>, _>>()?;
    if found.is_empty() {
        refuse!(key(), "found none, expected one at least, such as [\"tip-x\"]; leave it out for all");
    }
    if let Some(twice) = (1..found.len()).find(|at| found[..*at].contains(&found[*at])) {
        refuse!(key(), "found \"{}\" twice; remove one of them", words[twice]);
    }
    if found.contains(&TraceChannel::TipX) && found.contains(&TraceChannel::Deflection) {
        refuse!(
            key(),
            "found \"tip-x\" and \"deflection\", which both have the noise of the tip; remove one of them"
        );
    }
    Ok(found)
}

fn check_segment_lengths(entry: &JobEntry, found: &[f64]) -> Result<Vec<f64>, KeyRefusal> {
    let key = || entry.key_path("segment_s");
    if !(1..=MOST_STAGES).contains(&found.len()) {
        let count = found.len();
        refuse!(key(), "found {count} lengths, expected 1 to {MOST_STAGES}, such as [0.004, 0.008, 0.016]");
    }
    for length in found {
        check_above_zero(key(), *length)?;
    }
    if let Some([before, after]) = found.windows(2).find(|pair| pair[0] >= pair[1]) {
        refuse!(
            key(),
            "found {after} after {before}, expected rising lengths: each stage starts from the one before"
        );
    }
    Ok(found.to_vec())
}

fn check_trace_camera(
    entry: &JobEntry,
    written: &as_written::JobTraceCameraTable,
) -> Result<CameraPriorSds, KeyRefusal> {
    let sd = |key: &str, found, most| check_camera_sd(entry.key_path(&format!("camera.{key}")), found, most);
    let tilt_sd_deg = sd("tilt_sd_deg", written.tilt_sd_deg, MOST_TILT_SD_DEG)?;
    let scale_sd = sd("scale_sd", written.scale_sd, conditions::MAX_SCALE_SD)?;
    let drift_sd_m_per_s = sd("drift_sd_m_per_s", written.drift_sd_m_per_s, MOST_DRIFT_SD_M_PER_S)?;
    let offset_sd_m = sd("offset_sd_m", written.offset_sd_m, conditions::MAX_OFFSET_SD_M)?;
    Ok(CameraPriorSds {
        tilt_sd_rad: tilt_sd_deg.unwrap_or(TILT_SD_DEG) * PI / 180.0,
        scale_sd: scale_sd.unwrap_or(conditions::DEFAULT_SCALE_SD),
        drift_sd_m_per_s: drift_sd_m_per_s.unwrap_or(0.0),
        offset_sd_m: offset_sd_m.unwrap_or(conditions::DEFAULT_OFFSET_SD_M),
        clock_sd_s: sd("clock_sd_s", written.clock_sd_s, MOST_CLOCK_SD_S)?,
    })
}
