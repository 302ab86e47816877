//! Whether a recording can show a component of a given frequency.

use super::measured::{FEWEST_CYCLES, NYQUIST_SHARE, Quality};
use crate::camera::{alias_hz, exposure_gain};
use serde::Serialize;

/// Title of the paper whose experiment found [`PUBLISHED_COMPONENTS_HZ`].
pub const PUBLISHED_TITLE: &str = "Investigation of the dynamics of the wiper blade around the reversal";
/// The two components of the published experiment, with their names, Hz.
pub const PUBLISHED_COMPONENTS_HZ: [(&str, f64); 2] =
    [("low", 78.4), ("high (printed as about 900 Hz)", 900.0)];
/// Share of an amplitude that still counts as shown in full: a scale is rarely known better than to a tenth.
const NEARLY_ALL: f64 = 0.9;

/// What a recording makes of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Visibility {
    /// Frequency and amplitude can be read.
    Shown,
    /// The frequency can be read; the exposure makes the amplitude smaller.
    Attenuated,
    /// Above 0.8 of the Nyquist frequency: it is close to its own alias.
    NearNyquist,
    /// Above the Nyquist frequency: it appears at a wrong, lower frequency.
    Aliased,
    /// Fewer than three cycles in the recording.
    TooFewCycles,
}

/// A component as a recording shows it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ComponentVisibility {
    /// Frequency of the component, Hz.
    pub frequency_hz: f64,
    /// Whether it can be seen.
    pub verdict: Visibility,
    /// Frequency at which it appears, Hz; the same unless it is aliased.
    pub appears_at_hz: f64,
    /// Cycles of it in the whole recording.
    pub cycles: f64,
    /// Part of its amplitude that the exposure passes; `None` where the exposure is not known.
    pub exposure_passes: Option<f64>,
}

impl Quality {
    /// What the recording makes of a component of `frequency_hz`, a positive number.
    #[must_use]
    pub fn component_visibility(&self, frequency_hz: f64) -> ComponentVisibility {
        let cycles = frequency_hz * self.duration_s;
        let passes = self.exposure_s().map(|exposure| exposure_gain(frequency_hz, exposure));
        let verdict = if frequency_hz > self.nyquist_hz {
            Visibility::Aliased
        } else if cycles < FEWEST_CYCLES {
            Visibility::TooFewCycles
        } else if frequency_hz > NYQUIST_SHARE * self.nyquist_hz {
            Visibility::NearNyquist
        } else if passes.is_some_and(|part| part < NEARLY_ALL) {
            Visibility::Attenuated
        } else {
            Visibility::Shown
        };
        ComponentVisibility {
            frequency_hz,
            verdict,
            appears_at_hz: alias_hz(frequency_hz, self.frame_rate_hz),
            cycles,
            exposure_passes: passes,
        }
    }
}

impl ComponentVisibility {
    /// The verdict in words, with its numbers.
    #[must_use]
    pub fn describe(&self) -> String {
        let what = match self.verdict {
            Visibility::Shown => "shown".to_owned(),
            Visibility::Attenuated => "attenuated".to_owned(),
            Visibility::NearNyquist => "close to the Nyquist frequency and to its own alias".to_owned(),
            Visibility::Aliased => format!("aliased to {:.1} Hz", self.appears_at_hz),
            Visibility::TooFewCycles => format!("too few cycles for a frequency ({FEWEST_CYCLES} needed)"),
        };
        let exposure = self.exposure_passes.map_or_else(
            || "exposure unknown".to_owned(),
            |part| format!("{:.1} % of the amplitude", 100.0 * part),
        );
        format!("{what}: {:.1} cycles, {exposure}", self.cycles)
    }
}
