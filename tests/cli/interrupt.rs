//! SIGINT and SIGTERM: every long command answers within a second, says what was computed, ends with code 3
//! and leaves nothing half-written.
#![cfg(unix)]

use crate::project::Project;
use assert_cmd::cargo::cargo_bin;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// From the signal to the end of the program, on a machine that does other things too.
const ANSWER: Duration = Duration::from_millis(1500);
/// How long a command has run when it is interrupted: the first that it has not ended before and that it has
/// begun to answer signals in.
const MOMENTS_MS: [u64; 7] = [400, 800, 1600, 200, 100, 50, 25];

fn start(project: &Project, arguments: &[&str]) -> Child {
    let mut command = Command::new(cargo_bin!("wiperlab"));
    command.args(arguments).current_dir(project.path(""));
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([name, &child.id().to_string()]).stderr(Stdio::null()).status();
    sent.unwrap(); // it may have ended
}

/// Interrupts a command until its message has this part; gives the message.
fn interrupted(project: &Project, arguments: &[&str], name: &str, part: &str) -> String {
    for moment in MOMENTS_MS.map(Duration::from_millis) {
        let child = start(project, arguments);
        std::thread::sleep(moment);
        signal(&child, name);
        let clock = Instant::now();
        let ended = child.wait_with_output().unwrap();
        let (took, said) = (clock.elapsed(), String::from_utf8(ended.stderr).unwrap());
        if ended.status.code() == Some(3) {
            assert!(took < ANSWER, "{arguments:?} took {took:?}");
            assert!(said.contains("interrupted: "), "{arguments:?}: {said}");
            assert_eq!(passing(&project.path("")), [""; 0], "{arguments:?}");
            if said.contains(part) {
                return said;
            }
            // it was still reading, or its files were already written (`import` judges them after that)
        } else {
            assert!(matches!(ended.status.code(), Some(0) | None), "{arguments:?}: {said}");
        }
        // what this attempt wrote says nothing of the next
        if let Some(option) = arguments.iter().position(|argument| *argument == "--out") {
            let _ = fs::remove_dir_all(project.path(arguments[option + 1]));
        }
    }
    panic!("{arguments:?} was never met at work");
}

/// Temporary files below a folder.
fn passing(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        if entry.path().is_dir() {
            found.extend(passing(&entry.path()));
        } else if name.starts_with('.') && name != ".wiperlab.json" {
            found.push(name);
        }
    }
    found
}

/// A copy of the committed data, and a scene whose run takes minutes.
fn project() -> Project {
    let project = Project::copied();
    let scene = fs::read_to_string(project.path("data/scenes/light-blade-strokes.toml")).unwrap();
    let long = scene.replace("stop_s = 3.4", "stop_s = 9000").replace("= 10000.0", "= 100.0");
    assert_ne!(long, scene);
    fs::write(project.path("long.toml"), long).unwrap();
    project
}

#[test]
fn a_run_that_is_interrupted_keeps_what_it_has() {
    let project = project();
    for name in ["-INT", "-TERM"] {
        let said = interrupted(&project, &["simulate", "long.toml", "--out", "sim"], name, "of 9000 s;");
        assert!(said.contains("what it has is written"), "{said}");
        let summary: serde_json::Value =
            serde_json::from_slice(&fs::read(project.path("sim/summary.json")).unwrap()).unwrap();
        assert_eq!(summary["status"], "interrupted");
        let trace = fs::read_to_string(project.path("sim/trace.csv")).unwrap();
        let last: f64 = trace.lines().last().unwrap().split(',').next().unwrap().parse().unwrap();
        let stopped = summary["stopped_at_s"].as_f64().unwrap();
        assert!((stopped - 0.011..=stopped).contains(&last), "{last} {stopped}");
        assert!(trace.ends_with('\n') && trace.lines().count() > 2);
    }
}

#[test]
fn a_fit_that_is_interrupted_keeps_its_journal_and_the_earlier_result() {
    let project = project();
    let result = project.path("fits/actual-blade-twin/result.json");
    let earlier = fs::read(&result).unwrap();
    let job = "fits/actual-blade-twin/job.toml";
    let said = interrupted(&project, &["fit", job, "--resume", "--quiet"], "-INT", " holds ");
    let journal = fs::read_to_string(project.path("fits/actual-blade-twin/journal.jsonl")).unwrap();
    let held = journal.lines().count() - 1;
    assert!(held > 0 && journal.ends_with('\n'));
    let advice = format!("holds {held} iterates; go on with `wiperlab fit {job} --resume`");
    assert!(said.contains(&advice), "{said}");
    assert!(fs::read(&result).unwrap() == earlier, "the earlier result is replaced");
    project.run_to(&["fit", job, "--resume", "--max-evaluations", &held.to_string(), "--quiet"], &[3]);
}

/// A single evaluation that takes far longer than the limit does not carry the fit over it.
#[test]
fn a_fit_of_slow_evaluations_ends_at_its_time_limit() {
    let project = project();
    let job = fs::read_to_string(project.path("fits/published-simulation/job.toml")).unwrap();
    let slow = job
        .replace("../../data/scenes/published-simulation.toml", "../../long.toml")
        .replace("frame_rate_hz = 10000.0", "frame_rate_hz = 100.0")
        .replace("band_hz = [200.0, 1500.0]", "band_hz = [10.0, 45.0]")
        .replace("segment_s = 0.015", "segment_s = 0.5");
    fs::create_dir(project.path("fits/slow")).unwrap();
    fs::write(project.path("fits/slow/job.toml"), slow).unwrap();
    let clock = Instant::now();
    let child = start(&project, &["fit", "fits/slow", "--time-limit", "1s", "--quiet"]);
    let ended = child.wait_with_output().unwrap();
    let (took, said) = (clock.elapsed(), String::from_utf8(ended.stderr).unwrap());
    assert_eq!(ended.status.code(), Some(3), "{said}");
    assert!(said.contains("stopped at the time limit: "), "{said}");
    assert!(said.contains("the search had not begun, and there is no journal of it"), "{said}");
    let limit = Duration::from_secs(1);
    assert!(limit <= took && took < limit + ANSWER, "it took {took:?}");
    assert_eq!(fs::read_dir(project.path("fits/slow")).unwrap().count(), 1);
}

#[test]
fn a_study_that_is_interrupted_keeps_its_points() {
    let project = project();
    let study = fs::read_to_string(project.path("data/sweeps/flip.toml")).unwrap();
    fs::write(project.path("data/sweeps/fine.toml"), study.replace("points = 17", "points = 190")).unwrap();
    let arguments = ["sweep", "data/sweeps/fine.toml", "--out", "study", "--quiet"];
    let said = interrupted(&project, &arguments, "-TERM", " holds ");
    let journal = fs::read_to_string(project.path("study/journal.jsonl")).unwrap();
    let points = journal.lines().count() - 1;
    assert!(
        said.contains(&format!("study/journal.jsonl holds {points} of 36100 points; go on with --resume"))
    );
    assert!(!project.path("study/sweep.csv").exists());
}

/// Points that take longer than the answer may: the program ends without them.
#[test]
fn a_study_of_slow_points_ends_in_time_and_at_once_when_asked_twice() {
    let project = project();
    let study = fs::read_to_string(project.path("data/sweeps/flip.toml")).unwrap();
    let slow = study.replace("../scenes/actual-blade.toml", "../../long.toml").replace("10000.0", "100.0");
    let maps = slow.find("[[map]]").unwrap();
    let slow = format!("{}[[map]]\nname = \"stick\"\nkind = \"stick-fraction\"\n", &slow[..maps]);
    fs::write(
        project.path("data/sweeps/slow.toml"),
        slow.replace("from = 0.02\nto = 0.06", "from = 0.01\nto = 0.02"),
    )
    .unwrap();
    let arguments = ["sweep", "data/sweeps/slow.toml", "--out", "study", "--quiet"];
    let said = interrupted(&project, &arguments, "-INT", " holds ");
    assert!(said.contains("holds 0 of 289 points"), "{said}");

    let child = start(&project, &arguments);
    std::thread::sleep(Duration::from_millis(400));
    signal(&child, "-INT");
    std::thread::sleep(Duration::from_millis(50));
    let clock = Instant::now();
    signal(&child, "-INT");
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(3));
    assert!(clock.elapsed() < Duration::from_millis(600), "{:?}", clock.elapsed());
}

#[test]
fn a_command_without_anything_partial_ends_at_once_and_writes_nothing() {
    let project = project();
    let scene = fs::read_to_string(project.path("long.toml")).unwrap();
    fs::write(project.path("film.toml"), FILM).unwrap();
    fs::write(project.path("frames.toml"), scene.replace("= 100.0", "= 5000.0").replace("9000", "60"))
        .unwrap();
    project.run_to(&["simulate", "frames.toml", "--out", "frames", "--quiet"], &[0]);
    fs::copy(project.path("frames/trace.csv"), project.path("export.csv")).unwrap();
    let commands: [&[&str]; 5] = [
        &["accuracy", "long.toml", "--out", "new"],
        &["twin", "film.toml", "--out", "new"],
        &["spectrum", "frames", "--out", "new"],
        &["report", "fits/published-simulation", "--out", "new"],
        &["import", "export.csv", "--frame-rate-hz", "5000", "--out", "new"],
    ];
    for arguments in commands {
        let said = interrupted(&project, arguments, "-INT", "nothing is written");
        assert!(!project.path("new").exists(), "{said}");
    }
}

const FILM: &str = "format = 1\ntitle = \"a film\"\nscene = \"long.toml\"\nseed = 7\n[camera]\nframe_rate_hz = 100.0\nmetres_per_pixel = 2e-5\n";
