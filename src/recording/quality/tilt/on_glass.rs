//! Which frames have the tip on the glass: those near the line that most frames lie on.

use super::line::GlassLine;
use super::path::{TipPath, TipPoint};

/// Blocks of frames whose medians give the first line: enough for a steady median of slopes, few enough for
/// all pairs.
const SLOPE_BLOCKS: usize = 64;
/// Least distance of two blocks whose slope counts, as a share of the travel: noise makes the slopes of
/// nearer ones arbitrary.
const OUTLYING_PLACES: f64 = 0.25;
/// Standard deviations from the line within which the tip lies on the glass: 1 frame of 16,000 is lost by
/// chance.
const NEAR_DEVIATIONS: f64 = 4.0;
/// Median of |x| of a standard normal variable.
const NORMAL_MEDIAN: f64 = 0.674_489_75;
/// Least distance that is off the glass, m: below it lies the rounding of a trace without noise.
const LEAST_DISTANCE_M: f64 = 1e-9;
/// Share of the travel that a place may lie beyond it: farther ones are outliers.
const BEYOND_STEPS: f64 = 0.1;
/// Most repetitions; the frames on the glass rarely change after five.
const MOST_REPETITIONS: usize = 30;

/// The line through the frames with the tip on the glass. The first line is the median of the slopes between
/// blocks of frames, which a quarter of wrong blocks does not move; it is then fitted to the frames near it,
/// until these stay the same.
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

/// Which points are no outliers along the sweep.
fn inliers_along_sweep(path: &TipPath) -> Vec<bool> {
    let mut sorted: Vec<f64> = path.points.iter().map(|point| point.x_m).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let end = sorted.len() / 100;
    let (low, high) = (sorted[end], sorted[sorted.len() - 1 - end]);
    let beyond = BEYOND_STEPS * (high - low);
    path.points.iter().map(|p| p.x_m >= low - beyond && p.x_m <= high + beyond).collect()
}

/// The points whose distance from the line is that of noise or of the step in which heights are written.
fn points_near_line(distances_m: &[f64], within: &[bool], step_m: f64) -> Vec<bool> {
    let mut sizes: Vec<f64> = distances_m.iter().map(|distance| distance.abs()).collect();
    let scale = median_in_place(&mut sizes) / NORMAL_MEDIAN;
    let limit = (NEAR_DEVIATIONS * scale.max(step_m)).max(LEAST_DISTANCE_M);
    distances_m.iter().zip(within).map(|(distance, within)| *within && distance.abs() <= limit).collect()
}

/// Distance of every point from the line of a slope through the median of its stroke, m.
fn distances_from_line(path: &TipPath, slope: f64) -> Vec<f64> {
    path.points_by_stroke()
        .flat_map(|stroke| {
            let height = |point: &TipPoint| point.y_m - slope * point.x_m;
            let middle = median_in_place(&mut stroke.iter().map(height).collect::<Vec<_>>());
            stroke.iter().map(move |point| height(point) - middle)
        })
        .collect()
}

/// Median slope between blocks of one stroke that lie far enough apart (Theil 1950, Sen 1968).
fn median_slope(path: &TipPath, travel_m: f64) -> f64 {
    let length = path.points.len().div_ceil(SLOPE_BLOCKS);
    let mut slopes = vec![];
    for stroke in path.points_by_stroke() {
        let blocks: Vec<(f64, f64)> = stroke.chunks(length).map(block_middle).collect();
        for (i, a) in blocks.iter().enumerate() {
            let far = blocks[..i].iter().filter(|b| (a.0 - b.0).abs() > OUTLYING_PLACES * travel_m);
            slopes.extend(far.map(|b| (a.1 - b.1) / (a.0 - b.0)));
        }
    }
    if slopes.is_empty() { 0.0 } else { median_in_place(&mut slopes) }
}

/// Median place and height of a block.
fn block_middle(block: &[TipPoint]) -> (f64, f64) {
    let median_of =
        |value: fn(&TipPoint) -> f64| median_in_place(&mut block.iter().map(value).collect::<Vec<_>>());
    (median_of(|point| point.x_m), median_of(|point| point.y_m))
}

/// Median of at least one value.
fn median_in_place(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
