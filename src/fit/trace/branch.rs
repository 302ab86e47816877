//! Chains of iterates that begin at the best end of a search and know nothing of each other: where shorter
//! segments lead from there, how far the cost itself lets each parameter go, and twins.

use super::assess::{Z_95, chi2_per_dof, is_parameter};
use super::chain::{anew, stepped};
use super::iterate::{Iterate, Settings};
use super::keep::Keep;
use super::model::TraceModel;
use super::outer::{Covariance, covariance};
use super::profile::pinned;
use super::search::MOST_STARTS;
use super::twin::twin;
use rayon::prelude::*;
use std::borrow::Cow;

/// Most twins of a search.
pub const MOST_TWINS: usize = 1000;
/// Chains that are made together: the order of the iterates does not depend on the number of threads, and no
/// more of them are lost when the program is killed.
const TOGETHER: usize = 8;

/// What a chain is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Branch {
    /// A twin of the data, fitted again.
    Twin(usize),
    /// The segments of the stage before, from the end.
    Shorter,
    /// An unknown away from its estimate, with everything else fitted again.
    Side {
        /// Number of the unknown.
        unknown: usize,
        /// Whether it is above the estimate.
        above: bool,
    },
}

impl Branch {
    /// Number of its chain, behind those of the starts.
    #[must_use]
    pub fn number(self) -> usize {
        MOST_STARTS
            + match self {
                Self::Twin(twin) => twin,
                Self::Shorter => MOST_TWINS,
                Self::Side { unknown, above } => MOST_TWINS + 1 + 2 * unknown + usize::from(above),
            }
    }

    /// What the chain with a number is for; `None` for a start.
    #[must_use]
    pub fn of(chain: usize) -> Option<Self> {
        let number = chain.checked_sub(MOST_STARTS)?;
        Some(match number.checked_sub(MOST_TWINS) {
            None => Self::Twin(number),
            Some(0) => Self::Shorter,
            Some(side) => Self::Side { unknown: (side - 1) / 2, above: side % 2 == 0 },
        })
    }

    pub(super) fn is_twin(self) -> bool {
        matches!(self, Self::Twin(_))
    }

    /// Steps of its chain, at most: it begins near its end, where the linear model nearly holds.
    fn most_steps(self) -> usize {
        match self {
            Self::Twin(_) => 4,
            Self::Shorter => 6,
            Self::Side { .. } => 1,
        }
    }

    /// Whether its chain ends with an iterate.
    fn ends_with(self, last: &Iterate) -> bool {
        last.settled || last.number >= self.most_steps()
    }
}

/// The end of a search, and what its branches need to know of it.
pub struct End<'a> {
    /// What was fitted.
    pub model: &'a TraceModel,
    /// How it was searched.
    pub settings: &'a Settings,
    /// Seed of the job.
    pub seed: u64,
    /// The best iterate.
    pub at: &'a Iterate,
    /// Covariance there.
    pub covariance: Covariance,
    /// Factor on variances: noise that is larger than measured widens everything.
    pub widening: f64,
    /// Standard deviation of each coordinate by curvature and segments.
    pub sd: Vec<f64>,
}

impl<'a> End<'a> {
    /// `None` where the recordings do not determine the unknowns there.
    #[must_use]
    pub fn new(model: &'a TraceModel, settings: &'a Settings, seed: u64, at: &'a Iterate) -> Option<Self> {
        let covariance = covariance(model, at)?;
        let widening = chi2_per_dof(at).0.max(1.0);
        let variance = |i: usize| (widening * covariance.curvature[(i, i)]).max(covariance.sandwich[(i, i)]);
        let sd = (0..at.point.len()).map(|i| variance(i).sqrt()).collect();
        Some(Self { model, settings, seed, at, covariance, widening, sd })
    }

    /// The branches that it has: none where some segments do not fit.
    pub(super) fn branches(&self) -> Vec<Branch> {
        if !self.at.plain {
            return Vec::new();
        }
        let shorter = (self.at.stage > 0).then_some(Branch::Shorter);
        let parameters = (0..self.at.point.len()).filter(|&i| is_parameter(self.model, i));
        let sides = parameters.flat_map(|unknown| [false, true].map(|above| Branch::Side { unknown, above }));
        shorter.into_iter().chain(sides).chain((0..self.settings.twins).map(Branch::Twin)).collect()
    }

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

    /// How far an unknown is moved to look at the cost there.
    pub(super) fn moved(&self, unknown: usize, above: bool) -> f64 {
        let far = Z_95 * self.sd.get(unknown).copied().unwrap_or_default();
        if above { far } else { -far }
    }
}

/// Where a branch begins.
struct Root<'a> {
    model: Cow<'a, TraceModel>,
    first: Iterate,
}

/// What became of branches.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Followed {
    /// The last iterate of each branch, in order; `None` where the scene refuses every place of it.
    Ends(Vec<Option<Iterate>>),
    /// Numbers of the chains that were left to others.
    Left(Vec<usize>),
    /// It was asked to stop.
    Stopped,
}

/// A branch on its way.
struct Way<'a> {
    branch: Branch,
    root: Option<Root<'a>>,
    place: usize,
    last: Option<Iterate>,
    is_left: bool,
}

impl Way<'_> {
    fn is_open(&self) -> bool {
        !self.is_left && !self.last.as_ref().is_some_and(|last| self.branch.ends_with(last))
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

/// Follows branches to their ends, several at once.
pub(super) fn followed(end: &End<'_>, branches: &[Branch], keep: &mut dyn Keep) -> Followed {
    let (mut ends, mut left) = (Vec::new(), Vec::new());
    // (twins are behind the others also where they are wanted later)
    let kinds = branches.chunk_by(|a, b| a.is_twin() == b.is_twin());
    for branches in kinds.flat_map(|kind| kind.chunks(TOGETHER)) {
        let begun =
            |branch: &Branch| Way { branch: *branch, root: None, place: 0, last: None, is_left: false };
        let mut ways: Vec<Way<'_>> = branches.iter().map(begun).collect();
        while ways.iter().any(Way::is_open) {
            let mut due: Vec<&mut Way<'_>> = Vec::new();
            for way in ways.iter_mut().filter(|way| way.is_open()) {
                let chain = way.branch.number();
                match keep.known(chain, way.place) {
                    Some(known) => way.take(known),
                    None if keep.makes(chain) => due.push(way),
                    None => way.is_left = true,
                }
            }
            let made: Vec<Iterate> = due.par_iter_mut().map(|way| way.next(end)).collect();
            for (way, made) in due.into_iter().zip(made) {
                if keep.add(way.branch.number(), way.place, &made).is_break() {
                    return Followed::Stopped;
                }
                way.take(made);
            }
        }
        left.extend(ways.iter().filter(|way| way.is_left).map(|way| way.branch.number()));
        ends.extend(ways.into_iter().map(|way| way.last.filter(|last| last.cost < f64::MAX)));
    }
    if left.is_empty() { Followed::Ends(ends) } else { Followed::Left(left) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_chain_has_a_number_of_its_own() {
        let sides = (0..20).flat_map(|unknown| [false, true].map(|above| Branch::Side { unknown, above }));
        let branches: Vec<Branch> =
            (0..MOST_TWINS).map(Branch::Twin).chain([Branch::Shorter]).chain(sides).collect();
        for (place, branch) in branches.iter().enumerate() {
            assert_eq!((branch.number(), Branch::of(branch.number())), (MOST_STARTS + place, Some(*branch)));
        }
        assert_eq!(Branch::of(MOST_STARTS - 1), None);
    }
}
