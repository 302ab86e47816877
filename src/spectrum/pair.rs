//! Two steady oscillations where one was seen: closer than a window that starts at zero tells apart.
//!
//! A frequency that drifts, or an amplitude that falls in a line, can be taken to pieces too. So two are taken
//! for one only if they leave nothing around them, and if neither explains more by growing or decaying.

use super::closely::Doubtful;
use super::least_squares::{Care, Free, Term};
use super::oscillations::{Explained, Parts, Search};

/// Distances from which a fit of two starts, resolutions.
const APART: [f64; 3] = [0.7, 1.2, 1.8];
/// Resolutions from the one within which the two must lie.
const WITHIN: f64 = 2.0;

impl Search<'_> {
    /// The parts with two steady terms in the place of one that is doubtful.
    pub(super) fn with_pairs(&self, explained: &Explained, doubtful: &[Doubtful]) -> Vec<Parts> {
        let tried = doubtful.iter().flat_map(|one| APART.map(|apart| (one, apart)));
        tried.filter_map(|(one, apart)| self.pair(&explained.parts, one.k, apart)).collect()
    }

    fn pair(&self, parts: &Parts, k: usize, apart: f64) -> Option<Parts> {
        let one = parts.solved.terms[k];
        let half = |sign: f64| Term::from_start(one.cycles + sign * apart / 2.0, 0.0, Free::Cycles);
        let mut terms = parts.solved.terms.clone();
        terms.remove(k);
        terms.extend([half(-1.0), half(1.0)]);
        if !self.has_frames_for(&parts.problem, &terms) {
            return None;
        }
        let solved = parts.problem.solve(&terms, Care::Passing)?;
        let steady = Parts { problem: parts.problem.clone(), solved };
        let two = &steady.solved.terms[terms.len() - 2..];
        let stays = |t: &Term| t.free == Free::Cycles && (t.cycles - one.cycles).abs() < WITHIN;
        if !two.iter().all(stays) {
            return None;
        }
        let released = self.fitted(steady.problem.clone(), &steady.solved.terms, Care::Passing)?;
        if self.criterion(&released) < self.criterion(&steady) {
            return None;
        }
        let explained = self.explain(steady);
        let leaves =
            explained.parts.solved.terms.iter().rev().take(2).any(|t| self.leaves_peak(&explained, t));
        (!leaves).then_some(explained.parts)
    }
}
