//! Runs work without holding the interpreter lock of Python, so that other Python threads continue. Ctrl-C
//! ends the work. After a fork, the new process creates threads of its own.

use crate::errors;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Interval between two checks for signals such as Ctrl-C.
const POLL: Duration = Duration::from_millis(50);

/// The thread pool, with the id of the process that created it. After a fork, the new process has none of
/// these threads.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

fn process_pool() -> Result<Arc<ThreadPool>, String> {
    let mut held = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((owner, pool)) = held.as_ref()
        && *owner == process
    {
        return Ok(Arc::clone(pool));
    }
    let made = Arc::new(build_pool(0)?);
    // the old pool is not dropped, since a forked process cannot end the threads of its parent
    std::mem::forget(held.replace((process, Arc::clone(&made))));
    Ok(made)
}

fn build_pool(threads: usize) -> Result<ThreadPool, String> {
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| error.to_string())
}

/// Runs work that cannot be interrupted, on every core, without the interpreter lock. After Ctrl-C the work
/// continues in the background, and its result is dropped.
pub fn run_detached<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let pool = process_pool().map_err(|error| no_threads_error(py, &error))?;
    let (send, mut receive) = mpsc::channel();
    pool.spawn(move || {
        // sending fails only if the receiver has stopped waiting
        let _ = send.send(catch_unwind(AssertUnwindSafe(work)));
    });
    loop {
        let receive = &mut receive;
        match py.detach(move || receive.recv_timeout(POLL)) {
            Ok(Ok(result)) => return Ok(result),
            Ok(Err(panic)) => return Err(errors::internal_error(py, errors::panic_message(&*panic))),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => return Err(errors::internal_error(py, NO_RESULT)),
        }
    }
}

const NO_RESULT: &str = "a thread ended without a result; please report it";

fn no_threads_error(py: Python<'_>, error: &str) -> PyErr {
    errors::internal_error(py, format!("no threads can be started: {error}"))
}

/// Runs work on `threads` threads (`None`: every core) without the interpreter lock. Ctrl-C sets the flag
/// that is passed to the work.
pub fn run_interruptible<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<T> {
    let pool = threads.map_or_else(process_pool, |threads| build_pool(threads).map(Arc::new));
    let pool = pool.map_err(|error| no_threads_error(py, &error))?;
    let stop = AtomicBool::new(false);
    let (done, changed) = (Mutex::new(None), Condvar::new());
    let mut asked = None;
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let result = catch_unwind(AssertUnwindSafe(|| pool.install(|| work(&stop))));
            *done.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
            changed.notify_one();
        });
        loop {
            let is_done = py.detach(|| {
                let guard = done.lock().unwrap_or_else(PoisonError::into_inner);
                let waited = changed.wait_timeout_while(guard, POLL, |done| done.is_none());
                waited.map_or(true, |(guard, _)| guard.is_some())
            });
            if is_done {
                break;
            }
            if asked.is_none()
                && let Err(signal) = py.check_signals()
            {
                stop.store(true, Ordering::Relaxed);
                asked = Some(signal);
            }
        }
    });
    let done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    match (asked, done) {
        (Some(signal), _) => Err(signal),
        (None, Some(Ok(result))) => Ok(result),
        (None, Some(Err(panic))) => Err(errors::internal_error(py, errors::panic_message(&*panic))),
        (None, None) => Err(errors::internal_error(py, NO_RESULT)),
    }
}
