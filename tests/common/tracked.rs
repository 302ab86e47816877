//! What is under version control.

use std::path::Path;
use std::process::Command;

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Paths of all tracked files, from the root; `None` where the sources are not a checkout of git.
pub fn tracked() -> Option<Vec<String>> {
    if !root().join(".git").exists() {
        eprintln!("skipped: no checkout of git");
        return None;
    }
    let listed = Command::new("git").args(["ls-files", "-z"]).current_dir(root()).output().unwrap();
    assert!(listed.status.success(), "git ls-files: {}", String::from_utf8_lossy(&listed.stderr));
    let listed = String::from_utf8(listed.stdout).unwrap();
    // (what is deleted and not committed yet is still listed)
    let exists = |path: &&str| !path.is_empty() && root().join(path).exists();
    Some(listed.split('\0').filter(exists).map(str::to_owned).collect())
}
