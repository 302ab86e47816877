//! `recording.toml`: the source of a recording, the camera, and the measured quality.

use super::{DESCRIPTION_FILE, FilesError, VideoEntry};
use crate::recording::quality::{Optics, Quality, QualityFinding};
use crate::text::{format_degrees, text_sha256};
use crate::toml_file::{self, FORMAT};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where a recording comes from, how it was taken, and what was measured on it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecordingFile {
    /// Version of the format.
    pub format: u32,
    /// Whether no camera took the recording: it is a simulation or a twin.
    #[serde(default)]
    pub synthetic: bool,
    /// SHA-256 of `trace.csv`, without byte-order mark and with line feeds. A trace is not verified if this
    /// is absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trace_sha256: Option<String>,
    /// The export that was imported; absent for a twin that was never exported.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<SourceEntry>,
    /// How the recording was taken.
    pub camera: CameraEntry,
    /// How the tilt of the camera was measured and removed; absent if the traces were left as in the export.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<LevelEntry>,
    /// Quality that was measured when this file was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quality: Option<Quality>,
    /// Any notes of the user on the test: glass, speed, humidity.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub conditions: toml::Table,
    /// Pictures of the frames, for figures; absent if there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub video: Option<VideoEntry>,
    /// The whole specification of a twin.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<serde_json::Map<String, serde_json::Value>>")]
    pub twin: Option<toml::Table>,
}

/// `[source]`: the export as it lies in the folder. Several files are listed in the same order in `file` and
/// `sha256`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SourceEntry {
    /// Name of the file in the folder.
    pub file: OneOrMany,
    /// SHA-256 of the bytes of the file, hexadecimal.
    pub sha256: OneOrMany,
    /// Format as which the file was read.
    pub detected_format: String,
    /// Text encoding with which the file was read.
    pub encoding: String,
    /// Findings that only the export could show: on its times, its rejected positions and its filters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<QualityFinding>,
}

/// One text or a list of them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum OneOrMany {
    /// A single text.
    One(String),
    /// Several texts, in order.
    Many(Vec<String>),
}

impl OneOrMany {
    /// All texts, in order.
    #[must_use]
    pub fn as_slice(&self) -> &[String] {
        match self {
            Self::One(one) => std::slice::from_ref(one),
            Self::Many(many) => many,
        }
    }
}

impl From<Vec<String>> for OneOrMany {
    fn from(mut many: Vec<String>) -> Self {
        match many.len() {
            1 => Self::One(many.swap_remove(0)),
            _ => Self::Many(many),
        }
    }
}

/// `[camera]`: how the recording was taken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraEntry {
    /// Recording rate, 1/s (not the playback rate); the mean rate if `clock` is "times".
    pub frame_rate_hz: f64,
    /// Standard deviation of the recording rate, 1/s; it is part of the standard deviation of every
    /// frequency.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_rate_sd_hz: Option<f64>,
    /// Whether the frames lie on a grid of `frame_rate_hz` ("grid", also if absent) or at the times in
    /// `trace.csv` ("times").
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clock: Option<FrameClock>,
    /// Exposure of a frame, s, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_s: Option<f64>,
    /// Length that a pixel shows, m; absent if the export was already in a length unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metres_per_pixel: Option<f64>,
    /// Direction of y in the export; in `trace.csv`, y always points up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_axis: Option<YAxis>,
}

impl From<&CameraEntry> for Optics {
    fn from(camera: &CameraEntry) -> Self {
        Self { exposure_s: camera.exposure_s, metres_per_pixel: camera.metres_per_pixel }
    }
}

/// When the frames were taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FrameClock {
    /// At a constant rate; `trace.csv` may lack rows.
    Grid,
    /// At the times in `trace.csv`, which follow no constant rate.
    Times,
}

/// `[level]`: the tilt of the camera that `import --level` found. If `applied` is true, the traces in
/// `trace.csv` are those of the export, rotated clockwise by `angle_rad` about the centre.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LevelEntry {
    /// Whether both tracks were rotated; a tilt that is not clear is not corrected.
    pub applied: bool,
    /// Angle from the x axis to the glass, rad; positive if the glass rose towards positive x.
    pub angle_rad: f64,
    /// Standard deviation of the angle, rad.
    pub sd_rad: f64,
    /// Position of the centre of rotation along the sweep, m; the rotation leaves this point in place.
    pub centre_x_m: f64,
    /// Height of the centre of rotation, m.
    pub centre_y_m: f64,
    /// Number of frames with the tip on the glass, from which the angle was found.
    pub frames: usize,
    /// Curvature of the glass in the picture, 1/m, if it is clear.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub curvature_per_m: Option<f64>,
}

impl LevelEntry {
    /// Description of the rotation in words.
    pub(crate) fn describe(&self) -> String {
        let angle = format_degrees(self.angle_rad, self.sd_rad);
        if !self.applied {
            return format!(
                "a slope of the glass of {angle} along x is not clear of its standard deviation, or \
                 too small to matter: the tracks are as in the export"
            );
        }
        let [x, y] = [self.centre_x_m, self.centre_y_m].map(|place| 1e3 * place);
        format!(
            "the glass was inclined by {angle} along x: both tracks are turned back by this angle about x = \
             {x:.3} mm, y = {y:.3} mm"
        )
    }

    fn named_numbers(&self) -> [(&'static str, f64); 4] {
        let centre = [("centre_x_m", self.centre_x_m), ("centre_y_m", self.centre_y_m)];
        [("angle_rad", self.angle_rad), ("sd_rad", self.sd_rad), centre[0], centre[1]]
    }
}

/// Direction in which y increases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum YAxis {
    /// Upwards, as in world coordinates.
    Up,
    /// Downwards, as in image coordinates.
    Down,
}

impl RecordingFile {
    /// JSON Schema of recording.toml, for editors and messages.
    #[must_use]
    pub fn schema() -> serde_json::Value {
        toml_file::schema_of::<Self>()
    }

    /// A description in the present format that has only the camera.
    pub(crate) fn new(camera: CameraEntry, synthetic: bool) -> Self {
        Self {
            format: FORMAT,
            synthetic,
            trace_sha256: None,
            source: None,
            camera,
            level: None,
            quality: None,
            conditions: toml::Table::new(),
            video: None,
            twin: None,
        }
    }

    /// Reads the text of a `recording.toml`; `file` is the name used in refusals.
    ///
    /// # Errors
    /// [`FilesError`] with file, line and key.
    pub fn parse(file: &str, text: &str) -> Result<Self, FilesError> {
        let parsed: Self = toml_file::parse_toml(file, text)?;
        toml_file::check_format(file, parsed.format)?;
        let camera = &parsed.camera;
        let lengths = [
            ("frame_rate_hz", Some(camera.frame_rate_hz)),
            ("frame_rate_sd_hz", camera.frame_rate_sd_hz),
            ("exposure_s", camera.exposure_s),
            ("metres_per_pixel", camera.metres_per_pixel),
        ];
        for (key, value) in lengths {
            if let Some(found) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
                let problem =
                    format!(": key `camera.{key}`: found {found}, expected a finite number above 0");
                return Err(FilesError::refuse(file, problem));
            }
        }
        if let Some(video) = &parsed.video {
            video.pixel_mapping(file, camera, parsed.level.as_ref())?;
        }
        let mut level = parsed.level.iter().flat_map(LevelEntry::named_numbers);
        match level.find(|(_, value)| !value.is_finite()) {
            None => Ok(parsed),
            Some((key, found)) => {
                let expected = "expected a finite number; import the recording again";
                let problem = format!(": key `level.{key}`: found {found}, {expected}");
                Err(FilesError::refuse(file, problem))
            }
        }
    }

    /// Refuses a trace whose hash differs from the hash in the description; `file` is the name of the trace
    /// in the refusal. A description without a hash accepts any trace.
    ///
    /// # Errors
    /// [`FilesError`] with the first digits of both hashes.
    pub(crate) fn check_trace(&self, file: &str, trace: &str) -> Result<(), FilesError> {
        let Some(expected) = &self.trace_sha256 else { return Ok(()) };
        let found = text_sha256(trace);
        if found == *expected {
            return Ok(());
        }
        let [found, expected] = [&found, expected].map(|hash| hash.chars().take(12).collect::<String>());
        let problem = format!(
            ": found SHA-256 {found}..., expected {expected}... as the {DESCRIPTION_FILE} next to it says: \
             one of the two was changed or replaced; import the export again with --force or, where the \
             change of the trace is intended, copy it alone into a folder of its own"
        );
        Err(FilesError::refuse(file, problem))
    }

    /// The text of the file.
    ///
    /// # Errors
    /// [`FilesError`] when a value has no TOML form.
    pub fn to_toml(&self) -> Result<String, FilesError> {
        let advice = "shorten or remove the value under [conditions] or [twin]";
        let refuse =
            |error| FilesError::refuse(DESCRIPTION_FILE, format!(" cannot be written: {error}; {advice}"));
        toml::to_string(self).map_err(refuse)
    }
}
