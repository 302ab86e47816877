//! The frames of the video from which a recording was tracked: which picture shows which frame, and where a
//! tracked point lies in it.

use super::files::PixelMapping;
use crate::math;
use png::{BitDepth, ColorType, Compression, Decoder, Encoder, Limits, Transformations};
use std::io::Cursor;

/// Most memory for a picture, bytes: 60 million pixels in four channels.
const MOST_BYTES: usize = 256 << 20;
/// Greys of a picture in a figure: as many as fit half a byte, so that four pictures leave room on a page.
const GREYS: u16 = 16;
/// Most samples of the picture across a point of a figure, along either axis.
const MOST_SAMPLES: f64 = 8.0;

/// Why a picture cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// It is no PNG, or not whole.
    #[error("found no readable PNG picture ({0}), expected one; save the frames of the video as PNG")]
    Png(#[from] png::DecodingError),
    /// It takes too much memory.
    #[error(
        "found a picture of {width} x {height} pixels, expected at most 60 million; save the frames smaller"
    )]
    Large {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
    },
}

/// A picture in greys, row by row from the upper left corner, 0 for black.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Their greys.
    pub grey: Vec<u8>,
}

impl Picture {
    /// Reads a PNG of any kind; transparent pixels lie on white.
    ///
    /// # Errors
    /// [`PictureError`] where it is none, is not whole or is too large.
    pub fn from_png(png: &[u8]) -> Result<Self, PictureError> {
        let mut decoder = Decoder::new_with_limits(Cursor::new(png), Limits { bytes: MOST_BYTES });
        decoder.set_transformations(Transformations::normalize_to_color8());
        let mut reader = decoder.read_info()?;
        let (width, height) = reader.info().size();
        let large = PictureError::Large { width, height };
        let Some(bytes) = reader.output_buffer_size().filter(|bytes| *bytes <= MOST_BYTES) else {
            return Err(large);
        };
        let mut values = vec![0; bytes];
        let frame = reader.next_frame(&mut values)?;
        values.truncate(frame.buffer_size());
        let grey = values.chunks_exact(frame.color_type.samples()).map(grey_on_white).collect();
        Ok(Self { width: frame.width as usize, height: frame.height as usize, grey })
    }

    /// The picture as a PNG of a few greys.
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
        let row = |row: &[u8]| {
            let pairs =
                row.chunks(2).map(|pair| step(pair[0]) << 4 | pair.get(1).map_or(0, |grey| step(*grey)));
            pairs.collect::<Vec<u8>>()
        };
        let rows: Vec<u8> = self.grey.chunks(self.width.max(1)).flat_map(row).collect();
        writer.write_image_data(&rows)?;
        writer.finish()?;
        Ok(bytes)
    }

    /// A picture of `width` x `height` points, each the mean of what lies within it; `pixel` gives the place
    /// in this picture of a place in that one, both in pixels from the upper left corner. White where there
    /// is nothing.
    #[must_use]
    pub fn resample(&self, width: usize, height: usize, pixel: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        let ([x0, y0], [x1, y1]) = (pixel([0.0, 0.0]), pixel([1.0, 0.0]));
        let samples = math::hypot(x1 - x0, y1 - y0).ceil().clamp(1.0, MOST_SAMPLES) as usize;
        let samples = samples.max(1); // (of places that are no numbers)
        let part = |at: usize, k: usize| at as f64 + (k as f64 + 0.5) / samples as f64;
        let point = |at: usize| {
            let (row, column) = (at / width, at % width);
            let of = |k: usize| pixel([part(column, k % samples), part(row, k / samples)]);
            let sum: u32 = (0..samples * samples).map(|k| u32::from(self.grey_at(of(k)))).sum();
            (sum / (samples * samples) as u32) as u8
        };
        Self { width, height, grey: (0..width * height).map(point).collect() }
    }

    /// Whether a place lies in the picture.
    #[must_use]
    pub fn contains_point(&self, [x, y]: [f64; 2]) -> bool {
        (0.0..self.width as f64).contains(&x) && (0.0..self.height as f64).contains(&y)
    }

    fn grey_at(&self, [x, y]: [f64; 2]) -> u8 {
        if !self.contains_point([x, y]) {
            return u8::MAX;
        }
        self.grey.get(y as usize * self.width + x as usize).copied().unwrap_or(u8::MAX)
    }
}

/// Grey of the samples of a pixel, on white (ITU-R BT.601 weights).
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

/// Gives pictures of frames.
pub trait PictureSource: Sync {
    /// The picture of a frame, counted from 0, where there is one.
    fn frame_picture(&self, frame: usize) -> Option<Picture>;
}

/// The frames of a recording's video.
#[derive(Clone, Copy)]
pub struct RecordingVideo<'a> {
    /// Where points lie in them.
    pub mapping: PixelMapping,
    /// The pictures.
    pub pictures: &'a dyn PictureSource,
}

impl std::fmt::Debug for RecordingVideo<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Film").field("place", &self.mapping).finish_non_exhaustive()
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
        // half transparent black on white
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
}
