//! A parameter study: a scene is simulated at every point of a grid or a sample, and readings are taken from
//! each run.
//!
//! A point whose run ends early or lacks a reading has a reason instead of a value ([`MissingReason`]);
//! missing values are not filled in. Points are independent of each other, so the numbers do not depend on
//! the number of threads, and a study resumes from a [`journal`] of finished points.

pub mod collect;
pub mod grid;
pub mod journal;
pub mod outputs;
pub mod point;
pub mod rank_correlation;
pub mod study;

pub use crate::feature::MissingReason;
pub use collect::{CollectError, PointCollection};
pub(crate) use grid::{AxisSpacing, SamplePlan, SweepAxis};
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

/// Maximum number of finished points that may wait to be written. It keeps a slow disk from filling the
/// memory.
const WAITING: usize = 4096;

/// Reason why a study stopped.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SweepError {
    /// The journal cannot be written.
    #[error("the journal cannot be written: {problem}")]
    JournalWrite {
        /// Reason why it cannot be written.
        problem: String,
    },
    /// The caller asked the study to stop; the journal contains the finished points.
    #[error("the study was asked to stop")]
    Interrupted,
}

/// Runs the points of a shard for which `due` returns true, in parallel.
///
/// `flow` is called before each point and may stop the study. Finished points go to `sink` in any order; once
/// they are written, `done` is called for each of them. No outcome stays in memory: a [`PointCollection`]
/// reads the outcomes from the [`journal`].
///
/// # Errors
/// [`SweepError`] if the journal cannot be written, or if `flow` breaks before the last point.
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
        // one thread waits for the disk while the others compute
        let (to_disk, lines) = sync_channel::<String>(WAITING);
        let writer = scope.spawn(move || write_lines(&lines, sink, done));
        let point = |index: usize| {
            if flow().is_break() {
                return Err(SweepError::Interrupted);
            }
            let outcome = PointOutcome::run_point(study, scene, index);
            let line = format_record_line(&SweepPoint { index, outcome });
            // the channel closes only after a failure, which the writer reports
            to_disk.send(line).map_err(|_| SweepError::Interrupted)
        };
        let places = (0..shard.count_points(study.point_count())).into_par_iter();
        let ran =
            places.map(|place| shard.point_index(place)).filter(|index| due(*index)).try_for_each(point);
        drop(to_disk);
        let written = writer.join().unwrap_or_else(|_| Err("the thread that writes it failed".to_owned()));
        written.map_err(|problem| SweepError::JournalWrite { problem }).and(ran)
    })
}

/// Runs every point of a small study without a journal; outcomes are in the order of the points.
#[must_use]
pub fn run_all_points(study: &Study, scene: &Scene) -> Vec<PointOutcome> {
    (0..study.point_count())
        .into_par_iter()
        .map(|index| PointOutcome::run_point(study, scene, index))
        .collect()
}

/// Writes lines as they arrive; lines that arrive during a write are written together in the next one.
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
