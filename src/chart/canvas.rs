//! Lines, rectangles, polygons, circles and text on a canvas in whole units, with the shapes and letterings
//! of plotters.

use super::colours::{BLACK, Rgb};
use super::compact_svg::CompactSvg;
use super::path::{Area, Point};
use super::sizes::UNITS;
use crate::text::printable;
use plotters::prelude::{DrawingBackend, IntoFont, RGBColor};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontStyle, FontTransform, ShapeStyle, TextStyle};

/// Which point of a text stands at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    /// Middle of the left edge.
    Left,
    /// Middle of the right edge.
    Right,
    /// Middle of the upper edge.
    Top,
    /// Middle of the lower edge.
    Bottom,
    /// The middle.
    Centre,
}

/// Look of a text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lettering {
    pub size_mm: f64,
    pub anchor: Anchor,
    pub bold: bool,
    pub upwards: bool,
}

impl Lettering {
    pub fn plain(size_mm: f64, anchor: Anchor) -> Self {
        Self { size_mm, anchor, bold: false, upwards: false }
    }
}

/// The canvas; places in its units, y downwards.
pub(super) struct Canvas {
    back: CompactSvg,
}

// Drawing into a string cannot fail, so the results of the back end are dropped below.
impl Canvas {
    /// The elements that `draw` leaves on a canvas of that size.
    pub fn elements(size: (u32, u32), draw: impl FnOnce(&mut Canvas)) -> String {
        let mut canvas = Canvas { back: CompactSvg::of(size) };
        draw(&mut canvas);
        canvas.back.elements()
    }

    /// What `draw` leaves, as a group with attributes; `None` for no group.
    pub fn group(&mut self, attributes: Option<&str>, draw: impl FnOnce(&mut Canvas)) {
        match attributes {
            None => draw(self),
            Some(attributes) => {
                self.back.open_group(attributes);
                draw(self);
                self.back.close_group();
            }
        }
    }

    pub fn line(&mut self, points: &[Point], colour: Rgb, width: u32) {
        let mut whole = whole(points);
        whole.dedup();
        if whole.len() == 1 {
            whole.push(whole[0]);
        }
        let _ = self.back.draw_path(whole, &rgb(colour).stroke_width(width));
    }

    /// A PNG in an area, as far as it lies within another.
    pub fn picture(&mut self, area: &Area, within: &Area, png: &[u8]) {
        self.back.picture(area, within, png);
    }

    pub(crate) fn rectangle(&mut self, area: &Area, colour: Rgb, opacity: f64) {
        let style = ShapeStyle { color: rgb(colour).mix(opacity), filled: true, stroke_width: 0 };
        let _ = self.back.draw_rect(
            (area.left as i32, area.top as i32),
            (area.right as i32, area.bottom as i32),
            &style,
            true,
        );
    }

    pub(crate) fn polygon(&mut self, corners: &[Point], colour: Rgb, opacity: f64) {
        let _ = self.back.fill_polygon(whole(corners), &rgb(colour).mix(opacity).filled());
    }

    pub fn circle(&mut self, at: Point, radius: u32, colour: Rgb, filled: bool) {
        let style = ShapeStyle { color: rgb(colour).to_rgba(), filled, stroke_width: 4 };
        let _ = self.back.draw_circle((at.0.round() as i32, at.1.round() as i32), radius, &style, filled);
    }

    pub fn text(&mut self, text: &str, at: Point, look: Lettering) {
        self.coloured(text, at, look, BLACK);
    }

    pub fn coloured(&mut self, text: &str, at: Point, look: Lettering, colour: Rgb) {
        let font = ("sans-serif", look.size_mm * UNITS).into_font();
        let font = if look.bold { font.style(FontStyle::Bold) } else { font };
        let font = if look.upwards { font.transform(FontTransform::Rotate270) } else { font };
        let colour = rgb(colour);
        let style = TextStyle::from(font).pos(position(look.anchor)).color(&colour);
        let _ = self.back.draw_text(&printable(text), &style, (at.0.round() as i32, at.1.round() as i32));
    }
}

fn whole(points: &[Point]) -> Vec<(i32, i32)> {
    points.iter().map(|p| (p.0.round() as i32, p.1.round() as i32)).collect()
}

fn rgb((red, green, blue): Rgb) -> RGBColor {
    RGBColor(red, green, blue)
}

fn position(anchor: Anchor) -> Pos {
    match anchor {
        Anchor::Left => Pos::new(HPos::Left, VPos::Center),
        Anchor::Right => Pos::new(HPos::Right, VPos::Center),
        Anchor::Top => Pos::new(HPos::Center, VPos::Top),
        Anchor::Bottom => Pos::new(HPos::Center, VPos::Bottom),
        Anchor::Centre => Pos::new(HPos::Center, VPos::Center),
    }
}
