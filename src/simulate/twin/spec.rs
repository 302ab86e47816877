//! Specification of a twin: the file as written, and the validated values.

use super::{Camera, TrackingModel};
use crate::simulate::scene::Scene;
use crate::toml_file::{self, TomlError};
use schemars::JsonSchema;
use serde::Deserialize;

/// Why a specification was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TwinSpecError {
    /// The file is not TOML, or not in this format.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// A value is out of range.
    #[error("{file}: key `{key}`: found {found}, expected {expected}; correct the value")]
    Value {
        /// File as named by the user.
        file: String,
        /// Table and key.
        key: &'static str,
        /// Value that was found in the file.
        found: String,
        /// What was expected.
        expected: String,
    },
}

/// A validated specification of a twin.
#[derive(Debug, Clone, PartialEq)]
pub struct TwinSpec {
    /// Title of pages and figures.
    pub title: String,
    /// Path of the scene, relative to the specification.
    pub scene: String,
    /// Frame rate and exposure.
    pub camera: Camera,
    /// Scale, noise and dropouts.
    pub tracking: TrackingModel,
    /// Part of the scene's time that is recorded, s; `None` for the whole run.
    pub window_s: Option<[f64; 2]>,
    /// Whether a table in the layout of Tracker is written too.
    pub tracker_export: bool,
}

/// A synthetic recording: a scene filmed by a camera.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct TwinFile {
    /// Version of the format: 1.
    format: u32,
    /// Title for pages and figures.
    title: String,
    /// Scene that is filmed; relative to this file.
    scene: String,
    /// Seed of the random numbers for noise and lost frames, a whole number.
    seed: u64,
    /// The camera and the errors of tracking.
    camera: TwinCameraFile,
    /// Part of the run that is recorded; the whole run if left out.
    window: Option<TwinWindowFile>,
    /// Export in the layout of a tracking program that is written too; none if left out.
    export: Option<TwinExportFile>,
    /// Written by the program into the specification that accompanies a twin; not read back.
    #[allow(dead_code)]
    #[schemars(with = "Option<serde_json::Map<String, serde_json::Value>>")]
    truth: Option<toml::Table>,
}

/// A camera and the errors that tracking adds.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct TwinCameraFile {
    /// Frames per second, 1/s.
    frame_rate_hz: f64,
    /// Time for which the shutter is open, s; 0 if left out.
    #[serde(default)]
    exposure_s: f64,
    /// Length that a pixel shows, m.
    metres_per_pixel: f64,
    /// Standard deviation of a tracked coordinate, pixels; 0 if left out.
    #[serde(default)]
    noise_px: f64,
    /// Fraction of the frames in which a point is lost; 0 if left out.
    #[serde(default)]
    dropout_fraction: f64,
}

/// Part of a run.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct TwinWindowFile {
    /// Start of the part, s.
    start_s: f64,
    /// End of the part, s.
    stop_s: f64,
}

/// An export of a tracking program.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct TwinExportFile {
    /// Tracking program whose layout the export has.
    #[allow(dead_code)]
    layout: ExportLayout,
}

#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum ExportLayout {
    Tracker,
}

/// Maximum number of frames of a twin: 200 s at 10,000 frames/s, half a gigabyte. A mistyped rate must not
/// fill the memory.
const MOST_FRAMES: f64 = 2e6;

impl TwinSpec {
    /// JSON Schema of twin.toml, for editors and messages.
    #[must_use]
    pub fn schema() -> serde_json::Value {
        toml_file::schema_of::<TwinFile>()
    }

    /// Reads and validates a specification; error messages name the specification `file`.
    ///
    /// # Errors
    /// [`TwinSpecError`] with file, key, finding and admissible values.
    pub fn parse(file: &str, text: &str) -> Result<Self, TwinSpecError> {
        let written: TwinFile = toml_file::parse_toml(file, text)?;
        toml_file::check_format(file, written.format)?;
        let TwinCameraFile { frame_rate_hz, exposure_s, metres_per_pixel, noise_px, dropout_fraction } =
            written.camera;
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let is_shutter = (0.0..=1.0 / frame_rate_hz).contains(&exposure_s);
        let is_noise = noise_px.is_finite() && noise_px >= 0.0;
        let is_fraction = (0.0..1.0).contains(&dropout_fraction);
        let rules = [
            ("camera.frame_rate_hz", frame_rate_hz, positive(frame_rate_hz), "a number above 0"),
            ("camera.exposure_s", exposure_s, is_shutter, "0 to the time between frames"),
            ("camera.metres_per_pixel", metres_per_pixel, positive(metres_per_pixel), "a number above 0"),
            ("camera.noise_px", noise_px, is_noise, "a number of 0 or more"),
            ("camera.dropout_fraction", dropout_fraction, is_fraction, "a number from 0 to below 1"),
        ];
        if let Some((key, found, _, expected)) = rules.into_iter().find(|(_, _, holds, _)| !holds) {
            return Err(value_error(file, key, found, expected));
        }
        let window_s = written.window.map(|w| [w.start_s, w.stop_s]);
        let refused = |&[start, stop]: &[f64; 2]| !(start.is_finite() && stop.is_finite() && start < stop);
        if let Some([start, stop]) = window_s.filter(refused) {
            return Err(value_error(file, "window", format!("{start} to {stop}"), "a start before the stop"));
        }
        Ok(Self {
            title: written.title,
            scene: written.scene,
            camera: Camera { frame_rate_hz, exposure_s },
            tracking: TrackingModel { metres_per_pixel, noise_px, dropout_fraction, seed: written.seed },
            window_s,
            tracker_export: written.export.is_some(),
        })
    }

    /// Part of the scene's time that is recorded, s.
    ///
    /// # Errors
    /// [`TwinSpecError::Value`] if the window is not within the scene's run or has too few or too many
    /// frames.
    pub(crate) fn window_within(&self, file: &str, scene: &Scene) -> Result<[f64; 2], TwinSpecError> {
        let [start, stop] = self.window_s.unwrap_or([scene.start_s, scene.run.stop_s]);
        if start < scene.start_s || stop > scene.run.stop_s {
            let expected = format!("a window within the scene's {} to {} s", scene.start_s, scene.run.stop_s);
            return Err(value_error(file, "window", format!("{start} to {stop}"), &expected));
        }
        let frames = (stop - start) * self.camera.frame_rate_hz;
        if !(1.0..=MOST_FRAMES).contains(&frames) {
            let (found, expected) =
                (format!("{frames:e} frames in the window"), format!("2 to {MOST_FRAMES:e}"));
            return Err(value_error(file, "camera.frame_rate_hz", found, &expected));
        }
        Ok([start, stop])
    }
}

fn value_error(file: &str, key: &'static str, found: impl ToString, expected: &str) -> TwinSpecError {
    let [file, expected] = [file, expected].map(str::to_owned);
    TwinSpecError::Value { file, key, found: found.to_string(), expected }
}
