//! Targets of a job: given in the job, or measured on its recordings. A measured target gets the standard
//! deviation that follows from the noise of the recording.

use super::FitError;
use super::job::{FitTarget, Job, TargetSource, TargetStage};
use crate::feature::{
    Feature, FeatureUnit, FeatureValue, MissingValue, ValueComparison, read_assigned_features,
};
use crate::fit::target_value::TargetValue;
use crate::recording::Recording;
use crate::recording::quality::measure_quality;
use crate::simulate::twin::{TrackingModel, add_tracking_noise};
use portable_math as math;

/// Number of copies of a recording with additional noise from which the standard deviation of a feature is
/// estimated. A standard deviation from 12 values is accurate to a fifth.
const NOISE_COPIES: u64 = 12;
/// Lower limit of the relative standard deviation of a measured target: features of sampled traces and of the
/// model are not more precise.
const MIN_SD_RELATIVE: f64 = 1e-3;

/// Targets in the order of the job; `measured` has one entry per condition, `None` for a condition
/// without a recording.
///
/// If the job states no standard deviation, it is the scatter of the feature over copies of the recording to
/// which tracking noise as large as that of the recording is added.
///
/// # Errors
/// [`FitError::Recordings`], or [`FitError::NotMeasurable`] with the names of the recording and the feature.
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
    let target = |((aim, read), scatter)| {
        let calibration = job.target_calibration(aim);
        Ok(TargetValue { calibration, ..measure_target(aim, read, scatter, measured)? })
    };
    job.targets.iter().zip(read).zip(scatter).map(target).collect()
}

/// Splits the targets of the job into three lists: the fitted entries, the target values of the fitted
/// entries, and the held-out entries with their target values.
pub(super) fn split_held_out(
    job: &Job,
    all: Vec<TargetValue>,
) -> (Vec<FitTarget>, Vec<TargetValue>, Vec<(FitTarget, TargetValue)>) {
    let (held, fitted): (Vec<_>, Vec<_>) =
        job.targets.iter().cloned().zip(all).partition(|(aim, _)| aim.held_out);
    let (aims, targets) = fitted.into_iter().unzip();
    (aims, targets, held)
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
            let read = read.map_err(|missing| not_measurable_error(aim, measured, missing.to_string()))?;
            if !read.value.is_finite() || (read.value == 0.0 && measure == ValueComparison::Log) {
                return Err(not_measurable_error(aim, measured, format!("its value is {}", read.value)));
            }
            let scale = match measure {
                ValueComparison::Log => read.value.abs(),
                ValueComparison::Linear { scale } => scale,
            };
            let stated = least_sd > 0.0 || least_sd_relative > 0.0;
            let clock = measured.get(aim.feature.condition).and_then(Option::as_ref);
            let clock = clock.filter(|_| aim.feature.reading.unit() == FeatureUnit::HERTZ);
            let with_clock = |sd| clock.map_or(sd, |recording| recording.add_clock_sd(read.value, sd));
            let noise = if stated { read.sd } else { scatter.map(with_clock).or(read.sd) };
            let least =
                if stated { least_sd.max(least_sd_relative * scale) } else { MIN_SD_RELATIVE * scale };
            (read.value, noise.filter(|sd| sd.is_finite()).unwrap_or(0.0).max(least))
        }
    };
    Ok(TargetValue { name, value, sd, scatter: 0.0, measure, last, calibration: None })
}

/// Standard deviation of each feature over copies of the recordings with additional noise; `None` if at most
/// half of the copies show the feature.
fn copy_scatter(features: &[Feature], measured: &[Option<Recording>]) -> Vec<Option<f64>> {
    let noise = |m: &Option<Recording>| measure_quality(m.as_ref()?, None).head_x.noise_m;
    let noise_m: Vec<f64> = measured.iter().map(|m| noise(m).unwrap_or(0.0)).collect();
    let copy = |seed: u64| -> Vec<Option<Recording>> {
        let noisier = |(recording, noise_m): (&Option<Recording>, &f64)| {
            let recording = recording.as_ref()?;
            let tracking =
                TrackingModel { metres_per_pixel: *noise_m, noise_px: 1.0, dropout_fraction: 0.0, seed };
            add_tracking_noise(recording, recording.name(), &tracking).ok()
        };
        measured.iter().zip(&noise_m).map(noisier).collect()
    };
    let reads: Vec<_> =
        (1..=NOISE_COPIES).map(|seed| read_recorded_features(features, &copy(seed))).collect();
    let values = |at: usize| reads.iter().filter_map(move |read| Some(read.get(at)?.as_ref().ok()?.value));
    (0..features.len()).map(|at| standard_deviation(&values(at).collect::<Vec<f64>>())).collect()
}

/// Computes all features on the recordings; features of conditions without a recording are missing.
fn read_recorded_features(
    features: &[Feature],
    measured: &[Option<Recording>],
) -> Vec<Result<FeatureValue, MissingValue>> {
    let present: Vec<usize> = (0..measured.len()).filter(|at| measured[*at].is_some()).collect();
    let place = |condition: usize| present.iter().position(|at| *at == condition).unwrap_or(usize::MAX - 1);
    let moved = |feature: &Feature| Feature { condition: place(feature.condition), ..feature.clone() };
    let placed: Vec<Feature> = features.iter().map(moved).collect();
    read_assigned_features(&placed, &[], &measured.iter().flatten().collect::<Vec<_>>())
}

fn standard_deviation(values: &[f64]) -> Option<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let sum: f64 = values.iter().map(|v| math::powi(v - mean, 2)).sum();
    (2 * values.len() as u64 > NOISE_COPIES).then(|| (sum / (values.len() - 1) as f64).sqrt())
}

fn not_measurable_error(aim: &FitTarget, measured: &[Option<Recording>], problem: String) -> FitError {
    let recording = measured.get(aim.feature.condition).and_then(Option::as_ref);
    let recording = recording.map_or("the recording", Recording::name).to_owned();
    FitError::NotMeasurable { recording, name: aim.feature.name.clone(), problem }
}
