//! What changed digits in journals do.

use crate::sealed::resealed;
use crate::small_fit::{JOB, Project};
use std::fs;

/// Changed digits that are tried in each kind of journal.
const DIGITS: usize = 150;

const STUDY: &str = r#"format = 1
title = "A small study"
scene = "data/scenes/actual-blade.toml"

[camera]
frame_rate_hz = 2000.0
exposure_s = 0.0

[[axis]]
name = "friction.a"
values = [0.9, 0.95, 1.0]

[[axis]]
name = "friction.c"
from = 0.25
to = 0.35
points = 4

[[map]]
name = "stick fraction"
kind = "stick-fraction"

[[map]]
name = "jam"
kind = "jam"
"#;

const FIT: [&str; 3] = ["fit", "fits/x/job.toml", "--resume"];
const SWEEP: [&str; 5] = ["sweep", "study.toml", "--out", "out", "--resume"];

fn of_a_fit() -> Project {
    let project = Project::of("twin");
    project.write("fits/x/job.toml", JOB);
    let (code, _, stderr) = project.run(&["fit", "fits/x/job.toml", "--max-evaluations", "30"]);
    assert_eq!(code, 3, "{stderr}");
    project
}

fn of_a_study() -> Project {
    let project = Project::of("twin");
    let scene = project.read("data/scenes/actual-blade.toml").replace("stop_s = 1.15", "stop_s = 0.72");
    project.write("data/scenes/actual-blade.toml", &scene);
    project.write("study.toml", STUDY);
    let (code, _, stderr) = project.run(&SWEEP[..4]);
    assert_eq!(code, 0, "{stderr}");
    project
}

fn refused(project: &Project, arguments: &[&str], parts: &[&str]) {
    let (code, stdout, stderr) = project.run(arguments);
    assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
    assert!(parts.iter().all(|part| stderr.contains(part)), "expected {parts:?} in {stderr}");
}

/// Changes digits one by one, spread over the whole file: every one is refused with its line, by the command
/// that would go on from it, and the file stays as it is.
fn no_changed_digit_is_accepted(project: &Project, journal: &str, resume: &[&str]) {
    let text = project.read(journal);
    let digits: Vec<usize> = text.match_indices(|c: char| c.is_ascii_digit()).map(|(at, _)| at).collect();
    let mut lines = Vec::new();
    for nth in 0..DIGITS {
        let at = digits[nth * digits.len() / DIGITS];
        let mut changed = text.clone().into_bytes();
        changed[at] = b'0' + (changed[at] - b'0' + 1 + nth as u8 % 9) % 10;
        fs::write(project.path(journal), &changed).unwrap();
        let line = text[..at].matches('\n').count() + 1;
        refused(project, resume, &[&format!("{journal}:{line}: ")]);
        assert_eq!(fs::read(project.path(journal)).unwrap(), changed);
        lines.push(line);
    }
    lines.dedup();
    assert!(lines[0] == 1 && lines.len() == text.lines().count().min(lines.len()) && lines.len() > 10);
    project.write(journal, &text);
}

#[test]
fn no_changed_digit_in_the_journal_of_a_fit_is_accepted() {
    no_changed_digit_is_accepted(&of_a_fit(), "fits/x/journal.jsonl", &FIT);
}

#[test]
fn no_changed_digit_in_the_journal_of_a_study_is_accepted() {
    no_changed_digit_is_accepted(&of_a_study(), "out/journal.jsonl", &SWEEP);
}

#[test]
fn what_stands_before_a_damaged_line_is_resumed() {
    let project = of_a_fit();
    let journal = "fits/x/journal.jsonl";
    let resume = [&FIT[..], &["--max-evaluations", "30"]].concat();
    let whole = project.read(journal);
    let damaged = {
        let line = whole.lines().nth(8).unwrap();
        whole.replacen(line, &line.replacen("\"unit\":[0", "\"unit\":[1", 1), 1)
    };
    project.write(journal, &damaged);
    refused(&project, &resume, &["fits/x/journal.jsonl:9: ", "remove this line and all lines after it"]);
    let before: String = damaged.split_inclusive('\n').take(8).collect();
    project.write(journal, &before);
    let (code, _, stderr) = project.run(&resume);
    assert_eq!((code, project.read(journal)), (3, whole), "{stderr}");
}

#[test]
fn a_journal_of_another_layout_is_refused_with_what_to_do() {
    let fit = of_a_fit();
    let other = |text: &str| resealed(&text.replacen("\"layout\":4", "\"layout\":3", 1));
    fit.write("fits/x/journal.jsonl", &other(&fit.read("fits/x/journal.jsonl")));
    let said = "journal.jsonl: a journal of layout 3, expected layout 4; move it away and run the fit again";
    refused(&fit, &FIT, &[said]);
    let study = of_a_study();
    study.write("out/journal.jsonl", &other(&study.read("out/journal.jsonl")));
    refused(&study, &SWEEP, &["a journal of layout 3, expected layout 4", "run the sweep again"]);
}

#[test]
fn what_the_model_does_not_give_is_not_believed() {
    let project = of_a_fit();
    let resume = [&FIT[..], &["--max-evaluations", "30"]].concat();
    let journal = project.read("fits/x/journal.jsonl");
    fs::remove_file(project.path("fits/x/result.json")).unwrap();
    // every evaluation is edited, and the checksums are made anew
    let (header, lines) = journal.split_once('\n').unwrap();
    let edited = lines.replace("\"features\":[{\"value\":", "\"features\":[{\"value\":1");
    let edited = resealed(&format!("{header}\n{edited}"));
    project.write("fits/x/journal.jsonl", &edited);
    refused(
        &project,
        &resume,
        &["found evaluation.outcome.features[0].value 1", "but computed again the evaluation gives "],
    );
    assert!(!project.path("fits/x/result.json").exists());
    // one alone is edited so that it meets every target, and becomes the best
    project.write("fits/x/journal.jsonl", &journal);
    project.run(&resume);
    let result: serde_json::Value = serde_json::from_str(&project.read("fits/x/result.json")).unwrap();
    fs::remove_file(project.path("fits/x/result.json")).unwrap();
    let targets = [&result["components"][0]["target_hz"], &result["features"][0]["target"]];
    let [low, release] = targets.map(|target| target.as_f64().unwrap());
    let edit = |(line, at): (&str, usize)| match line.split_once("\"features\":[") {
        Some((unit, _)) if at == 17 => {
            format!("{unit}\"features\":[{{\"value\":{low:?}}},{{\"value\":{release:?}}}]}}}}")
        }
        _ => line.to_owned(),
    };
    let edited: Vec<String> = journal.lines().zip(1..).map(edit).collect();
    project.write("fits/x/journal.jsonl", &resealed(&edited.join("\n")));
    refused(&project, &resume, &["fits/x/journal.jsonl:17: found evaluation.outcome.features["]);
    assert!(!project.path("fits/x/result.json").exists());
}
