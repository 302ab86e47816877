//! The complete analysis of a record: what it is made of, how well each part is known, and what its frequency is worth.

use super::least_squares::{Covariance, Deviations, Free, Term};
use super::oscillations::{Explained, Parts, Search};
use super::peaks::CLEAR_DB;
use super::periodogram::Periodogram;
use super::trend::Trend;
use super::{Component, Detrend, Estimator, MIN_CYCLES, Settings, Spectrum, SpectrumError, Verdict, check};
use std::f64::consts::TAU;

/// Half width of the neighbourhood whose rest is the noise of a component, resolutions: 48 independent values of the spectrum, so that
/// the noise is known to a tenth.
const NEIGHBOURHOOD: f64 = 12.0;
/// Deviations from zero from which a decay is one; below, the amplitude is that of a steady oscillation.
const DECAYS: f64 = 3.0;

/// A record and the camera that took it.
#[derive(Debug, Clone, Copy)]
pub struct Record<'a> {
    /// One sample a frame, m; `None` where there is none.
    pub samples: &'a [Option<f64>],
    /// Frames per second, 1/s.
    pub frame_rate_hz: f64,
    /// Exposure of a frame, s, where known.
    pub exposure_s: Option<f64>,
}

/// A record taken apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    /// Amplitude spectrum of the record less what was removed, with the components.
    pub spectrum: Spectrum,
    /// What was removed.
    pub removed: Removed,
    /// Trend and relaxations in every frame, m.
    pub removed_m: Vec<f64>,
    /// The sum of the components in every frame, m.
    pub model_m: Vec<f64>,
    /// What is left in each frame, m.
    pub left_m: Vec<Option<f64>>,
}

/// What was taken away before components were read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Removed {
    /// The trend.
    pub detrend: Detrend,
    /// Exponential relaxations beside it.
    pub relaxations: usize,
}

impl Analysis {
    /// Takes a record apart; with `settings.detrend` `None` the trend is chosen from the record.
    ///
    /// # Errors
    /// [`SpectrumError`] when the record, the rate or the band cannot give one.
    pub fn of(record: &Record, settings: &Settings) -> Result<Self, SpectrumError> {
        let (padded, trend) = check(record.samples, record.frame_rate_hz, settings)?;
        let periodogram = Periodogram::of(record.samples, padded);
        let largest = record.samples.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        let least_m = (super::ROUNDING * largest).max(f64::MIN_POSITIVE);
        let mut search = Search::new(record.samples, record.frame_rate_hz, &periodogram, trend, least_m);
        search.grows = settings.detrend.is_none();
        let explained = search.run(trend).ok_or(SpectrumError::TooFew { found: record.samples.iter().flatten().count() })?;
        let reading = Reading::of(&search, explained).ok_or(SpectrumError::TooFew { found: record.samples.iter().flatten().count() })?;
        Ok(reading.analysis(record, settings, &periodogram))
    }
}

/// A record explained, with what its least squares say of the parts.
struct Reading<'a> {
    search: &'a Search<'a>,
    /// With every decay free: frequency and damping are read from it.
    free: Parts,
    /// With decays that are none held at none: amplitudes are read from it.
    explained: Explained,
    covariance_free: Covariance,
    covariance: Covariance,
}

impl<'a> Reading<'a> {
    fn of(search: &'a Search<'a>, explained: Explained) -> Option<Self> {
        let free = explained.parts.clone();
        let problem = search.problem(free.trend);
        let covariance_free = problem.covariance(&free.solved)?;
        let noise_m = search.periodogram.deviation(explained.found.floor_m);
        let steady = |(k, term): (usize, &Term)| {
            let sd = covariance_free.deviations(k, problem.pair(&free.solved, k)).nepers * noise_m;
            if term.free == Free::Both && term.nepers.abs() < DECAYS * sd { Term { nepers: 0.0, free: Free::Cycles, ..*term } } else { *term }
        };
        let terms: Vec<Term> = free.solved.terms.iter().enumerate().map(steady).collect();
        let explained = if terms == free.solved.terms { explained } else { search.explain(Parts { trend: free.trend, solved: problem.solve(&terms)? }) };
        let covariance = problem.covariance(&explained.parts.solved)?;
        Some(Self { search, free, explained, covariance_free, covariance })
    }

    fn analysis(&self, record: &Record, settings: &Settings, periodogram: &Periodogram) -> Analysis {
        let parts = &self.explained.parts;
        let problem = self.search.problem(parts.trend);
        let removed_m = self.search.removed(parts);
        let oscillations: Vec<usize> = (0..parts.solved.terms.len()).filter(|k| parts.solved.terms[*k].cycles > 0.0).collect();
        let courses: Vec<Vec<f64>> = oscillations.iter().map(|k| problem.of_term(&parts.solved, *k)).collect();
        let mut model_m = vec![0.0; record.samples.len()];
        courses.iter().for_each(|course| model_m.iter_mut().zip(course).for_each(|(sum, x)| *sum += x));
        let amplitude_m = self.curve(&model_m);
        let leakage_m = periodogram.amplitudes(&removed_m);
        let richer = self.search.with_more_trend(parts);
        let bin_hz = periodogram.seen(&amplitude_m, record.frame_rate_hz, 0.0).bin_hz;
        let resolution_hz = record.frame_rate_hz / record.samples.len() as f64;
        let (low, high) = settings.band_hz.unwrap_or((0.0, record.frame_rate_hz / 2.0));
        let mut components: Vec<Component> = Vec::new();
        for (&k, course) in oscillations.iter().zip(&courses) {
            let mut component = self.component(k, course, resolution_hz);
            component.leakage_m = leakage_m.get((component.frequency_hz / bin_hz).round() as usize).copied();
            component.trend_shift_hz =
                richer.as_ref().map(|richer| (richer.solved.terms[k].cycles - parts.solved.terms[k].cycles).abs() * resolution_hz);
            if (low..=high).contains(&component.frequency_hz) {
                components.push(component);
            }
        }
        components.sort_by(|a, b| b.amplitude_m.total_cmp(&a.amplitude_m));
        components.truncate(settings.max_components);
        let sums = periodogram.sums;
        let spectrum = Spectrum {
            frequency_hz: (0..amplitude_m.len()).map(|k| k as f64 * bin_hz).collect(),
            noise_floor_m: self.explained.found.floor_m,
            resolution_hz,
            noise_bandwidth_hz: record.frame_rate_hz * sums.second / (sums.first * sums.first),
            present: sums.present as f64 / record.samples.len() as f64,
            components,
            amplitude_m,
        };
        let relaxations = parts.solved.terms.len() - oscillations.len();
        let removed = Removed { detrend: settings.detrend.unwrap_or(chosen(parts.trend)), relaxations };
        Analysis { spectrum, removed, removed_m, model_m, left_m: self.explained.left.clone() }
    }

    /// The spectrum of components and rest, m: the components in every frame, so that gaps do not spread them, the rest where it is known.
    fn curve(&self, model_m: &[f64]) -> Vec<f64> {
        let frames = model_m.len();
        let whole: Vec<Option<f64>> = vec![Some(0.0); frames];
        let share = self.search.periodogram.sums.first / (frames as f64 / 2.0); // of the window's sum; a Hann window without gaps has half its frames
        let data: Vec<f64> = self.explained.left.iter().zip(model_m).map(|(left, m)| m + left.unwrap_or(0.0) / share).collect();
        Periodogram::of(&whole, 2 * (self.explained.amplitude_m.len() - 1)).amplitudes(&data)
    }

    fn component(&self, k: usize, course: &[f64], resolution_hz: f64) -> Component {
        let parts = &self.explained.parts;
        let problem = self.search.problem(parts.trend);
        let (term, free) = (&parts.solved.terms[k], &self.free.solved.terms[k]);
        let pair = problem.pair(&parts.solved, k);
        let noise_m = self.noise_near(term.cycles);
        let sd = self.covariance.deviations(k, pair);
        let sd_free = self.covariance_free.deviations(k, problem.pair(&self.free.solved, k));
        let amplitude_m = pair[0].hypot(pair[1]);
        let snr_db = 20.0 * (self.search.periodogram.shown(course, term.cycles) / self.explained.found.floor_m).log10();
        let damping = (free.free == Free::Both || free.free == Free::Nepers).then(|| damping_ratio(free, &sd_free, noise_m));
        Component {
            frequency_hz: term.cycles * resolution_hz,
            frequency_sd_hz: sd.cycles * noise_m * resolution_hz,
            amplitude_m,
            amplitude_sd_m: sd.amplitude * noise_m,
            damping_ratio: damping.map(|d| d.0),
            damping_ratio_sd: damping.map(|d| d.1),
            snr_db,
            estimator: Estimator::LeastSquares,
            trend_shift_hz: None,
            leakage_m: None,
            verdict: match () {
                () if term.cycles < MIN_CYCLES => Verdict::NotResolvable,
                () if snr_db < CLEAR_DB => Verdict::Weak,
                () => Verdict::Clear,
            },
        }
    }

    /// Standard deviation of white noise that leaves as much as is left around a frequency, m.
    fn noise_near(&self, cycles: f64) -> f64 {
        let Explained { parts, amplitude_m, .. } = &self.explained;
        let bins_a_cycle = 2.0 * (amplitude_m.len() - 1) as f64 / self.search.samples.len() as f64;
        let most = self.search.samples.len() as f64 / 2.0;
        let lowest = parts.trend.waves().min(most / 2.0);
        let low = (cycles - NEIGHBOURHOOD).min(most - 2.0 * NEIGHBOURHOOD).max(lowest);
        let high = (low + 2.0 * NEIGHBOURHOOD).min(most);
        let bin = |cycles: f64| ((cycles * bins_a_cycle) as usize).min(amplitude_m.len() - 1);
        let around = &amplitude_m[bin(low)..=bin(high)];
        let mean_square = around.iter().map(|a| a * a).sum::<f64>() / around.len() as f64;
        // every oscillation inside has taken up to four of the values with it
        let values = 2.0 * (high - low);
        let taken: f64 = parts.solved.terms.iter().filter(|t| t.cycles > low && t.cycles < high).map(|t| 2.0 + t.free.count() as f64).sum();
        let share = (1.0 - taken / values).max(0.25);
        self.search.periodogram.deviation((mean_square / share).sqrt())
    }
}

/// Damping ratio `d / sqrt(d^2 + (2 pi n)^2)` of `d` nepers in `n` cycles, and its deviation.
fn damping_ratio(term: &Term, sd: &Deviations, noise_m: f64) -> (f64, f64) {
    let angle = TAU * term.cycles;
    let size = term.nepers.hypot(angle);
    (term.nepers / size, sd.nepers * noise_m * (angle / size).powi(2) / size)
}

fn chosen(trend: Trend) -> Detrend {
    match trend.columns() {
        0 => Detrend::None,
        1 => Detrend::Mean,
        2 => Detrend::Line,
        4 => Detrend::Cubic,
        columns => Detrend::Polynomial(columns - 1),
    }
}
