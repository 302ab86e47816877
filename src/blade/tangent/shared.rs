//! What the derivatives in all directions take from the motion itself.

use super::Pairs;
use super::linkage::LinkageTangent;
use super::row::Row;
use crate::blade::Linkage;
use crate::blade::series::{Instant, MotionSeries, Pair, Touch, each};
use crate::blade::shoulder::Lean;

/// Factors of the products with derivatives, coefficient `j`.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Products {
    pub cos: Pair,
    pub sin: Pair,
    /// `cos Y - sin X`: what the moments gain by turning.
    pub z: Pair,
    /// Friction coefficient, and its force's loss per speed of the tip, `-b sigma N E`.
    pub mu: f64,
    pub per_speed: f64,
}

/// Factors of the derivatives of the friction law's constants, in N and N m/s.
#[derive(Debug, Clone, Copy, Default)]
struct OfFriction {
    /// `N e`.
    per_a: f64,
    /// `-sigma v3' N E`.
    per_b: f64,
}

/// Series that follow from a motion and that all directions share.
#[derive(Debug, Clone)]
pub struct Shared<'a, const K: usize> {
    pub(super) motion: &'a MotionSeries<K>,
    pub(super) touch: Touch,
    pub(super) order: usize,
    pub(super) instant: Instant,
    pub(super) products: [Products; K],
    lean: Lean,
    of_friction: [OfFriction; K],
    falls: bool,
}

impl<'a, const K: usize> Shared<'a, K> {
    /// Of a motion that is expanded on this linkage to an order of at most `K - 2`; `friction` where
    /// constants of the friction law change in a direction.
    #[must_use]
    pub fn new(
        linkage: &Linkage,
        touch: Touch,
        lean: Lean,
        motion: &'a MotionSeries<K>,
        friction: bool,
    ) -> Self {
        debug_assert!(motion.order + 2 <= K);
        let mut shared = Self {
            motion,
            touch,
            order: motion.order,
            instant: motion.instant(linkage, touch, lean),
            products: [Products::default(); K],
            lean,
            of_friction: [OfFriction::default(); K],
            falls: matches!(touch, Touch::Slip(_)) && linkage.friction.a != 0.0,
        };
        shared.turn();
        if let Touch::Slip(direction) = touch {
            shared.rub(linkage, direction, friction);
        }
        shared
    }

    /// Slip under friction that falls with speed.
    #[inline(always)]
    pub(super) fn falls(&self) -> bool {
        self.falls
    }

    /// Cosines and sines, coefficient `k` up to one order more than the motion's.
    #[inline(always)]
    pub(super) fn directions(&self, k: usize) -> [Pair; 2] {
        [self.products[k].cos, self.products[k].sin]
    }

    /// `p` of the motion, coefficient `k` up to its order.
    #[inline(always)]
    pub(super) fn p(&self, k: usize) -> Pair {
        self.products[k + 1].sin.map(|sin| (k + 1) as f64 * sin)
    }

    /// `q` of the motion, likewise.
    #[inline(always)]
    pub(super) fn q(&self, k: usize) -> Pair {
        self.products[k + 1].cos.map(|cos| -((k + 1) as f64) * cos)
    }

    fn turn(&mut self) {
        let (motion, order) = (self.motion, self.order);
        let share = 1.0 / (order + 1) as f64;
        let products = &mut self.products;
        for (product, left) in products.iter_mut().zip(&motion.left[..=order]) {
            (product.cos, product.sin) = (left.cos, left.sin);
        }
        products[order + 1].cos = motion.q.map(|q| -share * q);
        products[order + 1].sin = motion.p.map(|p| share * p);
        for (k, product) in products[..order].iter_mut().enumerate() {
            let mut z = [0.0; 2];
            for (left, right) in motion.left[..=k].iter().zip(motion.right[..=k].iter().rev()) {
                z = each(|i| z[i] + left.cos[i] * right.y[i] - left.sin[i] * right.x[i]);
            }
            product.z = z;
        }
    }

    /// Friction: `e = exp(-b sigma v3')`, of which the falling part of `mu` is the `a`-fold.
    fn rub(&mut self, linkage: &Linkage, direction: f64, constants: bool) {
        let (motion, friction) = (self.motion, &linkage.friction);
        let mut e = [0.0; K];
        if self.falls {
            let falling = motion.left[..self.order].iter().map(|left| left.slip[0] / friction.a);
            e.iter_mut().zip(falling).for_each(|(e, falling)| *e = falling);
            e[0] -= friction.c / friction.a;
        } else if constants {
            exponential(&mut e[..self.order], -friction.b_s_per_m * direction, &motion.tip_velocity);
        } else {
            return;
        }
        for k in 0..self.order {
            self.products[k].mu = motion.left[k].slip[0];
            let per_a: f64 = (0..=k).map(|j| e[j] * motion.normal_n(k - j)).sum();
            self.of_friction[k].per_a = per_a;
            self.products[k].per_speed = -friction.b_s_per_m * direction * friction.a * per_a;
        }
        if constants {
            for k in 0..self.order {
                let sum: f64 = (0..=k).map(|j| motion.tip_velocity[j] * self.of_friction[k - j].per_a).sum();
                self.of_friction[k].per_b = -direction * friction.a * sum;
            }
        }
    }

    /// What changed constants of the friction law add to friction, N, coefficient `k`.
    #[inline(always)]
    pub(super) fn own_slip(&self, own: &LinkageTangent, k: usize) -> Row {
        let OfFriction { per_a, per_b } = self.of_friction[k];
        per_a * own.friction_a + per_b * own.friction_b_s_per_m + self.motion.normal_n(k) * own.friction_c
    }
}

/// Coefficients of `exp(factor x)`.
fn exponential(e: &mut [f64], factor: f64, x: &[f64]) {
    if let Some(first) = e.first_mut() {
        *first = (factor * x[0]).exp();
    }
    for k in 1..e.len() {
        let sum: f64 = (1..=k).map(|j| j as f64 * x[j] * e[k - j]).sum();
        e[k] = factor * sum / k as f64;
    }
}

impl LinkageTangent {
    /// What a changed support adds to its force on the head, N, coefficient `k`.
    #[inline(always)]
    pub(super) fn support<const K: usize>(
        &self,
        linkage: &Linkage,
        motion: &MotionSeries<K>,
        k: usize,
    ) -> Row {
        let mut force = -motion.drop_m[k] * self.head.stiffness - motion.drop_rate[k] * self.head.damping;
        if k == 0 {
            force += linkage.preload_displacement_m * self.head.stiffness
                + linkage.head.stiffness * self.preload_displacement_m;
        }
        force
    }

    /// What changed springs, dampers, inertias and the shoulder add to the moments of neck and lip, N m,
    /// coefficient `k`.
    #[inline(always)]
    pub(super) fn spring_moments<const K: usize>(
        &self,
        linkage: &Linkage,
        shared: &Shared<'_, K>,
        k: usize,
    ) -> Pairs {
        let motion = shared.motion;
        let ([theta, phi], [theta_rate, phi_rate]) = (motion.angle[k], motion.rate[k]);
        let accelerations = each(|i| (k + 1) as f64 * motion.rate[k + 1][i]);
        let lip = (phi - theta) * self.lip.stiffness + (phi_rate - theta_rate) * self.lip.damping;
        let mut neck = theta * self.neck.stiffness + theta_rate * self.neck.damping;
        if let (side @ (Lean::Forward | Lean::Backward), Some(shoulder)) = (shared.lean, &linkage.shoulder) {
            neck += theta * self.shoulder.stiffness + theta_rate * self.shoulder.damping;
            if k == 0 {
                neck -= side.sign()
                    * (shoulder.contact_angle_rad * self.shoulder.stiffness
                        + shoulder.stiffness_n_m_per_rad * self.contact_angle_rad);
            }
        }
        [neck - lip + accelerations[0] * self.inertias[0], lip + accelerations[1] * self.inertias[1]]
    }
}
