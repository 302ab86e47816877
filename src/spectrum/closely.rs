//! What a first look at a record does not show: what begins late or is over soon, and two lines where one was
//! seen.

use super::judge::DAMPED;
use super::least_squares::{Care, Term, nepers};
use super::oscillations::{Explained, FLIP_CYCLES, LOBE, Parts, Search, lobe};
use super::time_frequency::Range;

/// Range over which two lines that beat may seem to drift, resolutions: they lie at most four apart, and
/// where they nearly cancel the frequency swings beyond both.
const WIDEST_BEAT: f64 = 10.0;

/// Steps by which a trend may grow to explain what a slow ring-down does: together they have as many
/// unknowns.
const GROWN: usize = 3;
/// What a criterion must differ by to decide: odds of a hundred to one.
const DECIDES: f64 = 10.0;

/// A term that leaves more than noise around it.
pub(super) struct Doubtful {
    /// Its number.
    pub k: usize,
    /// The criterion that what takes its place must fall below.
    pub criterion: f64,
}

impl Search<'_> {
    /// What explains most with least: parts that are improved otherwise, with a ring-down more, or with two
    /// lines for one. Next to a doubtful term they must explain more than a drift or an even fall of that
    /// one.
    pub(super) fn looked_at_closely(&self, explained: &Explained, improved: Option<Parts>) -> Option<Parts> {
        let parts = &explained.parts;
        let terms = &parts.solved.terms;
        let doubtful = self.doubtful(explained);
        let ring_downs = self.with_ring_downs(explained, &doubtful);
        let leaving: Vec<usize> = doubtful.iter().map(|d| d.k).collect();
        let pairs = self.with_pairs(explained, &leaving);
        let candidates = improved.into_iter().chain(ring_downs).chain(pairs);
        let known = |new: &Term| terms.iter().any(|t| t.cycles == new.cycles && t.nepers == new.nepers);
        let explains = |candidate: &Parts| {
            let criterion = self.criterion(candidate);
            let doubted = |d: &Doubtful| {
                let near =
                    |t: &&Term| t.cycles > 0.0 && (t.cycles - terms[d.k].cycles).abs() < LOBE + lobe(t);
                let pieces = candidate.solved.terms.iter().filter(near).filter(|t| !known(t)).count();
                let were = terms.iter().filter(near).count();
                pieces > were.min(1) || candidate.solved.terms.iter().filter(near).any(|t| t.first > 0)
            };
            let changed: Vec<&Doubtful> = doubtful.iter().filter(|d| doubted(d)).collect();
            changed.iter().all(|d| criterion < d.criterion)
                && (changed.is_empty() || self.settles(candidate, &changed, terms))
        };
        let best =
            candidates.filter(explains).min_by(|a, b| self.criterion(a).total_cmp(&self.criterion(b)))?;
        let slow = |t: &Term| t.is_brief() && t.cycles < FLIP_CYCLES && !known(t);
        let doubted = self.grows && best.solved.terms.iter().any(slow);
        Some(doubted.then(|| self.with_grown_trend(parts, self.criterion(&best))).flatten().unwrap_or(best))
    }

    /// The parts with a trend of a few columns more, where that explains about as much as a criterion says: a
    /// slow ring-down may be what a trend does not describe yet.
    fn with_grown_trend(&self, parts: &Parts, criterion: f64) -> Option<Parts> {
        let richer = std::iter::successors(parts.trend().richer(), |trend| trend.richer()).take(GROWN);
        let grown =
            richer.filter_map(|trend| self.fitted(self.problem(trend), &parts.solved.terms, Care::Passing));
        grown
            .min_by(|a, b| self.criterion(a).total_cmp(&self.criterion(b)))
            .filter(|grown| self.criterion(grown) < criterion + DECIDES)
    }

    /// With two steady lines where one was seen that drifts over a range, if nothing but noise is left then.
    /// What drifts farther than the two may lie apart is no pair.
    pub(super) fn paired(&self, explained: &Explained, range: &Range) -> Option<Explained> {
        if range.high_hz - range.low_hz > WIDEST_BEAT * self.resolution_hz() {
            return None;
        }
        let pairs = self.with_pairs(explained, &self.leaving(explained));
        let best = pairs.into_iter().min_by(|a, b| self.criterion(a).total_cmp(&self.criterion(b)))?;
        Some(self.explain(best)).filter(|paired| self.leaves_noise(paired))
    }

    /// Whether nothing more than noise is left around doubtful terms once a candidate takes their place: what
    /// a sum of oscillations does not describe, more of them only take to pieces.
    fn settles(&self, candidate: &Parts, doubtful: &[&Doubtful], terms: &[Term]) -> bool {
        let explained = self.explain(candidate.clone());
        let near = |t: &&Term| {
            doubtful.iter().any(|d| (t.cycles - terms[d.k].cycles).abs() < LOBE + lobe(t)) && t.cycles > 0.0
        };
        !explained.parts.solved.terms.iter().filter(near).any(|t| self.leaves_peak(&explained, t))
    }

    /// Whether something that begins inside the record is over within a cycle, as a step is.
    pub(super) fn steps(&self, explained: &Explained) -> bool {
        let damped = |t: &Term| t.first > 0 && t.nepers > nepers(t.cycles, DAMPED);
        self.grows && explained.parts.solved.terms.iter().any(|t| t.cycles > 0.0 && damped(t))
    }
}
