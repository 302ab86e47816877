//! A motion whose variation is asked for.

use super::row::Row;
use crate::blade::Linkage;
use crate::blade::series::{MotionSeries, Touch};
use crate::blade::shoulder::Lean;

/// A quantity of neck and lip.
pub(super) type Pairs = [Row; 2];

/// A motion whose variation is asked for; `K` is that of its series.
#[derive(Debug, Clone, Copy)]
pub struct Course<'a, const K: usize> {
    /// The linkage that moves.
    pub linkage: &'a Linkage,
    /// How its tip touches the glass.
    pub touch: Touch,
    /// On which side its neck leans.
    pub lean: Lean,
    /// Its series.
    pub motion: &'a MotionSeries<K>,
}

impl<const K: usize> Course<'_, K> {
    pub(super) fn flies(&self) -> bool {
        matches!(self.touch, Touch::Flight(..))
    }

    pub(super) fn lengths(&self) -> [f64; 2] {
        [self.linkage.l1_m, self.linkage.l2_m]
    }

    pub(super) fn moments(&self) -> [f64; 2] {
        [self.linkage.m_a, self.linkage.m_b]
    }

    /// `m_a - M l1`, `m_b - M l2`: what the normal force takes of `q'`.
    pub(super) fn arms(&self) -> [f64; 2] {
        let (l, m) = (self.lengths(), self.moments());
        [m[0] - self.linkage.mass_kg * l[0], m[1] - self.linkage.mass_kg * l[1]]
    }
}

/// One row a link.
#[inline(always)]
pub(super) fn rows(f: impl Fn(usize) -> Row) -> Pairs {
    [f(0), f(1)]
}

/// The sum over both links.
#[inline(always)]
pub(super) fn weighted(weights: [f64; 2], rows: &Pairs) -> Row {
    weights[0] * rows[0] + weights[1] * rows[1]
}
