//! Fits several jobs one after the other, or a shard of them; a single fit is never divided.

use super::FitArgs;
use crate::cli::checkpoint::CHECKPOINT_FILE;
use crate::cli::files::RESULT_FILE;
use crate::cli::job::{LoadedJob, job_path};
use crate::cli::prelude::*;
use crate::fit::result::{FitResult, FitStatus};
use std::collections::BTreeMap;

/// State of a job in a list of jobs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BatchJobState {
    /// The job has a result that belongs to the present job and version of the program, and whose search
    /// converged; the value is the outcome of that fit.
    Done(CommandOutcome),
    /// The job has no such result and must be fitted.
    Due,
}

impl BatchJobState {
    pub(crate) fn read(problem: &LoadedJob) -> Self {
        let path = problem.folder.join(RESULT_FILE);
        let name = path.display().to_string();
        let text = path.exists().then(|| files::read_json(&path).ok()).flatten();
        let result = text.and_then(|text| FitResult::parse(&name, &text).ok());
        let (fingerprint, version) = (problem.problem.fingerprint(), env!("CARGO_PKG_VERSION"));
        let done = result.filter(|result| {
            let of = (result.fingerprint.as_str(), result.version.as_str(), result.seed);
            result.status == FitStatus::Converged && of == (fingerprint, version, problem.job().search.seed)
        });
        let ended = |result: FitResult| CommandOutcome::done_if(result.explains_recordings());
        done.map_or(Self::Due, |result| Self::Done(ended(result)))
    }

    pub(crate) fn describe(self) -> &'static str {
        match self {
            Self::Done(CommandOutcome::Done) => "converged",
            Self::Done(CommandOutcome::StoppedEarly) => {
                "converged, and the model does not explain the recording"
            }

            Self::Due => "no result of this job and version, or the search has not converged",
        }
    }
}

/// Refuses a list in which two jobs would write the same files.
pub(crate) fn check_distinct_folders(jobs: &[PathBuf]) -> Outcome<()> {
    let mut folders: BTreeMap<PathBuf, &Path> = BTreeMap::new();
    for job in jobs {
        let file = job_path(job);
        let folder = files::containing_folder(&file);
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        if let Some(other) = folders.insert(folder, job) {
            return Err(Failure::at(
                job.display(),
                format!(
                    "lies in the folder of {}, where both would write {CHECKPOINT_FILE} and {RESULT_FILE}; expected a folder \
                 for each job",
                    other.display()
                ),
            ));
        }
    }
    Ok(())
}

impl FitArgs {
    /// Fits the jobs of the list that belong to the shard and are not yet done. A job that is refused does
    /// not stop the others.
    pub(crate) fn run_batch(&self, global: &GlobalArgs) -> Outcome {
        check_distinct_folders(&self.jobs)?;
        let (mut refused, mut early) = (None, Vec::new());
        let is_mine = |at: usize| self.shard.is_none_or(|of| of.contains(at));
        let mine: Vec<&PathBuf> =
            (0..self.jobs.len()).filter(|at| is_mine(*at)).map(|at| &self.jobs[at]).collect();
        for (at, job) in mine.iter().enumerate() {
            if interrupt::control_flow().is_break() {
                let left = mine.len() - at;
                warn_line!("stopped: {left} of {} jobs were not begun; the same command goes on", mine.len());
                return Ok(CommandOutcome::StoppedEarly);
            }
            if !global.quiet {
                print_line!("{} ({} of {})", job.display(), at + 1, mine.len());
            }
            match self.run_batch_job(job, global) {
                Ok(CommandOutcome::Done) => {}
                Ok(CommandOutcome::StoppedEarly) => early.push(job.display().to_string()),
                Err(failure) => {
                    warn_line!("error: {failure}");
                    refused.get_or_insert(failure);
                }
            }
        }
        if !early.is_empty() && !global.quiet {
            print_line!("not converged, or not explained by the model: {}", early.join(", "));
        }
        match refused {
            Some(Failure::Input(_)) => {
                Err(Failure::input("not every job of the list could be fitted, see above"))
            }
            Some(internal) => Err(internal),
            None => Ok(CommandOutcome::done_if(early.is_empty())),
        }
    }

    fn run_batch_job(&self, job: &Path, global: &GlobalArgs) -> Outcome {
        let problem = LoadedJob::load(job)?;
        if let BatchJobState::Done(ended) = BatchJobState::read(&problem)
            && self.shard.is_some()
        {
            if !global.quiet {
                print_line!("its result is there already");
            }
            return Ok(ended);
        }
        let has_journal = problem.folder.join(CHECKPOINT_FILE).exists();
        let resume = has_journal && (self.resume || self.shard.is_some());
        self.fit_job(&problem, resume, global)
    }
}
