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
mod recheck;
pub mod study;

pub use crate::feature::Reason;
pub use grid::{Axis, Spacing};
pub use point::{Ended, Outcome};
pub use recheck::recheck;
pub use study::{Map, Study, StudyError};

use crate::journal::{Sink, line};
use crate::simulate::scene::Scene;
use journal::Point;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, channel};

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
/// `sink`, in any order, and `done` is called once for each that is written. `flow` is asked before each of
/// them. The outcomes are in the order of the grid.
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
    std::thread::scope(|scope| {
        // the disk is waited for on a thread of its own, while others compute
        let (to_disk, lines) = channel::<String>();
        let writer = scope.spawn(move || write(&lines, sink, done));
        let outcome = |index: usize| {
            if let Some(outcome) = known.get(index).and_then(Option::as_ref) {
                return Ok(outcome.clone());
            }
            if flow().is_break() {
                return Err(SweepError::Interrupted);
            }
            let outcome = Outcome::of(study, scene, index);
            let line = line(&Point { index, outcome: outcome.clone() }, index);
            // nobody receives it after a failure, which the writer reports
            to_disk.send(line).map(|()| outcome).map_err(|_| SweepError::Interrupted)
        };
        let outcomes: Result<Vec<Outcome>, _> = (0..study.points()).into_par_iter().map(outcome).collect();
        drop(to_disk);
        let panicked = |_| Err("the thread that writes it failed".to_owned());
        let written = writer.join().unwrap_or_else(panicked);
        written.map_err(|problem| SweepError::JournalWrite { problem }).and(outcomes)
    })
}

/// Writes lines as they come; those that came while the disk was busy go together.
fn write(lines: &Receiver<String>, sink: &mut dyn Sink, done: &(dyn Fn() + Sync)) -> Result<(), String> {
    while let Ok(first) = lines.recv() {
        let waiting: Vec<String> = std::iter::once(first).chain(lines.try_iter()).collect();
        sink.append(&waiting.concat())?;
        waiting.iter().for_each(|_| done());
    }
    Ok(())
}
