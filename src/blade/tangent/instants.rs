//! A motion at a few instants of a step, by its series.

use super::course::{Course, Pairs, rows, weighted};
use super::row::{LANES, Row};
use crate::blade::series::Touch;
use crate::math;
use std::cell::OnceCell;
use std::ops::Deref;

/// Where the links point at a few instants, one a lane.
#[derive(Debug, Clone)]
pub struct Attitude {
    /// Times since the start of the series, s.
    pub x: Row,
    /// Cosines of both angles.
    pub cos: [Row; 2],
    /// Sines of both angles.
    pub sin: [Row; 2],
    /// Angular rates, rad/s.
    pub rate: [Row; 2],
}

/// A motion at a few instants, one a lane.
#[derive(Debug, Clone)]
pub struct Instants {
    /// Where the links point.
    pub attitude: Attitude,
    pub(super) acceleration: Pairs,
    /// `1 / cos` with its first two derivatives in time.
    pub(super) secant: [Pairs; 3],
    /// `sin / cos` likewise.
    pub(super) tangent: [Pairs; 3],
    /// `p'`, `q'`.
    pub(super) along: Pairs,
    pub(super) across: Pairs,
    pub(super) head_acceleration: Row,
    /// `u''`.
    pub(super) drop_acceleration: Row,
    pub(super) normal: Row,
    pub(super) friction: Row,
    /// `sigma mu` in slip, 0 otherwise.
    pub(super) mu: Row,
    /// `N E` in slip, 0 otherwise: what friction loses with speed, over its decay.
    pub(super) falling: Row,
    /// Both angles, rad, once they are asked for.
    angles: OnceCell<Pairs>,
}

/// Sums of series by Horner's rule, side by side.
#[inline(always)]
pub(super) fn sums<const Q: usize>(
    x: Row,
    order: usize,
    coefficients: impl Fn(usize) -> [f64; Q],
) -> [Row; Q] {
    let mut sums = [Row::ZERO; Q];
    for k in (0..=order).rev() {
        for (sum, coefficient) in sums.iter_mut().zip(coefficients(k)) {
            *sum = *sum * x + Row::all(coefficient);
        }
    }
    sums
}

impl Deref for Instants {
    type Target = Attitude;
    #[inline(always)]
    fn deref(&self) -> &Attitude {
        &self.attitude
    }
}

impl<const K: usize> Course<'_, K> {
    /// Where the links point at these times after the start of the series.
    #[inline]
    #[must_use]
    pub fn attitude(&self, x: Row) -> Attitude {
        let motion = self.motion;
        let [cos_0, cos_1, sin_0, sin_1] = sums(x, motion.order, |k| {
            let ([cos_0, cos_1], [sin_0, sin_1]) = (motion.cosines(k), motion.sines(k));
            [cos_0, cos_1, sin_0, sin_1]
        });
        let rate = sums(x, motion.order, |k| motion.rate[k]);
        Attitude { x, cos: [cos_0, cos_1], sin: [sin_0, sin_1], rate }
    }

    /// The motion at these times after the start of its series.
    #[inline]
    #[must_use]
    pub fn instants(&self, x: Row) -> Instants {
        let motion = self.motion;
        let order = motion.order;
        let attitude = self.attitude(x);
        let Attitude { cos, sin, rate, .. } = attitude;
        let [a_0, a_1, head_acceleration, normal] = sums(x, order - 1, |k| {
            let next = (k + 1) as f64;
            let [a_0, a_1] = motion.rate[k + 1];
            [next * a_0, next * a_1, next * motion.head_velocity[k + 1], motion.normal_n(k)]
        });
        let acceleration = [a_0, a_1];
        let swing = rows(|i| rate[i] * rate[i]);
        let along = rows(|i| cos[i] * acceleration[i] - sin[i] * swing[i]);
        let across = rows(|i| sin[i] * acceleration[i] + cos[i] * swing[i]);
        let secant = rows(|i| cos[i].inverse());
        let tangent = rows(|i| sin[i] * secant[i]);
        let turning = rows(|i| rate[i] * secant[i]);
        let secant_1 = rows(|i| tangent[i] * turning[i]);
        let mut at = Instants {
            attitude,
            acceleration,
            secant: [
                secant,
                secant_1,
                rows(|i| across[i] * secant[i] * secant[i] + 2.0 * secant_1[i] * secant_1[i] * cos[i]),
            ],
            tangent: [
                tangent,
                rows(|i| turning[i] * secant[i]),
                rows(|i| acceleration[i] * secant[i] * secant[i] + 2.0 * turning[i] * secant_1[i]),
            ],
            along,
            across,
            head_acceleration,
            drop_acceleration: weighted(self.lengths(), &across),
            normal,
            friction: Row::ZERO,
            mu: Row::ZERO,
            falling: Row::ZERO,
            angles: OnceCell::new(),
        };
        self.press(&mut at);
        at
    }

    /// The forces on the tip.
    #[inline(always)]
    fn press(&self, at: &mut Instants) {
        let motion = self.motion;
        let order = motion.order;
        match self.touch {
            Touch::Flight(..) => {
                at.normal = Row::ZERO;
                [at.drop_acceleration] =
                    sums(at.x, order - 1, |k| [(k + 1) as f64 * motion.drop_rate[k + 1]]);
            }
            Touch::Stick => [at.friction] = sums(at.x, order - 1, |k| [motion.friction_n[k]]),
            Touch::Slip(direction) => {
                let law = &self.linkage.friction;
                let [mu] = match law.a == 0.0 {
                    true => [Row::all(law.c)],
                    false => sums(at.x, order, |k| [motion.left[k].slip[0]]),
                };
                at.mu = direction * mu;
                at.friction = -at.mu * at.normal;
                at.falling = (mu - Row::all(law.c)) * at.normal;
            }
        }
    }

    /// Both angles there, rad.
    pub(super) fn angles(&self, at: &Instants) -> Pairs {
        *at.angles.get_or_init(|| sums(at.x, self.motion.order, |k| self.motion.angle[k]))
    }

    /// Velocity of the tip there, m/s.
    pub(super) fn tip_velocity(&self, x: Row) -> Row {
        let [velocity] = sums(x, self.motion.order, |k| [self.motion.tip_velocity[k]]);
        velocity
    }

    /// Drop of the head there, m, and its rate, m/s.
    pub(super) fn drop(&self, at: &Instants) -> [Row; 2] {
        let motion = self.motion;
        if self.flies() {
            return sums(at.x, motion.order, |k| [motion.drop_m[k], motion.drop_rate[k]]);
        }
        let l = self.lengths();
        let one = Row::all(1.0);
        [weighted(l, &rows(|i| one - at.cos[i])), weighted(l, &rows(|i| at.sin[i] * at.rate[i]))]
    }

    /// `e`, the decay of friction with speed: of which the falling part of the coefficient is the `a`-fold.
    pub(super) fn decay(&self, at: &Instants, direction: f64) -> Row {
        let law = &self.linkage.friction;
        if law.a == 0.0 {
            let velocity = self.tip_velocity(at.x);
            return Row(velocity.0.map(|v| math::exp(-law.b_s_per_m * direction * v)));
        }
        (1.0 / law.a) * (direction * at.mu - Row::all(law.c))
    }
}

/// Times that fill a row: the last one fills what is left.
#[must_use]
pub fn row_of(times: impl IntoIterator<Item = f64>) -> Row {
    let mut row = Row::ZERO;
    for (lane, time) in times.into_iter().take(LANES).enumerate() {
        row.0[lane..].fill(time);
    }
    row
}
