//! Samples of a motion at a few instants of a step, from its series.

use super::lane_vector::{LANES, LaneVector};
use super::{LaneVectorPair, ReferenceMotion, lanes_per_link, sum_over_links};
use crate::model::series::ContactMode;
use std::cell::OnceCell;
use std::ops::Deref;

/// Angles and angular rates of the links at a few instants, one per lane.
#[derive(Debug, Clone)]
pub(crate) struct LinkAttitudes {
    /// Times since the start of the series, s.
    pub x: LaneVector,
    /// Cosines of both angles.
    pub cos: [LaneVector; 2],
    /// Sines of both angles.
    pub sin: [LaneVector; 2],
    pub rate: [LaneVector; 2],
}

/// Motion and forces at a few instants, one per lane.
#[derive(Debug, Clone)]
pub(crate) struct MotionSamples {
    pub attitude: LinkAttitudes,
    pub(super) acceleration: LaneVectorPair,
    /// `1 / cos` with its first two derivatives in time.
    pub(super) secant: [LaneVectorPair; 3],
    /// `sin / cos` with its first two derivatives in time.
    pub(super) tangent: [LaneVectorPair; 3],
    pub(super) along: LaneVectorPair,
    pub(super) across: LaneVectorPair,
    pub(super) head_acceleration: LaneVector,
    pub(super) drop_acceleration: LaneVector,
    pub(super) normal: LaneVector,
    pub(super) friction: LaneVector,
    /// Friction coefficient times the direction of slip, `sigma mu`; 0 unless the tip slips.
    pub(super) mu: LaneVector,
    /// Normal force times the fall of the friction coefficient per unit of `b |v3'|`, without viscous
    /// friction, N: `N E`; 0 unless the tip slips.
    pub(super) falling: LaneVector,
    /// Both angles, rad, computed on demand.
    angles: OnceCell<LaneVectorPair>,
}

/// Sums of `Q` Taylor series at the times `x`, by Horner's rule, with powers of `x` up to `order`.
#[inline(always)]
pub(super) fn sum_horner<const Q: usize>(
    x: LaneVector,
    order: usize,
    coefficients: impl Fn(usize) -> [f64; Q],
) -> [LaneVector; Q] {
    let mut sums = [LaneVector::ZERO; Q];
    for k in (0..=order).rev() {
        for (sum, coefficient) in sums.iter_mut().zip(coefficients(k)) {
            *sum = *sum * x + LaneVector::splat(coefficient);
        }
    }
    sums
}

impl Deref for MotionSamples {
    type Target = LinkAttitudes;
    #[inline(always)]
    fn deref(&self) -> &LinkAttitudes {
        &self.attitude
    }
}

impl<const K: usize> ReferenceMotion<'_, K> {
    /// Angles and angular rates of the links at the times `x` after the start of the series, s.
    #[inline]
    pub(crate) fn sample_attitudes(&self, x: LaneVector) -> LinkAttitudes {
        let motion = self.motion;
        let [cos_0, cos_1, sin_0, sin_1] = sum_horner(x, motion.order, |k| {
            let ([cos_0, cos_1], [sin_0, sin_1]) = (motion.cosines(k), motion.sines(k));
            [cos_0, cos_1, sin_0, sin_1]
        });
        let rate = sum_horner(x, motion.order, |k| motion.rate[k]);
        LinkAttitudes { x, cos: [cos_0, cos_1], sin: [sin_0, sin_1], rate }
    }

    /// Motion and forces at the times `x` after the start of the series, s.
    #[inline]
    pub(crate) fn sample_motion(&self, x: LaneVector) -> MotionSamples {
        let (motion, order) = (self.motion, self.motion.order);
        let attitude = self.sample_attitudes(x);
        let LinkAttitudes { cos, sin, rate, .. } = attitude;
        let [a_0, a_1, head_acceleration, normal] = sum_horner(x, order - 1, |k| {
            let next = (k + 1) as f64;
            let [a_0, a_1] = motion.rate[k + 1];
            [next * a_0, next * a_1, next * motion.head_velocity[k + 1], motion.normal_n(k)]
        });
        let acceleration = [a_0, a_1];
        let swing = lanes_per_link(|i| rate[i] * rate[i]);
        let along = lanes_per_link(|i| cos[i] * acceleration[i] - sin[i] * swing[i]);
        let across = lanes_per_link(|i| sin[i] * acceleration[i] + cos[i] * swing[i]);
        let secant = lanes_per_link(|i| cos[i].inverse());
        let tangent = lanes_per_link(|i| sin[i] * secant[i]);
        let turning = lanes_per_link(|i| rate[i] * secant[i]);
        let secant_1 = lanes_per_link(|i| tangent[i] * turning[i]);
        let mut at = MotionSamples {
            attitude,
            acceleration,
            secant: [
                secant,
                secant_1,
                lanes_per_link(|i| {
                    across[i] * secant[i] * secant[i] + 2.0 * secant_1[i] * secant_1[i] * cos[i]
                }),
            ],
            tangent: [
                tangent,
                lanes_per_link(|i| turning[i] * secant[i]),
                lanes_per_link(|i| acceleration[i] * secant[i] * secant[i] + 2.0 * turning[i] * secant_1[i]),
            ],
            along,
            across,
            head_acceleration,
            drop_acceleration: sum_over_links(self.lengths(), &across),
            normal,
            friction: LaneVector::ZERO,
            mu: LaneVector::ZERO,
            falling: LaneVector::ZERO,
            angles: OnceCell::new(),
        };
        self.sample_tip_forces(&mut at);
        at
    }

    /// Samples the forces on the tip.
    #[inline(always)]
    fn sample_tip_forces(&self, at: &mut MotionSamples) {
        let (motion, order) = (self.motion, self.motion.order);
        match self.touch {
            ContactMode::Flight(..) => {
                at.normal = LaneVector::ZERO;
                [at.drop_acceleration] =
                    sum_horner(at.x, order - 1, |k| [(k + 1) as f64 * motion.drop_rate[k + 1]]);
            }
            ContactMode::Stick => [at.friction] = sum_horner(at.x, order - 1, |k| [motion.friction_n[k]]),
            ContactMode::Slip(direction) => {
                let law = &self.linkage.friction;
                let factor = law.direction_factor(direction);
                let staying = LaneVector::splat(factor * law.c);
                let [mu] = match law.a {
                    0.0 if law.is_plain() => [staying],
                    _ => sum_horner(at.x, order, |k| [motion.left[k].slip[0]]),
                };
                at.mu = direction * mu;
                at.friction = -at.mu * at.normal;
                let falling = if law.is_plain() {
                    mu - staying
                } else {
                    (-factor * law.a) * self.sample_varying_part(at, direction, 1)
                };
                at.falling = falling * at.normal;
            }
        }
    }

    /// Both angles at the sampled instants, rad.
    pub(super) fn sample_angles(&self, at: &MotionSamples) -> LaneVectorPair {
        *at.angles.get_or_init(|| sum_horner(at.x, self.motion.order, |k| self.motion.angle[k]))
    }

    /// Velocity of the tip along the sweep at the times `x` after the start of the series, m/s.
    pub(super) fn sample_tip_velocity(&self, x: LaneVector) -> LaneVector {
        let [velocity] = sum_horner(x, self.motion.order, |k| [self.motion.tip_velocity[k]]);
        velocity
    }

    /// Drop of the head at the sampled instants, m, and its rate, m/s.
    pub(super) fn sample_head_drop(&self, at: &MotionSamples) -> [LaneVector; 2] {
        let motion = self.motion;
        if self.is_in_flight() {
            return sum_horner(at.x, motion.order, |k| [motion.drop_m[k], motion.drop_rate[k]]);
        }
        let (l, one) = (self.lengths(), LaneVector::splat(1.0));
        [
            sum_over_links(l, &lanes_per_link(|i| one - at.cos[i])),
            sum_over_links(l, &lanes_per_link(|i| at.sin[i] * at.rate[i])),
        ]
    }

    /// Part `F` of the friction law (`which` 0), its derivative by `b |v3'|` (1) or by the exponent (2).
    pub(super) fn sample_varying_part(&self, at: &MotionSamples, direction: f64, which: usize) -> LaneVector {
        let velocity = self.sample_tip_velocity(at.x);
        LaneVector(velocity.0.map(|v| self.linkage.friction.varying_part(direction * v)[which]))
    }

    /// Part `F` of the friction law in slip: the part of the friction coefficient that changes with speed is
    /// `a F`.
    pub(super) fn friction_decay(&self, at: &MotionSamples, direction: f64) -> LaneVector {
        let law = &self.linkage.friction;
        if law.a == 0.0 || !law.is_plain() {
            return self.sample_varying_part(at, direction, 0);
        }
        let factor = law.direction_factor(direction);
        (1.0 / (factor * law.a)) * (direction * at.mu - LaneVector::splat(factor * law.c))
    }
}

/// Vector of the given times; the last time also fills the remaining lanes.
pub(crate) fn fill_lanes(times: impl IntoIterator<Item = f64>) -> LaneVector {
    let mut row = LaneVector::ZERO;
    for (lane, time) in times.into_iter().take(LANES).enumerate() {
        row.0[lane..].fill(time);
    }
    row
}
