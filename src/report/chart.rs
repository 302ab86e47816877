//! Figures: stacked panels with axes, lines, symbols, shaded intervals, heat maps and marks, as SVG; no
//! physics.
//!
//! plotters' SVG has whole coordinates, so the canvas has about four units for a pixel of 1/96 inch and a
//! `viewBox` scales it to millimetres. Lines are split at gaps, thinned and clipped here: plotters clamps
//! points to its range and turns a NaN into a spike.

mod axis;
mod canvas;
mod cells;
mod colours;
mod compact;
mod elements;
mod hatch;
mod heat;
mod layout;
mod overlay;
mod panel;
mod path;
mod series;
mod style;
mod text;
mod theme;

pub use axis::{Axis, Scale};
pub use elements::{Band, Bar, Caption, Panel, Ribbon, Rule, Series, Text};
pub use hatch::{Hatch, Pattern};
pub use heat::{Colours, Heat};
pub use overlay::Plot;
pub use style::{Colour, Mark, Shape};
pub(super) use theme::style as dark_style;

use crate::text::printable;
use canvas::{Canvas, WHITE};
use layout::Layout;
use path::Area;

/// Canvas units for a millimetre: four for a pixel of 1/96 inch.
const UNITS: f64 = 15.0;
/// Width of a figure over two columns of a journal, mm.
pub const FULL_WIDTH_MM: f64 = 170.0;
/// Width of a figure in one column, mm.
pub const COLUMN_WIDTH_MM: f64 = 85.0;
/// Most height of a figure in print, mm: Springer's journals, among the strictest, take figures up to 234 mm
/// high, about the text of an A4 page.
pub const MOST_HEIGHT_MM: f64 = 230.0;
/// Size of labels, mm (7.5 pt, readable at print size).
const TEXT_MM: f64 = 2.6;
const TITLE_MM: f64 = 3.2;
const SMALL_MM: f64 = 2.3;
const LINE_MM: f64 = 4.0;
const EDGE_MM: f64 = 2.0;
const TICK_MM: f64 = 1.0;
/// Least distance of labelled ticks, mm.
const X_TICKS_MM: f64 = 18.0;
const Y_TICKS_MM: f64 = 5.5;
/// Opacity of shaded surfaces: pale enough for lines and grid to stay readable.
const BAND_OPACITY: f64 = 0.22;

/// A figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// Heading, and name for screen readers.
    pub title: String,
    /// Line under the heading, such as a statement that the data are synthetic; empty for none.
    pub subtitle: String,
    /// What the figure shows, for screen readers.
    pub description: String,
    /// Width on a screen, mm.
    pub width_mm: f64,
    /// Panels beside each other where the width allows; 0 and 1 are one below the other.
    pub columns: usize,
    /// Panels in the order of reading.
    pub panels: Vec<Panel>,
}

/// What a figure is drawn for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Medium {
    /// A screen, light or dark as its reader has it, in the figure's own width.
    Screen,
    /// A column of a journal, [`COLUMN_WIDTH_MM`] wide, in fixed colours and without a style sheet.
    Column,
    /// A page of a journal, [`FULL_WIDTH_MM`] wide, in the same way.
    Page,
}

impl Figure {
    /// The figure as SVG, vectors alone; the same figure always gives the same bytes.
    #[must_use]
    pub fn svg(&self, medium: Medium) -> String {
        match medium {
            Medium::Screen => svg(self, &dark_style()),
            Medium::Column | Medium::Page => svg(&self.for_medium(medium), ""),
        }
    }

    /// Its height in a medium, mm. In print, panels are lowered as far as they stay legible until it is at
    /// most [`MOST_HEIGHT_MM`].
    #[must_use]
    pub fn height_mm(&self, medium: Medium) -> f64 {
        Layout::of(&self.for_medium(medium)).height
    }

    fn for_medium(&self, medium: Medium) -> Self {
        let width_mm = match medium {
            Medium::Screen => return self.clone(),
            Medium::Column => COLUMN_WIDTH_MM,
            Medium::Page => FULL_WIDTH_MM,
        };
        layout::no_higher_than(Self { width_mm, ..self.clone() }, MOST_HEIGHT_MM)
    }
}

fn svg(figure: &Figure, style: &str) -> String {
    let layout = Layout::of(figure);
    let size = ((figure.width_mm * UNITS).round() as u32, (layout.height * UNITS).round() as u32);
    let whole = Area { left: 0.0, top: 0.0, right: f64::from(size.0), bottom: f64::from(size.1) };
    let ground = Canvas::elements(size, |canvas| canvas.rectangle(&whole, WHITE, 1.0));
    let maps: String = layout
        .panels
        .iter()
        .filter_map(|placed| cells::elements(placed.panel.heat.as_ref()?, &placed.x, &placed.y, &placed.area))
        .collect();
    let drawn = Canvas::elements(size, |canvas| {
        panel::heading(canvas, figure, &layout);
        for placed in &layout.panels {
            panel::panel(canvas, placed);
        }
    });
    let (width, height) = (size.0, size.1);
    let (title, description) =
        (escaped(&figure.title), escaped(&format!("{} {}", figure.description, figure.subtitle)));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{title}\" width=\"{:.2}mm\" height=\"{:.2}mm\" viewBox=\"0 0 {width} {height}\" \
         stroke-linejoin=\"round\">\n<title>{title}</title>\n<desc>{}</desc>\n{style}{ground}{maps}{drawn}</svg>\n",
        f64::from(width) / UNITS,
        f64::from(height) / UNITS,
        description.trim(),
    )
}

/// Edges of cells with these middles along an axis: half way between them as the axis counts, and as far out
/// at the ends; none for middles that do not rise.
#[must_use]
pub fn cell_edges(middles: &[f64], scale: Scale) -> Vec<f64> {
    heat::edges(middles, scale)
}

fn escaped(text: &str) -> String {
    html_escape::encode_safe(&printable(text)).into_owned()
}

#[cfg(test)]
mod tests;
