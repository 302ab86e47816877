//! Solves linear differential equations of second order, `M(t) y'' + D(t) y' + K(t) y = g(t)`, by collocation
//! at the Gauss-Legendre nodes (Hairer, Lubich and Wanner, *Geometric Numerical Integration*, section
//! II.1.3).
//!
//! The unknowns of a step of length `h` are the accelerations `a_j` at its nodes `c_j`. With the polynomials
//! `l_j`, each 1 at node `j` and 0 at the others,
//!
//! ```text
//! y'(x) = y'_0 + h sum a_j int_0^x l_j          y(x) = y_0 + h x y'_0 + h^2 sum a_j int_0^x int l_j
//! ```
//!
//! With `s` nodes the solution is of order `2 s` at the end of the step and of order `s + 2` inside it. The
//! equations are eliminated block by block in the order of time, without exchange of rows, because a later
//! node has little effect on an earlier one.

#![allow(clippy::needless_range_loop)] // the indices are those of the formulas

use portable_math as math;
use std::array::from_fn;
use std::ops::{Add, Mul, Sub};
use std::sync::LazyLock;

/// Maximum number of nodes of a step.
pub const MOST_NODES: usize = 12;
/// Minimum number of nodes of a step.
pub const LEAST_NODES: usize = 3;

/// One value per node.
pub type NodeArray<T> = [T; MOST_NODES];

/// The nodes of a step and the integrals of their Lagrange polynomials `l_j`.
#[derive(Debug, Clone)]
pub struct CollocationRule {
    /// Number of nodes.
    pub nodes: usize,
    /// Positions of the nodes on [0, 1].
    pub positions: NodeArray<f64>,
    /// Quadrature weights of the nodes for the integral over [0, 1].
    pub weights: NodeArray<f64>,
    /// Coefficients of the expansion of `l_j` in Legendre polynomials: `(2 m + 1) b_j P_m(2 c_j - 1)` for
    /// node `j` and degree `m`, where `c_j` is the position and `b_j` the weight of the node.
    legendre: NodeArray<NodeArray<f64>>,
    /// Integral of each `l_j` from 0 to each node.
    once: NodeArray<NodeArray<f64>>,
    /// Double integral of each `l_j` from 0 to each node.
    twice: NodeArray<NodeArray<f64>>,
}

/// The collocation rules, indexed by their number of nodes.
static RULES: LazyLock<Vec<CollocationRule>> =
    LazyLock::new(|| (0..=MOST_NODES).map(CollocationRule::new).collect());

/// The collocation rule with this number of nodes, at most [`MOST_NODES`].
pub fn collocation_rule(nodes: usize) -> &'static CollocationRule {
    &RULES[nodes]
}

/// A number, or a SIMD vector with one number per lane.
pub trait LaneNumber: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// A value with `x` in every lane.
    fn splat(x: f64) -> Self;

    /// Every lane multiplied by `factor`.
    fn scale_by(self, factor: f64) -> Self;
}

impl LaneNumber for f64 {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn scale_by(self, factor: f64) -> Self {
        factor * self
    }
}

impl CollocationRule {
    fn new(nodes: usize) -> Self {
        let (row, square) = ([0.0; MOST_NODES], [[0.0; MOST_NODES]; MOST_NODES]);
        let mut rule =
            Self { nodes, positions: row, weights: row, legendre: square, once: square, twice: square };
        for j in 0..nodes {
            let (place, weight) = gauss_node(nodes, j);
            (rule.positions[j], rule.weights[j]) = (place, weight);
            let polynomials = legendre_polynomials(place, nodes);
            rule.legendre[j] = from_fn(|m| (2 * m + 1) as f64 * weight * polynomials[m]);
        }
        for i in 0..nodes {
            [rule.once[i], rule.twice[i]] = rule.integrals(rule.positions[i]);
        }
        rule
    }

    /// Integral and double integral of each `l_j` from 0 to `x`, which lies in [0, 1].
    pub(crate) fn integrals(&self, x: f64) -> [NodeArray<f64>; 2] {
        let [mut once, mut twice] = [[0.0; MOST_NODES]; 2];
        self.integrals_by_degree(x, &mut once, &mut twice);
        [self.to_nodal(&once), self.to_nodal(&twice)]
    }

    /// Integral (`once`) and double integral (`twice`) from 0 to `x` of the Legendre polynomials of `2 x -
    /// 1`, for each degree below the number of nodes. The integral is `int P_m = (P_(m+1) - P_(m-1)) / (2 (2
    /// m + 1))`; this formula, applied twice, gives the double integral.
    #[inline(always)]
    pub fn integrals_by_degree<R: LaneNumber>(
        &self,
        x: R,
        once: &mut NodeArray<R>,
        twice: &mut NodeArray<R>,
    ) {
        let p = legendre_polynomials(x, self.nodes);
        (once[0], twice[0]) = (x, (x * x).scale_by(0.5));
        for m in 1..self.nodes {
            once[m] = (p[m + 1] - p[m - 1]).scale_by(0.5 * RECIPROCALS[2 * m + 1]);
        }
        for m in 1..self.nodes {
            // (for the highest degree, the integral of the next degree is not in `once`)
            let next = if m + 1 < self.nodes {
                once[m + 1]
            } else {
                (p[m + 2] - p[m]).scale_by(0.5 * RECIPROCALS[2 * m + 3])
            };
            twice[m] = (next - once[m - 1]).scale_by(0.5 * RECIPROCALS[2 * m + 1]);
        }
    }

    /// Integrals of each `l_j`, computed from the integrals of each Legendre polynomial.
    pub fn to_nodal(&self, by_degree: &NodeArray<f64>) -> NodeArray<f64> {
        let mut sums = [0.0; MOST_NODES];
        for (sum, legendre) in sums.iter_mut().zip(&self.legendre[..self.nodes]) {
            for (a, b) in legendre[..self.nodes].iter().zip(by_degree) {
                *sum += a * b;
            }
        }
        sums
    }
}

/// Node `j` of the Gauss-Legendre rule with `nodes` nodes on [0, 1], and its weight, by Newton's method.
fn gauss_node(nodes: usize, j: usize) -> (f64, f64) {
    /// Number of iterations of Newton's method, more than it needs from Tricomi's starting value.
    const ROUNDS: usize = 12;
    let mut z = -math::cos(std::f64::consts::PI * (j as f64 + 0.75) / (nodes as f64 + 0.5));
    let mut slope = 1.0;
    for _ in 0..ROUNDS {
        let (mut before, mut value) = (1.0, z);
        for m in 1..nodes {
            let next = ((2 * m + 1) as f64 * z * value - m as f64 * before) / (m + 1) as f64;
            (before, value) = (value, next);
        }
        slope = nodes as f64 * (z * value - before) / (z * z - 1.0);
        z -= value / slope;
    }
    (0.5 * (1.0 + z), 1.0 / ((1.0 - z * z) * slope * slope))
}

/// Legendre polynomials of `2 x - 1`, up to the degree `nodes + 1`.
#[inline(always)]
fn legendre_polynomials<R: LaneNumber>(x: R, nodes: usize) -> [R; MOST_NODES + 2] {
    let z = x.scale_by(2.0) - R::splat(1.0);
    let mut p = [R::splat(1.0); MOST_NODES + 2];
    p[1] = z;
    for m in 1..=nodes.min(MOST_NODES) {
        let share = RECIPROCALS[m + 1];
        p[m + 1] = (z * p[m]).scale_by((2 * m + 1) as f64 * share) - p[m - 1].scale_by(m as f64 * share);
    }
    p
}

/// Table of reciprocals: the element with index `m` is `1 / m`.
const RECIPROCALS: [f64; 2 * MOST_NODES + 4] = {
    let mut shares = [0.0; 2 * MOST_NODES + 4];
    let mut m = 1;
    while m < shares.len() {
        shares[m] = 1.0 / m as f64;
        m += 1;
    }
    shares
};

/// A matrix of the equations at one time.
pub type SquareMatrix<const D: usize> = [[f64; D]; D];

/// Matrices of `D` equations at the nodes of a step.
#[derive(Debug, Clone, Copy)]
pub struct CollocationEquations<const D: usize> {
    /// Matrix `M` of the equations at each node; it multiplies the second derivative of the unknowns.
    pub mass: NodeArray<SquareMatrix<D>>,
    /// Matrix `D` of the equations at each node; it multiplies the first derivative of the unknowns.
    pub damping: NodeArray<SquareMatrix<D>>,
    /// Matrix `K` of the equations at each node; it multiplies the unknowns themselves.
    pub stiffness: NodeArray<SquareMatrix<D>>,
}

impl<const D: usize> Default for CollocationEquations<D> {
    fn default() -> Self {
        let none = [[[0.0; D]; D]; MOST_NODES];
        Self { mass: none, damping: none, stiffness: none }
    }
}

/// The collocation equations of a step as block LU factors.
#[derive(Debug, Clone)]
pub struct CollocationStep<const D: usize> {
    rule: &'static CollocationRule,
    length: f64,
    /// Block LU factors: multipliers left of the diagonal, inverse pivots on it, the eliminated matrix right
    /// of it.
    blocks: NodeArray<NodeArray<SquareMatrix<D>>>,
}

impl<const D: usize> Default for CollocationStep<D> {
    fn default() -> Self {
        Self { rule: collocation_rule(0), length: 0.0, blocks: [[[[0.0; D]; D]; MOST_NODES]; MOST_NODES] }
    }
}

impl<const D: usize> CollocationStep<D> {
    /// Factors the equations of a step of this length.
    pub fn factor(
        &mut self,
        rule: &'static CollocationRule,
        length: f64,
        equations: &CollocationEquations<D>,
    ) {
        (self.rule, self.length) = (rule, length);
        for i in 0..rule.nodes {
            let (damping, stiffness) = (&equations.damping[i], &equations.stiffness[i]);
            let row = &mut self.blocks[i];
            for (j, block) in row[..rule.nodes].iter_mut().enumerate() {
                let (once, twice) = (length * rule.once[i][j], length * length * rule.twice[i][j]);
                *block = from_fn(|r| from_fn(|c| once * damping[r][c] + twice * stiffness[r][c]));
            }
            row[i] = from_fn(|r| from_fn(|c| row[i][r][c] + equations.mass[i][r][c]));
        }
        for p in 0..rule.nodes {
            let (upper, lower) = self.blocks.split_at_mut(p + 1);
            let pivot = &mut upper[p];
            pivot[p] = invert_square(&pivot[p]);
            for row in &mut lower[..rule.nodes - p - 1] {
                let factor = multiply_squares(&row[p], &pivot[p]);
                row[p] = factor;
                for (block, right) in row[p + 1..rule.nodes].iter_mut().zip(&pivot[p + 1..rule.nodes]) {
                    for r in 0..D {
                        for k in 0..D {
                            for c in 0..D {
                                block[r][c] -= factor[r][k] * right[k][c];
                            }
                        }
                    }
                }
            }
        }
    }

    /// Replaces the right-hand sides at the nodes by the accelerations at the nodes. The right-hand sides
    /// must include the terms that follow from the starting values.
    #[inline(always)]
    pub fn solve<R: LaneNumber>(&self, rows: &mut [[R; D]]) {
        let nodes = self.rule.nodes;
        let rows = &mut rows[..nodes];
        for i in 1..nodes {
            let (done, rest) = rows.split_at_mut(i);
            let mut sum = rest[0];
            for (block, row) in self.blocks[i][..i].iter().zip(done) {
                subtract_product(&mut sum, block, row);
            }
            rest[0] = sum;
        }
        for i in (0..nodes).rev() {
            let (rest, done) = rows.split_at_mut(i + 1);
            let mut sum = rest[i];
            for (block, row) in self.blocks[i][i + 1..nodes].iter().zip(done) {
                subtract_product(&mut sum, block, row);
            }
            rest[i] = multiply_row(&self.blocks[i][i], &sum);
        }
    }
}

/// Subtracts the product `block * row` from `sum`.
#[inline(always)]
fn subtract_product<const D: usize, R: LaneNumber>(sum: &mut [R; D], block: &SquareMatrix<D>, row: &[R; D]) {
    for r in 0..D {
        for c in 0..D {
            sum[r] = sum[r] - row[c].scale_by(block[r][c]);
        }
    }
}

/// The product `block * row`.
#[inline(always)]
pub fn multiply_row<const D: usize, R: LaneNumber>(block: &SquareMatrix<D>, row: &[R; D]) -> [R; D] {
    from_fn(|r| {
        let mut sum = row[0].scale_by(block[r][0]);
        for c in 1..D {
            sum = sum + row[c].scale_by(block[r][c]);
        }
        sum
    })
}

fn multiply_squares<const D: usize>(a: &SquareMatrix<D>, b: &SquareMatrix<D>) -> SquareMatrix<D> {
    from_fn(|r| from_fn(|c| (0..D).map(|k| a[r][k] * b[k][c]).sum()))
}

/// Inverse of a matrix of at most three rows, by Cramer's rule.
pub fn invert_square<const D: usize>(m: &SquareMatrix<D>) -> SquareMatrix<D> {
    let mut out = [[0.0; D]; D];
    match D {
        1 => out[0][0] = 1.0 / m[0][0],
        2 => {
            let share = 1.0 / (m[0][0] * m[1][1] - m[0][1] * m[1][0]);
            (out[0][0], out[0][1]) = (share * m[1][1], -share * m[0][1]);
            (out[1][0], out[1][1]) = (-share * m[1][0], share * m[0][0]);
        }
        _ => {
            let cofactor = |r: usize, c: usize| {
                let ([r1, r2], [c1, c2]) = ([(r + 1) % 3, (r + 2) % 3], [(c + 1) % 3, (c + 2) % 3]);
                m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
            };
            let share = 1.0 / (0..3).map(|c| m[0][c] * cofactor(0, c)).sum::<f64>();
            for r in 0..D {
                for c in 0..D {
                    out[r][c] = share * cofactor(c, r);
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes and weights agree with Abramowitz and Stegun, table 25.4.
    #[test]
    fn nodes_and_weights_are_those_of_the_table() {
        let five = collocation_rule(5);
        for (j, (z, weight)) in [
            (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
            (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
            (0.0, 0.568_888_888_888_888_9),
        ]
        .into_iter()
        .enumerate()
        {
            assert!((2.0 * five.positions[j] - 1.0 - z).abs() < 1e-15);
            assert!((2.0 * five.weights[j] - weight).abs() < 1e-15);
        }
    }

    /// The integrals of `x^k` are exact for `k` below the number of nodes.
    #[test]
    fn powers_are_integrated_exactly() {
        for nodes in LEAST_NODES..=MOST_NODES {
            let rule = collocation_rule(nodes);
            for power in 0..nodes as i32 {
                let values = rule.positions.map(|c| c.powi(power));
                for x in [0.0, 0.3, 1.0f64] {
                    let sums = rule.integrals(x).map(|w| (0..nodes).map(|j| w[j] * values[j]).sum::<f64>());
                    let once = x.powi(power + 1) / f64::from(power + 1);
                    let exact = [once, once * x / f64::from(power + 2)];
                    let error = (sums[0] - exact[0]).abs().max((sums[1] - exact[1]).abs());
                    assert!(error < 1e-15, "{nodes} nodes, x^{power} to {x}: {error:e}");
                }
            }
        }
    }

    /// Error at the end of one step of `y'' + 0.2 y' + y = 0` that starts from `y = 1`, `y' = 0`.
    fn error(nodes: usize, length: f64) -> f64 {
        let [mass, damping, stiffness] = [1.0, 0.2, 1.0].map(|x| [[[x]]; MOST_NODES]);
        let equations = CollocationEquations::<1> { mass, damping, stiffness };
        let (rule, mut step) = (collocation_rule(nodes), CollocationStep::default());
        step.factor(rule, length, &equations);
        let mut rows = [[-1.0]; MOST_NODES];
        step.solve(&mut rows);
        let sum = |weights: &NodeArray<f64>| (0..nodes).map(|j| weights[j] * rows[j][0]).sum::<f64>();
        let [once, twice] = rule.integrals(1.0);
        let (value, rate) = (1.0 + length * length * sum(&twice), length * sum(&once));
        let (decay, omega) = (0.1, 0.99f64.sqrt());
        let (sin, cos) = (omega * length).sin_cos();
        let left = (-decay * length).exp();
        (value - left * (cos + decay / omega * sin)).hypot(rate + left / omega * sin)
    }

    /// The error of a step of length `h` is proportional to `h^(2 nodes + 1)`.
    #[test]
    fn the_end_of_a_step_is_of_twice_the_order_of_the_nodes() {
        for (nodes, length) in [(3, 0.8), (4, 0.4)] {
            let order = (error(nodes, length) / error(nodes, 0.5 * length)).log2();
            assert!((order - (2 * nodes + 1) as f64).abs() < 0.2, "{nodes} nodes: {order}");
        }
    }
}
