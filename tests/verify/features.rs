//! Every kind of feature against recordings whose answer is known exactly.

use crate::noise::noise;
use short_spectra::{Detrend, SpectrumSettings, analyse_spectrum};
use std::f64::consts::{PI, TAU};
use wiperlab::feature::{
    ASSIGN_DB, ASSIGN_WIDTH, CycleRangeEnd, Feature, FeatureBand, FeatureReader, FeatureValue, MissingValue,
    Reading, ReversalInterval, read_features,
};
use wiperlab::recording::channel::{Channel, InstantNotFound, ReversalInstants, Window};
use wiperlab::recording::{FrameGrid, Recording, Traces};

const RATE_HZ: f64 = 5000.0;
/// A tenth of a pixel of 20 um, in the deflection.
const NOISE_M: f64 = 2e-6;

/// Head and deflection over time, with noise on both points; head drop as the deflection.
fn recording(
    duration_s: f64,
    noise_m: f64,
    head: impl Fn(f64) -> f64,
    deflection: impl Fn(f64) -> f64,
) -> Recording {
    let grid =
        FrameGrid { start_s: 0.0, frame_rate_hz: RATE_HZ, frames: (duration_s * RATE_HZ).round() as usize };
    let mut draw = noise(17);
    let mut column = |place: &dyn Fn(f64) -> f64| -> Vec<Option<f64>> {
        (0..grid.frames).map(|i| Some(place(grid.time_s(i)) + noise_m * draw())).collect()
    };
    let (head_x_m, tip_x_m, head_y_m) =
        (column(&head), column(&|t| head(t) + deflection(t)), column(&|t| -deflection(t)));
    let traces =
        Traces { tip_x_m, tip_y_m: vec![None; grid.frames], head_x_m, head_y_m, ..Traces::default() };
    Recording::new("exact", grid, traces, true).unwrap()
}

/// The same with a head at rest.
fn resting(duration_s: f64, noise_m: f64, deflection: impl Fn(f64) -> f64) -> Recording {
    recording(duration_s, noise_m, |_| 0.0, deflection)
}

fn band(window: &str, low: f64, high: f64) -> FeatureBand {
    FeatureBand {
        channel: Channel::Deflection,
        window: Window::parse(window).unwrap(),
        band_hz: (low, high),
        detrend: Detrend::Cubic,
        least_amplitude_m: 0.0,
    }
}

fn feature(reading: Reading) -> Feature {
    Feature { name: "f".to_owned(), reading, condition: 0 }
}

fn read(reading: Reading, recording: &Recording) -> Result<FeatureValue, MissingValue> {
    feature(reading).read(recording, &ReversalInstants::find_instants(recording))
}

/// A blade's flip as a cubic, m, over a window of 0.15 s.
fn flip(t: f64) -> f64 {
    let s = t / 0.15;
    1e-3 * (1.0 - 2.0 * s + 0.8 * s * s + 0.3 * s * s * s)
}

fn ring_down(frequency_hz: f64, damping: f64, amplitude_m: f64) -> impl Fn(f64) -> f64 {
    let decay = TAU * frequency_hz * damping / (1.0 - damping * damping).sqrt();
    move |t| amplitude_m * (-decay * t).exp() * (TAU * frequency_hz * t + 0.4).sin()
}

#[test]
fn damping_of_an_exact_ring_down_is_read_to_two_thousandths_also_on_a_flip() {
    for (frequency_hz, duration_s, damping) in [
        (78.4, 0.15, 0.002),
        (78.4, 0.15, 0.02),
        (78.4, 0.15, 0.05),
        (78.4, 0.3, 0.03),
        (900.0, 0.1, 0.002),
        (900.0, 0.1, 0.01),
        (900.0, 0.1, 0.02),
    ] {
        let exact = ring_down(frequency_hz, damping, 100e-6);
        let of = |with_flip: f64, detrend| {
            let seen = resting(duration_s, 0.0, |t| with_flip * flip(t) + exact(t));
            read(
                Reading::DampingRatio(FeatureBand {
                    detrend,
                    ..band("..", 0.5 * frequency_hz, 1.5 * frequency_hz)
                }),
                &seen,
            )
            .unwrap()
            .value
        };
        for found in [of(0.0, Detrend::None), of(1.0, Detrend::Cubic)] {
            assert!((found / damping - 1.0).abs() < 2e-3, "{frequency_hz} Hz, {damping}: {found}");
        }
    }
}

#[test]
fn damping_in_noise_stays_within_the_deviation_that_it_states() {
    for (frequency_hz, duration_s, damping) in
        [(78.4, 0.15, 0.005), (78.4, 0.15, 0.05), (78.4, 0.3, 0.02), (900.0, 0.1, 0.005)]
    {
        let exact = ring_down(frequency_hz, damping, 100e-6);
        let seen = resting(duration_s, NOISE_M, |t| flip(t) + exact(t));
        let found =
            read(Reading::DampingRatio(band("..", 0.5 * frequency_hz, 1.5 * frequency_hz)), &seen).unwrap();
        let sd = found.sd.unwrap();
        assert!(
            (found.value - damping).abs() < 3.0 * sd && sd < 0.1 * damping,
            "{frequency_hz} Hz, {damping}: {found:?}"
        );
    }
}

#[test]
fn a_ring_down_that_has_faded_that_grows_or_that_is_too_short_has_no_damping() {
    let of = |duration_s: f64, noise_m: f64, (frequency_hz, damping): (f64, f64)| {
        let seen = resting(duration_s, noise_m, ring_down(frequency_hz, damping, 100e-6));
        read(Reading::DampingRatio(band("..", 0.5 * frequency_hz, 1.5 * frequency_hz)), &seen)
    };
    assert!(matches!(of(0.3, NOISE_M, (78.4, 0.05)), Err(MissingValue::Faded { .. })), "e^-3.7 of 100 um");
    assert!(matches!(
        of(0.15, NOISE_M, (78.4, -0.01)),
        Err(MissingValue::NoDecay { first_m, second_m, .. }) if first_m < second_m
    ));
    assert!(matches!(
        of(0.06, 0.0, (78.4, 0.01)),
        Err(MissingValue::FewCycles { cycles, .. }) if (cycles - 2.35).abs() < 0.1
    ));
}

fn cycle(window: &str, (low, high): (f64, f64), segment_s: f64, end: CycleRangeEnd) -> Reading {
    Reading::CycleFrequency { band: band(window, low, high), segment_s, end }
}

/// Phase of a chirp from 359 to 692 Hz in 0.2 s, rad.
fn chirp(t: f64) -> f64 {
    TAU * (359.0 + SWEEP_HZ_PER_S * t / 2.0) * t
}

const SWEEP_HZ_PER_S: f64 = (692.0 - 359.0) / 0.2;

#[test]
fn the_range_of_a_chirp_is_that_of_the_middles_of_its_first_and_last_segment() {
    let (low_hz, high_hz) = (359.0 + 0.01 * SWEEP_HZ_PER_S, 692.0 - 0.01 * SWEEP_HZ_PER_S);
    let saw = |t: f64| (1..=5).map(|n| 20e-6 * (f64::from(n) * chirp(t)).sin() / f64::from(n)).sum::<f64>();
    let tone = |t: f64| 20e-6 * chirp(t).sin();
    // the second harmonic of a cycle that sticks and slips lies in the band while the cycle is slow, at half
    // the amplitude
    for (name, seen, tolerance_hz) in [
        ("sine", resting(0.2, 0.0, tone), 1.0),
        ("saw", resting(0.2, 0.0, saw), 1.0),
        ("sine in noise", resting(0.2, NOISE_M, tone), 4.0),
        ("saw in noise", resting(0.2, NOISE_M, saw), 4.0),
    ] {
        for (end, expected) in [(CycleRangeEnd::Low, low_hz), (CycleRangeEnd::High, high_hz)] {
            let found = read(cycle("..", (300.0, 800.0), 0.02, end), &seen).unwrap().value;
            assert!((found - expected).abs() < tolerance_hz, "{name}, {end:?}: {found}, expected {expected}");
        }
    }
}

#[test]
fn a_constant_cycle_has_no_range_and_what_is_too_weak_does_not_widen_it() {
    let seen = resting(0.2, NOISE_M, |t| 20e-6 * (TAU * 600.0 * t).sin());
    let [low, high] = [CycleRangeEnd::Low, CycleRangeEnd::High]
        .map(|end| read(cycle("..", (300.0, 800.0), 0.02, end), &seen).unwrap());
    assert!(
        high.value >= low.value && high.value - low.value < 12.0,
        "six deviations of {:?} Hz: {} to {}",
        low.sd,
        low.value,
        high.value
    );
    // chatter at 450 Hz of a tenth of the amplitude before the cycle starts, then noise alone
    let weak = |t: f64| if t < 0.06 { 4e-6 * (TAU * 450.0 * t).sin() } else { 0.0 };
    let late =
        resting(
            0.3,
            0.1e-6,
            |t| if (0.1..0.2).contains(&t) { 40e-6 * (TAU * 600.0 * t).sin() } else { weak(t) },
        );
    let found = read(cycle("..", (300.0, 800.0), 0.02, CycleRangeEnd::Low), &late).unwrap().value;
    assert!((found - 600.0).abs() < 6.0, "a segment half in the cycle is still its: {found}");
    let silent = resting(0.2, 0.0, |t| 1e-3 * t);
    assert!(matches!(
        read(cycle("..", (300.0, 800.0), 0.02, CycleRangeEnd::Low), &silent),
        Err(MissingValue::NoPeak { .. })
    ));
    for segment_s in [0.0012, 0.3] {
        assert!(matches!(
            read(cycle("..", (300.0, 800.0), segment_s, CycleRangeEnd::Low), &seen),
            Err(MissingValue::Segment { window: 1000, .. })
        ));
    }
}

/// Head on half a stroke of 1 Hz, m, and its speed, m/s.
fn stroke(t: f64) -> (f64, f64) {
    (0.1 * (1.0 - (TAU * 0.5 * t).cos()), 0.1 * PI * (TAU * 0.5 * t).sin())
}

#[test]
fn the_deflection_at_a_speed_is_the_mean_of_its_law_over_the_frames_of_that_speed() {
    let law = |speed: f64| -1e-3 * (0.6 * (-6.0 * speed).exp() + 0.4);
    let seen =
        recording(1.0, NOISE_M, |t| stroke(t).0, |t| law(stroke(t).1) + 30e-6 * (TAU * 777.0 * t).sin());
    for speed_m_per_s in [0.03, 0.05, 0.1, 0.2, 0.3] {
        let inside: Vec<f64> = (0..5000)
            .map(|i| stroke(f64::from(i) / RATE_HZ).1)
            .filter(|v| (v / speed_m_per_s - 1.0).abs() <= 0.15)
            .map(law)
            .collect();
        let expected = inside.iter().sum::<f64>() / inside.len() as f64;
        let reading =
            Reading::DeflectionAtSpeed { window: Window::WHOLE, speed_m_per_s, width_relative: 0.15 };
        let found = read(reading, &seen).unwrap().value;
        assert!((found / expected - 1.0).abs() < 4e-3, "{speed_m_per_s} m/s: {found}, expected {expected}");
        assert!((found / law(speed_m_per_s) - 1.0).abs() < 0.01, "the law itself bends little within 15 %");
    }
}

#[test]
fn gaps_move_the_deflection_at_a_speed_no_more_than_noise_and_a_speed_that_is_not_there_is_said() {
    let whole = recording(1.0, NOISE_M, |t| stroke(t).0, |t| -2e-3 * stroke(t).1);
    let mut traces = whole.traces().clone();
    for i in (0..5000).filter(|i| i % 9 == 4 || (700..760).contains(i) || (3000..3300).contains(i)) {
        (traces.head_x_m[i], traces.tip_x_m[i]) = (None, None);
    }
    let gappy = Recording::new("gappy", whole.grid(), traces, true).unwrap();
    let at = |speed_m_per_s| Reading::DeflectionAtSpeed {
        window: Window::WHOLE,
        speed_m_per_s,
        width_relative: 0.15,
    };
    for speed in [0.1, 0.2] {
        let found = read(at(speed), &gappy).unwrap().value;
        assert!((found / (-2e-3 * speed) - 1.0).abs() < 0.02, "{speed} m/s: {found}");
    }
    let missing = read(at(0.5), &whole).unwrap_err();
    assert!(
        matches!(
            missing,
            MissingValue::Speed { found: 0, most_m_per_s, .. } if (most_m_per_s - 0.1 * PI).abs() < 1e-3
        ),
        "{missing}"
    );
    assert!(missing.to_string().starts_with(
        "found 0 tracked frames with the head at 0.4250 to 0.5750 m/s, expected at least 8; the window \
         shows 0."
    ));
    let few = Reading::DeflectionAtSpeed {
        window: Window::parse("0.5..0.51").unwrap(),
        speed_m_per_s: 0.1,
        width_relative: 0.15,
    };
    assert_eq!(read(few, &whole), Err(MissingValue::NoSpeed), "50 frames hold no two blocks of 20 ms");
}

const TRAILS_M: f64 = 1.1e-3;
const HOLD_S: f64 = 0.98;

fn turning_head(t: f64) -> f64 {
    0.018 * (1.0 - (PI * t).cos())
}

/// When the head, after its turn at 1 s, is `back_m` behind where it was when the tip stopped, s.
fn back_s(back_m: f64) -> f64 {
    1.0 + ((PI * 0.02).cos() - back_m / 0.018).acos() / PI
}

/// A tip that trails, stops at 0.98 s, sticks until the blade is deflected as far to the other side, and
/// trails again.
fn reversal(noise_m: f64) -> Recording {
    let tip = |t: f64| match t {
        t if t < HOLD_S => turning_head(t) - TRAILS_M,
        t if t < back_s(2.0 * TRAILS_M) => turning_head(HOLD_S) - TRAILS_M,
        t => turning_head(t) + TRAILS_M,
    };
    recording(1.4, noise_m, turning_head, |t| tip(t) - turning_head(t))
}

#[test]
fn times_between_the_instants_of_a_reversal_are_exact_to_a_frame_or_two() {
    let release_s = back_s(2.0 * TRAILS_M);
    let excursion_m = turning_head(0.99) - turning_head(HOLD_S); // of the head at the median of the rest
    let flip_s = |share: f64| back_s(share * (2.0 * TRAILS_M + excursion_m) - excursion_m);
    let expected = [
        (ReversalInterval::ReleaseAfterReversal, release_s - 1.0),
        (ReversalInterval::StickDuration, release_s - HOLD_S),
        (ReversalInterval::FlipAfterReversal, flip_s(0.05) - 1.0),
        (ReversalInterval::FlipDuration, flip_s(0.95) - flip_s(0.05)),
    ];
    for (noise_m, frames) in [(0.0, 3.0), (NOISE_M, 12.0)] {
        let seen = reversal(noise_m);
        for (interval, expected_s) in expected {
            let found = read(Reading::Interval { interval, reversal: 1 }, &seen).unwrap().value;
            assert!(
                (found - expected_s).abs() * RATE_HZ < frames,
                "{interval:?}: {found} s, expected {expected_s} s"
            );
        }
    }
}

#[test]
fn a_reversal_that_is_not_there_gives_no_times() {
    let still = resting(0.2, NOISE_M, |t| 20e-6 * (TAU * 300.0 * t).sin());
    for interval in [
        ReversalInterval::ReleaseAfterReversal,
        ReversalInterval::StickDuration,
        ReversalInterval::FlipAfterReversal,
        ReversalInterval::FlipDuration,
    ] {
        assert_eq!(
            read(Reading::Interval { interval, reversal: 1 }, &still),
            Err(MissingValue::Instant(InstantNotFound::NoTurn))
        );
        assert_eq!(
            read(Reading::Interval { interval, reversal: 2 }, &reversal(0.0)),
            Err(MissingValue::Instant(InstantNotFound::FewerTurns { turns: 1 }))
        );
    }
    let after = Reading::DeflectionAtSpeed {
        window: Window::parse("after").unwrap(),
        speed_m_per_s: 0.01,
        width_relative: 0.15,
    };
    assert!(matches!(read(after, &still), Err(MissingValue::Window(_))));
    assert!(matches!(
        read(Reading::Rms(band("0.1..0.3", 100.0, 200.0)), &still),
        Err(MissingValue::Window(_))
    ));
    let other = Feature { condition: 1, ..feature(Reading::MeanDeflection(Window::WHOLE)) };
    assert_eq!(read_features(&[other], &[still]), [Err(MissingValue::NoRecording { number: 2 })]);
}

#[test]
fn a_line_that_holds_a_tone_has_its_rms_and_the_others_the_floor() {
    let seen = resting(0.2, 0.0, |t| 10e-6 * (TAU * 640.0 * t).sin());
    let line =
        |low, high| read(Reading::BandLevel { band: band("..", low, high), floor_m: 1e-7 }, &seen).unwrap();
    assert!((line(600.0, 700.0).value / (10e-6 / 2.0_f64.sqrt()).hypot(1e-7) - 1.0).abs() < 1e-3);
    for other in [line(500.0, 600.0), line(700.0, 800.0)] {
        assert!((other.value / 1e-7 - 1.0).abs() < 0.01 && other.sd.is_none(), "{other:?}");
    }
    assert!(
        matches!(read(Reading::Rms(band("..", 2500.0, 2600.0)), &seen), Err(MissingValue::Spectrum(_))),
        "above half the frame rate"
    );
}

/// Two tones on either side of a target, the lower one stronger by this ratio, and what is assigned to the
/// target.
fn between_two(ratio: f64) -> FeatureValue {
    let seen = resting(0.4, 0.0, |t| {
        10e-6 * (ratio.sqrt() * (TAU * LOWER_HZ * t).sin() + (TAU * UPPER_HZ * t).sin() / ratio.sqrt())
    });
    let instants = ReversalInstants::find_instants(&seen);
    feature(Reading::Frequency(band("..", 40.0, 140.0)))
        .read_assigned(Some(TARGET_HZ), &FeatureReader::new(&seen, &instants))
        .unwrap()
}

const LOWER_HZ: f64 = 66.0;
const TARGET_HZ: f64 = 80.0;
const UPPER_HZ: f64 = 84.0;

fn rank(found_hz: f64, below_db: f64) -> f64 {
    ((found_hz / TARGET_HZ).ln() / ASSIGN_WIDTH).powi(2) + (below_db / ASSIGN_DB).powi(2)
}

#[test]
fn the_rank_of_the_assigned_peak_does_not_jump_when_peaks_cross_over() {
    // from -18 dB to 18 dB in steps of 0.25 dB
    let steps: Vec<FeatureValue> =
        (-72..=72).map(|k| between_two(10.0_f64.powf(f64::from(k) / 80.0))).collect();
    let ranks: Vec<f64> = steps.iter().map(|r| rank(r.value, r.below_db)).collect();
    let largest = ranks.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
    assert!(
        largest < 0.25,
        "a quarter of a decibel at 12 dB below changes the rank by 0.17, found {largest}"
    );
    let taken = |r: &FeatureValue| if (r.value - UPPER_HZ).abs() < 1.0 { 'u' } else { 'l' };
    let switches = steps.windows(2).filter(|w| taken(&w[0]) != taken(&w[1])).count();
    assert_eq!((taken(&steps[0]), taken(&steps[144]), switches), ('u', 'l', 1));
    let upper_at_6_db = between_two(2.0);
    assert!(
        (upper_at_6_db.value - UPPER_HZ).abs() < 0.5,
        "the nearer one is taken though it is 6 dB weaker: {upper_at_6_db:?}"
    );
    assert!((upper_at_6_db.below_db - 6.02).abs() < 0.2);
    let runner_up = upper_at_6_db.runner_up.unwrap();
    assert!((runner_up.frequency_hz - LOWER_HZ).abs() < 0.5 && runner_up.below_db == 0.0);
}

#[test]
fn without_a_target_the_strongest_is_taken_and_a_lone_peak_has_no_runner_up() {
    let seen = resting(0.4, 0.0, |t| 10e-6 * (TAU * LOWER_HZ * t).sin() + 6e-6 * (TAU * UPPER_HZ * t).sin());
    let found = read(Reading::Frequency(band("..", 40.0, 140.0)), &seen).unwrap();
    assert!((found.value - LOWER_HZ).abs() < 0.5 && found.below_db == 0.0);
    assert!((found.runner_up.unwrap().below_db - 20.0 * (10.0_f64 / 6.0).log10()).abs() < 0.2);
    let alone = read(Reading::Frequency(band("..", 60.0, 72.0)), &seen).unwrap();
    assert!((alone.value - LOWER_HZ).abs() < 0.5 && alone.runner_up.is_none());
}

#[test]
fn features_read_together_are_those_read_alone_and_those_of_a_spectrum_of_their_own() {
    let seen = recording(
        0.4,
        NOISE_M,
        |t| stroke(t).0,
        |t| flip(t / 3.0) + 30e-6 * (TAU * 78.0 * t).sin() * (-9.0 * t).exp() + 8e-6 * chirp(t).sin(),
    );
    let (low, high) = (band("0.05..0.35", 40.0, 140.0), band("0.05..0.35", 300.0, 1000.0));
    let readings = [
        Reading::Frequency(low.clone()),
        Reading::Frequency(high.clone()),
        Reading::Amplitude(low.clone()),
        Reading::Rms(high.clone()),
        Reading::DampingRatio(low.clone()),
        Reading::CycleFrequency { band: high.clone(), segment_s: 0.02, end: CycleRangeEnd::Low },
        Reading::CycleFrequency { band: high, segment_s: 0.02, end: CycleRangeEnd::High },
        Reading::MeanDeflection(Window::WHOLE),
        Reading::SlipRate(Window::WHOLE),
    ];
    let features: Vec<Feature> = readings.into_iter().map(feature).collect();
    let instants = ReversalInstants::find_instants(&seen);
    let alone: Vec<_> = features.iter().map(|feature| feature.read(&seen, &instants)).collect();
    assert_eq!(read_features(&features, std::slice::from_ref(&seen)), alone);
    assert!(alone[..8].iter().all(Result::is_ok), "{alone:?}");
    assert!(matches!(alone[8], Err(MissingValue::NoCycle(_))), "{alone:?}");
    let settings = SpectrumSettings { band_hz: Some((40.0, 140.0)), ..SpectrumSettings::default() };
    let own = analyse_spectrum(&Channel::Deflection.samples(&seen)[250..1750], RATE_HZ, &settings).unwrap();
    assert_eq!(alone[0].as_ref().unwrap().value, own.component_in_band(40.0, 140.0).unwrap().frequency_hz);
}

#[test]
fn the_rate_of_slips_is_that_of_a_saw_tooth() {
    let head = |t: f64| 0.1 * t;
    // the tip rests for 8 ms and slips in 2 ms
    let tip = |t: f64| 1e-3 * ((100.0 * t).floor() + ((100.0 * t).fract() * 5.0 - 4.0).max(0.0));
    let seen = recording(0.4, NOISE_M, head, |t| tip(t) - head(t));
    let found = read(Reading::SlipRate(Window::WHOLE), &seen).unwrap();
    assert!((found.value - 100.0).abs() < 3.0 * found.sd.unwrap() && found.sd.unwrap() < 0.1, "{found:?}");
}
