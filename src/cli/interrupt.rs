//! SIGINT, SIGTERM and the time limit. A command that can stop early is asked to stop, and writes the results
//! that it has. Any other command, and a command that does not stop in time, is ended immediately. In both
//! cases the program prints what was computed, exits with the code of an early stop, and leaves neither
//! incomplete outputs nor temporary files.

use super::failure::{Failure, Outcome, STOPPED_EARLY};
use super::progress;
use std::io;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tempfile::NamedTempFile;

/// Time within which a command must stop, so that the program reacts within a second.
const GRACE: Duration = Duration::from_millis(800);

/// Whether the program was asked to stop.
static STOP_REQUESTED: AtomicBool = AtomicBool::new(false);

/// Whether the time limit has passed.
static LATE: AtomicBool = AtomicBool::new(false);

static STATE: Mutex<InterruptState> =
    Mutex::new(InterruptState { kept: None, finishing: false, passing: Vec::new(), renamed: false });

/// State that is needed to end the program.
struct InterruptState {
    /// Describes which results are on the disk if the program ends now; set by commands that can stop.
    kept: Option<Box<dyn Fn() -> String + Send>>,
    /// Whether the command has stopped and is writing its results.
    finishing: bool,
    /// Temporary files that have not been renamed yet, and new folders that contain no files yet.
    passing: Vec<PathBuf>,
    /// Whether a temporary file may have been renamed, so that outputs of this run are on the disk.
    renamed: bool,
}

/// Installs the handler of signals.
pub(crate) fn install_handler() -> Outcome<()> {
    let mut signals = 0;
    let answer = move || {
        signals += 1;
        STOP_REQUESTED.store(true, Ordering::Relaxed);
        if signals > 1 {
            end_program();
        }
        std::thread::spawn(end_unless_it_stops);
    };
    ctrlc::set_handler(answer)
        .map_err(|error| Failure::Internal(format!("signals cannot be answered: {error}")))
}

/// `Break` after a signal or after the time limit, otherwise `Continue`.
pub(crate) fn control_flow() -> ControlFlow<()> {
    if STOP_REQUESTED.load(Ordering::Relaxed) || LATE.load(Ordering::Relaxed) {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}

/// Starts the time limit; after it the command is asked to stop, as by a signal.
pub(crate) fn set_time_limit(time: Duration) {
    std::thread::spawn(move || {
        std::thread::sleep(time);
        LATE.store(true, Ordering::Relaxed);
        end_unless_it_stops();
    });
}

/// Registers a command that checks [`control_flow`]; `kept` describes which results are on the disk if the
/// command does not stop in time.
pub(crate) fn register_stoppable(kept: impl Fn() -> String + Send + 'static) -> StopGuard {
    lock_state().kept = Some(Box::new(kept));
    StopGuard
}

/// While this value exists, the command counts as one that can stop early.
pub(crate) struct StopGuard;

impl StopGuard {
    /// Announces that the command has stopped. It may then take any time to write its results; only a second
    /// signal ends it.
    pub(crate) fn announce_stop(&self, what: &str) {
        lock_state().finishing = true;
        progress::finish_in_words(); // the message replaces the progress bar
        warn_line!("{}: {what}", why());
    }
}

impl Drop for StopGuard {
    fn drop(&mut self) {
        let mut state = lock_state();
        (state.kept, state.finishing) = (None, false);
    }
}

/// Creates a temporary file, which is removed if the program ends before the file is renamed.
pub(crate) fn track_temporary_file(
    make: impl FnOnce() -> io::Result<NamedTempFile>,
) -> io::Result<NamedTempFile> {
    let mut state = lock_state();
    let file = make()?;
    state.passing.push(file.path().to_owned());
    Ok(file)
}

/// Creates folders, the outermost first, which are removed if the program ends before they contain a file.
pub(crate) fn track_new_folders(
    folders: Vec<PathBuf>,
    make: impl FnOnce() -> io::Result<()>,
) -> io::Result<()> {
    let mut state = lock_state();
    make()?;
    state.passing.extend(folders);
    Ok(())
}

/// While the returned lock is held, the program does not end, so that files are renamed together.
pub(crate) fn lock_renames() -> RenameLock {
    RenameLock(lock_state())
}

pub(crate) struct RenameLock(MutexGuard<'static, InterruptState>);

impl RenameLock {
    /// Call this before the first temporary file is renamed.
    pub(crate) fn expect_outputs(&mut self) {
        self.0.renamed = true;
    }

    /// Call this when every temporary file has been renamed.
    pub(crate) fn forget_temporaries(mut self) {
        self.0.passing.clear();
    }
}

fn lock_state() -> MutexGuard<'static, InterruptState> {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn end_unless_it_stops() {
    if lock_state().kept.is_some() {
        std::thread::sleep(GRACE);
    }
    if !lock_state().finishing {
        end_program();
    }
}

/// Reason why the program ends before its command is done.
fn why() -> &'static str {
    if STOP_REQUESTED.load(Ordering::Relaxed) { "interrupted" } else { "stopped at the time limit" }
}

/// Ends the program. The state is locked, so that nothing is renamed in the meantime.
fn end_program() -> ! {
    let state = lock_state();
    for path in state.passing.iter().rev() {
        // files that cannot be removed are left to the next command; of the folders, only empty ones are
        // removed
        let _ = std::fs::remove_file(path).or_else(|_| std::fs::remove_dir(path));
    }
    let kept = state.kept.as_ref().map_or_else(|| describe_outputs(state.renamed), |kept| kept());
    let reached = progress::finish_in_words().map_or_else(String::new, |reached| format!("{reached}; "));
    warn_line!("{}: {reached}{kept}", why());
    std::process::exit(i32::from(STOPPED_EARLY))
}

/// Describes what is on the disk when a command that cannot stop early is ended.
fn describe_outputs(renamed: bool) -> String {
    let said = if renamed {
        "the files that were complete are written, others are not"
    } else {
        "nothing is written"
    };
    said.to_owned()
}
