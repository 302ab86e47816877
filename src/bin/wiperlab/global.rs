//! What every command takes.

use crate::count::count;
use crate::failure::Failure;
use clap::Args;

#[derive(Debug, Clone, Args)]
pub struct Global {
    /// No progress and no summary; refusals are still shown
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Threads for parallel work (default: every core); results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub threads: Option<usize>,
}

impl Global {
    /// Sets the size of the thread pool before anything runs.
    pub fn use_threads(&self) -> Result<(), Failure> {
        let Some(threads) = self.threads else { return Ok(()) };
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(Failure::internal)
    }
}
