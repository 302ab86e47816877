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
    /// Standard deviation of the frequency, Hz. For least squares it follows from the noise, from the scatter
    /// of the frequency within the record, and from other explanations that are nearly as probable; for a
    /// periodogram it is 1.6 times the Cramér-Rao bound, plus the effect of a removed trend.
    pub frequency_sd_hz: f64,
    /// Lowest and highest frequency of a component that drifts. `frequency_hz` is then the mean: the number
    /// of cycles divided by their duration, while the component is present.
    pub range_hz: Option<FrequencyRange>,
    /// Start, s from the first frame analysed; `None` for a component present from the first frame on. If the
    /// component was found in a piece of a long record and is present when the piece starts, the start of the
    /// piece.
    pub begins_s: Option<f64>,
    /// Amplitude, m. A decaying component has this amplitude at the start of the component or of the record,
    /// whichever is later.
    pub amplitude_m: f64,
    /// Standard deviation of the amplitude, m.
    pub amplitude_sd_m: f64,
    /// Damping ratio, negative for a growing component; `None` if the estimator gives none.
    pub damping_ratio: Option<f64>,
    /// Standard deviation of the damping ratio.
    pub damping_ratio_sd: Option<f64>,
    /// Ratio of the amplitude in the spectrum to the noise floor of the spectrum, dB (`20 log10`).
    pub snr_db: f64,
    /// Cramér-Rao bound of the frequency, Hz. It assumes that the record has no gaps and contains only this
    /// component and white noise that disturbs it as much as the noise of the record does. A component along
    /// a ridge has no bound; this field then equals `frequency_sd_hz`.
    pub cramer_rao_hz: f64,
    /// Probability that noise alone produces a line as steady as this component (Thomson's F over the
    /// tapers): small for a steady oscillation, near one for a ring-down.
    pub line_probability: Option<f64>,
    /// Method that estimated the component.
    pub estimator: Estimator,
    /// Amplitude of the removed trend at this frequency, m.
    pub leakage_m: Option<f64>,
    /// Exposure gain at this frequency, 0 to 1; `None` if the exposure is not known.
    pub exposure_passes: Option<f64>,
    /// Faster frequencies that would appear at this frequency.
    pub folded_from: Vec<AliasSource>,
    /// The component of which this is a harmonic.
    pub harmonic_of: Option<Harmonic>,
    /// The component of which this is a fraction.
    pub subharmonic_of: Option<Subharmonic>,
    /// The component of which this is a sideband.
    pub sideband_of: Option<Sideband>,
    /// The multiple of the mains frequency that lies within three standard deviations of the frequency.
    pub mains: Option<MainsMultiple>,
    /// The verdict of the most serious reason, or clear.
    pub verdict: ComponentVerdict,
    /// All reasons against the component, the most serious first.
    pub reasons: Vec<ComponentReason>,
}

/// Method that estimated a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// The maximum of a Hann-windowed periodogram.
    #[default]
    Periodogram,
    /// Least squares of the trend and all components on the frames present.
    LeastSquares,
    /// Means along the course of the frequency.
    Ridge,
}

impl Component {
    /// Whether the record holds enough cycles of the component to determine its frequency.
    pub fn is_resolvable(&self) -> bool {
        self.verdict != ComponentVerdict::NotResolvable
    }
}

// The Cramér-Rao bound of a frequency (Rife and Boorstyn 1974, for a decaying tone summed frame by frame).

/// A decaying tone in white noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct DecayingTone {
    /// Amplitude at the start of the record, m.
    pub amplitude_m: f64,
    /// Decay over the record, nepers.
    pub nepers: f64,
    /// Standard deviation of the noise, m.
    pub noise_m: f64,
}

impl DecayingTone {
    /// Bound on the standard deviation of the frequency, Hz, with amplitude, phase and decay unknown.
    ///
    /// Amplitude and decay are uncorrelated with phase and frequency, so with weights `p = exp(-2 d t / T)`
    /// the information on the frequency is `(2 pi A)^2 / (2 sigma^2)` times the spread `sum p t^2 - (sum p
    /// t)^2 / sum p`. For a steady tone the bound has the closed form `fs / (2 pi) sqrt(12 / (eta N (N^2 -
    /// 1)))`, `eta = A^2 / (2 sigma^2)`.
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

/// Reliability of a component's frequency, the most serious doubt first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ComponentVerdict {
    /// Fewer than `MIN_CYCLES` cycles in the record: the frequency depends on the trend and the window.
    NotResolvable,
    /// A faster oscillation that the motion may contain would appear at the same frequency.
    AliasSuspected,
    /// An explanation of the record without the component, or with another frequency, is nearly as probable;
    /// the component may be a piece of another motion or of noise; or its amplitude is within three standard
    /// deviations of zero.
    Ambiguous,
    /// A multiple of the frequency of a stronger component, to within four standard deviations.
    Harmonic,
    /// A half or a third of the frequency of a stronger component, or a multiple of these: successive cycles
    /// alternate.
    Subharmonic,
    /// A stronger component, modulated by another component.
    Sideband,
    /// Within three standard deviations of a multiple of the mains frequency: a lamp may have caused it.
    Mains,
    /// The exposure has passed less than nine tenths of the amplitude.
    Attenuated,
    /// Above the level that noise reaches in one of a hundred spectra, but less than `CLEAR_DB` above the
    /// noise floor.
    Weak,
    /// There is no reason against the component.
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

    /// The name in files and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

impl Component {
    /// Adds a reason for which the frequency is ambiguous that the record itself does not show.
    pub fn add_doubt(&mut self, words: String) {
        let verdict = ComponentVerdict::Ambiguous;
        let graver = self.reasons.partition_point(|reason| reason.verdict <= verdict);
        self.reasons.insert(graver, ComponentReason { verdict, words });
        self.verdict = self.reasons[0].verdict;
    }
}

/// A verdict with the numbers behind it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComponentReason {
    /// The verdict.
    pub verdict: ComponentVerdict,
    /// The numbers, as a sentence.
    pub words: String,
}

/// A faster frequency that would appear at the frequency of a component.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AliasSource {
    /// The faster frequency, Hz.
    pub frequency_hz: f64,
    /// Exposure gain at the faster frequency, 0 to 1; `None` if the exposure is not known.
    pub exposure_passes: Option<f64>,
}

/// A component whose frequency, times a fraction, is the frequency of another component.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Subharmonic {
    /// Frequency of the component, Hz.
    pub frequency_hz: f64,
    /// The numerator of the fraction.
    pub numerator: usize,
    /// The denominator of the fraction: number of cycles after which the pattern repeats.
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

/// A component whose frequency, times a whole number, is the frequency of another component.
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
        // in an endless record the spread is 1 / (8 a^3 dt), with the decay a, 1/s, and the frame interval
        // dt, s
        let (frames, rate, decay) = (100_000, 1e5, 40.0);
        let tone = DecayingTone { amplitude_m: 1.0, nepers: decay * frames as f64 / rate, noise_m: 0.1 };
        let closed = (2.0 * 8.0 * f64::powi(decay, 3) / rate).sqrt() * 0.1 / TAU;
        assert!((tone.cramer_rao_bound_hz(frames, rate) / closed - 1.0).abs() < 1e-3);
    }
}
