//! `wiperlab journal`, and journals on disk.

mod backup;
mod drop;
mod export;
mod file;
mod merge;
mod show;
mod verify;
mod work;

pub use file::{JOURNAL, JournalFile};

use crate::program::failure::{Failure, Outcome};
use crate::program::global::Global;
use clap::{Args, Subcommand};

#[derive(Debug, Args)]
pub struct JournalArgs {
    #[command(subcommand)]
    pub command: JournalCommand,
}

#[derive(Debug, Subcommand)]
pub enum JournalCommand {
    /// Put journals of one fit or study together, such as those of several machines or seeds
    ///
    /// Of a fit, the first journal says which seed the merged one belongs to: put the result next to a job
    /// with that seed as journal.jsonl and go on with `wiperlab fit JOB --resume`. Evaluations of other seeds
    /// then count as known: they are not made again, local searches start from the best of them, and the best
    /// point may be one of them.
    Merge(merge::MergeArgs),
    /// Check every line of journals against its checksum
    ///
    /// Ends at the first line that was damaged or edited, names it, and says what to do (exit code 2).
    Verify(verify::VerifyArgs),
    /// Say what a journal holds: header, counts, and single records with names and units
    Show(show::ShowArgs),
    /// Remove damaged lines from a journal
    ///
    /// What is left is numbered anew, and the file as it was is kept as NAME.previous-1.jsonl (the next free
    /// number). `fit --resume` and `sweep --resume` then compute again what was removed.
    Drop(drop::DropArgs),
    /// Write a journal as a table, one row a record
    ExportCsv(export::ExportArgs),
}

impl JournalArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        match &self.command {
            JournalCommand::Merge(args) => args.run(global),
            JournalCommand::Verify(args) => args.run(global),
            JournalCommand::Show(args) => args.run(),
            JournalCommand::Drop(args) => args.run(global),
            JournalCommand::ExportCsv(args) => args.run(global),
        }
    }
}
