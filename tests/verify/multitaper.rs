//! The multitaper estimate against records whose density and lines are known.

use crate::noise::noise;
use short_spectra::{Multitaper, MultitaperError, TAPERS};
use std::f64::consts::TAU;

const RATE_HZ: f64 = 5000.0;
const FRAMES: usize = 750;
const PADDED: usize = 8192;
/// Enough where bins a line's width apart are looked at.
const SHORT: usize = 1024;

fn record(f: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..FRAMES).map(|i| f(i as f64 / RATE_HZ)).collect()
}

fn estimate(samples: &[f64]) -> Multitaper {
    padded(samples, PADDED)
}

fn padded(samples: &[f64], padded: usize) -> Multitaper {
    let samples: Vec<_> = samples.iter().copied().map(Some).collect();
    Multitaper::new(&samples, RATE_HZ, padded, TAPERS).unwrap()
}

fn bin(m: &Multitaper, frequency_hz: f64) -> usize {
    (frequency_hz / m.frequency_hz[1]).round() as usize
}

/// Bins a line's width apart, a line's width from both ends: nearly independent.
fn apart(m: &Multitaper) -> impl Iterator<Item = usize> {
    let width = bin(m, 2.0 * m.half_bandwidth_hz);
    (width..m.frequency_hz.len() - width).step_by(width)
}

#[test]
fn the_sum_over_the_bins_is_the_mean_square_as_the_tapers_weigh_it() {
    let mut draw = noise(1);
    let samples: Vec<f64> = (0..FRAMES).map(|_| 2e-6 * draw()).collect();
    let m = estimate(&samples);
    assert_eq!((m.frequency_hz.len(), m.tapers, m.degrees_of_freedom()), (PADDED / 2 + 1, 7, 14));
    assert_eq!(*m.frequency_hz.last().unwrap(), RATE_HZ / 2.0);
    let integral = m.density_m2_per_hz.iter().sum::<f64>() * m.frequency_hz[1];
    let weight = |i: usize| {
        let angle = std::f64::consts::PI * (i + 1) as f64 / (FRAMES + 1) as f64;
        (1..=TAPERS).map(|k| (k as f64 * angle).sin().powi(2)).sum::<f64>() * 2.0
            / (FRAMES + 1) as f64
            / TAPERS as f64
    };
    let expected: f64 = samples.iter().enumerate().map(|(i, x)| weight(i) * x * x).sum();
    assert!((integral / expected - 1.0).abs() < 1e-12, "{integral:e} {expected:e}");
}

#[test]
fn white_noise_reads_twice_its_variance_over_the_rate_and_its_intervals_hold_it() {
    let (mut draw, truth) = (noise(2), 2.0 * 4e-12 / RATE_HZ);
    let (mut mean, mut inside, mut count) = (0.0, 0, 0);
    for _ in 0..100 {
        let m = padded(&(0..FRAMES).map(|_| 2e-6 * draw()).collect::<Vec<_>>(), SHORT);
        for bin in apart(&m) {
            let (low, high) = m.interval_95(bin).unwrap();
            mean += m.density_m2_per_hz[bin] / truth;
            inside += usize::from(low < truth && truth < high);
            count += 1;
        }
    }
    assert_eq!(count, 4500);
    // the mean of 4500 values that scatter by sqrt(2/14): four deviations are 2.3 %
    assert!((mean / f64::from(count as u32) - 1.0).abs() < 0.023, "{}", mean / f64::from(count as u32));
    let share = inside as f64 / f64::from(count as u32);
    assert!((0.90..0.98).contains(&share), "{share}");
}

#[test]
fn f_of_noise_has_the_stated_tail() {
    let mut draw = noise(3);
    let (mut below, mut count) = ([0_usize; 3], 0_usize);
    let levels = [0.5, 0.1, 0.01];
    for _ in 0..200 {
        let m = padded(&(0..FRAMES).map(|_| draw()).collect::<Vec<_>>(), SHORT);
        for bin in apart(&m) {
            let p = m.line_probability(bin).unwrap();
            levels.iter().zip(&mut below).for_each(|(level, below)| *below += usize::from(p < *level));
            count += 1;
        }
    }
    assert_eq!(count, 9000);
    for (level, below) in levels.into_iter().zip(below) {
        let (expected, deviation) = (level * count as f64, (level * (1.0 - level) * count as f64).sqrt());
        assert!(
            (below as f64 - expected).abs() < 4.0 * deviation,
            "p < {level}: {below} of {count}, expected {expected} +- {deviation}"
        );
    }
}

#[test]
fn a_steady_tone_is_a_line_of_its_amplitude() {
    let tone_hz = 1024.0 * RATE_HZ / PADDED as f64; // a bin: 625 Hz
    let m = estimate(&record(|t| 3e-6 * (TAU * tone_hz * t + 0.4).sin()));
    assert!(m.line_f[1024] > 1e6, "{:e}", m.line_f[1024]);
    assert!((m.line_amplitude_m[1024] / 3e-6 - 1.0).abs() < 1e-3, "{:e}", m.line_amplitude_m[1024]);
    let integral = m.density_m2_per_hz.iter().sum::<f64>() * m.frequency_hz[1];
    assert!((integral / (9e-12 / 2.0) - 1.0).abs() < 1e-3, "{integral:e}");
}

#[test]
fn a_ring_down_is_no_line_beside_a_tone_that_is_one() {
    for seed in 0..20 {
        let (mut draw, phase) = (noise(seed + 10), seed as f64);
        let ring_down = |t: f64| 100e-6 * (-0.05 * TAU * 78.4 * t).exp() * (TAU * 78.4 * t + phase).sin();
        let clean = record(|t| ring_down(t) + 8e-6 * (TAU * 900.0 * t + 2.0 * phase).sin());
        let m = estimate(&clean.into_iter().map(|x| x + 0.3e-6 * draw()).collect::<Vec<_>>());
        let least = |from_hz: f64, to_hz: f64| {
            (bin(&m, from_hz)..=bin(&m, to_hz)).filter_map(|bin| m.line_probability(bin)).fold(1.0, f64::min)
        };
        assert!(least(890.0, 910.0) < 1e-9, "{seed}: {:e}", least(890.0, 910.0));
        assert!(least(68.0, 88.0) > 1.0 / FRAMES as f64, "{seed}: {:e}", least(68.0, 88.0));
    }
}

/// Noise whose density falls by 12 dB from 0 to half the rate: `x[i] = 0.6 x[i-1] + e[i]`.
fn coloured(draw: &mut impl FnMut() -> f64) -> Vec<f64> {
    let mut state = 0.0;
    (0..FRAMES + 200)
        .map(|_| {
            state = 0.6 * state + draw();
            state
        })
        .skip(200)
        .collect()
}

#[test]
fn the_floor_follows_coloured_noise_under_a_tone() {
    let mut draw = noise(5);
    let truth = |f: f64| 2.0 / RATE_HZ / (1.0 + 0.36 - 1.2 * (TAU * f / RATE_HZ).cos());
    let at_hz = [200.0, 400.0, 625.0, 800.0, 1200.0, 1800.0, 2300.0];
    let mut ratio = [0.0; 7];
    for _ in 0..100 {
        let toned: Vec<_> = coloured(&mut draw)
            .into_iter()
            .zip(record(|t| 20.0 * (TAU * 625.0 * t).sin()))
            .map(|(x, s)| x + s)
            .collect();
        let m = padded(&toned, SHORT);
        let floor = m.noise_density(0.0);
        assert_eq!(floor.len(), m.frequency_hz.len());
        assert!(m.density_m2_per_hz[bin(&m, 625.0)] > 100.0 * floor[bin(&m, 625.0)]);
        at_hz.iter().zip(&mut ratio).for_each(|(f, sum)| *sum += floor[bin(&m, *f)] / truth(*f) / 100.0);
    }
    // (a tone 60 dB above the noise of its bins reaches across the window of the median, so that under it the
    // floor reads a quarter high)
    assert!(
        ratio.iter().zip(at_hz).all(|(r, f)| (r - 1.0).abs() < if f == 625.0 { 0.3 } else { 0.1 }),
        "{ratio:?}"
    );
}

#[test]
fn gaps_keep_the_scale_and_find_the_line() {
    let (mut draw, mut mean, mut count) = (noise(6), 0.0, 0);
    let gappy = |clean: Vec<f64>| -> Vec<_> {
        clean
            .into_iter()
            .enumerate()
            .map(|(i, x)| Some(x).filter(|_| i % 10 != 3 && !(400..450).contains(&i)))
            .collect()
    };
    for _ in 0..100 {
        let quiet: Vec<f64> = (0..FRAMES).map(|_| draw()).collect();
        let toned = quiet.iter().zip(record(|t| 4.0 * (TAU * 625.0 * t).sin())).map(|(x, s)| x + s).collect();
        let (quiet, toned) = (gappy(quiet), gappy(toned));
        assert_eq!(quiet.iter().filter(|x| x.is_none()).count(), 120);
        let m = Multitaper::new(&quiet, RATE_HZ, SHORT, TAPERS).unwrap();
        assert_eq!(m.tapers, 7);
        apart(&m).for_each(|bin| {
            mean += m.density_m2_per_hz[bin] * RATE_HZ / 2.0;
            count += 1;
        });
        let m = Multitaper::new(&toned, RATE_HZ, SHORT, TAPERS).unwrap();
        assert!(m.line_probability(128).unwrap() < 1e-3, "{:e}", m.line_probability(128).unwrap());
        assert!((m.line_amplitude_m[128] / 4.0 - 1.0).abs() < 0.1, "{}", m.line_amplitude_m[128]);
    }
    assert_eq!(count, 4500);
    assert!((mean / f64::from(count) - 1.0).abs() < 0.023, "{}", mean / f64::from(count));
}

#[test]
fn the_same_record_gives_the_same_estimate_in_one_thread_and_in_four() {
    let mut draw = noise(7);
    let samples: Vec<_> = (0..20_000).map(|i| Some(draw()).filter(|_| i % 9 != 4)).collect();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Multitaper::new(&samples, RATE_HZ, 1 << 17, TAPERS).unwrap())
    };
    assert_eq!(with(1), with(4));
}

#[test]
fn records_without_an_estimate_are_refused() {
    let refuse = |samples: &[Option<f64>], rate, padded, tapers| {
        Multitaper::new(samples, rate, padded, tapers).unwrap_err()
    };
    assert_eq!(refuse(&[Some(1.0); 100], RATE_HZ, 128, 1), MultitaperError::Tapers { found: 1 });
    assert_eq!(
        refuse(&[Some(1.0); 13], RATE_HZ, 128, 7),
        MultitaperError::TooFew { found: 13, expected: 14 }
    );
    assert_eq!(
        refuse(&[Some(1.0); 100], f64::NAN, 128, 7).to_string(),
        "frame rate: found NaN Hz, expected a finite number above 0"
    );
    let spoiled: Vec<_> = (0..20).map(|i| Some(if i == 4 { f64::INFINITY } else { 0.0 })).collect();
    assert_eq!(
        refuse(&spoiled, RATE_HZ, 128, 7),
        MultitaperError::NotFinite { frame: 4, found: f64::INFINITY }
    );
    assert!(matches!(refuse(&[Some(1.0); 100], RATE_HZ, usize::MAX, 7), MultitaperError::TooLong { .. }));
    let silent = Multitaper::new(&[Some(0.0); 100], RATE_HZ, 0, 7).unwrap();
    assert_eq!(silent.frequency_hz.len(), 65);
    assert!(silent.log_density_sd.iter().chain(&silent.line_f).all(|x| *x == 0.0));
    assert_eq!((silent.interval_95(64), silent.interval_95(65)), (Some((0.0, 0.0)), None));
}
