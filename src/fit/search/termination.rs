//! What a search did.

use crate::fit::evaluation::Evaluation;
use crate::fit::ledger::StopReason;

/// How a search ended; the best point is in the ledger.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SearchTermination {
    /// Simplices of several sizes from the best point gained nothing.
    Converged,
    /// It was stopped, most often by the budget.
    Stopped(StopReason),
}

/// A local search: where it started and where it came to.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalDescent {
    /// Where it started.
    pub start: Evaluation,
    /// Where it came to.
    pub end: Evaluation,
    /// Evaluations that it took.
    pub evaluations: usize,
}

/// What a search did.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchOutcome {
    /// How it ended.
    pub termination: SearchTermination,
    /// The local searches, one a start; the last one is the polish of the best.
    pub descents: Vec<LocalDescent>,
}

// When a solver has come to its end.

/// Points closer than this in every coordinate of the unit box are one starting point: a descent crosses half
/// of that in a step.
pub(crate) const MIN_START_DISTANCE: f64 = 0.2;
/// Edges of the simplices in the unit box, taken in turn from the best point: the first stays in a basin that
/// a cloud has found, the second steps over a kink or along a valley that has collapsed the first, the third
/// fits into a narrow one.
pub(crate) const SIMPLEX_EDGES: [f64; 3] = [0.05, 0.2, 0.01];
/// Spread of the costs in a simplex at which it has converged, in squared standard deviations: a hundredth of
/// an sd of a feature.
pub const SIMPLEX_COST_SPREAD: f64 = 1e-4;
/// Gain in cost below which another step is not worth taking: 2 % of the gain of 1 that a 68 % interval
/// spans.
pub const MIN_WORTHWHILE_GAIN: f64 = 0.02;
/// Cost that leaves nothing to gain: a thousandth of a standard deviation in one feature.
pub const EXACT_COST: f64 = 1e-6;
