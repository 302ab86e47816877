//! Parts that an explanation does not need: atoms, or parameters of atoms.

use super::{JOINT_ITERATIONS, LEAST_GAIN, PartSearch, Rival};
use crate::decomposition::atom::{Atom, FEWEST_CYCLES, OscillationAtom};
use crate::decomposition::problem::{Explanation, Parts};

impl PartSearch {
    /// Drops atoms or parameters of atoms one at a time as long as the criterion falls. `with_onsets` also
    /// tries other onsets, which takes long.
    pub(super) fn simplify_parts(&mut self, explanation: &Explanation, with_onsets: bool) -> Explanation {
        let mut current = explanation.clone();
        while let Some(simpler) = self.drop_part(&current, with_onsets) {
            current = simpler;
        }
        current
    }

    /// The explanation without one atom or one parameter of an atom; `None` if the criterion falls with none
    /// of them. The sum of squares to second order shows which variants are worth a fit. The variant with the
    /// lowest estimated criterion is fitted first.
    fn drop_part(&mut self, current: &Explanation, with_onsets: bool) -> Option<Explanation> {
        /// Largest estimated rise of the criterion, nats, with which a fit is tried.
        const WORTH_A_FIT: f64 = 1.0;
        /// Largest fall of the criterion, nats, that a fit with another onset is expected to bring.
        const MOST_FALL: f64 = 120.0;
        let products = self.problem.products_around(current);
        // parts, estimated criterion, and whether the onset changes
        let mut tried: Vec<(Parts, f64, bool)> = Vec::new();
        let mut first = 0;
        let sizes = current.parts.atoms.iter().map(|a| a.column_count() + a.parameters().len());
        let total: usize = sizes.sum();
        for (k, (atom, amplitudes)) in current.atoms_with_amplitudes().enumerate() {
            let values = [amplitudes, &atom.parameters()].concat();
            let size = values.len();
            for variant in simpler_variants(atom) {
                let mut atoms = current.parts.atoms.clone();
                let is_removed = variant.atom.is_none();
                atoms.splice(k..=k, variant.atom);
                let parts = Parts { trend: current.parts.trend, atoms };
                let Some(dropped) = variant.dropped else {
                    if with_onsets {
                        // an onset that is wrong by a few frames distorts the shapes of the other parts, so a
                        // fit with another onset starts far from its minimum
                        let quick = self.problem.fit_parts(&parts, 0);
                        tried.push((parts, quick.criterion - MOST_FALL, true));
                    }
                    continue;
                };
                let own = first..first + size;
                let kept: Vec<usize> = (0..total)
                    .filter(|i| !own.contains(i) || (!is_removed && !dropped.contains(&(i - first))))
                    .collect();
                let changed: Vec<f64> = dropped.iter().map(|i| values[*i]).collect();
                let dropped: Vec<usize> = dropped.iter().map(|i| first + i).collect();
                let rise = products.squares_without(&dropped, &changed, &kept);
                let criterion = self.problem.criterion(&parts, current.squares + rise);
                tried.push((parts, criterion, false));
            }
            first += size;
        }
        portable_math::sort_by_number(&mut tried, |a| a.1);
        for (parts, estimate, is_late) in tried {
            if estimate > current.criterion + WORTH_A_FIT {
                self.rivals.push(Rival { atoms: parts.atoms, criterion: estimate });
                continue;
            }
            let found = self.problem.fit_parts(&parts, if is_late { 3 } else { 1 } * JOINT_ITERATIONS);
            self.keep_rival(&found);
            if found.criterion < current.criterion - LEAST_GAIN {
                return Some(found);
            }
        }
        None
    }
}

/// An atom without one of its properties, or no atom.
struct SimplerVariant {
    /// `None` if the atom is removed.
    atom: Option<Atom>,
    /// Indices of those that become 0, in the list of the columns and then the parameters of the atom; `None`
    /// if the onset changes, which is not a parameter.
    dropped: Option<Vec<usize>>,
}

/// The variants of an atom without one of its properties, and without the atom itself. A break has no simpler
/// variant.
fn simpler_variants(atom: &Atom) -> Vec<SimplerVariant> {
    if let Atom::Break { .. } = atom {
        return Vec::new();
    }
    let columns = atom.column_count();
    let mut variants = vec![SimplerVariant { atom: None, dropped: Some((0..columns).collect()) }];
    if let Some(course) = atom.course() {
        for k in 0..course.multiples.len() {
            let mut simpler = course.clone();
            simpler.multiples.remove(k);
            let dropped = Some(vec![2 * k + 1, 2 * k + 2]);
            variants.push(SimplerVariant { atom: Some(Atom::Course(simpler)), dropped });
        }
    }
    let Some(o) = atom.oscillation() else { return variants };
    let mut add = |o: OscillationAtom, dropped: Option<Vec<usize>>| {
        if o.cycles > FEWEST_CYCLES {
            variants.push(SimplerVariant { atom: Some(Atom::Oscillation(o)), dropped });
        }
    };
    let shapes = columns + 1 + usize::from(o.nepers.is_some());
    if o.nepers.is_some() {
        let dropped = (o.onset == 0.0).then(|| vec![columns + 1]);
        add(OscillationAtom { nepers: None, onset: 0.0, ..o.clone() }, dropped);
    }
    if o.onset > 0.0 && o.nepers.is_some_and(|d| d * o.onset < 4.0) {
        add(OscillationAtom { onset: 0.0, ..o.clone() }, None);
    }
    if let Some((_, phase)) = o.phase.split_last() {
        let phase = phase.to_vec();
        let last = shapes + phase.len();
        add(OscillationAtom { phase, ..o.clone() }, Some(vec![last]));
    }
    if let Some((_, envelope)) = o.envelope.split_last() {
        let envelope = envelope.to_vec();
        let last = shapes + o.phase.len() + envelope.len();
        add(OscillationAtom { envelope, ..o.clone() }, Some(vec![last]));
    }
    for k in 0..o.multiples.len() {
        let mut multiples = o.multiples.clone();
        multiples.remove(k);
        add(OscillationAtom { multiples, ..o.clone() }, Some(vec![2 * k + 2, 2 * k + 3]));
    }
    variants
}
