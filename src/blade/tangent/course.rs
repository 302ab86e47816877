//! A motion whose variation is asked for.

use super::row::LaneVector;
use crate::blade::Linkage;
use crate::blade::series::{ContactMode, MotionSeries};
use crate::blade::shoulder::ShoulderContact;

/// A quantity of neck and lip.
pub(super) type LaneVectorPair = [LaneVector; 2];

/// A motion whose variation is asked for; `K` is that of its series.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceMotion<'a, const K: usize> {
    /// The linkage that moves.
    pub linkage: &'a Linkage,
    /// How its tip touches the glass.
    pub touch: ContactMode,
    /// On which side its neck leans.
    pub lean: ShoulderContact,
    /// Its series.
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

    /// `m_a - M l1`, `m_b - M l2`: what the normal force takes of `q'`.
    pub(super) fn arms(&self) -> [f64; 2] {
        let (l, m) = (self.lengths(), self.moments());
        [m[0] - self.linkage.mass_kg * l[0], m[1] - self.linkage.mass_kg * l[1]]
    }
}

/// One row a link.
#[inline(always)]
pub(super) fn lanes_per_link(f: impl Fn(usize) -> LaneVector) -> LaneVectorPair {
    [f(0), f(1)]
}

/// The sum over both links.
#[inline(always)]
pub(super) fn sum_over_links(weights: [f64; 2], rows: &LaneVectorPair) -> LaneVector {
    weights[0] * rows[0] + weights[1] * rows[1]
}
