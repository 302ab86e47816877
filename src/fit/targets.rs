//! Targets of a job: given in it, or measured on its recordings with the deviation that their own noise
//! leaves.

use super::error::FitError;
use super::job::{Aim, Job, Source, When};
use super::target::Target;
use crate::feature::{Feature, Measure, Missing, Value, read_all_assigned};
use crate::math;
use crate::recording::Recording;
use crate::recording::quality::quality;
use crate::twin::{Tracking, track};

/// Copies of a recording with its own noise added once more, from which the deviation of a feature is taken:
/// the estimate of a standard deviation from 12 values is itself good to a fifth.
const COPIES: u64 = 12;
/// Least deviation relative to a value that was measured: features of sampled traces are not read better, and
/// the model is no better.
const LEAST_RELATIVE: f64 = 1e-3;

/// Targets of a job in the order of its aims; `measured` has one recording for each of the job's conditions
/// that has one.
///
/// A deviation that the job does not state is the scatter of the feature over copies of the recording to
/// which its own tracking noise was added once more.
///
/// # Errors
/// [`FitError::Recordings`], or [`FitError::NotMeasurable`] naming the recording and the feature.
pub fn targets(job: &Job, measured: &[Option<Recording>]) -> Result<Vec<Target>, FitError> {
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
    let read = read(&features, measured);
    let unstated = job.aims.iter().any(|aim| matches!(aim.source, Source::Measured { least_sd: 0.0, .. }));
    let scatter = if unstated { scatter(&features, measured) } else { vec![None; features.len()] };
    job.aims
        .iter()
        .zip(read)
        .zip(scatter)
        .map(|((aim, read), scatter)| {
            let calibration = job.calibration(aim);
            Ok(Target { calibration, ..target(aim, read, scatter, measured)? })
        })
        .collect()
}

fn target(
    aim: &Aim,
    read: Result<Value, Missing>,
    scatter: Option<f64>,
    measured: &[Option<Recording>],
) -> Result<Target, FitError> {
    let (name, measure, last) =
        (aim.feature.name.clone(), aim.feature.reading.measure(), aim.stage == When::Last);
    let (value, sd) = match aim.source {
        Source::Given { target, sd } => (target, sd),
        Source::Measured { least_sd, least_sd_relative } => {
            let usable = |read: Value| match read.value {
                value if !value.is_finite() || (value == 0.0 && measure == Measure::Log) => {
                    Err(format!("its value is {value}"))
                }
                _ => Ok(read),
            };
            let read = read
                .map_err(|missing| missing.to_string())
                .and_then(usable)
                .map_err(|problem| not_measurable(aim, measured, problem))?;
            let scale = if measure == Measure::Log { read.value.abs() } else { least_scale(measure) };
            let stated = least_sd > 0.0 || least_sd_relative > 0.0;
            let noise = if stated { read.sd } else { scatter.or(read.sd) };
            let least = if stated { least_sd.max(least_sd_relative * scale) } else { LEAST_RELATIVE * scale };
            (read.value, noise.filter(|sd| sd.is_finite()).unwrap_or(0.0).max(least))
        }
    };
    Ok(Target { name, value, sd, scatter: 0.0, measure, last, calibration: None })
}

fn least_scale(measure: Measure) -> f64 {
    match measure {
        Measure::Log => 1.0,
        Measure::Linear { scale } => scale,
    }
}

/// Standard deviation of each feature over noisier copies of the recordings; `None` where fewer than half of
/// them show it.
fn scatter(features: &[Feature], measured: &[Option<Recording>]) -> Vec<Option<f64>> {
    let noise_m: Vec<f64> = measured
        .iter()
        .map(|m| m.as_ref().and_then(|m| quality(m, None).head_x.noise_m).unwrap_or(0.0))
        .collect();
    let copy = |seed: u64| -> Vec<Option<Recording>> {
        let noisier = |(recording, noise_m): (&Option<Recording>, &f64)| {
            let recording = recording.as_ref()?;
            let tracking =
                Tracking { metres_per_pixel: *noise_m, noise_px: 1.0, dropout_fraction: 0.0, seed };
            track(recording, recording.name(), &tracking).ok()
        };
        measured.iter().zip(&noise_m).map(noisier).collect()
    };
    let values = |seed: u64| {
        read(features, &copy(seed)).into_iter().map(|read| read.ok().map(|read| read.value)).collect()
    };
    let reads: Vec<Vec<Option<f64>>> = (1..=COPIES).map(values).collect();
    (0..features.len())
        .map(|at| {
            deviation(&reads.iter().filter_map(|read| read.get(at).copied().flatten()).collect::<Vec<f64>>())
        })
        .collect()
}

/// Every feature of the conditions that were measured; those of the others are missing.
fn read(features: &[Feature], measured: &[Option<Recording>]) -> Vec<Result<Value, Missing>> {
    let present: Vec<usize> = (0..measured.len()).filter(|at| measured[*at].is_some()).collect();
    let place = |condition: usize| present.iter().position(|at| *at == condition).unwrap_or(usize::MAX - 1);
    let placed: Vec<Feature> = features
        .iter()
        .map(|feature| Feature { condition: place(feature.condition), ..feature.clone() })
        .collect();
    read_all_assigned(&placed, &[], &measured.iter().flatten().collect::<Vec<_>>())
}

fn deviation(values: &[f64]) -> Option<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let sum: f64 = values.iter().map(|v| math::powi(v - mean, 2)).sum();
    (2 * values.len() as u64 > COPIES).then(|| (sum / (values.len() - 1) as f64).sqrt())
}

fn not_measurable(aim: &Aim, measured: &[Option<Recording>], problem: String) -> FitError {
    let recording = measured
        .get(aim.feature.condition)
        .and_then(Option::as_ref)
        .map_or("the recording", Recording::name)
        .to_owned();
    FitError::NotMeasurable { recording, name: aim.feature.name.clone(), problem }
}
