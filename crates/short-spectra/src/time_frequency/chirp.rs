//! A sinusoid whose frequency and amplitude change linearly, fitted to a segment by Gauss-Newton steps, which
//! are damped if they do not lower the misfit.
//!
//! The time `x` runs over a segment from -1 to 1. The value is `(1 + s x) (p cos phi + q sin phi)` with the
//! phase `phi = a x + b x^2 + c x^3`. For a segment of `T` seconds the frequency is `(a + 2 b x + 3 c x^2) /
//! (pi T)`. The slope of the amplitude cannot imitate a frequency, because `p` and `q` share the slope `s`.

use crate::periodogram::{self, upper_median};
use crate::transform::RealTransform;
use nalgebra::{SMatrix, SVector};
use portable_math as math;
use std::f64::consts::PI;

/// Number of unknowns for a frequency that changes at a constant rate: p, q, s, a, b.
pub(super) const LINEAR_UNKNOWNS: usize = 5;
/// Number of unknowns if the rate changes too: `c` in addition to p, q, s, a, b.
pub(super) const CURVED_UNKNOWNS: usize = 6;
/// Maximum number of steps; five are usual.
const MOST_STEPS: usize = 20;
/// A step is the last if it changes the phase at the ends of the segment by less than this angle, in rad. The
/// remaining error is of the order of the square of this change.
const SMALLEST_PHASE_STEP: f64 = 1e-3;
/// First damping after a step that does not lower the misfit, as a fraction of the diagonal of the normal
/// matrix.
const FIRST_DAMPING: f64 = 1e-2;
/// Damping above which the fit stops, because no step lowers the misfit any more.
const LARGEST_DAMPING: f64 = 1e4;
/// Minimum number of frames per unknown of the fit. With fewer frames, the fit would follow the noise.
const FRAMES_PER_UNKNOWN: usize = 3;

/// Frames of a segment and their weights.
pub(super) struct ChirpSegment<'a> {
    pub samples: &'a [Option<f64>],
    /// One weight per frame; a frame without a value takes no part.
    pub weights: &'a [f64],
}

/// The unknowns p, q, s, a, b, c.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chirp(pub [f64; CURVED_UNKNOWNS]);

/// A fit of the first `N` unknowns.
pub(super) struct ChirpFit<const N: usize> {
    pub parameters: Chirp,
    /// Covariance of the unknowns for noise of standard deviation 1 in each frame.
    pub covariance: SMatrix<f64, N, N>,
}

impl Chirp {
    /// Start of a fit from a frequency and its change over the segment, both in cycles in the segment.
    pub(super) fn from_cycles(cycles: f64, change: f64) -> Self {
        Self([0.0, 0.0, 0.0, PI * cycles, PI * change / 4.0, 0.0])
    }

    /// Frequency at `x`, cycles in the segment.
    pub(super) fn cycles_at(&self, x: f64) -> f64 {
        let [.., a, b, c] = self.0;
        (a + x * (2.0 * b + 3.0 * x * c)) / PI
    }

    /// Change, in cycles in the segment, that the frequency would make over the whole segment at the rate in
    /// the middle.
    pub(super) fn change(&self) -> f64 {
        4.0 * self.0[4] / PI
    }

    /// The same parameters, but with a rate that changes by `cycles` from one segment to the next. The rate
    /// is the change of the frequency, cycles in the segment, over one segment.
    pub(super) fn with_curvature(mut self, cycles: f64) -> Self {
        self.0[5] = PI * cycles / 24.0;
        self
    }

    /// Amplitude in the middle of the segment.
    pub(super) fn amplitude(&self) -> f64 {
        math::hypot(self.0[0], self.0[1])
    }

    /// Phase, rad, of the component in the middle of the segment, if the component is written as a cosine.
    pub(super) fn phase(&self) -> f64 {
        -math::atan2(self.0[1], self.0[0])
    }

    /// `x`, cosine and sine of the phase in each frame. They are rotated from frame to frame, which is
    /// possible because the third differences of a cubic phase are constant.
    fn phases(&self, frames: usize) -> impl Iterator<Item = (f64, f64, f64)> + use<> {
        let [.., a, b, c] = self.0;
        let h = 2.0 / frames as f64;
        let first = h / 2.0 - 1.0;
        let turn = |(c1, s1): (f64, f64), (c2, s2): (f64, f64)| (c1 * c2 - s1 * s2, s1 * c2 + c1 * s2);
        let unit = |angle: f64| (math::cos(angle), math::sin(angle));
        let mut z = unit(first * (a + first * (b + first * c)));
        let mut dz = unit(h * (a + b * (2.0 * first + h) + c * (3.0 * first * (first + h) + h * h)));
        let mut ddz = unit(h * h * (2.0 * b + 6.0 * c * (first + h)));
        let dddz = unit(6.0 * c * h * h * h);
        (0..frames).map(move |i| {
            let now = (first + h * i as f64, z.0, z.1);
            z = turn(z, dz);
            dz = turn(dz, ddz);
            ddz = turn(ddz, dddz);
            now
        })
    }

    /// The value at `x`, given the cosine and sine of the phase there.
    fn value_at(&self, (x, cosine, sine): (f64, f64, f64)) -> f64 {
        (1.0 + self.0[2] * x) * (self.0[0] * cosine + self.0[1] * sine)
    }

    /// Whether the amplitude falls to zero within the segment: the component then begins or ends near the
    /// middle of the segment.
    pub(super) fn vanishes(&self) -> bool {
        self.0[2].abs() >= 1.0
    }

    /// The values in every frame of a segment.
    pub(super) fn values(self, frames: usize) -> impl Iterator<Item = f64> {
        self.phases(frames).map(move |at| self.value_at(at))
    }

    /// Derivatives of the value with respect to the unknowns.
    fn derivatives(&self, (x, cosine, sine): (f64, f64, f64)) -> [f64; CURVED_UNKNOWNS] {
        let [p, q, s, ..] = self.0;
        let level = 1.0 + s * x;
        let turned = level * x * (q * cosine - p * sine);
        [level * cosine, level * sine, x * (p * cosine + q * sine), turned, turned * x, turned * x * x]
    }
}

/// Normal equations and misfit of the fit at given parameters.
struct ChirpNormal<const N: usize> {
    matrix: SMatrix<f64, N, N>,
    right: SVector<f64, N>,
    misfit: f64,
}

impl ChirpSegment<'_> {
    /// Fits the first `N` unknowns from a start; `None` if the frames do not determine them.
    pub(super) fn fit_chirp<const N: usize>(&self, start: Chirp) -> Option<ChirpFit<N>> {
        if self.samples.iter().flatten().count() < FRAMES_PER_UNKNOWN * N {
            return None;
        }
        let mut shape = self.with_fitted_amplitude(start)?;
        let mut normal = self.normal_equations::<N>(&shape, |w| w);
        let mut damping = 0.0;
        for _ in 0..MOST_STEPS {
            let mut damped = normal.matrix;
            (0..N).for_each(|i| damped[(i, i)] *= 1.0 + damping);
            let step = damped.cholesky()?.solve(&normal.right);
            let next = apply_step(shape, &step);
            let found = self.normal_equations::<N>(&next, |w| w);
            let settled = step.iter().skip(3).all(|s| s.abs() < SMALLEST_PHASE_STEP);
            if found.misfit <= normal.misfit {
                damping = if damping > FIRST_DAMPING { damping / 10.0 } else { 0.0 };
                (shape, normal) = (next, found);
            } else {
                damping = (10.0 * damping).max(FIRST_DAMPING);
            }
            if settled || damping > LARGEST_DAMPING {
                break;
            }
        }
        let inverse = normal.matrix.cholesky()?.inverse();
        let spread = self.normal_equations::<N>(&shape, |w| w * w).matrix;
        Some(ChirpFit { parameters: shape, covariance: inverse * spread * inverse })
    }

    /// The start with its best amplitude and phase, and with no slope of the amplitude.
    fn with_fitted_amplitude(&self, start: Chirp) -> Option<Chirp> {
        let [.., a, b, c] = start.0;
        let normal = self.normal_equations::<2>(&Chirp([0.0, 0.0, 0.0, a, b, c]), |w| w);
        let [p, q] = normal.matrix.cholesky()?.solve(&normal.right).into();
        Some(Chirp([p, q, 0.0, a, b, c]))
    }

    fn normal_equations<const N: usize>(&self, shape: &Chirp, weight: impl Fn(f64) -> f64) -> ChirpNormal<N> {
        let (mut matrix, mut towards, mut misfit) = ([[0.0; N]; N], [0.0; N], 0.0);
        for ((sample, w), at) in self.samples.iter().zip(self.weights).zip(shape.phases(self.samples.len())) {
            let Some(sample) = sample else { continue };
            let (rest, slopes, w) = (sample - shape.value_at(at), shape.derivatives(at), weight(*w));
            for i in 0..N {
                let weighted = w * slopes[i];
                (0..=i).for_each(|j| matrix[i][j] += weighted * slopes[j]);
                towards[i] += weighted * rest;
            }
            misfit += w * rest * rest;
        }
        let matrix = SMatrix::from_fn(|i, j| matrix[i.max(j)][i.min(j)]);
        ChirpNormal { matrix, right: SVector::from(towards), misfit }
    }
}

/// The parameters after a step. The slope is limited so that the amplitude falls at most to zero at one end.
fn apply_step<const N: usize>(shape: Chirp, step: &SVector<f64, N>) -> Chirp {
    let mut next = shape.0;
    next.iter_mut().zip(step.iter()).for_each(|(value, step)| *value += step);
    next[2] = next[2].clamp(-1.0, 1.0);
    Chirp(next)
}

impl<const N: usize> ChirpFit<N> {
    /// Variance, in squared cycles in the segment, of the frequency at `x` for noise of standard deviation 1
    /// in each frame.
    pub(super) fn cycles_variance(&self, x: f64) -> f64 {
        let along = [1.0, 2.0 * x, 3.0 * x * x];
        let mut gradient = SVector::<f64, N>::zeros();
        gradient.iter_mut().skip(3).zip(along).for_each(|(g, a)| *g = a / PI);
        (gradient.transpose() * self.covariance * gradient)[0].max(0.0)
    }
}

// Noise of a segment without its component.

/// Half width of the lobe of a Hann window, resolutions.
const LOBE: f64 = 2.0;
/// Number of multiples of the frequency that do not count as noise, because the oscillation need not be a
/// sine.
const HARMONICS: usize = 3;
/// Smallest allowed width, in resolutions, of the band from whose median the noise is estimated.
const FEWEST_RESOLUTIONS: f64 = 20.0;
/// Minimum number of bins of a median; if fewer remain without the multiples, the multiples count as noise
/// too.
const FEWEST_BINS: usize = 8;
/// Number of neighbouring columns on either side in the median of the noise of a column: one segment length.
/// The few bins of a single column are too uncertain.
const NEIGHBOURS: usize = 4;

/// Measures the noise of segments of one length.
pub(super) struct SegmentNoise {
    transform: RealTransform,
    window: Vec<f64>,
    padded: usize,
    /// Band of the component, cycles in the segment.
    band: (f64, f64),
}

impl SegmentNoise {
    pub(super) fn new(frames: usize, band: (f64, f64)) -> Self {
        let padded = (frames + 1).next_power_of_two();
        let (transform, window) =
            (RealTransform::new(padded), periodogram::hann_weights(&vec![Some(0.0); frames]));
        Self { transform, window, padded, band }
    }

    /// Residual of a segment after the fitted component is subtracted, measured as noise.
    pub(super) fn measure_residual(&self, segment: &[Option<f64>], shape: &Chirp) -> ResidualNoise {
        let values = segment.iter().zip(shape.values(segment.len())).zip(&self.window);
        let weighted = values.map(|((sample, value), w)| sample.map_or(0.0, |sample| w * (sample - value)));
        let powers = self.transform.squared_magnitudes(weighted);
        let square = |(sample, w): (&Option<f64>, &f64)| if sample.is_some() { w * w } else { 0.0 };
        let squares: f64 = segment.iter().zip(&self.window).map(square).sum();
        let cycles = |bin: usize| bin as f64 * self.window.len() as f64 / self.padded as f64;
        let top = self.band.1.max(self.band.0 + FEWEST_RESOLUTIONS);
        let band: Vec<usize> =
            (1..powers.len()).filter(|bin| cycles(*bin) >= self.band.0 && cycles(*bin) <= top).collect();
        let of = |chosen: &dyn Fn(f64) -> bool| {
            band.iter().filter(|bin| chosen(cycles(**bin))).map(|bin| powers[*bin]).collect::<Vec<f64>>()
        };
        let mut apart = of(&|cycles| !(1..=HARMONICS).any(|k| is_in_harmonic_lobe(cycles, shape, k)));
        if apart.len() < FEWEST_BINS {
            apart = of(&|_| true);
        }
        let under = of(&|cycles| is_in_harmonic_lobe(cycles, shape, 1));
        let mean = under.iter().sum::<f64>() / under.len().max(1) as f64;
        let deviation = |power: f64| if squares > 0.0 { (power / squares).sqrt() } else { 0.0 };
        // powers of noise are distributed exponentially: their median is the mean times ln 2
        let around_m = deviation(upper_median(apart).unwrap_or(0.0) / std::f64::consts::LN_2);
        ResidualNoise { around_m, under_m: deviation(mean) }
    }
}

/// Residual in a segment, m, as the standard deviation per frame of white noise of the same power.
#[derive(Debug, Clone, Copy)]
pub(super) struct ResidualNoise {
    /// Noise: the residual in the band, over at least 20 resolutions, but outside the component and its
    /// multiples.
    pub around_m: f64,
    /// Residual at the component's own frequency. It is larger than the noise if the component is not a
    /// sinusoid with linearly changing frequency and amplitude.
    pub under_m: f64,
}

fn is_in_harmonic_lobe(cycles: f64, shape: &Chirp, multiple: usize) -> bool {
    let k = multiple as f64;
    (cycles - k * shape.cycles_at(0.0)).abs() <= LOBE + k * shape.change().abs() / 2.0
}

/// The median over each column and its neighbours.
pub(super) fn median_filter(deviations: &[Option<f64>]) -> Vec<f64> {
    let around = |c: usize| {
        let near = &deviations[c.saturating_sub(NEIGHBOURS)..(c + NEIGHBOURS + 1).min(deviations.len())];
        upper_median(near.iter().flatten().copied().collect()).unwrap_or(0.0)
    };
    (0..deviations.len()).map(around).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exact_chirp_is_restored_also_with_missing_frames() {
        let truth = Chirp([3.0, -2.0, 0.3, PI * 9.3, PI * 0.6, 0.2]);
        let samples: Vec<_> = truth.values(90).enumerate().map(|(i, x)| (i % 5 != 3).then_some(x)).collect();
        let weights = vec![1.0; 90];
        let fitted = ChirpSegment { samples: &samples, weights: &weights }
            .fit_chirp::<CURVED_UNKNOWNS>(Chirp::from_cycles(9.1, 1.0))
            .unwrap();
        for (found, expected) in fitted.parameters.0.iter().zip(truth.0) {
            assert!((found - expected).abs() < 1e-5, "{:?}", fitted.parameters);
        }
        assert!((fitted.parameters.cycles_at(0.5) - (9.3 + 0.6 + 0.15 / PI)).abs() < 1e-5);
        assert!((truth.change() - 2.4).abs() < 1e-12);
    }

    #[test]
    fn the_phase_is_that_of_the_polynomial() {
        let shape = Chirp([1.0, 0.5, -0.4, 400.0, 70.0, -20.0]);
        let frames = 2048;
        for (i, value) in shape.values(frames).enumerate() {
            let x = (2 * i + 1) as f64 / frames as f64 - 1.0;
            let phase = x * (400.0 + x * (70.0 - 20.0 * x));
            assert!((value - (1.0 - 0.4 * x) * (phase.cos() + 0.5 * phase.sin())).abs() < 1e-7, "frame {i}");
        }
    }

    #[test]
    fn too_few_frames_fix_nothing() {
        let samples = [Some(1.0); 14];
        assert!(
            ChirpSegment { samples: &samples, weights: &[1.0; 14] }
                .fit_chirp::<LINEAR_UNKNOWNS>(Chirp::from_cycles(3.0, 0.0))
                .is_none()
        );
        assert!(
            ChirpSegment { samples: &[Some(0.0); 40], weights: &[1.0; 40] }
                .fit_chirp::<LINEAR_UNKNOWNS>(Chirp::from_cycles(5.0, 0.0))
                .is_none()
        );
    }
}
