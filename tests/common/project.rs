//! A temporary project with committed fits, and the reports that the built program makes of them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// A copy of `data/` and `fits/` to run the program in.
pub struct Project {
    folder: TempDir,
}

impl Project {
    pub fn copied() -> Self {
        let project = Self { folder: TempDir::new().unwrap() };
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        for part in ["data", "fits"] {
            copy(&root.join(part), &project.path(part));
        }
        project
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs the program; it must end with one of these codes.
    pub fn run_to(&self, arguments: &[&str], codes: &[i32]) {
        let run = Command::new(env!("CARGO_BIN_EXE_wiperlab")).args(arguments).current_dir(self.folder.path()).output().unwrap();
        assert!(run.status.code().is_some_and(|code| codes.contains(&code)), "{arguments:?}\n{}", String::from_utf8_lossy(&run.stderr));
    }

    /// The folder of the report of a fit, made anew.
    pub fn report(&self, fit: &str) -> PathBuf {
        self.run_to(&["report", &format!("fits/{fit}")], &[0]);
        self.path("reports").join(fit)
    }
}

/// Files of a folder with an ending, in order of their names.
pub fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|e| e == ending)).collect();
    files.sort();
    files
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        if source.is_dir() {
            copy(&source, &target);
        } else {
            fs::copy(&source, &target).unwrap();
        }
    }
}
