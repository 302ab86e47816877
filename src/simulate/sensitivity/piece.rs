//! What observers of derivatives see.

use super::blocks::TangentBlock;
use super::seeds::TangentSeeds;
use super::span::TangentStretch;
use super::weights::{Channel, ChannelWeights, DerivativeSum, RECIPROCALS};
use crate::blade::tangent::{LANES, LaneVector};
use crate::simulate::mode::TipMode;
use crate::simulate::piece::{BladePoints, ModelSample, SolutionSegment};

/// A piece of the solution with its derivatives.
pub struct TangentSegment<'a> {
    /// Start of the piece, s.
    pub start_s: f64,
    /// End of the piece, s.
    pub end_s: f64,
    /// Mode of contact.
    pub mode: TipMode,
    /// Whether there are derivatives: not behind a guard that grazes zero, nor behind a tip that has jammed.
    pub is_known: bool,
    pub(super) piece: &'a SolutionSegment<'a>,
    pub(super) span: TangentStretch<'a>,
    pub(super) blocks: &'a [TangentBlock],
    pub(super) seeds: &'a TangentSeeds,
}

impl TangentSegment<'_> {
    /// Where the blade is at a time within the piece.
    #[must_use]
    pub fn points_at(&self, t: f64) -> BladePoints {
        self.piece.points_at(t)
    }

    /// The model at a time within the piece.
    #[must_use]
    pub fn sample_at(&self, t: f64) -> ModelSample {
        self.piece.sample_at(t)
    }

    /// Weights of the value at a time within the piece.
    #[must_use]
    pub fn weights_at(&self, t: f64) -> ChannelWeights {
        ChannelWeights::at_time(t - self.span.place.start_s, self.span.course.motion.order)
    }

    /// Weights of the integral over a time within the piece, s: a camera's mean is the sum over the pieces
    /// that its shutter sees, over the time that it is open.
    #[must_use]
    pub fn weights_over(&self, from: f64, to: f64) -> ChannelWeights {
        let start_s = self.span.place.start_s;
        ChannelWeights::over_interval(
            &self.span.place,
            [from - start_s, to - start_s],
            self.span.course.motion.order,
        )
    }

    /// A channel's value, or its integral, by the series of the piece.
    #[must_use]
    pub fn channel_value(&self, channel: Channel, weights: &ChannelWeights) -> f64 {
        let motion = self.span.course.motion;
        let start_s = self.span.place.start_s;
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
            Channel::TipHeight if self.mode == TipMode::Flight => {
                sum_integrated(weights, &motion.gap_rate[..order])
            }
            Channel::TipHeight => 0.0,
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

    /// The derivatives of the same by each direction, in the order of the seeds: as many as `out` holds.
    pub fn channel_derivatives(&self, channel: Channel, weights: &ChannelWeights, out: &mut [f64]) {
        let sum = DerivativeSum::from_weights(&self.span, channel, weights);
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

/// The sum for what has these coefficients as its rate, and is zero at first.
fn sum_integrated(weights: &ChannelWeights, rate: &[f64]) -> f64 {
    let terms = weights.powers[1..].iter().zip(rate).zip(&RECIPROCALS[1..]);
    terms.rev().fold(0.0, |sum, ((factor, rate), share)| sum + factor * (rate * share))
}

/// Blocks whose sums are gathered at a time.
const MOST_BLOCKS: usize = 64 / LANES;
