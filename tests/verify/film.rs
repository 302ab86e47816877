//! A fine trace seen by a camera: against the exact mean of a sinusoid, against the scene itself seen by the
//! same camera, and with the noise and the lost points of a recording.

use crate::scenes::committed;
use short_spectra::sampling::exposure_gain;
use std::f64::consts::{PI, TAU};
use wiperlab::recording::noise::noise_floor;
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::simulate::SolverOptions;
use wiperlab::simulate::twin::film::{
    DropoutPattern, FilmError, LEAST_OVERSAMPLING, film_like_recording, film_trace,
};
use wiperlab::simulate::twin::{Camera, TrackingModel, add_tracking_noise, film_scene};

const AMPLITUDE_M: f64 = 1e-3;
const START_S: f64 = 0.3;

fn trace(rate_hz: f64, frames: usize, place: impl Fn(f64) -> f64) -> Recording {
    let grid = FrameGrid { start_s: START_S, frame_rate_hz: rate_hz, frames };
    let column: Vec<Option<f64>> = (0..frames).map(|i| Some(place(grid.time_s(i)))).collect();
    let traces = Traces {
        tip_x_m: column.clone(),
        tip_y_m: column.clone(),
        head_x_m: column.clone(),
        head_y_m: column,
        ..Traces::default()
    };
    Recording::new("fine", grid, traces, true).unwrap()
}

fn sine(frequency_hz: f64) -> impl Fn(f64) -> f64 {
    move |t| AMPLITUDE_M * (TAU * frequency_hz * t + 0.7).sin()
}

/// Largest distance of the frames between the ends' own from the sine times `part`, in its amplitude.
fn worst(seen: &Recording, frequency_hz: f64, part: f64) -> f64 {
    let x = &seen.traces().tip_x_m;
    let misses =
        (2..x.len() - 2).map(|i| (x[i].unwrap() - part * sine(frequency_hz)(seen.grid().time_s(i))).abs());
    misses.fold(0.0, f64::max) / AMPLITUDE_M
}

#[test]
fn a_sine_keeps_its_frequency_and_phase_and_loses_the_sinc_of_its_exposure() {
    let fine = trace(20_000.0, 4001, sine(900.0));
    for exposure_s in [0.0, 5e-5, 1.3e-4, 2e-4] {
        let seen =
            film_trace(&fine, &Camera { frame_rate_hz: 5000.0, exposure_s }, START_S + 1.7e-5).unwrap();
        assert_eq!(seen.grid(), FrameGrid { start_s: START_S + 1.7e-5, frame_rate_hz: 5000.0, frames: 1000 });
        let error = worst(&seen, 900.0, exposure_gain(900.0, exposure_s));
        assert!(error < 3e-6, "{exposure_s}: {error:e}");
    }
    // more than a whole cycle under the open shutter turns the sine over
    let slow = film_trace(&fine, &Camera { frame_rate_hz: 500.0, exposure_s: 2e-3 }, START_S + 1e-3).unwrap();
    let sinc = (PI * 1.8).sin() / (PI * 1.8);
    assert!(sinc < 0.0 && worst(&slow, 900.0, sinc) < 3e-6, "{:e}", worst(&slow, 900.0, sinc));
}

#[test]
fn at_the_least_rate_the_error_is_the_stated_one() {
    let fine = trace(LEAST_OVERSAMPLING * 5000.0, 4001, |_| 0.0);
    for (frequency_hz, most) in [(2500.0, 1.2e-3), (1250.0, 2e-5), (900.0, 3e-6)] {
        let fine = trace(fine.grid().frame_rate_hz, 4001, sine(frequency_hz));
        let error = worst(
            &film_trace(&fine, &Camera { frame_rate_hz: 4999.0, exposure_s: 0.0 }, START_S + 2.5e-5).unwrap(),
            frequency_hz,
            1.0,
        );
        assert!(error < most && error > most / 4.0, "{frequency_hz} Hz: {error:e}");
    }
}

#[test]
fn a_camera_of_the_same_rate_without_exposure_takes_the_samples() {
    let fine = trace(5000.0, 100, sine(900.0));
    let seen = film_trace(&fine, &Camera { frame_rate_hz: 5000.0, exposure_s: 0.0 }, START_S).unwrap();
    assert_eq!(seen, fine);
    let half = film_trace(&fine, &Camera { frame_rate_hz: 2500.0, exposure_s: 0.0 }, START_S + 2e-4).unwrap();
    assert_eq!(half.grid().frames, 50);
    assert!((0..50).all(|i| half.traces().head_y_m[i] == fine.traces().head_y_m[2 * i + 1]));
}

#[test]
fn the_shutter_at_the_ends_is_cut_to_the_trace() {
    let fine = trace(20_000.0, 401, |t| t);
    let seen = film_trace(&fine, &Camera { frame_rate_hz: 5000.0, exposure_s: 1e-4 }, START_S).unwrap();
    let x = &seen.traces().tip_x_m;
    assert_eq!(x.len(), 101);
    // half of the first exposure shows the first sample: the mean lies an eighth of the exposure further on
    assert!((x[0].unwrap() - START_S - 1.25e-5).abs() < 1e-12);
    assert!((x[50].unwrap() - START_S - 0.01).abs() < 1e-12);
    assert!((x[100].unwrap() - START_S - 0.02 + 1.25e-5).abs() < 1e-12);
}

#[test]
fn a_frame_that_rests_on_a_missing_sample_is_missing() {
    let fine = trace(20_000.0, 401, sine(100.0));
    let mut traces = fine.traces().clone();
    traces.tip_x_m[200] = None;
    let fine = Recording::new("fine", fine.grid(), traces, true).unwrap();
    let seen = film_trace(&fine, &Camera { frame_rate_hz: 5000.0, exposure_s: 5e-5 }, START_S).unwrap();
    let missing: Vec<usize> = (0..101).filter(|i| seen.traces().tip_x_m[*i].is_none()).collect();
    assert_eq!(missing, [50]);
    assert_eq!(seen.traces().tip_y_m.iter().filter(|y| y.is_none()).count(), 0);
}

#[test]
fn what_cannot_be_filmed_is_refused() {
    let fine = trace(10_000.0, 100, sine(900.0));
    let refused = |rate, exposure_s, start_s| {
        film_trace(&fine, &Camera { frame_rate_hz: rate, exposure_s }, start_s).unwrap_err()
    };
    assert_eq!(
        refused(5000.0, 5e-5, START_S).to_string(),
        "fine: found 10000 samples/s, expected at least 20000 for a camera of 5000 frames/s; raise [run] sample_rate_hz in the scene and simulate again"
    );
    assert!(
        matches!(refused(5000.0, 0.0, START_S + 1e-5), FilmError::TooCoarse { .. }),
        "frames between samples"
    );
    assert!(matches!(refused(2e4, 0.0, START_S), FilmError::TooCoarse { .. }));
    assert!(matches!(refused(1000.0, 0.0, 0.0), FilmError::Outside { .. }));
    assert!(matches!(refused(1000.0, 0.0, f64::NAN), FilmError::Outside { .. }));
    for (rate, exposure_s, expected) in [
        (0.0, 0.0, "frame_rate_hz"),
        (f64::NAN, 0.0, "frame_rate_hz"),
        (1e3, 1.1e-3, "exposure_s"),
        (1e3, -1e-9, "exposure_s"),
    ] {
        assert!(
            matches!(refused(rate, exposure_s, START_S), FilmError::Camera { key, .. } if key == expected),
            "{rate} {exposure_s}"
        );
    }
    let short = trace(1e5, 5, sine(900.0));
    let refused =
        film_trace(&short, &Camera { frame_rate_hz: 25_000.0, exposure_s: 1e-6 }, START_S).unwrap_err();
    assert!(matches!(refused, FilmError::TooShort { found: 5, .. }));
}

/// The bundled blade to a few stick-slip cycles after its release: at the least rate a five-hundredth of the
/// tracking noise of 2 um.
#[test]
fn a_fine_simulation_filmed_is_the_scene_seen_by_the_same_camera() {
    let mut scene = committed("actual-blade");
    scene.run.stop_s = 0.8;
    let effort = SolverOptions::new(1e-8);
    let look = |camera: &Camera| {
        film_scene(&scene, camera, scene.start_s, scene.run.stop_s, effort).unwrap().recording
    };
    for (fine_hz, exposure_s, most_m) in
        [(20_000.0, 5e-5, 4e-9), (20_000.0, 2e-4, 4e-9), (80_000.0, 5e-5, 2e-10)]
    {
        let camera = Camera { frame_rate_hz: 5000.0, exposure_s };
        let seen = look(&camera);
        let filmed =
            film_trace(&look(&Camera { frame_rate_hz: fine_hz, exposure_s: 0.0 }), &camera, scene.start_s)
                .unwrap();
        assert_eq!(filmed.grid(), seen.grid());
        // of the first and the last frame a view takes the half that there is, a film holds its first sample
        let inner = 1..seen.grid().frames - 1;
        let apart = |a: &[Option<f64>], b: &[Option<f64>]| {
            inner.clone().map(|i| (a[i].unwrap() - b[i].unwrap()).abs()).fold(0.0, f64::max)
        };
        let (a, b) = (filmed.traces(), seen.traces());
        let worst =
            [apart(&a.tip_x_m, &b.tip_x_m), apart(&a.head_x_m, &b.head_x_m), apart(&a.head_y_m, &b.head_y_m)];
        assert!(worst.iter().all(|x| *x < most_m), "{fine_hz} samples/s, {exposure_s} s: {worst:?}");
    }
}

/// A head that turns 0.1 s after the start and a tip that stays where it is: what counts here is which frames
/// are dropped.
fn turning(rate_hz: f64, frames: usize, turn_s: f64) -> Recording {
    let still = trace(rate_hz, frames, |_| 0.0);
    let head = |t: f64| 0.02 * (PI * (t - turn_s)).cos();
    let head_x_m = (0..frames).map(|i| Some(head(still.grid().time_s(i)))).collect();
    Recording::new("turning", still.grid(), Traces { head_x_m, ..still.traces().clone() }, true).unwrap()
}

const TRACKING: TrackingModel =
    TrackingModel { metres_per_pixel: 2e-5, noise_px: 0.1, dropout_fraction: 0.2, seed: 9 };
const NOISE_M: f64 = 2e-6;

fn sd(values: &[Option<f64>]) -> f64 {
    let present: Vec<f64> = values.iter().flatten().copied().collect();
    (present.iter().map(|x| x * x).sum::<f64>() / present.len() as f64).sqrt()
}

#[test]
fn a_film_like_a_recording_has_its_noise_and_misses_its_frames() {
    let like = add_tracking_noise(&turning(5000.0, 5000, 0.8), "like", &TRACKING).unwrap();
    let filmed = film_like_recording(&turning(20_000.0, 4001, 0.4), &like, 5e-5, 4).unwrap();
    assert_eq!(filmed.dropouts, DropoutPattern::SameFrames);
    assert!(filmed.recording.is_synthetic());
    // the trace turns 0.1 s after its start, the recording 0.5 s after its own
    assert!(
        filmed.recording.grid().frames >= 1000 && filmed.recording.grid().frames <= 1001,
        "{:?}",
        filmed.recording.grid()
    );
    let shift_s = filmed.recording.grid().start_s + 0.4;
    let first = ((shift_s - like.grid().start_s) * 5000.0).round() as usize;
    assert!(first.abs_diff(2000) <= 1, "{first}");
    let same = |film: &[Option<f64>], like: &[Option<f64>]| {
        film.iter().zip(&like[first..]).all(|(a, b)| a.is_none() == b.is_none())
    };
    let (film, of) = (filmed.recording.traces(), like.traces());
    assert!(same(&film.tip_x_m, &of.tip_x_m) && same(&film.head_x_m, &of.head_x_m));
    assert!(film.tip_x_m.iter().any(Option::is_none));
    let measured = noise_floor(&of.tip_x_m).unwrap();
    assert_eq!(filmed.noise_m[0], measured);
    assert!((measured / NOISE_M - 1.0).abs() < 0.1, "{measured}");
    assert!((sd(&film.tip_x_m) / measured - 1.0).abs() < 0.15, "{}", sd(&film.tip_x_m)); // 6 standard errors with 800 frames
    assert_eq!(
        film_like_recording(&turning(20_000.0, 4001, 0.4), &like, 5e-5, 4).unwrap(),
        filmed,
        "a seed gives one film"
    );
    assert_ne!(film_like_recording(&turning(20_000.0, 4001, 0.4), &like, 5e-5, 5).unwrap(), filmed);
}

#[test]
fn without_a_turn_as_many_frames_are_dropped_at_random() {
    let like = add_tracking_noise(&trace(5000.0, 5000, |_| 0.0), "like", &TRACKING).unwrap();
    let filmed = film_like_recording(&turning(20_000.0, 16_001, 0.4), &like, 0.0, 4).unwrap();
    assert_eq!(filmed.dropouts, DropoutPattern::AtRandom);
    let tip = &filmed.recording.traces().tip_x_m;
    assert_eq!(tip.len(), 4001);
    let share = tip.iter().filter(|x| x.is_none()).count() as f64 / 4001.0;
    assert!((share - 0.2).abs() < 6.0 * (0.2_f64 * 0.8 / 4001.0).sqrt(), "{share}");
    assert!(
        tip.iter().zip(&filmed.recording.traces().tip_y_m).all(|(x, y)| x.is_none() == y.is_none()),
        "a point is lost as a whole"
    );
}

#[test]
fn a_column_that_was_not_tracked_is_not_filmed_and_one_without_noise_is_refused() {
    let still = trace(5000.0, 500, |_| 0.0);
    let untracked = Recording::new(
        "like",
        still.grid(),
        Traces { head_y_m: vec![None; 500], ..still.traces().clone() },
        true,
    )
    .unwrap();
    let filmed = film_like_recording(&turning(20_000.0, 4001, 0.4), &untracked, 0.0, 4).unwrap();
    assert!(filmed.recording.traces().head_y_m.iter().all(Option::is_none));
    assert_eq!(filmed.noise_m, [0.0; 4]);
    let gappy: Vec<Option<f64>> = (0..500).map(|i| (i % 3 == 0).then_some(0.0)).collect();
    let gappy =
        Recording::new("like", still.grid(), Traces { tip_y_m: gappy, ..still.traces().clone() }, true)
            .unwrap();
    let refused = film_like_recording(&turning(20_000.0, 4001, 0.4), &gappy, 0.0, 4).unwrap_err().to_string();
    assert!(refused.starts_with("like, column tip_y_m: found too few frames in a row"), "{refused}");
}
