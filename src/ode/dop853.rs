//! One step of the Dormand-Prince 8(5,3) method with its error estimate and its dense output of order 7.

#![allow(clippy::needless_range_loop)] // several arrays share each index, as in the formulas

use super::DenseOutput;
use super::tableau::{
    A1, A2, A3, A4, A5, A6, A7, A8, A9, A10, A11, A12, A13, A14, A15, C, D3, D4, D5, D6, E3, E5, TableauRow,
};
use crate::math;

/// Order of the error estimate that controls the step: the estimate is of order 7 in the step, so `err ~ h^8`
/// a step.
pub(crate) const ERROR_EXPONENT: f64 = 1.0 / 8.0;
/// Right-hand sides of a step beyond the first, which is the last one of the step before.
pub(crate) const EVALUATIONS_PER_STEP: u64 = 12;
/// Right-hand sides that the dense output needs in addition.
pub(crate) const EVALUATIONS_FOR_DENSE: u64 = 3;
/// Weight of the order 3 estimate against the order 5 one in the combined error (Hairer's code).
const ORDER_3_WEIGHT: f64 = 0.01;

/// The stages of one step of length `h` from `(t, y)`.
#[derive(Debug, Clone)]
pub struct Dop853Stages<const N: usize> {
    /// Start of the step, s.
    pub t: f64,
    /// Length of the step, s.
    pub h: f64,
    /// State at the start.
    pub y: [f64; N],
    /// State at the end, of order 8.
    pub y_end: [f64; N],
    k: [[f64; N]; 16],
}

/// `y + h * sum(a_j k_j)` over the nonzero entries of a row.
#[inline(always)]
fn combine_stages<const N: usize, const M: usize>(
    y: &[f64; N],
    h: f64,
    k: &[[f64; N]; 16],
    row: &TableauRow<M>,
) -> [f64; N] {
    let mut sum = [0.0; N];
    for &(stage, a) in row {
        for i in 0..N {
            sum[i] += a * k[stage][i];
        }
    }
    let mut out = *y;
    for i in 0..N {
        out[i] += h * sum[i];
    }
    out
}

impl<const N: usize> Dop853Stages<N> {
    /// Takes the step; `first` is the derivative at its start, `f(t, y)` the right-hand side (12
    /// evaluations).
    #[inline]
    pub fn take_step(
        f: impl Fn(f64, &[f64; N]) -> [f64; N],
        t: f64,
        y: &[f64; N],
        first: &[f64; N],
        h: f64,
    ) -> Self {
        let mut k = [[0.0; N]; 16];
        k[0] = *first;
        macro_rules! stage {
            ($i:literal, $row:ident) => {
                k[$i] = f(t + C[$i] * h, &combine_stages(y, h, &k, &$row))
            };
        }
        stage!(1, A1);
        stage!(2, A2);
        stage!(3, A3);
        stage!(4, A4);
        stage!(5, A5);
        stage!(6, A6);
        stage!(7, A7);
        stage!(8, A8);
        stage!(9, A9);
        stage!(10, A10);
        stage!(11, A11);
        let y_end = combine_stages(y, h, &k, &A12);
        k[12] = f(t + h, &y_end);
        Self { t, h, y: *y, y_end, k }
    }

    /// Derivative at the end of the step: the first stage of the next one.
    #[inline]
    pub(crate) fn derivative_at_end(&self) -> &[f64; N] {
        &self.k[12]
    }

    /// Combined error estimate in units of the tolerance: at most 1 is accepted. `scale` is the tolerated
    /// error of each component.
    #[inline]
    pub fn error_norm(&self, scale: &[f64; N]) -> f64 {
        let zero = [0.0; N];
        let e5 = combine_stages(&zero, 1.0, &self.k, &E5);
        let e3 = combine_stages(&zero, 1.0, &self.k, &E3);
        let (mut norm5, mut norm3) = (0.0, 0.0);
        for i in 0..N {
            norm5 += math::powi(e5[i] / scale[i], 2);
            norm3 += math::powi(e3[i] / scale[i], 2);
        }
        if norm5 == 0.0 && norm3 == 0.0 {
            return 0.0;
        }
        self.h.abs() * norm5 / ((norm5 + ORDER_3_WEIGHT * norm3) * N as f64).sqrt()
    }

    /// Adds the three stages of the dense output and returns it.
    #[inline]
    pub fn dense_output(&mut self, f: impl Fn(f64, &[f64; N]) -> [f64; N]) -> Dop853DenseOutput<N> {
        let (t, h) = (self.t, self.h);
        self.k[13] = f(t + C[13] * h, &combine_stages(&self.y, h, &self.k, &A13));
        self.k[14] = f(t + C[14] * h, &combine_stages(&self.y, h, &self.k, &A14));
        self.k[15] = f(t + C[15] * h, &combine_stages(&self.y, h, &self.k, &A15));
        let zero = [0.0; N];
        let mut c = [[0.0; N]; 7];
        for i in 0..N {
            let rise = self.y_end[i] - self.y[i];
            c[0][i] = rise;
            c[1][i] = h * self.k[0][i] - rise;
            c[2][i] = 2.0 * rise - h * (self.k[12][i] + self.k[0][i]);
        }
        c[3] = combine_stages(&zero, h, &self.k, &D3);
        c[4] = combine_stages(&zero, h, &self.k, &D4);
        c[5] = combine_stages(&zero, h, &self.k, &D5);
        c[6] = combine_stages(&zero, h, &self.k, &D6);
        Dop853DenseOutput { t, h, y: self.y, c }
    }
}

/// The solution between the ends of a step, of order 7.
#[derive(Debug, Clone)]
pub struct Dop853DenseOutput<const N: usize> {
    t: f64,
    h: f64,
    y: [f64; N],
    c: [[f64; N]; 7],
}

impl<const N: usize> Dop853DenseOutput<N> {
    /// State at the fraction `x` of the step, 0 at its start and 1 at its end.
    #[inline]
    #[must_use]
    pub(crate) fn state_at_fraction(&self, x: f64) -> [f64; N] {
        let rest = 1.0 - x;
        let mut y = self.y;
        for i in 0..N {
            let c = |j: usize| self.c[j][i];
            y[i] += x
                * (c(0) + rest * (c(1) + x * (c(2) + rest * (c(3) + x * (c(4) + rest * (c(5) + x * c(6)))))));
        }
        y
    }
}

impl<const N: usize> DenseOutput<N> for Dop853DenseOutput<N> {
    fn state_at(&self, t: f64) -> [f64; N] {
        self.state_at_fraction((t - self.t) / self.h)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tableau;
    use super::*;

    /// Row sums equal the nodes (Hairer, Nørsett, Wanner, equation II.1.9).
    #[test]
    fn every_row_sums_to_its_node() {
        let sums: [f64; 15] = [
            sum(&A1),
            sum(&A2),
            sum(&A3),
            sum(&A4),
            sum(&A5),
            sum(&A6),
            sum(&A7),
            sum(&A8),
            sum(&A9),
            sum(&A10),
            sum(&A11),
            sum(&A12),
            sum(&A13),
            sum(&A14),
            sum(&A15),
        ];
        for (stage, found) in sums.iter().enumerate() {
            // cancellation among entries up to 44 leaves a few units of 44 eps
            assert!(
                (found - C[stage + 1]).abs() < 44.0 * f64::EPSILON,
                "stage {}: {found} against {}",
                stage + 1,
                C[stage + 1]
            );
        }
    }

    /// Quadrature conditions `sum b_i c_i^(q-1) = 1/q` up to order 8, and their failure at order 9.
    #[test]
    fn the_weights_integrate_powers_to_order_eight() {
        for q in 1..=8 {
            let found: f64 = tableau::A12.iter().map(|&(stage, b)| b * C[stage].powi(q - 1)).sum();
            assert!((found - 1.0 / f64::from(q)).abs() < 1e-14, "order {q}: {found}");
        }
        let ninth: f64 = tableau::A12.iter().map(|&(stage, b)| b * C[stage].powi(8)).sum();
        assert!((ninth - 1.0 / 9.0).abs() > 1e-7, "the method is not of order 9: {ninth}");
    }

    /// The error estimates vanish for a constant derivative.
    #[test]
    fn the_error_weights_sum_to_zero() {
        assert!(sum(&E3).abs() < 1e-14 && sum(&E5).abs() < 1e-14);
    }

    fn sum<const M: usize>(row: &TableauRow<M>) -> f64 {
        row.iter().map(|&(_, a)| a).sum()
    }

    fn rotation(_: f64, y: &[f64; 2]) -> [f64; 2] {
        [y[1], -y[0]]
    }

    /// Neither the even nor the odd derivatives vanish here.
    const PHASE: f64 = 0.7;

    fn exact(t: f64) -> [f64; 2] {
        [(PHASE + t).sin(), (PHASE + t).cos()]
    }

    /// Error after integrating to t = 8 in equal steps.
    fn global_error(steps: u32) -> f64 {
        let h = 8.0 / f64::from(steps);
        let mut y = exact(0.0);
        for i in 0..steps {
            y = Dop853Stages::take_step(rotation, f64::from(i) * h, &y, &rotation(0.0, &y), h).y_end;
        }
        (y[0] - exact(8.0)[0]).hypot(y[1] - exact(8.0)[1])
    }

    /// Largest error of the dense output within one step.
    fn dense_error(h: f64) -> f64 {
        let start = exact(0.0);
        let mut stages = Dop853Stages::take_step(rotation, 0.0, &start, &rotation(0.0, &start), h);
        let dense = stages.dense_output(rotation);
        (1..20)
            .map(|i| f64::from(i) / 20.0)
            .map(|x| (dense.state_at_fraction(x)[0] - exact(x * h)[0]).abs())
            .fold(0.0, f64::max)
    }

    /// The error of the method falls as `h^8`, that of its dense output within one step as `h^8` too: order
    /// 7.
    #[test]
    fn the_method_is_of_order_eight_and_its_dense_output_of_order_seven() {
        let order = (global_error(16) / global_error(32)).log2();
        assert!((order - 8.0).abs() < 0.2, "method: {order}");
        let order = (dense_error(0.4) / dense_error(0.2)).log2();
        assert!((order - 8.0).abs() < 0.2, "dense output: {order}");
    }
}
