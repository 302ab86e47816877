//! An oscillation that was found in a record.

use super::time_frequency::FrequencyRange;
use super::verdict::{
    AliasSource, ComponentReason, ComponentVerdict, Harmonic, MainsMultiple, Sideband, Subharmonic,
};
use serde::Serialize;

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
    #[must_use]
    pub fn is_resolvable(&self) -> bool {
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
