//! Drawing of lines, symbols, error bars and ribbons.

use super::canvas::Canvas;
use super::elements::{ErrorBar, Ribbon, Series};
use super::layout::PanelLayout;
use super::path::{self, CanvasArea, CanvasPoint};
use super::style::{Colour, Mark, MarkerShape};
use super::style::{Rgb, WHITE};
use super::style::{SHADING_OPACITY, UNITS_PER_MM};
use portable_math as math;

/// Width, in canvas units, of the columns in which the points of a line are thinned: one pixel.
const THINNING_COLUMN: f64 = 4.0;
/// Half width of a symbol, canvas units.
const SYMBOL_HALF_WIDTH: f64 = 0.8 * UNITS_PER_MM;
/// Smallest allowed radius, in canvas units, of the dot that marks a point without neighbours on a line.
const MIN_DOT_HALF_WIDTH: u32 = 4;
/// Half width, in canvas units, of the cap at the end of an error bar.
const CAP_HALF_WIDTH: f64 = 0.7 * UNITS_PER_MM;
/// Width of the line of an error bar, canvas units.
const ERROR_BAR_WIDTH: u32 = 3;

/// Draws the error bars of a series and then the series on top of them.
pub(super) fn draw_series(canvas: &mut Canvas, placed: &PanelLayout, series: &Series) {
    for bar in &series.error_bars {
        draw_error_bar(canvas, placed, *bar, series.colour.rgb());
    }
    let points: Vec<Option<CanvasPoint>> =
        series.points.iter().map(|p| p.and_then(|p| placed.canvas_point(p))).collect();
    draw_marks(canvas, &points, series.colour, series.mark, &placed.area);
}

/// Draws canvas points as line or symbols, clipped to an area.
pub(super) fn draw_marks(
    canvas: &mut Canvas,
    points: &[Option<CanvasPoint>],
    colour: Colour,
    mark: Mark,
    area: &CanvasArea,
) {
    let rgb = colour.rgb();
    for whole in path::split_at_gaps(points.iter().copied()) {
        let run = path::thin_points(&whole, THINNING_COLUMN);
        match mark {
            Mark::Dots | Mark::Circles | Mark::Crosses | Mark::Hollow(_) => {
                for point in run.into_iter().filter(|p| area.contains(*p)) {
                    draw_symbol(canvas, point, mark, rgb);
                }
            }
            Mark::Edged => draw_edged_line(canvas, &run, rgb, area),
            _ => {
                // a single point between two gaps is drawn as a dot
                if let [alone] = run.as_slice()
                    && area.contains(*alone)
                {
                    canvas.draw_circle(*alone, mark.line_width().max(MIN_DOT_HALF_WIDTH), rgb, true);
                }
                for piece in path::clip_line(&run, area) {
                    for dash in path::split_into_dashes(&piece, mark.dash_pattern()) {
                        canvas.draw_line(&dash, rgb, mark.line_width());
                    }
                }
            }
        }
        if let Mark::Joined(_) = mark {
            for point in whole.iter().filter(|p| area.contains(**p)) {
                draw_symbol(canvas, *point, mark, rgb);
            }
        }
    }
}

/// Draws a line on top of a wider white line. Dots are added if points are far apart or if there is only one.
fn draw_edged_line(canvas: &mut Canvas, run: &[CanvasPoint], colour: Rgb, area: &CanvasArea) {
    const DOT: u32 = 5;
    const EDGE: u32 = 3;
    const APART: f64 = 4.0 * DOT as f64;
    let pieces = path::clip_line(run, area);
    let apart = run.len() < 2
        || run.windows(2).any(|pair| math::hypot(pair[1].0 - pair[0].0, pair[1].1 - pair[0].1) > APART);
    let inside = || run.iter().filter(|p| apart && area.contains(**p));
    for (rgb, extra) in [(WHITE, EDGE), (colour, 0)] {
        for piece in &pieces {
            canvas.draw_line(piece, rgb, 4 + 2 * extra);
        }
        for point in inside() {
            canvas.draw_circle(*point, DOT + extra, rgb, true);
        }
    }
}

fn draw_symbol(canvas: &mut Canvas, (x, y): CanvasPoint, mark: Mark, colour: Rgb) {
    match mark {
        Mark::Circles => canvas.draw_circle((x, y), SYMBOL_HALF_WIDTH as u32, colour, false),
        Mark::Crosses => {
            for (dx, dy) in [SYMBOL_HALF_WIDTH, -SYMBOL_HALF_WIDTH].map(|dy| (SYMBOL_HALF_WIDTH, dy)) {
                canvas.draw_line(&[(x - dx, y - dy), (x + dx, y + dy)], colour, 4);
            }
        }
        Mark::Joined(shape) => draw_shape(canvas, (x, y), shape, colour, colour),
        Mark::Hollow(shape) => draw_shape(canvas, (x, y), shape, colour, WHITE),
        _ => canvas.draw_circle((x, y), 4, colour, true),
    }
}

/// Draws a symbol whose outline has one colour and whose inside has another.
fn draw_shape(canvas: &mut Canvas, (x, y): CanvasPoint, shape: MarkerShape, colour: Rgb, inside: Rgb) {
    let corner = |(a, b): &CanvasPoint| (x + a * SYMBOL_HALF_WIDTH, y + b * SYMBOL_HALF_WIDTH);
    let mut outline: Vec<CanvasPoint> = shape.corners().iter().map(corner).collect();
    let Some(first) = outline.first().copied() else {
        canvas.draw_circle((x, y), SYMBOL_HALF_WIDTH as u32, inside, true);
        canvas.draw_circle((x, y), SYMBOL_HALF_WIDTH as u32, colour, false);
        return;
    };
    canvas.fill_polygon(&outline, inside, 1.0);
    outline.push(first);
    canvas.draw_line(&outline, colour, 4);
}

/// Draws an error bar. An end outside the axes, or at or below zero on a logarithmic axis, is clipped and has
/// no cap.
fn draw_error_bar(canvas: &mut Canvas, placed: &PanelLayout, bar: ErrorBar, colour: Rgb) {
    let (x, y) = (&placed.x, &placed.y);
    let (from, to, across) = match bar {
        ErrorBar::Horizontal { y: at, from, to } => {
            let Some(at) = y.canvas_position(at) else { return };
            let end = |end| Some((x.canvas_position_or_low(end)?, at));
            (end(from), end(to), (0.0, CAP_HALF_WIDTH))
        }
        ErrorBar::Vertical { x: at, from, to } => {
            let Some(at) = x.canvas_position(at) else { return };
            let end = |end| Some((at, y.canvas_position_or_low(end)?));
            (end(from), end(to), (CAP_HALF_WIDTH, 0.0))
        }
    };
    let (Some(from), Some(to)) = (from, to) else { return };
    let Some((a, b)) = placed.area.clip(from, to) else { return };
    canvas.draw_line(&[a, b], colour, ERROR_BAR_WIDTH);
    for (cut, end) in [(a, from), (b, to)] {
        if cut == end && is_strictly_inside(&placed.area, end) {
            let cap = [(end.0 - across.0, end.1 - across.1), (end.0 + across.0, end.1 + across.1)];
            canvas.draw_line(&cap, colour, ERROR_BAR_WIDTH);
        }
    }
}

fn is_strictly_inside(area: &CanvasArea, (x, y): CanvasPoint) -> bool {
    x > area.left && x < area.right && y > area.top && y < area.bottom
}

/// Fills the area between the lower and the upper curve of a ribbon.
pub(super) fn draw_ribbon(canvas: &mut Canvas, placed: &PanelLayout, ribbon: &Ribbon) {
    let corners = |(x, low, high): (f64, f64, f64)| {
        let [low, high] = [low, high].map(|end| placed.y.canvas_position_or_low(end));
        Some((placed.x.canvas_position(x)?, low?, high?))
    };
    let placed_points: Vec<_> = ribbon.points.iter().map(|p| p.and_then(corners)).collect();
    let edge = |take: fn((f64, f64, f64)) -> f64| {
        path::split_at_gaps(placed_points.iter().map(|p| p.map(|p| (p.0, take(p)))))
    };
    for (low, high) in edge(|p| p.1).iter().zip(edge(|p| p.2)) {
        let mut outline = path::thin_points(low, THINNING_COLUMN);
        outline.extend(path::thin_points(&high, THINNING_COLUMN).into_iter().rev());
        let outline = path::clip_polygon(&outline, &placed.area);
        if outline.len() > 2 {
            canvas.fill_polygon(&outline, ribbon.colour.rgb(), SHADING_OPACITY);
        }
    }
}
