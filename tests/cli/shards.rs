//! A study in shards: as one machine makes it, whatever is killed, done twice, divided anew or torn.

use crate::sealed::resealed;
use assert_cmd::cargo::cargo_bin;
use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Output, Stdio};
use std::time::Duration;
use tempfile::TempDir;

/// 60 short runs, some of which lose contact.
const STUDY: &str = r#"format = 1
title = "A divided study"
scene = "scene.toml"
[camera]
frame_rate_hz = 2000.0
exposure_s = 0.0
[[axis]]
name = "drive.amplitude_m"
values = [0.0138, 0.03]
[[axis]]
name = "blade.preload_force_n"
from = 0.05
to = 0.25
points = 30
[[map]]
name = "stick fraction"
kind = "stick-fraction"
[[map]]
name = "contact loss"
kind = "contact-loss"
"#;

pub fn project() -> TempDir {
    let project = TempDir::new().unwrap();
    let scene = include_str!("../../data/scenes/light-blade.toml")
        .replace("stop_s = 1.02", "stop_s = 0.7")
        .replace("relative_tolerance = 1e-8", "relative_tolerance = 1e-5");
    fs::write(project.path().join("scene.toml"), scene).unwrap();
    fs::write(project.path().join("study.toml"), STUDY).unwrap();
    project
}

fn command(project: &TempDir, arguments: &[&str]) -> Command {
    let mut command = Command::new(cargo_bin!("wiperlab"));
    command.args(arguments).current_dir(project.path().join("")).stdin(Stdio::null());
    command
}

/// Code, standard output and standard error.
pub fn run(project: &TempDir, arguments: &[&str]) -> (i32, String, String) {
    let Output { status, stdout, stderr } = command(project, arguments).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (status.code().unwrap(), text(stdout), text(stderr))
}

fn shard(project: &TempDir, shard: &str) -> (i32, String, String) {
    run(project, &["sweep", "study.toml", "--out", "many", "--shard", shard])
}

/// Every file of a study in a folder, but for its journals.
fn results(project: &TempDir, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for part in ["", "paper"] {
        for entry in fs::read_dir(project.path().join(folder).join(part)).unwrap().map(Result::unwrap) {
            let name = entry.file_name().into_string().unwrap();
            if entry.path().is_file() && !name.starts_with("journal") {
                files.insert(format!("{part}/{name}"), fs::read(entry.path()).unwrap());
            }
        }
    }
    files
}

fn whole(project: &TempDir) -> BTreeMap<String, Vec<u8>> {
    assert_eq!(run(project, &["sweep", "study.toml", "--out", "one"]).0, 0);
    let files = results(project, "one");
    let is_figure = |name: &String| name.starts_with("paper/") && name.ends_with("-85mm.svg");
    assert!(files.contains_key("/sweep.csv") && files.keys().any(is_figure));
    files
}

#[test]
fn shards_give_what_one_machine_gives_also_when_their_number_changes() {
    let project = project();
    for k in ["0/5", "2/5", "3/5"] {
        let (code, said, _) = shard(&project, k);
        assert_eq!(code, 0);
        assert!(said.contains("its 12 points are done"), "{said}");
    }
    let (code, said, _) = run(&project, &["collect", "many"]);
    assert_eq!(code, 3);
    assert!(said.starts_with("missing: 24 of 60 points, in 2 of 5 tasks\ntasks: 1,4\n"), "{said}");
    assert!(!project.path().join("many/sweep.csv").exists());
    let (code, said, _) = run(&project, &["collect", "many", "--shards", "20"]);
    assert_eq!(code, 3);
    assert!(said.contains("tasks: 1,4,6,9,11,14,16,19\n"), "{said}");
    for k in ["0/2", "1/2"] {
        let (code, _, said) = shard(&project, k);
        assert!(code == 0 && said.contains("18 of 30 points are taken from the journal"), "{said}");
    }
    assert_eq!(run(&project, &["collect", "many"]).0, 0);
    assert_eq!(results(&project, "many"), whole(&project));
}

#[test]
fn a_killed_shard_with_a_torn_line_goes_on_and_two_may_collect_at_once() {
    let project = project();
    let mut child = command(&project, &["sweep", "study.toml", "--out", "many", "--shard", "0/1"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let journal = project.path().join("many/shards/0-of-1.jsonl");
    while !fs::read_to_string(&journal).is_ok_and(|text| text.lines().count() > 3) {
        assert!(child.try_wait().unwrap().is_none(), "too fast to be killed");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let text = fs::read_to_string(&journal).unwrap();
    let end = text.trim_end().rfind('\n').unwrap();
    fs::write(&journal, &text[..end + 20]).unwrap();
    let (code, said, warned) = run(&project, &["collect", "many"]);
    assert_eq!(code, 3);
    assert!(said.contains("in 1 of 1 tasks") && warned.contains("incomplete"), "{said}{warned}");
    assert_eq!(shard(&project, "0/1").0, 0);
    let collecting = || command(&project, &["collect", "many", "--quiet"]).spawn().unwrap();
    for mut collecting in [collecting(), collecting()] {
        assert!(collecting.wait().unwrap().success());
    }
    assert_eq!(results(&project, "many"), whole(&project));
}

#[test]
fn equal_duplicates_pass_and_unequal_ones_are_refused_with_both_lines() {
    let project = project();
    assert_eq!(shard(&project, "0/1").0, 0);
    let whole_shard = fs::read_to_string(project.path().join("many/shards/0-of-1.jsonl")).unwrap();
    let (first, second) =
        (project.path().join("many/shards/0-of-2.jsonl"), project.path().join("many/shards/1-of-2.jsonl"));
    fs::write(&first, &whole_shard).unwrap();
    assert_eq!(run(&project, &["collect", "many"]).0, 0);
    assert_eq!(results(&project, "many"), whole(&project));
    let mut lines: Vec<String> = whole_shard.lines().map(str::to_owned).collect();
    let line = lines.iter_mut().position(|line| line.contains("\"stopped_at_s\":0.7,")).unwrap();
    lines[line] = resealed(&lines[line].replace(":0.7,", ":0.6,")).trim_end().to_owned();
    fs::write(&second, lines.join("\n") + "\n").unwrap();
    let (code, _, said) = run(&project, &["collect", "many"]);
    assert_eq!(code, 2);
    let place = format!("1-of-2.jsonl:{}: stopped_at_s 0.6, but ", line + 1);
    let other = format!("0-of-1.jsonl:{} has stopped_at_s 0.7", line + 1);
    assert!(said.contains(&place) && said.contains(&other), "{said}");
}

#[test]
fn a_shard_stops_at_its_time_limit_and_on_a_signal_and_goes_on() {
    let project = project();
    let study = STUDY.replace("points = 30", "points = 100000");
    fs::write(project.path().join("study.toml"), study).unwrap();
    let limited = ["sweep", "study.toml", "--out", "many", "--shard", "0/2", "--time-limit", "1s"];
    let (code, _, said) = run(&project, &limited);
    assert_eq!(code, 3);
    assert!(said.contains("stopped at the time limit: ") && said.contains("of 100000 points"), "{said}");
    let known =
        || fs::read_to_string(project.path().join("many/shards/0-of-2.jsonl")).unwrap().lines().count();
    let before = known();
    let (code, _, said) = run(&project, &limited);
    assert_eq!(code, 3);
    assert!(said.contains("of 100000 points are taken from the journal"), "{said}");
    assert!(known() > before && before > 2);
}

#[test]
fn what_cannot_be_divided_or_collected_is_refused() {
    let project = project();
    for text in ["4/4", "a/b", "3", "1/0"] {
        let (code, _, said) = shard(&project, text);
        assert!(code == 2 && said.contains("such as 3/64"), "{said}");
    }
    let (code, _, said) = run(&project, &["collect", "nowhere"]);
    assert!(code == 2 && said.contains("found no shard K-of-N.jsonl"), "{said}");
    assert_eq!(shard(&project, "0/30").0, 0);
    fs::write(project.path().join("study.toml"), STUDY.replace("to = 0.25", "to = 0.26")).unwrap();
    for arguments in [&["collect", "many"][..], &["sweep", "study.toml", "--out", "many", "--shard", "1/30"]]
    {
        let (code, _, said) = run(&project, arguments);
        assert!(code == 2 && said.contains("0-of-30.jsonl: fingerprint "), "{said}");
    }
    fs::remove_file(project.path().join("many/shards/study.json")).unwrap();
    let (code, _, said) = run(&project, &["collect", "many"]);
    assert!(code == 2 && said.contains("--study"), "{said}");
    fs::write(project.path().join("study.toml"), STUDY).unwrap();
    let (code, said, _) = run(&project, &["collect", "many", "--study", "study.toml"]);
    assert!(code == 3 && said.contains("missing: 58 of 60 points"), "{said}");
    let damaged = project.path().join("many/shards/0-of-30.jsonl");
    let text = fs::read_to_string(&damaged).unwrap().replacen("\"index\":30", "\"index\":31", 1);
    fs::write(&damaged, text).unwrap();
    let (code, _, said) = run(&project, &["collect", "many", "--study", "study.toml"]);
    assert!(code == 2 && said.contains("0-of-30.jsonl:") && said.contains("checksum"), "{said}");
    let (code, _, said) = shard(&project, "0/20");
    assert!(code == 0 && said.contains("warning: "), "another shard goes on: {said}");
    let (code, _, said) = shard(&project, "1/30");
    assert!(code == 0 && said.is_empty(), "one that shares no point with it does not read it: {said}");
    let (code, _, said) = run(&project, &["collect", "study.toml"]);
    assert!(code == 2 && said.contains("found a study, expected the folder of its shards"), "{said}");
}

/// Three parameters in a Sobol sample: no maps, but rank correlations.
#[test]
fn a_sample_is_divided_like_a_grid_and_its_summary_counts_what_failed() {
    let project = project();
    let (head, maps) = STUDY.split_once("[[map]]").unwrap();
    let head = head.split("[[axis]]").next().unwrap();
    let axis =
        |name: &str, from: f64, to: f64| format!("[[axis]]\nname = \"{name}\"\nfrom = {from}\nto = {to}\n");
    let axes = axis("friction.a", 0.1, 0.3)
        + &axis("drive.amplitude_m", 0.01, 0.03)
        + &axis("blade.preload_force_n", 0.05, 0.25);
    let study = format!("{head}[sample]\npoints = 200\nseed = 7\n{axes}[[map]]{maps}");
    fs::write(project.path().join("study.toml"), study).unwrap();
    for k in ["0/2", "1/2"] {
        assert_eq!(shard(&project, k).0, 0);
    }
    let (code, said, _) = run(&project, &["collect", "many"]);
    assert_eq!(code, 0);
    assert!(said.contains("over friction.a: sampled from 0.1 to 0.3"), "{said}");
    assert_eq!(results(&project, "many"), whole(&project));
    let table = fs::read_to_string(project.path().join("many/sweep.csv")).unwrap();
    assert_eq!(table.lines().count(), 201);
    assert!(!table.contains("NaN") && table.contains("contact-lost"));
    let summary = fs::read_to_string(project.path().join("many/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["sample"]["seed"], 7);
    let counts = summary["status"].as_object().unwrap().values().map(|n| n.as_u64().unwrap()).sum::<u64>();
    assert_eq!(counts, 200);
    let loss = &summary["maps"][1]["rank_correlations"][2];
    assert_eq!(loss["parameter"], "blade.preload_force_n");
    assert!(summary["maps"][0]["rank_correlations"][1]["rank_correlation"].as_f64().unwrap() < -0.3);
    let figure = fs::read_to_string(project.path().join("many/all-maps.svg")).unwrap();
    assert!(figure.contains("rank correlation") && figure.contains("synthetic: 200 simulations"));
}
