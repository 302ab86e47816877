//! Advice on additional measurements: features that change with the parameter combinations that a
//! job leaves undetermined.
//!
//! Candidate features are computed from runs of the model around one probe. A candidate is worth measuring if
//! it changes by more than its own 95 % interval when an undetermined combination moves from one side of the
//! search box to the other.

use super::identifiability::ProbeEvaluation;
use super::job::{FitTarget, Job};
use super::linear_model::{MIN_INFORMATIVE, ParameterCombination, difference_points};
use super::model::{Draw, Model, ModelFeatures};
use crate::feature::{CycleRangeEnd, Feature, FeatureBand, Reading, ReversalInterval, WIDTH_RELATIVE};
use crate::recording::Recording;
use crate::recording::channel::{Channel, Window};
use portable_math as math;

/// Assumed relative standard deviation of a measured mean deflection or time interval.
const CAREFUL_SD_RELATIVE: f64 = 0.01;
/// Assumed relative standard deviation of a measured amplitude, damping or frequency range.
const ROUGH_SD_RELATIVE: f64 = 0.05;
/// Head speeds at which the mean deflection is a candidate, as fractions of the largest head speed.
const SPEED_SHARES: [f64; 3] = [0.25, 0.5, 0.8];
/// Number of frames over which the head's speed is averaged.
const SPEED_FRAMES: usize = 20;
/// Length, s, of the segments in which a drifting frequency is measured. It is short enough to resolve a
/// change within 0.1 s.
const SEGMENT_S: f64 = 0.02;

/// A feature that could be added to the job as a target.
struct CandidateFeature {
    description: String,
    sd_relative: f64,
    feature: Feature,
}

/// Advice on measurements: one sentence for each parameter combination that the job leaves undetermined at
/// the given probe.
pub(crate) fn advise_measurements(
    job: &Job,
    model: &dyn Model,
    probed: &ProbeEvaluation,
    combinations: &[ParameterCombination],
) -> Vec<String> {
    let open = probed.directions.open_directions();
    if open.is_empty() {
        return Vec::new();
    }
    let candidates = candidate_features(job, model, &probed.centre.values);
    let rows = candidate_sensitivities(&candidates, job, model, probed);
    let names = combinations.iter().filter(|c| !c.determined).map(ParameterCombination::describe_in_words);
    let mut sentences: Vec<String> = Vec::new();
    for (direction, name) in open.into_iter().zip(names) {
        let moved = |row: &Vec<f64>| row.iter().zip(direction).map(|(r, d)| r * d).sum::<f64>().abs();
        let moves = candidates.iter().zip(&rows).map(|(candidate, row)| (candidate, moved(row)));
        sentences.push(match moves.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((candidate, moved)) if moved > MIN_INFORMATIVE => format!(
                "to determine {name}, measure {} to {:.0} %",
                candidate.description,
                100.0 * candidate.sd_relative
            ),
            _ => format!(
                "to determine {name}, film the blade at another speed or preload: nothing else that was tried in \
                 these conditions depends on it"
            ),
        });
    }
    sentences.dedup();
    sentences
}

/// Change of each candidate feature, in its own standard deviations, when one parameter moves from its lower
/// to its upper bound. One row per candidate, one column per parameter; zero where the model does not show
/// the feature.
fn candidate_sensitivities(
    candidates: &[CandidateFeature],
    job: &Job,
    model: &dyn Model,
    probed: &ProbeEvaluation,
) -> Vec<Vec<f64>> {
    let features: Vec<Feature> = candidates.iter().map(|candidate| candidate.feature.clone()).collect();
    let seen = ModelFeatures::new(model, &features, Vec::new(), 1);
    let read = |unit: &Vec<f64>| -> Vec<Option<f64>> {
        let units = job.parameters.iter().zip(unit);
        let values: Vec<f64> = units.map(|(parameter, u)| parameter.bounds.value_at_unit(*u)).collect();
        let read = seen.read_features(&values, Draw::default()).unwrap_or_default();
        (0..features.len()).map(|at| read.get(at)?.as_ref().ok().map(|read| read.value)).collect()
    };
    let around = difference_points(&probed.centre.unit);
    let reads: Vec<Vec<Option<f64>>> = around.iter().map(read).collect();
    let slope = |at: usize, axis: usize| {
        let (below, above) = (reads[2 * axis][at]?, reads[2 * axis + 1][at]?);
        let width = around[2 * axis + 1][axis] - around[2 * axis][axis];
        let ratio = above / below;
        (ratio > 0.0 && ratio.is_finite() && width > 0.0).then(|| math::ln(ratio) / width)
    };
    let row = |(at, candidate): (usize, &CandidateFeature)| {
        let axes = 0..job.parameters.len();
        axes.map(|axis| slope(at, axis).unwrap_or(0.0) / candidate.sd_relative).collect::<Vec<f64>>()
    };
    candidates.iter().enumerate().map(row).collect()
}

fn candidate_features(job: &Job, model: &dyn Model, values: &[f64]) -> Vec<CandidateFeature> {
    let mut all = Vec::new();
    for (at, condition) in job.conditions.iter().enumerate().filter(|(_, condition)| !condition.held_out) {
        let recording = model.record_condition(values, at, Draw::default()).ok();
        let fastest = recording.as_ref().and_then(max_head_speed_m_per_s);
        let intervals = INTERVALS.map(|interval| {
            let words = format!("the {}", interval.kind().replace('-', " "));
            (Reading::Interval { interval, reversal: 1 }, words)
        });
        let careful = quasi_static_readings(fastest).into_iter().chain(intervals);
        let careful = careful.map(|(reading, words)| (reading, words, CAREFUL_SD_RELATIVE));
        let rough = spectral_readings(&job.targets, at).into_iter();
        let rough = rough.map(|(reading, words)| (reading, words, ROUGH_SD_RELATIVE));
        all.extend(careful.chain(rough).map(|(reading, words, sd_relative)| {
            let several = job.conditions.len() > 1;
            let description = if several { format!("{words} in `{}`", condition.name) } else { words };
            let feature = Feature { name: String::new(), reading, condition: at };
            CandidateFeature { description, sd_relative, feature }
        }));
    }
    let is_same = |a: &Feature, b: &Feature| a.reading == b.reading && a.condition == b.condition;
    all.retain(|candidate| !job.targets.iter().any(|aim| is_same(&aim.feature, &candidate.feature)));
    all
}

const INTERVALS: [ReversalInterval; 3] =
    [ReversalInterval::ReleaseAfterReversal, ReversalInterval::StickDuration, ReversalInterval::FlipDuration];

/// Candidate mean deflections at several head speeds, each with a description. They show the friction at
/// these speeds.
fn quasi_static_readings(fastest_m_per_s: Option<f64>) -> Vec<(Reading, String)> {
    let mut found = Vec::new();
    for part in ["before", "after"] {
        let Ok(window) = Window::parse(part) else { continue };
        found.push((Reading::MeanDeflection(window), format!("the mean deflection {part} the flip")));
        for speed_m_per_s in SPEED_SHARES.iter().filter_map(|share| Some(share * fastest_m_per_s?)) {
            let reading =
                Reading::DeflectionAtSpeed { window, speed_m_per_s, width_relative: WIDTH_RELATIVE };
            found.push((
                reading,
                format!("the mean deflection at a head speed of {speed_m_per_s:.2} m/s {part} the flip"),
            ));
        }
    }
    found
}

/// Amplitude, damping and frequency range in the frequency band of each component.
fn spectral_readings(aims: &[FitTarget], condition: usize) -> Vec<(Reading, String)> {
    let bands: Vec<(&FeatureBand, &str)> = aims
        .iter()
        .filter(|aim| aim.feature.condition == condition)
        .filter_map(|aim| match &aim.feature.reading {
            Reading::Frequency(band) => Some((band, aim.feature.name.as_str())),
            _ => None,
        })
        .collect();
    let of = |(band, name): (&FeatureBand, &str)| {
        let mut found = vec![
            (Reading::Rms(band.clone()), format!("the rms in the band of `{name}`")),
            (Reading::DampingRatio(band.clone()), format!("the damping of `{name}`")),
        ];
        if band.channel == Channel::Deflection {
            let end = |end: CycleRangeEnd, word: &str| {
                let reading = Reading::CycleFrequency { band: band.clone(), segment_s: SEGMENT_S, end };
                (reading, format!("the {word} frequency of `{name}`"))
            };
            found.extend([end(CycleRangeEnd::Low, "lowest"), end(CycleRangeEnd::High, "highest")]);
        }
        found
    };
    bands.into_iter().flat_map(of).collect()
}

/// Largest speed of the recorded head, m/s, averaged over [`SPEED_FRAMES`] frames.
fn max_head_speed_m_per_s(recording: &Recording) -> Option<f64> {
    let (head, rate_hz) = (&recording.traces().head_x_m, recording.grid().frame_rate_hz);
    let speed = |ends: &[Option<f64>]| {
        Some((ends.last().copied()?? - ends.first().copied()??).abs() * rate_hz / SPEED_FRAMES as f64)
    };
    head.windows(SPEED_FRAMES + 1).filter_map(speed).max_by(f64::total_cmp)
}
