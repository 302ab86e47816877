//! Truncated power series about the start of a step, and the search for the first zero of a series.
//!
//! On a step of length `h` a series with coefficients `g_k` is the polynomial `sum g_k h^k s^k`, `s` in [0,
//! 1]. The polynomial lies in the convex hull of its Bernstein coefficients. It therefore has no root if all
//! coefficients are positive, and exactly one root if the coefficients change sign once. Otherwise the
//! interval is halved by de Casteljau's algorithm. No root inside a step is missed, not even one of a close
//! pair.

/// Highest order of an expansion; at higher orders rounding, not truncation, limits the accuracy.
pub(crate) const MOST_ORDER: usize = 20;
/// Coefficients of `x^0` to `x^MOST_ORDER`.
pub const TERMS: usize = MOST_ORDER + 1;

/// Taylor coefficients about the start of a step, `g(t + x) = sum g_k x^k`; coefficients above the order in
/// use are unspecified.
pub(crate) type TaylorSeries = [f64; TERMS];

/// Maximum number of halvings of the interval. Two roots that are not separated by then count as one point
/// where the guard touches zero, and such a point is not a root: 2^-30 of a step is below every tolerance.
const MOST_HALVINGS: u32 = 30;
/// Terms below this fraction of the sum of all absolute terms are rounding errors. They do not decide whether
/// a guard starts at a zero.
const NOISE: f64 = 1e-14;
/// If no Bernstein coefficient on a part of the step exceeds this fraction of the sum of all terms, the
/// polynomial counts as zero on that part. The signs of its coefficients are then rounding errors, and
/// halving the part further would take a billion steps.
const FLAT: f64 = 4.0 * f64::EPSILON;

/// First fall of a guard to zero within a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum GuardFall {
    Nowhere,
    /// Time from the start of the step to the zero, in the units of `h`.
    At(f64),
    /// The series of the guard is not finite.
    Undefined,
}

/// First fall of a guard to zero on `[0, h]`.
///
/// `zero_order` is the multiplicity of the guard's zero at the start, 0 if the guard is positive there. If
/// the guard starts at a zero, the first coefficient above rounding error decides: if it is positive, the
/// zero is divided out before the search; if it is negative, the guard falls at once.
pub(crate) fn first_fall(guard: &TaylorSeries, order: usize, zero_order: usize, h: f64) -> GuardFall {
    if guard[0] == f64::INFINITY {
        return GuardFall::Nowhere;
    }
    let mut scaled = [0.0; TERMS];
    let (mut power, mut rest) = (1.0, 0.0);
    for k in 0..=order {
        scaled[k] = guard[k] * power;
        power *= h;
        rest += scaled[k].abs();
    }
    if !rest.is_finite() {
        return GuardFall::Undefined;
    }
    if zero_order == 0 && 2.0 * scaled[0] > rest {
        return GuardFall::Nowhere; // the first term outweighs all others together
    }
    let noise = NOISE * rest;
    let Some(first) = (zero_order..=order).find(|&k| scaled[k].abs() > noise) else {
        return GuardFall::Nowhere;
    };
    let quotient = &scaled[first..=order];
    match () {
        () if quotient[0] < 0.0 => GuardFall::At(0.0),
        () if is_root_free(quotient) => GuardFall::Nowhere,
        () => first_root(quotient).map_or(GuardFall::Nowhere, |s| GuardFall::At(s * h)),
    }
}

/// Quick test that excludes a root: whether all Bernstein coefficients of the first few terms exceed the sum
/// of the absolute values of the other terms.
fn is_root_free(c: &[f64]) -> bool {
    /// Degree of the polynomial that consists of the first few terms. Terms above this degree decrease faster
    /// with the step length.
    const HEAD: usize = 4;
    /// Reciprocals of the binomial coefficients of degree 4.
    const SHARES: [f64; HEAD + 1] = [1.0, 1.0 / 4.0, 1.0 / 6.0, 1.0 / 4.0, 1.0];
    let Some((head, tail)) = c.split_first_chunk::<{ HEAD + 1 }>() else { return false };
    let others: f64 = tail.iter().map(|c| c.abs()).sum();
    let mut b: [f64; HEAD + 1] = std::array::from_fn(|k| head[k] * SHARES[k]);
    for k in 1..=HEAD {
        for j in (k..=HEAD).rev() {
            b[j] += b[j - 1];
        }
    }
    b.iter().all(|&b| b > others)
}

/// First root in (0, 1] of the polynomial with these coefficients, whose first coefficient is positive.
fn first_root(c: &[f64]) -> Option<f64> {
    let mut b = [0.0; TERMS];
    let degree = c.len() - 1;
    let mut binomial = 1.0;
    for (k, (b, &c)) in b.iter_mut().zip(c).enumerate() {
        *b = c / binomial;
        binomial *= (degree - k) as f64 / (k + 1) as f64;
    }
    for k in 1..=degree {
        for j in (k..=degree).rev() {
            b[j] += b[j - 1];
        }
    }
    let flat = FLAT * c.iter().map(|c| c.abs()).sum::<f64>();
    first_crossing(&RootSearch { c, flat }, &mut b, 0.0, 1.0, 0)
}

/// A polynomial, and the absolute value at or below which its Bernstein coefficients are rounding errors.
struct RootSearch<'a> {
    c: &'a [f64],
    flat: f64,
}

/// First root in `[low, high]`. At the start, `b` contains the Bernstein coefficients on this interval; it is
/// overwritten.
fn first_crossing(search: &RootSearch, b: &mut [f64; TERMS], low: f64, high: f64, depth: u32) -> Option<f64> {
    let degree = search.c.len() - 1;
    if b[0] <= 0.0 {
        return Some(low);
    }
    let b_here = &b[..=degree];
    let changes = b_here.windows(2).filter(|w| (w[0] > 0.0) != (w[1] > 0.0)).count();
    if changes == 0 {
        return None;
    }
    if changes == 1 {
        return Some(single_root(search.c, low, high, b[0], b[degree]));
    }
    if depth == MOST_HALVINGS || b_here.iter().all(|b| b.abs() <= search.flat) {
        return None;
    }
    let mut left = [0.0; TERMS];
    for (level, left) in left[..=degree].iter_mut().enumerate() {
        *left = b[0];
        for i in 0..degree - level {
            b[i] = 0.5 * (b[i] + b[i + 1]);
        }
    }
    // `b` now holds the coefficients of the right half
    let middle = 0.5 * (low + high);
    first_crossing(search, &mut left, low, middle, depth + 1)
        .or_else(|| first_crossing(search, b, middle, high, depth + 1))
}

/// The single root between `low`, where the polynomial is positive, and `high`, where it is zero or negative.
/// Newton's method starts from the result of false position; a step that leaves the bracket or does not
/// converge fast is replaced by bisection.
fn single_root(c: &[f64], mut low: f64, mut high: f64, at_low: f64, at_high: f64) -> f64 {
    /// Maximum number of rounds, more than Newton's method and bisection together need in double precision.
    const ROUNDS: usize = 80;
    let mut x = low + (high - low) * at_low / (at_low - at_high);
    let mut before = high - low;
    for _ in 0..ROUNDS {
        let (mut value, mut slope) = (0.0, 0.0);
        for &c in c.iter().rev() {
            slope = slope * x + value;
            value = value * x + c;
        }
        if value > 0.0 {
            low = x;
        } else {
            high = x;
        }
        let step = -value / slope;
        let newton = x + step;
        // a step longer than half the previous step does not converge fast
        let converges = newton > low && newton < high && 2.0 * step.abs() < before;
        let next = if converges { newton } else { 0.5 * (low + high) };
        before = (next - x).abs();
        if before <= 2.0 * f64::EPSILON * x || value == 0.0 {
            return x;
        }
        x = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coefficients of `factor * product (x - root)`.
    fn with_roots(factor: f64, roots: &[f64]) -> (TaylorSeries, usize) {
        let mut c = [0.0; TERMS];
        c[0] = factor;
        for (degree, root) in roots.iter().enumerate() {
            for k in (0..=degree + 1).rev() {
                c[k] = if k > 0 { c[k - 1] } else { 0.0 } - root * c[k];
            }
        }
        (c, roots.len())
    }

    fn fall(factor: f64, roots: &[f64], zero_order: usize, h: f64) -> GuardFall {
        let (c, order) = with_roots(factor, roots);
        first_fall(&c, order, zero_order, h)
    }

    fn assert_falls(found: GuardFall, expected: f64, error: f64) {
        let GuardFall::At(x) = found else { panic!("{found:?}") };
        assert!((x - expected).abs() <= error, "{x} instead of {expected}");
    }

    #[test]
    fn a_single_root_is_found_to_rounding() {
        assert_falls(fall(-1.0, &[0.3], 0, 1.0), 0.3, 1e-16);
        assert_falls(fall(-1.0, &[0.3, 1.7, 2.5, -1.0, -2.0], 0, 1.5), 0.3, 1e-15);
        assert_eq!(fall(-1.0, &[1.3], 0, 1.0), GuardFall::Nowhere);
    }

    #[test]
    fn the_first_of_two_close_roots_is_found_and_a_near_miss_is_none() {
        assert_falls(fall(1.0, &[0.51, 0.52], 0, 1.0), 0.51, 1e-13);
        assert_falls(fall(1.0, &[0.51, 0.510_001, -2.0], 0, 1.0), 0.51, 1e-9);
        // (x - 0.515)^2 plus a little more than the rounding error
        let (mut c, order) = with_roots(1.0, &[0.515, 0.515]);
        c[0] += 1e-14;
        assert_eq!(first_fall(&c, order, 0, 1.0), GuardFall::Nowhere);
    }

    #[test]
    fn a_zero_at_the_start_is_divided_out_and_the_next_one_found() {
        for order in 1..=3 {
            let mut roots = vec![0.0; order];
            assert_eq!(fall(1.0, &roots, order, 1.0), GuardFall::Nowhere);
            roots.push(0.01);
            assert_falls(fall(-1.0, &roots, order, 1.0), 0.01, 1e-16);
            // with a `zero_order` of 0, the first coefficient above rounding error shows the zero at the
            // start
            assert_falls(fall(-1.0, &roots, 0, 1.0), 0.01, 1e-16);
        }
    }

    #[test]
    fn a_guard_that_falls_from_its_zero_falls_at_once() {
        assert_eq!(fall(-1.0, &[0.0], 1, 1.0), GuardFall::At(0.0));
        assert_eq!(fall(-1.0, &[0.0, 0.0], 0, 1.0), GuardFall::At(0.0));
        assert_eq!(fall(-1.0, &[-0.1], 0, 1.0), GuardFall::At(0.0));
    }

    #[test]
    fn a_zero_of_higher_order_than_announced_is_armed_by_the_next_coefficient() {
        assert_eq!(fall(1.0, &[0.0, 0.0, 0.0], 2, 1.0), GuardFall::Nowhere);
        assert_eq!(fall(-1.0, &[0.0, 0.0, 0.0], 2, 1.0), GuardFall::At(0.0));
    }

    /// Around a root of multiplicity 20, the polynomial is zero to rounding over a sixth of the step; halving
    /// that part further would not end.
    #[test]
    fn a_flat_touch_ends_the_search() {
        let found = fall(1.0, &[1.0; 20], 0, 1.0);
        assert!(found == GuardFall::Nowhere || matches!(found, GuardFall::At(x) if x > 0.7), "{found:?}");
    }

    #[test]
    fn what_is_no_number_is_said_and_what_does_not_apply_is_nowhere() {
        let mut c = [0.0; TERMS];
        c[0] = f64::NAN;
        assert_eq!(first_fall(&c, 4, 0, 1.0), GuardFall::Undefined);
        c[0] = f64::INFINITY;
        assert_eq!(first_fall(&c, 4, 0, 1.0), GuardFall::Nowhere);
        // a guard that does not apply (infinity), although `zero_order` states a zero at the start
        assert_eq!(first_fall(&c, 4, 1, 1.0), GuardFall::Nowhere);
    }
}
