//! Oscillations that are over soon or begin inside the record: a window that starts at zero hides them.
//!
//! What is left is held against decaying oscillations that begin at any frame: `z = sum x exp(-d s - 2 pi i n
//! s)` over the frames since. A term of this frequency, decay and beginning lowers the sum of squares by `2
//! |z|^2 / sum exp(-2 d s)`; in white noise of variance one half of that exceeds `q` with the chance
//! `exp(-q)`.

use super::closely::Doubtful;
use super::least_squares::{Care, Free, Term};
use super::limits::MIN_CYCLES;
use super::oscillations::{Explained, FLIP_CYCLES, Parts, Search, lobe};
use super::transform::Transform;
use crate::math;
use std::f64::consts::TAU;
use std::ops::Range;

/// Nepers over the record of the decays that are tried: of one between two, nine tenths of the energy are
/// met.
const DECAYS: [f64; 6] = [6.0, 12.0, 24.0, 48.0, 96.0, 192.0];
/// Nepers after which a decay is over.
const OVER: f64 = 3.5;
/// Fewest frames in which an amplitude falls by a neper.
const FEWEST: f64 = 4.0;
/// Beginnings that are tried in a neper of the decay.
const STEPS: f64 = 3.0;
/// Chance that noise alone begins an oscillation anywhere.
const FALSE_ALARM: f64 = 0.01;
/// Nepers over the record from which a window that starts at zero shows too little of a decay.
const BRIEF: f64 = 8.0;
/// Least width of an octave, cycles in the record: its floor is a median.
const OCTAVE: f64 = 20.0;
/// Moves of a term that is placed; each halving of the steps is one.
const MOST_MOVES: usize = 30;
/// Cycles in the record up to which what explains most may be what a flip leaves: twice those of its peaks.
const SLOW: f64 = 2.0 * FLIP_CYCLES;
/// Nepers of a decay that are lost where it is seen to begin late because others hide its start.
const LOST: f64 = 2.0;
/// Share of a record's sum of squares that is rounding: a misfit is a difference of such sums.
const ROUNDED: f64 = 1e-12;
/// Rounds in which terms are placed again; each changes one.
const MOST_ROUNDS: usize = 6;
/// Determinant of cosine and sine, over the product of their squares, below which they are one.
const SINGULAR: f64 = 1e-3;
/// Values of the transform in the length of a decay: bins a seventh of its width apart.
const PADDING: usize = 4;

impl Term {
    /// Whether it is over soon or begins inside the record.
    pub(super) fn is_brief(&self) -> bool {
        self.cycles > 0.0 && (self.first > 0 || self.nepers > BRIEF)
    }

    /// Its envelope from its first frame on, as far as it is not over.
    fn envelope(&self, frames: usize) -> impl Iterator<Item = (usize, f64)> + Clone + use<> {
        let (first, decay) = (self.first, self.nepers / frames as f64);
        let lasts = if decay > 0.0 { (OVER / decay).ceil() as usize } else { frames };
        (first..frames.min(first.saturating_add(lasts)))
            .map(move |i| (i, math::exp(-decay * ((i - first) as f64 + 0.5))))
    }
}

/// A decay that is tried everywhere in what is left.
struct Tried {
    nepers: f64,
    /// Values of its transform.
    padded: usize,
    /// Frames from one beginning to the next.
    step: usize,
    /// Bins of the transform where it may be, with the deviation of the noise there, m.
    bins: Vec<(usize, f64)>,
}

/// The decays that were found in what is left: the one that stands out most of the noise around it, and the
/// one that lowers the sum of squares most, if it is no slow one. A large one raises the noise around itself.
#[derive(Default)]
struct Met {
    stands_out: Option<(f64, Term)>,
    explains: Option<(f64, Term)>,
}

impl Met {
    /// Takes a decay that lowers the sum of squares by twice `square`, which is `half` variances of noise.
    fn take(&mut self, term: Term, half: f64, square: f64) {
        let larger = |value: f64, than: &Option<(f64, Term)>| than.is_none_or(|(least, _)| value > least);
        if larger(half, &self.stands_out) {
            self.stands_out = Some((half, term));
        }
        if term.cycles > SLOW && larger(square, &self.explains) {
            self.explains = Some((square, term));
        }
    }

    /// The first, and with `both` the second, if that is another.
    fn terms(self, both: bool) -> impl Iterator<Item = Term> {
        let (first, second) = (self.stands_out.map(|met| met.1), self.explains.map(|met| met.1));
        first.into_iter().chain(second.filter(|second| both && Some(*second) != first))
    }
}

impl Search<'_> {
    /// The parts with a decaying oscillation more, or with one in the place of a doubtful term or of
    /// relaxations: the first half-wave of a ring-down looks like one.
    pub(super) fn with_ring_downs(&self, explained: &Explained, doubtful: &[Doubtful]) -> Vec<Parts> {
        let parts = &explained.parts;
        let terms = &parts.solved.terms;
        let left: Vec<f64> = explained.left.iter().map(|x| x.unwrap_or(0.0)).collect();
        let noise = Noise::of(self, explained);
        let relaxations: Vec<usize> = (0..terms.len()).filter(|k| terms[*k].cycles == 0.0).collect();
        let mut places: Vec<Vec<usize>> = vec![vec![]];
        places.extend(doubtful.iter().filter(|d| terms[d.k].first == 0).map(|d| vec![d.k]));
        places.extend(relaxations.iter().map(|k| vec![*k]));
        places.extend((relaxations.len() > 1).then_some(relaxations));
        // what begins late and is large raises the noise around itself: no line in its place is doubtful
        if doubtful.is_empty() && !self.leaves_noise(explained) {
            let steady = |k: &usize| terms[*k].cycles > 0.0 && !terms[*k].is_brief();
            places.extend((0..terms.len()).filter(steady).map(|k| vec![k]));
        }
        let least = self.criterion(parts);
        let placed = |out: &Vec<usize>| {
            let left = self.with_terms(parts, &left, out);
            let fitted = |met: Term| {
                let kept = (0..terms.len()).filter(|k| !out.contains(k)).map(|k| terms[k]);
                let terms: Vec<Term> = kept.chain([self.placed(&left, met)]).collect();
                let fitted = self.fitted(parts.problem.clone(), &terms, Care::Passing)?;
                let new = fitted.solved.terms.last()?;
                (new.free == Free::Both && self.criterion(&fitted) < least).then_some(fitted)
            };
            let met = self.met(explained, &left, &noise, reach(terms, out));
            // of a doubtful term, what explains most may be a piece
            met.terms(doubtful.is_empty()).filter_map(fitted).collect::<Vec<Parts>>()
        };
        places.iter().flat_map(placed).collect()
    }

    /// The parts with brief terms placed anew and without relaxations that explain nothing, as long as that
    /// explains more with less: what was found first was placed while the others were missing, and no fit
    /// moves a first frame. Where only rounding is left, no criterion tells anything.
    pub(super) fn placed_again(&self, mut parts: Parts) -> Parts {
        let power: f64 = self.data.iter().zip(&self.weights).map(|(x, weight)| weight * x * x).sum();
        for _ in 0..MOST_ROUNDS {
            if parts.solved.misfit < ROUNDED * power {
                break;
            }
            let least = self.criterion(&parts);
            let better = self.variants(&parts).into_iter().filter_map(|terms| {
                let fitted = self.fitted(parts.problem.clone(), &terms, Care::Passing)?;
                (self.criterion(&fitted) < least).then_some(fitted)
            });
            match better.min_by(|a, b| self.criterion(a).total_cmp(&self.criterion(b))) {
                Some(better) => parts = better,
                None => break,
            }
        }
        parts
    }

    /// The terms with a brief one in another place, with two for those in its lobe, with all from the start
    /// on, or with a relaxation less.
    fn variants(&self, parts: &Parts) -> Vec<Vec<Term>> {
        let terms = &parts.solved.terms;
        let brief: Vec<usize> = (0..terms.len()).filter(|k| terms[*k].is_brief()).collect();
        if brief.is_empty() {
            return Vec::new();
        }
        let left: Vec<f64> = self.explain(parts.clone()).left.iter().map(|x| x.unwrap_or(0.0)).collect();
        let with = |out: &[usize], new: &[Term]| {
            let kept = (0..terms.len()).filter(|k| !out.contains(k)).map(|k| terms[k]);
            kept.chain(new.iter().copied()).collect::<Vec<Term>>()
        };
        let again = brief.iter().map(|k| {
            let term = self.placed(&self.with_terms(parts, &left, &[*k]), terms[*k]);
            with(&[*k], &[term])
        });
        let split = brief.iter().map(|k| {
            let term = terms[*k];
            let near = |j: &usize| (terms[*j].cycles - term.cycles).abs() < lobe(&term);
            let together: Vec<usize> = brief.iter().copied().filter(near).collect();
            let (by, nepers) = (term.nepers / TAU / 2.0, term.nepers / 2.0);
            with(&together, &[-by, by].map(|by| Term { cycles: term.cycles + by, nepers, ..term }))
        });
        let from_start = [with(&brief, &brief.iter().map(|k| self.begun(&terms[*k])).collect::<Vec<_>>())];
        let relaxed = (0..terms.len()).filter(|k| terms[*k].cycles == 0.0).map(|k| with(&[k], &[]));
        again.chain(split).chain(from_start).chain(relaxed).collect()
    }

    /// The term from the start on, if it has lost little by then.
    fn begun(&self, term: &Term) -> Term {
        let lost = term.nepers * term.first as f64 / self.samples.len() as f64;
        if lost < LOST { Term { first: 0, ..*term } } else { *term }
    }

    /// What is left with some terms put back, m.
    pub(super) fn with_terms(&self, parts: &Parts, left: &[f64], back: &[usize]) -> Vec<f64> {
        let mut with = left.to_vec();
        for k in back {
            let of_term = parts.problem.of_term(&parts.solved, *k);
            let present = of_term.iter().zip(&self.weights).map(|(value, weight)| value * weight);
            with.iter_mut().zip(present).for_each(|(x, value)| *x += value);
        }
        with
    }

    /// The largest amplitude left under the envelope of a term around its frequency, m; 0 where noise alone
    /// may have made it.
    pub(super) fn left_in_envelope(&self, explained: &Explained, term: &Term) -> f64 {
        let frames = self.samples.len();
        let values = term.envelope(frames).map(|(i, e)| e * explained.left[i].unwrap_or(0.0));
        let (length, energy) = self.energy(term);
        let transform = Transform::of((PADDING * length).next_power_of_two().max(2));
        let spectrum = transform.magnitudes(values);
        let bin = frames as f64 / (PADDING * length).next_power_of_two().max(2) as f64;
        let width = lobe(term) + 1.0;
        let near = |k: &usize| (*k as f64 * bin - term.cycles).abs() < width;
        let most = (0..spectrum.len()).filter(near).fold(0.0, |most: f64, k| most.max(spectrum[k]));
        let noise = self.wide_noise(explained, term.cycles);
        if most * most > math::powi(explained.found.detection, 2) * energy * noise * noise {
            2.0 * most / energy
        } else {
            0.0
        }
    }

    /// Amplitude of a term over the noise of its estimate under its own envelope.
    pub(super) fn level_in_envelope(&self, explained: &Explained, term: &Term, amplitude_m: f64) -> f64 {
        amplitude_m * self.energy(term).1.sqrt() / (2.0 * self.wide_noise(explained, term.cycles))
    }

    /// Frames of a term's envelope, and the sum of its squares over the frames present.
    fn energy(&self, term: &Term) -> (usize, f64) {
        let add =
            |(count, sum): (usize, f64), (i, e): (usize, f64)| (count + 1, sum + self.weights[i] * e * e);
        term.envelope(self.samples.len()).fold((0, 0.0), add)
    }

    /// The decays that noise alone would make once in a hundred records and that stand out or explain most.
    fn met(&self, explained: &Explained, left: &[f64], noise: &Noise, within: Range<f64>) -> Met {
        let frames = self.samples.len();
        let tried = self.tried(explained, noise, &within);
        let trials = |t: &Tried| t.bins.len() as f64 / PADDING as f64 * frames as f64 / t.step as f64;
        let least = math::ln(tried.iter().map(trials).sum::<f64>().max(1.0) / FALSE_ALARM);
        let mut met = Met::default();
        for Tried { nepers, padded, step, bins } in tried {
            let transform = Transform::of(padded);
            let alone = Term { cycles: 1.0, nepers, first: 0, free: Free::Both };
            let envelope: Vec<f64> = alone.envelope(frames).map(|(_, e)| e).collect();
            // a decay of which less than one neper is in the record is an impulse at its end
            for first in (0..frames.saturating_sub(envelope.len() / 3)).step_by(step) {
                let present = envelope.iter().zip(&self.weights[first..]);
                let energy: f64 = present.map(|(e, weight)| weight * e * e).sum();
                if energy <= 0.0 {
                    continue;
                }
                let squares = transform.squares(envelope.iter().zip(&left[first..]).map(|(e, x)| e * x));
                for (bin, noise) in &bins {
                    let square = squares[*bin] / energy;
                    let half = square / (noise * noise);
                    if half > least {
                        let cycles = *bin as f64 * frames as f64 / padded as f64;
                        met.take(Term { cycles, nepers, first, free: Free::Both }, half, square);
                    }
                }
            }
        }
        met
    }

    /// The decays that are tried, and where.
    fn tried(&self, explained: &Explained, noise: &Noise, within: &Range<f64>) -> Vec<Tried> {
        let frames = self.samples.len() as f64;
        let lowest = MIN_CYCLES.max(explained.parts.trend().waves() + 1.0);
        let of = |nepers: f64| {
            let padded = (PADDING * (OVER * frames / nepers).ceil() as usize).next_power_of_two();
            let cycles = |bin: usize| bin as f64 * frames / padded as f64;
            let usable = |bin: &usize| {
                let term = Term::from_start(cycles(*bin), nepers, Free::Both);
                term.cycles >= lowest
                    && within.contains(&term.cycles)
                    && term.cycles + 1.0 < frames / 2.0
                    && term.is_oscillation()
                    && nepers < term.bounds().1
                    && !self.drifts(term.cycles * self.resolution_hz())
            };
            let bins = (1..padded / 2).filter(usable).map(|bin| (bin, noise.at(cycles(bin)))).collect();
            Tried { nepers, padded, step: ((frames / nepers / STEPS) as usize).max(1), bins }
        };
        DECAYS.into_iter().filter(|nepers| FEWEST * nepers <= frames).map(of).collect()
    }

    /// Frequency, decay and first frame that explain most, by steps that are halved where none helps.
    fn placed(&self, left: &[f64], start: Term) -> Term {
        let frames = self.samples.len() as f64;
        let mut best = (self.explains(left, &start), start);
        let mut share = 1.0;
        for _ in 0..MOST_MOVES {
            let term = best.1;
            let by = share * term.nepers / TAU;
            // one that keeps its amplitude lasts as long as the record
            let frame = ((share * frames / term.nepers.max(1.0) / STEPS) as usize).max(1);
            let with =
                |cycles: f64, nepers: f64, first: usize| Term { cycles, nepers, first, free: Free::Both };
            let stretched = 1.0 + share;
            let moves = [
                with(term.cycles + by, term.nepers, term.first),
                with(term.cycles - by, term.nepers, term.first),
                with(term.cycles, term.nepers * stretched, term.first),
                with(term.cycles, term.nepers / stretched, term.first),
                with(term.cycles, term.nepers, term.first + frame),
                with(term.cycles, term.nepers, term.first.saturating_sub(frame)),
            ];
            let usable = |term: &Term| term.is_oscillation() && term.first < self.samples.len();
            let tried = moves.into_iter().filter(usable).map(|term| (self.explains(left, &term), term));
            match tried.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|tried| tried.0 > best.0) {
                Some(better) => best = better,
                None => share /= 2.0,
            }
        }
        best.1
    }

    /// What a term with the best amplitude and phase lowers the sum of squares by, m^2.
    fn explains(&self, left: &[f64], term: &Term) -> f64 {
        let turn = TAU * term.cycles / left.len() as f64;
        let add = |[cc, cs, ss, xc, xs]: [f64; 5], (i, e): (usize, f64)| {
            let (sine, cosine) = math::sin_cos(turn * i as f64);
            let (c, s, w) = (e * cosine, e * sine, self.weights[i]);
            [cc + w * c * c, cs + w * c * s, ss + w * s * s, xc + c * left[i], xs + s * left[i]]
        };
        let [cc, cs, ss, xc, xs] = term.envelope(left.len()).fold([0.0; 5], add);
        let determinant = cc * ss - cs * cs;
        if determinant > SINGULAR * cc * ss {
            (ss * xc * xc - 2.0 * cs * xc * xs + cc * xs * xs) / determinant
        } else {
            0.0
        }
    }

    /// Whether more than noise is left in the lobe of a term.
    pub(super) fn leaves_peak(&self, explained: &Explained, term: &Term) -> bool {
        let width = lobe(term) + 1.0;
        let around = self.between(explained, term.cycles - width, term.cycles + width);
        let most = around.iter().fold(0.0, |most: f64, a| most.max(*a));
        self.periodogram.deviation(most) > explained.found.detection * self.wide_noise(explained, term.cycles)
    }

    /// Deviation of the noise around a frequency, m: what decays within the record is wider than the
    /// neighbourhood of a line, so the floor is that of the octave below or above, whichever is higher.
    pub(super) fn wide_noise(&self, explained: &Explained, cycles: f64) -> f64 {
        let octaves = [(cycles / 2.0).min(cycles - OCTAVE), cycles, (2.0 * cycles).max(cycles + OCTAVE)];
        let floors = octaves.windows(2).map(|side| self.floor_between(explained, side[0], side[1]));
        self.periodogram.deviation(floors.fold(explained.found.floor_m, f64::max))
    }
}

/// Where what takes the place of terms may lie, cycles in the record.
fn reach(terms: &[Term], out: &[usize]) -> Range<f64> {
    match out.first().map(|k| &terms[*k]).filter(|term| term.cycles > 0.0) {
        Some(term) => term.cycles - lobe(term)..term.cycles + lobe(term),
        None => 0.0..f64::INFINITY,
    }
}

/// Deviation of the noise as a function of frequency.
struct Noise {
    /// Distance of the knots, cycles in the record.
    apart: f64,
    deviation_m: Vec<f64>,
}

impl Noise {
    fn of(search: &Search, explained: &Explained) -> Self {
        const APART: f64 = 16.0;
        let knots = (search.samples.len() as f64 / 2.0 / APART).ceil() as usize + 1;
        let deviation_m = (0..knots).map(|knot| search.wide_noise(explained, knot as f64 * APART)).collect();
        Self { apart: APART, deviation_m }
    }

    fn at(&self, cycles: f64) -> f64 {
        let knot = ((cycles / self.apart).round() as usize).min(self.deviation_m.len() - 1);
        self.deviation_m[knot]
    }
}
