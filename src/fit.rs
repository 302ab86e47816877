//! Fitting a scene's parameters to recordings or to published components.
//!
//! A [`job::Job`] names free parameters, their bounds and what has to be met: components (frequencies) and other features.
//! Targets are measured on the recordings, or given. A swarm and then simplices search the unit box for the lowest cost;
//! every evaluation goes into a journal from which the same fit can be replayed and continued; at the best point
//! sensitivities say which parameters the features identify.

pub mod descent;
pub mod features;
pub mod job;
pub mod journal;
pub mod ledger;
pub mod objective;
pub mod result;
pub mod scale;
pub mod scene_model;
pub mod search;
pub mod uncertainty;

use crate::recording::Recording;
use features::{Reckoned, Seen, read_all};
use job::{Aim, Job, Source};
use journal::{Header, JOURNAL_FORMAT, Journal, JournalError, Sink};
use ledger::{Ledger, Stop, Watch};
use objective::{Evaluation, Model, Objective, Observed, Target};
use result::{ComponentResult, Evaluations, FeatureResult, FitResult, ParameterResult, Status};
use search::Ended;
use uncertainty::Uncertainty;

/// Why a fit did not run, or could not go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The job wants another number of recordings.
    #[error("found {found} recordings, expected the {expected} of the job")]
    Recordings {
        /// Recordings given.
        found: usize,
        /// Recordings in the job.
        expected: usize,
    },
    /// A recording does not show what the job wants to fit.
    #[error("{recording}: `{name}` cannot be measured: {problem}; choose another window or band, give its target in the job, or remove it from the job")]
    NotMeasurable {
        /// Name of the recording.
        recording: String,
        /// Name of the component or feature.
        name: String,
        /// Why.
        problem: String,
    },
    /// The journal does not belong to this fit.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The journal cannot be written.
    #[error("the journal cannot be written: {problem}")]
    JournalWrite {
        /// Why.
        problem: String,
    },
    /// No evaluation was allowed.
    #[error("found an allowance of {allowed} evaluations, expected at least 1; raise --max-evaluations")]
    NoEvaluation {
        /// Evaluations allowed.
        allowed: usize,
    },
}

/// What the program knows and the library does not.
#[derive(Debug, Clone)]
pub struct Context<'a> {
    /// From [`journal::fingerprint`].
    pub fingerprint: &'a str,
    /// Version of the program.
    pub version: &'a str,
    /// Most evaluations of this run, replayed ones included; `None` for what the job allows.
    pub max_evaluations: Option<usize>,
    /// The journal to be continued, with its file's name for refusals.
    pub resume: Option<(&'a str, &'a Journal)>,
}

/// What is wrong with a job before anything runs, in sentences.
#[must_use]
pub fn warnings(job: &Job) -> Vec<String> {
    uncertainty::count_warning(job.aims.len(), None, job.parameters.len()).into_iter().collect()
}

/// Targets of a job in its order, measured on `measured` (one recording for each of the job's) where they are not given.
///
/// # Errors
/// [`FitError::Recordings`], or [`FitError::NotMeasurable`] naming the recording and the feature.
pub fn targets(job: &Job, measured: &[Recording]) -> Result<Vec<Target>, FitError> {
    let expected = job.recordings().count();
    if measured.len() != expected {
        return Err(FitError::Recordings { found: measured.len(), expected });
    }
    let read = read_all(&job.features(), measured);
    let target = |(aim, read): (&Aim, Result<Reckoned, features::Missing>)| match aim.source {
        Source::Given { target, sd } => Ok(Target { name: aim.feature.name.clone(), value: target, sd }),
        Source::Measured { least_sd, least_sd_relative } => {
            let read = read.map_err(|missing| missing.to_string());
            let read = read.and_then(|read| if read.value == 0.0 || !read.value.is_finite() { Err(format!("its value is {}", read.value)) } else { Ok(read) });
            let read = read.map_err(|problem| not_measurable(aim, measured, problem))?;
            let sd = [least_sd, least_sd_relative * read.value.abs()].into_iter().fold(read.sd.filter(|sd| sd.is_finite()).unwrap_or(0.0), f64::max);
            Ok(Target { name: aim.feature.name.clone(), value: read.value, sd })
        }
    };
    job.aims.iter().zip(read).map(target).collect()
}

/// Fits the job's parameters: `measured` are its recordings, `model` shows what a camera sees at parameter values.
///
/// Every new evaluation becomes a line in `journal` (the first line is a header unless one is continued) and is told to
/// `watch`. The result depends on nothing but the context's fingerprint and allowance: not on threads, and not on how often
/// the fit was interrupted and resumed.
///
/// # Errors
/// [`FitError`]; a search that stops early or does not converge is a result and says so.
pub fn fit(job: &Job, measured: &[Recording], model: &dyn Model, context: &Context, journal: &mut dyn Sink, watch: &mut Watch) -> Result<FitResult, FitError> {
    let targets = targets(job, measured)?;
    let (names, features) = (job.parameter_names(), job.features());
    start_journal(&names, &targets, context, journal)?;
    let seen = Seen { model, features: &features };
    let objective = Objective::new(job.parameters.iter().map(|p| p.bounds).collect(), targets, &seen);
    let allowed = context.max_evaluations.unwrap_or(usize::MAX);
    let journaled = context.resume.map_or(&[][..], |(_, journal)| &journal.entries);
    let mut ledger = Ledger::new(&objective, journaled, journal, watch, allowed);
    let ended = search::search(&mut ledger, names.len(), &job.search, search_allowance(allowed, names.len()));
    ledger.set_limit(allowed);
    let found = uncertainty::at_best(&mut ledger, &objective, &names);
    if let Some(Stop::Journal(problem)) = ledger.stopped() {
        return Err(FitError::JournalWrite { problem: problem.clone() });
    }
    let (Some(best), Some(found)) = (ledger.best(), found) else { return Err(FitError::NoEvaluation { allowed }) };
    let status = match &ended {
        _ if best.failure.is_some() => Status::Failed,
        _ if ledger.stopped().is_some() => Status::Interrupted,
        Ended::Converged => Status::Converged,
        Ended::Stopped(_) => Status::BudgetExhausted,
    };
    let evaluations = Evaluations { total: ledger.run().len(), failed: ledger.failures() };
    let synthetic = measured.iter().any(Recording::is_synthetic);
    Ok(Findings { job, objective: &objective, best, found, status, evaluations, synthetic, context }.into_result())
}

/// Evaluations of the search when the sensitivities have to fit into the allowance too; they are left out of a tight one.
fn search_allowance(allowed: usize, parameters: usize) -> usize {
    let sensitivities = 2 * parameters;
    if allowed >= 2 * sensitivities { allowed - sensitivities } else { allowed }
}

fn not_measurable(aim: &Aim, measured: &[Recording], problem: String) -> FitError {
    let recording = measured.get(aim.feature.condition).map_or("the recording", Recording::name).to_owned();
    FitError::NotMeasurable { recording, name: aim.feature.name.clone(), problem }
}

/// Writes the header of a new journal, or checks the one that is continued.
fn start_journal(names: &[String], targets: &[Target], context: &Context, sink: &mut dyn Sink) -> Result<(), FitError> {
    let features = targets.iter().map(|t| t.name.clone()).collect();
    let (fingerprint, version) = (context.fingerprint.to_owned(), context.version.to_owned());
    let header = Header { journal: JOURNAL_FORMAT, fingerprint, version, parameters: names.to_vec(), features };
    let Some((file, journal)) = context.resume else {
        return sink.append(&journal::header_line(&header)).map_err(|problem| FitError::JournalWrite { problem });
    };
    journal::check_fingerprint(file, journal, context.fingerprint)?;
    if journal.header == header {
        return Ok(());
    }
    let problem = "the header names other parameters, features or versions than the job".to_owned();
    Err(JournalError::Line { file: file.to_owned(), line: 1, problem }.into())
}

/// Everything that goes into a result.
struct Findings<'a> {
    job: &'a Job,
    objective: &'a Objective<'a>,
    best: &'a Evaluation,
    found: Uncertainty,
    status: Status,
    evaluations: Evaluations,
    synthetic: bool,
    context: &'a Context<'a>,
}

impl Findings<'_> {
    fn into_result(self) -> FitResult {
        let names = self.job.parameter_names();
        let parameters =
            self.found.intervals.iter().map(|i| ParameterResult { estimate: i.estimate, lower_95: i.lower_95, upper_95: i.upper_95, verdict: i.verdict });
        let targets = self.objective.targets();
        let sensitivities =
            targets.iter().zip(&self.found.sensitivities).map(|(t, row)| (t.name.clone(), names.iter().cloned().zip(row.iter().copied()).collect()));
        let mut notes = self.found.notes.clone();
        if self.synthetic {
            notes.push("the recording is synthetic: no camera took it".to_owned());
        }
        FitResult {
            title: self.job.title.clone(),
            status: self.status,
            parameters: names.iter().cloned().zip(parameters).collect(),
            components: self.components(),
            features: self.features(),
            rank: self.found.rank,
            cost: self.best.cost,
            sensitivities: sensitivities.collect(),
            evaluations: self.evaluations.clone(),
            synthetic: self.synthetic,
            notes,
            wall_s: None,
            seed: self.job.search.seed,
            fingerprint: self.context.fingerprint.to_owned(),
            version: self.context.version.to_owned(),
        }
    }

    /// Every aim with its target, the model's value and why there is none.
    fn met(&self) -> impl Iterator<Item = (&Aim, &Target, Option<f64>, Option<String>)> {
        let why = |at: usize| match (self.best.features.get(at), &self.best.failure) {
            (Some(Observed::Missing(why)), _) => Some(why.clone()),
            (Some(Observed::Value(_)), _) => None,
            (None, failure) => failure.as_ref().map(ToString::to_string),
        };
        let value = |at: usize| self.best.features.get(at).and_then(Observed::value);
        self.job.aims.iter().zip(self.objective.targets()).enumerate().map(move |(at, (aim, target))| (aim, target, value(at), why(at)))
    }

    fn components(&self) -> Vec<ComponentResult> {
        let component = |(aim, target, model, missing): (&Aim, &Target, Option<f64>, Option<String>)| {
            let tolerance_relative = aim.tolerance_relative?;
            let relative_error = model.map(|model| model / target.value - 1.0);
            let pass = relative_error.is_some_and(|error| error.abs() <= tolerance_relative);
            let (name, target_hz, target_sd_hz) = (target.name.clone(), target.value, target.sd);
            Some(ComponentResult { name, target_hz, target_sd_hz, model_hz: model, relative_error, tolerance_relative, pass, missing })
        };
        self.met().filter_map(component).collect()
    }

    fn features(&self) -> Vec<FeatureResult> {
        let feature = |(aim, target, model, missing): (&Aim, &Target, Option<f64>, Option<String>)| FeatureResult {
            name: target.name.clone(),
            kind: aim.feature.reading.kind().to_owned(),
            unit: aim.feature.reading.unit().to_owned(),
            target: target.value,
            target_sd: target.sd,
            model,
            relative_error: model.map(|model| model / target.value - 1.0),
            pass: model.is_some_and(|model| (model - target.value).abs() <= uncertainty::Z_95 * target.sd),
            missing,
        };
        self.met().filter(|(aim, ..)| aim.tolerance_relative.is_none()).map(feature).collect()
    }
}
