//! `wiperlab stability` as a user runs it.

use crate::small_fit::Project;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

const SCENE: &str = "data/scenes/actual-blade.toml";

fn summary(project: &Project, folder: &str) -> Value {
    serde_json::from_slice(&fs::read(project.path(folder).join("stability.json")).unwrap()).unwrap()
}

#[test]
fn a_map_has_a_row_for_each_mode_and_says_where_sliding_is_unstable() {
    let project = Project::of("twin");
    let arguments = ["stability", SCENE, "--out", "map", "--speed-m-per-s", "0..0.5"];
    let (code, out, err) =
        project.run(&[&arguments[..], &["--preload-n", "0.05..0.25", "--points", "12"]].concat());
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    assert!(out.contains("unstable: flutter at 912.2 Hz (squeal)"), "{out}");
    let table = fs::read_to_string(project.path("map/stability.csv")).unwrap();
    let mut rows = table.lines();
    assert_eq!(rows.next(), Some("speed_m_per_s,preload_n,shoulder,mode,growth_per_s,frequency_hz"));
    assert!(rows.count() >= 12 * 12 * 2);
    let found = summary(&project, "map");
    assert_eq!(found["onset_m_per_s"], 0.0);
    assert!((found["end_m_per_s"].as_f64().unwrap() - 0.253_709).abs() < 1e-6, "{found}");
    assert!((found["cycle_fold_m_per_s"].as_f64().unwrap() - 0.277_534).abs() < 1e-6, "{found}");
    assert_eq!(found["cycle_fold_kind"], "stick-lost");
    assert_eq!(found["chatter"]["part"], "neck on the shoulder");
    assert!(found["chatter"]["remedy"]["cycle_fold_m_per_s"].as_f64().unwrap() < 0.277);
    assert!(found["chatter"]["numbers"]["cycle_hz"]["half_95"].is_null(), "{found}");
    assert!(
        out.contains(
            "a stick-slip cycle goes on up to 0.278 m/s; with 2 times the damping of the lip it would end at"
        ),
        "{out}"
    );
    let cycles = fs::read_to_string(project.path("map/cycles.csv")).unwrap();
    assert!(
        cycles.starts_with("speed_m_per_s,period_s,frequency_hz,amplitude_m,sticks,stick_s,"),
        "{cycles}"
    );
    assert!(cycles.lines().count() > 50);
    assert_eq!(found["by_preload"].as_array().unwrap().len(), 12);
    assert!(found["changes"].as_array().unwrap().len() > 10);
    // a second run overwrites the files of the first with the same bytes
    let again = project.run(&[&arguments[..], &["--preload-n", "0.05..0.25", "--points", "12"]].concat());
    assert_eq!(again.0, 0);
    assert_eq!(fs::read_to_string(project.path("map/stability.csv")).unwrap(), table);
}

/// The scene that the bundled fit wrote gets intervals, and they contain the numbers of the true blade.
/// Another scene, and a folder without a result, are refused.
#[test]
fn a_fit_gives_intervals_to_the_numbers_of_its_scene() {
    let project = Project::of("twin");
    let committed = |path: &str| format!("{}/{path}", env!("CARGO_MANIFEST_DIR"));
    let (fit, scene) =
        (committed("fits/actual-blade-twin"), committed("fits/actual-blade-twin/fitted-scene.toml"));
    let (code, out, err) = project.run(&["stability", &scene, "--fit", &fit, "--out", "fitted"]);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    let numbers = &summary(&project, "fitted")["chatter"]["numbers"];
    for (name, truth) in [("end_m_per_s", 0.253_709), ("cycle_fold_m_per_s", 0.277_534)] {
        let [value, half] = ["value", "half_95"].map(|key| numbers[name][key].as_f64().unwrap());
        assert!((value - truth).abs() < half && half < 0.02 * truth, "{name}: {value} +- {half}, {truth}");
    }
    assert!(out.contains("goes on up to 0.277 m/s (0.276 to 0.278)"), "{out}");
    for (scene, fit, said) in [
        (SCENE, fit.as_str(), "= 0.0018867389443817122, the estimate in"),
        (SCENE, "fits/nothing", "no such fit"),
        (SCENE, "data", "result.json"),
    ] {
        let (code, _, err) = project.run(&["stability", scene, "--fit", fit, "--out", "none"]);
        assert!(code == 2 && err.contains(said), "{err}");
    }
    assert!(!project.path("none").exists());
}

/// Contents of the files of a study.
fn outputs(folder: &Path) -> Vec<Vec<u8>> {
    let names = ["stability.csv", "cycles.csv", "stability.json", "stability.svg"];
    names.iter().map(|name| fs::read(folder.join(name)).unwrap()).collect()
}

/// A study that is killed during its rows, during its changes, or with a line half-written, and then resumed,
/// ends with the files of one that was left alone, and without a journal. Its journal belongs to one range
/// only.
#[test]
fn a_killed_study_goes_on_to_the_same_bytes() {
    let project = Project::of("twin");
    let arguments = |out| {
        let range = ["--speed-m-per-s", "0..0.5", "--preload-n", "0.05..0.25", "--points", "25"];
        [&["stability", SCENE, "--out", out][..], &range[..]].concat()
    };
    let (code, out, _) = project.run(&arguments("whole"));
    assert_eq!(code, 0, "{out}");
    let whole = outputs(&project.path("whole"));
    assert!(!project.path("whole/journal.jsonl").exists());
    let journal = project.path("killed/journal.jsonl");
    let lines = || fs::read_to_string(&journal).map_or(0, |text| text.lines().count());
    let resume = || project.run(&[&arguments("killed")[..], &["--resume"]].concat());
    // 26 rows and the cycle come before the changes
    for (kill, after) in [3, 15, 30].into_iter().enumerate() {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin!("wiperlab"))
            .current_dir(project.folder.path())
            .args(arguments("killed"))
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        while lines() < after && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap(); // SIGKILL: nothing is tidied up
        child.wait().unwrap();
        assert!(journal.exists() && !project.path("killed/stability.json").exists(), "too fast to be killed");
        let text = fs::read_to_string(&journal).unwrap();
        match kill {
            1 => fs::write(&journal, &text[..text.len() - 40]).unwrap(),
            2 => {
                let other: Vec<&str> = arguments("killed")
                    .into_iter()
                    .map(|word| if word == "25" { "24" } else { word })
                    .collect();
                let (code, _, err) = project.run(&[&other[..], &["--resume"]].concat());
                assert!(code == 2 && err.contains("the range, a scene or a recording has changed"), "{err}");
            }
            _ => {}
        }
        let (code, out, err) = resume();
        assert_eq!(code, 0, "{out}{err}");
        assert!(err.contains("evaluations are taken from the journal"), "{err}");
        assert!(outputs(&project.path("killed")) == whole, "kill {kill}");
        assert!(!journal.exists());
        fs::remove_dir_all(project.path("killed")).unwrap();
    }
}

#[test]
fn a_blade_without_an_instability_says_so() {
    let project = Project::of("twin");
    let scene = fs::read_to_string(project.path(SCENE)).unwrap();
    fs::write(project.path("calm.toml"), scene.replace("a = 0.108", "a = 0.0")).unwrap();
    let (code, out, err) = project.run(&["stability", "calm.toml", "--out", "calm"]);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    assert!(out.contains("no instability of steady sliding at these speeds"), "{out}");
    let found = summary(&project, "calm");
    assert!(found["onset_m_per_s"].is_null() && found["end_m_per_s"].is_null(), "{found}");
    assert_eq!(found["changes"].as_array().unwrap().len(), 0);
    assert!(found["cycle_fold_m_per_s"].is_null() && found["chatter"]["part"].is_null(), "{found}");
    assert!(found["cycle_fold_note"].as_str().unwrap().starts_with("no stick-slip cycle"), "{found}");
}

#[test]
fn bad_ranges_and_a_blade_that_cannot_slide_are_refused_and_nothing_is_written() {
    let project = Project::of("twin");
    for (option, value) in [
        ("--speed-m-per-s", "0.5..0.1"),
        ("--speed-m-per-s", "nan..1"),
        ("--speed-m-per-s", "0..inf"),
        ("--speed-m-per-s", "-1..1"),
        ("--speed-m-per-s", "0.3"),
        ("--preload-n", "0.2..0.2"),
        ("--points", "1"),
    ] {
        let (code, _, err) = project.run(&["stability", SCENE, "--out", "none", option, value]);
        assert_eq!(code, 2, "{option} {value}");
        assert!(err.contains(option) && err.contains(value), "{err}");
    }
    let scene = fs::read_to_string(project.path(SCENE)).unwrap();
    let lifted = scene.replace("preload_force_n = 0.126", "preload_force_n = 0.0");
    fs::write(project.path("lifted.toml"), lifted.replace("\"steady-slide\"", "\"upright\"")).unwrap();
    let (code, _, err) = project.run(&["stability", "lifted.toml", "--out", "none"]);
    assert_eq!(code, 2);
    assert!(err.contains("lifted.toml") && err.contains("contact is lost"), "{err}");
    assert!(!project.path("none").exists());
}
