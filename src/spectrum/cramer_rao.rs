//! The least variance that any unbiased reading of a frequency can have (Rife and Boorstyn 1974, for a
//! decaying tone summed frame by frame).

use crate::math;
use std::f64::consts::TAU;

/// A decaying tone in white noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct DecayingTone {
    /// Amplitude where the record starts, m.
    pub amplitude_m: f64,
    /// Nepers by which it decays over the record.
    pub nepers: f64,
    /// Standard deviation of the noise, m.
    pub noise_m: f64,
}

impl DecayingTone {
    /// Bound on the standard deviation of the frequency, Hz, with amplitude, phase and decay unknown.
    ///
    /// Amplitude and decay say nothing of phase and frequency, so with weights `p = exp(-2 d t / T)` the
    /// information on the frequency is `(2 pi A)^2 / (2 sigma^2)` times the spread `sum p t^2 - (sum p t)^2 /
    /// sum p`. For a steady tone that is the closed form `fs / (2 pi) sqrt(12 / (eta N (N^2 - 1)))`, `eta =
    /// A^2 / (2 sigma^2)`.
    pub(super) fn cramer_rao_bound_hz(&self, frames: usize, frame_rate_hz: f64) -> f64 {
        let shrink = math::exp(-2.0 * self.nepers / frames as f64);
        let (mut power, mut sums) = (1.0, [0.0; 3]);
        for i in 0..frames {
            let t = i as f64 / frame_rate_hz;
            sums = [sums[0] + power, sums[1] + power * t, sums[2] + power * t * t];
            power *= shrink;
        }
        let spread = sums[2] - sums[1] * sums[1] / sums[0];
        (2.0 / spread).sqrt() * self.noise_m / (self.amplitude_m * TAU)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_tone_has_the_closed_form() {
        let tone = DecayingTone { amplitude_m: 2.0, nepers: 0.0, noise_m: 0.1 };
        let (frames, rate, eta) = (750.0_f64, 5000.0, 200.0);
        let closed = rate / TAU * (12.0 / (eta * frames * (frames * frames - 1.0))).sqrt();
        assert!((tone.cramer_rao_bound_hz(750, rate) / closed - 1.0).abs() < 1e-10);
    }

    #[test]
    fn a_fast_decay_has_the_bound_of_an_endless_record() {
        // in an endless record spread = 1 / (8 a^3 dt) for a decay of a per second
        let (frames, rate, decay) = (100_000, 1e5, 40.0);
        let tone = DecayingTone { amplitude_m: 1.0, nepers: decay * frames as f64 / rate, noise_m: 0.1 };
        let closed = (2.0 * 8.0 * f64::powi(decay, 3) / rate).sqrt() * 0.1 / TAU;
        assert!((tone.cramer_rao_bound_hz(frames, rate) / closed - 1.0).abs() < 1e-3);
    }
}
