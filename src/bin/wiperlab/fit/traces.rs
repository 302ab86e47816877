//! A fit to traces, with its journal of iterates.

use super::Solved;
use crate::failure::Failure;
use crate::files::{self, Maker, Overwrite, Place, Writer};
use crate::global::Global;
use crate::interrupt;
use crate::journal::{JOURNAL, JournalFile};
use crate::problem::Problem;
use crate::progress;
use indicatif::ProgressBar;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use wiperlab::fit::iterates::Step;
use wiperlab::fit::result::Status;
use wiperlab::fit::trace_ledger::TraceProgress;

/// Iterates that a stage takes, about, from the recovery study: for the estimate of the time left.
const ITERATES_A_STAGE: usize = 14;
/// Starts that most fits take: two that agree.
const STARTS: usize = 2;

impl Problem {
    /// Fits the traces, and writes the journal as it goes and the result at the end.
    pub fn solve_traces(
        &self,
        global: &Global,
        resume: bool,
        most: Option<usize>,
        overwrite: Overwrite,
    ) -> Result<Solved, Failure> {
        let writer = Writer::new(Maker::Fit, overwrite);
        Place::check(&self.folder, &writer, &[files::RESULT])?;
        let path = self.folder.join(JOURNAL);
        let name = path.display().to_string();
        let (mut sink, resumed) = JournalFile::open::<Step>(&path, resume)?;
        let expected =
            (STARTS * self.problem.segment_s().len() * ITERATES_A_STAGE).min(most.unwrap_or(usize::MAX));
        let bar = progress::bar(expected as u64, "fit", "iterates", global.quiet);
        let journaled = Arc::new(AtomicUsize::new(resumed.as_ref().map_or(0, |found| found.records.len())));
        let kept = self.kept(&name, "iterates", &journaled);
        let stops = interrupt::stops(kept.clone());
        let mut replayed = 0;
        let stages = self.problem.segment_s().to_vec();
        let mut on_iterate = |now: &TraceProgress| {
            show(&bar, now, replayed, &stages);
            replayed = now.replayed;
            journaled.fetch_max(now.iterates, Ordering::Relaxed);
            interrupt::flow()
        };
        let resume = resumed.as_ref().map(|journal| (name.as_str(), journal));
        let clock = Instant::now();
        let fitted = self.problem.fit_traces(resume, most, &mut sink, &mut on_iterate);
        let mut result = fitted.map_err(|error| self.failure(&error))?;
        result.wall_s = Some(clock.elapsed().as_secs_f64());
        bar.finish_and_clear();
        sink.finish()?;
        if result.status == Status::Interrupted {
            // an earlier result stays: what is new is in the journal, and a resumed fit gives its result
            stops.finishing(&kept());
        } else {
            files::write_outputs(&self.folder, &writer, &[(files::RESULT, result.to_json().into_bytes())])?;
        }
        Ok(Solved { result, replayed })
    }
}

/// Moves the bar; the time left follows from the iterates that are made, not from those that were just
/// replayed.
fn show(bar: &ProgressBar, now: &TraceProgress, replayed_before: usize, stages: &[f64]) {
    bar.set_length(bar.length().unwrap_or(0).max(now.iterates as u64));
    bar.set_position(now.iterates as u64);
    if now.replayed > replayed_before {
        bar.reset_eta();
    }
    let (start, bad, all) = (now.start + 1, now.bad_segments, now.segments);
    let length_ms = 1e3 * stages.get(now.stage).copied().unwrap_or_default();
    bar.set_message(format!(
        "start {start}, segments of {length_ms} ms, {bad} of {all} bad, cost {:.1}",
        now.cost
    ));
}
