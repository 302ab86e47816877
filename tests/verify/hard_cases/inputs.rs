//! Numbers that are none, and numbers so large or small that products of them leave double precision: refused
//! by the scene, or run to a typed end.

use super::METHODS;
use super::scenes::upright_light_blade;
use wiperlab::model::Pose;
use wiperlab::model::parameters::PARAMETERS;
use wiperlab::simulate::scene::contact::{ContactLossRule, JamRule};
use wiperlab::simulate::scene::{Scene, StartKind};
use wiperlab::simulate::{Observer, RunStatus, SolutionSegment, SolverOptions, run_scene_with};

const LIGHT_BLADE: &str = include_str!("../../fixtures/light-blade.toml");
/// Right-hand sides after which a run counts as done: a hang would show.
const MOST_EVALUATIONS: u64 = 20_000;

#[derive(Default)]
struct Numbers {
    broken: Option<f64>,
}

impl Observer for Numbers {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        let end = piece.sample_at(piece.end_s);
        let numbers =
            [end.pose.theta, end.pose.phi, end.pose.theta_rate, end.pose.phi_rate, end.tip_x_m, end.normal_n];
        if self.broken.is_none() && !numbers.iter().all(|x| x.is_finite()) {
            self.broken = Some(piece.end_s);
        }
    }
}

/// Runs a scene by every method; a run that says it is complete has finite numbers throughout.
fn assert_ends(what: &str, scene: &Scene) {
    for method in METHODS {
        for relative in [1e-4, 1e-8, 1e-12] {
            let mut numbers = Numbers::default();
            let effort =
                SolverOptions { method, most_evaluations: MOST_EVALUATIONS, ..SolverOptions::new(relative) };
            let run = run_scene_with(scene, effort, &mut numbers);
            assert!(
                run.status != RunStatus::Completed || numbers.broken.is_none(),
                "{what}, {method:?} at {relative:e}: no number at {:?} s",
                numbers.broken
            );
            // the bound is looked at before every step; a step and its event cost less than this
            assert!(
                run.work.rhs_evaluations < MOST_EVALUATIONS + 2_000,
                "{what}, {method:?} at {relative:e}: {:?}",
                run.work
            );
        }
    }
}

/// Every parameter of the light blade at every extreme: refused with its name, or run to a typed end.
#[test]
fn no_parameter_however_extreme_panics_hangs_or_goes_unnoticed() {
    let mut refused = 0;
    for parameter in PARAMETERS {
        for value in [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            -1.0,
            0.0,
            1e-300,
            1e-100,
            1e-12,
            1e12,
            1e100,
            1e300,
            f64::MAX,
        ] {
            let what = format!("{} = {value:e}", parameter.name);
            let scene = match upright_light_blade().with_parameter(parameter.name, value) {
                Ok(scene) => scene,
                Err(error) => {
                    refused += 1;
                    assert!(
                        parameter.name.starts_with("shoulder.")
                            || error.to_string().contains("blade.")
                            || error.to_string().contains(parameter.name),
                        "{what}: {error}"
                    );
                    continue;
                }
            };
            assert!(value.is_finite() && value >= 0.0, "{what} is accepted");
            let mut scene = scene;
            scene.run.stop_s = 0.05;
            for (loss, jam) in
                [(ContactLossRule::Stop, JamRule::Stop), (ContactLossRule::Fly, JamRule::Impact)]
            {
                (scene.loss, scene.jam) = (loss, jam);
                assert_ends(&what, &scene);
            }
        }
    }
    assert!(
        refused >= 4 * PARAMETERS.len(),
        "NaN, infinities and negative numbers of every parameter are refused: {refused}"
    );
}

/// The same for the file itself: a number that is none is refused where it stands.
#[test]
fn a_file_with_a_number_that_is_none_is_refused() {
    for (from, to) in [
        ("head_mass_kg = 0.02659", "head_mass_kg = nan"),
        ("lip_length_m = 0.004163", "lip_length_m = inf"),
        ("lip_length_m = 0.004163", "lip_length_m = 1e999"),
        ("b_s_per_m = 7.95", "b_s_per_m = -inf"),
        ("frequency_hz = 0.915", "frequency_hz = nan"),
        ("time_s = 0.0", "time_s = nan"),
        ("stop_s = 0.25", "stop_s = inf"),
        ("relative_tolerance = 1e-8", "relative_tolerance = 0.0"),
        ("relative_tolerance = 1e-8", "relative_tolerance = nan"),
        ("sample_rate_hz = 1000.0", "sample_rate_hz = 1e300"),
        (
            "kind = \"upright\"",
            "kind = \"state\"\nneck_angle_rad = nan\nlip_angle_rad = 0.0\nneck_rate_rad_per_s = 0.0\nlip_rate_rad_per_s = 0.0",
        ),
    ] {
        assert!(LIGHT_BLADE.contains(from), "{from}");
        let error =
            Scene::parse("light-blade.toml", &LIGHT_BLADE.replacen(from, to, 1)).expect_err(to).to_string();
        assert!(error.contains("light-blade.toml"), "{to}: {error}");
    }
}

/// Rates whose squares overflow, and angles at and beyond level.
#[test]
fn no_start_however_extreme_panics_or_goes_unnoticed() {
    let mut scene = upright_light_blade();
    scene.run.stop_s = 0.01;
    for theta in [0.0, 1.5, -1.57, 1.6, 1e10, 1e300] {
        for rate in [0.0, -1e3, 1e8, 1e160, f64::MAX] {
            for (loss, jam) in
                [(ContactLossRule::Stop, JamRule::Stop), (ContactLossRule::Fly, JamRule::Impact)]
            {
                scene.start = StartKind::State(Pose { theta, phi: 0.5, theta_rate: rate, phi_rate: -rate });
                (scene.loss, scene.jam) = (loss, jam);
                assert_ends(&format!("neck at {theta:e} rad, {rate:e} rad/s"), &scene);
            }
        }
    }
}
