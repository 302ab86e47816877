//! One run of a trace fit, from the journal to the result.

use super::error::FitError;
use super::iterates::{HeaderCoordinate, IterateRecord, TraceCheckpoint, TraceHeader, TraceHeaderBody};
use super::problem::Problem;
use super::result::{FitResult, FitStatus};
use super::targets::measure_targets;
use super::trace::{
    SearchEnd, TraceDescent, TraceModel, TraceSearchSettings, UncertaintyRun, first_iterate, next_iterate,
    search_trace, start_point,
};
use super::trace_ledger::{OnIterate, TraceLedger, TraceStopReason, recheck_iterates};
use super::trace_result::TraceFindings;
use crate::journal::{CheckpointSink, ExactNumber};

impl Problem {
    /// Fits the traces of the job, at most to `most` iterates (`None` for as many as it takes), and tells of
    /// every one; goes on from a journal, whose file is named in refusals.
    ///
    /// The result depends on neither threads nor how often the fit was interrupted and resumed.
    ///
    /// # Errors
    /// [`FitError`]; a search that stops early or does not converge is a result and says so.
    pub fn fit_traces(
        &self,
        resume: Option<(&str, &TraceCheckpoint)>,
        most: Option<usize>,
        journal: &mut dyn CheckpointSink,
        on_iterate: &mut OnIterate,
    ) -> Result<FitResult, FitError> {
        let model = self.trace_model().ok_or_else(|| cannot_be_fitted("it has no [[trace]]"))?;
        let model = model.map_err(|error| cannot_be_fitted(&error.to_string()))?;
        let targets = measure_targets(self.job(), self.recordings())?;
        let seed = self.job().search.seed;
        let settings = TraceSearchSettings {
            segment_s: self.segment_s().to_vec(),
            twins: self.job().intervals.bootstrap,
        };
        let header = self.header_for_model(&model);
        let most = most.unwrap_or(usize::MAX);
        if most == 0 {
            return Err(FitError::NoEvaluation { allowed: most });
        }
        let mut ledger = TraceLedger::new(&header, resume, most, journal, on_iterate)?;
        if let Some((file, found)) = resume {
            recheck_iterates(file, found, |chain, before| {
                match (UncertaintyRun::from_chain_number(chain), before) {
                    (Some(_), _) => None, // (of an end that is not known yet)
                    (None, None) => first_iterate(&model, &settings, &start_point(&model, seed, chain)),
                    (None, Some(before)) => next_iterate(&model, &settings, before),
                }
            })?;
        }
        let searched = search_trace(&model, &settings, seed, &mut ledger);
        if let Some((file, found)) = resume {
            let best = searched.descents.get(searched.best).and_then(TraceDescent::last_iterate);
            let end = best.and_then(|at| SearchEnd::new(&model, &settings, seed, at));
            recheck_iterates(file, found, |chain, before| {
                end.as_ref()?.next_iterate(UncertaintyRun::from_chain_number(chain)?, before)
            })?;
        }
        if let Some(TraceStopReason::Journal(problem)) = ledger.stop_reason() {
            return Err(FitError::JournalWrite { problem: problem.clone() });
        }
        let found = TraceFindings { problem: self, model: &model, searched: &searched, ledger: &ledger };
        let mut result = found.into_result().ok_or_else(|| cannot_be_fitted(NO_SEGMENT_STARTED))?;
        if result.status != FitStatus::Interrupted {
            let (shown, held_out) = self.compare_with_targets(&result, targets)?;
            (result.components, result.features, result.held_out) =
                (shown.components, shown.features, held_out);
        }
        Ok(result)
    }

    /// Names of the recordings whose traces are fitted.
    pub(super) fn trace_recording_names(&self) -> Vec<String> {
        let name = |condition: usize| self.job().conditions[condition].name.clone();
        self.traces().iter().map(|trace| name(trace.condition)).collect()
    }

    fn header_for_model(&self, model: &TraceModel) -> TraceHeader {
        let recordings = self.trace_recording_names();
        let unknowns = model
            .unknowns
            .0
            .iter()
            .map(|unknown| HeaderCoordinate::from_unknown(unknown, &recordings))
            .collect();
        let segment_s = self.segment_s().iter().copied().map(ExactNumber).collect();
        let body = TraceHeaderBody { seed: self.job().search.seed, recordings, segment_s, unknowns };
        TraceHeader::new::<IterateRecord>(self.fingerprint(), env!("CARGO_PKG_VERSION"), body)
    }
}

fn cannot_be_fitted(why: &str) -> FitError {
    FitError::CannotBeFitted { why: why.to_owned() }
}

/// Why nothing could be fitted at all.
const NO_SEGMENT_STARTED: &str = "no segment of the traces could be started: the model runs nowhere within the bounds, or \
                          the tip slides in too few frames; look at the recording with `wiperlab inspect`";
