//! Inner products of a trend, (decaying) sinusoids and the data over the frames present.

use super::SineTerm;
use crate::trend::{MOST_COLUMNS, Trend, abscissa};
use nalgebra::{DMatrix, DMatrixViewMut};
use portable_math as math;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::Range;

/// Number of frames that are gathered before they are multiplied: a block fits in the cache, and each block
/// restarts the rotation of the sinusoids.
const BLOCK: usize = 256;
/// Number of blocks that one thread sums; the sums are added in order, so the number of threads does not
/// change a bit of the result.
const BLOCKS_A_TASK: usize = 64;

/// The columns of one term of `n` cycles and `d` nepers in the record. `u` runs over the record from -1 to 1,
/// the phase is `pi n u`, and the envelope `exp(-d ((u + 1) / 2 - s))` is 1 where the term starts, at the
/// fraction `s` of the record, and zero before.
#[derive(Debug, Clone, Copy)]
pub(super) enum TermColumn {
    Cosine,
    Sine,
    /// Derivative of the cosine with respect to the cycles.
    CosineSlope,
    /// Derivative of the sine with respect to the cycles.
    SineSlope,
}

/// Number of columns per term that its amplitudes need: cosine and sine.
pub(super) const QUADRATURE_COLUMNS: usize = 2;
/// Number of columns per term that a Gauss-Newton step needs: cosine, sine and their slopes.
pub(super) const COLUMNS_WITH_SLOPES: usize = 4;

impl TermColumn {
    /// Index of this column of a term in a matrix that contains first the columns of the trend and then all
    /// four columns of each term.
    pub(super) fn column_index(self, trend: usize, term: usize) -> usize {
        trend + COLUMNS_WITH_SLOPES * term + self as usize
    }
}

/// The weighted frames of a record and the columns of a trend in these frames, both constant during a fit.
#[derive(Debug)]
pub(super) struct FixedColumns {
    frames: usize,
    /// Frames that take part, with the square root of their weight.
    rows: Vec<(usize, f64)>,
    /// Rows of each block of frames.
    blocks: Vec<Range<usize>>,
    /// The columns of the trend and, last, the data; one row for each frame that takes part.
    columns: DMatrix<f64>,
    gram: DMatrix<f64>,
}

/// Cosine and sine, both with their envelope, and `pi u` for each frame of a block.
type PhasorBlock = [[f64; 3]; BLOCK];

impl FixedColumns {
    pub(super) fn new(trend: Trend, data: &[f64], weights: &[f64]) -> Self {
        let rows: Vec<(usize, f64)> =
            weights.iter().enumerate().filter(|(_, w)| **w > 0.0).map(|(i, w)| (i, w.sqrt())).collect();
        let at = |frame: usize| rows.partition_point(|row| row.0 < frame);
        let blocks: Vec<Range<usize>> =
            (0..data.len()).step_by(BLOCK).map(|first| at(first)..at(first + BLOCK)).collect();
        let mut columns = DMatrix::zeros(rows.len(), trend.column_count() + 1);
        let mut basis = [0.0; MOST_COLUMNS];
        for (row, &(frame, root)) in rows.iter().enumerate() {
            trend.fill_row(abscissa(frame, data.len()), &mut basis);
            for (column, value) in basis.iter().take(trend.column_count()).enumerate() {
                columns[(row, column)] = root * value;
            }
            columns[(row, trend.column_count())] = root * data[frame];
        }
        let gram = columns.tr_mul(&columns);
        Self { frames: data.len(), rows, blocks, columns, gram }
    }

    /// Inner products of the columns of the trend, the first `EACH` columns of every term, and the data, in
    /// this order.
    pub(super) fn gram_matrix<const EACH: usize>(&self, terms: &[SineTerm]) -> DMatrix<f64> {
        let (trend, width) = (self.columns.ncols() - 1, EACH * terms.len());
        let tasks: Vec<&[Range<usize>]> = self.blocks.chunks(BLOCKS_A_TASK).collect();
        let of = |(task, blocks): (usize, &&[Range<usize>])| {
            self.term_products::<EACH>(terms, task * BLOCKS_A_TASK, blocks)
        };
        let parts: Vec<_> = if tasks.len() > 1 {
            tasks.par_iter().enumerate().map(of).collect()
        } else {
            tasks.iter().enumerate().map(of).collect()
        };
        let zeros = (DMatrix::zeros(trend + 1, width), DMatrix::zeros(width, width));
        let (mixed, own) = parts.into_iter().fold(zeros, |sum, part| (sum.0 + part.0, sum.1 + part.1));
        // the data are the last fixed column and come after the terms here
        let place = |k: usize| if k == trend { trend + width } else { k };
        let mut gram = DMatrix::zeros(trend + width + 1, trend + width + 1);
        for i in 0..=trend {
            (0..=trend).for_each(|j| gram[(place(i), place(j))] = self.gram[(i, j)]);
            for j in 0..width {
                gram[(place(i), trend + j)] = mixed[(i, j)];
                gram[(trend + j, place(i))] = mixed[(i, j)];
            }
        }
        gram.view_mut((trend, trend), (width, width)).copy_from(&own);
        gram
    }

    /// Inner products of the fixed columns with the columns of the terms, and of the columns of the terms
    /// with each other, over blocks from `first` on.
    fn term_products<const EACH: usize>(
        &self,
        terms: &[SineTerm],
        first: usize,
        blocks: &[Range<usize>],
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let width = EACH * terms.len();
        let mut mixed = DMatrix::zeros(self.columns.ncols(), width);
        let mut own = DMatrix::zeros(width, width);
        let mut block = DMatrix::zeros(BLOCK, width);
        for (b, range) in blocks.iter().enumerate() {
            let rows = &self.rows[range.clone()];
            for (place, term) in terms.iter().enumerate() {
                let mut columns = block.columns_mut(EACH * place, EACH);
                let turning = rotate_phasors(term, (first + b) * BLOCK, self.frames);
                fill_term_columns::<EACH>(&mut columns, rows, &turning);
            }
            let of_terms = block.rows(0, rows.len());
            mixed.gemm_tr(1.0, &self.columns.rows(range.start, rows.len()), &of_terms, 1.0);
            for i in 0..width {
                (i..width).for_each(|j| own[(i, j)] += of_terms.column(i).dot(&of_terms.column(j)));
            }
        }
        own.fill_lower_triangle_with_upper_triangle();
        (mixed, own)
    }
}

fn fill_term_columns<const EACH: usize>(
    columns: &mut DMatrixViewMut<'_, f64>,
    rows: &[(usize, f64)],
    turning: &PhasorBlock,
) {
    let mut column = |of: TermColumn, value: fn(f64, [f64; 3]) -> f64| {
        for (entry, (frame, root)) in columns.column_mut(of as usize).iter_mut().zip(rows) {
            *entry = value(*root, turning[frame % BLOCK]);
        }
    };
    column(TermColumn::Cosine, |root, [cosine, _, _]| root * cosine);
    column(TermColumn::Sine, |root, [_, sine, _]| root * sine);
    if EACH == COLUMNS_WITH_SLOPES {
        column(TermColumn::CosineSlope, |root, [_, sine, angle_per_cycle]| -root * angle_per_cycle * sine);
        column(TermColumn::SineSlope, |root, [cosine, _, angle_per_cycle]| root * angle_per_cycle * cosine);
    }
}

/// Values of a term in every frame, from its cosine and sine amplitudes.
pub(super) fn term_values(term: &SineTerm, [cosine_m, sine_m]: [f64; 2], frames: usize) -> Vec<f64> {
    let mut values = Vec::with_capacity(frames);
    for first in (0..frames).step_by(BLOCK) {
        let turning = rotate_phasors(term, first, frames);
        let inside = turning.iter().take(frames - first);
        values.extend(inside.map(|[cosine, sine, _]| cosine_m * cosine + sine_m * sine));
    }
    values
}

/// Cosine and sine of a term, times its envelope, in the frames of a block. Each frame follows from the one
/// before by a rotation through a constant angle and multiplication by a constant factor.
fn rotate_phasors(term: &SineTerm, first: usize, frames: usize) -> PhasorBlock {
    let angle_per_cycle = |frame: usize| PI * abscissa(frame, frames);
    let mut turning = [[0.0; 3]; BLOCK];
    let before = term.first.saturating_sub(first).min(BLOCK);
    for (frame, slot) in turning[..before].iter_mut().enumerate() {
        slot[2] = angle_per_cycle(first + frame);
    }
    let first = first + before;
    if before == BLOCK {
        return turning;
    }
    let since = (abscissa(first, frames) + 1.0) / 2.0 - term.first as f64 / frames as f64;
    let envelope = math::exp(-term.nepers * since);
    let shrink = math::exp(-term.nepers / frames as f64);
    let (sine, cosine) = math::sin_cos(term.cycles * angle_per_cycle(first));
    let (mut sine, mut cosine) = (envelope * sine, envelope * cosine);
    let (sine_of_turn, cosine_of_turn) = math::sin_cos(term.cycles * 2.0 * PI / frames as f64);
    let (sine_of_turn, cosine_of_turn) = (shrink * sine_of_turn, shrink * cosine_of_turn);
    for (frame, slot) in turning[before..].iter_mut().enumerate() {
        *slot = [cosine, sine, angle_per_cycle(first + frame)];
        (cosine, sine) =
            (cosine * cosine_of_turn - sine * sine_of_turn, sine * cosine_of_turn + cosine * sine_of_turn);
    }
    turning
}

#[cfg(test)]
mod tests {
    use super::super::FreeSet;
    use super::*;

    #[test]
    fn inner_products_are_those_summed_frame_by_frame() {
        let frames = 700; // two whole blocks and a part
        let terms = [(31.3, 0.0), (122.9, 2.5)]
            .map(|(cycles, nepers)| SineTerm::from_start(cycles, nepers, FreeSet::Both));
        let weights: Vec<f64> =
            (0..frames).map(|i| if i % 3 == 1 { 0.0 } else { 1.0 + i as f64 / 700.0 }).collect();
        let data: Vec<f64> = (0..frames).map(|i| (i as f64 * 0.37).sin()).collect();
        let gram = FixedColumns::new(Trend::Polynomial(2), &data, &weights)
            .gram_matrix::<COLUMNS_WITH_SLOPES>(&terms);
        assert_eq!(gram.shape(), (11, 11));
        let u = |i: usize| abscissa(i, frames);
        let envelope = |i: usize| (-2.5 * (u(i) + 1.0) / 2.0).exp();
        let slope = |i: usize| PI * u(i) * (PI * 122.9 * u(i)).cos() * envelope(i);
        let sum = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| {
            (0..frames).map(|i| weights[i] * a(i) * b(i)).sum::<f64>()
        };
        let cosine = |i: usize| (PI * 31.3 * u(i)).cos();
        assert!(
            (gram[(TermColumn::SineSlope.column_index(2, 1), 10)] - sum(&slope, &|i| data[i])).abs() < 1e-9
        );
        assert!((gram[(TermColumn::Cosine.column_index(2, 0), 1)] - sum(&cosine, &u)).abs() < 1e-9);
        assert!((gram[(0, 0)] - sum(&|_| 1.0, &|_| 1.0)).abs() < 1e-9);
        let of_term = term_values(&terms[1], [0.0, 2.0], frames);
        assert!(
            (0..frames).all(|i| (of_term[i] - 2.0 * envelope(i) * (PI * 122.9 * u(i)).sin()).abs() < 1e-10)
        );
    }
}
