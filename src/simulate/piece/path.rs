//! Where the blade is over a piece of the solution, and the integral of it.
//!
//! The Taylor coefficients of a step hold the velocities of head and tip and the drop, so that places are
//! polynomials of the time since the start and their integrals over an open shutter are exact:
//!
//! ```text
//! v3(x) = v3(0) + sum v3'_(j-1) x^j / j        int v3 = v3(0) x + sum v3'_(j-1) x^(j+1) / (j (j+1))
//! ```
//!
//! Other methods of integration keep no such coefficients: there a place follows from the angles, and an
//! integral from five of them.

use super::{BladePoints, SegmentSolution, SolutionSegment};
use crate::math::gauss;
use crate::ode::polynomial::TERMS;
use crate::simulate::phases::{DrivenBlade, TaylorMotion};

/// `1 / j`, and 0 for `j = 0`.
const RECIPROCALS: [f64; TERMS + 4] = {
    let mut share = [0.0; TERMS + 4];
    let mut j = 1;
    while j < share.len() {
        share[j] = 1.0 / j as f64;
        j += 1;
    }
    share
};

/// Where the blade is over a piece; made once for all that is asked of the piece.
pub struct SegmentPath<'a> {
    piece: &'a SolutionSegment<'a>,
    polynomials: Option<PathPolynomials<'a>>,
}

/// Places as polynomials of the time since the start of a piece.
struct PathPolynomials<'a> {
    motion: &'a TaylorMotion,
    start: [f64; 4],
    /// Whether the tip is held.
    sticks: bool,
}

impl<'a> SegmentPath<'a> {
    pub(super) fn new(piece: &'a SolutionSegment<'a>) -> Self {
        Self {
            piece,
            polynomials: piece.motion.and_then(|motion| PathPolynomials::from_segment(piece, motion)),
        }
    }

    /// Where the blade is at a time within the piece.
    #[inline]
    #[must_use]
    pub fn points_at(&self, t: f64) -> BladePoints {
        self.polynomials.as_ref().map_or_else(
            || self.piece.points_at(t),
            |polynomials| BladePoints::from_array(polynomials.values_after(t - self.piece.start_s)),
        )
    }

    /// Integral of the place from one time within the piece to another, m s.
    #[inline]
    #[must_use]
    pub fn integrate_points(&self, from_s: f64, to_s: f64) -> BladePoints {
        let start_s = self.piece.start_s;
        BladePoints::from_array(match &self.polynomials {
            Some(polynomials) => polynomials.integrate_values(from_s - start_s, to_s - start_s),
            None => gauss::nodes_and_weights(from_s, to_s).fold([0.0; 4], |sum, (t, weight)| {
                let values = self.piece.points_at(t).to_array();
                four_values(|i| sum[i] + weight * values[i])
            }),
        })
    }
}

impl<'a> PathPolynomials<'a> {
    /// `None` where the piece was not computed by Taylor series.
    fn from_segment(piece: &SolutionSegment<'a>, motion: &'a TaylorMotion) -> Option<Self> {
        let (system, height, held): (&DrivenBlade, f64, Option<f64>) = match &piece.solution {
            SegmentSolution::Slip(slip, _) => (slip.system, 0.0, None),
            SegmentSolution::Stick(stick, _) => (stick.system, 0.0, Some(stick.place_m)),
            SegmentSolution::Flight(flight, step) => {
                (flight.system, step.solution.state_at(piece.start_s)[2], None)
            }
            SegmentSolution::Held(..) => return None,
        };
        let head = system.drive.motion_at(piece.start_s).position_m;
        let ([neck, lip], linkage) = (motion.sines(0), &system.linkage);
        let tip = held.unwrap_or(head + linkage.l1_m * neck + linkage.l2_m * lip);
        Some(Self { motion, start: [head, motion.drop_m[0], tip, height], sticks: held.is_some() })
    }

    /// Coefficients of `x^j`, `j > 0`.
    #[inline(always)]
    fn coefficients_of(&self, j: usize) -> [f64; 4] {
        let TaylorMotion { head_velocity, drop_m, tip_velocity, gap_rate, .. } = self.motion;
        let share = RECIPROCALS[j];
        [share * head_velocity[j - 1], drop_m[j], share * tip_velocity[j - 1], share * gap_rate[j - 1]]
    }

    #[inline]
    fn values_after(&self, x: f64) -> [f64; 4] {
        let mut sum = [0.0; 4];
        for j in (1..=self.motion.order).rev() {
            let row = self.coefficients_of(j);
            sum = four_values(|i| sum[i] * x + row[i]);
        }
        self.add_start(1.0, four_values(|i| sum[i] * x))
    }

    #[inline]
    fn integrate_values(&self, from: f64, to: f64) -> [f64; 4] {
        let (mut low, mut high) = ([0.0; 4], [0.0; 4]);
        for j in (1..=self.motion.order).rev() {
            let (row, share) = (self.coefficients_of(j), RECIPROCALS[j + 1]);
            low = four_values(|i| low[i] * from + share * row[i]);
            high = four_values(|i| high[i] * to + share * row[i]);
        }
        self.add_start(to - from, four_values(|i| high[i] * to * to - low[i] * from * from))
    }

    /// The start's places times a weight, and what has changed since; a tip that is held does not move.
    #[inline]
    fn add_start(&self, weight: f64, mut change: [f64; 4]) -> [f64; 4] {
        const TIP: usize = 2;
        if self.sticks {
            change[TIP] = 0.0;
        }
        four_values(|i| self.start[i] * weight + change[i])
    }
}

#[inline(always)]
fn four_values(f: impl Fn(usize) -> f64) -> [f64; 4] {
    [f(0), f(1), f(2), f(3)]
}
