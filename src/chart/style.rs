//! Looks of lines and symbols.

use super::colours::{NEAR_WHITE, Rgb, format_hex};
use super::path::CanvasPoint;
use super::sizes::UNITS_PER_MM;

/// Colours that colour-blind readers can tell apart: those of Okabe and Ito without the yellow that vanishes
/// on white, orange and sky blue darker, so that thin lines have a contrast of 3 to 1.
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
    /// For lines over a heat map.
    White,
}

impl Colour {
    /// Those of lines on the ground of a figure.
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

    /// As SVG writes it.
    #[must_use]
    pub(crate) fn hex(self) -> String {
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
    /// A thick full line, to lie under a thin one.
    Thick,
    /// A dashed line.
    Dashed,
    /// A dotted line.
    Dotted,
    /// A thin dashed line.
    ThinDashed,
    /// A line with its points, edged with white so that it is seen on any ground.
    Edged,
    /// Small dots, not joined.
    Dots,
    /// Circles, not joined.
    Circles,
    /// Crosses, not joined.
    Crosses,
    /// Full symbols of this shape, joined by a line.
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
    /// Corners in units of the symbol's half width, y downwards; none for a disc.
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
