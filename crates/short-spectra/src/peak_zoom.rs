//! Location of a peak in the spectrum of a long record with few bins, by evaluating the transform between
//! bins.
//!
//! The record is demodulated once by the frequency of the bin and summed in about a thousand blocks. Near
//! that frequency the sums represent the record, because a frequency difference of a fraction of a cycle per
//! record hardly changes the phase within a block.

use portable_math as math;
use std::f64::consts::TAU;

/// Number of blocks that represent the record. A frequency difference of half a cycle per record changes the
/// phase by 0.003 rad within a block, which lowers the amplitude by a fraction of 4e-7.
const DEMODULATED_BLOCKS: usize = 1024;
/// Number of frames after which a rotated phasor is computed afresh, so that rounding errors do not
/// accumulate.
const FRAMES_PER_RESTART: usize = 256;
/// Distance, in cycles in the record, between the three amplitudes that define a parabola: an eighth of a
/// resolution.
const PARABOLA_SPACING: f64 = 0.125;
/// Number of parabolas that are fitted in turn. Each is centred on the vertex of the one before, at most half
/// a spacing away, because a parabola is exact only at its own centre.
const PARABOLAS: usize = 6;

/// A weighted record.
pub(super) struct WeightedRecord<'a> {
    /// The record without its trend, m.
    pub residual: &'a [f64],
    /// Weight of each frame.
    pub weights: &'a [f64],
    /// Factor that converts a weighted sum over the frames to an amplitude.
    pub amplitude_scale: f64,
}

impl WeightedRecord<'_> {
    /// Cycles in the record and amplitude, m, of the peak near `cycles`.
    pub(super) fn zoom_peak(&self, cycles: f64) -> (f64, f64) {
        let (length, pieces) = self.demodulate_blocks(cycles);
        let frames = self.residual.len() as f64;
        let turn_per_cycle = |piece: usize| TAU * (piece as f64 + 0.5) * length as f64 / frames;
        let amplitude_m = |shift: f64| {
            let turned = |(piece, [real, imaginary]): (usize, &[f64; 2])| {
                let (sine, cosine) = math::sin_cos(shift * turn_per_cycle(piece));
                [real * cosine + imaginary * sine, imaginary * cosine - real * sine]
            };
            let sum = pieces.iter().enumerate().map(turned);
            let sum = sum.fold([0.0, 0.0], |sum, z| [sum[0] + z[0], sum[1] + z[1]]);
            self.amplitude_scale * math::hypot(sum[0], sum[1])
        };
        let next = |(shift, _): (f64, f64), _| {
            let around = [-1.0, 0.0, 1.0].map(|k| amplitude_m(shift + k * PARABOLA_SPACING));
            let (by, height_m) = log_parabola_vertex(around);
            (shift + by * PARABOLA_SPACING, height_m)
        };
        let (shift, height_m) = (0..PARABOLAS).fold((0.0, 0.0), next);
        (cycles + shift, height_m)
    }

    /// Number of frames of a block, and the sums over the blocks of the record demodulated by `cycles`.
    fn demodulate_blocks(&self, cycles: f64) -> (usize, Vec<[f64; 2]>) {
        let frames = self.residual.len();
        let length = frames.div_ceil(DEMODULATED_BLOCKS).max(1);
        let turn = -TAU * cycles / frames as f64;
        let (sine_by, cosine_by) = math::sin_cos(turn);
        let piece = |start: usize| {
            let mut sum = [0.0, 0.0];
            for first in (start..frames.min(start + length)).step_by(FRAMES_PER_RESTART) {
                let (mut sine, mut cosine) = math::sin_cos(turn * first as f64);
                let inside = first..frames.min(start + length).min(first + FRAMES_PER_RESTART);
                for (x, w) in self.residual[inside.clone()].iter().zip(&self.weights[inside]) {
                    sum = [sum[0] + x * w * cosine, sum[1] + x * w * sine];
                    (cosine, sine) =
                        (cosine * cosine_by - sine * sine_by, sine * cosine_by + cosine * sine_by);
                }
            }
            sum
        };
        (length, (0..frames).step_by(length).map(piece).collect())
    }
}

/// Vertex of the parabola through the logarithms of three equidistant amplitudes. Returns the distance of the
/// vertex from the middle amplitude, in spacings, and the height of the vertex.
pub(super) fn log_parabola_vertex(around: [f64; 3]) -> (f64, f64) {
    let [left, top, right] = around.map(|a| math::ln(a.max(f64::MIN_POSITIVE)));
    let curvature = left - 2.0 * top + right;
    let shift = if curvature < 0.0 { ((left - right) / (2.0 * curvature)).clamp(-0.5, 0.5) } else { 0.0 };
    (shift, math::exp(top - (left - right) * shift / 4.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_is_found_between_bins_half_a_resolution_apart() {
        let frames = 20_000;
        let tone = |i: usize| 3e-6 * (TAU * 1234.567 * (i as f64 + 0.5) / frames as f64 + 0.3).sin();
        let residual: Vec<f64> = (0..frames).map(tone).collect();
        let weights: Vec<f64> = (0..frames)
            .map(|i| (std::f64::consts::PI * (i as f64 + 0.5) / frames as f64).sin().powi(2))
            .collect();
        let record = WeightedRecord {
            residual: &residual,
            weights: &weights,
            amplitude_scale: 2.0 / weights.iter().sum::<f64>(),
        };
        for start in [1234.3, 1234.567, 1234.8] {
            let (cycles, amplitude_m) = record.zoom_peak(start);
            assert!(
                (cycles - 1234.567).abs() < 1e-6 && (amplitude_m / 3e-6 - 1.0).abs() < 1e-6,
                "{start}: {cycles} {amplitude_m:e}"
            );
        }
    }
}
