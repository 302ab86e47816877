//! `stability.csv` and `stability.json`.

use super::chatter::ChatterSummary;
use super::cycle_branch::CycleEnd;
use super::shooting::PeriodicMotion;
use super::speed_intervals::unstable_range;
use super::steady_sliding::{SlidingMode, SteadySlide};
use super::study::{SlidingSurvey, StabilityStudy};
use crate::model::shoulder::ShoulderContact;
use crate::text::format_digits;
use serde_json::{Value, json};
use std::fmt::Write;

/// What is known of the speed at which the stick-slip cycle ends, as a sentence.
#[must_use]
pub fn describe_cycle_end(study: &StabilityStudy) -> String {
    let Some(branch) = study.leading_branch() else {
        return "no stick-slip cycle was found at these speeds: no run settled into equal cycles".to_owned();
    };
    let end = match branch.end {
        CycleEnd::Fold if !branch.sticks_below_end() => {
            "a fold; below it the cycle loses its stick and goes on as a vibration without stick".to_owned()
        }
        CycleEnd::Fold => "a fold: a stable and an unstable cycle meet".to_owned(),
        CycleEnd::StickLost => "a corner: the stick of the cycle shrinks to an instant".to_owned(),
        CycleEnd::Grazing => "above it the tip slows down but does not stop".to_owned(),
        CycleEnd::EndOfRange => "the cycle goes on at the highest speed of the range".to_owned(),
        CycleEnd::Undecided => {
            let speed = format_digits(branch.end_m_per_s, 4);
            format!("undecided: the cycle was followed up to {speed} m/s only; {}", branch.problem)
        }
    };
    match branch.cycles().last() {
        Some(last) if !last.multipliers.is_empty() && !branch.is_stable_below_end() => {
            format!("{end}; this cycle is unstable, so the periods of the real vibration may be unequal")
        }
        _ => end,
    }
}

/// The table of the stick-slip cycle along its branch; empty without a cycle.
#[must_use]
pub fn write_cycles_csv(study: &StabilityStudy) -> String {
    let mut text =
        "speed_m_per_s,period_s,frequency_hz,amplitude_m,sticks,stick_s,largest_multiplier\n".to_owned();
    for branch in &study.branches {
        for motion in &branch.motions {
            let (speed, sticks) = (branch.direction * motion.speed_m_per_s, motion.sticks_s.len());
            let (hz, stick_s) = (motion.frequency_hz(), motion.stick_s());
            let PeriodicMotion { period_s, amplitude_m, .. } = motion;
            let largest = motion.largest_multiplier();
            let _ =
                writeln!(text, "{speed},{period_s:e},{hz},{amplitude_m:e},{sticks},{stick_s:e},{largest}");
        }
    }
    text
}

/// The table of all modes: a row for each mode of each equilibrium, also of those on other sides of the
/// shoulder.
#[must_use]
pub fn write_stability_csv(study: &StabilityStudy) -> String {
    let mut text = "speed_m_per_s,preload_n,shoulder,mode,growth_per_s,frequency_hz\n".to_owned();
    let surveys = study.surveys().iter();
    for (survey, point) in surveys.flat_map(|survey| survey.points.iter().map(move |point| (survey, point))) {
        // the sum makes a negative zero positive
        let speed = survey.direction * point.speed_m_per_s + 0.0;
        for slide in point.slide.iter().chain(&point.others) {
            let (preload_n, shoulder) = (survey.preload_n, shoulder_word(study, slide));
            for (i, SlidingMode { growth_per_s, frequency_hz, .. }) in slide.modes.iter().enumerate() {
                let mode = i + 1;
                let _ =
                    writeln!(text, "{speed},{preload_n},{shoulder},{mode},{growth_per_s:e},{frequency_hz}");
            }
        }
    }
    text
}

fn shoulder_word(study: &StabilityStudy, slide: &SteadySlide) -> &'static str {
    match slide.shoulder {
        _ if !study.has_shoulder => "none",
        ShoulderContact::Off => "off",
        ShoulderContact::Forward => "forward",
        ShoulderContact::Backward => "backward",
    }
}

/// The summary: onset and end, intervals of speed, where and why the blade chatters, and the ranked changes.
#[must_use]
pub fn write_stability_json(study: &StabilityStudy, chatter: &ChatterSummary) -> Value {
    let range = study.unstable_range();
    let changes: Vec<Value> = study
        .changes
        .iter()
        .map(|change| {
            json!({
                "parameter": change.parameter.name,
                "meaning": change.parameter.meaning,
                "unit": change.parameter.unit,
                "value": change.value,
                "step": change.step,
                "onset_change_m_per_s": change.onset_m_per_s,
                "end_change_m_per_s": change.end_m_per_s,
                "cycle_fold_change_m_per_s": change.fold_m_per_s,
            })
        })
        .collect();
    json!({
        "preload_n": study.preload_n,
        "speeds_m_per_s": study.range.speeds_m_per_s,
        "preloads_n": study.range.preloads_n,
        "points": study.range.points,
        "onset_m_per_s": range.map(|range| range[0]),
        "end_m_per_s": range.map(|range| range[1]),
        "end_is_end_of_range": range.map(|range| range[1] == study.range.speeds_m_per_s[1]),
        "cycle_fold_m_per_s": study.leading_branch().and_then(|branch| branch.fold_m_per_s()),
        "cycle_fold_kind": study.leading_branch().map(|branch| branch.end),
        "cycle_fold_note": describe_cycle_end(study),
        "chatter": chatter,
        "directions": study.own.iter().map(describe_survey).collect::<Vec<_>>(),
        "by_preload": study.by_preload.iter().map(describe_survey).collect::<Vec<_>>(),
        "changes": changes,
    })
}

fn describe_survey(survey: &SlidingSurvey) -> Value {
    let range = unstable_range(&survey.intervals);
    json!({
        "direction": if survey.direction < 0.0 { "backward" } else { "forward" },
        "preload_n": survey.preload_n,
        "onset_m_per_s": range.map(|range| range[0]),
        "end_m_per_s": range.map(|range| range[1]),
        "intervals": survey.intervals,
    })
}
