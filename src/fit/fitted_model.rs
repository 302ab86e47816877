//! Runs of the fitted model over whole recordings. If the recorded head drives the model, a run starts in the
//! fitted state of the first segment that fits.

use super::FitError;
use super::model::ModelFeatures;
use super::objective::Objective;
use super::problem::Problem;
use super::result::{FeatureResult, FitResult, ModelledTargets, NuisanceResult};
use super::run::{predict_held_out, read_best_model};
use super::scene_model::{ModelCondition, SceneModel};
use super::target_value::TargetValue;
use super::targets::split_held_out;
use super::trace::{FittedTraces, TraceUnknown, UnknownKind, first_fitting};
use crate::simulate::drive::Drive;
use crate::simulate::scene::{Scene, StartKind};

impl Problem {
    /// The model with the fitted constants and starting states of a result. In a fit of features this is the
    /// model of the problem.
    ///
    /// # Errors
    /// [`FitError::CannotBeFitted`] if a scene refuses a fitted value, or if the result lacks the estimate of
    /// an unknown of the traces.
    pub fn fitted_model(&self, result: &FitResult) -> Result<SceneModel, FitError> {
        let mut traces: Vec<Option<FittedTraces>> = vec![None; self.model().conditions().len()];
        for (traced, fitted) in self.traces().iter().zip(self.fitted_traces(result)?) {
            traces[traced.condition] = Some(fitted);
        }
        let conditions = self.model().conditions().iter().zip(&traces).enumerate();
        let whole = conditions.map(|(at, (condition, traces))| {
            let scene = self.whole_scene(at, &condition.scene, result, traces.as_ref())?;
            Ok(ModelCondition { scene, instrument: condition.instrument })
        });
        Ok(self.model().with_conditions(whole.collect::<Result<_, FitError>>()?, traces))
    }

    /// Each fitted recording together with the model at the estimates, in the order of the traces; empty
    /// without traces.
    fn fitted_traces(&self, result: &FitResult) -> Result<Vec<FittedTraces>, FitError> {
        let refused = |why: String| FitError::CannotBeFitted { why };
        let Some(model) = self.trace_model() else { return Ok(Vec::new()) };
        let model = model.map_err(|error| refused(error.to_string()))?;
        let names = self.trace_recording_names();
        let estimate = |unknown: &TraceUnknown| {
            let (recording, name) = match &unknown.kind {
                UnknownKind::Parameter { name, .. } => (None, name.as_str()),
                UnknownKind::Camera { film, what } => (names.get(*film), what.key()),
            };
            let is_same = |n: &&NuisanceResult| n.recording.as_ref() == recording && n.name == name;
            let found = result.nuisances.iter().find(is_same).map(|nuisance| nuisance.estimate);
            let found = found.or_else(|| Some(result.parameters.get(name)?.estimate));
            let coordinate = found.map(|value| unknown.coordinate(value)).filter(|z| z.is_finite());
            coordinate.ok_or_else(|| refused(format!("the result has no estimate of `{name}`")))
        };
        let z = model.unknowns.0.iter().map(estimate).collect::<Result<Vec<f64>, _>>()?;
        let shown = FittedTraces::show_recordings(&model, &z, &names, &result.segments);
        shown.ok_or_else(|| refused("a scene refuses the estimates of the result".to_owned()))
    }

    /// The scene of condition `at` for a run over the whole recording, with the fitted constants. If the
    /// recorded head drives the model, the run starts in the fitted state of the first segment that fits.
    fn whole_scene(
        &self,
        at: usize,
        scene: &Scene,
        result: &FitResult,
        traces: Option<&FittedTraces>,
    ) -> Result<Scene, FitError> {
        let refused = |why: String| FitError::CannotBeFitted { why };
        let mut scene = scene.clone();
        for constant in result.nuisances.iter().filter(|nuisance| nuisance.recording.is_none()) {
            let set = scene.with_parameter(&constant.name, constant.estimate);
            scene = set.map_err(|error| refused(error.to_string()))?;
        }
        let name = self.job().conditions.get(at).map(|condition| &condition.name);
        let own: Vec<_> = result.segments.iter().filter(|s| Some(&s.recording) == name).collect();
        if let (Some(traces), Some(start)) = (traces.filter(|traces| traces.own_head), first_fitting(&own)) {
            scene.drive = traces.scene.drive.clone();
            if let Drive::Recorded(motion) = &scene.drive {
                scene.run.stop_s = motion.span_s()[1];
            }
            scene.start_s = start.time_s;
            scene.start = StartKind::State(start.pose());
        }
        Ok(scene)
    }

    /// Compares runs of the fitted model over whole recordings with the components and features of the job.
    pub(super) fn compare_with_targets(
        &self,
        result: &FitResult,
        targets: Vec<TargetValue>,
    ) -> Result<(ModelledTargets, Vec<FeatureResult>), FitError> {
        let (job, model) = (self.job(), self.fitted_model(result)?);
        let (aims, targets, held) = split_held_out(job, targets);
        let values = result.parameter_estimates(job);
        let held_out = predict_held_out(&held, &model, &values);
        if aims.is_empty() {
            return Ok((ModelledTargets { components: Vec::new(), features: Vec::new() }, held_out));
        }
        let seen = ModelFeatures::for_targets(&model, &aims, &targets, job.ensemble.members);
        let objective = Objective::new(job.parameters.clone(), targets, &seen);
        let best = objective.evaluate_values(values.clone());
        let reads = read_best_model(&seen, &values);
        let shown = ModelledTargets::compare(&aims, objective.targets(), &[], &best, &reads);
        Ok((shown, held_out))
    }
}
