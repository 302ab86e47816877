//! A known truth is recovered: a twin of the bundled scene, seen, tracked and fitted with two parameters
//! free.

use std::ops::ControlFlow;
use wiperlab::fit::job::Job;
use wiperlab::fit::journal::FitProgress;
use wiperlab::fit::result::{FitResult, FitStatus};
use wiperlab::fit::uncertainty::ParameterVerdict;
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::recording::Recording;
use wiperlab::simulate::SolverOptions;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::{Camera, TrackingModel, add_tracking_noise, film_scene};

const SCENE: &str = include_str!("../../../data/scenes/actual-blade.toml");
const CAMERA: Camera = Camera { frame_rate_hz: 5000.0, exposure_s: 5e-5 };
/// A tenth of a pixel of 20 um.
const NOISE_M: f64 = 2e-6;
/// Not the values of the scene: a search that starts from the scene itself would be found out.
const TRUTH: [(&str, f64); 2] = [("friction.c", 0.31), ("shoulder.contact_angle_rad", 0.101)];

const JOB: &str = r#"format = 1
title = "Recovery"
scene = "scene.toml"
seed = 5

[[recording]]
path = "twin"

[[parameter]]
name = "friction.c"
lower = 0.26
upper = 0.36
scale = "log"

[[parameter]]
name = "shoulder.contact_angle_rad"
lower = 0.088
upper = 0.116
scale = "log"

[[component]]
name = "low"
channel = "head-drop"
window = "release+0.01..release+0.2"
band_hz = [40.0, 140.0]

[[feature]]
name = "release"
kind = "release-after-reversal"
sd_relative = 0.01

[[feature]]
name = "before"
kind = "mean-deflection"
window = "reversal-0.1..reversal-0.06"
sd_relative = 0.005

[[feature]]
name = "after"
kind = "mean-deflection"
window = "release+0.1..release+0.2"
sd_relative = 0.005

[search]
global_evaluations = 60
local_evaluations = 500
particles = 10
starts = 3
"#;

fn twin(scene: &Scene) -> Recording {
    let truth =
        TRUTH.iter().fold(scene.clone(), |scene, (name, value)| scene.with_parameter(name, *value).unwrap());
    let seen = film_scene(
        &truth,
        &CAMERA,
        truth.start_s,
        truth.run.stop_s,
        SolverOptions::new(truth.run.relative_tolerance),
    )
    .unwrap();
    add_tracking_noise(
        &seen.recording,
        "twin",
        &TrackingModel { metres_per_pixel: 2e-5, noise_px: NOISE_M / 2e-5, dropout_fraction: 0.02, seed: 11 },
    )
    .unwrap()
}

fn recovered(scene: &Scene, recording: Recording) -> (FitResult, usize) {
    let job = Job::parse("job.toml", JOB).unwrap();
    let measured = MeasuredRecording { recording, exposure_s: Some(CAMERA.exposure_s) };
    let problem = Problem::new(job, vec![scene.clone()], vec![measured]).unwrap();
    let mut journal = String::new();
    let mut carry_on = |_: &FitProgress| ControlFlow::Continue(());
    let result = problem.fit_with(&problem.new_context(), &mut journal, &mut carry_on).unwrap();
    (result, journal.lines().count())
}

#[test]
fn two_parameters_of_a_twin_come_back_within_two_percent_and_inside_their_intervals() {
    let scene = Scene::parse("actual-blade.toml", SCENE).unwrap();
    let recording = twin(&scene);
    assert!(recording.is_synthetic());
    let (result, lines) = recovered(&scene, recording);
    assert_ne!(result.status, FitStatus::Failed);
    assert_eq!(lines, 1 + result.evaluations.total, "a header and a line an evaluation");
    // (search 560, gate 25; profiles, twins and searches elsewhere beside)
    assert!(result.evaluations.total <= 1300, "{}", result.evaluations.total);
    assert_eq!(result.rank, 2);
    assert!(result.synthetic && result.components_pass(), "{:?}", result.components);
    for (name, truth) in TRUTH {
        let found = &result.parameters[name];
        assert!((found.estimate / truth - 1.0).abs() < 0.02, "{name}: {} for {truth}", found.estimate);
        assert_eq!(found.verdict, ParameterVerdict::Identified, "{name}");
        let interval = found.lower_95.unwrap()..=found.upper_95.unwrap();
        assert!(interval.contains(&truth), "{name}: {truth} outside {interval:?}");
        assert!(interval.end() / interval.start() < 1.2, "{name}: {interval:?} says next to nothing");
    }
}

/// Two operating conditions at once: the same blade, pressed harder in the second recording.
#[test]
fn two_recordings_of_one_blade_are_fitted_at_once() {
    let scene = Scene::parse("actual-blade.toml", SCENE).unwrap();
    let harder = scene.with_parameter("blade.preload_force_n", 0.14).unwrap();
    let second = "\n[[recording]]\nname = \"harder\"\npath = \"twin-2\"\nset = { \"blade.preload_force_n\" = 0.14 }\n\n[[parameter]]";
    let feature = "[[feature]]\nname = \"after, harder\"\nkind = \"mean-deflection\"\nwindow = \"release+0.1..release+0.2\"\nsd_relative = 0.005\nrecording = \"harder\"\n\n[search]";
    let text = JOB.replacen("\n[[parameter]]", second, 1).replace("[search]", feature)
        + "[intervals]\nprofile = false\nbootstrap = 0\n";
    let job = Job::parse("job.toml", &text).unwrap();
    assert_eq!(job.conditions[1].set, [("blade.preload_force_n".to_owned(), 0.14)]);
    let measured = [twin(&scene), twin(&harder)]
        .map(|recording| MeasuredRecording { recording, exposure_s: Some(CAMERA.exposure_s) });
    let problem = Problem::new(job, vec![scene.clone(), scene], measured.into()).unwrap();
    let result = problem.fit().unwrap();
    for (name, truth) in TRUTH {
        assert!(
            (result.parameters[name].estimate / truth - 1.0).abs() < 0.02,
            "{name}: {} for {truth}",
            result.parameters[name].estimate
        );
    }
    let [soft, hard] =
        ["after", "after, harder"].map(|name| result.features.iter().find(|f| f.name == name).unwrap());
    assert!(hard.target / soft.target > 1.05 && hard.pass && soft.pass, "{soft:?} {hard:?}");
}
