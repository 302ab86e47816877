//! Work without bounds is refused before it begins, and a limit that is reached ends the work.

use crate::project::Project;
use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};

/// A refusal comes before the work.
const AT_ONCE: Duration = Duration::from_secs(5);

fn run(project: &Project, arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wiperlab"));
    let output = command.args(arguments).current_dir(project.path("")).output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

fn refused(project: &Project, arguments: &[&str], parts: &[&str]) {
    let clock = Instant::now();
    let (code, said) = run(project, arguments);
    assert_eq!(code, Some(2), "{arguments:?}: {said}");
    assert!(parts.iter().all(|part| said.contains(part)), "{arguments:?}: {said}");
    assert!(clock.elapsed() < AT_ONCE, "{arguments:?}");
}

/// Writes a committed file with an edit under another name next to it.
fn edited(project: &Project, file: &str, edits: &[(&str, &str)]) -> String {
    let mut text = fs::read_to_string(project.path(file)).unwrap();
    for (old, new) in edits {
        assert!(text.contains(old), "{old}");
        text = text.replacen(old, new, 1);
    }
    let to = file.replace(".toml", "-edited.toml");
    fs::write(project.path(&to), text).unwrap();
    to
}

const SCENE: &str = "data/scenes/light-blade-strokes.toml";
const JOB: &str = "fits/published-experiment/job.toml";

/// What is replaced in a file, and what its refusal says.
type Case = (&'static [(&'static str, &'static str)], &'static [&'static str]);

#[test]
fn a_scene_of_endless_work_is_refused() {
    let project = Project::copied();
    let cases: [Case; 5] = [
        (
            &[("stop_s = 3.4", "stop_s = 1e9"), ("= 10000.0", "= 0.001")],
            &["run.stop_s", "run.most_evaluations"],
        ),
        (&[("= 10000.0", "= 1e9")], &["run.sample_rate_hz", "1e7 samples"]),
        (&[("stop_s = 3.4", "stop_s = 1e300")], &["run.sample_rate_hz"]),
        (&[("[run]", "[run]\nmost_evaluations = 0")], &["run.most_evaluations", "a whole number from 1"]),
        (&[("[run]", "[run]\nmost_evaluations = 10000")], &["run.stop_s", "10000"]),
    ];
    for (edits, parts) in cases {
        let scene = edited(&project, SCENE, edits);
        refused(&project, &["simulate", &scene, "--out", "new"], parts);
        assert!(!project.path("new").exists());
    }
}

#[test]
fn a_work_limit_ends_a_run_and_says_so() {
    let project = Project::copied();
    let scene = edited(&project, SCENE, &[("[run]", "[run]\nmost_evaluations = 50000")]);
    let (code, said) = run(&project, &["simulate", &scene, "--out", "new", "--quiet"]);
    assert_eq!(code, Some(3), "{said}");
    let summary = fs::read_to_string(project.path("new/summary.json")).unwrap();
    assert!(summary.contains("\"work-limit\""), "{summary}");
    assert!(fs::read_to_string(project.path("new/trace.csv")).unwrap().lines().count() > 10);
}

#[test]
fn a_camera_of_too_many_frames_is_refused() {
    let project = Project::copied();
    let twin =
        edited(&project, "data/twins/actual-blade.toml", &[("frame_rate_hz = ", "frame_rate_hz = 1e9 # ")]);
    let twin_exposure = fs::read_to_string(project.path(&twin)).unwrap();
    let shut: String =
        twin_exposure.lines().filter(|l| !l.starts_with("exposure_s")).map(|l| format!("{l}\n")).collect();
    fs::write(project.path(&twin), shut).unwrap();
    refused(&project, &["twin", &twin, "--out", "new"], &["camera.frame_rate_hz", "2e6"]);
    let study = edited(&project, "data/sweeps/flip.toml", &[("frame_rate_hz = ", "frame_rate_hz = 1e9 # ")]);
    refused(&project, &["sweep", &study, "--out", "new"], &["camera.frame_rate_hz", "1e6"]);
    let text = fs::read_to_string(project.path(JOB)).unwrap();
    let job: String = text
        .lines()
        .map(|line| match line.split(" = ").next() {
            Some("frame_rate_hz") => "frame_rate_hz = 1e9\n".to_owned(),
            Some("exposure_s") => "exposure_s = 0.0\n".to_owned(),
            _ => format!("{line}\n"),
        })
        .collect();
    assert_ne!(job, text);
    fs::write(project.path("fits/published-experiment/fast.toml"), job).unwrap();
    refused(&project, &["fit", "fits/published-experiment/fast.toml"], &["frames/s, expected 1 to 1e6"]);
}

#[test]
fn a_job_of_too_many_entries_is_refused() {
    let project = Project::copied();
    let text = fs::read_to_string(project.path(JOB)).unwrap();
    let many = |entry: fn(usize) -> String| (0..1500).map(entry).collect::<String>();
    let entries: [(&str, String); 3] = [
        ("recording", many(|i| format!("[[recording]]\npath = \"r{i}\"\n"))),
        ("condition", many(|i| format!("[[condition]]\nname = \"c{i}\"\n"))),
        (
            "component",
            many(|i| {
                format!(
                    "[[component]]\nname = \"n{i}\"\nchannel = \"deflection\"\nwindow = \"..\"\nband_hz = [1.0, 2.0]\ntarget_hz = 1.5\ntarget_sd_hz = 0.1\n"
                )
            }),
        ),
    ];
    for (key, entries) in entries {
        fs::write(project.path("fits/published-experiment/many.toml"), format!("{text}\n{entries}")).unwrap();
        refused(&project, &["fit", "fits/published-experiment/many.toml"], &[key, "expected 0 to 1000"]);
    }
}

#[test]
fn too_many_threads_are_refused() {
    let project = Project::copied();
    for threads in ["100000", "0", "18446744073709551616"] {
        refused(&project, &["modes", SCENE, "--threads", threads], &["--threads", "from 1 to 1024"]);
    }
}

#[test]
fn a_trace_of_a_few_rows_and_millions_of_frames_is_refused() {
    let project = Project::copied();
    let header = "time_s,tip_x_m,tip_y_m,head_x_m,head_y_m";
    fs::write(
        project.path("gap.csv"),
        format!("{header}\n0,1,1,1,1\n1e-4,1,1,1,1\n2e-4,1,1,1,1\n900,1,1,1,1\n"),
    )
    .unwrap();
    refused(&project, &["inspect", "gap.csv"], &["9000001 frames, and only 4 of them have a row"]);
}
