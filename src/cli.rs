//! The command-line program: parses the arguments, runs a command and returns the exit code. Only this module
//! opens files, prints and shows progress. The Python package reads files through it too.

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
mod job;
mod load;
mod method;
mod modes;
mod prelude;
mod progress;
pub mod read;
mod report;
mod run_observer;
mod sensitivities;
mod shards;
mod simulate;
mod spectrum;
mod stability;
mod submit;
mod sweep;
mod twin;

use args::GlobalArgs;
use clap::{CommandFactory, Parser, Subcommand};
use failure::Outcome;
use std::ffi::OsString;
use std::path::PathBuf;

/// Version and build options of the program.
const LONG_VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\nbuilt for ",
    env!("WIPERLAB_BUILT_FOR"),
    " at optimisation level ",
    env!("WIPERLAB_OPT_LEVEL"),
    "\nwith ",
    env!("WIPERLAB_BUILT_WITH"),
    "\ncommit ",
    env!("WIPERLAB_BUILT_FROM"),
);

/// Holds high-speed-video measurements of a windshield wiper blade against a stick-slip model of it.
#[derive(Debug, Parser)]
#[command(
    version,
    long_version = LONG_VERSION,
    about,
    long_about = None,
    propagate_version = true,
    disable_help_subcommand = true,
    after_help = help::list_help_pages()
)]
pub(crate) struct CommandLine {
    #[command(flatten)]
    pub global: GlobalArgs,
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Bundled recording -> import -> spectrum -> fit -> report
    Demo(demo::DemoArgs),
    /// Read a tracking export into data/NAME
    Import(import::ImportArgs),
    /// Write a first scene and a first job for a recording, with comments
    Init(init::InitArgs),
    /// Describe what a recording contains and what it can show: rates, gaps, noise, doubts
    Inspect(inspect::InspectArgs),
    /// Components of a recording's spectrum
    Spectrum(spectrum::SpectrumArgs),
    /// Run the model of a scene
    Simulate(simulate::SimulateArgs),
    /// Compute a scene's [blade] table from the section of a blade, or check a blade with ruler and scale
    ///
    /// SECTION.toml contains the length of the piece; density, modulus and loss factor of the rubber; heights
    /// and thicknesses of neck and lip; and mass, stiffness and force of the head per metre. Prints the table
    /// with the equation and the uncertainty of each number, as an estimate for the start of a fit. With
    /// --check, prints the natural frequencies, deflections and weights of a scene's blade.
    Blade(blade::BladeArgs),
    /// Natural frequencies and modes of a scene's blade
    Modes(modes::ModesArgs),
    /// Speeds at which steady sliding is unstable, and what changes them
    Stability(stability::StabilityArgs),
    /// Compare speed and error of every integration method on a scene
    Accuracy(accuracy::AccuracyArgs),
    /// A synthetic recording: a scene seen by a camera
    Twin(twin::TwinArgs),
    /// A parameter study: quantities as functions of one or two parameters of a scene
    Sweep(sweep::SweepArgs),
    /// Divide a parameter study, or a list of fits, among the machines of a cluster
    ///
    /// Creates an array of tasks for the scheduler, each of which does one shard, and a final job that puts
    /// the shards together (`wiperlab collect`). All files are checked before anything is submitted. If
    /// something is missing at the end, the final job names it in DIR/shards/logs; submit those --tasks
    /// again.
    Submit(submit::SubmitArgs),
    /// Put the shards of a parameter study together, or see which fits of a list are done
    ///
    /// Writes the files that `wiperlab sweep` writes on one machine, byte for byte. Points that are in
    /// several shards count only once. For a list of fits, lists those that have a result. Exit code 3:
    /// something is missing; the tasks that must be submitted again are named.
    Collect(collect::CollectArgs),
    /// Fit a scene's parameters to recordings or published components
    ///
    /// Every evaluation is written to journal.jsonl next to the job as it is made, and the result to
    /// result.json at the end. A fit that was killed, or whose budgets in [search] have been raised since,
    /// continues with --resume and ends with the result that it would have had in one run. A fit that cannot
    /// determine anything is refused before the search. Exit code 3: the allowed evaluations were used up
    /// before the search had converged, or the model does not explain the recordings.
    Fit(fit::FitArgs),
    /// Figures and page of a fit
    Report(report::ReportArgs),
    /// Print a completion script for a shell
    Completions(help::CompletionsArgs),
    /// The help of every command as manual pages
    Man(help::ManArgs),
    /// The help of a command, or a page about files, windows and features
    Help(help::HelpArgs),
}

impl Command {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        match self {
            Self::Demo(args) => args.run(global),
            Self::Import(args) => args.typed.run(global),
            Self::Init(args) => args.run(global),
            Self::Inspect(args) => args.run(global),
            Self::Spectrum(args) => args.run(global),
            Self::Simulate(args) => args.run(global),
            Self::Blade(args) => args.run(global),
            Self::Modes(args) => args.run(global),
            Self::Stability(args) => args.run(global),
            Self::Accuracy(args) => args.run(global),
            Self::Twin(args) => args.run(global),
            Self::Sweep(args) => args.run(global),
            Self::Submit(args) => args.run(global),
            Self::Collect(args) => args.run(global),
            Self::Fit(args) => args.run(global),
            Self::Report(args) => args.run(global),
            Self::Completions(args) => args.run(&mut CommandLine::command()),
            Self::Man(args) => args.run(&mut CommandLine::command(), global),
            Self::Help(args) => args.run(&mut CommandLine::command()),
        }
    }
}

/// Like [`run`], but for a call from within the process of another program, such as Python. `path` is the
/// executable that is started for further tasks.
#[must_use]
pub fn run_embedded(path: PathBuf, arguments: Vec<OsString>) -> u8 {
    submit::set_executable_path(path);
    run(arguments)
}

/// Runs the program with its arguments, beginning with the name of the program, and returns the exit code. It
/// handles signals and may end the process; a process may call it only once.
#[must_use]
pub fn run(arguments: Vec<OsString>) -> u8 {
    let program = match CommandLine::try_parse_from(&arguments) {
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
