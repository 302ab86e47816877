//! Whether times and rates agree within their digits.

/// Largest difference between two rates that are meant to be one: cameras hold theirs to parts in ten
/// thousand, and wrong rates are wrong by far more.
pub(crate) const RATE_AGREEMENT: f64 = 0.01;

/// Decimal places to which programs round times, s.
pub(crate) const QUANTA_S: [f64; 8] = [1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];

/// Whether times lie on the grid of `rate_hz` from the first one on, as near as their last digit.
pub(crate) fn times_fit_rate(times: &[f64], frames: &[f64], rate_hz: f64) -> bool {
    let (Some(start), Some(first)) = (times.first(), frames.first()) else { return false };
    let half_quantum =
        QUANTA_S.into_iter().find(|q| are_multiples(times, *q)).map_or(1e-9, |q| q / 2.0 * (1.0 + 1e-6));
    // the first time is rounded too
    times
        .iter()
        .zip(frames)
        .all(|(time, frame)| (start + (frame - first) / rate_hz - time).abs() <= 2.0 * half_quantum)
}

/// Whether every time is a multiple of `quantum_s`.
pub(crate) fn are_multiples(times: &[f64], quantum_s: f64) -> bool {
    times.iter().all(|t| (t / quantum_s - (t / quantum_s).round()).abs() <= 1e-6)
}
