//! A fit as a report: what was measured beside what the fitted model shows through the same camera.

mod aligned;
mod animated;
mod drawings;
mod figures;
mod pair;
mod runs;
mod tables;

use super::figure::profiles::Profiles;
use super::figure::searches::Searches;
use super::figure::sensitivities::Sensitivities;
use super::motion::Motion;
use super::{
    CombinationLine, Failed, FigureBlock, FigureGroup, ParameterLine, ProbeLine, Report, RunLine, SearchLine,
    Subject,
};
use crate::fit::failure::RunFailure;
use crate::fit::job::Job;
use crate::fit::result::{FitResult, Status};
use crate::fit::scene_model::SceneModel;
use crate::recording::Recording;
use crate::recording::files::RecordingFile;
use crate::simulate::scene::Scene;
use crate::twin::View;
use pair::Pair;
use rayon::prelude::*;

/// A recording that was fitted, with its description where it has one.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// The traces.
    pub recording: &'a Recording,
    /// `recording.toml`.
    pub file: Option<&'a RecordingFile>,
}

/// The model at the estimates in one condition of the job.
#[derive(Debug, Clone)]
pub struct Best {
    /// The scene with the estimates in it.
    pub scene: Scene,
    /// What the condition's camera sees.
    pub view: View,
    /// The motion itself.
    pub motion: Motion,
}

/// The model at the estimates, condition by condition.
///
/// # Errors
/// [`RunFailure`] when nothing could be seen.
pub fn best(job: &Job, model: &SceneModel, result: &FitResult) -> Result<Vec<Best>, RunFailure> {
    let values: Vec<f64> =
        job.parameters.iter().filter_map(|p| result.parameters.get(&p.name)).map(|p| p.estimate).collect();
    let at = |condition| {
        let (scene, view) = (model.scene_at(&values, condition)?, model.look(&values, condition)?);
        Ok(Best { motion: Motion::of(&scene), scene, view })
    };
    (0..job.conditions.len()).into_par_iter().map(at).collect()
}

/// The report of a fit, but for its provenance.
#[must_use]
pub fn report(job: &Job, measured: &[Measured], best: &[Best], result: &FitResult) -> Report {
    let pairs = Pair::all(job, measured, best, result);
    let report = lines(job, measured, &pairs, result);
    let groups = [
        (Subject::Measured, figures::blocks(&pairs)),
        (Subject::Blade, drawings::blocks(&pairs)),
        (Subject::Parameters, of_parameters(job, result, &report.parameters)),
    ];
    Report {
        figures: groups.into_iter().map(group).filter(|group| !group.figures.is_empty()).collect(),
        ..report
    }
}

/// The same without its figures, which take most of the time.
#[must_use]
pub fn in_words(job: &Job, measured: &[Measured], best: &[Best], result: &FitResult) -> Report {
    lines(job, measured, &Pair::all(job, measured, best, result), result)
}

fn lines(job: &Job, measured: &[Measured], pairs: &[Pair], result: &FitResult) -> Report {
    Report {
        title: job.title.clone(),
        search: search(result),
        recordings: measured.iter().map(tables::recording).collect(),
        components: tables::components(job, measured, result),
        features: tables::features(job, measured, &result.features),
        held_out: tables::features(job, measured, &result.held_out),
        parameters: tables::parameters(job, measured, result),
        combinations: result.combinations.iter().map(combination).collect(),
        advice: result.gate.advice.clone(),
        runs: pairs.iter().map(run).collect(),
        gate: result.gate.probes.iter().map(probe).collect(),
        gate_notes: result.gate.notes.clone(),
        notes: notes(measured, result),
        ..Report::default()
    }
}

/// What the fit knows of its parameters.
fn of_parameters(job: &Job, result: &FitResult, lines: &[ParameterLine]) -> Vec<FigureBlock> {
    let blocks = [
        Profiles::of(job, result, lines).block(),
        Searches::of(job, result).block(),
        Sensitivities::of(job, result).block(),
    ];
    blocks.into_iter().flatten().collect()
}

fn run(pair: &Pair) -> RunLine {
    let name = pair.job.conditions.get(pair.condition).map_or("", |condition| condition.name.as_str());
    RunLine { opposed: pair.aligned.opposed, ..runs::line(name, pair.best.scene.start_s, &pair.best.motion) }
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
        foreign: result.evaluations.foreign,
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
    notes.push(
        "every other number of the scene is taken as exact: the intervals know nothing of its error"
            .to_owned(),
    );
    if measured.is_empty() {
        notes.push("Only published values were fitted: there is no recording, and the traces shown are the model's alone; a value that the job assumes counts as published here.".to_owned());
    }
    notes
}
