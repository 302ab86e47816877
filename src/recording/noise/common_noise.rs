//! Noise that both points share: a camera that shakes moves both points alike.
//!
//! The noise of one point is regressed on the noise of the other within short blocks, in which a parabola
//! describes the motion. The weight of a block is the inverse of its residual variance: a block in which the
//! blade oscillates has little weight, and a block in which it sticks has much weight.

use super::blocks::{BlockCut, NoiseBlock, cut_blocks, dot_product, keep_quiet_blocks};
use super::{RecordingCuts, SHORTEST};
use crate::recording::Recording;
use portable_math as math;

/// Number of frames of a short block: after a parabola is fitted, three quarters of the degrees of freedom
/// remain.
const SHORT_BLOCK: usize = 12;
/// The share of common noise is significant if it exceeds this number of its standard deviations. By chance,
/// that happens in one recording of 370.
const CLEAR_DEVIATIONS: f64 = 3.0;
/// Minimum number of blocks for a share of common noise: its standard deviation, from the scatter over the
/// blocks, is too uncertain with fewer blocks.
const FEWEST_BLOCKS: usize = 30;

/// The part of a channel's noise that it shares with the other point.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SharedNoise {
    /// Ratio of the channel's shared noise to the noise of the other point.
    pub share: f64,
    pub sd: f64,
    /// Shared noise in every frame, m, which is to be subtracted from the channel; `None` if the noise of the
    /// other point is unknown.
    pub noise_m: Vec<Option<f64>>,
}

/// Common noise of a recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CommonNoise {
    /// Noise of the tip along the sweep that the head shows too; `None` if the share is not significant.
    pub tip_x: Option<SharedNoise>,
    /// Vertical noise of the head that the tip on the glass shows too.
    pub head_y: Option<SharedNoise>,
}

/// Measures the noise that both points of a recording share.
pub(super) fn measure_common_noise(recording: &Recording, cuts: &RecordingCuts<'_>) -> CommonNoise {
    let traces = recording.traces();
    let [head, glass] = [
        channel_residuals(&traces.head_x_m, &cuts.cut_head(SHORTEST)),
        channel_residuals(&traces.tip_y_m, &cuts.cut_glass()),
    ];
    let [level, along] = [None, cuts.cut_glass().covariate].map(|covariate| BlockCut {
        length: SHORT_BLOCK,
        degree: 2,
        covariate,
        places: &cuts.places,
    });
    CommonNoise {
        tip_x: regress_on_other_point(&traces.tip_x_m, &traces.head_x_m, head, &level),
        head_y: regress_on_other_point(&traces.head_y_m, &traces.tip_y_m, glass, &along),
    }
}

/// Residuals of a channel from its fitted motion, m; `None` for a frame outside the fitted blocks.
fn channel_residuals(channel: &[Option<f64>], cut: &BlockCut<'_>) -> Vec<Option<f64>> {
    let mut left = vec![None; channel.len()];
    for block in keep_quiet_blocks(cut_blocks(channel, cut)) {
        for (frame, residual) in block.frames.iter().zip(block.residuals()) {
            left[*frame] = Some(residual);
        }
    }
    left
}

/// Regression of the noise of a channel on `residuals`, the noise of the other point, in the frames in which
/// `residuals` has a value.
fn regress_on_other_point(
    channel: &[Option<f64>],
    other: &[Option<f64>],
    residuals: Vec<Option<f64>>,
    cut: &BlockCut<'_>,
) -> Option<SharedNoise> {
    let known = channel.iter().zip(&residuals).map(|(value, residual)| value.filter(|_| residual.is_some()));
    let both: Vec<Option<f64>> = known.collect();
    let pairs: Vec<[Vec<f64>; 2]> =
        cut_blocks(&both, cut).iter().filter_map(|block| residual_pair(block, other)).collect();
    if pairs.len() < FEWEST_BLOCKS {
        return None;
    }
    let (share, sd) = regress_pairs(&pairs)?;
    let noise_m = residuals.iter().map(|x| x.map(|x| share * x)).collect();
    (share.abs() > CLEAR_DEVIATIONS * sd).then_some(SharedNoise { share, sd, noise_m })
}

/// Residuals of the channel and of the other point in a block.
fn residual_pair(block: &NoiseBlock, other: &[Option<f64>]) -> Option<[Vec<f64>; 2]> {
    let first = other[*block.frames.first()?]?;
    let values =
        block.frames.iter().map(|&frame| Some(other[frame]? - first)).collect::<Option<Vec<f64>>>()?;
    Some([block.residuals(), NoiseBlock { values, ..block.clone() }.residuals()])
}

/// Share of common noise, and its standard deviation, by iteratively reweighted least squares; the standard
/// deviation follows from the scatter over the blocks. The weight of a block is the inverse of its residual
/// variance.
fn regress_pairs(pairs: &[[Vec<f64>; 2]]) -> Option<(f64, f64)> {
    const ROUNDS: usize = 4;
    let mut share = 0.0;
    let mut sd = f64::INFINITY;
    for _ in 0..ROUNDS {
        let part = |[own, other]: &[Vec<f64>; 2]| {
            let rest: Vec<f64> = own.iter().zip(other).map(|(a, b)| a - share * b).collect();
            let variance = dot_product(&rest, &rest) / rest.len() as f64;
            let weight = if variance > 0.0 { variance.recip() } else { 0.0 };
            [weight, dot_product(other, other), dot_product(other, &rest)]
        };
        let parts: Vec<[f64; 3]> = pairs.iter().map(part).collect();
        let information: f64 = parts.iter().map(|[weight, squared, _]| weight * squared).sum();
        if information.is_nan() || information <= 0.0 {
            return None;
        }
        share += parts.iter().map(|[weight, _, product]| weight * product).sum::<f64>() / information;
        let scatter: f64 = parts.iter().map(|[weight, _, product]| math::powi(weight * product, 2)).sum();
        sd = scatter.sqrt() / information;
    }
    Some((share, sd))
}
