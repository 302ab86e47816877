//! An oscillation that was found in a record.

use super::time_frequency::FrequencyRange;
use portable_math as math;
use serde::Serialize;
use std::f64::consts::TAU;

/// One component of a spectrum.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Component {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz. Least squares: from the residual around the component, and
    /// from the shift with a richer trend. Periodogram: 1.6 times the Cramér-Rao bound, and the effect of a
    /// removed trend.
    pub frequency_sd_hz: f64,
    /// Least and greatest frequency of a component that drifts; `frequency_hz` is then its mean while it was
    /// followed, by counting cycles.
    pub range_hz: Option<FrequencyRange>,
    /// Start, s from the first frame analysed; `None` for a component present from the first frame. In a
    /// piece of a long record: the start of the piece, if the component is present by then.
    pub begins_s: Option<f64>,
    /// Amplitude, m; of a decaying component where it begins or the record starts.
    pub amplitude_m: f64,
    /// Standard deviation of the amplitude, m.
    pub amplitude_sd_m: f64,
    /// Damping ratio, negative for a growing one; `None` where the estimator has none.
    pub damping_ratio: Option<f64>,
    /// Standard deviation of the damping ratio.
    pub damping_ratio_sd: Option<f64>,
    /// Amplitude in the spectrum over its noise floor, `20 log10`, dB.
    pub snr_db: f64,
    /// Cramér-Rao bound of the frequency of this component alone, in white noise of the size found around it,
    /// in a record without gaps, Hz.
    pub cramer_rao_hz: f64,
    /// The chance that noise gives so steady a line (Thomson's F over the tapers): small for a steady
    /// oscillation, near one for a ring-down.
    pub line_probability: Option<f64>,
    /// How it was read.
    pub estimator: Estimator,
    /// Shift of the frequency when the trend takes two columns more, Hz.
    pub trend_shift_hz: Option<f64>,
    /// Amplitude of the removed trend at this frequency, m.
    pub leakage_m: Option<f64>,
    /// Exposure gain at this frequency, 0 to 1; `None` where the exposure is not known.
    pub exposure_passes: Option<f64>,
    /// Faster frequencies that would appear at this one.
    pub folded_from: Vec<AliasSource>,
    /// The component of which this is a harmonic.
    pub harmonic_of: Option<Harmonic>,
    /// The component of which this is a fraction.
    pub subharmonic_of: Option<Subharmonic>,
    /// The component of which this is a sideband.
    pub sideband_of: Option<Sideband>,
    /// The multiple of the mains frequency that lies within its deviation.
    pub mains: Option<MainsMultiple>,
    /// The gravest of the reasons, or clear.
    pub verdict: ComponentVerdict,
    /// All that was found against it, gravest first.
    pub reasons: Vec<ComponentReason>,
}

/// How a component was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// The top of a Hann-windowed periodogram.
    #[default]
    Periodogram,
    /// Least squares of the trend and all components on the frames present.
    LeastSquares,
    /// Means over the course of its frequency.
    Ridge,
}

impl Component {
    /// Whether the record holds enough of its cycles for a frequency of its own.
    pub fn is_resolvable(&self) -> bool {
        self.verdict != ComponentVerdict::NotResolvable
    }
}

// The Cramér-Rao bound of a frequency (Rife and Boorstyn 1974, for a decaying tone summed frame by frame).

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
    /// Amplitude and decay are uncorrelated with phase and frequency, so with weights `p = exp(-2 d t / T)`
    /// the information on the frequency is `(2 pi A)^2 / (2 sigma^2)` times the spread `sum p t^2 - (sum p
    /// t)^2 / sum p`. For a steady tone that is the closed form `fs / (2 pi) sqrt(12 / (eta N (N^2 - 1)))`,
    /// `eta = A^2 / (2 sigma^2)`.
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

/// How far a component's frequency can be trusted, gravest reason first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ComponentVerdict {
    /// Fewer than `MIN_CYCLES` in the record: the frequency depends on the trend and the window.
    NotResolvable,
    /// A faster oscillation that the motion may hold would appear at the same frequency.
    AliasSuspected,
    /// No trend describes the motion under it, or a richer trend moves it by more than three deviations; its
    /// amplitude is within three deviations of zero; a quarter of it is left around it; or no oscillation of
    /// constant frequency and steady decay explains it.
    Ambiguous,
    /// A multiple of a stronger component, to within four deviations.
    Harmonic,
    /// A half or a third of a stronger component, or a multiple of these: beats alternate.
    Subharmonic,
    /// A stronger component, modulated by another.
    Sideband,
    /// Within its deviation of a multiple of the mains frequency: a lamp may have made it.
    Mains,
    /// The exposure has passed less than nine tenths of the amplitude.
    Attenuated,
    /// Above the level that noise reaches once in a hundred spectra, but less than `CLEAR_DB` above the noise
    /// floor.
    Weak,
    /// No reason against it.
    #[default]
    Clear,
}

impl ComponentVerdict {
    const NAMES: [&str; 10] = [
        "not-resolvable",
        "alias-suspected",
        "ambiguous",
        "harmonic",
        "subharmonic",
        "sideband",
        "mains",
        "attenuated",
        "weak",
        "clear",
    ];

    /// The word in files and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// A verdict with the numbers behind it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComponentReason {
    /// The verdict.
    pub verdict: ComponentVerdict,
    /// The numbers, in a sentence.
    pub words: String,
}

/// A faster frequency that would appear at that of a component.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AliasSource {
    /// The faster frequency, Hz.
    pub frequency_hz: f64,
    /// Exposure gain at the faster frequency, 0 to 1; `None` where the exposure is not known.
    pub exposure_passes: Option<f64>,
}

/// A component of which another is a fraction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Subharmonic {
    /// Frequency of the component, Hz.
    pub frequency_hz: f64,
    /// The fraction's numerator.
    pub numerator: usize,
    /// Its denominator: beats until one is like the first.
    pub denominator: usize,
}

/// A carrier of which another component is a sideband.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sideband {
    /// Frequency of the carrier, Hz.
    pub frequency_hz: f64,
    /// Modulation frequency, Hz.
    pub modulation_hz: f64,
}

/// A multiple of the mains frequency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct MainsMultiple {
    /// Frequency of the mains, Hz.
    pub frequency_hz: usize,
    /// The multiple.
    pub multiple: usize,
}

/// A component of which another is a multiple.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Harmonic {
    /// Frequency of the component, Hz.
    pub frequency_hz: f64,
    /// The multiple.
    pub multiple: usize,
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
