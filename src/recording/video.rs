//! Pictures of the video from which a recording was tracked, and the pixel of a tracked point in these
//! pictures.

use super::files::{CameraEntry, FilesError, LevelEntry};
use crate::toml_file::NumberPair;
use png::{BitDepth, ColorType, Compression, Decoder, Encoder, Limits, Transformations};
use portable_math as math;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io::Cursor;

/// Maximum memory for a picture, bytes: 60 million pixels in four channels.
const MOST_BYTES: usize = 256 << 20;
/// Number of grey levels of a picture in a figure: a pixel then needs half a byte, and four pictures fit on a
/// page.
const GREYS: u16 = 16;
/// Maximum number of samples of the original picture along either side of a pixel of a figure.
const MOST_SAMPLES: f64 = 8.0;

/// Why a picture cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The file is not a PNG, or it is damaged.
    #[error("found no readable PNG picture ({0}), expected one; save the frames of the video as PNG")]
    Png(#[from] png::DecodingError),
    /// The picture needs too much memory.
    #[error(
        "found a picture of {width} x {height} pixels, expected at most 60 million; save the frames smaller"
    )]
    Large {
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
    },
}

/// A greyscale picture, row by row from the upper left corner, 0 for black.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Grey levels of the pixels.
    pub grey: Vec<u8>,
}

impl Picture {
    /// Reads a PNG of any kind; transparent pixels are shown on white.
    ///
    /// # Errors
    /// [`PictureError`] if the file is not a PNG, is damaged or is too large.
    pub fn from_png(png: &[u8]) -> Result<Self, PictureError> {
        let mut decoder = Decoder::new_with_limits(Cursor::new(png), Limits { bytes: MOST_BYTES });
        decoder.set_transformations(Transformations::normalize_to_color8());
        let mut reader = decoder.read_info()?;
        let (width, height) = reader.info().size();
        let bytes = reader.output_buffer_size().filter(|bytes| *bytes <= MOST_BYTES);
        let bytes = bytes.ok_or(PictureError::Large { width, height })?;
        let mut values = vec![0; bytes];
        let frame = reader.next_frame(&mut values)?;
        values.truncate(frame.buffer_size());
        let grey = values.chunks_exact(frame.color_type.samples()).map(grey_on_white).collect();
        Ok(Self { width: frame.width as usize, height: frame.height as usize, grey })
    }

    /// The picture as a PNG with 16 grey levels.
    ///
    /// # Errors
    /// [`png::EncodingError`] for a picture without pixels.
    pub fn to_png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(ColorType::Grayscale);
        encoder.set_depth(BitDepth::Four);
        encoder.set_compression(Compression::High);
        let mut writer = encoder.write_header()?;
        let step = |grey: u8| ((u16::from(grey) * (GREYS - 1) + 127) / 255) as u8;
        let pack = |pair: &[u8]| step(pair[0]) << 4 | pair.get(1).map_or(0, |grey| step(*grey));
        let rows = self.grey.chunks(self.width.max(1));
        let rows: Vec<u8> = rows.flat_map(|row| row.chunks(2).map(pack)).collect();
        writer.write_image_data(&rows)?;
        writer.finish()?;
        Ok(bytes)
    }

    /// Resamples the picture to `width` x `height` pixels, each the mean over its area. `pixel` maps a point
    /// of the new picture to a point of this picture, both in pixels from the upper left corner. The
    /// surroundings of this picture are white.
    pub(crate) fn resample(&self, width: usize, height: usize, pixel: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        let ([x0, y0], [x1, y1]) = (pixel([0.0, 0.0]), pixel([1.0, 0.0]));
        let samples = math::hypot(x1 - x0, y1 - y0).ceil().clamp(1.0, MOST_SAMPLES) as usize;
        let samples = samples.max(1); // (NaN becomes 0)
        let part = |at: usize, k: usize| at as f64 + (k as f64 + 0.5) / samples as f64;
        let point = |at: usize| {
            let (row, column) = (at / width, at % width);
            let of = |k: usize| pixel([part(column, k % samples), part(row, k / samples)]);
            let sum: u32 = (0..samples * samples).map(|k| u32::from(self.grey_at(of(k)))).sum();
            (sum / (samples * samples) as u32) as u8
        };
        Self { width, height, grey: (0..width * height).map(point).collect() }
    }

    /// Whether a point lies in the picture.
    pub(crate) fn contains_point(&self, [x, y]: [f64; 2]) -> bool {
        (0.0..self.width as f64).contains(&x) && (0.0..self.height as f64).contains(&y)
    }

    fn grey_at(&self, [x, y]: [f64; 2]) -> u8 {
        if !self.contains_point([x, y]) {
            return u8::MAX;
        }
        self.grey.get(y as usize * self.width + x as usize).copied().unwrap_or(u8::MAX)
    }
}

/// Grey level of a pixel with these samples, shown on white (ITU-R BT.601 weights).
fn grey_on_white(samples: &[u8]) -> u8 {
    let (colour, alpha) = match samples {
        [grey] => (u32::from(*grey), 255),
        [grey, alpha] => (u32::from(*grey), u32::from(*alpha)),
        [red, green, blue, rest @ ..] => {
            let weighted = 299 * u32::from(*red) + 587 * u32::from(*green) + 114 * u32::from(*blue);
            ((weighted + 500) / 1000, rest.first().map_or(255, |alpha| u32::from(*alpha)))
        }
        [] => (255, 255),
    };
    ((colour * alpha + 255 * (255 - alpha) + 127) / 255) as u8
}

/// Provides pictures of frames.
pub trait PictureSource: Sync {
    /// The picture of a frame, counted from 0; `None` if there is none.
    fn frame_picture(&self, frame: usize) -> Option<Picture>;
}

/// The frames of a recording's video.
#[derive(Clone, Copy)]
pub struct RecordingVideo<'a> {
    /// Mapping of points of the recording to pixels.
    pub mapping: PixelMapping,
    /// Source of the pictures.
    pub pictures: &'a dyn PictureSource,
}

impl std::fmt::Debug for RecordingVideo<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Film").field("place", &self.mapping).finish_non_exhaustive()
    }
}

/// Largest distance of the origin from the corner of the picture, pixels; a larger distance, a thousand
/// pictures or more, is a mistake.
const MOST_PIXELS: f64 = 1e7;
/// Admissible length that a pixel shows, m: from the pixel of a microscope to 1 m, far more than in a view of
/// a wiper.
const LENGTHS_M: std::ops::RangeInclusive<f64> = 1e-9..=1.0;

/// `[video]`: pictures of frames, for figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VideoEntry {
    /// Folder of PNG pictures, one per frame, in the order of their names, or a single PNG; relative to this
    /// file.
    pub frames: String,
    /// Number of the frame that the first picture shows, counted from 0; 0 if left out.
    #[serde(default)]
    pub first_frame: usize,
    /// Pixel at which x and y of the export are 0, counted to the right and down from the upper left corner.
    pub origin_px: NumberPair,
    /// Length that a pixel shows, m; the length in `[camera]` if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metres_per_pixel: Option<f64>,
}

impl VideoEntry {
    /// Mapping from points of a recording with this camera and this rotation to pixels of the pictures.
    ///
    /// # Errors
    /// [`FilesError::Video`] for an impossible number, or if the length of a pixel is missing.
    pub(crate) fn pixel_mapping(
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
        let length = "expected the length that a pixel shows";
        let problem = match self.metres_per_pixel.or(camera.metres_per_pixel) {
            Some(found) if LENGTHS_M.contains(&found) => {
                return Ok(PixelMapping::new(origin_px, found, level));
            }
            Some(found) => format!("found {found:e}, {length}, from 1e-9 to 1 m, as in 2e-5; correct it"),
            None => format!("missing, and [camera] has none; {length}, as in 2e-5; add it"),
        };
        refuse("metres_per_pixel", problem)
    }
}

/// Mapping from a tracked point to its pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelMapping {
    /// Pixel at the origin of the export.
    pub origin_px: [f64; 2],
    /// Length that a pixel shows, m.
    pub metres_per_pixel: f64,
    /// Rotation of the tracks at import: angle, rad, and centre, m.
    rotation: Option<(f64, [f64; 2])>,
}

impl PixelMapping {
    /// Mapping for a recording; `level` is the rotation that was applied at import.
    #[must_use]
    pub fn new(origin_px: [f64; 2], metres_per_pixel: f64, level: Option<&LevelEntry>) -> Self {
        let turned = level.filter(|level| level.applied);
        let rotation = turned.map(|level| (level.angle_rad, [level.centre_x_m, level.centre_y_m]));
        Self { origin_px, metres_per_pixel, rotation }
    }

    /// Pixel of a point of the recording, m; y points up.
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

    fn encoded(colour: ColorType, depth: BitDepth, size: (u32, u32), values: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, size.0, size.1);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if colour == ColorType::Indexed {
            encoder.set_palette(vec![0, 0, 0, 255, 255, 255, 255, 0, 0]);
        }
        encoder.write_header().unwrap().write_image_data(values).unwrap();
        bytes
    }

    fn read(colour: ColorType, depth: BitDepth, size: (u32, u32), values: &[u8]) -> Vec<u8> {
        Picture::from_png(&encoded(colour, depth, size, values)).unwrap().grey
    }

    #[test]
    fn every_kind_of_png_becomes_grey() {
        use {BitDepth::*, ColorType::*};
        assert_eq!(read(Grayscale, Eight, (2, 1), &[0, 200]), [0, 200]);
        assert_eq!(read(Grayscale, One, (3, 1), &[0b1010_0000]), [255, 0, 255]);
        assert_eq!(read(Grayscale, Sixteen, (1, 1), &[0x80, 0xFF]), [0x80]);
        // half-transparent black on white
        assert_eq!(read(GrayscaleAlpha, Eight, (2, 1), &[0, 0, 0, 128]), [255, 127]);
        assert_eq!(read(Rgb, Eight, (3, 1), &[255, 0, 0, 0, 255, 0, 0, 0, 255]), [76, 150, 29]);
        assert_eq!(read(Rgba, Eight, (1, 1), &[0, 0, 0, 0]), [255]);
        assert_eq!(read(Indexed, Eight, (3, 1), &[1, 0, 2]), [255, 0, 76]);
    }

    #[test]
    fn what_is_no_whole_picture_is_refused_and_nothing_panics() {
        let whole = encoded(ColorType::Rgb, BitDepth::Eight, (5, 4), &[7; 60]);
        assert!(Picture::from_png(&whole).is_ok());
        for length in 0..whole.len() - 16 {
            assert!(Picture::from_png(&whole[..length]).is_err(), "{length}");
        }
        for at in 0..whole.len() {
            let mut changed = whole.clone();
            changed[at] ^= 0x55;
            let _ = Picture::from_png(&changed);
        }
    }

    /// The checksum of a chunk of a PNG, bit by bit.
    fn checksum(bytes: &[u8]) -> u32 {
        let step = |sum: u32, _| if sum & 1 == 1 { (sum >> 1) ^ 0xEDB8_8320 } else { sum >> 1 };
        !bytes.iter().fold(!0, |sum, byte| (0..8).fold(sum ^ u32::from(*byte), step))
    }

    #[test]
    fn a_header_of_very_many_pixels_is_refused_before_they_take_memory() {
        let mut bomb = encoded(ColorType::Rgb, BitDepth::Eight, (5, 4), &[7; 60]);
        assert_eq!(checksum(&bomb[12..29]).to_be_bytes(), bomb[29..33], "the checksum of the whole file");
        for side in [20_000_u32, 4_000_000] {
            bomb[16..20].copy_from_slice(&side.to_be_bytes());
            bomb[20..24].copy_from_slice(&side.to_be_bytes());
            let sum = checksum(&bomb[12..29]);
            bomb[29..33].copy_from_slice(&sum.to_be_bytes());
            let refused = Picture::from_png(&bomb).unwrap_err();
            assert!(matches!(refused, PictureError::Large { .. }), "{refused}");
        }
    }

    #[test]
    fn sixteen_greys_come_back_within_half_a_step() {
        let grey: Vec<u8> = (0..=254).step_by(2).map(|grey| grey as u8).collect();
        let picture = Picture { width: 16, height: 8, grey };
        let again = Picture::from_png(&picture.to_png().unwrap()).unwrap();
        assert_eq!((again.width, again.height), (16, 8));
        let apart = picture.grey.iter().zip(&again.grey).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(apart.unwrap() <= 9, "{apart:?}");
        let odd = Picture { width: 3, height: 2, grey: vec![0, 255, 0, 255, 0, 255] };
        assert_eq!(Picture::from_png(&odd.to_png().unwrap()).unwrap(), odd);
    }

    #[test]
    fn a_cut_is_the_mean_of_what_it_shows_and_white_beyond() {
        let picture = Picture { width: 4, height: 2, grey: vec![0, 100, 200, 200, 100, 200, 200, 200] };
        let half = picture.resample(2, 1, |[x, y]| [2.0 * x, 2.0 * y]);
        assert_eq!(half.grey, [100, 200]);
        let beyond = picture.resample(2, 1, |[x, y]| [x - 1.0, y]);
        assert_eq!(beyond.grey, [255, 0]);
    }

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
        // the tracks were rotated clockwise: a point above the centre has moved to the right of it
        let [x, y] = PixelMapping::new([100.0, 50.0], 1e-3, Some(&level)).to_pixel([0.02, 0.0]);
        assert!((x - 110.0).abs() < 1e-9 && (y - 40.0).abs() < 1e-9, "{x} {y}");
        let unused = LevelEntry { applied: false, ..level };
        assert_eq!(PixelMapping::new([100.0, 50.0], 1e-3, Some(&unused)), plain);
    }
}
