//! Styles: colours, marks, colour maps, lengths and the dark theme.

use super::path::CanvasPoint;
use portable_math as math;
use std::fmt::Write;

/// Colours for colour-blind readers (Okabe and Ito). Their yellow is left out, because it is hardly visible
/// on white; orange and sky blue are darkened to give thin lines a contrast of 3 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(missing_docs)]
pub enum Colour {
    #[default]
    Black,
    Orange,
    SkyBlue,
    Green,
    Blue,
    Vermilion,
    Purple,
    Grey,
    /// Near white, for lines over a heat map.
    White,
}

impl Colour {
    /// Colours of lines on the background of a figure.
    #[cfg(test)]
    pub(super) const LINES: [Self; 8] = [
        Self::Black,
        Self::Orange,
        Self::SkyBlue,
        Self::Green,
        Self::Blue,
        Self::Vermilion,
        Self::Purple,
        Self::Grey,
    ];

    /// The colour in the hexadecimal notation of SVG.
    pub fn hex(self) -> String {
        format_hex(self.rgb())
    }

    pub(super) fn rgb(self) -> Rgb {
        match self {
            Self::Black => (0, 0, 0),
            Self::Orange => (0xC4, 0x82, 0x00),
            Self::SkyBlue => (0x3A, 0x97, 0xD4),
            Self::Green => (0x00, 0x9E, 0x73),
            Self::Blue => (0x00, 0x72, 0xB2),
            Self::Vermilion => (0xD5, 0x5E, 0x00),
            Self::Purple => (0xCC, 0x79, 0xA7),
            Self::Grey => (0x80, 0x80, 0x80),
            Self::White => NEAR_WHITE,
        }
    }
}

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mark {
    /// A full line.
    #[default]
    Line,
    /// A thin full line.
    Thin,
    /// A thick full line, to be drawn below a thin one.
    Thick,
    /// A dashed line.
    Dashed,
    /// A dotted line.
    Dotted,
    /// A thin dashed line.
    ThinDashed,
    /// A line edged with white, to be visible on any background, with dots where its points are far apart.
    Edged,
    /// Small dots, not joined.
    Dots,
    /// Hollow circles, not joined.
    Circles,
    /// Crosses, not joined.
    Crosses,
    /// Filled symbols of this shape, joined by a line.
    Joined(MarkerShape),
    /// Hollow symbols of this shape, not joined.
    Hollow(MarkerShape),
}

/// Shape of a symbol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum MarkerShape {
    Disc,
    Square,
    Diamond,
    Triangle,
    InvertedTriangle,
}

impl MarkerShape {
    /// Corners relative to the centre, in units of the symbol's half width, y downwards; none for a disc.
    pub(super) fn corners(self) -> &'static [CanvasPoint] {
        match self {
            Self::Disc => &[],
            Self::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
            Self::Diamond => &[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)],
            Self::Triangle => &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)],
            Self::InvertedTriangle => &[(0.0, 1.2), (1.1, -0.8), (-1.1, -0.8)],
        }
    }
}

impl Mark {
    pub(super) fn dash_pattern(self) -> &'static [f64] {
        match self {
            Self::Dashed | Self::ThinDashed => &[1.6 * UNITS_PER_MM, 1.0 * UNITS_PER_MM],
            Self::Dotted => &[0.4 * UNITS_PER_MM, 0.8 * UNITS_PER_MM],
            _ => &[],
        }
    }

    pub(super) fn is_symbol(self) -> bool {
        matches!(self, Self::Dots | Self::Circles | Self::Crosses | Self::Hollow(_))
    }

    pub(super) fn line_width(self) -> u32 {
        match self {
            Self::Thin | Self::ThinDashed => 3,
            Self::Thick => 9,
            _ => 5,
        }
    }
}

// Colours as numbers, and colour maps.

/// Red, green and blue, 0 to 255.
pub(super) type Rgb = (u8, u8, u8);
pub(super) const WHITE: Rgb = (255, 255, 255);
pub(super) const BLACK: Rgb = (0, 0, 0);
pub(super) const GRID: Rgb = (0xDD, 0xDD, 0xDD);
pub(super) const FRAME: Rgb = (0x33, 0x33, 0x33);
/// Near white: unlike pure white, it is not replaced by the dark theme.
pub(super) const NEAR_WHITE: Rgb = (0xFE, 0xFE, 0xFE);
/// Near black: unlike pure black, it is not replaced by the dark theme.
const NEAR_BLACK: Rgb = (0x01, 0x01, 0x01);

/// A colour in the hexadecimal notation of SVG.
pub(super) fn format_hex((red, green, blue): Rgb) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}

/// Colours of a heat map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColourMap {
    /// Viridis: sequential, from low to high.
    #[default]
    Viridis,
    /// Diverging: blue below the middle of the range, near white at the middle, vermilion above it.
    Diverging,
}

/// Viridis in steps of 0.1 (S. van der Walt and N. Smith, matplotlib 2.0, CC0): perceptually uniform,
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
/// Blue, near white, vermilion: distinct for the colour-blind. The end colours differ from the line colours
/// by 1 in one component, so that the dark theme does not replace them.
const DIVERGING: [Rgb; 5] =
    [(0x00, 0x72, 0xB1), (0x80, 0xB8, 0xD8), (0xF7, 0xF7, 0xF5), (0xEA, 0xAE, 0x80), (0xD5, 0x5E, 0x01)];
/// Colour of missing values: a grey that neither colour map contains.
pub(super) const NO_VALUE: Rgb = (0xE4, 0xE4, 0xE4);

/// Colour at a fraction of the colour map from 0 to 1; outside this range, the colour of the nearer end.
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

/// Relative luminance, 0 to 1 (WCAG 2.2, with its transfer curve approximated by a power of 2.2).
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

/// Near white or near black, whichever has more contrast with a colour; the contrasts are equal at a
/// luminance of 0.18.
pub(super) fn readable_on(colour: Rgb) -> Rgb {
    if luminance(colour) > 0.18 { NEAR_BLACK } else { NEAR_WHITE }
}

// Lengths in mm and canvas units.

/// Canvas units per millimetre: about four per pixel of 1/96 inch.
pub(super) const UNITS_PER_MM: f64 = 15.0;
/// Width of a figure over two columns of a journal, mm.
pub const FULL_WIDTH_MM: f64 = 170.0;
/// Width of a figure in one column, mm.
pub const COLUMN_WIDTH_MM: f64 = 85.0;
/// Largest allowed height of a figure in print, mm: Springer's journals, among the strictest, allow 234 mm.
pub const MAX_HEIGHT_MM: f64 = 230.0;
/// Font size of labels, mm (7.4 pt, readable at print size).
pub(super) const TEXT_MM: f64 = 2.6;
pub(super) const TITLE_MM: f64 = 3.2;
/// Font size of small labels, mm (7.0 pt, the smallest size that many journals accept).
pub(super) const SMALL_MM: f64 = 2.47;
pub(super) const LINE_MM: f64 = 4.0;
pub(super) const EDGE_MM: f64 = 2.0;
pub(super) const TICK_MM: f64 = 1.0;
/// Smallest allowed distance, mm, between labelled ticks along the x axis.
pub(super) const X_TICKS_MM: f64 = 18.0;
/// Smallest allowed distance, mm, between labelled ticks along the y axis.
pub(super) const Y_TICKS_MM: f64 = 5.5;
/// Smallest allowed distance, mm, between labelled ticks along a logarithmic x axis.
pub(super) const X_LOG_TICKS_MM: f64 = 7.0;
/// Smallest allowed distance, mm, between labelled ticks along a logarithmic y axis.
pub(super) const Y_LOG_TICKS_MM: f64 = 3.6;
/// Opacity of shaded areas: pale enough for lines and grid to stay readable.
pub(super) const SHADING_OPACITY: f64 = 0.22;

// Dark theme: the style sheet of figures on screens. Print has none and keeps the light colours.

/// Colours of the light theme, each with its replacement in the dark theme. All other colours (of heat maps
/// and of lines over them) stay. The dark palette is that of Okabe and Ito in lighter shades, in the same
/// order.
const DARK_COLOURS: [(Rgb, Rgb); 13] = [
    ((0xFF, 0xFF, 0xFF), (0x16, 0x16, 0x16)), // background
    ((0x00, 0x00, 0x00), (0xF0, 0xF0, 0xEE)), // text and black lines
    ((0x33, 0x33, 0x33), (0xB8, 0xB8, 0xB4)), // frame
    ((0xDD, 0xDD, 0xDD), (0x3A, 0x3A, 0x38)), // grid
    ((0xE4, 0xE4, 0xE4), (0x3E, 0x3E, 0x40)), // no value
    ((0x66, 0x66, 0x66), (0xA2, 0xA2, 0xA0)), // hatching
    ((0xC4, 0x82, 0x00), (0xFF, 0xC2, 0x4D)),
    ((0x3A, 0x97, 0xD4), (0x9B, 0xD8, 0xFA)),
    ((0x00, 0x9E, 0x73), (0x2B, 0xC7, 0x9A)),
    ((0x00, 0x72, 0xB2), (0x4A, 0xA3, 0xE6)),
    ((0xD5, 0x5E, 0x00), (0xFF, 0x8A, 0x3D)),
    ((0xCC, 0x79, 0xA7), (0xE5, 0x9C, 0xC6)),
    ((0x80, 0x80, 0x80), (0xA6, 0xA6, 0xA6)),
];

/// A style element that gives all figures of a page their dark colours if the reader prefers a dark theme.
pub(crate) fn dark_theme_style() -> String {
    let mut rules = String::new();
    for (light, dark) in DARK_COLOURS {
        let (light, dark) = (format_hex(light), format_hex(dark));
        let _ = write!(
            rules,
            "svg [fill=\"{light}\"]{{fill:{dark}}}svg \
                           [stroke=\"{light}\"]{{stroke:{dark}}}"
        ); // (writing into a string cannot fail)
    }
    format!("<style>@media screen and (prefers-color-scheme:dark){{{rules}}}</style>\n")
}

#[cfg(test)]
mod tests {
    use super::{contrast, *};
    use crate::Colour;

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

    #[test]
    fn lines_have_a_contrast_of_three_to_one_on_both_grounds() {
        let [(white, dark_ground), ..] = DARK_COLOURS;
        for colour in Colour::LINES {
            let light = colour.rgb();
            let (_, dark) = DARK_COLOURS.iter().find(|(of, _)| *of == light).unwrap();
            for (line, ground) in [(light, white), (*dark, dark_ground)] {
                let found = contrast(line, ground);
                assert!(found >= 3.0, "{colour:?} on {}: {found:.2}", format_hex(ground));
            }
        }
    }
}
