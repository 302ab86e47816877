//! Figures: stacked panels with axes, lines, symbols, shaded intervals and marks, as SVG. The only file that names plotters; no physics.
//!
//! plotters' SVG has whole coordinates, so the canvas has about four units for a pixel of 1/96 inch and a `viewBox` scales it to millimetres.
//! Lines are split at gaps, thinned and clipped here: plotters clamps points to its range and turns a NaN into a spike.

mod axis;
mod layout;
mod path;

pub use axis::{Axis, Scale};

use layout::{Entry, Layout, Placed, label_span};
use path::{Area, Point};
use plotters::prelude::{DrawingBackend, IntoFont, RGBColor, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontStyle, FontTransform, ShapeStyle, TextStyle};

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
/// Width of a column in which a line keeps four points, canvas units: one pixel.
const COLUMN: f64 = 4.0;

/// Colours that colour-blind readers can tell apart (Okabe and Ito), without the yellow that vanishes on white.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Colour {
    Black,
    Orange,
    SkyBlue,
    Green,
    Blue,
    Vermilion,
    Purple,
    Grey,
}

impl Colour {
    fn rgb(self) -> RGBColor {
        let (r, g, b) = match self {
            Self::Black => (0, 0, 0),
            Self::Orange => (0xE6, 0x9F, 0x00),
            Self::SkyBlue => (0x56, 0xB4, 0xE9),
            Self::Green => (0x00, 0x9E, 0x73),
            Self::Blue => (0x00, 0x72, 0xB2),
            Self::Vermilion => (0xD5, 0x5E, 0x00),
            Self::Purple => (0xCC, 0x79, 0xA7),
            Self::Grey => (0x80, 0x80, 0x80),
        };
        RGBColor(r, g, b)
    }
}

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A full line.
    Line,
    /// A thin full line.
    Thin,
    /// A thick full line, to lie under a thin one.
    Thick,
    /// A dashed line.
    Dashed,
    /// A dotted line.
    Dotted,
    /// Small dots, not joined.
    Dots,
    /// Circles, not joined.
    Circles,
    /// Crosses, not joined.
    Crosses,
    /// Full symbols of this shape, joined by a line.
    Joined(Shape),
    /// Hollow symbols of this shape, not joined.
    Hollow(Shape),
}

/// Shape of a symbol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Shape {
    Disc,
    Square,
    Diamond,
    Triangle,
    InvertedTriangle,
}

impl Shape {
    /// Corners in units of the symbol's half width, y downwards; none for a disc.
    fn corners(self) -> &'static [Point] {
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
    fn pattern(self) -> &'static [f64] {
        match self {
            Self::Dashed => &[1.6 * UNITS, 1.0 * UNITS],
            Self::Dotted => &[0.4 * UNITS, 0.8 * UNITS],
            _ => &[],
        }
    }

    fn is_symbol(self) -> bool {
        matches!(self, Self::Dots | Self::Circles | Self::Crosses | Self::Hollow(_))
    }

    fn width(self) -> u32 {
        match self {
            Self::Thin => 3,
            Self::Thick => 9,
            _ => 5,
        }
    }
}

/// Points with one style and one entry in the legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Entry in the legend; equal ones of several panels share one. Empty for none.
    pub label: String,
    /// Colour.
    pub colour: Colour,
    /// Line or symbol.
    pub mark: Mark,
    /// Points in the units of the axes; `None` interrupts a line.
    pub points: Vec<Option<(f64, f64)>>,
}

/// A shaded interval of the x axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Entry in the legend; empty for none.
    pub label: String,
    /// Colour, drawn pale.
    pub colour: Colour,
    /// Start, in units of the x axis.
    pub from: f64,
    /// End, in units of the x axis.
    pub to: f64,
}

/// A vertical line with a label over the panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// Label; empty for none.
    pub label: String,
    /// Colour.
    pub colour: Colour,
    /// Line style.
    pub mark: Mark,
    /// Place, in units of the x axis.
    pub at: f64,
}

/// One pair of axes. Neighbours with the same x axis share it.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
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
}

/// A figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Heading, and name for screen readers.
    pub title: String,
    /// Line under the heading, such as a statement that the data are synthetic; empty for none.
    pub subtitle: String,
    /// What the figure shows, for screen readers.
    pub description: String,
    /// Width, mm.
    pub width_mm: f64,
    /// Panels from top to bottom.
    pub panels: Vec<Panel>,
}

/// The figure as SVG; the same figure always gives the same bytes.
#[must_use]
pub fn svg(figure: &Figure) -> String {
    let layout = Layout::of(figure);
    let size = ((figure.width_mm * UNITS).round() as u32, (layout.height * UNITS).round() as u32);
    let mut drawn = String::new();
    {
        let mut canvas = Canvas { back: SVGBackend::with_string(&mut drawn, size) };
        canvas.rectangle(&Area { left: 0.0, top: 0.0, right: f64::from(size.0), bottom: f64::from(size.1) }, RGBColor(255, 255, 255), 1.0);
        heading(&mut canvas, figure, &layout);
        for placed in &layout.panels {
            panel(&mut canvas, placed);
        }
        let _ = canvas.back.present(); // closes the tags; writing into a string cannot fail
    }
    let body = drawn.split_once('>').map_or("", |(_, body)| body);
    let (width, height) = (size.0, size.1);
    let (title, description) = (escaped(&figure.title), escaped(&format!("{} {}", figure.description, figure.subtitle)));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{title}\" width=\"{:.2}mm\" height=\"{:.2}mm\" viewBox=\"0 0 {width} {height}\">\n\
         <title>{title}</title>\n<desc>{}</desc>{body}",
        f64::from(width) / UNITS,
        f64::from(height) / UNITS,
        description.trim(),
    )
}

/// Text as XML takes it: control characters have no place in it.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') { ' ' } else { c }).collect()
}

fn escaped(text: &str) -> String {
    html_escape::encode_safe(&printable(text)).into_owned()
}

/// What the figures draw with; places in canvas units.
struct Canvas<'a> {
    back: SVGBackend<'a>,
}

// Drawing into a string cannot fail, so the results of the back end are dropped below.
impl Canvas<'_> {
    fn line(&mut self, points: &[Point], colour: RGBColor, width: u32) {
        let mut whole: Vec<(i32, i32)> = points.iter().map(|p| (p.0.round() as i32, p.1.round() as i32)).collect();
        whole.dedup();
        if whole.len() == 1 {
            whole.push(whole[0]);
        }
        let _ = self.back.draw_path(whole, &colour.stroke_width(width));
    }

    fn rectangle(&mut self, area: &Area, colour: RGBColor, opacity: f64) {
        let style = ShapeStyle { color: colour.mix(opacity), filled: true, stroke_width: 0 };
        let _ = self.back.draw_rect((area.left as i32, area.top as i32), (area.right as i32, area.bottom as i32), &style, true);
    }

    fn polygon(&mut self, corners: &[Point], colour: RGBColor) {
        let whole: Vec<(i32, i32)> = corners.iter().map(|p| (p.0.round() as i32, p.1.round() as i32)).collect();
        let _ = self.back.fill_polygon(whole, &colour.filled());
    }

    fn circle(&mut self, at: Point, radius: u32, colour: RGBColor, filled: bool) {
        let style = ShapeStyle { color: colour.to_rgba(), filled, stroke_width: 4 };
        let _ = self.back.draw_circle((at.0.round() as i32, at.1.round() as i32), radius, &style, filled);
    }

    fn text(&mut self, text: &str, at: Point, size_mm: f64, anchor: Pos, bold: bool, upwards: bool) {
        /// plotters divides the size by this before it writes it.
        const PLOTTERS_FACTOR: f64 = 1.24;
        let font = ("sans-serif", size_mm * UNITS * PLOTTERS_FACTOR).into_font();
        let font = if bold { font.style(FontStyle::Bold) } else { font };
        let font = if upwards { font.transform(FontTransform::Rotate270) } else { font };
        let style = TextStyle::from(font).pos(anchor);
        let _ = self.back.draw_text(&printable(text), &style, (at.0.round() as i32, at.1.round() as i32));
    }
}

fn heading(canvas: &mut Canvas, figure: &Figure, layout: &Layout) {
    let left = Pos::new(HPos::Left, VPos::Center);
    let (x, y) = (EDGE_MM * UNITS, (EDGE_MM + LINE_MM / 2.0) * UNITS);
    canvas.text(&figure.title, (x, y), TITLE_MM, left, true, false);
    if !figure.subtitle.is_empty() {
        canvas.text(&figure.subtitle, (x, y + LINE_MM * UNITS), TEXT_MM, left, false, false);
    }
    for (entry, x, y) in &layout.legend {
        let (x, y) = (x * UNITS, y * UNITS);
        match *entry {
            Entry::Series(_, colour, mark) => {
                let (middle, ends) = ([Some((x + 3.0 * UNITS, y))], [Some((x, y)), Some((x + 6.0 * UNITS, y))]);
                let sample = Area { left: x, right: x + 6.0 * UNITS, top: y, bottom: y };
                if !mark.is_symbol() {
                    let line = if let Mark::Joined(_) = mark { Mark::Line } else { mark };
                    series(canvas, &ends, colour, line, &sample);
                }
                if mark.is_symbol() || matches!(mark, Mark::Joined(_)) {
                    series(canvas, &middle, colour, mark, &sample);
                }
            }
            Entry::Band(_, colour) => {
                canvas.rectangle(&Area { left: x, right: x + 6.0 * UNITS, top: y - UNITS, bottom: y + UNITS }, colour.rgb(), BAND_OPACITY);
            }
        }
        canvas.text(entry.label(), (x + 7.0 * UNITS, y), TEXT_MM, left, false, false);
    }
}

/// Pale enough for lines and grid to stay readable.
const BAND_OPACITY: f64 = 0.22;

fn panel(canvas: &mut Canvas, placed: &Placed) {
    let (panel, area) = (placed.panel, &placed.area);
    for band in &panel.bands {
        let (Some(from), Some(to)) = (placed.x.place(band.from), placed.x.place(band.to)) else { continue };
        let (left, right) = (from.min(to).max(area.left), from.max(to).min(area.right));
        if left < right {
            canvas.rectangle(&Area { left, right, ..*area }, band.colour.rgb(), BAND_OPACITY);
        }
    }
    axes(canvas, placed);
    for (rule, row) in panel.rules.iter().zip(&placed.rows) {
        let Some(x) = placed.x.place(rule.at).filter(|x| *x >= area.left && *x <= area.right) else { continue };
        series(canvas, &[Some((x, area.bottom)), Some((x, area.top))], rule.colour, rule.mark, area);
        if let Some(row) = row {
            let (left, right) = label_span(rule, &placed.x);
            let y = area.top - (0.6 + *row as f64 * (SMALL_MM + 0.6)) * UNITS;
            canvas.text(&rule.label, ((left + right) / 2.0, y), SMALL_MM, Pos::new(HPos::Center, VPos::Bottom), false, false);
        }
    }
    for s in &panel.series {
        let points: Vec<Option<Point>> = s.points.iter().map(|p| p.and_then(|(x, y)| Some((placed.x.place(x)?, placed.y.place(y)?)))).collect();
        series(canvas, &points, s.colour, s.mark, area);
    }
}

/// Grid, frame, ticks, labels.
fn axes(canvas: &mut Canvas, placed: &Placed) {
    const GRID: RGBColor = RGBColor(0xDD, 0xDD, 0xDD);
    const FRAME: RGBColor = RGBColor(0x33, 0x33, 0x33);
    let area = &placed.area;
    for tick in placed.x.ticks(X_TICKS_MM * UNITS) {
        let Some(x) = placed.x.place(tick.value) else { continue };
        let length = if tick.label.is_some() { TICK_MM } else { TICK_MM / 2.0 } * UNITS;
        if tick.label.is_some() {
            canvas.line(&[(x, area.top), (x, area.bottom)], GRID, 2);
        }
        canvas.line(&[(x, area.bottom), (x, area.bottom + length)], FRAME, 3);
        if let Some(label) = tick.label.filter(|_| placed.last) {
            canvas.text(&label, (x, area.bottom + (TICK_MM + 0.6) * UNITS), TEXT_MM, Pos::new(HPos::Center, VPos::Top), false, false);
        }
    }
    for tick in placed.y.ticks(Y_TICKS_MM * UNITS) {
        let Some(y) = placed.y.place(tick.value) else { continue };
        let length = if tick.label.is_some() { TICK_MM } else { TICK_MM / 2.0 } * UNITS;
        if tick.label.is_some() {
            canvas.line(&[(area.left, y), (area.right, y)], GRID, 2);
        }
        canvas.line(&[(area.left - length, y), (area.left, y)], FRAME, 3);
        if let Some(label) = tick.label {
            canvas.text(&label, (area.left - (TICK_MM + 0.6) * UNITS, y), TEXT_MM, Pos::new(HPos::Right, VPos::Center), false, false);
        }
    }
    let corners = [(area.left, area.top), (area.right, area.top), (area.right, area.bottom), (area.left, area.bottom), (area.left, area.top)];
    canvas.line(&corners, FRAME, 3);
    let middle = (area.top + area.bottom) / 2.0;
    canvas.text(&placed.panel.y.label, ((EDGE_MM + TEXT_MM / 2.0) * UNITS, middle), TEXT_MM, Pos::new(HPos::Center, VPos::Center), false, true);
    if placed.last {
        let y = area.bottom + (TICK_MM + 0.6 + LINE_MM) * UNITS;
        canvas.text(&placed.panel.x.label, ((area.left + area.right) / 2.0, y), TEXT_MM, Pos::new(HPos::Center, VPos::Top), false, false);
    }
}

/// Points of the canvas as line or symbols, inside an area.
fn series(canvas: &mut Canvas, points: &[Option<Point>], colour: Colour, mark: Mark, area: &Area) {
    let rgb = colour.rgb();
    for run in path::runs(points.iter().copied()) {
        let run = path::thinned(&run, COLUMN);
        match mark {
            Mark::Dots | Mark::Circles | Mark::Crosses | Mark::Hollow(_) => {
                for point in run.into_iter().filter(|p| area.holds(*p)) {
                    symbol(canvas, point, mark, rgb);
                }
            }
            Mark::Line | Mark::Thin | Mark::Thick | Mark::Dashed | Mark::Dotted | Mark::Joined(_) => {
                for piece in path::clipped(&run, area) {
                    for dash in path::dashed(&piece, mark.pattern()) {
                        canvas.line(&dash, rgb, mark.width());
                    }
                }
            }
        }
        if let Mark::Joined(_) = mark {
            for point in points.iter().flatten().filter(|p| area.holds(**p)) {
                symbol(canvas, *point, mark, rgb);
            }
        }
    }
}

fn symbol(canvas: &mut Canvas, (x, y): Point, mark: Mark, colour: RGBColor) {
    const ARM: f64 = 0.8 * UNITS;
    match mark {
        Mark::Circles => canvas.circle((x, y), ARM as u32, colour, false),
        Mark::Crosses => {
            canvas.line(&[(x - ARM, y - ARM), (x + ARM, y + ARM)], colour, 4);
            canvas.line(&[(x - ARM, y + ARM), (x + ARM, y - ARM)], colour, 4);
        }
        Mark::Joined(shape) => shaped(canvas, (x, y), ARM, shape, colour, true),
        Mark::Hollow(shape) => shaped(canvas, (x, y), ARM, shape, colour, false),
        _ => canvas.circle((x, y), 4, colour, true),
    }
}

/// A symbol, hollow ones white inside.
fn shaped(canvas: &mut Canvas, (x, y): Point, half_width: f64, shape: Shape, colour: RGBColor, full: bool) {
    const WHITE: RGBColor = RGBColor(255, 255, 255);
    let mut outline: Vec<Point> = shape.corners().iter().map(|(a, b)| (x + a * half_width, y + b * half_width)).collect();
    let Some(first) = outline.first().copied() else {
        canvas.circle((x, y), half_width as u32, if full { colour } else { WHITE }, true);
        canvas.circle((x, y), half_width as u32, colour, false);
        return;
    };
    canvas.polygon(&outline, if full { colour } else { WHITE });
    outline.push(first);
    canvas.line(&outline, colour, 4);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(points: Vec<Option<(f64, f64)>>, title: &str) -> Figure {
        let series = Series { label: title.to_owned(), colour: Colour::Blue, mark: Mark::Line, points };
        let rule = Rule { label: title.to_owned(), colour: Colour::Grey, mark: Mark::Dashed, at: 0.5 };
        let x = Axis::linear("x").between(0.0, 1.0);
        let y = Axis::linear(title).between(0.0, 1.0);
        let panel = Panel { x, y, height_mm: 30.0, series: vec![series], bands: Vec::new(), rules: vec![rule] };
        Figure { title: title.to_owned(), subtitle: title.to_owned(), description: title.to_owned(), width_mm: FULL_WIDTH_MM, panels: vec![panel] }
    }

    /// The lines of a colour, as lists of coordinates.
    fn lines(svg: &str, colour: &str) -> Vec<String> {
        let of = |l: &&str| l.starts_with("<polyline") && l.contains(colour) && l.contains("stroke-width=\"5\"");
        svg.lines().filter(of).filter_map(|l| l.split("points=\"").nth(1)).map(str::to_owned).collect()
    }

    #[test]
    fn text_from_files_is_escaped_everywhere() {
        let drawn = svg(&figure(vec![Some((0.0, 0.0)), Some((1.0, 1.0))], "<script>\"a\" & 'b'</script>\u{1}"));
        assert!(!drawn.contains("<script") && !drawn.contains("\"a\"") && !drawn.contains("& ") && !drawn.contains('\u{1}'));
        assert!(drawn.matches("&lt;script&gt;").count() >= 6);
    }

    #[test]
    fn the_figure_has_its_width_in_millimetres_and_a_name() {
        let drawn = svg(&figure(vec![], "a name"));
        assert!(drawn.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"a name\" width=\"170.00mm\""));
        assert!(drawn.contains("viewBox=\"0 0 2550 ") && drawn.contains("<title>a name</title>") && drawn.contains("<desc>"));
    }

    #[test]
    fn gaps_and_values_that_are_no_numbers_split_a_line() {
        let points =
            vec![Some((0.0, 0.1)), Some((0.2, 0.1)), None, Some((0.4, 0.1)), Some((0.5, 0.1)), Some((0.6, f64::NAN)), Some((0.7, 0.1)), Some((0.8, 0.1))];
        let drawn = svg(&figure(points, ""));
        assert_eq!(lines(&drawn, "#0072B2").len(), 3);
    }

    #[test]
    fn a_line_is_cut_at_the_frame_and_not_bent() {
        let drawn = svg(&figure(vec![Some((0.0, -1.0)), Some((1.0, 2.0))], ""));
        let line = lines(&drawn, "#0072B2").remove(0);
        let frame = lines(&drawn.replace("stroke-width=\"3\"", "stroke-width=\"5\""), "#333333").into_iter().find(|l| l.matches(',').count() == 5).unwrap();
        let numbers = |text: &str| text.split([',', ' ', '"']).filter_map(|n| n.parse::<f64>().ok()).collect::<Vec<_>>();
        let (line, frame) = (numbers(&line), numbers(&frame));
        let (left, top, right, bottom) = (frame[0], frame[1], frame[4], frame[5]);
        let third = (right - left) / 3.0;
        let expected = [left + third, bottom, right - third, top];
        assert!(line.iter().zip(expected).all(|(found, expected)| (found - expected).abs() <= 1.0), "{line:?} {expected:?}");
    }

    #[test]
    fn a_million_points_are_drawn_in_few_bytes() {
        let points = (0..1_000_000).map(|i| Some((f64::from(i) * 1e-6, f64::from(i % 1000 * 7919 % 1000) * 1e-3))).collect();
        let drawn = svg(&figure(points, ""));
        assert!(drawn.len() < 60_000, "{}", drawn.len());
    }

    #[test]
    fn the_same_figure_gives_the_same_bytes_also_in_one_column() {
        let narrow = Figure { width_mm: COLUMN_WIDTH_MM, ..figure(vec![Some((0.0, 0.5)), Some((1.0, 0.5))], "t") };
        assert_eq!(svg(&narrow), svg(&narrow));
        assert!(svg(&narrow).contains("width=\"85.00mm\""));
    }
}
