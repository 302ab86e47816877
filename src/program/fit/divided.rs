//! One fit to traces, divided: chains of iterates in shards, and the result from all of them.

use super::traces::Run;
use super::{FitArgs, Solved};
use crate::fit::iterates::{Header, Journal, Step};
use crate::fit::result::Status;
use crate::fit::trace_ledger::Division;
use crate::fit::{Left, Ran};
use crate::program::failure::{Failure, Outcome};
use crate::program::files::{self, Maker, Overwrite, Writer};
use crate::program::global::Global;
use crate::program::journal::{JOURNAL, JournalFile};
use crate::program::problem::Problem;
use crate::program::shards::{SHARDS, journal_of, look_into, shard_files};
use crate::program::submit::Tasks;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::journal::{Shard, Sink, merge, read};

/// What collecting the shards of a fit came to.
pub enum Collected {
    /// The result, which was written.
    Solved(Box<Solved>),
    /// Tasks that have to run again, of so many, and why.
    Missing(Tasks, String),
}

impl FitArgs {
    /// A shard of the only job; a fit to features is one search, which the first shard makes whole.
    pub fn shard_of(&self, job: &Path, shard: Shard, global: &Global) -> Result<Outcome, Failure> {
        let problem = Problem::load(job)?;
        if problem.problem.traces().is_empty() {
            return self.run_batch(global);
        }
        if self.max_evaluations.is_some() {
            let why = "a divided fit has no common count of iterates";
            return Err(Failure::Input(format!(
                "--max-evaluations: found with --shard, expected without, as {why}; use --time-limit"
            )));
        }
        problem.solve_shard(shard, global)
    }
}

impl Problem {
    fn solve_shard(&self, shard: Shard, global: &Global) -> Result<Outcome, Failure> {
        let journal = journal_of(&self.folder, shard);
        files::check_free(&journal)?;
        let mut others =
            Others { folder: self.folder.clone(), own: journal.clone(), lengths: HashMap::new() };
        let header = self.trace_header()?;
        let first = others.look(&header)?;
        let mut first = Some(first);
        // (what is refused was refused at the first look)
        let mut look = || first.take().unwrap_or_else(|| others.look(&header).unwrap_or_default());
        let (mut sink, resumed) = JournalFile::open::<Step>(&journal, journal.exists())?;
        let run = Run {
            division: Division::Shard(shard, &mut look),
            journal: (&journal.to_string_lossy(), resumed.as_ref()),
            most: None,
            advice: "the same command goes on".to_owned(),
            reports: true,
        };
        let (ran, _) = self.run_traces(run, &mut sink, global)?;
        sink.finish()?;
        match ran {
            Ran::Whole(_) => Ok(Outcome::StoppedEarly),
            Ran::Left(_) => {
                if !global.quiet {
                    print_line!("shard {shard}: its chains are done, see {}", journal.display());
                    print_line!("when every shard is: wiperlab collect {}", self.file);
                }
                Ok(Outcome::Done)
            }
        }
    }

    /// Whether the fit was divided.
    pub fn is_divided(&self) -> Result<bool, Failure> {
        Ok(!self.problem.traces().is_empty() && !shard_files(&self.folder)?.is_empty())
    }

    /// The result from all shards, with the journal that one machine would have written.
    pub fn collect(&self, of: usize, overwrite: Overwrite, global: &Global) -> Result<Collected, Failure> {
        let writer = Writer::new(Maker::Fit, overwrite).csv(global.csv_dialect);
        self.check_place(&writer)?;
        let header = self.trace_header()?;
        let shards = self.shards(&header)?;
        let named: Vec<(&str, &Journal)> =
            shards.iter().map(|(name, journal)| (name.as_str(), journal)).collect();
        merge(&named).map_err(Failure::input)?;
        // (written as a whole at the end: what is incomplete leaves no journal behind)
        let (journal, mut text) = (self.folder.join(JOURNAL), String::new());
        let run = Run {
            division: Division::Collected(&named),
            journal: (&journal.to_string_lossy(), None),
            most: None,
            advice: "the same command goes on".to_owned(),
            reports: false,
        };
        let clock = Instant::now();
        match self.run_traces(run, &mut text, global)? {
            (Ran::Whole(result), replayed) => {
                if result.status != Status::Interrupted {
                    keep(&journal, &text)?;
                    self.write(&result, &writer)?;
                }
                let wall = clock.elapsed();
                Ok(Collected::Solved(Box::new(Solved { result: *result, replayed, wall })))
            }
            (Ran::Left(Left::Start), _) => {
                Ok(Collected::Missing((0..of).collect(), "the search itself".to_owned()))
            }
            (Ran::Left(Left::Branches(chains)), _) => {
                let tasks = chains.iter().map(|chain| chain % of).collect();
                Ok(Collected::Missing(tasks, format!("{} chains behind the search", chains.len())))
            }
        }
    }

    fn shards(&self, header: &Header) -> Result<Vec<(String, Journal)>, Failure> {
        let mut journals = Vec::new();
        for (_, path) in shard_files(&self.folder)? {
            let name = path.display().to_string();
            let found: Option<Journal> = read(&name, files::read(&path)?).map_err(Failure::input)?;
            let Some(journal) = found else {
                warn_line!("warning: {name}: holds no complete line");
                continue;
            };
            journal.check_problem(&name, header).map_err(Failure::input)?;
            if journal.torn {
                warn_line!("warning: {name}: the last line is incomplete and left out");
            }
            journals.push((name, journal));
        }
        if journals.is_empty() {
            let folder = self.folder.join(SHARDS);
            return Err(Failure::Input(format!(
                "{}: found no shard with a complete line, expected those of `wiperlab fit {} --shard K/N`",
                folder.display(),
                self.file
            )));
        }
        Ok(journals)
    }

    fn trace_header(&self) -> Result<Header, Failure> {
        self.problem.trace_header().map_err(|error| Failure::Input(format!("{}: {error}", self.file)))
    }
}

/// Writes a journal, unless it is there already; another one is kept as when a fit begins anew.
fn keep(path: &Path, text: &str) -> Result<(), Failure> {
    let (mut sink, _) = JournalFile::open::<Step>(path, false)?;
    if std::fs::read_to_string(path).is_ok_and(|found| found == text) {
        return Ok(());
    }
    sink.append(text).map_err(Failure::Internal)?;
    sink.finish()
}

/// Journals of other shards, which may grow.
struct Others {
    folder: PathBuf,
    own: PathBuf,
    /// How long each was when it was read.
    lengths: HashMap<PathBuf, u64>,
}

impl Others {
    /// Iterates of the journals that have grown.
    fn look(&mut self, header: &Header) -> Result<Vec<Step>, Failure> {
        let mut steps = Vec::new();
        for (_, path) in shard_files(&self.folder)?.into_iter().filter(|(_, path)| *path != self.own) {
            let length = std::fs::metadata(&path).map_or(0, |found| found.len());
            if self.lengths.insert(path.clone(), length) != Some(length) {
                look_into::<Step>(&path, header, true, |found| steps.push(found.record))?;
            }
        }
        Ok(steps)
    }
}
