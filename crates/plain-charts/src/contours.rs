//! Labelled contour lines of a heat map at round values.

use super::axis::{AxisScale, CanvasAxis, value_span};
use super::canvas::{Canvas, Lettering, TextAnchor};
use super::heat_map::{HeatMap, colour_fraction};
use super::layout::PanelLayout;
use super::path::{self, CanvasArea, CanvasPoint};
use super::style::{SMALL_MM, UNITS_PER_MM};
use super::style::{readable_on, sample_colour_map};
use super::text::text_width;
use portable_math as math;
use std::collections::BTreeMap;

/// Minimum number of columns and minimum number of rows of a heat map that has contours.
const MIN_GRID_SIZE: usize = 4;
/// Approximate maximum number of contours of a map.
const MOST_LEVELS: f64 = 6.0;
/// Largest allowed range of the four corner values of a cell, as a fraction of the colour range. A larger
/// range is a jump, which contours do not cross. If a plane covers the coarsest map (four by four values),
/// the range in each cell is one third.
const MAX_CELL_SPREAD: f64 = 0.35;
/// Largest allowed ratio of the number of cells with a jump to the number of cells without one. Above this
/// ratio a map is not smooth and has no contours.
const MOST_JUMPS: f64 = 0.15;
/// Width of a contour line, canvas units.
const CONTOUR_WIDTH: u32 = 3;
/// Length, mm, of the shortest contour line that is drawn.
const MIN_CONTOUR_MM: f64 = 2.5;
/// Length, mm, of the shortest contour line that has a label.
const MIN_LABELLED_MM: f64 = 10.0;
/// Smallest allowed distance, mm, of a contour label from another contour label.
const LABELS_APART_MM: f64 = 8.0;
/// Smallest allowed distance, mm, of a contour label from a symbol.
const SYMBOL_APART_MM: f64 = 4.0;

/// A side of a grid cell: column and row of the grid point where it starts, and whether it is vertical.
type GridEdge = (usize, usize, bool);

/// Draws the contours of the heat map of a panel if they are requested.
pub(super) fn draw_contours(canvas: &mut Canvas, placed: &PanelLayout) {
    let Some(heat) = placed.panel.heat_map.as_ref().filter(|h| h.contours) else { return };
    let Some(ends) = heat.value_range() else { return };
    let Some(grid) = ContourGrid::new(heat, placed, ends) else { return };
    let symbols = placed.panel.series.iter().flat_map(|series| series.points.iter().flatten());
    let symbols: Vec<CanvasPoint> = symbols.filter_map(|p| placed.canvas_point(*p)).collect();
    let scale =
        CanvasAxis { scale: AxisScale::Linear, low: ends.0, high: ends.1, from: 0.0, to: MOST_LEVELS };
    let mut labels: Vec<CanvasPoint> = Vec::new();
    for tick in scale.ticks(1.0) {
        let Some(label) = tick.label.filter(|_| tick.value > ends.0 && tick.value < ends.1) else { continue };
        let ground = sample_colour_map(heat.colour_map, colour_fraction(ends, tick.value));
        let ink = readable_on(ground);
        let long = |line: &Vec<CanvasPoint>| polyline_length(line) >= MIN_CONTOUR_MM * UNITS_PER_MM;
        let lines: Vec<Vec<CanvasPoint>> = grid.contour_lines(tick.value).into_iter().filter(long).collect();
        for piece in lines.iter().flat_map(|line| path::clip_line(line, &placed.area)) {
            canvas.draw_line(&piece, ink, CONTOUR_WIDTH);
        }
        let half = (text_width(&label, SMALL_MM) / 2.0 * UNITS_PER_MM, SMALL_MM / 2.0 * UNITS_PER_MM);
        if let Some(at) = find_label_position(&lines, &placed.area, half, &labels, &symbols) {
            let (width, height) = (half.0 + 0.3 * UNITS_PER_MM, half.1);
            let (left, right, top, bottom) = (at.0 - width, at.0 + width, at.1 - height, at.1 + height);
            let behind = CanvasArea { left, right, top, bottom };
            canvas.fill_rectangle(&behind, ground, 1.0);
            canvas.draw_coloured_text(&label, at, Lettering::plain(SMALL_MM, TextAnchor::Centre), ink);
            labels.push(at);
        }
    }
}

/// Position of a contour label: the point of a long contour line that is farthest from other labels. The
/// label must fit inside the axes and keep clear of symbols.
fn find_label_position(
    lines: &[Vec<CanvasPoint>],
    area: &CanvasArea,
    half: CanvasPoint,
    labels: &[CanvasPoint],
    symbols: &[CanvasPoint],
) -> Option<CanvasPoint> {
    let fits = |p: &CanvasPoint| {
        p.0 - half.0 >= area.left
            && p.0 + half.0 <= area.right
            && p.1 - half.1 >= area.top
            && p.1 + half.1 <= area.bottom
    };
    let nearest = |p: CanvasPoint, of: &[CanvasPoint]| {
        of.iter().map(|q| math::hypot(p.0 - q.0, p.1 - q.1)).fold(f64::INFINITY, f64::min)
    };
    let long = lines.iter().filter(|line| polyline_length(line) >= MIN_LABELLED_MM * UNITS_PER_MM);
    // order: from the middle of each line towards its ends, so that the middle wins among equally good points
    let points = long.flat_map(|line| {
        let (before, after) = line.split_at(line.len() / 2);
        after.iter().chain(before.iter().rev()).copied()
    });
    points
        .filter(fits)
        .filter(|p| nearest(*p, symbols) >= SYMBOL_APART_MM * UNITS_PER_MM)
        .map(|p| (nearest(p, labels).min(f64::MAX), p))
        .filter(|(apart, _)| *apart >= LABELS_APART_MM * UNITS_PER_MM)
        .reduce(|best, next| if next.0 > best.0 { next } else { best })
        .map(|(_, p)| p)
}

fn polyline_length(line: &[CanvasPoint]) -> f64 {
    line.windows(2).map(|pair| math::hypot(pair[1].0 - pair[0].0, pair[1].1 - pair[0].1)).sum()
}

/// Canvas positions of the cell centres of a heat map, and the squares between four neighbouring centres that
/// contours may cross.
struct ContourGrid<'a> {
    heat: &'a HeatMap,
    x: Vec<f64>,
    y: Vec<f64>,
    smooth: Vec<(usize, usize)>,
}

impl<'a> ContourGrid<'a> {
    /// The grid of a heat map; `None` if the heat map is too coarse or not smooth.
    fn new(heat: &'a HeatMap, placed: &PanelLayout, ends: (f64, f64)) -> Option<Self> {
        let places = |values: &[f64], axis: &CanvasAxis| {
            values.iter().map(|value| axis.canvas_position(*value)).collect::<Option<Vec<f64>>>()
        };
        let (x, y) = (places(&heat.x, &placed.x)?, places(&heat.y, &placed.y)?);
        if x.len() < MIN_GRID_SIZE || y.len() < MIN_GRID_SIZE {
            return None;
        }
        let mut grid = Self { heat, x, y, smooth: Vec::new() };
        let (mut jumps, within) = (0, |v: f64| v.clamp(ends.0, ends.1));
        for (i, j) in (1..grid.x.len()).flat_map(|i| (1..grid.y.len()).map(move |j| (i - 1, j - 1))) {
            let Some(corners) = grid.corner_values(i, j) else { continue };
            let (low, high) = value_span(corners.into_iter().map(within));
            if high - low > MAX_CELL_SPREAD * (ends.1 - ends.0) {
                jumps += 1;
            } else {
                grid.smooth.push((i, j));
            }
        }
        (f64::from(jumps) <= MOST_JUMPS * grid.smooth.len() as f64).then_some(grid)
    }

    fn value(&self, i: usize, j: usize) -> Option<f64> {
        self.heat.values.get(i)?.get(j).copied().flatten().filter(|v| v.is_finite())
    }

    /// Values at the corners of a square: lower left, lower right, upper left, upper right.
    fn corner_values(&self, i: usize, j: usize) -> Option<[f64; 4]> {
        Some([self.value(i, j)?, self.value(i + 1, j)?, self.value(i, j + 1)?, self.value(i + 1, j + 1)?])
    }

    /// The contour lines of a level, with linear interpolation between cell centres (marching squares, the
    /// two-dimensional case of Lorensen and Cline, 1987). At a saddle, the mean of the four corner values
    /// decides which sides are joined.
    fn contour_lines(&self, level: f64) -> Vec<Vec<CanvasPoint>> {
        let mut next: BTreeMap<GridEdge, Vec<GridEdge>> = BTreeMap::new();
        for (i, j) in self.smooth.iter().copied() {
            let Some([a, b, c, d]) = self.corner_values(i, j) else { continue };
            let above = [a, b, c, d].map(|value| value >= level);
            let [bottom, top, left, right] =
                [(i, j, false), (i, j + 1, false), (i, j, true), (i + 1, j, true)];
            let sides = [(bottom, 0, 1), (top, 2, 3), (left, 0, 2), (right, 1, 3)];
            let crossed = sides.into_iter().filter(|(_, k, l)| above[*k] != above[*l]);
            let crossed: Vec<GridEdge> = crossed.map(|(side, ..)| side).collect();
            let pairs = match crossed.as_slice() {
                [from, to] => vec![(*from, *to)],
                [_, _, _, _] if ((a + b + c + d) / 4.0 >= level) == above[0] => {
                    vec![(bottom, right), (left, top)]
                }
                [_, _, _, _] => vec![(bottom, left), (right, top)],
                _ => continue,
            };
            for (from, to) in pairs {
                next.entry(from).or_default().push(to);
                next.entry(to).or_default().push(from);
            }
        }
        let crossings =
            |line: Vec<GridEdge>| line.into_iter().filter_map(|s| self.edge_crossing(s, level)).collect();
        join_edges(next).into_iter().map(crossings).collect()
    }

    /// The point on a side of a square at which the interpolated value equals the level, canvas coordinates.
    fn edge_crossing(&self, (i, j, upwards): GridEdge, level: f64) -> Option<CanvasPoint> {
        let (k, l) = if upwards { (i, j + 1) } else { (i + 1, j) };
        let (from, to) = (self.value(i, j)?, self.value(k, l)?);
        let share = ((level - from) / (to - from)).clamp(0.0, 1.0);
        let between = |places: &[f64], a: usize, b: usize| places[a] + share * (places[b] - places[a]);
        Some((between(&self.x, i, k), between(&self.y, j, l)))
    }
}

/// Joins connected sides into contour lines: first the open lines, each from one end, then the closed lines.
fn join_edges(mut next: BTreeMap<GridEdge, Vec<GridEdge>>) -> Vec<Vec<GridEdge>> {
    let mut lines = Vec::new();
    let ends: Vec<GridEdge> =
        next.iter().filter(|(_, near)| near.len() == 1).map(|(side, _)| *side).collect();
    let all: Vec<GridEdge> = next.keys().copied().collect();
    for start in ends.into_iter().chain(all) {
        let mut line = vec![start];
        let mut at = start;
        while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
            if let Some(back) = next.get_mut(&to)
                && let Some(same) = back.iter().position(|side| *side == at)
            {
                back.remove(same);
            }
            line.push(to);
            at = to;
        }
        if line.len() > 1 {
            lines.push(line);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::super::elements::Panel;
    use super::*;

    fn placed(values: impl Fn(f64, f64) -> Option<f64>, size: usize) -> (Panel, CanvasAxis) {
        let middles: Vec<f64> = (0..size).map(|i| i as f64).collect();
        let column = |x: &f64| middles.iter().map(|y| values(*x, *y)).collect();
        let heat = HeatMap {
            x: middles.clone(),
            y: middles.clone(),
            values: middles.iter().map(column).collect(),
            contours: true,
            ..HeatMap::default()
        };
        let last = size as f64 - 1.0;
        let axis = CanvasAxis { scale: AxisScale::Linear, low: 0.0, high: last, from: 0.0, to: 100.0 * last };
        (Panel { heat_map: Some(heat), ..Panel::default() }, axis)
    }

    fn lines(
        values: impl Fn(f64, f64) -> Option<f64>,
        size: usize,
        level: f64,
    ) -> Option<Vec<Vec<CanvasPoint>>> {
        let (panel, x) = placed(values, size);
        let mut placed = PanelLayout::new(&panel, (x, (x.low, x.high)), 0.0, true, Vec::new());
        placed.y = x;
        let heat = panel.heat_map.as_ref().unwrap();
        Some(ContourGrid::new(heat, &placed, heat.value_range().unwrap())?.contour_lines(level))
    }

    #[test]
    fn a_line_of_a_plane_is_straight_and_whole() {
        let found = lines(|x, y| Some(x + 2.0 * y), 6, 5.5).unwrap();
        assert_eq!(found.len(), 1);
        for (x, y) in &found[0] {
            assert!((x + 2.0 * y - 550.0).abs() < 1e-9, "{found:?}");
        }
        let [first, last] = [found[0].first().unwrap(), found[0].last().unwrap()];
        assert_eq!([first.0.min(last.0), first.0.max(last.0)], [0.0, 500.0]);
    }

    #[test]
    fn a_hill_has_one_closed_line_and_a_saddle_two_that_do_not_cross() {
        let hill = lines(|x, y| Some(-math::hypot(x - 4.0, y - 4.0)), 9, -2.5).unwrap();
        assert!(hill.len() == 1 && hill[0].first() == hill[0].last(), "{hill:?}");
        for (x, y) in &hill[0] {
            assert!((math::hypot(x - 400.0, y - 400.0) - 250.0).abs() < 15.0);
        }
        let saddle = lines(|x, y| Some((x - 2.5) * (y - 2.5)), 6, 0.1).unwrap();
        assert_eq!(saddle.len(), 2);
    }

    #[test]
    fn no_line_follows_a_jump_or_crosses_a_gap() {
        // a jump by 100 between x = 3 and 4, on a slope along y
        let cliff = |x: f64, y: f64| Some(y + if x > 3.5 { 100.0 } else { 0.0 });
        assert!(lines(cliff, 10, 50.0).unwrap().is_empty());
        assert_eq!(lines(|x, y| Some(x).filter(|_| y != 5.0), 10, 4.5).unwrap().len(), 2);
    }

    #[test]
    fn coarse_and_noisy_maps_have_no_lines() {
        assert!(lines(|x, y| Some(x + y), 3, 1.5).is_none());
        let noise = |x: f64, y: f64| Some((7.0 * x + 5.0 * y) % 11.0);
        assert!(lines(noise, 12, 5.0).is_none());
    }
}
