//! `wiperlab inspect` as a user runs it: the verdict as text and as JSON, a scene's components, and what the
//! import kept.

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const TWIN: &str = "data/actual-blade-twin";
const SCENE: &str = "data/scenes/actual-blade.toml";

fn run(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("wiperlab")
        .unwrap()
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn shown(arguments: &[&str]) -> String {
    let (code, stdout, stderr) = run(arguments);
    assert_eq!((code, stderr.as_str()), (0, ""));
    stdout
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&shown(arguments)).unwrap()
}

/// A head that sweeps 20 mm and back within 0.4 s and a tip 1 mm behind, in whole pixels of 20 um, 1,000
/// frames/s.
fn imported() -> (TempDir, PathBuf, String) {
    let folder = TempDir::new().unwrap();
    let (source, out) = (folder.path().join("run.csv"), folder.path().join("run"));
    let place = |i: u32| (500.0 * (1.0 - (std::f64::consts::TAU * f64::from(i) / 400.0).cos())).round();
    let rows: String = (0..400)
        .map(|i| format!("{i},{},{},{},{}\n", 1_000.0 + place(i), 800, 1_050.0 + place(i), 500))
        .collect();
    fs::write(&source, rows).unwrap();
    let camera =
        ["--frame-rate-hz", "1000", "--scale", "20um/px", "--y-axis", "down", "--exposure-s", "0.001"];
    let columns = ["--columns", "frame=1,tip-x=2,tip-y=3,head-x=4,head-y=5"];
    let paths = ["import", source.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let (code, stdout, stderr) = run(&[&paths[..], &camera, &columns].concat());
    assert_eq!(code, 0, "{stderr}");
    (folder, out, stdout)
}

fn verdicts(text: &str) -> Vec<&str> {
    text.lines().filter_map(|line| line.strip_prefix("verdict: ")).collect()
}

fn path(folder: &Path) -> &str {
    folder.to_str().unwrap()
}

#[test]
fn the_grade_comes_first_and_the_motion_is_summed_up() {
    let text = shown(&["inspect", TWIN]);
    assert!(verdicts(&text)[0].starts_with("good: shows oscillations from about 5.085 Hz"), "{text}");
    assert!(text.contains("blade height      5.") && text.contains("mm, median of head above tip"), "{text}");
    assert!(!text.contains("components") && !text.contains("published"), "{text}");
    assert!(text.contains("reversal 1        at 0.107"), "{text}");
}

#[test]
fn quiet_leaves_the_verdict() {
    let text = shown(&["inspect", TWIN, "--quiet"]);
    assert!(text.lines().all(|line| line.starts_with("verdict: ")) && verdicts(&text).len() == 2, "{text}");
}

#[test]
fn json_is_one_object_with_every_part() {
    let found = json(&["inspect", TWIN, "--json"]);
    let keys: Vec<&str> = found.as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(
        keys,
        ["findings", "grade", "measurements", "motion", "recording", "reversals", "synthetic", "tilt"]
    );
    assert_eq!(
        (&found["grade"], &found["recording"], &found["synthetic"]),
        (&"good".into(), &"actual-blade-twin".into(), &true.into())
    );
    assert_eq!(found["measurements"]["frames"], 2951);
    let turns = found["reversals"].as_array().unwrap();
    assert_eq!(turns.len(), 1);
    let at = |key: &str| turns[0][key].as_f64().unwrap();
    assert!(at("hold_s") < at("reversal_s") && at("reversal_s") < at("release_s"), "{turns:?}");
    for finding in found["findings"].as_array().unwrap() {
        assert!(
            finding["value"].is_number() && finding["unit"].is_string() && finding["severity"] == "note",
            "{finding}"
        );
    }
}

#[test]
fn a_scene_names_its_own_components() {
    let found = json(&["inspect", TWIN, "--json", "--scene", SCENE]);
    assert!(
        found["components"]["source"].as_str().unwrap().starts_with("modes of the scene \"Actual blade"),
        "{found}"
    );
    let components = found["components"]["shown"].as_array().unwrap();
    let names: Vec<&str> = components.iter().map(|component| component["name"].as_str().unwrap()).collect();
    assert_eq!(names[..3], ["head on its spring", "tip held, mode 1", "tip slides, mode 1"]);
    assert_eq!(names.len(), 7);
    assert!((components[0]["frequency_hz"].as_f64().unwrap() - 20.0).abs() < 0.05);
    assert!(components.iter().any(|component| component["verdict"] == "shown"));
    let (code, _, stderr) = run(&["inspect", TWIN, "--scene", "none.toml"]);
    assert!(code == 2 && stderr.contains("none.toml: no such file"), "{stderr}");
}

#[test]
fn import_ends_with_the_verdict_that_inspect_gives() {
    let (_folder, out, stdout) = imported();
    let text = shown(&["inspect", path(&out)]);
    assert_eq!(verdicts(&stdout), verdicts(&text));
    assert!(verdicts(&text)[0].starts_with("usable with care"), "{text}");
    assert!(
        text.contains(
            "verdict: caution: tip-x, head-x (most in tip-x): written in steps of 20.000 um (whole pixels)"
        ),
        "{text}"
    );
}

#[test]
fn findings_of_the_import_are_shown_among_the_others() {
    let (_folder, out, _) = imported();
    let description = out.join("recording.toml");
    let kept = "\n[[source.findings]]\ncheck = \"implied-rate\"\nseverity = \"serious\"\nvalue = 30.0\nunit = \"Hz\"\nfound = \"the times imply 30 frames/s\"\nadvice = \"check the rate\"\n";
    fs::write(&description, fs::read_to_string(&description).unwrap() + kept).unwrap();
    let text = shown(&["inspect", path(&out)]);
    assert!(verdicts(&text)[0].starts_with("not usable until the serious findings are resolved"), "{text}");
    assert_eq!(verdicts(&text)[1], "serious: the times imply 30 frames/s; check the rate");
    let found = json(&["inspect", path(&out), "--json"]);
    assert_eq!(
        (&found["findings"][0]["check"], &found["grade"]),
        (&"implied-rate".into(), &"not-usable".into())
    );
}

#[test]
fn a_changed_source_is_a_finding() {
    let (_folder, out, _) = imported();
    fs::write(out.join("run.csv"), "other").unwrap();
    let found = json(&["inspect", path(&out), "--json"]);
    let changed: Vec<&Value> = found["findings"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|finding| finding["check"] == "source-changed")
        .collect();
    assert_eq!(changed.len(), 1);
    assert_eq!((&changed[0]["severity"], &changed[0]["value"]), (&"caution".into(), &1.0.into()));
}

#[test]
fn a_trace_alone_is_judged_without_a_camera() {
    let (folder, out, _) = imported();
    let alone = folder.path().join("alone.csv");
    fs::copy(out.join("trace.csv"), &alone).unwrap();
    let text = shown(&["inspect", path(&alone)]);
    assert!(text.contains("verdict: note: the exposure is not known"), "{text}");
    assert!(!text.contains("whole pixels"), "{text}");
}

#[test]
fn uneven_times_of_a_trace_alone_are_kept_and_the_grid_is_named() {
    let folder = TempDir::new().unwrap();
    let (file, out) = (folder.path().join("trace.csv"), folder.path().join("spectrum"));
    let mut time_s = 0.0_f64;
    let row = |i: usize| {
        time_s += if i < 150 { 0.0199 } else { 0.0213 };
        format!("{time_s},{},,0,\n", 1e-3 * (45.9 * time_s).cos())
    };
    let rows: String = (0..300).map(row).collect();
    fs::write(&file, format!("time_s,tip_x_m,tip_y_m,head_x_m,head_y_m\n{rows}")).unwrap();
    let said = "frames off a grid of 48.538";
    assert!(verdicts(&shown(&["inspect", path(&file)])).iter().any(|line| line.contains(said)));
    let text = shown(&["spectrum", path(&file), "--fastest-hz", "20", "--out", path(&out)]);
    assert!(text.contains(said), "{text}");
}
