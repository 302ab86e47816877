//! How a model run that did not complete ended, for the user.

use crate::simulate::{RunResult, RunStatus};

/// Status, time and meaning; `None` for a run that completed.
pub fn describe_early_end(run: &RunResult) -> Option<String> {
    (run.status != RunStatus::Completed)
        .then(|| format!("{} at {} s: {}", run.status.name(), run.stopped_at_s, run.status.meaning()))
}
