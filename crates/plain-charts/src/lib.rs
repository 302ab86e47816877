//! Charts as SVG: stacked panels with axes, lines, symbols, shaded intervals and heat maps; no physics.
//!
//! Positions are whole canvas units, four per pixel of 1/96 inch; a `viewBox` scales them to millimetres.
//! This crate computes axes, layout, gaps, clipping and thinning itself, because the crate `plotters` clamps
//! points to its range and draws a NaN as a spike. `plotters` provides only shapes and fonts; the back end
//! `compact_svg` writes them as SVG.
//!
//! The modules, from the basic ones to those that use them: `style`, `path`, `axis`, `text`; the parts of a
//! figure (`elements`, `heat_map`, `figure`); `layout`; `canvas` on `compact_svg`; the drawing of contours,
//! hatches, series and panels.
//!
//! # A figure of two panels
//!
//! ```
//! use plain_charts::{ChartAxis, Colour, Figure, Mark, Medium, Panel, Series};
//!
//! let times = || (0..=100).map(|i| f64::from(i) / 10.0);
//! let curve = |f: fn(f64) -> f64| times().map(move |t| Some((t, f(t))));
//! let panel = |label: &str, f| Panel {
//!     x: ChartAxis { label: "time, s".to_owned(), ..ChartAxis::default() },
//!     y: ChartAxis { label: label.to_owned(), ..ChartAxis::default() },
//!     series: vec![Series::new(label, Colour::Blue, Mark::Line, curve(f))],
//!     ..Panel::default()
//! };
//! let figure = Figure {
//!     title: "An oscillation and its velocity".to_owned(),
//!     panels: vec![panel("position, m", f64::sin), panel("velocity, m/s", f64::cos)],
//!     ..Figure::default()
//! };
//! let svg = figure.to_svg(Medium::Column);
//! assert!(svg.starts_with("<svg") && svg.contains("velocity, m/s"));
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may call them

mod axis;
mod canvas;
mod compact_svg;
mod contours;
mod elements;
mod figure;
mod hatch;
mod heat_map;
mod layout;
pub mod number;
mod panel;
mod path;
pub mod printable;
mod series;
mod style;
mod svg;
mod text;

pub use axis::{AxisScale, ChartAxis, value_span};
pub use elements::{
    ErrorBar, Hatch, HatchPattern, Panel, Raster, Ribbon, SampledSeries, Series, ShadedSpan, TextAnnotation,
    TopLabel, VerticalLine,
};
pub use figure::{Figure, Medium};
pub use heat_map::{HeatMap, cell_edges};
pub use style::{COLUMN_WIDTH_MM, FULL_WIDTH_MM, MAX_HEIGHT_MM};
pub use style::{Colour, ColourMap, Mark, MarkerShape};
pub use svg::PanelPlacement;

#[cfg(test)]
mod tests;
