//! From what a fit found to its result.

use super::{
    ComponentResult, Evaluations, FeatureResult, FitResult, NuisanceResult, Optimum, ParameterResult,
    RunnerUp, Status,
};
use crate::feature::Value;
use crate::fit::cameras::{CameraEstimate, Cameras};
use crate::fit::context::Context;
use crate::fit::evaluation::{Evaluation, Observed};
use crate::fit::gate::Gate;
use crate::fit::information::Z_95;
use crate::fit::job::{Aim, Job};
use crate::fit::ledger::Ledger;
use crate::fit::search::{Descent, Searched};
use crate::fit::target::Target;
use crate::fit::uncertainty::{CHI_SQUARED_95, Interval, Uncertainty};
use crate::math;
use crate::text::short;
use std::collections::BTreeMap;

/// Everything that goes into a result.
pub(in crate::fit) struct Findings<'a> {
    pub job: &'a Job,
    /// Aims that were fitted, in the order of the targets.
    pub aims: &'a [Aim],
    pub targets: &'a [Target],
    pub found: &'a Uncertainty,
    pub searched: &'a Searched,
    pub gate: Gate,
    /// Aims that were held out, with what the best model shows of them.
    pub held_out: Vec<(Aim, Target, Result<f64, String>)>,
    pub status: Status,
    pub synthetic: bool,
    pub context: &'a Context<'a>,
}

impl Findings<'_> {
    /// The result; `reads` are the features of the best model, read once more.
    pub(in crate::fit) fn into_result(self, ledger: &Ledger, reads: &[Option<Value>]) -> FitResult {
        let names = self.job.parameter_names();
        let sensitivities = self
            .targets
            .iter()
            .zip(&self.found.sensitivities)
            .map(|(t, row)| (t.name.clone(), names.iter().cloned().zip(row.iter().copied()).collect()));
        let correlation = |row: &Vec<Option<f64>>| {
            names.iter().zip(row).filter_map(|(name, r)| Some((name.clone(), (*r)?))).collect()
        };
        let shown = Shown::of(self.aims, self.targets, &self.found.twin_sd, &self.found.best, reads);
        FitResult {
            title: self.job.title.clone(),
            status: self.status,
            misfit: None,
            nuisances: camera_nuisances(self.job, &self.found.cameras),
            starts: Vec::new(),
            parameters: names.iter().cloned().zip(self.found.intervals.iter().map(parameter)).collect(),
            components: shown.components,
            features: shown.features,
            held_out: self.held_out.iter().map(predicted).collect(),
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
            waterfall: waterfall(&names, &self.searched.descents),
            sensitivities: sensitivities.collect(),
            evaluations: Evaluations { total: ledger.run().len(), failed: ledger.failures() },
            synthetic: self.synthetic,
            notes: self.notes(),
            seed: self.job.search.seed,
            fingerprint: self.context.fingerprint.to_owned(),
            version: self.context.version.to_owned(),
            gate: self.gate,
        }
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = self.found.notes.clone();
        notes.extend(self.gate.notes.iter().cloned());
        notes.extend(
            self.found.twin_sd.iter().zip(self.targets).filter_map(|(sd, target)| noisier(target, (*sd)?)),
        );
        if self.synthetic {
            notes.push("the recording is synthetic: no camera took it".to_owned());
        }
        notes
    }
}

/// What the best model shows of the aims that were fitted, next to their targets.
pub(in crate::fit) struct Shown {
    pub components: Vec<ComponentResult>,
    pub features: Vec<FeatureResult>,
}

impl Shown {
    /// Of aims, their targets and deviations over twins in one order; `reads` are the features of the best
    /// model, read once more.
    pub(in crate::fit) fn of(
        aims: &[Aim],
        targets: &[Target],
        twin_sd: &[Option<f64>],
        best: &Evaluation,
        reads: &[Option<Value>],
    ) -> Self {
        let cameras = &Cameras::of(targets, &best.features);
        let met = |(at, (aim, target))| {
            let twin_sd = twin_sd.get(at).copied().flatten();
            Met { at, aim, target, best, cameras, twin_sd }
        };
        let met: Vec<Met> = aims.iter().zip(targets).enumerate().map(met).collect();
        Self {
            components: met.iter().filter_map(|met| met.component(reads)).collect(),
            features: met
                .iter()
                .filter(|met| met.aim.tolerance_relative.is_none())
                .map(Met::feature)
                .collect(),
        }
    }
}

/// What was estimated of the cameras of features.
pub(in crate::fit) fn camera_nuisances(job: &Job, found: &[CameraEstimate]) -> Vec<NuisanceResult> {
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
const NOISIER: f64 = 2.0;

fn noisier(target: &Target, twin_sd: f64) -> Option<String> {
    (twin_sd > NOISIER * target.sd).then(|| {
        format!(
            "`{}` scatters by {} over twins of the best model, more than its stated deviation of {}: noise alone moves it so far",
            target.name,
            short(twin_sd),
            short(target.sd)
        )
    })
}

fn parameter(i: &Interval) -> ParameterResult {
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

fn waterfall(names: &[String], descents: &[Descent]) -> Vec<Optimum> {
    let optimum = |descent: &Descent| Optimum {
        start_cost: descent.start.cost,
        cost: descent.end.cost,
        evaluations: descent.evaluations,
        values: names.iter().cloned().zip(descent.end.values.iter().copied()).collect::<BTreeMap<_, _>>(),
        failure: descent.end.failure.as_ref().map(ToString::to_string),
    };
    let mut optima: Vec<Optimum> = descents.iter().map(optimum).collect();
    optima.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    optima
}

/// A held-out aim, with what the best model predicts.
pub(in crate::fit) fn predicted((aim, target, found): &(Aim, Target, Result<f64, String>)) -> FeatureResult {
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
struct Met<'a> {
    at: usize,
    aim: &'a Aim,
    target: &'a Target,
    best: &'a Evaluation,
    cameras: &'a Cameras,
    twin_sd: Option<f64>,
}

impl Met<'_> {
    fn model(&self) -> Option<f64> {
        self.best.features.get(self.at).and_then(Observed::value)
    }

    /// What the camera shows of the model's value.
    fn shown(&self) -> Option<f64> {
        self.cameras.shown_value(self.target, self.best.features.get(self.at)?)
    }

    fn spread(&self) -> Option<f64> {
        let spread = self.best.features.get(self.at)?.observation()?.spread;
        (spread > 0.0).then_some(spread)
    }

    fn scatter(&self) -> Option<f64> {
        (self.target.scatter > 0.0).then_some(self.target.scatter)
    }

    fn missing(&self) -> Option<String> {
        match (self.best.features.get(self.at), &self.best.failure) {
            (Some(Observed::Missing(why)), _) => Some(why.clone()),
            (Some(Observed::Value(_)), _) => None,
            (None, failure) => failure.as_ref().map(ToString::to_string),
        }
    }

    fn relative_error(&self) -> Option<f64> {
        self.shown().map(|model| model / self.target.value - 1.0).filter(|error| error.is_finite())
    }

    fn component(&self, reads: &[Option<Value>]) -> Option<ComponentResult> {
        let tolerance_relative = self.aim.tolerance_relative?;
        let runner_up = reads.get(self.at).and_then(|read| read.as_ref()?.runner_up);
        Some(ComponentResult {
            name: self.target.name.clone(),
            target_hz: self.target.value,
            target_sd_hz: self.target.sd,
            model_hz: self.model(),
            relative_error: self.relative_error(),
            tolerance_relative,
            pass: self.relative_error().is_some_and(|error| error.abs() <= tolerance_relative),
            model_scatter_hz: self.scatter(),
            model_spread_hz: self.spread(),
            below_db: self.best.features.get(self.at).and_then(|f| Some(f.observation()?.below_db)),
            runner_up: runner_up
                .map(|peak| RunnerUp { frequency_hz: peak.frequency_hz, below_db: peak.below_db }),
            twin_sd_hz: self.twin_sd,
            missing: self.missing(),
        })
    }

    fn feature(&self) -> FeatureResult {
        FeatureResult {
            name: self.target.name.clone(),
            kind: self.aim.feature.reading.kind().to_owned(),
            unit: self.aim.feature.reading.unit().name.to_owned(),
            target: self.target.value,
            target_sd: self.target.sd,
            model: self.model(),
            model_seen: self.target.calibration.and_then(|_| self.shown()),
            relative_error: self.relative_error(),
            pass: self
                .shown()
                .is_some_and(|model| (model - self.target.value).abs() <= Z_95 * self.target.sd),
            model_scatter: self.scatter(),
            model_spread: self.spread(),
            twin_sd: self.twin_sd,
            missing: self.missing(),
        }
    }
}
