//! The command-line program: parse, run, exit code. Everything that opens files, prints or shows progress is
//! below this module; the Python package reads files by it, too.

#[macro_use]
mod output;
mod accuracy;
mod args;
mod blade;
mod checkpoint;
mod collect;
mod demo;
mod failure;
mod files;
mod fit;
mod help;
mod import;
mod init;
mod inspect;
mod interrupt;
mod load;
mod method;
mod modes;
mod progress;
pub mod read;
mod report;
mod sensitivities;
mod shards;
mod simulate;
mod spectrum;
mod submit;
mod sweep;
mod twin;

use clap::Parser;
use failure::Failure;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::OnceLock;

/// The same as [`run`] in a process that runs something else, such as Python: `path` starts the program.
#[must_use]
pub fn run_embedded(path: PathBuf, arguments: Vec<OsString>) -> u8 {
    set_executable_path(path);
    run(arguments)
}

/// Runs the program with its arguments, its name first, and gives the exit code. It answers signals, and may
/// end the process to do so; a process runs it once.
#[must_use]
pub fn run(arguments: Vec<OsString>) -> u8 {
    let program = match args::CommandLine::try_parse_from(&arguments) {
        Ok(program) => program,
        Err(error) => {
            let code = if error.use_stderr() { failure::BAD_INPUT } else { 0 };
            return output::print_usage(&error, &arguments)
                .map_or_else(|failure| failure.print_message(), |()| code);
        }
    };
    if let Err(failure) = interrupt::install_handler().and_then(|()| program.global.apply_settings()) {
        return failure.print_message();
    }
    let ran = program.command.run(&program.global);
    match ran.and_then(|outcome| output::check_stdout().map(|()| outcome)) {
        Ok(outcome) => outcome.exit_code(),
        Err(failure) => failure.print_message(),
    }
}

// Where the program lies, for jobs that start it again.

/// Its path where the process runs something else.
static EXECUTABLE_PATH: OnceLock<PathBuf> = OnceLock::new();

/// Says where it lies; the first word counts.
pub(crate) fn set_executable_path(path: PathBuf) {
    let _ = EXECUTABLE_PATH.set(path);
}

pub(crate) fn executable_path() -> Result<PathBuf, Failure> {
    let unknown = |error| Failure::Internal(format!("the path of this program is not known: {error}"));
    EXECUTABLE_PATH.get().map_or_else(|| std::env::current_exe().map_err(unknown), |path| Ok(path.clone()))
}
