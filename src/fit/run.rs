//! One run of a fit, from the targets to the result.

use super::advice::advice;
use super::axis::Axis;
use super::context::Context;
use super::error::FitError;
use super::evaluation::Evaluation;
use super::gate::{Gate, GateError, gate};
use super::job::{Aim, FreeParameter, Job};
use super::journal::{Aimed, Body, Entry, Header, Parameter};
use super::ledger::{Ledger, OnProgress, Stop};
use super::misfit::{far_from_priors, unexplained};
use super::model::{Draw, Model};
use super::model_features::ModelFeatures;
use super::objective::Objective;
use super::recheck;
use super::result::{Findings, FitResult, Status, camera_nuisances};
use super::search::{self, Ended, Searched};
use super::settled::start_notes;
use super::target::Target;
use super::targets::targets;
use super::uncertainty::{self, Uncertainty, Weighed};
use crate::blade::parameters;
use crate::feature::{Feature, Unit, Value};
use crate::journal::Sink;
use crate::recording::Recording;
use std::cell::OnceCell;

/// What is wrong with a job before anything runs, in sentences.
#[must_use]
pub fn warnings(job: &Job) -> Vec<String> {
    if !job.traces.is_empty() {
        return Vec::new(); // every frame counts
    }
    uncertainty::count_warning(job.aims.len(), None, job.parameters.len()).into_iter().collect()
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
pub fn fit(
    job: &Job,
    measured: &[Option<Recording>],
    model: &dyn Model,
    context: &Context,
    journal: &mut dyn Sink,
    on_progress: &mut OnProgress,
) -> Result<FitResult, FitError> {
    let all = targets(job, measured)?;
    let (fitted, held): (Vec<_>, Vec<_>) =
        job.aims.iter().cloned().zip(all).partition(|(aim, _)| !aim.held_out);
    let (aims, targets): (Vec<Aim>, Vec<Target>) = fitted.into_iter().unzip();
    let names = job.parameter_names();
    let header = header(job, &aims, &targets, context);
    context.check_resumable(&header)?;
    let wanted: Vec<Feature> = aims.iter().map(|aim| aim.feature.clone()).collect();
    let seen = ModelFeatures::new(
        model,
        &wanted,
        targets.iter().map(|target| target.value).collect(),
        job.ensemble.members,
    );
    let objective = Objective::new(job.parameters.iter().map(axis).collect(), targets, &seen);
    recheck::some(&objective, context, job.search.seed)?;
    let allowed = context.max_evaluations.unwrap_or(usize::MAX);
    let (rough, local) = (OnceCell::new(), OnceCell::new());
    let mut ledger = Ledger::new(&objective, context.journaled(), journal, on_progress, allowed);
    ledger.hold();
    let gate = passed(&mut ledger, job, model)?;
    ledger.reprice(rough.get_or_init(|| objective.with_scatter(&gate.scatter)));
    ledger.release(&context.opening(&header)).map_err(|problem| FitError::JournalWrite { problem })?;
    let searched = if ledger.stopped().is_some() || ledger.remaining() == 0 {
        Searched { ended: Ended::Stopped(Stop::Budget), descents: Vec::new() }
    } else {
        search::search(&mut ledger, names.len(), &job.search, search_allowance(allowed, names.len()))
    };
    ledger.set_limit(allowed);
    let weighed = uncertainty::weighed(&mut ledger);
    if let Some(weighed) = &weighed {
        ledger.reprice(local.get_or_init(|| objective.with_scatter(&weighed.scatter)));
    }
    let found = uncertainty::at_best(&mut ledger, &names, &job.intervals, job.search.local_evaluations);
    let settled = searched.ended == Ended::Converged;
    let found = found.map(|found| match settled && found.best.failure.is_none() {
        true => uncertainty::confirmed(&mut ledger, &names, (&job.search, &job.intervals), found),
        false => found,
    });
    let found = found.map(|found| qualified(found, weighed.as_ref(), &ledger, &searched));
    if let Some(Stop::Journal(problem)) = ledger.stopped() {
        return Err(FitError::JournalWrite { problem: problem.clone() });
    }
    let Some(found) = found else { return Err(FitError::NoEvaluation { allowed }) };
    let found = started(found, model, job, (&aims, ledger.objective().targets()));
    let far = far_from_priors(&camera_nuisances(job, &found.cameras));
    let found = found.barred((!far.is_empty()).then(|| unexplained(&far)));
    recheck::at(&objective, context, &found.best.unit)?;
    let held_out = cross_check(held, model, &found.best.values);
    let status = status(&ledger, &found.best, &searched.ended);
    let synthetic = measured.iter().flatten().any(Recording::is_synthetic);
    let findings = Findings {
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
    let best_reads = best_reads(&seen, &found.best.values);
    Ok(findings.into_result(&ledger, &best_reads))
}

/// What the gate says; nothing was found where the evaluations did not reach.
fn passed(ledger: &mut Ledger, job: &Job, model: &dyn Model) -> Result<Gate, FitError> {
    match gate(ledger, &job.parameter_names()) {
        Ok((gate, nearest)) => Ok(Gate { advice: advice(job, model, &nearest, &gate.combinations), ..gate }),
        Err(GateError::CannotBeFitted(why)) => Err(FitError::CannotBeFitted { why }),
        Err(GateError::Stopped(_)) => {
            Ok(Gate { scatter: vec![0.0; ledger.objective().targets().len()], ..Gate::default() })
        }
    }
}

/// What was found, with the reservations that the weighing and the other local searches bring.
fn qualified(
    mut found: Uncertainty,
    weighed: Option<&Weighed>,
    ledger: &Ledger,
    searched: &Searched,
) -> Uncertainty {
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
    let plain = ledger.objective().with_scatter(&weighed.roughness);
    found.doubted(
        searched.ended == Ended::Converged,
        &plain,
        &others.iter().map(|descent| descent.end.clone()).collect::<Vec<_>>(),
    )
}

/// What was found, with what the start of the scenes does to it.
fn started(mut found: Uncertainty, model: &dyn Model, job: &Job, fitted: (&[Aim], &[Target])) -> Uncertainty {
    if found.best.failure.is_none() {
        let names: Vec<String> = job.conditions.iter().map(|condition| condition.name.clone()).collect();
        let said = start_notes(model, &names, fitted, &found.best.values, job.ensemble.members);
        found.notes.extend(said);
    }
    found
}

fn status(ledger: &Ledger, best: &Evaluation, ended: &Ended) -> Status {
    match ended {
        _ if best.failure.is_some() => Status::Failed,
        _ if ledger.stopped().is_some() => Status::Interrupted,
        Ended::Converged => Status::Converged,
        Ended::Stopped(_) => Status::BudgetExhausted,
    }
}

/// What the best model shows of the features that were held out.
pub(super) fn cross_check(
    held: Vec<(Aim, Target)>,
    model: &dyn Model,
    values: &[f64],
) -> Vec<(Aim, Target, Result<f64, String>)> {
    let predicted = |(aim, target): (Aim, Target)| {
        let seen = ModelFeatures::new(model, std::slice::from_ref(&aim.feature), vec![target.value], 1);
        let read = seen.read(values, Draw::default()).map_err(|failure| failure.to_string());
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
pub(super) fn best_reads(seen: &ModelFeatures, values: &[f64]) -> Vec<Option<Value>> {
    seen.read(values, Draw::default())
        .map_or_else(|_| Vec::new(), |read| read.into_iter().map(Result::ok).collect())
}

/// Evaluations of the search when the sensitivities have to fit into the allowance too; they are left out of
/// a tight one.
fn search_allowance(allowed: usize, parameters: usize) -> usize {
    let sensitivities = 2 * parameters;
    if allowed >= 2 * sensitivities { allowed - sensitivities } else { allowed }
}

fn header(job: &Job, aims: &[Aim], targets: &[Target], context: &Context) -> Header {
    let parameter = |p: &FreeParameter| Parameter {
        name: p.name.clone(),
        unit: parameters::find(&p.name).map_or(Unit::PLAIN.name, |known| known.unit).to_owned(),
        axis: axis(p),
    };
    let aimed = |(aim, target): (&Aim, &Target)| Aimed {
        name: target.name.clone(),
        unit: aim.feature.reading.unit().name.to_owned(),
        target: target.clone(),
    };
    let parameters = job.parameters.iter().map(parameter).collect();
    let features = aims.iter().zip(targets).map(aimed).collect();
    let body = Body { seed: job.search.seed, parameters, features };
    Header::of::<Entry>(context.fingerprint, context.version, body)
}

pub(super) fn axis(parameter: &FreeParameter) -> Axis {
    Axis { bounds: parameter.bounds, prior: parameter.prior }
}
