//! The model of a fit: a scene with some parameters replaced, seen through the cameras of the recordings.

use super::objective::{Model, RunFailure};
use crate::recording::Recording;
use crate::simulate::scene::Scene;
use crate::simulate::{Effort, Run, Status};
use crate::twin::{Camera, View, ViewError, view};

/// Right-hand sides after which an evaluation is given up: some hundred times what a reversal costs, a few seconds.
const MOST_EVALUATIONS: u64 = 20_000_000;

/// A scene whose named parameters a fit may change.
pub struct SceneModel<'a> {
    scene: &'a Scene,
    names: Vec<String>,
    cameras: Vec<Camera>,
}

impl<'a> SceneModel<'a> {
    /// A model that is seen through each camera in turn; `names` are the free parameters in job order.
    #[must_use]
    pub fn new(scene: &'a Scene, names: Vec<String>, cameras: Vec<Camera>) -> Self {
        Self { scene, names, cameras }
    }

    /// The scene with these values of the free parameters.
    ///
    /// # Errors
    /// The scene's refusal, as a failure of the run.
    pub fn scene_at(&self, values: &[f64]) -> Result<Scene, RunFailure> {
        self.names
            .iter()
            .zip(values)
            .try_fold(self.scene.clone(), |scene, (name, value)| scene.with(name, *value))
            .map_err(|error| RunFailure::new("refused", error.to_string(), 0.0))
    }

    /// What the first camera sees with these values, whatever way the run ends.
    ///
    /// # Errors
    /// [`RunFailure`] when nothing could be seen.
    pub fn look(&self, values: &[f64]) -> Result<Vec<View>, RunFailure> {
        let scene = self.scene_at(values)?;
        let effort = Effort { most_evaluations: MOST_EVALUATIONS, ..Effort::new(scene.run.relative_tolerance) };
        self.cameras.iter().map(|camera| view(&scene, camera, scene.start_s, scene.run.stop_s, effort).map_err(|error| self.blind(&error))).collect()
    }

    fn blind(&self, error: &ViewError) -> RunFailure {
        match error {
            ViewError::Early { status, stopped_at_s } => RunFailure::new(status.name(), error.to_string(), self.progress(*stopped_at_s)),
            ViewError::Recording(_) => RunFailure::new("not-finite", error.to_string(), 0.0),
        }
    }

    /// Share of the run that was reached.
    fn progress(&self, time_s: f64) -> f64 {
        (time_s - self.scene.start_s) / (self.scene.run.stop_s - self.scene.start_s)
    }

    fn whole(&self, run: &Run) -> Result<(), RunFailure> {
        if run.status == Status::Completed {
            return Ok(());
        }
        let message = format!("{} at {} s: {}", run.status.name(), run.stopped_at_s, run.status.meaning());
        Err(RunFailure::new(run.status.name(), message, self.progress(run.stopped_at_s)))
    }
}

impl Model for SceneModel<'_> {
    fn observe(&self, values: &[f64]) -> Result<Vec<Recording>, RunFailure> {
        self.look(values)?.into_iter().map(|seen| self.whole(&seen.run).map(|()| seen.recording)).collect()
    }
}
