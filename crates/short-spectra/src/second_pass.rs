//! A second pass over a decomposed record, for oscillations that begin late or end soon, and for pairs of
//! lines that were found as one.

use super::chirp_alternatives::nearby_terms;
use super::classification::SINGLE_CYCLE_DAMPING;
use super::least_squares::{FreeSet, SineTerm, Tolerance, nepers_from_damping_ratio};
use super::model_selection::{LOBE, ModelFit, ModelSelector, STEP_CYCLES, SineModel, lobe_half_width};
use super::time_frequency::FrequencyRange;

/// Largest frequency range, in resolutions, of an apparent drift that two beating lines may cause. The lines
/// lie at most four resolutions apart, but where they nearly cancel, the frequency swings beyond both.
const WIDEST_BEAT: f64 = 10.0;
/// Maximum number of steps by which a trend may grow in the place of a slow ring-down; these steps together
/// add about as many unknowns as the ring-down has.
const MOST_TREND_GROWTH: usize = 3;
/// Difference of two Bayesian information criteria that decides between two models: odds of a hundred to one.
const DECISIVE_DIFFERENCE: f64 = 10.0;

/// A term around which the residual exceeds noise.
pub(super) struct DoubtfulTerm {
    pub index: usize,
    /// Limit: a replacement of the term must have a Bayesian information criterion below this value.
    pub criterion: f64,
}

impl ModelSelector<'_> {
    /// The model with the lowest Bayesian information criterion: the `improved` model, a model with another
    /// ring-down, or a model with two lines in the place of a single line. A model that changes a doubtful
    /// term must explain more than a constant frequency drift or a linearly falling amplitude of that term
    /// would.
    pub(super) fn refine_candidates(&self, fit: &ModelFit, improved: Option<SineModel>) -> Option<SineModel> {
        let parts = &fit.model;
        let terms = parts.terms();
        let doubtful = self.doubtful_terms(fit);
        let ring_downs = self.with_ring_downs(fit, &doubtful);
        let leaving: Vec<usize> = doubtful.iter().map(|d| d.index).collect();
        let pairs = self.with_pairs(fit, &leaving);
        let candidates = improved.into_iter().chain(ring_downs).chain(pairs);
        let known = |new: &SineTerm| terms.iter().any(|t| t.cycles == new.cycles && t.nepers == new.nepers);
        let explains = |candidate: &SineModel| {
            let criterion = self.bic_of(candidate);
            let doubted = |d: &&DoubtfulTerm| {
                let near = |t: &&SineTerm| t.cycles > 0.0 && are_adjacent(t, &terms[d.index]);
                let new = || candidate.terms().iter().filter(near);
                let were = terms.iter().filter(near).count();
                new().filter(|t| !known(t)).count() > were.min(1) || new().any(|t| t.first > 0)
            };
            let changed: Vec<&DoubtfulTerm> = doubtful.iter().filter(doubted).collect();
            changed.iter().all(|d| criterion < d.criterion)
                && (changed.is_empty() || self.leaves_noise_near(candidate, &changed, terms))
        };
        let best = self.select_best(candidates.filter(explains))?;
        let slow = |t: &SineTerm| t.is_transient() && t.cycles < STEP_CYCLES && !known(t);
        let doubted = self.trend_grows && best.terms().iter().any(slow);
        let grown = doubted.then(|| self.with_grown_trend(parts, self.bic_of(&best))).flatten();
        Some(grown.unwrap_or(best))
    }

    /// The model with a trend of a few more columns, if its Bayesian information criterion is about as low as
    /// `criterion`: a slow ring-down may be a part of the trend that is not described yet.
    fn with_grown_trend(&self, parts: &SineModel, criterion: f64) -> Option<SineModel> {
        let richer = std::iter::successors(parts.trend().next_richer(), |trend| trend.next_richer());
        let grown = richer.take(MOST_TREND_GROWTH).filter_map(|trend| {
            self.fit_model(self.problem_with_trend(trend), parts.terms(), Tolerance::Coarse)
        });
        self.select_best(grown).filter(|grown| self.bic_of(grown) < criterion + DECISIVE_DIFFERENCE)
    }

    /// The fit with two steady lines in the place of a single line that drifts over `range`; `None` if the
    /// residual is more than noise, or if the range is wider than two beating lines may cause.
    pub(super) fn split_into_pair(&self, fit: &ModelFit, range: &FrequencyRange) -> Option<ModelFit> {
        if range.high_hz - range.low_hz > WIDEST_BEAT * self.resolution_hz() {
            return None;
        }
        let best = self.select_best(self.with_pairs(fit, &self.terms_with_residual(fit)))?;
        Some(self.decompose(best)).filter(|paired| self.leaves_only_noise(paired))
    }

    /// Whether only noise is left around doubtful terms if a candidate replaces them. If not, the motion is
    /// not a sum of oscillations, and more oscillations would only split it into pieces.
    fn leaves_noise_near(
        &self,
        candidate: &SineModel,
        doubtful: &[&DoubtfulTerm],
        terms: &[SineTerm],
    ) -> bool {
        let fit = self.decompose(candidate.clone());
        let near =
            |t: &&SineTerm| t.cycles > 0.0 && doubtful.iter().any(|d| are_adjacent(t, &terms[d.index]));
        !fit.model.terms().iter().filter(near).any(|t| self.leaves_peak(&fit, t))
    }

    /// Whether a term begins inside the record and decays within one cycle: such a term describes a step.
    pub(super) fn contains_step(&self, fit: &ModelFit) -> bool {
        let damped = |t: &SineTerm| {
            t.first > 0 && t.nepers > nepers_from_damping_ratio(t.cycles, SINGLE_CYCLE_DAMPING)
        };
        self.trend_grows && fit.model.terms().iter().any(|t| t.cycles > 0.0 && damped(t))
    }
}

/// Whether the lobes of two terms touch or overlap.
fn are_adjacent(term: &SineTerm, other: &SineTerm) -> bool {
    (term.cycles - other.cycles).abs() < LOBE + lobe_half_width(term)
}

// Two steady oscillations (a pair) in the place of one, closer together than the width of the lobe of a
// window that is zero at its ends. An oscillation whose frequency drifts or whose amplitude falls linearly
// can also be split into two. A pair is therefore accepted only if it leaves only noise around it, and if
// neither line explains more by growing or decaying.

/// Initial distances, in resolutions, of the two lines of a pair from the single term. The single term lies
/// between the two lines or has converged to one of them.
const PAIR_STARTS: [[f64; 2]; 5] = [[-0.35, 0.35], [-0.6, 0.6], [-0.9, 0.9], [0.0, 1.6], [-1.6, 0.0]];
/// Largest allowed distance, in resolutions, of a line of the pair from the single term.
const PAIR_REACH: f64 = 2.0;

impl ModelSelector<'_> {
    /// Models in which two steady terms replace a doubtful term.
    pub(super) fn with_pairs(&self, fit: &ModelFit, doubtful: &[usize]) -> Vec<SineModel> {
        let parts = &fit.model;
        let tried = |one: &usize| {
            let (alone, group) = (vec![*one], nearby_terms(parts.terms(), *one));
            let groups = if group.len() > 1 { vec![alone, group] } else { vec![alone] };
            let pairs = groups.into_iter().flat_map(|out| PAIR_STARTS.map(|starts| (out.clone(), starts)));
            pairs.filter_map(|(out, starts)| self.fit_pair(parts, *one, &out, starts)).collect::<Vec<_>>()
        };
        doubtful.iter().flat_map(tried).collect()
    }

    /// The model with two terms at the distances `starts` from term `k`, in the place of the terms `out`.
    fn fit_pair(&self, parts: &SineModel, k: usize, out: &[usize], starts: [f64; 2]) -> Option<SineModel> {
        let one = parts.terms()[k];
        let start = |apart: f64| SineTerm::from_start(one.cycles + apart, 0.0, FreeSet::Cycles);
        let terms = parts.swap_terms(out, starts.map(start));
        if !self.has_frames_for(&parts.problem, &terms) {
            return None;
        }
        let solution = parts.problem.gauss_newton(&terms, Tolerance::Fine)?;
        let steady = SineModel { problem: parts.problem.clone(), solution };
        let stays = |t: &SineTerm| t.free == FreeSet::Cycles && (t.cycles - one.cycles).abs() < PAIR_REACH;
        if !steady.terms()[terms.len() - 2..].iter().all(stays) {
            return None;
        }
        let released = self.fit_model(steady.problem.clone(), steady.terms(), Tolerance::Coarse)?;
        if self.bic_of(&released) < self.bic_of(&steady) {
            return None;
        }
        let fit = self.decompose(steady);
        let leaves = fit.model.terms().iter().rev().take(2).any(|t| self.leaves_peak(&fit, t));
        (!leaves).then_some(fit.model)
    }
}
