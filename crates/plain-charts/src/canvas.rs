//! A drawing surface in whole canvas units: lines, rectangles, polygons, circles and text, drawn with
//! `plotters`.

use super::compact_svg::CompactSvg;
use super::path::{CanvasArea, CanvasPoint, remove_flat_points};
use super::style::UNITS_PER_MM;
use super::style::{BLACK, Rgb};
use crate::printable::make_printable;
use plotters::prelude::{DrawingBackend, IntoFont, RGBColor};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontStyle, FontTransform, ShapeStyle, TextStyle};

/// Which point of a text's bounding box lies at the position where the text is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TextAnchor {
    /// Middle of the left edge.
    Left,
    /// Middle of the right edge.
    Right,
    /// Middle of the upper edge.
    Top,
    /// Middle of the lower edge.
    Bottom,
    Centre,
}

/// Size, anchor and style of a text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lettering {
    pub size_mm: f64,
    pub anchor: TextAnchor,
    pub bold: bool,
    pub upwards: bool,
}

impl Lettering {
    pub(crate) fn plain(size_mm: f64, anchor: TextAnchor) -> Self {
        Self { size_mm, anchor, bold: false, upwards: false }
    }
}

/// A drawing surface. Positions are in canvas units from the upper left corner, y downwards.
pub(super) struct Canvas {
    back: CompactSvg,
}

// Drawing into a string cannot fail, so the results of the back end are ignored below.
impl Canvas {
    /// The SVG elements that `draw` makes on a canvas of this size, in canvas units.
    pub(crate) fn render_elements(size: (u32, u32), draw: impl FnOnce(&mut Canvas)) -> String {
        let mut canvas = Canvas { back: CompactSvg::new(size) };
        draw(&mut canvas);
        canvas.back.into_elements()
    }

    /// Calls `draw` inside an SVG group with these attributes, or outside any group for `None`.
    pub(crate) fn draw_group(&mut self, attributes: Option<&str>, draw: impl FnOnce(&mut Canvas)) {
        match attributes {
            None => draw(self),
            Some(attributes) => {
                self.back.open_group(attributes);
                draw(self);
                self.back.close_group();
            }
        }
    }

    pub(crate) fn draw_line(&mut self, points: &[CanvasPoint], colour: Rgb, width: u32) {
        let mut whole: Vec<_> = points.iter().map(round_point).collect();
        whole.dedup();
        let mut whole = remove_flat_points(&whole);
        if whole.len() == 1 {
            whole.push(whole[0]);
        }
        let _ = self.back.draw_path(whole, &plotters_colour(colour).stroke_width(width));
    }

    /// Draws a PNG image that fills `area` and is clipped to `within`. If `smooth`, colours are interpolated
    /// between pixels; otherwise every pixel keeps its colour and its edges.
    pub(crate) fn draw_png(&mut self, area: &CanvasArea, within: &CanvasArea, png: &[u8], smooth: bool) {
        self.back.append_png(area, within, png, smooth);
    }

    pub(crate) fn fill_rectangle(&mut self, area: &CanvasArea, colour: Rgb, opacity: f64) {
        let style = ShapeStyle { color: plotters_colour(colour).mix(opacity), filled: true, stroke_width: 0 };
        let (upper, lower) = ((area.left as i32, area.top as i32), (area.right as i32, area.bottom as i32));
        let _ = self.back.draw_rect(upper, lower, &style, true);
    }

    pub(crate) fn fill_polygon(&mut self, corners: &[CanvasPoint], colour: Rgb, opacity: f64) {
        let _ = self
            .back
            .fill_polygon(corners.iter().map(round_point), &plotters_colour(colour).mix(opacity).filled());
    }

    pub(crate) fn draw_circle(&mut self, at: CanvasPoint, radius: u32, colour: Rgb, filled: bool) {
        let style = ShapeStyle { color: plotters_colour(colour).to_rgba(), filled, stroke_width: 4 };
        let _ = self.back.draw_circle(round_point(&at), radius, &style, filled);
    }

    pub(crate) fn draw_text(&mut self, text: &str, at: CanvasPoint, look: Lettering) {
        self.draw_coloured_text(text, at, look, BLACK);
    }

    pub(crate) fn draw_coloured_text(&mut self, text: &str, at: CanvasPoint, look: Lettering, colour: Rgb) {
        let font = ("sans-serif", look.size_mm * UNITS_PER_MM).into_font();
        let font = if look.bold { font.style(FontStyle::Bold) } else { font };
        let font = if look.upwards { font.transform(FontTransform::Rotate270) } else { font };
        let colour = plotters_colour(colour);
        let (h, v) = match look.anchor {
            TextAnchor::Left => (HPos::Left, VPos::Center),
            TextAnchor::Right => (HPos::Right, VPos::Center),
            TextAnchor::Top => (HPos::Center, VPos::Top),
            TextAnchor::Bottom => (HPos::Center, VPos::Bottom),
            TextAnchor::Centre => (HPos::Center, VPos::Center),
        };
        let style = TextStyle::from(font).pos(Pos::new(h, v)).color(&colour);
        let _ = self.back.draw_text(&make_printable(text), &style, round_point(&at));
    }
}

fn round_point(at: &CanvasPoint) -> (i32, i32) {
    (at.0.round() as i32, at.1.round() as i32)
}

fn plotters_colour((red, green, blue): Rgb) -> RGBColor {
    RGBColor(red, green, blue)
}
