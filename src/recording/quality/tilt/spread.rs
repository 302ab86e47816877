//! How far correlated errors let a fitted line stray.

use super::line::GlassLine;
use super::path::TipPath;

/// Most values whose correlation is looked at: longer recordings are averaged in groups of frames, which
/// leaves the slow errors that matter for a slope.
const MOST_VALUES: usize = 20_000;
/// Lags that the sum of correlations reaches over, in units of that sum: five correlation times (Sokal 1997).
/// What lies beyond is noise of the estimate.
const WINDOW: f64 = 2.5;
/// Least share of the variance of errors that a fit leaves in the residuals; below it their correlation
/// reaches over the whole recording.
const LEAST_LEFT: f64 = 0.1;

/// Variance of the heights about the line as a slow line sees it, m^2: that of a frame times the number of
/// frames over which errors are alike. A sum of `n` errors has `n` times this variance.
pub(super) fn long_run_variance(path: &TipPath, line: &GlassLine) -> f64 {
    let group = path.points.len().div_ceil(MOST_VALUES);
    let values = group_averages(path, line, group);
    let present = values.iter().flatten().count() as f64;
    let variance = values.iter().flatten().map(|v| v * v).sum::<f64>() / present;
    if variance <= 0.0 {
        return 0.0;
    }
    let (alike, lags) = correlated_values(&values, variance);
    // every fitted number takes its share of each covariance
    let taken = line.fitted as f64 * (1 + 2 * lags) as f64 / present;
    group as f64 * variance * alike / (1.0 - taken).max(LEAST_LEFT)
}

/// Residuals of the frames on the glass, averaged over groups of frames; `None` where a group has none.
fn group_averages(path: &TipPath, line: &GlassLine, group: usize) -> Vec<Option<f64>> {
    let first = path.points.first().map_or(0, |point| point.frame);
    let last = path.points.last().map_or(0, |point| point.frame);
    let mut sums = vec![(0.0, 0_usize); (last - first) / group + 1];
    for ((point, residual), on) in path.points.iter().zip(&line.residuals_m).zip(&line.on_glass) {
        if *on {
            let (sum, count) = &mut sums[(point.frame - first) / group];
            *sum += residual;
            *count += 1;
        }
    }
    sums.into_iter().map(|(sum, count)| (count > 0).then(|| sum / count as f64)).collect()
}

/// Number of values over which errors are alike, at least 1: one and twice the sum of the correlations; and
/// the lags of that sum, [`WINDOW`] times as many.
fn correlated_values(values: &[Option<f64>], variance: f64) -> (f64, usize) {
    let (mut alike, mut lags) = (1.0, 0);
    for lag in 1..values.len() / 2 {
        alike += 2.0 * lag_covariance(values, lag) / variance;
        lags = lag;
        if lag as f64 >= WINDOW * alike {
            break;
        }
    }
    (alike.max(1.0), lags)
}

/// Mean product of the values a lag apart; zero where there is no such pair.
fn lag_covariance(values: &[Option<f64>], lag: usize) -> f64 {
    let products = values.iter().zip(&values[lag..]).filter_map(|(a, b)| Some((*a)? * (*b)?));
    let (sum, pairs) = products.fold((0.0, 0_usize), |(sum, pairs), product| (sum + product, pairs + 1));
    if pairs == 0 { 0.0 } else { sum / pairs as f64 }
}
