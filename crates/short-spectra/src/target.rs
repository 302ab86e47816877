//! A target frequency.

use serde::Serialize;

/// A frequency that a spectrum is compared with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Target {
    /// Name of the target in tables.
    pub name: String,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz, if known.
    pub frequency_sd_hz: Option<f64>,
}
