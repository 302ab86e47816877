//! The model of a fit over whole recordings: with the constants as they were fitted, and for a trace driven
//! by its own head from the state in which the first segment starts.

use super::error::FitError;
use super::job::{FitTarget, HeadSource};
use super::model_features::ModelFeatures;
use super::objective::Objective;
use super::problem::Problem;
use super::result::{
    FeatureResult, FitResult, ModelledTargets, NuisanceResult, StartState, predicted_feature_result,
};
use super::run::{predict_held_out, read_best_model, search_axis};
use super::scene_model::{ModelCondition, SceneModel};
use super::target::TargetValue;
use crate::blade::Pose;
use crate::simulate::drive::{Drive, smooth_head_motion};
use crate::simulate::scene::{Scene, StartKind};
use std::sync::Arc;

impl Problem {
    /// The model whose runs a result is about: that of the problem itself in a fit of features.
    ///
    /// # Errors
    /// [`FitError::CannotBeFitted`] when a scene refuses what was fitted.
    pub fn fitted_model(&self, result: &FitResult) -> Result<SceneModel, FitError> {
        let conditions = self.model().conditions().iter().enumerate();
        let whole = conditions.map(|(at, condition)| {
            let scene = self.whole_scene(at, &condition.scene, result)?;
            Ok(ModelCondition { scene, instrument: condition.instrument })
        });
        Ok(self.model().with_conditions(whole.collect::<Result<_, FitError>>()?))
    }

    /// The scene of condition `at` with the fitted constants, its drive and its start.
    fn whole_scene(&self, at: usize, scene: &Scene, result: &FitResult) -> Result<Scene, FitError> {
        let refused = |why: String| FitError::CannotBeFitted { why };
        let mut constants = result.nuisances.iter().filter(|nuisance| nuisance.recording.is_none());
        let set = |scene: Scene, constant: &NuisanceResult| {
            scene
                .with_parameter(&constant.name, constant.estimate)
                .map_err(|error| refused(error.to_string()))
        };
        let mut scene = constants.try_fold(scene.clone(), set)?;
        let trace = self.traces().iter().find(|trace| trace.condition == at);
        let name = self.job().conditions.get(at).map(|condition| &condition.name);
        let start = result.starts.iter().find(|start| Some(&start.recording) == name);
        let recording = self.recordings().get(at).and_then(Option::as_ref);
        if let (Some(HeadSource::Recording), Some(start), Some(recording)) =
            (trace.map(|trace| trace.head), start, recording)
        {
            let motion = smooth_head_motion(recording).map_err(|error| refused(error.to_string()))?;
            scene.run.stop_s = motion.span_s()[1];
            scene.drive = Drive::Recorded(Arc::new(motion));
            scene.start_s = start.time_s;
            scene.start = StartKind::State(start_pose(start));
        }
        Ok(scene)
    }

    /// What the whole runs of a result's model show of the job's components and features.
    pub(super) fn compare_with_targets(
        &self,
        result: &FitResult,
        targets: Vec<TargetValue>,
    ) -> Result<(ModelledTargets, Vec<FeatureResult>), FitError> {
        let (job, model) = (self.job(), self.fitted_model(result)?);
        let (fitted, held): (Vec<_>, Vec<_>) =
            job.targets.iter().cloned().zip(targets).partition(|(aim, _)| !aim.held_out);
        let (aims, targets): (Vec<FitTarget>, Vec<TargetValue>) = fitted.into_iter().unzip();
        let wanted: Vec<_> = aims.iter().map(|aim| aim.feature.clone()).collect();
        let goals = targets.iter().map(|target| target.value).collect();
        let values = result.parameter_estimates(job);
        let held_out = predict_held_out(held, &model, &values).iter().map(predicted_feature_result).collect();
        if aims.is_empty() {
            return Ok((ModelledTargets { components: Vec::new(), features: Vec::new() }, held_out));
        }
        let seen = ModelFeatures::new(&model, &wanted, goals, job.ensemble.members);
        let objective = Objective::new(job.parameters.iter().map(search_axis).collect(), targets, &seen);
        let best = objective.evaluate_values(values.clone());
        let shown = ModelledTargets::compare(
            &aims,
            objective.targets(),
            &[],
            &best,
            &read_best_model(&seen, &values),
        );
        Ok((shown, held_out))
    }
}

fn start_pose(start: &StartState) -> Pose {
    Pose {
        theta: start.neck_angle_rad,
        phi: start.lip_angle_rad,
        theta_rate: start.neck_rate_rad_per_s,
        phi_rate: start.lip_rate_rad_per_s,
    }
}
