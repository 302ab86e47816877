//! Alternatives to a second oscillation near a first one: a frequency that drifts at a constant rate, or an
//! amplitude that falls linearly. Neither is a term of the fit. If one of them explains as much as a second
//! oscillation does, the second oscillation is dropped.

use super::least_squares::SineTerm;
use super::model_selection::{ModelFit, ModelSelector};
use super::second_pass::DoubtfulTerm;
use portable_math as math;
use std::f64::consts::{PI, TAU};

/// Maximum number of steps of the search for the best frequency, drift and decay of an alternative; each
/// halving of the step sizes counts as a step.
const MOST_STEPS: usize = 40;
/// Initial step sizes of the search: for the frequency and for its change over the record, both in cycles in
/// the record, and for the decay, in nepers.
const FIRST_STEPS: [f64; 3] = [0.3, 1.0, 1.0];
/// Number of parameters of a term of the fit.
const TERM_PARAMETERS: f64 = 4.0;
/// Number of parameters that an alternative has in addition to those of a term of the fit.
const EXTRA_PARAMETERS: f64 = 1.0;
/// Distance in frequency, in resolutions, within which terms may be parts of one oscillation.
const NEARBY_RESOLUTIONS: f64 = 5.0;
/// Number of blocks that represent the record: a shift of the frequency by a few cycles in the record hardly
/// changes the phase within a block.
const BLOCKS: usize = 128;
/// Shortest and longest time, in lengths of the record, in which an amplitude that falls linearly may reach
/// zero.
const LINEAR_DECAY_ENDS: (f64, f64) = (0.1, 4.0);

/// An oscillation whose frequency or amplitude changes at a constant rate.
#[derive(Clone, Copy)]
struct UnsteadyTone {
    /// Frequency in the middle of the record, cycles in the record.
    cycles: f64,
    /// Change of the frequency over the record, cycles.
    change: f64,
    /// Decay over the record, nepers, or the time in which the amplitude falls to zero, in lengths of the
    /// record.
    decay: EnvelopeDecay,
}

#[derive(Clone, Copy)]
enum EnvelopeDecay {
    Exponential(f64),
    Linear(f64),
}

impl UnsteadyTone {
    fn from_term(start: &SineTerm, [cycles, change, fall]: [f64; 3], line: bool) -> Self {
        let decay = if line {
            EnvelopeDecay::Linear(math::exp(fall).clamp(LINEAR_DECAY_ENDS.0, LINEAR_DECAY_ENDS.1))
        } else {
            EnvelopeDecay::Exponential(start.nepers + fall)
        };
        Self { cycles: start.cycles + cycles, change, decay }
    }

    /// Envelope and phase, rad, at a time `s` in lengths of the record.
    fn envelope_and_phase(&self, s: f64) -> (f64, f64) {
        let envelope = match self.decay {
            EnvelopeDecay::Exponential(nepers) => math::exp(-nepers * s),
            EnvelopeDecay::Linear(end) => (1.0 - s / end).max(0.0),
        };
        (envelope, TAU * self.cycles * s + PI * self.change * s * (s - 1.0))
    }
}

impl ModelSelector<'_> {
    /// Indices of the terms around which the residual exceeds noise.
    pub(super) fn terms_with_residual(&self, fit: &ModelFit) -> Vec<usize> {
        let terms = fit.model.terms();
        let leaves = |k: &usize| terms[*k].cycles > 0.0 && self.leaves_peak(fit, &terms[*k]);
        (0..terms.len()).filter(leaves).collect()
    }

    /// The terms around which the residual exceeds noise. Each is stored with a limit: a replacement of the
    /// term must have a Bayesian information criterion below it.
    pub(super) fn doubtful_terms(&self, fit: &ModelFit) -> Vec<DoubtfulTerm> {
        let least = self.bic_of(&fit.model);
        let criterion = |k: usize| self.alternatives_criterion(fit, k).min(least);
        let terms = self.terms_with_residual(fit).into_iter();
        terms.map(|k| DoubtfulTerm { index: k, criterion: criterion(k) }).collect()
    }

    /// Indices of terms that may be parts of one oscillation: a single oscillation in their place, with a
    /// constant frequency drift or a linearly falling amplitude, has a lower Bayesian information criterion.
    pub(super) fn unsteady_terms(&self, fit: &ModelFit) -> Vec<usize> {
        let terms = fit.model.terms();
        let steady = self.bic_of(&fit.model);
        // a term without neighbours is a single line in any case
        let in_pieces =
            |k: &usize| nearby_terms(terms, *k).len() > 1 && self.alternatives_criterion(fit, *k) < steady;
        let whole: Vec<usize> = self.terms_with_residual(fit).into_iter().filter(in_pieces).collect();
        let is_piece = |k: &usize| whole.iter().any(|one| are_near(&terms[*one], &terms[*k]));
        fit.model.oscillations().into_iter().filter(is_piece).collect()
    }

    /// The Bayesian information criterion after one oscillation, with a constant frequency drift or a
    /// linearly falling amplitude, has replaced term `k`, or `k` and its neighbours. The lowest of these
    /// criteria is returned.
    pub(super) fn alternatives_criterion(&self, fit: &ModelFit, k: usize) -> f64 {
        let group = nearby_terms(fit.model.terms(), k);
        let alone = self.replacement_criterion(fit, k, &[k]);
        if group.len() > 1 { alone.min(self.replacement_criterion(fit, k, &group)) } else { alone }
    }

    fn replacement_criterion(&self, fit: &ModelFit, k: usize, of: &[usize]) -> f64 {
        let parts = &fit.model;
        let start = parts.terms()[k];
        let left: Vec<f64> = fit.residual_m.iter().map(|x| x.unwrap_or(0.0)).collect();
        let with = self.add_terms_back(parts, &left, of);
        let blocks = self.demodulate_blocks(&with, start.cycles);
        let square: f64 = with.iter().map(|x| x * x).sum();
        let alone = |line: bool| {
            let shape = |values: [f64; 3]| UnsteadyTone::from_term(&start, values, line);
            let left = |values: [f64; 3]| square - power_from_blocks(&blocks, &start, &shape(values));
            let mut best = ([0.0; 3], left([0.0; 3]));
            let mut steps = FIRST_STEPS;
            for _ in 0..MOST_STEPS {
                let moves = (0..3).filter(|j| !(line && *j == 1)).flat_map(|j| {
                    [steps[j], -steps[j]].map(|by| {
                        let mut values = best.0;
                        values[j] += by;
                        (values, left(values))
                    })
                });
                match moves.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|tried| tried.1 < best.1) {
                    Some(better) => best = better,
                    None => steps = steps.map(|step| step / 2.0),
                }
            }
            square - self.power_of_alternative(&with, &shape(best.0))
        };
        let less = (of.len() - 1) as f64 * TERM_PARAMETERS;
        self.bic_with(parts, alone(false).min(alone(true)), EXTRA_PARAMETERS - less)
    }

    /// Reduction of the sum of squares by an oscillation of this shape with its best amplitude and phase,
    /// m^2.
    fn power_of_alternative(&self, values: &[f64], shape: &UnsteadyTone) -> f64 {
        let add = |[cc, cs, ss, xc, xs]: [f64; 5], (i, x): (usize, &f64)| {
            let (envelope, phase) = shape.envelope_and_phase((i as f64 + 0.5) / values.len() as f64);
            let (sine, cosine) = math::sin_cos(phase);
            let (c, s, w) = (envelope * cosine, envelope * sine, self.weights[i]);
            [cc + w * c * c, cs + w * c * s, ss + w * s * s, xc + c * x, xs + s * x]
        };
        let [cc, cs, ss, xc, xs] = values.iter().enumerate().fold([0.0; 5], add);
        let determinant = cc * ss - cs * cs;
        if determinant > 0.0 { (ss * xc * xc - 2.0 * cs * xc * xs + cc * xs * xs) / determinant } else { 0.0 }
    }

    /// The values demodulated by a frequency, cycles in the record, and summed over blocks.
    fn demodulate_blocks(&self, values: &[f64], cycles: f64) -> Vec<DemodulatedBlock> {
        let frames = values.len();
        let size = frames.div_ceil(BLOCKS);
        let turn = -TAU * cycles / frames as f64;
        let block = |first: usize| {
            let add = |(re, im, weight): (f64, f64, f64), i: usize| {
                let (sine, cosine) = math::sin_cos(turn * (i as f64 + 0.5));
                (re + values[i] * cosine, im + values[i] * sine, weight + self.weights[i])
            };
            let inside = first..frames.min(first + size);
            let middle = (inside.start + inside.end) as f64 / 2.0 / frames as f64;
            let (re, im, weight) = inside.fold((0.0, 0.0, 0.0), add);
            DemodulatedBlock { middle, phasor: [re, im], weight }
        };
        (0..frames).step_by(size).map(block).collect()
    }
}

/// Indices of the oscillations, `k` included, that may be parts of one oscillation with term `k`.
pub(super) fn nearby_terms(terms: &[SineTerm], k: usize) -> Vec<usize> {
    let near = |j: &usize| terms[*j].cycles > 0.0 && are_near(&terms[*j], &terms[k]);
    (0..terms.len()).filter(near).collect()
}

fn are_near(a: &SineTerm, b: &SineTerm) -> bool {
    (a.cycles - b.cycles).abs() < NEARBY_RESOLUTIONS
}

/// A block of frames of the demodulated record.
struct DemodulatedBlock {
    /// Time of the middle of the block, in lengths of the record.
    middle: f64,
    /// Sum of the demodulated frames of the block, m: real and imaginary part.
    phasor: [f64; 2],
    /// Sum of the weights of the frames of the block.
    weight: f64,
}

/// Approximates `power_of_alternative` from sums over blocks; the relative error is about the reciprocal of
/// the number of cycles in the record.
fn power_from_blocks(blocks: &[DemodulatedBlock], start: &SineTerm, shape: &UnsteadyTone) -> f64 {
    let add = |[re, im, power]: [f64; 3], block: &DemodulatedBlock| {
        let (envelope, phase) = shape.envelope_and_phase(block.middle);
        let (sine, cosine) = math::sin_cos(phase - TAU * start.cycles * block.middle);
        let [x, y] = block.phasor;
        [
            re + envelope * (x * cosine + y * sine),
            im + envelope * (y * cosine - x * sine),
            power + envelope * envelope * block.weight,
        ]
    };
    let [re, im, power] = blocks.iter().fold([0.0; 3], add);
    if power > 0.0 { 2.0 * (re * re + im * im) / power } else { 0.0 }
}
