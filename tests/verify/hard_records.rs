//! Records on which a reading of spectra fails, and the exact answers of what begins inside a record. The
//! records are those of the study `crates/short-spectra/examples/spectra`.

use crate::counts::Counts;
use crate::hard::KINDS;
use crate::thorough::pick;
use short_spectra::{Component, ComponentVerdict, SampledRecord, SpectralAnalysis, SpectrumSettings};
use std::f64::consts::TAU;

const RATE_HZ: f64 = 5000.0;
/// Seeds of a kind in the tests of every change and in the thorough ones; long records take a few.
const SEEDS: (u64, u64) = (2, 25);
const LONG_SEEDS: (u64, u64) = (1, 3);

fn analysed(frames: usize, value: impl Fn(f64) -> f64) -> SpectralAnalysis {
    let samples: Vec<Option<f64>> = (0..frames).map(|i| Some(value(i as f64 / RATE_HZ))).collect();
    let record = SampledRecord { samples: &samples, frame_rate_hz: RATE_HZ, exposure_s: None };
    SpectralAnalysis::from_record(&record, &SpectrumSettings::default()).unwrap()
}

fn components(frames: usize, value: impl Fn(f64) -> f64) -> Vec<Component> {
    analysed(frames, value).spectrum.components
}

/// Even noise of a deviation, m.
fn noise(deviation_m: f64) -> impl FnMut() -> f64 {
    let mut seed = 11_u64;
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        deviation_m * 12.0_f64.sqrt() * ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
    }
}

#[test]
fn nothing_sought_is_missed_and_nothing_is_wrongly_clear() {
    // a camera that shakes moves as slowly as a trend does, and a piece of a long window may begin in a flip
    let undecidable = |name: &str| match name {
        "a camera that shakes" => pick(0, 3),
        "78.4 Hz, 3 %, after each of two flips, 20,000 frames" => 1,
        _ => 0,
    };
    // no polynomial follows the amplitude of a brief burst, but no piece of it may be clear
    let is_brief =
        |name: &str| name.starts_with("a burst in a third") || name.starts_with("a burst in a sixth");
    for kind in KINDS {
        let (every_change, thorough) = if kind.group == "long" { LONG_SEEDS } else { SEEDS };
        let counts = Counts::of(kind, pick(every_change, thorough));
        assert!(counts.missed == 0 || is_brief(kind.name), "{}: {} missed", kind.name, counts.missed);
        let wrong = undecidable(kind.name);
        assert!(counts.wrong <= wrong, "{}: {} records with what is none", kind.name, counts.wrong);
    }
}

/// Records of the mixtures in which ring-downs overlap, begin late and are large, or lie on a smooth step.
/// Such ring-downs are hard to separate.
const MIXED: [(&str, &[u64]); 2] = [
    ("one of any kind, on any flip, 30 dB", &[72, 177]),
    ("up to three of any kind, on any flip, 30 dB", &[29, 69, 170, 178, 284, 334, 386]),
];

#[test]
fn ring_downs_in_a_mixture_are_told_apart_and_known_to_their_deviations() {
    for (name, seeds) in MIXED {
        let kind = KINDS.iter().find(|kind| kind.name == name).unwrap();
        for seed in seeds {
            let made = kind.made(*seed);
            let record =
                SampledRecord { samples: &made.samples, frame_rate_hz: made.rate_hz, exposure_s: None };
            let analysis = SpectralAnalysis::from_record(&record, &SpectrumSettings::default()).unwrap();
            let list = &analysis.spectrum.components;
            let off = |c: &Component, hz: f64| (c.frequency_hz - hz).abs() / c.frequency_sd_hz;
            let nearest = |hz: f64| list.iter().min_by(|a, b| off(a, hz).total_cmp(&off(b, hz))).unwrap();
            for truth in &made.truths {
                let found = nearest(truth.hz);
                assert!(off(found, truth.hz) < 4.0, "{name}, {seed}: {} Hz: {found:?}", truth.hz);
                let bound_hz = truth.bound_hz(made.samples.len(), made.rate_hz, made.noise_m);
                assert!(found.frequency_sd_hz < 20.0 * bound_hz, "{name}, {seed}: {bound_hz} Hz: {found:?}");
            }
            // each oscillation has a component of its own; one more may be listed, in doubt
            let is_true = |c: &Component| made.truths.iter().any(|truth| nearest(truth.hz) == c);
            let others: Vec<&Component> = list.iter().filter(|c| !is_true(c)).collect();
            assert_eq!(list.len() - others.len(), made.truths.len(), "{name}, {seed}: {list:?}");
            let in_doubt = others.iter().all(|c| c.verdict != ComponentVerdict::Clear);
            assert!(others.len() < 2 && in_doubt, "{name}, {seed}: {others:?}");
        }
    }
}

#[test]
fn a_ring_down_that_begins_inside_is_exact_in_all_but_no_noise() {
    for (hz, decay_per_s, first) in [(412.3, 90.0, 300), (904.7, 400.0, 0), (250.1, 25.0, 511)] {
        let begins_s = f64::from(first) / RATE_HZ;
        let mut draw = noise(1e-12);
        let noise_m: Vec<f64> = (0..750).map(|_| draw()).collect();
        let at = |t: f64| {
            let ringing =
                1e-5 * (-decay_per_s * (t - begins_s)).exp() * (TAU * hz * (t - begins_s) + 0.4).cos();
            noise_m[(t * RATE_HZ).round() as usize] + if t < begins_s { 0.0 } else { ringing }
        };
        let list = components(750, at);
        assert_eq!(list.len(), 1, "{hz} Hz: {list:?}");
        let c = &list[0];
        assert!((c.frequency_hz - hz).abs() < 1e-4, "{hz} Hz: {c:?}");
        assert_eq!(c.begins_s, (first > 0).then_some(begins_s), "{hz} Hz");
        let omega = TAU * hz;
        let ratio = decay_per_s / omega.hypot(decay_per_s);
        assert!((c.damping_ratio.unwrap() / ratio - 1.0).abs() < 1e-5, "{ratio}: {c:?}");
        // the amplitude is that half a frame before the first
        let amplitude_m = 1e-5 * (0.5 * decay_per_s / RATE_HZ).exp();
        assert!((c.amplitude_m / amplitude_m - 1.0).abs() < 1e-4, "{amplitude_m:e}: {c:?}");
    }
}

#[test]
fn its_oscillation_is_what_was_put_in_and_nothing_before_it_begins() {
    let mut draw = noise(1e-9);
    let noise_m: Vec<f64> = (0..750).map(|_| draw()).collect();
    let ringing =
        |t: f64| if t < 0.06 { 0.0 } else { 1e-5 * (-90.0 * (t - 0.06)).exp() * (TAU * 412.3 * t).cos() };
    let analysis = analysed(750, |t| ringing(t) + noise_m[(t * RATE_HZ).round() as usize]);
    let [oscillation] = &analysis.oscillations[..] else { panic!("{:?}", analysis.oscillations) };
    assert!((oscillation.begins_s() - 0.06).abs() < 1e-12);
    for i in 0..750 {
        let t = f64::from(i) / RATE_HZ;
        assert!((oscillation.displacement_m(t) - ringing(t)).abs() < 2e-9, "{t} s");
    }
}

#[test]
fn a_pair_and_its_amplitudes_are_exact_in_all_but_no_noise() {
    let resolution_hz = RATE_HZ / 750.0;
    for apart in [0.7, 1.0] {
        let high_hz = 605.0 + apart * resolution_hz;
        let mut draw = noise(1e-8);
        let noise_m: Vec<f64> = (0..750).map(|_| draw()).collect();
        let list = components(750, |t| {
            noise_m[(t * RATE_HZ).round() as usize]
                + 1e-5 * (TAU * 605.0 * t).cos()
                + 6e-6 * (TAU * high_hz * t + 1.0).cos()
        });
        assert_eq!(list.len(), 2, "{apart}: {list:?}");
        let off_hz = [list[0].frequency_hz - 605.0, list[1].frequency_hz - high_hz];
        assert!(off_hz.iter().all(|off| off.abs() < 0.01), "{apart}: {off_hz:?}");
        assert!((list[0].amplitude_m / 1e-5 - 1.0).abs() < 0.01, "{apart}: {list:?}");
    }
}

/// Steady oscillations of these frequencies and amplitudes, um, in 0.1 um of noise.
fn tones(tones: &[(f64, f64)]) -> Vec<Component> {
    let mut draw = noise(1e-7);
    let noise_m: Vec<f64> = (0..1500).map(|_| draw()).collect();
    components(1500, |t| {
        let sum: f64 =
            tones.iter().enumerate().map(|(k, (hz, um))| um * (TAU * hz * t + 1.3 * k as f64).cos()).sum();
        1e-6 * sum + noise_m[(t * RATE_HZ).round() as usize]
    })
}

fn near(list: &[Component], hz: f64) -> &Component {
    list.iter().find(|c| (c.frequency_hz - hz).abs() < 1.0).unwrap_or_else(|| panic!("{hz} Hz: {list:?}"))
}

#[test]
fn each_relation_is_named_with_its_numbers() {
    let list = tones(&[(131.3, 10.0), (262.6, 5.0), (787.8, 3.0), (1444.3, 2.0)]);
    let multiples = [(262.6, 2), (787.8, 6), (1444.3, 11)];
    for (hz, multiple) in multiples {
        let of = near(&list, hz).harmonic_of.unwrap();
        assert_eq!((of.multiple, near(&list, hz).verdict), (multiple, ComponentVerdict::Harmonic));
        assert!((of.frequency_hz - 131.3).abs() < 0.1, "of the lowest, not of another multiple: {of:?}");
    }
    let list = tones(&[(302.0, 10.0), (151.0, 2.0), (402.666_667, 1.5), (1057.0, 3.0)]);
    for (hz, numerator, denominator) in [(151.0, 1, 2), (402.67, 4, 3), (1057.0, 7, 2)] {
        let c = near(&list, hz);
        let of = c.subharmonic_of.unwrap();
        assert_eq!(
            (of.numerator, of.denominator, c.verdict),
            (numerator, denominator, ComponentVerdict::Subharmonic)
        );
        assert!(c.reasons[0].words.contains("beat differs or is missing"), "{:?}", c.reasons);
    }
    // with the modulation in the list, and without
    let list = tones(&[(902.0, 10.0), (78.0, 6.0), (824.0, 2.0), (980.0, 2.0), (1058.0, 1.0)]);
    assert_eq!(near(&list, 78.0).verdict, ComponentVerdict::Clear);
    assert!(
        [824.0, 980.0, 1058.0].iter().all(|hz| near(&list, *hz).verdict == ComponentVerdict::Sideband),
        "{list:?}"
    );
    let list = tones(&[(902.0, 10.0), (831.0, 2.0), (973.0, 2.0)]);
    let of = near(&list, 831.0).sideband_of.unwrap();
    assert!((of.frequency_hz - 902.0).abs() < 0.1 && (of.modulation_hz - 71.0).abs() < 0.1, "{of:?}");
    // what is none
    let list = tones(&[(902.3, 10.0), (78.4, 6.0), (655.5, 3.0)]);
    assert!(list.iter().all(|c| c.verdict == ComponentVerdict::Clear), "{list:?}");
}

#[test]
fn a_lamp_on_the_mains_is_named_and_what_decays_there_is_none() {
    let list = tones(&[(100.0, 5.0), (360.0, 3.0), (437.0, 2.0)]);
    let mains = |hz| near(&list, hz).mains.map(|mains| (mains.frequency_hz, mains.multiple));
    assert_eq!((mains(100.0), mains(360.0), mains(437.0)), (Some((50, 2)), Some((60, 6)), None));
    assert_eq!(near(&list, 100.0).verdict, ComponentVerdict::Mains);
    let mut draw = noise(1e-8);
    let noise_m: Vec<f64> = (0..750).map(|_| draw()).collect();
    let ringing = |t: f64| 1e-5 * (-15.0 * t).exp() * (TAU * 100.0 * t).cos();
    let list = components(750, |t| ringing(t) + noise_m[(t * RATE_HZ).round() as usize]);
    assert_eq!((list.len(), list[0].mains), (1, None), "{list:?}");
}

#[test]
fn the_cycles_of_a_drift_are_counted() {
    for (low_hz, high_hz) in [(359.0, 692.0), (900.0, 820.0)] {
        let mut draw = noise(1e-7);
        let noise_m: Vec<f64> = (0..1000).map(|_| draw()).collect();
        let cycles = |t: f64| (low_hz + (high_hz - low_hz) * t / 0.2 / 2.0) * t;
        let list =
            components(1000, |t| 1e-5 * (TAU * cycles(t)).cos() + noise_m[(t * RATE_HZ).round() as usize]);
        let [c] = &list[..] else { panic!("{list:?}") };
        let last_s = 999.0 / RATE_HZ;
        let mean_hz = cycles(last_s) / last_s;
        let off_hz = c.frequency_hz - mean_hz;
        assert!(c.range_hz.is_some() && c.verdict == ComponentVerdict::Clear, "{c:?}");
        assert!(off_hz.abs() < 2.0 * c.frequency_sd_hz && off_hz.abs() < 0.5, "{mean_hz}: {c:?}");
    }
}
