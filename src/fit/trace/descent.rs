//! One search from one start, as a solver of argmin's loop: an iteration is an iterate of the chain.
//!
//! argmin's own Gauss-Newton solvers know neither states that are eliminated nor stages.

use super::chain::{advance, begin};
use super::iterate::{Iterate, Settings};
use super::keep::Keep;
use super::model::TraceModel;
use argmin::core::{Error, Executor, IterState, KV, Problem, Solver, TerminationReason, TerminationStatus};

/// Distance of two ends, in standard deviations of each unknown, up to which they are one place.
pub const AGREES_SD: f64 = 1.0;

/// The end of one start.
#[derive(Debug, Clone, PartialEq)]
pub struct Descent {
    /// Number of its start, from 0.
    pub start: usize,
    /// Last iterate of each stage that was reached, in order.
    pub stages: Vec<Iterate>,
}

impl Descent {
    /// Cost at the end of the first stage.
    #[must_use]
    pub fn first_cost(&self) -> f64 {
        self.stages.first().map_or(f64::INFINITY, |first| first.cost)
    }

    /// The last iterate.
    #[must_use]
    pub fn end(&self) -> Option<&Iterate> {
        self.stages.last()
    }
}

/// What a chain works on.
struct Chain<'a> {
    model: &'a TraceModel,
    settings: &'a Settings,
    start: usize,
    point: Vec<f64>,
    /// Cost at the end of the first stage beyond which a start is given up.
    limit: f64,
    keep: &'a mut dyn Keep,
}

/// Where a chain is.
#[derive(Default)]
struct Progress {
    place: usize,
    stages: Vec<Iterate>,
    current: Option<Iterate>,
    ended: bool,
    stopped: bool,
}

type Plain = IterState<Vec<f64>, (), (), (), (), f64>;

impl Progress {
    /// The next iterate: that of a journal, or a new one, which is kept.
    fn next(&mut self, chain: &mut Chain<'_>) {
        if self.current.as_ref().is_some_and(|at| at.settled && at.stage == 0 && at.cost > chain.limit) {
            self.ended = true;
            return;
        }
        let known = chain.keep.known(chain.start, self.place);
        let is_new = known.is_none();
        let next = known.or_else(|| match &self.current {
            None => begin(chain.model, chain.settings, &chain.point),
            Some(before) => advance(chain.model, chain.settings, before),
        });
        let Some(next) = next else {
            self.ended = true;
            return;
        };
        if is_new && chain.keep.add(chain.start, self.place, &next).is_break() {
            self.stopped = true;
        }
        if let Some(before) = self.current.take().filter(|before| before.stage != next.stage) {
            self.stages.push(before);
        }
        (self.current, self.place) = (Some(next), self.place + 1);
    }
}

impl<'a> Solver<Chain<'a>, Plain> for &mut Progress {
    fn name(&self) -> &'static str {
        "segments with eliminated states"
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<Chain<'a>>,
        state: Plain,
    ) -> Result<(Plain, Option<KV>), Error> {
        if let Some(chain) = &mut problem.problem {
            self.next(chain);
        }
        let cost = self.current.as_ref().map_or(f64::INFINITY, |iterate| iterate.cost);
        Ok((state.cost(cost), None))
    }

    fn terminate(&mut self, _: &Plain) -> TerminationStatus {
        match () {
            () if self.stopped => TerminationStatus::Terminated(TerminationReason::Interrupt),
            () if self.ended => TerminationStatus::Terminated(TerminationReason::SolverConverged),
            () => TerminationStatus::NotTerminated,
        }
    }
}

/// A chain from a start to its end, given up where its first stage ends above `limit`; whether it was asked
/// to stop before.
pub(super) fn descend(
    model: &TraceModel,
    settings: &Settings,
    point: Vec<f64>,
    start: usize,
    limit: f64,
    keep: &mut dyn Keep,
) -> (Descent, bool) {
    let mut progress = Progress::default();
    let chain = Chain { model, settings, start, point, limit, keep };
    // (the solver never fails)
    let _ =
        Executor::new(chain, &mut progress).timer(false).configure(|state| state.max_iters(u64::MAX)).run();
    let mut stages = progress.stages;
    stages.extend(progress.current);
    (Descent { start, stages }, progress.stopped)
}
