//! `result.json` is what the fit wrote: a changed digit is refused by the hash that the file carries, and
//! most of them also by the model that a report runs.

use crate::sealed::resealed_result;
use crate::small_fit::{JOB, Project};
use serde_json::Value;
use std::path::Path;
use wiperlab::fit::job::Job;
use wiperlab::fit::result::FitResult;
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::recording::files::{RecordingFile, read_recording};
use wiperlab::simulate::scene::Scene;

/// Keys of numbers that one evaluation of the model and arithmetic cannot give, and why. For these the hash
/// alone stands.
const NOT_COMPUTED: [(&str, &str); 13] = [
    ("gate.", "evaluations before the search, all over the bounds"),
    ("waterfall", "where each local search went"),
    ("evaluations.", "counts of the search"),
    (".profile[", "a fit at each point"),
    (".profile_95", "ends of the profile"),
    (".linear_95", "sensitivities, which take evaluations around the estimates"),
    (".bootstrap_95", "fits of twins"),
    (".lower_95", "ends of the intervals above, and points that the search met"),
    (".upper_95", "ends of the intervals above, and points that the search met"),
    ("model_scatter", "sensitivities; the cost shows one that is not far below the deviation of its target"),
    ("twin_sd", "fits of twins"),
    ("rank", "sensitivities"),
    ("twins", "counts of the fits of twins"),
];
/// The same for whole tables.
const TABLES_NOT_COMPUTED: [(&str, &str); 5] = [
    ("chatter.", "a branch of cycles, which `stability` computes again"),
    ("condition", "sensitivities"),
    ("sensitivities.", "evaluations around the estimates"),
    ("correlations.", "sensitivities"),
    ("combinations", "sensitivities"),
];

fn not_computed(key: &str) -> bool {
    let named = |(part, _): &(&str, &str)| key.contains(part);
    NOT_COMPUTED.iter().any(named) || TABLES_NOT_COMPUTED.iter().any(named)
}

/// A job of the repository with its scenes and recordings.
fn problem(fit: &str) -> (Problem, String) {
    problem_in(Path::new(env!("CARGO_MANIFEST_DIR")), fit)
}

/// The same of another folder.
fn problem_in(root: &Path, fit: &str) -> (Problem, String) {
    let folder = root.join("fits").join(fit);
    let read = |path: &Path| std::fs::read_to_string(path).unwrap();
    let job = Job::parse("job.toml", &read(&folder.join("job.toml"))).unwrap();
    let scenes = job.conditions.iter().map(|c| Scene::parse("scene", &read(&folder.join(&c.scene))).unwrap());
    let scenes = scenes.collect();
    let measured = job.recordings().map(|path| {
        let at = folder.join(path);
        let file = RecordingFile::parse("recording.toml", &read(&at.join("recording.toml"))).unwrap();
        let recording =
            read_recording("twin", "trace.csv", &read(&at.join("trace.csv")), Some(&file)).unwrap();
        MeasuredRecording { recording, exposure_s: file.camera.exposure_s }
    });
    let measured = measured.collect();
    (Problem::new(job, scenes, measured).unwrap(), read(&folder.join("result.json")))
}

/// Every number of a text of JSON: its key, and where its digits lie.
fn numbers(text: &str) -> Vec<(String, std::ops::Range<usize>)> {
    let (mut found, mut path, mut at) = (Vec::new(), Vec::<(String, Option<usize>)>::new(), 0);
    let mut key = String::new();
    let bytes = text.as_bytes();
    let shown = |path: &[(String, Option<usize>)], key: &str| {
        let mut all = String::new();
        for (name, index) in path {
            all += &match index {
                Some(index) => format!("{name}[{index}]"),
                None => format!("{name}."),
            };
        }
        let last_is_list = path.last().is_some_and(|(_, index)| index.is_some());
        all + if last_is_list { "" } else { key }
    };
    while at < bytes.len() {
        match bytes[at] {
            b'"' => {
                let start = at + 1;
                at = start;
                while bytes[at] != b'"' {
                    at += if bytes[at] == b'\\' { 2 } else { 1 };
                }
                if bytes.get(at + 1) == Some(&b':') {
                    key = text[start..at].to_owned();
                }
            }
            b'{' | b'[' => {
                let list = (bytes[at] == b'[').then_some(0);
                let own =
                    if path.last().is_some_and(|(_, index)| index.is_some()) { "" } else { key.as_str() };
                path.push((own.to_owned(), list));
            }
            b'}' | b']' => {
                path.pop();
            }
            b',' => path.last_mut().and_then(|(_, index)| index.as_mut()).into_iter().for_each(|i| *i += 1),
            b'0'..=b'9' | b'-' => {
                let start = at;
                while matches!(bytes[at], b'0'..=b'9' | b'-' | b'+' | b'.' | b'e' | b'E') {
                    at += 1;
                }
                found.push((shown(&path[1..], &key), start..at));
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    found
}

/// The number with its first digit that can be changed changed.
fn other(number: &str) -> Option<String> {
    let at = number.find(|c: char| ('1'..='9').contains(&c))?;
    let digit = number.as_bytes()[at];
    let mut other = number.to_owned();
    other.replace_range(
        at..=at,
        if digit == b'9' { "8" } else { ["2", "3", "4", "5", "6", "7", "8", "9"][usize::from(digit - b'1')] },
    );
    Some(other)
}

#[test]
fn every_changed_number_is_refused_by_the_hash_and_what_can_be_computed_by_the_model_too() {
    let (problem, text) = problem("published-simulation");
    let check = |text: &str| {
        let result: FitResult = serde_json::from_str(text).map_err(|error| error.to_string())?;
        result.check_against_job(problem.job(), "r").map_err(|error| error.to_string())?;
        problem.check_result(&result, "r").map_err(|error| error.to_string())
    };
    assert_eq!(check(&text), Ok(()), "the committed result is what the model shows");
    let (mut by_hash, mut by_model, mut believed) = (0, 0, Vec::new());
    for (key, range) in numbers(&text) {
        let Some(number) = other(&text[range.clone()]) else { continue };
        let mut changed = text.clone();
        changed.replace_range(range, &number);
        assert!(FitResult::parse("r", &changed).is_err(), "{key}: {number}");
        by_hash += 1;
        if not_computed(&key) {
            continue;
        }
        match check(&changed) {
            Err(why) => by_model += usize::from(why.starts_with("r: not the result of a fit: ")),
            Ok(()) => believed.push(format!("{key}: {number}")),
        }
    }
    assert!(believed.is_empty(), "only the hash refuses {believed:#?}");
    assert!(by_hash > 150 && by_model > 20, "{by_hash} numbers, {by_model} by the model");
}

/// The small fit with a deflection, whose camera is estimated.
fn with_deflection() -> String {
    let deflection = "[[feature]]\nname = \"lean\"\nkind = \"mean-deflection\"\n\
                      window = \"reversal-0.1..reversal-0.06\"\nsd_relative = 0.005\n\n[search]";
    JOB.replacen("[search]", deflection, 1)
}

#[test]
fn what_is_estimated_of_a_camera_is_shown_and_computed_again() {
    let project = Project::of("twin");
    project.write("fits/x/job.toml", &with_deflection());
    let (code, stdout, stderr) = project.run(&["fit", "fits/x/job.toml"]);
    assert_eq!(code, 3, "{stderr}");
    let shown = |name: &str| stdout.lines().any(|line| line.starts_with(&format!("recording 1: {name}")));
    assert!(
        stdout.contains("camera and constants") && shown("offset_x_m") && shown("scale_relative"),
        "{stdout}"
    );
    let text = project.read("fits/x/result.json");
    let whole: Value = serde_json::from_str(&text).unwrap();
    let lean = &whole["features"][1];
    let [model, seen] = ["model", "model_seen"].map(|key| lean[key].as_f64().unwrap());
    let number = |name: &str| {
        let list = whole["nuisances"].as_array().unwrap();
        list.iter().find(|n| n["name"] == name).unwrap()["estimate"].as_f64().unwrap()
    };
    assert!(((1.0 + number("scale_relative")) * model + number("offset_x_m") - seen).abs() < 1e-15, "{lean}");
    assert!(
        (lean["relative_error"].as_f64().unwrap() - (seen / lean["target"].as_f64().unwrap() - 1.0)).abs()
            < 1e-12
    );
    let (code, _, stderr) = project.run(&["report", "fits/x", "--quiet"]);
    assert_eq!(code, 0, "{stderr}");
    let page = project.read("reports/x/index.html");
    assert!(
        page.contains("offset_<wbr>x_<wbr>m")
            && page.contains("without the offset and the scale of its camera")
    );
    let (problem, text) = problem_in(project.folder.path(), "x");
    let check = |edit: fn(&mut Value)| {
        let mut value: Value = serde_json::from_str(&text).unwrap();
        edit(&mut value);
        problem.check_result(&serde_json::from_value(value).unwrap(), "r").map_err(|e| e.to_string())
    };
    assert_eq!(check(|_| ()), Ok(()));
    type Edit = fn(&mut Value);
    let cases: [(Edit, &str); 5] = [
        (
            |r| r["nuisances"][1]["estimate"] = 0.01.into(),
            "nuisances[1].estimate: found 0.01, computed again ",
        ),
        (
            |r| r["nuisances"][0]["prior_sd"] = 0.1.into(),
            "nuisances[0].prior_sd: found 0.1, computed again 0.005",
        ),
        (|r| r["nuisances"] = Value::Array(Vec::new()), "nuisances: found "),
        (
            |r| r["features"][1]["model_seen"] = 0.1.into(),
            "features[1].model_seen: found 0.1, computed again ",
        ),
        (|r| r["nuisances"][1]["upper_95"] = (-0.1).into(), "expected an interval that holds"),
    ];
    for (edit, words) in cases {
        let refused = check(edit).unwrap_err();
        assert!(refused.contains(words), "{refused}");
    }
}

#[test]
fn what_the_model_does_not_show_is_named_with_both_values() {
    let project = Project::of("twin");
    project.write("fits/x/job.toml", JOB);
    assert_eq!(project.run(&["fit", "fits/x/job.toml", "--quiet"]).0, 3);
    let text = project.read("fits/x/result.json");
    let whole: Value = serde_json::from_str(&text).unwrap();
    type Edit = fn(&mut Value);
    let cases: [(Edit, &[&str]); 9] = [
        (|r| r["features"][0]["model"] = 0.1.into(), &["features[0].model: found 0.1, computed again 0.0"]),
        (
            |r| r["features"][0]["missing"] = "no".into(),
            &["features[0].missing: found \"no\", computed again null"],
        ),
        (
            |r| r["components"][0]["pass"] = false.into(),
            &["components[0].pass: found false, computed again true"],
        ),
        (
            |r| r["components"][0]["relative_error"] = 0.25.into(),
            &["components[0].relative_error: found 0.25"],
        ),
        (|r| r["cost"] = 0.125.into(), &["cost: found 0.125, computed again "]),
        (|r| r["seed"] = 4.into(), &["seed: found 4, computed again 3"]),
        (|r| r["version"] = "0.0.9".into(), &["version: found \"0.0.9\""]),
        (
            |r| r["parameters"]["friction.c"]["verdict"] = "at-bound".into(),
            &["parameters.friction.c.verdict: found \"at-bound\", computed again"],
        ),
        (
            |r| r["parameters"]["friction.c"]["upper_95"] = 0.271.into(),
            &["parameters.friction.c.upper_95: found 0.271, expected none, as the fit is budget-exhausted"],
        ),
    ];
    let mut without = whole.clone();
    without.as_object_mut().unwrap().remove("sha256");
    project.write("fits/x/result.json", &without.to_string());
    let (code, _, stderr) = project.run(&["report", "fits/x"]);
    assert!(code == 2 && stderr.contains("found no `sha256`"), "{stderr}");
    assert!(stderr.contains("run `wiperlab fit` again"), "{stderr}");
    for (edit, parts) in cases {
        let mut value = whole.clone();
        edit(&mut value);
        project.write("fits/x/result.json", &resealed_result(&value.to_string()));
        for fits in [&["fits/x"][..], &["fits/x", "fits/y"]] {
            if fits.len() > 1 {
                project.write("fits/y/job.toml", JOB);
                project.write("fits/y/result.json", &text);
            }
            let (code, _, stderr) = project.run(&[&["report"], fits].concat());
            assert_eq!(code, 2, "{stderr}");
            for part in parts {
                assert!(stderr.contains(part), "expected {part:?} in {stderr}");
            }
        }
    }
}
