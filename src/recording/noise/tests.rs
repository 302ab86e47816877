//! Synthetic recordings with known noise.

use super::*;
use crate::recording::noise::common_noise::CommonNoise;
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
        for channel in [found.head_x.unwrap(), found.tip_y.unwrap()] {
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
            for channel in [found.head_x.unwrap(), found.tip_y.unwrap()] {
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

/// Noise whose correlation lasts for half of a short block is measured in longer blocks. The errors of the
/// standard deviations, divided by their estimates, have a standard normal distribution.
#[test]
fn noise_that_lasts_for_many_frames_is_found_in_longer_blocks() {
    for (rate_hz, rho, mean_error) in [(5000.0, 0.8, 0.03), (5000.0, 0.9, 0.08), (10_000.0, 0.9, 0.05)] {
        let measured = (0..4).map(|seed| {
            let noise = AutoregressiveNoise::new(SD_M, vec![rho]).unwrap();
            let sweep = Sweep { rate_hz, noise, shared: 0.0, lost: 0.03, seed };
            let found = measure_noise(&sweep.recording()).head_x.unwrap();
            [found.noise.sd() / SD_M, (found.noise.sd() - SD_M) / found.sd_of_sd_m]
        });
        let measured: Vec<[f64; 2]> = measured.collect();
        let mean = measured.iter().map(|[ratio, _]| ratio).sum::<f64>() / 4.0;
        let square = measured.iter().map(|[_, z]| z * z).sum::<f64>() / 4.0;
        assert!(
            (mean - 1.0).abs() < mean_error && (0.3..2.2).contains(&square),
            "{rate_hz} {rho}: {measured:?}"
        );
    }
}

/// A marker beside the edge of the lip moves up and down by ten times the noise as the blade rings and leans.
#[test]
fn the_motion_of_a_marker_beside_the_edge_is_no_noise_of_heights() {
    let white = AutoregressiveNoise::white(SD_M).unwrap();
    for (rate_hz, seed) in [(5000.0, 0), (10_000.0, 1)] {
        let sweep = Sweep { rate_hz, noise: white.clone(), shared: 0.0, lost: 0.03, seed };
        let recording = sweep.recording();
        let mut traces = recording.traces().clone();
        for (i, y) in traces.tip_y_m.iter_mut().enumerate() {
            let [tip, _, head, _] = sweep.motion(i);
            *y = y.map(|y| y + 0.1 * (tip - head));
        }
        let found = measure_noise(&recording.with_traces(traces).unwrap());
        for channel in [found.tip_y.unwrap(), found.head_y.unwrap()] {
            assert!((channel.noise.sd() / SD_M - 1.0).abs() < 0.3, "{rate_hz}: {channel:?}");
        }
    }
}

/// Additional noise doubles the variance of the tip. Without it, tip and head have noise of the same size. At
/// the lower frame rate, the blade rings at a fifth of the rate, which hides the difference.
#[test]
fn noise_of_another_size_at_the_tip_is_found() {
    let white = AutoregressiveNoise::white(SD_M).unwrap();
    for (rate_hz, seed) in [(5000.0, 0), (10_000.0, 0), (10_000.0, 1), (10_000.0, 2)] {
        let sweep = Sweep { rate_hz, noise: white.clone(), shared: 0.0, lost: 0.03, seed };
        let alike = sweep.recording();
        let found = measure_noise(&alike);
        assert_eq!((&found.tip_x, &found.head_y), (&found.head_x, &found.tip_y));
        let more = series(&white, sweep.frames(), &mut Xoshiro256PlusPlus::seed_from_u64(seed + 100));
        let mut traces = alike.traces().clone();
        traces.tip_x_m.iter_mut().zip(&more).for_each(|(x, more)| *x = x.map(|x| x + more));
        let unlike = measure_noise(&alike.with_traces(traces).unwrap());
        if rate_hz < 10_000.0 {
            assert_eq!(unlike.tip_x, found.tip_x);
            continue;
        }
        let tip = unlike.tip_x.clone().unwrap();
        let error_m = tip.noise.sd() - 2f64.sqrt() * SD_M;
        assert!(error_m.abs() < 3.0 * tip.sd_of_sd_m && tip.sd_of_sd_m < 0.05 * SD_M, "{error_m} {tip:?}");
        assert_eq!(unlike.head_x, found.head_x);
    }
}

/// The frames of a camera with an uneven clock: noise of first order whose correlation over a time `t` is
/// `exp(-t/tau)`.
#[test]
fn noise_at_true_times_is_found() {
    const TAU_FRAMES: f64 = 2.0;
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(5);
    let (mut places, mut noise_m): (Vec<f64>, Vec<f64>) = (vec![0.0], vec![0.0]);
    for _ in 0..8000 {
        let step = 1.0 + 0.8 * (generator.random::<f64>() - 0.5);
        let decay = (-step / TAU_FRAMES).exp();
        let fresh: f64 = generator.sample(StandardNormal);
        noise_m.push(decay * noise_m[noise_m.len() - 1] + SD_M * (1.0 - decay * decay).sqrt() * fresh);
        places.push(places[places.len() - 1] + step);
    }
    let times_s: Vec<f64> = places.iter().map(|place| place / 8000.0).collect();
    let path_m = |(t, noise): (&f64, &f64)| Some(0.05 * (TAU * t).cos() + noise);
    let head_x_m: Vec<Option<f64>> = times_s.iter().zip(&noise_m).map(path_m).collect();
    let missing = vec![None; times_s.len()];
    let traces = Traces {
        tip_x_m: missing.clone(),
        tip_y_m: missing.clone(),
        head_y_m: missing,
        head_x_m,
        ..Traces::default()
    };
    let found = measure_noise(&Recording::from_times("uneven", times_s, traces, true).unwrap());
    let found = found.head_x.unwrap();
    let [rho] = found.noise.coefficients().try_into().unwrap();
    let expected: f64 = (-1.0 / TAU_FRAMES).exp();
    assert!((rho - expected).abs() < 3.0 * found.sd_of_coefficients[0], "{found:?} {expected}");
    assert!((found.noise.sd() - SD_M).abs() < 3.0 * found.sd_of_sd_m, "{found:?}");
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
        let found = measure_noise(&recording).head_x.unwrap().noise;
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
            let CommonNoise { tip_x, head_y } = measure_noise(&recording).common;
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
        let CommonNoise { tip_x, head_y } = measure_noise(&recording).common;
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
        let found = measure_noise(&recording);
        assert_eq!([found.tip_x, found.tip_y, found.head_x, found.head_y], [const { None }; 4]);
    }
}
