//! The cycle of a condition over the speed of the tip.

use super::{CycleOverSpeed, SpeedPoint, Target, draw_figure};
use crate::blade::modes::body_frequencies;
use crate::compare::{ConditionComparison, TrackedRidge};
use crate::figures::{FigureBlock, Words};
use crate::text::{format_digits, format_speed, join_with_and};

/// Ratio of neighbouring frequencies that two different components have: a cycle changes by less than that at
/// once.
const COMPONENT_RATIO: f64 = 2.5;
/// Share of its mean by which a cycle that stays the same may change.
const CONSTANT_TOLERANCE: f64 = 0.03;
/// Share of the range by which the cycles of the faster half differ from those of the slower one where the
/// cycle follows the speed.
const MIN_SPEED_TREND: f64 = 0.2;

/// The figure of a condition; none where neither shows a cycle.
pub(crate) fn figure_block(case: &ConditionComparison) -> Option<FigureBlock> {
    let (measured, model) = (&case.ridges.measured, &case.ridges.model);
    let all = [measured, model].into_iter().flatten().flat_map(|ridge| ridge.courses.iter().flatten());
    let least_hz = cycle_threshold_hz(all.map(|p| p.frequency_hz).collect());
    let over_speed = |followed: &Option<TrackedRidge>| {
        let points = followed.iter().flat_map(|ridge| ridge.over_speed.iter().copied());
        points.filter(|p| p.frequency_hz >= least_hz).collect::<Vec<_>>()
    };
    let (measured, model) = (over_speed(measured), over_speed(model));
    if measured.is_empty() && model.is_empty() {
        return None;
    }
    let blade = body_frequencies(&case.model.scene.linkage);
    let natural_hz = [("head", blade.head_hz), ("neck", blade.neck_hz), ("lip", blade.lip_hz)];
    let shown = CycleOverSpeed {
        title: String::new(),
        note: case.heading_note(""),
        synthetic: case.is_synthetic(),
        natural_hz: natural_hz.map(|(name, hz)| (name.to_owned(), hz)).to_vec(),
        targets: case.frequency_comparisons().map(|sought| sought.target).collect::<Vec<Target>>(),
        measured,
        model,
    };
    let ridge = case.ridges.measured.as_ref().filter(|_| !shown.measured.is_empty());
    let courses = ridge.or(case.ridges.model.as_ref())?.courses.iter().flatten();
    let cycles = || courses.clone().map(|p| p.frequency_hz).filter(|hz| *hz >= least_hz);
    let range_hz = (cycles().reduce(f64::min)?, cycles().reduce(f64::max)?);
    let claim = claim_sentence(&shown, range_hz);
    let shown = CycleOverSpeed { title: claim.clone(), ..shown };
    let words = figure_text(case, &shown, &claim);
    Some(case.figure_block("cycle", words, draw_figure(&shown)))
}

/// From which frequency on a component is the stick-slip cycle, Hz: a ridge that jumps between it and the
/// slow swing of the head has a wide gap between the two.
fn cycle_threshold_hz(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    let gap = all.windows(2).rev().find(|pair| pair[1] > COMPONENT_RATIO * pair[0]);
    gap.map_or(0.0, |pair| pair[1])
}

/// The claim with its numbers, of the recording where it shows a cycle. What is slower than the neck swings
/// may be the head, and is called no cycle.
fn claim_sentence(shown: &CycleOverSpeed, (low, high): (f64, f64)) -> String {
    let neck_hz = shown.natural_hz.iter().find(|(name, _)| name == "neck").map_or(0.0, |(_, hz)| *hz);
    let what = if high < neck_hz { "strongest component" } else { "cycle" };
    let whose = if shown.measured.is_empty() { format!("The model's {what}") } else { format!("The {what}") };
    let points = if shown.measured.is_empty() { &shown.model } else { &shown.measured };
    let [low_hz, high_hz] = [low, high].map(|hz| format_digits(hz, 3));
    if high - low < CONSTANT_TOLERANCE * (high + low) / 2.0 {
        return format!("{whose} stays between {low_hz} and {high_hz} Hz whatever the speed of the tip");
    }
    match frequency_rise_hz(points) / (high - low) {
        rise if rise > MIN_SPEED_TREND => {
            format!("{whose} rises from {low_hz} to {high_hz} Hz as the tip speeds up")
        }
        rise if rise < -MIN_SPEED_TREND => {
            format!("{whose} falls from {high_hz} to {low_hz} Hz as the tip speeds up")
        }
        _ => format!("{whose} runs from {low_hz} to {high_hz} Hz"),
    }
}

/// Mean frequency of the faster half less that of the slower half, Hz.
fn frequency_rise_hz(points: &[SpeedPoint]) -> f64 {
    let mut by_speed = points.to_vec();
    by_speed.sort_by(|a, b| a.tip_speed_m_per_s.total_cmp(&b.tip_speed_m_per_s));
    let (slow, fast) = by_speed.split_at(by_speed.len() / 2);
    let mean = |of: &[SpeedPoint]| of.iter().map(|p| p.frequency_hz).sum::<f64>() / of.len().max(1) as f64;
    if slow.is_empty() { 0.0 } else { mean(fast) - mean(slow) }
}

fn figure_text(case: &ConditionComparison, shown: &CycleOverSpeed, claim: &str) -> Words {
    let points = if shown.measured.is_empty() { &shown.model } else { &shown.measured };
    let speeds = || points.iter().map(|p| p.tip_speed_m_per_s);
    let span = speeds().reduce(f64::min).zip(speeds().reduce(f64::max));
    let span = span.map_or_else(String::new, |(from, to)| {
        format!(", at mean speeds of the tip from {} to {}", format_speed(from), format_speed(to))
    });
    let whose = match (shown.measured.is_empty(), case.recording()) {
        (false, _) => format!("{} and the fitted model", case.source_kind()),
        (true, Some(_)) => "the fitted model alone, as the recording shows no cycle".to_owned(),
        (true, None) => case.source_kind().to_owned(),
    };
    let caption = format!("{claim}{span}: {whose}.");
    let natural: Vec<String> =
        shown.natural_hz.iter().map(|(name, hz)| format!("{name} {} Hz", format_digits(*hz, 3))).collect();
    let details = format!(
        "Every symbol is the strongest component of a segment after the release of the tip, where neighbouring \
         segments agree on it, over the mean speed of the tip in that segment. Natural frequencies of the \
         fitted blade off its shoulder, each link by itself: {}; those above the axis are left out.",
        join_with_and(&natural)
    );
    Words { caption, details }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(cycles: &[(f64, f64)]) -> CycleOverSpeed {
        let point = |(v, f): &(f64, f64)| SpeedPoint {
            tip_speed_m_per_s: *v,
            frequency_hz: *f,
            frequency_sd_hz: None,
        };
        CycleOverSpeed { measured: cycles.iter().map(point).collect(), ..CycleOverSpeed::default() }
    }

    #[test]
    fn a_slow_swing_is_no_cycle() {
        assert_eq!(cycle_threshold_hz(vec![700.0, 64.0, 75.0, 910.0]), 700.0);
        assert_eq!(cycle_threshold_hz(vec![700.0, 359.0, 910.0]), 0.0);
        assert_eq!(cycle_threshold_hz(Vec::new()), 0.0);
    }

    #[test]
    fn the_claim_says_which_way_the_cycle_goes() {
        let falls = shown(&[(0.2, 693.0), (0.05, 913.0), (0.1, 800.0)]);
        assert_eq!(
            claim_sentence(&falls, (693.0, 913.0)),
            "The cycle falls from 913 to 693 Hz as the tip speeds up"
        );
        let rises = shown(&[(0.1, 359.0), (0.3, 692.0)]);
        assert!(claim_sentence(&rises, (359.0, 692.0)).contains("rises from 359 to 692 Hz"));
        assert!(
            claim_sentence(&shown(&[(0.1, 900.0), (0.3, 905.0)]), (900.0, 905.0)).contains("stays between")
        );
        assert!(claim_sentence(&shown(&[(0.1, 700.0)]), (600.0, 800.0)).contains("runs from 600 to 800 Hz"));
        let natural_hz = vec![("head".to_owned(), 20.0), ("neck".to_owned(), 195.0)];
        let swing = CycleOverSpeed { natural_hz, ..shown(&[(0.1, 77.0)]) };
        assert!(
            claim_sentence(&swing, (46.0, 79.0))
                .starts_with("The strongest component runs from 46.0 to 79.0 Hz")
        );
    }
}
