//! What a command may overwrite: its own unchanged files, the rest with `--force`, a measured recording
//! never; and a trace that is not the one that its description was written for.

use crate::small_fit::{JOB, Project};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

const EXPORT: &str = "\ttip\t\thead\t\nt\tx\ty\tx\ty\n0.000\t1.5\t2.5\t3.5\t4.5\n0.001\t1.6\t2.6\t3.6\t4.6\n0.002\t1.7\t2.7\t3.7\t4.7\n";
const CAMERA: [&str; 8] =
    ["--frame-rate-hz", "1000", "--scale", "mm", "--y-axis", "up", "--condition", "glass=wet"];
const SCENE: &str = "data/scenes/actual-blade.toml";
const TWIN: &str = "format = 1\ntitle = \"a twin\"\nscene = \"../data/scenes/actual-blade.toml\"\nseed = 7\n[camera]\nframe_rate_hz = 2000.0\nexposure_s = 1e-4\n\
                    metres_per_pixel = 2e-5\nnoise_px = 0.1\ndropout_fraction = 0.1\n[export]\nlayout = \"tracker\"\n";
const STUDY: &str = "format = 1\ntitle = \"small\"\nscene = \"../data/scenes/actual-blade.toml\"\n[camera]\nframe_rate_hz = 2000.0\nexposure_s = 0.0\n[[axis]]\nname = \"friction.c\"\nvalues = [0.29, 0.3]\n[[map]]\nname = \"stick fraction\"\nkind = \"stick-fraction\"\n";

/// A scene, a job, a twin and an export, with a measured recording in `data/take`.
fn project() -> Project {
    let project = Project::of("twin");
    project.write("fits/x/job.toml", JOB);
    project.write("specs/twin.toml", TWIN);
    project.write("specs/study.toml", STUDY);
    project.write("take.txt", EXPORT);
    let (code, _, stderr) = project.run(&import(&[]));
    assert_eq!(code, 0, "{stderr}");
    project
}

fn import<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["import", "take.txt", "--out", "data/take"], &CAMERA[..], more].concat()
}

/// Every file of a folder with its bytes.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap).filter(|entry| entry.path().is_file());
    entries.map(|e| (e.file_name().into_string().unwrap(), fs::read(e.path()).unwrap())).collect()
}

impl Project {
    /// A refusal with code 2 that changes nothing in `folder`.
    fn leaves(&self, folder: &str, arguments: &[&str], parts: &[&str]) {
        let before = contents(&self.path(folder));
        let (code, _, stderr) = self.run(arguments);
        assert_eq!(code, 2, "{arguments:?}: {stderr}");
        for part in parts {
            assert!(stderr.contains(part), "{arguments:?}: expected {part:?} in {stderr}");
        }
        assert!(contents(&self.path(folder)) == before, "{arguments:?} changed {folder}");
    }

    fn succeeds(&self, arguments: &[&str]) -> String {
        let (code, stdout, stderr) = self.run(arguments);
        assert!(code == 0 || code == 3, "{arguments:?}: {stderr}");
        stdout
    }
}

#[test]
fn no_command_replaces_a_measured_recording() {
    let project = project();
    let refused = "no measured recording is overwritten";
    for force in [&[][..], &["--force"]] {
        let run = |arguments: &[&str], parts: &[&str]| {
            project.leaves("data/take", &[arguments, force].concat(), parts);
        };
        run(
            &["simulate", SCENE, "--out", "data/take"],
            &["data/take/trace.csv: found another recording", refused],
        );
        run(&["twin", "specs/twin.toml", "--out", "data/take"], &[refused]);
        project.write("other.txt", &EXPORT.replace("1.5", "1.4"));
        run(
            &[&["import", "other.txt", "--out", "data/take"], &CAMERA[..]].concat(),
            &[refused, "move the folder away"],
        );
    }
    // an export that was called like a table of the spectrum
    project.write("spectrum.csv", EXPORT);
    project.succeeds(&[&["import", "spectrum.csv", "--out", "data/named"], &CAMERA[..]].concat());
    let spectrum = ["spectrum", "data/twin", "--out", "data/named"];
    project.leaves("data/named", &spectrum, &["data/named/spectrum.csv: found another recording", refused]);
    project.leaves("data/named", &[&spectrum[..], &["--force"]].concat(), &[refused]);
    // the same exports lose nothing, and have to be asked for
    project.leaves("data/take", &import(&[]), &["add --force to import the same exports again"]);
    let noted = project
        .read("data/take/recording.toml")
        .replace("[conditions]\n", "[conditions]\nhumidity = \"40 %\"\n")
        + "\n[video]\nframes = \"frames\"\norigin_px = [0.0, 1.0]\nmetres_per_pixel = 1e-5\n";
    project.write("data/take/recording.toml", &noted);
    project.succeeds(&import(&["--force"]));
    let conditions = project.read("data/take/recording.toml");
    assert!(
        conditions.contains("humidity = \"40 %\"")
            && conditions.contains("glass = \"wet\"")
            && conditions.contains("origin_px = [0.0, 1.0]"),
        "{conditions}"
    );
}

#[test]
fn what_does_not_prove_that_it_is_synthetic_counts_as_measured() {
    let project = project();
    let trace = project.read("data/take/trace.csv");
    project.write("bare/trace.csv", &trace);
    project.write("torn/trace.csv", &trace);
    project.write("torn/recording.toml", "format = 1\nsynth");
    project.write("study/trace.csv", &trace);
    project.write("study/summary.json", "{\"title\": \"a study\", \"points\": 3}");
    project.succeeds(&["simulate", SCENE, "--out", "over"]);
    project.write("over/trace.csv", &trace); // somebody copied a measured trace there
    for (folder, why) in [
        ("bare", "nothing next to it that says where it comes from"),
        ("torn", "recording.toml that cannot be read"),
        ("study", "nothing next to it"),
        ("over", "was changed since `wiperlab simulate` wrote it"),
    ] {
        for command in [["simulate", SCENE], ["twin", "specs/twin.toml"]] {
            project.leaves(
                folder,
                &[&command[..], &["--out", folder, "--force"]].concat(),
                &[why, "no measured recording is overwritten"],
            );
        }
    }
    let (code, stdout, _) = project.run(&["inspect", "study"]);
    assert!(
        code == 0 && !stdout.contains("synthetic"),
        "a study's summary makes no trace synthetic: {stdout}"
    );
    let (code, _, stderr) = project.run(&["inspect", "over"]);
    assert!(
        code == 2 && stderr.contains("changed or replaced since `wiperlab simulate` wrote it"),
        "{stderr}"
    );
}

#[test]
fn every_command_overwrites_what_it_made_and_nothing_else() {
    let project = project();
    let commands: [(&[&str], &str, &str); 7] = [
        (&["simulate", SCENE, "--out", "out/simulate"], "out/simulate", "summary.json"),
        (&["twin", "specs/twin.toml", "--out", "out/twin"], "out/twin", "twin.toml"),
        (
            &["spectrum", "data/twin", "--window", "0.3..0.4", "--out", "out/spectrum"],
            "out/spectrum",
            "components.json",
        ),
        (&["sweep", "specs/study.toml", "--out", "out/sweep"], "out/sweep", "sweep.csv"),
        (&["fit", "fits/x/job.toml", "--max-evaluations", "3"], "fits/x", "result.json"),
        (&["report", "fits/x"], "reports/x", "index.html"),
        (&["report", "fits/x", "--out", "out/report"], "out/report", "report.json"),
    ];
    for (command, folder, file) in commands {
        let name = format!("{folder}/{file}");
        project.succeeds(command);
        project.succeeds(command); // its own, without a word
        let made = project.read(&name);
        project.write(&name, &made.replacen('0', "1", 1));
        project.leaves(folder, command, &[&name, "was changed since", command[0], "--force"]);
        fs::remove_file(project.path(&format!("{folder}/.wiperlab.json"))).unwrap();
        project.leaves(folder, command, &["no wiperlab command is known to have made", "move the file away"]);
        project.succeeds(&[command, &["--force"]].concat());
        project.succeeds(command);
        // (a job's result is not asked for by another command)
        if folder.starts_with("out/") && command[0] != "spectrum" {
            let other = ["spectrum", "data/twin", "--window", "0.3..0.4", "--out", folder];
            project.write(&format!("{folder}/ridge.csv"), "mine");
            project.leaves(folder, &other, &["ridge.csv", "--force"]);
        }
    }
}

#[test]
fn the_description_of_one_recording_never_stands_next_to_the_trace_of_another() {
    let project = project();
    project.succeeds(&["twin", "specs/twin.toml", "--out", "a"]);
    let simulate = ["simulate", SCENE, "--out", "a"];
    project.leaves("a", &simulate, &["a/recording.toml: found the description of another recording"]);
    project.succeeds(&[&simulate[..], &["--force"]].concat());
    let names: Vec<String> = contents(&project.path("a")).into_keys().collect();
    assert_eq!(names, [".wiperlab.json", "events.csv", "state.csv", "summary.json", "trace.csv"]);
    let twin = ["twin", "specs/twin.toml", "--out", "a"];
    project.leaves("a", &twin, &["a/summary.json: found the description of another recording"]);
    project.succeeds(&[&twin[..], &["--force"]].concat());
    let names: Vec<String> = contents(&project.path("a")).into_keys().collect();
    assert_eq!(
        names,
        [".wiperlab.json", "recording.toml", "synthetic-tracker-export.txt", "trace.csv", "twin.toml"]
    );
    assert!(project.succeeds(&["inspect", "a"]).contains("synthetic"));
}

#[test]
fn a_trace_that_is_not_the_one_described_is_refused_by_every_reader() {
    let project = project();
    project.succeeds(&["fit", "fits/x/job.toml", "--max-evaluations", "3"]);
    let driven = "driven.toml";
    let scene = project.read(SCENE);
    let drive = scene.find("[drive]").unwrap();
    let end = scene[drive + 1..].find("\n[").map_or(scene.len(), |at| drive + 1 + at);
    project
        .write(driven, &format!("{}[drive]\nrecording = \"data/twin\"\n{}", &scene[..drive], &scene[end..]));
    let intact = project.read("data/twin/trace.csv");
    let at = intact.len() / 2 + intact[intact.len() / 2..].find('1').unwrap();
    let mut changed = intact.clone();
    changed.replace_range(at..=at, "2");
    let readers: [&[&str]; 5] = [
        &["inspect", "data/twin"],
        &["spectrum", "data/twin", "--out", "s"],
        &["fit", "fits/x/job.toml"],
        &["report", "fits/x"],
        &["simulate", driven, "--out", "d"],
    ];
    project.write("data/twin/trace.csv", &changed);
    for reader in readers {
        project.leaves(
            "data/twin",
            reader,
            &["trace.csv: found SHA-256 ", "as the recording.toml next to it says"],
        );
    }
    // a checkout that changed line ends changed nothing
    project.write("data/twin/trace.csv", &format!("\u{feff}{}", intact.replace('\n', "\r\n")));
    assert!(!project.succeeds(&["inspect", "data/twin"]).contains("not verified"));
    // without the key there is nothing to hold the trace against
    let description = project.read("data/twin/recording.toml");
    let without: String = description
        .lines()
        .filter(|line| !line.starts_with("trace_sha256"))
        .map(|l| format!("{l}\n"))
        .collect();
    project.write("data/twin/recording.toml", &without);
    assert!(project.succeeds(&["inspect", "data/twin"]).contains("not verified"));
    // the trace alone, in a folder of its own, is what the refusal offers
    project.write("alone/trace.csv", &changed);
    project.succeeds(&["inspect", "alone"]);
}

/// A limit on the size of files stands for a disk that is full.
#[cfg(unix)]
#[test]
fn a_disk_that_is_full_leaves_the_old_files() {
    let project = project();
    project.succeeds(&["simulate", SCENE, "--out", "s"]);
    let before = contents(&project.path("s"));
    project.write(
        "longer.toml",
        &project.read(SCENE).replace("sample_rate_hz", "# ").replacen(
            "[run]",
            "[run]\nsample_rate_hz = 20000.0",
            1,
        ),
    );
    for (command, folder) in [
        ("simulate longer.toml --out s", "s"),
        ("simulate longer.toml --out new", "new"),
        ("twin specs/twin.toml --out new", "new"),
        ("import big.txt --out new --frame-rate-hz 1000 --scale mm --y-axis up", "new"),
    ] {
        let rows: String =
            (0..20_000).map(|i| format!("{}\t1.5\t2.5\t3.5\t4.5\n", f64::from(i) * 1e-3)).collect();
        project.write("big.txt", &format!("\ttip\t\thead\t\nt\tx\ty\tx\ty\n{rows}"));
        let shell = format!("trap '' XFSZ; ulimit -f 8; exec {} {command}", env!("CARGO_BIN_EXE_wiperlab"));
        let output = assert_cmd::Command::new("sh")
            .current_dir(project.folder.path())
            .args(["-c", &shell])
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{command}: {stderr}");
        assert!(stderr.contains("cannot be written"), "{command}: {stderr}");
        if folder == "s" {
            assert!(contents(&project.path("s")) == before, "{command}");
        } else {
            assert!(!project.path("new").exists(), "{command}");
        }
    }
}
