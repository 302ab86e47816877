//! What a first look at a record does not show: what begins late or is over soon, and two lines where one was
//! seen.

use super::chirp_alternatives::nearby_terms;
use super::classification::SINGLE_CYCLE_DAMPING;
use super::least_squares::{FreeParameters, SinusoidTerm, Tolerance, nepers_from_damping_ratio};
use super::model_selection::{
    Decomposition, LOBE, ModelSelector, STEP_CYCLES, SinusoidModel, lobe_half_width,
};
use super::time_frequency::FrequencyRange;

/// Range over which two lines that beat may seem to drift, resolutions: they lie at most four apart, and
/// where they nearly cancel the frequency swings beyond both.
const WIDEST_BEAT: f64 = 10.0;

/// Steps by which a trend may grow to explain what a slow ring-down does: together they have as many
/// unknowns.
const MOST_TREND_GROWTH: usize = 3;
/// What a criterion must differ by to decide: odds of a hundred to one.
const DECISIVE_DIFFERENCE: f64 = 10.0;

/// A term that leaves more than noise around it.
pub(super) struct DoubtfulTerm {
    pub index: usize,
    /// The criterion that what takes its place must fall below.
    pub criterion: f64,
}

impl ModelSelector<'_> {
    /// What explains most with least: parts that are improved otherwise, with a ring-down more, or with two
    /// lines for one. Next to a doubtful term they must explain more than a drift or an even fall of that
    /// one.
    pub(super) fn refine_candidates(
        &self,
        explained: &Decomposition,
        improved: Option<SinusoidModel>,
    ) -> Option<SinusoidModel> {
        let parts = &explained.model;
        let terms = &parts.solution.terms;
        let doubtful = self.doubtful_terms(explained);
        let ring_downs = self.with_ring_downs(explained, &doubtful);
        let leaving: Vec<usize> = doubtful.iter().map(|d| d.index).collect();
        let pairs = self.with_pairs(explained, &leaving);
        let candidates = improved.into_iter().chain(ring_downs).chain(pairs);
        let known =
            |new: &SinusoidTerm| terms.iter().any(|t| t.cycles == new.cycles && t.nepers == new.nepers);
        let explains = |candidate: &SinusoidModel| {
            let criterion = self.information_criterion(candidate);
            let doubted = |d: &DoubtfulTerm| {
                let near = |t: &&SinusoidTerm| {
                    t.cycles > 0.0 && (t.cycles - terms[d.index].cycles).abs() < LOBE + lobe_half_width(t)
                };
                let pieces = candidate.solution.terms.iter().filter(near).filter(|t| !known(t)).count();
                let were = terms.iter().filter(near).count();
                pieces > were.min(1) || candidate.solution.terms.iter().filter(near).any(|t| t.first > 0)
            };
            let changed: Vec<&DoubtfulTerm> = doubtful.iter().filter(|d| doubted(d)).collect();
            changed.iter().all(|d| criterion < d.criterion)
                && (changed.is_empty() || self.leaves_noise_near_terms(candidate, &changed, terms))
        };
        let best = candidates
            .filter(explains)
            .min_by(|a, b| self.information_criterion(a).total_cmp(&self.information_criterion(b)))?;
        let slow = |t: &SinusoidTerm| t.is_transient() && t.cycles < STEP_CYCLES && !known(t);
        let doubted = self.trend_grows && best.solution.terms.iter().any(slow);
        Some(
            doubted
                .then(|| self.with_grown_trend(parts, self.information_criterion(&best)))
                .flatten()
                .unwrap_or(best),
        )
    }

    /// The parts with a trend of a few columns more, where that explains about as much as a criterion says: a
    /// slow ring-down may be what a trend does not describe yet.
    fn with_grown_trend(&self, parts: &SinusoidModel, criterion: f64) -> Option<SinusoidModel> {
        let richer = std::iter::successors(parts.trend().next_richer(), |trend| trend.next_richer())
            .take(MOST_TREND_GROWTH);
        let grown = richer.filter_map(|trend| {
            self.fit_model(self.problem_with_trend(trend), &parts.solution.terms, Tolerance::Coarse)
        });
        grown
            .min_by(|a, b| self.information_criterion(a).total_cmp(&self.information_criterion(b)))
            .filter(|grown| self.information_criterion(grown) < criterion + DECISIVE_DIFFERENCE)
    }

    /// With two steady lines where one was seen that drifts over a range, if nothing but noise is left then.
    /// What drifts farther than the two may lie apart is no pair.
    pub(super) fn split_into_pair(
        &self,
        explained: &Decomposition,
        range: &FrequencyRange,
    ) -> Option<Decomposition> {
        if range.high_hz - range.low_hz > WIDEST_BEAT * self.resolution_hz() {
            return None;
        }
        let pairs = self.with_pairs(explained, &self.terms_with_residual(explained));
        let best = pairs
            .into_iter()
            .min_by(|a, b| self.information_criterion(a).total_cmp(&self.information_criterion(b)))?;
        Some(self.decompose(best)).filter(|paired| self.leaves_only_noise(paired))
    }

    /// Whether nothing more than noise is left around doubtful terms once a candidate takes their place: what
    /// a sum of oscillations does not describe, more of them only take to pieces.
    fn leaves_noise_near_terms(
        &self,
        candidate: &SinusoidModel,
        doubtful: &[&DoubtfulTerm],
        terms: &[SinusoidTerm],
    ) -> bool {
        let explained = self.decompose(candidate.clone());
        let near = |t: &&SinusoidTerm| {
            doubtful.iter().any(|d| (t.cycles - terms[d.index].cycles).abs() < LOBE + lobe_half_width(t))
                && t.cycles > 0.0
        };
        !explained.model.solution.terms.iter().filter(near).any(|t| self.leaves_peak(&explained, t))
    }

    /// Whether something that begins inside the record is over within a cycle, as a step is.
    pub(super) fn contains_step(&self, explained: &Decomposition) -> bool {
        let damped = |t: &SinusoidTerm| {
            t.first > 0 && t.nepers > nepers_from_damping_ratio(t.cycles, SINGLE_CYCLE_DAMPING)
        };
        self.trend_grows && explained.model.solution.terms.iter().any(|t| t.cycles > 0.0 && damped(t))
    }
}

// Two steady oscillations where one was seen: closer than a window that starts at zero tells apart.
//
// A frequency that drifts, or an amplitude that falls in a line, can be taken to pieces too. So two are
// taken for one only if they leave nothing around them, and if neither explains more by growing or decaying.

/// Where a fit of two starts, resolutions from the one: it lies between them, or has settled on either.
const PAIR_STARTS: [[f64; 2]; 5] = [[-0.35, 0.35], [-0.6, 0.6], [-0.9, 0.9], [0.0, 1.6], [-1.6, 0.0]];
/// Resolutions from the one within which the two must lie.
const PAIR_REACH: f64 = 2.0;

impl ModelSelector<'_> {
    /// The parts with two steady terms in the place of one that is doubtful.
    pub(super) fn with_pairs(&self, explained: &Decomposition, doubtful: &[usize]) -> Vec<SinusoidModel> {
        let parts = &explained.model;
        let tried = |one: &usize| {
            let (alone, group) = (vec![*one], nearby_terms(&parts.solution.terms, *one));
            let groups = if group.len() > 1 { vec![alone, group] } else { vec![alone] };
            let pairs = groups.into_iter().flat_map(|out| PAIR_STARTS.map(|starts| (out.clone(), starts)));
            pairs.filter_map(|(out, starts)| self.fit_pair(parts, *one, &out, starts)).collect::<Vec<_>>()
        };
        doubtful.iter().flat_map(tried).collect()
    }

    /// Two terms that start this far from term `k`, in the place of some.
    fn fit_pair(
        &self,
        parts: &SinusoidModel,
        k: usize,
        out: &[usize],
        starts: [f64; 2],
    ) -> Option<SinusoidModel> {
        let one = parts.solution.terms[k];
        let all = &parts.solution.terms;
        let mut terms: Vec<SinusoidTerm> =
            (0..all.len()).filter(|k| !out.contains(k)).map(|k| all[k]).collect();
        terms.extend(
            starts.map(|apart| SinusoidTerm::from_start(one.cycles + apart, 0.0, FreeParameters::Cycles)),
        );
        if !self.has_frames_for(&parts.problem, &terms) {
            return None;
        }
        let solved = parts.problem.gauss_newton(&terms, Tolerance::Fine)?;
        let steady = SinusoidModel { problem: parts.problem.clone(), solution: solved };
        let two = &steady.solution.terms[terms.len() - 2..];
        let stays =
            |t: &SinusoidTerm| t.free == FreeParameters::Cycles && (t.cycles - one.cycles).abs() < PAIR_REACH;
        if !two.iter().all(stays) {
            return None;
        }
        let released = self.fit_model(steady.problem.clone(), &steady.solution.terms, Tolerance::Coarse)?;
        if self.information_criterion(&released) < self.information_criterion(&steady) {
            return None;
        }
        let explained = self.decompose(steady);
        let leaves =
            explained.model.solution.terms.iter().rev().take(2).any(|t| self.leaves_peak(&explained, t));
        (!leaves).then_some(explained.model)
    }
}
