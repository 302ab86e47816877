//! Assembles the result of a fit of features.

use super::{
    ComponentResult, EvaluationCounts, FeatureResult, FitResult, FitStatus, LocalOptimum, NuisanceResult,
    RunnerUpPeak,
};
use crate::feature::FeatureValue;
use crate::fit::camera_calibration::{CameraEstimate, CameraFit};
use crate::fit::context::FitContext;
use crate::fit::evaluation::{Evaluation, Observed, map_names};
use crate::fit::identifiability::Identifiability;
use crate::fit::job::{FitTarget, Job};
use crate::fit::ledger::Ledger;
use crate::fit::linear_model::Z_95;
use crate::fit::search::{LocalDescent, SearchOutcome};
use crate::fit::target_value::TargetValue;
use crate::fit::uncertainty::{CHI_SQUARED_95, FitUncertainty};
use crate::text::format_short;
use portable_math as math;

/// The parts from which a result is assembled.
pub(in crate::fit) struct FitFindings<'a> {
    pub job: &'a Job,
    /// Fitted entries of the job, in the order of the targets.
    pub aims: &'a [FitTarget],
    pub targets: &'a [TargetValue],
    pub found: &'a FitUncertainty,
    pub searched: &'a SearchOutcome,
    pub gate: Identifiability,
    pub held_out: Vec<FeatureResult>,
    pub status: FitStatus,
    pub synthetic: bool,
    pub context: &'a FitContext<'a>,
}

impl FitFindings<'_> {
    /// The result of the fit; `reads` are the features of the best model with their spectral peaks.
    pub(in crate::fit) fn into_result(self, ledger: &Ledger, reads: &[Option<FeatureValue>]) -> FitResult {
        let (found, names) = (self.found, self.job.parameter_names());
        let rows = self.targets.iter().zip(&found.sensitivities);
        let sensitivities = rows.map(|(t, row)| (t.name.clone(), map_names(&names, row.iter().copied())));
        let correlation = |row: &Vec<Option<f64>>| {
            names.iter().cloned().zip(row).filter_map(|(n, r)| Some((n, (*r)?))).collect()
        };
        let shown = ModelledTargets::compare(self.aims, self.targets, &found.twin_sd, &found.best, reads);
        FitResult {
            title: self.job.title.clone(),
            status: self.status,
            misfit: None,
            findings: Vec::new(),
            law: None,
            chatter: None,
            nuisances: camera_nuisance_results(self.job, &found.cameras),
            segments: Vec::new(),
            parameters: map_names(&names, found.intervals.iter().cloned()),
            components: shown.components,
            features: shown.features,
            held_out: self.held_out.clone(),
            rank: found.rank,
            condition: Some(found.condition).filter(|condition| condition.is_finite()),
            combinations: found.combinations.clone(),
            correlations: map_names(&names, found.correlations.iter().map(correlation)),
            cost: found.best.cost,
            threshold: CHI_SQUARED_95,
            twins: found.twins,
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
        let twins = self.found.twin_sd.iter().zip(self.targets);
        notes.extend(twins.filter_map(|(sd, target)| twin_noise_note(target, (*sd)?)));
        if self.synthetic {
            notes.push("the recording is synthetic: no camera took it".to_owned());
        }
        notes
    }
}

/// Values of the best model compared with the fitted targets.
pub(in crate::fit) struct ModelledTargets {
    pub components: Vec<ComponentResult>,
    pub features: Vec<FeatureResult>,
}

impl ModelledTargets {
    /// Compares the best model with the targets. `twin_sd` are the standard deviations of the features over
    /// twins, and `reads` are the features of the best model with their spectral peaks; both are in the order
    /// of `aims`.
    pub(in crate::fit) fn compare(
        aims: &[FitTarget],
        targets: &[TargetValue],
        twin_sd: &[Option<f64>],
        best: &Evaluation,
        reads: &[Option<FeatureValue>],
    ) -> Self {
        let cameras = CameraFit::estimate(targets, &best.features);
        let mut shown = Self { components: Vec::new(), features: Vec::new() };
        for (at, (aim, target)) in aims.iter().zip(targets).enumerate() {
            let observed = best.features.get(at);
            let found = observed.and_then(Observed::observation);
            let seen = observed.and_then(|observed| cameras.apply_to_value(target, observed));
            let feature = FeatureResult {
                model: found.map(|found| found.value),
                model_seen: target.calibration.and(seen),
                relative_error: relative_error(seen, target),
                pass: seen.is_some_and(|model| (model - target.value).abs() <= Z_95 * target.sd),
                model_scatter: Some(target.scatter).filter(|scatter| *scatter > 0.0),
                model_spread: found.map(|found| found.spread).filter(|spread| *spread > 0.0),
                twin_sd: twin_sd.get(at).copied().flatten(),
                missing: match observed {
                    Some(Observed::Missing(why)) => Some(why.clone()),
                    Some(Observed::Value(_)) => None,
                    None => best.failure.as_ref().map(ToString::to_string),
                },
                ..unread_result(aim, target)
            };
            let Some(tolerance_relative) = aim.tolerance_relative else {
                shown.features.push(feature);
                continue;
            };
            let runner_up = reads.get(at).and_then(|read| read.as_ref()?.runner_up);
            shown.components.push(ComponentResult {
                name: feature.name,
                target_hz: feature.target,
                target_sd_hz: feature.target_sd,
                model_hz: feature.model,
                relative_error: feature.relative_error,
                tolerance_relative,
                pass: feature.relative_error.is_some_and(|error| error.abs() <= tolerance_relative),
                model_scatter_hz: feature.model_scatter,
                model_spread_hz: feature.model_spread,
                below_db: found.map(|found| found.below_db),
                runner_up: runner_up
                    .map(|peak| RunnerUpPeak { frequency_hz: peak.frequency_hz, below_db: peak.below_db }),
                twin_sd_hz: feature.twin_sd,
                missing: feature.missing,
            });
        }
        shown
    }
}

/// Result for a target, before any value of the model is entered.
fn unread_result(aim: &FitTarget, target: &TargetValue) -> FeatureResult {
    FeatureResult {
        name: target.name.clone(),
        kind: aim.feature.reading.kind().to_owned(),
        unit: aim.feature.reading.unit().name.to_owned(),
        target: target.value,
        target_sd: target.sd,
        ..FeatureResult::default()
    }
}

fn relative_error(model: Option<f64>, target: &TargetValue) -> Option<f64> {
    model.map(|model| model / target.value - 1.0).filter(|error| error.is_finite())
}

/// Estimated calibration errors of the cameras of features, as nuisance parameters.
pub(in crate::fit) fn camera_nuisance_results(job: &Job, found: &[CameraEstimate]) -> Vec<NuisanceResult> {
    let nuisance = |found: &CameraEstimate| NuisanceResult {
        recording: job.conditions.get(found.condition).map(|condition| condition.name.clone()),
        name: found.name.to_owned(),
        prior: Some(0.0),
        prior_sd: Some(found.prior_sd),
        estimate: found.estimate,
        lower_95: found.half_95.map(|half| found.estimate - half),
        upper_95: found.half_95.map(|half| found.estimate + half),
    };
    found.iter().map(nuisance).collect()
}

/// A note is written if the standard deviation of a feature over twins is above this factor times the
/// standard deviation of its target.
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

fn sorted_optima(names: &[String], descents: &[LocalDescent]) -> Vec<LocalOptimum> {
    let optimum = |descent: &LocalDescent| LocalOptimum {
        start_cost: descent.start.cost,
        cost: descent.end.cost,
        evaluations: descent.evaluations,
        values: map_names(names, descent.end.values.iter().copied()),
        failure: descent.end.failure.as_ref().map(ToString::to_string),
    };
    let mut optima: Vec<LocalOptimum> = descents.iter().map(optimum).collect();
    math::sort_by_number(&mut optima, |a| a.cost);
    optima
}

/// Result for a held-out target, with the prediction of the best model.
pub(in crate::fit) fn predicted_feature_result(
    aim: &FitTarget,
    target: &TargetValue,
    found: Result<f64, String>,
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
        model,
        relative_error: relative_error(model, target),
        pass: model.is_some_and(near),
        missing: found.err(),
        ..unread_result(aim, target)
    }
}
