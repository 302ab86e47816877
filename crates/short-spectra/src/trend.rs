//! Trends removed from a record before its transform: a polynomial or slow cosines, by least squares over the
//! frames present.

use nalgebra::{DMatrix, DVector};
use portable_math as math;
use serde::Serialize;
use std::fmt;

/// Highest degree of a polynomial trend: still higher degrees would only fit the ends of a record.
pub(crate) const HIGHEST_DEGREE: usize = 23;
/// Maximum number of columns of a trend; only records longer than a tenth of a second need a high-pass of
/// more cosines.
pub(super) const MOST_COLUMNS: usize = 48;

/// A trend to remove.
///
/// A trend is often far larger than the components on top of it. For a component at 78 Hz in a record of 0.15
/// s, removing only the mean or a line leaves a frequency error of 0.9 to 1 Hz; a cubic leaves 0.03 Hz.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
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
    /// A polynomial of this degree, at most `HIGHEST_DEGREE`.
    Polynomial(usize),
    /// Everything slower than this frequency, Hz: a line, and every cosine with a whole number of half-waves
    /// over the record below this frequency, at most 46. They are fitted linearly to the frames present,
    /// which causes no delay and attenuates nothing above the frequency.
    HighPass(f64),
}

/// Error: a text that is not the name of a detrending.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown detrending `{found}`; expected `none`, `mean`, `line`, `cubic`, `polynomial:N` (N up to {HIGHEST_DEGREE}) or `high-pass:HZ` (HZ above 0)"
)]
pub struct UnknownDetrend {
    /// The name as written.
    pub found: String,
}

impl Detrend {
    /// The choices without a number.
    const NAMED: [(&str, Self); 4] =
        [("none", Self::None), ("mean", Self::Mean), ("line", Self::Line), ("cubic", Self::Cubic)];

    /// The choice that a text names: `none`, `mean`, `line`, `cubic`, `polynomial:7` or `high-pass:40`, with
    /// any numbers.
    ///
    /// # Errors
    /// [`UnknownDetrend`] with the known names.
    pub fn parse(text: &str) -> Result<Self, UnknownDetrend> {
        let named = Self::NAMED.into_iter().find(|(name, _)| *name == text).map(|(_, detrend)| detrend);
        let degree = || text.strip_prefix("polynomial:")?.parse().ok().filter(|n| *n <= HIGHEST_DEGREE);
        let is_usable = |hz: &f64| hz.is_finite() && *hz > 0.0;
        let hz = || text.strip_prefix("high-pass:")?.parse().ok().filter(is_usable);
        let polynomial = || degree().map(Self::Polynomial);
        named
            .or_else(polynomial)
            .or_else(|| hz().map(Self::HighPass))
            .ok_or_else(|| UnknownDetrend { found: text.to_owned() })
    }

    /// The trend of a record of this length; `None` if it would take more columns than a fit can hold.
    pub(super) fn to_trend(self, frames: usize, frame_rate_hz: f64) -> Option<Trend> {
        Some(match self {
            Self::None => Trend::Polynomial(0),
            Self::Mean => Trend::Polynomial(1),
            Self::Line => Trend::Polynomial(2),
            Self::Cubic => Trend::Polynomial(4),
            Self::Polynomial(degree) => Trend::Polynomial(degree.min(HIGHEST_DEGREE) + 1),
            Self::HighPass(hz) => {
                let half_waves = 2.0 * hz * frames as f64 / frame_rate_hz;
                let most = (MOST_COLUMNS - LINE_COLUMNS) as f64;
                return (half_waves < most + 1.0).then_some(Trend::Cosines(half_waves as usize));
            }
        })
    }
}

impl fmt::Display for Detrend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Polynomial(degree) => write!(f, "polynomial:{degree}"),
            Self::HighPass(hz) => write!(f, "high-pass:{hz}"),
            plain => {
                f.write_str(Self::NAMED.iter().find(|(_, named)| named == plain).map_or("", |(name, _)| name))
            }
        }
    }
}

impl std::str::FromStr for Detrend {
    type Err = UnknownDetrend;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::parse(text)
    }
}

/// Number of columns of a line.
const LINE_COLUMNS: usize = 2;

/// The columns of a trend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Trend {
    /// The given number of Legendre polynomials, from degree 0 on; they are orthogonal over a record without
    /// gaps.
    Polynomial(usize),
    /// A line and the given number of cosines, with one, two, three ... half-waves over the record.
    Cosines(usize),
}

/// Factors of the recurrence `P_k = ((2k - 1) s P_(k-1) - (k - 1) P_(k-2)) / k`: precomputed, because
/// divisions for each of a million frames take time.
pub(super) const LEGENDRE: [[f64; 2]; HIGHEST_DEGREE + 1] = {
    let mut factors = [[0.0; 2]; HIGHEST_DEGREE + 1];
    let mut k = 1;
    while k <= HIGHEST_DEGREE {
        factors[k] = [(2 * k - 1) as f64 / k as f64, (k - 1) as f64 / k as f64];
        k += 1;
    }
    factors
};

/// The values of a trend's columns in one frame.
pub(super) type TrendBasis = [f64; MOST_COLUMNS];

impl Trend {
    pub(super) fn column_count(self) -> usize {
        match self {
            Self::Polynomial(columns) => columns,
            Self::Cosines(cosines) => LINE_COLUMNS + cosines,
        }
    }

    /// Fills in the columns at `s`, which runs over the record from -1 to 1; other entries are unchanged.
    pub(super) fn fill_row(self, s: f64, row: &mut TrendBasis) {
        match self {
            Self::Polynomial(columns) => {
                row[..4].copy_from_slice(&[1.0, s, (3.0 * s * s - 1.0) / 2.0, (5.0 * s * s - 3.0) * s / 2.0]);
                (4..columns)
                    .for_each(|k| row[k] = LEGENDRE[k][0] * s * row[k - 1] - LEGENDRE[k][1] * row[k - 2]);
            }
            Self::Cosines(cosines) => {
                row[..LINE_COLUMNS].copy_from_slice(&[1.0, s]);
                let half_wave = std::f64::consts::FRAC_PI_2 * (s + 1.0);
                (0..cosines).for_each(|j| row[LINE_COLUMNS + j] = math::cos((j + 1) as f64 * half_wave));
            }
        }
    }

    /// The trend with these coefficients in every frame.
    pub(super) fn values(self, coefficients: &[f64], frames: usize) -> Vec<f64> {
        let mut row = [0.0; MOST_COLUMNS];
        let mut value = |i: usize| {
            self.fill_row(abscissa(i, frames), &mut row);
            row.iter().zip(coefficients).map(|(b, c)| b * c).sum()
        };
        (0..frames).map(&mut value).collect()
    }

    /// The trend fitted to the samples, in every frame.
    pub(super) fn fit_values(self, samples: &[Option<f64>]) -> Vec<f64> {
        self.fit_coefficients(samples)
            .map_or_else(|| vec![0.0; samples.len()], |c| self.values(c.as_slice(), samples.len()))
    }

    /// The samples without the trend; zero for a missing sample.
    pub(super) fn residual(self, samples: &[Option<f64>]) -> Vec<f64> {
        samples.iter().zip(self.fit_values(samples)).map(|(x, trend)| x.map_or(0.0, |x| x - trend)).collect()
    }

    /// The next richer trend of its kind; `None` for the richest.
    pub(super) fn next_richer(self) -> Option<Self> {
        let columns = self.column_count() + 2;
        match self {
            Self::Polynomial(_) => (columns <= HIGHEST_DEGREE + 1).then_some(Self::Polynomial(columns)),
            Self::Cosines(cosines) => (columns <= MOST_COLUMNS).then_some(Self::Cosines(cosines + 2)),
        }
    }

    /// Coefficients of the trend, from a singular value decomposition of the normal equations. These
    /// equations may be singular if the frames present lie in clumps.
    fn fit_coefficients(self, samples: &[Option<f64>]) -> Option<DVector<f64>> {
        /// Fraction of the number of frames below which a singular value of the normal matrix counts as zero.
        const SINGULAR: f64 = 1e-12;
        /// Maximum number of iterations; each column takes a few.
        const MOST_ITERATIONS: usize = 10_000;
        let columns = self.column_count();
        if columns == 0 {
            return None;
        }
        // arrays on the stack, because each of up to a million frames adds to them
        let (mut normal, mut right) = ([[0.0; MOST_COLUMNS]; MOST_COLUMNS], [0.0; MOST_COLUMNS]);
        let mut row = [0.0; MOST_COLUMNS];
        for (s, x) in
            samples.iter().enumerate().filter_map(|(i, x)| x.map(|x| (abscissa(i, samples.len()), x)))
        {
            self.fill_row(s, &mut row);
            for i in 0..columns {
                (i..columns).for_each(|j| normal[i][j] += row[i] * row[j]); // the lower half is the same
                right[i] += row[i] * x;
            }
        }
        let normal = DMatrix::from_fn(columns, columns, |i, j| normal[i.min(j)][i.max(j)]);
        let right = DVector::from_fn(columns, |i, _| right[i]);
        normal
            .try_svd(true, true, 5.0 * f64::EPSILON, MOST_ITERATIONS)?
            .solve(&right, SINGULAR * samples.len() as f64)
            .ok()
    }
}

/// Frame number scaled to -1..1, so that powers stay comparable.
pub(super) fn abscissa(index: usize, frames: usize) -> f64 {
    2.0 * (index as f64 + 0.5) / frames as f64 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn largest(residual: &[f64]) -> f64 {
        residual.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
    }

    fn residual(detrend: Detrend, samples: &[Option<f64>]) -> Vec<f64> {
        detrend.to_trend(samples.len(), 1000.0).unwrap().residual(samples)
    }

    #[test]
    fn polynomials_are_removed_exactly_also_with_gaps() {
        let cubic = |i: usize| 1.0 + 0.1 * i as f64 - 0.02 * (i * i) as f64 + 1e-4 * (i * i * i) as f64;
        let samples: Vec<_> = (0..100).map(|i| (i % 3 != 1).then(|| cubic(i))).collect();
        assert!(largest(&residual(Detrend::Cubic, &samples)) < 1e-12);
        assert!(largest(&residual(Detrend::Line, &samples)) > 1.0);
        assert_eq!(residual(Detrend::Cubic, &samples)[1], 0.0);
        let ninth: Vec<_> = (0..100).map(|i| (i % 3 != 1).then(|| (i as f64 / 100.0).powi(9))).collect();
        assert!(largest(&residual(Detrend::Polynomial(9), &ninth)) < 1e-12);
        assert!(largest(&residual(Detrend::Polynomial(8), &ninth)) > 1e-7);
    }

    #[test]
    fn a_mean_is_that_of_the_frames_present() {
        assert_eq!(residual(Detrend::Mean, &[Some(1.0), None, Some(3.0)]), [-1.0, 0.0, 1.0]);
        assert_eq!(residual(Detrend::None, &[Some(1.0), None, Some(3.0)]), [1.0, 0.0, 3.0]);
    }

    #[test]
    fn a_high_pass_takes_what_is_slower_and_leaves_what_is_faster() {
        let half_waves = |n: f64| -> Vec<Option<f64>> {
            (0..500).map(|i| Some((std::f64::consts::PI * n * (i as f64 + 0.5) / 500.0).cos())).collect()
        };
        // 20 half-waves in 0.5 s
        let of_20_hz = |samples: &[Option<f64>]| largest(&residual(Detrend::HighPass(20.0), samples));
        assert!(
            of_20_hz(&half_waves(20.0)).max(of_20_hz(&half_waves(3.0))) < 1e-8,
            "singular values are iterated to some 1e-9"
        );
        assert!((of_20_hz(&half_waves(40.0)) - 1.0).abs() < 0.02, "{}", of_20_hz(&half_waves(40.0)));
        assert_eq!(Detrend::HighPass(47.0).to_trend(500, 1000.0), None, "one column too many");
        assert_eq!(
            Detrend::HighPass(46.0).to_trend(500, 1000.0).map(Trend::column_count),
            Some(MOST_COLUMNS)
        );
    }

    #[test]
    fn names_are_read_back_and_others_refused() {
        for text in ["none", "mean", "line", "cubic", "polynomial:7", "high-pass:37.5"] {
            assert_eq!(Detrend::parse(text).map(|d| d.to_string()), Ok(text.to_owned()));
        }
        for text in
            ["square", "polynomial:24", "polynomial:", "high-pass:-1", "high-pass:inf", "high-pass:NaN"]
        {
            assert!(
                Detrend::parse(text)
                    .unwrap_err()
                    .to_string()
                    .starts_with(&format!("unknown detrending `{text}`"))
            );
        }
    }
}
