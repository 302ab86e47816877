//! The chains of iterates behind the best end of a search, which know nothing of each other.

use super::branch::{SearchEnd, UncertaintyRun};
use super::chain::{outer_step, restart_stage};
use super::iterate::Iterate;
use super::keep::Checkpoint;
use super::model::TraceModel;
use super::profile::pin_unknown;
use super::twin::simulate_twin;
use rayon::prelude::*;
use std::borrow::Cow;

/// Chains that are made together: the order of the iterates does not depend on the number of threads, and no
/// more of them are lost when the program is killed.
const RUNS_TOGETHER: usize = 8;

impl<'a> SearchEnd<'a> {
    /// The iterate of a branch after one, and the first one; `None` at its end.
    #[must_use]
    pub fn next_iterate(&self, branch: UncertaintyRun, before: Option<&Iterate>) -> Option<Iterate> {
        if before.is_some_and(|before| branch.is_complete(before)) {
            return None;
        }
        let root = self.run_start(branch);
        Some(before.map_or(root.first, |before| outer_step(&root.model, before)))
    }

    fn run_start(&self, branch: UncertaintyRun) -> RunStart<'a> {
        let (model, first) = match branch {
            UncertaintyRun::Twin(draw) => {
                let (model, first) = simulate_twin(self, draw);
                (Cow::Owned(model), first)
            }
            UncertaintyRun::Shorter => {
                let first =
                    restart_stage(self.model, self.settings, self.at.stage.saturating_sub(1), self.at);
                (Cow::Borrowed(self.model), first)
            }
            UncertaintyRun::Side { unknown, above } => {
                let (model, first) = pin_unknown(self, unknown, self.profile_offset(unknown, above));
                (Cow::Owned(model), first)
            }
        };
        // (a place that the scene refuses is an end too, which nothing is read from)
        let nowhere = || Iterate { cost: f64::MAX, settled: true, ..self.at.clone() };
        RunStart { model, first: Iterate { number: 0, ..first.unwrap_or_else(nowhere) } }
    }
}

/// Where a branch begins.
struct RunStart<'a> {
    model: Cow<'a, TraceModel>,
    first: Iterate,
}

/// A branch on its way.
struct RunProgress<'a> {
    branch: UncertaintyRun,
    root: Option<RunStart<'a>>,
    place: usize,
    last: Option<Iterate>,
}

impl RunProgress<'_> {
    fn is_open(&self) -> bool {
        !self.last.as_ref().is_some_and(|last| self.branch.is_complete(last))
    }

    fn accept_iterate(&mut self, next: Iterate) {
        (self.last, self.place) = (Some(next), self.place + 1);
    }
}

impl<'a> RunProgress<'a> {
    fn next_iterate(&mut self, end: &SearchEnd<'a>) -> Iterate {
        let root = self.root.get_or_insert_with(|| end.run_start(self.branch));
        self.last.as_ref().map_or_else(|| root.first.clone(), |last| outer_step(&root.model, last))
    }
}

/// Follows branches to their ends, several at once: the last iterate of each, in order, where the scene does
/// not refuse every place of it. `None` where it was asked to stop.
pub(super) fn follow_runs(
    end: &SearchEnd<'_>,
    branches: &[UncertaintyRun],
    keep: &mut dyn Checkpoint,
) -> Option<Vec<Option<Iterate>>> {
    let mut ends = Vec::new();
    // (twins are behind the others also where they are wanted later)
    let kinds = branches.chunk_by(|a, b| a.is_twin() == b.is_twin());
    for branches in kinds.flat_map(|kind| kind.chunks(RUNS_TOGETHER)) {
        let begun =
            |branch: &UncertaintyRun| RunProgress { branch: *branch, root: None, place: 0, last: None };
        let mut ways: Vec<RunProgress<'_>> = branches.iter().map(begun).collect();
        while ways.iter().any(RunProgress::is_open) {
            let mut due: Vec<&mut RunProgress<'_>> = Vec::new();
            for way in ways.iter_mut().filter(|way| way.is_open()) {
                match keep.find_iterate(way.branch.chain_number(), way.place) {
                    Some(known) => way.accept_iterate(known),
                    None => due.push(way),
                }
            }
            let made: Vec<Iterate> = due.par_iter_mut().map(|way| way.next_iterate(end)).collect();
            for (way, made) in due.into_iter().zip(made) {
                if keep.store_iterate(way.branch.chain_number(), way.place, &made).is_break() {
                    return None;
                }
                way.accept_iterate(made);
            }
        }
        ends.extend(ways.into_iter().map(|way| way.last.filter(|last| last.cost < f64::MAX)));
    }
    Some(ends)
}
