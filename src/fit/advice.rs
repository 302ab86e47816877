//! What to measure in addition: features that would move along the combinations that a job leaves open.
//!
//! The candidates are read from the same runs of the model as the gate's own features, at one place of the
//! box, and held against the open directions there: a feature is worth measuring where it moves by more than
//! its own 95 % interval across the box.

use super::identifiability::ProbeEvaluation;
use super::job::{FitTarget, Job};
use super::linear_model::difference_points;
use super::linear_model::{MIN_INFORMATIVE, ParameterCombination};
use super::model::ModelFeatures;
use super::model::{Draw, Model};
use crate::feature::{CycleRangeEnd, Feature, FeatureBand, Reading, ReversalInterval, WIDTH_RELATIVE};
use crate::math;
use crate::recording::Recording;
use crate::recording::channel::{Channel, Window};

/// Standard deviations that a careful measurement reaches, relative: of a mean or an instant, and of an
/// amplitude or a damping.
const CAREFUL_SD_RELATIVE: f64 = 0.01;
const ROUGH_SD_RELATIVE: f64 = 0.05;
/// Speeds at which the friction curve is tried, as shares of the largest.
const SPEED_SHARES: [f64; 3] = [0.25, 0.5, 0.8];
/// Frames over which the head's speed is taken.
const SPEED_FRAMES: usize = 20;
/// Segments of a drifting cycle: fine enough for a change within a tenth of a second.
const SEGMENT_S: f64 = 0.02;

/// A feature that a job might ask for.
struct CandidateFeature {
    description: String,
    sd_relative: f64,
    feature: Feature,
}

/// Sentences for the directions that are open at a place that was probed; none where nothing is open.
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
    let names = combinations.iter().filter(|c| !c.determined).map(ParameterCombination::describe);
    let mut sentences: Vec<String> = Vec::new();
    for (direction, name) in open.into_iter().zip(names) {
        let moved = |row: &Vec<f64>| row.iter().zip(direction).map(|(r, d)| r * d).sum::<f64>().abs();
        let best = candidates
            .iter()
            .zip(&rows)
            .map(|(candidate, row)| (candidate, moved(row)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let sentence = match best {
            Some((candidate, moved)) if moved > MIN_INFORMATIVE => format!(
                "to determine {name}: measure {} to {:.0} %, which moves by {moved:.0} of its standard deviations across the box",
                candidate.description,
                100.0 * candidate.sd_relative
            ),
            _ => format!(
                "no feature of these conditions that was tried moves along {name}: measure at another speed or preload, as another [[recording]]"
            ),
        };
        sentences.push(sentence);
    }
    sentences.dedup();
    sentences
}

/// Change of each candidate across the box along each parameter, in standard deviations; zero where it is not
/// seen.
fn candidate_sensitivities(
    candidates: &[CandidateFeature],
    job: &Job,
    model: &dyn Model,
    probed: &ProbeEvaluation,
) -> Vec<Vec<f64>> {
    let features: Vec<Feature> = candidates.iter().map(|candidate| candidate.feature.clone()).collect();
    let seen = ModelFeatures::new(model, &features, Vec::new(), 1);
    let read = |unit: &Vec<f64>| -> Vec<Option<f64>> {
        let values: Vec<f64> =
            job.parameters.iter().zip(unit).map(|(parameter, u)| parameter.bounds.from_unit(*u)).collect();
        let read = seen.read_features(&values, Draw::default()).unwrap_or_default();
        (0..features.len()).map(|at| read.get(at)?.as_ref().ok().map(|read| read.value)).collect()
    };
    let around = difference_points(&probed.centre.unit);
    let reads: Vec<Vec<Option<f64>>> = around.iter().map(read).collect();
    let slope = |at: usize, axis: usize| {
        let (below, above) =
            (reads.get(2 * axis)?.get(at).copied()??, reads.get(2 * axis + 1)?.get(at).copied()??);
        let width = around.get(2 * axis + 1)?.get(axis)? - around.get(2 * axis)?.get(axis)?;
        let ratio = above / below;
        (ratio > 0.0 && ratio.is_finite() && width > 0.0).then(|| math::ln(ratio) / width)
    };
    let row = |(at, candidate): (usize, &CandidateFeature)| {
        let slopes =
            (0..job.parameters.len()).map(|axis| slope(at, axis).unwrap_or(0.0) / candidate.sd_relative);
        slopes.collect::<Vec<f64>>()
    };
    candidates.iter().enumerate().map(row).collect()
}

fn candidate_features(job: &Job, model: &dyn Model, values: &[f64]) -> Vec<CandidateFeature> {
    let mut all = Vec::new();
    for (at, condition) in job.conditions.iter().enumerate().filter(|(_, condition)| !condition.held_out) {
        let fastest = model
            .record_condition(values, at, Draw::default())
            .ok()
            .and_then(|recording| max_head_speed_m_per_s(&recording));
        let of = |reading: Reading, words: String, sd_relative: f64| {
            let words =
                if job.conditions.len() > 1 { format!("{words} in `{}`", condition.name) } else { words };
            CandidateFeature {
                description: words,
                sd_relative,
                feature: Feature { name: String::new(), reading, condition: at },
            }
        };
        all.extend(
            quasi_static_readings(fastest)
                .into_iter()
                .map(|(reading, words)| of(reading, words, CAREFUL_SD_RELATIVE)),
        );
        all.extend(INTERVALS.map(|interval| {
            of(
                Reading::Interval { interval, reversal: 1 },
                format!("the {}", interval.kind().replace('-', " ")),
                CAREFUL_SD_RELATIVE,
            )
        }));
        all.extend(
            spectral_readings(&job.targets, at)
                .into_iter()
                .map(|(reading, words)| of(reading, words, ROUGH_SD_RELATIVE)),
        );
    }
    all.retain(|candidate| {
        job.targets.iter().all(|aim| {
            aim.feature.reading != candidate.feature.reading
                || aim.feature.condition != candidate.feature.condition
        })
    });
    all
}

const INTERVALS: [ReversalInterval; 3] =
    [ReversalInterval::ReleaseAfterReversal, ReversalInterval::StickDuration, ReversalInterval::FlipDuration];

/// Mean deflections, which say the friction at a speed.
fn quasi_static_readings(fastest_m_per_s: Option<f64>) -> Vec<(Reading, String)> {
    let mut found = Vec::new();
    for part in ["before", "after"] {
        let Ok(window) = Window::parse(part) else { continue };
        found.push((Reading::MeanDeflection(window), format!("the mean deflection {part} the flip")));
        for speed_m_per_s in SPEED_SHARES.iter().filter_map(|share| Some(share * fastest_m_per_s?)) {
            let reading =
                Reading::DeflectionAtSpeed { window, speed_m_per_s, width_relative: WIDTH_RELATIVE };
            found.push((reading, format!("the mean deflection at a head speed of {speed_m_per_s:.2} m/s {part} the flip (deflection-at-speed)")));
        }
    }
    found
}

/// Amplitude, damping and range in the bands of the components.
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
            (Reading::DampingRatio(band.clone()), format!("the damping of `{name}` (damping-ratio)")),
        ];
        if band.channel == Channel::Deflection {
            let end = |end: CycleRangeEnd, word: &str| {
                (
                    Reading::CycleFrequency { band: band.clone(), segment_s: SEGMENT_S, end },
                    format!("the {word} frequency over which `{name}` runs (cycle-frequency-{word})"),
                )
            };
            found.extend([end(CycleRangeEnd::Low, "low"), end(CycleRangeEnd::High, "high")]);
        }
        found
    };
    bands.into_iter().flat_map(of).collect()
}

/// Largest speed of the head, m/s.
fn max_head_speed_m_per_s(recording: &Recording) -> Option<f64> {
    let (head, rate_hz) = (&recording.traces().head_x_m, recording.grid().frame_rate_hz);
    let speed = |ends: &[Option<f64>]| {
        Some((ends.last().copied()?? - ends.first().copied()??).abs() * rate_hz / SPEED_FRAMES as f64)
    };
    head.windows(SPEED_FRAMES + 1).filter_map(speed).max_by(f64::total_cmp)
}
