//! Frequency and decay of a ring-down by the matrix pencil, in a band around a peak.
//!
//! The record is demodulated by the frequency of the peak and summed in blocks of `D` frames. The block sums
//! of an exponential `z^n` are again an exponential, `z^(mD)` times a constant. Sixty block sums therefore
//! represent the record. A decay from the first frame on remains exact, whereas a filter would blur it. The
//! number of exponentials is the number of singular values above the noise of the Hankel matrix of the sums,
//! by the minimum description length. The shift from each row of the matrix to the next gives the poles (Hua
//! and Sarkar 1990; Roy and Kailath 1989).

use nalgebra::{Complex, DMatrix, DVector};
use portable_math as math;
use std::f64::consts::TAU;

/// Number of blocks that represent the record: a decay within a twentieth of the record still spans three
/// blocks, and the matrix is solved in a millisecond.
const BLOCKS: usize = 60;
/// Maximum number of exponentials: the peak, its mirror image, a residue of the trend and their neighbours.
const MOST_POLES: usize = 8;
/// Largest allowed distance, in cycles in the record, between the frequency of a pole and that of its peak.
/// It is increased for a pole that decays or grows.
const FARTHEST_POLE: f64 = 2.0;
/// Relative precision of a decomposition.
const PRECISION: f64 = 5.0 * f64::EPSILON;
/// Maximum number of iterations of a decomposition. One that converges takes a few per row; with gaps in the
/// record it may not converge.
const MOST_ITERATIONS: usize = 2000;
/// Largest allowed growth, in nepers, of a pole over the record. With a larger growth, which a record of
/// mostly gaps may give, powers of a pole come near the largest floating-point number.
const MOST_NEPERS: f64 = 200.0;
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pole {
    /// Cycles in the record.
    pub cycles: f64,
    /// Decay over the record, nepers.
    pub nepers: f64,
}

/// The strongest pole near `cycles` in a record without gaps.
pub(super) fn find_pole(record: &[f64], cycles: f64) -> Option<Pole> {
    let size = record.len().div_ceil(BLOCKS).max(1);
    let sums = block_sums(record, cycles, size);
    let per_record = record.len() as f64 / size as f64; // blocks in the record, not a whole number
    let shifts = block_shifts(&sums)?;
    let energies = pole_energies(&sums, &shifts)?;
    let near = |shift: Complex<f64>| {
        let (turn, gain) = (math::atan2(shift.im, shift.re), math::ln(magnitude(&shift)));
        let pole = Pole { cycles: cycles + turn / TAU * per_record, nepers: -gain * per_record };
        let width = FARTHEST_POLE + pole.nepers.abs() / TAU;
        ((pole.cycles - cycles).abs() <= width && pole.cycles > 0.0).then_some(pole)
    };
    let found = shifts.iter().zip(energies).filter_map(|(shift, energy)| Some((near(*shift)?, energy)));
    found.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(pole, _)| pole)
}

fn block_sums(record: &[f64], cycles: f64, size: usize) -> Vec<Complex<f64>> {
    let turn = -TAU * cycles / record.len() as f64;
    let sum = |(block, values): (usize, &[f64])| {
        let turned = |(i, x): (usize, &f64)| {
            let (sin, cos) = math::sin_cos(turn * (block * size + i) as f64);
            Complex::new(x * cos, x * sin)
        };
        values.iter().enumerate().map(turned).sum()
    };
    record.chunks_exact(size).enumerate().map(sum).collect()
}

fn magnitude(z: &Complex<f64>) -> f64 {
    math::hypot(z.re, z.im)
}

/// For each exponential, the factor by which it changes from one block to the next.
fn block_shifts(sums: &[Complex<f64>]) -> Option<Vec<Complex<f64>>> {
    let rows = sums.len() / 2;
    let columns = sums.len() + 1 - rows;
    if rows < 2 * MOST_POLES {
        return None;
    }
    let hankel = DMatrix::from_fn(rows, columns, |i, j| sums[i + j]);
    let svd = hankel.try_svd(true, false, PRECISION, MOST_ITERATIONS)?;
    let order = model_order(svd.singular_values.as_slice(), columns)?;
    let left = svd.u?;
    let (upper, lower) = (left.view((0, 0), (rows - 1, order)), left.view((1, 0), (rows - 1, order)));
    let turn = (upper.adjoint() * upper).lu().solve(&(upper.adjoint() * lower))?;
    let last = (sums.len() - 1) as f64;
    let usable = |z: &Complex<f64>| magnitude(z) > 0.0 && math::ln(magnitude(z)) * last < MOST_NEPERS;
    let (_, triangular) = turn.try_schur(f64::EPSILON, MOST_ITERATIONS)?.unpack();
    Some(triangular.diagonal().iter().copied().filter(usable).collect())
}

/// Number of exponentials by the minimum description length of Wax and Kailath (1985); `None` for zero.
fn model_order(singular_values: &[f64], samples: usize) -> Option<usize> {
    let (all, samples) = (singular_values.len(), samples as f64);
    let powers: Vec<f64> = singular_values.iter().map(|s| (s * s).max(f64::MIN_POSITIVE)).collect();
    let length = |order: usize| {
        let rest = &powers[order..];
        let count = rest.len() as f64;
        let likelihood = rest.iter().map(|p| math::ln(*p)).sum::<f64>()
            - count * math::ln(rest.iter().sum::<f64>() / count);
        -samples * likelihood + 0.5 * (order * (2 * all - order)) as f64 * math::ln(samples)
    };
    let order = (0..=MOST_POLES.min(all.checked_sub(1)?)).min_by(|a, b| length(*a).total_cmp(&length(*b)));
    order.filter(|order| *order > 0)
}

/// Energy of each exponential over the record.
fn pole_energies(sums: &[Complex<f64>], shifts: &[Complex<f64>]) -> Option<Vec<f64>> {
    let powers = DMatrix::from_fn(sums.len(), shifts.len(), |i, j| shifts[j].powu(i as u32));
    let svd = powers.clone().try_svd(true, true, PRECISION, MOST_ITERATIONS)?;
    let amplitudes = svd.solve(&DVector::from_column_slice(sums), f64::EPSILON).ok()?;
    let energy = |(amplitude, column): (&Complex<f64>, _)| {
        amplitude.norm_sqr() * nalgebra::Matrix::norm_squared(&column)
    };
    Some(amplitudes.iter().zip(powers.column_iter()).map(energy).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring_down(frames: usize, cycles: f64, nepers: f64) -> Vec<f64> {
        (0..frames)
            .map(|i| i as f64 / frames as f64)
            .map(|s| (-nepers * s).exp() * (TAU * cycles * s + 0.4).cos())
            .collect()
    }

    #[test]
    fn a_ring_down_without_noise_is_found_exactly_from_a_start_that_is_off() {
        for (frames, cycles, nepers) in
            [(750, 11.76, 7.4), (751, 135.0, 1.0), (200, 20.3, 0.0), (3001, 11.76, 30.0)]
        {
            let found = find_pole(&ring_down(frames, cycles, nepers), cycles + 0.4).unwrap();
            assert!(
                (found.cycles - cycles).abs() < 1e-6 && (found.nepers - nepers).abs() < 1e-6,
                "{cycles} {nepers}: {found:?}"
            );
        }
    }

    #[test]
    fn two_ring_downs_closer_than_a_resolution_are_resolved() {
        let both: Vec<f64> = ring_down(750, 30.0, 2.0)
            .into_iter()
            .zip(ring_down(750, 30.7, 3.0))
            .map(|(a, b)| a + 2.0 * b)
            .collect();
        let found = find_pole(&both, 30.5).unwrap();
        assert!((found.cycles - 30.7).abs() < 1e-5 && (found.nepers - 3.0).abs() < 1e-5, "{found:?}");
    }

    #[test]
    fn a_record_that_is_mostly_gaps_comes_to_an_end() {
        // values at the ends only, which give growing and decaying poles of any size
        let ends: Vec<f64> = (0..900)
            .map(|i| {
                if (20..880).contains(&i) {
                    0.0
                } else {
                    1e-3 * (f64::from(i) * 0.7).sin() + 1e-6 * f64::from(i * i % 13)
                }
            })
            .collect();
        for cycles in 1..440 {
            let found = find_pole(&ends, f64::from(cycles));
            assert!(found.is_none_or(|pole| pole.cycles.is_finite() && pole.nepers.is_finite()), "{found:?}");
        }
    }

    #[test]
    fn nothing_near_is_none_and_too_little_too() {
        assert_eq!(find_pole(&ring_down(750, 60.0, 1.0), 30.0), None);
        assert_eq!(find_pole(&ring_down(20, 5.0, 1.0), 5.0), None);
        assert_eq!(find_pole(&[0.0; 750], 30.0), None);
    }
}
