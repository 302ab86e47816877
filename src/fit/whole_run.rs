//! The model of a fit over whole recordings: with the constants as they were fitted, and for a trace driven
//! by its own head from the state in which the first segment starts.

use super::error::FitError;
use super::job::{Aim, Head};
use super::model_features::ModelFeatures;
use super::objective::Objective;
use super::problem::Problem;
use super::result::{FeatureResult, FitResult, NuisanceResult, Shown, StartState, predicted};
use super::run::{axis, best_reads, cross_check};
use super::scene_model::{Condition, SceneModel};
use super::target::Target;
use crate::blade::Pose;
use crate::simulate::drive::{Drive, head_motion};
use crate::simulate::scene::{Scene, StartKind};
use std::sync::Arc;

impl Problem {
    /// The model whose runs a result is about: that of the problem itself in a fit of features.
    ///
    /// # Errors
    /// [`FitError::CannotBeFitted`] when a scene refuses what was fitted.
    pub fn model_of(&self, result: &FitResult) -> Result<SceneModel, FitError> {
        let conditions = self.model().conditions().iter().enumerate();
        let whole = conditions.map(|(at, condition)| {
            let scene = self.whole_scene(at, &condition.scene, result)?;
            Ok(Condition { scene, instrument: condition.instrument })
        });
        Ok(self.model().with_conditions(whole.collect::<Result<_, FitError>>()?))
    }

    /// The scene of condition `at` with the fitted constants, its drive and its start.
    fn whole_scene(&self, at: usize, scene: &Scene, result: &FitResult) -> Result<Scene, FitError> {
        let refused = |why: String| FitError::CannotBeFitted { why };
        let mut constants = result.nuisances.iter().filter(|nuisance| nuisance.recording.is_none());
        let set = |scene: Scene, constant: &NuisanceResult| {
            scene.with(&constant.name, constant.estimate).map_err(|error| refused(error.to_string()))
        };
        let mut scene = constants.try_fold(scene.clone(), set)?;
        let trace = self.traces().iter().find(|trace| trace.condition == at);
        let name = self.job().conditions.get(at).map(|condition| &condition.name);
        let start = result.starts.iter().find(|start| Some(&start.recording) == name);
        let recording = self.recordings().get(at).and_then(Option::as_ref);
        if let (Some(Head::Recording), Some(start), Some(recording)) =
            (trace.map(|trace| trace.head), start, recording)
        {
            let motion = head_motion(recording).map_err(|error| refused(error.to_string()))?;
            scene.run.stop_s = motion.span_s()[1];
            scene.drive = Drive::Recorded(Arc::new(motion));
            scene.start_s = start.time_s;
            scene.start = StartKind::State(pose(start));
        }
        Ok(scene)
    }

    /// What the whole runs of a result's model show of the job's components and features.
    pub(super) fn checked(
        &self,
        result: &FitResult,
        targets: Vec<Target>,
    ) -> Result<(Shown, Vec<FeatureResult>), FitError> {
        let (job, model) = (self.job(), self.model_of(result)?);
        let (fitted, held): (Vec<_>, Vec<_>) =
            job.aims.iter().cloned().zip(targets).partition(|(aim, _)| !aim.held_out);
        let (aims, targets): (Vec<Aim>, Vec<Target>) = fitted.into_iter().unzip();
        let wanted: Vec<_> = aims.iter().map(|aim| aim.feature.clone()).collect();
        let goals = targets.iter().map(|target| target.value).collect();
        let values = result.values(job);
        let held_out = cross_check(held, &model, &values).iter().map(predicted).collect();
        if aims.is_empty() {
            return Ok((Shown { components: Vec::new(), features: Vec::new() }, held_out));
        }
        let seen = ModelFeatures::new(&model, &wanted, goals, job.ensemble.members);
        let objective = Objective::new(job.parameters.iter().map(axis).collect(), targets, &seen);
        let best = objective.evaluate_values(values.clone());
        let shown = Shown::of(&aims, objective.targets(), &[], &best, &best_reads(&seen, &values));
        Ok((shown, held_out))
    }
}

fn pose(start: &StartState) -> Pose {
    Pose {
        theta: start.neck_angle_rad,
        phi: start.lip_angle_rad,
        theta_rate: start.neck_rate_rad_per_s,
        phi_rate: start.lip_rate_rad_per_s,
    }
}
