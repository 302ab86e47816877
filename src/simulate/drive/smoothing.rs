//! The cubic smoothing spline of points on a frame grid.
//!
//! Reinsch (1967, *Numerische Mathematik* 10, 177): among all curves whose squared residuals have a given sum
//! the one with the least integral of squared curvature is a natural cubic spline with knots at the points,
//! and one banded system gives it. How much it smooths is chosen by generalised cross-validation (Craven and
//! Wahba 1979, *Numerische Mathematik* 31, 377). Taking the residuals from the measured noise instead (the
//! discrepancy principle) was tried and is fragile: over noisy cosines of 1200 frames a noise estimated 10 %
//! too low gave accelerations that were wrong by as much as they were large, where cross-validation stayed
//! within 1.2 % away from the ends.
//!
//! A natural spline has no curvature at its ends, a head that is filmed while it moves has. So a cubic
//! polynomial is taken out of the points first and put back afterwards: the one whose removal leaves the
//! least residuals, the estimator of Speckman (1988, *Journal of the Royal Statistical Society* B 50, 413)
//! for the parametric part of a smooth curve. On the same cosines the largest error of the acceleration, at
//! the ends, fell from 90 % of it to 6 to 13 %, and the error inside by a factor of ten.
//!
//! Times are in frames here: spacings are whole numbers and the smoothing parameter has no unit.

/// Smoothed positions, m, and second derivatives, m/frame2, at the points.
pub(super) struct Smoothing {
    pub positions: Vec<f64>,
    pub curvatures: Vec<f64>,
    /// Freedoms of the curve: the trace of the matrix that makes positions of points.
    pub freedoms: f64,
    /// Standard deviation of the positions that the scatter of the points leaves, m, on average over them
    /// (Wahba 1983, *Journal of the Royal Statistical Society* B 45, 133).
    pub sd_m: f64,
}

/// Binary logarithms of the smoothing parameter that are tried, and their step. The lower end follows the
/// points to 1e-9 of their bend; the upper one averages over `2^(40/4)`, a thousand, frames, and beyond it
/// rounding would show in the curvature.
const LOG2_SMOOTHING: (i32, i32, i32) = (-30, 40, 2);
/// Golden sections around the best of them: the parameter is then good to a few percent, which the curve does
/// not show.
const SECTIONS: u32 = 9;

/// Smooths positions at rising frames, at least three, by cross-validation.
pub(super) fn smooth(frames: &[usize], positions: &[f64]) -> Smoothing {
    let problem = Problem::new(frames, positions);
    smooth_by(&problem, positions, problem.parameter())
}

/// The spline that passes through every point.
#[cfg(test)]
pub(super) fn interpolate(frames: &[usize], positions: &[f64]) -> Smoothing {
    smooth_by(&Problem::new(frames, positions), positions, 0.0)
}

fn smooth_by(problem: &Problem, positions: &[f64], parameter: f64) -> Smoothing {
    let fit = problem.fit(&problem.factors(parameter));
    let positions =
        positions.iter().zip(&fit.jumps).map(|(position, jump)| position - parameter * jump).collect();
    let points = fit.jumps.len() as f64;
    let (squares, trace) = problem.squares_and_trace(parameter);
    // (the two coefficients of the cubic are freedoms too)
    let left = (parameter * trace - 2.0).max(0.0);
    let freedoms = points - left;
    let variance = if left > 0.0 { parameter * parameter * squares / left } else { 0.0 };
    Smoothing { positions, curvatures: fit.curvatures, freedoms, sd_m: (variance * freedoms / points).sqrt() }
}

/// What does not depend on the smoothing parameter; letters as Reinsch's: `R` the matrix of the curvatures,
/// `Q` that of second differences.
struct Problem {
    /// Distances between neighbouring points, frames.
    h: Vec<f64>,
    /// Places of the points on [-1, 1].
    places: Vec<f64>,
    /// `Q^T` times the points and times the two cubics whose curvature is 1 and the place; a straight line
    /// has none.
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
        let of_points = inner
            .clone()
            .map(|j| {
                (positions[j + 2] - positions[j + 1]) / h[j + 1] - (positions[j + 1] - positions[j]) / h[j]
            })
            .collect();
        // the second divided difference of a cubic is its curvature at the mean place, exactly
        let of_square: Vec<f64> = inner.map(|j| 0.5 * (h[j] + h[j + 1])).collect();
        let of_cube =
            of_square.iter().zip(places.windows(3)).map(|(d, x)| d * (x[0] + x[1] + x[2]) / 3.0).collect();
        Self { h, places, differences: [of_points, of_square, of_cube] }
    }

    /// The parameter of the least score.
    fn parameter(&self) -> f64 {
        /// Share of a section that is kept.
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let (low, high, step) = LOG2_SMOOTHING;
        let tried =
            (low..=high).step_by(step as usize).map(|log| (f64::from(log), self.score(f64::from(log))));
        let best = tried.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(f64::from(low), |(log, _)| log);
        let (mut a, mut b) = (best - f64::from(step), best + f64::from(step));
        for _ in 0..SECTIONS {
            let [left, right] = [b - GOLDEN * (b - a), a + GOLDEN * (b - a)];
            if self.score(left) < self.score(right) { b = right } else { a = left }
        }
        (0.5 * (a + b)).exp2()
    }

    /// Generalised cross-validation: squared residuals over the square of the trace of the matrix that makes
    /// them, both over the parameter's square. (The two coefficients of the cubic are not counted: among the
    /// freedoms of the spline they are lost.)
    fn score(&self, log2_parameter: f64) -> f64 {
        let (squares, trace) = self.squares_and_trace(log2_parameter.exp2());
        squares / (trace * trace)
    }

    /// Squared residuals over the square of the parameter, and the trace of the matrix that makes residuals
    /// over the parameter.
    fn squares_and_trace(&self, parameter: f64) -> (f64, f64) {
        let factors = self.factors(parameter);
        let squares: f64 = self.fit(&factors).jumps.iter().map(|jump| jump * jump).sum();
        let [mut after, mut second] = [[0.0; 2]; 2];
        let mut trace = 0.0;
        // the inverse's three diagonals from the last element up (Hutchinson and de Hoog 1985, Numerische
        // Mathematik 47, 99)
        for (j, [pivot, near, far]) in factors.rows.iter().copied().enumerate().rev() {
            let off = [-near * after[0] - far * after[1], -near * after[1] - far * second[0]];
            let diagonal = 1.0 / pivot - near * off[0] - far * off[1];
            let [q0, q1, q2] = self.squares_of_differences(j);
            trace += q0 * diagonal + 2.0 * (q1 * off[0] + q2 * off[1]);
            (second, after) = (after, [diagonal, off[0]]);
        }
        (squares, trace)
    }

    fn fit(&self, factors: &Factors) -> Fit {
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
        Factors::of((0..h.len() - 1).map(|j| {
            let [q0, q1, q2] = self.squares_of_differences(j);
            let off = if j + 2 < h.len() { h[j + 1] / 6.0 } else { 0.0 };
            [(h[j] + h[j + 1]) / 3.0 + parameter * q0, off + parameter * q1, parameter * q2]
        }))
    }

    /// Column `j` of `Q^T Q` from the diagonal down.
    fn squares_of_differences(&self, j: usize) -> [f64; 3] {
        let h = &self.h;
        let column = |j: usize| {
            if j + 1 < h.len() {
                [1.0 / h[j], -1.0 / h[j] - 1.0 / h[j + 1], 1.0 / h[j + 1]]
            } else {
                [0.0; 3]
            }
        };
        let ([a, b, c], next, second) = (column(j), column(j + 1), column(j + 2));
        [a * a + b * b + c * c, b * next[0] + c * next[1], c * second[0]]
    }
}

/// `L D L^T` of a symmetric matrix with two diagonals on either side of the main one.
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
    if determinant > 0.0 {
        [(bb * ay - ab * by) / determinant, (aa * by - ab * ay) / determinant]
    } else {
        [0.0; 2]
    }
}
