//! The spectrum of a window as curves, levels and named components.

use super::window::AnalysedWindow;
use crate::report::figure::spectrum::{Curve, Interval, Level, Named, Spectra};
use crate::spectrum::{Analysis, Component, Spectrum, Verdict};

impl AnalysedWindow<'_> {
    pub(super) fn spectra(&self) -> Spectra {
        let (analysis, spectrum) = (self.analysis, &self.analysis.spectrum);
        Spectra {
            title: self.title("Spectrum"),
            quantity: self.channel.to_string(),
            note: self.note.clone(),
            synthetic: self.recording.is_synthetic(),
            measured: Some(curve(analysis)),
            noise_floor_m: Some(spectrum.noise_floor_m),
            noise_floor: level(analysis, &analysis.noise_floor_m),
            interval_95: self.interval(),
            leakage: level(analysis, &analysis.leakage_m),
            components: spectrum.components.iter().map(|c| named(c, spectrum)).collect(),
            lowest_hz: spectrum.resolution_hz,
            ..Spectra::default()
        }
    }

    /// The jackknife interval of the density as amplitudes of the spectrum.
    fn interval(&self) -> Option<Interval> {
        let (multitaper, bandwidth_hz) =
            (self.analysis.multitaper.as_ref()?, self.analysis.spectrum.noise_bandwidth_hz);
        let amplitude = |density: f64| (2.0 * density * bandwidth_hz).sqrt();
        let ends: Vec<(f64, f64)> =
            (0..multitaper.frequency_hz.len()).filter_map(|bin| multitaper.interval_95(bin)).collect();
        Some(Interval {
            frequency_hz: multitaper.frequency_hz.clone(),
            lower_m: ends.iter().map(|e| amplitude(e.0)).collect(),
            upper_m: ends.iter().map(|e| amplitude(e.1)).collect(),
        })
    }
}

pub(super) fn curve(analysis: &Analysis) -> Curve {
    Curve {
        frequency_hz: analysis.spectrum.frequency_hz.clone(),
        amplitude_m: analysis.spectrum.amplitude_m.clone(),
    }
}

/// Amplitudes at the frequencies of the spectrum; none where there are not as many.
pub(super) fn level(analysis: &Analysis, amplitude_m: &[f64]) -> Option<Level> {
    let frequency_hz = &analysis.spectrum.frequency_hz;
    (amplitude_m.len() == frequency_hz.len())
        .then(|| Level { frequency_hz: frequency_hz.clone(), amplitude_m: amplitude_m.to_vec() })
}

/// A component at its height in the spectrum, as its amplitude may be that of a start; one that drifts has no
/// height there, but a mean.
pub(super) fn named(c: &Component, spectrum: &Spectrum) -> Named {
    let bin_hz = spectrum.frequency_hz.get(1).copied().unwrap_or(f64::INFINITY);
    let height_m = spectrum.amplitude_m.get((c.frequency_hz / bin_hz).round() as usize).copied();
    let shown_m = height_m.filter(|_| c.range_hz.is_none()).unwrap_or(c.amplitude_m);
    let share = if c.amplitude_m > 0.0 { c.amplitude_sd_m / c.amplitude_m } else { 0.0 };
    Named {
        frequency_hz: c.frequency_hz,
        frequency_sd_hz: c.frequency_sd_hz,
        range_hz: c.range_hz.map(|range| (range.low_hz, range.high_hz)),
        amplitude_m: shown_m,
        amplitude_sd_m: shown_m * share,
        remark: if c.verdict == Verdict::Clear { String::new() } else { c.verdict.word().to_owned() },
    }
}
