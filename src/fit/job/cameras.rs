//! What is not known of the cameras of features; `traces.rs` has those of traces.

use super::Job;
use super::aim::{Aim, Source};
use super::as_written::{self, RecordingCamera};
use super::refusal::{Refusal, refuse};
use super::traces::{MOST_OFFSET_SD_M, MOST_SCALE_SD, OFFSET_SD_M, SCALE_SD, doubt};
use crate::fit::calibration::Calibration;
use serde::Serialize;

/// Standard deviations of what is not known of the camera of a recording from which features are read; one
/// that is 0 is held at its nominal value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FeatureCamera {
    /// Of the scale, relative.
    pub scale_sd: f64,
    /// Of the place of the tip's marker against the head's along the sweep, m.
    pub offset_sd_m: f64,
}

impl FeatureCamera {
    /// One of which everything is known.
    pub const EXACT: Self = Self { scale_sd: 0.0, offset_sd_m: 0.0 };
    const USUAL: Self = Self { scale_sd: SCALE_SD, offset_sd_m: OFFSET_SD_M };
}

/// The camera of the recording `entry`, such as `recording 1`.
pub(super) fn camera(entry: &str, written: Option<&RecordingCamera>) -> Result<FeatureCamera, Refusal> {
    let table = match written {
        None => return Ok(FeatureCamera::USUAL),
        Some(RecordingCamera::Word(word)) if word == "exact" => return Ok(FeatureCamera::EXACT),
        Some(RecordingCamera::Word(word)) => {
            return refuse(
                format!("{entry}, `camera`"),
                format!(
                    "found \"{word}\", expected \"exact\", or a table such as {{ offset_sd_m = 0.0005 }}"
                ),
            );
        }
        Some(RecordingCamera::Doubt(table)) => table,
    };
    let key = |key: &str| format!("{entry}, `camera.{key}`");
    let as_written::TraceCamera { tilt_sd_deg, scale_sd, offset_sd_m, clock_sd_s } = table;
    if tilt_sd_deg.is_some() {
        return refuse(
            key("tilt_sd_deg"),
            "found in the camera of features, which the offset covers: a tilt moves the tip against the head \
             by the height of the blade times the angle; enlarge `offset_sd_m` and remove it",
        );
    }
    if clock_sd_s.is_some() {
        return refuse(
            key("clock_sd_s"),
            "found in the camera of features, which find their instants in each recording by itself; remove it",
        );
    }
    Ok(FeatureCamera {
        scale_sd: doubt(key("scale_sd"), *scale_sd, MOST_SCALE_SD)?.unwrap_or(SCALE_SD),
        offset_sd_m: doubt(key("offset_sd_m"), *offset_sd_m, MOST_OFFSET_SD_M)?.unwrap_or(OFFSET_SD_M),
    })
}

/// A job with traces has its cameras there.
pub(super) fn check_beside_traces(written: &as_written::Job) -> Result<(), Refusal> {
    let both = (1..).zip(&written.recording).find(|(_, r)| !written.trace.is_empty() && r.camera.is_some());
    match both {
        None => Ok(()),
        Some((number, _)) => refuse(
            format!("recording {number}, `camera`"),
            "found in a job with a [[trace]], which estimates its camera frame by frame; write it as \
             [trace.camera], or remove it",
        ),
    }
}

impl Job {
    /// Cameras on which a feature depends that is fitted, with the numbers of their conditions.
    pub(super) fn cameras(&self) -> Vec<(usize, FeatureCamera)> {
        let used = |at: usize| {
            let aims = self.aims.iter().filter(|aim| aim.feature.condition == at && !aim.held_out);
            aims.filter_map(|aim| self.calibration(aim)).next().is_some()
        };
        let cameras = self.conditions.iter().enumerate().filter_map(|(at, c)| Some((at, c.camera?)));
        cameras.filter(|(at, _)| used(*at)).collect()
    }

    /// How the target of an aim depends on what is not known of its camera. `None` for what is no length, for
    /// a number that the job gives, whose deviation is the job's, and in a job with traces.
    #[must_use]
    pub fn calibration(&self, aim: &Aim) -> Option<Calibration> {
        let measured = matches!(aim.source, Source::Measured { .. }) && self.traces.is_empty();
        let condition = aim.feature.condition;
        let camera = self.conditions.get(condition)?.camera.filter(|_| measured)?;
        let FeatureCamera { scale_sd, offset_sd_m } = camera;
        let found = Calibration { condition, scale_sd, offset_sd_m, length: aim.feature.reading.length()? };
        (found.sds() != [0.0; 2]).then_some(found)
    }
}
