//! A parameter study: a scene run at every point of a grid over one or two of its parameters, and what is
//! read from each run.
//!
//! A point whose run ends early, or does not show what is read, has a reason instead of a value
//! ([`Reason`]); nothing is filled in. Points do not know each other, so a study gives the same numbers for
//! any number of threads, and goes on from a [`journal`] of the points that are done.

pub mod grid;
pub mod journal;
pub mod outputs;
pub mod point;
pub mod study;

pub use crate::feature::Reason;
pub use grid::{Axis, Spacing};
pub use point::{Ended, Outcome};
pub use study::{Map, Study, StudyError};

use crate::journal::{Sink, line};
use crate::simulate::scene::Scene;
use journal::Point;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};

/// Why a study stopped.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SweepError {
    /// The journal cannot be written.
    #[error("the journal cannot be written: {problem}")]
    JournalWrite {
        /// Why.
        problem: String,
    },
    /// It was asked to stop; the points that were done are in the journal.
    #[error("the study was asked to stop")]
    Interrupted,
}

/// Runs every point of a checked study that `known` does not hold yet, in parallel; every new one goes to
/// `sink`, in any order, and `done` is called once for each. `flow` is asked before each of them. The outcomes are in the order of
/// the grid.
///
/// # Errors
/// [`SweepError`] when the journal cannot be written, or when `flow` breaks before the last point.
pub fn run(
    study: &Study,
    scene: &Scene,
    known: &[Option<Outcome>],
    sink: &mut dyn Sink,
    done: &(dyn Fn() + Sync),
    flow: &(dyn Fn() -> ControlFlow<()> + Sync),
) -> Result<Vec<Outcome>, SweepError> {
    let sink = Mutex::new(sink);
    let outcome = |index: usize| {
        if let Some(outcome) = known.get(index).and_then(Option::as_ref) {
            return Ok(outcome.clone());
        }
        if flow().is_break() {
            return Err(SweepError::Interrupted);
        }
        let outcome = Outcome::of(study, scene, index);
        sink.lock()
            .unwrap_or_else(PoisonError::into_inner)
            .append(&line(&Point { index, outcome: outcome.clone() }, index))
            .map_err(|problem| SweepError::JournalWrite { problem })?;
        done();
        Ok(outcome)
    };
    (0..study.points()).into_par_iter().map(outcome).collect()
}
