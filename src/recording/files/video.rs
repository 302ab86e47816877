//! `[video]` of `recording.toml`: pictures of the frames.

use super::{CameraEntry, FilesError, LevelEntry};
use crate::math;
use crate::toml_file::NumberPair;
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
    /// Folder of PNG pictures, a frame each, in the order of their names, or a single PNG; relative to
    /// this file.
    pub frames: String,
    /// Number of the frame that the first picture shows, counted from 0; 0 if left out.
    #[serde(default)]
    pub first_frame: usize,
    /// Pixel at which x and y of the export are 0: to the right and down from the upper left corner.
    pub origin_px: NumberPair,
    /// Length that a pixel shows, m; that of the camera if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres_per_pixel: Option<f64>,
}

impl VideoEntry {
    /// Where points of a recording with this camera, which may have been levelled, lie in the pictures.
    ///
    /// # Errors
    /// [`FilesError::Video`] for a number that no picture has, or without the length of a pixel.
    pub fn pixel_mapping(
        &self,
        file: &str,
        camera: &CameraEntry,
        level: Option<&LevelEntry>,
    ) -> Result<PixelMapping, FilesError> {
        let refuse = |key, problem: String| Err(FilesError::Video { file: file.to_owned(), key, problem });
        let NumberPair(origin_px) = self.origin_px;
        if !origin_px.iter().all(|px| px.abs() <= MOST_PIXELS) {
            let expected = "two numbers of pixels up to ten million, as in [0.0, 512.0]";
            return refuse("origin_px", format!("found {origin_px:?}, expected {expected}; correct them"));
        }
        match self.metres_per_pixel.or(camera.metres_per_pixel) {
            Some(length_m) if LENGTHS_M.contains(&length_m) => {
                Ok(PixelMapping::new(origin_px, length_m, level))
            }
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

/// Where a tracked point lies in the pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelMapping {
    /// Pixel of the export's origin.
    pub origin_px: [f64; 2],
    /// Length that a pixel shows, m.
    pub metres_per_pixel: f64,
    /// Turn of the tracks since the export: angle, rad, and its centre, m.
    rotation: Option<(f64, [f64; 2])>,
}

impl PixelMapping {
    /// The place of a recording whose tracks may have been levelled.
    #[must_use]
    pub fn new(origin_px: [f64; 2], metres_per_pixel: f64, level: Option<&LevelEntry>) -> Self {
        let turned = level.filter(|level| level.applied);
        let rotation = turned.map(|level| (level.angle_rad, [level.centre_x_m, level.centre_y_m]));
        Self { origin_px, metres_per_pixel, rotation }
    }

    /// Pixel of a point of the recording, m, y upwards.
    #[must_use]
    pub fn to_pixel(&self, [x_m, y_m]: [f64; 2]) -> [f64; 2] {
        let [x_m, y_m] = match self.rotation {
            None => [x_m, y_m],
            Some((angle_rad, [cx_m, cy_m])) => {
                let (sin, cos) = math::sin_cos(angle_rad);
                let (dx, dy) = (x_m - cx_m, y_m - cy_m);
                [cx_m + cos * dx - sin * dy, cy_m + sin * dx + cos * dy]
            }
        };
        [self.origin_px[0] + x_m / self.metres_per_pixel, self.origin_px[1] - y_m / self.metres_per_pixel]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_levelled_point_lies_where_the_export_had_it() {
        let plain = PixelMapping::new([100.0, 50.0], 1e-3, None);
        assert_eq!(plain.to_pixel([0.01, 0.02]), [110.0, 30.0]);
        let level = LevelEntry {
            applied: true,
            angle_rad: std::f64::consts::FRAC_PI_2,
            sd_rad: 0.0,
            centre_x_m: 0.01,
            centre_y_m: 0.0,
            frames: 1,
            curvature_per_m: None,
        };
        // turned clockwise, a point above the centre came to lie to its right
        let [x, y] = PixelMapping::new([100.0, 50.0], 1e-3, Some(&level)).to_pixel([0.02, 0.0]);
        assert!((x - 110.0).abs() < 1e-9 && (y - 40.0).abs() < 1e-9, "{x} {y}");
        let unused = LevelEntry { applied: false, ..level };
        assert_eq!(PixelMapping::new([100.0, 50.0], 1e-3, Some(&unused)), plain);
    }
}
