//! Least-squares fit of a line and a parabola to the path of the tip; each stroke has its own height.

use super::super::motion::find_trimmed_ends;
use crate::recording::Recording;
use crate::recording::channel::{NORMAL_MEDIAN, ReversalInstants, median_or_zero};
use portable_math as math;

/// Smallest mean square of the fitted parabola `q`, relative to the fourth power of the standard deviation of
/// the positions along the sweep. With a smaller value, the positions have only two values and show no
/// curvature.
const LEAST_BEND: f64 = 1e-6;

/// A curve `y = height(stroke) + slope x + bend q(x)`. The parabola `q` is `x^2` minus its least-squares
/// line, so that `slope` is the mean slope of a curved path.
pub(super) struct GlassLine {
    pub slope: f64,
    /// Slope of the curve at `centre_m`. It differs from `slope` where the tip spends more time
    /// at one end of a curved path.
    pub middle_slope: f64,
    pub bend_per_m: f64,
    pub centre_m: [f64; 2],
    /// Standard deviation of the positions along the sweep, m.
    pub x_sd_m: f64,
    /// Sum of the squared distances of the positions from the mean of their stroke, m^2. The variance of
    /// `slope` is the variance of a height divided by this sum.
    pub slope_information_m2: f64,
    /// Sum of the squares of the parabola `q`, m^4: the variance of `bend` is the variance of a height
    /// divided by this sum. Zero if the path shows no curvature.
    pub bend_information_m4: f64,
    /// Marks the points through which the line is fitted.
    pub on_glass: Vec<bool>,
    /// Height of every point above the line, m; infinite in a stroke without a point on the glass.
    pub residuals_m: Vec<f64>,
    /// Number of fitted coefficients.
    pub fitted: usize,
}

/// A point relative to the mean point of its stroke.
struct CentredPoint {
    x: f64,
    x2: f64,
    y: f64,
}

/// Sums over the points of a stroke that lie on the glass.
#[derive(Clone, Copy, Default)]
struct StrokeSums {
    points: f64,
    x: f64,
    x2: f64,
    y: f64,
}

impl GlassLine {
    /// Fits the points for which `on_glass` is true, of which there must be at least one.
    pub(super) fn fit_through(path: &TipPath, on_glass: Vec<bool>) -> Self {
        let used = || path.points.iter().zip(&on_glass).filter(|(_, on)| **on).map(|(point, _)| point);
        let count = used().count() as f64;
        let mean = |of: fn(&TipPoint) -> f64| used().map(of).sum::<f64>() / count;
        let centre_m = [mean(|p| p.x_m), mean(|p| p.y_m)];
        let means = stroke_means(path.strokes, used(), centre_m);
        let centred = |point: &TipPoint| {
            let (mean, x) = (&means[point.stroke], point.x_m - centre_m[0]);
            CentredPoint { x: x - mean.x, x2: x * x - mean.x2, y: point.y_m - centre_m[1] - mean.y }
        };
        let all: Vec<CentredPoint> = path.points.iter().map(centred).collect();
        let fitted = || all.iter().zip(&on_glass).filter(|(_, on)| **on).map(|(point, _)| point);
        let sum = |value: &dyn Fn(&CentredPoint) -> f64| fitted().map(value).sum::<f64>();
        let xx = sum(&|p| p.x * p.x);
        let along = |value: f64| if xx > 0.0 { value / xx } else { 0.0 };
        let (slope, lean) = (along(sum(&|p| p.x * p.y)), along(sum(&|p| p.x * p.x2)));
        let bent = |p: &CentredPoint| p.x2 - lean * p.x;
        let qq = sum(&|p| math::powi(bent(p), 2));
        let qq = if qq > LEAST_BEND * xx * xx / count { qq } else { 0.0 };
        let bend_per_m = if qq > 0.0 { sum(&|p| bent(p) * p.y) / qq } else { 0.0 };
        let spread = used().map(|p| math::powi(p.x_m - centre_m[0], 2)).sum::<f64>() / count;
        Self {
            slope,
            middle_slope: slope - bend_per_m * lean,
            bend_per_m,
            centre_m,
            x_sd_m: spread.sqrt(),
            slope_information_m2: xx,
            bend_information_m4: qq,
            residuals_m: all.iter().map(|p| p.y - slope * p.x - bend_per_m * bent(p)).collect(),
            fitted: means.iter().filter(|mean| mean.points > 0.0).count() + 2,
            on_glass,
        }
    }
}

/// Means of the points of each stroke, relative to `centre_m`; the mean height is infinite in a stroke
/// without a point.
fn stroke_means<'a>(
    strokes: usize,
    points: impl Iterator<Item = &'a TipPoint>,
    centre_m: [f64; 2],
) -> Vec<StrokeSums> {
    let mut sums = vec![StrokeSums::default(); strokes];
    for point in points {
        let (sum, x) = (&mut sums[point.stroke], point.x_m - centre_m[0]);
        sum.points += 1.0;
        sum.x += x;
        sum.x2 += x * x;
        sum.y += point.y_m - centre_m[1];
    }
    for sum in &mut sums {
        *sum = match sum.points {
            0.0 => StrokeSums { y: f64::NEG_INFINITY, ..*sum },
            n => StrokeSums { points: n, x: sum.x / n, x2: sum.x2 / n, y: sum.y / n },
        };
    }
    sums
}

/// Number of blocks of frames for the first line: enough for a robust median slope, few enough to use all
/// pairs.
const SLOPE_BLOCKS: usize = 64;
/// Smallest distance between two blocks for their slope to be used, as a fraction of the travel: noise
/// dominates the slope over a shorter distance.
const OUTLYING_PLACES: f64 = 0.25;
/// A tip farther from the line than this number of standard deviations is off the glass; by chance, a tip on
/// the glass is farther in 1 frame of 16,000.
const NEAR_DEVIATIONS: f64 = 4.0;
/// A tip within this distance of the line always counts as on the glass, m: the rounding of a trace without
/// noise.
const LEAST_DISTANCE_M: f64 = 1e-9;
/// Largest distance of a position from the range of the tip's positions along the sweep, without the
/// outermost hundredth at either end, as a fraction of this range. A position farther out is an outlier.
const BEYOND_STEPS: f64 = 0.1;
/// Maximum number of repetitions of the fit; the frames on the glass rarely change after five.
const MOST_REPETITIONS: usize = 30;

/// Fits a line through the frames with the tip on the glass. The first line has the median slope between
/// blocks of frames, which tolerates a quarter of wrong blocks. The line is then fitted again to the frames
/// near it, until these frames no longer change.
pub(super) fn fit_glass_line(path: &TipPath, travel_m: f64, step_m: f64) -> GlassLine {
    let within = inliers_along_sweep(path);
    let first = distances_from_line(path, median_slope(path, travel_m));
    let mut line = GlassLine::fit_through(path, points_near_line(&first, &within, step_m));
    for _ in 0..MOST_REPETITIONS {
        let on_glass = points_near_line(&line.residuals_m, &within, step_m);
        if on_glass == line.on_glass {
            break;
        }
        line = GlassLine::fit_through(path, on_glass);
    }
    line
}

/// Marks the points that are not outliers along the sweep.
fn inliers_along_sweep(path: &TipPath) -> Vec<bool> {
    let ends = find_trimmed_ends(path.points.iter().map(|point| point.x_m));
    let [low, high] = ends.unwrap_or_default();
    let beyond = BEYOND_STEPS * (high - low);
    path.points.iter().map(|p| p.x_m >= low - beyond && p.x_m <= high + beyond).collect()
}

/// Marks the points whose distance from the line can come from noise or from the step of the heights.
fn points_near_line(distances_m: &[f64], within: &[bool], step_m: f64) -> Vec<bool> {
    let scale = median_or_zero(distances_m.iter().map(|distance| distance.abs())) / NORMAL_MEDIAN;
    let limit = (NEAR_DEVIATIONS * scale.max(step_m)).max(LEAST_DISTANCE_M);
    distances_m.iter().zip(within).map(|(distance, within)| *within && distance.abs() <= limit).collect()
}

/// Height of every point above a line of the given slope through the median point of its stroke, m.
fn distances_from_line(path: &TipPath, slope: f64) -> Vec<f64> {
    path.points_by_stroke()
        .flat_map(|stroke| {
            let height = |point: &TipPoint| point.y_m - slope * point.x_m;
            let middle = median_or_zero(stroke.iter().map(height));
            stroke.iter().map(move |point| height(point) - middle)
        })
        .collect()
}

/// Median slope between blocks of one stroke that are far enough apart (Theil 1950, Sen 1968).
fn median_slope(path: &TipPath, travel_m: f64) -> f64 {
    let length = path.points.len().div_ceil(SLOPE_BLOCKS);
    let mut slopes = vec![];
    for stroke in path.points_by_stroke() {
        let median = |block: &[TipPoint], of: fn(&TipPoint) -> f64| median_or_zero(block.iter().map(of));
        let middle = |block: &[TipPoint]| (median(block, |p| p.x_m), median(block, |p| p.y_m));
        let blocks: Vec<(f64, f64)> = stroke.chunks(length).map(middle).collect();
        for (i, a) in blocks.iter().enumerate() {
            let far = blocks[..i].iter().filter(|b| (a.0 - b.0).abs() > OUTLYING_PLACES * travel_m);
            slopes.extend(far.map(|b| (a.1 - b.1) / (a.0 - b.0)));
        }
    }
    median_or_zero(slopes)
}

/// Maximum number of frames from which the tilt is measured; of a longer recording, only every n-th frame is
/// used. These frames determine the angle far better than needed.
const MOST_FRAMES: usize = 100_000;

/// Position of the tip in a frame in which both coordinates are known.
#[derive(Debug, Clone, Copy)]
pub(super) struct TipPoint {
    /// Index of the frame among the frames that are used.
    pub frame: usize,
    /// Index of the stroke: the number of turns of the head before it.
    pub stroke: usize,
    pub x_m: f64,
    pub y_m: f64,
}

/// The path of the tip.
pub(super) struct TipPath {
    /// Points of the path, in order of frames.
    pub points: Vec<TipPoint>,
    pub strokes: usize,
}

impl TipPath {
    pub(super) fn from_recording(recording: &Recording, instants: &ReversalInstants) -> Self {
        let (grid, traces) = (recording.grid(), recording.traces());
        let turns_s: Vec<f64> = instants.reversals.iter().map(|turn| turn.reversal_s).collect();
        let mut stroke = 0;
        let apart = grid.frames.div_ceil(MOST_FRAMES).max(1);
        let both = traces.tip_x_m.iter().zip(&traces.tip_y_m).step_by(apart).enumerate();
        let points = both.filter_map(|(frame, (x, y))| {
            while turns_s.get(stroke).is_some_and(|turn_s| *turn_s <= grid.time_s(apart * frame)) {
                stroke += 1;
            }
            Some(TipPoint { frame, stroke, x_m: (*x)?, y_m: (*y)? })
        });
        Self { points: points.collect(), strokes: turns_s.len() + 1 }
    }

    /// The points for which `kept` is true.
    pub(super) fn select_points(&self, kept: &[bool]) -> Self {
        let points = self.points.iter().zip(kept).filter(|(_, kept)| **kept).map(|(point, _)| *point);
        Self { points: points.collect(), strokes: self.strokes }
    }

    /// The points of each stroke that has points.
    pub(super) fn points_by_stroke(&self) -> impl Iterator<Item = &[TipPoint]> {
        self.points.chunk_by(|a, b| a.stroke == b.stroke)
    }

    /// Longest travel within a stroke, m, without the outermost positions.
    pub(super) fn travel_m(&self) -> f64 {
        self.points_by_stroke().map(stroke_travel_m).fold(0.0, f64::max)
    }
}

fn stroke_travel_m(stroke: &[TipPoint]) -> f64 {
    find_trimmed_ends(stroke.iter().map(|point| point.x_m)).map_or(0.0, |[low, high]| high - low)
}

/// Maximum number of values from which the correlation of errors is computed. Longer recordings are averaged
/// in groups of frames, which preserves the slow errors that matter for a slope.
const MOST_VALUES: usize = 20_000;
/// Ratio of the largest lag in the sum of correlations to the number of correlated values; the largest lag is
/// then five correlation times (Sokal 1997). Longer lags only add noise.
const WINDOW: f64 = 2.5;
/// Smallest fraction of the variance of the errors that is assumed to remain in the residuals of a fit. For
/// errors that are correlated over the whole recording, the computed fraction would be smaller.
const LEAST_LEFT: f64 = 0.1;

/// Long-run variance of the heights about the line, m^2: the variance of a frame times the number of frames
/// over which errors are correlated. The sum of `n` errors has `n` times this variance.
pub(super) fn long_run_variance(path: &TipPath, line: &GlassLine) -> f64 {
    let group = path.points.len().div_ceil(MOST_VALUES);
    let values = group_averages(path, line, group);
    let present = values.iter().flatten().count() as f64;
    let variance = values.iter().flatten().map(|v| v * v).sum::<f64>() / present;
    if variance <= 0.0 {
        return 0.0;
    }
    let (alike, lags) = correlated_values(&values, variance);
    // each fitted coefficient reduces the covariance at every lag
    let taken = line.fitted as f64 * (1 + 2 * lags) as f64 / present;
    group as f64 * variance * alike / (1.0 - taken).max(LEAST_LEFT)
}

/// Residuals of the frames on the glass, averaged over groups of frames; `None` for a group without such
/// frames.
fn group_averages(path: &TipPath, line: &GlassLine, group: usize) -> Vec<Option<f64>> {
    let first = path.points.first().map_or(0, |point| point.frame);
    let last = path.points.last().map_or(0, |point| point.frame);
    let mut sums = vec![(0.0, 0_usize); (last - first) / group + 1];
    for ((point, residual), on) in path.points.iter().zip(&line.residuals_m).zip(&line.on_glass) {
        if *on {
            let (sum, count) = &mut sums[(point.frame - first) / group];
            *sum += residual;
            *count += 1;
        }
    }
    sums.into_iter().map(|(sum, count)| (count > 0).then(|| sum / count as f64)).collect()
}

/// Number of values over which errors are correlated, at least 1: one plus twice the sum of the correlations.
/// The second number is the largest lag in that sum, [`WINDOW`] times the first.
fn correlated_values(values: &[Option<f64>], variance: f64) -> (f64, usize) {
    let (mut alike, mut lags) = (1.0, 0);
    for lag in 1..values.len() / 2 {
        alike += 2.0 * lag_covariance(values, lag) / variance;
        lags = lag;
        if lag as f64 >= WINDOW * alike {
            break;
        }
    }
    (alike.max(1.0), lags)
}

/// Mean product of two values that are `lag` apart; zero without such a pair.
fn lag_covariance(values: &[Option<f64>], lag: usize) -> f64 {
    let products = values.iter().zip(&values[lag..]).filter_map(|(a, b)| Some((*a)? * (*b)?));
    let (sum, pairs) = products.fold((0.0, 0_usize), |(sum, pairs), product| (sum + product, pairs + 1));
    if pairs == 0 { 0.0 } else { sum / pairs as f64 }
}
