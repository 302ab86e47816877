//! How exact the spectra are: known signals in noise, the errors of what is read from them, beside the Cramér-Rao bound.
//!
//! `cargo run --release --example spectra` prints the table; `-- 1000` takes a thousand seeds a line instead of two hundred.
//! Every signal is synthetic: 0.15 s at 5,000 frames/s unless the line says otherwise.

use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use wiperlab::spectrum::{Analysis, Component, Record, Settings};

const RATE_HZ: f64 = 5000.0;
const FRAMES: usize = 750;
const AMPLITUDE_M: f64 = 1e-5;

/// An oscillation `A exp(-2 pi f zeta t) cos(2 pi f t + phase)`.
#[derive(Clone, Copy)]
struct Tone {
    hz: f64,
    amplitude_m: f64,
    damping: f64,
}

impl Tone {
    fn at(&self, t: f64, phase: f64) -> f64 {
        self.amplitude_m * (-TAU * self.hz * self.damping * t).exp() * (TAU * self.hz * t + phase).cos()
    }

    /// Damping ratio as read: of the decay over the length of the pole.
    fn ratio(&self) -> f64 {
        self.damping / self.damping.hypot(1.0)
    }
}

/// What is added below the tones, of unit height over the record.
type Flip = (&'static str, fn(f64) -> f64);

const FLIPS: [Flip; 5] = [
    ("none", |_| 0.0),
    ("cubic", |s| 4.0 * (s - 0.5).powi(3) + s),
    ("exponential", |s| (-12.0 * s).exp()),
    ("tanh tail", |s| (20.0 * (s + 0.05)).tanh()),
    ("smooth step", |s| 1.0 / (1.0 + (-12.0 * (s - 0.4)).exp())),
];

struct Case {
    name: &'static str,
    tones: Vec<Tone>,
    flip: usize,
    /// `A^2 / (2 sigma^2)` of the last tone, dB.
    snr_db: f64,
    missing: f64,
}

/// Errors of one tone over the seeds.
#[derive(Default)]
struct Errors {
    found: usize,
    hz: Vec<f64>,
    damping: Vec<f64>,
    scaled: [Vec<f64>; 3],
    extra: usize,
}

fn record(case: &Case, seed: u64) -> (Vec<Option<f64>>, f64) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let last = case.tones.last().map_or(AMPLITUDE_M, |t| t.amplitude_m);
    let sigma_m = last / (2.0 * 10.0_f64.powf(case.snr_db / 10.0)).sqrt();
    let phases: Vec<f64> = case.tones.iter().map(|_| random.random::<f64>() * TAU).collect();
    let flip_m = if case.flip == 0 { 0.0 } else { 100.0 * AMPLITUDE_M };
    let sample = |i: usize| {
        let t = i as f64 / RATE_HZ;
        let tones: f64 = case.tones.iter().zip(&phases).map(|(tone, phase)| tone.at(t, *phase)).sum();
        let noise: f64 = random.sample(StandardNormal);
        let lost = random.random::<f64>() < case.missing;
        (!lost).then(|| tones + flip_m * FLIPS[case.flip].1(i as f64 / FRAMES as f64) + sigma_m * noise)
    };
    ((0..FRAMES).map(sample).collect(), sigma_m)
}

fn errors(case: &Case, seeds: u64) -> Vec<Errors> {
    let mut errors: Vec<Errors> = case.tones.iter().map(|_| Errors::default()).collect();
    for seed in 0..seeds {
        let (samples, _) = record(case, seed);
        let found = Analysis::of(&Record { samples: &samples, frame_rate_hz: RATE_HZ, exposure_s: None }, &Settings::default())
            .map_or_else(|_| Vec::new(), |a| a.spectrum.components);
        for (tone, errors) in case.tones.iter().zip(&mut errors) {
            errors.extra += found.len().saturating_sub(case.tones.len());
            let near = found.iter().filter(|c| (c.frequency_hz / tone.hz - 1.0).abs() < 0.15);
            let Some(c) = near.max_by(|a, b| a.amplitude_m.total_cmp(&b.amplitude_m)) else { continue };
            errors.add(tone, c);
        }
    }
    errors
}

impl Errors {
    fn add(&mut self, tone: &Tone, c: &Component) {
        self.found += 1;
        self.hz.push(c.frequency_hz - tone.hz);
        self.scaled[0].push((c.frequency_hz - tone.hz) / c.frequency_sd_hz);
        self.scaled[1].push((c.amplitude_m - tone.amplitude_m) / c.amplitude_sd_m);
        if let (Some(ratio), Some(sd)) = (c.damping_ratio, c.damping_ratio_sd) {
            self.damping.push(ratio - tone.ratio());
            self.scaled[2].push((ratio - tone.ratio()) / sd);
        }
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    rms(&values.iter().map(|x| x - mean).collect::<Vec<_>>())
}

/// Cramér-Rao bound of the frequency of one real tone that decays with nothing else unknown but its decay, amplitude and phase, Hz.
fn bound_hz(tone: &Tone, sigma_m: f64) -> f64 {
    let decay = TAU * tone.hz * tone.damping;
    let mut sums = [0.0; 3];
    for i in 0..FRAMES {
        let t = i as f64 / RATE_HZ;
        let power = (-2.0 * decay * t).exp();
        (0..3).for_each(|k| sums[k] += power * t.powi(k as i32));
    }
    let spread = sums[2] - sums[1] * sums[1] / sums[0];
    (2.0 * sigma_m * sigma_m / (tone.amplitude_m * tone.amplitude_m * spread)).sqrt() / TAU
}

fn main() {
    let seeds = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(200);
    let steady = |hz| Tone { hz, amplitude_m: AMPLITUDE_M, damping: 0.0 };
    let ring = |damping| Tone { hz: 78.4, amplitude_m: AMPLITUDE_M, damping };
    let mut cases = vec![
        Case { name: "900 Hz", tones: vec![steady(900.0)], flip: 0, snr_db: 20.0, missing: 0.0 },
        Case { name: "78.4 Hz", tones: vec![steady(78.4)], flip: 0, snr_db: 20.0, missing: 0.0 },
        Case { name: "78.4 and 900 Hz", tones: vec![steady(78.4), steady(900.0)], flip: 0, snr_db: 20.0, missing: 0.0 },
        Case { name: "the same, 40 % missing", tones: vec![steady(78.4), steady(900.0)], flip: 0, snr_db: 20.0, missing: 0.4 },
    ];
    for flip in 1..FLIPS.len() {
        for damping in [0.02, 0.05, 0.1] {
            cases.push(Case { name: "ring-down", tones: vec![ring(damping)], flip, snr_db: 30.0, missing: 0.0 });
        }
    }
    println!("{seeds} seeds a line; errors of the frequency in Hz; scaled: deviation of (error / stated deviation)");
    println!(
        "{:<24} {:<12} {:>6} {:>6} {:>5} {:>6} {:>9} {:>9} {:>7} {:>7} {:>9} | scaled {:>6} {:>6} {:>6}",
        "signal", "flip", "Hz", "zeta", "found", "extra", "bias", "rms", "rms/CRB", "rms %", "zeta %", "freq.", "ampl.", "damp."
    );
    let only = std::env::var("ONLY").ok();
    for case in cases.iter().filter(|c| only.as_ref().is_none_or(|o| FLIPS[c.flip].0.contains(o.as_str()) || c.name.contains(o.as_str()))) {
        let started = std::time::Instant::now();
        let errors = errors(case, seeds);
        let ms = started.elapsed().as_secs_f64() * 1e3 / seeds as f64;
        for (tone, e) in case.tones.iter().zip(errors) {
            let sigma_m = record(case, 0).1;
            let bound = bound_hz(tone, sigma_m) / (1.0_f64 - case.missing).sqrt();
            println!(
                "{:<24} {:<12} {:>6.1} {:>6.2} {:>5} {:>6} {:>9.5} {:>9.5} {:>7.3} {:>7.3} {:>9.2} |        {:>6.3} {:>6.3} {:>6.3}  {ms:.2} ms",
                case.name,
                FLIPS[case.flip].0,
                tone.hz,
                tone.damping,
                e.found,
                e.extra,
                mean(&e.hz),
                rms(&e.hz),
                rms(&e.hz) / bound,
                100.0 * rms(&e.hz) / tone.hz,
                if tone.damping > 0.0 { 100.0 * rms(&e.damping) / tone.ratio() } else { 0.0 },
                deviation(&e.scaled[0]),
                deviation(&e.scaled[1]),
                deviation(&e.scaled[2]),
            );
        }
    }
}
