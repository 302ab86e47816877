//! Where the program lies, for jobs that start it again.

use crate::program::failure::Failure;
use std::path::PathBuf;
use std::sync::OnceLock;

/// Its path where the process runs something else.
static EXECUTABLE_PATH: OnceLock<PathBuf> = OnceLock::new();

/// Says where it lies; the first word counts.
pub fn set_executable_path(path: PathBuf) {
    let _ = EXECUTABLE_PATH.set(path);
}

/// Its path.
pub fn executable_path() -> Result<PathBuf, Failure> {
    let unknown = |error| Failure::Internal(format!("the path of this program is not known: {error}"));
    EXECUTABLE_PATH.get().map_or_else(|| std::env::current_exe().map_err(unknown), |path| Ok(path.clone()))
}
