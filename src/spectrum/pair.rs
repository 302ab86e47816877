//! Two steady oscillations where one was seen: closer than a window that starts at zero tells apart.
//!
//! A frequency that drifts, or an amplitude that falls in a line, can be taken to pieces too. So two are
//! taken for one only if they leave nothing around them, and if neither explains more by growing or decaying.

use super::least_squares::{Care, Free, Term};
use super::oscillations::{Explained, Parts, Search};
use super::shapes::near;

/// Where a fit of two starts, resolutions from the one: it lies between them, or has settled on either.
const STARTS: [[f64; 2]; 5] = [[-0.35, 0.35], [-0.6, 0.6], [-0.9, 0.9], [0.0, 1.6], [-1.6, 0.0]];
/// Resolutions from the one within which the two must lie.
const WITHIN: f64 = 2.0;

impl Search<'_> {
    /// The parts with two steady terms in the place of one that is doubtful.
    pub(super) fn with_pairs(&self, explained: &Explained, doubtful: &[usize]) -> Vec<Parts> {
        let parts = &explained.parts;
        let tried = |one: &usize| {
            let (alone, group) = (vec![*one], near(&parts.solved.terms, *one));
            let groups = if group.len() > 1 { vec![alone, group] } else { vec![alone] };
            let pairs = groups.into_iter().flat_map(|out| STARTS.map(|starts| (out.clone(), starts)));
            pairs.filter_map(|(out, starts)| self.pair(parts, *one, &out, starts)).collect::<Vec<_>>()
        };
        doubtful.iter().flat_map(tried).collect()
    }

    /// Two terms that start this far from term `k`, in the place of some.
    fn pair(&self, parts: &Parts, k: usize, out: &[usize], starts: [f64; 2]) -> Option<Parts> {
        let one = parts.solved.terms[k];
        let all = &parts.solved.terms;
        let mut terms: Vec<Term> = (0..all.len()).filter(|k| !out.contains(k)).map(|k| all[k]).collect();
        terms.extend(starts.map(|apart| Term::from_start(one.cycles + apart, 0.0, Free::Cycles)));
        if !self.has_frames_for(&parts.problem, &terms) {
            return None;
        }
        let solved = parts.problem.solve(&terms, Care::Final)?;
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
