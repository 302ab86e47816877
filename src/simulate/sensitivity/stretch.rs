//! Stretches, and the choice of their length. A stretch is a part of a piece of the solution over which
//! derivatives are computed by collocation.

use super::source::{HeadPolynomial, TangentSource};
use crate::model::series::ContactMode;
use crate::model::shoulder::ShoulderContact;
use crate::model::tangent::{self, LaneVector};
use crate::simulate::phases::DrivenBlade;
use hybrid_ode::collocation::{
    CollocationRule, LEAST_NODES, LaneNumber, MOST_NODES, SquareMatrix, collocation_rule, invert_square,
    multiply_row,
};
use portable_math as math;

/// Number of coefficients of the series of a motion.
pub(super) const SERIES_TERMS: usize = hybrid_ode::polynomial::TERMS + 2;

/// The motion whose derivatives are computed, with its Taylor series.
pub(super) type SeriesReference<'a> = tangent::ReferenceMotion<'a, SERIES_TERMS>;

impl LaneNumber for LaneVector {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self::splat(x)
    }

    #[inline(always)]
    fn scale_by(self, factor: f64) -> Self {
        factor * self
    }
}

/// Position of a stretch in the run, and its collocation rule.
#[derive(Debug, Clone, Copy)]
pub(super) struct StretchPlace {
    /// Mode of contact and side of the shoulder.
    pub touch: ContactMode,
    pub lean: ShoulderContact,
    /// Start of the series of the piece, s.
    pub start_s: f64,
    /// Start of the stretch, s, relative to the start of the series.
    pub from: f64,
    /// Length of the stretch, s.
    pub length: f64,
    pub rule: &'static CollocationRule,
    /// Rate of change of the fastest derivative, 1/s.
    pub rapid: f64,
}

impl StretchPlace {
    /// A stretch over a whole piece, for a piece without derivatives.
    pub(crate) fn whole_piece(touch: ContactMode, lean: ShoulderContact, start_s: f64, length: f64) -> Self {
        Self { touch, lean, start_s, from: 0.0, length, rule: collocation_rule(LEAST_NODES), rapid: 0.0 }
    }
}

/// A stretch with its motion and the sources of derivatives.
pub(super) struct TangentStretch<'a> {
    pub system: &'a DrivenBlade,
    pub course: SeriesReference<'a>,
    pub place: StretchPlace,
    pub sources: &'a [TangentSource],
    pub head: Option<HeadPolynomial<'a>>,
}

impl<'a> TangentStretch<'a> {
    pub(crate) fn new(
        system: &'a DrivenBlade,
        sources: &'a [TangentSource],
        course: SeriesReference<'a>,
        place: StretchPlace,
    ) -> Self {
        let velocity = &course.motion.head_velocity[..=course.motion.order];
        let head = HeadPolynomial::from_drive(sources, &system.drive, place.start_s, velocity);
        Self { system, course, place, sources, head }
    }

    pub(crate) fn unknown_count(&self) -> usize {
        match self.place.touch {
            ContactMode::Stick => 1,
            ContactMode::Slip(_) => 2,
            ContactMode::Flight(..) => 3,
        }
    }

    /// Times of the nodes in groups of four, s after the start of the series.
    pub(crate) fn node_chunks(&self) -> impl Iterator<Item = LaneVector> {
        let StretchPlace { from, length, rule, .. } = self.place;
        let chunks = rule.positions.as_chunks().0;
        chunks[..rule.nodes.div_ceil(tangent::LANES)]
            .iter()
            .map(move |&places| LaneVector::splat(from) + length * LaneVector(places))
    }
}

/// Plans the length and the number of nodes of stretches.
#[derive(Debug, Clone)]
pub(super) struct StretchPlanner {
    /// For each number of nodes: the largest phase or decay of the fastest derivative over a stretch, rad,
    /// that these nodes resolve.
    limits: [f64; MOST_NODES + 1],
    /// Latest rates in stick, slip and flight, 1/s; first for a neck off the shoulder, then for a neck on it.
    rapid: [f64; 6],
}

impl StretchPlanner {
    /// A planner for this relative tolerance; `fastest` is a first guess of the largest rate, 1/s.
    ///
    /// For a sine over `z` radians, `s` nodes have the error `z^(s + 2) s! / (4 s^2 (2 s)!)`: this is the
    /// contribution of the first Legendre polynomial that the approximation of the second derivative lacks,
    /// integrated twice.
    pub(crate) fn new(relative: f64, fastest: f64) -> Self {
        let mut limits = [0.0; MOST_NODES + 1];
        let mut ratio = 1.0; // (2 s)! / s!
        for (s, limit) in limits.iter_mut().enumerate().skip(1) {
            ratio *= (2 * (2 * s - 1)) as f64;
            *limit = math::powf(relative * 4.0 * (s * s) as f64 * ratio, 1.0 / (s + 2) as f64);
        }
        Self { limits, rapid: [fastest; 6] }
    }

    /// Collocation rule and length, s, of the next stretch, which is at most `rest` long.
    pub(crate) fn plan(&self, course: &SeriesReference<'_>, rest: f64) -> (&'static CollocationRule, f64) {
        /// Maximum number of stretches of a step, even if the rate is not finite.
        const MOST_PARTS: f64 = 1e3;
        /// Factor on the latest rate, because the rate may have risen since then.
        const MARGIN: f64 = 1.1;
        let rapid = MARGIN * self.rapid[rate_index(course)];
        let parts = (rapid * rest / self.limits[MOST_NODES]).ceil().clamp(1.0, MOST_PARTS);
        let length = if parts > 1.0 { rest / parts } else { rest };
        let wanted = rapid * length;
        let nodes = (LEAST_NODES..MOST_NODES).find(|&s| wanted <= self.limits[s]).unwrap_or(MOST_NODES);
        (collocation_rule(nodes), length)
    }

    /// Records the rate of a stretch; returns whether the nodes of the stretch resolve this rate.
    pub(crate) fn record_rate(
        &mut self,
        course: &SeriesReference<'_>,
        found: f64,
        rule: &CollocationRule,
        length: f64,
    ) -> bool {
        let rapid = &mut self.rapid[rate_index(course)];
        if found.is_finite() {
            *rapid = found;
        }
        *rapid * length <= self.limits[rule.nodes]
    }
}

/// Index of a motion in [`StretchPlanner::rapid`].
fn rate_index(course: &SeriesReference<'_>) -> usize {
    let touch = match course.touch {
        ContactMode::Stick => 0,
        ContactMode::Slip(_) => 1,
        ContactMode::Flight(..) => 2,
    };
    touch + if course.lean == ShoulderContact::Off { 0 } else { 3 }
}

/// Upper limit of the rates of `m y'' + d y' + k y = 0`, 1/s: the root of `x^2 = x |m^-1 d| + |m^-1 k|`,
/// where the norm of a matrix is its largest eigenvalue in size.
pub(super) fn bound_rate<const D: usize>(
    mass: &SquareMatrix<D>,
    damping: &SquareMatrix<D>,
    stiffness: &SquareMatrix<D>,
) -> f64 {
    let inverse = invert_square(mass);
    let size = |matrix: &SquareMatrix<D>| {
        let columns: [[f64; D]; D] =
            std::array::from_fn(|c| multiply_row(&inverse, &matrix.map(|row| row[c])));
        if D == 1 {
            return columns[0][0].abs();
        }
        // the gap in flight is left out, because it is slower than the links
        let half = 0.5 * (columns[0][0] + columns[1][1]);
        let determinant = columns[0][0] * columns[1][1] - columns[1][0] * columns[0][1];
        half.abs() + (half * half - determinant).abs().sqrt()
    };
    let (damping, stiffness) = (0.5 * size(damping), size(stiffness));
    damping + (damping * damping + stiffness).sqrt()
}
