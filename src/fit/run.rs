//! One run of a fit, from the targets to the result.

use super::advice::advise_measurements;
use super::bounds::SearchAxis;
use super::evaluation::Evaluation;
use super::feature_checkpoint::{
    EvaluationRecord, FeatureCheckpoint, FeatureHeader, FeatureHeaderBody, HeaderFeature, HeaderParameter,
};
use super::identifiability::{Identifiability, IdentifiabilityError, assess_identifiability};
use super::job::{FitTarget, FreeParameter, Job};
use super::ledger::{Ledger, OnProgress, StopReason};
use super::misfit::{far_from_priors, unexplained_headline};
use super::model::{Draw, Model, ModelFeatures};
use super::objective::Objective;
use super::result::{FitFindings, FitResult, FitStatus, camera_nuisance_results};
use super::search::{SearchOutcome, SearchTermination};
use super::start_transient::start_notes;
use super::targets::{TargetValue, measure_targets};
use super::uncertainty::{FeatureWeights, FitUncertainty};
use super::{FitError, feature_checkpoint, search, uncertainty};
use crate::checkpoint::{CheckpointSink, format_header_line};
use crate::feature::{Feature, FeatureUnit, FeatureValue};
use crate::model::parameters;
use crate::recording::Recording;
use std::cell::OnceCell;

/// What is wrong with a job before anything runs, in sentences.
#[must_use]
pub fn job_warnings(job: &Job) -> Vec<String> {
    if !job.traces.is_empty() {
        return Vec::new(); // every frame counts
    }
    uncertainty::count_warning(job.targets.len(), None, job.parameters.len()).into_iter().collect()
}

/// Fits the job's parameters: `measured` has a recording for each condition that has one, `model` shows what
/// a camera sees at parameter values.
///
/// Every new evaluation becomes a line in `journal` (the first line is a header unless one is continued;
/// nothing is written before the gate is passed) and is reported to `on_progress`. The result depends on
/// nothing but the context's fingerprint and allowance: not on threads, and not on how often the fit was
/// interrupted and resumed.
///
/// # Errors
/// [`FitError`]; a search that stops early or does not converge is a result and says so.
pub fn fit_features(
    job: &Job,
    measured: &[Option<Recording>],
    model: &dyn Model,
    context: &FitContext,
    journal: &mut dyn CheckpointSink,
    on_progress: &mut OnProgress,
) -> Result<FitResult, FitError> {
    let all = measure_targets(job, measured)?;
    let (fitted, held): (Vec<_>, Vec<_>) =
        job.targets.iter().cloned().zip(all).partition(|(aim, _)| !aim.held_out);
    let (aims, targets): (Vec<FitTarget>, Vec<TargetValue>) = fitted.into_iter().unzip();
    let names = job.parameter_names();
    let header = checkpoint_header(job, &aims, &targets, context);
    context.check_resumable(&header)?;
    let wanted: Vec<Feature> = aims.iter().map(|aim| aim.feature.clone()).collect();
    let seen = ModelFeatures::new(
        model,
        &wanted,
        targets.iter().map(|target| target.value).collect(),
        job.ensemble.members,
    );
    let objective = Objective::new(job.parameters.iter().map(search_axis).collect(), targets, &seen);
    feature_checkpoint::recheck_sample(&objective, context, job.search.seed)?;
    let allowed = context.max_evaluations.unwrap_or(usize::MAX);
    let (rough, local) = (OnceCell::new(), OnceCell::new());
    let mut ledger = Ledger::new(&objective, context.stored_records(), journal, on_progress, allowed);
    ledger.hold_lines();
    let gate = check_identifiability(&mut ledger, job, model)?;
    ledger.change_objective(rough.get_or_init(|| objective.with_feature_scatter(&gate.scatter)));
    ledger
        .release_lines(&context.opening_lines(&header))
        .map_err(|problem| FitError::JournalWrite { problem })?;
    let searched = if ledger.stop_reason().is_some() || ledger.remaining_evaluations() == 0 {
        SearchOutcome { termination: SearchTermination::Stopped(StopReason::Budget), descents: Vec::new() }
    } else {
        search::search_minimum(&mut ledger, names.len(), &job.search, search_allowance(allowed, names.len()))
    };
    ledger.set_limit(allowed);
    let weighed = uncertainty::weigh_features(&mut ledger);
    if let Some(weighed) = &weighed {
        ledger.change_objective(local.get_or_init(|| objective.with_feature_scatter(&weighed.scatter)));
    }
    let found = uncertainty::assess_best(&mut ledger, &names, &job.intervals, job.search.local_evaluations);
    let settled = searched.termination == SearchTermination::Converged;
    let found = found.map(|found| match settled && found.best.failure.is_none() {
        true => uncertainty::confirm_identified(&mut ledger, &names, (&job.search, &job.intervals), found),
        false => found,
    });
    let found = found.map(|found| add_reservations(found, weighed.as_ref(), &ledger, &searched));
    if let Some(StopReason::Journal(problem)) = ledger.stop_reason() {
        return Err(FitError::JournalWrite { problem: problem.clone() });
    }
    let Some(found) = found else { return Err(FitError::NoEvaluation { allowed }) };
    let found = add_start_notes(found, model, job, (&aims, ledger.objective().targets()));
    let far = far_from_priors(&camera_nuisance_results(job, &found.cameras));
    let found = found.with_model_objection((!far.is_empty()).then(|| unexplained_headline(&far)));
    feature_checkpoint::recheck_at(&objective, context, &found.best.unit)?;
    let held_out = predict_held_out(held, model, &found.best.values);
    let status = fit_status(&ledger, &found.best, &searched.termination);
    let synthetic = measured.iter().flatten().any(Recording::is_synthetic);
    let findings = FitFindings {
        job,
        aims: &aims,
        targets: ledger.objective().targets(),
        found: &found,
        searched: &searched,
        gate,
        held_out,
        status,
        synthetic,
        context,
    };
    let best_reads = read_best_model(&seen, &found.best.values);
    Ok(findings.into_result(&ledger, &best_reads))
}

/// What the gate says; nothing was found where the evaluations did not reach.
fn check_identifiability(
    ledger: &mut Ledger,
    job: &Job,
    model: &dyn Model,
) -> Result<Identifiability, FitError> {
    match assess_identifiability(ledger, &job.parameter_names()) {
        Ok((gate, nearest)) => Ok(Identifiability {
            advice: advise_measurements(job, model, &nearest, &gate.combinations),
            ..gate
        }),
        Err(IdentifiabilityError::CannotBeFitted(why)) => Err(FitError::CannotBeFitted { why }),
        Err(IdentifiabilityError::Stopped(_)) => Ok(Identifiability {
            scatter: vec![0.0; ledger.objective().targets().len()],
            ..Identifiability::default()
        }),
    }
}

/// What was found, with the reservations that the weighing and the other local searches bring.
fn add_reservations(
    mut found: FitUncertainty,
    weighed: Option<&FeatureWeights>,
    ledger: &Ledger,
    searched: &SearchOutcome,
) -> FitUncertainty {
    let Some(weighed) = weighed.filter(|_| found.best.failure.is_none()) else { return found };
    if weighed.inflation > 1.0 {
        let note = format!(
            "the features are missed by more than their standard deviations allow; all of them were taken {:.2} times as large",
            weighed.inflation
        );
        found.notes.push(note);
    }
    // the last one polished the best point: it is no other search
    let others = searched.descents.split_last().map_or(&[][..], |(_, others)| others);
    // places are distinguished by the features alone, without deviations that a misfit has widened
    let plain = ledger.objective().with_feature_scatter(&weighed.roughness);
    found.with_search_doubts(
        searched.termination == SearchTermination::Converged,
        &plain,
        &others.iter().map(|descent| descent.end.clone()).collect::<Vec<_>>(),
    )
}

/// What was found, with what the start of the scenes does to it.
fn add_start_notes(
    mut found: FitUncertainty,
    model: &dyn Model,
    job: &Job,
    fitted: (&[FitTarget], &[TargetValue]),
) -> FitUncertainty {
    if found.best.failure.is_none() {
        let names: Vec<String> = job.conditions.iter().map(|condition| condition.name.clone()).collect();
        let said = start_notes(model, &names, fitted, &found.best.values, job.ensemble.members);
        found.notes.extend(said);
    }
    found
}

fn fit_status(ledger: &Ledger, best: &Evaluation, ended: &SearchTermination) -> FitStatus {
    match ended {
        _ if best.failure.is_some() => FitStatus::Failed,
        _ if ledger.stop_reason().is_some() => FitStatus::Interrupted,
        SearchTermination::Converged => FitStatus::Converged,
        SearchTermination::Stopped(_) => FitStatus::BudgetExhausted,
    }
}

/// What the best model shows of the features that were held out.
pub(super) fn predict_held_out(
    held: Vec<(FitTarget, TargetValue)>,
    model: &dyn Model,
    values: &[f64],
) -> Vec<(FitTarget, TargetValue, Result<f64, String>)> {
    let predicted = |(aim, target): (FitTarget, TargetValue)| {
        let seen = ModelFeatures::new(model, std::slice::from_ref(&aim.feature), vec![target.value], 1);
        let read = seen.read_features(values, Draw::default()).map_err(|failure| failure.to_string());
        let read = read.and_then(|mut read| match read.pop() {
            Some(Ok(read)) => Ok(read.value),
            Some(Err(missing)) => Err(missing.to_string()),
            None => Err("it was not read".to_owned()),
        });
        (aim, target, read)
    };
    held.into_iter().map(predicted).collect()
}

/// The features of the best model once more, with the peaks that were not assigned.
pub(super) fn read_best_model(seen: &ModelFeatures, values: &[f64]) -> Vec<Option<FeatureValue>> {
    seen.read_features(values, Draw::default())
        .map_or_else(|_| Vec::new(), |read| read.into_iter().map(Result::ok).collect())
}

/// Evaluations of the search when the sensitivities have to fit into the allowance too; they are left out of
/// a tight one.
fn search_allowance(allowed: usize, parameters: usize) -> usize {
    let sensitivities = 2 * parameters;
    if allowed >= 2 * sensitivities { allowed - sensitivities } else { allowed }
}

fn checkpoint_header(
    job: &Job,
    aims: &[FitTarget],
    targets: &[TargetValue],
    context: &FitContext,
) -> FeatureHeader {
    let parameter = |p: &FreeParameter| HeaderParameter {
        name: p.name.clone(),
        unit: parameters::find_parameter(&p.name)
            .map_or(FeatureUnit::DIMENSIONLESS.name, |known| known.unit)
            .to_owned(),
        axis: search_axis(p),
    };
    let aimed = |(aim, target): (&FitTarget, &TargetValue)| HeaderFeature {
        name: target.name.clone(),
        unit: aim.feature.reading.unit().name.to_owned(),
        target: target.clone(),
    };
    let parameters = job.parameters.iter().map(parameter).collect();
    let features = aims.iter().zip(targets).map(aimed).collect();
    let body = FeatureHeaderBody { seed: job.search.seed, parameters, features };
    FeatureHeader::new::<EvaluationRecord>(context.fingerprint, context.version, body)
}

pub(super) fn search_axis(parameter: &FreeParameter) -> SearchAxis {
    SearchAxis { bounds: parameter.bounds, prior: parameter.prior }
}

// What a fit needs to know besides its job, its recordings and its model.

/// Which run of which problem it is.
#[derive(Debug, Clone, Default)]
pub struct FitContext<'a> {
    /// Fingerprint of the problem, from [`crate::checkpoint::checksum`].
    pub fingerprint: &'a str,
    /// Version of the program.
    pub version: &'a str,
    /// Most evaluations of this run, replayed ones included; `None` for what the job allows.
    pub max_evaluations: Option<usize>,
    /// The journal to be continued, with its file's name for refusals.
    pub resume: Option<(&'a str, &'a FeatureCheckpoint)>,
}

impl<'a> FitContext<'a> {
    /// Evaluations that are known before the first.
    pub(super) fn stored_records(&self) -> &'a [EvaluationRecord] {
        self.resume.map_or(&[][..], |(_, journal)| &journal.records)
    }

    /// What is written before the first new line: the header of a new journal.
    pub(super) fn opening_lines(&self, header: &FeatureHeader) -> String {
        self.resume.map_or_else(|| format_header_line(header), |_| String::new())
    }

    /// Refuses a journal from which a fit with this header cannot go on.
    pub(super) fn check_resumable(&self, expected: &FeatureHeader) -> Result<(), FitError> {
        let Some((file, journal)) = self.resume else { return Ok(()) };
        journal.header.check_matches::<EvaluationRecord>(file, expected)?;
        let (found, expected) = (journal.header.body.seed, expected.body.seed);
        if found == expected {
            return Ok(());
        }
        Err(FitError::OtherSeed { file: file.to_owned(), found, expected })
    }
}
