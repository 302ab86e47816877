//! Derivatives of all parts, and records whose parts are known.

use super::atom::{Atom, FramePlaces, OscillationAtom, StepShape};
use super::{Decomposition, DecompositionSettings};
use crate::record::SampledRecord;
use crate::time_frequency::{Spectrogram, SpectrogramSettings, course};
use crate::trend::Trend;
use crate::{ComponentVerdict, SpectrumSettings};
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 5000.0;
const FRAMES: usize = 750;

fn atoms() -> Vec<Atom> {
    let ring = OscillationAtom { nepers: Some(7.0), onset: 0.2, ..OscillationAtom::steady(31.3) };
    let cycle = OscillationAtom {
        phase: vec![3.1, -0.4],
        envelope: vec![0.3, -0.2, 0.1],
        multiples: vec![2, 5],
        ..OscillationAtom::steady(40.7)
    };
    let steps = StepShape::ALL.map(|shape| Atom::Step { shape, centre: 0.43, width: 0.06 });
    let relaxations = [0.0, 0.3].map(|onset| Atom::Relaxation { onset, nepers: 9.0 });
    [Atom::Oscillation(ring), Atom::Oscillation(cycle)].into_iter().chain(steps).chain(relaxations).collect()
}

#[test]
fn derivatives_of_all_parts_are_those_of_their_values() {
    const STEP: f64 = 1e-6;
    let at = FramePlaces { places: (0..200).map(|i| (f64::from(i) + 0.5) / 200.0).collect(), frames: 200 };
    for atom in atoms() {
        let columns = atom.columns(&at);
        let amplitudes: Vec<f64> = (0..columns.len()).map(|k| 1.0 - 0.3 * k as f64).collect();
        let value = |atom: &Atom| -> Vec<f64> {
            let columns = atom.columns(&at);
            (0..200).map(|i| columns.iter().zip(&amplitudes).map(|(c, a)| a * c[i]).sum()).collect()
        };
        let derivatives = atom.derivatives(&at, &columns, &amplitudes);
        let parameters = atom.parameters();
        assert_eq!(derivatives.len(), parameters.len());
        for (k, derivative) in derivatives.iter().enumerate() {
            let moved = |by: f64| {
                let mut values = parameters.clone();
                values[k] += by;
                value(&atom.with_parameters(&values))
            };
            let largest = derivative.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            for ((ahead, behind), exact) in moved(STEP).iter().zip(moved(-STEP)).zip(derivative) {
                let error = ((ahead - behind) / (2.0 * STEP) - exact).abs();
                assert!(error < 1e-4 * largest, "{atom:?} parameter {k}: {error:e} of {largest:e}");
            }
        }
    }
}

/// Explanation of a record of `value`, m, over time, s, in white noise of a standard deviation, m, and its
/// samples.
fn taken_apart(value: impl Fn(f64) -> f64, noise: f64, seed: u64) -> (Decomposition, Vec<Option<f64>>) {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut draw = || noise * generator.sample::<f64, _>(StandardNormal);
    let samples: Vec<Option<f64>> = (0..FRAMES).map(|i| Some(value(i as f64 / RATE_HZ) + draw())).collect();
    let settings = DecompositionSettings::new(FRAMES, Trend::Polynomial(4), &SpectrumSettings::default());
    let found = Decomposition::from_record(&record(&samples), settings).unwrap();
    (found, samples)
}

fn record(samples: &[Option<f64>]) -> SampledRecord<'_> {
    SampledRecord { samples, frame_rate_hz: RATE_HZ, exposure_s: None }
}

/// Frequencies of the components with their standard deviations, Hz, in rising order.
fn listed(found: &Decomposition, samples: &[Option<f64>]) -> Vec<(f64, f64)> {
    let components = found.components(&record(samples), &SpectrumSettings::default());
    let mut list: Vec<(f64, f64)> = components.iter().map(|c| (c.frequency_hz, c.frequency_sd_hz)).collect();
    portable_math::sort_by_number(&mut list, |a| a.0);
    list
}

/// Phase, cycles, at time `t`, s, of a frequency that changes at a constant rate from `from` to `to`, Hz:
/// from half a frame before the first frame to half a frame after the last one.
fn chirp(from: f64, to: f64, t: f64) -> f64 {
    let (t, duration) = (t + 0.5 / RATE_HZ, FRAMES as f64 / RATE_HZ);
    from * t + (to - from) * t * t / (2.0 * duration)
}

#[test]
fn parts_without_noise_are_found_exactly() {
    let value = |t: f64| {
        let ring = |since: f64| 2e-5 * (-60.0 * since).exp() * (TAU * 410.0 * since).sin();
        1e-3 * ((t - 0.07) / 0.004).tanh()
            + 1e-5 * (TAU * chirp(700.0, 1100.0, t)).cos()
            + if t >= 0.08 { ring(t - 0.08) } else { 0.0 }
    };
    let (found, samples) = taken_apart(value, 1e-10, 1);
    let list = listed(&found, &samples);
    assert_eq!(list.len(), 2, "{list:?}");
    assert!((list[0].0 - 410.0).abs() < 1e-3 && (list[1].0 - 900.0).abs() < 1e-3, "{list:?}");
    let left = found.explanation.squares.sqrt() * found.scale_m;
    assert!(left < 1e-8, "{left:e} m left in all frames together");
}

#[test]
fn two_cycles_that_cross_are_two_and_a_line_between_them_is_a_third() {
    for seed in 0..4 {
        let value = |t: f64| {
            let phases = [chirp(300.0, 700.0, t), chirp(620.0, 380.0, t) + 0.2, 480.0 * t + 0.7];
            phases.iter().map(|p| 1e-5 * (TAU * p).cos()).sum()
        };
        let (found, samples) = taken_apart(value, 7e-7, seed);
        let list = listed(&found, &samples);
        assert_eq!(list.len(), 3, "seed {seed}: {list:?}");
        for ((hz, sd_hz), exact) in list.iter().zip([480.0, 500.0, 500.0]) {
            // the instants of cycles alone give a mean over 0.15 s a deviation of 0.47 Hz
            assert!((hz - exact).abs() < 4.0 * sd_hz && *sd_hz < 0.6, "seed {seed}: {list:?}");
        }
    }
}

#[test]
fn mistracked_frames_are_left_out_and_both_tones_are_clear() {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(3);
    let (_, mut samples) =
        taken_apart(|t| 1e-5 * ((TAU * 84.7 * t).cos() + (TAU * 865.6 * t).cos()), 7e-7, 4);
    for i in (5..FRAMES).step_by(93) {
        *samples[i].as_mut().unwrap() += 3e-4 * (generator.random::<f64>() + 0.5);
    }
    let settings = DecompositionSettings::new(FRAMES, Trend::Polynomial(4), &SpectrumSettings::default());
    let found = Decomposition::from_record(&record(&samples), settings).unwrap();
    // nine frames are mistracked; at most three good ones are left out with them
    assert!((FRAMES - 12..=FRAMES - 9).contains(&found.problem.len()), "{}", found.problem.len());
    let components = found.components(&record(&samples), &SpectrumSettings::default());
    assert_eq!(components.len(), 2, "{components:?}");
    assert!(components.iter().all(|c| c.verdict == ComponentVerdict::Clear), "{components:?}");
}

#[test]
fn a_record_without_variation_has_no_parts() {
    let samples = vec![Some(3.0); 100];
    let settings = DecompositionSettings::new(100, Trend::Polynomial(4), &SpectrumSettings::default());
    assert!(Decomposition::from_record(&record(&samples), settings).is_none());
}

/// Gaps between the frames are short, long and at the start.
#[test]
fn columns_are_those_of_their_formula_also_around_gaps() {
    let used = (3..900).filter(|i| i % 7 != 2 && !(300..420).contains(i));
    let at = FramePlaces { places: used.map(|i| (f64::from(i) + 0.5) / 900.0).collect(), frames: 900 };
    let ring = OscillationAtom { nepers: Some(7.0), onset: 0.2, ..OscillationAtom::steady(131.3) };
    let cycle = OscillationAtom { multiples: vec![2, 5], ..OscillationAtom::steady(40.7) };
    for o in [ring, cycle] {
        let columns = Atom::Oscillation(o.clone()).columns(&at);
        for (i, s) in at.places.iter().enumerate() {
            let decay = if *s < o.onset { 0.0 } else { (-o.nepers.unwrap_or(0.0) * (s - o.onset)).exp() };
            for (k, multiple) in std::iter::once(&1).chain(&o.multiples).enumerate() {
                let turn = TAU * *multiple as f64 * o.phase_at(*s);
                let exact = [decay * turn.cos(), decay * turn.sin()];
                for (column, exact) in columns[2 * k..].iter().zip(exact) {
                    assert!((column[i] - exact).abs() < 1e-12, "{o:?} at {s}");
                }
            }
        }
    }
}

/// The frequency is `780 + 90 sin(2 pi 3.7 t)` Hz, and the record also has a steady line.
#[test]
fn a_frequency_that_no_polynomial_follows_is_one_component_along_its_ridge() {
    let frames = 2000;
    let swing = |t: f64| 780.0 * t - 90.0 / (TAU * 3.7) * ((TAU * 3.7 * t).cos() - 1.0);
    let mean_hz = swing(0.4) / 0.4;
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut draw = || 4e-7 * generator.sample::<f64, _>(StandardNormal);
    let value = |t: f64| 3e-5 * (TAU * swing(t)).cos() + 4e-6 * (TAU * 1510.0 * t).cos();
    let samples: Vec<Option<f64>> =
        (0..frames).map(|i| Some(value(f64::from(i) / RATE_HZ) + draw())).collect();
    let found = crate::SpectralAnalysis::from_record(&record(&samples), &SpectrumSettings::default());
    let found = found.unwrap().spectrum.components;
    let cycle = found.iter().find(|c| c.range_hz.is_some()).unwrap();
    let range = cycle.range_hz.unwrap();
    assert_eq!(
        (cycle.estimator, cycle.verdict),
        (crate::Estimator::Ridge, ComponentVerdict::Clear),
        "{cycle:?}"
    );
    assert!((cycle.frequency_hz - mean_hz).abs() < 4.0 * cycle.frequency_sd_hz, "{cycle:?}, {mean_hz}");
    assert!((range.low_hz - 690.0).abs() < 4.0 && (range.high_hz - 870.0).abs() < 4.0, "{range:?}");
    let line = found.iter().find(|c| (c.frequency_hz - 1510.0).abs() < 1.0).unwrap();
    assert!((line.frequency_hz - 1510.0).abs() < 4.0 * line.frequency_sd_hz, "{line:?}");
    assert_eq!(found.len(), 2, "{found:?}");
}

/// Whether the ridge in the band from 300 to 1,500 Hz has parts that follow one component, and whether these
/// exceed noise.
fn find_courses(samples: &[Option<f64>]) -> (bool, bool) {
    const BAND_HZ: (f64, f64) = (300.0, 1500.0);
    let settings = SpectrogramSettings { segment_s: Some(0.03), band_hz: Some(BAND_HZ), overlap: None };
    let spectrogram = Spectrogram::new(samples, RATE_HZ, &settings).unwrap();
    let ridge = spectrogram.find_ridge(samples, BAND_HZ).unwrap();
    let courses = course::coherent_parts(&ridge, &spectrogram);
    (!courses.is_empty(), super::exceeds_noise(samples, RATE_HZ, &ridge, &courses))
}

#[test]
fn a_ridge_of_a_drifting_oscillation_exceeds_noise_and_one_of_noise_does_not() {
    let record = |amplitude: f64, colour: f64, seed: u64| -> Vec<Option<f64>> {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut noise = 0.0;
        let mut value = |i: usize| {
            noise = colour * noise + generator.sample::<f64, _>(StandardNormal);
            amplitude * (TAU * chirp(500.0, 900.0, i as f64 / RATE_HZ)).cos() + noise
        };
        (0..FRAMES).map(|i| Some(value(i))).collect()
    };
    let mut courses_of_noise = 0;
    for seed in 0..100 {
        for colour in [0.0, 0.5, 0.9] {
            let (has_courses, exceeds) = find_courses(&record(0.0, colour, seed));
            assert!(!exceeds, "noise of colour {colour}, {seed}");
            courses_of_noise += usize::from(has_courses);
        }
    }
    assert!(courses_of_noise > 0);
    for (seed, colour) in (0..30).zip([0.0, 0.5].into_iter().cycle()) {
        assert!(find_courses(&record(1.5, colour, seed)).1, "drift in noise of colour {colour}, {seed}");
    }
}

#[test]
fn an_oscillation_between_frames_is_the_one_that_was_fitted_to_them() {
    let ring = |t: f64| 2e-5 * (-60.0 * t).exp() * (TAU * 90.0 * t).cos();
    // the frequency swings too often for a polynomial
    let phase = |t: f64| 900.0 * t + 2.5 * (TAU * 17.0 * t).sin() + 4.0 * (TAU * 5.0 * t).cos();
    let value = |t: f64| ring(t) + 1e-5 * (TAU * phase(t)).cos() + 3e-6 * (2.0 * TAU * phase(t)).sin();
    let (found, samples) = taken_apart(value, 2e-7, 1);
    let parts = found.record_parts();
    let has_course = found.explanation.parts.atoms.iter().any(|atom| atom.course().is_some());
    assert!(has_course, "{:?}", found.explanation.parts.atoms);
    for (i, sample) in samples.iter().enumerate().filter(|(i, _)| parts.is_used[*i]) {
        let fast_m: f64 = parts.oscillations.iter().map(|o| o.displacement_m(i as f64 / RATE_HZ)).sum();
        assert!((fast_m - parts.fast_m[i]).abs() < 1e-9, "frame {i}: {fast_m:e} {:e}", parts.fast_m[i]);
        assert!((sample.unwrap() - parts.slow_m[i] - fast_m).abs() < 5e-6, "frame {i}");
    }
}

/// A description with more than half as many parameters as frames follows the noise: its floor would be 0,
/// and a strong line would be lost.
#[test]
fn windows_of_a_few_dozen_frames_keep_their_line_and_their_noise() {
    const NOISE_M: f64 = 2e-6;
    for frames in [24, 30, 40, 60, 90] {
        let (mut found, mut floors) = (0, Vec::new());
        for seed in 0..20 {
            let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut draw = || NOISE_M * generator.sample::<f64, _>(StandardNormal);
            let value = |i: usize| 1.2e-5 * (TAU * 700.0 * i as f64 / RATE_HZ + seed as f64).sin();
            let samples: Vec<Option<f64>> = (0..frames).map(|i| Some(value(i) + draw())).collect();
            let spectrum =
                crate::SpectralAnalysis::from_record(&record(&samples), &SpectrumSettings::default());
            let spectrum = spectrum.unwrap().spectrum;
            let is_it = |c: &crate::Component| (c.frequency_hz - 700.0).abs() < 0.3 * RATE_HZ / frames as f64;
            found += usize::from(spectrum.components.iter().any(is_it));
            floors.push(spectrum.noise_floor_m);
        }
        floors.sort_by(f64::total_cmp);
        assert!(found >= 19, "{frames} frames: the line is found in {found} of 20 windows");
        assert!(floors[0] > 0.0, "{frames} frames: {floors:?}");
    }
}

/// An oscillation from 300 to 270 Hz that swells, fades and is over after 110 of 150 ms.
#[test]
fn a_fading_oscillation_has_no_frequency_where_it_is_over() {
    const OVER_S: f64 = 0.11;
    let value = |t: f64| {
        let size = if t < OVER_S { (TAU / 2.0 * t / OVER_S).sin().powi(2) } else { 0.0 };
        1e-5 * size * (TAU * (300.0 * t - 15.0 * t * t / OVER_S)).cos()
    };
    let (mut clear, mut ranges) = (0, 0);
    for seed in 0..10 {
        let (found, samples) = taken_apart(value, 3e-7, seed);
        let components = found.components(&record(&samples), &SpectrumSettings::default());
        let largest = &components[0];
        assert!((largest.frequency_hz - 285.0).abs() < 4.0 * largest.frequency_sd_hz, "{seed}: {largest:?}");
        if let Some(range) = largest.range_hz {
            // at a tenth of its amplitude the frequency is 294 and 276 Hz
            assert!((range.low_hz - 273.0).abs() < 15.0, "{seed}: {range:?}");
            assert!((range.high_hz - 297.0).abs() < 5.0, "{seed}: {range:?}");
            ranges += 1;
        }
        clear += usize::from(largest.verdict == ComponentVerdict::Clear);
    }
    assert!(clear >= 5 && ranges >= 9, "{clear} {ranges}");
}

/// A burst in two thirds of the record is listed. No polynomial follows one in a third of it, or a stronger
/// one with the shape of a bell: what is listed is in doubt, also if noise describes the record better.
#[test]
fn a_burst_is_listed_or_in_doubt_and_no_piece_of_it_is_clear() {
    let swell = |t: f64, lasts_s: f64| (TAU / 2.0 * ((t - 0.03) / lasts_s).clamp(0.0, 1.0)).sin().powi(2);
    let sizes: [(&dyn Fn(f64) -> f64, bool); 3] = [
        (&|t| 1e-5 * swell(t, 0.1), true),
        (&|t| 1e-5 * swell(t, 0.05), false),
        (&|t| 1e-4 * (-((t - 0.0625) / 0.02).powi(2)).exp(), true),
    ];
    let mut more_probable_without = 0;
    for seed in 0..8 {
        let hz = 325.0 + 60.0 * seed as f64;
        for (k, (size, is_listed)) in sizes.iter().enumerate() {
            let (found, samples) = taken_apart(|t| size(t) * (TAU * hz * t).cos(), 1e-7, seed);
            let components = found.components(&record(&samples), &SpectrumSettings::default());
            let is_it = |c: &crate::Component| (c.frequency_hz - hz).abs() < 2.0;
            assert!(!is_listed || components.iter().any(is_it), "{k}, {hz} Hz: {components:?}");
            let clear = components.iter().filter(|c| c.verdict == ComponentVerdict::Clear);
            let mut wrong = clear.filter(|c| (c.frequency_hz - hz).abs() > 4.0 * c.frequency_sd_hz);
            assert!(wrong.next().is_none(), "{k}, {hz} Hz: {components:?}");
            let words = components.iter().flat_map(|c| &c.reasons).map(|reason| &reason.words);
            more_probable_without += words.filter(|words| words.contains("more probable without it")).count();
        }
    }
    assert!(more_probable_without > 0);
}
