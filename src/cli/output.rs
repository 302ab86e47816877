//! Everything that the program prints passes through one filter here, so that no text from a file or from the
//! command line can control the terminal. A failure of standard output is reported at the end; a closed pipe
//! (`| head`) is not a failure.

use super::failure::{Failure, Outcome};
use crate::text::escape_controls;
use std::ffi::OsString;
use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};
use std::sync::{Mutex, PoisonError};

/// Prints one line of results to standard output.
macro_rules! print_line {
    ($($words:tt)*) => {
        $crate::cli::output::write_stdout(&$crate::cli::output::escape_line(format_args!($($words)*)))
    };
}

/// Prints one line of a message to standard error.
macro_rules! warn_line {
    ($($words:tt)*) => {
        $crate::cli::output::write_stderr(&$crate::cli::output::escape_line(format_args!($($words)*)))
    };
}

/// The first failure of standard output; after it, nothing more is written there.
static STDOUT_FAILURE: Mutex<Option<io::Error>> = Mutex::new(None);

/// A text as one line with its line end; control characters within it, such as line ends, are escaped.
pub(crate) fn escape_line(words: Arguments<'_>) -> String {
    escape_controls(&words.to_string()) + "\n"
}

/// Lines with their line ends, such as a table or JSON; control characters within them are escaped.
pub(crate) fn escape_lines(text: &str) -> String {
    text.lines().map(|line| escape_controls(line) + "\n").collect()
}

/// Writes filtered text to standard output.
pub(crate) fn write_stdout(text: &str) {
    let mut failed = STDOUT_FAILURE.lock().unwrap_or_else(PoisonError::into_inner);
    if failed.is_none() {
        let mut output = io::stdout().lock();
        *failed = output.write_all(text.as_bytes()).and_then(|()| output.flush()).err();
    }
}

/// Prints lines to standard output.
pub(crate) fn print_lines(text: &str) {
    write_stdout(&escape_lines(text));
}

/// Writes filtered text to standard error.
pub(crate) fn write_stderr(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes()); // a failure here cannot be reported anywhere
}

/// Fails if something could not be written to standard output.
pub(crate) fn check_stdout() -> Outcome<()> {
    let failed = STDOUT_FAILURE.lock().unwrap_or_else(PoisonError::into_inner);
    match failed.as_ref() {
        Some(error) if error.kind() != ErrorKind::BrokenPipe => Err(stdout_failure(error)),
        _ => Ok(()),
    }
}

/// Prints help from clap to standard output. Refusals, which repeat what the user typed, go to standard
/// error.
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
