//! The same bits on every processor: every command writes the same bytes with and without the functions that
//! the system's library has for processors with fused multiply-add.

use crate::small_fit::{JOB, Project};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Makes glibc (x86-64) use the functions that every processor can run, by the names of new and old versions.
/// Other systems do not know the variable, and the test compares two equal runs.
const PLAIN_PROCESSOR: (&str, &str) = (
    "GLIBC_TUNABLES",
    "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,-FMA4,-FMA4_Usable,-AVX512F",
);

/// Digits of a SHA-256.
const SHA256_DIGITS: usize = 64;

const SWEEP: &str = r#"format = 1
title = "A small study"
scene = "../scenes/actual-blade.toml"

[camera]
frame_rate_hz = 5000.0
exposure_s = 5e-5

[[axis]]
name = "friction.c"
values = [0.28, 0.3, 0.32]

[[map]]
name = "stick fraction"
kind = "stick-fraction"

[[map]]
name = "low component"
kind = "frequency"
channel = "head-drop"
window = "release+0.01..release+0.2"
band_hz = [40.0, 140.0]
"#;

const COMMANDS: [&str; 7] = [
    "simulate data/scenes/actual-blade.toml --out simulated",
    "simulate data/scenes/light-blade.toml --out light",
    "spectrum light/trace.csv --out spectrum",
    "spectrum data/twin --channel head-drop --window release+0.01..release+0.2 --out ring-down",
    "sweep data/sweeps/small.toml --out swept",
    "fit fits/small/job.toml",
    "report fits/small --out page",
];

#[test]
fn every_output_is_the_same_whatever_the_processor_has() {
    let of_this_processor = outputs(None);
    let of_any = outputs(Some(PLAIN_PROCESSOR));
    let names = |files: &BTreeMap<String, String>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&of_this_processor), names(&of_any));
    let differs = |name: &&String| of_this_processor[*name] != of_any[*name];
    let differing: Vec<_> = of_any.keys().filter(differs).collect();
    assert!(differing.is_empty(), "{} of {} files differ: {differing:#?}", differing.len(), of_any.len());
    for name in
        ["simulated/events.csv", "spectrum/spectrum.json", "swept/sweep.csv", "fits/small/result.json"]
    {
        assert!(of_any.contains_key(name), "{name} is compared: {:#?}", names(&of_any));
    }
}

/// The text of every file that the commands write.
fn outputs(variable: Option<(&str, &str)>) -> BTreeMap<String, String> {
    let project = Project::of("twin");
    project.write("data/scenes/light-blade.toml", include_str!("../../data/scenes/light-blade.toml"));
    project.write("data/sweeps/small.toml", SWEEP);
    project.write("fits/small/job.toml", JOB);
    for command in COMMANDS {
        let output = Command::new(program())
            .current_dir(project.folder.path())
            .env_remove(PLAIN_PROCESSOR.0)
            .envs(variable)
            .args(command.split(' '))
            .output()
            .unwrap();
        // (3: the small fit says that it determines nothing)
        let done = output.status.code().is_some_and(|code| [0, 3].contains(&code));
        assert!(done, "{command}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let mut found = BTreeMap::new();
    collect(project.folder.path(), "", &mut found);
    found
}

/// The program of this build, or another one that the same test is to be made with.
fn program() -> String {
    std::env::var("WIPERLAB_PROGRAM").unwrap_or_else(|_| env!("CARGO_BIN_EXE_wiperlab").to_owned())
}

fn collect(folder: &Path, within: &str, found: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = format!("{within}{}", entry.file_name().to_str().unwrap());
        if entry.path().is_dir() {
            collect(&entry.path(), &format!("{name}/"), found);
        } else if !name.ends_with(".wiperlab.json") {
            // (the markers are hashes of the other files)
            found.insert(name, without_times(&fs::read_to_string(entry.path()).unwrap()));
        }
    }
}

/// What is no time of the machine and no hash of one. Lines are put in order: those of a journal stand as
/// their threads were done.
fn without_times(text: &str) -> String {
    let words = text.split(|c: char| !c.is_ascii_hexdigit());
    let hashes: BTreeSet<&str> = words.filter(|word| word.len() == SHA256_DIGITS).collect();
    let text = hashes.iter().fold(text.to_owned(), |text, hash| text.replace(hash, "SHA-256"));
    let mut lines: Vec<&str> = text.lines().filter(|line| !line.contains("\"wall_s\"")).collect();
    lines.sort_unstable();
    lines.join("\n")
}
