//! The course of a drifting component against records whose frequency is known at every instant.

use crate::noise::noise;
use short_spectra::SpectrumError;
use short_spectra::time_frequency::{
    FrequencyRange, MOST_COLUMNS, Ridge, Spectrogram, SpectrogramSettings, default_band_hz,
};
use std::f64::consts::TAU;

const BAND_HZ: (f64, f64) = (250.0, 1500.0);
const AMPLITUDE_M: f64 = 10e-6;
/// 20 dB: `A^2 / (2 sigma^2)` of 100.
const NOISE_20_DB_M: f64 = AMPLITUDE_M / 14.142_135_623_730_951;
const LOW_HZ: f64 = 359.0;
const HIGH_HZ: f64 = 692.0;

/// Frequency, Hz, over the share of the record that has passed.
type Law = fn(f64) -> f64;

const RISING: Law = |u| LOW_HZ + (HIGH_HZ - LOW_HZ) * u;
const FALLING: Law = |u| HIGH_HZ - (HIGH_HZ - LOW_HZ) * u;
const EXPONENTIAL: Law = |u| LOW_HZ * (HIGH_HZ / LOW_HZ).powf(u);
const SINUSOIDAL: Law = |u| (LOW_HZ + HIGH_HZ) / 2.0 + (HIGH_HZ - LOW_HZ) / 2.0 * (TAU * u).sin();
const STEADY: Law = |_| 525.0;

/// What a record is made of.
#[derive(Clone, Copy)]
struct Made {
    law: Law,
    duration_s: f64,
    rate_hz: f64,
    noise_m: f64,
    /// Second and third harmonic, 30 % and 15 %.
    harmonics: bool,
    /// A remainder of a ring-down at 78.4 Hz, as large as the component.
    ring_down: bool,
    /// A fifth of the frames missing.
    gaps: bool,
}

impl Made {
    fn of(law: Law, duration_s: f64, rate_hz: f64) -> Self {
        Self { law, duration_s, rate_hz, noise_m: 0.0, harmonics: false, ring_down: false, gaps: false }
    }

    fn noisy(self) -> Self {
        Self { noise_m: NOISE_20_DB_M, ..self }
    }

    fn frames(&self) -> usize {
        (self.duration_s * self.rate_hz).round() as usize
    }

    fn record(&self, seed: u64) -> Vec<Option<f64>> {
        const STEPS: u32 = 16;
        let (mut draw, mut phase) = (noise(7919 * seed + 13), seed as f64);
        let mut sample = |frame: usize| {
            let time_s = frame as f64 / self.rate_hz;
            let harmonics = if self.harmonics {
                0.3 * (2.0 * phase + 0.4).sin() + 0.15 * (3.0 * phase + 1.1).sin()
            } else {
                0.0
            };
            let ring_down = if self.ring_down {
                (TAU * 78.4 * time_s + 2.0 * seed as f64).cos() * (-0.03 * TAU * 78.4 * time_s).exp()
            } else {
                0.0
            };
            let value = AMPLITUDE_M * (phase.sin() + harmonics + ring_down) + self.noise_m * draw();
            for step in 0..STEPS {
                let now_s = time_s + (f64::from(step) + 0.5) / f64::from(STEPS) / self.rate_hz;
                phase += TAU * (self.law)(now_s / self.duration_s) / f64::from(STEPS) / self.rate_hz;
            }
            (!self.gaps || draw() > -0.84).then_some(value)
        };
        (0..self.frames()).map(&mut sample).collect()
    }

    fn ridge(&self, seed: u64) -> Ridge {
        let record = self.record(seed);
        spectrogram(&record, self.rate_hz).find_ridge(&record, BAND_HZ).unwrap()
    }

    /// Least and greatest frequency of the law within the record.
    fn range_hz(&self) -> (f64, f64) {
        let last = 1.0 - 1.0 / self.frames() as f64;
        let course = || (0..=1000).map(|i| (self.law)(f64::from(i) / 1000.0 * last));
        (course().fold(f64::INFINITY, f64::min), course().fold(0.0, f64::max))
    }

    /// Holds the range found against that of the law.
    fn assert_range(&self, seed: u64, share: f64) -> FrequencyRange {
        let ((low_hz, high_hz), found) = (self.range_hz(), self.ridge(seed).range_hz().unwrap());
        let said = format!(
            "{} s at {} Hz, seed {seed}: {low_hz}..{high_hz} and found {found:?}",
            self.duration_s, self.rate_hz
        );
        assert!(
            (found.low_hz / low_hz - 1.0).abs() < share && (found.high_hz / high_hz - 1.0).abs() < share,
            "{said}"
        );
        found
    }
}

fn spectrogram(record: &[Option<f64>], rate_hz: f64) -> Spectrogram {
    Spectrogram::new(
        record,
        rate_hz,
        &SpectrogramSettings { band_hz: Some(BAND_HZ), ..SpectrogramSettings::default() },
    )
    .unwrap()
}

fn lengths_and_rates() -> impl Iterator<Item = (f64, f64)> {
    [0.1, 0.15, 0.3, 0.6]
        .into_iter()
        .flat_map(|duration_s| [5000.0, 10_000.0].map(|rate_hz| (duration_s, rate_hz)))
}

#[test]
fn a_linear_chirp_without_noise_is_exact_to_its_ends() {
    for (duration_s, rate_hz) in lengths_and_rates() {
        for law in [RISING, FALLING] {
            Made::of(law, duration_s, rate_hz).assert_range(1, 2e-4);
        }
    }
}

#[test]
fn courses_come_back_as_their_range_within_two_percent() {
    for (duration_s, rate_hz) in lengths_and_rates() {
        for law in [RISING, FALLING, EXPONENTIAL, SINUSOIDAL] {
            let made = Made::of(law, duration_s, rate_hz);
            made.assert_range(1, 0.02);
            (1..4).for_each(|seed| assert!(made.noisy().assert_range(seed, 0.02).low_sd_hz < 8.0));
            assert!(made.noisy().ridge(1).is_drifting());
        }
    }
}

#[test]
fn harmonics_and_what_is_left_of_a_ring_down_do_not_lead_it_away() {
    for (duration_s, rate_hz) in lengths_and_rates() {
        for law in [RISING, FALLING] {
            let made = Made { harmonics: true, ..Made::of(law, duration_s, rate_hz).noisy() };
            made.assert_range(2, 0.02);
            Made { ring_down: true, ..made }.assert_range(2, 0.02);
        }
    }
}

#[test]
fn a_fifth_of_the_frames_missing_widens_the_deviations_and_moves_nothing() {
    for (duration_s, rate_hz) in lengths_and_rates() {
        for law in [RISING, FALLING] {
            let made = Made { gaps: true, ..Made::of(law, duration_s, rate_hz).noisy() };
            let missing = made.record(3).iter().filter(|x| x.is_none()).count() as f64 / made.frames() as f64;
            assert!((0.14..0.26).contains(&missing), "{missing}");
            made.assert_range(3, 0.02);
        }
    }
    // with harmonics and a ring-down as well, what leaks through the gaps is noise, and is stated as such
    let all = Made { gaps: true, harmonics: true, ring_down: true, ..Made::of(RISING, 0.15, 5000.0).noisy() };
    let without = Made { gaps: false, ..all }.assert_range(3, 0.02);
    let with = all.assert_range(3, 0.05);
    assert!(with.low_sd_hz > 1.5 * without.low_sd_hz, "{with:?} and {without:?}");
}

#[test]
fn the_stated_deviations_of_points_and_ends_are_honest() {
    for made in [
        Made::of(RISING, 0.15, 5000.0).noisy(),
        Made::of(EXPONENTIAL, 0.3, 5000.0).noisy(),
        Made { gaps: true, ..Made::of(RISING, 0.3, 5000.0).noisy() },
    ] {
        let (mut points, mut ends) = (Vec::new(), Vec::new());
        for seed in 0..50 {
            let ridge = made.ridge(seed);
            let law = |time_s: f64| (made.law)(time_s / made.duration_s);
            points.extend(ridge.points.iter().map(|p| (p.frequency_hz - law(p.time_s)) / p.frequency_sd_hz));
            ends.extend(
                ridge
                    .start
                    .iter()
                    .chain(&ridge.end)
                    .map(|e| (e.frequency_hz - law(e.time_s)) / e.frequency_sd_hz),
            );
        }
        let rms = |scaled: &[f64]| (scaled.iter().map(|z| z * z).sum::<f64>() / scaled.len() as f64).sqrt();
        assert!(points.len() > 500 && ends.len() > 90, "{} points, {} ends", points.len(), ends.len());
        assert!((0.7..1.4).contains(&rms(&points)), "points: {}", rms(&points));
        assert!((0.7..1.4).contains(&rms(&ends)), "ends: {}", rms(&ends));
    }
}

#[test]
fn a_steady_tone_does_not_drift() {
    let mut drifting = 0;
    for (duration_s, rate_hz) in lengths_and_rates() {
        assert!(!Made::of(STEADY, duration_s, rate_hz).ridge(1).is_drifting());
        for seed in 0..5 {
            let ridge = Made::of(STEADY, duration_s, rate_hz).noisy().ridge(seed);
            let range = ridge.range_hz().unwrap();
            assert!(range.low_hz <= range.high_hz);
            assert!(
                (range.low_hz - 525.0).abs() < 4.0 * range.low_sd_hz
                    && (range.high_hz - 525.0).abs() < 4.0 * range.high_sd_hz,
                "{range:?}"
            );
            drifting += usize::from(ridge.is_drifting());
        }
    }
    assert_eq!(drifting, 0, "of 40");
}

#[test]
fn noise_alone_has_no_ridge() {
    for (duration_s, rate_hz) in [(0.15, 5000.0), (0.3, 5000.0), (0.1, 10_000.0)] {
        let silent = |seed: u64| {
            let mut draw = noise(104_729 * seed + 5);
            (0..(duration_s * rate_hz) as usize).map(|_| Some(1e-6 * draw())).collect::<Vec<_>>()
        };
        let ridge =
            |record: Vec<Option<f64>>| spectrogram(&record, rate_hz).find_ridge(&record, BAND_HZ).unwrap();
        let found: Vec<Ridge> =
            (0..100).map(|seed| ridge(silent(seed))).filter(|ridge| !ridge.points.is_empty()).collect();
        assert!(found.len() <= 5, "{} of 100", found.len());
    }
    let still = vec![Some(0.0); 750];
    let ridge = spectrogram(&still, 5000.0).find_ridge(&still, BAND_HZ).unwrap();
    assert!(ridge.points.is_empty() && ridge.range_hz().is_none() && !ridge.is_drifting());
}

#[test]
fn a_component_that_ends_half_way_has_a_ridge_that_ends_there() {
    for duration_s in [0.15, 0.3, 0.6] {
        for seed in 1..4 {
            let made = Made::of(|u| 500.0 + 100.0 * u, duration_s, 5000.0);
            let (mut record, mut draw) = (made.record(seed), noise(seed + 77));
            let half = record.len() / 2;
            for (frame, sample) in record.iter_mut().enumerate() {
                *sample = sample.filter(|_| frame < half).or(Some(0.0)).map(|x| x + NOISE_20_DB_M * draw());
            }
            let ridge = spectrogram(&record, 5000.0).find_ridge(&record, BAND_HZ).unwrap();
            let last = ridge.points.last().unwrap();
            let late = (last.time_s - duration_s / 2.0) / ridge.segment_s;
            assert!(ridge.start.is_some() && ridge.end.is_none(), "{duration_s} s, seed {seed}: {ridge:?}");
            assert!(
                (-0.6..0.1).contains(&late),
                "{duration_s} s, seed {seed}: {late} segments after the end"
            );
            assert_eq!(ridge.unbroken_parts().count(), 1);
            let range = ridge.range_hz().unwrap();
            assert!(
                (range.low_hz - 500.0).abs() < 6.0 && range.high_hz < 555.0 && range.high_hz > 520.0,
                "{range:?}"
            );
        }
    }
}

#[test]
fn a_gap_interrupts_the_ridge_and_columns_with_half_their_weight_missing_are_none() {
    let made = Made::of(RISING, 0.3, 5000.0).noisy();
    let mut record = made.record(1);
    record[700..900].fill(None);
    let found = spectrogram(&record, 5000.0);
    let empty: Vec<f64> = found
        .amplitude_m
        .iter()
        .zip(&found.time_s)
        .filter(|(column, _)| column.is_none())
        .map(|(_, t)| *t)
        .collect();
    assert!(!empty.is_empty() && empty.iter().all(|t| (0.13..0.19).contains(t)), "{empty:?}");
    let ridge = found.find_ridge(&record, BAND_HZ).unwrap();
    assert_eq!(ridge.unbroken_parts().count(), 2);
    let range = ridge.range_hz().unwrap();
    assert!(
        (range.low_hz / LOW_HZ - 1.0).abs() < 0.02 && (range.high_hz / HIGH_HZ - 1.0).abs() < 0.02,
        "{range:?}"
    );
}

#[test]
fn a_steady_sine_reads_its_amplitude_in_every_column() {
    for gaps in [false, true] {
        let made = Made { gaps, ..Made::of(STEADY, 0.3, 5000.0) };
        let record = made.record(1);
        let settings = SpectrogramSettings { segment_s: Some(0.04), ..SpectrogramSettings::default() };
        let found = Spectrogram::new(&record, 5000.0, &settings).unwrap();
        // 200 frames of 1500, 50 apart: 27 columns; 1024 bins of 4.88 Hz from zero to half the rate
        assert_eq!((found.time_s.len(), found.amplitude_m.len(), found.frequency_hz.len()), (27, 27, 513));
        assert_eq!((found.segment_s, found.hop_s, found.resolution_hz), (0.04, 0.01, 25.0));
        assert!(
            (found.time_s[0] - 0.0199).abs() < 1e-12
                && (found.frequency_hz[1] - 5000.0 / 1024.0).abs() < 1e-12
        );
        for column in found.amplitude_m.iter().flatten() {
            let top = column.iter().fold(0.0, |m: f64, a| m.max(*a));
            // 525 Hz lies half way between two bins, a tenth of a resolution from each: a Hann window reads
            // 0.6 % low there
            assert!(
                (top / AMPLITUDE_M - if gaps { 1.0 } else { 0.9944 }).abs() < if gaps { 0.1 } else { 2e-4 },
                "{top}"
            );
        }
        let ridge = found.find_ridge(&record, BAND_HZ).unwrap();
        assert_eq!(ridge.points.len(), 27);
        for p in &ridge.points {
            assert!(
                (p.frequency_hz - 525.0).abs() < 1e-3
                    && (p.amplitude_m / AMPLITUDE_M - 1.0).abs() < 1e-4
                    && p.rate_hz_per_s.abs() < 0.5,
                "{p:?}"
            );
        }
    }
}

#[test]
fn a_long_record_has_a_bounded_spectrogram() {
    let made = Made::of(RISING, 8.0, 5000.0).noisy();
    let record = made.record(1);
    let found = spectrogram(&record, 5000.0);
    assert!(
        found.time_s.len() <= MOST_COLUMNS && found.frequency_hz.len() <= 8193,
        "{} by {}",
        found.time_s.len(),
        found.frequency_hz.len()
    );
    made.assert_range(1, 0.02);
}

#[test]
fn what_cannot_be_cut_is_refused() {
    let record = Made::of(STEADY, 0.1, 5000.0).record(1);
    let of = |segment_s, band_hz| {
        Spectrogram::new(&record, 5000.0, &SpectrogramSettings { segment_s, band_hz, overlap: None })
    };
    for segment_s in [0.0, -1.0, 0.003, 0.2, f64::NAN, f64::INFINITY] {
        assert!(matches!(of(Some(segment_s), None), Err(SpectrumError::Segment { .. })), "{segment_s}");
    }
    assert!(of(Some(0.1), None).unwrap().find_ridge(&record, BAND_HZ).is_ok());
    for band_hz in [(700.0, 700.0), (2500.0, 2600.0), (-1.0, 5.0), (f64::NAN, 5.0), (5.0, f64::NAN)] {
        assert!(matches!(of(None, Some(band_hz)), Err(SpectrumError::Band { .. })), "{band_hz:?}");
        assert!(
            matches!(of(None, None).unwrap().find_ridge(&record, band_hz), Err(SpectrumError::Band { .. })),
            "{band_hz:?}"
        );
    }
    for (low, high) in [(0.0, 1e300), (0.0, 1e-300), (2499.0, f64::INFINITY)] {
        assert!(
            of(None, Some((low, high))).unwrap().find_ridge(&record, (low, high)).is_ok(),
            "{low}..{high}"
        );
    }
    assert!(matches!(
        Spectrogram::new(&[Some(1.0); 7], 5000.0, &SpectrogramSettings::default()),
        Err(SpectrumError::TooFew { found: 7, least: 8 })
    ));
    for frames in [8, 9, 15, 16, 17, 33] {
        let short: Vec<_> = record.iter().copied().take(frames).collect();
        let found = Spectrogram::new(&short, 5000.0, &SpectrogramSettings::default()).unwrap();
        assert!(
            found.find_ridge(&short, (1.0, 2500.0)).is_ok()
                && found.find_ridge(&[], (1.0, 2500.0)).unwrap().points.is_empty()
        );
    }
}

#[test]
fn a_band_that_nobody_gave_lies_above_the_ring_down() {
    assert_eq!(default_band_hz(750, 5000.0, Some(75.0)), (300.0, 2250.0));
    // four segments of four cycles in 0.1 s
    assert_eq!(default_band_hz(500, 5000.0, Some(20.0)), (160.0, 2250.0));
    assert_eq!(default_band_hz(500, 5000.0, None), (160.0, 2250.0));
    assert_eq!(default_band_hz(0, 5000.0, Some(2000.0)), (1125.0, 2250.0));
}
