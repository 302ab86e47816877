//! `wiperlab sweep`.

mod problem;
mod results;
mod shards;
mod solve;

pub use problem::LoadedStudy;
pub use shards::find_study;

use crate::journal::Shard;
use crate::program::failure::{CommandOutcome, Failure};
use crate::program::files::{self, OutputCommand, Overwrite, WritePolicy};
use crate::program::global::GlobalArgs;
use crate::program::interrupt;
use crate::program::journal::CHECKPOINT_FILE;
use crate::program::time_limit::TimeLimit;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct SweepArgs {
    /// Study to run (sweep.toml): a scene, the parameters that are varied, and what is mapped
    pub sweep: PathBuf,
    /// Folder for sweep.csv, summary.json, one SVG a map, and journal.jsonl, which grows with every point
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
    /// Go on from the journal in DIR; without it a study starts over and the old journal is kept as
    /// journal.previous-1.jsonl (the next free number)
    #[arg(long)]
    pub resume: bool,
    /// Do only every N-th point from point K on (K from 0), into DIR/shards/K-of-N.jsonl; goes on from what
    /// is there, and `wiperlab collect DIR` puts the shards together
    #[arg(long, value_name = "K/N", conflicts_with = "force")]
    pub shard: Option<Shard>,
    /// Stop after this time with what is done (exit code 3); such as 45min, 1h30min or 02:00:00
    #[arg(long, value_name = "TIME")]
    pub time_limit: Option<TimeLimit>,
}

impl SweepArgs {
    pub fn run(&self, global: &GlobalArgs) -> Result<CommandOutcome, Failure> {
        let problem = LoadedStudy::load(&self.sweep)?;
        if let Some(TimeLimit(time)) = self.time_limit {
            interrupt::set_time_limit(time);
        }
        if let Some(shard) = self.shard {
            return problem.solve_shard(&self.sweep, &self.out, shard, global);
        }
        let journal = self.out.join(CHECKPOINT_FILE);
        files::check_path_free(&journal)?;
        let writer =
            WritePolicy::new(OutputCommand::Sweep, self.overwrite).with_csv_dialect(global.csv_dialect);
        problem.check_outputs(&self.out, &writer)?;
        if !problem.solve(&journal, self.resume, global)? {
            return Ok(CommandOutcome::StoppedEarly);
        }
        let mut points = problem.new_collection(&self.out)?;
        problem.add_checkpoint(&mut points, &journal)?;
        problem.write_outputs(&mut points, &self.out, &writer, global)
    }
}
