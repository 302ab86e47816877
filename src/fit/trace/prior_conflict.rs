//! Tests whether the estimates of the constants contradict their priors.
//!
//! With a right model and right priors, the distance of the estimates from the prior means has the covariance
//! `P - C` (prior less posterior), and the excess of the noise and the errors of the recorded head add to it.
//! Constants that are jointly too far from their priors, and parameters that move when the priors are made
//! wider, show that a prior or the model is wrong.

use super::uncertainty_run::SearchEnd;
use crate::model::parameters::describe_parameters;
use nalgebra::{DMatrix, DVector};
use portable_math as math;

/// Standard normal quantile of the test of all constants together: one right fit in a hundred fails it.
const Z_99: f64 = 2.326_347_874_040_841;
/// Directions count only if the recordings reduce the prior variance by at least this fraction. In other
/// directions the estimates stay near the prior means, whatever the recordings show.
const LEAST_REMOVED: f64 = 0.05;
/// Largest allowed shift of an estimate if all priors become twice as wide, in standard deviations of the
/// shifted estimate.
const MAX_SHIFT_SD: f64 = 1.0;
/// Maximum number of constants that a reason names.
const NAMED: usize = 3;

/// Reasons to doubt all parameters because the estimates contradict the priors of constants or parameters.
pub(super) fn prior_conflicts(end: &SearchEnd<'_>) -> Vec<String> {
    let known: Vec<(usize, f64, f64)> = (0..end.at.point.len())
        .filter(|&i| end.model.unknowns.is_parameter(i))
        .filter_map(|i| {
            let [pull, per_unit] = end.model.unknowns.0[i].prior_residual(end.at.point[i])?;
            Some((i, pull, per_unit))
        })
        .collect();
    if known.is_empty() {
        return Vec::new();
    }
    let excess = end.excess_covariance();
    let of_pulls = |covariance: &DMatrix<f64>| {
        let entry = |a: usize, b: usize| covariance[(known[a].0, known[b].0)] * known[a].2 * known[b].2;
        DMatrix::from_fn(known.len(), known.len(), entry)
    };
    let posterior = &end.covariance.curvature - &end.covariance.heads;
    let removed = DMatrix::identity(known.len(), known.len()) - of_pulls(&posterior);
    let pulls: Vec<f64> = known.iter().map(|(_, pull, _)| *pull).collect();
    let name = |i: usize| describe_parameters(end.model.unknowns.parameter_name(i));
    let mut doubts = Vec::new();
    if are_jointly_improbable(&removed, &of_pulls(&excess), &pulls) {
        let mut furthest = known.clone();
        math::sort_by_number(&mut furthest, |a| -a.1.abs());
        let named = furthest.iter().take(NAMED);
        let named: Vec<String> =
            named.map(|(i, pull, _)| format!("{} by {pull:+.1} standard deviations", name(*i))).collect();
        doubts.push(format!(
            "{} constants together contradict what was known of them, most of all {}",
            known.len(),
            named.join(", ")
        ));
    }
    let moved = shifts_by_wider_priors(&end.covariance.information, &known);
    let free = end.model.unknowns.parameters().filter(|&i| end.model.unknowns.0[i].prior.is_none());
    let furthest = free.map(|i| (i, moved[i])).max_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((i, shift)) = furthest.filter(|(_, shift)| *shift > MAX_SHIFT_SD) {
        doubts.push(format!(
            "{} would move by {shift:.1} standard deviations with priors twice as wide",
            name(i)
        ));
    }
    doubts
}

/// Whether the pulls are jointly so large that only one right fit in a hundred exceeds them. A pull is the
/// distance of an estimate from its prior mean, in standard deviations of the prior. `removed` is the
/// covariance of the pulls for noise of the measured size, `excess` is added to it.
fn are_jointly_improbable(removed: &DMatrix<f64>, excess: &DMatrix<f64>, pulls: &[f64]) -> bool {
    let eigen = removed.clone().symmetric_eigen();
    let directions: Vec<usize> = (0..pulls.len()).filter(|&k| eigen.eigenvalues[k] > LEAST_REMOVED).collect();
    let axes = eigen.eigenvectors.select_columns(&directions);
    let along = axes.transpose() * DVector::from_column_slice(pulls);
    let covariance = axes.transpose() * (removed + excess) * &axes;
    let square = covariance.cholesky().map_or(0.0, |covariance| along.dot(&covariance.solve(&along)));
    square > chi_squared_99(directions.len())
}

/// The 99 % quantile of chi2 with `freedoms` degrees of freedom (Wilson and Hilferty 1931).
fn chi_squared_99(freedoms: usize) -> f64 {
    let spread = 2.0 / (9.0 * freedoms.max(1) as f64);
    freedoms as f64 * math::powi(1.0 - spread + Z_99 * spread.sqrt(), 3)
}

/// Absolute shifts of all unknowns if the priors `known` become twice as wide, in standard deviations of the
/// shifted estimates; zeros if the unknowns are then not determined.
fn shifts_by_wider_priors(information: &DMatrix<f64>, known: &[(usize, f64, f64)]) -> Vec<f64> {
    /// Fraction of the information of a prior that is lost if its standard deviation doubles.
    const LOST: f64 = 0.75;
    let (mut wider, n) = (information.clone(), information.nrows());
    let mut slope = DVector::zeros(n);
    for (i, pull, per_unit) in known {
        wider[(*i, *i)] -= LOST * per_unit * per_unit;
        slope[*i] += LOST * pull * per_unit;
    }
    let Some(wider) = wider.cholesky() else { return vec![0.0; n] };
    let (shift, variance) = (wider.solve(&slope), wider.inverse());
    (0..n).map(|i| shift[i].abs() / variance[(i, i)].sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quantiles_are_those_of_a_table() {
        // Abramowitz and Stegun, table 26.8
        for (freedoms, exact) in [(1, 6.635), (5, 15.086), (20, 37.566)] {
            assert!((chi_squared_99(freedoms) / exact - 1.0).abs() < 0.01, "{freedoms}");
        }
        assert!(chi_squared_99(0) == 0.0);
    }

    #[test]
    fn pulls_count_only_where_the_recordings_say_something() {
        let none = DMatrix::zeros(2, 2);
        let removed = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 0.0]));
        assert!(!are_jointly_improbable(&removed, &none, &[2.0, 0.0]));
        assert!(are_jointly_improbable(&removed, &none, &[3.0, 0.0]));
        assert!(!are_jointly_improbable(&DMatrix::zeros(2, 2), &none, &[0.0, 0.0]));
        // the recordings remove a quarter of the prior variance of the second constant, so its pull of 1.6 is
        // as improbable as a pull of 3.2 of the first
        let half = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 0.25]));
        assert!(are_jointly_improbable(&half, &none, &[0.0, 1.6]));
        // with three times the variance by more noise than was measured, this pull is not improbable
        let noise = DMatrix::from_diagonal(&DVector::from_vec(vec![0.0, 0.5]));
        assert!(!are_jointly_improbable(&half, &noise, &[0.0, 1.6]));
    }

    /// An unknown has the prior 0 with standard deviation 1, and is measured as 1 with standard deviation
    /// 0.5. Its estimate is 0.8; with a prior that is twice as wide, it is 0.94.
    #[test]
    fn a_wider_prior_moves_an_estimate_as_a_new_fit_would() {
        let (data, prior) = (4.0, 1.0);
        let estimate = |prior: f64| data / (data + prior);
        let information = DMatrix::from_element(1, 1, data + prior);
        let [shift] = shifts_by_wider_priors(&information, &[(0, estimate(1.0), 1.0)])[..] else { panic!() };
        let exact = (estimate(0.25) - estimate(1.0)) * (data + 0.25f64).sqrt();
        assert!((shift - exact).abs() < 1e-12, "{shift} {exact}");
    }
}
