//! A window as the sum of its trend and its components, and what is left.

use super::window::AnalysedWindow;
use crate::figures::ring_down::{ComponentDecay, RingDown, RingDownTrace, figure_title};
use crate::spectrum::{Component, Estimator, Oscillation};
use crate::text::format_with_sd;

/// Points a cycle of the fastest oscillation for a smooth line.
const POINTS_A_CYCLE: f64 = 12.0;
/// Most points of a fitted line: beyond, they are closer than the pixels of the figure.
const MOST_POINTS: f64 = 40_000.0;
/// Deviations from zero from which a decay is drawn as one.
const DECAYS: f64 = 3.0;

impl AnalysedWindow<'_> {
    /// The window as the sum of its trend and its components, and what is left.
    #[must_use]
    pub(crate) fn ring_down(&self) -> RingDown {
        let grid = self.recording.grid();
        let time_s: Vec<f64> = self.frames.clone().map(|i| grid.time_s(i)).collect();
        let trace =
            |values: Vec<Option<f64>>| RingDownTrace { time_s: time_s.clone(), displacement_m: values };
        let analysis = self.analysis;
        let samples = analysis
            .residual_m
            .iter()
            .zip(&analysis.model_m)
            .zip(&analysis.removed_m)
            .map(|((left, m), removed)| left.map(|left| left + m + removed));
        // white noise of density 2 s^2 / rate has this root mean square in a bin
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

    /// The largest component that decays, with what is left of the record added.
    fn largest_decay(&self, time_s: &[f64]) -> Option<ComponentDecay> {
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
            .residual_m
            .iter()
            .zip(time_s)
            .map(|(left, t)| left.map(|left| left + own.displacement_m(t - start_s)))
            .collect();
        let ratio = component
            .damping_ratio
            .zip(component.damping_ratio_sd)
            .map(|(ratio, sd)| format_with_sd(ratio, sd))?;
        Some(ComponentDecay {
            name: format!(
                "{} Hz, damping ratio {ratio}",
                format_with_sd(component.frequency_hz, component.frequency_sd_hz)
            ),
            fitted: self.fine_trace(|t| own.displacement_m(t)),
            envelope: self.fine_trace(|t| own.envelope_m(t)),
            data: RingDownTrace { time_s: time_s.to_vec(), displacement_m: data },
        })
    }

    /// What was removed, between the frames on a straight line, m.
    fn removed_trend_m(&self, time_s: f64) -> f64 {
        let place = time_s * self.recording.grid().frame_rate_hz;
        let before = (place.max(0.0) as usize).min(self.analysis.removed_m.len().saturating_sub(1));
        let value = |i: usize| {
            self.analysis.removed_m.get(i).or(self.analysis.removed_m.last()).copied().unwrap_or(0.0)
        };
        value(before) + (place - before as f64) * (value(before + 1) - value(before))
    }

    /// A function of the time from the first frame, drawn finer than the frames.
    fn fine_trace(&self, value: impl Fn(f64) -> f64) -> RingDownTrace {
        let grid = self.recording.grid();
        let (start_s, length_s) =
            (grid.time_s(self.frames.start), self.frames.len().saturating_sub(1) as f64 / grid.frame_rate_hz);
        let fastest_hz = self.analysis.oscillations.iter().fold(0.0, |f: f64, o| f.max(o.frequency_hz));
        let points =
            (POINTS_A_CYCLE * fastest_hz * length_s).max(self.frames.len() as f64).min(MOST_POINTS) as usize;
        let times: Vec<f64> = (0..=points).map(|i| length_s * i as f64 / points.max(1) as f64).collect();
        RingDownTrace {
            displacement_m: times.iter().map(|t| Some(value(*t))).collect(),
            time_s: times.into_iter().map(|t| start_s + t).collect(),
        }
    }
}
