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
use crate::figures::figure_text::make_file_names_unique;
use crate::figures::profiles::ProfilePlot;
use crate::figures::pulls::PullPlot;
use crate::figures::{
    FigureBlock, animation, cycle, evidence, friction, history, phase_portrait, poses, residuals,
    spectrogram, spectrum, video_frames,
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
    let mut evidence = cases.get(telling).map_or_else(Vec::new, |case| {
        make_file_names_unique(condition_figures(case, shared_law_case(&cases, telling)))
    });
    evidence.extend(summary_figures(job, result, &report));
    let profiles = ProfilePlot::from_fit(job, result, &report.parameters).figure_block();
    let groups = [
        (FigureSubject::Evidence, evidence),
        (FigureSubject::Measured, measured_figures(&cases, telling)),
        (FigureSubject::Blade, blade_figures(&cases)),
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
    Report {
        title: job.title.clone(),
        search: search_line(result),
        misfit: result.misfit.clone(),
        nuisances: result.nuisances.clone(),
        recordings: measured.iter().map(tables::recording_line).collect(),
        components: tables::component_lines(job, measured, result),
        features: tables::feature_lines(job, measured, &result.features),
        held_out: tables::feature_lines(job, measured, &result.held_out),
        parameters: tables::parameter_lines(job, measured, result),
        friction: cases.first().map_or_else(Vec::new, friction::friction_lines),
        combinations: result.combinations.iter().map(combination_line).collect(),
        advice: result.gate.advice.clone(),
        runs: cases.iter().map(ConditionComparison::run_summary).collect(),
        gate: result.gate.probes.iter().map(probe_line).collect(),
        gate_notes: result.gate.notes.clone(),
        comparison: cases.iter().map(ComparisonSummary::summarize).collect(),
        notes: fit_notes(measured, result),
        ..Report::default()
    }
}

/// The condition whose friction figure also applies to the condition `of`: both have the same run, or are one
/// and the same condition.
fn shared_law_case<'a, 'b>(
    cases: &'b [ConditionComparison<'a>],
    of: usize,
) -> Option<&'b ConditionComparison<'a>> {
    let shares = |same: &Vec<usize>, case: &ConditionComparison| case.condition == of || same.contains(&of);
    cases.iter().find(|case| case.same_run.as_ref().is_some_and(|same| shares(same, case)))
}

/// The figures that show whether the model explains a condition: recording and model on one axis, cycle
/// against speed, friction, residuals.
fn condition_figures(case: &ConditionComparison, law: Option<&ConditionComparison>) -> Vec<FigureBlock> {
    let parts = [
        evidence::figure_block(case),
        cycle::figure_block(case),
        law.and_then(friction::figure_block),
        residuals::figure_block(case),
    ];
    parts.into_iter().flatten().collect()
}

/// The figures of all conditions: histories, spectra, spectrograms and phase portraits. All conditions except
/// `telling` also get their [`condition_figures`] here; those of `telling` are in the answer at the top of
/// the page.
fn measured_figures(cases: &[ConditionComparison], telling: usize) -> Vec<FigureBlock> {
    let all = |(i, case): (usize, &ConditionComparison)| {
        let shown = shared_law_case(cases, telling).map(|law| law.condition);
        let own = case.same_run.as_ref().map(|_| case).filter(|case| shown != Some(case.condition));
        let first = if i == telling { Vec::new() } else { condition_figures(case, own) };
        let parts = [
            history::caption::figure_blocks(case),
            spectrum::caption::figure_blocks(case),
            spectrogram::caption::figure_blocks(case),
            phase_portrait::figure_blocks(case),
        ];
        first.into_iter().chain(parts.into_iter().flatten()).collect::<Vec<_>>()
    };
    make_file_names_unique(cases.par_iter().enumerate().flat_map_iter(all).collect())
}

/// Figures of the poses of the blade in every run, of its links over frames of each video, and animations.
fn blade_figures(cases: &[ConditionComparison]) -> Vec<FigureBlock> {
    let runs = || cases.iter().filter(|case| case.same_run.is_some());
    let filmed = cases.iter().filter_map(video_frames::block);
    let moving = runs().filter_map(animation::figure_block);
    runs().filter_map(poses::figure_block).chain(filmed).chain(moving).collect()
}

/// Figures of the correlations of the parameters, and of the deviation of the model from every target.
fn summary_figures(job: &Job, result: &FitResult, report: &Report) -> Vec<FigureBlock> {
    let features = [report.components.as_slice(), report.features.as_slice()];
    let blocks = [
        CornerPlot::from_fit(job, result, &report.parameters).figure_block(),
        PullPlot::from_comparisons(&job.title, &features, &report.held_out).figure_block(),
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
