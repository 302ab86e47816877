//! What is read from many records, held against what they were made of.

use crate::signal::{Signal, Tone};
use rayon::prelude::*;
use short_spectra::{Component, SampledRecord, SpectralAnalysis, SpectrumSettings};

/// A component is a tone's if its frequency is within this share of it.
const NEAR: f64 = 0.15;

/// What was read from a record.
#[derive(Debug)]
pub struct Reading {
    pub components: Vec<Component>,
    /// Where the part begins that was taken apart, s: behind a flip that splits the record. Amplitudes are
    /// those there.
    pub from_s: f64,
}

impl std::ops::Deref for Reading {
    type Target = [Component];

    fn deref(&self) -> &[Component] {
        &self.components
    }
}

/// The components of a record.
pub fn read(signal: &Signal, seed: u64) -> Reading {
    let record = SampledRecord {
        samples: &signal.record(seed),
        frame_rate_hz: signal.rate_hz,
        exposure_s: signal.exposure_s,
    };
    read_record(&record, &SpectrumSettings::default())
}

/// The components that the complete analysis lists.
pub fn read_record(record: &SampledRecord, settings: &SpectrumSettings) -> Reading {
    let reading = |a: SpectralAnalysis| Reading {
        from_s: a.skipped_frames as f64 / record.frame_rate_hz,
        components: a.spectrum.components,
    };
    SpectralAnalysis::from_record(record, settings)
        .map_or_else(|_| Reading { components: Vec::new(), from_s: 0.0 }, reading)
}

/// The components of as many records.
pub fn read_all(signal: &Signal, seeds: u64) -> Vec<Reading> {
    (0..seeds).into_par_iter().map(|seed| read(signal, seed)).collect()
}

/// The largest component near a frequency.
pub fn near(list: &[Component], hz: f64) -> Option<&Component> {
    let near = list.iter().filter(|c| (c.frequency_hz / hz - 1.0).abs() < NEAR);
    near.max_by(|a, b| a.amplitude_m.total_cmp(&b.amplitude_m))
}

/// Errors of one tone, one of each record that has it.
#[derive(Default)]
pub struct Errors {
    pub hz: Vec<f64>,
    pub damping: Vec<f64>,
    /// Over the stated deviations: frequency, amplitude, damping.
    pub scaled: [Vec<f64>; 3],
}

impl Errors {
    pub fn of(tone: &Tone, lists: &[Reading]) -> Self {
        let mut errors = Self::default();
        lists
            .iter()
            .filter_map(|list| Some((near(list, tone.hz)?, list.from_s)))
            .for_each(|(c, from_s)| errors.add(tone, c, from_s));
        errors
    }

    fn add(&mut self, tone: &Tone, c: &Component, from_s: f64) {
        self.hz.push(c.frequency_hz - tone.hz);
        self.scaled[0].push((c.frequency_hz - tone.hz) / c.frequency_sd_hz);
        self.scaled[1].push((c.amplitude_m - tone.envelope_m(from_s)) / c.amplitude_sd_m);
        if let (Some(ratio), Some(sd)) = (c.damping_ratio, c.damping_ratio_sd) {
            self.damping.push(ratio - tone.ratio());
            self.scaled[2].push((ratio - tone.ratio()) / sd);
        }
    }
}

pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

pub fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    rms(&values.iter().map(|x| x - mean).collect::<Vec<_>>())
}

pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()))
}
