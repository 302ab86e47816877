//! What a fit leaves behind: the scene at the estimates, the recording beside the model, the parameters in a
//! row; and recordings that drive their own condition.

use crate::small_fit::{JOB, Project};
use serde_json::Value;
use std::collections::BTreeMap;

const TRACED: &str = include_str!("../../fits/actual-blade-twin/job.toml");

fn project(job: &str) -> Project {
    let project = Project::of("twin");
    project.write("fits/x/job.toml", job);
    project
}

fn fitted(project: &Project, more: &[&str]) -> Value {
    let (code, _, stderr) = project.run(&[&["fit", "fits/x/job.toml"], more].concat());
    assert!([0, 3].contains(&code), "{stderr}");
    serde_json::from_str(&project.read("fits/x/result.json")).unwrap()
}

/// The rows of a table, each by column.
fn rows(text: &str, delimiter: u8) -> Vec<BTreeMap<String, String>> {
    let mut table = csv::ReaderBuilder::new().delimiter(delimiter).from_reader(text.as_bytes());
    table.deserialize().map(Result::unwrap).collect()
}

/// Two columns of the rows that have both.
fn pairs(rows: &[BTreeMap<String, String>], x: &str, y: &str) -> Vec<(f64, f64)> {
    rows.iter().filter_map(|row| Some((row[x].parse().ok()?, row[y].parse().ok()?))).collect()
}

#[test]
fn the_scene_of_a_trace_fit_runs_as_the_model_beside_the_recording() {
    let project = project(&TRACED.replace("data/actual-blade-twin", "data/twin"));
    let result = fitted(&project, &[]);
    let text = project.read("fits/x/fitted-scene.toml");
    assert!(text.contains("synthetic recording, which no camera took"), "{text}");
    let (code, _, stderr) = project.run(&["simulate", "fits/x/fitted-scene.toml", "--out", "out"]);
    assert_eq!((code, stderr.as_str()), (0, ""));

    let compared = rows(&project.read("fits/x/comparison.csv"), b',');
    let trace = rows(&project.read("data/twin/trace.csv"), b',');
    assert_eq!(compared.len(), trace.len(), "a row for each frame");
    let same = |column: &str| pairs(&compared, "time_s", column) == pairs(&trace, "time_s", column);
    assert!(same("tip_x_m") && same("head_x_m"), "the recording as it is");
    assert!(compared.iter().all(|row| row["recording"] == "synthetic"));

    let simulated = pairs(&rows(&project.read("out/trace.csv"), b','), "time_s", "tip_x_m");
    let at = |time_s: f64| {
        let after = simulated.partition_point(|(t, _)| *t < time_s);
        let [(t0, x0), (t1, x1)] = [simulated.get(after.checked_sub(1)?)?, simulated.get(after)?];
        Some(x0 + (x1 - x0) * (time_s - t0) / (t1 - t0))
    };
    let model = pairs(&compared, "time_s", "tip_x_model_m");
    assert!(model.len() > trace.len() - 10);
    let apart: Vec<f64> = model.iter().filter_map(|(t, x)| Some(x - at(*t)?)).collect();
    let mean = apart.iter().sum::<f64>() / apart.len() as f64;
    let most = apart.iter().fold(0.0_f64, |most, x| most.max((x - mean).abs()));
    // a cycle is 50 um; a frame is the mean over its exposure, and a sample an instant
    assert!(apart.len() > trace.len() - 10 && most < 5e-6, "{most:e} m");

    let row = rows(&project.read("fits/x/parameters.csv"), b',').pop().unwrap();
    for (name, parameter) in result["parameters"].as_object().unwrap() {
        let cell = |column: String| row[&column].parse::<f64>().ok();
        assert_eq!(cell(name.clone()), parameter["estimate"].as_f64());
        assert_eq!(cell(format!("{name}_lower_95")), parameter["lower_95"].as_f64());
        assert_eq!(cell(format!("{name}_upper_95")), parameter["upper_95"].as_f64());
        assert_eq!(row[&format!("{name}_verdict")], parameter["verdict"].as_str().unwrap());
        let key = name.split_once('.').unwrap().1;
        let estimate = parameter["estimate"].as_f64().unwrap();
        assert!(text.contains(&format!("\n{key} = {estimate:?}\n")), "{name}");
    }
    assert_eq!((row["explained"].as_str(), row["synthetic"].as_str()), ("true", "true"));
}

#[test]
fn a_table_for_a_german_spreadsheet_has_the_same_numbers() {
    let project = project(JOB);
    fitted(&project, &[]);
    let plain = project.read("fits/x/comparison.csv");
    fitted(&project, &["--resume", "--csv-dialect", "excel-de"]);
    let german = project.read("fits/x/comparison.csv");
    assert!(german.starts_with("\u{feff}condition;recording;time_s;") && german.ends_with("\r\n"));
    let back = rows(&german[3..].replace(',', "."), b';');
    assert_eq!(back, rows(&plain, b','));
    fitted(&project, &["--resume"]);
    assert_eq!(project.read("fits/x/comparison.csv"), plain);

    // a trace stays as programs read it
    let scene = "fits/x/fitted-scene.toml";
    assert_eq!(project.run(&["simulate", scene, "--out", "out", "--csv-dialect", "excel-de"]).0, 0);
    assert!(project.read("out/trace.csv").starts_with("time_s,"));
    assert!(project.read("out/events.csv").starts_with("\u{feff}time_s;"));
}

#[test]
fn a_recording_drives_its_own_condition() {
    let own = |drive: &str| {
        JOB.replace("path = \"../../data/twin\"", &format!("path = \"../../data/twin\"\n{drive}"))
    };
    let by_job = project(&own("drive = \"recording\""));
    let result = fitted(&by_job, &[]);

    // as a copy of the scene that names the recording and runs as long
    let text = by_job.read("fits/x/fitted-scene.toml");
    let time = |key: &str| text.lines().find(|line| line.starts_with(key)).unwrap().to_owned();
    let by_scene = project(JOB);
    let scene = by_scene.read("data/scenes/actual-blade.toml");
    let copied: Vec<String> = scene
        .lines()
        .filter(|line| !line.starts_with("amplitude_m"))
        .map(|line| match line.split_once(" = ").map(|(key, _)| key) {
            Some("frequency_hz") => "recording = \"../twin\"".to_owned(),
            Some(key @ ("time_s" | "stop_s")) => time(key),
            _ => line.to_owned(),
        })
        .collect();
    by_scene.write("data/scenes/actual-blade.toml", &copied.join("\n"));
    let copied = fitted(&by_scene, &[]);
    assert_eq!(result["parameters"], copied["parameters"]);
    assert_eq!(result["fingerprint"], copied["fingerprint"]);
    assert!(text.contains("[drive]\nrecording = \"../../data/twin\"\n"), "{text}");
    assert_eq!(text, by_scene.read("fits/x/fitted-scene.toml"));
    assert_eq!(by_job.run(&["simulate", "fits/x/fitted-scene.toml", "--out", "out"]).0, 0);
}

#[test]
fn a_drive_that_cannot_be_is_refused_with_its_key() {
    let with = |drive: &str| {
        JOB.replace("path = \"../../data/twin\"", &format!("path = \"../../data/twin\"\n{drive}"))
    };
    let refused = |job: String, parts: &[&str]| {
        let project = project(&job);
        let (code, _, stderr) = project.run(&["fit", "fits/x/job.toml"]);
        assert_eq!(code, 2, "{stderr}");
        parts.iter().for_each(|part| assert!(stderr.contains(part), "{part}: {stderr}"));
        assert!(!project.path("fits/x/result.json").exists());
    };
    refused(with("drive = \"head\""), &["recording 1, `drive`", "found \"head\"", "\"recording\""]);
    let free = "\n[[parameter]]\nname = \"drive.frequency_hz\"\nlower = 0.5\nupper = 1.0\nscale = \"log\"\n";
    refused(with("drive = \"recording\"") + free, &["drive.frequency_hz", "a recorded drive"]);

    let project = project(&with("drive = \"recording\""));
    let tip_alone: String = project
        .read("data/twin/trace.csv")
        .lines()
        .map(|line| line.splitn(4, ',').take(3).collect::<Vec<_>>().join(",") + ",,\n")
        .collect();
    let tip_alone = tip_alone.replacen("tip_y_m,,", "tip_y_m,head_x_m,head_y_m", 1);
    project.write("data/bare/trace.csv", &tip_alone);
    project.write("fits/x/job.toml", &project.read("fits/x/job.toml").replace("data/twin", "data/bare"));
    let (code, _, stderr) = project.run(&["fit", "fits/x/job.toml"]);
    assert_eq!(code, 2, "{stderr}");
    for part in ["`recording 1`, `drive`", "found the head's x in 0 of", "track the head"] {
        assert!(stderr.contains(part), "{part}: {stderr}");
    }
}
