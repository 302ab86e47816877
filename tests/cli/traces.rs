//! Fits to traces: journal, kill, resume, result and report.

use crate::sealed::resealed_result;
use crate::small_fit::Project;
use serde_json::Value;
use std::path::Path;

/// Two parameters near their truth, on a few hundredths of a second that an ideal camera saw.
pub const JOB: &str = r#"format = 1
title = "A small trace"
scene = "../../data/scenes/actual-blade.toml"
seed = 3
nuisance = "exact"

[[recording]]
name = "film"
path = "../../data/short"

[[parameter]]
name = "friction.c"
lower = 0.27
upper = 0.33
scale = "log"

[[parameter]]
name = "blade.neck_stiffness_n_m_per_rad"
lower = 0.0017
upper = 0.0021
scale = "log"

[[trace]]
window = "0.60..0.64"
segment_s = [0.004, 0.008]
drive = "scene"
camera = { tilt_sd_deg = 0, scale_sd = 0, offset_sd_m = 0, clock_sd_s = 0 }
"#;

/// The recording: on the clock of its scene, so that the scene's drive serves.
pub const TWIN: &str = r#"format = 1
title = "short"
scene = "scenes/actual-blade.toml"
seed = 5

[camera]
frame_rate_hz = 5000.0
exposure_s = 0.00005
metres_per_pixel = 0.00002
noise_px = 0.1

[window]
start_s = 0.60
stop_s = 0.64
"#;

pub fn project() -> Project {
    let project = Project::of("twin");
    project.write("data/short.toml", TWIN);
    let (code, _, err) = project.run(&["twin", "data/short.toml", "--out", "data/short"]);
    assert_eq!(code, 0, "{err}");
    project.write("fits/small/job.toml", JOB);
    project
}

fn json(project: &Project, name: &str) -> Value {
    serde_json::from_str(&project.read(name)).unwrap()
}

fn fitted(project: &Project) -> Value {
    json(project, "fits/small/result.json")
}

const FIT: [&str; 2] = ["fit", "fits/small/job.toml"];
const RESUME: [&str; 3] = ["fit", "fits/small/job.toml", "--resume"];
const JOURNAL: &str = "fits/small/journal.jsonl";

#[test]
fn a_trace_is_fitted_journaled_resumed_and_reported() {
    let project = project();
    let (code, out, err) = project.run(&FIT);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    assert!(out.starts_with("The model explains the recording to within its noise"), "{out}");
    let result = fitted(&project);
    assert_eq!((&result["status"], &result["misfit"]["explained"]), (&"converged".into(), &true.into()));
    for (name, truth) in [("friction.c", 0.295), ("blade.neck_stiffness_n_m_per_rad", 0.00189)] {
        let found = &result["parameters"][name];
        let estimate = found["estimate"].as_f64().unwrap();
        assert!((estimate / truth - 1.0).abs() < 0.05, "{name}: {estimate}");
        assert!(found["lower_95"].as_f64().unwrap() < estimate && found["verdict"].is_string());
    }
    let channels = result["misfit"]["channels"].as_array().unwrap();
    assert_eq!(channels.iter().map(|c| &c["channel"]).collect::<Vec<_>>(), ["tip-x", "head-drop"]);
    assert!(channels.iter().all(|c| c["recording"] == "film" && c["worst"][0]["start_s"].is_f64()));

    resumes_from_any_cut(&project, &result);
    let journal = project.read(JOURNAL);
    assert_eq!(project.run(&[&FIT[..], &["--threads", "1"]].concat()).0, 0);
    assert_eq!(
        (project.read(JOURNAL), fitted(&project)),
        (journal, result),
        "whatever the number of threads"
    );
    twins_are_fitted_again(&project);

    let (code, out, err) = project.run(&["report", "fits/small", "--check"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.starts_with("The model explains the recording to within its noise"), "{out}");
    let page = project.read("reports/small/index.html");
    let places =
        ["class=\"verdict\"", "id=\"misfit\"", "id=\"parameters\""].map(|part| page.find(part).unwrap());
    assert!(places.is_sorted(), "the misfit comes first");
    assert_eq!(json(&project, "reports/small/report.json")["model_explains_recording"], true);
    refuses_a_changed_verdict(&project);
}

/// A journal as a kill at any moment leaves it gives the same journal and result.
fn resumes_from_any_cut(project: &Project, result: &Value) {
    let whole = project.read(JOURNAL);
    let header = whole.find('\n').unwrap() + 1;
    for cut in [header - 1, whole.len() / 2, whole.len()] {
        project.write(JOURNAL, &whole[..cut]);
        let (code, out, err) = project.run(&RESUME);
        assert_eq!(code, 0, "cut at {cut}: {out}{err}");
        assert_eq!((&project.read(JOURNAL), &fitted(project)), (&whole, result), "cut at {cut}");
    }
    let (code, _, _) = project.run(&[&RESUME[..], &["--max-evaluations", "3"]].concat());
    assert_eq!((code, fitted(project)["status"].clone()), (0, "converged".into()), "all is in the journal");
    project.write(
        JOURNAL,
        whole.lines().take(3).map(|line| line.to_owned() + "\n").collect::<String>().as_str(),
    );
    let (code, out, _) = project.run(&[&RESUME[..], &["--max-evaluations", "4"]].concat());
    assert_eq!((code, fitted(project)["status"].clone()), (3, "budget-exhausted".into()), "{out}");
    assert_eq!((project.run(&RESUME).0, &project.read(JOURNAL), &fitted(project)), (0, &whole, result));
}

/// A finished fit goes on with twins, which are journaled like everything else.
fn twins_are_fitted_again(project: &Project) {
    let without = fitted(project);
    project.write("fits/small/job.toml", &format!("{JOB}\n[intervals]\nbootstrap = 8\n"));
    let (code, out, err) = project.run(&RESUME);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    let (whole, result) = (project.read(JOURNAL), fitted(project));
    assert_eq!((&without["twins"], &result["twins"]), (&0.into(), &8.into()));
    for (name, found) in result["parameters"].as_object().unwrap() {
        let end = |key: &str, at: usize| found[key][at].as_f64().unwrap();
        let [low, high] = [end("bootstrap_95", 0), end("bootstrap_95", 1)];
        let ratio = (high - low) / (end("linear_95", 1) - end("linear_95", 0));
        assert!((0.3..1.5).contains(&ratio), "{name}: twins scatter by {ratio} of the interval without them");
        assert!(found["lower_95"].as_f64().unwrap() <= low && found["upper_95"].as_f64().unwrap() >= high);
    }
    let lines = |count: usize| whole.lines().take(count).map(|line| format!("{line}\n")).collect::<String>();
    let all = whole.lines().count();
    for kept in [all - 3, all - 20] {
        project.write(JOURNAL, &lines(kept));
        assert_eq!(project.run(&RESUME).0, 0);
        assert_eq!((&project.read(JOURNAL), &fitted(project)), (&whole, &result), "{kept} of {all} lines");
    }
    project.write("fits/small/job.toml", JOB);
    assert_eq!((project.run(&FIT).0, fitted(project)), (0, without));
}

/// Neither a better misfit nor a better verdict can be written into a result.
fn refuses_a_changed_verdict(project: &Project) {
    let whole = project.read("fits/small/result.json");
    for (from, to, key) in [
        ("\"explained\": true", "\"explained\": false", "misfit.explained"),
        ("\"bad_segments\": 0", "\"bad_segments\": 2", "misfit.explained"),
    ] {
        assert!(whole.contains(from), "{from}");
        project.write("fits/small/result.json", &resealed_result(&whole.replace(from, to)));
        let (code, _, err) = project.run(&["report", "fits/small"]);
        assert_eq!((code, err.contains(key)), (2, true), "{err}");
    }
    project.write("fits/small/result.json", &whole);
}

#[test]
fn a_model_that_does_not_explain_the_trace_ends_with_3() {
    let project = project();
    // a lip that is too stiff
    let scene = project.read("data/scenes/actual-blade.toml");
    let wrong = scene.replacen("lip_natural_frequency_hz = 608", "lip_natural_frequency_hz = 760", 1);
    assert_ne!(scene, wrong);
    project.write("data/scenes/actual-blade.toml", &wrong);
    let (code, out, _) = project.run(&FIT);
    assert_eq!(code, 3, "{out}");
    assert!(out.starts_with("The model does not explain the recording: "), "{out}");
    let result = fitted(&project);
    assert!(result["misfit"]["reasons"][0].is_string(), "{result}");
    assert_ne!(result["parameters"]["friction.c"]["verdict"], "identified");
    let (code, out, _) = project.run(&["report", "fits/small", "--check"]);
    assert_eq!(code, 3);
    assert!(out.starts_with("The model does not explain the recording: "), "{out}");
}

#[test]
fn a_job_that_turns_to_traces_begins_a_new_journal() {
    let project = project();
    project.write("fits/small/job.toml", crate::small_fit::JOB);
    assert!([0, 3].contains(&project.run(&FIT).0));
    project.write("fits/small/job.toml", JOB);
    let (code, _, err) = project.run(&RESUME);
    assert_eq!(code, 2);
    assert!(err.contains("the job, a scene or a recording has changed since it was written"), "{err}");
    let (code, out, err) = project.run(&[&FIT[..], &["--max-evaluations", "2"]].concat());
    assert_eq!(code, 3, "{out}{err}");
    assert!(err.contains("the old journal is kept as"), "{err}");
    assert!(Path::new(&project.path("fits/small/journal.previous-1.jsonl")).exists());
}
