//! `wiperlab demo` as a newcomer runs it, with a budget that shows the way but not the whole fit.

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Most iterates: about half of the whole fit.
const FEW: &str = "40";

fn demo(folder: &Path, more: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_wiperlab"))
        .current_dir(folder)
        .arg("demo")
        .args(more)
        .output()
        .unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn the_demo_goes_from_an_export_to_a_page_and_tells_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let (code, stdout, stderr) = demo(folder.path(), &["--max-evaluations", FEW]);
    assert_eq!(code, 3, "a fit cut short says so: {stderr}");
    for step in ["1/4 import", "2/4 spectrum", "3/4 fit", "4/4 report"] {
        assert!(stderr.contains(step), "{stderr}");
    }
    let at = |path: &str| folder.path().join("demo").join(path);
    let (data, fit, page) = ("data/actual-blade-twin", "fits/actual-blade-twin", "reports/actual-blade-twin");
    for file in ["synthetic-tracker-export.txt", "trace.csv", "recording.toml"] {
        assert!(at(data).join(file).is_file(), "{file}");
    }
    for file in ["job.toml", "journal.jsonl", "result.json"] {
        assert!(at(fit).join(file).is_file(), "{file}");
    }
    for file in ["index.html", "report.json", "history.svg", "spectrum.svg", "stick-slip.svg"] {
        assert!(at(page).join(file).is_file(), "{file}");
    }
    assert!(fs::read_to_string(at(data).join("recording.toml")).unwrap().contains("synthetic = true"));

    // the components of the recording do not depend on the budget: the largest in the low and in the high
    // band
    for (name, [least_hz, most_hz], expected_hz) in
        [("low", [40.0, 140.0], 74.8), ("high", [500.0, 1500.0], 907.7)]
    {
        let list = json(&at("spectra").join(name).join("components.json"));
        let frequency_hz = |c: &serde_json::Value| c["frequency_hz"].as_f64().unwrap();
        let found = list["components"]
            .as_array()
            .unwrap()
            .iter()
            .find(|c| (least_hz..most_hz).contains(&frequency_hz(c)))
            .unwrap();
        // the stick-slip cycle drifts: what the fit reads at the top of a periodogram lies in its range
        let range_hz = |end: &str| found["range_hz"][end].as_f64().unwrap_or(frequency_hz(found));
        let (low_hz, high_hz) = (range_hz("low_hz"), range_hz("high_hz"));
        assert!(
            low_hz < 1.005 * expected_hz && high_hz > 0.995 * expected_hz && high_hz / low_hz < 1.1,
            "{name}: {found}"
        );
    }

    let result = json(&at(fit).join("result.json"));
    assert_eq!((&result["status"], &result["synthetic"]), (&"budget-exhausted".into(), &true.into()));
    let total = result["evaluations"]["total"].as_u64().unwrap();
    assert_eq!(total.to_string(), FEW);
    assert_eq!(fs::read_to_string(at(fit).join("journal.jsonl")).unwrap().lines().count() as u64, total + 1);
    let html = fs::read_to_string(at(page).join("index.html")).unwrap();
    assert!(html.contains("truth (synthetic)"));
    for (name, truth) in
        [("friction.a", "0.108000"), ("friction.b_s_per_m", "4.910000"), ("friction.c", "0.296000")]
    {
        let line = stdout
            .lines()
            .find(|line| line.starts_with(name) && line.contains(truth))
            .unwrap_or_else(|| panic!("{name} in {stdout}"));
        assert!(line.ends_with("yes") || line.ends_with("no"), "{line}");
    }
    assert!(stdout.contains("reports/actual-blade-twin/index.html"));
}

#[test]
fn a_demo_that_cannot_run_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (code, _, stderr) = demo(folder.path(), &["--max-evaluations", "0"]);
    assert!(code == 2 && stderr.contains("'0' for '--max-evaluations <N>'"), "{stderr}");
    fs::write(folder.path().join("taken"), "mine").unwrap();
    let (code, _, stderr) = demo(folder.path(), &["--out", "taken"]);
    assert!(code == 2 && stderr.contains("is a file, expected a folder"), "{stderr}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    assert_eq!(fs::read_to_string(folder.path().join("taken")).unwrap(), "mine");
}
