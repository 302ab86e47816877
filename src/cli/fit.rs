//! `wiperlab fit`.

mod batch;
mod outputs;
mod summary;
mod traces;

use super::args::{TimeLimit, parse_count};
use super::checkpoint::{CHECKPOINT_FILE, CheckpointWriter};
use super::job::LoadedJob;
use super::load::print_warnings;
use super::prelude::*;
use crate::checkpoint::Shard;
use crate::fit::evaluation::EvaluationStage;
use crate::fit::ledger::FitProgress;
use crate::fit::result::{FitResult, FitStatus};
use crate::fit::{FitContext, FitError};
pub(crate) use batch::{BatchJobState, check_distinct_folders};
use indicatif::ProgressBar;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
pub(crate) use summary::print_summary;

#[derive(Debug, Args)]
pub(crate) struct FitArgs {
    /// Job of the fit (fits/NAME/job.toml), or its folder; several are fitted one after the other, each in a
    /// folder of its own
    #[arg(required = true, value_name = "JOB")]
    pub jobs: Vec<PathBuf>,
    /// Go on from the journal next to the job; without this a new one is begun and the old one kept as
    /// journal.previous-1.jsonl (the next free number)
    #[arg(long)]
    pub resume: bool,
    /// Most evaluations of the model, those of the journal included (default: what the job allows); of a fit
    /// to traces most iterates of the search (default: as many as it takes)
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub max_evaluations: Option<usize>,
    /// Of several jobs fit only every N-th from job K on (K from 0); each goes on from its journal, and one
    /// whose result is there is left as it is
    #[arg(long, value_name = "K/N")]
    pub shard: Option<Shard>,
    /// Stop after this time with what is done (exit code 3); such as 45min, 1h30min or 02:00:00
    #[arg(long, value_name = "TIME")]
    pub time_limit: Option<TimeLimit>,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// A result, and what it took.
pub(crate) struct CompletedFit {
    pub result: FitResult,
    /// How much of it was taken from journals.
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
        Ok(solved.print_outcome(problem, global))
    }
}

impl CompletedFit {
    /// Says what was found and where it is.
    pub(crate) fn print_outcome(&self, problem: &LoadedJob, global: &GlobalArgs) -> CommandOutcome {
        if !global.quiet {
            print_summary(self);
        }
        if !global.quiet && self.result.status != FitStatus::Interrupted {
            print_line!("written to {}", problem.folder.join(files::RESULT_FILE).display());
        }
        let done = self.result.status == FitStatus::Converged && self.result.explains_recordings();
        CommandOutcome::done_if(done)
    }
}

impl LoadedJob {
    /// Fits, and writes the journal as it goes and the result at the end.
    pub(crate) fn solve(
        &self,
        global: &GlobalArgs,
        resume: bool,
        max_evaluations: Option<usize>,
        overwrite: Overwrite,
    ) -> Outcome<CompletedFit> {
        if !self.problem.traces().is_empty() {
            return self.solve_traces(global, resume, max_evaluations, overwrite);
        }
        let writer = global.write_policy(OutputCommand::Fit, overwrite);
        self.check_outputs(&writer)?;
        let path = self.folder.join(CHECKPOINT_FILE);
        let name = path.display().to_string();
        let (mut sink, resumed) = CheckpointWriter::open(&path, resume)?;
        let bar = progress::start_bar(
            self.expected_evaluations(max_evaluations) as u64,
            "fit",
            "evaluations",
            global.quiet,
        );
        let mut replayed = 0;
        let journaled = Arc::new(AtomicUsize::new(resumed.as_ref().map_or(0, |found| found.records.len())));
        let kept = self.saved_progress(&name, "evaluations", &journaled);
        let stops = interrupt::register_stoppable(kept.clone());
        let mut on_progress = |now: &FitProgress| {
            update_progress_bar(&bar, now, replayed);
            replayed = now.replayed;
            if now.stage != EvaluationStage::Gate {
                journaled.fetch_max(now.evaluations, Ordering::Relaxed);
            }
            interrupt::control_flow()
        };
        let resume = resumed.as_ref().map(|journal| (name.as_str(), journal));
        let context = FitContext { max_evaluations, resume, ..self.problem.new_context() };
        let clock = Instant::now();
        let fitted = self.problem.fit_with(&context, &mut sink, &mut on_progress);
        let result = fitted.map_err(|error| self.fit_failure(&error))?;
        let wall = clock.elapsed();
        bar.finish_and_clear();
        sink.finish()?;
        if result.status == FitStatus::Interrupted {
            // an earlier result stays: what is new is in the journal, and a resumed fit gives its result
            stops.announce_stop(&kept());
        } else {
            self.write_outputs(&result, &writer)?;
        }
        Ok(CompletedFit { result, replayed, wall })
    }

    /// Why the fit did not run.
    fn fit_failure(&self, error: &FitError) -> Failure {
        match error {
            FitError::JournalWrite { .. } => Failure::Internal(error.to_string()),
            FitError::Journal(_) | FitError::OtherSeed { .. } => Failure::input(error),
            _ => Failure::Input(format!("{}: {error}", self.file)),
        }
    }

    /// What is on the disk when the fit is interrupted.
    fn saved_progress(
        &self,
        journal: &str,
        records: &'static str,
        journaled: &Arc<AtomicUsize>,
    ) -> impl Fn() -> String + Clone + use<> {
        let (journal, job, journaled) = (journal.to_owned(), self.file.clone(), Arc::clone(journaled));
        move || match journaled.load(Ordering::Relaxed) {
            0 => "the search had not begun, and there is no journal of it".to_owned(),
            count => format!("{journal} holds {count} {records}; go on with `wiperlab fit {job} --resume`"),
        }
    }

    /// Evaluations to be expected, for the progress: the budget, and about what gate, profiles and twins
    /// take.
    fn expected_evaluations(&self, max_evaluations: Option<usize>) -> usize {
        let (job, parameters) = (self.job(), self.job().parameters.len());
        let gate = crate::fit::identifiability::PROBE_COUNT * (2 * parameters + 1);
        let profiles = if job.intervals.profile { 60 * parameters } else { 0 };
        let all = gate
            + job.search.global_evaluations
            + job.search.local_evaluations
            + profiles
            + 3 * job.intervals.bootstrap;
        all.min(max_evaluations.unwrap_or(usize::MAX))
    }
}

/// Moves the bar; the time left follows from the evaluations that are made, not from those that were just
/// replayed.
fn update_progress_bar(bar: &ProgressBar, now: &FitProgress, replayed_before: usize) {
    bar.set_length(bar.length().unwrap_or(0).max(now.evaluations as u64));
    bar.set_position(now.evaluations as u64);
    if now.replayed > replayed_before {
        bar.reset_eta();
    }
    bar.set_message(format!("{}, cost {:.4}", now.stage.name(), now.best_cost));
}
