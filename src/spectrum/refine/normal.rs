//! Weighted inner products of a trend, sinusoids and the data over the frames present.

use crate::spectrum::detrend::{abscissa, basis};
use nalgebra::DMatrix;
use std::f64::consts::PI;

/// Frames gathered before they are multiplied out: a block stays in cache, and sinusoids advanced by rotation start afresh in each.
const BLOCK: usize = 256;

/// The columns of one sinusoid of `n` cycles in the record: `u` runs over it from -1 to 1, and its phase is `pi n u`.
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
    pub(super) fn column(self, trend: usize, sinusoid: usize) -> usize {
        trend + 4 * sinusoid + self as usize
    }
}

/// What is fitted to a record.
pub(super) struct Columns<'a> {
    /// Coefficients of the trend.
    pub trend: usize,
    /// Cycles in the record of each sinusoid.
    pub cycles: &'a [f64],
}

impl Columns<'_> {
    /// Inner products of all columns, the data last; frames of weight zero take no part.
    pub(super) fn gram(&self, data: &[f64], weight: impl Fn(usize) -> f64) -> DMatrix<f64> {
        let width = self.trend + 4 * self.cycles.len() + 1;
        let mut gram = DMatrix::zeros(width, width);
        let mut block = DMatrix::zeros(BLOCK, width);
        for first in (0..data.len()).step_by(BLOCK) {
            let frames = first..(first + BLOCK).min(data.len());
            let rows: Vec<(usize, f64)> = frames.map(|i| (i, weight(i).sqrt())).filter(|(_, root)| *root > 0.0).collect();
            self.fill(&mut block, &rows, first, data);
            let block = block.rows(0, rows.len());
            gram.gemm(1.0, &block.transpose(), &block, 1.0);
        }
        gram
    }

    /// The trend and the cosine and sine of each sinusoid with these amplitudes, in every frame.
    pub(super) fn model(&self, amplitudes: &[f64], frames: usize) -> Vec<f64> {
        let (trend, pairs) = amplitudes.split_at(self.trend.min(amplitudes.len()));
        let of_trend = |frame: usize| basis(abscissa(frame, frames)).iter().zip(trend).map(|(b, c)| b * c).sum::<f64>();
        let mut model: Vec<f64> = (0..frames).map(of_trend).collect();
        for (cycles, pair) in self.cycles.iter().zip(pairs.chunks_exact(2)) {
            for (block, values) in model.chunks_mut(BLOCK).enumerate() {
                let turning = turning(*cycles, block * BLOCK, frames);
                values.iter_mut().zip(turning).for_each(|(value, [cosine, sine, _])| *value += pair[0] * cosine + pair[1] * sine);
            }
        }
        model
    }

    fn fill(&self, block: &mut DMatrix<f64>, rows: &[(usize, f64)], first: usize, data: &[f64]) {
        let last = block.ncols() - 1;
        for (row, &(frame, root)) in rows.iter().enumerate() {
            for (column, value) in basis(abscissa(frame, data.len())).into_iter().take(self.trend).enumerate() {
                block[(row, column)] = root * value;
            }
            block[(row, last)] = root * data[frame];
        }
        for (sinusoid, cycles) in self.cycles.iter().enumerate() {
            self.fill_sinusoid(block, rows, sinusoid, &turning(*cycles, first, data.len()));
        }
    }

    fn fill_sinusoid(&self, block: &mut DMatrix<f64>, rows: &[(usize, f64)], sinusoid: usize, turning: &[[f64; 3]]) {
        let place = |of: Of| of.column(self.trend, sinusoid);
        for (row, &(frame, root)) in rows.iter().enumerate() {
            let [cosine, sine, angle_per_cycle] = turning[frame % BLOCK];
            block[(row, place(Of::Cosine))] = root * cosine;
            block[(row, place(Of::Sine))] = root * sine;
            block[(row, place(Of::CosineSlope))] = -root * angle_per_cycle * sine;
            block[(row, place(Of::SineSlope))] = root * angle_per_cycle * cosine;
        }
    }
}

/// Cosine, sine and `pi u` of the frames of a block, each sinusoid turned by the same angle from frame to frame.
fn turning(cycles: f64, first: usize, frames: usize) -> Vec<[f64; 3]> {
    let angle_per_cycle = |frame: usize| PI * abscissa(frame, frames);
    let (mut sine, mut cosine) = (cycles * angle_per_cycle(first)).sin_cos();
    let (sine_of_turn, cosine_of_turn) = (cycles * 2.0 * PI / frames as f64).sin_cos();
    let advance = |frame| {
        let now = [cosine, sine, angle_per_cycle(frame)];
        (cosine, sine) = (cosine * cosine_of_turn - sine * sine_of_turn, sine * cosine_of_turn + cosine * sine_of_turn);
        now
    };
    (first..first + BLOCK).map(advance).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inner_products_are_those_summed_frame_by_frame() {
        let frames = 700; // two whole blocks and a part
        let (cycles, weight) = ([31.3, 122.9], |i: usize| if i % 3 == 1 { 0.0 } else { 1.0 + i as f64 / 700.0 });
        let data: Vec<f64> = (0..frames).map(|i| (i as f64 * 0.37).sin()).collect();
        let gram = Columns { trend: 2, cycles: &cycles }.gram(&data, weight);
        assert_eq!(gram.shape(), (11, 11));
        let u = |i: usize| abscissa(i, frames);
        let slope = |i: usize| PI * u(i) * (PI * cycles[1] * u(i)).cos();
        let sum = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| (0..frames).map(|i| weight(i) * a(i) * b(i)).sum::<f64>();
        let cosine = |i: usize| (PI * cycles[0] * u(i)).cos();
        assert!((gram[(Of::SineSlope.column(2, 1), 10)] - sum(&slope, &|i| data[i])).abs() < 1e-9);
        assert!((gram[(Of::Cosine.column(2, 0), 1)] - sum(&cosine, &u)).abs() < 1e-9);
        assert!((gram[(0, 0)] - sum(&|_| 1.0, &|_| 1.0)).abs() < 1e-9);
    }
}
