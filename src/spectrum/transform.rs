//! The Fourier transform of real samples; the only file that names the transform library.

use realfft::{RealFftPlanner, RealToComplex};
use std::cell::RefCell;
use std::sync::Arc;

/// A value of a transform.
pub(super) type Complex = realfft::num_complex::Complex<f64>;

thread_local! {
    /// Plans of the lengths that this thread has met: making one takes longer than using it.
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// A transform of one length.
pub(super) struct Transform {
    plan: Arc<dyn RealToComplex<f64>>,
}

impl Transform {
    /// For records padded with zeros to `padded` values, an even number.
    pub(super) fn of(padded: usize) -> Self {
        Self { plan: PLANNER.with_borrow_mut(|planner| planner.plan_fft_forward(padded)) }
    }

    /// `sum x exp(-2 pi i k n / padded)` for every `k` from 0 to half the length, which is at least that of
    /// `values`.
    pub(super) fn values(&self, values: impl Iterator<Item = f64>) -> Vec<Complex> {
        let mut input = self.plan.make_input_vec();
        let mut output = self.plan.make_output_vec();
        for (slot, value) in input.iter_mut().zip(values) {
            *slot = value;
        }
        // both buffers come from the plan, so their lengths are right and it cannot refuse them
        let _ = self.plan.process(&mut input, &mut output);
        output
    }

    /// Magnitudes of [`Self::values`].
    pub(super) fn magnitudes(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        self.values(values).iter().map(|z| z.norm()).collect()
    }

    /// The squares of [`Self::magnitudes`], in a fraction of the time.
    pub(super) fn squares(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut input = self.plan.make_input_vec();
        let mut output = self.plan.make_output_vec();
        for (slot, value) in input.iter_mut().zip(values) {
            *slot = value;
        }
        let _ = self.plan.process(&mut input, &mut output); // as above
        output.iter().map(|z| z.norm_sqr()).collect()
    }
}
