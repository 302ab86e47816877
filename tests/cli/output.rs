//! What the program prints: nothing from a file or the command line steers a terminal, and what cannot be
//! written is reported.
#![cfg(target_os = "linux")]

use crate::project::Project;
use assert_cmd::cargo::cargo_bin;
use std::fs::{self, File};
use std::process::{Command, Output, Stdio};

/// Colours, a title, a colour by C1, text from right to left, and a line that looks like the program's.
const HOSTILE: &str = "\u{1b}[31m\u{1b}]0;t\u{7}\u{9b}32m\u{202e}drow\u{2066}\u{7f}\u{200f}\u{2028}\rx";
const LINE: &str = "name\nverdict: good";

fn program(project: &Project) -> Command {
    let mut command = Command::new(cargo_bin!("wiperlab"));
    command.current_dir(project.path(""));
    command
}

fn said(project: &Project, arguments: &[&str]) -> Output {
    program(project).args(arguments).output().unwrap()
}

/// A TOML string.
fn quoted(text: &str) -> String {
    serde_json::to_string(text).unwrap().replace('\u{7f}', "\\u007f")
}

fn edited(project: &Project, from: &str, to: &str, edits: &[(&str, &str)]) {
    let mut text = fs::read_to_string(project.path(from)).unwrap();
    for (old, new) in edits {
        assert!(text.contains(old), "{old}");
        text = text.replacen(old, new, 1);
    }
    fs::write(project.path(to), text).unwrap();
}

/// Line ends are all that may be left, and no line is one of a name's.
fn check_calm(arguments: &[&str], output: &Output) {
    for text in [&output.stdout, &output.stderr] {
        let text = str::from_utf8(text).unwrap();
        let steers = |c: char| {
            (c.is_control() && c != '\n')
                || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
        };
        assert!(!text.contains(steers), "{arguments:?}: {text:?}");
        assert!(!text.lines().any(|line| line == "verdict: good"), "{arguments:?}: {text}");
    }
}

#[test]
fn names_steer_no_terminal() {
    let project = Project::copied();
    let title = format!("title = {}", quoted(&format!("{HOSTILE}{LINE}")));
    let key = format!("{} = 1\nformat = 1", quoted(HOSTILE));
    let name = format!("name = {}", quoted(&format!("{HOSTILE}{LINE}")));
    let scene = "data/scenes/light-blade.toml";
    let scene_title = fs::read_to_string(project.path(scene)).unwrap();
    let scene_title = scene_title.lines().find(|line| line.starts_with("title")).unwrap().to_owned();
    edited(&project, scene, "scene.toml", &[(&scene_title, &title)]);
    edited(&project, scene, "key.toml", &[("format = 1", &key)]);
    edited(
        &project,
        "fits/actual-blade-twin/job.toml",
        "fits/actual-blade-twin/name.toml",
        &[("name = \"low\"", &name), ("band_hz = [", "band_hz = [-")],
    );
    edited(
        &project,
        "data/sweeps/flip.toml",
        "data/sweeps/name.toml",
        &[("name = \"drive.amplitude_m\"", &name)],
    );
    fs::write(
        project.path("film.toml"),
        "format = 1\ntitle = \"t\"\nscene = \"scene.toml\"\nseed = 7\n[camera]\nframe_rate_hz = 1000.0\nmetres_per_pixel = 2e-5\n",
    )
    .unwrap();
    let folder = format!("data/{HOSTILE}{LINE}").replace("data/\u{1b}", "data/a\u{1b}");
    fs::rename(project.path("data/actual-blade-twin"), project.path(&folder)).unwrap();
    fs::write(project.path("export.csv"), format!("t,{HOSTILE}_x,{HOSTILE}_y\n0,1,1\n1,2,2\n")).unwrap();
    let commands: [&[&str]; 17] = [
        &["modes", "scene.toml"],
        &["simulate", "scene.toml", "--out", "sim"],
        &["twin", "film.toml", "--out", "film"],
        &["modes", "key.toml"],
        &["modes", HOSTILE],
        &["fit", "fits/actual-blade-twin/name.toml"],
        &["sweep", "data/sweeps/name.toml", "--out", "study"],
        &["inspect", &folder],
        &["inspect", &folder, "--json"],
        &["spectrum", &folder, "--channel", HOSTILE, "--out", "spectrum"],
        &[
            "import",
            "export.csv",
            "--out",
            "new",
            "--frame-rate-hz",
            "1000",
            "--scale",
            "m",
            "--y-axis",
            "up",
        ],
        &["import", "export.csv", "--out", "new", "--point", HOSTILE],
        &["import", "export.csv", "--out", HOSTILE, "--columns", HOSTILE],
        &["report", HOSTILE],
        &["collect", HOSTILE, LINE],
        &[HOSTILE],
        &["modes", "scene.toml", "--threads", HOSTILE],
    ];
    for arguments in commands {
        check_calm(arguments, &said(&project, arguments));
    }
    let shown = said(&project, &["modes", "scene.toml"]).stdout;
    assert!(str::from_utf8(&shown).unwrap().contains("\\u001b[31m\\u001b]0;t\\u0007"));
    let json = said(&project, &["inspect", &folder, "--json"]);
    let read: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(read["recording"], folder.trim_start_matches("data/"), "the escapes mean the same");
}

#[test]
fn a_full_disk_behind_standard_output_is_reported() {
    let project = Project::copied();
    let commands: [&[&str]; 5] = [
        &["inspect", "data/actual-blade-twin", "--json"],
        &["inspect", "data/actual-blade-twin"],
        &["modes", "data/scenes/light-blade.toml"],
        &["--help"],
        &["fit", "--help"],
    ];
    for arguments in commands {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let output = program(&project).args(arguments).stdout(full).stderr(Stdio::piped()).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(stderr.contains("standard output: cannot be written: No space left"), "{stderr}");
    }
}

#[test]
fn a_reader_that_has_gone_away_is_no_failure() {
    let project = Project::copied();
    for arguments in [&["inspect", "data/actual-blade-twin", "--json"][..], &["--help"]] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output =
            program(&project).args(arguments).stdout(writer).stderr(Stdio::piped()).output().unwrap();
        assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]), "{arguments:?}");
    }
}
