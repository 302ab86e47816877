//! Which frames have the tip on the glass: those near the line that most frames lie on.

use super::line::Line;
use super::path::{Path, Point};

/// Blocks of frames whose medians give the first line: enough for a steady median of slopes, few enough for
/// all pairs.
const BLOCKS: usize = 64;
/// Least distance of two blocks whose slope counts, as a share of the travel: noise makes the slopes of
/// nearer ones arbitrary.
const FAR: f64 = 0.25;
/// Standard deviations from the line within which the tip lies on the glass: 1 frame of 16,000 is lost by
/// chance.
const NEAR: f64 = 4.0;
/// Median of |x| of a standard normal variable.
const NORMAL_MEDIAN: f64 = 0.674_489_75;
/// Least distance that is off the glass, m: below it lies the rounding of a trace without noise.
const LEAST_DISTANCE_M: f64 = 1e-9;
/// Share of the travel that a place may lie beyond it: farther ones are outliers.
const BEYOND: f64 = 0.1;
/// Most repetitions; the frames on the glass rarely change after five.
const MOST_REPETITIONS: usize = 30;

/// The line through the frames with the tip on the glass. The first line is the median of the slopes between
/// blocks of frames, which a quarter of wrong blocks does not move; it is then fitted to the frames near it,
/// until these stay the same.
pub(super) fn fit(path: &Path, travel_m: f64, step_m: f64) -> Line {
    let within = places(path);
    let first = distances(path, median_slope(path, travel_m));
    let mut line = Line::through(path, near(&first, &within, step_m));
    for _ in 0..MOST_REPETITIONS {
        let on_glass = near(&line.residuals_m, &within, step_m);
        if on_glass == line.on_glass {
            break;
        }
        line = Line::through(path, on_glass);
    }
    line
}

/// Which points are no outliers along the sweep.
fn places(path: &Path) -> Vec<bool> {
    let mut sorted: Vec<f64> = path.points.iter().map(|point| point.x_m).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let end = sorted.len() / 100;
    let (low, high) = (sorted[end], sorted[sorted.len() - 1 - end]);
    let beyond = BEYOND * (high - low);
    path.points.iter().map(|p| p.x_m >= low - beyond && p.x_m <= high + beyond).collect()
}

/// The points whose distance from the line is that of noise or of the step in which heights are written.
fn near(distances_m: &[f64], within: &[bool], step_m: f64) -> Vec<bool> {
    let mut sizes: Vec<f64> = distances_m.iter().map(|distance| distance.abs()).collect();
    let scale = median(&mut sizes) / NORMAL_MEDIAN;
    let limit = (NEAR * scale.max(step_m)).max(LEAST_DISTANCE_M);
    distances_m.iter().zip(within).map(|(distance, within)| *within && distance.abs() <= limit).collect()
}

/// Distance of every point from the line of a slope through the median of its stroke, m.
fn distances(path: &Path, slope: f64) -> Vec<f64> {
    path.by_stroke()
        .flat_map(|stroke| {
            let height = |point: &Point| point.y_m - slope * point.x_m;
            let middle = median(&mut stroke.iter().map(height).collect::<Vec<_>>());
            stroke.iter().map(move |point| height(point) - middle)
        })
        .collect()
}

/// Median slope between blocks of one stroke that lie far enough apart (Theil 1950, Sen 1968).
fn median_slope(path: &Path, travel_m: f64) -> f64 {
    let length = path.points.len().div_ceil(BLOCKS);
    let mut slopes = vec![];
    for stroke in path.by_stroke() {
        let blocks: Vec<(f64, f64)> = stroke.chunks(length).map(middle).collect();
        for (i, a) in blocks.iter().enumerate() {
            let far = blocks[..i].iter().filter(|b| (a.0 - b.0).abs() > FAR * travel_m);
            slopes.extend(far.map(|b| (a.1 - b.1) / (a.0 - b.0)));
        }
    }
    if slopes.is_empty() { 0.0 } else { median(&mut slopes) }
}

/// Median place and height of a block.
fn middle(block: &[Point]) -> (f64, f64) {
    let median_of = |value: fn(&Point) -> f64| median(&mut block.iter().map(value).collect::<Vec<_>>());
    (median_of(|point| point.x_m), median_of(|point| point.y_m))
}

/// Median of at least one value.
fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
