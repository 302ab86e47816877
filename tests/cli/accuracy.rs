//! `wiperlab accuracy` and the methods of `wiperlab simulate` as a user runs them.

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// The light blade from upright at rest up to `stop_s`; its tip first slips at 0.114 s.
fn scene(stop_s: f64) -> String {
    let text = include_str!("../fixtures/light-blade.toml");
    assert!(text.contains("stop_s = 0.25"));
    text.replace("stop_s = 0.25", &format!("stop_s = {stop_s}"))
}

fn folder_with(text: &str) -> (TempDir, PathBuf, PathBuf) {
    let folder = TempDir::new().unwrap();
    let (file, out) = (folder.path().join("scene.toml"), folder.path().join("out"));
    fs::write(&file, text).unwrap();
    (folder, file, out)
}

fn run(command: &str, file: &Path, out: &Path, more: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("wiperlab")
        .unwrap()
        .arg(command)
        .arg(file)
        .arg("--out")
        .arg(out)
        .args(more)
        .output()
        .unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// Rows of a CSV file, header first.
fn table(path: &Path) -> Vec<Vec<String>> {
    fs::read_to_string(path)
        .unwrap()
        .lines()
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect()
}

#[test]
fn every_method_is_held_against_the_reference() {
    let (_folder, file, out) = folder_with(&scene(0.13));
    let (code, stdout, stderr) = run("accuracy", &file, &out, &[]);
    assert_eq!((code, stderr.as_str()), (0, ""), "{stdout}");
    assert!(stdout.contains("reference: taylor at 1e-13; runge-kutta at the same is"), "{stdout}");

    let rows = table(&out.join("work-precision.csv"));
    assert_eq!(
        rows[0].join(","),
        "method,relative_tolerance,step_s,error,wall_s,rhs_evaluations,transitions"
    );
    let of = |method: &str| rows.iter().filter(|row| row[0] == method).collect::<Vec<_>>();
    let expected = rows.iter().find(|row| row[0] == "taylor" && row[1] == "1e-12").unwrap()[6].clone();
    assert!(expected.parse::<u32>().unwrap() > 10, "the blade vibrates: {expected}");
    for method in ["taylor", "runge-kutta", "slack"] {
        assert_eq!(of(method).len(), 9, "{method}");
        for row in of(method) {
            let [tolerance, error, wall]: [f64; 3] =
                [&row[1], &row[3], &row[4]].map(|cell| cell.parse().unwrap());
            assert!(
                error <= 20.0 * tolerance
                    && row[2].is_empty()
                    && row[6] == expected
                    && wall > 0.0
                    && wall.is_finite(),
                "{row:?}"
            );
        }
    }
    for (method, best_s) in [("fixed-step-end", 1e-4), ("fixed-step-slack", 1e-10)] {
        assert_eq!(of(method).len(), 5, "{method}");
        let finest = of(method)[4];
        assert!(finest[1].is_empty() && finest[2] == "1e-6", "{finest:?}");
        assert!(finest[3].parse::<f64>().unwrap() < best_s, "{finest:?}");
    }
    let accuracy = table(&out.join("accuracy.csv"));
    assert_eq!((accuracy.len(), rows.len()), (38, 38));
    assert!(accuracy.iter().all(|row| row.len() == accuracy[0].len()));
    let place = |name: &str| accuracy[0].iter().position(|column| column == name).unwrap();
    let [error, predicted] = ["transition_error_s", "predicted_time_error_s"].map(place);
    for row in accuracy[1..].iter().filter(|row| row[0] == "taylor") {
        let [error, predicted]: [f64; 2] = [&row[error], &row[predicted]].map(|cell| cell.parse().unwrap());
        // smaller errors are below the accuracy of the reference
        assert!(error < predicted.max(1e-12) && predicted < 100.0 * error.max(1e-13), "{row:?}");
    }
    let figure = fs::read_to_string(out.join("work-precision.svg")).unwrap();
    assert!(
        figure.contains("worst error of a transition time, s") && figure.contains("wall time of a run, s")
    );
}

#[test]
fn a_scene_without_transitions_is_studied_by_its_motion() {
    let (folder, file, out) = folder_with(&scene(0.03));
    let (code, stdout, stderr) = run("accuracy", &file, &out, &[]);
    assert_eq!((code, stderr.as_str()), (0, ""), "{stdout}");
    assert!(stdout.contains("without transitions"), "{stdout}");
    for row in &table(&out.join("work-precision.csv"))[1..] {
        assert!(row[3].is_empty() && row[6] == "0", "{row:?}");
    }
    assert!(
        fs::read_to_string(out.join("work-precision.svg"))
            .unwrap()
            .contains("worst error of the deflection over its range")
    );

    // all but the times comes out the same again, and quietly so
    let again = folder.path().join("again");
    assert_eq!(run("accuracy", &file, &again, &["--quiet"]), (0, String::new(), String::new()));
    assert_eq!(fs::read(out.join("accuracy.csv")).unwrap(), fs::read(again.join("accuracy.csv")).unwrap());
}

#[test]
fn a_scene_that_ends_early_is_studied_up_to_its_end() {
    let (_folder, file, out) =
        folder_with(&scene(0.25).replace("preload_force_n = 0.2813", "preload_force_n = 0.03"));
    let (code, stdout, _) = run("accuracy", &file, &out, &[]);
    assert_eq!(code, 3, "{stdout}");
    assert!(stdout.contains("the reference ends early: contact-lost at"), "{stdout}");
    let rows = table(&out.join("accuracy.csv"));
    let place = |name: &str| rows[0].iter().position(|column| column == name).unwrap();
    for row in rows[1..].iter().filter(|row| !row[place("method")].starts_with("fixed")) {
        let [tolerance, stop_error]: [f64; 2] =
            [&row[1], &row[place("stop_error_s")]].map(|cell| cell.parse().unwrap());
        assert!(row[place("status")] == "contact-lost" && stop_error <= 20.0 * tolerance, "{row:?}");
    }
}

#[test]
fn a_scene_that_cannot_be_studied_is_refused() {
    let (folder, file, out) = folder_with(&scene(0.03));
    let (code, _, stderr) = run("accuracy", &folder.path().join("none.toml"), &out, &[]);
    assert!(code == 2 && stderr.contains("none.toml: no such file; check the path"), "{stderr}");
    fs::write(&file, scene(-1.0)).unwrap();
    let (code, _, stderr) = run("accuracy", &file, &out, &[]);
    assert!(code == 2 && stderr.contains("key `run.stop_s`"), "{stderr}");
    assert!(!out.exists());
}

#[test]
fn simulate_takes_every_method_and_its_summary_names_it() {
    let (folder, file, _) = folder_with(&scene(0.12));
    let methods: [(&[&str], &str); 6] = [
        (&[], "taylor"),
        (&["--method", "adaptive"], "taylor"),
        (&["--method", "runge-kutta"], "runge-kutta"),
        (&["--method", "slack"], "slack"),
        (&["--method", "fixed-step", "--step", "1e-5"], "fixed-step"),
        (
            &["--method", "fixed-step", "--step", "1e-5", "--transitions", "step-end", "--gain", "0"],
            "fixed-step",
        ),
    ];
    for (i, (options, name)) in methods.into_iter().enumerate() {
        let out = folder.path().join(i.to_string());
        let (code, _, stderr) = run("simulate", &file, &out, options);
        assert_eq!((code, stderr.as_str()), (0, ""), "{options:?}");
        let summary: serde_json::Value =
            serde_json::from_str(&fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
        assert_eq!(summary["method"], name);
        let fixed = name == "fixed-step";
        assert_eq!(
            (summary["relative_tolerance"].is_null(), summary["step_s"].is_null()),
            (fixed, !fixed),
            "{options:?}"
        );
        if fixed {
            assert_eq!(summary["step_s"], 1e-5);
            assert!(summary["steps"].as_u64().unwrap() >= 12_000, "0.12 s in steps of 10 us");
        }
    }
}

#[test]
fn options_that_do_not_fit_the_method_are_refused() {
    let refused = |options: &[&str], parts: &[&str]| {
        let (_folder, file, out) = folder_with(&scene(0.06));
        let (code, stdout, stderr) = run("simulate", &file, &out, options);
        assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
        for part in parts {
            assert!(stderr.contains(part), "expected {part:?} in {stderr}");
        }
        assert!(!out.exists());
    };
    let fixed = |more: &[&'static str]| [&["--method", "fixed-step"], more].concat();
    refused(&fixed(&[]), &["--step: found nothing, expected a length in seconds", "add --step 1e-5"]);
    refused(&fixed(&["--step", "0"]), &["--step: found 0, expected a number of seconds above 0"]);
    refused(&fixed(&["--step", "-1e-5"]), &["--step: found -0.00001"]);
    refused(&fixed(&["--step", "nan"]), &["--step: found NaN"]);
    refused(
        &fixed(&["--step", "1"]),
        &["--step: found 1, expected a number of seconds above 0, at most the run's 0.06"],
    );
    refused(&fixed(&["--step", "1e-15"]), &["at most 1e10 steps"]);
    refused(&fixed(&["--step", "1e-5", "--gain", "-1"]), &["--gain: found -1, expected a number from 0 to"]);
    refused(
        &fixed(&["--step", "1e-3"]),
        &[
            "--gain: found 10000, expected a number from 0 to 2.7850e3 1/s",
            "choose a shorter step or a smaller gain",
        ],
    );
    refused(
        &fixed(&["--step", "1e-5", "--relative-tolerance", "1e-8"]),
        &["--relative-tolerance: found 0.00000001 with --method fixed-step", "remove it"],
    );
    for (option, value) in [("--step", "1e-5"), ("--transitions", "slack"), ("--gain", "0")] {
        let found = if option == "--step" { "0.00001" } else { value };
        let start = format!(
            "{option}: found {found} with --method slack, expected it with --method fixed-step alone"
        );
        refused(&["--method", "slack", option, value], &[&start]);
    }
}
