//! `wiperlab fit`.

mod batch;
mod outputs;
mod summary;

use super::args::{TimeLimit, parse_count};
use super::checkpoint::{CHECKPOINT_FILE, CheckpointWriter};
use super::job::LoadedJob;
use super::load::print_warnings;
use super::prelude::*;
use crate::checkpoint::Shard;
use crate::fit::checkpoint::FitCheckpoint;
use crate::fit::journal::FitProgress;
use crate::fit::result::{FitResult, FitStatus};
use crate::fit::{FitContext, FitError};
pub(crate) use batch::{BatchJobState, check_distinct_folders};
use indicatif::ProgressBar;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
pub(crate) use summary::print_summary;

#[derive(Debug, Args)]
pub(crate) struct FitArgs {
    /// Job of the fit (fits/NAME/job.toml), or its folder; several jobs are fitted one after the other, each
    /// in a folder of its own
    #[arg(required = true, value_name = "JOB")]
    pub jobs: Vec<PathBuf>,
    /// Continue from the journal next to the job; without this option, a new journal is begun and the old one
    /// is kept as journal.previous-1.jsonl (the next free number)
    #[arg(long)]
    pub resume: bool,
    /// Maximum number of evaluations of the model, including those in the journal (default: as the job says);
    /// in a fit to traces, maximum number of iterates of the search (default: until it has converged)
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub max_evaluations: Option<usize>,
    /// Of several jobs, fit only every N-th, beginning with job K (counted from 0); each continues from its
    /// journal, and a job that has its result is skipped
    #[arg(long, value_name = "K/N")]
    pub shard: Option<Shard>,
    /// Stop after this time and keep what is done (exit code 3); such as 45min, 1h30min or 02:00:00
    #[arg(long, value_name = "TIME")]
    pub time_limit: Option<TimeLimit>,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// A result, and the work that it took.
pub(crate) struct CompletedFit {
    pub result: FitResult,
    /// Number of evaluations or iterates that were taken from the journal.
    pub replayed: usize,
    pub wall: Duration,
}

impl FitArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        if let Some(TimeLimit(time)) = self.time_limit {
            interrupt::set_time_limit(time);
        }
        match (self.jobs.as_slice(), self.shard) {
            ([job], None) => self.fit_job(&LoadedJob::load(job)?, self.resume, global),
            ([job], Some(_)) => Err(Failure::Input(format!(
                "--shard: found with the one job {}, expected a list of jobs, as a fit takes seconds and is not \
                 divided; leave --shard out, or divide a list of jobs or a study (`wiperlab sweep STUDY --out DIR \
                 --shard K/N`)",
                job.display()
            ))),
            _ => self.run_batch(global),
        }
    }

    fn fit_job(&self, problem: &LoadedJob, resume: bool, global: &GlobalArgs) -> Outcome {
        for warning in crate::fit::job_warnings(problem.job()).iter().filter(|_| !global.quiet) {
            warn_line!("warning: {warning}");
        }
        problem.doubts.iter().for_each(|(scene, findings)| print_warnings(scene, findings, global));
        let solved = problem.solve(global, resume, self.max_evaluations, self.overwrite)?;
        let result = &solved.result;
        if !global.quiet {
            print_summary(&solved);
            if result.status != FitStatus::Interrupted {
                print_line!("written to {}", problem.folder.join(files::RESULT_FILE).display());
            }
        }
        let done = result.status == FitStatus::Converged && result.explains_recordings();
        Ok(CommandOutcome::done_if(done))
    }
}

impl LoadedJob {
    /// Runs the search; meanwhile writes the journal, and at the end the result.
    pub(crate) fn solve(
        &self,
        global: &GlobalArgs,
        resume: bool,
        most: Option<usize>,
        overwrite: Overwrite,
    ) -> Outcome<CompletedFit> {
        let (records, expected) = match self.problem.traces().is_empty() {
            true => ("evaluations", self.expected_evaluations()),
            false => ("iterates", self.expected_iterates()),
        };
        let expected = expected.min(most.unwrap_or(usize::MAX));
        let writer = global.write_policy(OutputCommand::Fit, overwrite);
        self.check_outputs(&writer)?;
        let path = self.folder.join(CHECKPOINT_FILE);
        let name = path.display().to_string();
        let (mut sink, resumed) = CheckpointWriter::open(&path, resume)?;
        let bar = progress::start_bar(expected as u64, "fit", records, global.quiet);
        let found = resumed.as_ref().map_or(0, |found: &FitCheckpoint| found.records.len());
        let journaled = Arc::new(AtomicUsize::new(found));
        let kept = {
            let (journal, job, journaled) = (name.clone(), self.file.clone(), Arc::clone(&journaled));
            move || match journaled.load(Ordering::Relaxed) {
                0 => "the search had not begun, and there is no journal of it".to_owned(),
                count => {
                    format!("{journal} holds {count} {records}; go on with `wiperlab fit {job} --resume`")
                }
            }
        };
        let stops = interrupt::register_stoppable(kept.clone());
        let mut shown = SearchDisplay { bar, replayed: 0, journaled };
        let clock = Instant::now();
        let resume = resumed.as_ref().map(|journal| (name.as_str(), journal));
        let context = FitContext { max_evaluations: most, resume, ..self.problem.new_context() };
        let fitted = self.problem.fit_with(&context, &mut sink, &mut |now: &FitProgress| shown.advance(now));
        let mut result = fitted.map_err(|error| match error {
            FitError::JournalWrite { .. } => Failure::internal(error),
            FitError::Journal(_) | FitError::OtherSeed { .. } => Failure::input(error),
            _ => Failure::at(&self.file, error),
        })?;
        let wall = clock.elapsed();
        shown.bar.finish_and_clear();
        sink.finish()?;
        if result.status == FitStatus::Interrupted {
            // an earlier result file is kept; a resumed fit continues from the journal
            stops.announce_stop(&kept());
        } else {
            self.write_outputs(&mut result, &writer)?;
        }
        Ok(CompletedFit { result, replayed: shown.replayed, wall })
    }

    /// Approximate number of evaluations of the model: the budget of the search, plus those for the
    /// identifiability check before it (the gate), the profile likelihoods and the twins (bootstrap).
    fn expected_evaluations(&self) -> usize {
        let (job, parameters) = (self.job(), self.job().parameters.len());
        let gate = crate::fit::identifiability::PROBE_COUNT * (2 * parameters + 1);
        let profiles = if job.intervals.profile { 60 * parameters } else { 0 };
        let budget = job.search.global_evaluations + job.search.local_evaluations;
        gate + budget + profiles + 3 * job.intervals.bootstrap
    }

    /// Approximate number of iterates of a fit to traces.
    fn expected_iterates(&self) -> usize {
        let search = STARTS * self.problem.segment_s().len() * ITERATES_A_STAGE;
        let (twins, parameters) = (self.job().intervals.bootstrap, self.job().parameters.len());
        search + ITERATES_A_TWIN * twins + 2 * ITERATES_A_SIDE * parameters
    }
}

/// Approximate number of iterates in a stage of a fit to traces, from the recovery study. It serves to
/// estimate the remaining time.
const ITERATES_A_STAGE: usize = 14;
/// Number of starts of the search that most fits need: the results of two starts must agree.
const STARTS: usize = 2;
/// Approximate number of iterates of the fit to one twin (bootstrap data set).
const ITERATES_A_TWIN: usize = 5;
/// Approximate number of iterates for one side of the profile of a parameter.
const ITERATES_A_SIDE: usize = 2;

/// The progress bar of a search, and the number of records in its journal.
struct SearchDisplay {
    bar: ProgressBar,
    replayed: usize,
    journaled: Arc<AtomicUsize>,
}

impl SearchDisplay {
    /// Moves the bar. The remaining time is estimated only from evaluations that were computed, not from
    /// those that were read from the journal.
    fn advance(&mut self, now: &FitProgress) -> ControlFlow<()> {
        self.bar.set_length(self.bar.length().unwrap_or(0).max(now.evaluations as u64));
        self.bar.set_position(now.evaluations as u64);
        if now.replayed > self.replayed {
            self.bar.reset_eta();
        }
        self.bar.set_message(now.activity.clone());
        self.replayed = now.replayed;
        self.journaled.fetch_max(now.journaled, Ordering::Relaxed);
        interrupt::control_flow()
    }
}
