//! The lines of a report's tables from a job, its recordings and its result.

use crate::compare::{Comparison, FittedRecording, NextPeak, ParameterLine, Truth};
use crate::fit::job::{FitTarget, FreeParameter, Job, TargetSource};
use crate::fit::result::{ComponentResult, FeatureResult, FitResult, FitStatus, ParameterResult};
use crate::fit::uncertainty::ParameterVerdict;
use crate::model::parameters;
use crate::recording::channel::ReversalInstants;
use crate::recording::files::RecordingFile;
use crate::recording::quality::{self, Optics, QualityFinding};
use crate::report::RecordingLine;
use crate::text::format_number;

/// A recording with everything that `wiperlab inspect` says of it.
pub(super) fn recording_line(measured: &FittedRecording) -> RecordingLine {
    let (recording, source) =
        (measured.recording, measured.file.and_then(|file: &RecordingFile| file.source.as_ref()));
    let optics = measured.file.map_or_else(Optics::default, |file| Optics::from(&file.camera));
    let measurements = quality::measure_quality(recording, optics.exposure_s);
    let kept: Vec<QualityFinding> = source.map_or_else(Vec::new, |source| source.findings.clone());
    let findings = quality::collect_findings(
        recording,
        &measurements,
        &optics,
        &ReversalInstants::find_instants(recording),
        &kept,
    );
    RecordingLine {
        name: recording.name().to_owned(),
        synthetic: recording.is_synthetic(),
        exports: source.map_or_else(Vec::new, |source| source.file.as_slice().to_vec()),
        grade: quality::grade_findings(&findings),
        verdict: quality::verdict_lines(&measurements, &findings),
        measurements,
        findings,
    }
}

/// What the job says of a value by its name.
fn find_fit_target<'a>(job: &'a Job, name: &str) -> Option<&'a FitTarget> {
    job.targets.iter().find(|aim| aim.feature.name == name)
}

/// A line with what the job says: where the target comes from, and of which condition it is.
fn comparison_line(job: &Job, measured: &[FittedRecording], name: &str) -> Comparison {
    let aim = find_fit_target(job, name);
    let several = job.conditions.len() > 1;
    Comparison {
        name: name.to_owned(),
        condition: aim
            .filter(|_| several)
            .and_then(|aim| job.conditions.get(aim.feature.condition))
            .map(|condition| condition.name.clone()),
        given: aim.is_some_and(|aim| matches!(aim.source, TargetSource::Given { .. })),
        synthetic: aim
            .filter(|aim| matches!(aim.source, TargetSource::Measured { .. }))
            .and_then(|aim| measured.get(aim.feature.condition))
            .is_some_and(|m| m.recording.is_synthetic()),
        tolerance_relative: aim.and_then(|aim| aim.tolerance_relative),
        ..Comparison::default()
    }
}

pub(super) fn component_lines(
    job: &Job,
    measured: &[FittedRecording],
    result: &FitResult,
) -> Vec<Comparison> {
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
        ..comparison_line(job, measured, &c.name)
    };
    result.components.iter().map(component).collect()
}

pub(super) fn feature_lines(
    job: &Job,
    measured: &[FittedRecording],
    found: &[FeatureResult],
) -> Vec<Comparison> {
    let feature = |f: &FeatureResult| Comparison {
        unit: f.unit.clone(),
        target: f.target,
        target_sd: Some(f.target_sd),
        model: f.value_seen(),
        without_camera: f.model_seen.and(f.model),
        relative_error: f.relative_error,
        pass: f.pass,
        twin_sd: f.twin_sd,
        model_scatter: f.model_scatter,
        missing: f.missing.clone(),
        ..comparison_line(job, measured, &f.name)
    };
    found.iter().map(feature).collect()
}

/// The parameters in job order, with the truth where one twin alone was fitted.
pub(super) fn parameter_lines(
    job: &Job,
    measured: &[FittedRecording],
    result: &FitResult,
) -> Vec<ParameterLine> {
    let twin = match measured {
        [one] => one.file.and_then(|f| f.twin.as_ref()),
        _ => None,
    };
    let truth = twin.and_then(|t| t.get("truth")).and_then(toml::Value::as_table);
    let value = |name: &str| truth.and_then(|t| t.get(name)).and_then(toml::Value::as_float);
    job.parameters
        .iter()
        .filter_map(|free| {
            Some(parameter_line(free, result.parameters.get(&free.name)?, result, value(&free.name)))
        })
        .collect()
}

fn parameter_line(
    free: &FreeParameter,
    found: &ParameterResult,
    result: &FitResult,
    truth: Option<f64>,
) -> ParameterLine {
    let row = parameters::find_parameter(&free.name);
    let mut line = ParameterLine {
        name: free.name.clone(),
        symbol: row.map_or_else(String::new, |p| p.symbol.to_owned()),
        unit: row.map(|p| p.unit).filter(|unit| *unit != "1").unwrap_or_default().to_owned(),
        estimate: found.estimate,
        lower_95: found.lower_95,
        upper_95: found.upper_95,
        verdict: found.verdict,
        why: if found.reasons.is_empty() {
            unidentified_reason(free, found.verdict, result)
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
fn unidentified_reason(
    free: &FreeParameter,
    verdict: ParameterVerdict,
    result: &FitResult,
) -> Option<String> {
    let (lower, upper) = (format_number(free.bounds.lower()), format_number(free.bounds.upper()));
    match verdict {
        ParameterVerdict::Identified => None,
        ParameterVerdict::OpenBelow => Some(format!(
            "only an upper limit is known, the interval reaches the lower bound of the search, {lower}"
        )),
        ParameterVerdict::OpenAbove => Some(format!(
            "only a lower limit is known, the interval reaches the upper bound of the search, {upper}"
        )),
        ParameterVerdict::AtBound => Some(format!(
            "the best value is a bound of the search, {lower} to {upper}: the optimum may lie outside"
        )),
        ParameterVerdict::NotIdentified => Some(undetermined_reason(&free.name, result)),
    }
}

fn undetermined_reason(name: &str, result: &FitResult) -> String {
    let open = result.combinations.iter().find(|c| !c.determined && c.exponents.contains_key(name));
    match (result.status, open) {
        (FitStatus::Converged, Some(open)) => format!("the features leave {} open", open.describe()),
        (FitStatus::Converged, None) => "the best point is not reliable, see the reservations".to_owned(),
        (status, _) => format!("the search had not converged ({})", status.name()),
    }
}
