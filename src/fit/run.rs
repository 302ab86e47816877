//! Fit of features, from the targets to the result.

use super::advice::advise_measurements;
use super::checkpoint::FitHeader;
use super::evaluation::Evaluation;
use super::identifiability::{Identifiability, assess_identifiability};
use super::job::{FitTarget, Job};
use super::journal::{Journal, OnProgress, StopReason};
use super::ledger::Ledger;
use super::misfit::{far_from_priors, unexplained_headline};
use super::model::{Draw, Model, ModelFeatures};
use super::objective::Objective;
use super::result::{
    FeatureResult, FitFindings, FitResult, FitStatus, camera_nuisance_results, predicted_feature_result,
};
use super::search::{SearchOutcome, SearchTermination};
use super::start_transient::start_notes;
use super::target_value::TargetValue;
use super::targets::{measure_targets, split_held_out};
use super::uncertainty::{FeatureWeights, FitUncertainty};
use super::{FitError, search, uncertainty};
use crate::checkpoint::CheckpointSink;
use crate::feature::FeatureValue;
use crate::fit::context::FitContext;
use crate::recording::Recording;
use std::cell::OnceCell;
use std::slice;

/// Warnings about a job before the fit starts, one sentence each.
#[must_use]
pub fn job_warnings(job: &Job) -> Vec<String> {
    if !job.traces.is_empty() {
        return Vec::new(); // a trace fit uses every frame
    }
    uncertainty::count_warning(job.targets.len(), None, job.parameters.len()).into_iter().collect()
}

/// Fits the parameters of a job on features. `measured` has one entry per condition, `None` for a condition
/// without a recording; `model` simulates recordings as a function of the parameters.
///
/// Every new evaluation is written to `sink` as a line and reported to `on_progress`. A new journal starts
/// with a header; nothing is written before the identifiability is assessed. The result depends only on the
/// fingerprint and the evaluation limit of the context, not on the number of threads or on interruptions.
///
/// # Errors
/// [`FitError`]. A search that stops early or does not converge is no error; the status of the
/// result says so.
pub fn fit_features(
    job: &Job,
    measured: &[Option<Recording>],
    model: &dyn Model,
    context: &FitContext,
    sink: &mut dyn CheckpointSink,
    on_progress: &mut OnProgress,
) -> Result<FitResult, FitError> {
    let all = measure_targets(job, measured)?;
    let (aims, targets, held) = split_held_out(job, all);
    let names = job.parameter_names();
    let header = FitHeader {
        seed: job.search.seed,
        unknowns: names.clone(),
        data: targets.iter().map(|target| target.name.clone()).collect(),
        segment_s: Vec::new(),
    };
    let mut journal = Journal::new(context, header, sink, on_progress)?;
    journal.hold_lines();
    let seen = ModelFeatures::for_targets(model, &aims, &targets, job.ensemble.members);
    let objective = Objective::new(job.parameters.clone(), targets, &seen);
    let allowed = context.max_evaluations.unwrap_or(usize::MAX);
    let (rough, local) = (OnceCell::new(), OnceCell::new());
    let mut ledger = Ledger::new(&objective, journal);
    let gate = check_identifiability(&mut ledger, job, model)?;
    ledger.change_objective(rough.get_or_init(|| objective.with_feature_scatter(&gate.scatter)));
    ledger.release_lines()?;
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
    if let Some(found) = &found {
        ledger.check_journal(&objective, &found.best.unit)?;
    }
    let Some(found) = found else { return Err(FitError::NoEvaluation { allowed }) };
    let mut found = add_reservations(found, weighed.as_ref(), &ledger, &searched);
    if found.best.failure.is_none() {
        let conditions: Vec<String> = job.conditions.iter().map(|condition| condition.name.clone()).collect();
        let fitted = (&aims[..], ledger.objective().targets());
        let values = &found.best.values;
        found.notes.extend(measured.iter().flatten().filter_map(Recording::describe_resampling));
        found.notes.extend(start_notes(model, &conditions, fitted, values, job.ensemble.members));
    }
    let far = far_from_priors(&camera_nuisance_results(job, &found.cameras));
    let found = found.with_model_objection((!far.is_empty()).then(|| unexplained_headline(&far)));
    let held_out = predict_held_out(&held, model, &found.best.values);
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

/// Assesses the identifiability of the parameters; the assessment is empty if the evaluations are used up.
fn check_identifiability(
    ledger: &mut Ledger,
    job: &Job,
    model: &dyn Model,
) -> Result<Identifiability, FitError> {
    let Some((gate, nearest)) = assess_identifiability(ledger, &job.parameter_names())? else {
        let scatter = vec![0.0; ledger.objective().targets().len()];
        return Ok(Identifiability { scatter, ..Identifiability::default() });
    };
    Ok(Identifiability { advice: advise_measurements(job, model, &nearest, &gate.combinations), ..gate })
}

/// Adds the reasons for doubt that follow from the misfit at the best point and from the ends of the other
/// local searches.
fn add_reservations(
    mut found: FitUncertainty,
    weighed: Option<&FeatureWeights>,
    ledger: &Ledger,
    searched: &SearchOutcome,
) -> FitUncertainty {
    let Some(weighed) = weighed.filter(|_| found.best.failure.is_none()) else { return found };
    if weighed.inflation > 1.0 {
        found.notes.push(format!(
            "the features are missed by more than their standard deviations allow; all of them were taken {:.2} times as large",
            weighed.inflation
        ));
    }
    // the last descent only polished the best point and does not count as a separate search
    let others = searched.descents.split_last().map_or(&[][..], |(_, others)| others);
    let ends: Vec<Evaluation> = others.iter().map(|descent| descent.end.clone()).collect();
    // for the comparison of optima, the standard deviations of the targets are not inflated by the misfit
    let plain = ledger.objective().with_feature_scatter(&weighed.roughness);
    found.with_search_doubts(searched.termination == SearchTermination::Converged, &plain, &ends)
}

fn fit_status(ledger: &Ledger, best: &Evaluation, ended: &SearchTermination) -> FitStatus {
    match ended {
        _ if best.failure.is_some() => FitStatus::Failed,
        _ if ledger.stop_reason().is_some() => FitStatus::Interrupted,
        SearchTermination::Converged => FitStatus::Converged,
        SearchTermination::Stopped(_) => FitStatus::BudgetExhausted,
    }
}

/// Predictions of the best model for the held-out targets.
pub(super) fn predict_held_out(
    held: &[(FitTarget, TargetValue)],
    model: &dyn Model,
    values: &[f64],
) -> Vec<FeatureResult> {
    let predicted = |(aim, target): &(FitTarget, TargetValue)| {
        let seen = ModelFeatures::new(model, slice::from_ref(&aim.feature), vec![target.value], 1);
        let read = seen.read_features(values, Draw::default()).map_err(|failure| failure.to_string());
        let read = read.and_then(|mut read| match read.pop() {
            Some(Ok(read)) => Ok(read.value),
            Some(Err(missing)) => Err(missing.to_string()),
            None => Err("it was not read".to_owned()),
        });
        predicted_feature_result(aim, target, read)
    };
    held.iter().map(predicted).collect()
}

/// Features of the best model, including the spectral peaks that are not assigned to a component; `None` for
/// a missing feature.
pub(super) fn read_best_model(seen: &ModelFeatures, values: &[f64]) -> Vec<Option<FeatureValue>> {
    let read = seen.read_features(values, Draw::default()).unwrap_or_default();
    read.into_iter().map(Result::ok).collect()
}

/// Number of evaluations for the search: the allowed number minus the number for the sensitivities, or the
/// whole allowed number if it is too small for both.
fn search_allowance(allowed: usize, parameters: usize) -> usize {
    let sensitivities = 2 * parameters;
    if allowed >= 2 * sensitivities { allowed - sensitivities } else { allowed }
}
