//! The fast Fourier transform of real samples.
//!
//! Libraries choose another order of additions for each kind of processor, and the system's sines, so their
//! last bits are those of one machine. Here they are not: the complex transform of half the length, the
//! samples taken in pairs, by steps of four parts that need no reordering (Stockham; Van Loan, "Computational
//! frameworks for the fast Fourier transform", 1992, 1.7), and then the two halves taken apart.

use crate::math;
use std::cell::RefCell;
use std::collections::HashMap;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::sync::Arc;

/// A value of a transform.
pub(super) type Complex = nalgebra::Complex<f64>;

thread_local! {
    /// Turns of the lengths that this thread has met: they take as long as a transform.
    static TURNS: RefCell<HashMap<usize, Arc<[Complex]>>> = RefCell::default();
}

/// A transform of one length.
pub(super) struct Transform {
    padded: usize,
    /// `exp(-2 pi i k / padded)` for a quarter of a turn.
    turns: Arc<[Complex]>,
}

impl Transform {
    /// For records padded with zeros to `padded` values, a power of two from 2 on.
    pub(super) fn of(padded: usize) -> Self {
        debug_assert!(padded.is_power_of_two() && padded >= 2);
        let turns = TURNS.with_borrow_mut(|known| {
            known.entry(padded).or_insert_with(|| quarter_turn(padded).into()).clone()
        });
        Self { padded, turns }
    }

    /// `sum x exp(-2 pi i k n / padded)` for every `k` from 0 to half the length, which is at least that of
    /// `values`.
    pub(super) fn values(&self, values: impl Iterator<Item = f64>) -> Vec<Complex> {
        let half = self.padded / 2;
        let mut pairs = Vec::with_capacity(half + 1);
        let mut values = values.take(self.padded);
        while let Some(re) = values.next() {
            pairs.push(Complex { re, im: values.next().unwrap_or(0.0) });
        }
        pairs.resize(half, Complex::default());
        let mut transformed = self.of_pairs(pairs);
        take_apart(&mut transformed, &self.turns);
        transformed
    }

    /// Magnitudes of [`Self::values`].
    pub(super) fn magnitudes(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        self.values(values).iter().map(|z| math::hypot(z.re, z.im)).collect()
    }

    /// The squares of [`Self::magnitudes`], in a fraction of the time.
    pub(super) fn squares(&self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        self.values(values).iter().map(|z| z.norm_sqr()).collect()
    }

    /// The complex transform of half the length.
    fn of_pairs(&self, mut from: Vec<Complex>) -> Vec<Complex> {
        let mut to = Vec::with_capacity(from.len() + 1);
        to.resize(from.len(), Complex::default());
        let (mut parts, mut stride) = (from.len(), 1);
        while parts >= 4 {
            in_four(&from, &mut to, stride, &self.turns);
            (parts, stride) = (parts / 4, stride * 4);
            std::mem::swap(&mut from, &mut to);
        }
        if parts == 2 {
            in_two(&from, &mut to);
            std::mem::swap(&mut from, &mut to);
        }
        from
    }
}

/// `exp(-2 pi i k / length)` for `k` from 0 to a quarter of the length; its second half is the first one
/// mirrored.
fn quarter_turn(length: usize) -> Vec<Complex> {
    let quarter = length / 4;
    let mut turns = vec![Complex { re: 1.0, im: 0.0 }; quarter + 1];
    for k in 1..=quarter / 2 {
        let (sin, cos) = math::sin_cos(TAU * (k as f64 / length as f64));
        turns[k] = Complex { re: cos, im: -sin };
        turns[quarter - k] = Complex { re: sin, im: -cos };
    }
    if quarter >= 1 {
        turns[quarter] = Complex { re: 0.0, im: -1.0 };
    }
    if length.is_multiple_of(8) {
        turns[quarter / 2] = Complex { re: FRAC_1_SQRT_2, im: -FRAC_1_SQRT_2 };
    }
    turns
}

/// One step: what is left to do are `4 stride` transforms of a fourth of the length.
fn in_four(from: &[Complex], to: &mut [Complex], stride: usize, turns: &[Complex]) {
    let fourth = from.len() / 4;
    let (a, rest) = from.split_at(fourth);
    let (b, rest) = rest.split_at(fourth);
    let (c, d) = rest.split_at(fourth);
    let (a, b) = (a.chunks_exact(stride), b.chunks_exact(stride));
    let (c, d) = (c.chunks_exact(stride), d.chunks_exact(stride));
    let parts = a.zip(b).zip(c).zip(d);
    for (i, ((((a, b), c), d), to)) in parts.zip(to.chunks_exact_mut(4 * stride)).enumerate() {
        // (the table is of twice the length)
        let once = turns[2 * stride * i];
        let twice = once * once;
        let thrice = twice * once;
        let (to_a, rest) = to.split_at_mut(stride);
        let (to_b, rest) = rest.split_at_mut(stride);
        let (to_c, to_d) = rest.split_at_mut(stride);
        for q in 0..stride {
            let (sum, difference) = (a[q] + c[q], a[q] - c[q]);
            let (other_sum, other) = (b[q] + d[q], b[q] - d[q]);
            let turned = Complex { re: other.im, im: -other.re }; // by -i
            to_a[q] = sum + other_sum;
            to_b[q] = once * (difference + turned);
            to_c[q] = twice * (sum - other_sum);
            to_d[q] = thrice * (difference - turned);
        }
    }
}

/// The last step where the length is no power of four.
fn in_two(from: &[Complex], to: &mut [Complex]) {
    let half = from.len() / 2;
    let (a, b) = from.split_at(half);
    let (sum, difference) = to.split_at_mut(half);
    for q in 0..half {
        sum[q] = a[q] + b[q];
        difference[q] = a[q] - b[q];
    }
}

/// The transform of the samples from that of their pairs: the even samples have its even part, the odd ones
/// its odd part.
fn take_apart(values: &mut Vec<Complex>, turns: &[Complex]) {
    let half = values.len();
    values.push(values[0]);
    for k in 0..=half / 2 {
        let (low, high) = (values[k], values[half - k].conj());
        let even = (low + high) * 0.5;
        let odd = (low - high) * 0.5;
        let turned = turns[k] * Complex { re: odd.im, im: -odd.re };
        values[k] = even + turned;
        values[half - k] = (even - turned).conj();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples without any pattern.
    fn samples(length: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..length).map(|_| next()).collect()
    }

    #[test]
    fn values_are_the_sums_that_define_them() {
        for length in [2, 4, 8, 16, 32, 64, 256, 2048] {
            let samples = samples(length);
            let found = Transform::of(length).values(samples.iter().copied());
            assert_eq!(found.len(), length / 2 + 1);
            for (k, value) in found.iter().enumerate() {
                let turn = |n: usize| TAU * ((k * n) % length) as f64 / length as f64;
                let re: f64 = samples.iter().enumerate().map(|(n, x)| x * turn(n).cos()).sum();
                let im: f64 = samples.iter().enumerate().map(|(n, x)| -x * turn(n).sin()).sum();
                let error = (value.re - re).hypot(value.im - im);
                assert!(error < 1e-15 * length as f64, "{length} {k}: {error:e}");
            }
        }
    }

    #[test]
    fn a_long_transform_keeps_the_power_of_its_samples() {
        let length = 1 << 18;
        let samples = samples(length - 1001);
        let squares = Transform::of(length).squares(samples.iter().copied());
        let all: f64 = squares.iter().sum::<f64>() * 2.0 - squares[0] - squares[length / 2];
        let power: f64 = samples.iter().map(|x| x * x).sum();
        assert!((all / length as f64 / power - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_cosine_is_one_bin() {
        let length = 4096;
        let cosine = (0..length).map(|n| (TAU * ((37 * n) % length) as f64 / length as f64).cos());
        let magnitudes = Transform::of(length).magnitudes(cosine);
        for (k, magnitude) in magnitudes.iter().enumerate() {
            let expected = if k == 37 { length as f64 / 2.0 } else { 0.0 };
            assert!((magnitude - expected).abs() < 1e-11, "{k}: {magnitude:e}");
        }
    }
}
