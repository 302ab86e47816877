//! Targets of a job: given in it, or measured on its recordings with the deviation that their own noise
//! leaves.

use super::FitError;
use super::camera_calibration::TargetCalibration;
use super::job::{FitTarget, Job, TargetSource, TargetStage};
use crate::feature::{Feature, FeatureValue, MissingValue, ValueComparison, read_assigned_features};
use crate::math;
use crate::recording::Recording;
use crate::recording::quality::measure_quality;
use crate::simulate::twin::{TrackingModel, add_tracking_noise};

/// Copies of a recording with its own noise added once more, from which the deviation of a feature is taken:
/// the estimate of a standard deviation from 12 values is itself good to a fifth.
const NOISE_COPIES: u64 = 12;
/// Least deviation relative to a value that was measured: features of sampled traces are not read better, and
/// the model is no better.
const MIN_SD_RELATIVE: f64 = 1e-3;

/// Targets of a job in the order of its aims; `measured` has one recording for each of the job's conditions
/// that has one.
///
/// A deviation that the job does not state is the scatter of the feature over copies of the recording to
/// which its own tracking noise was added once more.
///
/// # Errors
/// [`FitError::Recordings`], or [`FitError::NotMeasurable`] naming the recording and the feature.
pub fn measure_targets(job: &Job, measured: &[Option<Recording>]) -> Result<Vec<TargetValue>, FitError> {
    let expected = job.conditions.len();
    if measured.len() != expected
        || job.conditions.iter().zip(measured).any(|(c, m)| c.recording.is_some() != m.is_some())
    {
        return Err(FitError::Recordings {
            found: measured.iter().flatten().count(),
            expected: job.conditions.iter().filter(|c| c.recording.is_some()).count(),
        });
    }
    let features = job.features();
    let read = read_recorded_features(&features, measured);
    let unstated =
        job.targets.iter().any(|aim| matches!(aim.source, TargetSource::Measured { least_sd: 0.0, .. }));
    let scatter = if unstated { copy_scatter(&features, measured) } else { vec![None; features.len()] };
    job.targets
        .iter()
        .zip(read)
        .zip(scatter)
        .map(|((aim, read), scatter)| {
            let calibration = job.target_calibration(aim);
            Ok(TargetValue { calibration, ..measure_target(aim, read, scatter, measured)? })
        })
        .collect()
}

fn measure_target(
    aim: &FitTarget,
    read: Result<FeatureValue, MissingValue>,
    scatter: Option<f64>,
    measured: &[Option<Recording>],
) -> Result<TargetValue, FitError> {
    let (name, measure, last) =
        (aim.feature.name.clone(), aim.feature.reading.comparison(), aim.stage == TargetStage::Last);
    let (value, sd) = match aim.source {
        TargetSource::Given { target, sd } => (target, sd),
        TargetSource::Measured { least_sd, least_sd_relative } => {
            let usable = |read: FeatureValue| match read.value {
                value if !value.is_finite() || (value == 0.0 && measure == ValueComparison::Log) => {
                    Err(format!("its value is {value}"))
                }
                _ => Ok(read),
            };
            let read = read
                .map_err(|missing| missing.to_string())
                .and_then(usable)
                .map_err(|problem| not_measurable_error(aim, measured, problem))?;
            let scale =
                if measure == ValueComparison::Log { read.value.abs() } else { target_scale(measure) };
            let stated = least_sd > 0.0 || least_sd_relative > 0.0;
            let noise = if stated { read.sd } else { scatter.or(read.sd) };
            let least =
                if stated { least_sd.max(least_sd_relative * scale) } else { MIN_SD_RELATIVE * scale };
            (read.value, noise.filter(|sd| sd.is_finite()).unwrap_or(0.0).max(least))
        }
    };
    Ok(TargetValue { name, value, sd, scatter: 0.0, measure, last, calibration: None })
}

fn target_scale(measure: ValueComparison) -> f64 {
    match measure {
        ValueComparison::Log => 1.0,
        ValueComparison::Linear { scale } => scale,
    }
}

/// Standard deviation of each feature over noisier copies of the recordings; `None` where fewer than half of
/// them show it.
fn copy_scatter(features: &[Feature], measured: &[Option<Recording>]) -> Vec<Option<f64>> {
    let noise_m: Vec<f64> = measured
        .iter()
        .map(|m| m.as_ref().and_then(|m| measure_quality(m, None).head_x.noise_m).unwrap_or(0.0))
        .collect();
    let copy = |seed: u64| -> Vec<Option<Recording>> {
        let noisier = |(recording, noise_m): (&Option<Recording>, &f64)| {
            let recording = recording.as_ref()?;
            let tracking =
                TrackingModel { metres_per_pixel: *noise_m, noise_px: 1.0, dropout_fraction: 0.0, seed };
            add_tracking_noise(recording, recording.name(), &tracking).ok()
        };
        measured.iter().zip(&noise_m).map(noisier).collect()
    };
    let values = |seed: u64| {
        read_recorded_features(features, &copy(seed))
            .into_iter()
            .map(|read| read.ok().map(|read| read.value))
            .collect()
    };
    let reads: Vec<Vec<Option<f64>>> = (1..=NOISE_COPIES).map(values).collect();
    (0..features.len())
        .map(|at| {
            standard_deviation(
                &reads.iter().filter_map(|read| read.get(at).copied().flatten()).collect::<Vec<f64>>(),
            )
        })
        .collect()
}

/// Every feature of the conditions that were measured; those of the others are missing.
fn read_recorded_features(
    features: &[Feature],
    measured: &[Option<Recording>],
) -> Vec<Result<FeatureValue, MissingValue>> {
    let present: Vec<usize> = (0..measured.len()).filter(|at| measured[*at].is_some()).collect();
    let place = |condition: usize| present.iter().position(|at| *at == condition).unwrap_or(usize::MAX - 1);
    let placed: Vec<Feature> = features
        .iter()
        .map(|feature| Feature { condition: place(feature.condition), ..feature.clone() })
        .collect();
    read_assigned_features(&placed, &[], &measured.iter().flatten().collect::<Vec<_>>())
}

fn standard_deviation(values: &[f64]) -> Option<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let sum: f64 = values.iter().map(|v| math::powi(v - mean, 2)).sum();
    (2 * values.len() as u64 > NOISE_COPIES).then(|| (sum / (values.len() - 1) as f64).sqrt())
}

fn not_measurable_error(aim: &FitTarget, measured: &[Option<Recording>], problem: String) -> FitError {
    let recording = measured
        .get(aim.feature.condition)
        .and_then(Option::as_ref)
        .map_or("the recording", Recording::name)
        .to_owned();
    FitError::NotMeasurable { recording, name: aim.feature.name.clone(), problem }
}

// What a feature should be, and how far from it a value is.

/// Ratio of model and target beyond which a residual no longer grows: two decades, more than any two bounds
/// of a physical feature, so that every value found beats a missing one.
pub(crate) const MAX_RATIO: f64 = 100.0;

/// Least relative standard deviation in the first stage: far from the targets everything is missed by many
/// deviations, and the most precise features would outvote the others.
pub(crate) const FIRST_STAGE_SD_RELATIVE: f64 = 0.05;

/// What a feature should be.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetValue {
    /// Name of the component or feature.
    pub name: String,
    /// Target, in the feature's own SI unit; not zero where it is measured by logarithms.
    pub value: f64,
    /// Its standard deviation, in the same unit; above zero.
    pub sd: f64,
    /// Scatter of the model's value between neighbouring parameters, in the same unit; 0 where it is smooth.
    pub scatter: f64,
    /// How a residual is taken.
    pub measure: ValueComparison,
    /// Whether it counts in the last stage alone.
    pub last: bool,
    /// What is not known of the camera that measured it, where the value depends on it.
    pub calibration: Option<TargetCalibration>,
}

impl TargetValue {
    /// Standard deviation of the residual's numerator, the model's scatter included, in units of
    /// [`Self::reference_size`].
    pub(crate) fn relative_sd(&self) -> f64 {
        math::hypot(self.sd, self.scatter) / self.reference_size()
    }

    /// Distance of a value from the target in units of [`Self::reference_size`], stopped at the logarithm of [`MAX_RATIO`].
    pub(crate) fn distance(&self, value: f64) -> f64 {
        let most = math::ln(MAX_RATIO);
        match self.measure {
            ValueComparison::Log => {
                let ratio = value / self.value;
                if ratio > 0.0 { math::ln(ratio).clamp(-most, most) } else { -most }
            }
            ValueComparison::Linear { scale } => ((value - self.value) / scale).clamp(-most, most),
        }
    }

    /// Distance of one value from another, as [`Self::distance`] has it; zero where no logarithm can be
    /// taken.
    pub(crate) fn distance_between(&self, value: f64, from: f64) -> f64 {
        match self.measure {
            ValueComparison::Log => {
                Some(value / from).filter(|ratio| *ratio > 0.0 && ratio.is_finite()).map_or(0.0, math::ln)
            }
            ValueComparison::Linear { scale } => (value - from) / scale,
        }
    }

    /// The target of the first stage: known to no better than [`FIRST_STAGE_SD_RELATIVE`], and none where it counts in the
    /// last stage alone.
    pub(super) fn first_stage_target(&self) -> Option<Self> {
        let sd = self.sd.max(FIRST_STAGE_SD_RELATIVE * self.reference_size());
        (!self.last).then(|| Self { sd, ..self.clone() })
    }

    /// What a relative change refers to, in the feature's unit: the target's size, or the scale of its
    /// differences.
    pub(crate) fn reference_size(&self) -> f64 {
        match self.measure {
            ValueComparison::Log => self.value.abs(),
            ValueComparison::Linear { scale } => scale,
        }
    }
}
