//! Sine tapers, orthonormal over the frames present.
//!
//! Over `n` frames without gaps the tapers `sqrt(2/(n+1)) sin(pi k m/(n+1))`, `m = 1..n`, `k = 1..K`, are
//! orthonormal (Riedel and Sidorenko 1995, eq. 2). Where frames are missing they are not; with their inner
//! products `G` over the frames present, `G^(-1/2)` times the tapers are, and of all such sets these are the
//! nearest to the tapers themselves.

use super::map_parallel_above;
use crate::math;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

/// Frames whose inner products are summed at a time: the sum is the same for any number of threads.
const PRODUCT_BLOCK: usize = 1 << 15;
/// Combinations of tapers with less than this share of the largest's energy on the frames present are left
/// out: they lie in the gaps, and brought to unit energy they would leak over the whole spectrum.
const LEAST_ENERGY_SHARE: f64 = 0.1;

/// Combinations of sine tapers.
pub(super) struct SineTapers {
    /// Angle from frame to frame of the first taper.
    turn: f64,
    /// A row for each taper: its combination of the sines.
    rows: DMatrix<f64>,
}

impl SineTapers {
    /// At most `count` tapers for a record; fewer where its gaps leave room for fewer only.
    pub(super) fn new(samples: &[Option<f64>], count: usize) -> Self {
        let turn = PI / (samples.len() + 1) as f64;
        let sines = DMatrix::identity(count, count) * (2.0 / (samples.len() + 1) as f64).sqrt();
        let rows = if samples.iter().all(Option::is_some) {
            sines
        } else {
            orthonormal_combinations(&taper_inner_products(samples, turn, count))
        };
        Self { turn, rows }
    }

    pub(super) fn len(&self) -> usize {
        self.rows.nrows()
    }

    /// The taper of a row in a frame, by Clenshaw's recurrence.
    pub(super) fn value(&self, row: &[f64], frame: usize) -> f64 {
        let (sine, cosine) = math::sin_cos(self.turn * (frame + 1) as f64);
        let next = |(b1, b2): (f64, f64), c: &f64| (c + 2.0 * cosine * b1 - b2, b1);
        sine * row.iter().rev().fold((0.0, 0.0), next).0
    }

    /// What the sines are multiplied with to give a taper.
    pub(super) fn coefficients(&self, taper: usize) -> Vec<f64> {
        self.rows.row(taper).iter().copied().collect()
    }
}

/// `sum sin(j a) sin(k a)` over the frames present, `a` the angle of the frame.
fn taper_inner_products(samples: &[Option<f64>], turn: f64, count: usize) -> DMatrix<f64> {
    let block = |index: usize| {
        let mut sum = DMatrix::zeros(count, count);
        let mut sines = DVector::zeros(count);
        for frame in (index * PRODUCT_BLOCK..samples.len().min((index + 1) * PRODUCT_BLOCK))
            .filter(|frame| samples[*frame].is_some())
        {
            let (sine, cosine) = math::sin_cos(turn * (frame + 1) as f64);
            let (mut before, mut now) = (0.0, sine);
            for value in &mut sines {
                *value = now;
                (before, now) = (now, 2.0 * cosine * now - before);
            }
            sum.ger(1.0, &sines, &sines, 1.0);
        }
        sum
    };
    map_parallel_above(samples.len().div_ceil(PRODUCT_BLOCK), samples.len(), block).into_iter().sum()
}

/// `G^(-1/2)`, or where some combinations lie in the gaps, the combinations that do not, each of unit energy.
fn orthonormal_combinations(products: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = products.clone().symmetric_eigen();
    let least = LEAST_ENERGY_SHARE * eigen.eigenvalues.max();
    let kept: Vec<usize> = (0..eigen.eigenvalues.len()).filter(|i| eigen.eigenvalues[*i] > least).collect();
    let directions = eigen.eigenvectors.select_columns(&kept);
    let scale = DMatrix::from_diagonal(&DVector::from_iterator(
        kept.len(),
        kept.iter().map(|i| eigen.eigenvalues[*i].sqrt().recip()),
    ));
    if kept.len() == eigen.eigenvalues.len() {
        &directions * scale * directions.transpose()
    } else {
        scale * directions.transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(samples: &[Option<f64>], count: usize) -> Vec<Vec<f64>> {
        let tapers = SineTapers::new(samples, count);
        let taper = |k: usize| {
            (0..samples.len())
                .map(|i| samples[i].map_or(0.0, |_| tapers.value(&tapers.coefficients(k), i)))
                .collect()
        };
        (0..tapers.len()).map(taper).collect()
    }

    fn worst(tapers: &[Vec<f64>]) -> f64 {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut worst = 0.0_f64;
        for (j, a) in tapers.iter().enumerate() {
            for (k, b) in tapers.iter().enumerate() {
                worst = worst.max((product(a, b) - f64::from(u8::from(j == k))).abs());
            }
        }
        worst
    }

    #[test]
    fn without_gaps_they_are_the_sines_and_orthonormal() {
        let tapers = table(&[Some(0.0); 750], 7);
        assert_eq!(tapers.len(), 7);
        assert!((tapers[4][99] - (2.0_f64 / 751.0).sqrt() * (PI * 5.0 * 100.0 / 751.0).sin()).abs() < 1e-14);
        assert!(worst(&tapers) < 1e-12, "{:e}", worst(&tapers));
    }

    #[test]
    fn with_gaps_they_are_orthonormal_over_the_frames_present() {
        let scattered: Vec<_> = (0..750).map(|i| (i * i % 7 != 2 && i % 11 != 5).then_some(0.0)).collect();
        let one_long: Vec<_> = (0..750).map(|i| (!(300..420).contains(&i)).then_some(0.0)).collect();
        for (samples, missing) in [(&scattered, 263), (&one_long, 120)] {
            assert_eq!(samples.iter().filter(|x| x.is_none()).count(), missing);
            let tapers = table(samples, 7);
            assert_eq!(tapers.len(), 7);
            assert!(worst(&tapers) < 1e-12, "{:e}", worst(&tapers));
        }
    }

    #[test]
    fn combinations_that_lie_in_a_gap_are_left_out() {
        let half: Vec<_> = (0..750).map(|i| (!(200..550).contains(&i)).then_some(0.0)).collect();
        let tapers = table(&half, 7);
        assert!((2..7).contains(&tapers.len()), "{}", tapers.len());
        assert!(worst(&tapers) < 1e-12, "{:e}", worst(&tapers));
    }
}
