//! A parameter study: a scene run at every point of a grid over its parameters, or of a sample of them, and
//! what is read from each run.
//!
//! A point whose run ends early, or does not show what is read, has a reason instead of a value
//! ([`MissingReason`]); nothing is filled in. Points do not know each other, so a study gives the same numbers for
//! any number of threads, and goes on from a [`journal`] of the points that are done.

pub mod collect;
pub mod grid;
pub mod journal;
pub mod outputs;
pub mod point;
pub mod rank_correlation;
pub mod study;

pub use crate::feature::MissingReason;
pub use collect::{CollectError, PointCollection};
pub(crate) use grid::SamplePlan;
pub(crate) use grid::{AxisSpacing, SweepAxis};
pub(crate) use journal::PointRecheck;
pub use point::{EarlyEnd, PointOutcome};
pub use rank_correlation::RankCorrelations;
pub use study::{SHEET_NAME, Study, StudyError, SweepMap};

use crate::checkpoint::{CheckpointSink, Shard, format_record_line};
use crate::simulate::scene::Scene;
use journal::SweepPoint;
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
/// kept in memory: what the points gave is read from their [`journal`], such as by a [`PointCollection`].
///
/// # Errors
/// [`SweepError`] when the journal cannot be written, or when `flow` breaks before the last point.
pub fn run_sweep(
    study: &Study,
    scene: &Scene,
    shard: Shard,
    due: &(dyn Fn(usize) -> bool + Sync),
    sink: &mut dyn CheckpointSink,
    done: &(dyn Fn() + Sync),
    flow: &(dyn Fn() -> ControlFlow<()> + Sync),
) -> Result<(), SweepError> {
    std::thread::scope(|scope| {
        // the disk is waited for on a thread of its own, while others compute
        let (to_disk, lines) = sync_channel::<String>(WAITING);
        let writer = scope.spawn(move || write_lines(&lines, sink, done));
        let point = |index: usize| {
            if flow().is_break() {
                return Err(SweepError::Interrupted);
            }
            let line = format_record_line(
                &SweepPoint { index, outcome: PointOutcome::run_point(study, scene, index) },
                index,
            );
            // nobody receives it after a failure, which the writer reports
            to_disk.send(line).map_err(|_| SweepError::Interrupted)
        };
        let places = (0..shard.count_points(study.point_count())).into_par_iter();
        let ran =
            places.map(|place| shard.point_index(place)).filter(|index| due(*index)).try_for_each(point);
        drop(to_disk);
        let panicked = |_| Err("the thread that writes it failed".to_owned());
        let written = writer.join().unwrap_or_else(panicked);
        written.map_err(|problem| SweepError::JournalWrite { problem }).and(ran)
    })
}

/// What every point of a small study gives, in the order of the study, without a journal.
#[must_use]
pub fn run_all_points(study: &Study, scene: &Scene) -> Vec<PointOutcome> {
    (0..study.point_count())
        .into_par_iter()
        .map(|index| PointOutcome::run_point(study, scene, index))
        .collect()
}

/// Writes lines as they come; those that came while the disk was busy go together.
fn write_lines(
    lines: &Receiver<String>,
    sink: &mut dyn CheckpointSink,
    done: &(dyn Fn() + Sync),
) -> Result<(), String> {
    while let Ok(first) = lines.recv() {
        let waiting: Vec<String> = std::iter::once(first).chain(lines.try_iter()).collect();
        sink.append(&waiting.concat())?;
        waiting.iter().for_each(|_| done());
    }
    Ok(())
}
