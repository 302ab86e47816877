//! Tests of the traces and constants of a job.

use super::*;

/// A job whose trace has only the keys that it needs.
const TRACED: &str = r#"format = 1
title = "traced"
scene = "s.toml"
seed = 1
nuisance = "3 %"
[[recording]]
path = "../../data/x"
[[recording]]
name = "second"
path = "../../data/y"
[[recording]]
name = "apart"
path = "../../data/z"
held_out = true
[[condition]]
name = "published"
[camera]
frame_rate_hz = 1000
exposure_s = 0
[[parameter]]
name = "friction.a"
lower = 0.05
upper = 1.0
scale = "log"
[[trace]]
segment_s = [0.004, 0.02]
[[trace]]
recording = "second"
channels = ["deflection", "head-drop"]
segment_s = [0.004, 0.02]
window = "0.1..0.3"
noise_m = 2e-6
drive = "scene"
[trace.camera]
tilt_sd_deg = 0
clock_sd_s = 0.002
"#;

fn of(text: &str) -> Job {
    job(text).unwrap()
}

#[test]
fn a_trace_needs_no_more_than_its_name() {
    let job = of(TRACED);
    assert!(job.targets.is_empty());
    let [first, second] = job.traces.as_slice() else { panic!() };
    assert_eq!((first.condition, &first.channels, first.noise_m, first.head), (0, &None, None, None));
    assert_eq!(first.camera.clock_sd_s(HeadSource::Recording), 0.0, "one camera took head and tip");
    assert!(first.camera.tilt_sd_rad > 0.0 && first.camera.scale_sd > 0.0 && first.camera.offset_sd_m > 0.0);
    assert_eq!(second.condition, 1);
    assert_eq!(second.channels, Some(vec![TraceChannel::Deflection, TraceChannel::HeadDrop]));
    assert_eq!((second.head, second.noise_m), (Some(HeadSource::Scene), Some(2e-6)));
    assert_eq!((second.camera.tilt_sd_rad, second.camera.clock_sd_s(HeadSource::Recording)), (0.0, 0.002));
    assert_eq!(job.constants, Constants::All { sd_relative: 0.03 });
    assert_eq!((job.search.seed, job.search.global_evaluations), (1, 0));
}

#[test]
fn traces_are_part_of_what_is_fitted() {
    let content = |text: &str| serde_json::to_string(&of(text).identity()).unwrap();
    let base = content(TRACED);
    for (from, to) in [
        ("2e-6", "3e-6"),
        ("\"3 %\"", "\"4 %\""),
        ("0.1..0.3", "0.1..0.2"),
        ("\"scene\"\n[t", "\"recording\"\n[t"),
    ] {
        assert_ne!(content(&TRACED.replacen(from, to, 1)), base, "{from}");
    }
    let without = serde_json::to_string(&super::job(MEASURED).unwrap().identity()).unwrap();
    assert!(!without.contains("traces") && !without.contains("constants"), "old fingerprints stay");
}

#[test]
fn traces_are_checked() {
    for (from, to, words) in [
        ("[0.004, 0.02]", "[0.004]", "trace 2, `segment_s`: differs from that of trace 1"),
        ("\"second\"\nch", "1\nch", "trace 2, `recording`: `recording 1` has a [[trace]] already"),
        (
            "\"second\"\nch",
            "\"secnd\"\nch",
            "no recording or condition is called `secnd`; did you mean `second`?",
        ),
        ("\"second\"\nch", "4\nch", "trace 2, `recording`: `published` has no recording"),
        ("\"second\"\nch", "3\nch", "`apart` is held out of the fit"),
        ("\"head-drop\"]", "\"head-dorp\"]", "`channels`: found \"head-dorp\"; did you mean `head-drop`?"),
        ("\"head-drop\"]", "\"deflection\"]", "`channels`: found \"deflection\" twice"),
        ("\"head-drop\"]", "\"tip-x\"]", "which both have the noise of the tip"),
        ("[\"deflection\", \"head-drop\"]", "[]", "`channels`: found none, expected one at least"),
        ("[0.004, 0.02]", "[0.02, 0.02]", "`segment_s`: found 0.02 after 0.02, expected rising lengths"),
        ("[0.004, 0.02]", "[]", "`segment_s`: found 0 lengths, expected 1 to 8"),
        ("[0.004, 0.02]", "[-1.0]", "`segment_s`: found -1, expected a finite number above 0"),
        ("0.1..0.3", "0.1-0.3", "trace 2, `window`: "),
        ("2e-6", "nan", "`noise_m`: found NaN, expected a finite number above 0"),
        ("drive = \"scene\"", "drive = \"head\"", "`drive`: found \"head\", expected \"recording\""),
        ("tilt_sd_deg = 0", "tilt_sd_deg = -1", "`camera.tilt_sd_deg`: found -1, expected 0 (held) to 10"),
        ("clock_sd_s = 0.002", "clock_sd_s = inf", "`camera.clock_sd_s`: found inf"),
        ("tilt_sd_deg", "tilt_sd", "unknown key `trace[2].camera.tilt_sd`; did you mean `tilt_sd_deg`?"),
    ] {
        let refused = refusal(TRACED, from, to);
        assert!(refused.contains(words), "{refused}");
    }
}

#[test]
fn constants_are_checked() {
    for (to, words) in [
        ("\"3\"", "nuisance: found \"3\", expected \"exact\", a percentage such as \"3 %\""),
        ("\"90 %\"", "nuisance: found 90 %, expected 0.0001 % to 50 %"),
        ("3", "expected \"exact\", a percentage such as \"3 %\", or a list"),
        ("[]", "nuisance: found an empty list"),
        ("[{ name = \"friction.d\", sd = \"3 %\" }]", "nuisance `friction.d`: not a parameter of a scene"),
        ("[{ name = \"friction.a\", sd = \"3 %\" }]", "the [[parameter]] `friction.a` is free already"),
        ("[{ name = \"friction.c\" }]", "nuisance `friction.c`: expected either `sd`"),
    ] {
        let refused = refusal(TRACED, "\"3 %\"", to);
        assert!(refused.contains(words), "{refused}");
    }
    let listed = TRACED.replacen("\"3 %\"", "[{ name = \"friction.c\", sd_relative = 0.05 }]", 1);
    let expected = NuisanceParameter { name: "friction.c".to_owned(), sd_relative: 0.05 };
    assert_eq!(of(&listed).constants, Constants::Listed(vec![expected]));
    let without = refusal(MEASURED, "seed = 7", "seed = 7\nnuisance = \"3 %\"");
    assert!(without.contains("nuisance: found without a [[trace]], expected one"), "{without}");
}

#[test]
fn a_job_without_a_trace_has_its_budgets_and_something_to_fit() {
    let search = "[search]\nglobal_evaluations = 240\nlocal_evaluations = 100\n";
    assert!(refusal(PUBLISHED, search, "").starts_with("job.toml: search: missing; without a [[trace]]"));
    assert!(
        refusal(PUBLISHED, "local_evaluations = 100\n", "")
            .starts_with("job.toml: search.local_evaluations: missing;")
    );
}

#[test]
fn laws_are_checked() {
    let with = |laws: &str| TRACED.replace("seed = 1\n", &format!("seed = 1\nlaws = {laws}\n"));
    assert_eq!(of(TRACED).laws, None);
    assert_eq!(of(&with("[]")).laws, Some(Vec::new()));
    let both = Some(vec![FrictionShape::Stribeck, FrictionShape::Rational]);
    assert_eq!(of(&with("[\"stribeck\", \"rational\"]")).laws, both);
    let refused = |laws: &str| job(&with(laws)).unwrap_err().to_string();
    assert!(
        refused("[\"stribek\"]").contains("laws: found \"stribek\"; did you mean `stribeck`?"),
        "{}",
        refused("[\"stribek\"]")
    );
    assert!(refused("[\"table\"]").contains("whose points are no parameters"));
    assert!(refused("[\"rational\", \"rational\"]").contains("found \"rational\" twice"));
    let features = MEASURED.replace("seed = 7\n", "seed = 7\nlaws = [\"stribeck\"]\n");
    assert!(job(&features).unwrap_err().to_string().contains("found without a [[trace]]"));
}
