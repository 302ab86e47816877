//! Figures: stacked panels with axes, lines, symbols, shaded intervals, heat maps and marks, as SVG; no physics.
//!
//! plotters' SVG has whole coordinates, so the canvas has about four units for a pixel of 1/96 inch and a `viewBox` scales it to millimetres.
//! Lines are split at gaps, thinned and clipped here: plotters clamps points to its range and turns a NaN into a spike.

mod axis;
mod canvas;
mod cells;
mod colours;
mod compact;
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

pub(super) use axis::superscript;
pub use axis::{Axis, Scale};
pub use hatch::{Hatch, Pattern};
pub use heat::{Colours, Heat};
pub use overlay::Plot;
pub use style::{Colour, Mark, Shape};
pub(super) use theme::style as dark_style;

use canvas::{Canvas, WHITE};
use layout::Layout;
use path::Area;

/// Canvas units for a millimetre: four for a pixel of 1/96 inch.
const UNITS: f64 = 15.0;
/// Width of a figure over two columns of a journal, mm.
pub const FULL_WIDTH_MM: f64 = 170.0;
/// Width of a figure in one column, mm.
pub const COLUMN_WIDTH_MM: f64 = 85.0;
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

/// Points with one style and one entry in the legend.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Entry in the legend; equal ones of several panels share one. Empty for none.
    pub label: String,
    /// Colour.
    pub colour: Colour,
    /// Line or symbol.
    pub mark: Mark,
    /// Points in the units of the axes; `None` interrupts a line.
    pub points: Vec<Option<(f64, f64)>>,
    /// Error bars.
    pub bars: Vec<Bar>,
}

/// An error bar, in the units of the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub enum Bar {
    /// Along the x axis, at a height `y`.
    Horizontal { y: f64, from: f64, to: f64 },
    /// Along the y axis, at a place `x`.
    Vertical { x: f64, from: f64, to: f64 },
}

/// The surface between two curves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ribbon {
    /// Entry in the legend; empty for none.
    pub label: String,
    /// Colour, drawn pale.
    pub colour: Colour,
    /// Place on the x axis with lower and upper end there, in the units of the axes; `None` interrupts it.
    pub points: Vec<Option<(f64, f64, f64)>>,
}

/// A shaded interval of the x axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Band {
    /// Entry in the legend; empty for none.
    pub label: String,
    /// Colour, drawn pale.
    pub colour: Colour,
    /// Start, in units of the x axis.
    pub from: f64,
    /// End, in units of the x axis.
    pub to: f64,
    /// Framed with a line, over everything else, instead of shaded.
    pub outlined: bool,
}

/// A vertical line with a label over the panel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Rule {
    /// Label; empty for none.
    pub label: String,
    /// Colour.
    pub colour: Colour,
    /// Line style.
    pub mark: Mark,
    /// Place, in units of the x axis.
    pub at: f64,
    /// Height from which it runs to the top, in units of the y axis; `None` from the bottom.
    pub above: Option<f64>,
}

/// A label over the panel, without a line.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Caption {
    /// Label.
    pub label: String,
    /// Its middle, in units of the x axis.
    pub at: f64,
}

/// Text inside the axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Text {
    /// What it says.
    pub text: String,
    /// Colour.
    pub colour: Colour,
    /// Its middle, in the units of the axes.
    pub at: (f64, f64),
}

/// One pair of axes. Neighbours one below the other with the same x axis share it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Panel {
    /// What tells it from its neighbours, over its left corner; empty for none.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Height of the axes, mm.
    pub height_mm: f64,
    /// Lines and symbols, later ones on top.
    pub series: Vec<Series>,
    /// Shaded intervals, under the lines.
    pub bands: Vec<Band>,
    /// Vertical lines.
    pub rules: Vec<Rule>,
    /// Surfaces between curves, under the lines.
    pub ribbons: Vec<Ribbon>,
    /// Labels over the panel.
    pub captions: Vec<Caption>,
    /// Heat map, under everything else.
    pub heat: Option<Heat>,
    /// Hatched cells over it.
    pub hatches: Vec<Hatch>,
    /// Text inside, over everything else.
    pub texts: Vec<Text>,
    /// One length for a unit of either axis, as a drawing to scale has; the y axis reaches as far as that takes.
    pub equal: bool,
    /// Neither frame nor grid nor ticks: a drawing, not a diagram.
    pub bare: bool,
}

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
            Medium::Column => svg(&Self { width_mm: COLUMN_WIDTH_MM, ..self.clone() }, ""),
            Medium::Page => svg(&Self { width_mm: FULL_WIDTH_MM, ..self.clone() }, ""),
        }
    }
}

fn svg(figure: &Figure, style: &str) -> String {
    let layout = Layout::of(figure);
    let size = ((figure.width_mm * UNITS).round() as u32, (layout.height * UNITS).round() as u32);
    let whole = Area { left: 0.0, top: 0.0, right: f64::from(size.0), bottom: f64::from(size.1) };
    let ground = Canvas::elements(size, |canvas| canvas.rectangle(&whole, WHITE, 1.0));
    let maps: String = layout.panels.iter().filter_map(|placed| cells::elements(placed.panel.heat.as_ref()?, &placed.x, &placed.y, &placed.area)).collect();
    let drawn = Canvas::elements(size, |canvas| {
        panel::heading(canvas, figure, &layout);
        for placed in &layout.panels {
            panel::panel(canvas, placed);
        }
    });
    let (width, height) = (size.0, size.1);
    let (title, description) = (escaped(&figure.title), escaped(&format!("{} {}", figure.description, figure.subtitle)));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{title}\" width=\"{:.2}mm\" height=\"{:.2}mm\" viewBox=\"0 0 {width} {height}\" \
         stroke-linejoin=\"round\">\n<title>{title}</title>\n<desc>{}</desc>\n{style}{ground}{maps}{drawn}</svg>\n",
        f64::from(width) / UNITS,
        f64::from(height) / UNITS,
        description.trim(),
    )
}

/// Edges of cells with these middles along an axis: half way between them as the axis counts, and as far out at the ends; none for middles
/// that do not rise.
#[must_use]
pub fn cell_edges(middles: &[f64], scale: Scale) -> Vec<f64> {
    heat::edges(middles, scale)
}

/// Text as XML takes it: control characters have no place in it, and those that would turn the direction of what follows are left out.
pub(super) fn printable(text: &str) -> String {
    let turns = |c: &char| matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    text.chars().filter(|c| !turns(c)).map(|c| if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') { ' ' } else { c }).collect()
}

fn escaped(text: &str) -> String {
    html_escape::encode_safe(&printable(text)).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(points: Vec<Option<(f64, f64)>>, title: &str) -> Figure {
        let series = Series { label: title.to_owned(), colour: Colour::Blue, mark: Mark::Line, points, ..Series::default() };
        let rule = Rule { label: title.to_owned(), colour: Colour::Grey, mark: Mark::Dashed, at: 0.5, above: None };
        let x = Axis::linear("x").between(0.0, 1.0);
        let y = Axis::linear(title).between(0.0, 1.0);
        let panel = Panel { x, y, height_mm: 30.0, series: vec![series], rules: vec![rule], ..Panel::default() };
        Figure {
            title: title.to_owned(),
            subtitle: title.to_owned(),
            description: title.to_owned(),
            width_mm: FULL_WIDTH_MM,
            panels: vec![panel],
            ..Figure::default()
        }
    }

    fn as_svg(figure: &Figure) -> String {
        figure.svg(Medium::Screen)
    }

    /// The lines of a colour and width, as lists of points.
    fn lines(svg: &str, colour: &str, width: u32) -> Vec<Vec<(f64, f64)>> {
        let look = format!("stroke=\"{colour}\" stroke-width=\"{width}\" d=\"");
        let paths = svg.lines().filter_map(|line| line.strip_prefix("<path fill=\"none\" ")?.split_once(&look)).map(|(_, data)| data);
        paths.flat_map(|data| data.trim_end_matches("\"/>").split('M').skip(1)).map(points).collect()
    }

    /// A start and steps from there.
    fn points(data: &str) -> Vec<(f64, f64)> {
        let spaced = data.replace('l', " ").replace('-', " -");
        let numbers: Vec<f64> = spaced.split_whitespace().map(|n| n.parse().unwrap()).collect();
        let steps = numbers.chunks(2).scan((0.0, 0.0), |at, step| {
            *at = (at.0 + step[0], at.1 + step[1]);
            Some(*at)
        });
        steps.collect()
    }

    #[test]
    fn text_from_files_is_escaped_everywhere() {
        let drawn = as_svg(&figure(vec![Some((0.0, 0.0)), Some((1.0, 1.0))], "<script>\"a\" & 'b'</script>\u{1}"));
        assert!(!drawn.contains("<script") && !drawn.contains("\"a\"") && !drawn.contains("& ") && !drawn.contains('\u{1}'));
        assert!(drawn.matches("&lt;script&gt;").count() >= 6);
    }

    #[test]
    fn the_figure_has_its_width_in_millimetres_and_a_name() {
        let drawn = as_svg(&figure(vec![], "a name"));
        assert!(drawn.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"a name\" width=\"170.00mm\""));
        assert!(drawn.contains("viewBox=\"0 0 2550 ") && drawn.contains("<title>a name</title>") && drawn.contains("<desc>"));
    }

    #[test]
    fn gaps_and_values_that_are_no_numbers_split_a_line() {
        let points =
            vec![Some((0.0, 0.1)), Some((0.2, 0.1)), None, Some((0.4, 0.1)), Some((0.5, 0.1)), Some((0.6, f64::NAN)), Some((0.7, 0.1)), Some((0.8, 0.1))];
        let drawn = as_svg(&figure(points, ""));
        assert_eq!(lines(&drawn, "#0072B2", 5).len(), 3);
    }

    #[test]
    fn a_line_is_cut_at_the_frame_and_not_bent() {
        let drawn = as_svg(&figure(vec![Some((0.0, -1.0)), Some((1.0, 2.0))], ""));
        let line = lines(&drawn, "#0072B2", 5).remove(0);
        let frame = lines(&drawn, "#333333", 3).into_iter().find(|l| l.len() == 5).unwrap();
        let ((left, top), (right, bottom)) = (frame[0], frame[2]);
        let third = (right - left) / 3.0;
        let expected = [(left + third, bottom), (right - third, top)];
        let near = |(found, expected): (&(f64, f64), (f64, f64))| (found.0 - expected.0).abs() <= 1.0 && (found.1 - expected.1).abs() <= 1.0;
        assert!(line.iter().zip(expected).all(near), "{line:?} {expected:?}");
    }

    #[test]
    fn error_bars_have_caps_but_where_they_are_cut() {
        let count = |y: Axis, bar| {
            let mut figure = figure(vec![Some((0.5, 0.5))], "");
            let panel = &mut figure.panels[0];
            (panel.y, panel.series[0].bars, panel.series[0].mark) = (y, vec![bar], Mark::Circles);
            lines(&as_svg(&figure), "#0072B2", 3).len()
        };
        let linear = || Axis::linear("y").between(0.0, 1.0);
        assert_eq!(count(linear(), Bar::Vertical { x: 0.5, from: 0.2, to: 0.7 }), 3);
        assert_eq!(count(linear(), Bar::Horizontal { y: 0.5, from: 0.2, to: 1.7 }), 2);
        assert_eq!(count(linear(), Bar::Horizontal { y: 1.5, from: 0.2, to: 0.7 }), 0);
        assert_eq!(count(linear(), Bar::Vertical { x: 0.5, from: f64::NAN, to: 0.7 }), 0);
        assert_eq!(count(Axis::log("y").between(0.1, 1.0), Bar::Vertical { x: 0.5, from: -0.2, to: 0.7 }), 2);
    }

    #[test]
    fn a_million_points_are_drawn_in_few_bytes() {
        let points = (0..1_000_000).map(|i| Some((f64::from(i) * 1e-6, f64::from(i % 1000 * 7919 % 1000) * 1e-3))).collect();
        let drawn = as_svg(&figure(points, ""));
        assert!(drawn.len() < 60_000, "{}", drawn.len());
    }

    #[test]
    fn the_same_figure_gives_the_same_bytes_also_in_one_column() {
        let narrow = Figure { width_mm: COLUMN_WIDTH_MM, ..figure(vec![Some((0.0, 0.5)), Some((1.0, 0.5))], "t") };
        assert_eq!(as_svg(&narrow), as_svg(&narrow));
        assert!(as_svg(&narrow).contains("width=\"85.00mm\""));
    }
}
