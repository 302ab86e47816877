//! Lines, symbols, error bars and ribbons of a panel, on the canvas.

use super::canvas::Canvas;
use super::colours::{Rgb, WHITE};
use super::elements::{Bar, Ribbon, Series};
use super::layout::Placed;
use super::path::{self, Area, Point};
use super::sizes::{BAND_OPACITY, UNITS};
use super::style::{Colour, Mark, Shape};
use crate::math;

/// Width of a column in which a line keeps four points, canvas units: one pixel.
const COLUMN: f64 = 4.0;
/// Half width of a symbol, canvas units.
const ARM: f64 = 0.8 * UNITS;
/// Least half width of a point that stands alone in a line, canvas units.
const LEAST_DOT: u32 = 4;
/// Half width of the cap at the end of an error bar, canvas units.
const CAP: f64 = 0.7 * UNITS;
/// Width of the line of an error bar, canvas units.
const BAR_WIDTH: u32 = 3;

/// A series with its error bars, which lie under its symbols.
pub(super) fn series(canvas: &mut Canvas, placed: &Placed, series: &Series) {
    for bar in &series.bars {
        error_bar(canvas, placed, *bar, series.colour.rgb());
    }
    let points: Vec<Option<Point>> = series
        .points
        .iter()
        .map(|p| p.and_then(|(x, y)| Some((placed.x.place(x)?, placed.y.place(y)?))))
        .collect();
    marked(canvas, &points, series.colour, series.mark, &placed.area);
}

/// Points of the canvas as line or symbols, inside an area.
pub(super) fn marked(canvas: &mut Canvas, points: &[Option<Point>], colour: Colour, mark: Mark, area: &Area) {
    let rgb = colour.rgb();
    for whole in path::runs(points.iter().copied()) {
        let run = path::thinned(&whole, COLUMN);
        match mark {
            Mark::Dots | Mark::Circles | Mark::Crosses | Mark::Hollow(_) => {
                for point in run.into_iter().filter(|p| area.holds(*p)) {
                    symbol(canvas, point, mark, rgb);
                }
            }
            Mark::Edged => edged(canvas, &run, rgb, area),
            Mark::Line
            | Mark::Thin
            | Mark::Thick
            | Mark::Dashed
            | Mark::Dotted
            | Mark::ThinDashed
            | Mark::Joined(_) => {
                // (a point between two gaps is no line, and must be seen)
                if let [alone] = run.as_slice()
                    && area.holds(*alone)
                {
                    canvas.circle(*alone, mark.width().max(LEAST_DOT), rgb, true);
                }
                for piece in path::clipped(&run, area) {
                    for dash in path::dashed(&piece, mark.pattern()) {
                        canvas.line(&dash, rgb, mark.width());
                    }
                }
            }
        }
        if let Mark::Joined(_) = mark {
            for point in whole.iter().filter(|p| area.holds(**p)) {
                symbol(canvas, *point, mark, rgb);
            }
        }
    }
}

/// A line over a wider white one, with its points where they stand apart or alone.
fn edged(canvas: &mut Canvas, run: &[Point], colour: Rgb, area: &Area) {
    const DOT: u32 = 5;
    const EDGE: u32 = 3;
    const APART: f64 = 4.0 * DOT as f64;
    let pieces = path::clipped(run, area);
    let apart = run.len() < 2
        || run.windows(2).any(|pair| math::hypot(pair[1].0 - pair[0].0, pair[1].1 - pair[0].1) > APART);
    let inside = || run.iter().filter(|p| apart && area.holds(**p));
    for (rgb, extra) in [(WHITE, EDGE), (colour, 0)] {
        for piece in &pieces {
            canvas.line(piece, rgb, 4 + 2 * extra);
        }
        for point in inside() {
            canvas.circle(*point, DOT + extra, rgb, true);
        }
    }
}

fn symbol(canvas: &mut Canvas, (x, y): Point, mark: Mark, colour: Rgb) {
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
fn shaped(canvas: &mut Canvas, (x, y): Point, half_width: f64, shape: Shape, colour: Rgb, full: bool) {
    let mut outline: Vec<Point> =
        shape.corners().iter().map(|(a, b)| (x + a * half_width, y + b * half_width)).collect();
    let Some(first) = outline.first().copied() else {
        canvas.circle((x, y), half_width as u32, if full { colour } else { WHITE }, true);
        canvas.circle((x, y), half_width as u32, colour, false);
        return;
    };
    canvas.polygon(&outline, if full { colour } else { WHITE }, 1.0);
    outline.push(first);
    canvas.line(&outline, colour, 4);
}

/// An error bar; an end beyond the axes, or at or below zero on a logarithmic one, is cut there and has no
/// cap.
fn error_bar(canvas: &mut Canvas, placed: &Placed, bar: Bar, colour: Rgb) {
    let (x, y) = (&placed.x, &placed.y);
    let (ends, across) = match bar {
        Bar::Horizontal { y: at, from, to } => {
            let Some(at) = y.place(at) else { return };
            ([x.place_or_low(from), x.place_or_low(to)].map(|end| end.map(|end| (end, at))), (0.0, CAP))
        }
        Bar::Vertical { x: at, from, to } => {
            let Some(at) = x.place(at) else { return };
            ([y.place_or_low(from), y.place_or_low(to)].map(|end| end.map(|end| (at, end))), (CAP, 0.0))
        }
    };
    let [Some(from), Some(to)] = ends else { return };
    let Some((a, b)) = placed.area.clip(from, to) else { return };
    canvas.line(&[a, b], colour, BAR_WIDTH);
    for (cut, end) in [(a, from), (b, to)] {
        if cut == end && strictly_inside(&placed.area, end) {
            canvas.line(
                &[(end.0 - across.0, end.1 - across.1), (end.0 + across.0, end.1 + across.1)],
                colour,
                BAR_WIDTH,
            );
        }
    }
}

fn strictly_inside(area: &Area, (x, y): Point) -> bool {
    x > area.left && x < area.right && y > area.top && y < area.bottom
}

/// The surface between two curves.
pub(super) fn ribbon(canvas: &mut Canvas, placed: &Placed, ribbon: &Ribbon) {
    let corners = |(x, low, high): (f64, f64, f64)| {
        Some((placed.x.place(x)?, placed.y.place_or_low(low)?, placed.y.place_or_low(high)?))
    };
    let placed_points: Vec<_> = ribbon.points.iter().map(|p| p.and_then(corners)).collect();
    let edge = |take: fn((f64, f64, f64)) -> f64| {
        path::runs(placed_points.iter().map(|p| p.map(|p| (p.0, take(p)))))
    };
    for (low, high) in edge(|p| p.1).iter().zip(edge(|p| p.2)) {
        let mut outline = path::thinned(low, COLUMN);
        outline.extend(path::thinned(&high, COLUMN).into_iter().rev());
        let outline = path::polygon_inside(&outline, &placed.area);
        if outline.len() > 2 {
            canvas.polygon(&outline, ribbon.colour.rgb(), BAND_OPACITY);
        }
    }
}
