//! `wiperlab import` and `wiperlab inspect` as a user runs them: exit codes, messages, and what lies on disk
//! afterwards.

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const GOOD: &str = "\ttip\t\thead\t\nt\tx\ty\tx\ty\n0.000\t1.5\t2.5\t3.5\t4.5\n0.001\t1.6\t2.6\t3.6\t4.6\n0.002\t1.7\t2.7\t3.7\t4.7\n";
const CAMERA: [&str; 6] = ["--frame-rate-hz", "1000", "--scale", "mm", "--y-axis", "up"];

const ALL: &str = "time=1,tip-x=2,tip-y=3";

fn folder_with(text: &str) -> (TempDir, PathBuf, PathBuf) {
    let folder = TempDir::new().unwrap();
    let (source, out) = (folder.path().join("run.txt"), folder.path().join("out"));
    fs::write(&source, text).unwrap();
    (folder, source, out)
}

fn run(source: &Path, out: &Path, more: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("wiperlab").unwrap();
    let output = command.arg("import").arg(source).arg("--out").arg(out).args(more).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn inspect(path: &Path) -> (i32, String, String) {
    let output = Command::cargo_bin("wiperlab").unwrap().arg("inspect").arg(path).output().unwrap();
    (
        output.status.code().unwrap(),
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

/// Bad input ends with code 2, a message that has every part, and no folder.
fn refused(text: &str, more: &[&str], parts: &[&str]) {
    let (_folder, source, out) = folder_with(text);
    let (code, _, stderr) = run(&source, &out, &[&CAMERA[..], more].concat());
    assert_eq!(code, 2, "{stderr}");
    for part in parts {
        assert!(stderr.contains(part), "expected {part:?} in {stderr}");
    }
    assert!(!out.exists(), "{stderr}");
}

#[test]
fn a_recording_is_written_whole_and_inspected() {
    let (_folder, source, out) = folder_with(GOOD);
    let (code, stdout, stderr) = run(&source, &out, &CAMERA);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("recording, 3 frames at 1000 frames/s"), "{stdout}");
    assert_eq!(fs::read_to_string(out.join("run.txt")).unwrap(), GOOD);
    assert!(
        fs::read_to_string(out.join("trace.csv"))
            .unwrap()
            .starts_with("time_s,tip_x_m,tip_y_m,head_x_m,head_y_m\n0,0.0015,")
    );
    assert_eq!(fs::read_dir(&out).unwrap().count(), 4, "export, trace, description, marker");
    for path in [out.clone(), out.join("trace.csv")] {
        let (code, stdout, _) = inspect(&path);
        assert_eq!(code, 0);
        assert!(
            stdout.contains("recording rate    1000 frames/s (Nyquist 500 Hz)")
                && stdout.contains("verdict: too short"),
            "{stdout}"
        );
    }
}

#[test]
fn another_recording_is_not_overwritten_unless_forced() {
    let (_folder, source, out) = folder_with(GOOD);
    assert_eq!(run(&source, &out, &CAMERA).0, 0);
    let (code, _, stderr) = run(&source, &out, &CAMERA);
    assert!(code == 2 && stderr.contains("add --force to import the same exports again"), "{stderr}");
    assert_eq!(run(&source, &out, &[&CAMERA[..], &["--force", "--quiet"]].concat()).0, 0);
}

#[test]
fn the_help_names_every_format() {
    let output = Command::cargo_bin("wiperlab").unwrap().args(["import", "--help"]).output().unwrap();
    let help = String::from_utf8(output.stdout).unwrap();
    for name in wiperlab::import::format_names() {
        assert!(help.contains(name), "{name} is not in the help");
    }
}

#[test]
fn a_changed_source_is_noticed() {
    let (_folder, source, out) = folder_with(GOOD);
    run(&source, &out, &CAMERA);
    fs::write(out.join("run.txt"), "other").unwrap();
    assert!(inspect(&out).1.contains("run.txt is not the file that was imported"));
}

#[test]
fn a_dry_run_writes_nothing() {
    let (_folder, source, out) = folder_with(GOOD);
    let (code, stdout, _) = run(&source, &out, &[&CAMERA[..], &["--dry-run"]].concat());
    assert!(code == 0 && stdout.starts_with("would write"), "{stdout}");
    assert!(
        stdout.contains("files: run.txt, trace.csv, recording.toml\ntrace.csv: time_s,tip_x_m,tip_y_m,head_x_m,head_y_m\ntrace.csv: 0,0.0015,"),
        "{stdout}"
    );
    assert!(!out.exists());
}

#[test]
fn a_missing_file_is_refused() {
    let folder = TempDir::new().unwrap();
    let (code, _, stderr) = run(&folder.path().join("none.txt"), &folder.path().join("out"), &CAMERA);
    assert!(code == 2 && stderr.contains("none.txt: no such file; check the path"), "{stderr}");
    assert!(!folder.path().join("out").exists());
}

#[test]
fn unset_options_are_refused_together() {
    let (_folder, source, out) = folder_with(GOOD);
    let (code, _, stderr) = run(&source, &out, &[]);
    assert_eq!(code, 2);
    for part in ["--frame-rate-hz", "imply 1000.000000", "--scale", "--y-axis"] {
        assert!(stderr.contains(part), "{stderr}");
    }
    assert!(!out.exists());
}

#[test]
fn bad_input_names_place_and_remedy_and_writes_nothing() {
    refused(
        &GOOD.replace('\t', "|"),
        &[],
        &["run.txt:3:1", "tabs, semicolons, commas or spaces", "export again"],
    );
    refused(
        GOOD,
        &["--point", "tip=tipp"],
        &["--point tip", "`tipp`", "did you mean `tip`?", "tracks found: tip, head"],
    );
    refused(
        &GOOD.replace("1.6", "lost"),
        &[],
        &["run.txt:4:7", "`lost`", "expected a number", "correct the cell"],
    );
    refused(
        &GOOD.replace("0.002\t", "0.001\t"),
        &[],
        &["run.txt:5:1", "`0.001`", "export again from the tracking program"],
    );
    refused(&GOOD.replace("0.002\t", "0.0005\t"), &[], &["run.txt:5:1", "export again in the order of time"]);
    refused("", &[], &["run.txt:1:1", "the file is empty", "export the track data again"]);
    refused("t\tx\ty\n", &[], &["run.txt:1:1", "no rows of numbers", "export again"]);
    refused(&GOOD.replace("\t4.6", ""), &[], &["run.txt:4:1", "found 4 cells, expected 5"]);
    refused(
        "t,x,y\n0,0,1,5,2,5\n0,1,1,6,2,6\n",
        &[],
        &["run.txt:2:1", "both delimiter and decimal mark", "decimal points"],
    );
    refused("<?xml version=\"1.0\"?><object/>", &[], &["run.txt:1:1", "File > Export > Data"]);
    refused("PK\u{3}\u{4}", &[], &["a zip archive", "save the sheet as CSV"]);
    refused(GOOD, &["--format", "trakcer"], &["trakcer", "did you mean `tracker`?", "--columns"]);
    refused(GOOD, &["--format", "tema"], &["the format tema", "not published", "--columns time=1"]);
    refused(GOOD, &["--columns", "time=1,tip-x=9"], &["run.txt:1:1", "tip-x=9", "a table of 5 columns"]);
    refused(GOOD, &["--exposure-s", "0.5"], &["--exposure-s", "at most the time of a frame"]);
    refused(&GOOD.replace("tip", "a").replace("head", "b"), &[], &["tracks found: a, b"]);
}

#[test]
fn tables_without_usable_positions_are_refused() {
    let blank: String = (0..20).map(|i| format!("{:.3}\t\t\t\t\n", f64::from(i) / 1000.0)).collect();
    refused(
        &format!("\ttip\t\thead\t\nt\tx\ty\tx\ty\n{blank}"),
        &[],
        &["run.txt: found no position of `tip` or `head` in any row"],
    );
    refused(
        "\ttip\t\thead\t\nt\tx\ty\tx\ty\n0.000\t1\t2\t3\t4\n",
        &[],
        &["run.txt:3:1: found a single row of numbers", "at least two"],
    );
    refused(
        &GOOD.replace("1.6", "1e308"),
        &[],
        &["run.txt: column tip_x_m, frame 1: found 1e305", "expected at most 1e6 from the origin"],
    );
    refused(
        "0,000,10,05,9,5\n0,001,10,15,9,6\n",
        &["--columns", ALL],
        &["run.txt:1:1: found 6 cells that look like 3 numbers cut in two"],
    );
    refused(GOOD, &["--frame-step", "0"], &["invalid value '0' for '--frame-step"]);
}

#[test]
fn a_mistyped_track_is_suggested_where_its_point_is_missing() {
    let (_folder, source, out) = folder_with(&GOOD.replace("tip", "tpi"));
    let parts = [
        "no track for the tip",
        "did you mean `tpi`? tracks found: tpi, head: name it with --point tip=NAME",
    ];
    let (code, stdout, _) = run(&source, &out, &CAMERA);
    assert!(code == 0 && parts.iter().all(|part| stdout.contains(part)), "{stdout}");
    let (code, stdout, stderr) = run(&source, &out, &[&CAMERA[..], &["--force", "--quiet"]].concat());
    assert!(
        code == 0 && stdout.is_empty() && parts.iter().all(|part| stderr.contains(part)),
        "{stdout}{stderr}"
    );
}

#[test]
fn an_import_tells_all_it_knows_as_json() {
    let (_folder, source, out) = folder_with(GOOD);
    let (code, stdout, stderr) = run(&source, &out, &[&CAMERA[..], &["--json", "--dry-run"]].concat());
    assert!(code == 0 && stderr.is_empty(), "{stderr}");
    let told: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(
        (&told["written"], &told["format"], &told["measurements"]["frames"]),
        (&false.into(), &"tracker".into(), &3.into())
    );
    assert_eq!(told["files"], serde_json::json!(["run.txt", "trace.csv", "recording.toml"]));
    assert!(
        told["findings"]
            .as_array()
            .unwrap()
            .iter()
            .any(|finding| finding["check"] == "implied-rate" && finding["value"] == 1000.0)
    );
    assert!(!out.exists());
}

#[test]
fn a_track_may_be_called_like_an_element_of_xml() {
    let (_folder, source, out) = folder_with(&GOOD.replace("tip", "<script>"));
    let (code, _, stderr) =
        run(&source, &out, &[&CAMERA[..], &["--point", "tip=<script>", "--point", "head=head"]].concat());
    assert_eq!(code, 0, "{stderr}");
}

#[test]
fn out_folders_are_made_and_files_in_their_place_are_kept() {
    let (folder, source, _) = folder_with(GOOD);
    let nested = folder.path().join("a/b/c");
    assert_eq!(run(&source, &nested, &CAMERA).0, 0);
    assert!(nested.join("trace.csv").is_file());
    for out in [source.clone(), source.join("x")] {
        let (code, _, stderr) = run(&source, &out, &CAMERA);
        assert!(code == 2 && stderr.contains("is a file, expected a folder for the results"), "{stderr}");
    }
    assert_eq!(fs::read_to_string(&source).unwrap(), GOOD);
}

#[test]
fn a_wrong_rate_is_refused_with_both_rates() {
    let (_folder, source, out) = folder_with(GOOD);
    let (code, _, stderr) =
        run(&source, &out, &["--frame-rate-hz", "40000", "--scale", "mm", "--y-axis", "up"]);
    assert!(
        code == 2
            && stderr
                .contains("imply 1000.000000 frames/s, but --frame-rate-hz says 40000 (a factor of 40.0000)"),
        "{stderr}"
    );
    assert!(!out.exists());
}

#[test]
fn inspect_refuses_what_is_no_recording() {
    let folder = TempDir::new().unwrap();
    let (code, _, stderr) = inspect(folder.path());
    assert!(code == 2 && stderr.contains("found no trace.csv"), "{stderr}");
    fs::write(folder.path().join("trace.csv"), "a,b\n1,2\n").unwrap();
    let (code, _, stderr) = inspect(folder.path());
    assert!(code == 2 && stderr.contains("trace.csv:1:1: found the header `a,b`"), "{stderr}");
}
