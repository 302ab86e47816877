//! `wiperlab journal` as a user runs it, and what changed digits in journals do.

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

fn done(project: &Project, arguments: &[&str]) -> (String, String) {
    let (code, stdout, stderr) = project.run(arguments);
    assert_eq!(code, 0, "{arguments:?}: {stderr}");
    (stdout, stderr)
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
fn journals_are_verified_and_the_first_damaged_line_is_named() {
    let project = of_a_fit();
    let journal = "fits/x/journal.jsonl";
    let (stdout, stderr) = done(&project, &["journal", "verify", journal, journal]);
    assert_eq!(stdout, format!("{journal}: fit, 30 evaluations: every checksum holds\n").repeat(2));
    assert_eq!(stderr, "");
    let text = project.read(journal);
    project.write(journal, &text.replacen("\"index\":4,", "\"index\":5,", 1));
    refused(
        &project,
        &["journal", "verify", journal],
        &["fits/x/journal.jsonl:6: the line has the checksum"],
    );
    project.write(journal, &(text + "{\"index\""));
    let (_, stderr) = done(&project, &["journal", "verify", journal]);
    assert!(stderr.contains("the last line is incomplete and left out"), "{stderr}");
    refused(&project, &["journal", "verify", "fits/x/job.toml"], &["job.toml:1: no journal header"]);
}

#[test]
fn damaged_lines_are_dropped_and_computed_again() {
    let project = of_a_fit();
    let journal = "fits/x/journal.jsonl";
    let whole = project.read(journal);
    let result = |project: &Project| project.read("fits/x/result.json");
    let expected = result(&project);
    let damaged = whole.replacen("\"index\":7,", "\"index\":8,", 1);
    project.write(journal, &damaged);
    refused(&project, &FIT, &["fits/x/journal.jsonl:9: ", "`wiperlab journal drop fits/x/journal.jsonl 9`"]);
    let (stdout, stderr) = done(&project, &["journal", "drop", journal, "9"]);
    assert_eq!(stdout, "fits/x/journal.jsonl: 1 removed, 29 evaluations left\n");
    assert_eq!(stderr, "fits/x/journal.jsonl: the old journal is kept as fits/x/journal.previous-1.jsonl\n");
    assert_eq!(project.read("fits/x/journal.previous-1.jsonl"), damaged);
    done(&project, &["journal", "verify", journal]);
    let (code, _, stderr) = project.run(&[&FIT[..], &["--max-evaluations", "30"]].concat());
    assert_eq!((code, project.read(journal).lines().count()), (3, 31), "{stderr}");
    assert_eq!(result(&project), expected, "the result does not depend on where a line stands");
    done(&project, &["journal", "drop", journal, "3", "20.."]);
    assert_eq!(project.read(journal).lines().count(), 18);
    assert!(project.path("fits/x/journal.previous-2.jsonl").exists());
    for (line, said) in [
        ("1", "expected one of the lines 2 to 18 and not 1; line 1 is the header"),
        ("19", "lines 2 to 18 and not 19"),
        ("x", "found \"x\", expected a line such as 17, 17..20 or 17.."),
        ("5..3", "5 is behind 3"),
        ("-1", "found \"-1\", expected a line such as 17"),
    ] {
        refused(&project, &["journal", "drop", journal, line], &[said]);
    }
    assert!(!project.path("fits/x/journal.previous-3.jsonl").exists());
}

#[test]
fn a_journal_is_shown_with_names_and_units() {
    let project = of_a_fit();
    let show =
        |more: &[&str]| done(&project, &[&["journal", "show", "fits/x/journal.jsonl"], more].concat()).0;
    let whole = show(&[]);
    for part in [
        "of a fit, layout 3",
        "friction.c: 0.27 to 0.33, by differences",
        "blade.neck_stiffness_n_m_per_rad: 0.0017 to 0.0021 N m/rad, by ratios",
        "low: ",
        " Hz, standard deviation ",
        "gate done",
        "best ",
    ] {
        assert!(whole.contains(part), "{part}: {whole}");
    }
    let line = show(&["--line", "2"]);
    assert!(line.contains("gate") && line.contains("low [Hz]") && line.contains("friction.c"), "{line}");
    assert_eq!(show(&["--last", "3"]).matches("cost_without_scatter").count(), 3);
    assert_eq!(show(&["--best"]).matches("cost_without_scatter").count(), 1);
    let said = "--line: found 32, expected 2 to 31: line 1 is the header";
    refused(&project, &["journal", "show", "fits/x/journal.jsonl", "--line", "32"], &[said]);
    let study = of_a_study();
    let (whole, _) = done(&study, &["journal", "show", "out/journal.jsonl"]);
    assert!(
        whole.contains("friction.c: 4 values from 0.25 to 0.35") && whole.contains("completed"),
        "{whole}"
    );
    refused(&study, &["journal", "show", "out/journal.jsonl", "--best"], &["no point has a cost"]);
}

#[test]
fn a_journal_is_a_table() {
    let (fit, study) = (of_a_fit(), of_a_study());
    let table = |project: &Project, journal: &str| -> Vec<Vec<String>> {
        done(project, &["journal", "export-csv", journal, "--out", "new/table.csv"]);
        let text = project.read("new/table.csv");
        let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(text.as_bytes());
        reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect()
    };
    let rows = table(&fit, "fits/x/journal.jsonl");
    assert_eq!(rows.len(), 31);
    assert_eq!(
        rows[0][..6].join(" "),
        "index stage seed friction.c blade.neck_stiffness_n_m_per_rad cost_without_scatter"
    );
    for row in &rows[1..] {
        let value = |at: usize| row[at].parse::<f64>().unwrap();
        assert!(
            (0.27..=0.33).contains(&value(3)) && (0.0017..=0.0021).contains(&value(4)) && value(5) >= 0.0
        );
    }
    let rows = table(&study, "out/journal.jsonl");
    let by_index = rows[1..].iter().find(|row| row[0] == "6").unwrap();
    assert_eq!((rows.len(), &by_index[1..3]), (13, &["0.95".to_owned(), "0.316666666667".to_owned()][..]));
    refused(&fit, &["journal", "export-csv", "fits/x/journal.jsonl", "--out", "new/table.csv"], &["exists"]);
}

/// The journal as the version before wrote it: layout 2, without checksums, with parameter values and costs.
fn unchecked(project: &Project) -> String {
    done(project, &["journal", "export-csv", "fits/x/journal.jsonl", "--out", "values.csv"]);
    let values = project.read("values.csv");
    let mut values = csv::Reader::from_reader(values.as_bytes()).into_records().map(Result::unwrap);
    let text = project.read("fits/x/journal.jsonl");
    let mut lines = text.lines().map(|line| line.rsplit_once(",\"sha256\"").unwrap().0);
    let header = lines.next().unwrap();
    let header = header.split_once("\"body\"").unwrap().0.replace("\"layout\":3", "\"layout\":2");
    let body = "{\"seed\":3,\"parameters\":[\"friction.c\",\"blade.neck_stiffness_n_m_per_rad\"],\
                \"features\":[\"low\",\"release\"]}";
    let line = |line: &str| {
        let row = values.next().unwrap();
        let stored = format!("\"values\":[\"{}\",\"{}\"],\"cost\":\"1.0\",\"features\"", &row[3], &row[4]);
        line.replacen("\"features\"", &stored, 1) + "}\n"
    };
    format!("{header}\"body\":{body}}}\n") + &lines.map(line).collect::<String>()
}

#[test]
fn a_journal_without_checksums_is_resumed_with_a_warning_and_gets_them() {
    let project = of_a_fit();
    let journal = project.read("fits/x/journal.jsonl");
    let old = unchecked(&project);
    let resume = [&FIT[..], &["--max-evaluations", "30"]].concat();
    project.write("fits/x/journal.jsonl", &old);
    let (code, _, stderr) = project.run(&resume);
    assert_eq!(code, 3, "{stderr}");
    for said in ["layout 2, whose lines have no checksums", "is kept as fits/x/journal.previous-1.jsonl"] {
        assert!(stderr.contains(said), "{stderr}");
    }
    assert_eq!(project.read("fits/x/journal.previous-1.jsonl"), old);
    assert_eq!(project.read("fits/x/journal.jsonl"), journal);
    // what is stored twice must agree
    project.write("fits/x/journal.jsonl", &old.replacen("\"values\":[\"0.2", "\"values\":[\"0.3", 1));
    refused(&project, &resume, &["`values`: found 0.3", "which follows from `unit`"]);
    for command in [
        ["journal", "drop", "fits/x/journal.jsonl", "3"],
        ["journal", "merge", "fits/x/journal.jsonl", "fits/x/journal.previous-1.jsonl"],
    ] {
        project.write("fits/x/journal.jsonl", &old);
        let more = if command[1] == "merge" { &["--out", "merged.jsonl"][..] } else { &[] };
        refused(
            &project,
            &[&command[..], more].concat(),
            &["layout 2, whose lines have no checksums; resume its fit once"],
        );
    }
}

#[test]
fn what_the_model_does_not_give_is_not_believed() {
    let project = of_a_fit();
    let resume = [&FIT[..], &["--max-evaluations", "30"]].concat();
    let journal = project.read("fits/x/journal.jsonl");
    fs::remove_file(project.path("fits/x/result.json")).unwrap();
    // every evaluation is edited, and the checksums are made anew
    let (header, lines) = journal.split_once('\n').unwrap();
    let edited = lines.replace("\"features\":[\"", "\"features\":[\"1");
    let edited = resealed(&format!("{header}\n{edited}"));
    project.write("fits/x/journal.jsonl", &edited);
    refused(
        &project,
        &resume,
        &[
            "found feature 1 1",
            "but computed again the evaluation gives feature 1 ",
            "`wiperlab journal drop ",
        ],
    );
    assert!(!project.path("fits/x/result.json").exists());
    // one alone is edited so that it meets every target, and becomes the best
    project.write("fits/x/journal.jsonl", &journal);
    project.run(&resume);
    let result: serde_json::Value = serde_json::from_str(&project.read("fits/x/result.json")).unwrap();
    fs::remove_file(project.path("fits/x/result.json")).unwrap();
    let targets = [&result["components"][0]["target_hz"], &result["features"][0]["target"]];
    let [low, release] = targets.map(|target| target.as_f64().unwrap());
    let edit = |(line, at): (&str, usize)| match line.split_once("\"features\":[\"") {
        Some((unit, _)) if at == 17 => format!("{unit}\"features\":[\"{low:?}\",\"{release:?}\"]"),
        _ => line.to_owned(),
    };
    let edited: Vec<String> = journal.lines().zip(1..).map(edit).collect();
    project.write("fits/x/journal.jsonl", &resealed(&edited.join("\n")));
    refused(&project, &resume, &["fits/x/journal.jsonl:17: found feature 1 "]);
    assert!(!project.path("fits/x/result.json").exists());
}
