//! Motion of a recorded head as a cubic spline with continuous acceleration.

use super::smoothing_spline::{SmoothingSpline, fit_smoothing_spline};
use crate::model::HeadMotion;
use crate::recording::FrameGrid;
use portable_math as math;
use serde::Serialize;
use std::sync::Arc;

/// An instant counts as a knot if it precedes the knot by less than this number of frames, so that no tiny
/// piece remains. The third derivative jumps at the knot; the effect of the jump on the position is 1e18
/// times smaller within this time than within a whole frame.
const NEAR_FRAMES: f64 = 1e-6;

/// Position of the head as cubics between knots; only the third derivative jumps at a knot. The outermost
/// cubics extend beyond the first and the last knot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeadSpline {
    grid: FrameGrid,
    first_frame: usize,
    knots_s: Vec<f64>,
    /// Taylor coefficients of the position about the first knot of each piece, m/s^k, in rising order.
    pieces: Vec<[f64; 4]>,
    /// For each frame from the first knot on: index of the piece that contains the frame.
    piece_of_frame: Vec<usize>,
    /// The smooth curve to which the cubics are fitted, if any.
    #[serde(skip)]
    curve: Option<Arc<SmoothingSpline>>,
}

impl HeadSpline {
    /// Cubic spline through the values of a smooth curve at the frames `knots`, which may depend on the
    /// number of frames in a piece of the curve.
    ///
    /// The curve is fitted to `points`: at least three frames of `grid` in rising order, each with a
    /// position, m. For the fit, the positions are averaged in blocks of `block` frames.
    pub(super) fn from_points(
        grid: &FrameGrid,
        points: &[(usize, f64)],
        block: usize,
        knots: impl Fn(f64) -> Vec<usize>,
    ) -> Self {
        let (frames, positions): (Vec<usize>, Vec<f64>) = points.iter().copied().unzip();
        let curve = fit_smoothing_spline(&frames, &positions, block);
        let knots = knots(1.0 / curve.pieces_per_frame());
        Self::follow_curve(grid, curve, &knots)
    }

    /// Cubic spline through the values of a smooth curve at the frames `knots`.
    fn follow_curve(grid: &FrameGrid, curve: SmoothingSpline, knots: &[usize]) -> Self {
        let places: Vec<f64> = knots.iter().map(|&frame| curve.position(frame as f64)).collect();
        let ends = [knots[0], knots[knots.len() - 1]].map(|frame| curve.curvature(frame as f64));
        Self { curve: Some(Arc::new(curve)), ..Self::interpolate_positions(grid, knots, &places, ends) }
    }

    /// Cubic spline through positions, m, with given second derivatives at the ends, m/frame^2.
    fn interpolate_positions(grid: &FrameGrid, frames: &[usize], positions: &[f64], ends: [f64; 2]) -> Self {
        let curvatures = solve_curvatures(frames, positions, ends);
        let knots_s: Vec<f64> = frames.iter().map(|&frame| grid.time_s(frame)).collect();
        let per_frame =
            [1.0, grid.frame_rate_hz, math::powi(grid.frame_rate_hz, 2), math::powi(grid.frame_rate_hz, 3)];
        let mut pieces = Vec::with_capacity(frames.len() - 1);
        let mut piece_of_frame = Vec::with_capacity(frames[frames.len() - 1] - frames[0]);
        for (i, ends) in frames.windows(2).enumerate() {
            let h = (ends[1] - ends[0]) as f64;
            let (position, curvature) = (&positions[i..i + 2], &curvatures[i..i + 2]);
            let slope = (position[1] - position[0]) / h - h * (2.0 * curvature[0] + curvature[1]) / 6.0;
            let in_frames =
                [position[0], slope, curvature[0] / 2.0, (curvature[1] - curvature[0]) / (6.0 * h)];
            pieces.push(std::array::from_fn(|k| in_frames[k] * per_frame[k]));
            piece_of_frame.extend(std::iter::repeat_n(i, ends[1] - ends[0]));
        }
        Self { grid: *grid, first_frame: frames[0], knots_s, pieces, piece_of_frame, curve: None }
    }

    /// The spline through the positions at the knots, m, after a map that is nearly linear over the distance
    /// between two knots.
    pub(crate) fn map_positions(&self, map: impl Fn(f64) -> f64) -> Self {
        /// Distance over which the slope of the map is taken, m.
        const NEAR_M: f64 = 1e-5;
        let places: Vec<f64> = self.knots_s.iter().map(|t| map(self.motion_at(*t).position_m)).collect();
        let ends = self.span_s().map(|t| {
            let motion = self.motion_at(t);
            let slope = (map(motion.position_m + NEAR_M) - map(motion.position_m - NEAR_M)) / (2.0 * NEAR_M);
            slope * motion.acceleration_m_per_s2 / math::powi(self.grid.frame_rate_hz, 2)
        });
        Self::interpolate_positions(&self.grid, &self.knot_frames(), &places, ends)
    }

    /// Frames of the knots.
    fn knot_frames(&self) -> Vec<usize> {
        let frame = |time_s: &f64| ((time_s - self.grid.start_s) * self.grid.frame_rate_hz).round() as usize;
        self.knots_s.iter().map(frame).collect()
    }

    /// Number of coefficients of the smooth curve; 0 if there is no curve.
    pub(crate) fn coefficient_count(&self) -> usize {
        self.curve.as_ref().map_or(0, |curve| curve.coefficients.len())
    }

    /// Derivatives of the position at a frame with respect to the coefficients of the smooth curve: index of
    /// the first nonzero derivative, and the values from this index on.
    pub(crate) fn position_weights(&self, frame: usize) -> (usize, [f64; 6]) {
        self.curve.as_ref().map_or((0, [0.0; 6]), |curve| curve.position_weights(frame as f64))
    }

    /// Multiplies a row vector, with one number per coefficient of the smooth curve, by the covariance matrix
    /// of the coefficients, m^2, in place.
    pub(crate) fn multiply_covariance(&self, row: &mut [f64]) {
        if let Some(curve) = &self.curve {
            curve.multiply_covariance(row);
        }
    }

    /// The spline through a smooth curve that differs from the own one by errors as they are expected; `draw`
    /// returns independent numbers with the standard normal distribution. Without a curve, the same spline.
    pub(crate) fn draw_like(&self, draw: impl FnMut() -> f64) -> Self {
        let Some(curve) = &self.curve else { return self.clone() };
        Self::follow_curve(&self.grid, curve.draw_like(draw), &self.knot_frames())
    }

    /// Standard deviation of the tracked positions about the smooth curve, m, if there is a curve.
    pub(crate) fn noise_m(&self) -> Option<f64> {
        self.curve.as_ref().map(|curve| curve.variance_m2.sqrt())
    }

    /// Times of the first and the last knot, s.
    #[must_use]
    pub fn span_s(&self) -> [f64; 2] {
        [self.knots_s[0], self.knots_s[self.knots_s.len() - 1]]
    }

    /// Whether the knots cover the time of a run.
    pub(crate) fn covers(&self, start_s: f64, stop_s: f64) -> bool {
        let ([first, last], near_s) = (self.span_s(), NEAR_FRAMES / self.grid.frame_rate_hz);
        first - near_s <= start_s && stop_s <= last + near_s
    }

    /// Motion of the head at time `t`, s.
    #[inline]
    #[must_use]
    pub fn motion_at(&self, t: f64) -> HeadMotion {
        let ([a, b, c, d], x) = self.piece_at(t);
        HeadMotion {
            position_m: a + x * (b + x * (c + x * d)),
            velocity_m_per_s: b + x * (2.0 * c + x * 3.0 * d),
            acceleration_m_per_s2: 2.0 * c + 6.0 * d * x,
        }
    }

    /// Taylor coefficients of the velocity about `t` in its piece, m/s^(k+1); higher coefficients are zero.
    #[inline]
    pub(super) fn velocity_series(&self, t: f64) -> [f64; 3] {
        let ([_, b, c, d], x) = self.piece_at(t);
        [b + x * (2.0 * c + x * 3.0 * d), 2.0 * c + 6.0 * d * x, 3.0 * d]
    }

    /// The first knot after `t`, s; `None` after the last.
    #[inline]
    pub(super) fn next_knot_s(&self, t: f64) -> Option<f64> {
        let next = self.knots_s[self.piece_index(t) + 1];
        (next > t).then_some(next)
    }

    /// Coefficients of the piece that contains `t`, and the time since its first knot, s.
    #[inline]
    fn piece_at(&self, t: f64) -> (&[f64; 4], f64) {
        let index = self.piece_index(t);
        (&self.pieces[index], t - self.knots_s[index])
    }

    #[inline]
    fn piece_index(&self, t: f64) -> usize {
        let frame = (t - self.grid.start_s) * self.grid.frame_rate_hz + NEAR_FRAMES - self.first_frame as f64;
        // the cast turns negative numbers into 0
        self.piece_of_frame[(frame as usize).min(self.piece_of_frame.len() - 1)]
    }
}

/// Second derivatives, m/frame^2, at the knots of the cubic spline through `positions`; `first` and `last`
/// are the second derivatives at the two ends.
fn solve_curvatures(frames: &[usize], positions: &[f64], [first, last]: [f64; 2]) -> Vec<f64> {
    let h = |i: usize| (frames[i + 1] - frames[i]) as f64;
    let slope = |i: usize| (positions[i + 1] - positions[i]) / h(i);
    let count = frames.len();
    let mut found = vec![first; count];
    found[count - 1] = last;
    // forward elimination: each row keeps the factor of the next curvature and the right-hand side
    let mut above = [0.0, first];
    let mut rows = Vec::with_capacity(count);
    for i in 1..count - 1 {
        let pivot = 2.0 * (h(i - 1) + h(i)) - h(i - 1) * above[0];
        let right = 6.0 * (slope(i) - slope(i - 1)) - h(i - 1) * above[1];
        above = [h(i) / pivot, right / pivot];
        rows.push(above);
    }
    for i in (1..count - 1).rev() {
        let [next, right] = rows[i - 1];
        found[i] = right - next * found[i + 1];
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: FrameGrid = FrameGrid { start_s: 0.25, frame_rate_hz: 500.0, frames: 101 };

    fn all(motion: impl Fn(f64) -> f64) -> Vec<(usize, f64)> {
        (0..GRID.frames).map(|i| (i, motion(GRID.time_s(i)))).collect()
    }

    fn smoothed(points: &[(usize, f64)]) -> HeadSpline {
        let knots: Vec<usize> = points.iter().map(|point| point.0).collect();
        HeadSpline::from_points(&GRID, points, 1, |_| knots.clone())
    }

    /// A cubic is reproduced by a spline with any number of pieces, with or without gaps.
    #[test]
    fn a_cubic_motion_is_reproduced() {
        let (p, v, a, j) = (0.02, -0.3, 4.0, 150.0);
        let exact = |t: f64| {
            let x = t - 0.3;
            [p + x * (v + x * (a + x * j)), v + x * (2.0 * a + 3.0 * x * j), 2.0 * a + 6.0 * j * x]
        };
        let gappy: Vec<(usize, f64)> = all(|t| exact(t)[0])
            .into_iter()
            .filter(|(i, _)| ![3, 20, 21, 22, 57, 58, 98].contains(i))
            .collect();
        let spline = smoothed(&gappy);
        let mut worst = [0.0f64; 3];
        for i in 0..=1000 {
            let t = 0.25 + 0.2 * f64::from(i) / 1000.0;
            let (found, exact) = (spline.motion_at(t), exact(t));
            let found = [found.position_m, found.velocity_m_per_s, found.acceleration_m_per_s2];
            worst = std::array::from_fn(|k| worst[k].max((found[k] - exact[k]).abs()));
        }
        let bounds = [1e-13, 1e-10, 1e-7]; // rounding of 0.5 m, divided by a frame's time, and by its square
        assert!(worst.iter().zip(bounds).all(|(worst, bound)| *worst < bound), "{worst:?}");
    }

    /// A cubic B-spline with knots at frames and zero curvature at its ends is the unique natural spline
    /// through its points.
    #[test]
    fn unsmoothed_a_spline_on_the_frames_is_reproduced() {
        let bump = |t: f64| {
            let weights = [1.0, -4.0, 6.0, -4.0, 1.0];
            let ramp = |k: usize| ((t - GRID.time_s(38 + 6 * k)) * 100.0).max(0.0).powi(3);
            0.01 * weights.iter().enumerate().map(|(k, w)| w * ramp(k)).sum::<f64>() + 0.2 * t
        };
        let points: Vec<(usize, f64)> =
            all(bump).into_iter().filter(|(i, _)| ![36, 47, 48, 61].contains(i)).collect();
        let (frames, positions): (Vec<usize>, Vec<f64>) = points.into_iter().unzip();
        let spline = HeadSpline::interpolate_positions(&GRID, &frames, &positions, [0.0; 2]);
        for i in 0..=1000 {
            let t = 0.25 + 0.2 * f64::from(i) / 1000.0;
            let error = spline.motion_at(t).position_m - bump(t);
            assert!(error.abs() < 1e-13, "at {t}: {error:e}");
        }
    }

    /// A linear map is exact. A map whose slope changes by a hundredth over the motion is exact to 10 nm.
    #[test]
    fn positions_are_mapped() {
        let spline = smoothed(&all(|t| 0.01 * (30.0 * t).sin()));
        for (bend, tolerance) in [(0.0, 1e-14), (0.3, 1e-8)] {
            let map = |x: f64| 0.5 + x * (0.97 + bend * x);
            let mapped = spline.map_positions(map);
            for i in 0..=1000 {
                let t = 0.25 + 0.2 * f64::from(i) / 1000.0;
                let error = mapped.motion_at(t).position_m - map(spline.motion_at(t).position_m);
                assert!(error.abs() < tolerance, "at {t}: {error:e}");
            }
        }
    }

    #[test]
    fn position_velocity_and_acceleration_are_continuous_at_the_knots() {
        let noisy = |t: f64| 0.01 * (30.0 * t).sin() + 1e-5 * (1e7 * t).sin();
        let spline = smoothed(&all(noisy));
        for knot in 1..100 {
            let t = GRID.time_s(knot);
            let (before, after) = (spline.motion_at(t - 2.1e-6 / 500.0), spline.motion_at(t));
            let moved = 2.1e-6 / 500.0 * after.velocity_m_per_s;
            assert!((after.position_m - before.position_m - moved).abs() < 1e-15);
            assert!((after.velocity_m_per_s - before.velocity_m_per_s).abs() < 1e-7);
            assert!((after.acceleration_m_per_s2 - before.acceleration_m_per_s2).abs() < 1e-5);
        }
    }

    #[test]
    fn the_knots_follow_one_another_and_gaps_have_none() {
        let points: Vec<(usize, f64)> =
            all(|t| t * t).into_iter().filter(|(i, _)| *i >= 2 && ![10, 11].contains(i)).collect();
        let spline = smoothed(&points);
        let (mut t, mut knots) = (0.0, vec![]);
        while let Some(next) = spline.next_knot_s(t) {
            knots.push(next);
            t = next;
        }
        let expected: Vec<f64> = points[1..].iter().map(|(i, _)| GRID.time_s(*i)).collect();
        assert_eq!(knots, expected);
        assert_eq!(spline.span_s(), [GRID.time_s(2), GRID.time_s(100)]);
        assert_eq!(
            spline.next_knot_s(GRID.time_s(20) - 1e-12),
            Some(GRID.time_s(21)),
            "no sliver of a piece is left over"
        );
        assert!(
            spline.covers(GRID.time_s(2), GRID.time_s(100))
                && !spline.covers(GRID.time_s(1), 0.3)
                && !spline.covers(0.3, 0.451)
        );
    }
}
