//! Outcome and thresholds of a search.

use crate::fit::evaluation::Evaluation;
use crate::fit::ledger::StopReason;

/// How a search ended. The best point is in the ledger.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SearchTermination {
    /// Simplices of several sizes from the best point gained nothing.
    Converged,
    /// It was stopped, usually by the budget.
    Stopped(StopReason),
}

/// A local search.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalDescent {
    /// First point.
    pub start: Evaluation,
    /// Last point.
    pub end: Evaluation,
    /// Number of evaluations.
    pub evaluations: usize,
}

/// Outcome of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchOutcome {
    /// How it ended.
    pub termination: SearchTermination,
    /// The local searches, one per start; the last is the polish of the best point.
    pub descents: Vec<LocalDescent>,
}

/// Points that are closer than this in every coordinate of the unit box count as one start: a descent crosses
/// half of that in a step.
pub(crate) const MIN_START_DISTANCE: f64 = 0.2;
/// Edges of the simplices in the unit box, used in turn. The first stays in the basin of the best point, the
/// second steps over a kink or along a valley in which the first collapsed, the third fits a narrow valley.
pub(crate) const SIMPLEX_EDGES: [f64; 3] = [0.05, 0.2, 0.01];
/// Spread of the costs at which a simplex has converged, in squared standard deviations of a feature: the
/// square of a hundredth.
pub const SIMPLEX_COST_SPREAD: f64 = 1e-4;
/// Gain in cost that another step must exceed: 2 % of the rise of 1 at the ends of a 68 % interval.
pub const MIN_WORTHWHILE_GAIN: f64 = 0.02;
/// Cost of an exact fit: the square of a thousandth of a standard deviation of one feature.
pub const EXACT_COST: f64 = 1e-6;
