//! The Fourier transform of real samples; the only file that names the transform library.

use realfft::RealFftPlanner;

/// `|sum x exp(-2 pi i k n / padded)|` for every `k` from 0 to half of `padded`, which is even and at least as long as `values`.
pub(super) fn magnitudes(values: &[f64], padded: usize) -> Vec<f64> {
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(padded);
    let mut input = plan.make_input_vec();
    let mut output = plan.make_output_vec();
    for (slot, value) in input.iter_mut().zip(values) {
        *slot = *value;
    }
    // both buffers come from the plan, so their lengths are right and it cannot refuse them
    let _ = plan.process(&mut input, &mut output);
    output.iter().map(|z| z.norm()).collect()
}
