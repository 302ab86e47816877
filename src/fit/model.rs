//! What a fit needs of a model.

use super::evaluation::Observed;
use super::failure::{FailureReason, RunFailure};
use crate::recording::Recording;

/// Features of a model at parameter values: what the objective needs, and all that it knows.
pub trait FeaturePredictor: Sync {
    /// One entry a target, in their order; `values` are the free parameters in job order, in their SI units.
    ///
    /// # Errors
    /// [`RunFailure`] when the run ended before anything could be observed.
    fn predict_features(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure>;

    /// What one measurement of that model would show: noise, lost points and starting state of draw number
    /// `draw`.
    ///
    /// # Errors
    /// As [`Self::predict_features`].
    fn simulate_twin(&self, values: &[f64], draw: u64) -> Result<Vec<Observed>, RunFailure>;
}

/// Which of the many equally likely runs and recordings of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Draw {
    /// Starting state; 0 is the scene's own.
    pub member: u64,
    /// Noise of the tracking; 0 is the one that every evaluation of a search shares.
    pub noise: u64,
    /// Whether frames are lost as in the recording.
    pub dropouts: bool,
}

/// A model that is seen through cameras.
pub trait Model: Sync {
    /// What the camera of a condition of the job (counted from 0) records; `values` are the free parameters
    /// in job order, in their SI units.
    ///
    /// # Errors
    /// [`RunFailure`] when the run ended before anything could be observed.
    fn record_condition(&self, values: &[f64], condition: usize, draw: Draw)
    -> Result<Recording, RunFailure>;

    /// The same of a run that starts otherwise.
    ///
    /// # Errors
    /// As [`Self::record_condition`]; also where the model knows no other start.
    fn record_restarted(
        &self,
        values: &[f64],
        condition: usize,
        draw: Draw,
        restart: Restart,
    ) -> Result<Recording, RunFailure> {
        let _ = (values, condition, draw, restart);
        Err(RunFailure::new(FailureReason::Refused, "this model knows no other start", 0.0))
    }

    /// The time in which a wrong start decays to a share of 1/e, s; `None` where it is unknown.
    fn decay_s(&self, values: &[f64], condition: usize) -> Option<f64> {
        let _ = (values, condition);
        None
    }

    /// By how much earlier a run may start, s.
    fn max_lead_s(&self, condition: usize) -> f64 {
        let _ = condition;
        f64::INFINITY
    }
}

/// How a run starts, other than its scene says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Restart {
    /// Earlier by this time, s; it is recorded from the same instant.
    Earlier(f64),
    /// With angles that are larger by this share.
    Moved(f64),
}
