//! What observers of derivatives see.

use super::blocks::Block;
use super::seeds::Seeds;
use super::span::Span;
use super::weights::{Channel, SHARES, Sum, Weights};
use crate::blade::tangent::{LANES, Row};
use crate::simulate::mode::Mode;
use crate::simulate::piece::{Piece, Place, Sample};

/// A piece of the solution with its derivatives.
pub struct TangentPiece<'a> {
    /// Start of the piece, s.
    pub start_s: f64,
    /// End of the piece, s.
    pub end_s: f64,
    /// Mode of contact.
    pub mode: Mode,
    /// Whether there are derivatives: not behind a guard that grazes zero, nor behind a tip that has jammed.
    pub is_known: bool,
    pub(super) piece: &'a Piece<'a>,
    pub(super) span: Span<'a>,
    pub(super) blocks: &'a [Block],
    pub(super) seeds: &'a Seeds,
}

impl TangentPiece<'_> {
    /// Where the blade is at a time within the piece.
    #[must_use]
    pub fn place(&self, t: f64) -> Place {
        self.piece.place(t)
    }

    /// The model at a time within the piece.
    #[must_use]
    pub fn sample(&self, t: f64) -> Sample {
        self.piece.sample(t)
    }

    /// Weights of the value at a time within the piece.
    #[must_use]
    pub fn at(&self, t: f64) -> Weights {
        Weights::at(t - self.span.place.start_s, self.span.course.motion.order)
    }

    /// Weights of the integral over a time within the piece, s: a camera's mean is the sum over the pieces
    /// that its shutter sees, over the time that it is open.
    #[must_use]
    pub fn over(&self, from: f64, to: f64) -> Weights {
        let start_s = self.span.place.start_s;
        Weights::over(&self.span.place, [from - start_s, to - start_s], self.span.course.motion.order)
    }

    /// A channel's value, or its integral, by the series of the piece.
    #[must_use]
    pub fn value(&self, channel: Channel, weights: &Weights) -> f64 {
        let motion = self.span.course.motion;
        let start_s = self.span.place.start_s;
        let first = match channel {
            Channel::TipX => self.tip_x(),
            Channel::HeadX => self.span.system.drive.at(start_s).position_m,
            Channel::TipHeight => self.piece.place(start_s).tip_height_m,
            _ => 0.0,
        };
        let order = motion.order;
        let sum = match channel {
            Channel::TipX => raised(weights, &motion.tip_velocity[..order]),
            Channel::HeadX => raised(weights, &motion.head_velocity[..order]),
            Channel::TipHeight if self.mode == Mode::Flight => raised(weights, &motion.gap_rate[..order]),
            Channel::TipHeight => 0.0,
            Channel::HeadDrop => weights.sum(order, |k| motion.drop_m[k]),
            Channel::NeckAngle => weights.sum(order, |k| motion.angle[k][0]),
            Channel::LipAngle => weights.sum(order, |k| motion.angle[k][1]),
            Channel::NeckRate => weights.sum(order, |k| motion.rate[k][0]),
            Channel::LipRate => weights.sum(order, |k| motion.rate[k][1]),
            Channel::TipVelocity => weights.sum(order, |k| motion.tip_velocity[k]),
            Channel::NormalForce => weights.sum(order, |k| motion.normal_n(k)),
            Channel::FrictionForce => weights.sum(order, |k| motion.friction_n[k]),
        };
        sum + weights.powers[0] * first
    }

    /// The derivatives of the same by each direction, in the order of the seeds: as many as `out` holds.
    pub fn derivatives(&self, channel: Channel, weights: &Weights, out: &mut [f64]) {
        let sum = Sum::of(&self.span, channel, weights);
        let mut rows = [Row::ZERO; MOST_BLOCKS];
        let mut done = 0;
        for (blocks, seeds) in self.blocks.chunks(MOST_BLOCKS).zip(self.seeds.blocks.chunks(MOST_BLOCKS)) {
            for ((row, block), seed) in rows.iter_mut().zip(blocks).zip(seeds) {
                *row = sum.row(block, seed);
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
    fn tip_x(&self) -> f64 {
        let Span { system, course, place, .. } = &self.span;
        let [sin_theta, sin_phi] = course.motion.sines(0);
        let linkage = &system.linkage;
        system.drive.at(place.start_s).position_m + linkage.l1_m * sin_theta + linkage.l2_m * sin_phi
    }
}

/// The sum for what has these coefficients as its rate, and is zero at first.
fn raised(weights: &Weights, rate: &[f64]) -> f64 {
    let terms = weights.powers[1..].iter().zip(rate).zip(&SHARES[1..]);
    terms.rev().fold(0.0, |sum, ((factor, rate), share)| sum + factor * (rate * share))
}

/// Blocks whose sums are gathered at a time.
const MOST_BLOCKS: usize = 64 / LANES;
