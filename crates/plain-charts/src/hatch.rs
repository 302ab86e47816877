//! Hatched cells of a map; the pattern tells why a value is missing.

use super::axis::value_span;
use super::canvas::Canvas;
use super::elements::{Hatch, HatchPattern};
use super::layout::PanelLayout;
use super::path::{self, CanvasArea, CanvasPoint};
use super::style::UNITS_PER_MM;
use super::style::{FRAME, NO_VALUE, Rgb};

const HATCH_GREY: Rgb = (0x66, 0x66, 0x66);
/// Smallest spacing, in canvas units, of the lines of a pattern. The spacing is doubled until there are at
/// most [`MOST_STROKES`] lines, which limits the file size.
const HATCH_SPACING: f64 = 1.3 * UNITS_PER_MM;
const MOST_STROKES: usize = 1200;
/// Largest gap, canvas units, across which two strokes of one line, or two areas of one row, are joined.
const TOUCHING_DISTANCE: f64 = 1.5;
const STROKE_WIDTH: u32 = 3;

impl HatchPattern {
    /// Unit vectors along the lines of the pattern, with y pointing down.
    fn directions(self) -> &'static [CanvasPoint] {
        const D: f64 = std::f64::consts::FRAC_1_SQRT_2;
        match self {
            Self::Plain => &[],
            Self::Rising => &[(D, -D)],
            Self::Falling => &[(D, D)],
            Self::Level | Self::Dotted | Self::Dashed => &[(1.0, 0.0)],
            Self::Upright | Self::DashedUpright => &[(0.0, 1.0)],
            Self::Crossed => &[(D, -D), (D, D)],
            Self::Checked => &[(1.0, 0.0), (0.0, 1.0)],
        }
    }

    /// Lengths of dashes and gaps in turn, canvas units; empty for full lines.
    fn dashes(self) -> &'static [f64] {
        match self {
            Self::Dotted => &[0.25 * UNITS_PER_MM, 1.55 * UNITS_PER_MM],
            Self::Dashed | Self::DashedUpright => &[1.2 * UNITS_PER_MM, 0.8 * UNITS_PER_MM],
            _ => &[],
        }
    }
}

/// Draws the cells of a hatch.
pub(super) fn draw_hatch(canvas: &mut Canvas, placed: &PanelLayout, hatch: &Hatch) {
    let inside = |[x_from, x_to, y_from, y_to]: &[f64; 4]| {
        let [left, right] = [x_from, x_to].map(|x| placed.x.canvas_position_or_low(*x));
        let frame = &placed.area;
        let end = |y: f64, beyond: f64| {
            if y.is_finite() { placed.y.canvas_position_or_low(y) } else { Some(beyond) }
        };
        let (bottom, top) = (end(*y_from, frame.bottom)?, end(*y_to, frame.top)?);
        let area = CanvasArea {
            left: left?.max(frame.left),
            right: right?.min(frame.right),
            top: top.max(frame.top),
            bottom: bottom.min(frame.bottom),
        };
        (area.left < area.right && area.top < area.bottom).then_some(area)
    };
    let areas: Vec<CanvasArea> = hatch.cells.iter().filter_map(inside).collect();
    if placed.panel.heat_map.as_ref().is_none_or(|heat| !heat.has_values()) {
        // a heat map with values already fills missing cells with grey
        merge_areas(&areas).iter().for_each(|area| canvas.fill_rectangle(area, NO_VALUE, 1.0));
    }
    draw_strokes(canvas, &areas, hatch.pattern);
}

/// Joins touching areas with the same top and bottom.
fn merge_areas(areas: &[CanvasArea]) -> Vec<CanvasArea> {
    let mut sorted = areas.to_vec();
    sorted.sort_by(|a, b| {
        a.top.total_cmp(&b.top).then(a.bottom.total_cmp(&b.bottom)).then(a.left.total_cmp(&b.left))
    });
    let rows = sorted
        .chunk_by(|a, b| a.top == b.top && a.bottom == b.bottom && b.left <= a.right + TOUCHING_DISTANCE);
    rows.filter_map(|row| Some(CanvasArea { right: row.last()?.right, ..*row.first()? })).collect()
}

/// Draws the sample of a pattern in the legend.
pub(super) fn draw_hatch_sample(canvas: &mut Canvas, area: &CanvasArea, pattern: HatchPattern) {
    canvas.fill_rectangle(area, NO_VALUE, 1.0);
    draw_strokes(canvas, &[*area], pattern);
    canvas.draw_line(&area.outline(), FRAME, 2);
}

/// Draws the lines of a pattern inside the areas; a line continues from one area into a touching area.
fn draw_strokes(canvas: &mut Canvas, areas: &[CanvasArea], pattern: HatchPattern) {
    for direction in pattern.directions() {
        let mut spacing = HATCH_SPACING;
        let mut found = hatch_lines(areas, *direction, spacing);
        while found.len() > MOST_STROKES {
            spacing *= 2.0;
            found = hatch_lines(areas, *direction, spacing);
        }
        for (a, b) in found {
            for dash in path::split_into_dashes(&[a, b], pattern.dashes()) {
                canvas.draw_line(&dash, HATCH_GREY, STROKE_WIDTH);
            }
        }
    }
}

/// Segments of equidistant parallel lines inside the areas; touching segments are joined.
fn hatch_lines(areas: &[CanvasArea], (dx, dy): CanvasPoint, spacing: f64) -> Vec<(CanvasPoint, CanvasPoint)> {
    let across = |(x, y): CanvasPoint| x * -dy + y * dx;
    let along = |(x, y): CanvasPoint| x * dx + y * dy;
    let mut pieces: Vec<(i64, f64, f64)> = Vec::new();
    for area in areas {
        let corners = area.outline();
        let (low, high) = value_span(corners.map(across).into_iter());
        let (start, end) = value_span(corners.map(along).into_iter());
        for number in (low / spacing).ceil() as i64..=(high / spacing).floor() as i64 {
            let offset = number as f64 * spacing;
            let at = |s: f64| (s * dx - offset * dy, s * dy + offset * dx);
            if let Some((a, b)) = area.clip(at(start), at(end)) {
                pieces.push((number, along(a), along(b)));
            }
        }
    }
    pieces.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let joined = pieces.chunk_by(|a, b| a.0 == b.0 && b.1 <= a.2 + TOUCHING_DISTANCE);
    let piece = |run: &[(i64, f64, f64)]| {
        let (number, start, _) = *run.first()?;
        let offset = number as f64 * spacing;
        let at = |s: f64| (s * dx - offset * dy, s * dy + offset * dx);
        Some((at(start), at(run.iter().map(|piece| piece.2).fold(start, f64::max))))
    };
    joined.filter_map(piece).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn area(left: f64, right: f64) -> CanvasArea {
        CanvasArea { left, right, top: 0.0, bottom: 10.0 }
    }

    #[test]
    fn cells_that_touch_have_one_ground() {
        let joined = merge_areas(&[
            area(10.0, 20.0),
            area(30.0, 40.0),
            area(0.0, 10.0),
            CanvasArea { top: 2.0, ..area(20.0, 30.0) },
        ]);
        assert_eq!(
            joined.iter().map(|a| (a.left, a.right, a.top)).collect::<Vec<_>>(),
            [(0.0, 20.0, 0.0), (30.0, 40.0, 0.0), (20.0, 30.0, 2.0)]
        );
    }

    #[test]
    fn lines_stay_inside_and_join_where_cells_touch() {
        let level = |areas: &[CanvasArea]| hatch_lines(areas, (1.0, 0.0), 4.0);
        assert_eq!(
            level(&[area(0.0, 10.0)]),
            [((0.0, 0.0), (10.0, 0.0)), ((0.0, 4.0), (10.0, 4.0)), ((0.0, 8.0), (10.0, 8.0))]
        );
        assert_eq!(level(&[area(10.0, 20.0), area(0.0, 10.0)])[1], ((0.0, 4.0), (20.0, 4.0)));
        assert_eq!(level(&[area(0.0, 10.0), area(20.0, 30.0)]).len(), 6);
        for (a, b) in hatch_lines(&[area(0.0, 10.0)], HatchPattern::Rising.directions()[0], 3.0) {
            let inside = |(x, y): CanvasPoint| {
                (-1e-9..=10.0 + 1e-9).contains(&x) && (-1e-9..=10.0 + 1e-9).contains(&y)
            };
            assert!(
                inside(a) && inside(b) && (a.0 + a.1 - b.0 - b.1).abs() < 1e-9 && b.1 < a.1 + 1e-9,
                "{a:?} {b:?}"
            );
        }
    }
}
