//! What both points have in common: a camera that shakes moves them alike.
//!
//! The noise of one point is regressed on that of the other within short blocks, in which the motion is a
//! parabola; a block counts by how still it is, so that a blade that rings says little and one that sticks
//! much.

use super::block_length;
use super::blocks::{BlockCut, NoiseBlock, cut_blocks, dot_product};
use crate::math;
use crate::recording::Recording;

/// Fewest frames of a short block: a parabola leaves three quarters of them.
const SHORT_BLOCK: usize = 12;
/// Standard deviations from which on a share is one: chance reaches them in one recording of 370.
const CLEAR_DEVIATIONS: f64 = 3.0;
/// Fewest blocks: with fewer their scatter is not known.
const FEWEST_BLOCKS: usize = 30;

/// The part of a channel's noise that the other point shows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SharedNoise {
    /// Noise of the channel for a unit of the other point's.
    pub share: f64,
    pub sd: f64,
    /// What to take from the channel in every frame, m; empty where the other point is lost, or its noise is
    /// not known.
    pub noise_m: Vec<Option<f64>>,
}

/// Common noise of a recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CommonNoise {
    /// In the tip along the sweep, as the head shows it; `None` where nothing clear is shared.
    pub tip_x: Option<SharedNoise>,
    /// In the head upwards, as the tip on the glass shows it.
    pub head_y: Option<SharedNoise>,
}

/// Measures what the points of a recording have in common.
pub(crate) fn measure_common_noise(recording: &Recording) -> CommonNoise {
    let (traces, length) = (recording.traces(), block_length(recording.grid().frame_rate_hz));
    let head = channel_residuals(&traces.head_x_m, &BlockCut { length, degree: 3, covariate: None });
    let glass =
        channel_residuals(&traces.tip_y_m, &BlockCut { length, degree: 1, covariate: Some(&traces.tip_x_m) });
    let short = |beside| BlockCut { length: SHORT_BLOCK, degree: 2, covariate: beside };
    CommonNoise {
        tip_x: regress_on_other_point(&traces.tip_x_m, &traces.head_x_m, head, &short(None)),
        head_y: regress_on_other_point(
            &traces.head_y_m,
            &traces.tip_y_m,
            glass,
            &short(Some(&traces.tip_x_m)),
        ),
    }
}

/// What a channel's motion leaves of it, frame by frame.
fn channel_residuals(channel: &[Option<f64>], cut: &BlockCut<'_>) -> Vec<Option<f64>> {
    let mut left = vec![None; channel.len()];
    for block in super::blocks::keep_quiet_blocks(cut_blocks(channel, cut)) {
        for (frame, residual) in block.frames.iter().zip(block.residuals()) {
            left[*frame] = Some(residual);
        }
    }
    left
}

/// Regression of a channel on the other point's where its noise, `channel_residuals`, is known.
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

/// Share and its standard deviation by the scatter over blocks, each with the weight of its own variance;
/// weights follow from what the share before leaves.
fn regress_pairs(pairs: &[[Vec<f64>; 2]]) -> Option<(f64, f64)> {
    const ROUNDS: usize = 4;
    let mut share = 0.0;
    let mut sd = f64::INFINITY;
    for _ in 0..ROUNDS {
        let left = |[own, other]: &[Vec<f64>; 2]| -> Vec<f64> {
            own.iter().zip(other).map(|(a, b)| a - share * b).collect()
        };
        let parts: Vec<[f64; 3]> = pairs
            .iter()
            .map(|pair| {
                let rest = left(pair);
                let variance = dot_product(&rest, &rest) / rest.len() as f64;
                let weight = if variance > 0.0 { variance.recip() } else { 0.0 };
                [weight, dot_product(&pair[1], &pair[1]), dot_product(&pair[1], &rest)]
            })
            .collect();
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
