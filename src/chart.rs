//! Figures: stacked panels with axes, lines, symbols, shaded intervals, heat maps and marks, as SVG; no
//! physics.
//!
//! Places are whole units of a canvas, about four for a pixel of 1/96 inch, and a `viewBox` scales it to
//! millimetres. Axes, layout, gaps, clipping and thinning are made here, as plotters clamps points to its
//! range and turns a NaN into a spike. plotters is the interface between drawing and format: a canvas draws
//! with its shapes and letterings on one of its back ends, `compact_svg`.
//!
//! From the bottom up: `sizes`, `colours`, `path`, `axis`, `text`; what a figure is made of (`style`, `heat`,
//! `elements`, `figure`); `layout`; `canvas` on `compact_svg`; the drawing of heat maps, hatches, series and
//! panels; `svg`.

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
mod text;

pub(crate) use axis::{AxisScale, ChartAxis, value_span};
pub use elements::{
    ErrorBar, Hatch, HatchPattern, Panel, Raster, Ribbon, SampledSeries, Series, ShadedSpan, TextAnnotation,
    TopLabel, VerticalLine,
};
pub(crate) use figure::PanelPlacement;
pub use figure::{Figure, Medium};
pub use heat_map::{HeatMap, cell_edges};
pub(crate) use style::ColourMap;
pub use style::MAX_HEIGHT_MM;
pub use style::{COLUMN_WIDTH_MM, FULL_WIDTH_MM};
pub(crate) use style::{Colour, Mark, MarkerShape};

#[cfg(test)]
mod tests;
