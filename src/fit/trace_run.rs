//! One run of a trace fit, from the journal to the result.

use super::error::FitError;
use super::iterates::{Body, Coordinate, Header, Journal, Step};
use super::problem::Problem;
use super::result::{FitResult, Status};
use super::targets::targets;
use super::trace::{Branch, Descent, End, Settings, TraceModel, advance, begin, search, start_point};
use super::trace_ledger::{OnIterate, Stopped, TraceLedger, recheck};
use super::trace_result::Found;
use crate::journal::{Exact, Sink};

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
        resume: Option<(&str, &Journal)>,
        most: Option<usize>,
        journal: &mut dyn Sink,
        on_iterate: &mut OnIterate,
    ) -> Result<FitResult, FitError> {
        let model = self.trace_model().ok_or_else(|| cannot("it has no [[trace]]"))?;
        let model = model.map_err(|error| cannot(&error.to_string()))?;
        let targets = targets(self.job(), self.recordings())?;
        let seed = self.job().search.seed;
        let settings =
            Settings { segment_s: self.segment_s().to_vec(), twins: self.job().intervals.bootstrap };
        let header = self.header_of(&model);
        let most = most.unwrap_or(usize::MAX);
        if most == 0 {
            return Err(FitError::NoEvaluation { allowed: most });
        }
        let mut ledger = TraceLedger::new(&header, resume, most, journal, on_iterate)?;
        if let Some((file, found)) = resume {
            recheck(file, found, |chain, before| match (Branch::of(chain), before) {
                (Some(_), _) => None, // (of an end that is not known yet)
                (None, None) => begin(&model, &settings, &start_point(&model, seed, chain)),
                (None, Some(before)) => advance(&model, &settings, before),
            })?;
        }
        let searched = search(&model, &settings, seed, &mut ledger);
        if let Some((file, found)) = resume {
            let best = searched.descents.get(searched.best).and_then(Descent::end);
            let end = best.and_then(|at| End::new(&model, &settings, seed, at));
            recheck(file, found, |chain, before| end.as_ref()?.next(Branch::of(chain)?, before))?;
        }
        if let Some(Stopped::Journal(problem)) = ledger.stopped() {
            return Err(FitError::JournalWrite { problem: problem.clone() });
        }
        let found = Found { problem: self, model: &model, searched: &searched, ledger: &ledger };
        let mut result = found.into_result().ok_or_else(|| cannot(NO_SEGMENT))?;
        if result.status != Status::Interrupted {
            let (shown, held_out) = self.checked(&result, targets)?;
            (result.components, result.features, result.held_out) =
                (shown.components, shown.features, held_out);
        }
        Ok(result)
    }

    /// Names of the recordings whose traces are fitted.
    pub(super) fn trace_names(&self) -> Vec<String> {
        let name = |condition: usize| self.job().conditions[condition].name.clone();
        self.traces().iter().map(|trace| name(trace.condition)).collect()
    }

    fn header_of(&self, model: &TraceModel) -> Header {
        let recordings = self.trace_names();
        let unknowns = model.unknowns.0.iter().map(|unknown| Coordinate::of(unknown, &recordings)).collect();
        let segment_s = self.segment_s().iter().copied().map(Exact).collect();
        let body = Body { seed: self.job().search.seed, recordings, segment_s, unknowns };
        Header::of::<Step>(self.fingerprint(), env!("CARGO_PKG_VERSION"), body)
    }
}

fn cannot(why: &str) -> FitError {
    FitError::CannotBeFitted { why: why.to_owned() }
}

/// Why nothing could be fitted at all.
const NO_SEGMENT: &str = "no segment of the traces could be started: the model runs nowhere within the bounds, or \
                          the tip slides in too few frames; look at the recording with `wiperlab inspect`";
