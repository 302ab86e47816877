//! Colours as numbers: those that figures share, and those of heat maps.

use crate::math;

/// Red, green and blue, 0 to 255.
pub(super) type Rgb = (u8, u8, u8);
pub(super) const WHITE: Rgb = (255, 255, 255);
pub(super) const BLACK: Rgb = (0, 0, 0);
pub(super) const GRID: Rgb = (0xDD, 0xDD, 0xDD);
pub(super) const FRAME: Rgb = (0x33, 0x33, 0x33);
/// Near white and near black, which are the same in the light and the dark.
pub(super) const NEAR_WHITE: Rgb = (0xFE, 0xFE, 0xFE);
const NEAR_BLACK: Rgb = (0x01, 0x01, 0x01);

/// As SVG writes it.
pub(super) fn format_hex((red, green, blue): Rgb) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}

/// Colours of a heat map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColourMap {
    /// Viridis: from little to much.
    #[default]
    Viridis,
    /// From blue over white to vermilion: below and above a middle.
    Diverging,
}

/// Every tenth of viridis (S. van der Walt and N. Smith, matplotlib 2.0, CC0): even steps to the eye,
/// readable for the colour-blind and in grey.
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
/// Blue over near white to vermilion: distinct for the colour-blind, the middle by its lightness. The ends
/// lie next to the colours of lines, which are others on a dark ground.
const DIVERGING: [Rgb; 5] =
    [(0x00, 0x72, 0xB1), (0x80, 0xB8, 0xD8), (0xF7, 0xF7, 0xF5), (0xEA, 0xAE, 0x80), (0xD5, 0x5E, 0x01)];
/// Where there is no value: a grey that neither map holds.
pub(super) const NO_VALUE: Rgb = (0xE4, 0xE4, 0xE4);

/// Colour of a share from 0 to 1; beyond, that of the nearer end.
pub(super) fn sample_colour_map(map: ColourMap, share: f64) -> Rgb {
    let stops: &[Rgb] = match map {
        ColourMap::Viridis => &VIRIDIS,
        ColourMap::Diverging => &DIVERGING,
    };
    let place = share.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let below = (place as usize).min(stops.len() - 2);
    let (a, b, rest) = (stops[below], stops[below + 1], place - below as f64);
    let between = |a: u8, b: u8| (f64::from(a) + rest * (f64::from(b) - f64::from(a))).round() as u8;
    (between(a.0, b.0), between(a.1, b.1), between(a.2, b.2))
}

/// Relative luminance, 0 to 1 (WCAG 2.2, with its curve as a power of 2.2).
fn luminance((red, green, blue): Rgb) -> f64 {
    let linear = |part: u8| math::powf(f64::from(part) / 255.0, 2.2);
    0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue)
}

/// Contrast ratio of two colours, from 1 to 21 (WCAG 2.2).
#[cfg(test)]
pub(super) fn contrast(a: Rgb, b: Rgb) -> f64 {
    let (a, b) = (luminance(a) + 0.05, luminance(b) + 0.05);
    a.max(b) / a.min(b)
}

/// Near white or near black: the one with the higher contrast on a colour; the two meet at 0.18.
pub(super) fn readable_on(colour: Rgb) -> Rgb {
    if luminance(colour) > 0.18 { NEAR_BLACK } else { NEAR_WHITE }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colours_run_from_purple_to_yellow_and_stay_within() {
        let viridis = |share| sample_colour_map(ColourMap::Viridis, share);
        assert_eq!(
            [0.0, 0.1, 1.0, -3.0, 7.0].map(viridis),
            [VIRIDIS[0], VIRIDIS[1], VIRIDIS[10], VIRIDIS[0], VIRIDIS[10]]
        );
        assert_eq!(viridis(0.55), (0x22, 0x9C, 0x88)); // half way from 0x21908C to 0x22A884
    }

    #[test]
    fn the_middle_of_the_diverging_map_is_its_lightest() {
        let sum = |share| -> u32 {
            let (r, g, b) = sample_colour_map(ColourMap::Diverging, share);
            u32::from(r) + u32::from(g) + u32::from(b)
        };
        assert!(sum(0.5) > sum(0.4) && sum(0.5) > sum(0.6) && sum(0.0) < sum(0.25));
    }
}
