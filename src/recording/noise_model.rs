//! Noise of a tracker whose frames resemble their neighbours: an autoregressive process, how a recording
//! shows it, what both points have in common, and the map that makes it white.

mod autoregressive;
mod blocks;
mod channels;
mod common;
mod likelihood;
mod whitener;

pub use autoregressive::{AutoregressiveNoise, MOST_COEFFICIENTS, NotStationary};
pub use channels::{ChannelNoise, NoiseSource, RecordingNoise, measure_noise};
pub use common::{CommonNoise, SharedNoise, measure_common_noise};
pub use whitener::Whitener;

#[cfg(test)]
mod tests;
