//! First zero of a guard inside a step. No root of the interpolating polynomial is missed, not even one of a
//! close pair.
//!
//! A guard is sampled on the dense output at equispaced fractions of the step, and the polynomial through the
//! samples is written in the Bernstein basis. If all coefficients are positive there is no root, because the
//! polynomial lies in their convex hull. Otherwise the interval is halved by de Casteljau's algorithm.

use portable_math as math;

/// Number of samples of the quick test, at the fractions 0, 1/4, 1/2, 3/4 and 1 of the step.
pub(crate) const COARSE_SAMPLES: usize = 5;
/// Number of samples of the full search, at the fractions 0, 1/8, ..., 1 of the step.
pub(crate) const FINE_SAMPLES: usize = 9;

/// Maximum number of halvings of the interval. Two roots that are not separated by then count as one point
/// where the guard touches zero, and such a point is not a root: 2^-30 of a step is below every tolerance.
const MOST_HALVINGS: u32 = 30;
/// If no Bernstein coefficient on a part of the step exceeds this fraction of the largest coefficient, the
/// polynomial counts as zero on that part. The signs of its coefficients are then rounding errors, and
/// halving the part further would take a billion steps.
const FLAT: f64 = 8.0 * f64::EPSILON;

const COARSE_TO_BERNSTEIN: [[f64; COARSE_SAMPLES]; COARSE_SAMPLES] = bernstein_from_samples(0);
const FINE_TO_BERNSTEIN: [[f64; FINE_SAMPLES]; FINE_SAMPLES] = bernstein_from_samples(0);
const INNER_TO_BERNSTEIN: [[f64; FINE_SAMPLES - 1]; FINE_SAMPLES - 1] = bernstein_from_samples(1);

/// Whether a guard stays above zero, judged from its coarse samples and one check sample at the fraction 7/8
/// of the step. The smallest Bernstein coefficient must exceed the interpolation error at the check sample,
/// times a safety factor.
#[inline]
pub(crate) fn is_root_free(samples: &[f64; COARSE_SAMPLES], check: f64) -> bool {
    /// Safety factor: the check sample shows the interpolation error at one place; elsewhere it may be
    /// larger.
    const MARGIN: f64 = 8.0;
    /// Weights of the five coarse samples in Lagrange interpolation at the fraction 7/8.
    const AT_CHECK: [f64; COARSE_SAMPLES] =
        [-5.0 / 128.0, 7.0 / 32.0, -35.0 / 64.0, 35.0 / 32.0, 35.0 / 128.0];
    let predicted: f64 = samples.iter().zip(AT_CHECK).map(|(s, w)| s * w).sum();
    let margin = MARGIN * (predicted - check).abs();
    multiply_matrix(&COARSE_TO_BERNSTEIN, samples).iter().all(|&b| b > margin)
}

/// First fraction of the step at which the polynomial through the fine samples falls to zero.
pub(crate) fn first_root(samples: &[f64; FINE_SAMPLES]) -> Option<f64> {
    find_first_root(multiply_matrix(&FINE_TO_BERNSTEIN, samples))
}

/// First fraction of the step at which a guard falls to zero after it has started at a zero of multiplicity
/// `order` and risen. The samples, except the first, are divided by `fraction^order`, which removes the zero
/// at the start, and the first root of the quotient is found.
pub(crate) fn first_root_after_zero(samples: &[f64; FINE_SAMPLES], order: i32) -> Option<f64> {
    let mut quotient = [0.0; FINE_SAMPLES - 1];
    for (i, q) in quotient.iter_mut().enumerate() {
        let fraction = (i + 1) as f64 / (FINE_SAMPLES - 1) as f64;
        *q = samples[i + 1] / math::powi(fraction, order);
    }
    find_first_root(multiply_matrix(&INNER_TO_BERNSTEIN, &quotient))
}

#[inline]
fn multiply_matrix<const M: usize>(matrix: &[[f64; M]; M], x: &[f64; M]) -> [f64; M] {
    let mut out = [0.0; M];
    for (o, row) in out.iter_mut().zip(matrix) {
        *o = row.iter().zip(x).map(|(a, b)| a * b).sum();
    }
    out
}

/// First root of the polynomial with these Bernstein coefficients. There is none for a guard that does not
/// apply (its samples are infinite, so that coefficients are infinite or NaN) or that is zero throughout.
fn find_first_root<const M: usize>(b: [f64; M]) -> Option<f64> {
    let largest = b.iter().fold(0.0, |a: f64, c| a.max(c.abs()));
    if largest == 0.0 || !b.iter().all(|c| c.is_finite()) {
        return None;
    }
    first_crossing(b, FLAT * largest, 0.0, 1.0, 0)
}

/// First place in `[low, high]` where the polynomial with these Bernstein coefficients falls to zero.
fn first_crossing<const M: usize>(b: [f64; M], flat: f64, low: f64, high: f64, depth: u32) -> Option<f64> {
    if b[0] <= 0.0 {
        return Some(low);
    }
    if b.iter().all(|&c| c > 0.0) {
        return None;
    }
    let changes = b.windows(2).filter(|w| (w[0] > 0.0) != (w[1] > 0.0)).count();
    if changes == 1 && b[M - 1] <= 0.0 {
        return Some(low + (high - low) * single_root(&b));
    }
    if depth == MOST_HALVINGS || b.iter().all(|c| c.abs() <= flat) {
        return None;
    }
    let (left, right) = subdivide(b);
    let middle = 0.5 * (low + high);
    first_crossing(left, flat, low, middle, depth + 1)
        .or_else(|| first_crossing(right, flat, middle, high, depth + 1))
}

/// The single root in [0, 1] of a polynomial that is positive at 0 and zero or negative at 1, by the Illinois
/// variant of false position, with bisection every third round.
fn single_root<const M: usize>(b: &[f64; M]) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    let (mut at_low, mut at_high) = (b[0], b[M - 1]);
    for round in 0..100 {
        if high - low < 4.0 * f64::EPSILON {
            break;
        }
        let secant = low + (high - low) * at_low / (at_low - at_high);
        let x = if round % 3 == 2 || !(secant > low && secant < high) { 0.5 * (low + high) } else { secant };
        let value = evaluate_bernstein(b, x);
        if value > 0.0 {
            (low, at_low, at_high) = (x, value, 0.5 * at_high);
        } else {
            (high, at_high, at_low) = (x, value, 0.5 * at_low);
            if value == 0.0 {
                break;
            }
        }
    }
    high
}

fn evaluate_bernstein<const M: usize>(b: &[f64; M], x: f64) -> f64 {
    let mut c = *b;
    for level in (1..M).rev() {
        for i in 0..level {
            c[i] += x * (c[i + 1] - c[i]);
        }
    }
    c[0]
}

fn subdivide<const M: usize>(b: [f64; M]) -> ([f64; M], [f64; M]) {
    let (mut c, mut left, mut right) = (b, [0.0; M], [0.0; M]);
    for level in (0..M).rev() {
        left[M - 1 - level] = c[0];
        right[level] = c[level];
        for i in 0..level {
            c[i] = 0.5 * (c[i] + c[i + 1]);
        }
    }
    (left, right)
}

/// Matrix that converts samples to Bernstein coefficients of degree `M - 1`: the inverse of the collocation
/// matrix at the nodes `i / (M - 1 + first)`, `i` from `first` on. `first` is 1 for the quotient of a guard,
/// which has no sample at 0.
const fn bernstein_from_samples<const M: usize>(first: usize) -> [[f64; M]; M] {
    let mut nodes = [0.0; M];
    let mut i = 0;
    while i < M {
        nodes[i] = (i + first) as f64 / (M - 1 + first) as f64;
        i += 1;
    }
    invert_matrix(collocation_matrix(&nodes))
}

const fn collocation_matrix<const M: usize>(nodes: &[f64; M]) -> [[f64; M]; M] {
    let mut matrix = [[0.0; M]; M];
    let mut row = 0;
    while row < M {
        let mut column = 0;
        let mut binomial = 1.0;
        while column < M {
            matrix[row][column] =
                binomial * power_of(nodes[row], column) * power_of(1.0 - nodes[row], M - 1 - column);
            binomial = binomial * (M - 1 - column) as f64 / (column + 1) as f64;
            column += 1;
        }
        row += 1;
    }
    matrix
}

const fn power_of(x: f64, n: usize) -> f64 {
    let mut product = 1.0;
    let mut i = 0;
    while i < n {
        product *= x;
        i += 1;
    }
    product
}

/// Inverse by Gauss-Jordan elimination. It needs no pivoting, because collocation matrices of the Bernstein
/// basis at ordered nodes are totally positive.
const fn invert_matrix<const M: usize>(mut a: [[f64; M]; M]) -> [[f64; M]; M] {
    let mut out = [[0.0; M]; M];
    let mut p = 0;
    while p < M {
        out[p][p] = 1.0;
        p += 1;
    }
    p = 0;
    while p < M {
        let pivot = a[p][p];
        let mut j = 0;
        while j < M {
            a[p][j] /= pivot;
            out[p][j] /= pivot;
            j += 1;
        }
        let mut i = 0;
        while i < M {
            if i != p {
                let factor = a[i][p];
                let mut j = 0;
                while j < M {
                    a[i][j] -= factor * a[p][j];
                    out[i][j] -= factor * out[p][j];
                    j += 1;
                }
            }
            i += 1;
        }
        p += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(f: impl Fn(f64) -> f64) -> [f64; FINE_SAMPLES] {
        std::array::from_fn(|i| f(i as f64 / (FINE_SAMPLES - 1) as f64))
    }

    #[test]
    fn a_single_root_is_found() {
        let root = first_root(&sample(|x| 0.3 - x)).unwrap();
        assert!((root - 0.3).abs() < 1e-14, "{root}");
    }

    #[test]
    fn the_first_of_two_roots_between_samples_is_found() {
        let root = first_root(&sample(|x| (x - 0.51) * (x - 0.52))).unwrap();
        assert!((root - 0.51).abs() < 1e-11, "{root}");
    }

    #[test]
    fn a_minimum_above_zero_and_a_touch_are_no_roots() {
        assert_eq!(first_root(&sample(|x| (x - 0.515).powi(2) + 1e-9)), None);
        assert_eq!(first_root(&sample(|x| (x - 0.515).powi(2) + 1e-15)), None);
    }

    #[test]
    fn a_zero_at_the_start_does_not_count_but_the_next_one_does() {
        for order in 1..=3 {
            assert_eq!(first_root_after_zero(&sample(|x| x.powi(order) * (1.0 + x)), order), None);
            let root = first_root_after_zero(&sample(|x| x.powi(order) * (0.01 - x)), order).unwrap();
            assert!((root - 0.01).abs() < 1e-11, "order {order}: {root}");
        }
    }

    #[test]
    fn a_guard_that_falls_from_its_zero_at_once_is_found_at_the_start() {
        assert_eq!(first_root_after_zero(&sample(|x| -x), 1), Some(0.0));
    }

    /// Without tests for these two cases, the interval would be halved a billion times, and this test would
    /// not end.
    #[test]
    fn a_guard_that_does_not_apply_or_is_flat_ends_the_search() {
        assert_eq!(first_root_after_zero(&[f64::INFINITY; FINE_SAMPLES], 1), None);
        assert_eq!(first_root_after_zero(&[0.0; FINE_SAMPLES], 3), None);
        let flat = first_root(&sample(|x| (1.0 - x).powi(8)));
        assert!(flat.is_none_or(|x| x > 0.9), "{flat:?}");
    }

    #[test]
    fn the_quick_look_agrees_with_the_full_one() {
        let quick = |f: fn(f64) -> f64| is_root_free(&std::array::from_fn(|i| f(i as f64 / 4.0)), f(0.875));
        assert!(quick(|x| 1.0 + 0.5 * (3.0 * x).sin()));
        assert!(!quick(|x| 0.3 - x));
        assert!(!quick(|x| (x - 0.51) * (x - 0.52)));
    }
}
