//! The camera of a synthetic recording or of a feature.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What takes a recording, as a model of it needs it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Frames per second, 1/s.
    pub frame_rate_hz: f64,
    /// Time for which the shutter is open, centred on the frame's instant, s; 0 for an instant.
    pub exposure_s: f64,
}
