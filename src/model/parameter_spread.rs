//! Uncertainty of fitted parameters, for its propagation to other numbers.

use serde::Serialize;

/// 95 % intervals and correlations of the parameters that a fit estimated.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ParameterSpread {
    /// Names of the parameters.
    pub names: Vec<String>,
    /// Estimates, in SI units.
    pub estimates: Vec<f64>,
    /// Half widths of the 95 % intervals, in SI units; `None` if an interval is open.
    pub halves_95: Vec<Option<f64>>,
    /// Correlations of the estimates; `None` if unknown.
    pub correlations: Vec<Vec<Option<f64>>>,
}

impl ParameterSpread {
    /// Half width of the 95 % interval of a number, by linear propagation. `moved` are the changes of the
    /// number if each parameter moves by the half width of its interval. `None` if a correlation is unknown.
    #[must_use]
    pub fn propagate_95(&self, moved: &[f64]) -> Option<f64> {
        let mut sum = 0.0;
        for (i, a) in moved.iter().enumerate().filter(|(_, a)| **a != 0.0) {
            for (j, b) in moved.iter().enumerate().filter(|(_, b)| **b != 0.0) {
                sum += a * b * if i == j { 1.0 } else { self.correlations[i][j]? };
            }
        }
        Some(sum.max(0.0).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlated_parameters_add_up_or_cancel() {
        let spread = |correlation: Option<f64>| ParameterSpread {
            correlations: vec![vec![Some(1.0), correlation], vec![correlation, Some(1.0)]],
            ..ParameterSpread::default()
        };
        assert_eq!(spread(Some(0.0)).propagate_95(&[3.0, -4.0]), Some(5.0));
        assert_eq!(spread(Some(1.0)).propagate_95(&[3.0, -4.0]), Some(1.0));
        assert_eq!(spread(Some(-1.0)).propagate_95(&[3.0, -3.0]), Some(6.0));
        assert_eq!(spread(None).propagate_95(&[3.0, -4.0]), None);
        assert_eq!(spread(None).propagate_95(&[3.0, 0.0]), Some(3.0));
    }
}
