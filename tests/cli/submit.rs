//! `wiperlab submit`: scripts for Slurm, how they are handed over, and tasks on this machine.
//!
//! One test needs Slurm (Debian: slurm-wlm, munge): `cargo test --test cli submit -- --ignored`.
#![cfg(unix)]

use crate::small_fit::{self, JOB};
use assert_cmd::cargo::cargo_bin;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const SCENE: &str = include_str!("../../data/scenes/light-blade.toml");

/// Twelve short runs.
pub const STUDY: &str = r#"format = 1
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
points = 6

[[map]]
name = "stick fraction"
kind = "stick-fraction"
"#;

/// Every name that the shell could misread.
const FOLDER: &str = "it's a $tudy; 50% `x` \"Wischblätter\" & co";

/// A study in a folder with a hostile name, and a folder of programs that stand for Slurm's.
struct Site {
    folder: TempDir,
}

impl Site {
    fn new() -> Self {
        let site = Self { folder: TempDir::new().unwrap() };
        let scene = SCENE
            .replace("stop_s = 1.02", "stop_s = 0.78")
            .replace("relative_tolerance = 1e-8", "relative_tolerance = 1e-5");
        site.write("scenes/light-blade.toml", &scene);
        site.write("sweeps/small.toml", STUDY);
        site
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(FOLDER).join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), text).unwrap();
    }

    fn bin(&self) -> PathBuf {
        self.folder.path().join("bin")
    }

    /// A program that notes its folder, its arguments and what it is given, and prints this.
    fn fake(&self, name: &str, prints: &str) {
        fs::create_dir_all(self.bin()).unwrap();
        let notes = self.folder.path().join("notes").display().to_string();
        let script = format!(
            "#!/bin/sh\n{{ pwd; printf '%s\\n' \"$0 $*\"; [ -t 0 ] || cat; }} >> '{notes}'\n{prints}\n"
        );
        let path = self.bin().join(name);
        fs::write(&path, script).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }

    fn notes(&self) -> String {
        fs::read_to_string(self.folder.path().join("notes")).unwrap_or_default()
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(cargo_bin!("wiperlab"));
        command.args(arguments).current_dir(self.path("")).stdin(Stdio::null());
        // no scheduler but the fakes, even where there is one
        let tools = self.folder.path().join("tools");
        fs::create_dir_all(&tools).unwrap();
        for tool in ["cat", "mkdir", "sed"] {
            let found = ["/usr/bin", "/bin"].map(|folder| Path::new(folder).join(tool));
            let _ = std::os::unix::fs::symlink(
                found.iter().find(|path| path.exists()).unwrap(),
                tools.join(tool),
            );
        }
        command.env("PATH", std::env::join_paths([self.bin(), tools]).unwrap());
        command
    }

    fn submit(&self, arguments: &[&str]) -> Output {
        let mut all = vec!["submit", "sweeps/small.toml", "--out", "out"];
        all.extend(arguments);
        self.command(&all).output().unwrap()
    }

    /// Scripts for Slurm, by name.
    fn printed(&self, arguments: &[&str]) -> BTreeMap<String, String> {
        let mut all = vec!["--scheduler", "slurm", "--shards", "64", "--print"];
        all.extend(arguments);
        let ran = self.submit(&all);
        assert_eq!((ran.status.code(), text(&ran.stderr).as_str()), (Some(0), ""));
        assert!(!self.path("out").exists(), "something was written");
        let mut scripts: BTreeMap<String, String> = BTreeMap::new();
        let mut name = String::new();
        for line in text(&ran.stdout).lines() {
            match line.strip_prefix("# ---- ").and_then(|line| line.strip_suffix(" ----")) {
                Some(next) => name = next.to_owned(),
                None => *scripts.entry(name.clone()).or_default() += &format!("{line}\n"),
            }
        }
        scripts
    }

    fn refused(&self, arguments: &[&str], parts: &[&str]) {
        let ran = self.submit(arguments);
        let said = text(&ran.stderr);
        assert_eq!((ran.status.code(), text(&ran.stdout).as_str()), (Some(2), ""), "{arguments:?}: {said}");
        for part in parts {
            assert!(said.contains(part), "{arguments:?}: no \"{part}\" in {said}");
        }
        assert!(!self.path("out").exists(), "{arguments:?}: something was written");
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Checks that the shell and, where it is installed, shellcheck take a script.
fn check_script(name: &str, script: &str) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, script).unwrap();
    let checked = Command::new("/bin/sh").arg("-n").arg(&path).output().unwrap();
    assert!(checked.status.success(), "{name}: {}\n{script}", text(&checked.stderr));
    if let Ok(checked) = Command::new("shellcheck").args(["--severity=warning"]).arg(&path).output() {
        assert!(checked.status.success(), "{name}: {}", text(&checked.stdout));
    }
}

/// Runs the script of a task with a program in place of wiperlab, and gives its folder and its arguments.
fn arguments_of(site: &Site, script: &str, variables: &[(&str, &str)]) -> Vec<String> {
    let program = cargo_bin!("wiperlab").display().to_string();
    let instead = site.folder.path().join("instead");
    fs::write(&instead, "#!/bin/sh\npwd\nprintf '%s\\n' \"$@\"\n").unwrap();
    fs::set_permissions(&instead, fs::Permissions::from_mode(0o755)).unwrap();
    assert!(script.contains(&program), "{script}");
    let path = site.folder.path().join("task.sh");
    fs::write(&path, script.replace(&program, &instead.display().to_string())).unwrap();
    let mut command = Command::new("/bin/sh");
    let ran = command.arg(&path).envs(variables.iter().copied()).output().unwrap();
    assert!(ran.status.success(), "{}", text(&ran.stderr));
    text(&ran.stdout).lines().map(str::to_owned).collect()
}

fn assert_lines(script: &str, lines: &[&str]) {
    for line in lines {
        assert!(script.lines().any(|found| found == *line), "no line {line} in\n{script}");
    }
}

/// Folder and arguments with which the task runs the program.
fn expected(site: &Site, shard: &str, threads: &str, limit: &[&str]) -> Vec<String> {
    let path = |name: &str| fs::canonicalize(site.path("")).unwrap().join(name).display().to_string();
    let own = |name: &str| site.path("").join(name).display().to_string();
    let mut words = vec![path("").trim_end_matches('/').to_owned()];
    words.extend(["sweep".to_owned(), own("sweeps/small.toml"), "--out".to_owned(), own("out")]);
    words.extend(["--shard", shard, "--threads", threads].map(str::to_owned));
    words.extend(limit.iter().map(|word| (*word).to_owned()));
    words
}

#[test]
fn slurm_gets_an_array_and_a_job_after_it() {
    let site = Site::new();
    let scripts = site.printed(&["--threads", "4", "--time", "1h30min", "--tasks", "3,7-12"]);
    assert_eq!(scripts.keys().collect::<Vec<_>>(), ["array.sh", "collect.sh", "submit.sh"]);
    scripts.iter().for_each(|(name, script)| check_script(name, script));
    assert_lines(
        &scripts["array.sh"],
        &[
            "#SBATCH --job-name=wl-small",
            "#SBATCH --array=3,7-12",
            "#SBATCH --cpus-per-task=4",
            "#SBATCH --time=01:30:00",
            "#SBATCH --signal=B:TERM@30",
            "#SBATCH --requeue",
            "#SBATCH --open-mode=append",
            "#SBATCH --output=%x-%A_%a.log",
        ],
    );
    let variables = [("SLURM_ARRAY_TASK_ID", "7"), ("SLURM_CPUS_PER_TASK", "8")];
    let found = arguments_of(&site, &scripts["array.sh"], &variables);
    assert_eq!(found, expected(&site, "7/64", "8", &["--time-limit", "5130s"]));
    assert_lines(&scripts["collect.sh"], &["#SBATCH --cpus-per-task=1", "#SBATCH --output=%x-%j.log"]);
    assert!(scripts["submit.sh"].contains("--dependency=\"afterany:$array\""));

    let large = site.printed(&["--max-file-size", "4GB"]);
    let found = arguments_of(&site, &large["array.sh"], &[("SLURM_ARRAY_TASK_ID", "7")]);
    assert!(found.join(" ").contains(" --max-file-size 4GB --shard 7/64 "), "{found:?}");
    assert!(large["collect.sh"].contains(" --shards 64 --max-file-size 4GB\n"), "{}", large["collect.sh"]);

    let all = site.printed(&[]);
    assert_lines(&all["array.sh"], &["#SBATCH --array=0-63", "#SBATCH --cpus-per-task=1"]);
    assert!(!all["array.sh"].contains("--time"), "{}", all["array.sh"]);
}

#[test]
fn further_lines_go_to_both_jobs() {
    let site = Site::new();
    let arguments = ["--directive=--partition=short", "--directive", "--account=blades"];
    let scripts = site.printed(&arguments);
    for name in ["array.sh", "collect.sh"] {
        assert_lines(&scripts[name], &["#SBATCH --partition=short", "#SBATCH --account=blades"]);
    }
}

#[test]
fn scripts_are_written_and_handed_over() {
    let site = Site::new();
    site.fake("sbatch", "echo '4711;cluster'");
    let ran = site.submit(&["--scheduler", "slurm", "--shards", "3"]);
    let (said, complaint) = (text(&ran.stdout), text(&ran.stderr));
    assert_eq!((ran.status.code(), complaint.as_str()), (Some(0), ""), "{said}");
    assert_lines(&said, &["array: 4711", "collect: 4711"]);
    assert!(said.contains("3 tasks with 1 core each"), "{said}");
    let noted = site.notes();
    for part in [
        "--parsable ../submit/array.sh",
        "--parsable --dependency=afterany:4711 ../submit/collect.sh",
        &site.path("out/shards/logs").display().to_string(),
    ] {
        assert!(noted.contains(part), "no {part} in {noted}");
    }
    for name in ["array.sh", "collect.sh", "submit.sh", ".wiperlab.json"] {
        assert!(site.path("out/shards/submit").join(name).is_file(), "{name}");
    }
    // again, with other tasks: the scripts are replaced
    let again = site.submit(&["--scheduler", "slurm", "--shards", "7", "--tasks", "2", "--quiet"]);
    assert_eq!(again.status.code(), Some(0), "{}", text(&again.stderr));
    assert!(fs::read_to_string(site.path("out/shards/submit/array.sh")).unwrap().contains("/7\""));
}

#[test]
fn scripts_that_were_changed_are_not_replaced_without_force() {
    let site = Site::new();
    site.fake("sbatch", "echo 1");
    let arguments = ["--scheduler", "slurm", "--shards", "3"];
    assert_eq!(site.submit(&arguments).status.code(), Some(0));
    site.write("out/shards/submit/array.sh", "#!/bin/sh\n# mine\n");
    let ran = site.submit(&arguments);
    assert_eq!(ran.status.code(), Some(2));
    let said = text(&ran.stderr);
    assert!(said.contains("changed since `wiperlab submit` made it") && said.contains("--force"), "{said}");
    let forced = site.submit(&["--scheduler", "slurm", "--shards", "3", "--force"]);
    assert_eq!(forced.status.code(), Some(0), "{}", text(&forced.stderr));
}

#[test]
fn a_scheduler_that_refuses_is_quoted() {
    let site = Site::new();
    site.fake("sbatch", "echo 'sbatch: error: invalid partition' >&2; exit 1");
    let ran = site.submit(&["--scheduler", "slurm", "--shards", "3"]);
    let said = text(&ran.stderr);
    assert_eq!((ran.status.code(), text(&ran.stdout).as_str()), (Some(1), ""), "{said}");
    assert!(said.contains("sbatch: error: invalid partition; nothing was submitted"), "{said}");

    site.fake("sbatch", "case $* in *depend*) exit 1;; esac; echo 12");
    let ran = site.submit(&["--scheduler", "slurm", "--shards", "3"]);
    let said = text(&ran.stderr);
    assert_eq!((ran.status.code(), text(&ran.stdout).as_str()), (Some(1), "array: 12\n"), "{said}");
    assert!(said.contains("the rest is not: run `wiperlab collect` yourself"), "{said}");
}

#[test]
fn what_every_task_would_refuse_is_refused_before() {
    let site = Site::new();
    let three = ["--scheduler", "slurm", "--shards", "3"];
    site.refused(&three, &["found no program `sbatch` on PATH", "--print"]);
    site.refused(
        &["--scheduler", "slurm", "--shards", "1001"],
        &["1001", "takes no longer array", "--threads"],
    );
    site.refused(&["--scheduler", "slurm", "--shards", "0"], &["from 1 to 1000"]);
    site.refused(
        &["--scheduler", "slurm", "--shards", "3", "--tasks", "1,3"],
        &["--tasks: found 3, expected numbers below the 3 of --shards"],
    );
    site.refused(&["--scheduler", "slurm", "--shards", "3", "--tasks", "a"], &["such as 3,7-12"]);
    site.refused(&["--scheduler", "slurm", "--shards", "3", "--time", "30s"], &["at least a minute"]);
    site.refused(
        &["--scheduler", "slurm", "--shards", "3", "--directive", "a\nb"],
        &["--directive", "expected one line"],
    );
    site.refused(
        &["--scheduler", "local", "--shards", "3", "--directive", "a"],
        &["there is no scheduler; leave it out"],
    );

    site.fake("sbatch", "echo 1");
    site.write("sweeps/small.toml", &STUDY.replace("preload_force_n", "preload_forse_n"));
    site.refused(&three, &["sweeps/small.toml", "blade.preload_forse_n"]);
    site.write("sweeps/small.toml", &STUDY.replace("light-blade.toml", "no-blade.toml"));
    site.refused(&three, &["key `scene`: found \"", "no-blade.toml`"]);
    site.write("sweeps/small.toml", &STUDY.replace("from = 0.05", "from = -0.05"));
    site.refused(&three, &["axis `blade.preload_force_n`", "found -0.05"]);
    assert_eq!(site.notes(), "", "something was submitted");

    site.write("sweeps/line\nbreak.toml", STUDY);
    let ran = site
        .command(&[
            "submit",
            "sweeps/line\nbreak.toml",
            "--out",
            "out",
            "--scheduler",
            "slurm",
            "--shards",
            "3",
        ])
        .output()
        .unwrap();
    assert_eq!(ran.status.code(), Some(2));
    assert!(text(&ran.stderr).contains("found a line break"), "{}", text(&ran.stderr));
}

/// Files of the results, without the shards.
fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for part in ["", "paper"] {
        for entry in fs::read_dir(folder.join(part)).unwrap().map(Result::unwrap) {
            let name = entry.file_name().into_string().unwrap();
            if entry.path().is_file() && !name.starts_with(['j', '.']) {
                found.insert(format!("{part}/{name}"), fs::read(entry.path()).unwrap());
            }
        }
    }
    found
}

#[test]
fn tasks_on_this_machine_give_what_one_run_gives() {
    let site = Site::new();
    let ran = site.command(&["sweep", "sweeps/small.toml", "--out", "expected"]).output().unwrap();
    assert_eq!(ran.status.code(), Some(0), "{}", text(&ran.stderr));

    let some = site.submit(&["--scheduler", "local", "--shards", "5", "--tasks", "0,2-4"]);
    assert_eq!(some.status.code(), Some(3), "{}", text(&some.stderr));
    let said = text(&some.stdout);
    assert!(said.contains("missing: 3 of 12 points") && said.contains("tasks: 1\n"), "{said}");
    assert!(!site.path("out/sweep.csv").exists());

    let rest = site.submit(&["--scheduler", "local", "--shards", "5", "--tasks", "1"]);
    assert_eq!(rest.status.code(), Some(0), "{}", text(&rest.stderr));
    let (expected, found) = (results(&site.path("expected")), results(&site.path("out")));
    assert_eq!(expected.keys().collect::<Vec<_>>(), found.keys().collect::<Vec<_>>());
    assert!(expected == found, "the results differ");

    let printed = site.submit(&["--scheduler", "local", "--shards", "2", "--print"]);
    let printed = text(&printed.stdout);
    assert_eq!(printed.lines().count(), 3);
    assert!(printed.contains("--shard 1/2 --threads 1\n"), "{printed}");
    check_script("local.sh", &format!("#!/bin/sh\n{printed}"));
}

#[test]
fn a_task_that_is_refused_is_named_with_its_message() {
    let site = Site::new();
    site.write("out/shards/1-of-3.jsonl", "{\"no\": \"journal\"}\n");
    let ran = site.submit(&["--scheduler", "local", "--shards", "3", "--quiet"]);
    let said = text(&ran.stderr);
    assert_eq!(ran.status.code(), Some(2), "{said}");
    assert!(said.contains("shard 1/3: ") && said.contains("1-of-3.jsonl"), "{said}");
    assert!(!site.path("out/sweep.csv").exists());
}

/// Three small fits.
fn fits() -> small_fit::Project {
    let project = small_fit::Project::of("twin");
    for name in ["one", "two", "three"] {
        project.write(&format!("fits/{name}/job.toml"), JOB);
    }
    project
}

const JOBS: [&str; 3] = ["fits/one/job.toml", "fits/two/job.toml", "fits/three/job.toml"];

#[test]
fn a_list_of_fits_is_divided_by_whole_jobs() {
    let project = fits();
    let submit = |arguments: &[&str]| project.run(&[&["submit"], &JOBS[..], arguments].concat());
    let (code, said, complaint) =
        submit(&["--scheduler", "slurm", "--shards", "2", "--print", "--time", "10min"]);
    assert_eq!((code, complaint.as_str()), (0, ""), "{said}");
    assert!(said.contains("#SBATCH --job-name=wl-fits\n"), "{said}");
    let path = |name: &str| project.path(name).display().to_string();
    let jobs = JOBS.map(path).join(" ");
    assert!(said.contains(&format!(" fit {jobs} \\\n    --shard \"${{SLURM_ARRAY_TASK_ID}}/2\"")), "{said}");
    assert!(said.contains(&format!(" collect {jobs} --shards 2\n")), "{said}");
    assert!(said.contains(&format!("cd {}\n", path("fits/shards/logs"))), "{said}");
    assert!(!project.path("fits/shards").exists());

    let (code, said, complaint) =
        submit(&["--scheduler", "local", "--shards", "2", "--tasks", "0", "--out", "logs"]);
    assert_eq!(code, 3, "{said}{complaint}");
    assert!(said.contains("missing: ") && said.contains("tasks: "), "{said}{complaint}");
    let done = |name: &str| project.path(&format!("fits/{name}/result.json")).exists();
    assert_eq!(["one", "two", "three"].map(done), [true, false, true], "{said}{complaint}");
    assert!(project.path("logs/shards/logs/0-of-2.log").is_file());
}

#[test]
fn a_list_that_no_task_could_do_is_refused_before() {
    let project = fits();
    project.write("fits/one/other.toml", JOB);
    project.write("fits/bad/job.toml", &JOB.replace("friction.c", "friction.d"));
    project.write("study.toml", STUDY);
    let refused = |files: &[&str], part: &str| {
        let arguments = ["--scheduler", "local", "--shards", "2"];
        let (code, said, complaint) = project.run(&[&["submit"], files, &arguments[..]].concat());
        assert_eq!((code, said.as_str()), (2, ""), "{files:?}: {complaint}");
        assert!(complaint.contains(part), "{files:?}: {complaint}");
    };
    refused(&["fits/one/job.toml"], "fits/one/job.toml: found one job, expected a study or a list of jobs");
    refused(&["fits/one/job.toml", "fits/one/other.toml"], "lies in the folder of");
    refused(&["fits/one/job.toml", "fits/bad/job.toml"], "friction.d");
    refused(&["fits/one/job.toml", "study.toml"], "study.toml: found a study among 2 files");
    refused(&["study.toml"], "study.toml: found a study without --out");
    refused(&["fits/one/job.toml", "fits/none/job.toml"], "fits/none/job.toml: no such file");
    refused(&["-"], "found standard input");
    assert!(!project.path("fits/shards").exists());
}

/// Processes of this test that run the program, but for the one that is asked for.
fn running(site: &Site) -> usize {
    let name = site.folder.path().file_name().unwrap().to_str().unwrap().to_owned();
    let processes = fs::read_dir("/proc").unwrap().filter_map(|entry| {
        fs::read(entry.unwrap().path().join("cmdline"))
            .ok()
            .map(|line| String::from_utf8_lossy(&line).into_owned())
    });
    processes.filter(|line| line.contains(&name) && line.contains("--shard\0")).count()
}

#[cfg(target_os = "linux")]
#[test]
fn an_interruption_stops_all_tasks() {
    let site = Site::new();
    let study = STUDY.replace("points = 6", "points = 6000");
    site.write("sweeps/small.toml", &study);
    let arguments =
        ["submit", "sweeps/small.toml", "--out", "out", "--scheduler", "local", "--shards", "9", "--quiet"];
    let child = site.command(&arguments).stderr(Stdio::piped()).spawn().unwrap();
    let clock = Instant::now();
    while running(&site) == 0 {
        assert!(clock.elapsed() < Duration::from_secs(30), "no task was started");
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(300));
    let clock = Instant::now();
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    let ended = child.wait_with_output().unwrap();
    let said = text(&ended.stderr);
    assert_eq!(ended.status.code(), Some(3), "{said}");
    assert!(clock.elapsed() < Duration::from_secs(3), "{:?}", clock.elapsed());
    assert!(said.contains("interrupted: ") && said.contains("the same command goes on"), "{said}");
    assert_eq!(running(&site), 0);
}

#[test]
#[ignore = "needs Slurm: cargo test --test cli submit -- --ignored"]
fn a_study_and_fits_on_a_real_slurm_survive_the_loss_of_tasks_and_of_a_node() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join(".ci/slurm");
    let status = Command::new(script).arg(cargo_bin!("wiperlab")).status().unwrap();
    assert!(status.success(), "{status}");
}
