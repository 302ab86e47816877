//! `[video]` of `recording.toml`: pictures of the frames.

use super::FilesError;
use crate::toml_file::Pair;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Most pixels between the picture and the origin: an origin a thousand pictures away is a slip.
const MOST_PIXELS: f64 = 1e7;
/// Lengths that a pixel may show, m: from those of a microscope to those of no camera on a wiper.
const LENGTHS_M: std::ops::RangeInclusive<f64> = 1e-9..=1.0;

/// `[video]`: pictures of frames, for figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VideoEntry {
    /// Folder of PNG pictures, a frame each, in the order of their names, or a single PNG; from the folder of
    /// the recording.
    pub frames: String,
    /// Number of the frame that the first picture shows, counted from 0; 0 if left out.
    #[serde(default)]
    pub first_frame: usize,
    /// Pixel at which x and y of the export are 0: to the right and down from the upper left corner.
    pub origin_px: Pair,
    /// Length that a pixel shows, m; that of the camera if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres_per_pixel: Option<f64>,
}

impl VideoEntry {
    /// Length that a pixel shows, m, where `camera` is what the camera has.
    ///
    /// # Errors
    /// [`FilesError::Video`] where neither has one, or a number is none that a picture has.
    pub fn metres_per_pixel(&self, file: &str, camera: Option<f64>) -> Result<f64, FilesError> {
        let refuse = |key, problem: String| Err(FilesError::Video { file: file.to_owned(), key, problem });
        let Pair(origin_px) = self.origin_px;
        if !origin_px.iter().all(|px| px.abs() <= MOST_PIXELS) {
            let expected = "two numbers of pixels up to ten million, as in [0.0, 512.0]";
            return refuse("origin_px", format!("found {origin_px:?}, expected {expected}; correct them"));
        }
        match self.metres_per_pixel.or(camera) {
            Some(length_m) if LENGTHS_M.contains(&length_m) => Ok(length_m),
            Some(found) => {
                let expected = "the length that a pixel shows, from 1e-9 to 1 m";
                refuse(
                    "metres_per_pixel",
                    format!("found {found:e}, expected {expected}, as in 2e-5; correct it"),
                )
            }
            None => refuse(
                "metres_per_pixel",
                "missing, and [camera] has none; expected the length that a pixel shows, as in 2e-5; add it"
                    .to_owned(),
            ),
        }
    }
}
