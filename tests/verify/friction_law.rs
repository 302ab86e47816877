//! A fit says which law of friction a film supports, and whether its parameters depend on the law.

use wiperlab::fit::job::Job;
use wiperlab::fit::law::{LawComparison, LawVerdict};
use wiperlab::fit::result::FitResult;
use wiperlab::fit::uncertainty::ParameterVerdict;
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::simulate::SolverOptions;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::{Camera, TrackingModel, add_tracking_noise, film_scene};

const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
const CAMERA: Camera = Camera { frame_rate_hz: 5_000.0, exposure_s: 5e-5 };
const EXPONENTIAL: &str = "a = 0.108\nb_s_per_m = 4.91\nc = 0.296\n";

const JOB: &str = r#"format = 1
title = "Law of friction"
scene = "scene.toml"
seed = 1
nuisance = "exact"

[[recording]]
path = "film"

[[parameter]]
name = "friction.a"
lower = 0.05
upper = 0.25
scale = "log"

[[parameter]]
name = "friction.b_s_per_m"
lower = 2.0
upper = 12.0
scale = "log"

[[parameter]]
name = "friction.c"
lower = 0.15
upper = 0.5
scale = "log"

[[parameter]]
name = "shoulder.stiffness_n_m_per_rad"
lower = 0.008
upper = 0.12
scale = "log"

[[trace]]
segment_s = [0.004, 0.008, 0.016, 0.032]
"#;

/// The fit of the exponential law to a film of a blade with the table `friction`; `laws` are compared with
/// it.
fn fit_film(friction: &str, laws: &str) -> FitResult {
    let truth = Scene::parse("truth.toml", &SCENE.replace(EXPONENTIAL, friction)).unwrap();
    let effort = SolverOptions::new(truth.run.relative_tolerance);
    let seen = film_scene(&truth, &CAMERA, truth.start_s, truth.run.stop_s, effort).unwrap();
    let tracking = TrackingModel { metres_per_pixel: 2e-5, noise_px: 0.1, dropout_fraction: 0.01, seed: 7 };
    let recording = add_tracking_noise(&seen.recording, "film", &tracking).unwrap();
    let job = JOB.replace("seed = 1\n", &format!("seed = 1\n{laws}\n"));
    let job = Job::parse("job.toml", &job).unwrap();
    let scene = Scene::parse("scene.toml", SCENE).unwrap();
    let measured = MeasuredRecording { recording, exposure_s: Some(CAMERA.exposure_s) };
    Problem::new(job, vec![scene], vec![measured]).unwrap().fit().unwrap()
}

fn law(result: &FitResult) -> &LawComparison {
    result.law.as_ref().unwrap()
}

fn identified(result: &FitResult) -> usize {
    let verdicts = result.parameters.values().map(|found| found.verdict);
    verdicts.filter(|verdict| *verdict == ParameterVerdict::Identified).count()
}

#[test]
fn an_exponential_film_keeps_its_law_and_names_what_it_assumes() {
    let result = fit_film(EXPONENTIAL, "");
    assert!(result.explains_recordings());
    assert_eq!((law(&result).verdict, identified(&result)), (LawVerdict::Preferred, 4));
    assert_eq!(law(&result).chosen.as_deref(), Some("exponential"));
    for (name, truth) in [("friction.a", 0.108), ("friction.b_s_per_m", 4.91), ("friction.c", 0.296)] {
        let found = &result.parameters[name];
        let half = 0.5 * (found.upper_95.unwrap() - found.lower_95.unwrap());
        assert!((found.estimate - truth).abs() < 2.0 * half && half < 0.05 * truth, "{name}: {found:?}");
    }
    // a slow rise of friction with speed can hardly be told from a slower fall
    assert!(
        law(&result).sentence.contains("The intervals assume this law; with"),
        "{}",
        law(&result).sentence
    );
    assert!(fit_film(EXPONENTIAL, "laws = []").law.is_none());
}

/// A limit at rest that is a fifth above the friction of slip changes the residuals by a fiftieth, and moves
/// the stiffness of the shoulder by four deviations.
#[test]
fn a_higher_limit_at_rest_takes_identified_away() {
    let result = fit_film(&format!("{EXPONENTIAL}static_ratio = 1.2\n"), "");
    assert!(result.explains_recordings());
    assert_eq!((law(&result).verdict, identified(&result)), (LawVerdict::Preferred, 0));
    let [_, terms] = &law(&result).candidates[..] else { panic!("{:?}", law(&result)) };
    assert_eq!(law(&result).chosen.as_deref(), Some(&terms.law[..]));
    let ratio = &terms.parameters["friction.static_ratio"];
    let [low, high] = [ratio.lower_95, ratio.upper_95].map(Option::unwrap);
    assert!(low < 1.2 && high > 1.2 && high - low < 0.1, "{ratio:?}");
}

#[test]
fn a_steep_rise_with_speed_explains_what_the_law_does_not() {
    let result = fit_film(&format!("{EXPONENTIAL}viscous_s_per_m = 0.4\n"), "");
    assert!(!result.explains_recordings());
    let named = result.findings.iter().find(|finding| finding.hypothesis.as_deref() == Some("friction-law"));
    assert!(named.is_some(), "{:?}", result.findings);
    let rise = &law(&result).candidates[1].parameters["friction.viscous_s_per_m"];
    assert!((0.3..0.5).contains(&rise.estimate), "{rise:?}");
}

#[test]
fn a_stribeck_film_is_explained_by_the_stribeck_law_alone() {
    let stribeck = "law = \"stribeck\"\nlimit_at_zero = 0.404\ncoulomb_level = 0.296\n\
                    stribeck_speed_m_per_s = 0.2\nstribeck_exponent = 1.5\n";
    let result = fit_film(stribeck, "laws = [\"stribeck\", \"rational\"]");
    let found = law(&result);
    assert_eq!(
        (found.verdict, found.chosen.as_deref()),
        (LawVerdict::Preferred, Some("stribeck")),
        "{found:?}"
    );
    let exponent = &found.candidates[2].parameters["friction.stribeck_exponent"];
    let [low, high] = [exponent.lower_95, exponent.upper_95].map(Option::unwrap);
    assert!(low < 1.5 && high > 1.5 && high - low < 0.2, "{exponent:?}");
}
