//! The complete analysis of a window of a recording as figures.

mod compared;

pub use compared::compared;

use super::about;
use super::chart::Figure;
use super::figure::ring_down::{self, Decay, RingDown, Trace};
use super::figure::spectrogram::{self, RidgePoint, SpeedPoint};
use super::figure::spectrum::{self, Curve, Interval, Level, Named, Spectra};
use super::figure::windows::{self, NamedWindow, Windows};
use crate::compare::course;
use crate::recording::Recording;
use crate::recording::channel::{Anchor, Channel, Instants, mean_speed_m_per_s, named_windows};
use crate::spectrum::time_frequency::{RidgePoint as Followed, Spectrogram, SpectrogramSettings};
use crate::spectrum::{Analysis, Component, Estimator, Oscillation, Spectrum, Verdict};
use std::ops::Range;

/// Points a cycle of the fastest oscillation for a smooth line.
const POINTS_A_CYCLE: f64 = 12.0;
/// Most points of a fitted line: beyond, they are closer than the pixels of the figure.
const MOST_POINTS: f64 = 40_000.0;
/// Deviations from zero from which a decay is drawn as one.
const DECAYS: f64 = 3.0;

fn curve(analysis: &Analysis) -> Curve {
    Curve {
        frequency_hz: analysis.spectrum.frequency_hz.clone(),
        amplitude_m: analysis.spectrum.amplitude_m.clone(),
    }
}

/// Amplitudes at the frequencies of the spectrum; none where there are not as many.
fn level(analysis: &Analysis, amplitude_m: &[f64]) -> Option<Level> {
    let frequency_hz = &analysis.spectrum.frequency_hz;
    (amplitude_m.len() == frequency_hz.len())
        .then(|| Level { frequency_hz: frequency_hz.clone(), amplitude_m: amplitude_m.to_vec() })
}

/// A window of a channel, taken apart.
pub struct Shown<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// The channel.
    pub channel: Channel,
    /// The frames analysed.
    pub frames: Range<usize>,
    /// What they hold.
    pub analysis: &'a Analysis,
    /// What was done to them, in words.
    pub note: String,
}

/// The frequency of a ridge at one time, with how fast the tip and the head moved then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoursePoint {
    /// Time of the recording, s.
    pub time_s: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Its standard deviation, Hz.
    pub frequency_sd_hz: f64,
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Mean speed of the tip over the segment, m/s.
    pub tip_speed_m_per_s: Option<f64>,
    /// Mean speed of the head over the segment, m/s.
    pub head_speed_m_per_s: Option<f64>,
}

impl Shown<'_> {
    /// Every figure, with its name.
    #[must_use]
    pub fn figures(&self) -> [(&'static str, Figure); 4] {
        let figures = [
            ("spectrum", self.spectrum()),
            ("spectrogram", self.spectrogram()),
            ("ring-down", self.ring_down()),
            ("history", self.history()),
        ];
        figures.map(|(name, figure)| {
            (name, Figure { subtitle: about(self.recording.name(), &figure.subtitle), ..figure })
        })
    }

    /// The course of the frequency, point by point.
    #[must_use]
    pub fn course(&self) -> Vec<CoursePoint> {
        self.analysis
            .ridge
            .as_ref()
            .map_or_else(Vec::new, |ridge| ridge.points.iter().map(|p| self.at(p, ridge.segment_s)).collect())
    }

    fn at(&self, p: &Followed, segment_s: f64) -> CoursePoint {
        let (grid, traces) = (self.recording.grid(), self.recording.traces());
        let half = (0.5 * segment_s * grid.frame_rate_hz).ceil() as usize;
        let centre = self.frames.start + (p.time_s * grid.frame_rate_hz).round() as usize;
        let segment = centre.saturating_sub(half)..(centre + half).min(grid.frames);
        let speed =
            |samples: &[Option<f64>]| mean_speed_m_per_s(samples, grid.frame_rate_hz, segment.clone());
        CoursePoint {
            time_s: grid.time_s(self.frames.start) + p.time_s,
            frequency_hz: p.frequency_hz,
            frequency_sd_hz: p.frequency_sd_hz,
            amplitude_m: p.amplitude_m,
            tip_speed_m_per_s: speed(&traces.tip_x_m),
            head_speed_m_per_s: speed(&traces.head_x_m),
        }
    }

    fn title(&self, what: &str) -> String {
        format!("{what} of {}", self.channel)
    }

    fn spectrum(&self) -> Figure {
        let (analysis, spectrum) = (self.analysis, &self.analysis.spectrum);
        spectrum::figure(&Spectra {
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
        })
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

    fn spectrogram(&self) -> Figure {
        let grid = self.recording.grid();
        let start_s = grid.time_s(self.frames.start);
        let settings = SpectrogramSettings {
            segment_s: self.analysis.ridge.as_ref().map(|r| r.segment_s),
            band_hz: None,
        };
        let cut = Spectrogram::of(&self.analysis.detrended_m(), grid.frame_rate_hz, &settings).ok();
        let column = |bins: usize, column: &Option<Vec<f64>>| {
            column.as_ref().map_or_else(|| vec![None; bins], |c| c.iter().copied().map(Some).collect())
        };
        let instants = instants(self.recording, (start_s, grid.time_s(self.frames.end)));
        let (ridge, over_speed, drawn) = cut.as_ref().map(|cut| self.ridge(cut)).unwrap_or_default();
        spectrogram::figure(&spectrogram::Spectrogram {
            title: self.title("Spectrogram"),
            quantity: self.channel.to_string(),
            note: cut.as_ref().map_or_else(
                || "too short to be cut into segments".to_owned(),
                |c| format!("{}; segments of {:.1} ms{drawn}", self.note, c.segment_s * 1e3),
            ),
            synthetic: self.recording.is_synthetic(),
            time_s: cut.as_ref().map_or_else(Vec::new, |c| c.time_s.iter().map(|t| start_s + t).collect()),
            frequency_hz: cut.as_ref().map_or_else(Vec::new, |c| c.frequency_hz.clone()),
            amplitude_m: cut.as_ref().map_or_else(Vec::new, |c| {
                c.amplitude_m.iter().map(|a| column(c.frequency_hz.len(), a)).collect()
            }),
            log_frequency: false,
            shown_hz: None,
            ridge,
            instants,
            over_speed,
        })
    }

    /// The ridge over time and over the speed of the tip, as far as it is drawn, and in how many segments
    /// that is.
    fn ridge(&self, of: &Spectrogram) -> (Vec<RidgePoint>, Vec<SpeedPoint>, String) {
        let Some(ridge) = &self.analysis.ridge else { return Default::default() };
        let drawn = course::parts(ridge, of);
        let start_s = self.recording.grid().time_s(self.frames.start);
        let gap = RidgePoint { time_s: start_s, frequency_hz: None };
        let over_time = |part: &Vec<Followed>| {
            let points = part
                .iter()
                .map(|p| RidgePoint { time_s: start_s + p.time_s, frequency_hz: Some(p.frequency_hz) });
            std::iter::once(gap).chain(points).collect::<Vec<_>>()
        };
        let over_speed = |p: CoursePoint| {
            Some(SpeedPoint {
                tip_speed_m_per_s: p.tip_speed_m_per_s?.abs(),
                frequency_hz: p.frequency_hz,
                frequency_sd_hz: Some(p.frequency_sd_hz),
            })
        };
        let speeds = drawn.iter().flatten().filter_map(|p| over_speed(self.at(p, ridge.segment_s))).collect();
        let said = format!("; ridge {}", spectrogram::counted(&drawn, ridge, of));
        (drawn.iter().flat_map(over_time).collect(), speeds, said)
    }

    /// The window as the sum of its trend and its components, and what is left.
    #[must_use]
    pub fn ring_down(&self) -> Figure {
        let grid = self.recording.grid();
        let time_s: Vec<f64> = self.frames.clone().map(|i| grid.time_s(i)).collect();
        let trace = |values: Vec<Option<f64>>| Trace { time_s: time_s.clone(), displacement_m: values };
        let analysis = self.analysis;
        let samples = analysis
            .left_m
            .iter()
            .zip(&analysis.model_m)
            .zip(&analysis.removed_m)
            .map(|((left, m), removed)| left.map(|left| left + m + removed));
        // white noise of density 2 s^2 / rate has this root mean square in a bin
        let noise_m = analysis.spectrum.noise_floor_m
            * (grid.frame_rate_hz / (4.0 * analysis.spectrum.noise_bandwidth_hz)).sqrt();
        ring_down::figure(&RingDown {
            title: self.title("Components and rest"),
            quantity: self.channel.label(),
            note: self.note.clone(),
            synthetic: self.recording.is_synthetic(),
            data: trace(samples.collect()),
            fitted: self
                .fine(|t| self.slow_m(t) + analysis.oscillations.iter().map(|o| o.at_m(t)).sum::<f64>()),
            trend: trace(analysis.removed_m.iter().copied().map(Some).collect()),
            residual: trace(analysis.left_m.clone()),
            noise_sd_m: (noise_m > 0.0).then_some(noise_m),
            decay: self.decay(&time_s),
        })
    }

    /// The largest component that decays, with what is left of the record beside it.
    fn decay(&self, time_s: &[f64]) -> Option<Decay> {
        let analysis = self.analysis;
        let decays = |c: &&Component| {
            c.damping_ratio.zip(c.damping_ratio_sd).is_some_and(|(ratio, sd)| ratio > DECAYS * sd)
        };
        let component = analysis
            .spectrum
            .components
            .iter()
            .filter(|c| c.estimator == Estimator::LeastSquares)
            .find(decays)?;
        let near = |a: &&Oscillation, b: &&Oscillation| {
            (a.frequency_hz - component.frequency_hz)
                .abs()
                .total_cmp(&(b.frequency_hz - component.frequency_hz).abs())
        };
        let own = analysis.oscillations.iter().min_by(near)?;
        let start_s = time_s.first().copied()?;
        let data = analysis
            .left_m
            .iter()
            .zip(time_s)
            .map(|(left, t)| left.map(|left| left + own.at_m(t - start_s)))
            .collect();
        let ratio = component
            .damping_ratio
            .zip(component.damping_ratio_sd)
            .map(|(ratio, sd)| crate::text::with_sd(ratio, sd))?;
        Some(Decay {
            name: format!(
                "{} Hz, damping ratio {ratio}",
                crate::text::with_sd(component.frequency_hz, component.frequency_sd_hz)
            ),
            fitted: self.fine(|t| own.at_m(t)),
            envelope: self.fine(|t| own.envelope_m(t)),
            data: Trace { time_s: time_s.to_vec(), displacement_m: data },
        })
    }

    /// What was removed, between the frames on a straight line, m.
    fn slow_m(&self, time_s: f64) -> f64 {
        let place = time_s * self.recording.grid().frame_rate_hz;
        let before = (place.max(0.0) as usize).min(self.analysis.removed_m.len().saturating_sub(1));
        let value = |i: usize| {
            self.analysis.removed_m.get(i).or(self.analysis.removed_m.last()).copied().unwrap_or(0.0)
        };
        value(before) + (place - before as f64) * (value(before + 1) - value(before))
    }

    /// A function of the time from the first frame, drawn finer than the frames.
    fn fine(&self, value: impl Fn(f64) -> f64) -> Trace {
        let grid = self.recording.grid();
        let (start_s, length_s) =
            (grid.time_s(self.frames.start), self.frames.len().saturating_sub(1) as f64 / grid.frame_rate_hz);
        let fastest_hz = self.analysis.oscillations.iter().fold(0.0, |f: f64, o| f.max(o.frequency_hz));
        let points =
            (POINTS_A_CYCLE * fastest_hz * length_s).max(self.frames.len() as f64).min(MOST_POINTS) as usize;
        let times: Vec<f64> = (0..=points).map(|i| length_s * i as f64 / points.max(1) as f64).collect();
        Trace {
            displacement_m: times.iter().map(|t| Some(value(*t))).collect(),
            time_s: times.into_iter().map(|t| start_s + t).collect(),
        }
    }

    fn history(&self) -> Figure {
        let (grid, found) = (self.recording.grid(), Instants::find(self.recording));
        let window = |w: crate::recording::channel::NamedWindow| NamedWindow {
            name: w.name,
            from_s: w.from_s,
            to_s: w.to_s,
        };
        windows::figure(&Windows {
            title: self.title("Windows"),
            quantity: self.channel.to_string(),
            note: String::new(),
            synthetic: self.recording.is_synthetic(),
            time_s: (0..grid.frames).map(|i| grid.time_s(i)).collect(),
            channel_m: self.channel.samples(self.recording),
            head_x_m: if self.channel == Channel::HeadX {
                Vec::new()
            } else {
                Channel::HeadX.samples(self.recording)
            },
            windows: named_windows(self.recording, &found).into_iter().map(window).collect(),
            analysed_s: Some((grid.time_s(self.frames.start), grid.time_s(self.frames.end))),
            instants: instants(self.recording, (grid.start_s, grid.time_s(grid.frames))),
        })
    }
}

/// A component at its height in the spectrum, as its amplitude may be that of a start; one that drifts has no
/// height there, but a mean.
fn named(c: &Component, spectrum: &Spectrum) -> Named {
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

/// Instants between two times, by name.
fn instants(recording: &Recording, (from_s, to_s): (f64, f64)) -> Vec<(String, f64)> {
    let found = Instants::find(recording);
    let all = (1..=found.reversals.len()).flat_map(|k| Anchor::ALL.map(|anchor| (anchor, k)));
    let named = all.filter_map(|(anchor, k)| {
        let suffix = if found.reversals.len() > 1 { format!("[{k}]") } else { String::new() };
        Some((format!("{}{suffix}", anchor.name()), found.time_s(anchor, k).ok()?))
    });
    named.filter(|(_, t)| *t >= from_s && *t <= to_s).collect()
}
