//! The spectrum against records whose components are known exactly.

use crate::noise::noise;
use short_spectra::{
    Component, ComponentVerdict, Detrend, Spectrum, SpectrumError, SpectrumSettings, analyse_spectrum,
};
use std::f64::consts::TAU;

const RATE_HZ: f64 = 5000.0;

fn record(frames: usize, f: impl Fn(f64) -> f64) -> Vec<Option<f64>> {
    (0..frames).map(|i| Some(f(i as f64 / RATE_HZ))).collect()
}

fn spectrum(samples: &[Option<f64>]) -> Spectrum {
    analyse_spectrum(samples, RATE_HZ, &SpectrumSettings::default()).unwrap()
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
    spectrum.components.iter().filter(|c| c.verdict != ComponentVerdict::NotResolvable).cloned().collect()
}

fn only(spectrum: &Spectrum) -> Component {
    let found = resolvable(spectrum);
    assert_eq!(found.len(), 1, "{:?}", spectrum.components);
    found[0].clone()
}

#[test]
fn a_tone_on_and_off_a_bin_reads_its_frequency_and_amplitude() {
    // 750 frames: bins of the record are 6.667 Hz apart; 200 Hz is the 30th, the others lie between bins
    for tone_hz in [200.0, 203.3, 201.7, 78.4, 900.0] {
        let found = only(&spectrum(&record(750, |t| 3e-6 * (TAU * tone_hz * t + 0.7).sin())));
        assert!((found.frequency_hz - tone_hz).abs() < 0.03, "{tone_hz}: {}", found.frequency_hz);
        assert!((found.amplitude_m / 3e-6 - 1.0).abs() < 0.01, "{tone_hz}: {}", found.amplitude_m);
        assert_eq!(found.verdict, ComponentVerdict::Clear);
        assert_eq!(found.damping_ratio, None);
    }
}

#[test]
fn two_tones_on_the_flip_of_a_blade_are_both_found() {
    let samples =
        record(750, |t| flip(t) + 20e-6 * (TAU * 78.4 * t).sin() + 8e-6 * (TAU * 900.0 * t + 1.0).cos());
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
        let found = analyse_spectrum(
            &samples,
            RATE_HZ,
            &SpectrumSettings {
                detrend: Some(detrend),
                band_hz: Some((60.0, 100.0)),
                ..SpectrumSettings::default()
            },
        )
        .unwrap();
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

/// Drops runs of 2 to 30 frames until four in ten are missing, by a fixed generator.
fn dropped_in_runs(samples: &[Option<f64>], seed: u64) -> Vec<Option<f64>> {
    let mut state = seed.wrapping_mul(7919) + 17;
    let mut below = |n: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    let mut left = samples.to_vec();
    while 10 * left.iter().filter(|x| x.is_none()).count() < 4 * samples.len() {
        let (first, frames) = (below(samples.len()), 2 + below(29));
        left.iter_mut().skip(first).take(frames).for_each(|x| *x = None);
    }
    left
}

fn flip(t: f64) -> f64 {
    2e-3 - 0.04 * t + 0.5 * t * t - 1.7 * t * t * t
}

const TONES: [(f64, f64); 2] = [(78.4, 20e-6), (900.0, 8e-6)];

/// What fifty gappy records of one kind show of each tone.
struct Scatter {
    missing: f64,
    rms_hz: [f64; 2],
    worst_hz: [f64; 2],
    /// Mean of the stated standard deviations.
    stated_hz: [f64; 2],
    worst_amplitude: [f64; 2],
    listed: usize,
}

const RECORDS: u64 = 50;

/// `record` by phase, thinned by `drop` with its seed; both tones must be found in every record, amplitudes
/// are held against `amplitude_m`.
fn scatter(
    record: impl Fn(u64) -> Vec<Option<f64>>,
    drop: impl Fn(&[Option<f64>], u64) -> Vec<Option<f64>>,
    amplitude_m: [f64; 2],
) -> Scatter {
    let mut s = Scatter {
        missing: 0.0,
        rms_hz: [0.0; 2],
        worst_hz: [0.0; 2],
        stated_hz: [0.0; 2],
        worst_amplitude: [0.0; 2],
        listed: 0,
    };
    for seed in 0..RECORDS {
        let gappy = drop(&record(seed), seed + 1);
        s.missing +=
            gappy.iter().filter(|x| x.is_none()).count() as f64 / gappy.len() as f64 / RECORDS as f64;
        let found = spectrum(&gappy);
        s.listed += resolvable(&found).len();
        for (k, (tone_hz, _)) in TONES.into_iter().enumerate() {
            let c = found.component_in_band(tone_hz - 30.0, tone_hz + 30.0).unwrap();
            let error_hz = (c.frequency_hz - tone_hz).abs();
            s.rms_hz[k] += error_hz.powi(2) / RECORDS as f64;
            s.worst_hz[k] = s.worst_hz[k].max(error_hz);
            s.stated_hz[k] += c.frequency_sd_hz / RECORDS as f64;
            s.worst_amplitude[k] = s.worst_amplitude[k].max((c.amplitude_m / amplitude_m[k] - 1.0).abs());
        }
    }
    s.rms_hz = s.rms_hz.map(f64::sqrt);
    s
}

fn at_random(samples: &[Option<f64>], seed: u64) -> Vec<Option<f64>> {
    dropped(samples, -0.25, seed) // four in ten normal numbers are below -0.25
}

fn tones(seed: u64, noise_m: f64) -> Vec<Option<f64>> {
    let (phase, mut draw) = (seed as f64, noise(seed + 1000));
    let wave = |t: f64| {
        flip(t) + 20e-6 * (TAU * 78.4 * t + phase).sin() + 8e-6 * (TAU * 900.0 * t + 2.0 * phase).sin()
    };
    record(750, wave).into_iter().map(|x| x.map(|x| x + noise_m * draw())).collect()
}

/// 20 dB for the fast tone: `A^2 / 2 sigma^2 = 100`.
const NOISE_M: f64 = 8e-6 / 14.142_135_623_730_951;

#[test]
fn two_fifths_of_the_frames_missing_at_random_move_nothing_and_add_nothing() {
    let s = scatter(|seed| tones(seed, 0.0), at_random, TONES.map(|t| t.1));
    assert!((0.38..0.42).contains(&s.missing), "{}", s.missing);
    assert_eq!(s.listed, 2 * RECORDS as usize, "what the bridge puts between the tones is no component");
    assert!(s.worst_hz.iter().all(|worst| *worst < 1e-4), "{:?}", s.worst_hz);
    assert!(s.worst_amplitude.iter().all(|worst| *worst < 1e-4), "{:?}", s.worst_amplitude);
}

#[test]
fn two_fifths_missing_in_runs_of_up_to_thirty_frames_move_nothing() {
    let s = scatter(|seed| tones(seed, 0.0), dropped_in_runs, TONES.map(|t| t.1));
    assert!((0.40..0.44).contains(&s.missing), "{}", s.missing);
    assert!(s.worst_hz.iter().all(|worst| *worst < 1e-4), "{:?}", s.worst_hz);
    assert!(s.worst_amplitude.iter().all(|worst| *worst < 1e-4), "{:?}", s.worst_amplitude);
}

#[test]
fn with_noise_the_frames_that_are_left_give_what_they_can() {
    // bound of one tone for the frames present: 450 of 750 at 20 dB, 0.017 Hz; of the slow tone, 20
    // log10(20/8) = 8 dB better
    let bound_hz = RATE_HZ / TAU * (12.0 / (100.0 * 450.0 * (750.0_f64.powi(2) - 1.0))).sqrt();
    for drop in [at_random, dropped_in_runs] {
        let s = scatter(|seed| tones(seed, NOISE_M), drop, TONES.map(|t| t.1));
        assert!(
            s.rms_hz[1] < 1.5 * bound_hz && s.rms_hz[1] > 0.7 * bound_hz,
            "{:?} with a bound of {bound_hz}",
            s.rms_hz
        );
        assert!(s.rms_hz[0] < 1.5 * bound_hz * 0.4, "{:?}", s.rms_hz);
        assert!(s.worst_hz[1] < 0.1, "{:?}", s.worst_hz);
        assert!(s.worst_amplitude.iter().all(|worst| *worst < 0.03), "{:?}", s.worst_amplitude);
        // what a removed trend may leave, 0.033 Hz, is part of the stated deviation
        let stated_hz = (s.stated_hz[1].powi(2) - (0.005 * RATE_HZ / 750.0_f64).powi(2)).sqrt();
        assert!((0.7..1.4).contains(&(s.rms_hz[1] / stated_hz)), "{} and stated {stated_hz}", s.rms_hz[1]);
    }
}

#[test]
fn a_cycle_that_decays_is_no_worse_than_with_bridged_gaps_alone() {
    let ring_down = |seed: u64| {
        let (phase, mut draw) = (seed as f64, noise(seed + 1000));
        let decay = |t: f64| 100e-6 * (-0.05 * TAU * 78.4 * t).exp() * (TAU * 78.4 * t + phase).sin();
        let wave = |t: f64| flip(t) + decay(t) + 8e-6 * (TAU * 900.0 * t + 2.0 * phase).sin();
        record(750, wave).into_iter().map(|x| x.map(|x| x + 0.3e-6 * draw())).collect::<Vec<_>>()
    };
    let whole = spectrum(&ring_down(0)).component_in_band(60.0, 100.0).unwrap().amplitude_m;
    let s = scatter(ring_down, at_random, [whole, 8e-6]);
    // bridged alone: 0.11 and 0.13 Hz
    assert!(s.rms_hz[0] < 0.09 && s.rms_hz[1] < 0.08, "{:?}", s.rms_hz);
    assert!(s.worst_amplitude.iter().all(|worst| *worst < 0.08), "{:?}", s.worst_amplitude);
}

#[test]
fn a_cycle_that_drifts_is_no_worse_than_with_bridged_gaps_alone() {
    let chirp = |seed: u64| {
        let (phase, mut draw) = (seed as f64, noise(seed + 1000));
        let wave = |t: f64| {
            flip(t)
                + 20e-6 * (TAU * 78.4 * t + phase).sin()
                + 8e-6 * (TAU * (870.0 + 200.0 * t) * t + 2.0 * phase).sin()
        };
        record(750, wave).into_iter().map(|x| x.map(|x| x + 0.3e-6 * draw())).collect::<Vec<_>>()
    };
    let whole = spectrum(&chirp(0)).component_in_band(870.0, 930.0).unwrap().amplitude_m;
    let s = scatter(chirp, at_random, [20e-6, whole]);
    // bridged alone: 0.10 and 1.7 Hz; a lobe that is 60 Hz wide has no sharper top
    assert!(s.rms_hz[0] < 0.08 && s.rms_hz[1] < 1.8, "{:?}", s.rms_hz);
}

#[test]
fn closing_up_the_gaps_moves_a_peak_by_tens_of_hertz() {
    let mut moved_hz: Vec<f64> = Vec::new();
    for seed in 0..10 {
        let gappy = at_random(&record(750, |t| 8e-6 * (TAU * 900.0 * t).sin()), seed + 1);
        let kept = spectrum(&gappy).component_in_band(870.0, 930.0).unwrap().frequency_hz;
        assert!((kept - 900.0).abs() < 1e-3, "{kept}");
        let closed: Vec<_> = gappy.into_iter().filter(Option::is_some).collect();
        let found = analyse_spectrum(&closed, RATE_HZ, &SpectrumSettings::default()).unwrap();
        moved_hz.push(found.components.first().map_or(f64::INFINITY, |c| (c.frequency_hz - 900.0).abs()));
    }
    assert!(moved_hz.iter().all(|moved| *moved > 20.0), "{moved_hz:?}");
}

#[test]
fn the_stated_deviation_is_that_of_repeated_noisy_records() {
    let mut draw = noise(3);
    let (mut square, mut stated, runs) = (0.0, 0.0, 200);
    for _ in 0..runs {
        // 900 Hz at a signal-to-noise ratio of 20 dB a sample (A^2 / 2 sigma^2 = 100)
        let samples: Vec<_> = record(750, |t| 10e-6 * (TAU * 900.0 * t).sin())
            .into_iter()
            .map(|x| x.map(|x| x + 10e-6 / 200.0_f64.sqrt() * draw()))
            .collect();
        let c = spectrum(&samples).component_in_band(850.0, 950.0).cloned().unwrap();
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
    // white noise of deviation s has the rms 2 s sqrt(sum w^2) / sum w = s sqrt(6 / n) in a bin of a Hann
    // window
    assert!(
        (found.noise_floor_m / (2e-6 * (6.0_f64 / 4000.0).sqrt()) - 1.0).abs() < 0.1,
        "{}",
        found.noise_floor_m
    );
    assert!((found.noise_bandwidth_hz / found.resolution_hz - 1.5).abs() < 1e-9);
    let tone = spectrum(&record(750, |t| 3e-6 * (TAU * 200.0 * t).sin()));
    assert!((tone.rms_in_band_m(150.0, 250.0) / (3e-6 / 2.0_f64.sqrt()) - 1.0).abs() < 1e-3);
}

#[test]
fn noise_alone_has_no_component_in_nearly_every_spectrum() {
    let mut draw = noise(9);
    let with = (0..100)
        .filter(|_| !spectrum(&(0..750).map(|_| Some(draw())).collect::<Vec<_>>()).components.is_empty())
        .count();
    assert!(with <= 5, "{with} of 100 spectra of noise show a component");
}

#[test]
fn fewer_than_three_cycles_are_not_resolvable() {
    let samples = record(750, |t| 1e-5 * (TAU * 17.0 * t).sin());
    let found = analyse_spectrum(
        &samples,
        RATE_HZ,
        &SpectrumSettings { detrend: Some(Detrend::Mean), ..SpectrumSettings::default() },
    )
    .unwrap();
    assert_eq!(found.components[0].verdict, ComponentVerdict::NotResolvable);
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
fn a_long_record_reads_its_tone_no_worse_for_its_wider_bins() {
    let (frames, tone_hz) = (270_000, 900.004_3);
    let found = spectrum(&record(frames, |t| 3e-6 * (TAU * tone_hz * t + 0.7).sin()));
    assert_eq!(
        found.frequency_hz.len(),
        (1 << 20) + 1,
        "padded to 2^21 samples, where eight times the record would be 2^22"
    );
    let c = only(&found);
    assert!((c.frequency_hz - tone_hz).abs() < 1e-5 * found.resolution_hz, "{}", c.frequency_hz);
    assert!((c.amplitude_m / 3e-6 - 1.0).abs() < 1e-5, "{}", c.amplitude_m);
}

#[test]
fn records_without_a_spectrum_are_refused() {
    let refuse =
        |samples: &[Option<f64>], rate, settings| analyse_spectrum(samples, rate, &settings).unwrap_err();
    let default = SpectrumSettings::default();
    assert_eq!(refuse(&[None; 100], RATE_HZ, default), SpectrumError::TooFew { found: 0, least: 8 });
    assert_eq!(refuse(&[Some(1.0); 7], RATE_HZ, default), SpectrumError::TooFew { found: 7, least: 8 });
    assert_eq!(refuse(&[Some(1.0); 8], 0.0, default), SpectrumError::FrameRate { found: 0.0 });
    let spoiled: Vec<_> = (0..20).map(|i| Some(if i == 4 { f64::INFINITY } else { 0.0 })).collect();
    assert_eq!(
        refuse(&spoiled, RATE_HZ, default),
        SpectrumError::NotFinite { frame: 4, found: f64::INFINITY }
    );
    for band in [(100.0, 100.0), (2500.0, 2600.0), (-1.0, 5.0), (f64::NAN, 5.0)] {
        assert!(matches!(
            refuse(&[Some(1.0); 100], RATE_HZ, SpectrumSettings { band_hz: Some(band), ..default }),
            SpectrumError::Band { .. }
        ));
    }
}

#[test]
fn the_same_record_gives_the_same_spectrum_to_the_bit() {
    let samples = with_gaps(&record(750, |t| (TAU * 78.4 * t).sin()));
    assert_eq!(spectrum(&samples), spectrum(&samples));
}
