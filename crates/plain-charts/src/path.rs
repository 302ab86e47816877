//! Lines on the canvas: splitting at gaps, thinning to pixels, clipping and dashes.

use portable_math as math;

/// A point of the canvas.
pub(super) type CanvasPoint = (f64, f64);

/// A rectangle of the canvas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CanvasArea {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl CanvasArea {
    /// Whether a point lies inside or on the edge.
    pub(crate) fn contains(&self, (x, y): CanvasPoint) -> bool {
        x >= self.left && x <= self.right && y >= self.top && y <= self.bottom
    }

    /// The corners, with the first repeated at the end.
    pub(crate) fn outline(&self) -> [CanvasPoint; 5] {
        [
            (self.left, self.top),
            (self.right, self.top),
            (self.right, self.bottom),
            (self.left, self.bottom),
            (self.left, self.top),
        ]
    }

    /// The part of the segment from `a` to `b` inside the area (Liang and Barsky); `None` if it lies outside.
    pub(crate) fn clip(&self, a: CanvasPoint, b: CanvasPoint) -> Option<(CanvasPoint, CanvasPoint)> {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (p, q) in
            [(-dx, a.0 - self.left), (dx, self.right - a.0), (-dy, a.1 - self.top), (dy, self.bottom - a.1)]
        {
            if p == 0.0 {
                if q < 0.0 {
                    return None;
                }
            } else if p < 0.0 {
                enter = enter.max(q / p);
            } else {
                leave = leave.min(q / p);
            }
        }
        let at = |s: f64| (a.0 + s * dx, a.1 + s * dy);
        (enter <= leave)
            .then(|| (if enter > 0.0 { at(enter) } else { a }, if leave < 1.0 { at(leave) } else { b }))
    }
}

/// Splits points at gaps (`None`) into runs.
pub(super) fn split_at_gaps(points: impl Iterator<Item = Option<CanvasPoint>>) -> Vec<Vec<CanvasPoint>> {
    let mut runs = vec![Vec::new()];
    for point in points {
        match (point, runs.last_mut()) {
            (Some(point), Some(run)) => run.push(point),
            _ => runs.push(Vec::new()),
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// Thins a line: in every column of the given width that has more than four points, only the first, lowest,
/// highest and last point stay. The line looks the same, and its number of points is bounded by the width of
/// the canvas.
pub(super) fn thin_points(run: &[CanvasPoint], width: f64) -> Vec<CanvasPoint> {
    let column = |p: &CanvasPoint| (p.0 / width).floor();
    let mut kept = Vec::new();
    for group in run.chunk_by(|a, b| column(a) == column(b)) {
        if group.len() <= 4 {
            kept.extend_from_slice(group);
            continue;
        }
        let by_height = |i: &usize, j: &usize| group[*i].1.total_cmp(&group[*j].1);
        let last = group.len() - 1;
        let mut keep = vec![0, last];
        keep.extend((0..group.len()).min_by(by_height));
        keep.extend((0..group.len()).max_by(by_height));
        keep.sort_unstable();
        keep.dedup();
        kept.extend(keep.into_iter().map(|i| group[i]));
    }
    kept
}

/// Maximum number of points by which [`remove_flat_points`] advances at once, which bounds its search. At
/// most one point less is left out between two points that stay.
const MOST_FLAT_POINTS: usize = 64;

/// A line without its flat points. A point is flat if it lies within half a canvas unit of the straight line
/// between its neighbours that stay, and if the line does not turn back there. Flat points differ from the
/// straight line only by rounding to canvas units, and would take most of the bytes of a page.
pub(super) fn remove_flat_points(line: &[(i32, i32)]) -> Vec<(i32, i32)> {
    let is_flat = |from: usize, to: usize| {
        let vector = |i: usize| (f64::from(line[i].0 - line[from].0), f64::from(line[i].1 - line[from].1));
        let (dx, dy) = vector(to);
        let length = dx * dx + dy * dy;
        length > 0.0
            && (from + 1..to).all(|i| {
                let ((x, y), (next_x, next_y)) = (vector(i), vector(i + 1));
                let (along, next) = (x * dx + y * dy, next_x * dx + next_y * dy);
                let across = x * dy - y * dx;
                4.0 * across * across <= length && 0.0 <= along && along <= next
            })
    };
    let mut kept: Vec<(i32, i32)> = line.first().copied().into_iter().collect();
    let mut from = 0;
    while from + 1 < line.len() {
        let last = (from + MOST_FLAT_POINTS).min(line.len() - 1);
        let to = (from + 2..=last).rev().find(|to| is_flat(from, *to)).unwrap_or(from + 1);
        kept.push(line[to]);
        from = to;
    }
    kept
}

/// The pieces of a run that lie inside an area; a run is a line through consecutive points.
pub(super) fn clip_line(run: &[CanvasPoint], area: &CanvasArea) -> Vec<Vec<CanvasPoint>> {
    let mut pieces: Vec<Vec<CanvasPoint>> = Vec::new();
    for pair in run.windows(2) {
        let Some((a, b)) = area.clip(pair[0], pair[1]) else { continue };
        match pieces.last_mut().filter(|piece| piece.last() == Some(&a)) {
            Some(piece) => piece.push(b),
            None => pieces.push(vec![a, b]),
        }
    }
    pieces
}

/// The part of a polygon inside an area (Sutherland and Hodgman).
pub(super) fn clip_polygon(corners: &[CanvasPoint], area: &CanvasArea) -> Vec<CanvasPoint> {
    let depths: [&dyn Fn(CanvasPoint) -> f64; 4] =
        [&|p| p.0 - area.left, &|p| area.right - p.0, &|p| p.1 - area.top, &|p| area.bottom - p.1];
    depths.iter().fold(corners.to_vec(), |corners, depth| {
        let next = corners.iter().cycle().skip(1);
        let sides = corners.iter().zip(next);
        sides.flat_map(|(a, b)| clip_polygon_side(*a, *b, depth(*a), depth(*b))).flatten().collect()
    })
}

/// The corners that the side from `a` to `b` adds to the clipped polygon: `a` if it is inside, and the point
/// where the side crosses the clipping edge, if it does. A depth is the distance of a point from that edge,
/// negative outside.
fn clip_polygon_side(a: CanvasPoint, b: CanvasPoint, depth_a: f64, depth_b: f64) -> [Option<CanvasPoint>; 2] {
    let crosses = (depth_a < 0.0) != (depth_b < 0.0);
    let share = depth_a / (depth_a - depth_b);
    let crossing = crosses.then_some((a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1)));
    [(depth_a >= 0.0).then_some(a), crossing]
}

/// Cuts a line into dashes. `pattern` lists the lengths of dashes and gaps in turn, canvas units; it is empty
/// for a full line.
pub(super) fn split_into_dashes(line: &[CanvasPoint], pattern: &[f64]) -> Vec<Vec<CanvasPoint>> {
    let Some(first) = line.first().filter(|_| pattern.iter().sum::<f64>() > 0.0) else {
        return vec![line.to_vec()];
    };
    let (mut dashes, mut current) = (Vec::new(), vec![*first]);
    let (mut turn, mut left) = (0, pattern[0]);
    for pair in line.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let length = math::hypot(b.0 - a.0, b.1 - a.1);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let point = (a.0 + (b.0 - a.0) * done / length, a.1 + (b.1 - a.1) * done / length);
            if turn % 2 == 0 {
                current.push(point);
                dashes.push(std::mem::take(&mut current));
            } else {
                current = vec![point];
            }
            turn += 1;
            left = pattern[turn % pattern.len()];
        }
        left -= length - done;
        if turn % 2 == 0 {
            current.push(b);
        }
    }
    if turn % 2 == 0 && current.len() > 1 {
        dashes.push(current);
    }
    dashes
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: CanvasArea = CanvasArea { left: 0.0, top: 0.0, right: 10.0, bottom: 10.0 };

    #[test]
    fn a_segment_is_cut_at_the_axes_and_keeps_its_slope() {
        assert_eq!(
            AREA.clip((-10.0, -5.0), (20.0, 10.0)),
            Some(((0.0, 0.0), (20.0, 10.0))).map(|_| ((0.0, 0.0), (10.0, 5.0)))
        );
        assert_eq!(AREA.clip((2.0, 3.0), (4.0, 5.0)), Some(((2.0, 3.0), (4.0, 5.0))));
        assert_eq!(AREA.clip((-1.0, 5.0), (-2.0, 6.0)), None);
        assert_eq!(AREA.clip((5.0, -4.0), (5.0, 40.0)), Some(((5.0, 0.0), (5.0, 10.0))));
    }

    #[test]
    fn a_line_that_leaves_and_returns_is_two_pieces() {
        let pieces = clip_line(&[(1.0, 5.0), (2.0, 15.0), (3.0, 5.0), (4.0, 5.0)], &AREA);
        assert_eq!(pieces, [vec![(1.0, 5.0), (1.5, 10.0)], vec![(2.5, 10.0), (3.0, 5.0), (4.0, 5.0)]]);
    }

    #[test]
    fn a_polygon_is_cut_at_the_axes() {
        assert_eq!(
            clip_polygon(&[(2.0, 2.0), (12.0, 2.0), (2.0, 7.0)], &AREA),
            [(2.0, 2.0), (10.0, 2.0), (10.0, 3.0), (2.0, 7.0)]
        );
        assert_eq!(clip_polygon(&[(-5.0, -5.0), (15.0, -5.0), (15.0, 15.0), (-5.0, 15.0)], &AREA).len(), 4);
        assert_eq!(
            clip_polygon(&[(1.0, 1.0), (2.0, 1.0), (2.0, 2.0)], &AREA),
            [(1.0, 1.0), (2.0, 1.0), (2.0, 2.0)]
        );
        assert_eq!(clip_polygon(&[(11.0, 1.0), (12.0, 1.0), (12.0, 2.0)], &AREA), []);
        assert_eq!(clip_polygon(&[], &AREA), []);
    }

    #[test]
    fn gaps_split_and_long_runs_keep_their_extremes() {
        assert_eq!(
            split_at_gaps([None, Some((0.0, 1.0)), None, None, Some((2.0, 1.0))].into_iter()),
            [vec![(0.0, 1.0)], vec![(2.0, 1.0)]]
        );
        let run: Vec<CanvasPoint> = (0..1000)
            .map(|i| {
                (
                    f64::from(i) / 500.0,
                    if i == 700 {
                        9.0
                    } else if i == 300 {
                        -9.0
                    } else {
                        0.0
                    },
                )
            })
            .collect();
        let kept = thin_points(&run, 1.0);
        assert!(kept.len() <= 8 && kept.contains(&(1.4, 9.0)) && kept.contains(&(0.6, -9.0)));
    }

    #[test]
    fn points_on_a_straight_line_go_and_corners_stay() {
        let slope: Vec<(i32, i32)> = (0..=60).map(|i| (i, (f64::from(i) * 0.3).round() as i32)).collect();
        assert_eq!(remove_flat_points(&slope), [(0, 0), (60, 18)]);
        assert_eq!(remove_flat_points(&[(0, 0), (9, 0), (0, 0)]), [(0, 0), (9, 0), (0, 0)]);
        let corner = [(0, 0), (5, 0), (10, 0), (10, 7), (10, 14), (10, 3), (20, 3)];
        assert_eq!(remove_flat_points(&corner), [(0, 0), (10, 0), (10, 14), (10, 3), (20, 3)]);
        let wave: Vec<(i32, i32)> =
            (0..500).map(|i| (i, (40.0 * (0.05 * f64::from(i)).sin()).round() as i32)).collect();
        let kept = remove_flat_points(&wave);
        assert!(kept.len() < 150, "{}", kept.len());
        for pair in kept.windows(2) {
            let [(x0, y0), (x1, y1)] = [pair[0], pair[1]].map(|(x, y)| (f64::from(x), f64::from(y)));
            let inside = wave.iter().map(|&(x, y)| (f64::from(x), f64::from(y)));
            for (x, y) in inside.filter(|(x, _)| (x0..=x1).contains(x)) {
                let off =
                    (y - y0 - (y1 - y0) * (x - x0) / (x1 - x0)) / (1.0_f64).hypot((y1 - y0) / (x1 - x0));
                assert!(off.abs() <= 0.5 + 1e-12, "{x}: {off}");
            }
        }
    }

    #[test]
    fn dashes_have_the_lengths_of_the_pattern() {
        let dashes = split_into_dashes(&[(0.0, 0.0), (7.0, 0.0), (10.0, 0.0)], &[3.0, 2.0]);
        assert_eq!(dashes, [vec![(0.0, 0.0), (3.0, 0.0)], vec![(5.0, 0.0), (7.0, 0.0), (8.0, 0.0)]]);
        assert_eq!(split_into_dashes(&[(0.0, 0.0), (7.0, 0.0)], &[]), [vec![(0.0, 0.0), (7.0, 0.0)]]);
    }
}
