//! Damping of a ring-down by its logarithmic decrement between the halves of a window.
//!
//! In the second half a decaying sinusoid is what it was in the first, `exp(-d T/2)` times as large and
//! turned. So the amplitudes that the same Hann window reads in both halves, at any frequency near its
//! own, have exactly that ratio: `d = 2 ln(a1 / a2) / T`, and `zeta = d / sqrt(d^2 + (2 pi f)^2)`. What is
//! not exact is the rest: the trend that takes a little of the oscillation with it, a neighbour, the noise.
//! It takes two sums over the window besides the spectrum that gives the frequency.

use super::band::FeatureBand;
use super::missing::{LEAST_CYCLES, MissingValue};
use super::reader::FeatureReader;
use super::spectral;
use super::value::FeatureValue;
use crate::math;
use std::f64::consts::TAU;

/// Least amplitude left in the second half, in deviations of the noise: at 3 it is known to a third, and
/// noise alone seldom shows it.
pub(crate) const LEAST_FINAL_AMPLITUDE: f64 = 3.0;

/// Damping ratio of the strongest component of a band.
pub(super) fn read_damping_ratio(
    band: &FeatureBand,
    reader: &FeatureReader,
) -> Result<FeatureValue, MissingValue> {
    let component = spectral::strongest_component(band, reader)?;
    let transformed = reader.band_transform(band)?;
    let frequency_hz = component.frequency_hz;
    let duration_s = transformed.duration_s();
    let cycles = frequency_hz * duration_s / 2.0;
    if cycles < LEAST_CYCLES {
        return Err(MissingValue::FewCycles { frequency_hz, cycles });
    }
    let [first_m, second_m] = transformed.half_amplitudes_m(frequency_hz);
    // a half has half the frames, so twice the power of noise in a bin: as a deviation of an amplitude just
    // the floor of the whole
    let noise_m = component.amplitude_m / math::powf(10.0, component.snr_db / 20.0);
    if second_m < LEAST_FINAL_AMPLITUDE * noise_m {
        return Err(MissingValue::Faded { frequency_hz, second_m });
    }
    if first_m <= second_m {
        return Err(MissingValue::NoDecay { frequency_hz, first_m, second_m });
    }
    let decay_per_s = 2.0 * math::ln(first_m / second_m) / duration_s;
    let decay_sd_per_s = 2.0 * math::hypot(noise_m / first_m, noise_m / second_m) / duration_s;
    let omega = TAU * frequency_hz;
    Ok(FeatureValue::new(decay_per_s / math::hypot(decay_per_s, omega), Some(decay_sd_per_s / omega)))
}
