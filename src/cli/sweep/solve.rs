//! Runs the points of a study, or of a part of it, and writes them to a journal.

use super::LoadedStudy;
use crate::checkpoint::{CheckpointSink, Shard, StoredRecord, format_header_line};
use crate::cli::checkpoint::CheckpointWriter;
use crate::cli::prelude::*;
use crate::sweep::journal::SweepPoint;
use crate::sweep::{self, PointRecheck, SweepError};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A part of a study, with its journal.
pub(crate) struct StudyPart<'a> {
    pub shard: Shard,
    pub journal: &'a Path,
    /// Whether the journal is continued; otherwise a new one is begun.
    pub resume: bool,
    /// For each point, whether another journal contains it.
    pub elsewhere: Vec<bool>,
    /// Advice on how to continue after an early stop.
    pub advice: &'static str,
    /// Whether progress is printed even if there is no terminal.
    pub reports: bool,
}

impl LoadedStudy {
    /// Runs the points that the journal of the whole study does not contain; returns `false` if interrupted.
    pub(crate) fn solve(&self, journal: &Path, resume: bool, global: &GlobalArgs) -> Outcome<bool> {
        let (elsewhere, advice) = (Vec::new(), "go on with --resume");
        self.solve_part(
            &StudyPart { shard: Shard::WHOLE, journal, resume, elsewhere, advice, reports: false },
            global,
        )
    }

    /// Runs those points of a part that no journal contains, and appends them to the journal of the part;
    /// returns `false` if interrupted.
    pub(crate) fn solve_part(&self, part: &StudyPart, global: &GlobalArgs) -> Outcome<bool> {
        let (header, name) = (self.header(), part.journal.display().to_string());
        let points = self.study.point_count();
        let mut known = part.elsewhere.clone();
        known.resize(points, false);
        let mut own = vec![false; points];
        let mut recheck = PointRecheck::new(points as u64);
        let mut each = |found: StoredRecord<SweepPoint>| {
            let index = found.record.index;
            match own.get_mut(index) {
                Some(before) if *before => {
                    return Err(crate::checkpoint::duplicate_record_error(&name, &found, ""));
                }
                Some(before) => *before = true,
                None => {}
            }
            recheck.offer_point(found);
            Ok(())
        };
        let (mut sink, found) = CheckpointWriter::open_each(part.journal, part.resume, &mut each)?;
        if let Some(found) = &found {
            found.check_matches::<SweepPoint>(&name, &header).map_err(Failure::input)?;
            recheck.check_points(&self.study, &self.scene, &name).map_err(Failure::input)?;
        } else {
            sink.append(&format_header_line(&header)).map_err(Failure::Internal)?;
        }
        known.iter_mut().zip(&own).for_each(|(known, own)| *known |= own);
        let all = part.shard.count_points(points);
        let taken = (0..all).filter(|place| known.get(part.shard.point_index(*place)) == Some(&true)).count();
        if taken > 0 {
            let line = format!("{taken} of {all} points are taken from the journal");
            progress::print_progress(global.quiet, &line);
        }
        let bar = progress::start_bar((all - taken) as u64, "sweep", "points", global.quiet);
        let reporter = progress::ProgressReporter::new(&bar, part.reports && !global.quiet);
        let journaled = Arc::new(AtomicUsize::new(taken));
        let kept = {
            let (advice, journaled) = (part.advice, Arc::clone(&journaled));
            move || {
                let done = journaled.load(Ordering::Relaxed);
                format!("{name} holds {done} of {all} points; {advice}")
            }
        };
        let stops = interrupt::register_stoppable(kept.clone());
        let done = || {
            bar.inc(1);
            journaled.fetch_add(1, Ordering::Relaxed);
            reporter.report_if_due();
        };
        let due = |index: usize| known.get(index) != Some(&true);
        let (study, scene, go_on) = (&self.study, &self.scene, &interrupt::control_flow);
        let ran = sweep::run_sweep(study, scene, part.shard, &due, &mut sink, &done, go_on);
        bar.finish_and_clear();
        sink.finish()?;
        match ran {
            Ok(()) => Ok(true),
            Err(SweepError::Interrupted) => {
                stops.announce_stop(&kept());
                Ok(false)
            }
            Err(failed) => Err(Failure::internal(failed)),
        }
    }
}
