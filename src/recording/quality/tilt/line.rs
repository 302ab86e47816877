//! Least squares of a line and a parabola through the path, each stroke at its own height.

use super::path::{TipPath, TipPoint};
use crate::math;

/// Least share that a parabola may differ from a line, in units of the fourth power of the places' spread:
/// below it the places hold two values and show no curvature.
const LEAST_BEND: f64 = 1e-6;

/// A line `y = height(stroke) + slope x + bend q(x)`, in which `q` is the parabola `x^2` without its part
/// along the line, so that `slope` is that of the line alone: the mean slope of a curved path.
pub(super) struct GlassLine {
    pub slope: f64,
    pub bend_per_m: f64,
    /// Mean place, m.
    pub centre_m: [f64; 2],
    /// Standard deviation of the places, m.
    pub x_sd_m: f64,
    /// Sum of the squared places from the mean of their stroke, m^2: the variance of `slope` is that of a
    /// height over it.
    pub slope_information_m2: f64,
    /// The same of the bend, m^4; zero where no curvature shows.
    pub bend_information_m4: f64,
    /// Which points the line is fitted through.
    pub on_glass: Vec<bool>,
    /// Height above the line, m, of every point; infinite in a stroke without a point on the glass.
    pub residuals_m: Vec<f64>,
    /// Numbers that were fitted.
    pub fitted: usize,
}

/// A point relative to the mean of its stroke.
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
    /// The line through the points for which `on_glass` holds; at least one.
    pub(super) fn fit_through(path: &TipPath, on_glass: Vec<bool>) -> Self {
        let used = || path.points.iter().zip(&on_glass).filter(|(_, on)| **on).map(|(point, _)| point);
        let count = used().count() as f64;
        let centre_m =
            [used().map(|p| p.x_m).sum::<f64>() / count, used().map(|p| p.y_m).sum::<f64>() / count];
        let means = stroke_means(path.strokes, used(), centre_m);
        let all: Vec<CentredPoint> =
            path.points.iter().map(|point| centre_point(point, centre_m, &means[point.stroke])).collect();
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

/// Means of the strokes about `centre_m`; infinite in a stroke without a point.
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

fn centre_point(point: &TipPoint, centre_m: [f64; 2], mean: &StrokeSums) -> CentredPoint {
    let x = point.x_m - centre_m[0];
    CentredPoint { x: x - mean.x, x2: x * x - mean.x2, y: point.y_m - centre_m[1] - mean.y }
}
