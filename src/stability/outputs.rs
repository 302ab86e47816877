//! `stability.csv` and `stability.json`.

use super::speed_intervals::{SlidingState, SpeedInterval, unstable_range};
use super::steady_sliding::SteadySlide;
use super::study::{SlidingSurvey, StabilityStudy};
use crate::model::shoulder::ShoulderContact;
use serde_json::{Value, json};
use std::fmt::Write;

/// Note in `stability.json` on the speed at which a stick-slip cycle ends.
pub const CYCLE_NOTE: &str = "not computed: a stick-slip cycle can go on above end_m_per_s, where steady \
     sliding is stable; `wiperlab simulate` shows whether it does";

/// The table of all modes: a row for each mode of each equilibrium, also of those on other sides of the
/// shoulder.
#[must_use]
pub fn write_stability_csv(study: &StabilityStudy) -> String {
    let mut text = "speed_m_per_s,preload_n,shoulder,mode,growth_per_s,frequency_hz\n".to_owned();
    for point in &study.points {
        for slide in point.slide.iter().chain(&point.others) {
            for (i, mode) in slide.modes().enumerate() {
                let _ = writeln!(
                    text,
                    "{},{},{},{},{:e},{}",
                    point.speed_m_per_s,
                    point.preload_n,
                    shoulder_word(study, slide),
                    i + 1,
                    mode.growth_per_s,
                    mode.frequency_hz
                );
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

/// The summary: onset and end, intervals of speed, and the ranked changes.
#[must_use]
pub fn write_stability_json(study: &StabilityStudy) -> Value {
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
                "cycle_fold_change_m_per_s": null,
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
        "cycle_fold_m_per_s": null,
        "cycle_fold_note": CYCLE_NOTE,
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
        "intervals": survey.intervals.iter().map(describe_interval).collect::<Vec<_>>(),
    })
}

fn describe_interval(interval: &SpeedInterval) -> Value {
    let [from, to] = interval.speeds_m_per_s;
    let (state, reason) = match interval.state {
        SlidingState::Stable => ("stable", None),
        SlidingState::Unstable => ("unstable", None),
        SlidingState::Impossible(reason) => ("impossible", Some(reason)),
    };
    let ends = interval.modes.zip(interval.instabilities()).map(|(modes, kinds)| {
        let end = |i: usize| {
            json!({
                "instability": kinds[i].0,
                "band": kinds[i].1,
                "growth_per_s": modes[i].growth_per_s,
                "frequency_hz": modes[i].frequency_hz,
            })
        };
        [end(0), end(1)]
    });
    json!({
        "from_m_per_s": from,
        "to_m_per_s": to,
        "state": state,
        "reason": reason,
        "modes_at_ends": ends,
    })
}
