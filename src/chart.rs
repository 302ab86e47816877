//!
//! Charts as SVG: stacked panels with axes, lines, symbols, shaded intervals and heat maps; no physics.
//!
//! Positions are whole canvas units, four per pixel of 1/96 inch; a `viewBox` scales them to millimetres.
//! Axes, layout, gaps, clipping and thinning are made here, because plotters clamps points to its range and
//! draws a NaN as a spike. A canvas draws with the shapes and fonts of plotters on the back end
//! `compact_svg`.
//!
//! From the bottom up: `style`, `path`, `axis`, `text`; the parts of a figure (`elements`, `heat_map`,
//! `figure`); `layout`; `canvas` on `compact_svg`; the drawing of contours, hatches, series and panels.

mod axis;
mod canvas;
mod compact_svg;
mod contours;
mod elements;
mod figure;
mod hatch;
mod heat_map;
mod layout;
mod panel;
mod path;
mod series;
mod style;
pub(crate) mod svg;
mod text;

pub(crate) use axis::{AxisScale, ChartAxis, value_span};
pub use elements::{
    ErrorBar, Hatch, HatchPattern, Panel, Raster, Ribbon, SampledSeries, Series, ShadedSpan, TextAnnotation,
    TopLabel, VerticalLine,
};
pub use figure::{Figure, Medium};
pub use heat_map::{HeatMap, cell_edges};
pub use style::{COLUMN_WIDTH_MM, FULL_WIDTH_MM, MAX_HEIGHT_MM};
pub(crate) use style::{Colour, ColourMap, Mark, MarkerShape};
pub(crate) use svg::PanelPlacement;

#[cfg(test)]
mod tests;
