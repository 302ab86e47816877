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
