//! Pieces of the solution with derivatives, for observers.

use super::seeds::{BlockSeed, TangentSeeds};
use super::source::{MOST_SOURCES, TangentSource};
use super::stretch::{SERIES_TERMS, StretchPlace, TangentStretch};
use super::tangent_blocks::TangentBlock;
pub use crate::model::tangent::ModelChannel as Channel;
use crate::model::tangent::{LANES, LaneVector, LinearForm, LinkAttitudes};
use crate::simulate::mode::TipMode;
use crate::simulate::solution_segment::{ModelSample, SolutionSegment};
use hybrid_ode::collocation::{MOST_NODES, NodeArray, collocation_rule};

/// A piece of the solution with its derivatives.
pub struct TangentSegment<'a> {
    /// Start of the piece, s.
    pub start_s: f64,
    /// End of the piece, s.
    pub end_s: f64,
    /// Mode of contact.
    pub mode: TipMode,
    /// Whether the derivatives are known: they are not after a guard has grazed zero or the tip has jammed.
    pub is_known: bool,
    pub(super) piece: &'a SolutionSegment<'a>,
    pub(super) span: TangentStretch<'a>,
    pub(super) blocks: &'a [TangentBlock],
    pub(super) seeds: &'a TangentSeeds,
}

impl TangentSegment<'_> {
    /// State of the model at a time within the piece.
    #[must_use]
    pub fn sample_at(&self, t: f64) -> ModelSample {
        self.piece.sample_at(t)
    }

    /// Weights that give the value of a channel at a time within the piece.
    #[must_use]
    pub fn weights_at(&self, t: f64) -> ChannelWeights {
        ChannelWeights::at_time(t - self.span.place.start_s, self.span.course.motion.order)
    }

    /// Weights that give the integral of a channel between two times within the piece, s. The mean over a
    /// camera's exposure is the sum of these integrals over the pieces within the exposure, divided by the
    /// exposure.
    #[must_use]
    pub fn weights_over(&self, from: f64, to: f64) -> ChannelWeights {
        let TangentStretch { place, course, .. } = &self.span;
        let interval = [from - place.start_s, to - place.start_s];
        ChannelWeights::over_interval(place, interval, course.motion.order)
    }

    /// Value or integral of a channel (as the weights define it), from the series of the piece.
    #[must_use]
    pub fn channel_value(&self, channel: Channel, weights: &ChannelWeights) -> f64 {
        let (motion, start_s) = (self.span.course.motion, self.span.place.start_s);
        let first = match channel {
            Channel::TipX => self.start_tip_x_m(),
            Channel::HeadX => self.span.system.drive.motion_at(start_s).position_m,
            Channel::TipHeight => self.piece.points_at(start_s).tip_height_m,
            _ => 0.0,
        };
        let order = motion.order;
        let sum = match channel {
            Channel::TipX => sum_integrated(weights, &motion.tip_velocity[..order]),
            Channel::HeadX => sum_integrated(weights, &motion.head_velocity[..order]),
            Channel::TipHeight if self.mode != TipMode::Flight => 0.0,
            Channel::TipHeight => sum_integrated(weights, &motion.gap_rate[..order]),
            Channel::HeadDrop => weights.sum_series(order, |k| motion.drop_m[k]),
            Channel::NeckAngle => weights.sum_series(order, |k| motion.angle[k][0]),
            Channel::LipAngle => weights.sum_series(order, |k| motion.angle[k][1]),
            Channel::NeckRate => weights.sum_series(order, |k| motion.rate[k][0]),
            Channel::LipRate => weights.sum_series(order, |k| motion.rate[k][1]),
            Channel::TipVelocity => weights.sum_series(order, |k| motion.tip_velocity[k]),
            Channel::NormalForce => weights.sum_series(order, |k| motion.normal_n(k)),
            Channel::FrictionForce => weights.sum_series(order, |k| motion.friction_n[k]),
        };
        sum + weights.powers[0] * first
    }

    /// Fills `out` with the derivatives of the value or integral with respect to each direction, in the order
    /// of the seeds.
    pub fn channel_derivatives(&self, channel: Channel, weights: &ChannelWeights, out: &mut [f64]) {
        let sum = DerivativeSum::new(&self.span, channel, weights);
        let mut rows = [LaneVector::ZERO; MOST_BLOCKS];
        let mut done = 0;
        for (blocks, seeds) in self.blocks.chunks(MOST_BLOCKS).zip(self.seeds.blocks.chunks(MOST_BLOCKS)) {
            for ((row, block), seed) in rows.iter_mut().zip(blocks).zip(seeds) {
                *row = sum.block_derivatives(block, seed);
            }
            for (out, &(block, lane)) in out.iter_mut().zip(&self.seeds.places) {
                if let Some(row) = block.checked_sub(done).and_then(|block| rows[..blocks.len()].get(block)) {
                    *out = row[lane];
                }
            }
            done += blocks.len();
        }
    }

    /// Position of the tip at the start of the series, m.
    fn start_tip_x_m(&self) -> f64 {
        let TangentStretch { system, course, place, .. } = &self.span;
        let [sin_theta, sin_phi] = course.motion.sines(0);
        let linkage = &system.linkage;
        system.drive.motion_at(place.start_s).position_m + linkage.l1_m * sin_theta + linkage.l2_m * sin_phi
    }
}

/// Weighted sum of the series of a quantity that starts at zero; `rate` has the Taylor coefficients of its
/// rate.
fn sum_integrated(weights: &ChannelWeights, rate: &[f64]) -> f64 {
    let terms = weights.powers[1..].iter().zip(rate).zip(&RECIPROCALS[1..]);
    terms.rev().fold(0.0, |sum, ((factor, rate), share)| sum + factor * (rate * share))
}

/// Maximum number of blocks of directions that are summed at a time.
const MOST_BLOCKS: usize = 64 / LANES;

// Values and integrals as weighted sums over the coefficients of series and over nodes.

/// Maximum number of parts of an integral; each part uses the quadrature rule with four nodes.
const MOST_PARTS: usize = 3;

pub(super) const RECIPROCALS: [f64; SERIES_TERMS + 1] = {
    let mut shares = [0.0; SERIES_TERMS + 1];
    let mut k = 1;
    while k < shares.len() {
        shares[k] = 1.0 / k as f64;
        k += 1;
    }
    shares
};

/// Four instants, s after the start of the motion's series, and their weights.
#[derive(Debug, Clone, Copy, Default)]
struct QuadraturePart {
    x: LaneVector,
    weights: LaneVector,
}

/// Weights that give a value at a time or an integral over an interval.
#[derive(Debug, Clone)]
pub struct ChannelWeights {
    /// Weights of the coefficients of the motion's series.
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
        /// Phase of the fastest derivative, rad, over which the rule with four nodes has an error of 1e-11.
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

    /// Weighted sum of the coefficients of a series.
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

/// Derivative of a value or integral, as a weighted sum of the unknowns of a block.
pub(super) struct DerivativeSum {
    value: [f64; 3],
    rate: [f64; 3],
    second: [NodeArray<f64>; 3],
    place: f64,
    own: [f64; MOST_SOURCES],
    /// Number of unknowns.
    unknowns: usize,
    /// Number of nodes.
    nodes: usize,
    /// Whether any source contributes directly.
    has_own: bool,
    /// Whether any unknown has a weight.
    has_second: bool,
}

impl DerivativeSum {
    pub(crate) fn new(span: &TangentStretch<'_>, channel: Channel, weights: &ChannelWeights) -> Self {
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
            // so far each weight belongs to a polynomial degree; convert them to weights of nodes
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
            // these forms do not need the angles of the links
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

    /// Adds a linear form, and its direct change by sources that displace head or tip. `at` is required for
    /// constants of the linkage and for forms with rates.
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

    /// Derivatives of the value or integral with respect to the directions of a block.
    pub(crate) fn block_derivatives(&self, block: &TangentBlock, seed: &BlockSeed) -> LaneVector {
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
