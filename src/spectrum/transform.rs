//! The Fourier transform of real samples; the only files that name the transform library.

mod real;

use crate::math;
use real::{PortableReal, with_exact_twiddles};
use realfft::{RealFftPlanner, RealToComplex};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

/// A value of a transform.
pub(super) type Complex = nalgebra::Complex<f64>;

/// Plans of the lengths that any thread has met: making one takes longer than using it.
static PLANNER: LazyLock<Mutex<RealFftPlanner<PortableReal>>> =
    LazyLock::new(|| Mutex::new(RealFftPlanner::new()));

/// A transform of one length.
pub(super) struct RealTransform {
    plan: Arc<dyn RealToComplex<PortableReal>>,
}

impl RealTransform {
    /// For records padded with zeros to `padded` values, a power of two from 2 on.
    pub(super) fn new(padded: usize) -> Self {
        debug_assert!(padded.is_power_of_two() && padded >= 2);
        // (a thread that ended while it planned leaves whole plans behind)
        let mut planner = PLANNER.lock().unwrap_or_else(PoisonError::into_inner);
        Self { plan: with_exact_twiddles(padded, || planner.plan_fft_forward(padded)) }
    }

    /// `sum x exp(-2 pi i k n / padded)` for every `k` from 0 to half the length, which is at least that of
    /// `values`.
    pub(super) fn spectrum_values(&self, values: impl Iterator<Item = f64>) -> Vec<Complex> {
        self.execute_plan(values).into_iter().map(|z| Complex { re: z.re.0, im: z.im.0 }).collect()
    }

    /// Magnitudes of [`Self::spectrum_values`].
    pub(super) fn magnitudes(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        self.execute_plan(values).iter().map(|z| math::hypot(z.re.0, z.im.0)).collect()
    }

    /// The squares of [`Self::magnitudes`], in a fraction of the time.
    pub(super) fn squared_magnitudes(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        self.execute_plan(values).iter().map(|z| z.norm_sqr().0).collect()
    }

    fn execute_plan(
        &self,
        values: impl Iterator<Item = f64>,
    ) -> Vec<realfft::num_complex::Complex<PortableReal>> {
        let mut input = self.plan.make_input_vec();
        let mut output = self.plan.make_output_vec();
        for (slot, value) in input.iter_mut().zip(values) {
            *slot = PortableReal(value);
        }
        // both buffers come from the plan, so their lengths are right and it cannot refuse them
        let _ = self.plan.process(&mut input, &mut output);
        output
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
}
