//! From what a fit found to its result.

use super::{
    ComponentResult, EvaluationCounts, FeatureResult, FitResult, FitStatus, LocalOptimum, NuisanceResult,
    ParameterResult, RunnerUpPeak,
};
use crate::feature::FeatureValue;
use crate::fit::camera_calibration::{CameraEstimate, CameraFit};
use crate::fit::evaluation::{Evaluation, Observed};
use crate::fit::identifiability::Identifiability;
use crate::fit::job::{FitTarget, Job};
use crate::fit::ledger::Ledger;
use crate::fit::linear_model::Z_95;
use crate::fit::run::FitContext;
use crate::fit::search::{LocalDescent, SearchOutcome};
use crate::fit::targets::TargetValue;
use crate::fit::uncertainty::{CHI_SQUARED_95, FitUncertainty, ParameterInterval};
use crate::math;
use crate::text::format_short;
use std::collections::BTreeMap;

/// Everything that goes into a result.
pub(in crate::fit) struct FitFindings<'a> {
    pub job: &'a Job,
    /// Aims that were fitted, in the order of the targets.
    pub aims: &'a [FitTarget],
    pub targets: &'a [TargetValue],
    pub found: &'a FitUncertainty,
    pub searched: &'a SearchOutcome,
    pub gate: Identifiability,
    /// Aims that were held out, with what the best model shows of them.
    pub held_out: Vec<(FitTarget, TargetValue, Result<f64, String>)>,
    pub status: FitStatus,
    pub synthetic: bool,
    pub context: &'a FitContext<'a>,
}

impl FitFindings<'_> {
    /// The result; `reads` are the features of the best model, read once more.
    pub(in crate::fit) fn into_result(self, ledger: &Ledger, reads: &[Option<FeatureValue>]) -> FitResult {
        let names = self.job.parameter_names();
        let sensitivities = self
            .targets
            .iter()
            .zip(&self.found.sensitivities)
            .map(|(t, row)| (t.name.clone(), names.iter().cloned().zip(row.iter().copied()).collect()));
        let correlation = |row: &Vec<Option<f64>>| {
            names.iter().zip(row).filter_map(|(name, r)| Some((name.clone(), (*r)?))).collect()
        };
        let shown =
            ModelledTargets::compare(self.aims, self.targets, &self.found.twin_sd, &self.found.best, reads);
        FitResult {
            title: self.job.title.clone(),
            status: self.status,
            misfit: None,
            nuisances: camera_nuisance_results(self.job, &self.found.cameras),
            starts: Vec::new(),
            parameters: names
                .iter()
                .cloned()
                .zip(self.found.intervals.iter().map(parameter_result))
                .collect(),
            components: shown.components,
            features: shown.features,
            held_out: self.held_out.iter().map(predicted_feature_result).collect(),
            rank: self.found.rank,
            condition: Some(self.found.condition).filter(|condition| condition.is_finite()),
            combinations: self.found.combinations.clone(),
            correlations: names
                .iter()
                .cloned()
                .zip(self.found.correlations.iter().map(correlation))
                .collect(),
            cost: self.found.best.cost,
            threshold: CHI_SQUARED_95,
            twins: self.found.twins,
            waterfall: sorted_optima(&names, &self.searched.descents),
            sensitivities: sensitivities.collect(),
            evaluations: EvaluationCounts {
                total: ledger.run_evaluations().len(),
                failed: ledger.count_failures(),
            },
            synthetic: self.synthetic,
            notes: self.collect_notes(),
            seed: self.job.search.seed,
            fingerprint: self.context.fingerprint.to_owned(),
            version: self.context.version.to_owned(),
            gate: self.gate,
        }
    }

    fn collect_notes(&self) -> Vec<String> {
        let mut notes = self.found.notes.clone();
        notes.extend(self.gate.notes.iter().cloned());
        notes.extend(
            self.found
                .twin_sd
                .iter()
                .zip(self.targets)
                .filter_map(|(sd, target)| twin_noise_note(target, (*sd)?)),
        );
        if self.synthetic {
            notes.push("the recording is synthetic: no camera took it".to_owned());
        }
        notes
    }
}

/// What the best model shows of the aims that were fitted, next to their targets.
pub(in crate::fit) struct ModelledTargets {
    pub components: Vec<ComponentResult>,
    pub features: Vec<FeatureResult>,
}

impl ModelledTargets {
    /// Of aims, their targets and deviations over twins in one order; `reads` are the features of the best
    /// model, read once more.
    pub(in crate::fit) fn compare(
        aims: &[FitTarget],
        targets: &[TargetValue],
        twin_sd: &[Option<f64>],
        best: &Evaluation,
        reads: &[Option<FeatureValue>],
    ) -> Self {
        let cameras = &CameraFit::estimate(targets, &best.features);
        let met = |(at, (aim, target))| {
            let twin_sd = twin_sd.get(at).copied().flatten();
            ModelledTarget { at, aim, target, best, cameras, twin_sd }
        };
        let met: Vec<ModelledTarget> = aims.iter().zip(targets).enumerate().map(met).collect();
        Self {
            components: met.iter().filter_map(|met| met.component_result(reads)).collect(),
            features: met
                .iter()
                .filter(|met| met.aim.tolerance_relative.is_none())
                .map(ModelledTarget::feature_result)
                .collect(),
        }
    }
}

/// What was estimated of the cameras of features.
pub(in crate::fit) fn camera_nuisance_results(job: &Job, found: &[CameraEstimate]) -> Vec<NuisanceResult> {
    let nuisance = |found: &CameraEstimate| NuisanceResult {
        recording: job.conditions.get(found.condition).map(|condition| condition.name.clone()),
        name: found.name.to_owned(),
        prior: 0.0,
        prior_sd: found.prior_sd,
        estimate: found.estimate,
        lower_95: found.half_95.map(|half| found.estimate - half),
        upper_95: found.half_95.map(|half| found.estimate + half),
    };
    found.iter().map(nuisance).collect()
}

/// Twins scatter by more than a target's deviation by this factor before it is said.
const NOISY_TWIN_FACTOR: f64 = 2.0;

fn twin_noise_note(target: &TargetValue, twin_sd: f64) -> Option<String> {
    (twin_sd > NOISY_TWIN_FACTOR * target.sd).then(|| {
        format!(
            "`{}` scatters by {} over twins of the best model, more than its stated deviation of {}: noise alone moves it so far",
            target.name,
            format_short(twin_sd),
            format_short(target.sd)
        )
    })
}

fn parameter_result(i: &ParameterInterval) -> ParameterResult {
    ParameterResult {
        estimate: i.estimate,
        lower_95: i.lower_95,
        upper_95: i.upper_95,
        verdict: i.verdict,
        linear_95: i.linear_95,
        profile_95: i.profile_95,
        bootstrap_95: i.bootstrap_95,
        profile: i.profile.clone(),
        reasons: i.reasons.clone(),
    }
}

fn sorted_optima(names: &[String], descents: &[LocalDescent]) -> Vec<LocalOptimum> {
    let optimum = |descent: &LocalDescent| LocalOptimum {
        start_cost: descent.start.cost,
        cost: descent.end.cost,
        evaluations: descent.evaluations,
        values: names.iter().cloned().zip(descent.end.values.iter().copied()).collect::<BTreeMap<_, _>>(),
        failure: descent.end.failure.as_ref().map(ToString::to_string),
    };
    let mut optima: Vec<LocalOptimum> = descents.iter().map(optimum).collect();
    optima.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    optima
}

/// A held-out aim, with what the best model predicts.
pub(in crate::fit) fn predicted_feature_result(
    (aim, target, found): &(FitTarget, TargetValue, Result<f64, String>),
) -> FeatureResult {
    let model = found.as_ref().ok().copied();
    let near = |model: f64| match aim.tolerance_relative {
        Some(tolerance) => (model / target.value - 1.0).abs() <= tolerance,
        None => {
            let of_camera = target.calibration.map_or(0.0, |calibration| calibration.sd_m(model));
            (model - target.value).abs() <= Z_95 * math::hypot(target.sd, of_camera)
        }
    };
    FeatureResult {
        name: target.name.clone(),
        kind: aim.feature.reading.kind().to_owned(),
        unit: aim.feature.reading.unit().name.to_owned(),
        target: target.value,
        target_sd: target.sd,
        model,
        model_seen: None,
        relative_error: model.map(|model| model / target.value - 1.0).filter(|error| error.is_finite()),
        pass: model.is_some_and(near),
        model_scatter: None,
        model_spread: None,
        twin_sd: None,
        missing: found.as_ref().err().cloned(),
    }
}

/// An aim against the best model.
struct ModelledTarget<'a> {
    at: usize,
    aim: &'a FitTarget,
    target: &'a TargetValue,
    best: &'a Evaluation,
    cameras: &'a CameraFit,
    twin_sd: Option<f64>,
}

impl ModelledTarget<'_> {
    fn model_value(&self) -> Option<f64> {
        self.best.features.get(self.at).and_then(Observed::value)
    }

    /// What the camera shows of the model's value.
    fn value_seen(&self) -> Option<f64> {
        self.cameras.apply_to_value(self.target, self.best.features.get(self.at)?)
    }

    fn start_spread(&self) -> Option<f64> {
        let spread = self.best.features.get(self.at)?.observation()?.spread;
        (spread > 0.0).then_some(spread)
    }

    fn model_scatter(&self) -> Option<f64> {
        (self.target.scatter > 0.0).then_some(self.target.scatter)
    }

    fn missing_reason(&self) -> Option<String> {
        match (self.best.features.get(self.at), &self.best.failure) {
            (Some(Observed::Missing(why)), _) => Some(why.clone()),
            (Some(Observed::Value(_)), _) => None,
            (None, failure) => failure.as_ref().map(ToString::to_string),
        }
    }

    fn relative_error(&self) -> Option<f64> {
        self.value_seen().map(|model| model / self.target.value - 1.0).filter(|error| error.is_finite())
    }

    fn component_result(&self, reads: &[Option<FeatureValue>]) -> Option<ComponentResult> {
        let tolerance_relative = self.aim.tolerance_relative?;
        let runner_up = reads.get(self.at).and_then(|read| read.as_ref()?.runner_up);
        Some(ComponentResult {
            name: self.target.name.clone(),
            target_hz: self.target.value,
            target_sd_hz: self.target.sd,
            model_hz: self.model_value(),
            relative_error: self.relative_error(),
            tolerance_relative,
            pass: self.relative_error().is_some_and(|error| error.abs() <= tolerance_relative),
            model_scatter_hz: self.model_scatter(),
            model_spread_hz: self.start_spread(),
            below_db: self.best.features.get(self.at).and_then(|f| Some(f.observation()?.below_db)),
            runner_up: runner_up
                .map(|peak| RunnerUpPeak { frequency_hz: peak.frequency_hz, below_db: peak.below_db }),
            twin_sd_hz: self.twin_sd,
            missing: self.missing_reason(),
        })
    }

    fn feature_result(&self) -> FeatureResult {
        FeatureResult {
            name: self.target.name.clone(),
            kind: self.aim.feature.reading.kind().to_owned(),
            unit: self.aim.feature.reading.unit().name.to_owned(),
            target: self.target.value,
            target_sd: self.target.sd,
            model: self.model_value(),
            model_seen: self.target.calibration.and_then(|_| self.value_seen()),
            relative_error: self.relative_error(),
            pass: self
                .value_seen()
                .is_some_and(|model| (model - self.target.value).abs() <= Z_95 * self.target.sd),
            model_scatter: self.model_scatter(),
            model_spread: self.start_spread(),
            twin_sd: self.twin_sd,
            missing: self.missing_reason(),
        }
    }
}
