//! One run of a trace fit, from the journal to the result.

use super::error::FitError;
use super::iterates::{Body, Coordinate, Header, Journal, Step};
use super::problem::Problem;
use super::result::{FitResult, Status};
use super::targets::targets;
use super::trace::{
    Branch, Descent, End, Searched, Settings, TraceModel, advance, begin, search, start_point,
};
use super::trace_ledger::{Division, OnIterate, Stopped, TraceLedger, recheck};
use super::trace_result::Found;
use crate::journal::{Exact, Sink};

/// What a run of a divided fit came to.
#[derive(Debug, Clone, PartialEq)]
pub enum Ran {
    /// The result, which also says whether the fit was interrupted.
    Whole(Box<FitResult>),
    /// Chains that this run does not make, and nobody else has made so far.
    Left(Left),
}

/// What is missing of a divided fit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Left {
    /// A start of the search, which every shard makes.
    Start,
    /// Numbers of chains that begin at the end of the search; a shard holds those of its own
    /// ([`Shard::holds`](crate::journal::Shard::holds)).
    Branches(Vec<usize>),
}

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
        match self.fit_divided(Division::Whole, resume, most, journal, on_iterate)? {
            Ran::Whole(result) => Ok(*result),
            Ran::Left(_) => Err(cannot(NO_SEGMENT)), // (nothing is left by a run of the whole)
        }
    }

    /// The same divided among machines: a shard makes its chains, and collecting gives the result, which is
    /// that of one machine to the last bit.
    ///
    /// # Errors
    /// [`FitError`].
    pub fn fit_divided(
        &self,
        division: Division<'_>,
        resume: Option<(&str, &Journal)>,
        most: Option<usize>,
        journal: &mut dyn Sink,
        on_iterate: &mut OnIterate,
    ) -> Result<Ran, FitError> {
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
        let journals: Vec<(&str, &Journal)> = match &division {
            Division::Collected(shards) => resume.iter().chain(shards.iter()).copied().collect(),
            Division::Whole | Division::Shard(..) => resume.into_iter().collect(),
        };
        let is_shard = matches!(division, Division::Shard(..));
        let mut ledger = TraceLedger::new(&header, resume, (division, most), journal, on_iterate)?;
        recheck(&journals, |chain, before| match (Branch::of(chain), before) {
            (Some(_), _) => None, // (of an end that is not known yet)
            (None, None) => begin(&model, &settings, &start_point(&model, seed, chain)),
            (None, Some(before)) => advance(&model, &settings, before),
        })?;
        let searched = search(&model, &settings, seed, &mut ledger);
        let best = searched.descents.get(searched.best).and_then(Descent::end);
        let end = best.filter(|_| !journals.is_empty()).and_then(|at| End::new(&model, &settings, seed, at));
        recheck(&journals, |chain, before| end.as_ref()?.next(Branch::of(chain)?, before))?;
        match ledger.stopped() {
            Some(Stopped::Journal(problem)) => Err(FitError::JournalWrite { problem: problem.clone() }),
            Some(Stopped::Missing) => Ok(Ran::Left(Left::Start)),
            _ if !searched.stopped && (is_shard || !searched.left.is_empty()) => {
                Ok(Ran::Left(Left::Branches(searched.left)))
            }
            _ => self.whole(&model, &searched, &ledger, targets).map(|result| Ran::Whole(Box::new(result))),
        }
    }

    fn whole(
        &self,
        model: &TraceModel,
        searched: &Searched,
        ledger: &TraceLedger<'_, '_>,
        targets: Vec<super::target::Target>,
    ) -> Result<FitResult, FitError> {
        let found = Found { problem: self, model, searched, ledger };
        let mut result = found.into_result().ok_or_else(|| cannot(NO_SEGMENT))?;
        if result.status != Status::Interrupted {
            let (shown, held_out) = self.checked(&result, targets)?;
            (result.components, result.features, result.held_out) =
                (shown.components, shown.features, held_out);
        }
        Ok(result)
    }

    /// First line of every journal of the trace fit, those of its shards included.
    ///
    /// # Errors
    /// [`FitError::CannotBeFitted`] where the job has no traces, or its head is not tracked.
    pub fn trace_header(&self) -> Result<Header, FitError> {
        let model = self.trace_model().ok_or_else(|| cannot("it has no [[trace]]"))?;
        Ok(self.header_of(&model.map_err(|error| cannot(&error.to_string()))?))
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
