//! Linear least squares with a few predictors.

use nalgebra::{SMatrix, SVector};

/// Coefficients of a least-squares fit and the mean square of its residuals.
pub(super) struct LinearFit<const N: usize> {
    pub coefficients: [f64; N],
    pub mean_square: f64,
}

/// Fits `y` by a linear combination of predictors; a row has the predictors and `y`. `None` if there are too
/// few rows or the predictors are linearly dependent.
pub(super) fn fit_rows<const N: usize>(rows: &[([f64; N], f64)]) -> Option<LinearFit<N>> {
    if rows.len() < 2 * N {
        return None;
    }
    // (arrays, because matrices are slow in a build without optimisation)
    let (mut normal, mut right) = ([[0.0; N]; N], [0.0; N]);
    for (predictors, y) in rows {
        for i in 0..N {
            for j in 0..N {
                normal[i][j] += predictors[i] * predictors[j];
            }
            right[i] += predictors[i] * y;
        }
    }
    let normal = SMatrix::<f64, N, N>::from_fn(|i, j| normal[i][j]);
    let solution: [f64; N] = normal.cholesky()?.solve(&SVector::from(right)).into();
    let miss = |(predictors, y): &([f64; N], f64)| {
        let fitted = (0..N).fold(0.0, |sum, i| sum + solution[i] * predictors[i]);
        (y - fitted) * (y - fitted)
    };
    let mean_square = rows.iter().map(miss).sum::<f64>() / rows.len() as f64;
    mean_square.is_finite().then_some(LinearFit { coefficients: solution, mean_square })
}

/// Powers of `x` from 0 to `N - 1`.
pub(super) fn polynomial_row<const N: usize>(x: f64) -> [f64; N] {
    let mut power = 1.0;
    std::array::from_fn(|exponent| {
        power = if exponent == 0 { 1.0 } else { power * x };
        power
    })
}
