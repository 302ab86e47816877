//! `wiperlab simulate`, `modes` and `twin` as a user runs them: exit codes, messages, and what lies on disk
//! afterwards.

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A short run of the light blade from upright.
fn scene() -> String {
    include_str!("../fixtures/light-blade.toml").to_owned()
}

const TWIN: &str = "format = 1\ntitle = \"a twin\"\nscene = \"scene.toml\"\nseed = 7\n[camera]\nframe_rate_hz = 2000.0\nexposure_s = 1e-4\n\
                    metres_per_pixel = 2e-5\nnoise_px = 0.1\ndropout_fraction = 0.1\n[export]\nlayout = \"tracker\"\n";

fn folder_with(name: &str, text: &str) -> (TempDir, PathBuf, PathBuf) {
    let folder = TempDir::new().unwrap();
    let (file, out) = (folder.path().join(name), folder.path().join("out"));
    fs::write(&file, text).unwrap();
    (folder, file, out)
}

fn run(arguments: &[&str], paths: [&Path; 2]) -> (i32, String, String) {
    let [file, out] = paths;
    let mut command = Command::cargo_bin("wiperlab").unwrap();
    command.arg(arguments[0]).arg(file).args(&arguments[1..]);
    if arguments[0] != "modes" {
        command.arg("--out").arg(out);
    }
    let output = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn summary(out: &Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(out.join("summary.json")).unwrap()).unwrap()
}

/// Bad input ends with code 2, a message that has every part, and no folder; `modes` refuses the same scenes
/// in the same words.
fn refused(text: &str, more: &[&str], parts: &[&str]) {
    let (_folder, file, out) = folder_with("scene.toml", text);
    let (code, stdout, stderr) = run(&[&["simulate"], more].concat(), [&file, &out]);
    assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
    for part in parts {
        assert!(stderr.contains(part), "expected {part:?} in {stderr}");
    }
    assert!(!out.exists(), "{stderr}");
    if more.is_empty() {
        assert_eq!(run(&["modes"], [&file, &out]), (2, String::new(), stderr));
    }
}

#[test]
fn a_run_writes_the_files_of_the_contract() {
    let (_folder, file, out) = folder_with("scene.toml", &scene());
    let (code, stdout, stderr) = run(&["simulate"], [&file, &out]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(stdout.starts_with("completed: the stop time was reached\nstopped at 0.25 s after "), "{stdout}");
    assert_eq!(names(&out), [".wiperlab.json", "events.csv", "state.csv", "summary.json", "trace.csv"]);

    let lines = |name: &str| -> Vec<String> {
        fs::read_to_string(out.join(name)).unwrap().lines().map(str::to_owned).collect()
    };
    let (trace, state, events) = (lines("trace.csv"), lines("state.csv"), lines("events.csv"));
    assert_eq!(trace[0], "time_s,tip_x_m,tip_y_m,head_x_m,head_y_m");
    assert_eq!(
        state[0],
        "time_s,neck_angle_rad,lip_angle_rad,neck_rate_rad_per_s,lip_rate_rad_per_s,head_drop_m,tip_velocity_m_per_s,normal_force_n,friction_force_n,mode"
    );
    assert_eq!(events[0], "time_s,from,to,cause,predicted_time_error_s");
    let predicted = events[1..].iter().map(|row| row.rsplit(',').next().unwrap().parse::<f64>().unwrap());
    assert!(predicted.into_iter().all(|error| (1e-16..1e-6).contains(&error)), "{events:?}");
    assert_eq!((trace.len(), state.len()), (252, 252), "0 to 0.25 s at 1000 1/s");
    assert!(trace[251].starts_with("0.25,") && state[251].starts_with("0.25,"));
    assert!(
        state
            .iter()
            .skip(1)
            .all(|row| ["stick", "slip+", "slip-"].contains(&row.rsplit(',').next().unwrap()))
    );
    let mantissa = events[1].split('e').next().unwrap();
    assert_eq!(mantissa.len(), 18, "17 significant digits: {}", events[1]);
    assert!(events[1].contains(",stick,slip+,friction-limit,"), "{}", events[1]);

    let summary = summary(&out);
    assert_eq!(summary["status"], "completed");
    assert_eq!(summary["stopped_at_s"], 0.25);
    assert_eq!(summary["transitions"], events.len() - 1);
    assert_eq!(summary["synthetic"], true);
    for key in [
        "rhs_evaluations",
        "steps",
        "rejected_steps",
        "wall_s",
        "max_constraint_drift_m",
        "energy_residual_relative",
        "min_normal_force_n",
    ] {
        assert!(summary[key].is_number(), "{key}");
    }
    assert!(summary["min_painleve_indicator"].is_number());
    assert!(summary["model_parts"].as_array().unwrap().contains(&"cosine drive".into()));
}

#[test]
fn a_second_run_writes_the_same_bytes_and_quiet_says_nothing() {
    let (folder, file, out) = folder_with("scene.toml", &scene());
    let again = folder.path().join("again");
    run(&["simulate"], [&file, &out]);
    assert_eq!(
        run(&["simulate", "--quiet", "--threads", "1"], [&file, &again]),
        (0, String::new(), String::new())
    );
    for name in ["trace.csv", "state.csv", "events.csv"] {
        assert_eq!(fs::read(out.join(name)).unwrap(), fs::read(again.join(name)).unwrap(), "{name}");
    }
}

#[test]
fn errors_of_transition_times_are_predicted_unless_that_is_declined() {
    let (folder, file, out) = folder_with("scene.toml", &scene());
    let (code, stdout, _) = run(&["simulate"], [&file, &out]);
    assert!(code == 0 && stdout.contains("predicted error of the transition times: at most"), "{stdout}");
    let found = summary(&out);
    assert!(found["undetermined_after_s"].is_null() && found.get("undetermined_after_s").is_some());
    assert!((1e-16..1e-6).contains(&found["predicted_time_error_s"].as_f64().unwrap()), "{found}");

    let plain = folder.path().join("plain");
    let (code, stdout, _) = run(&["simulate", "--no-predicted-errors"], [&file, &plain]);
    assert!(code == 0 && !stdout.contains("predicted"), "{stdout}");
    assert!(summary(&plain).get("undetermined_after_s").is_none());
    let text = |folder: &Path, name: &str| fs::read_to_string(folder.join(name)).unwrap();
    assert_eq!(text(&out, "state.csv"), text(&plain, "state.csv"));
    let events = |folder: &Path| text(folder, "events.csv");
    for (with, without) in events(&out).lines().skip(1).zip(events(&plain).lines().skip(1)) {
        assert_eq!(format!("{},", with.rsplit_once(',').unwrap().0), without);
    }
}

#[test]
fn only_the_outputs_asked_for_are_written_and_the_tolerance_is_taken() {
    let (_folder, file, out) =
        folder_with("scene.toml", &scene().replace("[\"trace\", \"state\", \"events\"]", "[\"events\"]"));
    assert_eq!(run(&["simulate", "--relative-tolerance", "1e-6"], [&file, &out]).0, 0);
    assert_eq!(names(&out), [".wiperlab.json", "events.csv", "summary.json"]);
    assert_eq!(summary(&out)["relative_tolerance"], 1e-6);
}

#[test]
fn bad_scenes_are_refused_with_place_and_remedy() {
    let good = scene();
    let swap = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        good.replace(from, to)
    };
    refused(
        &swap("neck_mass_kg", "neck_mas_kg"),
        &[],
        &["scene.toml:6:1: unknown key `blade.neck_mas_kg`", "did you mean `neck_mass_kg`?"],
    );
    refused(&swap("[start]", "[begin]"), &[], &["scene.toml:31:2: unknown key `begin`"]);
    refused(
        &swap("stop_s", "stop_sec"),
        &[],
        &["scene.toml:36:1: unknown key `run.stop_sec`; did you mean `stop_s`?"],
    );
    refused(
        &swap("neck_mass_kg = 0.0001", "neck_mass_kg = -0.0001"),
        &[],
        &[
            "scene.toml:6:16: key `blade.neck_mass_kg`: found -0.0001, expected a number of 0 or more",
            "correct the value",
        ],
    );
    refused(
        &swap("neck_mass_kg = 0.0001", "neck_mass_kg = nan"),
        &[],
        &["scene.toml:6:16: key `blade.neck_mass_kg`: found nan"],
    );
    refused(
        &swap("neck_mass_kg = 0.0001", "neck_mass_kg = \"0.1 g\""),
        &[],
        &["scene.toml:6:16:", "expected"],
    );
    refused(&swap("[friction]", "[friction"), &[], &["scene.toml:22:"]);
    let both = swap("lip_natural_frequency_hz", "lip_stiffness_n_m_per_rad = 1e-3\nlip_natural_frequency_hz");
    refused(
        &both,
        &[],
        &[
            "lip_stiffness_n_m_per_rad",
            "lip_natural_frequency_hz",
            "expected one of the two; remove one: both set the same quantity",
        ],
    );
    refused(
        &swap("preload_force_n = 0.2813\n", ""),
        &[],
        &[
            "key `blade.preload_displacement_m`: found nothing, expected blade.preload_displacement_m or blade.preload_force_n; add it",
        ],
    );
    refused(
        &swap("frequency_hz = 0.915", "frequency_hz = 0.915\nrecording = \"data/x\""),
        &[],
        &[
            "scene.toml:30: key `drive.recording`: found also `drive.amplitude_m`",
            "remove one: both say how the head moves",
        ],
    );
    refused(
        &swap("[drive]", "[drive]\ndelay_s = inf"),
        &[],
        &["key `drive.delay_s`: found inf", "the time in seconds at which the head starts"],
    );
    refused(
        &swap("[start]", "[contact]\nloss = \"jump\"\n[start]"),
        &[],
        &["scene.toml:32:8:", "the text \"jump\"", "\"stop\", \"fly\""],
    );
    refused(
        &swap("[start]", "[contact]\nrestitution = 1.5\n[start]"),
        &[],
        &["key `contact.restitution`: found 1.5, expected a number from 0 to 1"],
    );
    refused(
        &swap("kind = \"upright\"", "kind = \"state\""),
        &[],
        &["key `start.neck_angle_rad`: found nothing", "needs all numbers of the state"],
    );
    refused(
        &swap("stop_s = 0.25", "stop_s = -1.0"),
        &[],
        &["key `run.stop_s`: found -1, expected a finite time after start.time_s = 0"],
    );
    refused(
        &swap("relative_tolerance = 1e-8", "relative_tolerance = 1.0"),
        &[],
        &["key `run.relative_tolerance`: found 1, expected a number from 1e-13 to 1e-2"],
    );
    refused(&swap("format = 1", "format = 2"), &[], &["scene.toml: key `format`: found 2, expected 1"]);
    refused(
        &swap("lip_centre_m = 0.0016652", "lip_centre_m = 1.6652"),
        &[],
        &["key `blade.lip_centre_m`: found 1.6652, expected at most the link's length 0.004163 m"],
    );
    refused("", &[], &["scene.toml:1:1: key `format`: found nothing"]);
    refused(
        &good,
        &["--relative-tolerance", "2"],
        &["--relative-tolerance: found 2, expected a number from 1e-13 to 1e-2"],
    );
}

#[test]
fn missing_files_and_bad_usage_are_refused() {
    let folder = TempDir::new().unwrap();
    let (none, out) = (folder.path().join("none.toml"), folder.path().join("out"));
    for command in ["simulate", "modes", "twin"] {
        let (code, _, stderr) = run(&[command], [&none, &out]);
        assert!(code == 2 && stderr.contains("none.toml: no such file; check the path"), "{stderr}");
    }
    let (_folder, file, out) = folder_with("scene.toml", &scene());
    assert_eq!(run(&["simulate", "--method", "magic"], [&file, &out]).0, 2);
    for place in [file.clone(), file.join("out")] {
        let (code, _, stderr) = run(&["simulate"], [&file, &place]);
        assert!(code == 2 && stderr.contains("scene.toml: is a file, expected a folder"), "{stderr}");
    }
    assert!(!out.exists());
    fs::create_dir_all(out.join("state.csv")).unwrap();
    let (code, _, stderr) = run(&["simulate"], [&file, &out]);
    assert!(code == 2 && stderr.contains("state.csv: is a folder, expected a file or nothing"), "{stderr}");
    assert_eq!(names(&out), ["state.csv"]);
    let (code, _, stderr) = run(&["simulate"], [&file, Path::new("/proc/wiperlab/out")]);
    assert!(code == 2 && stderr.contains("/proc/wiperlab/out: cannot be written: "), "{stderr}");
}

/// A shell's limit on the size of files stands for a full disk.
#[cfg(unix)]
#[test]
fn a_disk_that_fills_up_is_reported_and_nothing_is_left() {
    let (folder, file, out) = folder_with("scene.toml", &scene());
    let limited = format!(
        "trap '' XFSZ; ulimit -f 8; exec '{}' simulate '{}' --out '{}'",
        env!("CARGO_BIN_EXE_wiperlab"),
        file.display(),
        out.display()
    );
    let output = std::process::Command::new("sh").args(["-c", &limited]).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("trace.csv: cannot be written: "), "{stderr}");
    assert_eq!(names(folder.path()), ["scene.toml"]);
}

/// A run that would take minutes is killed: neither folder nor files, hidden ones included.
#[test]
fn a_run_that_is_killed_leaves_nothing() {
    let (folder, file, out) = folder_with("scene.toml", &scene().replace("stop_s = 0.25", "stop_s = 5000.0"));
    let mut program = std::process::Command::new(env!("CARGO_BIN_EXE_wiperlab"))
        .arg("simulate")
        .arg(&file)
        .arg("--out")
        .arg(&out)
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(200));
    assert!(program.try_wait().unwrap().is_none(), "it runs for long");
    program.kill().unwrap();
    program.wait().unwrap();
    assert_eq!(names(folder.path()), ["scene.toml"]);
}

/// The head as another run has shown it; the recording is sought beside the scene.
#[test]
fn a_recording_drives_the_head_in_every_command_that_reads_scenes() {
    // (at rest the least error of the head's velocity would decide between stick and slip, so both runs start
    // when it moves)
    let moving = scene().replace("time_s = 0.0", "time_s = 0.05");
    let (folder, file, out) = folder_with("scene.toml", &scene());
    let [cosine, driven, by_cosine, by_recording] =
        ["moving.toml", "driven.toml", "moving", "driven"].map(|name| folder.path().join(name));
    assert_eq!(run(&["simulate", "--quiet"], [&file, &out]).0, 0);
    let drive = "amplitude_m = 0.0138\nfrequency_hz = 0.915";
    let driven_by = |recording: &str| moving.replace(drive, &format!("recording = \"{recording}\""));
    assert!(moving != scene() && driven_by("out") != moving);
    fs::write(&cosine, &moving).unwrap();
    fs::write(&driven, driven_by("out")).unwrap();
    assert_eq!(run(&["simulate", "--quiet"], [&cosine, &by_cosine]).0, 0);
    let (code, stdout, stderr) = run(&["simulate"], [&driven, &by_recording]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(stdout.contains("recorded drive") && !stdout.contains("cosine drive"), "{stdout}");
    let events = |out: &Path| fs::read_to_string(out.join("events.csv")).unwrap().lines().count();
    assert_eq!(events(&by_cosine), events(&by_recording));
    assert_eq!(run(&["modes"], [&driven, &out]).0, 0);
    let (spec, twin) = (folder.path().join("twin.toml"), folder.path().join("twin"));
    fs::write(&spec, TWIN.replace("scene.toml", "driven.toml")).unwrap();
    let (code, _, stderr) = run(&["twin"], [&spec, &twin]);
    assert_eq!(code, 0, "{stderr}");

    let refused = |recording: &str, parts: &[&str]| {
        fs::write(&driven, driven_by(recording)).unwrap();
        let none = folder.path().join("none");
        let (code, _, stderr) = run(&["simulate"], [&driven, &none]);
        assert_eq!(code, 2, "{stderr}");
        assert!(
            stderr.contains("driven.toml:28: key `drive.recording`: ")
                && parts.iter().all(|part| stderr.contains(part)),
            "{stderr}"
        );
        assert!(!none.exists());
    };
    let nowhere = format!("there is no `{}`", folder.path().join("data/nowhere").display());
    refused(
        "data/nowhere",
        &["found \"data/nowhere\", ", &nowhere, "a path in a file is relative to that file"],
    );
    refused("scene.toml", &["scene.toml:1:1: found the header"]);
    let text = fs::read_to_string(out.join("trace.csv")).unwrap();
    fs::create_dir(folder.path().join("short")).unwrap();
    fs::write(
        folder.path().join("short/trace.csv"),
        text.lines().take(100).map(|line| format!("{line}\n")).collect::<String>(),
    )
    .unwrap();
    refused(
        "short",
        &[
            "found a run from 0.05 s to 0.25 s, expected one within the 0 s to 0.098 s in which `short` tracks the head",
        ],
    );
}

/// A folder of the same name where the program runs is another recording, which nobody meant.
#[test]
fn a_path_in_a_file_is_relative_to_that_file_wherever_the_program_runs() {
    let (folder, file, _) = folder_with("scene.toml", &scene());
    let here = folder.path().join("here");
    fs::create_dir(&here).unwrap();
    let at = |name: &str, arguments: &[&str]| {
        let mut command = Command::cargo_bin("wiperlab").unwrap();
        let output = command.current_dir(folder.path().join(name)).args(arguments).output().unwrap();
        (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    assert_eq!(at("", &["simulate", "scene.toml", "--out", "head"]), (0, String::new()));
    let drive = "amplitude_m = 0.0138\nfrequency_hz = 0.915";
    let driven = scene().replace("time_s = 0.0", "time_s = 0.05").replace(drive, "recording = \"head\"");
    fs::write(&file, driven).unwrap();
    fs::create_dir(here.join("head")).unwrap();
    fs::write(here.join("head/trace.csv"), "another recording\n").unwrap();
    fs::write(here.join("scene.toml"), "another scene\n").unwrap();
    let spec = folder.path().join("twin.toml");
    fs::write(&spec, TWIN).unwrap();
    assert_eq!(at("here", &["simulate", "../scene.toml", "--out", "run"]), (0, String::new()));
    assert_eq!(at("here", &["twin", "../twin.toml", "--out", "film"]).0, 0);

    fs::rename(folder.path().join("head"), folder.path().join("gone")).unwrap();
    let (code, said) = at("here", &["simulate", "../scene.toml", "--out", "other"]);
    assert!(code == 2 && said.contains("found \"head\", but there is no `../head`"), "{said}");
    assert!(said.contains("a path in a file is relative to that file"), "{said}");
    fs::rename(&file, folder.path().join("gone.toml")).unwrap();
    let (code, said) = at("here", &["twin", "../twin.toml", "--out", "other"]);
    let missing = "../twin.toml: key `scene`: found \"scene.toml\", but there is no `../scene.toml`";
    assert!(code == 2 && said.contains(missing), "{said}");
}

#[test]
fn a_run_that_stops_early_says_so_and_writes_what_it_has() {
    let (_folder, file, out) = folder_with("scene.toml", &losing_contact(&scene()));
    let (code, stdout, _) = run(&["simulate"], [&file, &out]);
    assert_eq!(code, 3);
    assert!(
        stdout.starts_with("contact-lost: the normal force reached zero: the tip lifts off the glass\n"),
        "{stdout}"
    );
    assert_eq!(names(&out), [".wiperlab.json", "events.csv", "state.csv", "summary.json", "trace.csv"]);
    let summary = summary(&out);
    assert_eq!(summary["status"], "contact-lost");
    let stopped = summary["stopped_at_s"].as_f64().unwrap();
    assert!(0.0 < stopped && stopped < 0.25, "{stopped}");
    let rows = fs::read_to_string(out.join("trace.csv")).unwrap().lines().count() - 1;
    assert_eq!(rows, (stopped * 1000.0).floor() as usize + 1, "the trace ends where the run did");
}

/// The same blade with leave to fly: the run goes on, and the files show the tip off the glass.
#[test]
fn a_tip_that_may_fly_lands_and_its_files_say_so() {
    let flying =
        losing_contact(&scene()).replace("[start]", "[contact]\nloss = \"fly\"\nrestitution = 0.3\n[start]");
    let (_folder, file, out) = folder_with("scene.toml", &flying);
    let (code, stdout, stderr) = run(&["simulate"], [&file, &out]);
    assert_eq!((code, stderr.as_str()), (0, ""), "{stdout}");
    let summary = summary(&out);
    let parts: Vec<&str> =
        summary["model_parts"].as_array().unwrap().iter().filter_map(|p| p.as_str()).collect();
    assert!(parts.contains(&"flight") && parts.contains(&"impacts"), "{parts:?}");
    let text = |name: &str| fs::read_to_string(out.join(name)).unwrap();
    let events = text("events.csv");
    assert!(events.contains(",flight,lift-off,") && events.contains(",flight,flight,landing,"), "{events}");
    assert_eq!(summary["transitions"], events.lines().count() - 1);
    // the tip is above its place on the glass in exactly the rows of flight
    let flight: Vec<bool> = text("state.csv").lines().skip(1).map(|row| row.ends_with(",flight")).collect();
    let height = |row: &str| row.split(',').nth(2).unwrap().parse::<f64>().unwrap();
    let heights: Vec<f64> = text("trace.csv").lines().skip(1).map(height).collect();
    assert!(flight.contains(&true) && flight.len() == heights.len());
    assert!(flight.iter().zip(&heights).all(|(flies, height)| *flies == (*height > heights[0])));
}

/// A heavy head on rough glass, its tip ahead of it and running on: the normal force of slip grows without
/// bound.
fn jamming() -> String {
    const LEADING: &str = "\"state\"\nneck_angle_rad = 0.2\nlip_angle_rad = 0.5\nneck_rate_rad_per_s = 100.0\nlip_rate_rad_per_s = 250.0";
    let heavy = scene()
        .replace("head_mass_kg = 0.02659", "head_mass_kg = 0.5")
        .replace("c = 0.331", "c = 0.6")
        .replace("\"upright\"", LEADING);
    heavy
        .replace("stop_s = 0.25", "stop_s = 0.001")
        .replace("sample_rate_hz = 1000.0", "sample_rate_hz = 1e6")
}

#[test]
fn a_jam_that_is_an_impact_does_not_end_the_run() {
    let (_folder, file, out) =
        folder_with("scene.toml", &jamming().replace("[start]", "[contact]\njam = \"impact\"\n[start]"));
    let (code, stdout, _) = run(&["simulate"], [&file, &out]);
    assert_eq!(code, 0, "{stdout}");
    let events = fs::read_to_string(out.join("events.csv")).unwrap();
    assert_eq!(events.lines().filter(|row| row.ends_with(",jam-impact,")).count(), 1, "{events}");
    assert!(stdout.contains("impacts") && !stdout.contains("flight"), "{stdout}");
}

#[test]
fn a_tip_that_jams_ends_the_run_with_code_3_and_its_files() {
    let (_folder, file, out) = folder_with("scene.toml", &jamming());
    let (code, stdout, stderr) = run(&["simulate"], [&file, &out]);
    assert_eq!((code, stderr.as_str()), (3, ""), "{stdout}");
    assert!(
        stdout.starts_with(
            "jammed: the Painlevé condition failed: no normal force is admissible and the tip jams\n"
        ),
        "{stdout}"
    );
    assert_eq!(names(&out), [".wiperlab.json", "events.csv", "state.csv", "summary.json", "trace.csv"]);
    let summary = summary(&out);
    assert_eq!(summary["status"], "jammed");
    let stopped = summary["stopped_at_s"].as_f64().unwrap();
    assert!(0.0 < stopped && stopped < 0.001, "{stopped}");
    assert!(summary["min_painleve_indicator"].as_f64().unwrap() < 1e-4);
    for name in ["trace.csv", "state.csv"] {
        let rows = fs::read_to_string(out.join(name)).unwrap().lines().count() - 1;
        assert_eq!(rows, (stopped * 1e6).floor() as usize + 1, "{name} ends where the run did");
    }
    let events = fs::read_to_string(out.join("events.csv")).unwrap();
    assert_eq!(summary["transitions"], events.lines().count() - 1);
}

/// Pressed on so lightly that the tip lifts off as the head turns fast.
fn losing_contact(scene: &str) -> String {
    scene.replace("preload_force_n = 0.2813", "preload_force_n = 0.03")
}

#[test]
fn modes_shows_every_frequency_and_writes_nothing() {
    let (folder, file, out) = folder_with("scene.toml", &scene());
    let (code, stdout, stderr) = run(&["modes"], [&file, &out]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    for part in ["Light test blade", "8.880 Hz", "519.000 Hz", "568.000 Hz", "slides", "held"] {
        assert!(stdout.contains(part), "expected {part:?} in {stdout}");
    }
    assert_eq!(names(folder.path()), ["scene.toml"]);
}

#[test]
fn a_twin_is_marked_synthetic_everywhere_and_repeats_with_its_seed() {
    let (folder, file, out) = folder_with("twin.toml", TWIN);
    fs::write(folder.path().join("scene.toml"), scene()).unwrap();
    let (code, stdout, stderr) = run(&["twin"], [&file, &out]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(
        stdout.starts_with(
            "synthetic recording of \"Light test blade around its reversal\": 501 frames at 2000 1/s"
        ),
        "{stdout}"
    );
    assert_eq!(
        names(&out),
        [".wiperlab.json", "recording.toml", "synthetic-tracker-export.txt", "trace.csv", "twin.toml"]
    );
    let text = |name: &str| fs::read_to_string(out.join(name)).unwrap();
    let description: toml::Table = text("recording.toml").parse().unwrap();
    assert_eq!(description["synthetic"].as_bool(), Some(true));
    let twin = description["twin"].as_table().unwrap();
    assert_eq!((twin["seed"].as_integer(), twin["truth"]["friction.a"].as_float()), (Some(7), Some(0.229)));
    assert!(text("synthetic-tracker-export.txt").starts_with("#multi:\n\tsynthetic tip\t\tsynthetic head"));
    let trace = text("trace.csv");
    assert_eq!(
        (trace.lines().next(), trace.lines().count()),
        (Some("time_s,tip_x_m,tip_y_m,head_x_m,head_y_m"), 502)
    );
    assert!(trace.contains(",,"), "dropouts are empty cells");

    let again = folder.path().join("again");
    run(&["twin"], [&file, &again]);
    assert_eq!(trace, fs::read_to_string(again.join("trace.csv")).unwrap());
    fs::write(&file, TWIN.replace("seed = 7", "seed = 8")).unwrap();
    let other = folder.path().join("other");
    run(&["twin"], [&file, &other]);
    assert_ne!(trace, fs::read_to_string(other.join("trace.csv")).unwrap());
}

#[test]
fn bad_twins_are_refused_and_short_ones_say_so() {
    let refused = |from: &str, to: &str, parts: &[&str]| {
        assert!(TWIN.contains(from), "{from}");
        let (folder, file, out) = folder_with("twin.toml", &TWIN.replace(from, to));
        fs::write(folder.path().join("scene.toml"), scene()).unwrap();
        let (code, _, stderr) = run(&["twin"], [&file, &out]);
        assert_eq!(code, 2, "{stderr}");
        for part in parts {
            assert!(stderr.contains(part), "expected {part:?} in {stderr}");
        }
        assert!(!out.exists());
    };
    refused(
        "noise_px = 0.1",
        "noise_px = -0.1",
        &["twin.toml: key `camera.noise_px`: found -0.1, expected a number of 0 or more"],
    );
    refused(
        "exposure_s = 1e-4",
        "exposure_s = 1.0",
        &["key `camera.exposure_s`: found 1, expected 0 to the time between frames"],
    );
    refused(
        "noise_px",
        "nois_px",
        &["twin.toml:9:1: unknown key `camera.nois_px`; did you mean `noise_px`?"],
    );
    refused("scene.toml", "other.toml", &["key `scene`: found \"other.toml\", but there is no `"]);
    refused(
        "[export]",
        "[window]\nstart_s = 0.0\nstop_s = 5.0\n[export]",
        &["key `window`: found 0 to 5, expected a window within the scene's 0 to 0.25 s"],
    );

    let (folder, file, out) = folder_with("twin.toml", TWIN);
    fs::write(folder.path().join("scene.toml"), losing_contact(&scene())).unwrap();
    let (code, _, stderr) = run(&["twin"], [&file, &out]);
    assert_eq!(code, 3, "{stderr}");
    assert!(stderr.contains("the recording") && stderr.contains("contact-lost"), "{stderr}");
    assert!(out.join("trace.csv").exists());
}

/// Derivatives go to two more files; what has none is refused before the run.
#[test]
fn sensitivities_are_written_for_the_names_that_are_asked_for() {
    let (_folder, file, out) = folder_with("scene.toml", &scene());
    let names_asked = "friction.a,start.neck_angle_rad,drive.scale";
    let (code, _, stderr) = run(&["simulate", "--sensitivities", names_asked], [&file, &out]);
    assert_eq!(code, 0, "{stderr}");
    let rows = |name: &str| -> Vec<Vec<String>> {
        let text = fs::read_to_string(out.join(name)).unwrap();
        text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
    };
    let (samples, events) = (rows("sensitivities.csv"), rows("event_sensitivities.csv"));
    assert_eq!(samples[0][..3], ["time_s", "d_tip_x_m_d_friction.a", "d_tip_x_m_d_start.neck_angle_rad"]);
    assert_eq!(events[0][4..], names_asked.split(',').map(|n| format!("d_time_s_d_{n}")).collect::<Vec<_>>());
    assert_eq!(samples.len(), rows("state.csv").len());
    let times = |rows: &[Vec<String>]| rows.iter().map(|row| row[0].clone()).collect::<Vec<_>>();
    assert_eq!(times(&events), times(&rows("events.csv")));
    assert!(samples.iter().chain(&events).skip(1).flatten().all(|field| !field.is_empty()));
}

#[test]
fn sensitivities_that_a_run_cannot_have_are_refused() {
    let cases: [(&[&str], &str); 5] = [
        (&["--sensitivities", "start.neck_angel_rad"], "did you mean `start.neck_angle_rad`?"),
        (&["--sensitivities", "friction.a,friction.a"], "remove one"),
        (&["--sensitivities", "shoulder.stiffness_ratio"], "found no [shoulder]"),
        (&["--sensitivities", "friction.a", "--method", "slack"], "leave --method out"),
        (&["--sensitivities", ""], "found ``"),
    ];
    for (arguments, part) in cases {
        let (_folder, file, out) = folder_with("scene.toml", &scene());
        let (code, _, stderr) = run(&[&["simulate"], arguments].concat(), [&file, &out]);
        assert!(code == 2 && stderr.contains(part) && !out.exists(), "{code} {stderr}");
    }
}
