//! The program `wiperlab`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(wiperlab::cli::run(std::env::args_os().collect()))
}
