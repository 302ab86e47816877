//! What the directions change: constants of the linkage and the head's motion.

use super::span::{COEFFICIENTS, Course};
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
pub(super) struct Head {
    start_s: f64,
    position_m: f64,
    order: usize,
    /// Taylor coefficients of the velocity, m/s.
    velocity: [f64; COEFFICIENTS + 1],
}

impl Head {
    pub fn of(drive: &Drive, start_s: f64, order: usize) -> Self {
        let mut velocity = [0.0; COEFFICIENTS + 1];
        drive.series(start_s, &mut velocity[..=order + 1]);
        // (between its knots a recorded head is a short polynomial)
        let order = velocity.iter().rposition(|&v| v != 0.0).unwrap_or(0);
        Self { start_s, position_m: drive.at(start_s).position_m, order, velocity }
    }

    /// Sums of the velocity's series, integrated once, as they are and derived once and twice.
    fn motion(&self, x: Row) -> [Row; 4] {
        let mut sums = [Row::ZERO; 4];
        for k in (0..=self.order).rev() {
            let (power, v) = (k as f64, self.velocity[k]);
            let [position, velocity, acceleration, jerk] = &mut sums;
            *position = *position * x + Row::all(v / (power + 1.0));
            *velocity = *velocity * x + Row::all(v);
            if k > 0 {
                *acceleration = *acceleration * x + Row::all(power * v);
            }
            if k > 1 {
                *jerk = *jerk * x + Row::all(power * (power - 1.0) * v);
            }
        }
        sums[0] = Row::all(self.position_m) + sums[0] * x;
        sums
    }

    /// How the head's place moves with a source, m, with two derivatives in time.
    fn shift(&self, source: Source, x: Row) -> Option<HeadShift> {
        let [p, v, a, jerk] = match source {
            Source::Constant(_) => return None,
            _ => self.motion(x),
        };
        let t = Row::all(self.start_s) + x;
        Some(match source {
            Source::HeadDelay => [-v, -a, -jerk],
            Source::HeadStretch => [t * v, v + t * a, 2.0 * a + t * jerk],
            _ => [p, v, a],
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
    pub fn effect(self, course: &Course<'_>, head: Option<&Head>, at: &Instants) -> Effect {
        match self {
            Self::Constant(constant) => course.effect(at, constant),
            _ => head
                .and_then(|head| head.shift(self, at.x))
                .map_or_else(Effect::default, |shift| course.head_effect(at, &shift)),
        }
    }

    /// Where a unit of it moves head and tip.
    pub fn moved(self, course: &Course<'_>, head: Option<&Head>, at: &Attitude) -> Effect {
        match self {
            Self::Constant(constant) => course.moved(at, constant),
            _ => self.carried(head, at.x),
        }
    }

    /// Where a unit of a change of the head's motion moves head and tip.
    pub fn carried(self, head: Option<&Head>, x: Row) -> Effect {
        head.and_then(|head| head.shift(self, x)).map_or_else(Effect::default, |shift| Effect {
            head: shift[0],
            tip: shift,
            ..Effect::default()
        })
    }
}
