//! The first variation of the motion: linear equations for the derivatives of the blade's angles with respect
//! to parameters (directions), along a motion with known Taylor series.
//!
//! The unknowns are the derivatives `y_i = cos(angle_i) d angle_i` of the sines of both angles, so that the
//! derivative of the tip's position is `l1 y1 + l2 y2` at all angles. Let `t` be the tangent of an angle and
//! `S_i = t_i y_i` the derivative of minus its cosine. In the notation of [`series`](super::series), the
//! equation of each link, divided by the cosine of its angle, becomes
//!
//! ```text
//! (I_i d angle_i'' + d moment_i + Z_i d angle_i) / cos_i + dX_i + t_i dY_i + (d I_i angle_i'') / cos_i = 0
//! dX_1 = m_c y2'' + m_a d v'' - l1 df + (d m_c p2' + d m_a v'' - d l1 f)       Z_i = cos_i Y_i - sin_i X_i
//! dY_1 = m_c S2'' - m_a du'' - l1 dN + (d m_c q2' - d m_a u'' - d l1 N)        likewise for the lip
//! slip:   df = -sigma mu dN + b N E d v3' - sigma N (d a F + d c) + d b v3' N E
//! stick:  l1 y1 + l2 y2 + d v + d l1 sin theta + d l2 sin phi is constant, which determines df
//! flight: dN = df = 0, and the gap between tip and glass is a third unknown
//! ```
//!
//! `a F` is the part of the friction coefficient that changes with speed, and `E` is minus its derivative by
//! `b |v3'|`. For an exponential, `E = a F`. Viscous friction, the exponent and the ratio of the directions
//! add further terms to `df` in slip.
//!
//! The coefficients of the unknowns, and the terms from a change of one constant, are the same for all
//! directions.

mod forcing;
mod lane_vector;
mod linear_forms;
mod linkage_tangent;
mod motion_samples;

use super::Linkage;
use super::series::{ContactMode, MotionSeries};
use super::shoulder::ShoulderContact;
pub(crate) use forcing::{ForcingTerms, HeadMotionChange};
pub(crate) use lane_vector::{LANES, LaneVector};
pub use linear_forms::{LinearForm, ModelChannel};
pub use linkage_tangent::{LinkageConstant, LinkageTangent, SpringTangent};
pub(crate) use motion_samples::{LinkAttitudes, MotionSamples, fill_lanes};

/// Derivatives of the state at the start of a step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StateTangent {
    /// Derivatives of the angles of neck and lip, rad per unit of the direction.
    pub angle: [LaneVector; 2],
    /// Derivatives of the angular rates, rad/s per unit of the direction.
    pub rate: [LaneVector; 2],
    /// Derivative of the gap between tip and glass, m per unit of the direction; zero in contact.
    pub gap_m: LaneVector,
    /// Derivative of the rate of the gap, m/s per unit of the direction.
    pub gap_rate: LaneVector,
}

/// One vector for the neck and one for the lip.
pub(super) type LaneVectorPair = [LaneVector; 2];

/// The motion about which the variation is computed; `K` is the number of Taylor coefficients of its series.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReferenceMotion<'a, const K: usize> {
    pub linkage: &'a Linkage,
    /// Contact between the tip and the glass.
    pub touch: ContactMode,
    /// Side of the shoulder on which the neck leans.
    pub lean: ShoulderContact,
    pub motion: &'a MotionSeries<K>,
}

impl<const K: usize> ReferenceMotion<'_, K> {
    pub(super) fn is_in_flight(&self) -> bool {
        matches!(self.touch, ContactMode::Flight(..))
    }

    pub(super) fn lengths(&self) -> [f64; 2] {
        [self.linkage.l1_m, self.linkage.l2_m]
    }

    pub(super) fn moments(&self) -> [f64; 2] {
        [self.linkage.m_a, self.linkage.m_b]
    }

    /// `m_a - M * l1` and `m_b - M * l2`, kg m: coefficients of the rates `q'` of neck and lip in the
    /// equation for the normal force, where `q = sin(angle) * rate`.
    pub(super) fn arms(&self) -> [f64; 2] {
        let (l, m) = (self.lengths(), self.moments());
        [m[0] - self.linkage.mass_kg * l[0], m[1] - self.linkage.mass_kg * l[1]]
    }
}

/// Applies `f` to the index of each link, 0 for the neck and 1 for the lip.
#[inline(always)]
pub(super) fn lanes_per_link(f: impl Fn(usize) -> LaneVector) -> LaneVectorPair {
    [f(0), f(1)]
}

/// Sum over both links of the weight times the vector of the link.
#[inline(always)]
pub(super) fn sum_over_links(weights: [f64; 2], rows: &LaneVectorPair) -> LaneVector {
    weights[0] * rows[0] + weights[1] * rows[1]
}

/// Mass, damping and stiffness matrices of the variation at a few instants, with a row per equation and a
/// column per unknown. The third row (the head) and the third column (the gap) matter only in flight.
#[derive(Debug, Clone)]
pub(crate) struct TangentMatrices {
    pub mass: [[LaneVector; 3]; 3],
    pub damping: [[LaneVector; 3]; 3],
    pub stiffness: [[LaneVector; 3]; 3],
}

/// Equation in stick for `y1`, the derivative of the sine of the neck's angle, after the friction force is
/// eliminated. The derivative of the sine of the lip's angle, `y2`, follows from `y1`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StickEquation {
    /// Coefficients of `y1''`, `y1'` and `y1` after `y2` is eliminated.
    pub first: [LaneVector; 3],
    /// Coefficients of `y2''`, `y2'` and `y2` before the elimination.
    pub second: [LaneVector; 3],
}

impl<const K: usize> ReferenceMotion<'_, K> {
    /// Coefficient of the normal force in each link's equation; zero in flight.
    #[inline(always)]
    pub(super) fn normal_force_arms(&self, at: &MotionSamples) -> [LaneVector; 2] {
        let l = self.lengths();
        if self.is_in_flight() {
            [LaneVector::ZERO; 2]
        } else {
            lanes_per_link(|i| l[i] * (at.mu - at.tangent[0][i]))
        }
    }

    /// Derivative of the friction force with respect to the tip's velocity, N s/m.
    #[inline(always)]
    pub(super) fn friction_per_speed(&self, at: &MotionSamples) -> LaneVector {
        let law = &self.linkage.friction;
        let falling = law.b_s_per_m * at.falling;
        match self.touch {
            ContactMode::Slip(direction) if law.viscous_s_per_m != 0.0 => {
                falling - (law.direction_factor(direction) * law.viscous_s_per_m) * at.normal
            }
            _ => falling,
        }
    }

    /// Matrices of the variation at the sampled instants; in stick, they do not include the friction force.
    pub(crate) fn tangent_matrices(&self, at: &MotionSamples) -> TangentMatrices {
        let linkage = self.linkage;
        let (l, m, arms, m_c) = (self.lengths(), self.moments(), self.arms(), linkage.m_c);
        let inertias = [linkage.m_theta, linkage.m_phi];
        let [secant, secant_1, secant_2] = &at.secant;
        let n = self.normal_force_arms(at);
        let zero = [[LaneVector::ZERO; 3]; 3];
        let mut out = TangentMatrices { mass: zero, damping: zero, stiffness: zero };
        for i in 0..2 {
            let o = 1 - i;
            let x = m_c * at.along[o] + m[i] * at.head_acceleration - l[i] * at.friction;
            let y = m_c * at.across[o] - m[i] * at.drop_acceleration - l[i] * at.normal;
            let turned = at.cos[i] * y - at.sin[i] * x;
            let carried = inertias[i] * secant[i];
            out.mass[i][i] = carried * secant[i];
            out.mass[i][o] = LaneVector::splat(m_c);
            out.damping[i][i] = 2.0 * carried * secant_1[i];
            out.stiffness[i][i] = carried * secant_2[i] + turned * secant[i] * secant[i];
            for j in 0..2 {
                let coupled = if i == j { -m[i] * l[j] } else { m_c - m[i] * l[j] };
                let pushed = coupled * at.tangent[0][i] + arms[j] * n[i];
                self.add_support(&mut out, at, (i, j), (pushed, l[j] * n[i]));
            }
        }
        self.add_springs(&mut out, secant, secant_1);
        match self.touch {
            ContactMode::Slip(_) => {
                let per_speed = self.friction_per_speed(at);
                for i in 0..2 {
                    for j in 0..2 {
                        out.damping[i][j] -= (l[i] * l[j]) * per_speed;
                    }
                }
            }
            ContactMode::Stick => {}
            ContactMode::Flight(..) => self.add_gap(&mut out, at),
        }
        out
    }

    /// Adds the terms of `S_j = t_j y_j`, the derivative of minus the cosine of angle `j`, to equation `i`:
    /// `pushed` times the second derivative of `S_j`, and `held` times the change of the support's force,
    /// which depends on `S_j` and its first derivative.
    #[inline(always)]
    fn add_support(
        &self,
        out: &mut TangentMatrices,
        at: &MotionSamples,
        (i, j): (usize, usize),
        (pushed, held): (LaneVector, LaneVector),
    ) {
        let head = self.linkage.head;
        let [t, t_1, t_2] = [at.tangent[0][j], at.tangent[1][j], at.tangent[2][j]];
        let (by_rate, by_value) = (-head.damping * held, -head.stiffness * held);
        out.mass[i][j] += pushed * t;
        out.damping[i][j] += 2.0 * pushed * t_1 + by_rate * t;
        out.stiffness[i][j] += pushed * t_2 + by_rate * t_1 + by_value * t;
    }

    /// Adds the terms of the springs and dampers of both links, which act on the derivatives of the angles,
    /// `y / cos`.
    #[inline(always)]
    fn add_springs(&self, out: &mut TangentMatrices, secant: &[LaneVector; 2], secant_1: &[LaneVector; 2]) {
        let lip = self.linkage.lip;
        let [stiffness, damping, _] = self.linkage.neck_spring(self.lean);
        let square = |neck: f64, lip: f64| [[neck + lip, -lip], [-lip, lip]];
        let (k, c) = (square(stiffness, lip.stiffness), square(damping, lip.damping));
        for i in 0..2 {
            for j in 0..2 {
                out.damping[i][j] += c[i][j] * (secant[i] * secant[j]);
                out.stiffness[i][j] += secant[i] * (k[i][j] * secant[j] + c[i][j] * secant_1[j]);
            }
        }
    }

    /// Adds the terms of flight: the third column belongs to the gap between tip and glass, and the third row
    /// is the equation of the head's drop.
    #[inline(always)]
    fn add_gap(&self, out: &mut TangentMatrices, at: &MotionSamples) {
        const GAP: usize = 2;
        let (m, l, arms, linkage) = (self.moments(), self.lengths(), self.arms(), self.linkage);
        let head = linkage.head;
        for i in 0..2 {
            out.mass[i][GAP] = m[i] * at.tangent[0][i];
            let [t, t_1, t_2] = [at.tangent[0][i], at.tangent[1][i], at.tangent[2][i]];
            out.mass[GAP][i] = -arms[i] * t;
            out.damping[GAP][i] = -2.0 * arms[i] * t_1 + head.damping * l[i] * t;
            out.stiffness[GAP][i] = -arms[i] * t_2 + head.damping * l[i] * t_1 + head.stiffness * l[i] * t;
        }
        out.mass[GAP][GAP] = LaneVector::splat(-linkage.mass_kg);
        out.damping[GAP][GAP] = LaneVector::splat(-head.damping);
        out.stiffness[GAP][GAP] = LaneVector::splat(-head.stiffness);
    }

    /// Combines the equations of both links into the equation for `y1` in stick.
    pub(crate) fn stick_equation(&self, matrices: &TangentMatrices) -> StickEquation {
        let l = self.lengths();
        let ratio = l[0] / l[1];
        let column = |m: &[[LaneVector; 3]; 3], j: usize| l[1] * m[0][j] - l[0] * m[1][j];
        let all = [&matrices.mass, &matrices.damping, &matrices.stiffness];
        let second = all.map(|m| column(m, 1));
        let first = [0, 1, 2].map(|k| column(all[k], 0) - ratio * second[k]);
        StickEquation { first, second }
    }
}
