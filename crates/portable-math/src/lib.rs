//! Mathematical functions, normal draws and quadrature whose results are the same to the last bit on every
//! machine, and sorting by a number.
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

pub mod gauss_legendre;
mod normal;
mod sort;

pub use normal::StandardNormal;
pub use sort::sort_by_number;

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

/// `sqrt(x^2 + y^2)` without overflow of the squares.
#[must_use]
#[inline]
pub fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}
