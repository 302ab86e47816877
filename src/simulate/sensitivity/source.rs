//! What the directions change: constants of the linkage and the head's motion.

use super::span::Course;
use crate::blade::tangent::{Attitude, Constant, Effect, HeadShift, Instants, Row};
use crate::simulate::drive::Drive;

/// A change that directions are made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Constant(Constant),
    /// The head's motion `x(t)` changes by `x`, by `-x'` or by `t x'`.
    HeadScale,
    HeadDelay,
    HeadStretch,
}

/// Number of sources at most: the linkage's constants, and the head's.
pub(super) const MOST_SOURCES: usize = 24;

/// The head's motion about the start of a piece.
#[derive(Debug, Clone)]
pub(super) struct Head<'a> {
    start_s: f64,
    position_m: f64,
    /// Taylor coefficients of the velocity, m/s, up to the last that is not zero: between its knots a
    /// recorded head is a short polynomial.
    velocity: &'a [f64],
}

impl<'a> Head<'a> {
    /// What the sources need of it; `None` where they leave the head alone.
    pub fn of(sources: &[Source], drive: &Drive, start_s: f64, velocity: &'a [f64]) -> Option<Self> {
        sources.iter().find(|source| !matches!(source, Source::Constant(_)))?;
        let used = velocity.iter().rposition(|&v| v != 0.0).map_or(0, |last| last + 1);
        let is_scaled = sources.contains(&Source::HeadScale);
        let position_m = if is_scaled { drive.at(start_s).position_m } else { 0.0 };
        Some(Self { start_s, position_m, velocity: &velocity[..used] })
    }

    /// The head's place, m.
    fn position(&self, x: Row) -> Row {
        let mut sum = Row::ZERO;
        for (k, v) in self.velocity.iter().enumerate().rev() {
            sum = sum * x + Row::all(v / (k + 1) as f64);
        }
        Row::all(self.position_m) + sum * x
    }

    /// Velocity, acceleration and jerk.
    fn rates(&self, x: Row) -> [Row; 3] {
        let mut sums = [Row::ZERO; 3];
        for (k, &v) in self.velocity.iter().enumerate().rev() {
            let power = k as f64;
            let [velocity, acceleration, jerk] = &mut sums;
            *velocity = *velocity * x + Row::all(v);
            if k > 0 {
                *acceleration = *acceleration * x + Row::all(power * v);
            }
            if k > 1 {
                *jerk = *jerk * x + Row::all(power * (power - 1.0) * v);
            }
        }
        sums
    }

    /// How the head's place moves with a source, m.
    pub fn moved(&self, source: Source, x: Row) -> Row {
        let velocity = || {
            self.velocity.iter().rev().fold(Row::ZERO, |sum, &coefficient| sum * x + Row::all(coefficient))
        };
        match source {
            Source::Constant(_) => Row::ZERO,
            Source::HeadScale => self.position(x),
            Source::HeadDelay => -velocity(),
            Source::HeadStretch => (Row::all(self.start_s) + x) * velocity(),
        }
    }

    /// The same with two derivatives in time.
    fn shift(&self, source: Source, x: Row) -> Option<HeadShift> {
        if let Source::Constant(_) = source {
            return None;
        }
        let ([v, a, jerk], t) = (self.rates(x), Row::all(self.start_s) + x);
        Some(match source {
            Source::HeadDelay => [-v, -a, -jerk],
            Source::HeadStretch => [t * v, v + t * a, 2.0 * a + t * jerk],
            _ => [self.position(x), v, a],
        })
    }
}

impl Source {
    /// Whether it matters in this course.
    pub fn acts(self, course: &Course<'_>) -> bool {
        match self {
            Self::Constant(constant) => course.uses(constant),
            _ => true,
        }
    }

    /// Whether it moves head or tip where the angles stay.
    pub fn moves(self, course: &Course<'_>) -> bool {
        match self {
            Self::Constant(constant) => course.moves(constant),
            _ => true,
        }
    }

    /// All that a unit of it does.
    #[inline(always)]
    pub fn effect(self, course: &Course<'_>, head: Option<&Head<'_>>, at: &Instants) -> Effect {
        match self {
            Self::Constant(constant) => course.effect(at, constant),
            _ => head
                .and_then(|head| head.shift(self, at.x))
                .map_or_else(Effect::default, |shift| course.head_effect(at, &shift)),
        }
    }

    /// Where a unit of it moves head and tip.
    pub fn moved(self, course: &Course<'_>, head: Option<&Head<'_>>, at: &Attitude) -> Effect {
        match self {
            Self::Constant(constant) => course.moved(at, constant),
            _ => head.and_then(|head| head.shift(self, at.x)).map_or_else(Effect::default, |shift| Effect {
                head: shift[0],
                tip: shift,
                ..Effect::default()
            }),
        }
    }
}
