//! A frequency that is sought.

use serde::Serialize;

/// A frequency that a spectrum is compared with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Target {
    /// What it is.
    pub name: String,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Its standard deviation, Hz, where known.
    pub frequency_sd_hz: Option<f64>,
}
