//! What every command takes.

use crate::program::count::parse_count;
use crate::program::failure::Failure;
use crate::program::files::{CsvDialect, FileSize};
use clap::Args;

#[derive(Debug, Clone, Args)]
pub struct GlobalArgs {
    /// No progress and no summary; refusals are still shown
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Threads for parallel work, at most 1024 (default: every core); results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = parse_threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// Largest file with data that is read, such as 500MB or 4GB; a recording takes up to four times as much
    /// memory
    #[arg(long, global = true, value_name = "SIZE", default_value_t = FileSize::DEFAULT)]
    pub max_file_size: FileSize,
    /// How tables are written, for a spreadsheet; trace.csv is always plain, as programs read it
    #[arg(long, global = true, value_name = "DIALECT", value_enum, default_value_t)]
    pub csv_dialect: CsvDialect,
}

/// Most threads: more than a machine has cores. Each takes megabytes, and a hundred thousand stop a machine.
const MOST_THREADS: usize = 1024;

fn parse_threads(text: &str) -> Result<usize, String> {
    parse_count(text).ok().filter(|threads| *threads <= MOST_THREADS).ok_or_else(|| {
        format!("expected a whole number from 1 to {MOST_THREADS}; leave it out for every core")
    })
}

impl GlobalArgs {
    /// Sets what holds for the whole program, before anything runs.
    pub fn apply_settings(&self) -> Result<(), Failure> {
        self.max_file_size.set_read_limit();
        let Some(threads) = self.threads else { return Ok(()) };
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(Failure::internal)
    }
}
