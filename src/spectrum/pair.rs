//! Two steady oscillations where one was seen: closer than a window that starts at zero tells apart.
//!
//! A frequency that drifts, or an amplitude that falls in a line, can be taken to pieces too. So two are
//! taken for one only if they leave nothing around them, and if neither explains more by growing or decaying.

use super::least_squares::{FreeParameters, SinusoidTerm, Tolerance};
use super::oscillations::{Decomposition, ModelSelector, SinusoidModel};
use super::shapes::nearby_terms;

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
