//! Noise of a tracker whose frames resemble their neighbours: an autoregressive process, how a recording
//! shows it, what both points have in common, and the map that makes it white.

mod autoregressive;
mod blocks;
mod common_noise;
mod likelihood;

use super::Recording;
pub(crate) use autoregressive::{AutoregressiveNoise, Whitener};
use blocks::{BlockCut, NoiseBlock, cut_blocks, keep_quiet_blocks};
pub(crate) use common_noise::{SharedNoise, measure_common_noise};

// The noise of a recording's channels.
//
// Along the sweep it is that of the head against its smooth motion; upwards that of the tip against the
// glass, which in the picture is a line along the tip's own place. The blade moves the other two channels
// itself, as fast as frames follow, so theirs cannot be told from it: one tracker is taken to treat both
// points alike, and the tip along the sweep to have the noise of the head, the head upwards that of the tip.

/// Time over which a motion is a cubic, s: at 50 Hz a hundredth of the swing is left over.
const BLOCK_S: f64 = 8e-3;
/// Fewest frames of a block: with fewer, a cubic takes most of what neighbours have in common.
const LEAST_BLOCK: usize = 24;
/// Most frames that are looked at, spread over the recording: they give a correlation to 0.01.
const MOST_FRAMES: usize = 6_000;
/// Fewest frames that give a noise, beyond the freedoms of the motion.
const FEWEST_FRAMES: usize = 100;
/// Noise below it is rounding, m.
const LEAST_SD_M: f64 = 1e-9;

/// Noise of a channel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChannelNoise {
    pub noise: AutoregressiveNoise,
    /// Standard deviation of its standard deviation, m.
    pub sd_of_sd_m: f64,
    /// Standard deviations of its coefficients.
    pub sd_of_coefficients: Vec<f64>,
    /// Frames that it was measured on, less the freedoms of the motion.
    pub frames: usize,
    pub source: NoiseSource,
}

/// What a channel's noise was measured on.
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
    /// Of the tip and of the head along the sweep.
    pub along_sweep: Option<ChannelNoise>,
    /// Of the tip and of the head upwards.
    pub upwards: Option<ChannelNoise>,
}

/// Frames of a block at a frame rate.
pub(super) fn block_length(frame_rate_hz: f64) -> usize {
    ((BLOCK_S * frame_rate_hz).round() as usize).max(LEAST_BLOCK)
}

/// Measures the noise of a recording: along the sweep and upwards, each by its own channel where that is
/// tracked, by the other one where not; `None` where neither is, or where a recording has none.
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
    let blocks = thin_blocks(keep_quiet_blocks(cut_blocks(values, cut)));
    let found = likelihood::estimate_noise(&blocks)?;
    if found.freedoms < FEWEST_FRAMES || found.noise.sd() < LEAST_SD_M {
        return None;
    }
    let likelihood::NoiseEstimate { noise, sd_of_sd: sd_of_sd_m, sd_of_coefficients, freedoms: frames } =
        found;
    Some(ChannelNoise { noise, sd_of_sd_m, sd_of_coefficients, frames, source })
}

/// Every n-th block, so that no more frames than needed are looked at.
fn thin_blocks(blocks: Vec<NoiseBlock>) -> Vec<NoiseBlock> {
    let frames: usize = blocks.iter().map(|block| block.values.len()).sum();
    blocks.into_iter().step_by(frames.div_ceil(MOST_FRAMES).max(1)).collect()
}

#[cfg(test)]
mod tests;
