//! Tracking noise that is correlated between neighbouring frames: an autoregressive process, its estimate
//! from a recording, the noise that both points share, and the map that makes the noise white.

mod autoregressive;
mod blocks;
mod common_noise;
mod likelihood;

use super::Recording;
pub(crate) use autoregressive::{AutoregressiveNoise, Whitener};
use blocks::{BlockCut, NoiseBlock, cut_blocks, keep_quiet_blocks};
pub(crate) use common_noise::{SharedNoise, measure_common_noise};

// The position of the head along the sweep is compared with its smooth motion. The height of the tip is
// compared with the glass, which is a straight line in the picture. In the other two channels the blade
// itself moves from frame to frame, so their noise cannot be separated. The tracker is assumed to treat both
// points alike: the noise of the head along the sweep is used for the tip too, and the noise of the tip's
// height is used for the head too.

/// Length of a block, s, in which a cubic is fitted to the motion. For a motion at 50 Hz, the residual of the
/// cubic is a hundredth of the amplitude.
const BLOCK_S: f64 = 8e-3;
/// Minimum number of frames of a block: in a shorter block, a cubic removes most of the correlation between
/// neighbouring frames.
const LEAST_BLOCK: usize = 24;
/// Maximum number of frames that are used for an estimate of the noise, spread over the recording: they
/// determine a correlation with an error of 0.01.
const MOST_FRAMES: usize = 6_000;
/// Minimum number of degrees of freedom of an estimate of the noise.
const FEWEST_FRAMES: usize = 100;
/// Smallest standard deviation that counts as noise, m; a smaller one is rounding.
const LEAST_SD_M: f64 = 1e-9;

/// Estimated noise of a channel, with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChannelNoise {
    pub noise: AutoregressiveNoise,
    /// Standard deviation of the estimated standard deviation of the noise, m.
    pub sd_of_sd_m: f64,
    /// Standard deviations of the estimated coefficients of the noise.
    pub sd_of_coefficients: Vec<f64>,
    /// Degrees of freedom: frames minus the coefficients of the motion.
    pub frames: usize,
    pub source: NoiseSource,
}

/// The residuals on which the noise was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoiseSource {
    /// The residuals of the head along the sweep from its smooth motion.
    SmoothHead,
    /// The residuals of the tip's height from the glass.
    Glass,
}

/// Estimated noise of a recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RecordingNoise {
    /// Noise of tip and head along the sweep.
    pub along_sweep: Option<ChannelNoise>,
    /// Noise of the heights of tip and head.
    pub upwards: Option<ChannelNoise>,
}

/// Number of frames of a block at a frame rate.
pub(super) fn block_length(frame_rate_hz: f64) -> usize {
    ((BLOCK_S * frame_rate_hz).round() as usize).max(LEAST_BLOCK)
}

/// Measures the noise of a recording along the sweep and in height. Each of the two is measured on its own
/// channel. If one measurement fails, the result of the other is used for both.
pub(crate) fn measure_noise(recording: &Recording) -> RecordingNoise {
    let (traces, length) = (recording.traces(), block_length(recording.grid().frame_rate_hz));
    let head = BlockCut { length, degree: 3, covariate: None };
    let glass = BlockCut { length, degree: 1, covariate: Some(&traces.tip_x_m) };
    let head = measure_channel_noise(&traces.head_x_m, &head, NoiseSource::SmoothHead);
    let glass = measure_channel_noise(&traces.tip_y_m, &glass, NoiseSource::Glass);
    RecordingNoise { along_sweep: head.clone().or_else(|| glass.clone()), upwards: glass.or(head) }
}

fn measure_channel_noise(
    values: &[Option<f64>],
    cut: &BlockCut<'_>,
    source: NoiseSource,
) -> Option<ChannelNoise> {
    let blocks = keep_quiet_blocks(cut_blocks(values, cut));
    let frames: usize = blocks.iter().map(|block| block.values.len()).sum();
    let thinned: Vec<NoiseBlock> = blocks.into_iter().step_by(frames.div_ceil(MOST_FRAMES).max(1)).collect();
    let found = likelihood::estimate_noise(&thinned, source)?;
    (found.frames >= FEWEST_FRAMES && found.noise.sd() >= LEAST_SD_M).then_some(found)
}

#[cfg(test)]
mod tests;
