//! A parameter study: a scene run at every point of a grid over its parameters, or of a sample of them, and
//! what is read from each run.
//!
//! A point whose run ends early, or does not show what is read, has a reason instead of a value
//! ([`Reason`]); nothing is filled in. Points do not know each other, so a study gives the same numbers for
//! any number of threads, and goes on from a [`journal`] of the points that are done.

pub mod collect;
pub mod grid;
pub mod journal;
pub mod outputs;
pub mod point;
pub mod rank_correlation;
mod recheck;
pub mod sample;
pub mod study;

pub use crate::feature::Reason;
pub use collect::{CollectError, Collection};
pub use grid::{Axis, Spacing};
pub use point::{Ended, Outcome};
pub use rank_correlation::RankCorrelations;
pub use recheck::Recheck;
pub use sample::Sample;
pub use study::{Map, SHEET, Study, StudyError};

use crate::journal::{Shard, Sink, line};
use crate::simulate::scene::Scene;
use journal::Point;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, sync_channel};

/// Points that may wait for the disk: a disk that is slower than the model does not fill the memory.
const WAITING: usize = 4096;

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

/// Runs every point of a shard of a checked study that is `due`, in parallel; each goes to `sink`, in any
/// order, and `done` is called once for each that is written. `flow` is asked before each of them. Nothing is
/// kept in memory: what the points gave is read from their [`journal`], such as by a [`Collection`].
///
/// # Errors
/// [`SweepError`] when the journal cannot be written, or when `flow` breaks before the last point.
pub fn run(
    study: &Study,
    scene: &Scene,
    shard: Shard,
    due: &(dyn Fn(usize) -> bool + Sync),
    sink: &mut dyn Sink,
    done: &(dyn Fn() + Sync),
    flow: &(dyn Fn() -> ControlFlow<()> + Sync),
) -> Result<(), SweepError> {
    std::thread::scope(|scope| {
        // the disk is waited for on a thread of its own, while others compute
        let (to_disk, lines) = sync_channel::<String>(WAITING);
        let writer = scope.spawn(move || write(&lines, sink, done));
        let point = |index: usize| {
            if flow().is_break() {
                return Err(SweepError::Interrupted);
            }
            let line = line(&Point { index, outcome: Outcome::of(study, scene, index) }, index);
            // nobody receives it after a failure, which the writer reports
            to_disk.send(line).map_err(|_| SweepError::Interrupted)
        };
        let places = (0..shard.count(study.points())).into_par_iter();
        let ran = places.map(|place| shard.index(place)).filter(|index| due(*index)).try_for_each(point);
        drop(to_disk);
        let panicked = |_| Err("the thread that writes it failed".to_owned());
        let written = writer.join().unwrap_or_else(panicked);
        written.map_err(|problem| SweepError::JournalWrite { problem }).and(ran)
    })
}

/// What every point of a small study gives, in the order of the study, without a journal.
#[must_use]
pub fn outcomes(study: &Study, scene: &Scene) -> Vec<Outcome> {
    (0..study.points()).into_par_iter().map(|index| Outcome::of(study, scene, index)).collect()
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
