//! The command-line program: parse, run, exit code. Everything that opens files, prints or shows progress is
//! below this folder.
#![allow(missing_docs)] // the library is documented; here the help texts are the documentation

#[macro_use]
mod progress;

mod accuracy;
mod args;
mod count;
mod demo;
mod early_end;
mod failure;
mod files;
mod fit;
mod global;
mod import;
mod inspect;
mod inspection;
mod journal;
mod load;
mod method;
mod modes;
mod problem;
mod report;
mod simulate;
mod spectrum;
mod sweep;
mod twin;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let program = match args::Program::try_parse() {
        Ok(program) => program,
        Err(error) => {
            let wanted_help = !error.use_stderr();
            let _ = error.print(); // nothing can be said when even the message cannot be printed
            return ExitCode::from(if wanted_help { 0 } else { failure::BAD_INPUT });
        }
    };
    if let Err(failure) = program.global.use_threads() {
        return failure.report();
    }
    match program.command.run(&program.global) {
        Ok(outcome) => outcome.exit_code(),
        Err(failure) => failure.report(),
    }
}
