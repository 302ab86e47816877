//! What the spectrum reads of a cycle whose sticks are counted.

use short_spectra::{Component, SampledRecord, SpectralAnalysis, SpectrumSettings};
use std::ops::Range;
use wiperlab::recording::Recording;
use wiperlab::recording::channel::Channel;
use wiperlab::recording::cycles::median_interval_s;
use wiperlab::simulate::SolverOptions;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::{Camera, TrackingModel, add_tracking_noise, film_scene};

/// Lengths of windows, s, and how far apart they begin, in their lengths.
const LENGTHS_S: [f64; 4] = [0.05, 0.1, 0.15, 0.25];
const APART: f64 = 0.25;
/// Fewest cycles of a window, and how many times longer or shorter than the median one may be: a dropped beat
/// makes one twice as long.
const FEWEST: usize = 12;
const REGULAR: f64 = 1.5;

/// Share of its mean within which a component is the cycle.
const NAMED: f64 = 0.1;

/// Deviation of the count, cycles: a stick ends at another phase of the fundamental as the form of the cycle
/// changes, by a twentieth at either end. The deviation of one that drifts has it already.
const COUNTED: f64 = 0.07;

/// What windows of a scene gave.
#[derive(Default)]
pub struct Count {
    pub windows: usize,
    pub named: usize,
    /// Error of the mean over its deviation.
    pub means: Vec<f64>,
    /// The same of both ends of the range of those that drift, and the errors, Hz.
    pub ends: Vec<f64>,
    pub ends_hz: Vec<f64>,
    /// Windows whose slips are counted in the recording, and those of them in which a stick between the first
    /// and the last slip is missed or too much.
    pub counted: usize,
    pub miscounted: usize,
}

/// Ends of sticks that follow one another regularly.
struct Cycles(Vec<f64>);

impl Cycles {
    /// Of a window that has nothing else; with two more on either side.
    fn between(ends_s: &[f64], from_s: f64, to_s: f64) -> Option<Self> {
        let first = ends_s.partition_point(|t| *t < from_s).checked_sub(2)?;
        let last = ends_s.partition_point(|t| *t < to_s) + 1;
        let inside = ends_s.get(first..=last).filter(|inside| inside.len() > FEWEST)?;
        let median = median_interval_s(inside.iter().copied())?;
        let is_regular = |pair: &[f64]| (median / REGULAR..REGULAR * median).contains(&(pair[1] - pair[0]));
        inside.windows(2).all(is_regular).then(|| Self(inside.to_vec()))
    }

    /// Cycles since the first stick, by a straight line between two.
    fn at(&self, time_s: f64) -> f64 {
        let next = self.0.partition_point(|t| *t < time_s).clamp(1, self.0.len() - 1);
        let (a, b) = (self.0[next - 1], self.0[next]);
        (next - 1) as f64 + (time_s - a) / (b - a)
    }

    /// Least and greatest frequency of three cycles in a row that overlap a stretch of time by half.
    fn range_hz(&self, from_s: f64, to_s: f64) -> (f64, f64) {
        let three = self.0.windows(4).filter(|sticks| {
            let middle_s = (sticks[0] + sticks[3]) / 2.0;
            middle_s > from_s && middle_s < to_s
        });
        three
            .map(|sticks| 3.0 / (sticks[3] - sticks[0]))
            .fold((f64::INFINITY, 0.0), |(low, high), hz| (low.min(hz), high.max(hz)))
    }

    fn mean_hz(&self, from_s: f64, to_s: f64) -> f64 {
        (self.at(to_s) - self.at(from_s)) / (to_s - from_s)
    }
}

impl Count {
    /// Of the windows of a scene that a camera sees.
    pub fn of(scene: &Scene, frame_rate_hz: f64, noise_m: f64) -> Result<Self, Box<dyn std::error::Error>> {
        let camera = Camera { frame_rate_hz, exposure_s: 0.0 };
        let seen =
            film_scene(scene, &camera, scene.start_s, scene.run.stop_s, SolverOptions::from_scene(scene))?;
        let tracking =
            TrackingModel { metres_per_pixel: noise_m, noise_px: 1.0, dropout_fraction: 0.0, seed: 1 };
        let recording = add_tracking_noise(&seen.recording, "scene", &tracking)?;
        let samples = Channel::Deflection.samples(&recording);
        let ends_s: Vec<f64> = seen.stick_s.iter().map(|stick| stick[1]).collect();
        let mut count = Self::default();
        for length_s in LENGTHS_S {
            let frames = (length_s * frame_rate_hz) as usize;
            let step = (APART * frames as f64) as usize;
            for first in (0..samples.len().saturating_sub(frames)).step_by(step) {
                let from_s = recording.grid().time_s(first);
                if let Some(cycles) = Cycles::between(&ends_s, from_s, from_s + length_s) {
                    let record = SampledRecord {
                        samples: &samples[first..first + frames],
                        frame_rate_hz,
                        exposure_s: None,
                    };
                    count.read(&record, from_s, &cycles)?;
                    count.count_slips(&recording, first..first + frames, &cycles);
                }
            }
        }
        Ok(count)
    }

    /// With the windows of another.
    pub fn add(&mut self, other: Self) {
        self.windows += other.windows;
        self.named += other.named;
        self.means.extend(other.means);
        self.ends.extend(other.ends);
        self.ends_hz.extend(other.ends_hz);
        self.counted += other.counted;
        self.miscounted += other.miscounted;
    }

    /// Compares the slips that are counted in a range of frames with the ends of the sticks: each stick ends
    /// less than half a period before the middle of its slip.
    fn count_slips(&mut self, recording: &Recording, frames: Range<usize>, cycles: &Cycles) {
        let Ok(found) = recording.count_cycles(frames) else { return };
        let [Some(first), Some(last)] = [found.slips.first(), found.slips.last()] else { return };
        let between = first.time_s - 0.5 * found.period_s..last.time_s;
        let sticks = cycles.0.iter().filter(|end_s| between.contains(*end_s)).count();
        self.counted += 1;
        self.miscounted += usize::from(sticks != found.count);
    }

    fn read(
        &mut self,
        record: &SampledRecord,
        from_s: f64,
        cycles: &Cycles,
    ) -> Result<(), Box<dyn std::error::Error>> {
        let analysis = SpectralAnalysis::from_record(record, &SpectrumSettings::default())?;
        let length_s = record.samples.len() as f64 / record.frame_rate_hz;
        let from_s = from_s + analysis.skipped_frames as f64 / record.frame_rate_hz;
        let to_s = from_s + analysis.residual_m.len() as f64 / record.frame_rate_hz;
        if to_s - from_s < length_s / 2.0 {
            return Ok(()); // what is left behind a flip
        }
        self.windows += 1;
        let mean_hz = cycles.mean_hz(from_s, to_s);
        let off = |c: &&Component| (c.frequency_hz - mean_hz).abs();
        let nearest = analysis.spectrum.components.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        let Some(component) = nearest.filter(|c| off(c) < NAMED * mean_hz) else { return Ok(()) };
        let [from_s, to_s] = match &analysis.ridge {
            Some(ridge) if component.range_hz.is_some() => {
                let first = ridge.start.map(|end| end.time_s).or(ridge.points.first().map(|p| p.time_s));
                let last = ridge.end.map(|end| end.time_s).or(ridge.points.last().map(|p| p.time_s));
                [first.map_or(from_s, |t| from_s + t), last.map_or(to_s, |t| from_s + t)]
            }
            _ => [from_s, to_s],
        };
        self.named += 1;
        let counted_sd_hz = if component.range_hz.is_some() { 0.0 } else { COUNTED / (to_s - from_s) };
        let off_hz = component.frequency_hz - cycles.mean_hz(from_s, to_s);
        self.means.push(off_hz / component.frequency_sd_hz.hypot(counted_sd_hz));
        if let Some(range) = component.range_hz {
            let (low, high) = cycles.range_hz(from_s, to_s);
            for (found, sd_hz, truth) in
                [(range.low_hz, range.low_sd_hz, low), (range.high_hz, range.high_sd_hz, high)]
            {
                self.ends.push((found - truth) / sd_hz);
                self.ends_hz.push(found - truth);
            }
        }
        Ok(())
    }

    /// How many means and how many ends are within two deviations.
    pub fn within(&self) -> [usize; 2] {
        [&self.means, &self.ends].map(|scaled| scaled.iter().filter(|x| x.abs() < 2.0).count())
    }
}
