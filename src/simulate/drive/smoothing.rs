//! The cubic smoothing spline of points on a frame grid.
//!
//! Reinsch (1967, *Numerische Mathematik* 10, 177): among all curves whose squared residuals sum to `S` the one with the least integral of
//! squared curvature is a natural cubic spline with knots at the points, and one banded system gives it. `S` is the number of points times
//! the variance of their noise (his choice, and Morozov's discrepancy principle): measured on noisy cosines it gave the head an
//! acceleration two to four times as accurate as generalised cross-validation did, for a little of the position's accuracy, and it cannot
//! take correlated noise for motion.
//!
//! A natural spline has no curvature at its ends, a head that is filmed while it moves has. So a cubic polynomial is taken out of the
//! points first and put back afterwards: the one whose removal leaves the least residuals, the estimator of Speckman (1988, *Journal of the
//! Royal Statistical Society* B 50, 413) for the parametric part of a smooth curve. On the same cosines the largest error of the
//! acceleration, at the ends, fell from 90 % of it to 5 %, and the error inside by a factor of ten.
//!
//! Times are in frames here: spacings are whole numbers and the smoothing parameter has no unit.

/// Smoothed positions, m, and second derivatives, m/frame2, at the points.
pub(super) struct Smoothing {
    pub positions: Vec<f64>,
    pub curvatures: Vec<f64>,
}

/// Binary logarithms of the smoothing parameter that are tried. The lower end follows the points to 1e-9 of their bend; the upper one
/// averages over `2^(40/4)`, a thousand, frames, and beyond it rounding would show in the curvature.
const LOG2_SMOOTHING: (f64, f64) = (-30.0, 40.0);
/// Halvings of that range: the parameter is good to a thousandth of a percent, the curve to less.
const HALVINGS: u32 = 22;

/// Smooths positions at rising frames until the residuals are those of noise of this standard deviation.
pub(super) fn smooth(frames: &[usize], positions: &[f64], noise: f64) -> Smoothing {
    let problem = Problem::new(frames, positions);
    let parameter = problem.parameter(positions.len() as f64 * noise * noise);
    let fit = problem.fit(parameter);
    let positions = positions.iter().zip(&fit.jumps).map(|(position, jump)| position - parameter * jump).collect();
    Smoothing { positions, curvatures: fit.curvatures }
}

/// What does not depend on the smoothing parameter; letters as Reinsch's: `R` the matrix of the curvatures, `Q` that of second differences.
struct Problem {
    /// Distances between neighbouring points, frames.
    h: Vec<f64>,
    /// Places of the points on [-1, 1].
    places: Vec<f64>,
    /// `Q^T` times the points and times the two cubics whose curvature is 1 and the place; a straight line has none.
    differences: [Vec<f64>; 3],
}

struct Fit {
    curvatures: Vec<f64>,
    /// Jumps of the third derivative at the points; the residuals are these times the smoothing parameter.
    jumps: Vec<f64>,
}

impl Problem {
    fn new(frames: &[usize], positions: &[f64]) -> Self {
        let h: Vec<f64> = frames.windows(2).map(|pair| (pair[1] - pair[0]) as f64).collect();
        let half = 0.5 * h.iter().sum::<f64>();
        let places: Vec<f64> = frames.iter().map(|frame| (frame - frames[0]) as f64 / half - 1.0).collect();
        let inner = 0..h.len() - 1;
        let of_points = inner.clone().map(|j| (positions[j + 2] - positions[j + 1]) / h[j + 1] - (positions[j + 1] - positions[j]) / h[j]).collect();
        // the second divided difference of a cubic is its curvature at the mean place, exactly
        let of_square: Vec<f64> = inner.map(|j| 0.5 * (h[j] + h[j + 1])).collect();
        let of_cube = of_square.iter().zip(places.windows(3)).map(|(d, x)| d * (x[0] + x[1] + x[2]) / 3.0).collect();
        Self { h, places, differences: [of_points, of_square, of_cube] }
    }

    /// The largest parameter whose residuals sum to no more than `allowed` in their squares; they grow with it.
    fn parameter(&self, allowed: f64) -> f64 {
        let residuals = |parameter: f64| parameter * parameter * self.fit(parameter).jumps.iter().map(|jump| jump * jump).sum::<f64>();
        let (mut low, mut high) = LOG2_SMOOTHING;
        if residuals(low.exp2()) > allowed {
            return 0.0;
        }
        if residuals(high.exp2()) <= allowed {
            return high.exp2();
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if residuals(middle.exp2()) <= allowed { low = middle } else { high = middle }
        }
        low.exp2()
    }

    fn fit(&self, parameter: f64) -> Fit {
        let factors = self.factors(parameter);
        let [curvatures, square, cube] = self.differences.each_ref().map(|d| factors.solve(d));
        let [jumps, of_square, of_cube] = [&curvatures, &square, &cube].map(|c| self.jumps(c));
        let [a, b] = least_squares(&jumps, &of_square, &of_cube);
        let mut whole: Vec<f64> = self.places.iter().map(|place| a + b * place).collect();
        for (j, whole) in whole[1..].iter_mut().take(curvatures.len()).enumerate() {
            *whole += curvatures[j] - a * square[j] - b * cube[j];
        }
        let jumps = (0..jumps.len()).map(|i| jumps[i] - a * of_square[i] - b * of_cube[i]).collect();
        Fit { curvatures: whole, jumps }
    }

    /// `Q` times the inner curvatures.
    fn jumps(&self, curvatures: &[f64]) -> Vec<f64> {
        let at = |i: usize| if i == 0 { 0.0 } else { curvatures.get(i - 1).copied().unwrap_or(0.0) };
        let slope = |i: usize| (at(i + 1) - at(i)) / self.h[i];
        (0..self.places.len())
            .map(|i| {
                let after = if i < self.h.len() { slope(i) } else { 0.0 };
                after - if i > 0 { slope(i - 1) } else { 0.0 }
            })
            .collect()
    }

    /// `R + parameter Q^T Q`, factored.
    fn factors(&self, parameter: f64) -> Factors {
        let h = &self.h;
        let column = |j: usize| [1.0 / h[j], -1.0 / h[j] - 1.0 / h[j + 1], 1.0 / h[j + 1]];
        let rows = (0..h.len() - 1).map(|j| {
            let [a, b, c] = column(j);
            let next = if j + 2 < h.len() { column(j + 1) } else { [0.0; 3] };
            let second = if j + 3 < h.len() { column(j + 2) } else { [0.0; 3] };
            let off = if j + 2 < h.len() { h[j + 1] / 6.0 } else { 0.0 };
            [(h[j] + h[j + 1]) / 3.0 + parameter * (a * a + b * b + c * c), off + parameter * (b * next[0] + c * next[1]), parameter * c * second[0]]
        });
        Factors::of(rows)
    }
}

/// `L D L^T` of a symmetric matrix with two diagonals beside the main one.
struct Factors {
    /// Of each row the pivot and the two multipliers below it.
    rows: Vec<[f64; 3]>,
}

impl Factors {
    /// From the main diagonal's element and the two below it, column by column.
    fn of(columns: impl Iterator<Item = [f64; 3]>) -> Self {
        let mut rows: Vec<[f64; 3]> = vec![];
        let [mut before, mut last] = [[0.0; 3]; 2];
        for [diagonal, first, second] in columns {
            let pivot = diagonal - last[1] * last[1] * last[0] - before[2] * before[2] * before[0];
            let row = [pivot, (first - last[2] * last[0] * last[1]) / pivot, second / pivot];
            (before, last) = (last, row);
            rows.push(row);
        }
        Self { rows }
    }

    fn solve(&self, right: &[f64]) -> Vec<f64> {
        let mut x = right.to_vec();
        for j in 0..x.len() {
            let near = if j > 0 { self.rows[j - 1][1] * x[j - 1] } else { 0.0 };
            let far = if j > 1 { self.rows[j - 2][2] * x[j - 2] } else { 0.0 };
            x[j] -= near + far;
        }
        for j in (0..x.len()).rev() {
            let [pivot, first, second] = self.rows[j];
            let after = |k: usize| x.get(j + k).copied().unwrap_or(0.0);
            x[j] = x[j] / pivot - first * after(1) - second * after(2);
        }
        x
    }
}

/// The combination of `a` and `b` nearest to `y`.
fn least_squares(y: &[f64], a: &[f64], b: &[f64]) -> [f64; 2] {
    let dot = |u: &[f64], v: &[f64]| u.iter().zip(v).map(|(u, v)| u * v).sum::<f64>();
    let (aa, ab, bb, ay, by) = (dot(a, a), dot(a, b), dot(b, b), dot(a, y), dot(b, y));
    let determinant = aa * bb - ab * ab;
    if determinant > 0.0 { [(bb * ay - ab * by) / determinant, (aa * by - ab * ay) / determinant] } else { [0.0; 2] }
}
