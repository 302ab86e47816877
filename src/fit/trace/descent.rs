//! One search from one start, as a solver of argmin's loop: an iteration is an iterate of the chain.
//!
//! argmin's own Gauss-Newton solvers know neither states that are eliminated nor stages.

use super::chain::{first_iterate, next_iterate};
use super::iterate::{Iterate, TraceSearchSettings};
use super::keep::Checkpoint;
use super::model::TraceModel;
use argmin::core::{Error, Executor, IterState, KV, Problem, Solver, TerminationReason, TerminationStatus};

/// Distance of two ends, in standard deviations of each unknown, up to which they are one place.
pub const SAME_END_SD: f64 = 1.0;

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
    #[must_use]
    pub fn first_stage_cost(&self) -> f64 {
        self.stages.first().map_or(f64::INFINITY, |first| first.cost)
    }

    /// The last iterate.
    #[must_use]
    pub fn last_iterate(&self) -> Option<&Iterate> {
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
