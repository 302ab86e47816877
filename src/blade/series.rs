//! Taylor coefficients of the blade's motion about an instant, by recurrence.
//!
//! With `p_i = cos(angle_i) rate_i`, `q_i = sin(angle_i) rate_i` the angles' sines and cosines follow from `sin' = p`, `cos' = -q`, and the
//! whole of equations (1) to (3) is
//!
//! ```text
//! m_theta theta'' + cos theta X1 + sin theta Y1 + moment(neck) - moment(lip) = 0      X1 = m_c p2' + m_a v'' - l1 f    Y1 = m_c q2' - m_a u'' - l1 N
//! m_phi   phi''   + cos phi   X2 + sin phi   Y2 + moment(lip)                = 0      X2 = m_c p1' + m_b v'' - l2 f    Y2 = m_c q1' - m_b u'' - l2 N
//! contact:  u' = l1 q1 + l2 q2,   N = k0 (h_d - u) - c0 u' - M u'' + m_a q1' + m_b q2'
//! slip:     f = -sigma mu(|v3'|) N          stick:  v3'' = v'' + l1 p1' + l2 p2' = 0
//! flight:   N = f = 0,   M u'' = m_a q1' + m_b q2' + k0 (h_d - u) - c0 u'
//! ```
//!
//! so that eight products of series, and two more for friction, are all that a coefficient costs. The highest coefficients enter linearly
//! with the matrix of the instant itself, which is inverted once.

use super::{Directions, Lean, Linkage, Pose};

/// A quantity of neck and lip.
type Pair = [f64; 2];

/// How the tip touches the glass while the motion is expanded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Touch {
    /// It slides in this direction, +1 or -1.
    Slip(f64),
    /// It is held at its place.
    Stick,
    /// It is off the glass: drop of the head, m, and its rate, m/s.
    Flight(f64, f64),
}

/// Taylor coefficients of everything that the recurrence needs; `K` is the number of coefficients, that of `x^0` included.
///
/// After [`Self::expand`] to the order `n` angles, rates, sines, cosines, `drop_m` and `tip_velocity` hold the coefficients up to `x^n`,
/// forces those up to `x^(n-1)`.
#[derive(Debug, Clone)]
#[allow(missing_docs)] // letters as in the module's equations, SI units
pub struct MotionSeries<const K: usize> {
    pub angle: [Pair; K],
    pub rate: [Pair; K],
    pub sin: [Pair; K],
    pub cos: [Pair; K],
    /// Velocity of the head along the sweep, given.
    pub head_velocity: [f64; K],
    pub tip_velocity: [f64; K],
    pub drop_m: [f64; K],
    pub drop_rate: [f64; K],
    pub normal_n: [f64; K],
    pub friction_n: [f64; K],
    /// Painlevé indicator of slip at the instant; 1 in stick and in flight.
    pub indicator: f64,
    p: [Pair; K],
    q: [Pair; K],
    x: [Pair; K],
    y: [Pair; K],
    mu: [f64; K],
}

impl<const K: usize> Default for MotionSeries<K> {
    fn default() -> Self {
        let (pairs, plain) = ([[0.0; 2]; K], [0.0; K]);
        Self {
            angle: pairs,
            rate: pairs,
            sin: pairs,
            cos: pairs,
            head_velocity: plain,
            tip_velocity: plain,
            drop_m: plain,
            drop_rate: plain,
            normal_n: plain,
            friction_n: plain,
            indicator: 1.0,
            p: pairs,
            q: pairs,
            x: pairs,
            y: pairs,
            mu: plain,
        }
    }
}

/// `constant + linear . a`, `a` the pair of angular accelerations that a coefficient is solved for.
#[derive(Clone, Copy, Default)]
struct Affine {
    constant: f64,
    linear: Pair,
}

impl Affine {
    #[inline(always)]
    fn at(&self, a: Pair) -> f64 {
        self.constant + self.linear[0] * a[0] + self.linear[1] * a[1]
    }
}

/// The part of the recurrence that does not change with the order: inertia at the instant, inverted.
struct Instant {
    l: Pair,
    /// `m_a`, `m_b`.
    m: Pair,
    /// `m_a - M l1`, `m_b - M l2`: what the normal force takes of `q'`.
    arm: Pair,
    inverse: [Pair; 2],
    /// `A^-1 w` and `kappa = w.A^-1 w`, for stick.
    per_force: Pair,
    kappa: f64,
    /// How `u''`, `N` and `f` depend on the accelerations.
    drop: Pair,
    normal: Pair,
    friction: Pair,
    /// Stiffness of the neck, the shoulder's included where it leans, its damping, and the moment at zero angle.
    neck: [f64; 3],
}

impl<const K: usize> MotionSeries<K> {
    /// Coefficients up to `x^order` of the motion from `pose`; `self.head_velocity` holds those of the head.
    pub fn expand(&mut self, linkage: &Linkage, touch: Touch, lean: Lean, pose: &Pose, order: usize) {
        let order = order.min(K - 1);
        self.begin(linkage, touch, pose);
        let instant = self.instant(linkage, touch, lean);
        for k in 0..order {
            self.advance(linkage, touch, &instant, k);
        }
    }

    fn begin(&mut self, linkage: &Linkage, touch: Touch, pose: &Pose) {
        let d = Directions::of(pose);
        self.angle[0] = [pose.theta, pose.phi];
        self.rate[0] = [pose.theta_rate, pose.phi_rate];
        self.sin[0] = [d.sin_theta, d.sin_phi];
        self.cos[0] = [d.cos_theta, d.cos_phi];
        for i in 0..2 {
            self.p[0][i] = self.cos[0][i] * self.rate[0][i];
            self.q[0][i] = self.sin[0][i] * self.rate[0][i];
        }
        self.tip_velocity[0] = self.tip_rate(linkage, 0);
        (self.drop_m[0], self.drop_rate[0]) = match touch {
            Touch::Flight(drop, rate) => (drop, rate),
            _ => (linkage.head_drop_m(&d), linkage.l1_m * self.q[0][0] + linkage.l2_m * self.q[0][1]),
        };
        if let Touch::Slip(direction) = touch {
            self.mu[0] = linkage.friction.dynamic(direction * self.tip_velocity[0]);
        }
    }

    #[inline(always)]
    fn tip_rate(&self, linkage: &Linkage, k: usize) -> f64 {
        self.head_velocity[k] + linkage.l1_m * self.p[k][0] + linkage.l2_m * self.p[k][1]
    }

    fn instant(&mut self, linkage: &Linkage, touch: Touch, lean: Lean) -> Instant {
        let Linkage { mass_kg: mass, l1_m: l1, l2_m: l2, m_a, m_b, m_c, m_theta, m_phi, .. } = *linkage;
        let ([s1, s2], [c1, c2]) = (self.sin[0], self.cos[0]);
        let arm = [m_a - mass * l1, m_b - mass * l2];
        let (drop, normal) = match touch {
            Touch::Flight(..) => ([m_a * s1 / mass, m_b * s2 / mass], [0.0; 2]),
            _ => ([l1 * s1, l2 * s2], [arm[0] * s1, arm[1] * s2]),
        };
        let coupling = m_c * (c1 * c2 + s1 * s2);
        let a11 = m_theta - s1 * (m_a * drop[0] + l1 * normal[0]);
        let a22 = m_phi - s2 * (m_b * drop[1] + l2 * normal[1]);
        let a12 = coupling - s1 * (m_a * drop[1] + l1 * normal[1]);
        let determinant = a11 * a22 - a12 * a12;
        let mut friction = [0.0; 2];
        let mut matrix = [[a11, a12], [a12, a22]];
        self.indicator = 1.0;
        if let Touch::Slip(direction) = touch {
            friction = normal.map(|n| -direction * self.mu[0] * n);
            let (w1, w2) = (l1 * c1, l2 * c2);
            matrix = [[a11 - w1 * friction[0], a12 - w1 * friction[1]], [a12 - w2 * friction[0], a22 - w2 * friction[1]]];
            self.indicator = (matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0]) / determinant;
        }
        let inverse_determinant = 1.0 / (determinant * self.indicator);
        let inverse = [
            [inverse_determinant * matrix[1][1], -inverse_determinant * matrix[0][1]],
            [-inverse_determinant * matrix[1][0], inverse_determinant * matrix[0][0]],
        ];
        let w = [l1 * c1, l2 * c2];
        let per_force = [inverse[0][0] * w[0] + inverse[0][1] * w[1], inverse[1][0] * w[0] + inverse[1][1] * w[1]];
        let kappa = w[0] * per_force[0] + w[1] * per_force[1];
        Instant { l: [l1, l2], m: [m_a, m_b], arm, inverse, per_force, kappa, drop, normal, friction, neck: linkage.neck_and_shoulder(lean) }
    }

    /// From the coefficients of angles and rates up to `x^k` to those of `x^(k + 1)`.
    #[inline]
    fn advance(&mut self, linkage: &Linkage, touch: Touch, at: &Instant, k: usize) {
        let next = (k + 1) as f64;
        let share = 1.0 / next;
        let each = |f: &dyn Fn(usize) -> f64| -> Pair { [f(0), f(1)] };
        self.angle[k + 1] = each(&|i| self.rate[k][i] * share);
        self.sin[k + 1] = each(&|i| self.p[k][i] * share);
        self.cos[k + 1] = each(&|i| -self.q[k][i] * share);
        // p and q of the next order but for the part of the rate that is solved for
        let (p_rest, q_rest) = products(&self.cos, &self.sin, &self.rate, k + 1);
        let (tp, tq) = (each(&|i| next * p_rest[i]), each(&|i| next * q_rest[i]));
        let head_acceleration = next * self.head_velocity[k + 1];

        let (drop, normal, friction) = self.vertical(linkage, touch, at, k, tq);
        let [x_rest, y_rest] = single_products(&self.cos, &self.x, &self.sin, &self.y, k);
        let other = [1, 0];
        let x_free = each(&|i| linkage.m_c * tp[other[i]] + at.m[i] * head_acceleration - at.l[i] * friction.constant);
        let y_free = each(&|i| linkage.m_c * tq[other[i]] - at.m[i] * drop.constant - at.l[i] * normal.constant);
        let [theta, phi] = self.angle[k];
        let [theta_rate, phi_rate] = self.rate[k];
        let lip = linkage.lip.stiffness * (phi - theta) + linkage.lip.damping * (phi_rate - theta_rate);
        let neck = at.neck[0] * theta + at.neck[1] * theta_rate + if k == 0 { at.neck[2] } else { 0.0 };
        let springs = [neck - lip, lip];
        let b = each(&|i| self.cos[0][i] * x_free[i] + x_rest[i] + self.sin[0][i] * y_free[i] + y_rest[i] + springs[i]);
        let mut a = each(&|i| -(at.inverse[i][0] * b[0] + at.inverse[i][1] * b[1]));
        let mut force = friction.at(a);
        if touch == Touch::Stick {
            let w = each(&|i| at.l[i] * self.cos[0][i]);
            let tip = head_acceleration + at.l[0] * tp[0] + at.l[1] * tp[1] + w[0] * a[0] + w[1] * a[1];
            force = -tip / at.kappa;
            a = each(&|i| a[i] + force * at.per_force[i]);
        }
        self.rate[k + 1] = each(&|i| a[i] * share);
        self.p[k + 1] = each(&|i| p_rest[i] + self.cos[0][i] * self.rate[k + 1][i]);
        self.q[k + 1] = each(&|i| q_rest[i] + self.sin[0][i] * self.rate[k + 1][i]);
        let (drop, normal) = (drop.at(a), normal.at(a));
        (self.normal_n[k], self.friction_n[k]) = (normal, force);
        self.x[k] = each(&|i| linkage.m_c * next * self.p[k + 1][other[i]] + at.m[i] * head_acceleration - at.l[i] * force);
        self.y[k] = each(&|i| linkage.m_c * next * self.q[k + 1][other[i]] - at.m[i] * drop - at.l[i] * normal);
        self.drop_rate[k + 1] = drop * share;
        self.drop_m[k + 1] = self.drop_rate[k] * share;
        self.tip_velocity[k + 1] = self.tip_rate(linkage, k + 1);
        if let Touch::Slip(direction) = touch {
            self.mu[k + 1] = self.next_mu(linkage, direction, k + 1);
        }
    }

    /// `u''`, `N` and `f` of order `k` as they depend on the accelerations; `tq` is the known part of `q'`.
    #[inline(always)]
    fn vertical(&self, linkage: &Linkage, touch: Touch, at: &Instant, k: usize, tq: Pair) -> (Affine, Affine, Affine) {
        let preload = if k == 0 { linkage.preload_displacement_m } else { 0.0 };
        let support = linkage.head.stiffness * (preload - self.drop_m[k]) - linkage.head.damping * self.drop_rate[k];
        let constant = match touch {
            Touch::Flight(..) => (at.m[0] * tq[0] + at.m[1] * tq[1] + support) / linkage.mass_kg,
            _ => at.l[0] * tq[0] + at.l[1] * tq[1],
        };
        let drop = Affine { constant, linear: at.drop };
        if let Touch::Flight(..) = touch {
            return (drop, Affine::default(), Affine::default());
        }
        let normal = Affine { constant: support + at.arm[0] * tq[0] + at.arm[1] * tq[1], linear: at.normal };
        let Touch::Slip(direction) = touch else { return (drop, normal, Affine::default()) };
        let earlier: f64 = self.mu[1..=k].iter().zip(self.normal_n[..k].iter().rev()).map(|(mu, n)| mu * n).sum();
        let friction = Affine { constant: -direction * (self.mu[0] * normal.constant + earlier), linear: at.friction };
        (drop, normal, friction)
    }

    /// Coefficient of `mu = a exp(-b sigma v3') + c`, from `E' = -b sigma v3'' E`.
    #[inline(always)]
    fn next_mu(&self, linkage: &Linkage, direction: f64, k: usize) -> f64 {
        let friction = &linkage.friction;
        if friction.a == 0.0 || friction.b_s_per_m == 0.0 {
            return 0.0;
        }
        // the falling part of mu is mu without c, which only the first coefficient contains
        let falling = |j: usize| if j == 0 { self.mu[0] - friction.c } else { self.mu[j] };
        let sum: f64 = (1..=k).map(|j| j as f64 * self.tip_velocity[j] * falling(k - j)).sum();
        -friction.b_s_per_m * direction * sum / k as f64
    }
}

/// `sum_{j=1}^{n} c_j r_{n-j}` and `sum_{j=1}^{n} s_j r_{n-j}` for both links.
#[inline(always)]
fn products<const K: usize>(c: &[Pair; K], s: &[Pair; K], r: &[Pair; K], n: usize) -> (Pair, Pair) {
    let (mut with_c, mut with_s) = ([0.0; 2], [0.0; 2]);
    for ((c, s), r) in c[1..=n].iter().zip(&s[1..=n]).zip(r[..n].iter().rev()) {
        for i in 0..2 {
            with_c[i] += c[i] * r[i];
            with_s[i] += s[i] * r[i];
        }
    }
    (with_c, with_s)
}

/// `sum_{j=1}^{n} c_j x_{n-j}` and `sum_{j=1}^{n} s_j y_{n-j}` for both links.
#[inline(always)]
fn single_products<const K: usize>(c: &[Pair; K], x: &[Pair; K], s: &[Pair; K], y: &[Pair; K], n: usize) -> [Pair; 2] {
    let (mut with_c, mut with_s) = ([0.0; 2], [0.0; 2]);
    for ((c, x), (s, y)) in c[1..=n].iter().zip(x[..n].iter().rev()).zip(s[1..=n].iter().zip(y[..n].iter().rev())) {
        for i in 0..2 {
            with_c[i] += c[i] * x[i];
            with_s[i] += s[i] * y[i];
        }
    }
    [with_c, with_s]
}
