//! Taylor coefficients of the blade's motion about an instant, by recurrence.
//!
//! With `p_i = cos(angle_i) rate_i`, `q_i = sin(angle_i) rate_i` the angles' sines and cosines follow from
//! `sin' = p`, `cos' = -q`, and the whole of equations (1) to (3) is
//!
//! ```text
//! m_theta theta'' + cos theta X1 + sin theta Y1 + moment(neck) - moment(lip) = 0
//! m_phi   phi''   + cos phi   X2 + sin phi   Y2 + moment(lip)                = 0
//! X1 = m_c p2' + m_a v'' - l1 f    Y1 = m_c q2' - m_a u'' - l1 N
//! X2 = m_c p1' + m_b v'' - l2 f    Y2 = m_c q1' - m_b u'' - l2 N
//! contact:  u' = l1 q1 + l2 q2,   N = k0 (h_d - u) - c0 u' - M u'' + m_a q1' + m_b q2'
//! slip:     f = -sigma mu(|v3'|) N          stick:  v3'' = v'' + l1 p1' + l2 p2' = 0
//! flight:   N = f = 0,   M u'' = m_a q1' + m_b q2' + k0 (h_d - u) - c0 u'
//! ```
//!
//! Each coefficient costs eight products of series; the friction of equation (4) adds two, other laws more.
//! The highest coefficients enter linearly; their matrix depends only on the angles at the instant and is
//! inverted once.

use super::friction::FrictionSeries;
use super::{LinkDirections, Linkage, Pose, ShoulderContact};

/// One value for the neck and one for the lip.
pub(super) type LinkPair = [f64; 2];

/// Contact between tip and glass during the expansion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ContactMode {
    /// The tip slides along the sweep in this direction, +1 or -1.
    Slip(f64),
    /// The tip sticks.
    Stick,
    /// The tip is off the glass. The two numbers are the drop of the head, m, and its rate, m/s.
    Flight(f64, f64),
}

impl ContactMode {
    /// Direction of slip, +1 or -1; 0 in stick and flight.
    #[inline]
    pub(super) fn slip_direction(self) -> f64 {
        match self {
            Self::Slip(direction) => direction,
            Self::Stick | Self::Flight(..) => 0.0,
        }
    }
}

/// Taylor coefficients of index `j`, the left factors of the products in the recurrence.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LeftFactors {
    pub cos: LinkPair,
    pub sin: LinkPair,
    /// Coefficient `mu_j` of the friction coefficient, and `j` times the coefficient `v3'_j` of the tip
    /// velocity.
    pub slip: LinkPair,
}

/// Taylor coefficients of index `m`, the right factors of the products in the recurrence; some have the index
/// `m + 1` instead.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct RightFactors {
    /// Angular rates of index `m + 1`.
    next_rate: LinkPair,
    pub x: LinkPair,
    pub y: LinkPair,
    /// Coefficient `N_m` of the normal force, and coefficient `m + 1` of the part of `mu` that changes
    /// with speed.
    slip: LinkPair,
}

/// Taylor coefficients of the motion; `K` is the number of coefficients, including that of `x^0`.
///
/// After `expand` to the order `n` the motion is known up to `x^n`, and forces are known up to `x^(n-1)`.
#[derive(Debug, Clone)]
pub struct MotionSeries<const K: usize> {
    /// Velocity of the head along the sweep, m/s; the caller sets it.
    pub head_velocity: [f64; K],
    /// Angles of neck and lip, rad.
    pub angle: [LinkPair; K],
    /// Angular rates, rad/s.
    pub rate: [LinkPair; K],
    /// Velocity of the tip along the sweep, m/s.
    pub tip_velocity: [f64; K],
    /// Drop of the head, m.
    pub drop_m: [f64; K],
    /// Friction force on the tip, N.
    pub friction_n: [f64; K],
    /// Velocity of the tip away from the glass in flight, m/s; the caller sets the first coefficient.
    pub gap_rate: [f64; K],
    /// Painlevé indicator of slip at the instant; 1 in stick and in flight.
    pub indicator: f64,
    /// Order of the last expansion.
    pub order: usize,
    /// Piece of the friction law in slip; the caller sets it before an expansion.
    pub law_piece: usize,
    /// Series of the friction law in slip, unless the law is that of equation (4) without further terms.
    pub(crate) law: FrictionSeries<K>,
    pub(super) drop_rate: [f64; K],
    pub(super) left: [LeftFactors; K],
    pub(super) right: [RightFactors; K],
    /// Coefficients of `p = cos(angle) * rate` of the highest order computed so far.
    pub(super) p: LinkPair,
    /// Coefficients of `q = sin(angle) * rate` of the highest order computed so far.
    pub(super) q: LinkPair,
}

impl<const K: usize> Default for MotionSeries<K> {
    fn default() -> Self {
        Self {
            head_velocity: [0.0; K],
            angle: [[0.0; 2]; K],
            rate: [[0.0; 2]; K],
            tip_velocity: [0.0; K],
            drop_m: [0.0; K],
            friction_n: [0.0; K],
            gap_rate: [0.0; K],
            indicator: 1.0,
            order: 0,
            law_piece: 0,
            law: FrictionSeries::default(),
            drop_rate: [0.0; K],
            left: [LeftFactors::default(); K],
            right: [RightFactors::default(); K],
            p: [0.0; 2],
            q: [0.0; 2],
        }
    }
}

/// No friction coefficient that changes: slip at a constant coefficient, stick, and flight.
const CONSTANT: u8 = 0;
/// Friction coefficient of equation (4), without further terms.
const EXPONENTIAL: u8 = 1;
/// Friction coefficient of any other law, from its own series.
const ANY_LAW: u8 = 2;

/// Sums of the products of coefficients of lower orders in the recurrence.
#[derive(Clone, Copy, Default)]
struct ProductSums {
    p: LinkPair,
    q: LinkPair,
    x: LinkPair,
    y: LinkPair,
    slip: LinkPair,
}

/// Constants of the recurrence, which depend only on the angles at the instant.
#[derive(Debug, Clone)]
pub(super) struct RecurrenceConstants {
    pub l: LinkPair,
    pub m: LinkPair,
    /// `m_a - M * l1` and `m_b - M * l2`, kg m: coefficients of the rates `q'` of neck and lip in the
    /// equation for the normal force, where `q = sin(angle) * rate`.
    pub arm: LinkPair,
    /// Inverse of the coefficient matrix of the angular accelerations, including friction in slip.
    pub inverse: [LinkPair; 2],
    /// Displacement of the tip per unit angle of each link, `w = (l1 cos theta, l2 cos phi)`, m; for stick.
    pub w: LinkPair,
    /// Angular accelerations per newton of friction force, `A^-1 w`; for stick.
    pub per_force: LinkPair,
    /// Friction force per unit of tip acceleration, `1 / (w.A^-1 w)`, kg; for stick.
    pub mobility: f64,
    /// Coefficients of the angular accelerations in the equation for the acceleration `u''` of the drop.
    pub drop: LinkPair,
    /// Coefficients, in the equation for the acceleration `u''` of the drop, of the part of `q'` that does
    /// not contain the angular accelerations.
    pub drop_rest: LinkPair,
    /// Coefficients of the angular accelerations in the equation for the normal force `N`.
    pub normal: LinkPair,
    /// Moments on neck and lip per newton of normal force.
    pub per_normal: LinkPair,
    /// Moments on neck and lip per newton of friction force from coefficients of lower orders.
    pub per_slip: LinkPair,
    /// Cosines of both angles at the instant, times `m_c`.
    pub cos_m_c: LinkPair,
    /// Sines of both angles at the instant, times `m_c`.
    pub sin_m_c: LinkPair,
    /// Cosines of both angles at the instant, times `m`.
    pub cos_m: LinkPair,
    /// Sines of both angles at the instant, times `m`.
    pub sin_m: LinkPair,
    /// Friction coefficient with the sign of the friction force.
    pub mu: f64,
    /// Part of the friction coefficient that does not depend on speed, without sign.
    pub staying: f64,
    /// Three numbers for the neck: its stiffness, its damping, and its moment at zero angle and rate. All
    /// include the shoulder if the neck leans on it.
    pub neck: [f64; 3],
    /// Painlevé indicator of slip; 1 in stick and in flight.
    pub indicator: f64,
}

impl<const K: usize> MotionSeries<K> {
    /// Computes the coefficients of the motion from `pose` up to `x^order`; `self.head_velocity` must contain
    /// the coefficients of the head's velocity.
    pub(crate) fn expand(
        &mut self,
        linkage: &Linkage,
        touch: ContactMode,
        lean: ShoulderContact,
        pose: &Pose,
        order: usize,
    ) {
        let order = order.min(K - 1);
        self.order = order;
        self.set_start(linkage, touch, pose);
        let instant = self.recurrence_constants(linkage, touch, lean);
        self.indicator = instant.indicator;
        (self.right[order], self.friction_n[order]) = (RightFactors::default(), 0.0);
        match touch {
            ContactMode::Slip(direction) if !linkage.friction.is_plain() => {
                (0..order).for_each(|k| self.advance_order::<ANY_LAW>(linkage, touch, &instant, k, direction))
            }
            ContactMode::Slip(direction) if linkage.friction.a != 0.0 => (0..order)
                .for_each(|k| self.advance_order::<EXPONENTIAL>(linkage, touch, &instant, k, direction)),
            _ => (0..order).for_each(|k| {
                self.advance_order::<CONSTANT>(linkage, touch, &instant, k, touch.slip_direction())
            }),
        }
    }

    /// Coefficient `k` of the cosines of both angles.
    #[inline]
    pub(crate) fn cosines(&self, k: usize) -> [f64; 2] {
        self.left[k].cos
    }

    /// Coefficient `k` of the sines of both angles.
    #[inline]
    pub(crate) fn sines(&self, k: usize) -> [f64; 2] {
        self.left[k].sin
    }

    /// Coefficient `k` of the normal force, N.
    #[inline]
    pub(crate) fn normal_n(&self, k: usize) -> f64 {
        self.right[k].slip[0]
    }

    fn set_start(&mut self, linkage: &Linkage, touch: ContactMode, pose: &Pose) {
        let d = LinkDirections::from_pose(pose);
        let (sin, cos, rate) =
            ([d.sin_theta, d.sin_phi], [d.cos_theta, d.cos_phi], [pose.theta_rate, pose.phi_rate]);
        self.angle[0] = [pose.theta, pose.phi];
        self.rate[0] = rate;
        self.p = per_link(|i| cos[i] * rate[i]);
        self.q = per_link(|i| sin[i] * rate[i]);
        self.tip_velocity[0] = self.tip_velocity_at(linkage, 0);
        (self.drop_m[0], self.drop_rate[0]) = match touch {
            ContactMode::Flight(drop, rate) => (drop, rate),
            _ => (linkage.head_drop_m(&d), linkage.l1_m * self.q[0] + linkage.l2_m * self.q[1]),
        };
        let (law, tip_velocity) = (&linkage.friction, self.tip_velocity[0]);
        let mu = match touch {
            ContactMode::Slip(direction) if law.is_plain() => {
                law.dynamic_coefficient(direction * tip_velocity, direction)
            }
            ContactMode::Slip(direction) => {
                law.direction_factor(direction)
                    * self.law.start_series(law, self.law_piece, direction * tip_velocity)
            }
            _ => 0.0,
        };
        self.left[0] = LeftFactors { cos, sin, slip: [mu, 0.0] };
    }

    #[inline(always)]
    fn tip_velocity_at(&self, linkage: &Linkage, k: usize) -> f64 {
        self.head_velocity[k] + linkage.l1_m * self.p[0] + linkage.l2_m * self.p[1]
    }

    /// Constants of the recurrence from the coefficients of order 0.
    pub(super) fn recurrence_constants(
        &self,
        linkage: &Linkage,
        touch: ContactMode,
        lean: ShoulderContact,
    ) -> RecurrenceConstants {
        let Linkage { mass_kg: mass, l1_m: l1, l2_m: l2, m_a, m_b, m_c, m_theta, m_phi, .. } = *linkage;
        let LeftFactors { cos: c, sin: s, slip: [mu, _] } = self.left[0];
        let (l, m) = ([l1, l2], [m_a, m_b]);
        let arm = [m_a - mass * l1, m_b - mass * l2];
        // in flight `u''` has an equation of its own, and there is no normal force
        let flies = matches!(touch, ContactMode::Flight(..));
        let drop_rest = if flies { m.map(|m| m / mass) } else { l };
        let drop = per_link(|i| drop_rest[i] * s[i]);
        let normal = if flies { [0.0; 2] } else { per_link(|i| arm[i] * s[i]) };
        let a11 = m_theta - s[0] * (m_a * drop[0] + l1 * normal[0]);
        let a22 = m_phi - s[1] * (m_b * drop[1] + l2 * normal[1]);
        let a12 = m_c * (c[0] * c[1] + s[0] * s[1]) - s[0] * (m_a * drop[1] + l1 * normal[1]);
        let determinant = a11 * a22 - a12 * a12;
        let w = per_link(|i| l[i] * c[i]);
        let direction = touch.slip_direction();
        let friction = normal.map(|n| -direction * mu * n);
        let matrix = [
            [a11 - w[0] * friction[0], a12 - w[0] * friction[1]],
            [a12 - w[1] * friction[0], a22 - w[1] * friction[1]],
        ];
        let with_friction = matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0];
        let share = 1.0 / with_friction;
        let inverse =
            [[share * matrix[1][1], -share * matrix[0][1]], [-share * matrix[1][0], share * matrix[0][0]]];
        let per_force = per_link(|i| inverse[i][0] * w[0] + inverse[i][1] * w[1]);
        RecurrenceConstants {
            l,
            m,
            arm,
            inverse,
            w,
            per_force,
            mobility: 1.0 / (w[0] * per_force[0] + w[1] * per_force[1]),
            drop,
            drop_rest,
            normal,
            per_normal: per_link(|i| if flies { 0.0 } else { direction * mu * w[i] - l[i] * s[i] }),
            per_slip: per_link(|i| direction * w[i]),
            cos_m_c: c.map(|c| c * m_c),
            sin_m_c: s.map(|s| s * m_c),
            cos_m: per_link(|i| c[i] * m[i]),
            sin_m: per_link(|i| s[i] * m[i]),
            mu: -direction * mu,
            staying: linkage.friction.direction_factor(direction) * linkage.friction.c,
            neck: linkage.neck_spring(lean),
            indicator: with_friction / determinant,
        }
    }

    /// Computes the coefficients of angles and rates at `x^(k + 1)` from those up to `x^k`. `LAW` says how
    /// the friction coefficient changes: [`CONSTANT`], [`EXPONENTIAL`] or [`ANY_LAW`].
    #[inline(always)]
    fn advance_order<const LAW: u8>(
        &mut self,
        linkage: &Linkage,
        touch: ContactMode,
        at: &RecurrenceConstants,
        k: usize,
        direction: f64,
    ) {
        let next = (k + 1) as f64;
        let share = 1.0 / next;
        let LeftFactors { cos: c, sin: s, slip: [mu, _] } = self.left[0];
        self.angle[k + 1] = per_link(|i| self.rate[k][i] * share);
        let (cos, sin) = (per_link(|i| -self.q[i] * share), per_link(|i| self.p[i] * share));
        let sums = self.sum_products::<LAW>(k);
        // p and q of the next order without the contribution of the unknown accelerations
        let rest_p = per_link(|i| sums.p[i] + cos[i] * self.rate[0][i]);
        let rest_q = per_link(|i| sums.q[i] + sin[i] * self.rate[0][i]);
        let (tp, tq) = (per_link(|i| next * rest_p[i]), per_link(|i| next * rest_q[i]));
        let head_acceleration = next * self.head_velocity[k + 1];

        let support = self.support_force(linkage, k);
        let rest_drop = at.drop_rest[0] * tq[0]
            + at.drop_rest[1] * tq[1]
            + if let ContactMode::Flight(..) = touch { support / linkage.mass_kg } else { 0.0 };
        let rest_normal = if let ContactMode::Flight(..) = touch {
            0.0
        } else {
            support + at.arm[0] * tq[0] + at.arm[1] * tq[1]
        };
        let springs = self.spring_moments(linkage, at, k);
        let known = per_link(|i| {
            let varying = if LAW == CONSTANT { 0.0 } else { at.per_slip[i] * sums.slip[0] };
            sums.x[i] + sums.y[i] + springs[i] + varying
        });
        let b = per_link(|i| {
            let other = 1 - i;
            let inertial =
                at.cos_m_c[i] * tp[other] + at.sin_m_c[i] * tq[other] + at.cos_m[i] * head_acceleration
                    - at.sin_m[i] * rest_drop;
            inertial + at.per_normal[i] * rest_normal + known[i]
        });
        let mut a = per_link(|i| -(at.inverse[i][0] * b[0] + at.inverse[i][1] * b[1]));
        let mut held = 0.0;
        if touch == ContactMode::Stick {
            let tip = head_acceleration + at.l[0] * tp[0] + at.l[1] * tp[1] + at.w[0] * a[0] + at.w[1] * a[1];
            held = -tip * at.mobility;
            a = per_link(|i| a[i] + held * at.per_force[i]);
        }
        let drop = rest_drop + at.drop[0] * a[0] + at.drop[1] * a[1];
        let normal = rest_normal + at.normal[0] * a[0] + at.normal[1] * a[1];
        let force = at.mu * normal + held - if LAW == CONSTANT { 0.0 } else { direction * sums.slip[0] };

        let rate = per_link(|i| a[i] * share);
        (self.p, self.q) =
            (per_link(|i| rest_p[i] + c[i] * rate[i]), per_link(|i| rest_q[i] + s[i] * rate[i]));
        let coupling = linkage.m_c * next;
        let x = per_link(|i| coupling * self.p[1 - i] + at.m[i] * head_acceleration - at.l[i] * force);
        let y = per_link(|i| coupling * self.q[1 - i] - at.m[i] * drop - at.l[i] * normal);
        self.rate[k + 1] = rate;
        self.friction_n[k] = force;
        self.drop_rate[k + 1] = drop * share;
        if let ContactMode::Flight(..) = touch {
            self.gap_rate[k + 1] = at.l[0] * self.q[0] + at.l[1] * self.q[1] - drop * share;
        }
        self.drop_m[k + 1] = self.drop_rate[k] * share;
        let tip = self.tip_velocity_at(linkage, k + 1);
        self.tip_velocity[k + 1] = tip;
        let mut falling = 0.0;
        if LAW == EXPONENTIAL {
            // the part E of mu = E + r c, r the factor of the direction, satisfies E' = -b sigma v3'' E
            let sum = sums.slip[1] + next * tip * (mu - at.staying);
            falling = -linkage.friction.b_s_per_m * direction * sum * share;
        } else if LAW == ANY_LAW {
            let law = &linkage.friction;
            falling = law.direction_factor(direction) * self.law.advance_series(law, k + 1, direction * tip);
        }
        self.left[k + 1] = LeftFactors { cos, sin, slip: [falling, next * tip] };
        self.right[k] = RightFactors { next_rate: rate, x, y, slip: [normal, falling] };
    }

    /// Sums the products of the known coefficients in the recurrence. The newest factors are added last,
    /// because the processor may still be computing them when the sum starts.
    #[inline(always)]
    fn sum_products<const LAW: u8>(&self, k: usize) -> ProductSums {
        let mut sums = ProductSums::default();
        for (left, right) in self.left[1..=k].iter().rev().zip(&self.right[..k]) {
            for i in 0..2 {
                sums.p[i] += left.cos[i] * right.next_rate[i];
                sums.q[i] += left.sin[i] * right.next_rate[i];
                sums.x[i] += left.cos[i] * right.x[i];
                sums.y[i] += left.sin[i] * right.y[i];
                if LAW != CONSTANT {
                    sums.slip[i] += left.slip[i] * right.slip[i];
                }
            }
        }
        sums
    }

    /// Coefficient `k` of the moments of springs and dampers on both links, N m.
    #[inline(always)]
    fn spring_moments(&self, linkage: &Linkage, at: &RecurrenceConstants, k: usize) -> LinkPair {
        let ([theta, phi], [theta_rate, phi_rate]) = (self.angle[k], self.rate[k]);
        let lip = linkage.lip.stiffness * (phi - theta) + linkage.lip.damping * (phi_rate - theta_rate);
        let neck = at.neck[0] * theta + at.neck[1] * theta_rate + if k == 0 { at.neck[2] } else { 0.0 };
        [neck - lip, lip]
    }

    /// Coefficient `k` of the force of the support on the head, N.
    #[inline(always)]
    fn support_force(&self, linkage: &Linkage, k: usize) -> f64 {
        let preload = if k == 0 { linkage.preload_displacement_m } else { 0.0 };
        linkage.head.stiffness * (preload - self.drop_m[k]) - linkage.head.damping * self.drop_rate[k]
    }
}

/// Applies `f` to the index of each link, 0 for the neck and 1 for the lip.
#[inline(always)]
pub(super) fn per_link(f: impl Fn(usize) -> f64) -> LinkPair {
    [f(0), f(1)]
}
