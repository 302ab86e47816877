//! `wiperlab sweep` as a user runs it: outputs, refusals, threads, and a study that is killed and goes on.

use assert_cmd::Command;
use resvg::usvg;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;
use tempfile::TempDir;

use crate::sealed::resealed;

const SCENE: &str = include_str!("../../data/scenes/light-blade.toml");

/// Six short runs, of which some lose contact.
const SWEEP: &str = r#"format = 1
title = "A small study"
scene = "../scenes/light-blade.toml"

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
points = 3

[[map]]
name = "stick fraction"
kind = "stick-fraction"

[[map]]
name = "high component"
kind = "frequency"
channel = "deflection"
window = "release+0.005..release+0.05"
band_hz = [200.0, 1000.0]

[[map]]
name = "contact loss"
kind = "contact-loss"
"#;

fn short_scene() -> String {
    SCENE
        .replace("stop_s = 1.02", "stop_s = 0.78")
        .replace("relative_tolerance = 1e-8", "relative_tolerance = 1e-5")
}

struct Project {
    folder: TempDir,
}

impl Project {
    fn with(sweep: &str) -> Self {
        let project = Self { folder: TempDir::new().unwrap() };
        project.write("scenes/light-blade.toml", &short_scene());
        project.write("sweeps/small.toml", sweep);
        project
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), text).unwrap();
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// Exit code, standard output and standard error of `wiperlab sweep sweeps/small.toml` with these
    /// arguments.
    fn sweep(&self, arguments: &[&str]) -> (i32, String, String) {
        let output = Command::cargo_bin("wiperlab")
            .unwrap()
            .current_dir(self.folder.path())
            .args(["sweep", "sweeps/small.toml"])
            .args(arguments)
            .output()
            .unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
    }

    fn done(&self, arguments: &[&str]) -> (String, String) {
        let (code, stdout, stderr) = self.sweep(arguments);
        assert_eq!(code, 0, "{stderr}");
        (stdout, stderr)
    }

    fn refused(&self, arguments: &[&str], parts: &[&str]) {
        let (code, stdout, stderr) = self.sweep(arguments);
        assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
        assert!(parts.iter().all(|part| stderr.contains(part)), "{stderr}");
    }
}

/// Every file of a folder (not of folders in it) but the journal, whose lines are in the order in which
/// points were done.
fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file());
    let named =
        files.map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(&path).unwrap()));
    named.filter(|(name, _)| !name.starts_with("journal.")).collect()
}

#[test]
fn a_study_writes_a_table_a_summary_a_figure_a_map_and_a_sheet() {
    let project = Project::with(SWEEP);
    let (stdout, stderr) = project.done(&["--out", "out/small"]);
    assert!(
        stdout.contains("A small study: 6 simulated runs") && stdout.contains("written to out/small"),
        "{stdout}"
    );
    assert_eq!(stderr, "");
    let files = results(&project.path("out/small"));
    assert_eq!(
        files.keys().collect::<Vec<_>>(),
        [
            ".wiperlab.json",
            "all-maps.svg",
            "contact-loss.svg",
            "high-component.svg",
            "stick-fraction.svg",
            "summary.json",
            "sweep.csv"
        ]
    );
    let paper: BTreeSet<String> = results(&project.path("out/small/paper")).into_keys().collect();
    let expected = ["all-maps", "contact-loss", "high-component", "stick-fraction"]
        .iter()
        .flat_map(|name| ["85mm", "170mm"].map(|width| format!("{name}-{width}.svg")));
    assert_eq!(paper, expected.collect());

    let table = project.read("out/small/sweep.csv");
    let mut rows = table.lines();
    let header = "drive.amplitude_m,blade.preload_force_n,status,stopped_at_s,stick_fraction,high_component_hz,\
                  contact_loss_s,missing,source";
    assert_eq!(rows.next(), Some(header));
    let rows: Vec<Vec<&str>> = rows.map(|row| row.split(',').collect()).collect();
    assert_eq!(
        rows.iter().map(|row| [row[0], row[1]].join(" ")).collect::<Vec<_>>(),
        ["0.0138 0.05", "0.0138 0.15", "0.0138 0.25", "0.03 0.05", "0.03 0.15", "0.03 0.25"]
    );
    let (lost, kept): (Vec<_>, Vec<_>) = rows.iter().partition(|row| row[2] == "contact-lost");
    assert!(!lost.is_empty() && kept.len() >= 2, "{table}");
    assert!(
        lost.iter()
            .all(|row| row[4].is_empty() && row[5].is_empty() && row[6] == row[3] && row[7].is_empty()),
        "{table}"
    );
    assert!(
        kept.iter().all(|row| row[2] == "completed"
            && row[4].parse::<f64>().is_ok()
            && row[7].contains("contact_loss_s: never")),
        "{table}"
    );
    assert!(rows.iter().all(|row| row.len() == 9 && row[8] == "simulation") && !table.contains("NaN"));

    let summary: Value = serde_json::from_str(&project.read("out/small/summary.json")).unwrap();
    assert_eq!(
        (&summary["synthetic"], &summary["points"], &summary["title"]),
        (&Value::from(true), &Value::from(6), &Value::from("A small study"))
    );
    assert_eq!(summary["status"]["contact-lost"], lost.len());
    assert_eq!(summary["maps"][2]["missing"]["never"], kept.len());
    for (name, bytes) in files.iter().filter(|(name, _)| name.ends_with(".svg")) {
        let text = std::str::from_utf8(bytes).unwrap();
        usvg::Tree::from_str(text, &usvg::Options::default())
            .unwrap_or_else(|problem| panic!("{name}: {problem}"));
        assert!(
            text.contains("A small study; synthetic: a simulation, no camera took it"),
            "{name}: in its description"
        );
        assert!(
            text.contains("drive amplitude a, mm")
                && text.contains("preload force k0 hd, N")
                && !text.contains("NaN"),
            "{name}"
        );
    }
    assert!(
        String::from_utf8_lossy(&files["stick-fraction.svg"])
            .contains(&format!("contact lost: {}", lost.len()))
    );
}

#[test]
fn one_axis_makes_curves_with_gaps() {
    let amplitude = SWEEP.find("[[axis]]").unwrap();
    let preload = SWEEP[amplitude + 8..].find("[[axis]]").unwrap() + amplitude + 8;
    let project = Project::with(&(SWEEP[..amplitude].to_owned() + &SWEEP[preload..]));
    project.done(&["--out", "out", "--quiet"]);
    let figure = project.read("out/stick-fraction.svg");
    assert!(
        !figure.contains("#440154")
            && figure.contains("preload force k0 hd, N")
            && figure.contains("contact lost: 1")
    );
    let grounds = figure
        .lines()
        .filter(|line| line.contains("fill=\"#E4E4E4\""))
        .map(|line| line.matches('M').count())
        .sum::<usize>();
    assert_eq!(grounds, 2, "the place without a value is grey, and so is its sample in the legend");
    assert!(
        figure.contains("the scene as written"),
        "its 0.2813 N lie within the half cell beyond the last value"
    );
    assert_eq!(project.read("out/sweep.csv").lines().count(), 4);
}

#[test]
fn the_bytes_do_not_depend_on_threads_nor_on_a_journal() {
    let project = Project::with(SWEEP);
    let run = |out: &str, more: &[&str]| {
        project.done(&[&["--out", out, "--quiet"], more].concat());
        results(&project.path(out))
    };
    let one = run("one", &["--threads", "1"]);
    assert!(
        one == run("two", &["--threads", "2"]) && one == run("four", &["--threads", "4"]),
        "results depend on the number of threads"
    );
    // a journal that stops anywhere, also within a line, gives the same
    let journal = project.read("one/journal.jsonl");
    assert_eq!(journal.lines().count(), 7);
    let lines: Vec<usize> = journal.match_indices('\n').map(|(at, _)| at + 1).collect();
    for (cut, torn, taken) in [
        (lines[0], false, 0),
        (lines[2] + 5, true, 2),
        (lines[5], false, 5),
        (lines[6] - 1, false, 6),
        (lines[6] - 2, true, 5),
        (3, false, 0),
        (lines[6], false, 6),
    ] {
        project.write("cut/journal.jsonl", &journal[..cut]);
        let (_, stderr) = project.done(&["--out", "cut", "--resume"]);
        assert_eq!(stderr.contains("the last line is incomplete and was dropped"), torn, "{cut}: {stderr}");
        assert_eq!(
            stderr.contains(&format!("{taken} of 6 points are taken from the journal")),
            taken > 0,
            "{cut}: {stderr}"
        );
        assert!(results(&project.path("cut")) == one, "resumed at byte {cut}");
        assert_eq!(project.read("cut/journal.jsonl").lines().count(), 7, "the journal is whole again");
        fs::remove_dir_all(project.path("cut")).unwrap();
    }
    // what the journal holds is taken, unless running it again gives something else
    let edited = journal.replacen("\"stopped_at_s\":0.78,", "\"stopped_at_s\":0.77,", 1);
    project.write("cut/journal.jsonl", &resealed(&edited));
    project.refused(
        &["--out", "cut", "--resume"],
        &["found stopped_at_s 0.77, but computed again the point gives stopped_at_s 0.78"],
    );
    assert!(results(&project.path("cut")).is_empty());
    // without --resume everything is
    project.done(&["--out", "cut", "--quiet"]);
    assert!(results(&project.path("cut")) == one);
}

#[test]
fn a_killed_study_goes_on_to_the_same_bytes() {
    let project = Project::with(&SWEEP.replace("points = 3", "points = 10"));
    project.done(&["--out", "whole", "--quiet"]);
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("wiperlab"))
        .current_dir(project.folder.path())
        .args(["sweep", "sweeps/small.toml", "--out", "killed", "--threads", "1"])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let journal = project.path("killed/journal.jsonl");
    while fs::read_to_string(&journal).map_or(0, |text| text.lines().count()) < 5
        && child.try_wait().unwrap().is_none()
    {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap(); // SIGKILL: nothing is tidied up
    child.wait().unwrap();
    assert!(
        !project.path("killed/sweep.csv").exists()
            || fs::read_to_string(&journal).unwrap().lines().count() == 21,
        "nothing half-written"
    );
    project.done(&["--out", "killed", "--resume", "--quiet"]);
    assert!(results(&project.path("killed")) == results(&project.path("whole")));
}

#[test]
fn what_cannot_be_run_is_refused_and_nothing_is_written() {
    let project = Project::with(SWEEP);
    let cases: [(&str, &str, &[&str]); 6] = [
        ("light-blade.toml", "no-blade.toml", &["key `scene`: found \"", "there is no `", "no-blade.toml`"]),
        ("[[map]]", "[[maps]]", &["sweeps/small.toml:19:3: unknown key `maps`; did you mean `map`?"]),
        (
            "from = 0.05",
            "from = -0.05",
            &["axis `blade.preload_force_n`: found -0.05, expected a number of 0 or more"],
        ),
        (
            "drive.amplitude_m",
            "drive.amplitude",
            &["not a parameter of a scene; did you mean `drive.amplitude_m`?"],
        ),
        (
            "drive.amplitude_m",
            "shoulder.stiffness_ratio",
            &["the point with shoulder.stiffness_ratio = 0.0138", "no [shoulder]", "add a [shoulder] table"],
        ),
        (
            "release+0.005..release+0.05",
            "0.1..0.2",
            &["expected one within the scene's run, 0.42 s to 0.78 s"],
        ),
    ];
    for (from, to, parts) in cases {
        assert!(SWEEP.contains(from), "{from}");
        project.write("sweeps/small.toml", &SWEEP.replacen(from, to, 1));
        project.refused(&["--out", "out"], parts);
    }
    assert!(!project.path("out").exists());
    project.write("sweeps/small.toml", SWEEP);
    project.refused(&["--out", "sweeps/small.toml"], &["is a file, expected a folder"]);
    for name in ["sweep.csv", "journal.jsonl"] {
        let (out, said) = (
            format!("taken-{name}"),
            format!("taken-{name}/{name}: is a folder, expected a file or nothing"),
        );
        fs::create_dir_all(project.path(&out).join(name)).unwrap();
        project.refused(&["--out", &out], &[&said]);
        assert!(
            results(&project.path(&out)).is_empty() && !project.path(&out).join("journal.jsonl").is_file(),
            "{name}"
        );
    }
    let usage = project.sweep(&[]);
    assert!(usage.0 == 2 && usage.2.contains("--out <DIR>"), "{}", usage.2);
}

#[test]
fn a_journal_of_another_study_is_neither_resumed_nor_touched() {
    let project = Project::with(SWEEP);
    let (_, stderr) = project.done(&["--out", "out", "--resume"]);
    assert!(stderr.contains("out/journal.jsonl: nothing to resume; starting over"), "{stderr}");
    let journal = project.read("out/journal.jsonl");
    let refused = |parts: &[&str]| project.refused(&["--out", "out", "--resume"], parts);
    project.write("sweeps/small.toml", &SWEEP.replace("to = 0.25", "to = 0.26"));
    refused(&[
        "out/journal.jsonl: fingerprint",
        "has changed since it was written",
        "move it away to start over",
    ]);
    project.write("sweeps/small.toml", SWEEP);
    project.write("scenes/light-blade.toml", SCENE);
    refused(&["out/journal.jsonl: fingerprint"]);
    assert_eq!(project.read("out/journal.jsonl"), journal);
    project.write("scenes/light-blade.toml", &short_scene());
    let edited = journal.replacen("\"index\"", "\"indx\"", 1);
    project.write("out/journal.jsonl", &edited);
    refused(&["out/journal.jsonl:2: the line has the checksum", "remove this line and all lines after it"]);
    project.write("out/journal.jsonl", &resealed(&edited));
    refused(&["out/journal.jsonl:2: no point: unknown field `indx`"]);
    // a journal of another kind is not overwritten, nor read
    let of_a_fit = "{\"journal\":\"fit\",\"layout\":3}\n";
    project.write("out/journal.jsonl", of_a_fit);
    refused(&["out/journal.jsonl: the journal of a fit, expected that of a sweep"]);
    project.refused(
        &["--out", "out"],
        &["out/journal.jsonl: found a file that is no journal of a sweep", "choose another folder"],
    );
    assert_eq!(project.read("out/journal.jsonl"), of_a_fit);
}

#[test]
fn a_new_study_keeps_the_journal_of_the_last_one_and_two_do_not_write_one() {
    let project = Project::with(SWEEP);
    project.done(&["--out", "out", "--quiet"]);
    let last = project.read("out/journal.jsonl");
    for kept in ["out/journal.previous-1.jsonl", "out/journal.previous-2.jsonl"] {
        let (_, stderr) = project.done(&["--out", "out", "--quiet"]);
        assert_eq!(stderr, format!("out/journal.jsonl: the old journal is kept as {kept}\n"));
    }
    assert_eq!(project.read("out/journal.previous-1.jsonl"), last);
    let held = fs::File::open(project.path("out/journal.jsonl")).unwrap();
    held.lock().unwrap();
    for resume in [&["--out", "out"][..], &["--out", "out", "--resume"]] {
        project.refused(resume, &["out/journal.jsonl: another sweep is writing this journal", "wait until"]);
    }
}

#[test]
fn a_study_that_shows_nothing_says_so_by_its_exit_code() {
    let project = Project::with(
        &SWEEP
            .replace("band_hz = [200.0, 1000.0]", "band_hz = [990.0, 1000.0]")
            .replace("kind = \"stick-fraction\"", "kind = \"jam\""),
    );
    project.write(
        "sweeps/small.toml",
        &project.read("sweeps/small.toml").replace("kind = \"contact-loss\"", "kind = \"jam\""),
    );
    let (code, stdout, _) = project.sweep(&["--out", "out"]);
    assert_eq!(code, 3, "{stdout}");
    assert!(project.read("out/high-component.svg").contains("no component in the band"));
}

#[test]
fn names_from_files_are_shown_as_text() {
    let bad = "<script>alert(1)</script> \"a\" & 'b'";
    let project = Project::with(
        &SWEEP
            .replace("\"A small study\"", &format!("\"\"\"{bad}\"\"\""))
            .replace("\"stick fraction\"", &format!("\"\"\"{bad}\"\"\"")),
    );
    project.done(&["--out", "out", "--quiet"]);
    let figure = project.read("out/script-alert-1-script-a-b.svg");
    assert!(!figure.contains("<script") && figure.contains("&lt;script&gt;"), "{figure}");
}
