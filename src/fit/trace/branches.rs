//! The chains of iterates behind the best end of a search, which know nothing of each other.

use super::branch::{Branch, End};
use super::chain::{anew, stepped};
use super::iterate::Iterate;
use super::keep::Keep;
use super::model::TraceModel;
use super::profile::pinned;
use super::twin::twin;
use rayon::prelude::*;
use std::borrow::Cow;

/// Chains that are made together: the order of the iterates does not depend on the number of threads, and no
/// more of them are lost when the program is killed.
const TOGETHER: usize = 8;

impl<'a> End<'a> {
    /// The iterate of a branch after one, and the first one; `None` at its end.
    #[must_use]
    pub fn next(&self, branch: Branch, before: Option<&Iterate>) -> Option<Iterate> {
        if before.is_some_and(|before| branch.ends_with(before)) {
            return None;
        }
        let root = self.root(branch);
        Some(before.map_or(root.first, |before| stepped(&root.model, before)))
    }

    fn root(&self, branch: Branch) -> Root<'a> {
        let (model, first) = match branch {
            Branch::Twin(draw) => {
                let (model, first) = twin(self, draw);
                (Cow::Owned(model), first)
            }
            Branch::Shorter => {
                let first = anew(self.model, self.settings, self.at.stage.saturating_sub(1), self.at);
                (Cow::Borrowed(self.model), first)
            }
            Branch::Side { unknown, above } => {
                let (model, first) = pinned(self, unknown, self.moved(unknown, above));
                (Cow::Owned(model), first)
            }
        };
        // (a place that the scene refuses is an end too, which nothing is read from)
        let nowhere = || Iterate { cost: f64::MAX, settled: true, ..self.at.clone() };
        Root { model, first: Iterate { number: 0, ..first.unwrap_or_else(nowhere) } }
    }
}

/// Where a branch begins.
struct Root<'a> {
    model: Cow<'a, TraceModel>,
    first: Iterate,
}

/// A branch on its way.
struct Way<'a> {
    branch: Branch,
    root: Option<Root<'a>>,
    place: usize,
    last: Option<Iterate>,
}

impl Way<'_> {
    fn is_open(&self) -> bool {
        !self.last.as_ref().is_some_and(|last| self.branch.ends_with(last))
    }

    fn take(&mut self, next: Iterate) {
        (self.last, self.place) = (Some(next), self.place + 1);
    }
}

impl<'a> Way<'a> {
    fn next(&mut self, end: &End<'a>) -> Iterate {
        let root = self.root.get_or_insert_with(|| end.root(self.branch));
        self.last.as_ref().map_or_else(|| root.first.clone(), |last| stepped(&root.model, last))
    }
}

/// Follows branches to their ends, several at once: the last iterate of each, in order, where the scene does
/// not refuse every place of it. `None` where it was asked to stop.
pub(super) fn followed(
    end: &End<'_>,
    branches: &[Branch],
    keep: &mut dyn Keep,
) -> Option<Vec<Option<Iterate>>> {
    let mut ends = Vec::new();
    // (twins are behind the others also where they are wanted later)
    let kinds = branches.chunk_by(|a, b| a.is_twin() == b.is_twin());
    for branches in kinds.flat_map(|kind| kind.chunks(TOGETHER)) {
        let begun = |branch: &Branch| Way { branch: *branch, root: None, place: 0, last: None };
        let mut ways: Vec<Way<'_>> = branches.iter().map(begun).collect();
        while ways.iter().any(Way::is_open) {
            let mut due: Vec<&mut Way<'_>> = Vec::new();
            for way in ways.iter_mut().filter(|way| way.is_open()) {
                match keep.known(way.branch.number(), way.place) {
                    Some(known) => way.take(known),
                    None => due.push(way),
                }
            }
            let made: Vec<Iterate> = due.par_iter_mut().map(|way| way.next(end)).collect();
            for (way, made) in due.into_iter().zip(made) {
                if keep.add(way.branch.number(), way.place, &made).is_break() {
                    return None;
                }
                way.take(made);
            }
        }
        ends.extend(ways.into_iter().map(|way| way.last.filter(|last| last.cost < f64::MAX)));
    }
    Some(ends)
}
