//! The trace of a synthetic recording gives back the values of its scene, from the middle of the bounds, and
//! also where the tip alone is tracked or points are lost.

use wiperlab::fit::job::Job;
use wiperlab::fit::result::{FitResult, FitStatus};
use wiperlab::fit::uncertainty::ParameterVerdict;
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::model::parameters::find_parameter;
use wiperlab::recording::{FrameGrid, Recording};
use wiperlab::simulate::SolverOptions;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::sensitivity::{TangentObserver, TangentSeeds, TangentSegment, run_with_tangents};
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
nuisance = "exact"

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

/// All parameters are identified. Each estimate is within 1 % of the value of the scene, and this value lies
/// in the 99.7 % interval.
fn assert_found(result: &FitResult, scene: &Scene) {
    let misfit = result.misfit.as_ref().unwrap();
    assert!(misfit.explained, "{:?}", misfit.reasons);
    assert_eq!(result.status, FitStatus::Converged);
    for (name, found) in &result.parameters {
        let truth = scene.value(name).unwrap();
        assert_eq!(found.verdict, ParameterVerdict::Identified, "{name}: {:?}", found.reasons);
        let (lower, upper) = (found.lower_95.unwrap(), found.upper_95.unwrap());
        let half = 1.5 * 0.5 * (upper - lower);
        assert!((found.estimate - truth).abs() < half, "{name}: {lower} to {upper} for {truth}");
        assert!((found.estimate / truth - 1.0).abs() < 0.01, "{name}: {} for {truth}", found.estimate);
    }
}

#[test]
fn a_trace_gives_back_the_values_from_the_middle_of_wide_bounds() {
    assert_found(&fitted("", recording()), &scene());
}

#[test]
fn the_tip_alone_is_enough() {
    assert_found(&fitted("channels = [\"tip-x\"]\n", recording()), &scene());
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
    assert_found(&fitted("", lost), &scene());
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
    assert_found(&found, &scene());
    let drift = found.nuisances.iter().find(|nuisance| nuisance.name == "drift_x_m_per_s").unwrap();
    let (lower, upper) = (drift.lower_95.unwrap(), drift.upper_95.unwrap());
    assert!(lower < CREEP && CREEP < upper && upper - lower < CREEP, "{lower} to {upper}");
    assert!(fitted("", recording()).nuisances.iter().all(|nuisance| !nuisance.name.starts_with("drift")));
}

/// The zero of a real picture may be anywhere, for example at the bottom of the frame, far below the glass.
#[test]
fn the_zero_of_the_picture_does_not_matter() {
    let whole = recording();
    let mut traces = whole.traces().clone();
    for column in [&mut traces.tip_y_m, &mut traces.head_y_m] {
        column.iter_mut().flatten().for_each(|y| *y += 0.1);
    }
    let [moved, before] =
        [Recording::new("twin", whole.grid(), traces, true).unwrap(), whole].map(|film| fitted("", film));
    assert_found(&moved, &scene());
    for (name, found) in &moved.parameters {
        let half = 0.5 * (found.upper_95.unwrap() - found.lower_95.unwrap());
        assert!((found.estimate - before.parameters[name].estimate).abs() < 0.05 * half, "{name}");
    }
}

/// On curved glass, the head appears nearer to the centre of the arc, and its height in the picture changes
/// towards the ends. The second glass curves the other way. Its picture is also turned, and the marker of the
/// head is above the hinge.
#[test]
fn a_curved_glass_does_not_matter() {
    let whole = recording();
    let scene = scene();
    let glass_y_m = -(scene.linkage.l1_m + scene.linkage.l2_m);
    for (radius_m, tilt_rad, above_m) in [(1.0, 0.0_f64, 0.0), (-0.6, 0.03, 4e-4)] {
        let mut traces = whole.traces().clone();
        let points = [
            (&mut traces.tip_x_m, &mut traces.tip_y_m, 0.0),
            (&mut traces.head_x_m, &mut traces.head_y_m, above_m),
        ];
        for (xs, ys, above_m) in points {
            for (x, y) in xs.iter_mut().flatten().zip(ys.iter_mut().flatten()) {
                let (angle, from_centre) = (*x / radius_m, radius_m - (*y + above_m - glass_y_m));
                let (along, up) = (from_centre * angle.sin(), radius_m - from_centre * angle.cos());
                *x = along * tilt_rad.cos() - up * tilt_rad.sin();
                *y = glass_y_m + along * tilt_rad.sin() + up * tilt_rad.cos();
            }
        }
        let result = fitted("", Recording::new("twin", whole.grid(), traces, true).unwrap());
        assert_found(&result, &scene);
    }
}

/// A preload that is five prior deviations off does not make a wrong value identified: the value of the scene
/// is within four deviations of the estimate, or the estimate is not identified.
#[test]
fn a_constant_far_outside_its_prior_identifies_nothing_wrong() {
    let preload = "blade.preload_force_n";
    let wrong = scene().with_parameter(preload, 1.3 * scene().value(preload).unwrap()).unwrap();
    let job = Job::parse("job.toml", &JOB.replace("nuisance = \"exact\"\n", "")).unwrap();
    let measured = MeasuredRecording { recording: recording(), exposure_s: Some(CAMERA.exposure_s) };
    let result = Problem::new(job, vec![wrong], vec![measured]).unwrap().fit().unwrap();
    assert!(result.nuisances.iter().any(|nuisance| nuisance.name == preload));
    for (name, found) in &result.parameters {
        if found.verdict == ParameterVerdict::Identified {
            let sd = (found.upper_95.unwrap() / found.lower_95.unwrap()).ln() / (2.0 * 1.96);
            let truth = scene().value(name).unwrap();
            assert!((found.estimate / truth).ln().abs() < 4.0 * sd, "{name}: {found:?}");
        } else {
            assert!(!found.reasons.is_empty(), "{name}");
        }
    }
}

/// Angles of the lip at given instants of a run, which are in rising order.
struct LipAngles {
    times_s: Vec<f64>,
    angles: Vec<f64>,
}

impl TangentObserver for LipAngles {
    fn observe_segment(&mut self, piece: &TangentSegment<'_>) {
        while let Some(time) = self.times_s.get(self.angles.len()).filter(|time| **time <= piece.end_s) {
            self.angles.push(piece.sample_at(time.max(piece.start_s)).pose.phi);
        }
    }
}

#[test]
fn a_marker_that_is_beside_the_edge_of_the_lip_turns_with_the_lip() {
    let (along_m, across_m) = (2e-4, -1e-4);
    let whole = recording();
    let (mut traces, grid) = (whole.traces().clone(), whole.grid());
    let times_s: Vec<f64> = (0..grid.frames).map(|i| grid.time_s(i)).collect();
    let mut seen = LipAngles { times_s, angles: Vec::new() };
    let nothing = TangentSeeds::new(&scene(), &[]).unwrap();
    run_with_tangents(&scene(), SolverOptions::new(1e-8), &nothing, &mut seen);
    assert_eq!(seen.angles.len(), grid.frames);
    for (x, angle) in traces.tip_x_m.iter_mut().zip(&seen.angles) {
        *x = x.map(|x| x + along_m * angle.sin() + across_m * angle.cos());
    }
    let found = fitted("", Recording::new("twin", grid, traces, true).unwrap());
    assert_found(&found, &scene());
    for (name, truth) in [("tip_along_lip_m", along_m), ("tip_across_lip_m", across_m)] {
        let marker = found.nuisances.iter().find(|nuisance| nuisance.name == name).unwrap();
        let half = 0.5 * (marker.upper_95.unwrap() - marker.lower_95.unwrap());
        assert!((marker.estimate - truth).abs() < 1.5 * half && half < 5e-5, "{name}: {marker:?}");
    }
}

/// Factor by which a quantity with this unit changes if lengths grow by `length` and times by `time`, and
/// densities stay the same.
fn unit_factor(unit: &str, length: f64, time: f64) -> f64 {
    let (mass, force) = (length.powi(3), length.powi(4) / time.powi(2));
    match unit {
        "1" | "rad" => 1.0,
        "Hz" => 1.0 / time,
        "m" => length,
        "kg" => mass,
        "kg m2" | "kg m^2" => mass * length * length,
        "N" => force,
        "N/m" => force / length,
        "N s/m" => force * time / length,
        "N m/rad" => force * length,
        "N m s/rad" => force * length * time,
        "s/m" => time / length,
        other => panic!("{other}"),
    }
}

/// A blade in other units of length and time is the same blade, so its fit takes the same course.
#[test]
fn blades_of_other_sizes_and_speeds_are_fitted_like_the_usual_one() {
    for (length, time) in [(10.0, 10.0), (0.1, 0.3), (1.0, 30.0)] {
        let whole = recording();
        let grid = whole.grid();
        let slower =
            FrameGrid { start_s: grid.start_s * time, frame_rate_hz: grid.frame_rate_hz / time, ..grid };
        let mut traces = whole.traces().clone();
        for column in [&mut traces.tip_x_m, &mut traces.tip_y_m, &mut traces.head_x_m, &mut traces.head_y_m] {
            column.iter_mut().flatten().for_each(|x| *x *= length);
        }
        let factor = |name: &str| unit_factor(find_parameter(name).unwrap().unit, length, time);
        let mut other = scene();
        // a centre of mass must lie on its link, so lengths are set first if they grow, and last if they
        // shrink
        let mut values: Vec<(&str, f64)> = scene().written_values().collect();
        values.sort_by_key(|(name, _)| name.ends_with("_length_m") != (length > 1.0));
        for (name, value) in values {
            other = other.with_parameter(name, value * factor(name)).unwrap();
        }
        (other.start_s, other.run.stop_s) = (other.start_s * time, other.run.stop_s * time);
        let stiffer = |end: f64| end * factor("blade.neck_stiffness_n_m_per_rad");
        let job = JOB.replace("0.0009", &stiffer(0.0009).to_string());
        let job = Job::parse("job.toml", &job.replace("0.0038", &stiffer(0.0038).to_string())).unwrap();
        let film = Recording::new("twin", slower, traces, true).unwrap();
        let measured = MeasuredRecording { recording: film, exposure_s: Some(CAMERA.exposure_s * time) };
        let result = Problem::new(job, vec![other], vec![measured]).unwrap().fit().unwrap();
        assert!(result.misfit.as_ref().unwrap().explained, "{length} {time}: {:?}", result.misfit);
        for (name, found) in &result.parameters {
            assert_eq!(
                found.verdict,
                ParameterVerdict::Identified,
                "{length} {time} {name}: {:?}",
                found.reasons
            );
            let truth = scene().value(name).unwrap() * factor(name);
            assert!(
                (found.estimate / truth - 1.0).abs() < 0.01,
                "{length} {time} {name}: {}",
                found.estimate
            );
        }
    }
}

/// A blade whose neck and lip are always within 0.1 rad of one line. Lean and drop do not determine its
/// state, and near the middle of the bounds of [`STRAIGHT_JOB`] its tip jams.
const STRAIGHT_SCENE: &str = r#"format = 1
title = "Straight blade"

[blade]
head_mass_kg = 9e-4
neck_mass_kg = 1e-4
lip_mass_kg = 9e-5
neck_length_m = 0.0025
lip_length_m = 0.002
neck_centre_m = 0.00125
lip_centre_m = 0.0008
neck_inertia_kg_m2 = 5.2e-11
lip_inertia_kg_m2 = 2e-11
head_natural_frequency_hz = 9.4
neck_natural_frequency_hz = 450.0
lip_natural_frequency_hz = 1200.0
head_damping_ratio = 0.34
neck_damping_ratio = 0.047
lip_damping_ratio = 0.033
preload_force_n = 0.23

[friction]
a = 0.12
b_s_per_m = 8.5
c = 0.4

[drive]
amplitude_m = 0.023
frequency_hz = 1.17

[start]
time_s = 0.32
kind = "steady-slide"

[run]
stop_s = 0.66
sample_rate_hz = 10000.0
relative_tolerance = 1e-8
outputs = ["trace"]
"#;

const STRAIGHT_JOB: &str = r#"format = 1
title = "Recovery of a straight blade"
scene = "scene.toml"
seed = 1
nuisance = "exact"

[[recording]]
path = "twin"

[[parameter]]
name = "friction.c"
lower = 0.16
upper = 1.7
scale = "log"

[[parameter]]
name = "blade.neck_natural_frequency_hz"
lower = 220.0
upper = 750.0
scale = "log"

[[trace]]
"#;

#[test]
fn a_straight_blade_is_fitted_from_where_its_tip_jams() {
    let scene = Scene::parse("scene.toml", STRAIGHT_SCENE).unwrap();
    let seen = film_scene(&scene, &CAMERA, 0.33, 0.65, SolverOptions::new(1e-8)).unwrap();
    let recording = add_tracking_noise(&seen.recording, "twin", &TRACKING).unwrap();
    let measured = MeasuredRecording { recording, exposure_s: Some(CAMERA.exposure_s) };
    let job = Job::parse("job.toml", STRAIGHT_JOB).unwrap();
    let problem = Problem::new(job, vec![scene.clone()], vec![measured]).unwrap();
    assert_found(&problem.fit().unwrap(), &scene);
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
