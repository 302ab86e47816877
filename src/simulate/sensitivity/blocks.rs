//! Derivatives in several directions over one piece.

use super::seeds::{BlockSeed, Seeds};
use crate::blade::series::Touch;
use crate::blade::shoulder::Lean;
use crate::blade::tangent::{LANES, Row, Shared, StateTangent, TangentSeries};
use crate::simulate::mode::Mode;
use crate::simulate::phases::{Motion, System};
use std::array::from_fn;

/// Number of coefficients of a motion's series.
pub(super) const COEFFICIENTS: usize = crate::ode::polynomial::TERMS + 2;

/// Directions that are carried side by side.
#[derive(Debug, Default)]
pub(super) struct Block {
    /// Coefficients of the last piece.
    pub series: TangentSeries<COEFFICIENTS>,
    /// Derivatives of the state at the start of the last piece.
    pub start: StateTangent,
    /// Of the position of the head there, m.
    pub head_x: Row,
    /// Of the state at the end of the last piece, or moved with the transition there.
    pub state: StateTangent,
    /// Of the guard that has fallen, and of the time of the transition.
    pub guard: Row,
    pub time: Row,
}

/// All directions of a run, and what they move with.
pub(super) struct Blocks<'a> {
    pub system: &'a System,
    pub seeds: &'a Seeds,
    pub all: &'a mut [Block],
    /// Share of their scale by which derivatives may err in a step.
    pub relative: f64,
    /// Highest angular frequency of the links, rad/s.
    pub fastest: f64,
}

impl Blocks<'_> {
    /// Blocks with what their directions change.
    pub fn each(&mut self) -> impl Iterator<Item = (&mut Block, &BlockSeed)> {
        self.all.iter_mut().zip(&self.seeds.blocks)
    }

    /// The series of all derivatives about the start of a motion.
    pub fn expand(&mut self, touch: Touch, lean: Lean, motion: &Motion, start_s: f64) {
        let shared = Shared::new(&self.system.linkage, touch, lean, motion, self.seeds.friction);
        let system = self.system;
        for (block, seed) in self.each() {
            block.start = block.state;
            block.head_x = seed.head(system, start_s, motion.order, &mut block.series.head_velocity);
            block.series.expand(&system.linkage, seed.linkage.as_deref(), &shared, &block.start);
            // (in stick the start has lost what would move the tip)
            block.start.rate = block.series.rate[0];
        }
    }

    /// The end of a piece that the series of the derivatives reach, at most `end_s`. A blade that slides
    /// steadily is integrated in long steps, but its derivatives swing.
    pub fn reach(&self, order: usize, [start_s, end_s]: [f64; 2]) -> f64 {
        /// Longer by this a step may be: no sliver is left over.
        const STRETCH: f64 = 1.01;
        /// Parts of a step at most: numbers that are none make no end.
        const MOST_PARTS: f64 = 1e3;
        let length = |k: usize| {
            let ratio = self.all.iter().map(|block| block.ratio(k, self.fastest)).fold(0.0, f64::max);
            (self.relative / ratio).powf(1.0 / k as f64)
        };
        let (wanted, rest) = (length(order - 1).min(length(order)), end_s - start_s);
        let parts = (rest / wanted).ceil().min(MOST_PARTS);
        if wanted * STRETCH >= rest || parts.is_nan() { end_s } else { start_s + rest / parts }
    }

    /// Moves the state to `x` after the start of the motion; whether it is a number.
    pub fn finish(&mut self, touch: Touch, order: usize, x: f64) -> bool {
        self.all.iter_mut().all(|block| {
            block.state = block.state_after(touch, order, x);
            block.state.is_finite()
        })
    }
}

/// Rates of the state at `x` after the start of a motion in this mode: of angles, angular rates, gap and its
/// rate; on the glass the gap stays.
pub(super) fn rates_after(motion: &Motion, mode: Mode, x: f64) -> [f64; 6] {
    let mut rates = [0.0; 6];
    for k in (1..=motion.order).rev() {
        let (power, before) = (k as f64, k - 1);
        let last = [
            motion.rate[before][0],
            motion.rate[before][1],
            power * motion.rate[k][0],
            power * motion.rate[k][1],
            motion.gap_rate[before],
            power * motion.gap_rate[k],
        ];
        rates = std::array::from_fn(|i| rates[i] * x + last[i]);
    }
    if mode != Mode::Flight {
        (rates[4], rates[5]) = (0.0, 0.0);
    }
    rates
}

impl StateTangent {
    /// Adds what passes in a time that depends on the direction.
    pub(super) fn shift(&mut self, rates: &[f64; 6], time: Row) {
        let ([theta, phi], [theta_rate, phi_rate]) = (&mut self.angle, &mut self.rate);
        let rows = [theta, phi, theta_rate, phi_rate, &mut self.gap_m, &mut self.gap_rate];
        rows.into_iter().zip(rates).for_each(|(row, rate)| row.add_scaled(*rate, &time));
    }

    fn is_finite(&self) -> bool {
        let Self { angle, rate, gap_m, gap_rate } = self;
        [angle[0], angle[1], rate[0], rate[1], *gap_m, *gap_rate].iter().all(Row::is_finite)
    }
}

impl Block {
    /// Size of the coefficients of `x^k` relative to the scale of each direction.
    fn ratio(&self, k: usize, fastest: f64) -> f64 {
        let series = &self.series;
        let largest = |rows: [Row; 2], lane: usize| rows[0][lane].abs().max(rows[1][lane].abs());
        let mut worst = 0.0f64;
        for lane in 0..LANES {
            // in radians: what is there, and what grows over a radian of the fastest oscillation
            let mut scale = largest(series.angle(0), lane);
            for j in 0..3 {
                scale = scale.max(largest(series.rate[j], lane) / fastest.powi(j as i32 + 1));
            }
            let size = largest(series.angle(k), lane).max(largest(series.rate[k], lane) / fastest);
            if scale > 0.0 {
                worst = worst.max(size / scale);
            }
        }
        worst
    }

    /// Derivatives of the state at `x` after the start of the last piece.
    fn state_after(&self, touch: Touch, order: usize, x: f64) -> StateTangent {
        let series = &self.series;
        let mut state = StateTangent::default();
        for k in (0..=order).rev() {
            let (angle, rate) = (series.angle(k), series.rate[k]);
            state.angle = from_fn(|i| x * state.angle[i] + angle[i]);
            state.rate = from_fn(|i| x * state.rate[i] + rate[i]);
        }
        if let Touch::Flight(..) = touch {
            for k in (0..=order).rev() {
                let share = x / (k + 1) as f64;
                state.gap_m = x * state.gap_m + share * series.gap_rate[k];
                state.gap_rate = x * state.gap_rate + series.gap_rate[k];
            }
            state.gap_m += self.start.gap_m;
        }
        state
    }
}

impl BlockSeed {
    /// Derivatives of the head's velocity at `t`, m/s.
    pub(super) fn head_velocity(&self, system: &System, t: f64) -> Row {
        let mut series = [Row::ZERO; COEFFICIENTS];
        self.head(system, t, 0, &mut series);
        series[0]
    }

    /// Taylor coefficients of the derivatives of the head's velocity about `t`, up to `x^order`; returns the
    /// derivatives of its position, m.
    fn head(&self, system: &System, t: f64, order: usize, out: &mut [Row; COEFFICIENTS]) -> Row {
        let Some(drive) = &self.drive else {
            out[..=order].fill(Row::ZERO);
            return Row::ZERO;
        };
        let mut velocity = [0.0; COEFFICIENTS + 1];
        system.drive.series(t, &mut velocity[..=order + 1]);
        let shift = t * drive.stretch - drive.delay;
        for k in 0..=order {
            let next = (k + 1) as f64;
            out[k] = velocity[k] * (drive.scale + next * drive.stretch) + (next * velocity[k + 1]) * shift;
        }
        system.drive.at(t).position_m * drive.scale + velocity[0] * shift
    }
}
