//! A record: samples on an even grid, with gaps.

/// A record of displacement, with the frame rate and the exposure of the camera that took it.
#[derive(Debug, Clone, Copy)]
pub struct SampledRecord<'a> {
    /// One sample per frame, m; `None` for a missing frame.
    pub samples: &'a [Option<f64>],
    /// Frames per second, 1/s.
    pub frame_rate_hz: f64,
    /// Exposure of a frame, s, if known.
    pub exposure_s: Option<f64>,
}
