//! A stretch of a piece over which derivatives are collocated, and how long it may be.

use super::source::{Head, Source};
use crate::blade::series::Touch;
use crate::blade::shoulder::Lean;
use crate::blade::tangent::{self, Row};
use crate::math;
use crate::ode::collocation::{LEAST_NODES, Lanes, MOST_NODES, Rule, Square, inverse, rule, times};
use crate::simulate::phases::System;

/// Number of coefficients of a motion's series.
pub(super) const COEFFICIENTS: usize = crate::ode::polynomial::TERMS + 2;

/// The motion that is varied.
pub(super) type Course<'a> = tangent::Course<'a, COEFFICIENTS>;

impl Lanes for Row {
    #[inline(always)]
    fn all(x: f64) -> Self {
        Self::all(x)
    }

    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        factor * self
    }
}

/// Where a stretch lies in the motion of its piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// How the tip touches the glass, and on which side the neck leans.
    pub touch: Touch,
    pub lean: Lean,
    /// Start of the motion's series, s.
    pub start_s: f64,
    /// Start of the stretch after it, s, and its length, s.
    pub from: f64,
    pub length: f64,
    pub rule: &'static Rule,
    /// Rate of change of the fastest derivative, 1/s.
    pub rapid: f64,
}

impl Place {
    /// A piece as one stretch, without derivatives.
    pub fn whole(touch: Touch, lean: Lean, start_s: f64, length: f64) -> Self {
        Self { touch, lean, start_s, from: 0.0, length, rule: rule(LEAST_NODES), rapid: 0.0 }
    }
}

/// A stretch and what moves along it.
pub(super) struct Span<'a> {
    pub system: &'a System,
    pub course: Course<'a>,
    pub place: Place,
    pub sources: &'a [Source],
    pub head: Option<Head<'a>>,
}

impl<'a> Span<'a> {
    pub fn new(system: &'a System, sources: &'a [Source], course: Course<'a>, place: Place) -> Self {
        let velocity = &course.motion.head_velocity[..=course.motion.order];
        let head = Head::of(sources, &system.drive, place.start_s, velocity);
        Self { system, course, place, sources, head }
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        match self.place.touch {
            Touch::Stick => 1,
            Touch::Slip(_) => 2,
            Touch::Flight(..) => 3,
        }
    }

    /// Times of nodes four by four, s after the start of the motion.
    pub fn chunks(&self) -> impl Iterator<Item = Row> {
        let Place { from, length, rule, .. } = self.place;
        let chunks = rule.places.as_chunks().0;
        chunks[..rule.nodes.div_ceil(tangent::LANES)]
            .iter()
            .map(move |&places| Row::all(from) + length * Row(places))
    }
}

/// How many nodes a stretch takes.
#[derive(Debug, Clone)]
pub(super) struct Pace {
    /// Radians, or decays, of the fastest derivative that each number of nodes resolves.
    limits: [f64; MOST_NODES + 1],
    /// Rates that were found last in stick, slip and flight off the shoulder, and on it, 1/s.
    rapid: [f64; 6],
}

impl Pace {
    /// At this tolerance, relative; `fastest` is a first guess of the fastest rate, 1/s.
    ///
    /// Within a step of `z` radians `s` nodes leave of a sine `z^(s + 2) s! / (4 s^2 (2 s)!)`: the first
    /// Legendre polynomial that is missing in its second derivative, integrated twice.
    pub fn new(relative: f64, fastest: f64) -> Self {
        let mut limits = [0.0; MOST_NODES + 1];
        let mut ratio = 1.0; // (2 s)! / s!
        for (s, limit) in limits.iter_mut().enumerate().skip(1) {
            ratio *= (2 * (2 * s - 1)) as f64;
            *limit = math::powf(relative * 4.0 * (s * s) as f64 * ratio, 1.0 / (s + 2) as f64);
        }
        Self { limits, rapid: [fastest; 6] }
    }

    /// Nodes and length of the next stretch, at most `rest`.
    pub fn plan(&self, course: &Course<'_>, rest: f64) -> (&'static Rule, f64) {
        /// Parts of a step at most: numbers that are none make no end.
        const MOST_PARTS: f64 = 1e3;
        /// Share by which the rate may have risen since.
        const MARGIN: f64 = 1.1;
        let rapid = MARGIN * self.rapid[kind(course)];
        let parts = (rapid * rest / self.limits[MOST_NODES]).ceil().clamp(1.0, MOST_PARTS);
        let length = if parts > 1.0 { rest / parts } else { rest };
        let wanted = rapid * length;
        let nodes = (LEAST_NODES..MOST_NODES).find(|&s| wanted <= self.limits[s]).unwrap_or(MOST_NODES);
        (rule(nodes), length)
    }

    /// Learns the rate that was found on a stretch; whether its nodes resolve it.
    pub fn learn(&mut self, course: &Course<'_>, found: f64, rule: &Rule, length: f64) -> bool {
        let rapid = &mut self.rapid[kind(course)];
        if found.is_finite() {
            *rapid = found;
        }
        *rapid * length <= self.limits[rule.nodes]
    }
}

/// Place of a course among the rates.
fn kind(course: &Course<'_>) -> usize {
    let touch = match course.touch {
        Touch::Stick => 0,
        Touch::Slip(_) => 1,
        Touch::Flight(..) => 2,
    };
    touch + if course.lean == Lean::Off { 0 } else { 3 }
}

/// A bound of the rates of `m y'' + d y' + k y = 0`, 1/s: the root of `x^2 = x |m^-1 d| + |m^-1 k|` with the
/// sizes of the matrices' eigenvalues.
pub(super) fn rate_of<const D: usize>(mass: &Square<D>, damping: &Square<D>, stiffness: &Square<D>) -> f64 {
    let inverse = inverse(mass);
    let size = |matrix: &Square<D>| {
        let columns: [[f64; D]; D] = std::array::from_fn(|c| times(&inverse, &matrix.map(|row| row[c])));
        if D == 1 {
            return columns[0][0].abs();
        }
        // (the gap in flight is slower than the links)
        let half = 0.5 * (columns[0][0] + columns[1][1]);
        let determinant = columns[0][0] * columns[1][1] - columns[1][0] * columns[0][1];
        half.abs() + (half * half - determinant).abs().sqrt()
    };
    let (damping, stiffness) = (0.5 * size(damping), size(stiffness));
    damping + (damping * damping + stiffness).sqrt()
}
