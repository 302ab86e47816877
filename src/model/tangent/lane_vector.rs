//! A short vector of numbers for parallel arithmetic, with one number (lane) per direction of a derivative,
//! or per instant.

use std::array::from_fn;
use std::ops::{Add, AddAssign, Index, IndexMut, Mul, Neg, Sub, SubAssign};

/// Number of lanes, the width of a vector register of most processors.
pub(crate) const LANES: usize = 4;

/// One number per direction of a derivative, or per instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LaneVector(pub [f64; LANES]);

impl LaneVector {
    /// Zero in every lane.
    pub(crate) const ZERO: Self = Self([0.0; LANES]);

    /// The same number in every lane.
    #[inline(always)]
    pub(crate) const fn splat(x: f64) -> Self {
        Self([x; LANES])
    }

    /// Reciprocal of each number.
    #[inline(always)]
    pub(crate) fn inverse(self) -> Self {
        Self(from_fn(|lane| 1.0 / self.0[lane]))
    }

    /// Scalar product of two vectors.
    #[inline(always)]
    pub(crate) fn dot(&self, other: &Self) -> f64 {
        (0..LANES).map(|lane| self.0[lane] * other.0[lane]).sum()
    }

    /// Sum of the numbers.
    #[inline(always)]
    pub(crate) fn sum(&self) -> f64 {
        self.0.iter().sum()
    }

    /// Adds `factor` times the vector `row`.
    #[inline(always)]
    pub(crate) fn add_scaled(&mut self, factor: f64, row: &Self) {
        for lane in 0..LANES {
            self.0[lane] += factor * row.0[lane];
        }
    }

    /// Whether all numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.0.iter().all(|x| x.is_finite())
    }
}

macro_rules! operators {
    ($($binary:ident $method:ident, $assign:ident $assign_method:ident;)*) => {$(
        impl $binary for LaneVector {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(from_fn(|lane| self.0[lane].$method(other.0[lane])))
            }
        }

        impl $assign for LaneVector {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                *self = self.$method(other);
            }
        }
    )*};
}

operators! {
    Add add, AddAssign add_assign;
    Sub sub, SubAssign sub_assign;
}

impl Neg for LaneVector {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(from_fn(|lane| -self.0[lane]))
    }
}

impl Mul<LaneVector> for f64 {
    type Output = LaneVector;
    #[inline(always)]
    fn mul(self, row: LaneVector) -> LaneVector {
        LaneVector(from_fn(|lane| self * row.0[lane]))
    }
}

impl Mul for LaneVector {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] * other.0[lane]))
    }
}

impl Index<usize> for LaneVector {
    type Output = f64;
    #[inline(always)]
    fn index(&self, lane: usize) -> &f64 {
        &self.0[lane]
    }
}

impl IndexMut<usize> for LaneVector {
    #[inline(always)]
    fn index_mut(&mut self, lane: usize) -> &mut f64 {
        &mut self.0[lane]
    }
}
