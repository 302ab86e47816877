//! One run of a trace fit, from the journal to the result.

use super::error::FitError;
use super::iterates::{Body, Coordinate, Header, Journal, Step};
use super::problem::Problem;
use super::result::{FitResult, Status};
use super::targets::targets;
use super::trace::{
    Descent, Iterate, MOST_STARTS, Settings, TraceModel, Twin, advance, begin, search, start_point,
};
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
        let cannot = |why: &str| FitError::CannotBeFitted { why: why.to_owned() };
        let model = self.trace_model().ok_or_else(|| cannot("it has no [[trace]]"))?;
        let model = model.map_err(|error| cannot(&error.to_string()))?;
        let targets = targets(self.job(), self.recordings())?;
        let seed = self.job().search.seed;
        let settings =
            Settings { segment_s: self.segment_s().to_vec(), twins: self.job().intervals.bootstrap };
        let header = self.trace_header(&model);
        let most = most.unwrap_or(usize::MAX);
        if most == 0 {
            return Err(FitError::NoEvaluation { allowed: most });
        }
        let mut ledger = TraceLedger::new(&header, resume, most, journal, on_iterate)?;
        let again = |start: usize, before: Option<&Iterate>| match before {
            _ if start >= MOST_STARTS => None, // (a twin, of an end that is not known yet)
            None => begin(&model, &settings, &start_point(&model, seed, start)),
            Some(before) => advance(&model, &settings, before),
        };
        resume.map_or(Ok(()), |resumed| recheck(resumed, again))?;
        let searched = search(&model, &settings, seed, &mut ledger);
        let end = searched.descents.get(searched.best).and_then(Descent::end);
        let of_twin = |start: usize, before: Option<&Iterate>| {
            Twin::new(&model, end?, seed, start.checked_sub(MOST_STARTS)?).next(before)
        };
        resume.map_or(Ok(()), |resumed| recheck(resumed, of_twin))?;
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

    fn trace_header(&self, model: &TraceModel) -> Header {
        let name = |condition: usize| self.job().conditions[condition].name.clone();
        let recordings: Vec<String> = self.traces().iter().map(|trace| name(trace.condition)).collect();
        let unknowns = model.unknowns.0.iter().map(|unknown| Coordinate::of(unknown, &recordings)).collect();
        let segment_s = self.segment_s().iter().copied().map(Exact).collect();
        let body = Body { seed: self.job().search.seed, recordings, segment_s, unknowns };
        Header::of::<Step>(self.fingerprint(), env!("CARGO_PKG_VERSION"), body)
    }
}

/// Why nothing could be fitted at all.
const NO_SEGMENT: &str = "no segment of the traces could be started: the model runs nowhere within the bounds, or \
                          the tip slides in too few frames; look at the recording with `wiperlab inspect`";
