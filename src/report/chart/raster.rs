//! Values as coloured pixels: the colour map, and a picture as a data URI. The only file that names png and base64.

use super::canvas::Rgb;
use super::path::Area;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use png::{BitDepth, ColorType, Compression, Encoder, Filter};

/// Every tenth of viridis (S. van der Walt and N. Smith, matplotlib 2.0, CC0): even steps to the eye, readable for the colour-blind and in grey.
const VIRIDIS: [Rgb; 11] = [
    (0x44, 0x01, 0x54),
    (0x48, 0x25, 0x76),
    (0x41, 0x44, 0x87),
    (0x35, 0x60, 0x8D),
    (0x2A, 0x78, 0x8E),
    (0x21, 0x90, 0x8C),
    (0x22, 0xA8, 0x84),
    (0x43, 0xBF, 0x71),
    (0x7A, 0xD1, 0x51),
    (0xBB, 0xDF, 0x27),
    (0xFD, 0xE7, 0x25),
];
/// Where there is no value: a grey that viridis does not hold.
pub(super) const NO_VALUE: Rgb = (0xE4, 0xE4, 0xE4);
/// Colours of a picture: steps that the eye does not see, in few bytes.
const STEPS: u8 = 128;

/// Colour of a share from 0 to 1; beyond, that of the nearer end.
pub(super) fn viridis(share: f64) -> Rgb {
    let place = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let below = (place as usize).min(VIRIDIS.len() - 2);
    let (a, b, rest) = (VIRIDIS[below], VIRIDIS[below + 1], place - below as f64);
    let between = |a: u8, b: u8| (f64::from(a) + rest * (f64::from(b) - f64::from(a))).round() as u8;
    (between(a.0, b.0), between(a.1, b.1), between(a.2, b.2))
}

/// A picture of shares from 0 to 1 (`None` without a value), row by row from the top.
pub(super) struct Picture {
    pub width: u32,
    pub height: u32,
    pub shares: Vec<Option<f64>>,
}

impl Picture {
    /// The picture stretched over an area, as an SVG element.
    pub fn element(&self, area: &Area) -> Option<String> {
        let data = STANDARD.encode(self.png()?);
        let (x, y, width, height) = (area.left, area.top, area.right - area.left, area.bottom - area.top);
        let size = format!("x=\"{x:.0}\" y=\"{y:.0}\" width=\"{width:.0}\" height=\"{height:.0}\"");
        Some(format!("<image {size} preserveAspectRatio=\"none\" image-rendering=\"optimizeSpeed\" href=\"data:image/png;base64,{data}\"/>\n"))
    }

    /// The picture as PNG with a palette, whose first colour stands for no value; `None` when it has no pixels.
    fn png(&self) -> Option<Vec<u8>> {
        let last = f64::from(STEPS - 1);
        let index = |share: &Option<f64>| share.map_or(0, |s| 1 + (s.clamp(0.0, 1.0) * last).round() as u8);
        let pixels: Vec<u8> = self.shares.iter().map(index).collect();
        let colours = std::iter::once(NO_VALUE).chain((0..STEPS).map(|i| viridis(f64::from(i) / last)));
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(ColorType::Indexed);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_palette(colours.flat_map(|(r, g, b)| [r, g, b]).collect::<Vec<u8>>());
        encoder.set_compression(Compression::High);
        encoder.set_filter(Filter::NoFilter); // neighbours in a palette are no neighbours in bytes worth a difference
        let mut writer = encoder.write_header().ok()?;
        writer.write_image_data(&pixels).ok()?;
        writer.finish().ok()?;
        Some(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colours_run_from_purple_to_yellow_and_stay_within() {
        assert_eq!([0.0, 0.1, 1.0, -3.0, 7.0].map(viridis), [VIRIDIS[0], VIRIDIS[1], VIRIDIS[10], VIRIDIS[0], VIRIDIS[10]]);
        assert_eq!(viridis(0.55), (0x22, 0x9C, 0x88)); // half way from 0x21908C to 0x22A884
    }

    #[test]
    fn a_picture_without_pixels_is_none() {
        assert!(Picture { width: 0, height: 0, shares: Vec::new() }.element(&Area { left: 0.0, top: 0.0, right: 1.0, bottom: 1.0 }).is_none());
    }
}
