//! Tracking noise that is correlated between neighbouring frames: an autoregressive process, its estimate
//! from a recording, the part that both points share, and the map that makes it white.

mod autoregressive;
mod blocks;
mod common_noise;
mod likelihood;

use super::Recording;
pub(crate) use autoregressive::{AutoregressiveNoise, Whitener};
use blocks::{BlockCut, NoiseBlock, cut_blocks, keep_quiet_blocks};
pub(crate) use common_noise::{SharedNoise, measure_common_noise};

// The head along the sweep is compared with its smooth motion; the tip upwards with the glass, which in the
// picture is a line along the sweep. In the other two channels the blade itself moves as fast as frames
// follow, so their noise cannot be separated. One tracker is assumed to treat both points alike: the tip
// along the sweep gets the noise of the head, and the head upwards that of the tip.

/// Length of a block, s, in which the motion is fitted by a cubic: at 50 Hz a hundredth of the amplitude is
/// left.
const BLOCK_S: f64 = 8e-3;
/// Fewest frames of a block: in fewer, a cubic removes most of the correlation between neighbours.
const LEAST_BLOCK: usize = 24;
/// Most frames that are used, spread over the recording: they give a correlation to 0.01.
const MOST_FRAMES: usize = 6_000;
/// Fewest degrees of freedom of an estimate.
const FEWEST_FRAMES: usize = 100;
/// Least standard deviation of noise, m; below it lies rounding.
const LEAST_SD_M: f64 = 1e-9;

/// Noise of a channel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChannelNoise {
    pub noise: AutoregressiveNoise,
    /// Uncertainty of its standard deviation, m.
    pub sd_of_sd_m: f64,
    /// Standard deviations of its coefficients.
    pub sd_of_coefficients: Vec<f64>,
    /// Degrees of freedom: frames minus the coefficients of the motion.
    pub frames: usize,
    pub source: NoiseSource,
}

/// The residuals on which the noise was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoiseSource {
    /// The head along the sweep, against its smooth motion.
    SmoothHead,
    /// The tip upwards, against the glass.
    Glass,
}

/// Noise of a recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RecordingNoise {
    /// Of tip and head along the sweep.
    pub along_sweep: Option<ChannelNoise>,
    /// Of tip and head upwards.
    pub upwards: Option<ChannelNoise>,
}

/// Frames of a block at a frame rate.
pub(super) fn block_length(frame_rate_hz: f64) -> usize {
    ((BLOCK_S * frame_rate_hz).round() as usize).max(LEAST_BLOCK)
}

/// Measures the noise of a recording along the sweep and upwards, each on its own channel or, where that
/// gives none, on the other.
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
