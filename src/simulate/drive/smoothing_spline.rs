//! A smooth curve through noisy points on a frame grid: a least-squares spline of degree 5.
//!
//! Generalised cross-validation chooses the number of pieces (Craven and Wahba 1979, *Numerische Mathematik*
//! 31, 377). Each degree of freedom counts as 1.4, so that noise does not add pieces (Kim and Gu 2004,
//! *Journal of the Royal Statistical Society* B 66, 337). A crank moves the head smoothly over tenths of a
//! second, so that a few pieces average the noise of thousands of frames; motion by hand needs more pieces.
//! On noisy cosines, the position error of a cubic smoothing spline is two to three times as large.
//!
//! Tracking noise is correlated over a few frames (vibration, sub-pixel bias), and cross-validation would
//! mistake it for motion. Points are therefore averaged in blocks, and each block is compared with the
//! average of the curve over the same frames. Times are in frames.

use nalgebra::{DMatrix, DVector};
use portable_math as math;

/// Degree of the polynomial pieces.
const DEGREE: usize = 5;
/// Number of B-splines that are nonzero in one piece.
const SUPPORT: usize = DEGREE + 1;
/// Number of B-splines that are nonzero in two adjacent pieces, which a block may span.
const BLOCK_WIDTH: usize = SUPPORT + 1;
/// Weight of the third differences of the coefficients in the least-squares fit, relative to the weight of a
/// block. The weight matters only if a gap leaves a piece without points.
const BRIDGE: f64 = 1e-7;
/// Factor by which degrees of freedom are multiplied in cross-validation.
const CAUTION: f64 = 1.4;
/// Minimum number of blocks per piece.
const BLOCKS_A_PIECE: f64 = 2.0;
/// Ratio of each trial number of pieces to the previous one.
const PIECE_RATIO: f64 = 1.25;

/// A polynomial trend plus a spline with uniform knots over the span.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SmoothingSpline {
    span: FrameSpan,
    /// Coefficients of the trend over the whole span, in rising order.
    trend: [f64; SUPPORT],
    pieces: usize,
    pub(super) coefficients: Vec<f64>,
    /// Cholesky factor of the information matrix (inverse covariance) of the coefficients, for a noise
    /// variance of 1 per frame.
    information: CholeskyFactor,
    /// Noise variance of a single frame, m^2, estimated from the scatter of the blocks.
    pub(super) variance_m2: f64,
}

/// First and last frame of the span of a spline.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FrameSpan(f64, f64);

/// Consecutive frames whose positions are averaged.
struct FrameBlock<'a> {
    frames: &'a [usize],
    /// Mean of the positions minus the trend, m.
    mean: f64,
}

/// Fits a curve to positions, m, at three or more frames in rising order, averaged in blocks of `length`
/// frames.
pub(super) fn fit_smoothing_spline(frames: &[usize], positions: &[f64], length: usize) -> SmoothingSpline {
    let span = FrameSpan(frames[0] as f64, frames[frames.len() - 1] as f64);
    let trend = fit_trend(frames, positions, span);
    let blocks = average_blocks(frames, positions, length, |frame| {
        evaluate_polynomial(&trend, span.to_unit_interval(frame))
    });
    let most = ((blocks.len() as f64 / BLOCKS_A_PIECE) as usize).max(1);
    let ladder = std::iter::successors(Some(1), |&n| Some(((PIECE_RATIO * n as f64) as usize).max(n + 1)));
    let tried = ladder
        .take_while(|pieces| *pieces <= most)
        .map(|pieces| SmoothingSpline::fit_pieces(span, trend, pieces, &blocks));
    let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
    // one piece is always among the trial numbers of pieces
    best.map_or_else(|| unreachable!("no curve"), |(_, curve)| curve)
}

fn average_blocks<'a>(
    frames: &'a [usize],
    positions: &[f64],
    length: usize,
    trend: impl Fn(f64) -> f64,
) -> Vec<FrameBlock<'a>> {
    let number = |at: usize| (frames[at] - frames[0]) / length;
    let mut blocks = Vec::new();
    let mut from = 0;
    while from < frames.len() {
        let count = frames[from..].partition_point(|frame| (frame - frames[0]) / length == number(from));
        let here = from..from + count;
        let above = here.clone().map(|at| positions[at] - trend(frames[at] as f64));
        blocks.push(FrameBlock { mean: above.sum::<f64>() / count as f64, frames: &frames[here] });
        from += count;
    }
    blocks
}

impl FrameSpan {
    /// Maps the span to [-1, 1].
    fn to_unit_interval(self, frame: f64) -> f64 {
        2.0 * (frame - self.0) / (self.1 - self.0) - 1.0
    }
}

fn evaluate_polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Coefficients of the least-squares polynomial of degree 5 through all points; the degree is lower if there
/// are few points.
fn fit_trend(frames: &[usize], positions: &[f64], span: FrameSpan) -> [f64; SUPPORT] {
    let terms = SUPPORT.min(frames.len());
    let powers = DMatrix::from_fn(frames.len(), terms, |row, k| {
        math::powi(span.to_unit_interval(frames[row] as f64), k as i32)
    });
    let factors = powers.col_piv_qr();
    let mut right = factors.q().tr_mul(&DVector::from_column_slice(positions));
    let solved = factors.r().solve_upper_triangular_mut(&mut right);
    factors.p().inv_permute_rows(&mut right);
    std::array::from_fn(|k| right.get(k).copied().filter(|_| solved).unwrap_or(0.0))
}

impl SmoothingSpline {
    /// Position at a frame, m.
    pub(crate) fn position(&self, frame: f64) -> f64 {
        let (piece, x) = self.piece_at(frame);
        let above: f64 = dot(&b_splines::<SUPPORT>(x), &self.coefficients[piece..]);
        above + evaluate_polynomial(&self.trend, self.span.to_unit_interval(frame))
    }

    /// Second derivative at a frame, m/frame2.
    pub(crate) fn curvature(&self, frame: f64) -> f64 {
        let (piece, x) = self.piece_at(frame);
        let seconds: [f64; SUPPORT - 2] = std::array::from_fn(|k| {
            let c = &self.coefficients[piece + k..];
            c[0] - 2.0 * c[1] + c[2]
        });
        let above = dot(&b_splines::<{ SUPPORT - 2 }>(x), &seconds) * math::powi(self.pieces_per_frame(), 2);
        let trend: [f64; SUPPORT - 2] =
            std::array::from_fn(|k| ((k + 1) * (k + 2)) as f64 * self.trend[k + 2]);
        let per_frame = 2.0 / (self.span.1 - self.span.0);
        above + evaluate_polynomial(&trend, self.span.to_unit_interval(frame)) * per_frame * per_frame
    }

    pub(super) fn pieces_per_frame(&self) -> f64 {
        self.pieces as f64 / (self.span.1 - self.span.0)
    }

    /// Index of the piece that contains a frame, and position of the frame within this piece, from 0 to 1.
    fn piece_at(&self, frame: f64) -> (usize, f64) {
        let x = (frame - self.span.0) * self.pieces_per_frame();
        let piece = (x as usize).min(self.pieces - 1);
        (piece, x - piece as f64)
    }

    /// Least-squares curve with the given number of pieces, and its cross-validation score, which comes first
    /// in the result.
    fn fit_pieces(
        span: FrameSpan,
        trend: [f64; SUPPORT],
        pieces: usize,
        blocks: &[FrameBlock<'_>],
    ) -> (f64, Self) {
        let count = pieces + DEGREE;
        let (coefficients, information) = (Vec::new(), CholeskyFactor(Vec::new()));
        let mut curve = Self { span, trend, pieces, coefficients, information, variance_m2: 0.0 };
        let rows: Vec<(usize, [f64; BLOCK_WIDTH])> =
            blocks.iter().map(|block| curve.block_row(block)).collect();
        let mut normal = BandedMatrix(vec![[0.0; BLOCK_WIDTH]; count]);
        let mut right = vec![0.0; count];
        for ((from, row), block) in rows.iter().zip(blocks) {
            let weight = block.frames.len() as f64;
            normal.add_outer_product(*from, row, weight);
            right[*from..].iter_mut().zip(row).for_each(|(sum, b)| *sum += weight * b * block.mean);
        }
        for from in 0..count - 3 {
            normal.add_outer_product(from, &[-1.0, 3.0, -3.0, 1.0], BRIDGE * blocks[0].frames.len() as f64);
        }
        curve.information = normal.factorise();
        curve.information.solve_in_place(&mut right);
        curve.coefficients = right;
        let weighted_square = |((from, row), block): (&(usize, [f64; BLOCK_WIDTH]), &FrameBlock<'_>)| {
            let off = block.mean - dot(row, &curve.coefficients[*from..]);
            block.frames.len() as f64 * off * off
        };
        let squares: f64 = rows.iter().zip(blocks).map(weighted_square).sum();
        let (n, freedoms) = (blocks.len() as f64, count.min(blocks.len()) as f64);
        curve.variance_m2 = squares / (n - freedoms).max(1.0);
        let left = n - CAUTION * freedoms;
        (if left > 0.0 { squares / (left * left) } else { f64::INFINITY }, curve)
    }

    /// Derivatives of the position at a frame with respect to the coefficients: index of the first nonzero
    /// derivative, and the values from this index on.
    pub(crate) fn position_weights(&self, frame: f64) -> (usize, [f64; SUPPORT]) {
        let (piece, x) = self.piece_at(frame);
        (piece, b_splines(x))
    }

    /// Multiplies a row vector, with one number per coefficient of the curve, by the covariance matrix of the
    /// coefficients, m^2, in place.
    pub(crate) fn multiply_covariance(&self, row: &mut [f64]) {
        self.information.solve_in_place(row);
        row.iter_mut().for_each(|x| *x *= self.variance_m2);
    }

    /// The curve with coefficients that are drawn from their normal distribution around those of this curve;
    /// `draw` returns independent numbers with the standard normal distribution.
    pub(super) fn draw_like(&self, mut draw: impl FnMut() -> f64) -> Self {
        let mut errors: Vec<f64> =
            self.coefficients.iter().map(|_| self.variance_m2.sqrt() * draw()).collect();
        self.information.solve_upper_in_place(&mut errors);
        let coefficients = self.coefficients.iter().zip(errors).map(|(c, error)| c + error).collect();
        Self { coefficients, information: CholeskyFactor(self.information.0.clone()), ..*self }
    }

    /// Means of the B-splines over a block: index of the first nonzero mean, and the values from this index
    /// on.
    fn block_row(&self, block: &FrameBlock<'_>) -> (usize, [f64; BLOCK_WIDTH]) {
        let (from, _) = self.piece_at(block.frames[0] as f64);
        let mut row = [0.0; BLOCK_WIDTH];
        for &frame in block.frames {
            let (piece, x) = self.piece_at(frame as f64);
            let values = b_splines::<SUPPORT>(x);
            row[piece - from..].iter_mut().zip(values).for_each(|(sum, b)| *sum += b);
        }
        (from, row.map(|sum| sum / block.frames.len() as f64))
    }
}

/// Scalar product; the excess elements of the longer vector are ignored.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The `N` nonzero B-splines of degree `N - 1` with integer knots at `x` from 0 to 1 (de Boor 1978, *A
/// Practical Guide to Splines*, chapter X).
fn b_splines<const N: usize>(x: f64) -> [f64; N] {
    let mut values = [0.0; N];
    values[0] = 1.0;
    for degree in 1..N {
        let mut carried = 0.0;
        for (k, value) in values[..degree].iter_mut().enumerate() {
            let part = *value / degree as f64;
            *value = carried + ((k + 1) as f64 - x) * part;
            carried = (x + (degree - k - 1) as f64) * part;
        }
        values[degree] = carried;
    }
    values
}

/// A symmetric positive definite band matrix; each column is stored from the main diagonal down.
struct BandedMatrix(Vec<[f64; BLOCK_WIDTH]>);

impl BandedMatrix {
    /// Adds `weight * transpose(row) * row` to the matrix; the first element of `row` belongs to column
    /// `from`.
    fn add_outer_product(&mut self, from: usize, row: &[f64], weight: f64) {
        for (a, left) in row.iter().enumerate().filter(|(_, left)| **left != 0.0) {
            for (b, right) in row[a..].iter().enumerate() {
                self.0[from + a][b] += weight * left * right;
            }
        }
    }

    fn factorise(mut self) -> CholeskyFactor {
        let count = self.0.len();
        for j in 0..count {
            let root = self.0[j][0].max(f64::MIN_POSITIVE).sqrt();
            self.0[j].iter_mut().for_each(|x| *x /= root);
            let column = self.0[j];
            for a in (1..BLOCK_WIDTH).take_while(|a| j + a < count) {
                for b in a..BLOCK_WIDTH {
                    self.0[j + a][b - a] -= column[a] * column[b];
                }
            }
        }
        CholeskyFactor(self.0)
    }
}

/// Lower Cholesky factor of a band matrix; each column is stored from the main diagonal down.
#[derive(Debug, Clone, PartialEq)]
struct CholeskyFactor(Vec<[f64; BLOCK_WIDTH]>);

impl CholeskyFactor {
    /// Replaces the right-hand side of the linear system by its solution.
    fn solve_in_place(&self, right: &mut [f64]) {
        for (j, column) in self.0.iter().enumerate() {
            right[j] /= column[0];
            let solved = right[j];
            right[j + 1..].iter_mut().zip(&column[1..]).for_each(|(x, below)| *x -= below * solved);
        }
        self.solve_upper_in_place(right);
    }

    /// Replaces the right-hand side of the system of the transposed factor by its solution.
    fn solve_upper_in_place(&self, right: &mut [f64]) {
        for (j, column) in self.0.iter().enumerate().rev() {
            let below = dot(&column[1..], &right[j + 1..]);
            right[j] = (right[j] - below) / column[0];
        }
    }
}
