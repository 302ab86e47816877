//! The search for the most probable parts of a record: parts are added, get more or fewer parameters, and are
//! divided, united or dropped, as long as the criterion falls. The explanations tried on the way are kept as
//! rivals: doubts follow from their odds.

use super::atom::{Atom, FEWEST_CYCLES, MOST_ENVELOPE_DEGREE, MOST_PHASE_DEGREE, OscillationAtom, StepShape};
use super::candidates::{Candidate, find_candidates};
use super::problem::{Explanation, Fixed, NoisyRecord, Parts, dot};
use crate::periodogram::upper_median;
use crate::trend::Trend;
use portable_math as math;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Iterations of a fit of one part while the others stay.
const LOCAL_ITERATIONS: usize = 8;
/// Iterations of a fit of all parts: it starts near the minimum, and each iteration takes longer.
const JOINT_ITERATIONS: usize = 4;
/// Largest number of changes in a round that are fitted while the other parts stay: those with the largest
/// estimated gain, because estimates are much faster than fits.
const TRIED_CHANGES: usize = 5;
/// Largest number of these changes for which all parts are then fitted together.
const JOINTLY_FITTED: usize = 2;
/// All parts are fitted together only for changes whose criterion is within this distance, nats, of the best
/// change of the round: a joint fit rarely gains more.
const NEARLY_AS_GOOD: f64 = 8.0;
/// Smallest fall of the criterion, nats, that counts as a gain; smaller ones come from unfinished iterations.
const LEAST_GAIN: f64 = 1e-3;
/// All parts are not fitted together for a change that raises the criterion by more than this, nats, while
/// the other parts stay.
const HOPELESS: f64 = 12.0;

/// Price of a frame that is left out as an outlier, in units of the logarithm of the number of frames: 1 for
/// its position and 1/2 for its value.
const OUTLIER_PRICE: f64 = 1.5;
/// An oscillation with a faster decay or growth than this, nepers per record, gets no harmonics: it is a free
/// oscillation, and not a driven cycle.
const DRIVEN_NEPERS: f64 = 3.0;
/// A frame left out as an outlier is used again if the parts explain it within this number of standard
/// deviations: fewer than those with which it is left out, so that frames do not change sides in every round.
const TAKEN_BACK_DEVIATIONS: f64 = 4.0;

/// An explanation that was tried: the odds of a frequency follow from it.
#[derive(Debug, Clone)]
pub(crate) struct Rival {
    pub atoms: Vec<Atom>,
    pub criterion: f64,
}

/// A search over one choice of frames and noise.
pub(crate) struct PartSearch {
    /// The frames used and their noise; outliers are taken out of it during the search.
    pub problem: NoisyRecord,
    /// Whether the trend may get more columns and steps and relaxations may be added.
    pub trend_grows: bool,
    /// Largest number of oscillations.
    pub most_oscillations: usize,
    /// Every explanation that was fitted.
    pub rivals: Vec<Rival>,
    /// The problem before frames were left out as outliers, if any were.
    whole: Option<NoisyRecord>,
    /// Criterion of the best explanation that is known without this search, infinite if there is none. A
    /// search that gains too slowly to reach it ends.
    pub bound: f64,
}

/// A change of parts with its estimated gain, nats. The `fitted` atoms are fitted first, while the `kept`
/// ones stay.
struct Change {
    gain: f64,
    trend: Trend,
    kept: Vec<Atom>,
    fitted: Vec<Atom>,
    /// Whether `fitted` are already fitted, so that the gain is that of a fit.
    is_fitted: bool,
}

impl PartSearch {
    pub(crate) fn new(problem: NoisyRecord, trend_grows: bool, most_oscillations: usize) -> Self {
        Self {
            problem,
            trend_grows,
            most_oscillations,
            rivals: Vec::new(),
            whole: None,
            bound: f64::INFINITY,
        }
    }

    /// The most probable parts that are found from `start` on.
    pub(crate) fn find_parts(&mut self, start: Parts) -> Explanation {
        /// Largest number of rounds for a record of at most `SHORT_RECORD` frames; it bounds the time.
        const MOST_ROUNDS: usize = 40;
        /// Largest number of rounds for a long record: enough for several parts.
        const FEWEST_ROUNDS: usize = 12;
        /// Frames up to which a record gets all rounds; the number falls in inverse proportion to longer
        /// ones.
        const SHORT_RECORD: usize = 4096;
        /// Number of rounds before a search may end because of the bound: the first parts gain most.
        const FEW_CHANGES: usize = 4;
        /// The search ends if this number of rounds with the gain of the last one does not reach the bound;
        /// later rounds rarely gain more.
        const FORESEEN_ROUNDS: f64 = 6.0;
        let mut current = self.problem.fit_parts(&start, LOCAL_ITERATIONS);
        let mut last = f64::INFINITY;
        // the time of a round grows with the length of the record
        let most = (MOST_ROUNDS * SHORT_RECORD / self.problem.len().max(1)).clamp(FEWEST_ROUNDS, MOST_ROUNDS);
        for round in 0..most {
            let gain = last - current.criterion;
            if round >= FEW_CHANGES && current.criterion - self.bound > FORESEEN_ROUNDS * gain {
                return current;
            }
            last = current.criterion;
            let next = self.best_change(&current);
            let improved = next.filter(|next| next.criterion < current.criterion - LEAST_GAIN);
            match improved {
                Some(next) => current = next,
                None => {
                    let simpler = self.simplify_parts(&current);
                    if simpler.criterion >= current.criterion - LEAST_GAIN {
                        return current;
                    }
                    current = simpler;
                    continue;
                }
            }
            current = self.take_back_frames(current);
            current = self.leave_out_outliers(current);
            current = self.simplify_parts(&current);
        }
        current
    }

    fn keep_rival(&mut self, explanation: &Explanation) {
        self.rivals.push(Rival { atoms: explanation.parts.atoms.clone(), criterion: explanation.criterion });
    }

    /// Fits the atoms of a change while those kept stay. Returns all parts with their criterion. Tries every
    /// shape of a step, and moves the onset of a late oscillation.
    fn try_change(&self, change: &Change) -> (Parts, f64) {
        let fixed = self.problem.fix_parts(change.trend, &change.kept);
        let (mut fitted, mut squares) =
            self.problem.fit_atoms(&fixed, change.fitted.clone(), LOCAL_ITERATIONS);
        if fitted.len() == 1 && fitted[0].oscillation().is_some_and(|o| o.onset > 0.0) {
            (fitted, squares) = self.place_onset(&fixed, fitted.remove(0), squares);
        }
        if let [Atom::Step { centre, width, .. }] = fitted[..] {
            for shape in StepShape::ALL {
                let step = Atom::Step { shape, centre, width: width * shape.steepness() };
                let (atoms, left) = self.problem.fit_atoms(&fixed, vec![step], 2 * LOCAL_ITERATIONS);
                if left < squares {
                    (fitted, squares) = (atoms, left);
                }
            }
        }
        let atoms = [change.kept.clone(), fitted].concat();
        let parts = Parts { trend: change.trend, atoms };
        let criterion = self.problem.criterion(&parts, squares);
        (parts, criterion)
    }

    /// Moves the onset of an oscillation, in steps that are halved down to one frame, as long as the sum of
    /// squares falls.
    fn place_onset(&self, fixed: &Fixed, atom: Atom, squares: f64) -> (Vec<Atom>, f64) {
        /// Iterations of the fit at each onset: the other parameters hardly depend on it.
        const ITERATIONS: usize = 2;
        let frames = self.problem.at.frames as f64;
        let mut best = (atom, squares);
        let nepers = best.0.oscillation().and_then(|o| o.nepers).unwrap_or(6.0).abs().max(6.0);
        let mut step = (frames / nepers / 3.0).ceil();
        while step >= 1.0 {
            let mut moved = false;
            for sign in [-1.0, 1.0] {
                let Some(o) = best.0.oscillation() else { break };
                let onset = ((o.onset * frames).round() + sign * step).max(0.0) / frames;
                if onset > 0.97 || onset == o.onset {
                    continue;
                }
                let trial = Atom::Oscillation(OscillationAtom { onset, ..o.clone() });
                let (mut atoms, squares) = self.problem.fit_atoms(fixed, vec![trial], ITERATIONS);
                if squares < best.1 {
                    best = (atoms.remove(0), squares);
                    moved = true;
                    break;
                }
            }
            if !moved {
                step = if step > 1.0 { (step / 2.0).floor() } else { 0.0 };
            }
        }
        (vec![best.0], best.1)
    }

    /// The explanation with the lowest criterion after the most promising changes, which may be higher than
    /// that of `current`; `None` without a promising change.
    fn best_change(&mut self, current: &Explanation) -> Option<Explanation> {
        let mut changes = self.list_additions(current);
        changes.extend(self.list_enrichments(current));
        changes.extend(self.list_trends(current));
        self.rivals.extend(changes.iter().filter(|c| c.is_fitted && c.gain > -HOPELESS).map(|change| {
            Rival {
                atoms: [change.kept.clone(), change.fitted.clone()].concat(),
                criterion: current.criterion - change.gain,
            }
        }));
        changes.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let least = -self.problem.log_frames();
        let promising = changes.iter().take(TRIED_CHANGES).take_while(|change| change.gain > least);
        let promising: Vec<&Change> = promising.collect();
        let mut tried: Vec<(Parts, f64)> =
            promising.par_iter().map(|change| self.try_change(change)).collect();
        self.rivals.extend(
            tried.iter().map(|(p, criterion)| Rival { atoms: p.atoms.clone(), criterion: *criterion }),
        );
        tried.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut best: Option<Explanation> = None;
        let most = tried.first().map_or(0.0, |(_, criterion)| *criterion) + NEARLY_AS_GOOD;
        for (parts, criterion) in tried.into_iter().take(JOINTLY_FITTED) {
            if criterion > current.criterion + HOPELESS || criterion > most {
                break;
            }
            let found = self.problem.fit_parts(&parts, JOINT_ITERATIONS);
            self.keep_rival(&found);
            if best.as_ref().is_none_or(|best| found.criterion < best.criterion) {
                best = Some(found);
            }
        }
        best
    }

    /// Additions of one part that the residual may contain.
    fn list_additions(&self, current: &Explanation) -> Vec<Change> {
        let oscillations = current.parts.atoms.iter().filter(|a| a.oscillation().is_some()).count();
        let fixed = self.problem.fix_parts(current.parts.trend, &current.parts.atoms);
        let mut found = find_candidates(&self.problem, &fixed, (0.0, f64::INFINITY), self.trend_grows);
        if oscillations >= self.most_oscillations {
            found.retain(|candidate| candidate.atom.oscillation().is_none());
        }
        let change = |candidate: Candidate| Change {
            gain: candidate.gain,
            trend: current.parts.trend,
            kept: current.parts.atoms.clone(),
            fitted: vec![candidate.atom],
            is_fitted: false,
        };
        found.into_iter().map(change).collect()
    }

    /// Changes to the next three richer trends.
    fn list_trends(&self, current: &Explanation) -> Vec<Change> {
        let mut changes = Vec::new();
        let mut trend = current.parts.trend;
        if !self.trend_grows {
            return changes;
        }
        let base = current.squares;
        for _ in 0..3 {
            let Some(richer) = trend.next_richer() else { break };
            trend = richer;
            let fixed = self.problem.fix_parts(trend, &current.parts.atoms);
            let residual = self.problem.residual_of(&fixed);
            let squares = dot(residual, residual);
            let parts = Parts { trend, atoms: current.parts.atoms.clone() };
            let gain = self.problem.criterion(&current.parts, base) - self.problem.criterion(&parts, squares);
            changes.push(Change { gain, trend, kept: parts.atoms, fitted: Vec::new(), is_fitted: false });
        }
        changes
    }

    /// Changes that give an oscillation a decay, a drift or harmonics, or divide or unite oscillations.
    fn list_enrichments(&self, current: &Explanation) -> Vec<Change> {
        let atoms = &current.parts.atoms;
        let fixed = self.problem.fix_parts(current.parts.trend, atoms);
        let mut changes = Vec::new();
        let mut first = 0;
        for (k, atom) in atoms.iter().enumerate() {
            let amplitudes = current.amplitudes[first..first + atom.column_count()].to_vec();
            first += atom.column_count();
            let Some(o) = atom.oscillation() else { continue };
            let kept: Vec<Atom> =
                atoms.iter().enumerate().filter(|(j, _)| *j != k).map(|(_, a)| a.clone()).collect();
            let mut variants: Vec<Vec<Atom>> = Vec::new();
            let one = |o: OscillationAtom| vec![Atom::Oscillation(o)];
            if o.nepers.is_none() && o.envelope.is_empty() {
                variants.push(one(OscillationAtom { nepers: Some(0.0), ..o.clone() }));
            }
            for more in 1..=2 {
                if o.phase.len() + more < MOST_PHASE_DEGREE {
                    let phase = [o.phase.clone(), vec![0.0; more]].concat();
                    variants.push(one(OscillationAtom { phase, ..o.clone() }));
                }
            }
            if o.nepers.is_none() && o.onset == 0.0 {
                for more in 1..=2 {
                    if o.envelope.len() + more <= MOST_ENVELOPE_DEGREE {
                        let envelope = [o.envelope.clone(), vec![0.0; more]].concat();
                        variants.push(one(OscillationAtom { envelope, ..o.clone() }));
                    }
                }
            }
            // a driven cycle may have harmonics, a free oscillation that decays has none
            let driven = o.onset == 0.0 && o.nepers.is_none_or(|d| d.abs() < DRIVEN_NEPERS);
            let next = o.multiples.last().map_or(2, |m| m + 1);
            for multiple in (next..next + 2).filter(|_| driven) {
                let multiples = [o.multiples.clone(), vec![multiple]].concat();
                variants.push(one(OscillationAtom { multiples, ..o.clone() }));
            }
            for variant in variants {
                let gain = self.gain_of_variant(&fixed, atom, &amplitudes, &variant[0]);
                changes.push(Change {
                    gain,
                    trend: current.parts.trend,
                    kept: kept.clone(),
                    fitted: variant,
                    is_fitted: false,
                });
            }
            if self.leaves_neighbours(&fixed, o) {
                changes.extend(self.exchange_decay(current, o, &kept));
                changes.extend(self.list_divisions(current, o, &kept));
            }
            changes.extend(self.list_unions(current, k, o));
        }
        changes
    }

    /// Estimated gain, nats, of a variant with more parameters or columns over the atom itself, which is
    /// among the fixed parts (score test).
    fn gain_of_variant(&self, fixed: &Fixed, atom: &Atom, amplitudes: &[f64], variant: &Atom) -> f64 {
        let columns = variant.columns(&self.problem.at);
        // a column that the atom lacks has no amplitude yet
        let mut amplitudes = amplitudes.to_vec();
        amplitudes.resize(columns.len(), 0.0);
        let mut all = variant.derivatives(&self.problem.at, &columns, &amplitudes);
        all.extend(columns);
        let share = self.problem.gain_of_columns(fixed, all).clamp(0.0, 1.0 - 1e-9);
        -0.5 * self.problem.len() as f64 * math::ln_1p(-share)
            - (variant.price() - atom.price()) * self.problem.log_frames()
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
        let slow = slow.map(|(power, column)| times(power, column)).collect();
        let share = self.problem.gain_of_columns(fixed, slow).clamp(0.0, 1.0 - 1e-9);
        -0.5 * self.problem.len() as f64 * math::ln_1p(-share) > 2.0 * self.problem.log_frames()
    }

    /// The oscillation with a polynomial amplitude in place of its decay; `None` if it has no decay that a
    /// polynomial can follow.
    fn exchange_decay(&self, current: &Explanation, o: &OscillationAtom, kept: &[Atom]) -> Option<Change> {
        /// Degree with which the polynomial starts; later changes raise or lower it.
        const DEGREE: usize = 3;
        /// Fastest decay or growth, nepers per record, that a polynomial can follow.
        const MOST_FOLLOWED: f64 = 8.0;
        let follows = o.onset == 0.0 && o.nepers.is_some_and(|d| d.abs() < MOST_FOLLOWED);
        let polynomial = || OscillationAtom { nepers: None, envelope: vec![0.0; DEGREE], ..o.clone() };
        follows.then(|| self.fit_change(current, kept, vec![Atom::Oscillation(polynomial())]))
    }

    /// A change with its gain after a fit of `atoms` while those kept stay.
    fn fit_change(&self, current: &Explanation, kept: &[Atom], atoms: Vec<Atom>) -> Change {
        let trend = current.parts.trend;
        let fixed = self.problem.fix_parts(trend, kept);
        let (fitted, squares) = self.problem.fit_atoms(&fixed, atoms, LOCAL_ITERATIONS);
        let parts = Parts { trend, atoms: [kept.to_vec(), fitted.clone()].concat() };
        let criterion = self.problem.criterion(&parts, squares);
        Change { gain: current.criterion - criterion, trend, kept: kept.to_vec(), fitted, is_fitted: true }
    }

    /// Divisions of an oscillation into two steady ones at three different distances; none if its drift is
    /// more than linear or if it has harmonics.
    fn list_divisions(&self, current: &Explanation, o: &OscillationAtom, kept: &[Atom]) -> Vec<Change> {
        if o.phase.len() > 1 || !o.multiples.is_empty() {
            return Vec::new();
        }
        let half = 0.35 + o.phase.first().map_or(0.0, |q| 3.0 * q.abs());
        let offer = |(a, b): (f64, f64)| {
            let pair = [a, b].map(|by| Atom::Oscillation(OscillationAtom::steady(o.cycles + by)));
            self.fit_change(current, kept, pair.to_vec())
        };
        [(-half, half), (-1.0, 0.2), (-0.2, 1.0)].into_iter().map(offer).collect()
    }

    /// Unions of an oscillation with its neighbours into one drifting or decaying oscillation. Neighbours are
    /// oscillations whose peaks overlap its own.
    fn list_unions(&self, current: &Explanation, k: usize, o: &OscillationAtom) -> Vec<Change> {
        let atoms = &current.parts.atoms;
        let reach = |o: &OscillationAtom| {
            let (low, high) = o.cycles_range();
            let wide = 2.5 + o.nepers.map_or(0.0, |d| d.abs() / TAU);
            (low - wide, high + wide)
        };
        let (low, high) = reach(o);
        let near: Vec<usize> = (0..atoms.len())
            .filter(|j| {
                atoms[*j].oscillation().is_some_and(|other| {
                    let (l, h) = reach(other);
                    l < high && low < h
                })
            })
            .collect();
        // only the first oscillation of a group unites it, so that no group is tried twice
        if near.len() < 2 || near[0] != k {
            return Vec::new();
        }
        let mut changes = self.list_group_envelopes(current, &near);
        let kept: Vec<Atom> =
            atoms.iter().enumerate().filter(|(j, _)| !near.contains(j)).map(|(_, a)| a.clone()).collect();
        let ranges = near.iter().filter_map(|j| atoms[*j].oscillation()).map(reach);
        let band = ranges.fold((f64::INFINITY, 0.0_f64), |(a, b), (l, h)| (a.min(l), b.max(h)));
        let fixed = self.problem.fix_parts(current.parts.trend, &kept);
        let base = self.problem.criterion(
            &Parts { trend: current.parts.trend, atoms: kept.clone() },
            dot(self.problem.residual_of(&fixed), self.problem.residual_of(&fixed)),
        );
        let change = |candidate: Candidate| Change {
            gain: current.criterion - base + candidate.gain + 3.0 * self.problem.log_frames(),
            trend: current.parts.trend,
            kept: kept.clone(),
            fitted: vec![candidate.atom],
            is_fitted: false,
        };
        changes.extend(find_candidates(&self.problem, &fixed, band, false).into_iter().map(change));
        changes
    }

    /// Changes of a group of neighbours as a whole: every one of them decays, because one alone may gain
    /// nothing by it; the two largest remain, without drift or decay; one oscillation with a polynomial
    /// amplitude replaces all of them.
    fn list_group_envelopes(&self, current: &Explanation, near: &[usize]) -> Vec<Change> {
        /// Decay, nepers per record, from which the fit of a steady oscillation starts: a slow one, which the
        /// fit can also turn into growth.
        const START_NEPERS: f64 = 1.0;
        let atoms = &current.parts.atoms;
        let group: Vec<&OscillationAtom> = near.iter().filter_map(|j| atoms[*j].oscillation()).collect();
        if group.len() > 4 {
            return Vec::new();
        }
        let kept: Vec<Atom> =
            atoms.iter().enumerate().filter(|(j, _)| !near.contains(j)).map(|(_, a)| a.clone()).collect();
        let decaying = |o: &&OscillationAtom| {
            Atom::Oscillation(OscillationAtom {
                nepers: o.nepers.or(Some(START_NEPERS)),
                phase: Vec::new(),
                envelope: Vec::new(),
                ..(*o).clone()
            })
        };
        let mut changes = vec![self.fit_change(current, &kept, group.iter().map(decaying).collect())];
        if group.len() > 2 {
            let mut largest: Vec<&OscillationAtom> = group.clone();
            let size = |o: &OscillationAtom| self.amplitude_of(current, o);
            largest.sort_by(|a, b| size(b).total_cmp(&size(a)));
            let pair = largest[..2].iter().map(|o| Atom::Oscillation(OscillationAtom::steady(o.cycles)));
            changes.push(self.fit_change(current, &kept, pair.collect()));
        }
        // one oscillation whose amplitude changes
        /// Degree of that amplitude: one more than in place of a decay, because beats of the group change it
        /// more.
        const DEGREE: usize = 4;
        let centre = group.iter().map(|o| o.cycles).sum::<f64>() / group.len() as f64;
        if group.iter().all(|o| o.onset == 0.0 && o.phase.len() < 2) {
            let one = OscillationAtom { envelope: vec![0.0; DEGREE], ..OscillationAtom::steady(centre) };
            changes.push(self.fit_change(current, &kept, vec![Atom::Oscillation(one)]));
        }
        changes
    }

    /// Amplitude of an oscillation of an explanation, in scaled units; 0 if it is not a part of it.
    fn amplitude_of(&self, current: &Explanation, o: &OscillationAtom) -> f64 {
        let mut first = 0;
        for atom in &current.parts.atoms {
            if atom.oscillation() == Some(o) {
                return math::hypot(current.amplitudes[first], current.amplitudes[first + 1]);
            }
            first += atom.column_count();
        }
        0.0
    }

    /// Drops atoms or parameters of atoms one at a time, that with the largest fall of the criterion first,
    /// as long as it falls.
    fn simplify_parts(&mut self, explanation: &Explanation) -> Explanation {
        let mut current = explanation.clone();
        loop {
            let mut best: Option<Explanation> = None;
            for (k, atom) in current.parts.atoms.clone().iter().enumerate() {
                for variant in simpler_variants(atom) {
                    let mut atoms = current.parts.atoms.clone();
                    atoms.splice(k..=k, variant);
                    let parts = Parts { trend: current.parts.trend, atoms };
                    // a fit of the amplitudes alone shows whether a simpler part can be enough
                    let quick = self.problem.fit_parts(&parts, 0);
                    // an onset that is wrong by a few frames distorts the shapes of the other parts, so the
                    // fit without this part starts further from its minimum
                    let late = atom.oscillation().is_some_and(|o| o.onset > 0.0);
                    let (reach, iterations) = if late {
                        (10.0 * HOPELESS, 3 * JOINT_ITERATIONS)
                    } else {
                        (HOPELESS, JOINT_ITERATIONS)
                    };
                    let found = if quick.criterion < current.criterion + reach {
                        self.problem.fit_parts(&quick.parts, iterations)
                    } else {
                        quick
                    };
                    self.keep_rival(&found);
                    if found.criterion < current.criterion - LEAST_GAIN
                        && best.as_ref().is_none_or(|best| found.criterion < best.criterion)
                    {
                        best = Some(found);
                    }
                }
            }
            match best {
                Some(best) => current = best,
                None => return current,
            }
        }
    }

    /// Uses frames again that were left out as outliers and that the parts now explain, if the criterion
    /// falls.
    fn take_back_frames(&mut self, current: Explanation) -> Explanation {
        let Some(whole) = self.whole.as_ref().filter(|whole| whole.len() > self.problem.len()) else {
            return current;
        };
        let sd = robust_sd(&current.residual);
        let residual = whole.residual_everywhere(&self.problem, &current);
        let explained = |k: usize| residual[k].abs() < TAKEN_BACK_DEVIATIONS * sd;
        let used = &self.problem.used;
        let back: Vec<usize> = (0..whole.len())
            .filter(|k| used.binary_search(&whole.used[*k]).is_err() && explained(*k))
            .map(|k| whole.used[k])
            .collect();
        if back.is_empty() {
            return current;
        }
        let price = OUTLIER_PRICE * whole.log_frames();
        let problem = whole
            .without_frames(|i| used.binary_search(&i).is_err() && back.binary_search(&i).is_err(), price);
        let found = problem.fit_parts(&current.parts, JOINT_ITERATIONS);
        if found.criterion >= current.criterion {
            return current;
        }
        self.problem = problem;
        found
    }

    /// Leaves out outliers as long as the criterion falls: frames that a free value of their own explains
    /// better, although position and value have a price. In coloured noise every frame is used.
    fn leave_out_outliers(&mut self, current: Explanation) -> Explanation {
        /// Smallest deviation of an outlier, in standard deviations of the residual: normal noise exceeds it
        /// in one of 150,000 frames.
        const LEAST_DEVIATIONS: f64 = 4.5;
        /// Largest fraction of frames that is left out at once: if more deviate, a part is missing.
        const MOST_SHARE: f64 = 0.1;
        /// Distance, frames, within which outliers count as close together.
        const OUTLIER_REACH: usize = 8;
        /// Largest number of outliers close together, including the frame itself.
        const OUTLIERS_TOGETHER: usize = 3;
        if self.problem.order > 0 {
            return current;
        }
        let mut current = current;
        loop {
            let n = self.problem.len() as f64;
            let sd = robust_sd(&current.residual);
            let gain = |r: f64| -0.5 * n * math::ln_1p(-(r * r / current.squares).min(1.0 - 1e-12));
            let price = OUTLIER_PRICE * self.problem.log_frames();
            let bad: Vec<usize> = (0..current.residual.len())
                .filter(|i| {
                    let r = current.residual[*i];
                    r.abs() > LEAST_DEVIATIONS * sd && gain(r) > price
                })
                .map(|i| self.problem.used[i])
                .collect();
            // more outliers close together are motion that no part explains yet
            let near = |i: usize| bad.iter().filter(|j| j.abs_diff(i) <= OUTLIER_REACH).count();
            let bad: Vec<usize> = bad.iter().copied().filter(|i| near(*i) <= OUTLIERS_TOGETHER).collect();
            if bad.is_empty() || bad.len() as f64 > MOST_SHARE * n {
                return current;
            }
            let without = self.problem.without_frames(|i| bad.binary_search(&i).is_ok(), price);
            let found = without.fit_parts(&current.parts, JOINT_ITERATIONS);
            if found.criterion >= current.criterion {
                return current;
            }
            if self.whole.is_none() {
                self.whole = Some(self.problem.clone());
            }
            self.problem = without;
            current = found;
        }
    }
}

/// Standard deviation of normal values from the median of their sizes, which outliers hardly change.
fn robust_sd(values: &[f64]) -> f64 {
    /// Standard deviation of normal values over the median of their sizes.
    const SD_OVER_MEDIAN: f64 = 1.4826;
    upper_median(values.iter().map(|x| x.abs()).collect()).map_or(0.0, |median| SD_OVER_MEDIAN * median)
}

/// The lists of atoms that may replace an atom: none at all, or the atom with one property fewer. A break has
/// no simpler variant.
fn simpler_variants(atom: &Atom) -> Vec<Vec<Atom>> {
    let mut variants = vec![Vec::new()];
    if let Atom::Break { .. } = atom {
        return Vec::new();
    }
    let Some(o) = atom.oscillation() else { return variants };
    let mut add = |o: OscillationAtom| variants.push(vec![Atom::Oscillation(o)]);
    if o.nepers.is_some() {
        add(OscillationAtom { nepers: None, onset: 0.0, ..o.clone() });
    }
    if o.onset > 0.0 && o.nepers.is_some_and(|d| d * o.onset < 4.0) {
        add(OscillationAtom { onset: 0.0, ..o.clone() });
    }
    if !o.phase.is_empty() {
        add(OscillationAtom { phase: o.phase[..o.phase.len() - 1].to_vec(), ..o.clone() });
    }
    if !o.envelope.is_empty() {
        add(OscillationAtom { envelope: o.envelope[..o.envelope.len() - 1].to_vec(), ..o.clone() });
    }
    for k in 0..o.multiples.len() {
        let mut multiples = o.multiples.clone();
        multiples.remove(k);
        add(OscillationAtom { multiples, ..o.clone() });
    }
    variants.retain(|variant| {
        variant.iter().all(|atom| atom.oscillation().is_none_or(|o| o.cycles > FEWEST_CYCLES))
    });
    variants
}
