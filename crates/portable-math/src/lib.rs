//! Mathematical functions, normal draws and quadrature whose results are the same to the last bit on every
//! machine, sorting by a number, and reading of decimal numbers.
//!
//! The functions of `f64` call the system's library, whose rounding is not specified: glibc has one version
//! for processors with fused multiply-add and another for those without. The functions here consist only of
//! additions, multiplications and divisions, whose rounding IEEE 754 specifies. IEEE 754 also specifies the
//! rounding of `sqrt`, `mul_add`, `floor` and similar functions; these are used as methods of `f64`.
//!
//! ```
//! // the same bits on every machine
//! assert_eq!(portable_math::sin(1.0).to_bits(), 0x3fea_ed54_8f09_0cee);
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may call them

mod decimal;
pub mod gauss_legendre;
mod normal;
mod sort;

pub use decimal::{parse_finite, parse_positive};
pub use normal::StandardNormal;
pub use sort::{select_number, sort_by_number};

/// The sine of an angle in rad.
#[must_use]
#[inline]
pub fn sin(x: f64) -> f64 {
    libm::sin(x)
}

/// The cosine of an angle in rad.
#[must_use]
#[inline]
pub fn cos(x: f64) -> f64 {
    libm::cos(x)
}

/// Sine and cosine of an angle in rad.
#[must_use]
#[inline]
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// The tangent of an angle in rad.
#[must_use]
#[inline]
pub fn tan(x: f64) -> f64 {
    libm::tan(x)
}

/// The inverse sine, rad.
#[must_use]
#[inline]
pub fn asin(x: f64) -> f64 {
    libm::asin(x)
}

/// The inverse cosine, rad.
#[must_use]
#[inline]
pub fn acos(x: f64) -> f64 {
    libm::acos(x)
}

/// The inverse tangent, rad.
#[must_use]
#[inline]
pub fn atan(x: f64) -> f64 {
    libm::atan(x)
}

/// The angle from the positive x axis to the point `(x, y)`, rad.
#[must_use]
#[inline]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// The hyperbolic tangent.
#[must_use]
#[inline]
pub fn tanh(x: f64) -> f64 {
    libm::tanh(x)
}

/// `e^x`.
#[must_use]
#[inline]
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// The natural logarithm.
#[must_use]
#[inline]
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// `ln(1 + x)`, accurate for small `x`.
#[must_use]
#[inline]
pub fn ln_1p(x: f64) -> f64 {
    libm::log1p(x)
}

/// The complementary error function.
#[inline]
pub fn erfc(x: f64) -> f64 {
    libm::erfc(x)
}

/// The logarithm to base 10.
#[must_use]
#[inline]
pub fn log10(x: f64) -> f64 {
    libm::log10(x)
}

/// `x^y`.
#[must_use]
#[inline]
pub fn powf(x: f64, y: f64) -> f64 {
    libm::pow(x, y)
}

/// `x^n` by repeated squaring; the compiler may compute [`f64::powi`] in another way.
#[must_use]
#[inline]
pub fn powi(x: f64, n: i32) -> f64 {
    let (mut square, mut left, mut power) = (x, n.unsigned_abs(), 1.0);
    loop {
        if left & 1 == 1 {
            power *= square;
        }
        left >>= 1;
        if left == 0 {
            return if n < 0 { 1.0 / power } else { power };
        }
        square *= square;
    }
}

/// The nearest whole number; a half is rounded away from zero.
///
/// The result is that of [`f64::round`]. On processors of the x86-64 baseline, that method calls the system's
/// library, which takes several times as long.
#[must_use]
#[inline]
pub fn round(x: f64) -> f64 {
    /// From 2^52 on, every number is whole.
    const ALL_WHOLE: f64 = 4_503_599_627_370_496.0;
    if x.is_nan() || x.abs() >= ALL_WHOLE {
        return x;
    }
    let whole = x as i64 as f64;
    let step = if (x - whole).abs() >= 0.5 { 1.0_f64.copysign(x) } else { 0.0 };
    (whole + step).copysign(x)
}

/// `sqrt(x^2 + y^2)` without overflow of the squares.
#[must_use]
#[inline]
pub fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}

#[cfg(test)]
mod tests {
    use rand::{RngCore, SeedableRng};

    /// Halves, their neighbours, the numbers around 2^52 and random bits.
    #[test]
    fn rounding_is_that_of_the_standard_library() {
        let mut draws = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
        let halves = (0..200).map(|i| f64::from(i) / 2.0);
        let around = halves.flat_map(|x| [x, x.next_up(), x.next_down()]);
        let large = (0..60).map(|i| 4_503_599_627_370_496.0 - f64::from(i) / 2.0);
        let special = [f64::NAN, f64::INFINITY, f64::MAX, f64::MIN_POSITIVE, 9.3e18, 1.9e19];
        let random = (0..100_000).map(|_| f64::from_bits(draws.next_u64()));
        let near_one = (0..100_000).map(|i| f64::from(i) * 0.37 - 9.0);
        for x in around.chain(large).chain(special).chain(random).chain(near_one) {
            for x in [x, -x] {
                let (ours, theirs) = (super::round(x), x.round());
                let same = ours.to_bits() == theirs.to_bits() || (ours.is_nan() && theirs.is_nan());
                assert!(same, "{x:e}: {ours:e}, expected {theirs:e}");
            }
        }
    }
}
