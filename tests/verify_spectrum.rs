//! The spectrum against records whose components are known exactly.

use std::f64::consts::TAU;
use wiperlab::spectrum::{Component, Detrend, Settings, Spectrum, SpectrumError, Verdict, analyse};

const RATE_HZ: f64 = 5000.0;

fn record(frames: usize, f: impl Fn(f64) -> f64) -> Vec<Option<f64>> {
    (0..frames).map(|i| Some(f(i as f64 / RATE_HZ))).collect()
}

fn spectrum(samples: &[Option<f64>]) -> Spectrum {
    analyse(samples, RATE_HZ, &Settings::default()).unwrap()
}

/// Normal noise from the sum of twelve uniform numbers of a fixed generator.
fn noise(mut seed: u64) -> impl FnMut() -> f64 {
    move || {
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// Drops about one frame in five, by a fixed generator.
fn with_gaps(samples: &[Option<f64>]) -> Vec<Option<f64>> {
    dropped(samples, -0.84, 11)
}

/// Drops the frames whose standard normal number is not above `level`.
fn dropped(samples: &[Option<f64>], level: f64, seed: u64) -> Vec<Option<f64>> {
    let mut draw = noise(seed);
    samples.iter().map(|x| x.filter(|_| draw() > level)).collect()
}

/// What is not a remainder of the trend.
fn resolvable(spectrum: &Spectrum) -> Vec<Component> {
    spectrum.components.iter().copied().filter(|c| c.verdict != Verdict::NotResolvable).collect()
}

fn only(spectrum: &Spectrum) -> Component {
    let found = resolvable(spectrum);
    assert_eq!(found.len(), 1, "{:?}", spectrum.components);
    found[0]
}

#[test]
fn a_tone_on_and_off_a_bin_reads_its_frequency_and_amplitude() {
    // 750 frames: bins of the record are 6.667 Hz apart; 200 Hz is the 30th, the others lie between bins
    for tone_hz in [200.0, 203.3, 201.7, 78.4, 900.0] {
        let found = only(&spectrum(&record(750, |t| 3e-6 * (TAU * tone_hz * t + 0.7).sin())));
        assert!((found.frequency_hz - tone_hz).abs() < 0.03, "{tone_hz}: {}", found.frequency_hz);
        assert!((found.amplitude_m / 3e-6 - 1.0).abs() < 0.01, "{tone_hz}: {}", found.amplitude_m);
        assert_eq!(found.verdict, Verdict::Clear);
        assert_eq!(found.damping_ratio, None);
    }
}

#[test]
fn two_tones_on_the_flip_of_a_blade_are_both_found() {
    let flip = |t: f64| 2e-3 - 0.04 * t + 0.5 * t * t - 1.7 * t * t * t;
    let samples = record(750, |t| flip(t) + 20e-6 * (TAU * 78.4 * t).sin() + 8e-6 * (TAU * 900.0 * t + 1.0).cos());
    let found = spectrum(&samples);
    assert_eq!(resolvable(&found).len(), 2, "{:?}", found.components);
    assert!((found.components[0].frequency_hz - 78.4).abs() < 0.05, "{}", found.components[0].frequency_hz);
    assert!((found.components[1].frequency_hz - 900.0).abs() < 0.03, "{}", found.components[1].frequency_hz);
    assert_eq!(found.component_in_band(500.0, 1500.0), Some(&found.components[1]));
    assert_eq!(found.component_in_band(1200.0, 1500.0), None);
}

#[test]
fn a_line_leaves_far_more_error_than_a_cubic() {
    let samples = record(750, |t| 5e-4 * (t / 0.15 - 0.5).powi(3) * 8.0 + 20e-6 * (TAU * 78.4 * t).sin());
    let error = |detrend| {
        let found = analyse(&samples, RATE_HZ, &Settings { detrend, band_hz: Some((60.0, 100.0)), ..Settings::default() }).unwrap();
        found.component_in_band(60.0, 100.0).map_or(f64::INFINITY, |c| (c.frequency_hz - 78.4).abs())
    };
    assert!(error(Detrend::Cubic) < 0.05, "{}", error(Detrend::Cubic));
    assert!(error(Detrend::Line) > 2.0 * error(Detrend::Cubic));
}

#[test]
fn a_fifth_of_the_frames_missing_moves_nothing() {
    let whole = record(750, |t| 20e-6 * (TAU * 78.4 * t).sin() + 15e-6 * (TAU * 900.0 * t).sin());
    let gappy = with_gaps(&whole);
    let missing = gappy.iter().filter(|x| x.is_none()).count();
    assert!((120..180).contains(&missing), "{missing}");
    let found = spectrum(&gappy);
    for (tone_hz, amplitude_m) in [(78.4, 20e-6), (900.0, 15e-6)] {
        let c = found.component_in_band(tone_hz - 30.0, tone_hz + 30.0).unwrap();
        assert!((c.frequency_hz - tone_hz).abs() < 0.1, "{}", c.frequency_hz);
        assert!((c.amplitude_m / amplitude_m - 1.0).abs() < 0.05, "{}", c.amplitude_m);
    }
}

#[test]
fn two_fifths_of_the_frames_missing_cost_tenths_of_a_hertz() {
    let flip = |t: f64| 2e-3 - 0.04 * t + 0.5 * t * t - 1.7 * t * t * t;
    let (mut missing, mut square, mut low) = (0, [0.0_f64; 2], 0.0);
    let records = 25;
    for seed in 0..records {
        let phase = seed as f64;
        let whole = record(750, |t| flip(t) + 20e-6 * (TAU * 78.4 * t + phase).sin() + 8e-6 * (TAU * 900.0 * t + 2.0 * phase).sin());
        let gappy = dropped(&whole, -0.25, seed + 1); // four in ten normal numbers are below -0.25
        missing += gappy.iter().filter(|x| x.is_none()).count();
        let found = spectrum(&gappy);
        for (square, tone_hz) in square.iter_mut().zip([78.4, 900.0]) {
            *square += (found.component_in_band(tone_hz - 30.0, tone_hz + 30.0).unwrap().frequency_hz - tone_hz).powi(2);
        }
        low += 1.0 - found.component_in_band(870.0, 930.0).unwrap().amplitude_m / 8e-6;
    }
    let (share, runs) = (missing as f64 / 750.0 / records as f64, records as f64);
    assert!((0.38..0.42).contains(&share), "{share}");
    let rms = square.map(|square| (square / runs).sqrt());
    assert!(rms[0] < 0.12 && rms[1] < 0.15, "{rms:?}");
    assert!((0.05..0.13).contains(&(low / runs)), "the fast component reads low: {}", low / runs);
}

#[test]
fn the_stated_deviation_is_that_of_repeated_noisy_records() {
    let mut draw = noise(3);
    let (mut square, mut stated, runs) = (0.0, 0.0, 200);
    for _ in 0..runs {
        // 900 Hz at a signal-to-noise ratio of 20 dB a sample (A^2 / 2 sigma^2 = 100)
        let samples: Vec<_> = record(750, |t| 10e-6 * (TAU * 900.0 * t).sin()).into_iter().map(|x| x.map(|x| x + 10e-6 / 200.0_f64.sqrt() * draw())).collect();
        let c = *spectrum(&samples).component_in_band(850.0, 950.0).unwrap();
        square += (c.frequency_hz - 900.0).powi(2);
        stated += c.frequency_sd_hz;
    }
    let ratio = (square / f64::from(runs)).sqrt() / (stated / f64::from(runs));
    assert!((0.4..1.3).contains(&ratio), "scatter over stated deviation: {ratio}");
}

#[test]
fn the_power_of_the_bins_is_that_of_the_record() {
    let mut draw = noise(5);
    let samples: Vec<_> = (0..4000).map(|_| Some(2e-6 * draw())).collect();
    let found = spectrum(&samples);
    let rms = found.rms_in_band_m(0.0, RATE_HZ / 2.0);
    assert!((rms / 2e-6 - 1.0).abs() < 0.05, "{rms}");
    // white noise of deviation s has the rms 2 s sqrt(sum w^2) / sum w = s sqrt(6 / n) in a bin of a Hann window
    assert!((found.noise_floor_m / (2e-6 * (6.0_f64 / 4000.0).sqrt()) - 1.0).abs() < 0.1, "{}", found.noise_floor_m);
    assert!((found.noise_bandwidth_hz / found.resolution_hz - 1.5).abs() < 1e-9);
    let tone = spectrum(&record(750, |t| 3e-6 * (TAU * 200.0 * t).sin()));
    assert!((tone.rms_in_band_m(150.0, 250.0) / (3e-6 / 2.0_f64.sqrt()) - 1.0).abs() < 1e-3);
}

#[test]
fn noise_alone_has_no_component_in_nearly_every_spectrum() {
    let mut draw = noise(9);
    let with = (0..100).filter(|_| !spectrum(&(0..750).map(|_| Some(draw())).collect::<Vec<_>>()).components.is_empty()).count();
    assert!(with <= 5, "{with} of 100 spectra of noise show a component");
}

#[test]
fn fewer_than_three_cycles_are_not_resolvable() {
    let samples = record(750, |t| 1e-5 * (TAU * 17.0 * t).sin());
    let found = analyse(&samples, RATE_HZ, &Settings { detrend: Detrend::Mean, ..Settings::default() }).unwrap();
    assert_eq!(found.components[0].verdict, Verdict::NotResolvable);
    assert_eq!(found.component_in_band(0.0, 100.0), None);
}

#[test]
fn a_constant_has_no_components_and_a_finite_floor() {
    let found = spectrum(&vec![Some(0.018); 750]);
    assert!(found.components.is_empty(), "{:?}", found.components);
    assert!(found.noise_floor_m > 0.0 && found.noise_floor_m < 1e-12);
    assert!(spectrum(&[Some(0.0); 64]).components.is_empty());
}

#[test]
fn records_without_a_spectrum_are_refused() {
    let refuse = |samples: &[Option<f64>], rate, settings| analyse(samples, rate, &settings).unwrap_err();
    let default = Settings::default();
    assert_eq!(refuse(&[None; 100], RATE_HZ, default), SpectrumError::TooFew { found: 0 });
    assert_eq!(refuse(&[Some(1.0); 7], RATE_HZ, default), SpectrumError::TooFew { found: 7 });
    assert_eq!(refuse(&[Some(1.0); 8], 0.0, default), SpectrumError::FrameRate { found: 0.0 });
    let spoiled: Vec<_> = (0..20).map(|i| Some(if i == 4 { f64::INFINITY } else { 0.0 })).collect();
    assert_eq!(refuse(&spoiled, RATE_HZ, default), SpectrumError::NotFinite { frame: 4, found: f64::INFINITY });
    for band in [(100.0, 100.0), (2500.0, 2600.0), (-1.0, 5.0), (f64::NAN, 5.0)] {
        assert!(matches!(refuse(&[Some(1.0); 100], RATE_HZ, Settings { band_hz: Some(band), ..default }), SpectrumError::Band { .. }));
    }
}

#[test]
fn the_same_record_gives_the_same_spectrum_to_the_bit() {
    let samples = with_gaps(&record(750, |t| (TAU * 78.4 * t).sin()));
    assert_eq!(spectrum(&samples), spectrum(&samples));
}
