//! Everything that the program says. Nothing from a file or the command line steers a terminal: it all passes
//! one filter here. A standard output that fails is reported at the end; one that nobody reads any more
//! (`| head`) is no failure.

use super::failure::{Failure, Outcome};
use crate::text::escape_controls;
use std::ffi::OsString;
use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};
use std::sync::{Mutex, PoisonError};

/// One line of results to standard output.
macro_rules! print_line {
    ($($words:tt)*) => {
        $crate::cli::output::write_stdout(&$crate::cli::output::escape_line(format_args!($($words)*)))
    };
}

/// One line of a message to standard error.
macro_rules! warn_line {
    ($($words:tt)*) => {
        $crate::cli::output::write_stderr(&$crate::cli::output::escape_line(format_args!($($words)*)))
    };
}

/// The first failure of standard output, after which nothing more is written to it.
static STDOUT_FAILURE: Mutex<Option<io::Error>> = Mutex::new(None);

/// A line of text with its end; ends within it are escaped like everything else that steers.
pub(crate) fn escape_line(words: Arguments<'_>) -> String {
    escape_controls(&words.to_string()) + "\n"
}

/// Lines that the program itself has broken, such as those of a table or of JSON.
pub(crate) fn escape_lines(text: &str) -> String {
    text.lines().map(|line| escape_controls(line) + "\n").collect()
}

/// Text that has passed the filter to standard output.
pub(crate) fn write_stdout(text: &str) {
    let mut failed = STDOUT_FAILURE.lock().unwrap_or_else(PoisonError::into_inner);
    if failed.is_none() {
        let mut output = io::stdout().lock();
        *failed = output.write_all(text.as_bytes()).and_then(|()| output.flush()).err();
    }
}

/// Lines to standard output.
pub(crate) fn print_lines(text: &str) {
    write_stdout(&escape_lines(text));
}

/// Text that has passed the filter to standard error.
pub(crate) fn write_stderr(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes()); // (there is no place left to say so)
}

/// Whether everything that was said was written.
pub(crate) fn check_stdout() -> Outcome<()> {
    let failed = STDOUT_FAILURE.lock().unwrap_or_else(PoisonError::into_inner);
    match failed.as_ref() {
        Some(error) if error.kind() != ErrorKind::BrokenPipe => Err(stdout_failure(error)),
        _ => Ok(()),
    }
}

/// What clap says: help to standard output, a refusal to standard error. A refusal repeats what was typed.
pub(crate) fn print_usage(error: &clap::Error, arguments: &[OsString]) -> Outcome<()> {
    let typed = arguments.iter().any(|word| {
        let word = word.to_string_lossy();
        escape_controls(&word) != word
    });
    if typed {
        let text = escape_lines(&error.render().to_string());
        if error.use_stderr() {
            write_stderr(&text)
        } else {
            write_stdout(&text)
        }
        return check_stdout();
    }
    match error.print().and_then(|()| io::stdout().flush()) {
        Err(failed) if !error.use_stderr() && failed.kind() != ErrorKind::BrokenPipe => {
            Err(stdout_failure(&failed))
        }
        _ => Ok(()),
    }
}

fn stdout_failure(error: &io::Error) -> Failure {
    Failure::Internal(format!(
        "standard output: cannot be written: {error}; what was printed is not complete"
    ))
}
