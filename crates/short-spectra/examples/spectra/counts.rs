//! What is read from records, held against what they were made of, kind by kind.

use crate::hard::{Kind, Made, Truth};
use rayon::prelude::*;
use short_spectra::{Component, ComponentVerdict, SampledRecord, SpectralAnalysis, SpectrumSettings};

/// A component that is listed.
pub struct Listed {
    pub hz: f64,
    pub sd_hz: f64,
    pub clear: bool,
}

/// Counts over the records of a kind.
#[derive(Default)]
pub struct Counts {
    /// Oscillations that are sought, and those not listed.
    pub sought: usize,
    pub missed: usize,
    /// Records with a component called clear that is none.
    pub wrong: usize,
    /// Components listed that are none, whatever is said of them.
    pub others: usize,
    /// Errors of the frequencies over their bounds, and over their stated deviations.
    pub over_bound: Vec<f64>,
    pub scaled: Vec<f64>,
}

impl Counts {
    /// Of what the complete analysis reads.
    pub fn of(kind: &Kind, seeds: u64) -> Self {
        let read = |made: &Made| {
            let record =
                SampledRecord { samples: &made.samples, frame_rate_hz: made.rate_hz, exposure_s: None };
            SpectralAnalysis::from_record(&record, &SpectrumSettings::default())
                .map_or_else(|_| Vec::new(), |a| a.spectrum.components.iter().map(listed).collect())
        };
        Self::over(kind, seeds, read)
    }

    /// Counts of the components that `read` lists in the records of a kind with the seeds below `seeds`.
    pub fn over(kind: &Kind, seeds: u64, read: impl Fn(&Made) -> Vec<Listed> + Sync) -> Self {
        let one = |seed| {
            let made = kind.made(seed);
            let read = read(&made);
            (made, read)
        };
        let all: Vec<_> = (0..seeds).into_par_iter().map(one).collect();
        let mut counts = Self::default();
        for (made, listed) in &all {
            counts.add(made, listed);
        }
        counts
    }

    fn add(&mut self, made: &Made, listed: &[Listed]) {
        let mut taken = vec![false; listed.len()];
        for truth in &made.truths {
            let off_hz = |k: &usize| (listed[*k].hz - truth.hz).abs();
            let nearest = (0..listed.len())
                .filter(|k| !taken[*k])
                .min_by(|a, b| off_hz(a).total_cmp(&off_hz(b)))
                .filter(|k| off_hz(k) < near_hz(truth, made));
            self.sought += usize::from(truth.sought);
            let Some(k) = nearest else {
                self.missed += usize::from(truth.sought);
                continue;
            };
            if truth.sought {
                let error_hz = listed[k].hz - truth.hz;
                self.over_bound
                    .push(error_hz / truth.bound_hz(made.samples.len(), made.rate_hz, made.noise_m));
                self.scaled.push(error_hz / listed[k].sd_hz);
            }
            // what is a part of another is there, but not of its own
            taken[k] = truth.own || !listed[k].clear;
        }
        let none = || listed.iter().zip(&taken).filter(|(_, taken)| !**taken).map(|(listed, _)| listed);
        self.others += none().count();
        self.wrong += usize::from(none().any(|listed| listed.clear));
    }
}

fn listed(c: &Component) -> Listed {
    Listed { hz: c.frequency_hz, sd_hz: c.frequency_sd_hz, clear: c.verdict == ComponentVerdict::Clear }
}

/// Within so many hertz a component is this oscillation.
fn near_hz(truth: &Truth, made: &Made) -> f64 {
    let frames = made.samples.len();
    let resolution_hz = made.rate_hz / frames as f64;
    let width_hz = truth.decay_per_s / std::f64::consts::TAU;
    (0.35 * resolution_hz).max(0.5 * width_hz).max(5.0 * truth.bound_hz(frames, made.rate_hz, made.noise_m))
}
