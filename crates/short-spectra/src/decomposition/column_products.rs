//! Products of whitened columns, from which the change of the sum of squares follows without a fit: how much
//! further columns explain, and how much it rises without some of them.

use super::problem::dot;
use nalgebra::{DMatrix, DVector};

/// Added to the diagonal of the scaled normal matrix, so that dependent columns do not make it singular.
const RIDGE: f64 = 1e-10;

/// Products of columns with each other and with a residual. Each column is scaled to unit length.
pub(crate) struct ColumnProducts {
    /// Lengths of the columns; 0 for a column that depends on the fixed parts.
    lengths: Vec<f64>,
    matrix: DMatrix<f64>,
    along: Vec<f64>,
}

impl ColumnProducts {
    /// The products of whitened columns from which the projections onto fixed parts are subtracted. `lengths`
    /// are those of the columns, or 0 for columns that depend on the fixed parts.
    pub(crate) fn new(columns: &[Vec<f64>], lengths: Vec<f64>, residual: &[f64]) -> Self {
        let n = columns.len();
        let scaled = |i: usize, product: f64| if lengths[i] > 0.0 { product / lengths[i] } else { 0.0 };
        let mut matrix = DMatrix::identity(n, n) * (1.0 + RIDGE);
        for i in 0..n {
            for j in 0..i {
                matrix[(i, j)] = scaled(i, scaled(j, dot(&columns[i], &columns[j])));
                matrix[(j, i)] = matrix[(i, j)];
            }
        }
        let along = (0..n).map(|i| scaled(i, dot(&columns[i], residual))).collect();
        Self { lengths, matrix, along }
    }

    fn matrix_of(&self, columns: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(columns.len(), columns.len(), |i, j| self.matrix[(columns[i], columns[j])])
    }

    /// Sum of squares of the residual that these columns explain together; 0 if they are dependent.
    pub(crate) fn explained_squares(&self, columns: &[usize]) -> f64 {
        let along = DVector::from_fn(columns.len(), |i, _| self.along[columns[i]]);
        self.matrix_of(columns).cholesky().map_or(0.0, |factor| along.dot(&factor.solve(&along)))
    }

    /// Covariance of the coefficients of the columns for noise of unit variance.
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        /// Variance of a coefficient that the columns do not determine, in the square of its unit.
        const UNKNOWN: f64 = 1e6;
        let n = self.lengths.len();
        let Some(inverse) = self.matrix.clone().cholesky().map(|factor| factor.inverse()) else {
            return DMatrix::from_diagonal_element(n, n, UNKNOWN);
        };
        DMatrix::from_fn(n, n, |i, j| match (self.lengths[i], self.lengths[j]) {
            (a, b) if a > 0.0 && b > 0.0 => inverse[(i, j)] / (a * b),
            _ => f64::from(u8::from(i == j)) * UNKNOWN,
        })
    }

    /// Rise of the sum of squares, to second order, if the amplitudes or parameters `dropped` change from
    /// `values` to 0 and those `kept` are fitted again; infinite if the columns are dependent.
    pub(crate) fn squares_without(&self, dropped: &[usize], values: &[f64], kept: &[usize]) -> f64 {
        // in the Cholesky factor of the matrix with the dropped columns last, the last block is the factor of
        // their Schur complement
        let order: Vec<usize> = kept.iter().chain(dropped).copied().collect();
        let Some(factor) = self.matrix_of(&order).cholesky() else { return f64::INFINITY };
        let size = dropped.len();
        let block = factor.l_dirty().view((kept.len(), kept.len()), (size, size)).lower_triangle();
        let steps = DVector::from_fn(size, |i, _| values[i] * self.lengths[dropped[i]]);
        block.tr_mul(&steps).norm_squared()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns() -> Vec<Vec<f64>> {
        let value = |i: i32, k: f64| (0.3 * k * f64::from(i) + 0.2 * k * k).sin();
        [1.0, 2.5, 4.0].map(|k| (0..40).map(|i| value(i, k)).collect()).to_vec()
    }

    fn products(columns: &[Vec<f64>], residual: &[f64]) -> ColumnProducts {
        let lengths = columns.iter().map(|c| dot(c, c).sqrt()).collect();
        ColumnProducts::new(columns, lengths, residual)
    }

    /// Sum of squares that columns leave, by an orthogonal decomposition.
    fn left_squares(columns: &[Vec<f64>], values: &[f64]) -> f64 {
        let matrix = DMatrix::from_fn(values.len(), columns.len(), |i, j| columns[j][i]);
        let values = DVector::from_column_slice(values);
        let q = matrix.qr().q();
        (&values - &q * q.tr_mul(&values)).norm_squared()
    }

    #[test]
    fn changes_of_the_sum_of_squares_are_those_of_fits() {
        let all = columns();
        let values: Vec<f64> = (0..40).map(|i| (0.7 * f64::from(i)).cos() + 0.1 * f64::from(i % 7)).collect();
        let explained = products(&all, &values).explained_squares(&[0, 2]);
        let exact = dot(&values, &values) - left_squares(&[all[0].clone(), all[2].clone()], &values);
        assert!((explained / exact - 1.0).abs() < 1e-8, "{explained} {exact}");
        // the amplitudes of all three columns, then the rise without the second
        let matrix = DMatrix::from_fn(40, 3, |i, j| all[j][i]);
        let amplitudes =
            matrix.clone().svd(true, true).solve(&DVector::from_column_slice(&values), 1e-12).unwrap();
        let rise = products(&all, &values).squares_without(&[1], &[amplitudes[1]], &[0, 2]);
        let exact = left_squares(&[all[0].clone(), all[2].clone()], &values) - left_squares(&all, &values);
        assert!((rise / exact - 1.0).abs() < 1e-8, "{rise} {exact}");
        let covariance = products(&all, &values).covariance();
        let inverse = (matrix.transpose() * matrix).try_inverse().unwrap();
        assert!((covariance - &inverse).norm() < 1e-8 * inverse.norm());
    }
}
