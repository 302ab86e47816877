//! What is kept of a simulated run, for what its traces do not show.

use crate::simulate::outputs::EnergyAudit;
use crate::simulate::{RunResult, Transition};

/// What is kept of a simulated run.
#[derive(Debug, Clone)]
pub struct RunRecord {
    /// Start and stop time of its scene, s.
    pub span_s: [f64; 2],
    /// How it went.
    pub run: RunResult,
    /// When the tip stuck, s.
    pub stick_s: Vec<[f64; 2]>,
    /// Its changes of mode.
    pub transitions: Vec<Transition>,
    /// Its extremes, where a reading needs them ([`super::Reading::needs_audit`]).
    pub audit: Option<EnergyAudit>,
}
