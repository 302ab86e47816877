//! A small fit that a program can make in a moment: a temporary folder with the bundled twin and its scene,
//! and a job.

use assert_cmd::Command;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
const TRACE: &str = include_str!("../../data/actual-blade-twin/trace.csv");
const DESCRIPTION: &str = include_str!("../../data/actual-blade-twin/recording.toml");

/// Two parameters of the bundled twin near their truth; 14 evaluations of the search, and what gate, profiles
/// and two twins take.
pub const JOB: &str = r#"format = 1
title = "A small fit"
scene = "../../data/scenes/actual-blade.toml"
seed = 3

[[recording]]
path = "../../data/twin"

[[parameter]]
name = "friction.c"
lower = 0.27
upper = 0.33
scale = "linear"

[[parameter]]
name = "blade.neck_stiffness_n_m_per_rad"
lower = 0.0017
upper = 0.0021
scale = "log"

[[component]]
name = "low"
channel = "head-drop"
window = "release+0.01..release+0.2"
band_hz = [40.0, 140.0]
tolerance_relative = 0.5

[[feature]]
name = "release"
kind = "release-after-reversal"
sd_relative = 0.01

[search]
global_evaluations = 8
local_evaluations = 6
particles = 4

[intervals]
bootstrap = 2
"#;

/// A project in a temporary folder.
pub struct Project {
    pub folder: TempDir,
}

impl Project {
    /// A scene, and the bundled twin as `data/NAME`.
    pub fn of(recording: &str) -> Self {
        let project = Self { folder: TempDir::new().unwrap() };
        project.write("data/scenes/actual-blade.toml", SCENE);
        project.write(&format!("data/{recording}/trace.csv"), TRACE);
        project.write(&format!("data/{recording}/recording.toml"), DESCRIPTION);
        project
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// Exit code, standard output and standard error.
    pub fn run(&self, arguments: &[&str]) -> (i32, String, String) {
        self.run_in("", arguments)
    }

    /// The same of a program that runs in a folder of the project.
    pub fn run_in(&self, folder: &str, arguments: &[&str]) -> (i32, String, String) {
        let output = Command::new(env!("CARGO_BIN_EXE_wiperlab"))
            .current_dir(self.path(folder))
            .args(arguments)
            .output()
            .unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
    }
}
