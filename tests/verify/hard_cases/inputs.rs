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

/// A friction law is refused without its parameters, with those of another law, and with points that make no
/// table. The message names file, line and key, and says what was found and what to do.
#[test]
fn a_friction_law_that_is_not_whole_is_refused() {
    const LINE: &str = "a = 0.229\nb_s_per_m = 7.95\nc = 0.331\n";
    let table = |speeds: &str, coefficients: &str| {
        format!("law = \"table\"\nspeeds_m_per_s = {speeds}\ncoefficients = {coefficients}\n")
    };
    let stribeck = "law = \"stribeck\"\nlimit_at_zero = 0.4\ncoulomb_level = 0.3\nstribeck_exponent = 1.5\n";
    for (written, message) in [
        (
            format!("{LINE}static_ratio = 0.9\n"),
            "LINE+3:16: key `friction.static_ratio`: found 0.9, expected a number from 1 to 10",
        ),
        (format!("{LINE}viscous_s_per_m = nan\n"), "LINE+3:19: key `friction.viscous_s_per_m`: found nan"),
        (
            format!("{LINE}backward_ratio = 0\n"),
            "LINE+3:18: key `friction.backward_ratio`: found 0, expected a number above 0",
        ),
        (
            format!("{LINE}stribeck_exponent = 1.0\n"),
            "LINE+3: key `friction.stribeck_exponent`: found the law \"exponential\", expected parameters of this law: friction.a, friction.b_s_per_m, friction.c; leave it out, or choose law = \"stribeck\"",
        ),
        (
            format!("law = \"stribek\"\n{LINE}"),
            "LINE:7: key `friction.law`: found the text \"stribek\", expected one of \"exponential\", \"stribeck\", \"rational\", \"table\"; did you mean `stribeck`?",
        ),
        (format!("law = \"rational\"\n{LINE}"), "LINE+1: key `friction.a`: found the law \"rational\""),
        (stribeck.to_owned(), "key `friction.stribeck_speed_m_per_s`: found nothing"),
        (
            format!("{stribeck}stribeck_speed_m_per_s = -0.1\n"),
            "LINE+4:26: key `friction.stribeck_speed_m_per_s`: found -0.1, expected a number above 0",
        ),
        ("a = 0.1\nc = 0.3\n".to_owned(), "key `friction.b_s_per_m`: found nothing"),
        (
            format!("{LINE}coefficients = [0.1, 0.2]\n"),
            "LINE+3: key `friction.coefficients`: found the law \"exponential\", expected the law \"table\"; leave it out, or choose law = \"table\"",
        ),
        (
            "law = \"table\"\ncoefficients = [0.1, 0.2]\n".to_owned(),
            "key `friction.speeds_m_per_s`: found nothing, expected a list of numbers",
        ),
        (
            table("[0.0, 0.2, 0.1]", "[0.4, 0.3, 0.2]"),
            "LINE+1: key `friction.speeds_m_per_s`: found 0.1 after 0.2, expected speeds that increase; sort the points by speed",
        ),
        (
            table("[0.0, -0.1]", "[0.4, 0.3]"),
            "LINE+1:24: key `friction.speeds_m_per_s[2]`: found -0.1, expected a number of 0 or more",
        ),
        (table("[0.1, 0.2]", "[0.4, inf]"), "LINE+2:22: key `friction.coefficients[2]`: found inf"),
        (table("[0.1]", "[0.4]"), "LINE+1: key `friction.speeds_m_per_s`: found 1, expected 2 to 32 speeds"),
        (
            table("[0.1, 0.2, 0.3]", "[0.4, 0.3]"),
            "LINE+2: key `friction.coefficients`: found 2, expected 3, one for each speed; give both lists the same length",
        ),
    ] {
        assert!(LIGHT_BLADE.contains(LINE));
        let text = LIGHT_BLADE.replacen(LINE, &written, 1);
        let line = 1 + LIGHT_BLADE[..LIGHT_BLADE.find(LINE).unwrap()].matches('\n').count();
        let expected = match message.strip_prefix("LINE") {
            Some(rest) => {
                let (more, rest) = rest.split_once(':').unwrap();
                format!("light-blade.toml:{}:{rest}", line + more.parse::<usize>().unwrap_or(0))
            }
            None => message.to_owned(),
        };
        let error = Scene::parse("light-blade.toml", &text).expect_err(message).to_string();
        assert!(error.contains(&expected), "{written}: {error}, expected {expected}");
    }
    let scene = upright_light_blade();
    let error = scene.with_parameter("friction.coulomb_level", 0.2).unwrap_err().to_string();
    assert!(error.contains("found the law \"exponential\""), "{error}");
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
