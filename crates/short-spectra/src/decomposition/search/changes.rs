//! The changes that a round of the search offers: additions of parts, richer trends, oscillations with more
//! parameters, divisions and unions.

use super::{Change, JOINT_ITERATIONS, LOCAL_ITERATIONS, PartSearch, atoms_without};
use crate::decomposition::atom::{Atom, MOST_ENVELOPE_DEGREE, MOST_PHASE_DEGREE, OscillationAtom};
use crate::decomposition::candidates::{Candidate, find_candidates};
use crate::decomposition::problem::{Explanation, Fixed, Parts, dot};
use crate::trend::Trend;
use portable_math as math;

/// An oscillation with a faster decay or growth than this, nepers per record, gets no harmonics: it is a free
/// oscillation, and not a driven cycle.
const DRIVEN_NEPERS: f64 = 3.0;

/// Margin, in resolutions, on each side of two peaks that overlap if their oscillations may be united. Peaks
/// in a Hann spectrum touch at half of this distance.
const UNION_MARGIN: f64 = 2.5;

impl PartSearch {
    /// Additions of one part that the residual may contain.
    pub(super) fn list_additions(&self, current: &Explanation, fixed: &Fixed) -> Vec<Change> {
        let oscillations = current.parts.atoms.iter().filter(|a| a.oscillation().is_some()).count();
        let mut found = find_candidates(&self.problem, fixed, (0.0, f64::INFINITY), self.trend_grows);
        if oscillations >= self.most_oscillations {
            found.retain(|candidate| candidate.atom.oscillation().is_none());
        }
        let change = |candidate: Candidate| Change {
            gain: candidate.gain,
            trend: current.parts.trend,
            replaced: Vec::new(),
            fitted: vec![candidate.atom],
            is_fitted: false,
        };
        found.into_iter().map(change).collect()
    }

    /// Changes to the next three richer trends.
    pub(super) fn list_trends(&self, current: &Explanation, fixed: &Fixed) -> Vec<Change> {
        let least = current.parts.trend;
        let richer: Vec<Trend> = std::iter::successors(least.next_richer(), |trend| trend.next_richer())
            .take_while(|_| self.trend_grows)
            .take(3)
            .collect();
        let Some(richest) = richer.last() else { return Vec::new() };
        let columns = self.problem.raw_trend_columns(*richest).split_off(least.column_count());
        let products = self.problem.multiply_columns(fixed, columns);
        let change = |trend: &Trend| {
            let more = trend.column_count() - least.column_count();
            let explained = products.explained_squares(&(0..more).collect::<Vec<_>>());
            let gain = self.problem.likelihood_gain(fixed, explained)
                - 0.5 * more as f64 * self.problem.log_frames();
            Change { gain, trend: *trend, replaced: Vec::new(), fitted: Vec::new(), is_fitted: false }
        };
        richer.iter().map(change).collect()
    }

    /// Changes that give an oscillation a decay, a drift or harmonics, or divide or unite oscillations.
    pub(super) fn list_enrichments(&mut self, current: &Explanation, fixed: &Fixed) -> Vec<Change> {
        let atoms = &current.parts.atoms;
        let mut changes = self.list_slow_unions(current);
        for (k, (atom, amplitudes)) in current.atoms_with_amplitudes().enumerate() {
            changes.extend(self.list_course_harmonics(current, fixed, k));
            let Some(o) = atom.oscillation() else { continue };
            for (gain, variant) in self.list_richer_variants(fixed, atom, o, amplitudes) {
                let trend = current.parts.trend;
                changes.push(Change {
                    gain,
                    trend,
                    replaced: vec![k],
                    fitted: vec![variant],
                    is_fitted: false,
                });
            }
            if self.leaves_neighbours(fixed, o) && self.is_new_group(&atoms[k..=k]) {
                let others = self.problem.fix_parts(current.parts.trend, &atoms_without(atoms, &[k]));
                changes.extend(self.exchange_decay(current, &others, k, o));
                changes.extend(self.list_divisions(current, &others, k, o));
            }
            changes.extend(self.list_unions(current, k, o));
        }
        changes
    }

    /// Variants of a course with another harmonic.
    fn list_course_harmonics(&self, current: &Explanation, fixed: &Fixed, k: usize) -> Vec<Change> {
        let atoms = &current.parts.atoms;
        let Some(course) = atoms[k].course() else { return Vec::new() };
        let next = course.multiples.last().map_or(2, |m| m + 1);
        let variant = |multiple: usize| {
            let mut richer = course.clone();
            richer.multiples.push(multiple);
            let variant = Atom::Course(richer);
            let new = variant.columns(&self.problem.at).split_off(course.column_count());
            let explained = self.problem.multiply_columns(fixed, new).explained_squares(&[0, 1]);
            let price = (variant.price() - atoms[k].price()) * self.problem.log_frames();
            let gain = self.problem.likelihood_gain(fixed, explained) - price;
            let trend = current.parts.trend;
            Change { gain, trend, replaced: vec![k], fitted: vec![variant], is_fitted: false }
        };
        (next..next + 2).map(variant).collect()
    }

    /// Variants of an oscillation, which is among the fixed parts, with a decay, a higher degree of phase or
    /// amplitude, or another harmonic, each with its estimated gain, nats (score test).
    fn list_richer_variants(
        &self,
        fixed: &Fixed,
        atom: &Atom,
        o: &OscillationAtom,
        amplitudes: &[f64],
    ) -> Vec<(f64, Atom)> {
        // the columns of the richest variant contain those of all others
        let mut richest = o.clone();
        let decays = o.nepers.is_none() && o.envelope.is_empty();
        if decays {
            richest.nepers = Some(0.0);
        }
        let degrees = 2.min(MOST_PHASE_DEGREE - 1 - o.phase.len());
        richest.phase.resize(o.phase.len() + degrees, 0.0);
        let modulated = o.nepers.is_none() && o.onset == 0.0;
        let envelopes = if modulated { 2.min(MOST_ENVELOPE_DEGREE - o.envelope.len()) } else { 0 };
        richest.envelope.resize(o.envelope.len() + envelopes, 0.0);
        // a driven cycle may have harmonics, a free oscillation that decays has none
        let driven = o.onset == 0.0 && o.nepers.is_none_or(|d| d.abs() < DRIVEN_NEPERS);
        let next = o.multiples.last().map_or(2, |m| m + 1);
        richest.multiples.extend((next..next + 2).filter(|_| driven));
        let richest = Atom::Oscillation(richest);
        let mut columns = richest.columns(&self.problem.at);
        let known = amplitudes.len();
        // a column that the atom lacks has no amplitude yet
        let mut amplitudes = amplitudes.to_vec();
        amplitudes.resize(columns.len(), 0.0);
        let slopes = richest.derivatives(&self.problem.at, &columns, &amplitudes);
        columns.drain(..known);
        let new_columns = columns.len();
        columns.extend(slopes);
        let products = self.problem.multiply_columns(fixed, columns);
        let cycles = new_columns;
        let nepers = cycles + 1;
        let phase = nepers + usize::from(o.nepers.is_some() || decays);
        let envelope = phase + o.phase.len() + degrees;
        let mut present = vec![cycles];
        present.extend(o.nepers.map(|_| nepers));
        present.extend(phase..phase + o.phase.len());
        present.extend(envelope..envelope + o.envelope.len());
        let mut variants: Vec<(OscillationAtom, Vec<usize>)> = Vec::new();
        if decays {
            variants.push((OscillationAtom { nepers: Some(0.0), ..o.clone() }, vec![nepers]));
        }
        for more in 1..=degrees {
            let longer = [o.phase.clone(), vec![0.0; more]].concat();
            let first = phase + o.phase.len();
            variants.push((OscillationAtom { phase: longer, ..o.clone() }, (first..first + more).collect()));
        }
        for more in 1..=envelopes {
            let longer = [o.envelope.clone(), vec![0.0; more]].concat();
            let first = envelope + o.envelope.len();
            let variant = OscillationAtom { envelope: longer, ..o.clone() };
            variants.push((variant, (first..first + more).collect()));
        }
        for k in 0..new_columns / 2 {
            let multiples = [o.multiples.clone(), vec![next + k]].concat();
            variants.push((OscillationAtom { multiples, ..o.clone() }, vec![2 * k, 2 * k + 1]));
        }
        let rate = |(variant, new): (OscillationAtom, Vec<usize>)| {
            let all: Vec<usize> = present.iter().copied().chain(new).collect();
            let gain = self.problem.likelihood_gain(fixed, products.explained_squares(&all));
            let variant = Atom::Oscillation(variant);
            (gain - (variant.price() - atom.price()) * self.problem.log_frames(), variant)
        };
        variants.into_iter().map(rate).collect()
    }

    /// Whether the residual around an oscillation shows that its amplitude or phase changes slowly: then
    /// changes that need a fit are worth their time.
    fn leaves_neighbours(&self, fixed: &Fixed, o: &OscillationAtom) -> bool {
        /// Degree of the polynomials by which its columns are multiplied: it describes a neighbour up to
        /// about a resolution away.
        const DEGREE: i32 = 3;
        let plain = OscillationAtom { multiples: Vec::new(), ..o.clone() };
        let columns = Atom::Oscillation(plain).columns(&self.problem.at);
        let places = &self.problem.at.places;
        let times = |power: i32, column: &Vec<f64>| -> Vec<f64> {
            column.iter().zip(places).map(|(x, s)| x * math::powi(2.0 * s - 1.0, power)).collect()
        };
        let slow = (1..=DEGREE).flat_map(|power| columns.iter().map(move |c| (power, c)));
        let slow: Vec<Vec<f64>> = slow.map(|(power, column)| times(power, column)).collect();
        let all: Vec<usize> = (0..slow.len()).collect();
        let explained = self.problem.multiply_columns(fixed, slow).explained_squares(&all);
        self.problem.likelihood_gain(fixed, explained) > 2.0 * self.problem.log_frames()
    }

    /// The oscillation with a polynomial amplitude in place of its decay; `None` if it has no decay that a
    /// polynomial can follow.
    fn exchange_decay(
        &self,
        current: &Explanation,
        others: &Fixed,
        k: usize,
        o: &OscillationAtom,
    ) -> Option<Change> {
        /// Degree with which the polynomial starts; later changes raise or lower it.
        const DEGREE: usize = 3;
        /// Fastest decay or growth, nepers per record, that a polynomial can follow.
        const MOST_FOLLOWED: f64 = 8.0;
        let follows = o.onset == 0.0 && o.nepers.is_some_and(|d| d.abs() < MOST_FOLLOWED);
        let polynomial = || OscillationAtom { nepers: None, envelope: vec![0.0; DEGREE], ..o.clone() };
        follows.then(|| self.fit_change(current, others, vec![k], vec![Atom::Oscillation(polynomial())]))
    }

    /// A change with its gain after a fit of `atoms` while the others stay.
    fn fit_change(
        &self,
        current: &Explanation,
        others: &Fixed,
        replaced: Vec<usize>,
        atoms: Vec<Atom>,
    ) -> Change {
        let trend = current.parts.trend;
        let (fitted, squares) = self.problem.fit_atoms(others, atoms, LOCAL_ITERATIONS);
        let kept = atoms_without(&current.parts.atoms, &replaced);
        let parts = Parts { trend, atoms: [kept, fitted.clone()].concat() };
        let gain = current.criterion - self.problem.criterion(&parts, squares);
        Change { gain, trend, replaced, fitted, is_fitted: true }
    }

    /// Whether no group with nearly the same atoms was offered before; the group then counts as offered.
    fn is_new_group(&mut self, group: &[Atom]) -> bool {
        let is_old = self.offered.iter().any(|old| is_similar(old, group));
        if !is_old {
            self.offered.push(group.to_vec());
        }
        !is_old
    }

    /// Divisions of an oscillation into two steady ones at three different distances; none if its drift is
    /// more than linear or if it has harmonics.
    fn list_divisions(
        &self,
        current: &Explanation,
        others: &Fixed,
        k: usize,
        o: &OscillationAtom,
    ) -> Vec<Change> {
        if o.phase.len() > 1 || !o.multiples.is_empty() {
            return Vec::new();
        }
        let half = 0.35 + o.phase.first().map_or(0.0, |q| 3.0 * q.abs());
        let offer = |(a, b): (f64, f64)| {
            let pair = [a, b].map(|by| Atom::Oscillation(OscillationAtom::steady(o.cycles + by)));
            self.fit_change(current, others, vec![k], pair.to_vec())
        };
        [(-half, half), (-1.0, 0.2), (-0.2, 1.0)].into_iter().map(offer).collect()
    }

    /// Unions of all steps and relaxations into one step: a step whose middle lies before the record has a
    /// tail that looks like several of them.
    fn list_slow_unions(&mut self, current: &Explanation) -> Vec<Change> {
        let atoms = &current.parts.atoms;
        let is_slow = |k: &usize| matches!(atoms[*k], Atom::Step { .. } | Atom::Relaxation { .. });
        let slow: Vec<usize> = (0..atoms.len()).filter(is_slow).collect();
        let group: Vec<Atom> = slow.iter().map(|k| atoms[*k].clone()).collect();
        if slow.len() < 2 || !self.trend_grows || !self.is_new_group(&group) {
            return Vec::new();
        }
        let trend = current.parts.trend;
        let fixed = self.problem.fix_parts(trend, &atoms_without(atoms, &slow));
        let found = find_candidates(&self.problem, &fixed, (f64::INFINITY, 0.0), true);
        let step = found.into_iter().find(|candidate| matches!(candidate.atom, Atom::Step { .. }));
        let change = |Candidate { atom, gain }: Candidate| {
            let change = Change { gain, trend, replaced: slow.clone(), fitted: vec![atom], is_fitted: false };
            // the best shapes of the oscillations depend on the slow parts, so all are fitted together
            let tried = self.try_change(current, &fixed, &change);
            let found = self.problem.fit_parts(&tried.parts, 3 * JOINT_ITERATIONS);
            let (gain, replaced) = (current.criterion - found.criterion, (0..atoms.len()).collect());
            Change { gain, trend, replaced, fitted: found.parts.atoms, is_fitted: true }
        };
        step.into_iter().map(change).collect()
    }

    /// Unions of an oscillation with its neighbours into one drifting or decaying oscillation. Neighbours are
    /// oscillations whose peaks overlap its own.
    fn list_unions(&mut self, current: &Explanation, k: usize, o: &OscillationAtom) -> Vec<Change> {
        let atoms = &current.parts.atoms;
        let is_near =
            |j: &usize| atoms[*j].oscillation().is_some_and(|other| o.overlaps(other, UNION_MARGIN));
        let near: Vec<usize> = (0..atoms.len()).filter(is_near).collect();
        // only the first oscillation of a group unites it, so that no group is tried twice
        if near.len() < 2 || near[0] != k {
            return Vec::new();
        }
        let group: Vec<Atom> = near.iter().map(|j| atoms[*j].clone()).collect();
        if !self.is_new_group(&group) {
            return Vec::new();
        }
        let kept = atoms_without(atoms, &near);
        let fixed = self.problem.fix_parts(current.parts.trend, &kept);
        let mut changes = self.list_group_envelopes(current, &fixed, &near);
        let ranges = near.iter().filter_map(|j| atoms[*j].oscillation()).map(|o| o.peak_band(UNION_MARGIN));
        let band = ranges.fold((f64::INFINITY, 0.0_f64), |(a, b), (l, h)| (a.min(l), b.max(h)));
        let base = self.problem.criterion(
            &Parts { trend: current.parts.trend, atoms: kept },
            dot(self.problem.residual_of(&fixed), self.problem.residual_of(&fixed)),
        );
        let change = |candidate: Candidate| Change {
            gain: current.criterion - base + candidate.gain + 3.0 * self.problem.log_frames(),
            trend: current.parts.trend,
            replaced: near.clone(),
            fitted: vec![candidate.atom],
            is_fitted: false,
        };
        changes.extend(find_candidates(&self.problem, &fixed, band, false).into_iter().map(change));
        changes
    }

    /// Changes of a group of neighbours as a whole: every one of them decays, because one alone may gain
    /// nothing by it; the two largest remain, without drift or decay; one oscillation with a polynomial
    /// amplitude replaces all of them.
    fn list_group_envelopes(&self, current: &Explanation, others: &Fixed, near: &[usize]) -> Vec<Change> {
        /// Decay, nepers per record, from which the fit of a steady oscillation starts: a slow one, which the
        /// fit can also turn into growth.
        const START_NEPERS: f64 = 1.0;
        let atoms = &current.parts.atoms;
        let group: Vec<&OscillationAtom> = near.iter().filter_map(|j| atoms[*j].oscillation()).collect();
        if group.len() > 4 {
            return Vec::new();
        }
        let decaying = |o: &&OscillationAtom| {
            Atom::Oscillation(OscillationAtom {
                nepers: o.nepers.or(Some(START_NEPERS)),
                phase: Vec::new(),
                envelope: Vec::new(),
                ..(*o).clone()
            })
        };
        let mut changes =
            vec![self.fit_change(current, others, near.to_vec(), group.iter().map(decaying).collect())];
        if group.len() > 2 {
            let mut largest: Vec<&OscillationAtom> = group.clone();
            let size = |o: &OscillationAtom| amplitude_of(current, o);
            math::sort_by_number(&mut largest, |a| -size(a));
            let pair = largest[..2].iter().map(|o| Atom::Oscillation(OscillationAtom::steady(o.cycles)));
            changes.push(self.fit_change(current, others, near.to_vec(), pair.collect()));
        }
        // one oscillation whose amplitude changes
        /// Degree of that amplitude: one more than in place of a decay, because beats of the group change it
        /// more.
        const DEGREE: usize = 4;
        let centre = group.iter().map(|o| o.cycles).sum::<f64>() / group.len() as f64;
        if group.iter().all(|o| o.onset == 0.0 && o.phase.len() < 2) {
            let one = OscillationAtom { envelope: vec![0.0; DEGREE], ..OscillationAtom::steady(centre) };
            changes.push(self.fit_change(current, others, near.to_vec(), vec![Atom::Oscillation(one)]));
        }
        changes
    }
}

/// Amplitude of an oscillation of an explanation, in scaled units; 0 if it is not a part of it.
fn amplitude_of(current: &Explanation, o: &OscillationAtom) -> f64 {
    let own = current.atoms_with_amplitudes().find(|(atom, _)| atom.oscillation() == Some(o));
    own.map_or(0.0, |(_, amplitudes)| math::hypot(amplitudes[0], amplitudes[1]))
}

/// Whether two groups have atoms of the same kind with nearly the same frequencies.
fn is_similar(a: &[Atom], b: &[Atom]) -> bool {
    /// Difference of frequencies, resolutions, below which atoms are nearly the same: an oscillation that
    /// moves by less keeps its neighbours. For steps and relaxations, the difference as a fraction of their
    /// width.
    const SAME: f64 = 0.1;
    let near = |a: f64, b: f64, scale: f64| (a - b).abs() < SAME * scale;
    let same = |(a, b): (&Atom, &Atom)| match (a, b) {
        (
            Atom::Step { shape: a, centre, width },
            Atom::Step { shape: b, centre: other, width: other_width },
        ) => a == b && near(*centre, *other, *width) && near(*width, *other_width, *width),
        (Atom::Relaxation { onset, nepers }, Atom::Relaxation { onset: other, nepers: other_nepers }) => {
            near(*onset, *other, nepers.recip()) && near(*nepers, *other_nepers, *nepers)
        }
        (Atom::Oscillation(a), Atom::Oscillation(b)) => {
            let kind = |o: &OscillationAtom| {
                (o.nepers.is_some(), o.onset > 0.0, o.phase.len(), o.envelope.len(), o.multiples.len())
            };
            kind(a) == kind(b) && (a.cycles - b.cycles).abs() < SAME
        }
        _ => false,
    };
    a.len() == b.len() && a.iter().zip(b).all(same)
}
