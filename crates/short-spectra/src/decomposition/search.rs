//! The search for the most probable parts of a record: parts are added, get more or fewer parameters, and are
//! divided, united or dropped, as long as the criterion falls. The explanations tried on the way are kept as
//! rivals: doubts follow from their odds.

mod changes;
mod simplification;

use super::atom::{Atom, OscillationAtom, StepShape};
use super::problem::{Explanation, Fixed, NoisyRecord, Parts};
use crate::periodogram::upper_median;
use crate::trend::Trend;
use portable_math as math;
use rayon::prelude::*;

/// Iterations of a fit of one part while the others stay.
const LOCAL_ITERATIONS: usize = 8;
/// Iterations of a fit of all parts: it starts near the minimum, and each iteration takes longer.
const JOINT_ITERATIONS: usize = 4;
/// Largest number of changes in a round that are fitted while the other parts stay: those with the largest
/// estimated gain, because estimates are much faster than fits.
const TRIED_CHANGES: usize = 5;
/// Smallest fall of the criterion, nats, that counts as a gain; smaller ones come from unfinished iterations.
const LEAST_GAIN: f64 = 0.02;
/// All parts are not fitted together for a change that raises the criterion by more than this, nats, while
/// the other parts stay.
const HOPELESS: f64 = 12.0;

/// Price of a frame that is left out as an outlier, in units of the logarithm of the number of frames: 1 for
/// its position and 1/2 for its value.
const OUTLIER_PRICE: f64 = 1.5;
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
    /// Groups of atoms for which changes that need a fit were offered.
    offered: Vec<Vec<Atom>>,
    /// Criterion of the best explanation that is known without this search, infinite if there is none. A
    /// search that gains too slowly to reach it ends.
    pub bound: f64,
}

/// A change of parts with its estimated gain, nats: `fitted` atoms take the place of those with the indices
/// `replaced`, and are fitted first while the other atoms stay.
struct Change {
    gain: f64,
    trend: Trend,
    replaced: Vec<usize>,
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
            offered: Vec::new(),
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
                    let simpler = self.simplify_parts(&current, true);
                    if simpler.criterion >= current.criterion - LEAST_GAIN {
                        return current;
                    }
                    current = simpler;
                    continue;
                }
            }
            current = self.take_back_frames(current);
            current = self.leave_out_outliers(current);
            current = self.simplify_parts(&current, false);
        }
        current
    }

    fn keep_rival(&mut self, explanation: &Explanation) {
        self.rivals.push(Rival { atoms: explanation.parts.atoms.clone(), criterion: explanation.criterion });
    }

    /// Fits the atoms of a change while those kept stay. Returns all parts with their criterion. Tries every
    /// shape of a step, and moves the onset of a late oscillation.
    fn try_change(&self, current: &Explanation, unchanged: &Fixed, change: &Change) -> FittedChange {
        let kept = atoms_without(&current.parts.atoms, &change.replaced);
        let adds = change.replaced.is_empty() && change.trend == current.parts.trend;
        let others;
        let fixed = if adds {
            unchanged
        } else {
            others = self.problem.fix_parts(change.trend, &kept);
            &others
        };
        let (mut fitted, mut squares) =
            self.problem.fit_atoms(fixed, change.fitted.clone(), LOCAL_ITERATIONS);
        if fitted.len() == 1 && fitted[0].oscillation().is_some_and(|o| o.onset > 0.0) {
            (fitted, squares) = self.place_onset(fixed, fitted.remove(0), squares);
        }
        if let [Atom::Step { centre, width, .. }] = fitted[..] {
            for shape in StepShape::ALL {
                let step = Atom::Step { shape, centre, width: width * shape.steepness() };
                let (atoms, left) = self.problem.fit_atoms(fixed, vec![step], 2 * LOCAL_ITERATIONS);
                if left < squares {
                    (fitted, squares) = (atoms, left);
                }
            }
        }
        let parts = Parts { trend: change.trend, atoms: [kept, fitted.clone()].concat() };
        let criterion = self.problem.criterion(&parts, squares);
        FittedChange { replaced: change.replaced.clone(), fitted, parts, criterion }
    }

    /// Moves the onset of an oscillation, in steps that are halved down to one frame, as long as the sum of
    /// squares falls. Each step is made at most `MOST_MOVES` times.
    fn place_onset(&self, fixed: &Fixed, atom: Atom, squares: f64) -> (Vec<Atom>, f64) {
        /// Iterations of the fit at each onset: the other parameters hardly depend on it.
        const ITERATIONS: usize = 2;
        /// A few moves are enough: the step before, twice as long, has brought the onset within about
        /// two steps.
        const MOST_MOVES: usize = 4;
        let frames = self.problem.at.frames as f64;
        let (mut best, mut moves) = ((atom, squares), 0);
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
            moves += 1;
            if !moved || moves == MOST_MOVES {
                step = if step > 1.0 { (step / 2.0).floor() } else { 0.0 };
                moves = 0;
            }
        }
        (vec![best.0], best.1)
    }

    /// The explanation with the lowest criterion after the most promising changes, which may be higher than
    /// that of `current`; `None` without a promising change.
    fn best_change(&mut self, current: &Explanation) -> Option<Explanation> {
        let fixed = self.problem.fix_parts(current.parts.trend, &current.parts.atoms);
        let mut changes = self.list_additions(current, &fixed);
        changes.extend(self.list_enrichments(current, &fixed));
        changes.extend(self.list_trends(current, &fixed));
        let atoms = &current.parts.atoms;
        let worth_keeping = changes.iter().filter(|c| c.is_fitted && c.gain > -HOPELESS);
        self.rivals.extend(worth_keeping.map(|change| Rival {
            atoms: [atoms_without(atoms, &change.replaced), change.fitted.clone()].concat(),
            criterion: current.criterion - change.gain,
        }));
        math::sort_by_number(&mut changes, |a| -a.gain);
        let least = -self.problem.log_frames();
        let promising = changes.iter().take(TRIED_CHANGES).take_while(|change| change.gain > least);
        let promising: Vec<&Change> = promising.collect();
        let mut tried: Vec<FittedChange> =
            promising.par_iter().map(|change| self.try_change(current, &fixed, change)).collect();
        self.rivals
            .extend(tried.iter().map(|t| Rival { atoms: t.parts.atoms.clone(), criterion: t.criterion }));
        math::sort_by_number(&mut tried, |a| a.criterion);
        let best = tried.first().filter(|best| best.criterion < current.criterion + HOPELESS)?;
        // if several changes together gain more than the best one alone, it need not be fitted
        if let Some(parts) = combine_changes(current, &tried) {
            let found = self.problem.fit_parts(&parts, JOINT_ITERATIONS);
            self.keep_rival(&found);
            if found.criterion < best.criterion {
                return Some(found);
            }
        }
        let found = self.problem.fit_parts(&best.parts, JOINT_ITERATIONS);
        self.keep_rival(&found);
        Some(found)
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

/// A change whose atoms are fitted while the others stay.
struct FittedChange {
    replaced: Vec<usize>,
    fitted: Vec<Atom>,
    /// All parts after the change.
    parts: Parts,
    criterion: f64,
}

/// The atoms without those with the indices `replaced`.
fn atoms_without(atoms: &[Atom], replaced: &[usize]) -> Vec<Atom> {
    let kept = atoms.iter().enumerate().filter(|(k, _)| !replaced.contains(k));
    kept.map(|(_, atom)| atom.clone()).collect()
}

/// The parts after all changes that lower the criterion by much and concern different frequencies: they can
/// be made at once. `changes` are sorted by their criterion; `None` if there are fewer than two such changes.
fn combine_changes(current: &Explanation, changes: &[FittedChange]) -> Option<Parts> {
    /// Smallest gain, nats, of a change that is made together with others.
    const LEAST: f64 = 10.0;
    /// Smallest distance, resolutions, of frequencies at which changes hardly affect each other.
    const APART: f64 = 4.0;
    let reach = |atom: &Atom| Some(atom.oscillation()?.peak_band(APART / 2.0));
    let mut taken: Vec<&FittedChange> = Vec::new();
    let mut ranges: Vec<(f64, f64)> = Vec::new();
    for change in changes {
        let own: Option<Vec<(f64, f64)>> = change.fitted.iter().map(reach).collect();
        let Some(own) = own.filter(|own| !own.is_empty()) else { break };
        let meets = |(low, high): &(f64, f64)| ranges.iter().any(|(l, h)| l < high && low < h);
        let shares = |k: &usize| taken.iter().any(|t| t.replaced.contains(k));
        let gains = change.criterion < current.criterion - LEAST;
        if gains && !own.iter().any(meets) && !change.replaced.iter().any(shares) {
            taken.push(change);
            ranges.extend(own);
        }
    }
    if taken.len() < 2 {
        return None;
    }
    let replaced: Vec<usize> = taken.iter().flat_map(|t| t.replaced.clone()).collect();
    let fitted = taken.iter().flat_map(|t| t.fitted.clone());
    let atoms = atoms_without(&current.parts.atoms, &replaced).into_iter().chain(fitted).collect();
    Some(Parts { trend: current.parts.trend, atoms })
}

/// Standard deviation of normal values from the median of their sizes, which outliers hardly change.
fn robust_sd(values: &[f64]) -> f64 {
    /// Standard deviation of normal values over the median of their sizes.
    const SD_OVER_MEDIAN: f64 = 1.4826;
    upper_median(values.iter().map(|x| x.abs()).collect()).map_or(0.0, |median| SD_OVER_MEDIAN * median)
}
