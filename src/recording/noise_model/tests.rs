//! Synthetic recordings with known noise.

use super::*;
use crate::recording::noise_model::common_noise::CommonNoise;
use crate::recording::{FrameGrid, Recording, Traces};
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

const SD_M: f64 = 2e-6;

fn series(noise: &AutoregressiveNoise, frames: usize, generator: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    const BEFORE: usize = 300;
    let mut values: Vec<f64> = Vec::new();
    for _ in 0..frames + BEFORE {
        let fresh: f64 = generator.sample(StandardNormal);
        let past: f64 = noise.coefficients().iter().zip(values.iter().rev()).map(|(a, b)| a * b).sum();
        values.push(past + noise.innovation_sd() * fresh);
    }
    values.split_off(BEFORE)
}

/// One second of a sweep: a slow head, a tip that rings at 1.1 kHz half of the time, a glass that is tilted
/// in the picture, and a fraction of the frames lost.
struct Sweep {
    rate_hz: f64,
    noise: AutoregressiveNoise,
    /// Fraction of the noise variance that both points have in common.
    shared: f64,
    lost: f64,
    seed: u64,
}

impl Sweep {
    fn frames(&self) -> usize {
        self.rate_hz as usize
    }

    /// Noise of tip x, tip y, head x and head y.
    fn noise(&self, generator: &mut Xoshiro256PlusPlus) -> [Vec<f64>; 4] {
        let frames = self.frames();
        let shake: [Vec<f64>; 2] = std::array::from_fn(|_| series(&self.noise, frames, generator));
        let [own, common] = [1.0 - self.shared, self.shared].map(f64::sqrt);
        std::array::from_fn(|channel| {
            let noise = series(&self.noise, frames, generator);
            noise.iter().zip(&shake[channel % 2]).map(|(a, b)| own * a + common * b).collect()
        })
    }

    fn motion(&self, i: usize) -> [f64; 4] {
        let t = i as f64 / self.rate_hz;
        let head = 0.05 * (1.0 - (TAU * t).cos()) + 2e-5 * (TAU * 30.0 * t).sin();
        let rings = (20.0 * t).fract() < 0.5;
        let ring = if rings { 2e-4 * (TAU * 1100.0 * t).sin() } else { 0.0 };
        let tip = head + 1e-3 + ring;
        [tip, -6e-3 + 0.01 * tip, head, -1e-4 + 0.1 * ring]
    }

    /// The recording and its noise; `bias_m` is the error of a position along the sweep as a function of this
    /// position.
    fn with_bias(&self, bias_m: fn(f64) -> f64) -> (Recording, [Vec<f64>; 4]) {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let noise = self.noise(&mut generator);
        let mut columns: [Vec<Option<f64>>; 4] = Default::default();
        for (i, places) in (0..self.frames()).map(|i| self.motion(i)).enumerate() {
            let lost: [bool; 2] = std::array::from_fn(|_| generator.random::<f64>() < self.lost);
            for (c, column) in columns.iter_mut().enumerate() {
                let seen = places[c] + bias_m(places[c]) + noise[c][i];
                column.push((!lost[c / 2]).then_some(seen));
            }
        }
        let [tip_x_m, tip_y_m, head_x_m, head_y_m] = columns;
        let traces = Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, ..Traces::default() };
        let grid = FrameGrid { start_s: 0.0, frame_rate_hz: self.rate_hz, frames: self.frames() };
        (Recording::new("sweep", grid, traces, true).unwrap(), noise)
    }

    fn recording(&self) -> Recording {
        self.with_bias(|_| 0.0).0
    }
}

#[test]
fn white_noise_is_found_to_be_white_and_of_its_size() {
    let mut coloured = 0;
    for seed in 0..15 {
        let noise = AutoregressiveNoise::white(SD_M).unwrap();
        let found =
            measure_noise(&Sweep { rate_hz: 5000.0, noise, shared: 0.0, lost: 0.05, seed }.recording());
        for channel in [found.along_sweep.unwrap(), found.upwards.unwrap()] {
            assert!((channel.noise.sd() - SD_M).abs() < 4.0 * channel.sd_of_sd_m, "{channel:?}");
            coloured += usize::from(!channel.noise.coefficients().is_empty());
        }
    }
    assert!(coloured <= 2, "{coloured} of 30");
}

/// The errors of the estimates, divided by their estimated standard deviations, have a standard normal
/// distribution.
#[test]
fn noise_that_resembles_its_neighbours_is_found() {
    let mut scores = Vec::new();
    for (rate_hz, rho) in [(2000.0, 0.3), (5000.0, 0.6), (10_000.0, 0.9), (20_000.0, 0.9)] {
        for seed in 0..3 {
            let noise = AutoregressiveNoise::new(SD_M, vec![rho]).unwrap();
            let found = measure_noise(&Sweep { rate_hz, noise, shared: 0.0, lost: 0.05, seed }.recording());
            for channel in [found.along_sweep.unwrap(), found.upwards.unwrap()] {
                assert_eq!(channel.noise.coefficients().len(), 1, "{rho}: {channel:?}");
                let off = channel.noise.coefficients()[0] - rho;
                scores.push(off / channel.sd_of_coefficients[0]);
                scores.push((channel.noise.sd() - SD_M) / channel.sd_of_sd_m);
            }
        }
    }
    let square = scores.iter().map(|z| z * z).sum::<f64>() / scores.len() as f64;
    assert!((0.4..1.8).contains(&square), "{square}: {scores:?}");
    assert!(scores.iter().all(|z| z.abs() < 4.0), "{scores:?}");
}

/// A bias of a twentieth of a pixel that depends on the position within the pixel counts as a further part of
/// the noise.
#[test]
fn a_bias_within_the_pixel_counts_as_noise() {
    const PIXEL_M: f64 = 2e-5;
    for seed in 0..3 {
        let noise = AutoregressiveNoise::white(SD_M).unwrap();
        let sweep = Sweep { rate_hz: 5000.0, noise, shared: 0.0, lost: 0.05, seed };
        let (recording, _) = sweep.with_bias(|x_m| 0.05 * PIXEL_M * (TAU * x_m / PIXEL_M).sin());
        let found = measure_noise(&recording).along_sweep.unwrap().noise;
        let expected = SD_M.hypot(0.05 * PIXEL_M / 2f64.sqrt());
        assert!((found.sd() / expected - 1.0).abs() < 0.06, "{found:?} instead of {expected}");
    }
}

/// If both points share a fraction `s` of the variance, the best multiple of the head's noise to subtract
/// from the tip is `s`. The fraction `1 - s^2` of the variance of white noise remains, plus the noise of the
/// head that the smooth motion absorbs: 4 degrees of freedom in a block of 40 frames.
#[test]
fn what_both_points_share_is_found_and_taken_out() {
    for (rate_hz, rho, share) in [(5000.0, 0.0, 0.6), (10_000.0, 0.6, 0.5), (10_000.0, 0.9, 0.8)] {
        let noise = AutoregressiveNoise::new(SD_M, vec![rho]).unwrap();
        for seed in 0..3 {
            let sweep = Sweep { rate_hz, noise: noise.clone(), shared: share, lost: 0.05, seed };
            let (recording, noise) = sweep.with_bias(|_| 0.0);
            let CommonNoise { tip_x, head_y } = measure_common_noise(&recording);
            let shared = [tip_x.unwrap(), head_y.unwrap()];
            for found in &shared {
                let off = found.share - share;
                assert!(
                    off.abs() < 4.0 * found.sd && found.sd < 0.05,
                    "{share}: {} {}",
                    found.share,
                    found.sd
                );
            }
            if rho == 0.0 {
                let [before, left] = variances(&noise[0], &shared[0].noise_m);
                let expected = 1.0 - share * share * (1.0 - 4.0 / 40.0);
                assert!((left / before - expected).abs() < 0.03, "{} {expected}", left / before);
            }
        }
    }
}

/// Variance of noise before and after `taken` is subtracted from it.
fn variances(noise: &[f64], taken: &[Option<f64>]) -> [f64; 2] {
    let pairs: Vec<(f64, f64)> = noise.iter().zip(taken).filter_map(|(a, b)| Some((*a, (*b)?))).collect();
    let mean = |f: fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>() / pairs.len() as f64;
    [mean(|(noise, _)| noise * noise), mean(|(noise, taken)| (noise - taken).powi(2))]
}

#[test]
fn points_without_common_noise_share_nothing() {
    let mut found = 0;
    for seed in 0..15 {
        let noise = AutoregressiveNoise::new(SD_M, vec![0.5]).unwrap();
        let recording = Sweep { rate_hz: 5000.0, noise, shared: 0.0, lost: 0.05, seed }.recording();
        let CommonNoise { tip_x, head_y } = measure_common_noise(&recording);
        found += usize::from(tip_x.is_some()) + usize::from(head_y.is_some());
    }
    assert!(found <= 2, "{found} of 30");
}

#[test]
fn a_recording_without_noise_or_without_points_has_none() {
    let noise = AutoregressiveNoise::white(1e-13).unwrap();
    let exact = Sweep { rate_hz: 5000.0, noise, shared: 0.0, lost: 0.0, seed: 1 }.recording();
    let still = Traces { head_x_m: vec![None; 5000], tip_y_m: vec![None; 5000], ..exact.traces().clone() };
    let blind = Recording::new("blind", exact.grid(), still, true).unwrap();
    for recording in [exact, blind] {
        assert_eq!(measure_noise(&recording), RecordingNoise { along_sweep: None, upwards: None });
    }
}
