//! The head's motion from a recording: exact where it can be, then against the noise, then on the blade.

use crate::scenes::seen;
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::simulate::drive::{HeadSpline, smooth_head_motion};
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::outputs::Transitions;
use wiperlab::simulate::scene::{Drive, Scene, StartKind};
use wiperlab::simulate::{
    IntegrationMethod, Observer, RunStatus, SolutionSegment, SolverOptions, Transition, run_scene_with,
};

const SCENE: &str = include_str!("../fixtures/light-blade.toml");
const COSINE: &str = "amplitude_m = 0.0138\nfrequency_hz = 0.915";

fn cosine() -> Drive {
    Drive::Cosine { amplitude_m: 0.0138, frequency_hz: 0.915, delay_s: 0.0 }
}

/// A recording of a head, nothing else tracked.
fn recording(grid: FrameGrid, head_x_m: Vec<Option<f64>>) -> Recording {
    let nothing = vec![None; grid.frames];
    let traces = Traces {
        tip_x_m: nothing.clone(),
        tip_y_m: nothing.clone(),
        head_x_m,
        head_y_m: nothing,
        ..Traces::default()
    };
    Recording::new("the head", grid, traces, true).unwrap()
}

fn of_cosine(start_s: f64, stop_s: f64, frame_rate_hz: f64) -> Recording {
    let grid = FrameGrid {
        start_s,
        frame_rate_hz,
        frames: ((stop_s - start_s) * frame_rate_hz).round() as usize + 1,
    };
    recording(grid, (0..grid.frames).map(|i| Some(cosine().motion_at(grid.time_s(i)).position_m)).collect())
}

/// Root mean square and largest errors of position, velocity and acceleration against the cosine, over part
/// of the recorded time.
fn errors(spline: &HeadSpline, margin_s: f64) -> [[f64; 2]; 3] {
    let [first, last] = spline.span_s();
    let (from, to) = (first + margin_s, last - margin_s);
    let count = 4001;
    let mut found = [[0.0f64; 2]; 3];
    for i in 0..count {
        let t = from + (to - from) * i as f64 / (count - 1) as f64;
        let (is, should) = (spline.motion_at(t), cosine().motion_at(t));
        let off = [
            is.position_m - should.position_m,
            is.velocity_m_per_s - should.velocity_m_per_s,
            is.acceleration_m_per_s2 - should.acceleration_m_per_s2,
        ];
        for (found, off) in found.iter_mut().zip(off) {
            *found = [found[0] + off * off / count as f64, found[1].max(off.abs())];
        }
    }
    found.map(|[square, largest]| [square.sqrt(), largest])
}

/// Without noise the spline is an interpolant of order 4, its acceleration one of order 2.
#[test]
fn without_noise_the_errors_fall_with_the_frame_rate_as_a_cubic_splines_do() {
    let worst = |rate: f64| {
        errors(&smooth_head_motion(&of_cosine(0.1, 0.9, rate)).unwrap(), 0.1).map(|[_, largest]| largest)
    };
    let (coarse, fine) = (worst(125.0), worst(250.0));
    for (k, least) in [(0, 2.7), (1, 2.7), (2, 1.8)] {
        let order = (coarse[k] / fine[k]).log2();
        assert!(order > least, "derivative {k}: order {order}, from {coarse:?} to {fine:?}");
    }
}

/// One stroke at 2000 frames/s, noise of 2 um: a tenth of a pixel of 20 um.
#[test]
fn of_a_noisy_stroke_the_position_is_within_the_noise_and_the_acceleration_within_three_percent() {
    const NOISE_M: f64 = 2e-6;
    let (largest_velocity, largest_acceleration) = (0.0794, 0.456); // a omega, a omega^2
    for seed in 0..5 {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
        let clean = of_cosine(0.1, 0.9, 2000.0);
        let seen = |x: &Option<f64>| {
            let (lost, noise): (f64, f64) = (generator.random(), generator.sample(StandardNormal));
            x.filter(|_| lost > 0.02).map(|x| x + NOISE_M * noise)
        };
        let head_x_m = clean.traces().head_x_m.iter().map(seen).collect();
        let spline = smooth_head_motion(&recording(clean.grid(), head_x_m)).unwrap();
        let [position, velocity, acceleration] = errors(&spline, 0.0);
        assert!(
            position[0] < 0.5 * NOISE_M && position[1] < 2.0 * NOISE_M,
            "seed {seed}: position {position:?}"
        );
        assert!(velocity[0] < 2e-3 * largest_velocity, "seed {seed}: velocity {velocity:?}");
        assert!(
            acceleration[1] < 0.2 * largest_acceleration,
            "seed {seed}: acceleration {acceleration:?}, ends included"
        );
        let [_, _, inside] = errors(&spline, 0.05);
        assert!(
            inside[0] < 0.03 * largest_acceleration,
            "seed {seed}: acceleration {inside:?} away from the ends"
        );
    }
}

fn transitions(scene: &Scene, effort: SolverOptions) -> Vec<Transition> {
    let mut list = Transitions::default();
    assert_eq!(run_scene_with(scene, effort, &mut list).status, RunStatus::Completed);
    list.0
}

/// The light blade upright at 0.05 s, when the head moves: at rest the least error of its velocity would
/// decide between stick and slip.
fn moving() -> String {
    SCENE.replace("time_s = 0.0", "time_s = 0.05")
}

fn driven_by(recording: &Recording) -> Scene {
    let text = moving().replace(COSINE, "recording = \"data/head\"");
    let read = |path: &str| {
        assert_eq!(path, "data/head");
        Ok(recording.clone())
    };
    Scene::parse_with_recording("scene.toml", &text, read).unwrap()
}

/// The blade follows a recording of its cosine through the same transitions, closer with every doubling of
/// the rate.
#[test]
fn a_noiseless_recording_of_the_cosine_gives_the_transitions_of_the_cosine() {
    let effort = SolverOptions::new(1e-11);
    let expected = transitions(&Scene::parse("scene.toml", &moving()).unwrap(), effort);
    assert!(expected.len() > 40, "{}", expected.len());
    let worst = |rate: f64| {
        let list = transitions(&driven_by(&of_cosine(0.0, 0.3, rate)), effort);
        assert!(
            list.iter().map(|t| (t.from, t.to)).eq(expected.iter().map(|t| (t.from, t.to))),
            "at {rate} frames/s"
        );
        list.iter().zip(&expected).map(|(a, b)| (a.time_s - b.time_s).abs()).fold(0.0, f64::max)
    };
    let found = [125.0, 250.0, 500.0].map(worst);
    assert!(found[0] < 1e-6 && found[1] < found[0] / 4.0 && found[2] < found[1] / 4.0, "{found:?}");
}

/// The pieces of a run, with the tip's place in stick.
#[derive(Default)]
struct Pieces {
    ends: Vec<[f64; 2]>,
    drift_m: f64,
}

impl Observer for Pieces {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.ends.push([piece.start_s, piece.end_s]);
        if piece.mode == TipMode::Stick {
            self.drift_m = self.drift_m.max(piece.sample_at(piece.end_s).constraint_drift_m.abs());
        }
    }
}

#[test]
fn no_step_leads_across_a_knot_and_both_methods_agree() {
    let scene = driven_by(&of_cosine(0.0, 0.25, 2000.0));
    let mut lists = vec![];
    for method in [IntegrationMethod::Taylor, IntegrationMethod::RungeKutta] {
        let (mut list, mut pieces) = (Transitions::default(), Pieces::default());
        run_scene_with(
            &scene,
            SolverOptions { method, ..SolverOptions::new(1e-10) },
            &mut (&mut list, &mut pieces),
        );
        for [start, end] in pieces.ends {
            let next = scene.drive.next_break(start).unwrap_or(f64::INFINITY);
            assert!(end <= next, "{method:?}: a step from {start} to {end} across {next}");
        }
        assert!(pieces.drift_m < 1e-15, "{method:?}: {:e} m", pieces.drift_m);
        lists.push(list.0);
    }
    assert_eq!(lists[0].len(), lists[1].len());
    let apart = lists[0].iter().zip(&lists[1]).map(|(a, b)| (a.time_s - b.time_s).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-8, "{apart:e} s");
    assert!(seen(&scene, 1e-10).audit.energy_residual_relative() < 1e-8);
}

fn refusal(text: &str, read: impl FnOnce(&str) -> Result<Recording, String>) -> String {
    Scene::parse_with_recording("scene.toml", text, read).unwrap_err().to_string()
}

#[test]
fn what_a_recording_cannot_drive_is_refused() {
    let text = SCENE.replace(COSINE, "recording = \"data/head\"");
    let short = refusal(&text, |_| Ok(of_cosine(0.05, 0.2, 1000.0)));
    assert_eq!(
        short,
        "scene.toml:28: key `drive.recording`: found a run from 0 s to 0.25 s, expected one within the 0.05 s to 0.2 s in which `the head` tracks the head; change start.time_s and run.stop_s, or take another recording"
    );
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz: 1000.0, frames: 300 };
    let sparse =
        refusal(&text, |_| Ok(recording(grid, (0..300).map(|i| (i % 40 == 0).then_some(0.0)).collect())));
    let expected = "scene.toml:28: key `drive.recording`: found the head's x in 8 of 300 frames of `the head`, expected it in at least 10";
    assert!(sparse.starts_with(expected), "{sparse}");
    let unread = refusal(&text, |_| Err("data/head/trace.csv:3: a bad cell".to_owned()));
    assert_eq!(unread, "scene.toml:28: key `drive.recording`: data/head/trace.csv:3: a bad cell");
    let both = refusal(&SCENE.replace(COSINE, "amplitude_m = 0.01\nrecording = \"data/head\""), |_| {
        panic!("not to be read")
    });
    assert_eq!(
        both,
        "scene.toml:29: key `drive.recording`: found also `drive.amplitude_m`, expected a recording, a constant speed, or amplitude_m and frequency_hz; remove one: both say how the head moves"
    );
    let alone = Scene::parse("scene.toml", &text).unwrap_err().to_string();
    assert!(
        alone.starts_with(
            "scene.toml:28: key `drive.recording`: found \"data/head\", expected amplitude_m and frequency_hz"
        ),
        "{alone}"
    );
    let fitted = driven_by(&of_cosine(0.0, 0.25, 1000.0))
        .with_parameter("drive.amplitude_m", 0.02)
        .unwrap_err()
        .to_string();
    assert!(fitted.contains("key `drive.amplitude_m`: found a recorded drive"), "{fitted}");
}

#[test]
fn a_scene_that_its_recording_drives_runs_while_the_head_is_tracked_and_starts_when_it_moves() {
    let mut slide = Scene::parse("scene", SCENE).unwrap();
    let mut upright = slide.clone();
    slide.start = StartKind::SteadySlide;
    // a head at rest at first: the sine of its speed is 0.2 of the greatest at asin(0.2)/omega
    let recorded = of_cosine(0.0, 0.5, 5000.0);
    let driven = slide.drive_by_recording(&recorded).unwrap();
    let expected_s = 0.2_f64.asin() / (TAU * 0.915);
    assert!((0.0..1e-3).contains(&(driven.start_s - expected_s)), "{} {expected_s}", driven.start_s);
    assert!((driven.run.stop_s - 0.49).abs() < 1e-12 && driven.value("drive.amplitude_m").is_none());
    let speed = driven.drive.motion_at(0.2).velocity_m_per_s;
    assert!((speed / cosine().motion_at(0.2).velocity_m_per_s - 1.0).abs() < 1e-6, "{speed}");
    // any other start is that of the recording, less its uncertain end; the times of the scene do not count
    (upright.start, upright.start_s) = (StartKind::Upright, 7.0);
    let later = upright.drive_by_recording(&of_cosine(0.3, 0.8, 5000.0)).unwrap();
    assert!((later.start_s - 0.31).abs() < 1e-12 && (later.run.stop_s - 0.79).abs() < 1e-12);
    // a head that begins in full motion starts at once
    let moving = slide.drive_by_recording(&of_cosine(0.2, 0.5, 5000.0)).unwrap();
    assert!((moving.start_s - 0.21).abs() < 1e-12);

    let refused = |recording: &Recording| slide.drive_by_recording(recording).unwrap_err().to_string();
    let short = refused(&of_cosine(0.2, 0.219, 5000.0));
    assert!(short.contains("`drive.recording`") && short.contains("film more of the stroke"), "{short}");
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz: 5000.0, frames: 2000 };
    assert!(refused(&recording(grid, vec![None; 2000])).contains("found the head's x in 0 of 2000 frames"));
}
