//! What a linear model of the residuals can determine: rank, condition, deviations, correlations,
//! combinations.
//!
//! `J = d r / d u` is in standard deviations of the features per length of the unit box. A singular direction
//! is informative if its 95 % interval fits into the box; the information matrix `J^T J` is inverted on those
//! directions alone.

use super::axis::SearchAxis;
use crate::math;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Half-width of a 95 % interval in standard deviations of a normal variable.
pub const Z_95: f64 = 1.96;
/// Gain in cost that a parameter's 95 % interval spans (chi-squared of one degree of freedom).
pub(crate) const CHI_SQUARED_95: f64 = 3.84;
/// Smallest singular value, per length of the box, of an informative direction: its 95 % interval is as wide
/// as the box.
pub(crate) const MIN_INFORMATIVE: f64 = 2.0 * Z_95;
/// Singular values below this share of the largest are rounding.
pub const ROUNDING_SHARE: f64 = 1e-9;
/// Share (squared cosine) of uninformative directions in a parameter from which on the parameter is not
/// determined.
pub(crate) const OPEN_SHARE: f64 = 0.01;
/// Exponents below this share of the largest one of a combination are not named.
const MIN_NAMED_EXPONENT: f64 = 0.05;

/// Singular directions of a Jacobian in the space of the parameters.
#[derive(Debug, Clone)]
pub struct SingularDirections {
    /// Singular value and direction, the most informative first; all of unit length and at right angles.
    all: Vec<(f64, Vec<f64>)>,
    /// Number of informative directions.
    pub rank: usize,
}

/// A product of powers of the parameters that the features determine, or leave open.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterCombination {
    /// Exponents by parameter; the largest is 1, those below 0.05 are left out.
    pub exponents: BTreeMap<String, f64>,
    /// Standard deviation of its logarithm; for one that is left open, that of which the box allows.
    pub sd_relative: f64,
    /// Whether the features determine it.
    pub determined: bool,
}

impl ParameterCombination {
    /// Such as `friction.c friction.a^0.31`.
    #[must_use]
    pub fn describe(&self) -> String {
        let mut factors: Vec<(&String, f64)> = self.exponents.iter().map(|(name, e)| (name, *e)).collect();
        factors.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        let factor = |(name, e): (&String, f64)| {
            if (e - 1.0).abs() < 0.005 { name.clone() } else { format!("{name}^{e:.2}") }
        };
        factors.into_iter().map(factor).collect::<Vec<_>>().join(" ")
    }
}

impl SingularDirections {
    /// Of a Jacobian, a column a parameter.
    #[must_use]
    pub fn from_jacobian(jacobian: &DMatrix<f64>) -> Self {
        let columns = jacobian.ncols();
        // rows of zeros say nothing and make the decomposition complete
        let padded = jacobian.clone().resize_vertically(jacobian.nrows().max(columns), 0.0);
        let svd = padded.svd(false, true);
        let rows = svd.v_t.iter().flat_map(|v_t| {
            v_t.row_iter().map(|row| row.iter().copied().collect::<Vec<f64>>()).collect::<Vec<_>>()
        });
        let mut all: Vec<(f64, Vec<f64>)> = svd.singular_values.iter().copied().zip(rows).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let threshold =
            all.first().map_or(MIN_INFORMATIVE, |(largest, _)| MIN_INFORMATIVE.max(ROUNDING_SHARE * largest));
        let rank = all.iter().filter(|(value, _)| *value > threshold).count();
        Self { all, rank }
    }

    /// Largest singular value over the smallest; infinite where one is zero.
    #[must_use]
    pub fn condition_number(&self) -> f64 {
        match (self.all.first(), self.all.last()) {
            (Some((largest, _)), Some((smallest, _))) if *smallest > ROUNDING_SHARE * largest => {
                largest / smallest
            }
            _ => f64::INFINITY,
        }
    }

    /// Standard deviation of a coordinate from the informative directions, and its share in the others.
    #[must_use]
    pub fn coordinate_sd(&self, axis: usize) -> (f64, f64) {
        let component = |direction: &Vec<f64>| math::powi(direction.get(axis).copied().unwrap_or(0.0), 2);
        let (known, open) = self.all.split_at(self.rank);
        let variance: f64 =
            known.iter().map(|(value, direction)| component(direction) / (value * value)).sum();
        (variance.sqrt(), open.iter().map(|(_, direction)| component(direction)).sum())
    }

    /// Whether the informative directions determine a coordinate.
    #[must_use]
    pub fn determines(&self, axis: usize) -> bool {
        self.coordinate_sd(axis).1 < OPEN_SHARE
    }

    /// Directions that the features leave open.
    #[must_use]
    pub fn open_directions(&self) -> Vec<&[f64]> {
        self.all.iter().skip(self.rank).map(|(_, direction)| direction.as_slice()).collect()
    }

    /// Correlation of two estimates; `None` where either is not determined.
    #[must_use]
    pub fn correlation(&self, a: usize, b: usize) -> Option<f64> {
        if !(self.determines(a) && self.determines(b)) {
            return None;
        }
        let product = |direction: &[f64]| Some(direction.get(a)? * direction.get(b)?);
        let covariance: f64 = self
            .all
            .iter()
            .take(self.rank)
            .filter_map(|(value, direction)| Some(product(direction)? / (value * value)))
            .sum();
        Some((covariance / (self.coordinate_sd(a).0 * self.coordinate_sd(b).0)).clamp(-1.0, 1.0))
    }

    /// What is determined (most precise first) and what is left open, as products of powers at the point
    /// `unit`.
    #[must_use]
    pub fn combinations(
        &self,
        names: &[String],
        axes: &[SearchAxis],
        unit: &[f64],
    ) -> Vec<ParameterCombination> {
        let slopes: Vec<f64> =
            axes.iter().zip(unit).map(|(axis, u)| axis.bounds.log_slope(*u).unwrap_or(0.0)).collect();
        let one = |(rank, (value, direction)): (usize, &(f64, Vec<f64>))| {
            let determined = rank < self.rank;
            // a determined sum d_i u_i has exponents d_i / slope_i; along an open direction ln p_i moves by
            // d_i slope_i
            let exponent = |(d, slope): (&f64, &f64)| {
                let determines = if *slope == 0.0 { 0.0 } else { d / slope };
                if determined { determines } else { d * slope }
            };
            let exponents: Vec<f64> = direction.iter().zip(&slopes).map(exponent).collect();
            let largest = exponents
                .iter()
                .copied()
                .fold(0.0, |most: f64, e| if e.abs() > most.abs() { e } else { most });
            let named = names
                .iter()
                .zip(&exponents)
                .filter(|(_, e)| e.abs() >= MIN_NAMED_EXPONENT * largest.abs() && largest != 0.0);
            let sd = if determined {
                1.0 / (value * largest.abs())
            } else {
                largest.abs() / value.max(MIN_INFORMATIVE / 2.0 / Z_95)
            };
            let exponents = named.map(|(name, e)| (name.clone(), e / largest)).collect();
            ParameterCombination { exponents, sd_relative: if sd.is_finite() { sd } else { 0.0 }, determined }
        };
        self.all.iter().enumerate().map(one).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::scale::{Bounds, BoundsSpacing};
    use super::*;

    fn names() -> [String; 2] {
        ["p".to_owned(), "q".to_owned()]
    }

    fn axes() -> Vec<SearchAxis> {
        vec![
            Bounds::new(0.1, 10.0, BoundsSpacing::Log).unwrap().into(),
            Bounds::new(1.0, 10.0, BoundsSpacing::Log).unwrap().into(),
        ]
    }

    /// `r = ln(p^a q^b) / sd` as rows of the Jacobian in the unit box.
    fn rows(of: &[(f64, f64, f64)]) -> DMatrix<f64> {
        let (lp, lq) = (100.0_f64.ln(), 10.0_f64.ln());
        DMatrix::from_fn(of.len(), 2, |row, column| {
            if column == 0 { of[row].0 * lp / of[row].2 } else { of[row].1 * lq / of[row].2 }
        })
    }

    #[test]
    fn a_product_is_named_with_its_exponents_and_deviation() {
        let found = SingularDirections::from_jacobian(&rows(&[(1.0, 0.5, 0.01)]));
        assert_eq!(found.rank, 1);
        assert!(!found.determines(0) && !found.determines(1) && found.condition_number().is_infinite());
        let combinations = found.combinations(&names(), &axes(), &[0.5, 0.5]);
        assert_eq!(combinations[0].describe(), "p q^0.50");
        assert!(combinations[0].determined && (combinations[0].sd_relative - 0.01).abs() < 1e-12);
        // p q^0.5 stays the same where ln q = -2 ln p
        let open = &combinations[1];
        assert!(
            !open.determined && (open.exponents["p"] / open.exponents["q"] + 0.5).abs() < 1e-9,
            "{open:?}"
        );
    }

    #[test]
    fn two_features_determine_both_and_their_correlation_is_that_of_least_squares() {
        // r1 = ln p / 0.01, r2 = ln(p q) / 0.02: cov = [[1, -1], [-1, 5]] 1e-4
        let found = SingularDirections::from_jacobian(&rows(&[(1.0, 0.0, 0.01), (1.0, 1.0, 0.02)]));
        assert_eq!(found.rank, 2);
        assert!((found.coordinate_sd(0).0 * 100.0_f64.ln() - 0.01).abs() < 1e-12);
        assert!((found.coordinate_sd(1).0 * 10.0_f64.ln() - 0.01 * 5.0_f64.sqrt()).abs() < 1e-12);
        assert!((found.correlation(0, 1).unwrap() + 1.0 / 5.0_f64.sqrt()).abs() < 1e-12);
        assert!(found.condition_number() > 1.0 && found.open_directions().is_empty());
    }

    #[test]
    fn nothing_is_known_from_nothing() {
        let found = SingularDirections::from_jacobian(&DMatrix::zeros(0, 2));
        assert_eq!((found.rank, found.open_directions().len()), (0, 2));
        assert_eq!(found.correlation(0, 1), None);
    }
}
