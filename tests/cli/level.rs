//! The tilt of the camera as a user meets it: `inspect` and `import` say it, `import --level` takes it out
//! and keeps what it did.

use assert_cmd::Command;
use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use wiperlab::recording::files::RecordingFile;

const FRAMES: usize = 1_000;
const CAMERA: [&str; 6] = ["--frame-rate-hz", "5000", "--scale", "20um/px", "--y-axis", "down"];
const COLUMNS: [&str; 2] = ["--columns", "frame=1,tip-x=2,tip-y=3,head-x=4,head-y=5"];

/// A stroke of 60 mm and back in pixels of 20 um, y downwards, seen by a camera tilted by `degrees`; a head 6
/// mm above the tip.
fn table(degrees: f64, digits: usize) -> String {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let cells = |x: f64, y: f64| {
        let (x, y) = (1_000.0 + cos * x - sin * y, 800.0 - (sin * x + cos * y));
        format!("{x:.digits$},{y:.digits$}")
    };
    // tracking noise of a tenth of a pixel that is no random number
    let noise = |i: usize| 0.14 * (12.9898 * i as f64 + 4.1 * (i as f64).powi(2)).sin();
    let head = |i: usize| 1_500.0 * (1.0 - (TAU * i as f64 / FRAMES as f64).cos());
    (0..FRAMES)
        .map(|i| {
            let side = if 2 * i < FRAMES { -50.0 } else { 50.0 };
            let tip = cells(head(i) + side + noise(i), noise(i + 7_000));
            format!("{i},{tip},{}\n", cells(head(i) + noise(i + 3_000), 300.0 + noise(i + 5_000)))
        })
        .collect()
}

fn folder_with(text: &str) -> (TempDir, PathBuf, PathBuf) {
    let folder = TempDir::new().unwrap();
    let (source, out) = (folder.path().join("run.csv"), folder.path().join("out"));
    fs::write(&source, text).unwrap();
    (folder, source, out)
}

fn run(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("wiperlab").unwrap().args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn import(source: &Path, out: &Path, more: &[&str]) -> (i32, String, String) {
    let paths = ["import", source.to_str().unwrap(), "--out", out.to_str().unwrap()];
    run(&[&paths[..], &CAMERA, &COLUMNS, more].concat())
}

fn description(out: &Path) -> RecordingFile {
    RecordingFile::parse("recording.toml", &fs::read_to_string(out.join("recording.toml")).unwrap()).unwrap()
}

fn heights(out: &Path) -> Vec<f64> {
    let trace = fs::read_to_string(out.join("trace.csv")).unwrap();
    trace.lines().skip(1).map(|line| line.split(',').nth(2).unwrap().parse().unwrap()).collect()
}

#[test]
fn a_tilt_is_said_with_its_uncertainty_and_its_consequence() {
    let (_folder, source, out) = folder_with(&table(0.3, 4));
    let (code, stdout, stderr) = import(&source, &out, &[]);
    assert_eq!(code, 0, "{stderr}");
    let line =
        stdout.lines().find(|line| line.contains("the glass rises by")).unwrap_or_else(|| panic!("{stdout}"));
    assert!(line.starts_with("verdict: caution: the glass rises by 0.300"), "{line}");
    for part in
        ["every deflection is shifted by 31.", "standard deviations of its noise", "head drop", "--level"]
    {
        assert!(line.contains(part), "{part}: {line}");
    }
    let (_, inspected, _) = run(&["inspect", out.to_str().unwrap()]);
    assert!(inspected.contains(line) && inspected.contains("\ntilt              0.300"), "{inspected}");
    let (_, json, _) = run(&["inspect", out.to_str().unwrap(), "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let (angle, sd) = (json["tilt"]["angle_rad"].as_f64().unwrap(), json["tilt"]["sd_rad"].as_f64().unwrap());
    assert!((angle - 0.3_f64.to_radians()).abs() < 3.0 * sd && sd < 2e-5, "{angle} {sd}");
    assert!(json["findings"].as_array().unwrap().iter().any(|f| f["check"] == "tilt"), "{json}");
}

#[test]
fn a_tilt_is_taken_out_on_request_and_comes_back_without_it() {
    let (_folder, source, out) = folder_with(&table(0.3, 4));
    import(&source, &out, &[]);
    let original = fs::read(out.join("trace.csv")).unwrap();
    assert!(description(&out).level.is_none());
    let (code, stdout, stderr) = import(&source, &out, &["--level", "--force"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("note: level: the glass was inclined by 0.300"), "{stdout}");
    let level = description(&out).level.unwrap();
    assert!(level.applied && level.frames > 900, "{level:?}");
    assert!((level.angle_rad - 0.3_f64.to_radians()).abs() < 3.0 * level.sd_rad, "{level:?}");
    let heights = heights(&out);
    assert!(heights.iter().all(|y| (y - level.centre_y_m).abs() < 1e-5), "{level:?}");
    let (_, inspected, _) = run(&["inspect", out.to_str().unwrap()]);
    assert!(!inspected.contains("the glass rises by"), "{inspected}");
    assert!(inspected.contains("level             the glass was inclined by 0.300"), "{inspected}");
    assert_eq!(import(&source, &out, &["--force"]).0, 0);
    assert_eq!(fs::read(out.join("trace.csv")).unwrap(), original);
    assert!(description(&out).level.is_none());
}

#[test]
fn a_level_recording_is_left_as_it_is() {
    let (_folder, source, out) = folder_with(&table(0.0, 4));
    let (_, stdout, _) = import(&source, &out, &[]);
    assert!(!stdout.contains("the glass rises by"), "{stdout}");
    let original = fs::read(out.join("trace.csv")).unwrap();
    let (code, stdout, _) = import(&source, &out, &["--level", "--force"]);
    assert!(code == 0 && stdout.contains("the tracks are as in the export"), "{stdout}");
    assert!(!description(&out).level.unwrap().applied);
    assert_eq!(fs::read(out.join("trace.csv")).unwrap(), original);
}

#[test]
fn whole_pixels_are_still_named_after_a_rotation() {
    let (_folder, source, out) = folder_with(&table(0.5, 0));
    let (_, stdout, _) = import(&source, &out, &["--level"]);
    assert!(description(&out).level.unwrap().applied, "{stdout}");
    let (_, inspected, _) = run(&["inspect", out.to_str().unwrap()]);
    assert!(inspected.contains("(whole pixels), coarser than the noise"), "{inspected}");
}

#[test]
fn what_cannot_be_levelled_is_refused_and_nothing_is_written() {
    let without = |column: usize, only: Option<usize>| -> String {
        let emptied = |(row, line): (usize, &str)| {
            let mut cells: Vec<&str> = line.split(',').collect();
            if only.is_none_or(|only| only == row) {
                cells[column] = "";
            }
            cells.join(",") + "\n"
        };
        table(0.3, 4).lines().enumerate().map(emptied).collect()
    };
    let cases = [
        (without(2, None), "the tip has x and y in 0 frames, expected at least 50"),
        (without(4, None), "the head has only one of x and y in 1000 frames, the first is frame 0"),
        (without(4, Some(17)), "the head has only one of x and y in 1 frames, the first is frame 17"),
        (table(0.3, 4).lines().take(60).map(|line| format!("{line}\n")).collect(), "the tip travels"),
    ];
    for (text, part) in cases {
        let (_folder, source, out) = folder_with(&text);
        let (code, _, stderr) = import(&source, &out, &["--level"]);
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains("run.csv: --level: ") && stderr.contains(part), "{part}: {stderr}");
        assert!(stderr.contains("import without --level"), "{stderr}");
        assert!(!out.exists(), "{stderr}");
        assert_eq!(import(&source, &out, &[]).0, 0);
    }
}
