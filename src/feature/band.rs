//! A band of the spectrum of a window of a channel.

use crate::recording::channel::{Channel, Window};
use crate::spectrum::Detrend;
use serde::Serialize;

/// A band of the spectrum of a window of a channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FeatureBand {
    /// Which channel.
    pub channel: Channel,
    /// Which frames.
    pub window: Window,
    /// Lower and upper end, Hz.
    pub band_hz: (f64, f64),
    /// What is removed before the transform.
    pub detrend: Detrend,
    /// Least amplitude of the strongest component, m: below it there is none. A trace without noise shows
    /// remains of the trend and of a long dead ring-down, which no camera resolves.
    pub least_amplitude_m: f64,
}
