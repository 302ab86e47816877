//! SIGINT, SIGTERM and the time limit. A command that can stop is asked to and finishes with what it has; any
//! other, and one that does not stop in time, ends at once. Either way the program says what was computed and ends with the code of an early stop,
//! and leaves neither half of its files nor a temporary one.

use super::failure::{Failure, Outcome, STOPPED_EARLY};
use super::progress;
use std::io;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tempfile::NamedTempFile;

/// How long a command that can stop may take to do so: with the rest, an answer comes within a second.
const GRACE: Duration = Duration::from_millis(800);

/// Whether the program was asked to stop.
static STOP_REQUESTED: AtomicBool = AtomicBool::new(false);

/// Whether the time that it may take is over.
static LATE: AtomicBool = AtomicBool::new(false);

static STATE: Mutex<InterruptState> =
    Mutex::new(InterruptState { kept: None, finishing: false, passing: Vec::new() });

/// What the end of the program has to know.
struct InterruptState {
    /// What is kept if the program ends now, where the command can stop.
    kept: Option<Box<dyn Fn() -> String + Send>>,
    /// Whether the command has stopped and writes what it has.
    finishing: bool,
    /// Temporary files that have no place yet, and folders made for them.
    passing: Vec<PathBuf>,
}

/// Answers signals from now on.
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

/// Whether a computation goes on.
pub(crate) fn control_flow() -> ControlFlow<()> {
    if STOP_REQUESTED.load(Ordering::Relaxed) || LATE.load(Ordering::Relaxed) {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}

/// From now on the command may take this long; then it is asked to stop as by a signal.
pub(crate) fn set_time_limit(time: Duration) {
    std::thread::spawn(move || {
        std::thread::sleep(time);
        LATE.store(true, Ordering::Relaxed);
        end_unless_it_stops();
    });
}

/// A command that asks [`control_flow`] and stops; `kept` says what is on the disk if it does not in time.
pub(crate) fn register_stoppable(kept: impl Fn() -> String + Send + 'static) -> StopGuard {
    lock_state().kept = Some(Box::new(kept));
    StopGuard
}

/// While it lives, the command stops by itself.
pub(crate) struct StopGuard;

impl StopGuard {
    /// The command has stopped and writes what it has: that takes what it takes, or until a second signal.
    pub(crate) fn announce_stop(&self, what: &str) {
        lock_state().finishing = true;
        progress::finish_in_words(); // the sentence says it better
        warn_line!("{}: {what}", why());
    }
}

impl Drop for StopGuard {
    fn drop(&mut self) {
        let mut state = lock_state();
        (state.kept, state.finishing) = (None, false);
    }
}

/// Makes a temporary file that goes when the program ends before the file has its place.
pub(crate) fn track_temporary_file(
    make: impl FnOnce() -> io::Result<NamedTempFile>,
) -> io::Result<NamedTempFile> {
    let mut state = lock_state();
    let file = make()?;
    state.passing.push(file.path().to_owned());
    Ok(file)
}

/// Makes folders that go when the program ends before there is a file in them; the outermost is first.
pub(crate) fn track_new_folders(
    folders: Vec<PathBuf>,
    make: impl FnOnce() -> io::Result<()>,
) -> io::Result<()> {
    let mut state = lock_state();
    make()?;
    state.passing.extend(folders);
    Ok(())
}

/// The program does not end while this is held: files that belong together get their names together.
pub(crate) fn lock_renames() -> RenameLock {
    RenameLock(lock_state())
}

pub(crate) struct RenameLock(MutexGuard<'static, InterruptState>);

impl RenameLock {
    /// Every temporary file has its place.
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

/// Why the program ends before its command is done.
fn why() -> &'static str {
    if STOP_REQUESTED.load(Ordering::Relaxed) { "interrupted" } else { "stopped at the time limit" }
}

/// Ends the program; the state is held, so that nothing gets a name meanwhile.
fn end_program() -> ! {
    let state = lock_state();
    for path in state.passing.iter().rev() {
        // (the next command clears what is left; of folders only an empty one goes)
        let _ = std::fs::remove_file(path).or_else(|_| std::fs::remove_dir(path));
    }
    let kept = state.kept.as_ref().map_or_else(nothing_saved, |kept| kept());
    let reached = progress::finish_in_words().map_or_else(String::new, |reached| format!("{reached}; "));
    warn_line!("{}: {reached}{kept}", why());
    std::process::exit(i32::from(STOPPED_EARLY))
}

fn nothing_saved() -> String {
    "a file that was not complete is not written".to_owned()
}
