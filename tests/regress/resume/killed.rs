//! `wiperlab fit` is killed at many moments, resumed, and compared with a run that was left alone.

use crate::thorough::pick;
use assert_cmd::cargo::cargo_bin;
use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const SCENE: &str = include_str!("../../../data/scenes/actual-blade.toml");
const TRACE: &str = include_str!("../../../data/actual-blade-twin/trace.csv");
const DESCRIPTION: &str = include_str!("../../../data/actual-blade-twin/recording.toml");

/// Two parameters of the bundled synthetic recording; a run to just after the flip.
const JOB: &str = r#"format = 1
title = "Killed and resumed"
scene = "scene.toml"
seed = 3

[[recording]]
path = "twin"

[[parameter]]
name = "friction.c"
lower = 0.2
upper = 0.4
scale = "log"

[[parameter]]
name = "blade.neck_stiffness_n_m_per_rad"
lower = 0.0014
upper = 0.0025
scale = "log"

[[feature]]
name = "release"
kind = "release-after-reversal"
sd_relative = 0.01

[[feature]]
name = "before"
kind = "mean-deflection"
window = "reversal-0.08..reversal-0.04"
sd_relative = 0.005

[search]
global_evaluations = 40
local_evaluations = 60
particles = 8

[intervals]
bootstrap = 3
"#;

struct Project(TempDir);

impl Project {
    fn new() -> Self {
        let project = Self(TempDir::new().unwrap());
        fs::create_dir(project.path("twin")).unwrap();
        let files =
            [("scene.toml", SCENE.replace("stop_s = 1.15", "stop_s = 0.76")), ("job.toml", JOB.to_owned())];
        files.iter().for_each(|(name, text)| fs::write(project.path(name), text).unwrap());
        fs::write(project.path("twin/trace.csv"), TRACE).unwrap();
        fs::write(project.path("twin/recording.toml"), DESCRIPTION).unwrap();
        project
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The program, started.
    fn start(&self, resume: bool, threads: u32) -> Child {
        let mut command = Command::new(cargo_bin!("wiperlab"));
        command.current_dir(&self.0).args(["fit", "job.toml", "--quiet", "--threads", &threads.to_string()]);
        command
            .args(resume.then_some("--resume"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    }

    /// Killed after so long, if it has not ended before; what it leaves is whole.
    fn killed(&self, resume: bool, threads: u32, after: Duration, expected: &Written) {
        let mut child = self.start(resume, threads);
        std::thread::sleep(after);
        let _ = child.kill(); // it may have ended
        child.wait().unwrap();
        if self.path("result.json").exists() {
            assert_eq!(
                fs::read_to_string(self.path("result.json")).unwrap(),
                expected.result,
                "half-written"
            );
        }
        if self.path("journal.jsonl").exists() {
            let journal = fs::read_to_string(self.path("journal.jsonl")).unwrap();
            assert!(expected.journal.starts_with(&journal), "not the first part of the whole journal");
        }
    }

    fn ended(&self, resume: bool, threads: u32) -> Written {
        let code = self.start(resume, threads).wait().unwrap().code();
        assert!(matches!(code, Some(0 | 3)), "{code:?}");
        Written {
            result: fs::read_to_string(self.path("result.json")).unwrap(),
            journal: fs::read_to_string(self.path("journal.jsonl")).unwrap(),
        }
    }

    fn clear(&self) {
        for name in ["result.json", "journal.jsonl"] {
            let _ = fs::remove_file(self.path(name)); // it may not be there
        }
    }
}

#[derive(Debug, PartialEq)]
struct Written {
    result: String,
    journal: String,
}

#[test]
fn a_fit_that_is_killed_at_many_moments_ends_like_one_that_never_was() {
    let kills = pick(8, 50);
    let project = Project::new();
    let clock = Instant::now();
    let expected = project.ended(false, 1);
    let whole = clock.elapsed();
    for stage in ["gate", "global", "local", "sensitivity", "profile", "bootstrap"] {
        assert!(expected.journal.contains(&format!("\"stage\":\"{stage}\"")), "{stage} is not tried");
    }
    let mut cut = 0;
    for kill in 0..kills {
        let threads = [1, 2, 4][kill as usize % 3];
        project.clear();
        project.killed(false, threads, whole * (2 * kill + 1) / (2 * kills), &expected);
        cut += u32::from(project.path("journal.jsonl").exists() && !project.path("result.json").exists());
        if kill % 4 == 0 {
            project.killed(true, threads, whole / 5, &expected);
        }
        assert_eq!(project.ended(true, [4, 1, 2][kill as usize % 3]), expected, "kill {kill}");
    }
    assert!(cut > kills / 10, "only {cut} kills met a fit that had begun to search");
}
