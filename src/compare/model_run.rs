//! The model at the estimates: each condition's scene, run once.

use crate::fit::failure::RunFailure;
use crate::fit::job::Job;
use crate::fit::result::FitResult;
use crate::fit::scene_model::SceneModel;
use crate::simulate::motion::{MotionRecorder, RunMotion};
use crate::simulate::scene::Scene;
use crate::twin::TwinView;
use rayon::prelude::*;

/// The model at the estimates in one condition of the job.
#[derive(Debug, Clone)]
pub struct ModelRun {
    /// The scene with the estimates in it.
    pub scene: Scene,
    /// What the condition's camera records of the run.
    pub view: TwinView,
    /// The states of the same run.
    pub motion: RunMotion,
}

/// The model at the estimates, condition by condition, each run once at the tolerance of its scene.
///
/// # Errors
/// [`RunFailure`] when a run ends before its camera took two frames.
pub fn run_conditions(
    job: &Job,
    model: &SceneModel,
    result: &FitResult,
) -> Result<Vec<ModelRun>, RunFailure> {
    let values: Vec<f64> =
        job.parameters.iter().filter_map(|p| result.parameters.get(&p.name)).map(|p| p.estimate).collect();
    let at = |condition| {
        let scene = model.scene_at(&values, condition)?;
        let mut recorder = MotionRecorder::new(&scene);
        let view = model.record_scene(&scene, condition, &mut recorder)?;
        Ok(ModelRun { motion: recorder.into_motion(&scene, view.run), scene, view })
    };
    (0..job.conditions.len()).into_par_iter().map(at).collect()
}
