//! The model of a fit: a scene with some parameters replaced, seen through the cameras of the recordings.

use super::objective::{Model, RunFailure};
use crate::recording::Recording;
use crate::simulate::scene::Scene;
use crate::simulate::{Effort, Run, Status};
use crate::twin::{Camera, Tracking, View, ViewError, track, view};

/// Right-hand sides after which an evaluation is given up: some hundred times what a reversal costs, a few seconds.
const MOST_EVALUATIONS: u64 = 20_000_000;

/// Tolerance of the model's runs: features are read to about 1e-3, and at 1e-6 the transitions are those of 1e-8 and finer.
const TOLERANCE: f64 = 1e-6;
/// Seed of the tracking noise: the same draws in every run, so that they cancel in differences.
const NOISE_SEED: u64 = 0;

/// How a recording was seen: its camera and the noise of its tracking.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eye {
    /// The camera.
    pub camera: Camera,
    /// Standard deviation of a tracked coordinate, m; the model gets as much, because noise shifts what is read (when a tip is seen
    /// to leave its place, the power in a band).
    pub noise_m: f64,
}

/// A scene whose named parameters a fit may change.
pub struct SceneModel<'a> {
    scene: &'a Scene,
    names: Vec<String>,
    eyes: Vec<Eye>,
}

impl<'a> SceneModel<'a> {
    /// A model that is seen through each eye in turn; `names` are the free parameters in job order.
    #[must_use]
    pub fn new(scene: &'a Scene, names: Vec<String>, eyes: Vec<Eye>) -> Self {
        Self { scene, names, eyes }
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

    /// What each eye sees with these values, tracking noise left out, whatever way the run ends.
    ///
    /// # Errors
    /// [`RunFailure`] when nothing could be seen.
    pub fn look(&self, values: &[f64]) -> Result<Vec<View>, RunFailure> {
        let scene = self.scene_at(values)?;
        let effort = Effort { most_evaluations: MOST_EVALUATIONS, ..Effort::new(scene.run.relative_tolerance.max(TOLERANCE)) };
        self.eyes.iter().map(|eye| view(&scene, &eye.camera, scene.start_s, scene.run.stop_s, effort).map_err(|error| self.blind(&error))).collect()
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
        let tracked = |(seen, eye): (View, &Eye)| {
            self.whole(&seen.run)?;
            let tracking = Tracking { metres_per_pixel: eye.noise_m, noise_px: 1.0, dropout_fraction: 0.0, seed: NOISE_SEED };
            track(&seen.recording, seen.recording.name(), &tracking).map_err(|error| RunFailure::new("not-finite", error.to_string(), 1.0))
        };
        self.look(values)?.into_iter().zip(&self.eyes).map(tracked).collect()
    }
}
