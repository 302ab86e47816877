//! Clusters: oscillations that lie close together and may be pieces of one whose amplitude changes.

use super::atom::{Atom, OscillationAtom};
use super::problem::{Explanation, NoisyRecord, Parts, dot};

/// Median distance of their frequencies, in resolutions, below which two oscillations belong to one cluster:
/// their peaks in a Hann spectrum touch.
pub(super) const CLUSTER_REACH: f64 = 2.5;

/// Groups the indices below `count`. Two indices are in one group if a chain of links joins them. The first
/// index of a group is its smallest.
pub(super) fn group_linked(count: usize, is_linked: impl Fn(usize, usize) -> bool) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> = (0..count).collect();
    let mut groups = Vec::new();
    while !left.is_empty() {
        let (mut group, mut next) = (vec![left.remove(0)], 0);
        while next < group.len() {
            let from = group[next];
            let (near, rest): (Vec<usize>, Vec<usize>) = left.into_iter().partition(|k| is_linked(from, *k));
            group.extend(near);
            left = rest;
            next += 1;
        }
        groups.push(group);
    }
    groups
}

/// The parts with each cluster of at least two oscillations replaced by one. Its frequency is the mean,
/// weighted by energy. Its amplitude is a polynomial, constant at first, without onset or decay. Its
/// harmonics are those of the strongest oscillation. `None` without a cluster.
pub(super) fn unite_clusters(problem: &NoisyRecord, found: &Explanation) -> Option<Parts> {
    /// Margin of a peak, resolutions: the peaks of a cluster touch in a Hann spectrum.
    const MARGIN: f64 = 1.25;
    /// Degree of the amplitude; the search raises or lowers it.
    const DEGREE: usize = 4;
    let atoms = &found.parts.atoms;
    let (_, courses) = problem.values_everywhere(found);
    let energy = |k: usize| dot(&courses[k], &courses[k]);
    let is_near = |a: usize, b: usize| {
        let bands = atoms[a].oscillation().zip(atoms[b].oscillation());
        bands.is_some_and(|(a, b)| a.overlaps(b, MARGIN))
    };
    let groups = group_linked(atoms.len(), is_near);
    let unite = |group: &Vec<usize>| {
        let strongest = group.iter().copied().max_by(|a, b| energy(*a).total_cmp(&energy(*b)))?;
        if group.len() < 2 {
            return Some(atoms[strongest].clone());
        }
        let total: f64 = group.iter().map(|k| energy(*k)).sum();
        let cycles = |k: &usize| atoms[*k].oscillation().map_or(0.0, OscillationAtom::mean_cycles);
        let mean = group.iter().map(|k| cycles(k) * energy(*k)).sum::<f64>() / total;
        Some(Atom::Oscillation(OscillationAtom {
            envelope: vec![0.0; DEGREE],
            multiples: atoms[strongest].multiples().to_vec(),
            ..OscillationAtom::steady(mean)
        }))
    };
    let united: Vec<Atom> = groups.iter().filter_map(unite).collect();
    (united.len() < atoms.len()).then_some(Parts { trend: found.parts.trend, atoms: united })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped_through_others() {
        let places = [0.0_f64, 10.0, 2.0, 1.0, 30.0, 11.5];
        let groups = group_linked(places.len(), |a, b| (places[a] - places[b]).abs() < 1.9);
        assert_eq!(groups, [vec![0, 3, 2], vec![1, 5], vec![4]]);
        assert_eq!(group_linked(0, |_, _| true), Vec::<Vec<usize>>::new());
    }
}
