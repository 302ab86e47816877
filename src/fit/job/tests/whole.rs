//! Tests of a job that has every table.

use super::*;

#[test]
fn recordings_and_conditions_have_names_scenes_and_values_of_their_own() {
    let job = job(WHOLE).unwrap();
    let condition = |name: &str, recording: Option<&str>, scene: &str, set: &[f64], held_out| JobCondition {
        name: name.to_owned(),
        recording: recording.map(str::to_owned),
        scene: scene.to_owned(),
        head: HeadSource::Scene,
        set: set.iter().map(|value| ("friction.c".to_owned(), *value)).collect(),
        held_out,
        camera: recording.map(|_| FeatureCamera { scale_sd: 0.005, offset_sd_m: 1e-3 }),
    };
    let expected = [
        condition("recording 1", Some("../../data/x"), "s.toml", &[], false),
        condition("fast", Some("../../data/y"), "t.toml", &[1.0], true),
        condition("slow", None, "s.toml", &[0.5], false),
    ];
    assert_eq!(job.conditions, expected);
    assert_eq!(job.recordings().collect::<Vec<_>>(), ["../../data/x", "../../data/y"]);
    let alone = super::Job::parse_with_names("job.toml", PUBLISHED, &KNOWN).unwrap().conditions;
    assert_eq!(alone, [condition("scene", None, "../../data/scenes/x.toml", &[], false)]);
}

#[test]
fn aims_know_their_condition_their_stage_and_whether_they_are_held_out() {
    let job = job(WHOLE).unwrap();
    let found: Vec<_> = job
        .targets
        .iter()
        .map(|a| (a.feature.name.as_str(), a.feature.condition, a.held_out, a.stage))
        .collect();
    let expected = [
        ("low", 0, false, TargetStage::Always),
        ("low, fast", 1, true, TargetStage::Always),
        ("flip-after-reversal", 2, false, TargetStage::Always),
        ("friction at 0.05 m/s", 0, false, TargetStage::Always),
        ("friction at 0.1 m/s", 0, false, TargetStage::Always),
        ("cycle at 550.0 Hz", 0, false, TargetStage::Last),
        ("cycle at 650.0 Hz", 0, false, TargetStage::Last),
        ("cycle at 750.0 Hz", 0, false, TargetStage::Last),
        ("cycle at 850.0 Hz", 0, false, TargetStage::Last),
        ("cycle-frequency-high", 0, false, TargetStage::Always),
    ];
    assert_eq!(found, expected);
}

#[test]
fn a_target_needs_no_deviation_where_the_recording_gives_one() {
    let sources: Vec<TargetSource> = job(WHOLE).unwrap().targets.iter().map(|a| a.source).collect();
    let least = |least_sd_relative| TargetSource::Measured { least_sd: 0.0, least_sd_relative };
    assert_eq!(
        (sources[0], sources[3], sources[5], sources[9]),
        (least(1e-3), least(0.0), least(0.3), least(1e-3))
    );
    assert_eq!(
        sources[2],
        TargetSource::Given { target: 0.0, sd: 0.002 },
        "the flip may start when the head turns"
    );
    let flip = WHOLE.replace("recording = 3\ntarget = 0.0\ntarget_sd = 0.002", "sd_relative = 0.1");
    let TargetSource::Measured { least_sd, least_sd_relative } = job(&flip).unwrap().targets[2].source else {
        panic!()
    };
    assert!(
        (least_sd - 0.005).abs() < 1e-15 && least_sd_relative == 0.0,
        "a share of the scale: the value may be zero"
    );
}

#[test]
fn tables_have_their_values_or_defaults() {
    let (whole, plain) = (job(WHOLE).unwrap(), job(MEASURED).unwrap());
    assert_eq!(
        (whole.ensemble, plain.ensemble),
        (Ensemble { members: 8, spread: 0.2 }, Ensemble { members: 1, spread: 0.1 })
    );
    assert!(
        (whole.largest_tilt_rad.unwrap() - 60.0_f64.to_radians()).abs() < 1e-15
            && plain.largest_tilt_rad.is_none()
    );
    assert_eq!((whole.search.starts, plain.search.starts), (2, 6));
    let intervals = |profile, bootstrap| IntervalSettings { profile, bootstrap };
    assert_eq!((whole.intervals, plain.intervals), (intervals(false, 0), intervals(true, 40)));
}

#[test]
fn a_prior_is_normal_in_the_scale_of_its_parameter() {
    let priors: Vec<Prior> = job(WHOLE).unwrap().parameters.into_iter().map(|p| p.prior.unwrap()).collect();
    assert_eq!(priors, [Prior::Log { mean_ln: 0.0, sd_ln: 0.1 }, Prior::Linear { mean: 0.0, sd: 0.5 }]);
    assert!(
        (priors[0].residual(0.2_f64.exp()) - 2.0).abs() < 1e-12
            && (priors[1].residual(-0.25) + 0.5).abs() < 1e-12
    );
    let in_units = job(&WHOLE.replace("mean = 1.0, sd_relative = 0.1", "mean = 1.6, sd = 0.4")).unwrap();
    assert_eq!(
        in_units.parameters[0].prior,
        Some(Prior::Log { mean_ln: portable_math::ln(1.6), sd_ln: 0.25 })
    );
    let prior = "prior = { mean = 1.0, sd_relative = 0.1 }";
    let of = |other: &str| refusal(WHOLE, prior, other);
    assert!(of("prior = { mean = 3.0, sd = 0.1 }").contains(
        "parameter `friction.a`, `prior.mean`: found 3, expected a number within the bounds, 0.5 to 2"
    ));
    assert!(of("prior = { mean = nan, sd = 0.1 }").contains("`prior.mean`: found NaN"));
    assert!(
        of("prior = { mean = 1.0, sd = 0.0 }")
            .contains("`prior.sd`: found 0, expected a finite number above 0")
    );
    assert!(
        of("prior = { mean = 1.0, sd = 0.1, sd_relative = 0.1 }")
            .contains("expected either `sd`, in the parameter's unit, or `sd_relative`")
    );
    assert!(of("prior = { mean = 1.0 }").contains("give one of them"));
    assert!(
        refusal(WHOLE, "mean = 0.0, sd = 0.5", "mean = 0.0, sd_relative = 0.5")
            .contains("found a share of a mean of 0; give `sd`")
    );
}
