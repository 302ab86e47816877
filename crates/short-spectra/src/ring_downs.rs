//! Oscillations that end soon or begin inside the record: a window that is zero at its ends hides them.
//!
//! The residual `x` is matched with decaying oscillations that begin at any frame: `z = sum x exp(-d s - 2 pi
//! i n s)` over the frames from the beginning on, where `s` is the time since the beginning in lengths of the
//! record. A term with this frequency, decay and beginning lowers the sum of squares by `2 |z|^2 / sum exp(-2
//! d s)`. In white noise of variance one, half of this reduction exceeds `q` with the probability `exp(-q)`.

use super::least_squares::{FreeSet, SineTerm, Tolerance};
use super::model_selection::{ModelFit, ModelSelector, STEP_CYCLES, SineModel, is_in_lobe, lobe_half_width};
use super::second_pass::DoubtfulTerm;
use super::settings::MIN_CYCLES;
use super::transform::RealTransform;
use portable_math as math;
use std::f64::consts::TAU;
use std::ops::Range;

/// Decays over the record that are tried, nepers; a decay between two of them is matched with nine tenths of
/// its energy.
const DECAYS: [f64; 6] = [6.0, 12.0, 24.0, 48.0, 96.0, 192.0];
/// Decay, nepers, after which an oscillation counts as over.
const NEPERS_UNTIL_OVER: f64 = 3.5;
/// Minimum number of frames in which an amplitude falls by a neper.
const FRAMES_PER_NEPER: f64 = 4.0;
/// Number of first frames that are tried in each interval in which the amplitude falls by a neper.
const STARTS_PER_NEPER: f64 = 3.0;
/// Allowed probability that noise alone causes an oscillation to be found anywhere in a record.
const FALSE_ALARM: f64 = 0.01;
/// Decay over the record, nepers, above which a window that is zero at its ends shows too little of an
/// oscillation.
const TRANSIENT_NEPERS: f64 = 8.0;
/// Smallest allowed width, in cycles in the record, of a band that is used as an octave: its noise floor is a
/// median, which needs enough bins.
const OCTAVE: f64 = 20.0;
/// Maximum number of steps of the search for the frequency, decay and first frame of a term; each halving
/// counts as a step.
const MOST_MOVES: usize = 30;
/// Number of cycles in the record up to which a decaying oscillation may be the residue of a step: twice the
/// number up to which a step causes peaks.
const SLOW_CYCLES: f64 = 2.0 * STEP_CYCLES;
/// Largest allowed decay, in nepers, of a term between the start of the record and its first frame, if the
/// term is extended to the start. Such a term may have been hidden there by other terms.
const MOST_NEPERS_LOST: f64 = 2.0;
/// Fraction of the sum of squares of a record below which a misfit is rounding error, because the misfit is a
/// difference of such sums.
const ROUNDING_SHARE: f64 = 1e-12;
/// Maximum number of rounds in which the placement of terms is optimised again; each round changes one term.
const MOST_ROUNDS: usize = 6;
/// Smallest allowed ratio of the determinant of the normal matrix of cosine and sine to the product of its
/// diagonal elements. With a smaller ratio, cosine and sine are not independent.
const SINGULAR: f64 = 1e-3;
/// Ratio of the length of a transform to that of a decay: the bins are a seventh of the width of a peak
/// apart.
const PADDING: usize = 4;

impl SineTerm {
    /// Whether the term ends soon or begins inside the record.
    pub(super) fn is_transient(&self) -> bool {
        self.cycles > 0.0 && (self.first > 0 || self.nepers > TRANSIENT_NEPERS)
    }

    /// The frames in which the term is present, each with the value of the envelope, from the first frame
    /// until the term has decayed.
    fn envelope_values(&self, frames: usize) -> impl Iterator<Item = (usize, f64)> + Clone + use<> {
        let (first, decay) = (self.first, self.nepers / frames as f64);
        let lasts = if decay > 0.0 { (NEPERS_UNTIL_OVER / decay).ceil() as usize } else { frames };
        (first..frames.min(first.saturating_add(lasts)))
            .map(move |i| (i, math::exp(-decay * ((i - first) as f64 + 0.5))))
    }
}

/// A decay that is tried with many first frames in the residual.
struct Trial {
    nepers: f64,
    /// Length of its transform, values.
    padded: usize,
    /// Distance between two first frames that are tried, in frames.
    step: usize,
    /// Bins of the transform to try, each with the standard deviation, m, of the noise there.
    bins: Vec<(usize, f64)>,
}

/// The best decaying oscillations in the residual: the one that stands out most from the noise around it, and
/// the one that lowers the sum of squares most, unless it is slow. They may differ, because a large decaying
/// oscillation raises the noise around itself.
#[derive(Default)]
struct Decays {
    stands_out: Option<(f64, SineTerm)>,
    explains: Option<(f64, SineTerm)>,
}

impl Decays {
    /// Keeps a decaying oscillation if it stands out more from the noise, or lowers the sum of squares more,
    /// than the oscillations before it. It lowers the sum of squares by twice `square`; `half` is `square`
    /// divided by the variance of the noise.
    fn keep_larger(&mut self, term: SineTerm, half: f64, square: f64) {
        if self.stands_out.is_none_or(|(least, _)| half > least) {
            self.stands_out = Some((half, term));
        }
        if term.cycles > SLOW_CYCLES && self.explains.is_none_or(|(least, _)| square > least) {
            self.explains = Some((square, term));
        }
    }

    /// The oscillation that stands out most from the noise. With `both`, also the oscillation that lowers the
    /// sum of squares most, if it is a different one.
    fn terms(self, both: bool) -> impl Iterator<Item = SineTerm> {
        let (first, second) = (self.stands_out.map(|met| met.1), self.explains.map(|met| met.1));
        first.into_iter().chain(second.filter(|second| both && Some(*second) != first))
    }
}

impl ModelSelector<'_> {
    /// Models with one more decaying oscillation, either added to the terms or in the place of a doubtful
    /// term or of relaxations: the first half-wave of a ring-down looks like a relaxation.
    pub(super) fn with_ring_downs(&self, fit: &ModelFit, doubtful: &[DoubtfulTerm]) -> Vec<SineModel> {
        let parts = &fit.model;
        let terms = parts.terms();
        let left = fit.residual_or_zero();
        let noise = NoiseCurve::from_residual(self, fit);
        let relaxations = parts.relaxations();
        let mut places: Vec<Vec<usize>> = vec![vec![]];
        places.extend(doubtful.iter().filter(|d| terms[d.index].first == 0).map(|d| vec![d.index]));
        places.extend(relaxations.iter().map(|k| vec![*k]));
        places.extend((relaxations.len() > 1).then_some(relaxations));
        // a large oscillation that begins late raises the noise around itself, so that no line is doubtful
        if doubtful.is_empty() && !self.leaves_only_noise(fit) {
            let steady = parts.oscillations().into_iter().filter(|k| !terms[*k].is_transient());
            places.extend(steady.map(|k| vec![k]));
        }
        let least = self.bic_of(parts);
        let placed = |out: &Vec<usize>| {
            let left = self.add_terms_back(parts, &left, out);
            let fitted = |met: SineTerm| {
                let terms = parts.swap_terms(out, [self.optimise_placement(&left, met)]);
                let fitted = self.fit_model(parts.problem.clone(), &terms, Tolerance::Coarse)?;
                let free = fitted.terms().last()?.free == FreeSet::Both;
                (free && self.bic_of(&fitted) < least).then_some(fitted)
            };
            let met = self.match_decays(fit, &left, &noise, replacement_range(terms, out));
            // the oscillation that explains most may be a part of a doubtful term
            met.terms(doubtful.is_empty()).filter_map(fitted).collect::<Vec<SineModel>>()
        };
        places.iter().flat_map(placed).collect()
    }

    /// Optimises the frequency, decay and first frame of brief terms again and drops relaxations that explain
    /// nothing, as long as the Bayesian information criterion falls. This is needed because the first terms
    /// were placed while others were missing, and a fit does not move first frames. If only rounding errors
    /// remain, the criterion is meaningless, and nothing is changed.
    pub(super) fn relocate_transients(&self, mut parts: SineModel) -> SineModel {
        let power: f64 = self.data.iter().zip(&self.weights).map(|(x, weight)| weight * x * x).sum();
        for _ in 0..MOST_ROUNDS {
            if parts.solution.misfit < ROUNDING_SHARE * power {
                break;
            }
            let least = self.bic_of(&parts);
            let better = self.transient_variants(&parts).into_iter().filter_map(|terms| {
                let fitted = self.fit_model(parts.problem.clone(), &terms, Tolerance::Coarse)?;
                (self.bic_of(&fitted) < least).then_some(fitted)
            });
            let Some(better) = self.select_best(better) else { break };
            parts = better;
        }
        parts
    }

    /// Variants of the terms: a brief term with an optimised placement, two terms in the place of all brief
    /// terms in a lobe, all brief terms extended to the start of the record, or one relaxation less.
    fn transient_variants(&self, parts: &SineModel) -> Vec<Vec<SineTerm>> {
        let terms = parts.terms();
        let brief: Vec<usize> = (0..terms.len()).filter(|k| terms[*k].is_transient()).collect();
        if brief.is_empty() {
            return Vec::new();
        }
        let left = self.decompose(parts.clone()).residual_or_zero();
        let again = brief.iter().map(|k| {
            let term = self.optimise_placement(&self.add_terms_back(parts, &left, &[*k]), terms[*k]);
            parts.swap_terms(&[*k], [term])
        });
        let split = brief.iter().map(|k| {
            let term = terms[*k];
            let near = |j: &usize| is_in_lobe(terms[*j].cycles, &term);
            let together: Vec<usize> = brief.iter().copied().filter(near).collect();
            let (by, nepers) = (term.nepers / TAU / 2.0, term.nepers / 2.0);
            let half = |by: f64| SineTerm { cycles: term.cycles + by, nepers, ..term };
            parts.swap_terms(&together, [-by, by].map(half))
        });
        let extended = brief.iter().map(|k| self.extend_to_start(&terms[*k]));
        let from_start = [parts.swap_terms(&brief, extended)];
        let relaxed = parts.relaxations().into_iter().map(|k| parts.swap_terms(&[k], []));
        again.chain(split).chain(from_start).chain(relaxed).collect()
    }

    /// The term extended to the start of the record, if it would decay little from there to its first frame;
    /// otherwise the term itself.
    fn extend_to_start(&self, term: &SineTerm) -> SineTerm {
        let lost = term.nepers * term.first as f64 / self.samples.len() as f64;
        if lost < MOST_NEPERS_LOST { SineTerm { first: 0, ..*term } } else { *term }
    }

    /// The residual with some terms added back, m.
    pub(super) fn add_terms_back(&self, parts: &SineModel, left: &[f64], back: &[usize]) -> Vec<f64> {
        let mut with = left.to_vec();
        for k in back {
            let of_term = parts.term_values(*k);
            let present = of_term.iter().zip(&self.weights).map(|(value, weight)| value * weight);
            with.iter_mut().zip(present).for_each(|(x, value)| *x += value);
        }
        with
    }

    /// Largest residual amplitude, m, under the envelope of a term and near its frequency; 0 if noise alone
    /// may have caused it.
    pub(super) fn residual_in_envelope(&self, fit: &ModelFit, term: &SineTerm) -> f64 {
        let frames = self.samples.len();
        let values = term.envelope_values(frames).map(|(i, e)| e * fit.residual_m[i].unwrap_or(0.0));
        let (length, energy) = self.envelope_energy(term);
        let padded = (PADDING * length).next_power_of_two().max(2);
        let spectrum = RealTransform::new(padded).magnitudes(values);
        let bin = frames as f64 / padded as f64;
        let width = lobe_half_width(term) + 1.0;
        let near = |k: &usize| (*k as f64 * bin - term.cycles).abs() < width;
        let most = (0..spectrum.len()).filter(near).fold(0.0, |most: f64, k| most.max(spectrum[k]));
        let noise = self.octave_noise_sd(fit, term.cycles);
        let least = math::powi(fit.peaks.detection, 2) * energy * noise * noise;
        if most * most > least { 2.0 * most / energy } else { 0.0 }
    }

    /// Ratio of the amplitude of a term to the noise in an estimate of this amplitude over the frames of the
    /// term's envelope.
    pub(super) fn level_in_envelope(&self, fit: &ModelFit, term: &SineTerm, amplitude_m: f64) -> f64 {
        let noise_m = self.octave_noise_sd(fit, term.cycles);
        amplitude_m * self.envelope_energy(term).1.sqrt() / (2.0 * noise_m)
    }

    /// Number of frames of the envelope of a term, and the sum of the squares of the envelope over the frames
    /// present.
    fn envelope_energy(&self, term: &SineTerm) -> (usize, f64) {
        let add =
            |(count, sum): (usize, f64), (i, e): (usize, f64)| (count + 1, sum + self.weights[i] * e * e);
        term.envelope_values(self.samples.len()).fold((0, 0.0), add)
    }

    /// The decaying oscillations that match best, if they exceed the level that noise alone reaches in one of
    /// a hundred records.
    fn match_decays(&self, fit: &ModelFit, left: &[f64], noise: &NoiseCurve, within: Range<f64>) -> Decays {
        let frames = self.samples.len();
        let tried = self.plan_trials(fit, noise, &within);
        let trials = |t: &Trial| t.bins.len() as f64 / PADDING as f64 * frames as f64 / t.step as f64;
        let least = math::ln(tried.iter().map(trials).sum::<f64>().max(1.0) / FALSE_ALARM);
        let mut met = Decays::default();
        for Trial { nepers, padded, step, bins } in tried {
            let transform = RealTransform::new(padded);
            let from = |cycles: f64, first: usize| SineTerm { cycles, nepers, first, free: FreeSet::Both };
            let envelope: Vec<f64> = from(1.0, 0).envelope_values(frames).map(|(_, e)| e).collect();
            // a decay of which less than one neper lies in the record is an impulse at the end of the record
            for first in (0..frames.saturating_sub(envelope.len() / 3)).step_by(step) {
                let present = envelope.iter().zip(&self.weights[first..]);
                let energy: f64 = present.map(|(e, weight)| weight * e * e).sum();
                if energy <= 0.0 {
                    continue;
                }
                let weighted = envelope.iter().zip(&left[first..]).map(|(e, x)| e * x);
                let squares = transform.squared_magnitudes(weighted);
                for (bin, noise) in &bins {
                    let square = squares[*bin] / energy;
                    let half = square / (noise * noise);
                    if half > least {
                        let cycles = *bin as f64 * frames as f64 / padded as f64;
                        met.keep_larger(from(cycles, first), half, square);
                    }
                }
            }
        }
        met
    }

    /// The decays to try, and their bins.
    fn plan_trials(&self, fit: &ModelFit, noise: &NoiseCurve, within: &Range<f64>) -> Vec<Trial> {
        let frames = self.samples.len() as f64;
        let lowest = MIN_CYCLES.max(fit.model.trend().fastest_waves() + 1.0);
        let of = |nepers: f64| {
            let lasts = (NEPERS_UNTIL_OVER * frames / nepers).ceil() as usize;
            let padded = (PADDING * lasts).next_power_of_two();
            let cycles = |bin: usize| bin as f64 * frames / padded as f64;
            let usable = |bin: &usize| {
                let term = SineTerm::from_start(cycles(*bin), nepers, FreeSet::Both);
                term.cycles >= lowest
                    && within.contains(&term.cycles)
                    && term.cycles + 1.0 < frames / 2.0
                    && term.is_oscillation()
                    && nepers < term.nepers_bounds().1
                    && !self.is_in_drift_region(term.cycles * self.resolution_hz())
            };
            let bins = (1..padded / 2).filter(usable).map(|bin| (bin, noise.sd_at(cycles(bin)))).collect();
            Trial { nepers, padded, step: ((frames / nepers / STARTS_PER_NEPER) as usize).max(1), bins }
        };
        DECAYS.into_iter().filter(|nepers| FRAMES_PER_NEPER * nepers <= frames).map(of).collect()
    }

    /// Moves a term to the frequency, decay and first frame that explain most; steps are halved if none of
    /// them helps.
    fn optimise_placement(&self, left: &[f64], start: SineTerm) -> SineTerm {
        let frames = self.samples.len() as f64;
        let mut best = (self.power_of_term(left, &start), start);
        let mut share = 1.0;
        for _ in 0..MOST_MOVES {
            let term = best.1;
            let by = share * term.nepers / TAU;
            // a term that keeps its amplitude lasts as long as the record
            let frame = ((share * frames / term.nepers.max(1.0) / STARTS_PER_NEPER) as usize).max(1);
            let (free, stretched) = (FreeSet::Both, 1.0 + share);
            let term = SineTerm { free, ..term };
            let moves = [
                SineTerm { cycles: term.cycles + by, ..term },
                SineTerm { cycles: term.cycles - by, ..term },
                SineTerm { nepers: term.nepers * stretched, ..term },
                SineTerm { nepers: term.nepers / stretched, ..term },
                SineTerm { first: term.first + frame, ..term },
                SineTerm { first: term.first.saturating_sub(frame), ..term },
            ];
            let usable = |term: &SineTerm| term.is_oscillation() && term.first < self.samples.len();
            let tried = moves.into_iter().filter(usable).map(|term| (self.power_of_term(left, &term), term));
            match tried.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|tried| tried.0 > best.0) {
                Some(better) => best = better,
                None => share /= 2.0,
            }
        }
        best.1
    }

    /// Reduction of the sum of squares by a term with the best amplitude and phase, m^2.
    fn power_of_term(&self, left: &[f64], term: &SineTerm) -> f64 {
        let turn = TAU * term.cycles / left.len() as f64;
        let add = |[cc, cs, ss, xc, xs]: [f64; 5], (i, e): (usize, f64)| {
            let (sine, cosine) = math::sin_cos(turn * i as f64);
            let (c, s, w) = (e * cosine, e * sine, self.weights[i]);
            [cc + w * c * c, cs + w * c * s, ss + w * s * s, xc + c * left[i], xs + s * left[i]]
        };
        let [cc, cs, ss, xc, xs] = term.envelope_values(left.len()).fold([0.0; 5], add);
        let determinant = cc * ss - cs * cs;
        let power = || (ss * xc * xc - 2.0 * cs * xc * xs + cc * xs * xs) / determinant;
        if determinant > SINGULAR * cc * ss { power() } else { 0.0 }
    }

    /// Whether the residual in the lobe of a term exceeds noise.
    pub(super) fn leaves_peak(&self, fit: &ModelFit, term: &SineTerm) -> bool {
        let left_m = self.periodogram.noise_sd_m(self.residual_near(fit, term));
        left_m > fit.peaks.detection * self.octave_noise_sd(fit, term.cycles)
    }

    /// Standard deviation, m, of the noise around a frequency: that of the octave below or above, whichever
    /// is larger. The peak of an oscillation that decays within the record is wider than the neighbourhood of
    /// a line.
    pub(super) fn octave_noise_sd(&self, fit: &ModelFit, cycles: f64) -> f64 {
        let octaves = [(cycles / 2.0).min(cycles - OCTAVE), cycles, (2.0 * cycles).max(cycles + OCTAVE)];
        let floors = octaves.windows(2).map(|side| self.noise_floor_between(fit, side[0], side[1]));
        self.periodogram.noise_sd_m(floors.fold(fit.peaks.floor_m, f64::max))
    }
}

/// Frequency range, in cycles in the record, in which a replacement of the terms `out` may lie.
fn replacement_range(terms: &[SineTerm], out: &[usize]) -> Range<f64> {
    match out.first().map(|k| &terms[*k]).filter(|term| term.cycles > 0.0) {
        Some(term) => term.cycles - lobe_half_width(term)..term.cycles + lobe_half_width(term),
        None => 0.0..f64::INFINITY,
    }
}

/// Standard deviation of the noise, m, at multiples of `APART` cycles in the record.
struct NoiseCurve(Vec<f64>);

impl NoiseCurve {
    const APART: f64 = 16.0;

    fn from_residual(search: &ModelSelector, fit: &ModelFit) -> Self {
        let knots = (search.samples.len() as f64 / 2.0 / Self::APART).ceil() as usize + 1;
        Self((0..knots).map(|knot| search.octave_noise_sd(fit, knot as f64 * Self::APART)).collect())
    }

    fn sd_at(&self, cycles: f64) -> f64 {
        self.0[((cycles / Self::APART).round() as usize).min(self.0.len() - 1)]
    }
}
