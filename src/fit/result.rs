//! The result of a fit, `result.json`.

mod assembly;
mod validation;

use super::evaluation::FailureReason;
use super::findings::FitFinding;
use super::identifiability::Identifiability;
use super::job::{FreeParameter, Job};
use super::law::LawComparison;
use super::linear_model::ParameterCombination;
use super::misfit::{TraceMisfit, far_from_priors, unexplained_headline};
use super::uncertainty::ParameterVerdict;
use crate::model::parameter_spread::ParameterSpread;
use crate::model::parameters::describe_parameters;
use crate::model::{Linkage, Pose};
use crate::stability::chatter::ChatterSummary;
use crate::text::{pluralise, text_sha256};
pub(super) use assembly::{FitFindings, ModelledTargets, camera_nuisance_results, predicted_feature_result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Outcome of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FitStatus {
    /// The search was completed: further steps from the best point did not lower the cost.
    Converged,
    /// The allowed evaluations were used up before the search was completed.
    BudgetExhausted,
    /// The fit was stopped from outside and can be resumed.
    Interrupted,
    /// The model failed at every evaluated point, or a trace fit did not complete its last stage.
    Failed,
}

impl FitStatus {
    /// Name of the status in files and summaries.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::BudgetExhausted => "budget-exhausted",
            Self::Interrupted => "interrupted",
            Self::Failed => "failed",
        }
    }

    /// Whether the search came to its end, so that it can say whether the model explains the recordings.
    pub(crate) fn has_ended(self) -> bool {
        !matches!(self, Self::Interrupted | Self::BudgetExhausted)
    }
}

/// Result for one parameter, in its own SI unit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ParameterResult {
    /// Best value.
    pub estimate: f64,
    /// Lower end of the 95 % interval, which contains the intervals of all methods; `None` if it is open at
    /// this end.
    pub lower_95: Option<f64>,
    /// Upper end of the 95 % interval, which contains the intervals of all methods; `None` if it is open at
    /// this end.
    pub upper_95: Option<f64>,
    /// Verdict: whether the fit identifies the parameter.
    pub verdict: ParameterVerdict,
    /// In a fit of features, the 95 % interval by the linear model at the estimates, if this model determines
    /// the parameter. In a trace fit, the 95 % interval from curvature, scatter of the segments and profile.
    pub linear_95: Option<[f64; 2]>,
    /// Values below and above the estimate at which the profile of the cost crosses the threshold; `None`
    /// without a crossing within the bounds.
    pub profile_95: [Option<f64>; 2],
    /// 95 % interval from refits to twins (recordings simulated with the best model).
    pub bootstrap_95: Option<[f64; 2]>,
    /// Values of the parameter, each with the lowest cost over the other parameters.
    pub profile: Vec<(f64, f64)>,
    /// Reasons why the parameter is not identified, one sentence each. In a fit of features, only reasons
    /// that do not follow from the other numbers of the result are listed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reasons: Vec<String>,
}

impl NuisanceResult {
    /// The quantity in words, with its recording if it has one.
    pub(crate) fn describe(&self) -> String {
        let of = self.recording.as_ref().map_or(String::new(), |recording| format!(" of `{recording}`"));
        format!("{}{of}", describe_parameters([self.name.as_str()]))
    }
}

impl ParameterResult {
    /// Whether the 95 % interval has both ends and the linear model determines the parameter.
    pub(crate) fn has_interval(&self) -> bool {
        self.linear_95.is_some() && self.lower_95.is_some() && self.upper_95.is_some()
    }
}

/// Nuisance parameter: a calibration error of a camera, or a constant of the scene, that is estimated
/// together with the parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NuisanceResult {
    /// Recording that the camera filmed; `None` for a constant of the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording: Option<String>,
    /// Key of the constant in the scene file, or a camera error: `tilt_rad`, `scale_relative`, `offset_x_m`,
    /// `offset_drop_m`, `curvature_per_m`, `tip_along_lip_m`, `tip_across_lip_m`,
    /// `head_above_hinge_m`, `clock_s` or a drift.
    pub name: String,
    /// Mean of the prior, in the unit that `name` states; `None` if nothing is known before the fit.
    pub prior: Option<f64>,
    /// Standard deviation of the prior, in the unit that `name` states; `None` without a prior.
    pub prior_sd: Option<f64>,
    /// Estimated value, in the unit that `name` states.
    pub estimate: f64,
    /// Lower end of the 95 % interval; `None` if unknown.
    pub lower_95: Option<f64>,
    /// Upper end of the 95 % interval; `None` if unknown.
    pub upper_95: Option<f64>,
}

/// A segment of a recording over which the fitted model was run, with its fitted starting state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FittedSegment {
    /// Name of the recording in the job.
    pub recording: String,
    /// Index of the first frame of the segment.
    pub first_frame: usize,
    /// Index of the frame after the last frame of the segment.
    pub end_frame: usize,
    /// Whether the segment fits as well as noise allows.
    pub fits: bool,
    /// Time of the start on the clock of the drive, s.
    pub time_s: f64,
    /// State at the start.
    #[serde(flatten)]
    pub start: SegmentStart,
}

/// State of the model at the start of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum SegmentStart {
    /// State of a blade.
    Blade {
        /// Angle of the neck, rad.
        neck_angle_rad: f64,
        /// Angle of the lip, rad.
        lip_angle_rad: f64,
        /// Angular velocity of the neck, rad/s.
        neck_rate_rad_per_s: f64,
        /// Angular velocity of the lip, rad/s.
        lip_rate_rad_per_s: f64,
    },
    /// State of a slider.
    Slider {
        /// Position of the slider minus that of its head, m.
        deflection_m: f64,
        /// Rate of change of the deflection, m/s.
        deflection_rate_m_per_s: f64,
    },
}

impl SegmentStart {
    /// The pose as the state of a blade or slider.
    pub(crate) fn new(pose: &Pose, linkage: &Linkage) -> Self {
        let Pose { theta, phi, theta_rate, phi_rate } = *pose;
        if linkage.is_slider() {
            let [deflection_m, deflection_rate_m_per_s] = pose.slider_deflection();
            return Self::Slider { deflection_m, deflection_rate_m_per_s };
        }
        Self::Blade {
            neck_angle_rad: theta,
            lip_angle_rad: phi,
            neck_rate_rad_per_s: theta_rate,
            lip_rate_rad_per_s: phi_rate,
        }
    }
}

impl FittedSegment {
    /// Angles and rates of the links at the start.
    pub(crate) fn pose(&self) -> Pose {
        match self.start {
            SegmentStart::Blade {
                neck_angle_rad: theta,
                lip_angle_rad: phi,
                neck_rate_rad_per_s: theta_rate,
                lip_rate_rad_per_s: phi_rate,
            } => Pose { theta, phi, theta_rate, phi_rate },
            SegmentStart::Slider { deflection_m, deflection_rate_m_per_s } => {
                Pose::of_slider(deflection_m, deflection_rate_m_per_s)
            }
        }
    }
}

/// The spectral peak of the model that is the second choice for a component.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RunnerUpPeak {
    /// Frequency of the peak, Hz.
    pub frequency_hz: f64,
    /// Level of the strongest peak of the component's band relative to this peak, dB.
    pub below_db: f64,
}

/// Result of one local search; it is one step in the waterfall plot of the costs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LocalOptimum {
    /// Cost at the start of the search.
    pub start_cost: f64,
    /// Cost at the end of the search.
    pub cost: f64,
    /// Number of evaluations in the search.
    pub evaluations: usize,
    /// Parameter values at the end of the search, in SI units.
    pub values: BTreeMap<String, f64>,
    /// Failure of the model at the end of the search, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

/// Target and model frequency of a component.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ComponentResult {
    /// Name of the component in the job.
    pub name: String,
    /// Measured or published frequency, Hz.
    pub target_hz: f64,
    /// Standard deviation of the target, Hz.
    pub target_sd_hz: f64,
    /// Frequency of the model, Hz; `None` if the model does not show the component.
    pub model_hz: Option<f64>,
    /// `model / target - 1`.
    pub relative_error: Option<f64>,
    /// Largest allowed absolute value of the relative error.
    pub tolerance_relative: f64,
    /// Whether the relative error is within the tolerance.
    pub pass: bool,
    /// Scatter of the model's frequency between neighbouring parameter values, Hz; it is added to the
    /// standard deviation of the target.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_scatter_hz: Option<f64>,
    /// Standard deviation of the model's frequency over its starting states, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_spread_hz: Option<f64>,
    /// Level of the strongest peak of the band relative to the model's peak that is assigned to the
    /// component, dB; 0 if the assigned peak is the strongest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub below_db: Option<f64>,
    /// The peak of the model that is the second choice for the component.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runner_up: Option<RunnerUpPeak>,
    /// Standard deviation of the frequency over twins of the best model, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub twin_sd_hz: Option<f64>,
    /// Reason why the model does not show the component, if it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missing: Option<String>,
}

/// Target and model value of a feature other than a component.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FeatureResult {
    /// Name of the feature in the job.
    pub name: String,
    /// Kind of the feature in the job.
    pub kind: String,
    /// Unit of target and model.
    pub unit: String,
    /// Measured or published value.
    pub target: f64,
    /// Standard deviation of the target.
    pub target_sd: f64,
    /// Value of the model; `None` if the model has no value.
    pub model: Option<f64>,
    /// Value of the model with the estimated camera errors; `None` if there are no camera errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_seen: Option<f64>,
    /// `model_seen / target - 1`, or `model / target - 1` without camera errors.
    pub relative_error: Option<f64>,
    /// Whether `model_seen` (without camera errors: `model`) is within the 95 % interval of the target. For a
    /// held-out feature the interval includes the calibration errors of the camera.
    pub pass: bool,
    /// Scatter of the model's value between neighbouring parameter values; it is added to the standard
    /// deviation of the target.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_scatter: Option<f64>,
    /// Standard deviation of the model's value over its starting states.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_spread: Option<f64>,
    /// Standard deviation of the feature over twins of the best model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub twin_sd: Option<f64>,
    /// Reason why the model has no value of the feature, if it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missing: Option<String>,
}

impl FeatureResult {
    /// Value of the model as the camera shows it: with camera errors if they are estimated.
    pub(crate) fn value_seen(&self) -> Option<f64> {
        self.model_seen.or(self.model)
    }
}

/// Counts of evaluations of the model, or of iterates in a trace fit.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct EvaluationCounts {
    /// Number of evaluations, including replayed ones.
    pub total: usize,
    /// Number of failed evaluations by reason.
    pub failed: BTreeMap<FailureReason, usize>,
}

/// The result of a fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitResult {
    /// Title of the job.
    pub title: String,
    /// Outcome of the fit.
    pub status: FitStatus,
    /// How well the model explains the traces; `None` in a fit of features.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub misfit: Option<TraceMisfit>,
    /// Why the model does not explain the traces, and what would explain them; empty if it does explain
    /// them, and in a fit of features.
    #[serde(default)]
    pub findings: Vec<FitFinding>,
    /// Results of the parameters, by key in the scene file preceded by its table.
    pub parameters: BTreeMap<String, ParameterResult>,
    /// Which law of friction the traces support; `None` if laws were not compared, as in a fit of features.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<LawComparison>,
    /// Where and why the fitted blade or slider of the first condition chatters; `None` if the model does not
    /// explain the recordings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chatter: Option<ChatterSummary>,
    /// Estimated calibration errors of cameras and freed constants.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub nuisances: Vec<NuisanceResult>,
    /// Segments of a trace fit with their fitted starting states.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub segments: Vec<FittedSegment>,
    /// Components in job order.
    pub components: Vec<ComponentResult>,
    /// Other features in job order.
    pub features: Vec<FeatureResult>,
    /// Predictions for components and features that were held out of the fit.
    pub held_out: Vec<FeatureResult>,
    /// Number of directions in the parameter space that the fit determines.
    pub rank: usize,
    /// Condition number of the Jacobian: ratio of the largest to the smallest singular value; `None` if it is
    /// infinite.
    pub condition: Option<f64>,
    /// Products of powers of the parameters that the features determine or leave undetermined.
    pub combinations: Vec<ParameterCombination>,
    /// Correlations of the estimates by the linear model, for the parameters that it determines.
    pub correlations: BTreeMap<String, BTreeMap<String, f64>>,
    /// Cost at the estimates: in a fit of features as defined in `fit::objective`, in a trace fit the cost of
    /// the segments and priors.
    pub cost: f64,
    /// Rise in cost at the ends of a 95 % interval.
    pub threshold: f64,
    /// Number of refits to twins of the best model.
    pub twins: usize,
    /// Identifiability before the search.
    pub gate: Identifiability,
    /// Results of the local searches in ascending order of cost.
    pub waterfall: Vec<LocalOptimum>,
    /// `d ln feature / d ln parameter` at the estimates, by feature and parameter; `None` if it is undefined.
    pub sensitivities: BTreeMap<String, BTreeMap<String, Option<f64>>>,
    /// Evaluations of the model.
    pub evaluations: EvaluationCounts,
    /// Whether any fitted recording was simulated rather than filmed.
    pub synthetic: bool,
    /// Remarks for the reader, one sentence each.
    pub notes: Vec<String>,
    /// Seed of the search.
    pub seed: u64,
    /// SHA-256 hash of problem, data and version of the program, in hexadecimal.
    pub fingerprint: String,
    /// Version of the program.
    pub version: String,
}

/// Contents of `result.json`: a result, and two keys that are computed from it.
#[derive(Serialize)]
struct ResultFile<'a> {
    /// Whether the model explains the recordings; `None` if the search did not end.
    explained: Option<bool>,
    /// `"free"` or `"held"`: the value of [`FitResult::constants_word`].
    constants: &'static str,
    #[serde(flatten)]
    result: &'a FitResult,
}

/// Error for a file that is not a valid result.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}: not the result of a fit: {problem}; run `wiperlab fit` again")]
pub struct ResultError {
    /// Name of the result file as the user gave it.
    pub file: String,
    /// Description of the problem, with line and column.
    pub problem: String,
}

impl FitResult {
    /// The result as the text of `result.json`. Keys have a fixed order; the last key is the hash of the
    /// text.
    #[must_use]
    pub fn to_json(&self) -> String {
        // serialisation cannot fail: keys are strings, and numbers that are not finite become `null`
        let file = ResultFile {
            explained: self.status.has_ended().then(|| self.explains_recordings()),
            constants: self.constants_word(),
            result: self,
        };
        append_hash(&serde_json::to_string_pretty(&file).unwrap_or_default())
    }

    /// Reads a `result.json`; `file` is its name in error messages.
    ///
    /// # Errors
    /// [`ResultError`] with the place of a syntax error, or if the hash does not match the text.
    pub fn parse(file: &str, text: &str) -> Result<Self, ResultError> {
        let refused = |problem| ResultError { file: file.to_owned(), problem };
        let result = serde_json::from_str(text).map_err(|e| refused(e.to_string()))?;
        check_hash(text).map_err(refused)?;
        Ok(result)
    }

    /// Estimates of the parameters, in job order.
    pub(crate) fn parameter_estimates(&self, job: &Job) -> Vec<f64> {
        let estimate = |p: &FreeParameter| self.parameters.get(&p.name).map_or(f64::NAN, |p| p.estimate);
        job.parameters.iter().map(estimate).collect()
    }

    /// Intervals and correlations of the parameters that are identified, and intervals of the constants of
    /// the scene that the fit freed. Constants count as uncorrelated with all others.
    #[must_use]
    pub fn parameter_spread(&self) -> ParameterSpread {
        let half = |estimate: f64, lower: Option<f64>, upper: Option<f64>| {
            Some((estimate - lower?).max(upper? - estimate)).filter(|half| half.is_finite())
        };
        let own = self.parameters.iter().map(|(name, found)| {
            let half_95 = half(found.estimate, found.lower_95, found.upper_95);
            (name.clone(), found.estimate, half_95.filter(|_| found.verdict == ParameterVerdict::Identified))
        });
        let constants = self.nuisances.iter().filter(|nuisance| nuisance.recording.is_none());
        let constants =
            constants.map(|n| (n.name.clone(), n.estimate, half(n.estimate, n.lower_95, n.upper_95)));
        let all: Vec<(String, f64, Option<f64>)> = own.chain(constants).collect();
        let correlation =
            |a: &str, b: &str| match self.parameters.contains_key(a) && self.parameters.contains_key(b) {
                true => self.correlations.get(a)?.get(b).copied(),
                false => Some(0.0),
            };
        let row = |a: &str| all.iter().map(|(b, ..)| correlation(a, b)).collect();
        ParameterSpread {
            names: all.iter().map(|(name, ..)| name.clone()).collect(),
            estimates: all.iter().map(|(_, estimate, _)| *estimate).collect(),
            halves_95: all.iter().map(|(.., half)| *half).collect(),
            correlations: all.iter().map(|(name, ..)| row(name)).collect(),
        }
    }

    /// `"free"` if the fit estimated constants of the scene within priors, `"held"` if it took all as exact.
    pub(crate) fn constants_word(&self) -> &'static str {
        if self.nuisances.iter().any(|nuisance| nuisance.recording.is_none()) { "free" } else { "held" }
    }

    /// Whether the estimates rest on data: in a trace fit, whether any segment could be started.
    pub(crate) fn has_estimates(&self) -> bool {
        self.misfit.as_ref().is_none_or(TraceMisfit::has_segments)
    }

    /// Whether every component is within its tolerance.
    #[must_use]
    pub fn components_pass(&self) -> bool {
        self.components.iter().all(|component| component.pass)
    }

    /// The verdict in words: the first sentence, without a full stop, and the reasons that it leaves out.
    #[must_use]
    pub fn describe_verdict(&self) -> (String, Vec<String>) {
        let far = far_from_priors(&self.nuisances);
        match &self.misfit {
            Some(misfit) => misfit.describe_verdict(self.status.has_ended()),
            None if far.is_empty() => {
                let met = self.components.iter().map(|c| c.pass).chain(self.features.iter().map(|f| f.pass));
                (describe_met_targets(met), Vec::new())
            }
            None => (unexplained_headline(&far), Vec::new()),
        }
    }

    /// Whether the model explains the recordings. In a fit of features, a camera that is far from its prior
    /// is evidence against the model.
    #[must_use]
    pub fn explains_recordings(&self) -> bool {
        match &self.misfit {
            Some(misfit) => misfit.explained,
            None => far_from_priors(&self.nuisances).is_empty(),
        }
    }
}

/// Sentence on the number of targets that the model meets, without a full stop: "The model meets all 3
/// targets".
pub(crate) fn describe_met_targets(met: impl IntoIterator<Item = bool>) -> String {
    let met: Vec<bool> = met.into_iter().collect();
    let (count, all) = (met.iter().filter(|met| **met).count(), met.len());
    match (count, all) {
        (1, 1) => "The model meets its one target".to_owned(),
        (count, all) if count == all => format!("The model meets all {all} targets"),
        _ => format!("The model meets {count} of {all} {}", pluralise("target", all)),
    }
}

// A result file contains the hash of its own text, which reveals any accidental change.

/// Last key of the file.
const HASH_KEY: &str = "\n  \"sha256\": \"";
const HASH_DIGITS: usize = 64;
/// Number of digits of a hash in an error message.
const SHORT_HASH_DIGITS: usize = 12;

/// Appends the hash of a pretty-printed JSON object as its last key. The hash is the SHA-256 of the whole
/// text in which the digits of the hash are replaced by zeros.
pub(super) fn append_hash(object: &str) -> String {
    let open = object.trim_end().trim_end_matches('}').trim_end();
    let with = |digits: &str| format!("{open},{HASH_KEY}{digits}\"\n}}\n");
    with(&text_sha256(with(&"0".repeat(HASH_DIGITS))))
}

/// Checks that the hash at the end of a text matches the text.
///
/// # Errors
/// A description of the mismatch.
pub(super) fn check_hash(text: &str) -> Result<(), String> {
    let line_feeds = text.replace("\r\n", "\n");
    let Some(at) = line_feeds.rfind(HASH_KEY) else {
        return Err("found no `sha256` as its last key, expected the SHA-256 of the file itself".to_owned());
    };
    let (before, rest) = line_feeds.split_at(at + HASH_KEY.len());
    let (carried, after) = rest.split_once('"').unwrap_or((rest, ""));
    let found = text_sha256(format!("{before}{}\"{after}", "0".repeat(HASH_DIGITS)));
    if found == carried {
        return Ok(());
    }
    let [found, carried] =
        [&found, carried].map(|hash| hash.chars().take(SHORT_HASH_DIGITS).collect::<String>());
    Err(format!(
        "found SHA-256 {found}..., expected {carried}... as its last key says: the file was changed after the fit wrote it"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::chatter::{ChatterEstimate, ChatterNumber};

    fn sample() -> FitResult {
        let parameter = |estimate, verdict| ParameterResult {
            estimate,
            lower_95: Some(0.25),
            upper_95: None,
            verdict,
            linear_95: None,
            profile_95: [Some(0.25), None],
            bootstrap_95: Some([0.3, 0.7]),
            profile: vec![(0.5, 2.5), (0.6, 3.5)],
            reasons: Vec::new(),
        };
        let parameters = [
            ("friction.c", parameter(0.5, ParameterVerdict::OpenAbove)),
            ("friction.a", parameter(0.75, ParameterVerdict::AtBound)),
        ];
        FitResult {
            title: "t".to_owned(),
            status: FitStatus::BudgetExhausted,
            misfit: None,
            findings: vec![],
            law: None,
            chatter: Some(ChatterSummary {
                numbers: BTreeMap::from([(
                    ChatterNumber::End,
                    ChatterEstimate { value: 0.3, half_95: None },
                )]),
                ..ChatterSummary::default()
            }),
            nuisances: vec![],
            segments: vec![],
            parameters: parameters.into_iter().map(|(name, p)| (name.to_owned(), p)).collect(),
            components: vec![ComponentResult {
                name: "low".to_owned(),
                target_hz: 80.0,
                target_sd_hz: 0.5,
                model_hz: None,
                relative_error: None,
                tolerance_relative: 0.02,
                pass: false,
                model_scatter_hz: None,
                model_spread_hz: None,
                below_db: None,
                runner_up: None,
                twin_sd_hz: None,
                missing: Some("no peak".to_owned()),
            }],
            features: vec![],
            held_out: vec![],
            rank: 1,
            condition: None,
            combinations: vec![],
            correlations: BTreeMap::new(),
            cost: 2.5,
            threshold: 3.84,
            twins: 0,
            gate: Identifiability::default(),
            waterfall: vec![],
            sensitivities: BTreeMap::new(),
            evaluations: EvaluationCounts {
                total: 7,
                failed: BTreeMap::from([(FailureReason::Ended(crate::simulate::RunStatus::Jammed), 2)]),
            },
            synthetic: true,
            notes: vec!["n".to_owned()],
            seed: 1,
            fingerprint: "f".to_owned(),
            version: "0.1.0".to_owned(),
        }
    }

    #[test]
    fn the_file_has_the_keys_of_the_contract() {
        let text = sample().to_json();
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["status"], "budget-exhausted");
        assert_eq!(value["parameters"]["friction.a"]["verdict"], "at-bound");
        assert_eq!(value["parameters"]["friction.c"]["verdict"], "open-above");
        assert!(
            value["parameters"]["friction.a"]["upper_95"].is_null()
                && value["components"][0]["model_hz"].is_null()
        );
        assert_eq!(value["evaluations"], serde_json::json!({"total": 7, "failed": {"jammed": 2}}));
        assert!(text.find("friction.a").unwrap() < text.find("friction.c").unwrap());
        assert!(!sample().components_pass());
    }

    #[test]
    fn it_is_read_back() {
        assert_eq!(FitResult::parse("r", &sample().to_json()).unwrap(), sample());
        assert!(
            FitResult::parse("r", "{}")
                .unwrap_err()
                .to_string()
                .starts_with("r: not the result of a fit: missing field `title` at line 1")
        );
    }

    #[test]
    fn a_text_carries_its_own_hash_and_no_other_text_does() {
        let text = append_hash("{\n  \"a\": 1.5,\n  \"b\": []\n}");
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert!(value["a"] == 1.5 && value["sha256"].as_str().unwrap().len() == HASH_DIGITS);
        assert_eq!(check_hash(&text), Ok(()));
        assert_eq!(check_hash(&text.replace('\n', "\r\n")), Ok(()), "a checkout changes line ends");
        assert!(check_hash("{\n  \"a\": 1.5\n}\n").unwrap_err().contains("found no `sha256`"));
        let key = text.find(HASH_KEY).map_or(0..0, |at| at..at + HASH_KEY.len());
        let digits = text.bytes().enumerate().filter(|(at, byte)| byte.is_ascii_digit() && !key.contains(at));
        for (at, byte) in digits {
            let mut other = text.clone();
            other.replace_range(at..=at, if byte == b'9' { "8" } else { "9" });
            assert!(check_hash(&other).unwrap_err().contains("changed after the fit wrote it"), "{other}");
        }
    }
}
