//! The trace of a synthetic recording gives back the values of its scene, from the middle of the bounds, and
//! also where the tip alone is tracked or points are lost.

use wiperlab::fit::job::Job;
use wiperlab::fit::result::{FitResult, FitStatus};
use wiperlab::fit::uncertainty::ParameterVerdict;
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::recording::Recording;
use wiperlab::simulate::SolverOptions;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::{Camera, TrackingModel, add_tracking_noise, film_scene};

const SCENE: &str = include_str!("../../../data/scenes/actual-blade.toml");
/// A fifth of a second around the flip.
const SPAN_S: [f64; 2] = [0.58, 0.8];
const CAMERA: Camera = Camera { frame_rate_hz: 5_000.0, exposure_s: 5e-5 };
/// A tenth of a pixel of 20 um.
const TRACKING: TrackingModel =
    TrackingModel { metres_per_pixel: 2e-5, noise_px: 0.1, dropout_fraction: 0.02, seed: 3 };

/// Two parameters far from the scene's values in the middle of their bounds.
const JOB: &str = r#"format = 1
title = "Recovery of a trace"
scene = "scene.toml"
seed = 1

[[recording]]
path = "twin"

[[parameter]]
name = "friction.c"
lower = 0.1
upper = 0.6
scale = "log"

[[parameter]]
name = "blade.neck_stiffness_n_m_per_rad"
lower = 0.0009
upper = 0.0038
scale = "log"

[[trace]]
"#;

fn scene() -> Scene {
    Scene::parse("actual-blade.toml", SCENE).unwrap()
}

fn recording() -> Recording {
    let scene = scene();
    let effort = SolverOptions::new(scene.run.relative_tolerance);
    let seen = film_scene(&scene, &CAMERA, SPAN_S[0], SPAN_S[1], effort).unwrap();
    add_tracking_noise(&seen.recording, "twin", &TRACKING).unwrap()
}

fn fitted(keys: &str, recording: Recording) -> FitResult {
    let job = Job::parse("job.toml", &format!("{JOB}{keys}")).unwrap();
    let measured = MeasuredRecording { recording, exposure_s: Some(CAMERA.exposure_s) };
    Problem::new(job, vec![scene()], vec![measured]).unwrap().fit().unwrap()
}

/// The values of the scene lie inside intervals of 99.7 % and within a hundredth.
fn assert_found(result: &FitResult) {
    let misfit = result.misfit.as_ref().unwrap();
    assert!(misfit.explained, "{:?}", misfit.reasons);
    assert_eq!(result.status, FitStatus::Converged);
    for (name, found) in &result.parameters {
        let truth = scene().value(name).unwrap();
        assert_eq!(found.verdict, ParameterVerdict::Identified, "{name}: {:?}", found.reasons);
        let (lower, upper) = (found.lower_95.unwrap(), found.upper_95.unwrap());
        let half = 1.5 * 0.5 * (upper - lower);
        assert!((found.estimate - truth).abs() < half, "{name}: {lower} to {upper} for {truth}");
        assert!((found.estimate / truth - 1.0).abs() < 0.01, "{name}: {} for {truth}", found.estimate);
    }
}

#[test]
fn a_trace_gives_back_the_values_from_the_middle_of_wide_bounds() {
    assert_found(&fitted("", recording()));
}

#[test]
fn the_tip_alone_is_enough() {
    assert_found(&fitted("channels = [\"tip-x\"]\n", recording()));
}

#[test]
fn every_third_point_may_be_lost() {
    let whole = recording();
    let mut traces = whole.traces().clone();
    for column in [&mut traces.tip_x_m, &mut traces.tip_y_m] {
        column.iter_mut().enumerate().filter(|(i, _)| i * 7 % 10 < 3).for_each(|(_, x)| *x = None);
    }
    for column in [&mut traces.head_x_m, &mut traces.head_y_m] {
        column.iter_mut().enumerate().filter(|(i, _)| i * 3 % 10 < 3).for_each(|(_, x)| *x = None);
    }
    let lost = Recording::new("twin", whole.grid(), traces, true).unwrap();
    assert_found(&fitted("", lost));
}

#[test]
fn a_marker_that_drifts_is_found_where_that_is_asked_for() {
    /// Speed at which the tip's marker creeps along the sweep, m/s.
    const CREEP: f64 = 2e-4;
    let whole = recording();
    let (mut traces, grid) = (whole.traces().clone(), whole.grid());
    let moved = |(i, x): (usize, &mut Option<f64>)| *x = x.map(|x| x + CREEP * i as f64 / grid.frame_rate_hz);
    traces.tip_x_m.iter_mut().enumerate().for_each(moved);
    let found = fitted(
        "camera = { drift_sd_m_per_s = 0.001 }\n",
        Recording::new("twin", grid, traces, true).unwrap(),
    );
    assert_found(&found);
    let drift = found.nuisances.iter().find(|nuisance| nuisance.name == "drift_x_m_per_s").unwrap();
    let (lower, upper) = (drift.lower_95.unwrap(), drift.upper_95.unwrap());
    assert!(lower < CREEP && CREEP < upper && upper - lower < CREEP, "{lower} to {upper}");
    assert!(fitted("", recording()).nuisances.iter().all(|nuisance| !nuisance.name.starts_with("drift")));
}

#[test]
fn a_scene_of_another_time_does_not_drive_a_trace() {
    let mut early = scene();
    (early.start_s, early.run.stop_s) = (-2.0, -1.0);
    let job = Job::parse("job.toml", &format!("{JOB}drive = \"scene\"\n")).unwrap();
    let measured = MeasuredRecording { recording: recording(), exposure_s: Some(CAMERA.exposure_s) };
    let said = Problem::new(job, vec![early], vec![measured]).map(|_| ()).unwrap_err().to_string();
    assert!(said.contains("`drive`: found \"scene\", whose head runs from -2 to -1 s"), "{said}");
}

/// `cargo run --release --example recovery` fits traces with the parameters of this job.
#[test]
fn the_job_of_the_recovery_study_fits_traces() {
    let job = include_str!("../../../examples/recovery/job.toml");
    let (parameters, _) = job.split_once("[[component]]").unwrap();
    let job = Job::parse("job.toml", &format!("{parameters}\n[[trace]]\n")).unwrap();
    assert_eq!((job.traces.len(), job.parameters.len()), (1, 5));
}
