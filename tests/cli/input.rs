//! What the program reads: regular files and standard input, up to a stated size.
#![cfg(unix)]

use crate::project::Project;
use assert_cmd::cargo::cargo_bin;
use std::fs::{self, File};
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::process::{Command, Output, Stdio};

fn program(project: &Project, arguments: &[&str]) -> Command {
    let mut command = Command::new(cargo_bin!("wiperlab"));
    command.args(arguments).current_dir(project.path(""));
    command
}

/// Refused with these words, as bad input.
fn refused(project: &Project, arguments: &[&str], parts: &[&str]) {
    let output = program(project, arguments).stdin(Stdio::null()).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
    assert!(parts.iter().all(|part| stderr.contains(part)), "{arguments:?}: {stderr}");
}

fn given(project: &Project, arguments: &[&str], file: &str) -> Output {
    let file = File::open(project.path(file)).unwrap();
    program(project, arguments).stdin(file).output().unwrap()
}

#[test]
fn only_regular_files_are_read() {
    let project = Project::copied();
    let made = Command::new("mkfifo").arg(project.path("pipe.csv")).status().unwrap();
    assert!(made.success());
    symlink("/dev/zero", project.path("zero.csv")).unwrap();
    let _socket = UnixListener::bind(project.path("socket.csv")).unwrap();
    fs::create_dir_all(project.path("fits/zero")).unwrap();
    fs::copy(project.path("fits/actual-blade-twin/job.toml"), project.path("fits/zero/job.toml")).unwrap();
    symlink("/dev/zero", project.path("fits/zero/result.json")).unwrap();
    let expected = ["a device, expected a file", "on standard input and name that `-`"];
    for file in ["pipe.csv", "zero.csv", "socket.csv"] {
        let commands: [&[&str]; 8] = [
            &["inspect", file],
            &["spectrum", file, "--out", "new"],
            &["import", file, "--out", "new"],
            &["modes", file],
            &["twin", file, "--out", "new"],
            &["sweep", file, "--out", "new"],
            &["fit", file],
            &["submit", file, "--scheduler", "local", "--shards", "2"],
        ];
        for arguments in commands {
            refused(&project, arguments, &expected);
        }
    }
    refused(&project, &["report", "fits/zero"], &expected);
    symlink("/dev/zero", project.path("fits/actual-blade-twin/journal.jsonl")).unwrap();
    refused(&project, &["fit", "fits/actual-blade-twin/job.toml", "--resume"], &["no regular file"]);
    refused(&project, &["modes", "data"], &["a folder, expected a file"]);
}

#[test]
fn a_file_above_the_stated_size_is_refused_before_it_is_read() {
    let project = Project::copied();
    let sparse = |name: &str, bytes| File::create(project.path(name)).unwrap().set_len(bytes).unwrap();
    sparse("sparse.csv", 5_000_000_000);
    sparse("sparse.toml", 500_001);
    let advice = ["found 5000000000 bytes, expected at most 1 GB", "--max-file-size"];
    refused(&project, &["inspect", "sparse.csv"], &advice);
    refused(&project, &["import", "sparse.csv", "--out", "new"], &advice);
    refused(&project, &["modes", "sparse.toml"], &["found 500001 bytes, expected at most 500 kB"]);
    let trace = "data/actual-blade-twin/trace.csv";
    refused(&project, &["inspect", trace, "--max-file-size", "1kB"], &["expected at most 1 kB"]);
    refused(&project, &["inspect", trace, "--max-file-size", "much"], &["such as 500MB or 2GB"]);
    let read = program(&project, &["inspect", trace, "--max-file-size", "2GB"]).output().unwrap();
    assert!(read.status.success());
}

#[test]
fn standard_input_is_read_where_one_file_is_named() {
    let project = Project::copied();
    let (scene, trace) = ("data/scenes/light-blade.toml", "data/actual-blade-twin/trace.csv");
    let piped = given(&project, &["modes", "-"], scene);
    let named = program(&project, &["modes", scene]).output().unwrap();
    assert_eq!((piped.status.code(), piped.stdout), (Some(0), named.stdout));
    let inspected = given(&project, &["inspect", "-", "--json"], trace);
    let found: serde_json::Value = serde_json::from_slice(&inspected.stdout).unwrap();
    assert_eq!(found["recording"], "standard-input");
    let export = "data/actual-blade-twin/synthetic-tracker-export.txt";
    let import = "import - --out new --frame-rate-hz 5000 --scale 20um/px --y-axis up --point";
    let points = ["tip=synthetic tip", "--point", "head=synthetic head"];
    let import: Vec<&str> = import.split(' ').chain(points).collect();
    let imported = given(&project, &import, export);
    assert_eq!(imported.status.code(), Some(0), "{}", String::from_utf8_lossy(&imported.stderr));
    let kept = fs::read(project.path("new/standard-input")).unwrap();
    assert!(kept == fs::read(project.path(export)).unwrap());
    let large = given(&project, &["inspect", "-", "--max-file-size", "1kB"], trace);
    assert_eq!(large.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&large.stderr).contains("found more than 1 kB, expected at most 1 kB"));
    refused(&project, &["fit", "-"], &["found standard input, expected a file"]);
}
