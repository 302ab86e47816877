//! Stationary autoregressive noise, `n_t = sum phi_i n_(t-i) + e_t` with white `e`.

use portable_math as math;
use std::array::from_fn;
use std::ops::Range;

/// Maximum number of coefficients of a process.
pub const MOST_COEFFICIENTS: usize = 8;

/// Stationary autoregressive noise of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct AutoregressiveNoise {
    sd: f64,
    coefficients: Vec<f64>,
}

/// The coefficients do not describe a stationary process, or the standard deviation is not a positive number.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "found a standard deviation of {sd} and the coefficients {coefficients:?} of noise, expected a positive number and at most {MOST_COEFFICIENTS} coefficients of a stationary process"
)]
pub struct NotStationary {
    /// The standard deviation.
    pub sd: f64,
    /// The coefficients.
    pub coefficients: Vec<f64>,
}

impl AutoregressiveNoise {
    /// Noise with a standard deviation, in the unit of its channel, and coefficients; the coefficient of the
    /// previous frame comes first.
    ///
    /// # Errors
    /// [`NotStationary`] unless the standard deviation is positive and the process is stationary.
    pub fn new(sd: f64, coefficients: Vec<f64>) -> Result<Self, NotStationary> {
        let usable = sd > 0.0 && sd.is_finite() && coefficients.len() <= MOST_COEFFICIENTS;
        if usable && reflection_coefficients(&coefficients).iter().all(|kappa| kappa.abs() < 1.0) {
            Ok(Self { sd, coefficients })
        } else {
            Err(NotStationary { sd, coefficients })
        }
    }

    /// White noise.
    ///
    /// # Errors
    /// [`NotStationary`] unless the standard deviation is positive.
    pub fn white(sd: f64) -> Result<Self, NotStationary> {
        Self::new(sd, Vec::new())
    }

    /// Standard deviation of the noise itself, in the unit of its channel.
    pub fn sd(&self) -> f64 {
        self.sd
    }

    /// Coefficients, beginning with that of the previous frame; none for white noise.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Standard deviation of the innovation, the part of a frame's noise that the previous frames do not
    /// predict.
    pub fn innovation_sd(&self) -> f64 {
        let unexplained: f64 =
            reflection_coefficients(&self.coefficients).iter().map(|kappa| 1.0 - kappa * kappa).product();
        self.sd * unexplained.sqrt()
    }

    /// Correlations of the noise in two frames that are 0, 1, ... `count - 1` frames apart.
    pub fn correlations(&self, count: usize) -> Vec<f64> {
        let mut correlations = vec![1.0];
        let (mut known, mut unexplained) = (Vec::new(), 1.0);
        for kappa in reflection_coefficients(&self.coefficients) {
            correlations.push(kappa * unexplained + predict_value(&known, &correlations));
            known = raise_order(&known, kappa);
            unexplained *= 1.0 - kappa * kappa;
        }
        while correlations.len() < count {
            correlations.push(predict_value(&self.coefficients, &correlations));
        }
        correlations.truncate(count);
        correlations
    }
}

/// One-step prediction: the sum of the coefficients times the latest values; the first coefficient belongs to
/// the last value.
fn predict_value(coefficients: &[f64], values: &[f64]) -> f64 {
    coefficients.iter().zip(values.iter().rev()).map(|(a, b)| a * b).sum()
}

/// Coefficients of the process of the next higher order, from those of the present order and the reflection
/// coefficient `kappa` of the next order (Levinson's recursion; Percival and Walden 1993, section 9.4).
pub fn raise_order(coefficients: &[f64], kappa: f64) -> Vec<f64> {
    let turned = coefficients.iter().rev();
    let mut longer: Vec<f64> = coefficients.iter().zip(turned).map(|(a, b)| a - kappa * b).collect();
    longer.push(kappa);
    longer
}

/// Reflection coefficients, beginning with that of the lowest order (Levinson's recursion in reverse).
fn reflection_coefficients(coefficients: &[f64]) -> Vec<f64> {
    let mut left = coefficients.to_vec();
    let mut found = Vec::with_capacity(left.len());
    while let Some(kappa) = left.pop() {
        found.push(kappa);
        let turned: Vec<f64> = left.iter().rev().copied().collect();
        left.iter_mut().zip(turned).for_each(|(a, b)| *a = (*a + kappa * b) / (1.0 - kappa * kappa));
    }
    found.reverse();
    found
}

// Whitening with missing frames. The map is the inverse of the lower Cholesky factor of the covariance of the
// present frames. It is computed from the innovations of a Kalman filter over the last few frames (Jones
// 1980, *Technometrics* 22). The gains of the filter do not depend on the data, so they are computed once.
// Across a gap, the filter predicts over several frames.

/// One number for each of the last frames, beginning with the latest frame.
type NoiseMemory = [f64; MOST_COEFFICIENTS];

/// Linear map that makes the noise white for a given pattern of present frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Whitener {
    coefficients: NoiseMemory,
    /// Order of the process, at least 1.
    order: usize,
    steps: Vec<WhiteningStep>,
    /// Ranges of steps with `order` present frames directly before each: there the filter is a sum over these
    /// frames.
    complete: Vec<Range<usize>>,
    /// Standard deviation of the innovation in these steps, in the unit of the noise.
    innovation_sd: f64,
}

/// Step of the filter from one present frame to the next.
#[derive(Debug, Clone, PartialEq)]
struct WhiteningStep {
    /// Number of whole frames since the previous present frame.
    ahead: usize,
    /// Correlation of the noise over the fraction of a frame after these whole frames.
    decay: f64,
    /// Standard deviation of the innovation.
    sd: f64,
    /// Kalman gain: change of the estimate of the last frames per unit of the innovation.
    gain: NoiseMemory,
}

impl Whitener {
    /// The map for `frames`, the indices of the present frames in rising order.
    pub fn new(noise: &AutoregressiveNoise, frames: &[usize]) -> Self {
        Self::at_places(noise, &frames.iter().map(|frame| *frame as f64).collect::<Vec<_>>())
    }

    /// The map for frames at their true times `places`, in units of the mean frame interval and in rising
    /// order. If times are not whole numbers, the noise must be white or of first order: over a time `t`, its
    /// correlation is `r^t`, where `r` is its coefficient.
    pub fn at_places(noise: &AutoregressiveNoise, places: &[f64]) -> Self {
        let mut coefficients = [0.0; MOST_COEFFICIENTS];
        coefficients[..noise.coefficients().len()].copy_from_slice(noise.coefficients());
        let order = noise.coefficients().len().max(1);
        let steps = Vec::with_capacity(places.len());
        let innovation_sd = noise.innovation_sd();
        let mut whitener = Self { coefficients, order, steps, complete: Vec::new(), innovation_sd };
        let mut uncertain = PredictionCovariance::from_stationary(noise, order);
        let innovation = math::powi(noise.innovation_sd(), 2);
        let mut before = places.first().copied();
        for &place in places {
            let step = before.replace(place).map_or(0.0, |before| place - before);
            let (ahead, rest) = (step as usize, step.fract());
            let decay = if rest > 0.0 { math::exp(rest * math::ln(coefficients[0].abs())) } else { 1.0 };
            (0..ahead).for_each(|_| uncertain.advance_frame(&whitener.coefficients, innovation));
            uncertain.advance_fraction(decay, math::powi(noise.sd(), 2));
            let (sd, gain) = uncertain.observe_latest();
            whitener.steps.push(WhiteningStep { ahead, decay, sd, gain });
        }
        whitener.complete = whitener.find_complete_steps();
        whitener
    }

    /// Ranges of steps with `order` present frames directly before each, at distances of exactly one frame.
    fn find_complete_steps(&self) -> Vec<Range<usize>> {
        let follows = |k: usize| self.steps[k].ahead == 1 && self.steps[k].decay == 1.0;
        let mut complete = Vec::new();
        let mut first = 0;
        for k in 1..=self.steps.len() {
            if k == self.steps.len() || !follows(k) {
                if first + self.order < k {
                    complete.push(first + self.order..k);
                }
                first = k;
            }
        }
        complete
    }

    /// Whitens a column in place; the column has one value per present frame, in the unit of the noise.
    /// Whitened noise is independent from frame to frame and has unit variance.
    pub fn whiten_column(&self, column: &mut [f64]) {
        // a constant order lets the compiler unroll the inner loops
        match self.order {
            1 => self.whiten_with_order::<1>(column),
            2 => self.whiten_with_order::<2>(column),
            3 => self.whiten_with_order::<3>(column),
            4 => self.whiten_with_order::<4>(column),
            5 => self.whiten_with_order::<5>(column),
            6 => self.whiten_with_order::<6>(column),
            7 => self.whiten_with_order::<7>(column),
            _ => self.whiten_with_order::<MOST_COEFFICIENTS>(column),
        }
    }

    fn whiten_with_order<const N: usize>(&self, column: &mut [f64]) {
        let values = column.to_vec();
        let mut next = 0;
        let mut memory = [0.0; N];
        for complete in &self.complete {
            self.filter_steps(next..complete.start, column, &mut memory);
            let part = &mut column[complete.clone()];
            for (lag, coefficient) in (1..=N).zip(&self.coefficients) {
                let before = &values[complete.start - lag..complete.end - lag];
                part.iter_mut().zip(before).for_each(|(x, past)| *x -= coefficient * past);
            }
            part.iter_mut().for_each(|x| *x /= self.innovation_sd);
            memory = from_fn(|lag| values[complete.end - 1 - lag]);
            next = complete.end;
        }
        self.filter_steps(next..self.steps.len(), column, &mut memory);
    }

    /// Whitens a part of a column in place. `memory` holds estimates of the noise in the last frames before
    /// it, latest first, and afterwards in its own last frames.
    fn filter_steps<const N: usize>(&self, part: Range<usize>, column: &mut [f64], memory: &mut [f64; N]) {
        let coefficients: [f64; N] = from_fn(|i| self.coefficients[i]);
        for (value, step) in column[part.clone()].iter_mut().zip(&self.steps[part]) {
            for _ in 0..step.ahead {
                let next = coefficients.iter().zip(&*memory).map(|(a, b)| a * b).sum();
                memory.copy_within(..N - 1, 1);
                memory[0] = next;
            }
            memory[0] *= step.decay;
            let innovation = *value - memory[0];
            memory.iter_mut().zip(&step.gain).for_each(|(past, gain)| *past += gain * innovation);
            *value = innovation / step.sd;
        }
    }

    /// Logarithm of the determinant of the covariance of the frames.
    pub fn log_determinant(&self) -> f64 {
        self.steps.iter().map(|step| 2.0 * math::ln(step.sd)).sum()
    }
}

/// Covariance of the noise of the last frames, conditional on the present frames before them.
struct PredictionCovariance {
    order: usize,
    covariance: [NoiseMemory; MOST_COEFFICIENTS],
}

impl PredictionCovariance {
    fn from_stationary(noise: &AutoregressiveNoise, order: usize) -> Self {
        let (correlations, variance) = (noise.correlations(order), noise.sd() * noise.sd());
        let within = |i: usize, j: usize| i < order && j < order;
        let entry = |i: usize, j: usize| {
            if within(i, j) { variance * correlations[i.abs_diff(j)] } else { 0.0 }
        };
        Self { order, covariance: from_fn(|i| from_fn(|j| entry(i, j))) }
    }

    fn advance_frame(&mut self, coefficients: &NoiseMemory, innovation: f64) {
        let n = self.order;
        let mut with_next = [0.0; MOST_COEFFICIENTS];
        for (with, row) in with_next.iter_mut().zip(&self.covariance).take(n) {
            *with = (0..n).map(|j| row[j] * coefficients[j]).sum();
        }
        let next = (0..n).map(|i| coefficients[i] * with_next[i]).sum::<f64>() + innovation;
        for i in (1..n).rev() {
            for j in (1..n).rev() {
                self.covariance[i][j] = self.covariance[i - 1][j - 1];
            }
        }
        for i in 1..n {
            self.covariance[i][0] = with_next[i - 1];
            self.covariance[0][i] = with_next[i - 1];
        }
        self.covariance[0][0] = next;
    }

    /// Advances noise of first order by a part of a frame over which its correlation is `decay`.
    fn advance_fraction(&mut self, decay: f64, variance: f64) {
        let latest = &mut self.covariance[0][0];
        *latest = decay * decay * *latest + (1.0 - decay * decay) * variance;
    }

    /// Measurement update with the latest frame: returns the standard deviation of its innovation and the
    /// gain.
    fn observe_latest(&mut self) -> (f64, NoiseMemory) {
        let variance = self.covariance[0][0];
        let gain = from_fn(|i| if i == 0 { 1.0 } else { self.covariance[i][0] / variance });
        for i in 1..self.order {
            for j in 1..self.order {
                self.covariance[i][j] -= gain[i] * gain[j] * variance;
            }
        }
        for i in 0..self.order {
            self.covariance[i][0] = 0.0;
            self.covariance[0][i] = 0.0;
        }
        (variance.sqrt(), gain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use portable_math::StandardNormal;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn one_coefficient_is_the_correlation_of_neighbours() {
        let noise = AutoregressiveNoise::new(2.0, vec![0.7]).unwrap();
        let exact = (0..6).map(|lag| 0.7f64.powi(lag));
        assert!(noise.correlations(6).iter().zip(exact).all(|(a, b)| (a - b).abs() < 1e-15));
        assert!((noise.innovation_sd() - 2.0 * 0.51f64.sqrt()).abs() < 1e-15);
    }

    /// Correlation `rho_1 = phi_1 / (1 - phi_2)`, and variance as in Box and Jenkins, equation (3.2.28).
    #[test]
    fn two_coefficients_have_their_closed_form() {
        let (a, b) = (1.1, -0.4);
        let noise = AutoregressiveNoise::new(1.0, vec![a, b]).unwrap();
        let [_, first, second] = noise.correlations(3).try_into().unwrap();
        assert!((first - a / (1.0 - b)).abs() < 1e-15);
        assert!((second - (a * first + b)).abs() < 1e-15);
        let innovation = (1.0 + b) * ((1.0 - b).powi(2) - a * a) / (1.0 - b);
        assert!((noise.innovation_sd().powi(2) - innovation).abs() < 1e-15);
    }

    #[test]
    fn noise_that_grows_is_refused() {
        for coefficients in [vec![1.0], vec![-1.2], vec![1.5, -0.4], vec![f64::NAN], vec![0.0; 9]] {
            assert!(AutoregressiveNoise::new(1.0, coefficients.clone()).is_err(), "{coefficients:?}");
        }
        for sd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(AutoregressiveNoise::white(sd).is_err(), "{sd}");
        }
    }

    fn models() -> Vec<AutoregressiveNoise> {
        let coefficients =
            [vec![], vec![0.9], vec![-0.5], vec![1.1, -0.4], vec![0.5, 0.1, -0.2, 0.1, 0.05, 0.2]];
        coefficients
            .into_iter()
            .map(|coefficients| AutoregressiveNoise::new(3e-6, coefficients).unwrap())
            .collect()
    }

    fn patterns() -> Vec<Vec<usize>> {
        let kept = |lost: fn(usize) -> bool| (7..90).filter(|i| !lost(*i)).collect();
        vec![
            kept(|_| false),
            kept(|i| i % 3 == 1),
            kept(|i| i % 7 == 2 || (20..55).contains(&i)),
            kept(|i| (9..80).contains(&i)),
            vec![12],
            vec![],
        ]
    }

    fn covariance(noise: &AutoregressiveNoise, frames: &[usize]) -> DMatrix<f64> {
        let correlations = noise.correlations(100);
        DMatrix::from_fn(frames.len(), frames.len(), |i, j| {
            noise.sd() * noise.sd() * correlations[frames[i].abs_diff(frames[j])]
        })
    }

    #[test]
    fn the_map_is_the_inverse_cholesky_factor_of_the_covariance() {
        for noise in models() {
            for frames in patterns().iter().filter(|frames| !frames.is_empty()) {
                let whitener = Whitener::new(&noise, frames);
                let lower = covariance(&noise, frames).cholesky().unwrap().l();
                let column = DVector::from_fn(frames.len(), |i, _| 1e-6 * (1.7 * i as f64).sin());
                let expected = lower.solve_lower_triangular(&column).unwrap();
                let mut found = column.as_slice().to_vec();
                whitener.whiten_column(&mut found);
                let error = expected.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(error < 1e-13, "{noise:?} {frames:?}: {error:e}");
                let log = 2.0 * lower.diagonal().iter().map(|x| x.ln()).sum::<f64>();
                assert!((whitener.log_determinant() - log).abs() < 1e-10, "{noise:?}");
            }
        }
    }

    /// With one coefficient `r`, the noise `g` frames after the previous present frame is predicted as `r^g`
    /// times the noise of that frame, with the variance `1 - r^(2 g)`.
    #[test]
    fn one_coefficient_has_its_closed_form_over_gaps() {
        let noise = AutoregressiveNoise::new(2.0, vec![0.8]).unwrap();
        let mut column = [1.0, -2.0, 0.5];
        Whitener::new(&noise, &[3, 4, 9]).whiten_column(&mut column);
        let innovation = |value: f64, before: f64, gap: i32| {
            (value - 0.8f64.powi(gap) * before) / (2.0 * (1.0 - 0.64f64.powi(gap)).sqrt())
        };
        let expected = [0.5, innovation(-2.0, 1.0, 1), innovation(0.5, -2.0, 5)];
        assert!(column.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{column:?} {expected:?}");
    }

    /// At true times, the covariance of noise of first order is `sd^2 exp(-|t - t'|/tau)`.
    #[test]
    fn the_map_at_true_times_is_the_inverse_cholesky_factor_of_the_covariance() {
        let tau = 3.7;
        for (noise, correlated) in [(vec![math::exp(-1.0 / tau)], 1.0), (vec![], 0.0)] {
            let noise = AutoregressiveNoise::new(3e-6, noise).unwrap();
            let places: Vec<f64> =
                (0..60).map(|i| 1.3 * f64::from(i) + 0.6 * f64::from(i * i).sin()).collect();
            let covariance = DMatrix::from_fn(60, 60, |i, j| {
                let apart = (places[i] - places[j]).abs();
                9e-12 * if i == j { 1.0 } else { correlated * (-apart / tau).exp() }
            });
            let lower = covariance.cholesky().unwrap().l();
            let column = DVector::from_fn(60, |i, _| 1e-6 * (1.7 * i as f64).sin());
            let expected = lower.solve_lower_triangular(&column).unwrap();
            let (whitener, mut found) = (Whitener::at_places(&noise, &places), column.as_slice().to_vec());
            whitener.whiten_column(&mut found);
            assert!(expected.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-13), "{noise:?}");
            let log = 2.0 * lower.diagonal().iter().map(|x| x.ln()).sum::<f64>();
            assert!((whitener.log_determinant() - log).abs() < 1e-10, "{noise:?}");
        }
    }

    #[test]
    fn white_noise_is_divided_by_its_standard_deviation() {
        let mut column = [1e-6, 5e-6, -3e-7];
        let expected = column.map(|x| x / 3e-6);
        Whitener::new(&AutoregressiveNoise::white(3e-6).unwrap(), &[0, 1, 8]).whiten_column(&mut column);
        assert_eq!(column, expected);
    }

    /// After whitening, the noise of every model, with a fifth of the frames lost, has unit variance and no
    /// correlation between neighbouring frames.
    #[test]
    fn whitened_noise_is_white() {
        const FRAMES: usize = 20_000;
        for (seed, noise) in models().iter().enumerate() {
            let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed as u64);
            let mut values: Vec<f64> = Vec::new();
            for _ in 0..FRAMES + 1000 {
                let fresh: f64 = generator.sample(StandardNormal);
                let past: f64 =
                    noise.coefficients().iter().zip(values.iter().rev()).map(|(a, b)| a * b).sum();
                values.push(past + noise.innovation_sd() * fresh);
            }
            let frames: Vec<usize> = (0..FRAMES).filter(|_| generator.random::<f64>() > 0.2).collect();
            let mut column: Vec<f64> = frames.iter().map(|&i| values[1000 + i]).collect();
            Whitener::new(noise, &frames).whiten_column(&mut column);
            let n = column.len() as f64;
            let variance = column.iter().map(|x| x * x).sum::<f64>() / n;
            assert!((variance - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{noise:?}: {variance}");
            for lag in 1..=10 {
                let pairs = column.iter().zip(&column[lag..]);
                let correlation = pairs.map(|(a, b)| a * b).sum::<f64>() / n;
                assert!(correlation.abs() < 4.0 / n.sqrt(), "{noise:?} lag {lag}: {correlation}");
            }
        }
    }
}
