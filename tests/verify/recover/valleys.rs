//! The tip of a blade sticks through the reversal while its neck leaves the shoulder and rings. A neck with
//! one cycle less in this time fits nearly as well. The fit finds the right neck from every start. It does
//! not search for such minima if the head does not reverse.

use wiperlab::fit::job::Job;
use wiperlab::fit::result::{FitResult, FitStatus};
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::simulate::SolverOptions;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::{Camera, TrackingModel, add_tracking_noise, film_scene};

const SCENE: &str = r#"format = 1
title = "A blade whose neck leaves its shoulder"
[blade]
head_mass_kg = 0.006
neck_mass_kg = 1.5e-4
lip_mass_kg = 6e-5
neck_length_m = 0.004
lip_length_m = 0.0017
neck_centre_m = 0.002
lip_centre_m = 0.0007
neck_inertia_kg_m2 = 2e-10
lip_inertia_kg_m2 = 1e-11
head_natural_frequency_hz = 12.0
neck_natural_frequency_hz = 160.0
lip_natural_frequency_hz = 700.0
head_damping_ratio = 0.05
neck_damping_ratio = 0.03
lip_damping_ratio = 0.06
preload_force_n = 0.28
[shoulder]
contact_angle_rad = 0.1
stiffness_ratio = 8.0
[friction]
a = 0.075
b_s_per_m = 6.0
c = 0.28
[drive]
amplitude_m = 0.036
frequency_hz = 0.8
[start]
time_s = 0.525
kind = "steady-slide"
[run]
stop_s = 1.0
sample_rate_hz = 10000.0
relative_tolerance = 1e-8
"#;
const CAMERA: Camera = Camera { frame_rate_hz: 5_000.0, exposure_s: 5e-5 };
/// A tenth of a pixel of 20 um.
const TRACKING: TrackingModel =
    TrackingModel { metres_per_pixel: 2e-5, noise_px: 0.1, dropout_fraction: 0.01, seed: 7 };
/// The head turns at 0.625 s, and the tip sticks from 0.628 to 0.708 s.
const WITH_REVERSAL_S: [f64; 2] = [0.54, 0.84];
const WITHOUT_REVERSAL_S: [f64; 2] = [0.73, 0.9];

const JOB: &str = r#"format = 1
title = "Valleys"
scene = "scene.toml"
nuisance = "exact"

[[recording]]
path = "twin"
drive = "recording"

[[parameter]]
name = "friction.a"
lower = 0.035
upper = 0.2
scale = "log"

[[parameter]]
name = "friction.b_s_per_m"
lower = 1.8
upper = 18.0
scale = "log"

[[parameter]]
name = "friction.c"
lower = 0.07
upper = 1.2
scale = "log"

[[parameter]]
name = "blade.neck_natural_frequency_hz"
lower = 70.0
upper = 230.0
scale = "log"

[[parameter]]
name = "shoulder.stiffness_ratio"
lower = 2.0
upper = 36.0
scale = "log"

[[trace]]
"#;

fn fitted(seed: u64, [from_s, to_s]: [f64; 2]) -> FitResult {
    let scene = Scene::parse("scene.toml", SCENE).unwrap();
    let effort = SolverOptions::new(scene.run.relative_tolerance);
    let seen = film_scene(&scene, &CAMERA, from_s, to_s, effort).unwrap();
    let recording = add_tracking_noise(&seen.recording, "twin", &TRACKING).unwrap();
    let job =
        Job::parse("job.toml", &JOB.replace("\n[[recording]]", &format!("seed = {seed}\n\n[[recording]]")));
    let measured = MeasuredRecording { recording, exposure_s: Some(CAMERA.exposure_s) };
    Problem::new(job.unwrap(), vec![scene], vec![measured]).unwrap().fit().unwrap()
}

#[test]
fn every_start_finds_the_neck_among_the_cycles_of_its_ringing() {
    for seed in [1, 3] {
        let result = fitted(seed, WITH_REVERSAL_S);
        let misfit = result.misfit.as_ref().unwrap();
        assert!(misfit.explained, "{:?}", misfit.reasons);
        assert_eq!(result.status, FitStatus::Converged);
        let neck = &result.parameters["blade.neck_natural_frequency_hz"];
        assert!((neck.estimate / 160.0 - 1.0).abs() < 0.02, "{}", neck.estimate);
        // the only allowed doubt is a neck with another number of cycles that the recording does not clearly
        // exclude
        assert!(neck.reasons.iter().all(|reason| reason.starts_with("another minimum, with ")), "{neck:?}");
        assert!(result.waterfall.len() > 2, "two starts, and minima of the long segment");
    }
}

#[test]
fn nothing_is_enumerated_where_the_head_does_not_reverse() {
    let result = fitted(1, WITHOUT_REVERSAL_S);
    assert_eq!(result.status, FitStatus::Converged);
    assert_eq!(result.waterfall.len(), 2, "two starts");
}
