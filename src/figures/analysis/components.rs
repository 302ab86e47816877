//! The spectrum of a window as curves, levels and named components.

use super::window::AnalysedWindow;
use crate::figures::spectrum::{
    AmplitudeInterval, LabelledComponent, SpectraPlot, SpectrumCurve, SpectrumLevel, strongest_claim,
};
use crate::spectrum::{Component, ComponentVerdict, SpectralAnalysis, Spectrum};

impl AnalysedWindow<'_> {
    pub(super) fn spectra(&self) -> SpectraPlot {
        let (analysis, spectrum) = (self.analysis, &self.analysis.spectrum);
        let shown = SpectraPlot {
            quantity: self.channel.to_string(),
            note: self.figure_note("spectrum"),
            synthetic: self.recording.is_synthetic(),
            measured: Some(spectrum_curve(analysis)),
            noise_floor_m: Some(spectrum.noise_floor_m),
            noise_floor: spectrum_level(analysis, &analysis.noise_floor_m),
            interval_95: self.noise_interval(),
            leakage: spectrum_level(analysis, &analysis.leakage_m),
            components: spectrum.components.iter().map(|c| label_component(c, spectrum)).collect(),
            lowest_hz: spectrum.resolution_hz,
            ..SpectraPlot::default()
        };
        SpectraPlot { title: strongest_claim(&shown), ..shown }
    }

    /// What the noise leaves open of every amplitude of the curve that is drawn.
    fn noise_interval(&self) -> Option<AmplitudeInterval> {
        let floor = spectrum_level(self.analysis, &self.analysis.noise_floor_m)?;
        Some(AmplitudeInterval::from_noise_floor(&spectrum_curve(self.analysis), &floor))
    }
}

pub(super) fn spectrum_curve(analysis: &SpectralAnalysis) -> SpectrumCurve {
    SpectrumCurve {
        frequency_hz: analysis.spectrum.frequency_hz.clone(),
        amplitude_m: analysis.spectrum.amplitude_m.clone(),
    }
}

/// Amplitudes at the frequencies of the spectrum; none where there are not as many.
pub(super) fn spectrum_level(analysis: &SpectralAnalysis, amplitude_m: &[f64]) -> Option<SpectrumLevel> {
    let frequency_hz = &analysis.spectrum.frequency_hz;
    (amplitude_m.len() == frequency_hz.len())
        .then(|| SpectrumLevel { frequency_hz: frequency_hz.clone(), amplitude_m: amplitude_m.to_vec() })
}

/// A component at its height in the spectrum, as its amplitude may be that of a start, or the mean of one
/// that drifts, which lies above its wide peak.
pub(super) fn label_component(c: &Component, spectrum: &Spectrum) -> LabelledComponent {
    let bin_hz = spectrum.frequency_hz.get(1).copied().unwrap_or(f64::INFINITY);
    let height_m = spectrum.amplitude_m.get((c.frequency_hz / bin_hz).round() as usize).copied();
    let shown_m = height_m.unwrap_or(c.amplitude_m);
    let share = if c.amplitude_m > 0.0 { c.amplitude_sd_m / c.amplitude_m } else { 0.0 };
    LabelledComponent {
        frequency_hz: c.frequency_hz,
        frequency_sd_hz: c.frequency_sd_hz,
        range_hz: c.range_hz.map(|range| (range.low_hz, range.high_hz)),
        amplitude_m: shown_m,
        amplitude_sd_m: shown_m * share,
        remark: if c.verdict == ComponentVerdict::Clear {
            String::new()
        } else {
            c.verdict.name().to_owned()
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::channel::Channel;
    use crate::recording::{FrameGrid, Recording, Traces};
    use crate::spectrum::{Detrend, SampledRecord, SpectrumSettings};
    use std::f64::consts::TAU;

    const RATE_HZ: f64 = 5000.0;

    /// A record with noise, one frame in so many lost, as it is drawn, and its curve without noise.
    fn drawn(of_m: impl Fn(f64) -> f64, noise_m: f64, lost: usize) -> (SpectraPlot, SpectrumCurve) {
        let mut seed = 7_u64;
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt()
        };
        let exact: Vec<f64> = (0..1500).map(|i| of_m(f64::from(i) / RATE_HZ)).collect();
        let seen = |x: f64, i: usize| Some(x).filter(|_| i % lost != lost / 2);
        let noisy: Vec<_> = exact.iter().enumerate().map(|(i, x)| seen(x + noise_m * draw(), i)).collect();
        let quiet: Vec<_> = exact.iter().enumerate().map(|(i, x)| seen(*x, i)).collect();
        let analysed = |samples: &[Option<f64>]| {
            let record = SampledRecord { samples, frame_rate_hz: RATE_HZ, exposure_s: None };
            SpectralAnalysis::from_record(
                &record,
                &SpectrumSettings { detrend: Some(Detrend::Mean), ..SpectrumSettings::default() },
            )
            .unwrap()
        };
        let grid = FrameGrid { start_s: 0.0, frame_rate_hz: RATE_HZ, frames: noisy.len() };
        let none = vec![None; noisy.len()];
        let traces = Traces {
            tip_x_m: noisy.clone(),
            tip_y_m: none.clone(),
            head_x_m: none.clone(),
            head_y_m: none,
            ..Traces::default()
        };
        let recording = Recording::new("r", grid, traces, true).unwrap();
        let analysis = analysed(&noisy);
        let window = AnalysedWindow {
            recording: &recording,
            channel: Channel::TipX,
            frames: 0..noisy.len(),
            analysis: &analysis,
            note: String::new(),
        };
        (window.spectra(), spectrum_curve(&analysed(&quiet)))
    }

    /// Share of the bins above the lowest frequency whose interval holds an amplitude.
    fn covered(shown: &SpectraPlot, amplitude_m: &[f64]) -> f64 {
        let interval = shown.interval_95.as_ref().unwrap();
        let bins = interval.lower_m.iter().zip(&interval.upper_m).zip(amplitude_m);
        let inside = |((low, high), a): ((&f64, &f64), &f64)| low <= a && a <= high;
        let all: Vec<bool> = bins.skip(20).map(inside).collect();
        all.iter().filter(|is| **is).count() as f64 / all.len() as f64
    }

    #[test]
    fn the_interval_holds_its_curve_and_the_true_one_of_noise_and_of_tones() {
        const NOISE_M: f64 = 2e-6;
        let silence = |_: f64| 0.0;
        let tone = |t: f64| 2e-5 * (TAU * 80.0 * t).sin() + 1e-5 * (TAU * 907.0 * t).sin();
        for lost in [10_000, 100, 7] {
            for of_m in [&silence as &dyn Fn(f64) -> f64, &tone] {
                let (shown, exact) = drawn(of_m, NOISE_M, lost);
                let own = &shown.measured.as_ref().unwrap().amplitude_m;
                assert_eq!(covered(&shown, own), 1.0, "one in {lost} lost");
                let share = covered(&shown, &exact.amplitude_m);
                assert!(share > 0.93, "{share}, one in {lost} lost");
            }
        }
    }

    #[test]
    fn every_symbol_stands_on_its_curve() {
        let drifting = |t: f64| 2e-5 * (TAU * (700.0 * t + 400.0 * t * t)).sin();
        let (shown, _) = drawn(drifting, 1e-6, 10_000);
        let curve = shown.measured.as_ref().unwrap();
        assert!(shown.components.iter().any(|c| c.range_hz.is_some()), "{:?}", shown.components);
        for component in &shown.components {
            let near = |f: &f64| (f - component.frequency_hz).abs() <= 0.51 * curve.frequency_hz[1];
            let bin = curve.frequency_hz.iter().position(near).unwrap();
            assert_eq!(component.amplitude_m, curve.amplitude_m[bin]);
        }
    }
}
