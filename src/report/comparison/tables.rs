//! The lines of a report's tables from a job, its recordings and its result.

use crate::blade::parameters;
use crate::compare::Measured;
use crate::compare::{Comparison, NextPeak, ParameterLine, Truth};
use crate::fit::job::{Aim, FreeParameter, Job, Source};
use crate::fit::result::{ComponentResult, FeatureResult, FitResult, ParameterResult, Status};
use crate::fit::uncertainty::Verdict;
use crate::recording::channel::Instants;
use crate::recording::files::RecordingFile;
use crate::recording::quality::{self, Finding, Optics};
use crate::report::RecordingLine;
use crate::text::number;

/// A recording with everything that `wiperlab inspect` says of it.
pub(super) fn recording(measured: &Measured) -> RecordingLine {
    let (recording, source) =
        (measured.recording, measured.file.and_then(|file: &RecordingFile| file.source.as_ref()));
    let optics = measured.file.map_or_else(Optics::default, |file| Optics::from(&file.camera));
    let measurements = quality::quality(recording, optics.exposure_s);
    let kept: Vec<Finding> = source.map_or_else(Vec::new, |source| source.findings.clone());
    let findings = quality::findings(recording, &measurements, &optics, &Instants::find(recording), &kept);
    RecordingLine {
        name: recording.name().to_owned(),
        synthetic: recording.is_synthetic(),
        exports: source.map_or_else(Vec::new, |source| source.file.all().to_vec()),
        grade: quality::grade(&findings),
        verdict: quality::verdict(&measurements, &findings),
        measurements,
        findings,
    }
}

/// What the job says of a value by its name.
fn asked<'a>(job: &'a Job, name: &str) -> Option<&'a Aim> {
    job.aims.iter().find(|aim| aim.feature.name == name)
}

/// A line with what the job says: where the target comes from, and of which condition it is.
fn line(job: &Job, measured: &[Measured], name: &str) -> Comparison {
    let aim = asked(job, name);
    let several = job.conditions.len() > 1;
    Comparison {
        name: name.to_owned(),
        condition: aim
            .filter(|_| several)
            .and_then(|aim| job.conditions.get(aim.feature.condition))
            .map(|condition| condition.name.clone()),
        given: aim.is_some_and(|aim| matches!(aim.source, Source::Given { .. })),
        synthetic: aim
            .filter(|aim| matches!(aim.source, Source::Measured { .. }))
            .and_then(|aim| measured.get(aim.feature.condition))
            .is_some_and(|m| m.recording.is_synthetic()),
        tolerance_relative: aim.and_then(|aim| aim.tolerance_relative),
        ..Comparison::default()
    }
}

pub(super) fn components(job: &Job, measured: &[Measured], result: &FitResult) -> Vec<Comparison> {
    let component = |c: &ComponentResult| Comparison {
        unit: "Hz".to_owned(),
        target: c.target_hz,
        target_sd: Some(c.target_sd_hz),
        model: c.model_hz,
        relative_error: c.relative_error,
        tolerance_relative: Some(c.tolerance_relative),
        pass: c.pass,
        twin_sd: c.twin_sd_hz,
        model_scatter: c.model_scatter_hz,
        below_db: c.below_db,
        next_peak: c
            .runner_up
            .map(|peak| NextPeak { frequency_hz: peak.frequency_hz, below_db: peak.below_db }),
        missing: c.missing.clone(),
        ..line(job, measured, &c.name)
    };
    result.components.iter().map(component).collect()
}

pub(super) fn features(job: &Job, measured: &[Measured], found: &[FeatureResult]) -> Vec<Comparison> {
    let feature = |f: &FeatureResult| Comparison {
        unit: f.unit.clone(),
        target: f.target,
        target_sd: Some(f.target_sd),
        model: f.shown(),
        without_camera: f.model_seen.and(f.model),
        relative_error: f.relative_error,
        pass: f.pass,
        twin_sd: f.twin_sd,
        model_scatter: f.model_scatter,
        missing: f.missing.clone(),
        ..line(job, measured, &f.name)
    };
    found.iter().map(feature).collect()
}

/// The parameters in job order, with the truth where one twin alone was fitted.
pub(super) fn parameters(job: &Job, measured: &[Measured], result: &FitResult) -> Vec<ParameterLine> {
    let twin = match measured {
        [one] => one.file.and_then(|f| f.twin.as_ref()),
        _ => None,
    };
    let truth = twin.and_then(|t| t.get("truth")).and_then(toml::Value::as_table);
    let value = |name: &str| truth.and_then(|t| t.get(name)).and_then(toml::Value::as_float);
    job.parameters
        .iter()
        .filter_map(|free| {
            Some(parameter(free, result.parameters.get(&free.name)?, result, value(&free.name)))
        })
        .collect()
}

fn parameter(
    free: &FreeParameter,
    found: &ParameterResult,
    result: &FitResult,
    truth: Option<f64>,
) -> ParameterLine {
    let row = parameters::find(&free.name);
    let mut line = ParameterLine {
        name: free.name.clone(),
        symbol: row.map_or_else(String::new, |p| p.symbol.to_owned()),
        unit: row.map(|p| p.unit).filter(|unit| *unit != "1").unwrap_or_default().to_owned(),
        estimate: found.estimate,
        lower_95: found.lower_95,
        upper_95: found.upper_95,
        verdict: found.verdict,
        why: if found.reasons.is_empty() {
            why(free, found.verdict, result)
        } else {
            Some(found.reasons.join("; "))
        },
        bounds: [free.bounds.lower(), free.bounds.upper()],
        prior: free.prior.is_some(),
        linear_95: found.linear_95,
        profile_95: found.profile_95,
        bootstrap_95: found.bootstrap_95,
        truth: None,
    };
    line.truth = truth.map(|value| Truth { value, inside_95: line.holds(value) });
    line
}

/// Why a parameter is not identified.
fn why(free: &FreeParameter, verdict: Verdict, result: &FitResult) -> Option<String> {
    let (lower, upper) = (number(free.bounds.lower()), number(free.bounds.upper()));
    match verdict {
        Verdict::Identified => None,
        Verdict::OpenBelow => Some(format!(
            "only an upper limit is known, the interval reaches the lower bound of the search, {lower}"
        )),
        Verdict::OpenAbove => Some(format!(
            "only a lower limit is known, the interval reaches the upper bound of the search, {upper}"
        )),
        Verdict::AtBound => Some(format!(
            "the best value is a bound of the search, {lower} to {upper}: the optimum may lie outside"
        )),
        Verdict::NotIdentified => Some(undetermined(&free.name, result)),
    }
}

fn undetermined(name: &str, result: &FitResult) -> String {
    let open = result.combinations.iter().find(|c| !c.determined && c.exponents.contains_key(name));
    match (result.status, open) {
        (Status::Converged, Some(open)) => format!("the features leave {} open", open.in_words()),
        (Status::Converged, None) => "the best point is not reliable, see the reservations".to_owned(),
        (status, _) => format!("the search had not converged ({})", status.word()),
    }
}
