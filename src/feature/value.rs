//! A value that was read.

/// A value read from a recording or a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeatureValue {
    /// The value, in the reading's unit.
    pub value: f64,
    /// Its standard deviation where the reading itself gives one.
    pub sd: Option<f64>,
    /// How far the component is below the strongest of its band, dB; 0 for the strongest, and where there is
    /// nothing to choose from.
    pub below_db: f64,
    /// The component that would have been next, where there is a choice.
    pub runner_up: Option<RunnerUpComponent>,
}

/// A component that was not chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunnerUpComponent {
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// How far it is below the strongest of the band, dB.
    pub below_db: f64,
}

impl FeatureValue {
    /// A value among which there is no choice.
    pub(super) fn new(value: f64, sd: Option<f64>) -> Self {
        Self { value, sd, below_db: 0.0, runner_up: None }
    }
}
