//! What is not known of cameras: what those of features and of traces have in common, and those of features.

use super::as_written::{self, RecordingCamera};
use super::refusal::{JobRefusal, refuse};
use serde::Serialize;

/// Relative standard deviation of the scale unless the job says otherwise: a scale bar of 20 mm that is read
/// to a tenth of a millimetre.
pub(super) const DEFAULT_SCALE_SD: f64 = 0.005;
/// Largest of it: a scale that is known worse is not a calibration.
pub(super) const MAX_SCALE_SD: f64 = 0.1;
/// Standard deviation of the places of both markers unless the job says otherwise, m: nobody's marker sits on
/// the hinge to better than a millimetre.
pub(super) const DEFAULT_OFFSET_SD_M: f64 = 1e-3;
/// Largest of it, m: the length of a blade.
pub(super) const MAX_OFFSET_SD_M: f64 = 0.1;

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
    const USUAL: Self = Self { scale_sd: DEFAULT_SCALE_SD, offset_sd_m: DEFAULT_OFFSET_SD_M };
}

/// The camera of the recording `entry`, such as `recording 1`.
pub(super) fn check_feature_camera(
    entry: &str,
    written: Option<&RecordingCamera>,
) -> Result<FeatureCamera, JobRefusal> {
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
    let as_written::JobTraceCameraTable { tilt_sd_deg, scale_sd, offset_sd_m, drift_sd_m_per_s, clock_sd_s } =
        table;
    let of_traces = [
        (
            "tilt_sd_deg",
            tilt_sd_deg,
            "which the offset covers: a tilt moves the tip against the head by the height of the blade times \
             the angle; enlarge `offset_sd_m` and remove it",
        ),
        (
            "drift_sd_m_per_s",
            drift_sd_m_per_s,
            "whose offset is one for the whole recording; enlarge `offset_sd_m`, or fit the recording as a [[trace]]",
        ),
        ("clock_sd_s", clock_sd_s, "which find their instants in each recording by itself; remove it"),
    ];
    for (name, found, why) in of_traces {
        if found.is_some() {
            return refuse(key(name), format!("found in the camera of features, {why}"));
        }
    }
    Ok(FeatureCamera {
        scale_sd: check_camera_sd(key("scale_sd"), *scale_sd, MAX_SCALE_SD)?.unwrap_or(DEFAULT_SCALE_SD),
        offset_sd_m: check_camera_sd(key("offset_sd_m"), *offset_sd_m, MAX_OFFSET_SD_M)?
            .unwrap_or(DEFAULT_OFFSET_SD_M),
    })
}

/// A job with traces has its cameras there.
pub(super) fn check_no_camera_with_traces(written: &as_written::JobFile) -> Result<(), JobRefusal> {
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

/// A standard deviation of a camera's number, where it is written.
pub(super) fn check_camera_sd(key: String, found: Option<f64>, most: f64) -> Result<Option<f64>, JobRefusal> {
    match found {
        Some(sd) if !(0.0..=most).contains(&sd) => {
            refuse(key, format!("found {sd}, expected 0 (held) to {most}"))
        }
        found => Ok(found),
    }
}
