//! One step of the Dormand-Prince 8(5,3) method with its error estimate and its dense output of order 7.
#![allow(clippy::needless_range_loop)] // several arrays share each index, as in the formulas

use super::DenseOutput;
use portable_math as math;

/// Exponent of the step control: the error estimate of a step is of order 8, `err ~ h^8`.
pub(crate) const ERROR_EXPONENT: f64 = 1.0 / 8.0;
/// Number of evaluations of the right-hand side in a step. The first stage is not counted, because it is the
/// last stage of the previous step.
pub(crate) const EVALUATIONS_PER_STEP: u64 = 12;
/// Number of additional evaluations of the right-hand side for the dense output.
pub(crate) const EVALUATIONS_FOR_DENSE: u64 = 3;
/// Weight of the order 3 estimate relative to the order 5 estimate in the combined error (Hairer's code).
const ORDER_3_WEIGHT: f64 = 0.01;
/// The stages of one step of length `h` from `(t, y)`.
#[derive(Debug, Clone)]
pub(crate) struct StepStages<const N: usize> {
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

/// `y + h * sum(a_j k_j)` over the nonzero coefficients `a_j` in a row of the tableau.
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

impl<const N: usize> StepStages<N> {
    /// Takes the step with 12 evaluations of the right-hand side `f(t, y)`; `first` is the derivative at the
    /// start.
    #[inline]
    pub(crate) fn take_step(
        f: impl Fn(f64, &[f64; N]) -> [f64; N],
        t: f64,
        y: &[f64; N],
        first: &[f64; N],
        h: f64,
    ) -> Self {
        let mut k = [[0.0; N]; 16];
        k[0] = *first;
        macro_rules! stages {
            ($($i:literal $row:ident),*) => {
                $(k[$i] = f(t + C[$i] * h, &combine_stages(y, h, &k, &$row));)*
            };
        }
        stages!(1 A1, 2 A2, 3 A3, 4 A4, 5 A5, 6 A6, 7 A7, 8 A8, 9 A9, 10 A10, 11 A11);
        let y_end = combine_stages(y, h, &k, &A12);
        k[12] = f(t + h, &y_end);
        Self { t, h, y: *y, y_end, k }
    }

    /// Derivative at the end of the step: the first stage of the next one.
    #[inline]
    pub(crate) fn derivative_at_end(&self) -> &[f64; N] {
        &self.k[12]
    }

    /// Combined error estimate in units of the tolerance. The step is accepted if the estimate is at most 1.
    /// `scale` is the tolerated error of each component of the state.
    #[inline]
    pub(crate) fn error_norm(&self, scale: &[f64; N]) -> f64 {
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
    pub(crate) fn dense_output(&mut self, f: impl Fn(f64, &[f64; N]) -> [f64; N]) -> StepOutput<N> {
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
        StepOutput { t, h, y: self.y, c }
    }
}

/// The solution between the ends of a step, of order 7.
#[derive(Debug, Clone)]
pub(crate) struct StepOutput<const N: usize> {
    t: f64,
    h: f64,
    y: [f64; N],
    c: [[f64; N]; 7],
}

impl<const N: usize> StepOutput<N> {
    /// State at the fraction `x` of the step, 0 at its start and 1 at its end.
    #[inline]
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

impl<const N: usize> DenseOutput<N> for StepOutput<N> {
    fn state_at(&self, t: f64) -> [f64; N] {
        self.state_at_fraction((t - self.t) / self.h)
    }
}

// Coefficients of the Dormand-Prince method of order 8 with embedded orders 5 and 3 and dense output of order
// 7. Source: E. Hairer, S. P. Nørsett, G. Wanner, "Solving Ordinary Differential Equations I", 2nd ed.,
// Springer 1993, section II.5, and the authors' code DOP853. Stages count from 0.

/// Joins the lines of a table into one array.
const fn join_lines<T: Copy, const M: usize>(lines: &[&[T]]) -> [T; M] {
    let mut out = [lines[0][0]; M];
    let (mut line, mut column, mut i) = (0, 0, 0);
    while i < M {
        if column == lines[line].len() {
            (line, column) = (line + 1, 0);
        }
        out[i] = lines[line][column];
        (column, i) = (column + 1, i + 1);
    }
    out
}

/// One row of coefficients: (stage, coefficient) for the nonzero entries.
pub(crate) type TableauRow<const M: usize> = [(usize, f64); M];

/// Nodes `c` of the 16 stages. Stage 12 is the derivative at the end of the step; stages 13 to 15 are for the
/// dense output only.
pub(crate) const C: [f64; 16] = join_lines(&[
    &[0.0, 0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726],
    &[0.3333333333333333, 0.25, 0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571, 1.0],
    &[1.0, 0.1, 0.2, 0.7777777777777778],
]);
/// Coefficients `a` of stage 1.
pub(crate) const A1: TableauRow<1> = [(0, 0.05260015195876773)];
/// Coefficients `a` of stage 2.
pub(crate) const A2: TableauRow<2> = [(0, 0.0197250569845379), (1, 0.0591751709536137)];
/// Coefficients `a` of stage 3.
pub(crate) const A3: TableauRow<2> = [(0, 0.02958758547680685), (2, 0.08876275643042054)];
/// Coefficients `a` of stage 4.
pub(crate) const A4: TableauRow<3> =
    [(0, 0.2413651341592667), (2, -0.8845494793282861), (3, 0.924834003261792)];
/// Coefficients `a` of stage 5.
pub(crate) const A5: TableauRow<3> =
    [(0, 0.037037037037037035), (3, 0.17082860872947386), (4, 0.12546768756682242)];
/// Coefficients `a` of stage 6.
pub(crate) const A6: TableauRow<4> =
    [(0, 0.037109375), (3, 0.17025221101954405), (4, 0.06021653898045596), (5, -0.017578125)];
/// Coefficients `a` of stage 7.
pub(crate) const A7: TableauRow<5> = join_lines(&[
    &[(0, 0.03709200011850479), (3, 0.17038392571223998), (4, 0.10726203044637328)],
    &[(5, -0.015319437748624402), (6, 0.008273789163814023)],
]);
/// Coefficients `a` of stage 8.
pub(crate) const A8: TableauRow<6> = join_lines(&[
    &[(0, 0.6241109587160757), (3, -3.3608926294469414), (4, -0.868219346841726)],
    &[(5, 27.59209969944671), (6, 20.154067550477894), (7, -43.48988418106996)],
]);
/// Coefficients `a` of stage 9.
pub(crate) const A9: TableauRow<7> = join_lines(&[
    &[(0, 0.47766253643826434), (3, -2.4881146199716677), (4, -0.590290826836843)],
    &[(5, 21.230051448181193), (6, 15.279233632882423), (7, -33.28821096898486)],
    &[(8, -0.020331201708508627)],
]);
/// Coefficients `a` of stage 10.
pub(crate) const A10: TableauRow<8> = join_lines(&[
    &[(0, -0.9371424300859873), (3, 5.186372428844064), (4, 1.0914373489967295)],
    &[(5, -8.149787010746927), (6, -18.52006565999696), (7, 22.739487099350505)],
    &[(8, 2.4936055526796523), (9, -3.0467644718982196)],
]);
/// Coefficients `a` of stage 11.
pub(crate) const A11: TableauRow<9> = join_lines(&[
    &[(0, 2.273310147516538), (3, -10.53449546673725), (4, -2.0008720582248625), (5, -17.9589318631188)],
    &[(6, 27.94888452941996), (7, -2.8589982771350235), (8, -8.87285693353063), (9, 12.360567175794303)],
    &[(10, 0.6433927460157636)],
]);
/// Coefficients `a` of stage 12, which are the weights `b` of the order 8 solution.
pub(crate) const A12: TableauRow<8> = join_lines(&[
    &[(0, 0.054293734116568765), (5, 4.450312892752409), (6, 1.8915178993145003)],
    &[(7, -5.801203960010585), (8, 0.3111643669578199), (9, -0.1521609496625161)],
    &[(10, 0.20136540080403034), (11, 0.04471061572777259)],
]);
/// Coefficients `a` of stage 13.
pub(crate) const A13: TableauRow<8> = join_lines(&[
    &[(0, 0.056167502283047954), (6, 0.25350021021662483), (7, -0.2462390374708025)],
    &[(8, -0.12419142326381637), (9, 0.15329179827876568), (10, 0.00820105229563469)],
    &[(11, 0.007567897660545699), (12, -0.008298)],
]);
/// Coefficients `a` of stage 14.
pub(crate) const A14: TableauRow<8> = join_lines(&[
    &[(0, 0.03183464816350214), (5, 0.028300909672366776), (6, 0.053541988307438566)],
    &[(7, -0.05492374857139099), (10, -0.00010834732869724932), (11, 0.0003825710908356584)],
    &[(12, -0.00034046500868740456), (13, 0.1413124436746325)],
]);
/// Coefficients `a` of stage 15.
pub(crate) const A15: TableauRow<8> = join_lines(&[
    &[(0, -0.42889630158379194), (5, -4.697621415361164), (6, 7.683421196062599), (7, 4.06898981839711)],
    &[(8, 0.3567271874552811), (12, -0.0013990241651590145), (13, 2.9475147891527724)],
    &[(14, -9.15095847217987)],
]);
/// Weights of the stages in the order 3 error estimate.
pub(crate) const E3: TableauRow<8> = join_lines(&[
    &[(0, -0.18980075407240762), (5, 4.450312892752409), (6, 1.8915178993145003)],
    &[(7, -5.801203960010585), (8, -0.4226823213237919), (9, -0.1521609496625161)],
    &[(10, 0.20136540080403034), (11, 0.02265179219836082)],
]);
/// Weights of the stages in the order 5 error estimate.
pub(crate) const E5: TableauRow<8> = join_lines(&[
    &[(0, 0.01312004499419488), (5, -1.2251564463762044), (6, -0.4957589496572502)],
    &[(7, 1.6643771824549864), (8, -0.35032884874997366), (9, 0.3341791187130175)],
    &[(10, 0.08192320648511571), (11, -0.022355307863886294)],
]);
/// Weights of the stages in coefficient 3 of the dense output.
pub(crate) const D3: TableauRow<12> = join_lines(&[
    &[(0, -8.428938276109013), (5, 0.5667149535193777), (6, -3.0689499459498917), (7, 2.38466765651207)],
    &[(8, 2.117034582445028), (9, -0.871391583777973), (10, 2.2404374302607883)],
    &[(11, 0.6315787787694688), (12, -0.08899033645133331), (13, 18.148505520854727)],
    &[(14, -9.194632392478356), (15, -4.436036387594894)],
]);
/// Weights of the stages in coefficient 4 of the dense output.
pub(crate) const D4: TableauRow<12> = join_lines(&[
    &[(0, 10.427508642579134), (5, 242.28349177525817), (6, 165.20045171727028)],
    &[(7, -374.5467547226902), (8, -22.113666853125306), (9, 7.733432668472264)],
    &[(10, -30.674084731089398), (11, -9.332130526430229), (12, 15.697238121770845)],
    &[(13, -31.139403219565178), (14, -9.35292435884448), (15, 35.81684148639408)],
]);
/// Weights of the stages in coefficient 5 of the dense output.
pub(crate) const D5: TableauRow<12> = join_lines(&[
    &[(0, 19.985053242002433), (5, -387.0373087493518), (6, -189.17813819516758)],
    &[(7, 527.8081592054236), (8, -11.57390253995963), (9, 6.8812326946963), (10, -1.0006050966910838)],
    &[(11, 0.7777137798053443), (12, -2.778205752353508), (13, -60.19669523126412)],
    &[(14, 84.32040550667716), (15, 11.99229113618279)],
]);
/// Weights of the stages in coefficient 6 of the dense output.
pub(crate) const D6: TableauRow<12> = join_lines(&[
    &[(0, -25.69393346270375), (5, -154.18974869023643), (6, -231.5293791760455)],
    &[(7, 357.6391179106141), (8, 93.40532418362432), (9, -37.45832313645163), (10, 104.0996495089623)],
    &[(11, 29.8402934266605), (12, -43.53345659001114), (13, 96.32455395918828)],
    &[(14, -39.17726167561544), (15, -149.72683625798564)],
]);

#[cfg(test)]
mod tests {
    use super::*;

    /// The coefficients of every stage add up to its node (Hairer, Nørsett, Wanner, equation II.1.9).
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
            // cancellation among entries of size up to 44 leaves an error of the order of 44 eps
            assert!(
                (found - C[stage + 1]).abs() < 44.0 * f64::EPSILON,
                "stage {}: {found} against {}",
                stage + 1,
                C[stage + 1]
            );
        }
    }

    /// The quadrature conditions `sum b_i c_i^(q-1) = 1/q` hold up to order 8 and fail at order 9.
    #[test]
    fn the_weights_integrate_powers_to_order_eight() {
        for q in 1..=8 {
            let found: f64 = A12.iter().map(|&(stage, b)| b * C[stage].powi(q - 1)).sum();
            assert!((found - 1.0 / f64::from(q)).abs() < 1e-14, "order {q}: {found}");
        }
        let ninth: f64 = A12.iter().map(|&(stage, b)| b * C[stage].powi(8)).sum();
        assert!((ninth - 1.0 / 9.0).abs() > 1e-7, "the method is not of order 9: {ninth}");
    }

    /// The weights of each error estimate add up to zero, so the estimates vanish for a constant derivative.
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

    /// Phase of the test oscillation at the start, rad. With this phase, no derivative is zero at the start.
    const PHASE: f64 = 0.7;

    fn exact(t: f64) -> [f64; 2] {
        [(PHASE + t).sin(), (PHASE + t).cos()]
    }

    /// Error after integrating to t = 8 in equal steps.
    fn global_error(steps: u32) -> f64 {
        let h = 8.0 / f64::from(steps);
        let mut y = exact(0.0);
        for i in 0..steps {
            y = StepStages::take_step(rotation, f64::from(i) * h, &y, &rotation(0.0, &y), h).y_end;
        }
        (y[0] - exact(8.0)[0]).hypot(y[1] - exact(8.0)[1])
    }

    /// Largest error of the dense output within one step of length `h`.
    fn dense_error(h: f64) -> f64 {
        let start = exact(0.0);
        let mut stages = StepStages::take_step(rotation, 0.0, &start, &rotation(0.0, &start), h);
        let dense = stages.dense_output(rotation);
        (1..20)
            .map(|i| f64::from(i) / 20.0)
            .map(|x| (dense.state_at_fraction(x)[0] - exact(x * h)[0]).abs())
            .fold(0.0, f64::max)
    }

    /// The global error is proportional to `h^8`. The error of the dense output within one step is also
    /// proportional to `h^8`, so the dense output is of order 7.
    #[test]
    fn the_method_is_of_order_eight_and_its_dense_output_of_order_seven() {
        let order = (global_error(16) / global_error(32)).log2();
        assert!((order - 8.0).abs() < 0.2, "method: {order}");
        let order = (dense_error(0.4) / dense_error(0.2)).log2();
        assert!((order - 8.0).abs() < 0.2, "dense output: {order}");
    }
}
