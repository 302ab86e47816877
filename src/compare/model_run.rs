//! The model at the estimates: each condition's scene, run once.

use super::motion::{Motion, MotionRecorder};
use crate::fit::job::Job;
use crate::fit::objective::RunFailure;
use crate::fit::result::FitResult;
use crate::fit::scene_model::SceneModel;
use crate::simulate::scene::Scene;
use crate::twin::View;
use rayon::prelude::*;

/// The model at the estimates in one condition of the job.
#[derive(Debug, Clone)]
pub struct ModelRun {
    /// The scene with the estimates in it.
    pub scene: Scene,
    /// What the condition's camera records of the run.
    pub view: View,
    /// The states of the same run.
    pub motion: Motion,
}

/// The model at the estimates, condition by condition, each run once at the tolerance of its scene.
///
/// # Errors
/// [`RunFailure`] when a run ends before its camera took two frames.
pub fn model_runs(job: &Job, model: &SceneModel, result: &FitResult) -> Result<Vec<ModelRun>, RunFailure> {
    let values: Vec<f64> =
        job.parameters.iter().filter_map(|p| result.parameters.get(&p.name)).map(|p| p.estimate).collect();
    let at = |condition| {
        let scene = model.scene_at(&values, condition)?;
        let mut recorder = MotionRecorder::new(&scene);
        let view = model.recorded(&scene, condition, &mut recorder)?;
        Ok(ModelRun { motion: recorder.motion(&scene, view.run), scene, view })
    };
    (0..job.conditions.len()).into_par_iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blade::parameters;
    use crate::fit::scene_model::{Condition, Eye, Plausible};
    use crate::report::comparison::report;
    use crate::simulate::RUNS;
    use crate::twin::Camera;

    const JOB: &str = include_str!("../../fits/published-simulation/job.toml");
    const RESULT: &str = include_str!("../../fits/published-simulation/result.json");
    const SCENE: &str = include_str!("../../data/scenes/published-simulation.toml");

    #[test]
    fn a_report_with_all_its_figures_runs_every_scene_once() {
        let job = Job::parse("job.toml", JOB, &parameters::names()).unwrap();
        let result = FitResult::parse("result.json", RESULT).unwrap();
        let camera = Camera { frame_rate_hz: 5e3, exposure_s: 0.0 };
        let condition = || Condition {
            scene: Scene::parse("scene.toml", SCENE).unwrap(),
            eye: Eye { camera, noise_m: 0.0, dropout_fraction: 0.0 },
        };
        let conditions: Vec<Condition> = job.conditions.iter().map(|_| condition()).collect();
        let model = SceneModel::new(conditions, job.parameter_names(), Plausible::default());
        // everything in one thread, whose runs are counted
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let (runs, figures) = pool.install(|| {
            let models = model_runs(&job, &model, &result).unwrap();
            let figures = report(&job, &[], &models, &result).all_figures().count();
            (RUNS.get(), figures)
        });
        assert_eq!(runs, job.conditions.len());
        assert!(figures > 8, "{figures}");
    }
}
