//! A fit as a report: its recordings against the model at the estimates.

mod tables;

use super::answer;
use super::{CombinationLine, Failed, FigureGroup, ProbeLine, Report, SearchLine, Subject};
use crate::compare::{Case, Measured, ModelRun, Summary, model_runs, tables::tables};
use crate::figures::FigureBlock;
use crate::figures::corner::Corner;
use crate::figures::naming::distinct;
use crate::figures::profiles::Profiles;
use crate::figures::pulls::Pulls;
use crate::figures::{
    animation, cycle, evidence, friction, history, phase_portrait, poses, residuals, spectrogram, spectrum,
    video_frames,
};
use crate::fit::Problem;
use crate::fit::failure::{FailureReason, RunFailure};
use crate::fit::job::Job;
use crate::fit::result::{FitResult, Status};
use rayon::prelude::*;

impl Report {
    /// The report of a fit that was made in the library: as the program writes it, without the description of
    /// the recordings and the files behind them.
    ///
    /// # Errors
    /// [`RunFailure`] when the model at the estimates does not run.
    pub fn of(problem: &Problem, result: &FitResult) -> Result<Self, RunFailure> {
        let recordings = problem.recordings().iter().flatten();
        let measured: Vec<Measured> =
            recordings.map(|recording| Measured { recording, file: None, film: None }).collect();
        let model = problem
            .model_of(result)
            .map_err(|error| RunFailure::new(FailureReason::Refused, error.to_string(), 0.0))?;
        let models = model_runs(problem.job(), &model, result)?;
        Ok(report(problem.job(), &measured, &models, result))
    }
}

/// The report of a fit, but for its provenance.
#[must_use]
pub fn report(job: &Job, measured: &[Measured], models: &[ModelRun], result: &FitResult) -> Report {
    let cases = Case::all(job, measured, models, result);
    let report = lines(job, measured, &cases, result);
    let telling = answer::farthest(&report.comparison).map_or(0, |(condition, _)| condition);
    let answering = [
        cases.get(telling).map_or_else(Vec::new, |case| distinct(of_condition(case, law(&cases, telling)))),
        of_answer(job, result, &report),
    ]
    .concat();
    let groups = [
        (Subject::Evidence, answering),
        (Subject::Measured, measured_figures(&cases, telling)),
        (Subject::Blade, blade_figures(&cases)),
        (Subject::Parameters, Profiles::of(job, result, &report.parameters).block().into_iter().collect()),
    ];
    Report {
        tables: tables(&cases),
        figures: groups.into_iter().map(group).filter(|group| !group.figures.is_empty()).collect(),
        ..report
    }
}

/// The same without its figures, which take most of the time.
#[must_use]
pub fn in_words(job: &Job, measured: &[Measured], models: &[ModelRun], result: &FitResult) -> Report {
    lines(job, measured, &Case::all(job, measured, models, result), result)
}

fn lines(job: &Job, measured: &[Measured], cases: &[Case], result: &FitResult) -> Report {
    Report {
        title: job.title.clone(),
        search: search(result),
        misfit: result.misfit.clone(),
        nuisances: result.nuisances.clone(),
        recordings: measured.iter().map(tables::recording).collect(),
        components: tables::components(job, measured, result),
        features: tables::features(job, measured, &result.features),
        held_out: tables::features(job, measured, &result.held_out),
        parameters: tables::parameters(job, measured, result),
        friction: cases.first().map_or_else(Vec::new, friction::caption::lines),
        combinations: result.combinations.iter().map(combination).collect(),
        advice: result.gate.advice.clone(),
        runs: cases.iter().map(Case::run_line).collect(),
        gate: result.gate.probes.iter().map(probe).collect(),
        gate_notes: result.gate.notes.clone(),
        comparison: cases.iter().map(Summary::of).collect(),
        notes: notes(measured, result),
        ..Report::default()
    }
}

/// The condition whose figure of friction shows that of another, as it is the first with the same run.
fn law<'a, 'b>(cases: &'b [Case<'a>], of: usize) -> Option<&'b Case<'a>> {
    let shares = |same: &Vec<usize>, case: &Case| case.condition == of || same.contains(&of);
    cases.iter().find(|case| case.same_run.as_ref().is_some_and(|same| shares(same, case)))
}

/// What shows at a glance whether the model explains a condition: both on one axis, the cycles over speed,
/// friction, and what is left.
fn of_condition(case: &Case, law: Option<&Case>) -> Vec<FigureBlock> {
    let parts = [
        evidence::caption::block(case),
        cycle::caption::block(case),
        law.and_then(friction::caption::block),
        residuals::caption::block(case),
    ];
    parts.into_iter().flatten().collect()
}

/// Condition by condition: the motion itself, then what it is made of; of the conditions but the `telling`
/// one also what the answer shows of that one.
fn measured_figures(cases: &[Case], telling: usize) -> Vec<FigureBlock> {
    let all = |(i, case): (usize, &Case)| {
        let shown = law(cases, telling).map(|law| law.condition);
        let own = case.same_run.as_ref().map(|_| case).filter(|case| shown != Some(case.condition));
        let first = if i == telling { Vec::new() } else { of_condition(case, own) };
        let parts = [
            history::caption::blocks(case),
            spectrum::caption::blocks(case),
            spectrogram::caption::blocks(case),
            phase_portrait::caption::blocks(case),
        ];
        first.into_iter().chain(parts.into_iter().flatten()).collect::<Vec<_>>()
    };
    distinct(cases.par_iter().enumerate().flat_map_iter(all).collect())
}

/// Run by run: the blade itself, then over the frames of each video, and then every run in motion.
fn blade_figures(cases: &[Case]) -> Vec<FigureBlock> {
    let runs = || cases.iter().filter(|case| case.same_run.is_some());
    let filmed = cases.iter().filter_map(video_frames::block);
    runs()
        .filter_map(poses::block)
        .chain(filmed)
        .chain(runs().filter_map(animation::caption::block))
        .collect()
}

/// How the parameters hang together, and how far every target is from the model.
fn of_answer(job: &Job, result: &FitResult, report: &Report) -> Vec<FigureBlock> {
    let features = [report.components.as_slice(), report.features.as_slice()];
    let blocks = [
        Corner::of(job, result, &report.parameters).block(),
        Pulls::of(&job.title, &features, &report.held_out).block(),
    ];
    blocks.into_iter().flatten().collect()
}

fn group((subject, figures): (Subject, Vec<FigureBlock>)) -> FigureGroup {
    FigureGroup { subject, figures }
}

fn search(result: &FitResult) -> SearchLine {
    let failed = result
        .evaluations
        .failed
        .iter()
        .map(|(reason, count)| Failed { reason: reason.to_string(), count: *count });
    SearchLine {
        status: Some(result.status),
        converged: result.status == Status::Converged,
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

fn combination(found: &crate::fit::information::Combination) -> CombinationLine {
    CombinationLine { words: found.in_words(), determined: found.determined, sd_relative: found.sd_relative }
}

fn probe(found: &crate::fit::gate::Probe) -> ProbeLine {
    ProbeLine {
        features_seen: found.features_seen,
        rank: found.rank,
        condition: found.condition,
        determines: found.determines.clone(),
        failure: found.failure.clone(),
    }
}

/// Notes of the fit, but for those of the gate, which have a place of their own.
fn notes(measured: &[Measured], result: &FitResult) -> Vec<String> {
    let mut notes: Vec<String> =
        result.notes.iter().filter(|note| !result.gate.notes.contains(note)).cloned().collect();
    let freed = result.nuisances.iter().any(|nuisance| nuisance.recording.is_none());
    // (a fit to traces that frees none says so itself)
    let exact = match (freed, &result.misfit) {
        (true, _) => Some("every number of the scene that is not freed"),
        (false, None) => Some("every other number of the scene"),
        (false, Some(_)) => None,
    };
    notes.extend(
        exact.map(|what| format!("{what} is taken as exact: the intervals do not include its error")),
    );
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
    use crate::compare::model_runs;
    use crate::fit::scene_model::{Condition, Instrument, Plausible, SceneModel};
    use crate::simulate::RUNS;
    use crate::simulate::scene::Scene;
    use crate::twin::Camera;

    const JOB: &str = include_str!("../../fits/published-simulation/job.toml");
    const RESULT: &str = include_str!("../../fits/published-simulation/result.json");
    const SCENE: &str = include_str!("../../data/scenes/published-simulation.toml");

    #[test]
    fn a_report_with_all_its_figures_runs_every_scene_once() {
        let job = Job::parse("job.toml", JOB).unwrap();
        let result = FitResult::parse("result.json", RESULT).unwrap();
        let camera = Camera { frame_rate_hz: 5e3, exposure_s: 0.0 };
        let condition = || Condition {
            scene: Scene::parse("scene.toml", SCENE).unwrap(),
            instrument: Instrument { camera, noise_m: 0.0, dropout_fraction: 0.0 },
        };
        let conditions: Vec<Condition> = job.conditions.iter().map(|_| condition()).collect();
        let model = SceneModel::new(conditions, job.parameter_names(), Plausible::default());
        // everything in one thread, whose runs are counted
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let (runs, figures) = pool.install(|| {
            let models = model_runs(&job, &model, &result).unwrap();
            let figures = report(&job, &[], &models, &result).all_figures().count();
            (RUNS.get(), figures)
        });
        assert_eq!(runs, job.conditions.len());
        assert!(figures > 8, "{figures}");
    }
}
