//! Elements of a figure: panels, axes, series, spans and labels.

use super::axis::ChartAxis;
use super::heat_map::HeatMap;
use super::style::{Colour, Mark};

/// Points with one style and one entry in the legend.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Text in the legend; equal entries of several panels appear once. Empty for no entry.
    pub label: String,
    /// Colour.
    pub colour: Colour,
    /// Line or symbol.
    pub mark: Mark,
    /// Points in the units of the axes; `None` interrupts a line.
    pub points: Vec<Option<(f64, f64)>>,
    /// Error bars.
    pub error_bars: Vec<ErrorBar>,
}

impl Series {
    /// A series without error bars.
    pub fn new(
        label: impl Into<String>,
        colour: Colour,
        mark: Mark,
        points: impl IntoIterator<Item = impl Into<Option<(f64, f64)>>>,
    ) -> Self {
        let points = points.into_iter().map(Into::into).collect();
        Self { label: label.into(), colour, mark, points, error_bars: Vec::new() }
    }
}

/// Values at equal steps of a linear x axis, in the units of the y axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SampledSeries {
    /// Position of the first value, in units of the x axis.
    pub start: f64,
    /// Distance between neighbouring values, in units of the x axis.
    pub step: f64,
    /// Values in units of the y axis; `None` for a missing value.
    pub values: Vec<Option<f64>>,
}

/// An error bar, in the units of the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub enum ErrorBar {
    /// Along the x axis, at the height `y`.
    Horizontal { y: f64, from: f64, to: f64 },
    /// Along the y axis, at the position `x`.
    Vertical { x: f64, from: f64, to: f64 },
}

/// A picture whose edges are given in axis units.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Raster {
    /// The picture as PNG bytes.
    pub png: Vec<u8>,
    /// Left and right edge of the picture, in units of the x axis.
    pub x: [f64; 2],
    /// Lower and upper edge of the picture, in units of the y axis.
    pub y: [f64; 2],
}

/// A filled area between a lower and an upper curve.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ribbon {
    /// Entry in the legend; empty for none.
    pub label: String,
    /// Colour, drawn pale.
    pub colour: Colour,
    /// Positions on the x axis, each with the lower and the upper end of the ribbon, in axis units; `None`
    /// interrupts the ribbon.
    pub points: Vec<Option<(f64, f64, f64)>>,
}

impl Ribbon {
    /// A ribbon with an entry in the legend, from points as in [`Self::points`].
    pub fn new(
        label: impl Into<String>,
        colour: Colour,
        points: impl IntoIterator<Item = impl Into<Option<(f64, f64, f64)>>>,
    ) -> Self {
        Self { label: label.into(), colour, points: points.into_iter().map(Into::into).collect() }
    }
}

/// A shaded interval of the x axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ShadedSpan {
    /// Entry in the legend; empty for none.
    pub label: String,
    /// Colour, drawn pale.
    pub colour: Colour,
    /// Start, in units of the x axis.
    pub from: f64,
    /// End, in units of the x axis.
    pub to: f64,
    /// Whether the span is drawn as a frame on top of everything else instead of as shading.
    pub outlined: bool,
}

impl ShadedSpan {
    /// A shaded span between two positions, in units of the x axis.
    pub fn new(label: impl Into<String>, colour: Colour, from: f64, to: f64) -> Self {
        Self { label: label.into(), colour, from, to, outlined: false }
    }

    /// A span framed with a line.
    pub fn outline(label: impl Into<String>, colour: Colour, from: f64, to: f64) -> Self {
        Self { outlined: true, ..Self::new(label, colour, from, to) }
    }
}

/// A vertical line with a label above the panel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VerticalLine {
    /// Label; empty for none.
    pub label: String,
    /// Colour.
    pub colour: Colour,
    /// Line style.
    pub mark: Mark,
    /// Position, in units of the x axis.
    pub at: f64,
    /// Lower end in units of the y axis; `None` for the bottom of the axes.
    pub above: Option<f64>,
}

impl VerticalLine {
    /// A line that spans the full height of the axes.
    pub fn new(label: impl Into<String>, colour: Colour, mark: Mark, at: f64) -> Self {
        Self { label: label.into(), colour, mark, at, above: None }
    }
}

/// A label above the panel, without a line.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TopLabel {
    /// Label.
    pub label: String,
    /// Position of the middle of the label, in units of the x axis.
    pub at: f64,
}

/// Text inside the axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TextAnnotation {
    /// The text.
    pub text: String,
    /// Colour.
    pub colour: Colour,
    /// Position of the middle of the text, in the units of the axes.
    pub at: (f64, f64),
}

impl TextAnnotation {
    /// A text with its middle at a position, in the units of the axes.
    pub fn new(text: impl Into<String>, colour: Colour, at: (f64, f64)) -> Self {
        Self { text: text.into(), colour, at }
    }
}

/// Hatched cells with one pattern and one entry in the legend.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Hatch {
    /// Entry in the legend; empty for none.
    pub label: String,
    /// Pattern of the cells.
    pub pattern: HatchPattern,
    /// For each cell: start and end on the x axis, then start and end on the y axis, in axis units. Cells are
    /// clipped to the axes; an infinite y value means the end of the y axis.
    pub cells: Vec<[f64; 4]>,
}

/// A pattern of thin lines, drawn over the grey of cells without a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(missing_docs)]
pub enum HatchPattern {
    #[default]
    Plain,
    Rising,
    Falling,
    Level,
    Upright,
    Crossed,
    Checked,
    Dotted,
    Dashed,
    DashedUpright,
}

/// A panel with one pair of axes. Stacked panels with equal x axes share tick labels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Panel {
    /// Title above the left corner, of one or more lines; empty for none.
    pub title: String,
    /// Horizontal axis.
    pub x: ChartAxis,
    /// Vertical axis.
    pub y: ChartAxis,
    /// Height of the axes, mm.
    pub height_mm: f64,
    /// Lines and symbols, later ones on top.
    pub series: Vec<Series>,
    /// Entry `i` is the full data of `series[i]` if the points of that series are thinned. A web page draws
    /// the full data when a reader enlarges a part. Missing entries count as `None`.
    pub sampled_series: Vec<Option<SampledSeries>>,
    /// Shaded intervals, under the lines.
    pub shaded_spans: Vec<ShadedSpan>,
    /// Vertical lines.
    pub vertical_lines: Vec<VerticalLine>,
    /// Filled areas between curves, under the lines.
    pub ribbons: Vec<Ribbon>,
    /// Labels above the panel.
    pub top_labels: Vec<TopLabel>,
    /// A picture under everything else.
    pub raster: Option<Raster>,
    /// Heat map, under everything else.
    pub heat_map: Option<HeatMap>,
    /// Hatched cells, over the heat map.
    pub hatches: Vec<Hatch>,
    /// Text inside the axes, over everything else.
    pub annotations: Vec<TextAnnotation>,
    /// Whether both axes have the same length per unit, as in a drawing; the range of one axis is then
    /// widened.
    pub equal_aspect: bool,
    /// Whether frame, grid and ticks are left out, as in a drawing.
    pub bare: bool,
}

impl Panel {
    /// A panel with series only.
    pub fn new(x: ChartAxis, y: ChartAxis, height_mm: f64, series: impl IntoIterator<Item = Series>) -> Self {
        Self { x, y, height_mm, series: series.into_iter().collect(), ..Self::default() }
    }
}
