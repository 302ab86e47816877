//! Values and integrals of quantities as sums of what a stretch knows.

#![allow(clippy::needless_range_loop)] // indices are those of the equations

use super::blocks::TangentBlock;
use super::seeds::BlockSeed;
use super::source::{MOST_SOURCES, TangentSource};
use super::span::{SERIES_TERMS, StretchPlace, TangentStretch};
pub use crate::blade::tangent::ModelChannel as Channel;
use crate::blade::tangent::{LANES, LaneVector, LinearForm, LinkAttitudes};
use crate::ode::collocation::{MOST_NODES, NodeArray, collocation_rule};

/// Parts of an integral at most, each by the rule of four nodes.
const MOST_PARTS: usize = 3;

/// `1 / k`.
pub(super) const RECIPROCALS: [f64; SERIES_TERMS + 1] = {
    let mut shares = [0.0; SERIES_TERMS + 1];
    let mut k = 1;
    while k < shares.len() {
        shares[k] = 1.0 / k as f64;
        k += 1;
    }
    shares
};

/// A few instants, s after the start of the motion, with their weights.
#[derive(Debug, Clone, Copy, Default)]
struct QuadraturePart {
    x: LaneVector,
    weights: LaneVector,
}

/// Factors in the sum for a value at a time, or for its integral over one.
#[derive(Debug, Clone)]
pub struct ChannelWeights {
    /// Of the coefficients of the motion's series.
    pub(super) powers: [f64; SERIES_TERMS],
    parts: [QuadraturePart; MOST_PARTS],
    used: usize,
}

impl ChannelWeights {
    fn empty() -> Self {
        Self { powers: [0.0; SERIES_TERMS], parts: [QuadraturePart::default(); MOST_PARTS], used: 0 }
    }

    pub(super) fn at_time(x: f64, order: usize) -> Self {
        let mut out = Self::empty();
        let mut power = 1.0;
        for factor in &mut out.powers[..=order] {
            *factor = power;
            power *= x;
        }
        let mut weights = LaneVector::ZERO;
        weights[0] = 1.0;
        out.add_part(LaneVector::splat(x), weights);
        out
    }

    pub(super) fn over_interval(place: &StretchPlace, [from, to]: [f64; 2], order: usize) -> Self {
        /// Radians of the fastest derivative over which four nodes are good to 1e-11.
        const RESOLVED: f64 = 0.6;
        let mut out = Self::empty();
        let mut powers = [from, to];
        for (k, factor) in out.powers[..=order].iter_mut().enumerate() {
            *factor = (powers[1] - powers[0]) * RECIPROCALS[k + 1];
            powers = [powers[0] * from, powers[1] * to];
        }
        let parts = (place.rapid * (to - from) / RESOLVED).ceil().clamp(1.0, MOST_PARTS as f64);
        let (length, four) = ((to - from) / parts, collocation_rule(LANES));
        for part in 0..parts as usize {
            let start = from + part as f64 * length;
            let [places, weights] =
                [four.positions, four.weights].map(|all| LaneVector(std::array::from_fn(|i| all[i])));
            out.add_part(LaneVector::splat(start) + length * places, length * weights);
        }
        out
    }

    /// The sum over the terms of a series.
    #[inline(always)]
    pub(super) fn sum_series(&self, order: usize, coefficient: impl Fn(usize) -> f64) -> f64 {
        let factors = self.powers[..=order].iter().enumerate().rev();
        factors.fold(0.0, |sum, (k, factor)| sum + factor * coefficient(k))
    }

    fn add_part(&mut self, x: LaneVector, weights: LaneVector) {
        self.parts[self.used] = QuadraturePart { x, weights };
        self.used += 1;
    }
}

/// A quantity's derivative, or its integral, as a sum over what the blocks know.
pub(super) struct DerivativeSum {
    value: [f64; 3],
    rate: [f64; 3],
    second: [NodeArray<f64>; 3],
    place: f64,
    own: [f64; MOST_SOURCES],
    /// Unknowns and nodes in use, whether any change acts by itself, and whether any unknown counts.
    unknowns: usize,
    nodes: usize,
    has_own: bool,
    has_second: bool,
}

impl DerivativeSum {
    pub fn from_weights(span: &TangentStretch<'_>, channel: Channel, weights: &ChannelWeights) -> Self {
        let mut sum = Self {
            value: [0.0; 3],
            rate: [0.0; 3],
            second: [[0.0; MOST_NODES]; 3],
            place: 0.0,
            own: [0.0; MOST_SOURCES],
            unknowns: span.unknown_count(),
            nodes: span.place.rule.nodes,
            has_own: false,
            has_second: false,
        };
        let is_force = matches!(channel, Channel::NormalForce | Channel::FrictionForce);
        for part in &weights.parts[..weights.used] {
            if is_force {
                sum.add_force(span, channel, part);
            } else {
                sum.add_position(span, channel, part);
            }
        }
        if sum.has_second {
            // (by degree so far)
            for second in &mut sum.second[..sum.unknowns] {
                *second = span.place.rule.to_nodal(second);
            }
        }
        sum
    }

    fn add_position(&mut self, span: &TangentStretch<'_>, channel: Channel, part: &QuadraturePart) {
        let course = &span.course;
        let turned = |source: &TangentSource| {
            matches!(source, TangentSource::Constant(_)) && source.displaces_points(course)
        };
        let form = match channel {
            // (no angle is needed)
            Channel::TipX => course.tip_position_form(),
            Channel::HeadX => course.head_position_form(),
            _ => {
                let at = course.sample_attitudes(part.x);
                let form = course.channel_form(&at, channel);
                return self.add_displaced(span, part, &form, Some(&at));
            }
        };
        let at = span.sources.iter().any(turned).then(|| course.sample_attitudes(part.x));
        self.add_displaced(span, part, &form, at.as_ref());
    }

    /// Adds a form, and what the sources that move head or tip do to it; `at` where one of them is a
    /// constant, or where rates count.
    fn add_displaced(
        &mut self,
        span: &TangentStretch<'_>,
        part: &QuadraturePart,
        form: &LinearForm,
        at: Option<&LinkAttitudes>,
    ) {
        let (course, own) = (&span.course, &form.forcing);
        self.add_form(span, part, form);
        let is_place = own.tip[1] == LaneVector::ZERO && own.tip[2] == LaneVector::ZERO;
        let by_head = own.head + own.tip[0];
        for (i, source) in
            span.sources.iter().enumerate().filter(|(_, source)| source.displaces_points(course))
        {
            let moved = match (source, &span.head, at) {
                (TangentSource::Constant(constant), _, Some(at)) => {
                    course.displacement_terms(at, *constant).dot(own)
                }
                (TangentSource::Constant(_), ..) => continue,
                (head, Some(motion), _) if is_place => {
                    if by_head == LaneVector::ZERO {
                        continue;
                    }
                    by_head * motion.position_change(*head, part.x)
                }
                (head, motion, Some(at)) => head.displacement_terms(course, motion.as_ref(), at).dot(own),
                _ => continue,
            };
            self.has_own = true;
            self.own[i] += part.weights.dot(&moved);
        }
    }

    fn add_force(&mut self, span: &TangentStretch<'_>, channel: Channel, part: &QuadraturePart) {
        let course = &span.course;
        let at = course.sample_motion(part.x);
        let form = course.force_form(&at, channel);
        self.add_form(span, part, &form);
        for (i, source) in span.sources.iter().enumerate().filter(|(_, source)| source.affects_motion(course))
        {
            self.has_own = true;
            let effect = source.forcing_terms(course, span.head.as_ref(), &at);
            self.own[i] += part.weights.dot(&effect.dot(&form.forcing));
        }
    }

    fn add_form(&mut self, span: &TangentStretch<'_>, part: &QuadraturePart, form: &LinearForm) {
        let StretchPlace { from, length, rule, .. } = span.place;
        let since = part.x - LaneVector::splat(from);
        self.place += part.weights.dot(&form.place);
        let unknowns = ..self.unknowns;
        if form.value[unknowns].iter().chain(&form.rate[unknowns]).all(|row| *row == LaneVector::ZERO) {
            return;
        }
        self.has_second = true;
        let [mut once, mut twice] = [[LaneVector::ZERO; MOST_NODES]; 2];
        rule.integrals_by_degree((1.0 / length) * since, &mut once, &mut twice);
        for d in 0..self.unknowns {
            let second = &mut self.second[d][..self.nodes];
            let value = part.weights * form.value[d];
            self.value[d] += value.sum();
            self.rate[d] += value.dot(&since);
            let value = (length * length) * value;
            second.iter_mut().zip(&twice).for_each(|(sum, twice)| *sum += value.dot(twice));
            if form.rate[d] != LaneVector::ZERO {
                let rate = part.weights * form.rate[d];
                self.rate[d] += rate.sum();
                let rate = length * rate;
                second.iter_mut().zip(&once).for_each(|(sum, once)| *sum += rate.dot(once));
            }
        }
    }

    /// The derivatives in the directions of a block.
    pub fn block_derivatives(&self, block: &TangentBlock, seed: &BlockSeed) -> LaneVector {
        let mut row = self.place * block.place;
        if self.has_second {
            for d in 0..self.unknowns {
                row.add_scaled(self.value[d], &block.value[d]);
                row.add_scaled(self.rate[d], &block.rate[d]);
                for (factor, second) in self.second[d][..self.nodes].iter().zip(&block.second) {
                    row.add_scaled(*factor, &second[d]);
                }
            }
        }
        if self.has_own {
            for change in &seed.changes {
                row[change.lane] += change.factor * self.own[change.source];
            }
        }
        row
    }
}
