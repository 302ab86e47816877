//! An oscillation that was found in a record.

use super::time_frequency::FrequencyRange;
use crate::math;
use serde::Serialize;
use std::f64::consts::TAU;

/// One component of a spectrum.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Component {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz. Of least squares: what the rest around the component gives
    /// it, and what it moves by with a richer trend. Of a periodogram: 1.6 times the Cramér-Rao bound, and
    /// what a removed trend leaves.
    pub frequency_sd_hz: f64,
    /// Least and greatest frequency of a component that drifts; its frequency is the number of its cycles
    /// over the time in which it was followed.
    pub range_hz: Option<FrequencyRange>,
    /// Where it begins, s from the first frame that was analysed; `None` for one that is there from the
    /// start. Of a piece of a long record: where the piece starts, if it is there by then.
    pub begins_s: Option<f64>,
    /// Amplitude of a steady oscillation; of a decaying one, where it begins or the record starts, m.
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
    /// What the frequency moves by when the trend takes two columns more, Hz.
    pub trend_shift_hz: Option<f64>,
    /// Amplitude that the removed trend would have shown at this frequency, m.
    pub leakage_m: Option<f64>,
    /// Part of the amplitude that the exposure has passed; `None` where the exposure is not known.
    pub exposure_passes: Option<f64>,
    /// What else the frequency may be.
    pub folded_from: Vec<AliasSource>,
    /// The component of which this is a harmonic.
    pub harmonic_of: Option<Harmonic>,
    /// The component of which this is a fraction.
    pub subharmonic_of: Option<Subharmonic>,
    /// The component of which this is a sideband.
    pub sideband_of: Option<Sideband>,
    /// The multiple of the mains frequency that it is within its deviation of.
    pub mains: Option<MainsMultiple>,
    /// What the frequency is worth: the gravest of the reasons, or clear.
    pub verdict: ComponentVerdict,
    /// All that was found against it, gravest first.
    pub reasons: Vec<ComponentReason>,
}

/// How a component was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// The top of a Hann-windowed periodogram.
    Periodogram,
    /// Least squares of the trend and all components on the frames present.
    LeastSquares,
    /// Means over the course of its frequency.
    Ridge,
}

impl Component {
    /// Whether the record holds enough of its cycles for a frequency of its own.
    pub(crate) fn is_resolvable(&self) -> bool {
        self.verdict != ComponentVerdict::NotResolvable
    }

    /// With nothing known but how it is read.
    pub(super) fn from_estimator(estimator: Estimator) -> Self {
        Self {
            frequency_hz: 0.0,
            frequency_sd_hz: 0.0,
            range_hz: None,
            begins_s: None,
            amplitude_m: 0.0,
            amplitude_sd_m: 0.0,
            damping_ratio: None,
            damping_ratio_sd: None,
            snr_db: 0.0,
            cramer_rao_hz: 0.0,
            line_probability: None,
            estimator,
            trend_shift_hz: None,
            leakage_m: None,
            exposure_passes: None,
            folded_from: Vec::new(),
            harmonic_of: None,
            subharmonic_of: None,
            sideband_of: None,
            mains: None,
            verdict: ComponentVerdict::Clear,
            reasons: Vec::new(),
        }
    }
}

// The least variance that any unbiased reading of a frequency can have (Rife and Boorstyn 1974, for a
// decaying tone summed frame by frame).

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

// What a component's frequency is worth.

/// What a component's frequency is worth, gravest reason first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ComponentVerdict {
    /// Fewer than `MIN_CYCLES` in the record: the frequency depends on the trend and the window.
    NotResolvable,
    /// A faster oscillation that the motion may hold would appear at the same frequency.
    AliasSuspected,
    /// No trend describes what it rides on, or a richer one moves it by more than three deviations, its
    /// amplitude is within three of zero, a quarter of it is left around it, or no oscillation that keeps its
    /// frequency and decays steadily explains it.
    Ambiguous,
    /// A multiple of a stronger component, to within four deviations.
    Harmonic,
    /// A half or a third of a stronger component, or a multiple of these: not every beat is like the one
    /// before.
    Subharmonic,
    /// A stronger component, modulated by another.
    Sideband,
    /// Within its deviation of a multiple of the mains frequency: a lamp may have made it.
    Mains,
    /// The exposure has passed less than nine tenths of the amplitude.
    Attenuated,
    /// Above what noise alone reaches once in a hundred spectra, but less than `CLEAR_DB` above the
    /// noise floor.
    Weak,
    /// Nothing of the above.
    Clear,
}

impl ComponentVerdict {
    /// The word in files and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NotResolvable => "not-resolvable",
            Self::AliasSuspected => "alias-suspected",
            Self::Ambiguous => "ambiguous",
            Self::Harmonic => "harmonic",
            Self::Subharmonic => "subharmonic",
            Self::Sideband => "sideband",
            Self::Mains => "mains",
            Self::Attenuated => "attenuated",
            Self::Weak => "weak",
            Self::Clear => "clear",
        }
    }
}

/// A verdict with what it rests on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComponentReason {
    /// The verdict.
    pub verdict: ComponentVerdict,
    /// The numbers behind it, in words.
    pub words: String,
}

/// A frequency that would appear at a component's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AliasSource {
    /// The faster frequency, Hz.
    pub frequency_hz: f64,
    /// Part of its amplitude that the exposure would have passed, where that is known.
    pub exposure_passes: Option<f64>,
}

/// A component of which another is a fraction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Subharmonic {
    /// Frequency of the component, Hz.
    pub frequency_hz: f64,
    /// The fraction's numerator.
    pub numerator: usize,
    /// Its denominator: so many beats pass until one is like the first.
    pub denominator: usize,
}

/// A component that another is modulated from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sideband {
    /// Frequency of the component, Hz.
    pub frequency_hz: f64,
    /// Frequency that it is modulated with, Hz.
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
