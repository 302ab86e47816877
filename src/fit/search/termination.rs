//! Outcome and thresholds of a search.

use crate::fit::evaluation::Evaluation;
use crate::fit::ledger::StopReason;

/// Reason why a search ended. The best point is in the ledger.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SearchTermination {
    /// Simplices of several sizes at the best point gained nothing.
    Converged,
    /// The search was stopped, usually by the budget.
    Stopped(StopReason),
}

/// Result of a local search.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalDescent {
    /// Evaluation at its first point.
    pub start: Evaluation,
    /// Evaluation at its last point.
    pub end: Evaluation,
    /// Number of its evaluations.
    pub evaluations: usize,
}

/// Outcome of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchOutcome {
    /// Reason why it ended.
    pub termination: SearchTermination,
    /// The local searches, one per start; the last one is the polish of the best point.
    pub descents: Vec<LocalDescent>,
}

/// Points whose coordinates in the unit box all differ by less than this value count as one start: a descent
/// crosses half of this distance in one step.
pub(crate) const MIN_START_DISTANCE: f64 = 0.2;
/// Edges of the simplices in the unit box, used in turn. The first simplex stays in the basin of the best
/// point. The second steps over a kink, or along a valley in which the first collapsed. The third fits into
/// a narrow valley.
pub(crate) const SIMPLEX_EDGES: [f64; 3] = [0.05, 0.2, 0.01];
/// A simplex has converged if the spread of its costs is below this value: the square of a hundredth of a
/// standard deviation of a feature.
pub const SIMPLEX_COST_SPREAD: f64 = 1e-4;
/// Gain in cost below which another step is not worthwhile: 2 % of the rise of 1 at the ends of a
/// 68 % interval.
pub const MIN_WORTHWHILE_GAIN: f64 = 0.02;
/// Cost below which a fit counts as exact: the square of a thousandth of a standard deviation of one feature.
pub const EXACT_COST: f64 = 1e-6;
