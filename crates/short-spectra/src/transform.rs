//! The Fourier transform of real samples; this is the only file that uses the transform library.

use portable_math as math;
use realfft::num_traits::{FromPrimitive, Num, One, Signed, Zero};
use realfft::{RealFftPlanner, RealToComplex, num_complex};
use std::cell::Cell;
use std::f64::consts::TAU;
use std::num::ParseFloatError;
use std::ops::{Add, Div, Mul, Neg, Rem, Sub};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

/// A value of a transform.
pub(super) type Complex = nalgebra::Complex<f64>;

/// Transform plans of the lengths used so far by any thread: a plan takes longer to make than to use.
static PLANNER: LazyLock<Mutex<RealFftPlanner<PortableReal>>> =
    LazyLock::new(|| Mutex::new(RealFftPlanner::new()));

/// A transform of one length.
pub(super) struct RealTransform {
    plan: Arc<dyn RealToComplex<PortableReal>>,
}

impl RealTransform {
    /// A transform of records padded with zeros to `padded` values, a power of two from 2 on.
    pub(super) fn new(padded: usize) -> Self {
        debug_assert!(padded.is_power_of_two() && padded >= 2);
        // (a thread that panicked while planning has left only complete plans)
        let mut planner = PLANNER.lock().unwrap_or_else(PoisonError::into_inner);
        Self { plan: with_exact_twiddles(padded, || planner.plan_fft_forward(padded)) }
    }

    /// `sum x exp(-2 pi i k n / padded)` for every `k` from 0 to half the length. There must be at most
    /// `padded` values.
    pub(super) fn spectrum_values(&self, values: impl Iterator<Item = f64>) -> Vec<Complex> {
        self.execute_plan(values).into_iter().map(|z| Complex { re: z.re.0, im: z.im.0 }).collect()
    }

    pub(super) fn magnitudes(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        self.execute_plan(values).iter().map(|z| math::hypot(z.re.0, z.im.0)).collect()
    }

    /// The squares of [`Self::magnitudes`], in a fraction of the time.
    pub(super) fn squared_magnitudes(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        self.execute_plan(values).iter().map(|z| z.norm_sqr().0).collect()
    }

    fn execute_plan(&self, values: impl Iterator<Item = f64>) -> Vec<num_complex::Complex<PortableReal>> {
        let (mut input, mut output) = (self.plan.make_input_vec(), self.plan.make_output_vec());
        for (slot, value) in input.iter_mut().zip(values) {
            *slot = PortableReal(value);
        }
        // both buffers come from the plan, so their lengths match and it cannot fail
        let _ = self.plan.process(&mut input, &mut output);
        output
    }
}

// A number type for the transform library that equals `f64` except for sines and cosines.
//
// The library takes the twiddle factors of a plan from the system's sine and cosine, whose last bits depend
// on the processor from lengths of 4,096 on. It also orders additions differently for the number types that
// it knows. Our own number type avoids both. While a plan is made, it finds, for each number that the library
// passes to it, the fraction of a full turn with that cosine, and takes the cosine of this fraction from libm
// instead.

thread_local! {
    /// Number of equal parts into which the twiddle factors of the plan being made divide a full turn; zero
    /// while no plan is being made.
    static TWIDDLE_DIVISIONS: Cell<usize> = const { Cell::new(0) };
}

/// Largest allowed difference between the system's cosine and ours: many units in the last place, but much
/// less than the difference between two cosines of a plan.
const COSINE_TOLERANCE: f64 = 1e-14;

/// The real number type that a transform computes with, whose cosines are the same on every system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PortableReal(pub f64);

/// Makes a plan whose twiddle factors divide a turn into `parts` parts, a power of two.
pub(super) fn with_exact_twiddles<T>(parts: usize, plan: impl FnOnce() -> T) -> T {
    TWIDDLE_DIVISIONS.set(parts);
    let made = plan();
    TWIDDLE_DIVISIONS.set(0);
    made
}

/// The cosine from libm if a number approximates the cosine of a part of a turn; otherwise the number itself.
fn exact_cosine(number: f64) -> f64 {
    let parts = TWIDDLE_DIVISIONS.get() as f64;
    let (size, quarter) = (number.abs(), parts / 4.0);
    // numbers change only while a plan is made: the transform itself uses the number 0.5
    if size > 1.0 || parts == 0.0 {
        return number;
    }
    let part = (math::acos(size) / TAU * parts).round();
    // computed from the angle or its complement to a quarter turn, whichever is smaller
    let cosine = match part {
        part if part >= quarter => 0.0,
        part if 2.0 * part <= quarter => math::cos(TAU * (part / parts)),
        part => math::sin(TAU * ((quarter - part) / parts)),
    };
    if (cosine - size).abs() < COSINE_TOLERANCE { cosine.copysign(number) } else { number }
}

impl FromPrimitive for PortableReal {
    fn from_i64(number: i64) -> Option<Self> {
        Some(Self(number as f64))
    }

    fn from_u64(number: u64) -> Option<Self> {
        Some(Self(number as f64))
    }

    fn from_f64(number: f64) -> Option<Self> {
        Some(Self(exact_cosine(number)))
    }
}

macro_rules! operators {
    ($($name:ident $function:ident $operator:tt),*) => {$(
        impl $name for PortableReal {
            type Output = Self;
            #[inline]
            fn $function(self, other: Self) -> Self {
                Self(self.0 $operator other.0)
            }
        }
    )*};
}

operators!(Add add +, Sub sub -, Mul mul *, Div div /, Rem rem %);

impl Neg for PortableReal {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Zero for PortableReal {
    #[inline]
    fn zero() -> Self {
        Self(0.0)
    }

    fn is_zero(&self) -> bool {
        self.0 == 0.0
    }
}

impl One for PortableReal {
    #[inline]
    fn one() -> Self {
        Self(1.0)
    }
}

impl Num for PortableReal {
    type FromStrRadixErr = ParseFloatError;

    /// Decimal digits only; the library parses no numbers.
    fn from_str_radix(text: &str, _: u32) -> Result<Self, ParseFloatError> {
        text.parse().map(Self)
    }
}

impl Signed for PortableReal {
    fn abs(&self) -> Self {
        Self(self.0.abs())
    }

    fn abs_sub(&self, other: &Self) -> Self {
        Self((self.0 - other.0).max(0.0))
    }

    fn signum(&self) -> Self {
        Self(self.0.signum())
    }

    fn is_positive(&self) -> bool {
        self.0.is_sign_positive()
    }

    fn is_negative(&self) -> bool {
        self.0.is_sign_negative()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Samples without any pattern.
    fn samples(length: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..length).map(|_| next()).collect()
    }

    #[test]
    fn values_are_the_sums_that_define_them() {
        for length in [2, 4, 8, 16, 32, 64, 256, 2048] {
            let samples = samples(length);
            let found = RealTransform::new(length).spectrum_values(samples.iter().copied());
            assert_eq!(found.len(), length / 2 + 1);
            for (k, value) in found.iter().enumerate() {
                let turn = |n: usize| TAU * ((k * n) % length) as f64 / length as f64;
                let re: f64 = samples.iter().enumerate().map(|(n, x)| x * turn(n).cos()).sum();
                let im: f64 = samples.iter().enumerate().map(|(n, x)| -x * turn(n).sin()).sum();
                let error = (value.re - re).hypot(value.im - im);
                assert!(error < 1e-15 * length as f64, "{length} {k}: {error:e}");
            }
        }
    }

    #[test]
    fn a_long_transform_keeps_the_power_of_its_samples() {
        let length = 1 << 18;
        let samples = samples(length - 1001);
        let squares = RealTransform::new(length).squared_magnitudes(samples.iter().copied());
        let all: f64 = squares.iter().sum::<f64>() * 2.0 - squares[0] - squares[length / 2];
        let power: f64 = samples.iter().map(|x| x * x).sum();
        assert!((all / length as f64 / power - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_cosine_is_one_bin() {
        let length = 4096;
        let cosine = (0..length).map(|n| (TAU * ((37 * n) % length) as f64 / length as f64).cos());
        let magnitudes = RealTransform::new(length).magnitudes(cosine);
        for (k, magnitude) in magnitudes.iter().enumerate() {
            let expected = if k == 37 { length as f64 / 2.0 } else { 0.0 };
            assert!((magnitude - expected).abs() < 1e-11, "{k}: {magnitude:e}");
        }
    }

    #[test]
    fn a_cosine_with_wrong_last_digits_is_that_of_its_part_of_a_turn() {
        for parts in [4_usize, 8, 64, 4096, 1 << 20] {
            for part in (0..parts).step_by((parts / 512).max(1)) {
                let angle = TAU * (part as f64 / parts as f64);
                for wrong in [-2e-16, 0.0, 2e-16] {
                    let found =
                        with_exact_twiddles(parts, || exact_cosine((angle.cos() + wrong).clamp(-1.0, 1.0)));
                    assert!((found - angle.cos()).abs() < 1e-15, "{part} of {parts}: {found}");
                    assert_eq!(found.abs(), with_exact_twiddles(parts, || exact_cosine(angle.cos())).abs());
                }
            }
        }
    }

    #[test]
    fn a_number_that_is_no_cosine_stays() {
        for number in [0.5, -0.5, 0.3, 2.0, 1e-3, f64::INFINITY] {
            assert_eq!(with_exact_twiddles(1024, || exact_cosine(number)), number);
        }
        assert!(exact_cosine(f64::NAN).is_nan());
    }
}
