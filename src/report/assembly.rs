//! Assembles the report of a fit: its recordings compared with the model at the estimates.

mod tables;

use super::{
    CombinationLine, FailureCount, FigureGroup, FigureSubject, ProbeLine, Report, SearchLine, summary,
};
use crate::compare::summary::format_comparison_json;
use crate::compare::tables::comparison_tables;
use crate::compare::{
    ComparisonSummary, ComparisonTable, ConditionComparison, FittedRecording, ModelRun, run_conditions,
};
use crate::figures::corner::CornerPlot;
use crate::figures::profiles::ProfilePlot;
use crate::figures::pulls::PullPlot;
use crate::figures::{
    FigureBlock, animation, cycle, evidence, friction, history, poses, residuals, spectrogram, spectrum,
    stick_slip, video_frames,
};
use crate::fit::Problem;
use crate::fit::evaluation::{FailureReason, RunFailure};
use crate::fit::job::Job;
use crate::fit::result::{FitResult, FitStatus};
use rayon::prelude::*;

impl Report {
    /// The report of a fit that was made through the library. It equals the report of the program, except
    /// that it has no descriptions of the recordings and no provenance.
    ///
    /// # Errors
    /// [`RunFailure`] when the model at the estimates does not run.
    pub fn from_fit(problem: &Problem, result: &FitResult) -> Result<Self, RunFailure> {
        let recordings = problem.recordings().iter().flatten();
        let measured: Vec<FittedRecording> =
            recordings.map(|recording| FittedRecording { recording, file: None, film: None }).collect();
        let model = problem
            .fitted_model(result)
            .map_err(|error| RunFailure::new(FailureReason::Refused, error.to_string(), 0.0))?;
        let models = run_conditions(problem.job(), &model, result)?;
        Ok(build_report(problem.job(), &measured, &models, result))
    }
}

/// The report of a fit, without its provenance.
#[must_use]
pub fn build_report(
    job: &Job,
    measured: &[FittedRecording],
    models: &[ModelRun],
    result: &FitResult,
) -> Report {
    let cases = ConditionComparison::compare_conditions(job, measured, models, result);
    let report = fill_report_sections(job, measured, &cases, result);
    let telling = summary::farthest_condition(&report.comparison).map_or(0, |(condition, _)| condition);
    let shown = shown_conditions(&cases, &report.comparison, telling);
    let mut evidence = draw_conditions(&shown, &EVIDENCE);
    evidence.extend(summary_figures(job, result, &report));
    let profiles = ProfilePlot::from_fit(job, result, &report.parameters).figure_block();
    let groups = [
        (FigureSubject::Evidence, evidence),
        (FigureSubject::Measured, draw_conditions(&shown, &MEASURED)),
        (FigureSubject::Blade, blade_figures(&shown)),
        (FigureSubject::Parameters, profiles.into_iter().collect()),
    ];
    let groups = groups.into_iter().filter(|(_, figures)| !figures.is_empty());
    let figures = groups.map(|(subject, figures)| FigureGroup { subject, figures }).collect();
    let mut tables = comparison_tables(&cases);
    let text = format_comparison_json(&report.comparison, telling);
    tables.push(ComparisonTable { file: "comparison.json", text });
    Report { tables, figures, ..report }
}

/// The report of a fit without its figures, which take most of the time.
pub(crate) fn build_report_without_figures(
    job: &Job,
    measured: &[FittedRecording],
    models: &[ModelRun],
    result: &FitResult,
) -> Report {
    let cases = ConditionComparison::compare_conditions(job, measured, models, result);
    fill_report_sections(job, measured, &cases, result)
}

fn fill_report_sections(
    job: &Job,
    measured: &[FittedRecording],
    cases: &[ConditionComparison],
    result: &FitResult,
) -> Report {
    let report = Report {
        title: job.title.clone(),
        search: search_line(result),
        misfit: result.misfit.clone(),
        findings: result.findings.clone(),
        nuisances: result.nuisances.clone(),
        recordings: measured.iter().map(tables::recording_line).collect(),
        components: tables::component_lines(job, measured, result),
        features: tables::feature_lines(job, measured, &result.features),
        held_out: tables::feature_lines(job, measured, &result.held_out),
        parameters: tables::parameter_lines(job, measured, result),
        friction: cases.first().map_or_else(Vec::new, friction::friction_lines),
        law: result.law.clone(),
        chatter: result.chatter.clone(),
        combinations: result.combinations.iter().map(combination_line).collect(),
        advice: result.gate.advice.clone(),
        runs: cases.iter().map(ConditionComparison::run_summary).collect(),
        gate: result.gate.probes.iter().map(probe_line).collect(),
        gate_notes: result.gate.notes.clone(),
        comparison: cases.iter().map(ComparisonSummary::summarize).collect(),
        notes: fit_notes(measured, result),
        ..Report::default()
    };
    if result.has_estimates() {
        return report;
    }
    // (without a segment, the values of the parameters are those at which the search started)
    Report { parameters: Vec::new(), nuisances: Vec::new(), friction: Vec::new(), ..report }
}

/// Draws a figure of one or several conditions, given in the order of [`shown_conditions`].
type DrawConditions = fn(&[&ConditionComparison]) -> Option<FigureBlock>;

/// Maximum number of conditions in a figure; more do not fit on a printed page.
const MOST_CONDITIONS: usize = 4;

/// The figures that show whether the model explains the conditions.
const EVIDENCE: [DrawConditions; 4] = [
    |shown| join_conditions(shown, evidence::figure_block, 2),
    |shown| join_conditions(shown, stick_slip::figure_block, 2),
    |shown| friction::figure_block(shown.first()?),
    |shown| residuals::figure_block(shown.first()?),
];

/// The figures of the motions and of their spectra.
const MEASURED: [DrawConditions; 4] = [
    |shown| join_conditions(shown, |case| Some(history::caption::figure_block(case)), 2),
    cycle::figure_block,
    |shown| join_conditions(shown, spectrogram::caption::figure_block, 2),
    |shown| join_conditions(shown, spectrum::caption::figure_block, 1),
];

/// The conditions that figures show: first `telling`, then the others in descending order of residual over
/// noise.
fn shown_conditions<'a, 'b>(
    cases: &'b [ConditionComparison<'a>],
    comparison: &[ComparisonSummary],
    telling: usize,
) -> Vec<&'b ConditionComparison<'a>> {
    let left = |case: &ConditionComparison| {
        let line = comparison.get(case.condition).and_then(ComparisonSummary::judged_residual);
        line.and_then(|line| line.rms_over_noise).unwrap_or(0.0)
    };
    let mut shown: Vec<&ConditionComparison> = cases.iter().collect();
    portable_math::sort_by_number(&mut shown, |a| -left(a));
    shown.sort_by_key(|case| case.condition != telling);
    shown.truncate(MOST_CONDITIONS);
    shown
}

fn draw_conditions(shown: &[&ConditionComparison], figures: &[DrawConditions]) -> Vec<FigureBlock> {
    figures.par_iter().filter_map(|draw| draw(shown)).collect()
}

/// The whole figure of the first condition that has one. Below it are the first `panels` panels of the figure
/// of each other condition.
fn join_conditions(
    shown: &[&ConditionComparison],
    draw: impl Fn(&ConditionComparison) -> Option<FigureBlock> + Sync,
    panels: usize,
) -> Option<FigureBlock> {
    let drawn: Vec<Option<FigureBlock>> = shown.par_iter().map(|case| draw(case)).collect();
    drawn.into_iter().flatten().reduce(|whole, next| whole.with_panels(next, panels))
}

/// Figures of the poses of the blade, of its links over frames of a video, and an animation; none of a
/// slider, which has no links.
fn blade_figures(shown: &[&ConditionComparison]) -> Vec<FigureBlock> {
    let first = |draw: fn(&ConditionComparison) -> Option<FigureBlock>| {
        shown.iter().filter(|case| !case.model.motion.linkage.is_slider()).find_map(|case| draw(case))
    };
    [first(poses::figure_block), first(video_frames::block), first(animation::figure_block)]
        .into_iter()
        .flatten()
        .collect()
}

/// Figures of the correlations of the parameters, and of the deviation of the model from every target.
fn summary_figures(job: &Job, result: &FitResult, report: &Report) -> Vec<FigureBlock> {
    let features = [report.components.as_slice(), report.features.as_slice()];
    let pulls = PullPlot::from_comparisons(&job.title, &features, &report.held_out);
    // with as many parameters as targets, a fit meets every target, so that the pulls say nothing
    let fitted = if report.misfit.is_some() { 0 } else { report.parameters.len() };
    let degrees = pulls.pulls.len().saturating_sub(fitted);
    let blocks = [
        CornerPlot::from_fit(job, result, &report.parameters).figure_block(),
        (degrees > 0).then(|| pulls.figure_block()).flatten(),
    ];
    blocks.into_iter().flatten().collect()
}

fn search_line(result: &FitResult) -> SearchLine {
    let failed = result.evaluations.failed.iter();
    let failed = failed.map(|(reason, count)| FailureCount { reason: reason.to_string(), count: *count });
    SearchLine {
        status: Some(result.status),
        converged: result.status == FitStatus::Converged,
        evaluations: result.evaluations.total,
        failed: failed.collect(),
        local_searches: result.waterfall.len(),
        cost: result.cost,
        threshold: result.threshold,
        twins: result.twins,
        rank: result.rank,
        condition: result.condition,
    }
}

fn combination_line(found: &crate::fit::linear_model::ParameterCombination) -> CombinationLine {
    CombinationLine { words: found.describe(), determined: found.determined, sd_relative: found.sd_relative }
}

fn probe_line(found: &crate::fit::identifiability::Probe) -> ProbeLine {
    ProbeLine {
        features_seen: found.features_seen,
        rank: found.rank,
        condition: found.condition,
        determines: found.determines.clone(),
        failure: found.failure.clone(),
    }
}

/// Notes of the fit, without the notes of the gate (the check before the search), which have their own
/// section.
fn fit_notes(measured: &[FittedRecording], result: &FitResult) -> Vec<String> {
    let mut notes: Vec<String> =
        result.notes.iter().filter(|note| !result.gate.notes.contains(note)).cloned().collect();
    let freed = result.nuisances.iter().any(|nuisance| nuisance.recording.is_none());
    // if no constants are fitted, a fit to traces already has such a note
    let exact = match (freed, &result.misfit) {
        (true, _) => Some("every number of the scene that is not freed"),
        (false, None) => Some("every other number of the scene"),
        (false, Some(_)) => None,
    };
    let error = "is taken as exact: the intervals do not include its error";
    notes.extend(exact.map(|what| format!("{what} {error}")));
    if measured.is_empty() {
        notes.push(
            "Only published values were fitted: there is no recording, and the traces shown are the model's \
             alone. A value that the job assumes counts as published here."
                .to_owned(),
        );
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::run_conditions;
    use crate::fit::scene_model::{Instrument, ModelCondition, PlausibilityLimits, SceneModel};
    use crate::simulate::RUNS;
    use crate::simulate::scene::Scene;
    use crate::simulate::twin::Camera;

    const JOB: &str = include_str!("../../fits/published-simulation/job.toml");
    const RESULT: &str = include_str!("../../fits/published-simulation/result.json");
    const SCENE: &str = include_str!("../../data/scenes/published-simulation.toml");

    #[test]
    fn a_report_with_all_its_figures_runs_every_scene_once() {
        let job = Job::parse("job.toml", JOB).unwrap();
        let result = FitResult::parse("result.json", RESULT).unwrap();
        let camera = Camera { frame_rate_hz: 5e3, exposure_s: 0.0 };
        let condition = || ModelCondition {
            scene: Scene::parse("scene.toml", SCENE).unwrap(),
            instrument: Instrument { camera, noise_m: 0.0, dropout_fraction: 0.0 },
        };
        let conditions: Vec<ModelCondition> = job.conditions.iter().map(|_| condition()).collect();
        let model = SceneModel::new(conditions, job.parameter_names(), PlausibilityLimits::default());
        // everything runs in one thread, since the runs are counted per thread
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let (runs, figures) = pool.install(|| {
            let models = run_conditions(&job, &model, &result).unwrap();
            let figures = build_report(&job, &[], &models, &result).all_figures().count();
            (RUNS.get(), figures)
        });
        assert_eq!(runs, job.conditions.len());
        assert!(figures > 8, "{figures}");
    }
}
