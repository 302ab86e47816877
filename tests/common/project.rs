//! A temporary project with what is committed in `data/` and `fits/`.

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
        let run = Command::new(env!("CARGO_BIN_EXE_wiperlab"))
            .args(arguments)
            .current_dir(self.folder.path())
            .output()
            .unwrap();
        assert!(
            run.status.code().is_some_and(|code| codes.contains(&code)),
            "{arguments:?}\n{}",
            String::from_utf8_lossy(&run.stderr)
        );
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        if entry.file_name().to_string_lossy().starts_with("journal") {
            continue; // what fits and studies leave here is not committed
        }
        if source.is_dir() {
            copy(&source, &target);
        } else {
            fs::copy(&source, &target).unwrap();
        }
    }
}
