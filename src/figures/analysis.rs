//! Figures of the analysis of one window of a recording: spectrum, spectrogram, ring-down and overview.

use super::ring_down::{ComponentDecay, RingDown, RingDownTrace, figure_title};
use super::spectrogram::{SpectrogramPlot, SpeedPoint};
use super::spectrum::{
    AmplitudeInterval, LabelledComponent, SpectraPlot, SpectrumCurve, SpectrumLevel, strongest_claim,
};
use super::windows::{WindowOverview, WindowSpan};
use super::{about, ring_down, spectrogram, spectrum, windows};
use crate::recording::channel::{Channel, InstantKind, ReversalInstants, mean_speed_m_per_s, phase_windows};
use crate::recording::{Recording, channel};
use crate::text::{format_digits, format_short, format_with_sd};
use plain_charts::Figure;
use short_spectra::time_frequency::{RidgePoint, Spectrogram, SpectrogramSettings, course};
use short_spectra::{Component, ComponentVerdict, Estimator, Oscillation, SpectralAnalysis, Spectrum};
use std::ops::Range;

impl AnalysedWindow<'_> {
    /// All four figures, each with its file name.
    pub(crate) fn figures(&self) -> [(&'static str, Figure); 4] {
        let figures = [
            ("spectrum", spectrum::draw_figure(&self.spectra())),
            ("spectrogram", spectrogram::draw_figure(&self.spectrogram())),
            ("ring-down", ring_down::draw_figure(&self.ring_down())),
            ("history", windows::draw_figure(&self.window_overview())),
        ];
        figures.map(|(name, figure)| {
            (name, Figure { subtitle: about(self.recording.name(), &figure.subtitle), ..figure })
        })
    }
}

// Spectra of a recording and of a model in the same window.

/// A component of the model is not drawn if its amplitude, divided by that of the model's largest component,
/// is below this value.
const LEAST_OF_MODEL: f64 = 1e-3;

/// The spectra and components of a recording and of a model in the same window. Leaves out components of the
/// model that no recording could show: those below the noise floor of the recording, or below 0.1 % of the
/// model's largest component. The caller sets heading, note and targets.
#[must_use]
pub fn compare_spectra(measured: Option<&SpectralAnalysis>, model: Option<&SpectralAnalysis>) -> SpectraPlot {
    let components = |analysis: &SpectralAnalysis| -> Vec<LabelledComponent> {
        let found = analysis.spectrum.components.iter().filter(|c| c.is_resolvable());
        found.map(|c| label_component(c, &analysis.spectrum)).collect()
    };
    let noise_floor_m = measured.map(|m| m.spectrum.noise_floor_m);
    let mut model_components = model.map_or_else(Vec::new, components);
    let largest_m = model_components.iter().map(|c| c.amplitude_m).fold(0.0, f64::max);
    let least_m = noise_floor_m.unwrap_or(0.0).max(LEAST_OF_MODEL * largest_m);
    model_components.retain(|c| c.amplitude_m >= least_m);
    SpectraPlot {
        measured: measured.map(spectrum_curve),
        model: model.map(spectrum_curve),
        noise_floor_m,
        noise_floor: measured.and_then(|m| spectrum_level(m, &m.noise_floor_m)),
        interval_95: measured.and_then(noise_interval),
        components: measured.map_or_else(Vec::new, components),
        model_components,
        lowest_hz: measured.or(model).map_or(1.0, |a| a.spectrum.resolution_hz),
        ..SpectraPlot::default()
    }
}

// Spectrum of a window: curves, levels and named components.

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
            interval_95: noise_interval(analysis),
            leakage: spectrum_level(analysis, &analysis.leakage_m),
            components: spectrum.components.iter().map(|c| label_component(c, spectrum)).collect(),
            lowest_hz: spectrum.resolution_hz,
            ..SpectraPlot::default()
        };
        SpectraPlot { title: strongest_claim(&shown), ..shown }
    }
}

/// The 95 % interval of a spectrum by its noise floor.
fn noise_interval(analysis: &SpectralAnalysis) -> Option<AmplitudeInterval> {
    let floor = spectrum_level(analysis, &analysis.noise_floor_m)?;
    Some(AmplitudeInterval::from_noise_floor(&spectrum_curve(analysis), &floor))
}

pub(super) fn spectrum_curve(analysis: &SpectralAnalysis) -> SpectrumCurve {
    SpectrumCurve {
        frequency_hz: analysis.spectrum.frequency_hz.clone(),
        amplitude_m: analysis.spectrum.amplitude_m.clone(),
    }
}

/// An amplitude level in metres, such as the noise floor, at the frequencies of the spectrum; `None` if level
/// and spectrum have different lengths.
pub(super) fn spectrum_level(analysis: &SpectralAnalysis, amplitude_m: &[f64]) -> Option<SpectrumLevel> {
    let frequency_hz = &analysis.spectrum.frequency_hz;
    (amplitude_m.len() == frequency_hz.len())
        .then(|| SpectrumLevel { frequency_hz: frequency_hz.clone(), amplitude_m: amplitude_m.to_vec() })
}

/// Label of a component, at the height of the spectrum at the frequency of the component. The fitted
/// amplitude may be larger: for a decaying component it is the amplitude at the start, for a drifting
/// component a mean.
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
        remark: if c.verdict == ComponentVerdict::Clear { "" } else { c.verdict.name() }.to_owned(),
    }
}

// Frequency of the strongest component against time and against tip speed.

/// A point of a ridge, with the mean speeds of tip and head in its segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CoursePoint {
    /// Time on the clock of the recording, s.
    pub time_s: f64,
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz.
    pub frequency_sd_hz: f64,
    pub amplitude_m: f64,
    /// Mean speed of the tip over the segment, m/s.
    pub tip_speed_m_per_s: Option<f64>,
    /// Mean speed of the head over the segment, m/s.
    pub head_speed_m_per_s: Option<f64>,
}

impl AnalysedWindow<'_> {
    /// The points of the ridge (the strongest frequency in each time segment); empty without a ridge.
    pub(crate) fn frequency_course(&self) -> Vec<CoursePoint> {
        self.analysis.ridge.as_ref().map_or_else(Vec::new, |ridge| {
            ridge.points.iter().map(|p| self.course_point(p, ridge.segment_s)).collect()
        })
    }

    fn course_point(&self, p: &RidgePoint, segment_s: f64) -> CoursePoint {
        let (grid, traces) = (self.recording.grid(), self.recording.traces());
        let half = (0.5 * segment_s * grid.frame_rate_hz).ceil() as usize;
        let centre = self.frames.start + (p.time_s * grid.frame_rate_hz).round() as usize;
        let segment = centre.saturating_sub(half)..(centre + half).min(grid.frames);
        let speed =
            |samples: &[Option<f64>]| mean_speed_m_per_s(samples, grid.frame_rate_hz, segment.clone());
        CoursePoint {
            time_s: grid.time_s(self.frames.start) + p.time_s,
            frequency_hz: p.frequency_hz,
            frequency_sd_hz: self.recording.add_clock_sd(p.frequency_hz, p.frequency_sd_hz),
            amplitude_m: p.amplitude_m,
            tip_speed_m_per_s: speed(&traces.tip_x_m),
            head_speed_m_per_s: speed(&traces.head_x_m),
        }
    }

    pub(super) fn spectrogram(&self) -> SpectrogramPlot {
        let (grid, note) = (self.recording.grid(), self.figure_note("spectrogram"));
        let start_s = grid.time_s(self.frames.start);
        let plot = SpectrogramPlot {
            title: "Nothing stands out long enough to be followed".to_owned(),
            quantity: self.channel.to_string(),
            note: format!("{note}; too short to be cut into segments"),
            synthetic: self.recording.is_synthetic(),
            instants: named_instants(self.recording, (start_s, grid.time_s(self.frames.end))),
            ..SpectrogramPlot::default()
        };
        let segment_s = self.analysis.ridge.as_ref().map(|r| r.segment_s);
        let settings = SpectrogramSettings { segment_s, ..SpectrogramSettings::default() };
        let Ok(cut) = Spectrogram::new(&self.analysis.detrended_m(), grid.frame_rate_hz, &settings) else {
            return plot;
        };
        let (ridge, over_speed, drawn) = self.drawn_ridge(&cut);
        let ends_hz = ridge.iter().flatten().map(|p| p.frequency_hz);
        let range_hz = ends_hz.clone().reduce(f64::min).zip(ends_hz.reduce(f64::max));
        let run = |(low, high)| {
            format!("The ridge runs from {} to {} Hz", format_digits(low, 3), format_digits(high, 3))
        };
        SpectrogramPlot {
            title: range_hz.map_or(plot.title.clone(), run),
            note: format!("{note}; segments of {:.1} ms{drawn}", cut.segment_s * 1e3),
            over_speed,
            ..spectrogram::fill_map(plot, &cut, &ridge, start_s, cut.frequency_hz.len())
        }
    }

    /// The drawn parts of the ridge, the points of these parts against tip speed, and a note on the number of
    /// segments.
    fn drawn_ridge(&self, of: &Spectrogram) -> (Vec<Vec<RidgePoint>>, Vec<SpeedPoint>, String) {
        let Some(ridge) = &self.analysis.ridge else { return Default::default() };
        let drawn = course::coherent_parts(ridge, of);
        let over_speed = |p: &RidgePoint| {
            let point = self.course_point(p, ridge.segment_s);
            Some(SpeedPoint {
                speed_m_per_s: point.tip_speed_m_per_s?.abs(),
                frequency_hz: p.frequency_hz,
                frequency_sd_hz: Some(point.frequency_sd_hz),
            })
        };
        let speeds = drawn.iter().flatten().filter_map(over_speed).collect();
        let note = format!("; ridge {}", spectrogram::describe_ridge_segments(&drawn, ridge, of));
        (drawn, speeds, note)
    }
}

// The whole recording with its named windows.

impl AnalysedWindow<'_> {
    pub(super) fn window_overview(&self) -> WindowOverview {
        let (grid, found) = (self.recording.grid(), ReversalInstants::find_instants(self.recording));
        let window = |w: channel::PhaseWindow| WindowSpan { name: w.name, from_s: w.from_s, to_s: w.to_s };
        let head = Some(Channel::HeadX).filter(|head| *head != self.channel);
        WindowOverview {
            title: format!(
                "Analysed: {} s of {} s, {} frames",
                format_short(self.frames.len() as f64 / grid.frame_rate_hz),
                format_short(grid.frames as f64 / grid.frame_rate_hz),
                self.frames.len()
            ),
            quantity: self.channel.to_string(),
            note: format!("named windows of {}", self.channel),
            synthetic: self.recording.is_synthetic(),
            time_s: (0..grid.frames).map(|i| grid.time_s(i)).collect(),
            channel_m: self.channel.samples(self.recording),
            head_x_m: head.map_or_else(Vec::new, |head| head.samples(self.recording)),
            windows: phase_windows(self.recording, &found).into_iter().map(window).collect(),
            analysed_s: Some((grid.time_s(self.frames.start), grid.time_s(self.frames.end))),
            instants: named_instants(self.recording, (grid.start_s, grid.time_s(grid.frames))),
        }
    }
}

// A window decomposed into trend, components and residual.

/// Points of a drawn line per cycle of the fastest oscillation; enough for a smooth line.
const POINTS_A_CYCLE: f64 = 12.0;
/// Maximum number of points of a fitted line; more would lie closer together than pixels.
const MOST_POINTS: f64 = 40_000.0;
/// A component counts as decaying if its damping ratio exceeds this number of standard deviations of the
/// damping ratio.
const DECAYS: f64 = 3.0;

impl AnalysedWindow<'_> {
    /// The window decomposed into trend, components and residual.
    pub(crate) fn ring_down(&self) -> RingDown {
        let grid = self.recording.grid();
        let time_s: Vec<f64> = self.frames.clone().map(|i| grid.time_s(i)).collect();
        let trace =
            |values: Vec<Option<f64>>| RingDownTrace { time_s: time_s.clone(), displacement_m: values };
        let analysis = self.analysis;
        let samples = analysis.residual_m.iter().zip(&analysis.model_m).zip(&analysis.removed_m);
        let samples = samples.map(|((left, m), removed)| left.map(|left| left + m + removed));
        // root mean square of the white noise that gives the noise floor `noise_floor_m` in the spectrum
        let noise_m = analysis.spectrum.noise_floor_m
            * (grid.frame_rate_hz / (4.0 * analysis.spectrum.noise_bandwidth_hz)).sqrt();
        RingDown {
            title: analysis.spectrum.components.first().map_or_else(
                || format!("No oscillation is found in the {}", self.channel.label()),
                |component| figure_title(&self.channel.label(), component),
            ),
            quantity: self.channel.label(),
            note: self.figure_note("components and rest"),
            synthetic: self.recording.is_synthetic(),
            data: trace(samples.collect()),
            fitted: self.fine_trace(|t| {
                self.removed_trend_m(t)
                    + analysis.oscillations.iter().map(|o| o.displacement_m(t)).sum::<f64>()
            }),
            trend: trace(analysis.removed_m.iter().copied().map(Some).collect()),
            residual: trace(analysis.residual_m.clone()),
            noise_sd_m: (noise_m > 0.0).then_some(noise_m),
            decay: self.largest_decay(&time_s),
        }
    }

    /// The decaying component with the largest amplitude. The data drawn with this component are its sum with
    /// the residual of the fit.
    fn largest_decay(&self, time_s: &[f64]) -> Option<ComponentDecay> {
        let analysis = self.analysis;
        let decays = |c: &&Component| {
            c.damping_ratio.zip(c.damping_ratio_sd).is_some_and(|(ratio, sd)| ratio > DECAYS * sd)
        };
        let mut fitted =
            analysis.spectrum.components.iter().filter(|c| c.estimator == Estimator::LeastSquares);
        let component = fitted.find(decays)?;
        let off = |o: &&Oscillation| (o.frequency_hz() - component.frequency_hz).abs();
        let own = analysis.oscillations.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let start_s = time_s.first().copied()?;
        let data = analysis.residual_m.iter().zip(time_s);
        let data = data.map(|(left, t)| left.map(|left| left + own.displacement_m(t - start_s))).collect();
        let frequency = format_with_sd(component.frequency_hz, component.frequency_sd_hz);
        let ratio = format_with_sd(component.damping_ratio?, component.damping_ratio_sd?);
        Some(ComponentDecay {
            name: format!("{frequency} Hz, damping ratio {ratio}"),
            fitted: self.fine_trace(|t| own.displacement_m(t)),
            envelope: self.fine_trace(|t| own.envelope_m(t)),
            data: RingDownTrace { time_s: time_s.to_vec(), displacement_m: data },
        })
    }

    /// The removed trend in metres at a given time, s, after the first frame; interpolated linearly between
    /// frames.
    fn removed_trend_m(&self, time_s: f64) -> f64 {
        let place = time_s * self.recording.grid().frame_rate_hz;
        let before = (place.max(0.0) as usize).min(self.analysis.removed_m.len().saturating_sub(1));
        let value = |i: usize| {
            self.analysis.removed_m.get(i).or(self.analysis.removed_m.last()).copied().unwrap_or(0.0)
        };
        value(before) + (place - before as f64) * (value(before + 1) - value(before))
    }

    /// Samples a function of the time after the first frame, s, densely enough for a smooth line.
    fn fine_trace(&self, value: impl Fn(f64) -> f64) -> RingDownTrace {
        let grid = self.recording.grid();
        let (start_s, length_s) =
            (grid.time_s(self.frames.start), self.frames.len().saturating_sub(1) as f64 / grid.frame_rate_hz);
        let fastest_hz = self.analysis.oscillations.iter().fold(0.0, |f: f64, o| f.max(o.frequency_hz()));
        let points =
            (POINTS_A_CYCLE * fastest_hz * length_s).max(self.frames.len() as f64).min(MOST_POINTS) as usize;
        let times: Vec<f64> = (0..=points).map(|i| length_s * i as f64 / points.max(1) as f64).collect();
        RingDownTrace {
            displacement_m: times.iter().map(|t| Some(value(*t))).collect(),
            time_s: times.into_iter().map(|t| start_s + t).collect(),
        }
    }
}

// A window of a channel with its analysis.

/// A window of a channel and its analysis.
pub(crate) struct AnalysedWindow<'a> {
    pub recording: &'a Recording,
    pub channel: Channel,
    pub frames: Range<usize>,
    pub analysis: &'a SpectralAnalysis,
    /// Description of the analysis, for the line under the heading.
    pub note: String,
}

impl AnalysedWindow<'_> {
    /// The line under the heading of a figure.
    pub(super) fn figure_note(&self, what: &str) -> String {
        about(&format!("{what} of {}", self.channel), &self.note)
    }
}

/// Named instants within a time interval, s.
pub(super) fn named_instants(recording: &Recording, (from_s, to_s): (f64, f64)) -> Vec<(String, f64)> {
    let found = ReversalInstants::find_instants(recording);
    let all = (1..=found.reversals.len()).flat_map(|k| InstantKind::ALL.map(|anchor| (anchor, k)));
    let named = all.filter_map(|(anchor, k)| {
        let suffix = if found.reversals.len() > 1 { format!("[{k}]") } else { String::new() };
        Some((format!("{}{suffix}", anchor.name()), found.time_s(anchor, k).ok()?))
    });
    named.filter(|(_, t)| *t >= from_s && *t <= to_s).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::channel::Channel;
    use crate::recording::{FrameGrid, Recording, Traces};
    use short_spectra::{Detrend, SampledRecord, SpectrumSettings};
    use std::f64::consts::TAU;

    const RATE_HZ: f64 = 5000.0;

    /// The plotted spectrum of a record with noise, and the spectrum of the same record without noise; every
    /// `lost`-th frame is missing.
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

    /// Fraction of the frequency bins, from bin 20 upwards, whose 95 % interval contains the given amplitude.
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
