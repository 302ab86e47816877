//! Taylor coefficients of the first variation of the motion: derivatives of everything that a
//! [`MotionSeries`](super::series::MotionSeries) carries, about the same instant and for several directions
//! at once.
//!
//! A direction changes constants of the linkage, the velocity of the head or the state. With `d` for its
//! derivative, `C_i = cos(angle_i) d angle_i` and `S_i = sin(angle_i) d angle_i`,
//!
//! ```text
//! d sin = C,  d cos = -S,  p = (sin)',  q = -(cos)',  so  d p = C',  d q = S'
//! I_i d angle_i'' + cos_i dX_i + sin_i dY_i + Z_i d angle_i + d moments + d I_i angle_i'' = 0
//! Z_i = cos_i Y_i - sin_i X_i
//! dX_1 = m_c d p2' + m_a d v'' - l1 df + (d m_c p2' + d m_a v'' - d l1 f)      dY_1, dX_2, dY_2 likewise
//! slip: df = -sigma (mu dN - b sigma N E d v3' + (d a e - d b sigma v3' E + d c) N),   E = a e
//! ```
//!
//! in the notation of [`series`](super::series). The brackets `Z` and `N E` are the same for all directions,
//! and a coefficient costs each direction twelve products of series. The highest coefficients enter with the
//! inverse of the motion's own matrix.

mod linkage;
mod row;
mod shared;

use super::Linkage;
use super::series::{Instant, Pair, Touch, each};
pub use linkage::{LinkageTangent, SpringTangent};
pub use row::{LANES, Row};
pub use shared::Shared;

/// A quantity of neck and lip in several directions.
type Pairs = [Row; 2];

/// Derivatives of the state at the start of a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct StateTangent {
    /// Of the angles of neck and lip, rad over the unit of the direction, and so on.
    pub angle: [Row; 2],
    /// Of the angular rates, rad/s.
    pub rate: [Row; 2],
    /// Of the gap between tip and glass, m: nothing in contact.
    pub gap_m: Row,
    /// Of its rate, m/s.
    pub gap_rate: Row,
}

/// What a coefficient enters the products of higher ones with.
#[derive(Debug, Clone, Copy, Default)]
struct Factors {
    angle: Pairs,
    x: Pairs,
    y: Pairs,
    normal: Row,
    tip_velocity: Row,
}

/// Taylor coefficients of the derivatives of the motion; `K` is that of the motion's series.
#[derive(Debug, Clone)]
pub struct TangentSeries<const K: usize> {
    /// Of the velocity of the head along the sweep, m/s: given up to the order of the motion.
    pub head_velocity: [Row; K],
    factors: [Factors; K],
    /// Of the angular rates, rad/s.
    pub rate: [[Row; 2]; K],
    /// Of the drop of the head, m.
    pub drop_m: [Row; K],
    drop_rate: [Row; K],
    /// Of the friction force, N, up to one order less.
    pub friction_n: [Row; K],
    /// Of the velocity of the tip away from the glass, m/s.
    pub gap_rate: [Row; K],
    p: Pairs,
    q: Pairs,
}

impl<const K: usize> Default for TangentSeries<K> {
    fn default() -> Self {
        Self {
            head_velocity: [Row::ZERO; K],
            factors: [Factors::default(); K],
            rate: [[Row::ZERO; 2]; K],
            drop_m: [Row::ZERO; K],
            drop_rate: [Row::ZERO; K],
            friction_n: [Row::ZERO; K],
            gap_rate: [Row::ZERO; K],
            p: [Row::ZERO; 2],
            q: [Row::ZERO; 2],
        }
    }
}

/// Sums over the products of lower orders: those of `C` and `S` two orders above the motion's, those of the
/// moments and those of friction.
#[derive(Clone, Copy, Default)]
struct Sums {
    c: Pairs,
    s: Pairs,
    moment: Pairs,
    slip: Row,
}

/// What a direction's own constants add at one order.
#[derive(Clone, Copy, Default)]
struct Own {
    x: Pairs,
    y: Pairs,
    /// To the moments of neck and lip.
    moment: Pairs,
    /// To the support's force, to `u''` and to `N`.
    support: Row,
    drop: Row,
    normal: Row,
    /// To `p'` along the sweep, `sum d l p'`.
    along: Row,
    /// To friction.
    slip: Row,
}

impl<const K: usize> TangentSeries<K> {
    /// Of the angles, rad, coefficient `k`.
    #[inline]
    #[must_use]
    pub fn angle(&self, k: usize) -> [Row; 2] {
        self.factors[k].angle
    }

    /// Of the velocity of the tip along the sweep, m/s, coefficient `k`.
    #[inline]
    #[must_use]
    pub fn tip_velocity(&self, k: usize) -> Row {
        self.factors[k].tip_velocity
    }

    /// Of the normal force, N, coefficient `k` up to one order less than the motion's.
    #[inline]
    #[must_use]
    pub fn normal_n(&self, k: usize) -> Row {
        self.factors[k].normal
    }

    /// Coefficients up to the order of the motion in `shared`, from the derivatives of the state at its
    /// start; `own` are those of the linkage's constants, `None` where none changes.
    ///
    /// In stick the rates' derivatives lose, by the impulse on the tip that does so, what would move the tip:
    /// a tip that sticks stays at rest.
    pub fn expand(
        &mut self,
        linkage: &Linkage,
        own: Option<&LinkageTangent>,
        shared: &Shared<'_, K>,
        start: &StateTangent,
    ) {
        match own {
            Some(own) => self.begin::<true>(linkage, own, shared, start),
            None => self.begin::<false>(linkage, &LinkageTangent::default(), shared, start),
        }
    }

    fn begin<const OWN: bool>(
        &mut self,
        linkage: &Linkage,
        own: &LinkageTangent,
        shared: &Shared<'_, K>,
        start: &StateTangent,
    ) {
        let (at, motion) = (&shared.instant, shared.motion);
        let [c, s] = shared.directions(0);
        let rate = motion.rate[0];
        self.factors[0].angle = start.angle;
        self.rate[0] = start.rate;
        let turned: Pairs = rows(|i| rate[i] * start.angle[i]);
        let along = |rates: &Pairs| rows(|i| c[i] * rates[i] - s[i] * turned[i]);
        self.p = along(&start.rate);
        let mut velocity = self.head_velocity[0] + weighted(at.l, &self.p);
        if OWN {
            velocity += weighted(shared.p(0), &own.lengths_m);
        }
        if shared.touch == Touch::Stick {
            self.rate[0] = rows(|i| start.rate[i] - (at.mobility * at.per_force[i]) * velocity);
            self.p = along(&self.rate[0]);
            velocity = Row::ZERO;
        }
        self.q = rows(|i| s[i] * self.rate[0][i] + c[i] * turned[i]);
        self.factors[0].tip_velocity = velocity;
        self.drop_m[0] = weighted(each(|i| at.l[i] * s[i]), &start.angle) - start.gap_m;
        self.drop_rate[0] = weighted(at.l, &self.q) - start.gap_rate;
        self.gap_rate[0] = start.gap_rate;
        if OWN {
            self.drop_m[0] += weighted(c.map(|c| 1.0 - c), &own.lengths_m);
            self.drop_rate[0] += weighted(shared.q(0), &own.lengths_m);
        }
        for k in 0..shared.order {
            let own_terms = if OWN { self.own(linkage, own, shared, k) } else { Own::default() };
            if shared.falls() {
                self.advance::<OWN, true>(linkage, shared, k, &own_terms);
            } else {
                self.advance::<OWN, false>(linkage, shared, k, &own_terms);
            }
            if OWN {
                self.add_lengths(own, shared, k + 1);
            }
        }
        let order = shared.order;
        (self.factors[order].normal, self.friction_n[order]) = (Row::ZERO, Row::ZERO);
    }

    /// What changed lengths do to the velocities of tip and gap, coefficient `k`.
    #[inline(always)]
    fn add_lengths(&mut self, own: &LinkageTangent, shared: &Shared<'_, K>, k: usize) {
        self.factors[k].tip_velocity += weighted(shared.p(k), &own.lengths_m);
        self.gap_rate[k] += weighted(shared.q(k), &own.lengths_m);
    }

    /// What the direction's own constants add to the equations, coefficient `k`.
    #[inline(always)]
    fn own(&self, linkage: &Linkage, own: &LinkageTangent, shared: &Shared<'_, K>, k: usize) -> Own {
        let motion = shared.motion;
        let next = (k + 1) as f64;
        let head_acceleration = next * motion.head_velocity[k + 1];
        let drop_acceleration = next * motion.drop_rate[k + 1];
        let (p, q) = (shared.p(k + 1).map(|p| next * p), shared.q(k + 1).map(|q| next * q));
        let (force, normal) = (motion.friction_n[k], motion.normal_n(k));
        let lengths = &own.lengths_m;
        let flies = matches!(shared.touch, Touch::Flight(..));
        let support = own.support(linkage, motion, k);
        let carried = weighted(q, &own.moments) - drop_acceleration * own.mass_kg;
        let drop = weighted(q, lengths);
        Own {
            x: rows(|i| p[1 - i] * own.m_c + head_acceleration * own.moments[i] - force * lengths[i]),
            y: rows(|i| q[1 - i] * own.m_c - drop_acceleration * own.moments[i] - normal * lengths[i]),
            moment: own.spring_moments(linkage, shared, k),
            support,
            drop: if flies { (1.0 / linkage.mass_kg) * carried } else { drop },
            normal: if flies { Row::ZERO } else { carried - linkage.mass_kg * drop },
            along: weighted(p, lengths),
            slip: shared.own_slip(own, k),
        }
    }

    /// From the coefficients up to `x^k` to those of `x^(k + 1)`, as the
    /// motion's series have it; `FALLING` is slip under friction that falls with speed.
    #[inline(always)]
    fn advance<const OWN: bool, const FALLING: bool>(
        &mut self,
        linkage: &Linkage,
        shared: &Shared<'_, K>,
        k: usize,
        own: &Own,
    ) {
        let at: &Instant = &shared.instant;
        let touch = shared.touch;
        let (next, after) = ((k + 1) as f64, (k + 2) as f64);
        let share = 1.0 / next;
        self.factors[k + 1].angle = rows(|i| share * self.rate[k][i]);
        let sums = self.sums::<FALLING>(shared, k);
        // p' and q' but for the part of the accelerations that are solved for
        let (tp, tq) = (rows(|i| (next * after) * sums.c[i]), rows(|i| (next * after) * sums.s[i]));
        let head_acceleration = next * self.head_velocity[k + 1];
        let flies = matches!(touch, Touch::Flight(..));

        let mut support = -linkage.head.stiffness * self.drop_m[k] - linkage.head.damping * self.drop_rate[k];
        let mut rest_drop = weighted(at.drop_rest, &tq);
        let mut rest_normal = Row::ZERO;
        if OWN {
            support += own.support;
            rest_drop += own.drop;
        }
        if flies {
            rest_drop += (1.0 / linkage.mass_kg) * support;
        } else {
            rest_normal = support + weighted(at.arm, &tq);
            if OWN {
                rest_normal += own.normal;
            }
        }
        let springs = self.spring_moments(linkage, at, k);
        let [cos, sin] = shared.directions(0);
        let slip = if OWN { sums.slip + own.slip } else { sums.slip };
        let b: Pairs = rows(|i| {
            let other = 1 - i;
            let mut b =
                at.cos_m_c[i] * tp[other] + at.sin_m_c[i] * tq[other] + at.cos_m[i] * head_acceleration
                    - at.sin_m[i] * rest_drop
                    + at.per_normal[i] * rest_normal
                    + sums.moment[i]
                    + springs[i];
            if OWN {
                b += cos[i] * own.x[i] + sin[i] * own.y[i] + own.moment[i];
            }
            if OWN || FALLING {
                b.add_scaled(at.per_slip[i], &slip);
            }
            b
        });
        let mut a: Pairs = rows(|i| -(at.inverse[i][0] * b[0] + at.inverse[i][1] * b[1]));
        let mut held = Row::ZERO;
        if touch == Touch::Stick {
            let mut tip = head_acceleration + weighted(at.l, &tp) + weighted(at.w, &a);
            if OWN {
                tip += own.along;
            }
            held = -at.mobility * tip;
            a = rows(|i| a[i] + at.per_force[i] * held);
        }
        let drop = rest_drop + weighted(at.drop, &a);
        let normal = rest_normal + weighted(at.normal, &a);
        let mut force = at.mu * normal + held;
        if OWN || FALLING {
            force.add_scaled(-touch.direction(), &slip);
        }

        let p: Pairs = rows(|i| tp[i] + cos[i] * a[i]);
        let q: Pairs = rows(|i| tq[i] + sin[i] * a[i]);
        self.rate[k + 1] = rows(|i| share * a[i]);
        (self.p, self.q) = (rows(|i| share * p[i]), rows(|i| share * q[i]));
        let factors = &mut self.factors[k];
        factors.x = rows(|i| linkage.m_c * p[1 - i] + at.m[i] * head_acceleration - at.l[i] * force);
        factors.y = rows(|i| linkage.m_c * q[1 - i] - at.m[i] * drop - at.l[i] * normal);
        if OWN {
            factors.x = rows(|i| factors.x[i] + own.x[i]);
            factors.y = rows(|i| factors.y[i] + own.y[i]);
        }
        factors.normal = normal;
        self.friction_n[k] = force;
        self.drop_rate[k + 1] = share * drop;
        self.drop_m[k + 1] = share * self.drop_rate[k];
        self.gap_rate[k + 1] = weighted(at.l, &self.q) - share * drop;
        self.factors[k + 1].tip_velocity = self.head_velocity[k + 1] + weighted(at.l, &self.p);
    }

    /// The products with what is known of lower orders.
    #[inline(always)]
    fn sums<const FALLING: bool>(&self, shared: &Shared<'_, K>, k: usize) -> Sums {
        let mut sums = Sums::default();
        for (m, row) in self.factors[..k].iter().enumerate() {
            let (near, far) = (&shared.products[k - m], &shared.products[k + 2 - m]);
            for i in 0..2 {
                sums.c[i].add_scaled(far.cos[i], &row.angle[i]);
                sums.s[i].add_scaled(far.sin[i], &row.angle[i]);
                sums.moment[i].add_scaled(near.z[i], &row.angle[i]);
                sums.moment[i].add_scaled(near.cos[i], &row.x[i]);
                sums.moment[i].add_scaled(near.sin[i], &row.y[i]);
            }
            if FALLING {
                sums.slip.add_scaled(near.mu, &row.normal);
                sums.slip.add_scaled(near.per_speed, &row.tip_velocity);
            }
        }
        let [first, second, third] = [0, 1, 2].map(|j| &shared.products[j]);
        let (this, next) = (&self.factors[k], &self.factors[k + 1]);
        for i in 0..2 {
            sums.c[i].add_scaled(third.cos[i], &this.angle[i]);
            sums.c[i].add_scaled(second.cos[i], &next.angle[i]);
            sums.s[i].add_scaled(third.sin[i], &this.angle[i]);
            sums.s[i].add_scaled(second.sin[i], &next.angle[i]);
            sums.moment[i].add_scaled(first.z[i], &this.angle[i]);
        }
        if FALLING {
            sums.slip.add_scaled(first.per_speed, &this.tip_velocity);
        }
        sums
    }

    #[inline(always)]
    fn spring_moments(&self, linkage: &Linkage, at: &Instant, k: usize) -> Pairs {
        let ([theta, phi], [theta_rate, phi_rate]) = (self.factors[k].angle, self.rate[k]);
        let lip = linkage.lip.stiffness * (phi - theta) + linkage.lip.damping * (phi_rate - theta_rate);
        [at.neck[0] * theta + at.neck[1] * theta_rate - lip, lip]
    }
}

/// One row a link.
#[inline(always)]
fn rows(f: impl Fn(usize) -> Row) -> Pairs {
    [f(0), f(1)]
}

/// The sum over both links.
#[inline(always)]
fn weighted(weights: Pair, rows: &Pairs) -> Row {
    weights[0] * rows[0] + weights[1] * rows[1]
}
