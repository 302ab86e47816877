//! Estimate of autoregressive noise from blocks of frames. The residual likelihood accounts for the degrees
//! of freedom of the fitted motion (Patterson and Thompson 1971, *Biometrika* 58); Schwarz's criterion
//! selects the order.

use super::ChannelNoise;
use super::blocks::{NoiseBlock, dot_product, project_out};
use crate::recording::channel::find_median;
use nalgebra::{DMatrix, DVector};
use portable_math as math;
use short_spectra::noise::{AutoregressiveNoise, Whitener, raise_order};
use std::f64::consts::PI;

/// Highest order of the autoregressive process: the noise of trackers consists of vibration and sub-pixel
/// bias, which last a few frames.
const MOST_ORDER: usize = 6;
/// The search for the order ends after this number of consecutive orders that do not lower Schwarz's
/// criterion.
const ORDERS_WITHOUT_GAIN: usize = 2;

/// Estimates the noise of blocks; `None` if the blocks have too few frames or no noise. If the times are not
/// on a grid, the noise is white, or of first order with a positive correlation.
pub(super) fn estimate_noise(blocks: &[NoiseBlock]) -> Option<ChannelNoise> {
    let freedoms: usize = blocks.iter().map(NoiseBlock::degrees_of_freedom).sum();
    let price = math::ln(freedoms as f64);
    let mut turns: Vec<f64> = Vec::new();
    let mut best = (restricted_deviance(blocks, &turns)?, turns.clone());
    let on_grid = blocks.iter().flat_map(|block| &block.places).all(|place| place.fract() == 0.0);
    for order in 1..=if on_grid { MOST_ORDER } else { 1 } {
        turns.push(0.0);
        let Some(found) = minimise_deviance(blocks, &mut turns).filter(|_| on_grid || turns[0] > 0.0) else {
            break;
        };
        let cost = found + price * order as f64;
        if cost < best.0 {
            best = (cost, turns.clone());
        }
        if order >= best.1.len() + ORDERS_WITHOUT_GAIN {
            break;
        }
    }
    estimate_at_optimum(blocks, &best.1, freedoms)
}

/// The noise at the minimum of the deviance, with standard deviations from the curvature of the deviance.
fn estimate_at_optimum(blocks: &[NoiseBlock], turns: &[f64], frames: usize) -> Option<ChannelNoise> {
    const STEP: f64 = 1e-3;
    let at = |turns: &[f64]| {
        let coefficients = coefficients_from_turns(turns);
        let unit = AutoregressiveNoise::new(1.0, coefficients.clone()).ok()?;
        Some((math::ln(deviance_and_variance(blocks, &unit)?.1), coefficients))
    };
    let (log_variance, coefficients) = at(turns)?;
    let mut by_turn = DMatrix::zeros(turns.len() + 1, turns.len());
    for i in 0..turns.len() {
        let mut moved = turns.to_vec();
        moved[i] += STEP;
        let (log, others) = at(&moved)?;
        by_turn[(0, i)] = (log - log_variance) / STEP;
        for (j, (a, b)) in others.iter().zip(&coefficients).enumerate() {
            by_turn[(j + 1, i)] = (a - b) / STEP;
        }
    }
    let (_, curvature) = deviance_derivatives(blocks, turns, restricted_deviance(blocks, turns)?)?;
    // the deviance is minus twice the logarithm of the likelihood
    let covariance = 2.0 * &by_turn * curvature.cholesky()?.inverse() * by_turn.transpose();
    let sd = math::exp(0.5 * log_variance);
    Some(ChannelNoise {
        noise: AutoregressiveNoise::new(sd, coefficients).ok()?,
        sd_of_sd_m: 0.5 * sd * (2.0 / frames as f64 + covariance[(0, 0)]).sqrt(),
        sd_of_coefficients: (1..=turns.len()).map(|i| covariance[(i, i)].sqrt()).collect(),
        frames,
    })
}

/// Coefficients of the process with the reflection coefficients `tanh(turn)`.
fn coefficients_from_turns(turns: &[f64]) -> Vec<f64> {
    turns.iter().fold(Vec::new(), |known, turn| raise_order(&known, math::tanh(*turn)))
}

/// Minus twice the logarithm of the residual likelihood, up to a constant.
fn restricted_deviance(blocks: &[NoiseBlock], turns: &[f64]) -> Option<f64> {
    let unit = AutoregressiveNoise::new(1.0, coefficients_from_turns(turns)).ok()?;
    let (deviance, _) = deviance_and_variance(blocks, &unit)?;
    deviance.is_finite().then_some(deviance)
}

/// Deviance of the blocks and variance of their noise.
fn deviance_and_variance(blocks: &[NoiseBlock], noise: &AutoregressiveNoise) -> Option<(f64, f64)> {
    let parts = whiten_blocks(blocks, noise)?;
    let freedoms: usize = blocks.iter().map(NoiseBlock::degrees_of_freedom).sum();
    let [squares, logs] = parts.iter().fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
    let variance = squares / freedoms as f64;
    (variance > 0.0).then(|| (freedoms as f64 * math::ln(variance) + logs, variance))
}

/// For each block, the sum of the squares of its whitened residuals, and the logarithms of the determinants
/// that enter the deviance. Neighbouring blocks with the same pattern of frames use the same whitener.
fn whiten_blocks(blocks: &[NoiseBlock], noise: &AutoregressiveNoise) -> Option<Vec<[f64; 2]>> {
    let mut last: Option<(Vec<f64>, Whitener)> = None;
    let whiten = |block: &NoiseBlock| {
        let first = *block.places.first()?;
        let pattern: Vec<f64> = block.places.iter().map(|place| place - first).collect();
        let kept = last.take().filter(|(of, _)| *of == pattern);
        let (pattern, whitener) = kept.unwrap_or_else(|| {
            let whitener = Whitener::at_places(noise, &pattern);
            (pattern, whitener)
        });
        let (mut values, mut columns) = (block.values.clone(), block.columns.clone());
        whitener.whiten_column(&mut values);
        columns.iter_mut().for_each(|column| whitener.whiten_column(column));
        let logs = project_out(&mut columns, &mut values) + whitener.log_determinant();
        last = Some((pattern, whitener));
        Some([dot_product(&values, &values), logs])
    };
    blocks.iter().map(whiten).collect()
}

/// Standard deviation of noise whose correlations are those of `like`, and the standard deviation of this
/// estimate, from the median over the blocks, which blocks with fast motion hardly change. The median of chi2
/// with `n` degrees of freedom is `n (1 - 2/(9 n))^3` (Wilson and Hilferty 1931).
pub(super) fn estimate_sd_like(blocks: &[NoiseBlock], like: &AutoregressiveNoise) -> Option<[f64; 2]> {
    let unit = AutoregressiveNoise::new(1.0, like.coefficients().to_vec()).ok()?;
    let freedoms = || blocks.iter().map(|block| block.degrees_of_freedom() as f64);
    let parts = whiten_blocks(blocks, &unit)?;
    let variances = parts
        .iter()
        .zip(freedoms())
        .map(|([squares, _], n)| squares / (n * math::powi(1.0 - 2.0 / (9.0 * n), 3)));
    let sd = find_median(variances)?.sqrt();
    // (the variance of the median of a normal variable is pi/2 times that of the mean)
    Some([sd, sd * (0.25 * PI / freedoms().sum::<f64>()).sqrt()])
}

/// Minimises the deviance over `turns` by Newton's method, and returns the smallest value found.
fn minimise_deviance(blocks: &[NoiseBlock], turns: &mut Vec<f64>) -> Option<f64> {
    const ROUNDS: usize = 12;
    const LONGEST: f64 = 0.7;
    const SMALL: f64 = 1e-3;
    let mut here = restricted_deviance(blocks, turns)?;
    for _ in 0..ROUNDS {
        let (slope, curvature) = deviance_derivatives(blocks, turns, here)?;
        let mut step = match curvature.clone().cholesky() {
            Some(cholesky) => -cholesky.solve(&slope),
            None => -&slope * (LONGEST / slope.norm()),
        };
        if step.norm() > LONGEST {
            step *= LONGEST / step.norm();
        }
        let moved = (0..8).find_map(|_| {
            let there: Vec<f64> = turns.iter().zip(&step).map(|(x, dx)| x + dx).collect();
            let value = restricted_deviance(blocks, &there).filter(|value| *value < here);
            step *= if value.is_some() { 1.0 } else { 0.4 };
            value.map(|value| (there, value))
        });
        let Some((there, value)) = moved else { break };
        (*turns, here) = (there, value);
        if step.norm() < SMALL {
            break;
        }
    }
    Some(here)
}

/// Gradient and Hessian of the deviance with respect to `turns`, from finite differences.
fn deviance_derivatives(
    blocks: &[NoiseBlock],
    turns: &[f64],
    here: f64,
) -> Option<(DVector<f64>, DMatrix<f64>)> {
    const STEP: f64 = 1e-2;
    let n = turns.len();
    let at = |moves: &[(usize, f64)]| {
        let mut moved = turns.to_vec();
        moves.iter().for_each(|(i, share)| moved[*i] += share * STEP);
        restricted_deviance(blocks, &moved)
    };
    let up: Vec<f64> = (0..n).map(|i| at(&[(i, 1.0)])).collect::<Option<_>>()?;
    let down: Vec<f64> = (0..n).map(|i| at(&[(i, -1.0)])).collect::<Option<_>>()?;
    let slope = DVector::from_fn(n, |i, _| (up[i] - down[i]) / (2.0 * STEP));
    let mut curvature = DMatrix::zeros(n, n);
    for i in 0..n {
        curvature[(i, i)] = (up[i] + down[i] - 2.0 * here) / (STEP * STEP);
        for j in 0..i {
            let mixed = (at(&[(i, 1.0), (j, 1.0)])? - up[i] - up[j] + here) / (STEP * STEP);
            (curvature[(i, j)], curvature[(j, i)]) = (mixed, mixed);
        }
    }
    Some((slope, curvature))
}
