//! What is removed from a record before its transform: a polynomial, by least squares over the frames present.

use nalgebra::{DMatrix, DVector};

/// The polynomial that is removed.
///
/// The flip of a blade is far larger than the components that ride on it. Removing only its mean or a line leaves 0.9 to 1 Hz of
/// error at 78 Hz in 0.15 s; a cubic leaves 0.03 Hz.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Detrend {
    /// Nothing.
    None,
    /// The mean.
    Mean,
    /// A straight line.
    Line,
    /// A cubic.
    #[default]
    Cubic,
}

/// A name of no detrending.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown detrending `{found}`; expected `none`, `mean`, `line` or `cubic`")]
pub struct UnknownDetrend {
    /// The name as written.
    pub found: String,
}

impl Detrend {
    /// Every choice.
    pub const ALL: [Self; 4] = [Self::None, Self::Mean, Self::Line, Self::Cubic];

    /// Name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Mean => "mean",
            Self::Line => "line",
            Self::Cubic => "cubic",
        }
    }

    /// The choice of that [`Self::name`].
    ///
    /// # Errors
    /// [`UnknownDetrend`] with the known names.
    pub fn parse(text: &str) -> Result<Self, UnknownDetrend> {
        Self::ALL.into_iter().find(|d| d.name() == text).ok_or_else(|| UnknownDetrend { found: text.to_owned() })
    }

    /// Coefficients of the polynomial.
    pub(super) fn coefficients(self) -> usize {
        match self {
            Self::None => 0,
            Self::Mean => 1,
            Self::Line => 2,
            Self::Cubic => 4,
        }
    }

    /// The samples less the polynomial; zero where there is none.
    pub(super) fn residual(self, samples: &[Option<f64>]) -> Vec<f64> {
        let trend = fit(samples, self.coefficients());
        let value = |i: usize| trend.as_ref().map_or(0.0, |c| basis(abscissa(i, samples.len())).iter().zip(c.iter()).map(|(b, c)| b * c).sum());
        samples.iter().enumerate().map(|(i, x)| x.map_or(0.0, |x| x - value(i))).collect()
    }
}

impl std::str::FromStr for Detrend {
    type Err = UnknownDetrend;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::parse(text)
    }
}

/// Frame number scaled to -1..1, so that powers stay comparable.
pub(super) fn abscissa(index: usize, frames: usize) -> f64 {
    2.0 * (index as f64 + 0.5) / frames as f64 - 1.0
}

/// Legendre polynomials: orthogonal over a record without gaps.
pub(super) fn basis(s: f64) -> [f64; 4] {
    [1.0, s, (3.0 * s * s - 1.0) / 2.0, (5.0 * s * s - 3.0) * s / 2.0]
}

/// Coefficients by singular values of the normal equations, so that frames in one clump cannot make them singular.
fn fit(samples: &[Option<f64>], coefficients: usize) -> Option<DVector<f64>> {
    /// Directions of the normal matrix below this share of the number of frames are not in the data.
    const SINGULAR: f64 = 1e-12;
    if coefficients == 0 {
        return None;
    }
    let (mut normal, mut right) = ([[0.0; 4]; 4], [0.0; 4]); // on the stack: a million frames each add to it
    for (s, x) in samples.iter().enumerate().filter_map(|(i, x)| x.map(|x| (abscissa(i, samples.len()), x))) {
        let row = basis(s);
        for i in 0..coefficients {
            (0..coefficients).for_each(|j| normal[i][j] += row[i] * row[j]);
            right[i] += row[i] * x;
        }
    }
    let normal = DMatrix::from_fn(coefficients, coefficients, |i, j| normal[i][j]);
    let right = DVector::from_fn(coefficients, |i, _| right[i]);
    normal.svd(true, true).solve(&right, SINGULAR * samples.len() as f64).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn largest(residual: &[f64]) -> f64 {
        residual.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
    }

    #[test]
    fn a_cubic_is_removed_exactly_also_with_gaps() {
        let cubic = |i: usize| 1.0 + 0.1 * i as f64 - 0.02 * (i * i) as f64 + 1e-4 * (i * i * i) as f64;
        let samples: Vec<_> = (0..100).map(|i| (i % 3 != 1).then(|| cubic(i))).collect();
        assert!(largest(&Detrend::Cubic.residual(&samples)) < 1e-12);
        assert!(largest(&Detrend::Line.residual(&samples)) > 1.0);
        assert_eq!(Detrend::Cubic.residual(&samples)[1], 0.0);
    }

    #[test]
    fn a_mean_is_that_of_the_frames_present() {
        assert_eq!(Detrend::Mean.residual(&[Some(1.0), None, Some(3.0)]), [-1.0, 0.0, 1.0]);
        assert_eq!(Detrend::None.residual(&[Some(1.0), None, Some(3.0)]), [1.0, 0.0, 3.0]);
    }
}
