//! What is done to a recording before it is analysed: deflection, instants, windows, detrending; gaps stay
//! gaps.

use short_spectra::{SpectrumError, SpectrumSettings, analyse_spectrum};
use std::f64::consts::TAU;
use wiperlab::recording::channel::{Channel, InstantKind, ReversalInstants, Window};
use wiperlab::recording::{FrameGrid, Recording, Traces};

const RATE_HZ: f64 = 5000.0;
const START_S: f64 = 0.9;
const FRAMES: usize = 2000;
const TONE_HZ: f64 = 78.4;
const TONE_M: f64 = 20e-6;

/// A head that turns at 1 s.
fn head(t: f64) -> f64 {
    0.018 * (1.0 - (TAU * 0.5 * t).cos())
}

/// A deflection that flips by 2 mm and carries a cycle of 20 um.
fn deflection(t: f64) -> f64 {
    2e-3 * (TAU * 0.5 * (t - 0.4)).cos() + TONE_M * (TAU * TONE_HZ * t).sin()
}

fn recording(tip_missing: impl Fn(usize) -> bool, head_missing: impl Fn(usize) -> bool) -> Recording {
    let grid = FrameGrid { start_s: START_S, frame_rate_hz: RATE_HZ, frames: FRAMES };
    let column = |value: &dyn Fn(f64) -> f64, missing: &dyn Fn(usize) -> bool| {
        (0..FRAMES).map(|i| (!missing(i)).then(|| value(grid.time_s(i)))).collect()
    };
    let traces = Traces {
        tip_x_m: column(&|t| head(t) + deflection(t), &tip_missing),
        tip_y_m: vec![None; FRAMES],
        head_x_m: column(&head, &head_missing),
        head_y_m: vec![None; FRAMES],
        ..Traces::default()
    };
    Recording::new("stroke", grid, traces, true).unwrap()
}

/// One tip in seven, one head in eleven, and both in a run of forty.
fn gappy() -> Recording {
    recording(|i| i % 7 == 3 || (900..940).contains(&i), |i| i % 11 == 5 || (900..940).contains(&i))
}

fn cut(recording: &Recording, window: &str) -> Vec<Option<f64>> {
    let frames = Window::parse(window)
        .unwrap()
        .resolve_frames(recording, &ReversalInstants::find_instants(recording))
        .unwrap();
    Channel::Deflection.samples(recording)[frames].to_vec()
}

#[test]
fn the_deflection_is_tip_minus_head_in_the_same_frame_and_missing_where_either_is() {
    let recording = gappy();
    let samples = Channel::Deflection.samples(&recording);
    assert_eq!(samples.len(), FRAMES);
    let missing = |i: usize| i % 7 == 3 || i % 11 == 5 || (900..940).contains(&i);
    for (i, sample) in samples.iter().enumerate() {
        assert_eq!(sample.is_none(), missing(i), "frame {i}");
        let expected = deflection(recording.grid().time_s(i));
        assert!(
            sample.is_none_or(|x| (x - expected).abs() < 1e-15),
            "frame {i}: {sample:?}, expected {expected}"
        );
    }
}

#[test]
fn gaps_do_not_move_the_reversal() {
    for recording in
        [recording(|_| false, |_| false), gappy(), recording(|_| false, |i| (470..530).contains(&i))]
    {
        let found = ReversalInstants::find_instants(&recording);
        assert_eq!(found.reversals.len(), 1);
        let reversal_s = found.time_s(InstantKind::Reversal, 1).unwrap();
        assert!((reversal_s - 1.0).abs() < 1e-6, "{reversal_s}");
    }
}

#[test]
fn a_window_from_the_reversal_holds_exactly_its_frames_also_with_gaps() {
    let recording = gappy();
    // the reversal is frame 500; half a frame keeps the ends away from frames
    let frames = |text: &str| {
        Window::parse(text)
            .unwrap()
            .resolve_frames(&recording, &ReversalInstants::find_instants(&recording))
            .unwrap()
    };
    assert_eq!(frames("reversal+0.0499..reversal+0.1999"), 750..1500);
    assert_eq!(frames("reversal-0.0501..reversal-0.0001"), 250..500);
    let samples = cut(&recording, "reversal+0.0499..reversal+0.1999");
    assert_eq!(samples.len(), 750);
    let missing = (750..1500).filter(|i| i % 7 == 3 || i % 11 == 5 || (900..940).contains(i)).count();
    assert_eq!(samples.iter().filter(|x| x.is_none()).count(), missing, "a missing frame stays missing");
}

#[test]
fn a_cubic_leaves_a_cycle_on_a_flip_a_hundred_times_larger_intact() {
    for recording in [recording(|_| false, |_| false), gappy()] {
        let found = analyse_spectrum(
            &cut(&recording, "reversal+0.05..reversal+0.20"),
            RATE_HZ,
            &SpectrumSettings::default(),
        )
        .unwrap();
        let c = found.component_in_band(60.0, 100.0).unwrap();
        assert!((c.frequency_hz - TONE_HZ).abs() < 0.05, "{}", c.frequency_hz);
        assert!((c.amplitude_m / TONE_M - 1.0).abs() < 0.01, "{}", c.amplitude_m);
    }
}

#[test]
fn a_window_in_which_nothing_was_tracked_is_refused() {
    let samples = cut(&gappy(), "reversal+0.0801..reversal+0.0879");
    assert_eq!((samples.len(), samples.iter().flatten().count()), (39, 0));
    let refused = analyse_spectrum(&samples, RATE_HZ, &SpectrumSettings::default()).unwrap_err();
    assert_eq!(refused, SpectrumError::TooFew { found: 0, least: 8 });
}

#[test]
fn a_recording_without_a_head_has_no_deflection_and_says_why_it_has_no_reversal() {
    let recording = recording(|_| false, |_| true);
    assert_eq!(Channel::Deflection.samples(&recording), vec![None; FRAMES]);
    assert_eq!(Channel::TipX.samples(&recording).iter().flatten().count(), FRAMES);
    let refused = Window::parse("reversal+0.05..")
        .unwrap()
        .resolve_frames(&recording, &ReversalInstants::find_instants(&recording))
        .unwrap_err()
        .to_string();
    assert_eq!(
        refused,
        "window `reversal+0.05..`: stroke shows no `reversal[1]`: the head was tracked in none of its frames; give the window in seconds of the recording's time"
    );
}
