//! A trace fit from the first start to the verdicts: chains of iterates from several starts, and what is
//! known at the best end.

use super::assessment::{TraceAssessment, assess_end};
use super::checkpoint::{Checkpoint, Iterate, TraceSearchSettings, chi2_per_dof};
use super::levenberg_marquardt::{first_iterate, next_iterate};
use super::model::TraceModel;
use super::normal_equations::recording_models;
use super::segment_simulation::RecordingModel;
use super::uncertainty_run::{MAX_STARTS, SearchEnd, follow_runs};
use crate::model::modes::{TipConstraint, natural_modes};
use argmin::core::{Error, Executor, IterState, KV, Problem, Solver, TerminationReason, TerminationStatus};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Starts that are tried at least, and where frames are too far apart for the fastest mode: there other
/// values may give the same frames.
const MIN_STARTS: usize = 2;
const MIN_STARTS_SLOW: usize = 4;

/// A start whose first stage costs this many times the least is in another valley and is given up.
const GIVE_UP_FACTOR: f64 = 3.0;

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceSearchOutcome {
    /// The starts in order.
    pub descents: Vec<TraceDescent>,
    /// Which of them ends best.
    pub best: usize,
    /// Whether it was asked to stop.
    pub stopped: bool,
    /// What is known at the best end; `None` where no start finished.
    pub assessment: Option<TraceAssessment>,
}

/// Searches from the middle of the ranges, then from seeded places until two starts agree; then assesses the
/// best end.
pub fn search_trace(
    model: &TraceModel,
    settings: &TraceSearchSettings,
    seed: u64,
    keep: &mut dyn Checkpoint,
) -> TraceSearchOutcome {
    let mut descents: Vec<TraceDescent> = Vec::new();
    let mut stopped = false;
    for start in 0..MAX_STARTS {
        let descent;
        let least = descents.iter().map(TraceDescent::first_stage_cost).fold(f64::INFINITY, f64::min);
        let point = start_point(model, seed, start);
        (descent, stopped) = descend_from_start(model, settings, point, start, GIVE_UP_FACTOR * least, keep);
        descents.push(descent);
        if stopped || has_enough_starts(model, &descents) {
            break;
        }
    }
    let best = best_descent(&descents);
    let mut found = TraceSearchOutcome { descents, best, stopped, assessment: None };
    let at = found.descents.get(best).and_then(TraceDescent::last_iterate).filter(|_| !stopped);
    let Some(end) = at.and_then(|at| SearchEnd::new(model, settings, seed, at)) else { return found };
    let branches = end.uncertainty_runs();
    match follow_runs(&end, &branches, keep) {
        Some(ends) => {
            let branches: Vec<_> = branches.into_iter().zip(ends).collect();
            found.assessment = Some(assess_end(&end, (&found.descents, best), &branches));
        }
        None => found.stopped = true,
    }
    found
}

/// The middle of every range, or a seeded place for the parameters of wide range.
#[must_use]
pub fn start_point(model: &TraceModel, seed: u64, start: usize) -> Vec<f64> {
    /// Share of a range at either end in which no search starts: the later ones stay nearer to the middle, as
    /// places at the ends of wide bounds often lead nowhere.
    const EDGES: [f64; MAX_STARTS] = [0.1, 0.1, 0.1, 0.3, 0.3, 0.3];
    let edge = EDGES[start.min(MAX_STARTS - 1)];
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed ^ ((start as u64) << 32));
    let place = |unknown: &super::unknowns::TraceUnknown| {
        let share = edge + (1.0 - 2.0 * edge) * generator.random::<f64>();
        let [low, high] = unknown.range;
        // (what has a prior starts where that says)
        if start == 0 || unknown.prior.is_some() { unknown.start } else { low + share * (high - low) }
    };
    model.unknowns.0.iter().map(place).collect()
}

/// Whether as many starts as it takes have ended, and two of them at the same place.
fn has_enough_starts(model: &TraceModel, descents: &[TraceDescent]) -> bool {
    let best = descents[best_descent(descents)].last_iterate();
    let is_slow = best.is_some_and(|end| undersampled_mode(model, end).is_some());
    let fewest = if is_slow { MIN_STARTS_SLOW } else { MIN_STARTS };
    descents.len() >= fewest && another_start_agrees(model, descents)
}

/// Frames a second, and the fastest mode of the blade, Hz, where that has fewer than two frames a period.
#[must_use]
pub fn undersampled_mode(model: &TraceModel, at: &Iterate) -> Option<[f64; 2]> {
    let one = |point: RecordingModel<'_>| {
        let (blade, rate_hz) = (&point.scene.linkage, point.observation.rate_hz);
        let fastest = natural_modes(blade, TipConstraint::Free, blade.shoulder.is_some());
        let fastest_hz = fastest.iter().filter_map(|mode| mode.frequency_hz).fold(0.0, f64::max);
        (2.0 * fastest_hz > rate_hz).then_some([rate_hz, fastest_hz])
    };
    recording_models(model, &at.point)?.into_iter().find_map(one)
}

/// The descent of least cost, those without bad segments first.
fn best_descent(descents: &[TraceDescent]) -> usize {
    let rank = |descent: &TraceDescent| {
        let end = descent.last_iterate();
        let stage = end.map_or(0, |end| end.stage);
        let plain = end.is_some_and(|end| end.plain);
        let cost = end.map_or(f64::INFINITY, |end| end.cost);
        (std::cmp::Reverse(stage), !plain, cost)
    };
    let order = |a: &usize, b: &usize| {
        let [a, b] = [*a, *b].map(|at| rank(&descents[at]));
        (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2))
    };
    (0..descents.len()).min_by(order).unwrap_or(0)
}

/// Whether another start ends where the best one does.
fn another_start_agrees(model: &TraceModel, descents: &[TraceDescent]) -> bool {
    let best = best_descent(descents);
    let Some(end) = descents[best].last_iterate() else { return false };
    let Some(covariance) = super::normal_equations::trace_covariance(model, end) else { return false };
    let widening = chi2_per_dof(end).0.max(1.0).sqrt();
    let others =
        descents.iter().enumerate().filter(|(at, _)| *at != best).filter_map(|(_, d)| d.last_iterate());
    others.filter(|other| other.plain == end.plain && other.stage == end.stage).any(|other| {
        end.point
            .iter()
            .zip(&other.point)
            .enumerate()
            .all(|(i, (a, b))| (a - b).abs() <= SAME_END_SD * widening * covariance.curvature[(i, i)].sqrt())
    })
}

// One search from one start, as a solver of argmin's loop: an iteration is an iterate of the chain.
//
// argmin's own Gauss-Newton solvers know neither states that are eliminated nor stages.

/// Distance of two ends, in standard deviations of each unknown, up to which they are one place.
pub(crate) const SAME_END_SD: f64 = 1.0;

/// The end of one start.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceDescent {
    /// Number of its start, from 0.
    pub start: usize,
    /// Last iterate of each stage that was reached, in order.
    pub stages: Vec<Iterate>,
}

impl TraceDescent {
    /// Cost at the end of the first stage.
    pub(crate) fn first_stage_cost(&self) -> f64 {
        self.stages.first().map_or(f64::INFINITY, |first| first.cost)
    }

    pub(crate) fn last_iterate(&self) -> Option<&Iterate> {
        self.stages.last()
    }
}

/// What a chain works on.
struct DescentProblem<'a> {
    model: &'a TraceModel,
    settings: &'a TraceSearchSettings,
    start: usize,
    point: Vec<f64>,
    /// Cost at the end of the first stage beyond which a start is given up.
    limit: f64,
    checkpoint: &'a mut dyn Checkpoint,
}

/// Where a chain is.
#[derive(Default)]
struct DescentSolver {
    place: usize,
    stages: Vec<Iterate>,
    current: Option<Iterate>,
    ended: bool,
    stopped: bool,
}

type DescentState = IterState<Vec<f64>, (), (), (), (), f64>;

impl DescentSolver {
    /// The next iterate: that of a journal, or a new one, which is kept.
    fn take_iterate(&mut self, chain: &mut DescentProblem<'_>) {
        if self.current.as_ref().is_some_and(|at| at.settled && at.stage == 0 && at.cost > chain.limit) {
            self.ended = true;
            return;
        }
        let known = chain.checkpoint.find_iterate(chain.start, self.place);
        let is_new = known.is_none();
        let next = known.or_else(|| match &self.current {
            None => first_iterate(chain.model, chain.settings, &chain.point),
            Some(before) => next_iterate(chain.model, chain.settings, before),
        });
        let Some(next) = next else {
            self.ended = true;
            return;
        };
        if is_new && chain.checkpoint.store_iterate(chain.start, self.place, &next).is_break() {
            self.stopped = true;
        }
        if let Some(before) = self.current.take().filter(|before| before.stage != next.stage) {
            self.stages.push(before);
        }
        (self.current, self.place) = (Some(next), self.place + 1);
    }
}

impl<'a> Solver<DescentProblem<'a>, DescentState> for &mut DescentSolver {
    fn name(&self) -> &'static str {
        "segments with eliminated states"
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<DescentProblem<'a>>,
        state: DescentState,
    ) -> Result<(DescentState, Option<KV>), Error> {
        if let Some(chain) = &mut problem.problem {
            self.take_iterate(chain);
        }
        let cost = self.current.as_ref().map_or(f64::INFINITY, |iterate| iterate.cost);
        Ok((state.cost(cost), None))
    }

    fn terminate(&mut self, _: &DescentState) -> TerminationStatus {
        match () {
            () if self.stopped => TerminationStatus::Terminated(TerminationReason::Interrupt),
            () if self.ended => TerminationStatus::Terminated(TerminationReason::SolverConverged),
            () => TerminationStatus::NotTerminated,
        }
    }
}

/// A chain from a start to its end, given up where its first stage ends above `limit`; whether it was asked
/// to stop before.
pub(super) fn descend_from_start(
    model: &TraceModel,
    settings: &TraceSearchSettings,
    point: Vec<f64>,
    start: usize,
    limit: f64,
    keep: &mut dyn Checkpoint,
) -> (TraceDescent, bool) {
    let mut progress = DescentSolver::default();
    let chain = DescentProblem { model, settings, start, point, limit, checkpoint: keep };
    // (the solver never fails)
    let _ =
        Executor::new(chain, &mut progress).timer(false).configure(|state| state.max_iters(u64::MAX)).run();
    let mut stages = progress.stages;
    stages.extend(progress.current);
    (TraceDescent { start, stages }, progress.stopped)
}
