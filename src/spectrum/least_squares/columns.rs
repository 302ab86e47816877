//! Inner products of a trend, (decaying) sinusoids and the data over the frames present.

use super::Term;
use crate::spectrum::trend::{FIRST, MOST_COLUMNS, Trend, abscissa};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Frames gathered before they are multiplied out: a block stays in cache, and sinusoids advanced by rotation start afresh in each.
const BLOCK: usize = 256;
/// Blocks that one thread sums; the sums are added in order, so that every number of threads gives the same bits.
const BLOCKS_A_TASK: usize = 64;

/// The columns of one term of `n` cycles and `d` nepers in the record: `u` runs over it from -1 to 1, the phase is `pi n u` and the
/// envelope `exp(-d (u + 1) / 2)`, which is 1 where the record starts.
#[derive(Debug, Clone, Copy)]
pub(super) enum Of {
    Cosine,
    Sine,
    /// Derivative of the cosine with respect to the cycles.
    CosineSlope,
    /// Derivative of the sine with respect to the cycles.
    SineSlope,
}

impl Of {
    /// Where the column stands after those of the trend.
    pub(super) fn column(self, trend: usize, term: usize) -> usize {
        trend + 4 * term + self as usize
    }
}

/// What is fitted to a record.
pub(super) struct Columns<'a> {
    pub trend: Trend,
    pub terms: &'a [Term],
}

/// Cosine and sine with their envelope, and `pi u`, of the frames of a block.
type Turning = [[f64; 3]; BLOCK];

impl Columns<'_> {
    /// Inner products of all columns, the data last; frames of weight zero take no part.
    pub(super) fn gram(&self, data: &[f64], weights: &[f64]) -> DMatrix<f64> {
        let width = self.trend.columns() + 4 * self.terms.len() + 1;
        let starts: Vec<usize> = (0..data.len()).step_by(BLOCK * BLOCKS_A_TASK).collect();
        let of = |first: &usize| self.gram_of(*first..(first + BLOCK * BLOCKS_A_TASK).min(data.len()), data, weights);
        let parts: Vec<_> = if starts.len() > 1 { starts.par_iter().map(of).collect() } else { starts.iter().map(of).collect() };
        parts.into_iter().fold(DMatrix::zeros(width, width), |sum, part| sum + part)
    }

    fn gram_of(&self, frames: std::ops::Range<usize>, data: &[f64], weights: &[f64]) -> DMatrix<f64> {
        let width = self.trend.columns() + 4 * self.terms.len() + 1;
        let mut gram = DMatrix::zeros(width, width);
        let mut block = DMatrix::zeros(BLOCK, width);
        let mut rows: Vec<(usize, f64)> = Vec::with_capacity(BLOCK);
        for first in frames.clone().step_by(BLOCK) {
            rows.clear();
            let inside = first..(first + BLOCK).min(frames.end);
            rows.extend(inside.map(|i| (i, weights[i].sqrt())).filter(|(_, root)| *root > 0.0));
            self.fill(&mut block, &rows, first, data);
            let block = block.rows(0, rows.len());
            gram.gemm(1.0, &block.transpose(), &block, 1.0);
        }
        gram
    }

    /// The trend with these amplitudes in every frame.
    pub(super) fn of_trend(&self, amplitudes: &[f64], frames: usize) -> Vec<f64> {
        self.trend.values(&amplitudes[..self.trend.columns().min(amplitudes.len())], frames)
    }

    /// One term with its cosine and sine amplitude in every frame.
    pub(super) fn of_term(&self, term: usize, [cosine_m, sine_m]: [f64; 2], frames: usize) -> Vec<f64> {
        let mut values = Vec::with_capacity(frames);
        for first in (0..frames).step_by(BLOCK) {
            let turning = turning(&self.terms[term], first, frames);
            values.extend(turning.iter().take(frames - first).map(|[cosine, sine, _]| cosine_m * cosine + sine_m * sine));
        }
        values
    }

    fn fill(&self, block: &mut DMatrix<f64>, rows: &[(usize, f64)], first: usize, data: &[f64]) {
        let last = block.ncols() - 1;
        let columns = self.trend.columns();
        let mut basis = [0.0; MOST_COLUMNS];
        for (row, &(frame, root)) in rows.iter().enumerate() {
            self.trend.fill_first(abscissa(frame, data.len()), &mut basis);
            for (column, value) in basis.iter().take(columns.min(FIRST)).enumerate() {
                block[(row, column)] = root * value;
            }
            block[(row, last)] = root * data[frame];
        }
        for k in FIRST..columns {
            // column by column, so that the processor takes several rows at once; the recurrence holds for weighted values too
            let (before, mut now) = block.columns_range_pair_mut(..k, k);
            for (row, &(frame, _)) in rows.iter().enumerate() {
                now[row] = self.trend.next(k, abscissa(frame, data.len()), [before[(row, k - 1)], before[(row, k - 2)]]);
            }
        }
        for (place, term) in self.terms.iter().enumerate() {
            self.fill_term(block, rows, place, &turning(term, first, data.len()));
        }
    }

    fn fill_term(&self, block: &mut DMatrix<f64>, rows: &[(usize, f64)], term: usize, turning: &Turning) {
        let place = |of: Of| of.column(self.trend.columns(), term);
        let mut column = |of: Of, value: fn(f64, [f64; 3]) -> f64| {
            let mut column = block.column_mut(place(of));
            column.iter_mut().zip(rows).for_each(|(entry, (frame, root))| *entry = value(*root, turning[frame % BLOCK]));
        };
        column(Of::Cosine, |root, [cosine, _, _]| root * cosine);
        column(Of::Sine, |root, [_, sine, _]| root * sine);
        column(Of::CosineSlope, |root, [_, sine, angle_per_cycle]| -root * angle_per_cycle * sine);
        column(Of::SineSlope, |root, [cosine, _, angle_per_cycle]| root * angle_per_cycle * cosine);
    }
}

/// The frames of a block, each turned by the same angle and shrunk by the same factor from the one before.
fn turning(term: &Term, first: usize, frames: usize) -> Turning {
    let angle_per_cycle = |frame: usize| PI * abscissa(frame, frames);
    let envelope = (-term.nepers * (abscissa(first, frames) + 1.0) / 2.0).exp();
    let shrink = (-term.nepers / frames as f64).exp();
    let (sine, cosine) = (term.cycles * angle_per_cycle(first)).sin_cos();
    let (mut sine, mut cosine) = (envelope * sine, envelope * cosine);
    let (sine_of_turn, cosine_of_turn) = (term.cycles * 2.0 * PI / frames as f64).sin_cos();
    let (sine_of_turn, cosine_of_turn) = (shrink * sine_of_turn, shrink * cosine_of_turn);
    let mut turning = [[0.0; 3]; BLOCK];
    for (frame, slot) in turning.iter_mut().enumerate() {
        *slot = [cosine, sine, angle_per_cycle(first + frame)];
        (cosine, sine) = (cosine * cosine_of_turn - sine * sine_of_turn, sine * cosine_of_turn + cosine * sine_of_turn);
    }
    turning
}

#[cfg(test)]
mod tests {
    use super::super::Free;
    use super::*;

    #[test]
    fn inner_products_are_those_summed_frame_by_frame() {
        let frames = 700; // two whole blocks and a part
        let terms = [(31.3, 0.0), (122.9, 2.5)].map(|(cycles, nepers)| Term { cycles, nepers, free: Free::Both });
        let weights: Vec<f64> = (0..frames).map(|i| if i % 3 == 1 { 0.0 } else { 1.0 + i as f64 / 700.0 }).collect();
        let data: Vec<f64> = (0..frames).map(|i| (i as f64 * 0.37).sin()).collect();
        let columns = Columns { trend: Trend::Polynomial(2), terms: &terms };
        let gram = columns.gram(&data, &weights);
        assert_eq!(gram.shape(), (11, 11));
        let u = |i: usize| abscissa(i, frames);
        let envelope = |i: usize| (-2.5 * (u(i) + 1.0) / 2.0).exp();
        let slope = |i: usize| PI * u(i) * (PI * 122.9 * u(i)).cos() * envelope(i);
        let sum = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| (0..frames).map(|i| weights[i] * a(i) * b(i)).sum::<f64>();
        let cosine = |i: usize| (PI * 31.3 * u(i)).cos();
        assert!((gram[(Of::SineSlope.column(2, 1), 10)] - sum(&slope, &|i| data[i])).abs() < 1e-9);
        assert!((gram[(Of::Cosine.column(2, 0), 1)] - sum(&cosine, &u)).abs() < 1e-9);
        assert!((gram[(0, 0)] - sum(&|_| 1.0, &|_| 1.0)).abs() < 1e-9);
        let of_term = columns.of_term(1, [0.0, 2.0], frames);
        assert!((0..frames).all(|i| (of_term[i] - 2.0 * envelope(i) * (PI * 122.9 * u(i)).sin()).abs() < 1e-10));
    }
}
