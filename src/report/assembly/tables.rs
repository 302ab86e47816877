//! Rows of the tables of a report, made from a job, its recordings and its result.

use crate::compare::{FittedRecording, NextPeak, ParameterLine, TargetComparison, TrueValue};
use crate::fit::job::{FreeParameter, Job, TargetSource};
use crate::fit::result::{ComponentResult, FeatureResult, FitResult, FitStatus, ParameterResult};
use crate::fit::uncertainty::ParameterVerdict;
use crate::model::parameters;
use crate::recording::channel::ReversalInstants;
use crate::recording::files::RecordingFile;
use crate::recording::quality::{self, Optics, QualityFinding};
use crate::report::RecordingLine;
use crate::text::format_number;

/// A recording with the findings of `wiperlab inspect`.
pub(super) fn recording_line(measured: &FittedRecording) -> RecordingLine {
    let recording = measured.recording;
    let source = measured.file.and_then(|file: &RecordingFile| file.source.as_ref());
    let optics = measured.file.map_or_else(Optics::default, |file| Optics::from(&file.camera));
    let measurements = quality::measure_quality(recording, optics.exposure_s);
    let kept: Vec<QualityFinding> = source.map_or_else(Vec::new, |source| source.findings.clone());
    let instants = ReversalInstants::find_instants(recording);
    let findings = quality::collect_findings(recording, &measurements, &optics, &instants, &kept);
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

/// A row with the job's settings for a target: its source, condition and tolerance.
fn comparison_line(job: &Job, measured: &[FittedRecording], name: &str) -> TargetComparison {
    let Some(target) = job.targets.iter().find(|target| target.feature.name == name) else {
        return TargetComparison { name: name.to_owned(), ..TargetComparison::default() };
    };
    let at = target.feature.condition;
    let condition = job.conditions.get(at).filter(|_| job.conditions.len() > 1);
    let is_measured = matches!(target.source, TargetSource::Measured { .. });
    TargetComparison {
        name: name.to_owned(),
        condition: condition.map(|condition| condition.name.clone()),
        given: matches!(target.source, TargetSource::Given { .. }),
        synthetic: is_measured && measured.get(at).is_some_and(|m| m.recording.is_synthetic()),
        tolerance_relative: target.tolerance_relative,
        ..TargetComparison::default()
    }
}

pub(super) fn component_lines(
    job: &Job,
    measured: &[FittedRecording],
    result: &FitResult,
) -> Vec<TargetComparison> {
    let component = |c: &ComponentResult| TargetComparison {
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
        next_peak: c.runner_up.map(|p| NextPeak { frequency_hz: p.frequency_hz, below_db: p.below_db }),
        missing: c.missing.clone(),
        ..comparison_line(job, measured, &c.name)
    };
    result.components.iter().map(component).collect()
}

pub(super) fn feature_lines(
    job: &Job,
    measured: &[FittedRecording],
    found: &[FeatureResult],
) -> Vec<TargetComparison> {
    let feature = |f: &FeatureResult| TargetComparison {
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

/// The parameters in the order of the job, with their true values if the only recording is a twin.
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
    let line = |free: &FreeParameter| {
        Some(parameter_line(free, result.parameters.get(&free.name)?, result, value(&free.name)))
    };
    job.parameters.iter().filter_map(line).collect()
}

fn parameter_line(
    free: &FreeParameter,
    found: &ParameterResult,
    result: &FitResult,
    truth: Option<f64>,
) -> ParameterLine {
    let row = parameters::find_parameter(&free.name);
    let reasons = (!found.reasons.is_empty()).then(|| found.reasons.join("; "));
    let mut line = ParameterLine {
        name: free.name.clone(),
        symbol: parameters::symbol_with_recording(&free.name).unwrap_or_default(),
        unit: row.map(|p| p.unit).filter(|unit| *unit != "1").unwrap_or_default().to_owned(),
        estimate: found.estimate,
        lower_95: found.lower_95,
        upper_95: found.upper_95,
        verdict: found.verdict,
        why: reasons.or_else(|| unidentified_reason(free, found.verdict, result)),
        bounds: [free.bounds.lower(), free.bounds.upper()],
        prior: free.prior.is_some(),
        linear_95: found.linear_95,
        profile_95: found.profile_95,
        bootstrap_95: found.bootstrap_95,
        truth: None,
    };
    line.truth = truth.map(|value| TrueValue { value, inside_95: line.holds(value) });
    line
}

/// Reason why a parameter is not identified.
fn unidentified_reason(
    free: &FreeParameter,
    verdict: ParameterVerdict,
    result: &FitResult,
) -> Option<String> {
    let [lower, upper] = [free.bounds.lower(), free.bounds.upper()].map(format_number);
    Some(match verdict {
        ParameterVerdict::Identified => return None,
        ParameterVerdict::OpenBelow => format!(
            "only an upper limit is known, the interval reaches the lower bound of the search, {lower}"
        ),
        ParameterVerdict::OpenAbove => format!(
            "only a lower limit is known, the interval reaches the upper bound of the search, {upper}"
        ),
        ParameterVerdict::AtBound => format!(
            "the best value is a bound of the search, {lower} to {upper}: the optimum may lie outside"
        ),
        ParameterVerdict::NotIdentified => undetermined_reason(&free.name, result),
    })
}

fn undetermined_reason(name: &str, result: &FitResult) -> String {
    let open = result.combinations.iter().find(|c| !c.determined && c.exponents.contains_key(name));
    match (result.status, open) {
        (FitStatus::Converged, Some(open)) => format!("the data leave {} open", open.describe_in_words()),
        (FitStatus::Converged, None) => "the best point is not reliable, see the reservations".to_owned(),
        (status, _) => format!("the search had not converged ({})", status.name()),
    }
}
