//! Outcome of a search, and its thresholds.

use crate::fit::evaluation::Evaluation;
use crate::fit::journal::StopReason;

/// Reason why a search ended. The best point is in the ledger.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SearchTermination {
    /// Simplices of several sizes at the best point did not lower the cost further.
    Converged,
    /// The search was stopped, usually by the budget.
    Stopped(StopReason),
}

/// Result of a local search.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalDescent {
    /// Evaluation at the first point of the search.
    pub start: Evaluation,
    /// Evaluation at the last point of the search.
    pub end: Evaluation,
    /// Number of evaluations in the search.
    pub evaluations: usize,
}

/// Outcome of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchOutcome {
    /// Reason why the search ended.
    pub termination: SearchTermination,
    /// The local searches, one per start; the last entry is the polish of the best point.
    pub descents: Vec<LocalDescent>,
}

/// Points whose coordinates in the unit box all differ by less than this value count as the same starting
/// point, because a descent crosses half of this distance in one step.
pub(crate) const MIN_START_DISTANCE: f64 = 0.2;
/// Edge lengths of the simplices in the unit box, used one after the other. The first simplex stays in the
/// basin of the best point. The second steps over a kink of the cost, or along a valley in which the first
/// collapsed. The third fits into a narrow valley.
pub(crate) const SIMPLEX_EDGES: [f64; 3] = [0.05, 0.2, 0.01];
/// A simplex has converged if the standard deviation of the costs at its vertices is below this value. A
/// residual of a hundredth of a standard deviation has this cost.
pub const SIMPLEX_COST_SPREAD: f64 = 1e-4;
/// Decrease of the cost below which another step is not worthwhile: 2 % of the rise in cost at the ends of a
/// 68 % interval, which is 1.
pub const MIN_WORTHWHILE_GAIN: f64 = 0.02;
/// Cost below which a fit counts as exact. A single residual of a thousandth of a standard deviation has this
/// cost.
pub const EXACT_COST: f64 = 1e-6;
