//! How a model run that did not complete ended, for the user.

use crate::simulate::{Run, Status};

/// Status, time and meaning; `None` for a run that completed.
pub fn early_end(run: &Run) -> Option<String> {
    (run.status != Status::Completed)
        .then(|| format!("{} at {} s: {}", run.status.name(), run.stopped_at_s, run.status.meaning()))
}
