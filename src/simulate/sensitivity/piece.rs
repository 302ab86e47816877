//! What observers of derivatives see.

use super::blocks::{Block, Blocks, COEFFICIENTS};
use super::seeds::Seeds;
use crate::blade::tangent::{LANES, LinkageTangent, Row};
use crate::simulate::mode::Mode;
use crate::simulate::phases::{Motion, System};
use crate::simulate::piece::{Piece, Place, Sample};

/// A quantity of which there are derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Position of the tip along the sweep, m.
    TipX,
    /// Drop of the head towards the glass, m.
    HeadDrop,
    /// Position of the head along the sweep, m.
    HeadX,
    /// Height of the tip above the glass, m; zero in contact.
    TipHeight,
    /// Angle of the neck, rad.
    NeckAngle,
    /// Angle of the lip, rad.
    LipAngle,
    /// Angular rate of the neck, rad/s.
    NeckRate,
    /// Angular rate of the lip, rad/s.
    LipRate,
    /// Velocity of the tip along the sweep, m/s.
    TipVelocity,
    /// Normal force, N, to one order less than the rest.
    NormalForce,
    /// Friction force, N, likewise.
    FrictionForce,
}

/// Factors of the coefficients of a polynomial in a sum: its value at a time, or its integral over one.
#[derive(Debug, Clone)]
pub struct Weights {
    factors: [f64; COEFFICIENTS],
}

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
    piece: &'a Piece<'a>,
    motion: &'a Motion,
    blocks: &'a [Block],
    seeds: &'a Seeds,
    system: &'a System,
}

impl<'a> TangentPiece<'a> {
    pub(super) fn new(
        piece: &'a Piece<'a>,
        [start_s, end_s]: [f64; 2],
        motion: &'a Motion,
        blocks: &'a Blocks<'a>,
        is_known: bool,
    ) -> Self {
        let (seeds, system) = (blocks.seeds, blocks.system);
        Self {
            start_s,
            end_s,
            mode: piece.mode,
            is_known,
            piece,
            motion,
            blocks: &*blocks.all,
            seeds,
            system,
        }
    }

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
        let (x, mut power) = (t - self.start_s, 1.0);
        let mut factors = [0.0; COEFFICIENTS];
        for factor in &mut factors[..=self.motion.order] {
            *factor = power;
            power *= x;
        }
        Weights { factors }
    }

    /// Weights of the integral over a time within the piece, s: a camera's mean is the sum over the pieces
    /// that its shutter sees, over the time that it is open.
    #[must_use]
    pub fn over(&self, from: f64, to: f64) -> Weights {
        let [from, to] = [from - self.start_s, to - self.start_s];
        let mut powers = [from, to];
        let mut factors = [0.0; COEFFICIENTS];
        for (k, factor) in factors[..=self.motion.order].iter_mut().enumerate() {
            *factor = (powers[1] - powers[0]) / (k + 1) as f64;
            powers = [powers[0] * from, powers[1] * to];
        }
        Weights { factors }
    }

    /// A channel's value, or its integral, by the series of the piece.
    #[must_use]
    pub fn value(&self, channel: Channel, weights: &Weights) -> f64 {
        let motion = self.motion;
        let first = match channel {
            Channel::TipX => self.tip_x(),
            Channel::HeadX => self.system.drive.at(self.start_s).position_m,
            Channel::TipHeight => self.gap(),
            _ => 0.0,
        };
        let coefficient = |k: usize| match channel {
            Channel::TipX if k > 0 => motion.tip_velocity[k - 1] / k as f64,
            Channel::HeadX if k > 0 => motion.head_velocity[k - 1] / k as f64,
            Channel::TipHeight if k > 0 && self.mode == Mode::Flight => motion.gap_rate[k - 1] / k as f64,
            Channel::TipX | Channel::HeadX | Channel::TipHeight => 0.0,
            Channel::HeadDrop => motion.drop_m[k],
            Channel::NeckAngle => motion.angle[k][0],
            Channel::LipAngle => motion.angle[k][1],
            Channel::NeckRate => motion.rate[k][0],
            Channel::LipRate => motion.rate[k][1],
            Channel::TipVelocity => motion.tip_velocity[k],
            Channel::NormalForce => motion.normal_n(k),
            Channel::FrictionForce => motion.friction_n[k],
        };
        let sum = weights.factors[..=motion.order].iter().enumerate().rev();
        sum.fold(0.0, |sum, (k, factor)| sum + factor * coefficient(k)) + weights.factors[0] * first
    }

    /// The derivatives of the same by each direction, in the order of the seeds: as many as `out` holds.
    pub fn derivatives(&self, channel: Channel, weights: &Weights, out: &mut [f64]) {
        let mut rows = [Row::ZERO; MOST_BLOCKS];
        let mut done = 0;
        for (blocks, seeds) in self.blocks.chunks(MOST_BLOCKS).zip(self.seeds.blocks.chunks(MOST_BLOCKS)) {
            for ((row, block), seed) in rows.iter_mut().zip(blocks).zip(seeds) {
                *row = self.row(block, seed.linkage.as_deref(), channel, weights);
            }
            for (out, &(block, lane)) in out.iter_mut().zip(&self.seeds.places) {
                if let Some(row) = block.checked_sub(done).and_then(|block| rows[..blocks.len()].get(block)) {
                    *out = row[lane];
                }
            }
            done += blocks.len();
        }
    }

    #[inline]
    fn row(&self, block: &Block, own: Option<&LinkageTangent>, channel: Channel, weights: &Weights) -> Row {
        let series = &block.series;
        let factors = &weights.factors[..=self.motion.order];
        let sum = |coefficient: &dyn Fn(usize) -> Row| {
            let mut sum = Row::ZERO;
            factors.iter().enumerate().for_each(|(k, factor)| sum.add_scaled(*factor, &coefficient(k)));
            sum
        };
        let grown = |first: Row, coefficient: &dyn Fn(usize) -> Row| {
            let mut sum = factors[0] * first;
            for (k, factor) in factors.iter().enumerate().skip(1) {
                sum.add_scaled(factor / k as f64, &coefficient(k - 1));
            }
            sum
        };
        match channel {
            Channel::TipX => grown(self.tip_x_row(block, own), &|k| series.tip_velocity(k)),
            Channel::HeadX => grown(block.head_x, &|k| series.head_velocity[k]),
            Channel::TipHeight if self.mode != Mode::Flight => Row::ZERO,
            Channel::TipHeight => grown(block.start.gap_m, &|k| series.gap_rate[k]),
            Channel::HeadDrop => sum(&|k| series.drop_m[k]),
            Channel::NeckAngle => sum(&|k| series.angle(k)[0]),
            Channel::LipAngle => sum(&|k| series.angle(k)[1]),
            Channel::NeckRate => sum(&|k| series.rate[k][0]),
            Channel::LipRate => sum(&|k| series.rate[k][1]),
            Channel::TipVelocity => sum(&|k| series.tip_velocity(k)),
            Channel::NormalForce => sum(&|k| series.normal_n(k)),
            Channel::FrictionForce => sum(&|k| series.friction_n[k]),
        }
    }

    /// Position of the tip at the start, m.
    fn tip_x(&self) -> f64 {
        let linkage = &self.system.linkage;
        let [sin_theta, sin_phi] = self.motion.sines(0);
        self.system.drive.at(self.start_s).position_m + linkage.l1_m * sin_theta + linkage.l2_m * sin_phi
    }

    fn tip_x_row(&self, block: &Block, own: Option<&LinkageTangent>) -> Row {
        let ([cos_theta, cos_phi], angle) = (self.motion.cosines(0), block.start.angle);
        let linkage = &self.system.linkage;
        let mut row =
            block.head_x + (linkage.l1_m * cos_theta) * angle[0] + (linkage.l2_m * cos_phi) * angle[1];
        if let Some(own) = own {
            let [sin_theta, sin_phi] = self.motion.sines(0);
            row += sin_theta * own.lengths_m[0] + sin_phi * own.lengths_m[1];
        }
        row
    }

    /// Height of the tip at the start, m.
    fn gap(&self) -> f64 {
        self.piece.place(self.start_s).tip_height_m
    }
}

/// Blocks whose sums are gathered at a time.
const MOST_BLOCKS: usize = 64 / LANES;
