//! A fit to traces, with its journal of iterates.

use super::CompletedFit;
use crate::cli::checkpoint::{CHECKPOINT_FILE, CheckpointWriter};
use crate::cli::job::LoadedJob;
use crate::cli::prelude::*;
use crate::fit::result::FitStatus;
use crate::fit::trace::UncertaintyRun;
use crate::fit::trace_checkpoint::IterateRecord;
use crate::fit::trace_ledger::TraceProgress;
use indicatif::ProgressBar;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Iterates that a stage takes, about, from the recovery study: for the estimate of the time left.
const ITERATES_A_STAGE: usize = 14;
/// Starts that most fits take: two that agree.
const STARTS: usize = 2;
/// Iterates that a twin takes, about, and a side of a parameter.
const ITERATES_A_TWIN: usize = 5;
const ITERATES_A_SIDE: usize = 2;

impl LoadedJob {
    /// Fits the traces, and writes the journal as it goes and the result at the end.
    pub(crate) fn solve_traces(
        &self,
        global: &GlobalArgs,
        resume: bool,
        most: Option<usize>,
        overwrite: Overwrite,
    ) -> Outcome<CompletedFit> {
        let writer = global.write_policy(OutputCommand::Fit, overwrite);
        self.check_outputs(&writer)?;
        let path = self.folder.join(CHECKPOINT_FILE);
        let (mut sink, resumed) = CheckpointWriter::open::<IterateRecord>(&path, resume)?;
        let name = path.display().to_string();
        let expected = self.expected_iterates().min(most.unwrap_or(usize::MAX));
        let bar = progress::start_bar(expected as u64, "fit", "iterates", global.quiet);
        let journaled = Arc::new(AtomicUsize::new(resumed.as_ref().map_or(0, |found| found.records.len())));
        let kept = self.saved_progress(&name, "iterates", &journaled);
        let stops = interrupt::register_stoppable(kept.clone());
        let mut replayed = 0;
        let stages = self.problem.segment_s().to_vec();
        let mut on_iterate = |now: &TraceProgress| {
            update_trace_bar(&bar, now, replayed, &stages);
            replayed = now.replayed;
            journaled.fetch_max(now.iterates, Ordering::Relaxed);
            interrupt::control_flow()
        };
        let resume = resumed.as_ref().map(|journal| (name.as_str(), journal));
        let clock = Instant::now();
        let fitted = self.problem.fit_traces(resume, most, &mut sink, &mut on_iterate);
        let result = fitted.map_err(|error| self.fit_failure(&error))?;
        let wall = clock.elapsed();
        bar.finish_and_clear();
        sink.finish()?;
        if result.status == FitStatus::Interrupted {
            // an earlier result stays: what is new is in the journal, and a resumed fit gives its result
            stops.announce_stop(&kept());
        } else {
            self.write_outputs(&result, &writer)?;
        }
        Ok(CompletedFit { result, replayed, wall })
    }

    fn expected_iterates(&self) -> usize {
        let search = STARTS * self.problem.segment_s().len() * ITERATES_A_STAGE;
        let (twins, parameters) = (self.job().intervals.bootstrap, self.job().parameters.len());
        search + ITERATES_A_TWIN * twins + 2 * ITERATES_A_SIDE * parameters
    }
}

/// Moves the bar; the time left follows from the iterates that are made, not from those that were just
/// replayed.
fn update_trace_bar(bar: &ProgressBar, now: &TraceProgress, replayed_before: usize, stages: &[f64]) {
    bar.set_length(bar.length().unwrap_or(0).max(now.iterates as u64));
    bar.set_position(now.iterates as u64);
    if now.replayed > replayed_before {
        bar.reset_eta();
    }
    let (bad, all) = (now.bad_segments, now.segments);
    let length_ms = 1e3 * stages.get(now.stage).copied().unwrap_or_default();
    let chain = match UncertaintyRun::from_chain_number(now.start) {
        None => format!("start {}", now.start + 1),
        Some(UncertaintyRun::Twin(twin)) => format!("twin {}", twin + 1),
        Some(UncertaintyRun::Shorter | UncertaintyRun::Side { .. }) => "intervals".to_owned(),
    };
    bar.set_message(format!("{chain}, segments of {length_ms} ms, {bad} of {all} bad, cost {:.1}", now.cost));
}
