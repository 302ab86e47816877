//! The frequencies that are sought, as lines over their windows with two deviations either side.

use super::{SpectrogramPlot, TargetFrequency, frequency_range, time_span};
use crate::chart::{Colour, ErrorBar, Mark, Series, TextAnnotation};
use crate::text::{format_digits, truncate_text};

/// Letters of a name that have room in a map.
const MAX_LABEL_LETTERS: usize = 14;
/// Distance of a name from its line, and distance of lines whose names would meet, shares of the height.
const LABEL_OFFSET: f64 = 0.05;
const CLOSE_TARGETS: f64 = 0.1;
/// Where the middle of a name stays, shares of the width: its ends lie within the axes.
const LABEL_LIMITS: (f64, f64) = (0.3, 0.7);

/// The lines over a map, edged so that they are seen on every colour.
pub(super) fn target_lines_over_map(targets: &[TargetFrequency]) -> Option<Series> {
    (!targets.is_empty()).then(|| target_lines(targets, "target \u{b1} 2 sd", Colour::Black, Mark::Edged))
}

/// The same over the ridges, those that are met apart from the others.
pub(super) fn target_lines_over_ridges(targets: &[TargetFrequency]) -> impl Iterator<Item = Series> {
    let looks = [
        (true, "target, met", Colour::Blue, Mark::Dashed),
        (false, "target, missed", Colour::Purple, Mark::Dotted),
    ];
    looks.into_iter().filter_map(|(met, label, colour, mark)| {
        let own: Vec<TargetFrequency> = targets.iter().filter(|t| t.met == met).cloned().collect();
        (!own.is_empty()).then(|| target_lines(&own, label, colour, mark))
    })
}

fn target_lines(targets: &[TargetFrequency], label: &str, colour: Colour, mark: Mark) -> Series {
    let line = |t: &TargetFrequency| {
        let (from_s, to_s) = t.span_s;
        [Some((from_s, t.frequency_hz)), Some((to_s, t.frequency_hz)), None]
    };
    let ends = |t: &TargetFrequency| {
        let (half, f) = (2.0 * t.frequency_sd_hz.unwrap_or(0.0), t.frequency_hz);
        [t.span_s.0, t.span_s.1].map(|x| ErrorBar::Vertical { x, from: f - half, to: f + half })
    };
    Series {
        label: label.to_owned(),
        colour,
        mark,
        points: targets.iter().flat_map(line).collect(),
        error_bars: targets.iter().filter(|t| t.frequency_sd_hz.is_some()).flat_map(ends).collect(),
    }
}

/// "high 908 Hz, met" over every line; under it where the next one is close.
pub(super) fn target_names(shown: &SpectrogramPlot) -> Vec<TextAnnotation> {
    let Some((bottom, top)) = shown.shown_hz.or_else(|| frequency_range(shown)) else { return Vec::new() };
    let Some((first, last)) = time_span(&shown.time_s) else { return Vec::new() };
    let place = |share: f64| first + share * (last - first);
    let text = |t: &TargetFrequency| {
        let above = |other: &TargetFrequency| {
            other.frequency_hz > t.frequency_hz
                && other.frequency_hz - t.frequency_hz < CLOSE_TARGETS * (top - bottom)
        };
        let side = if shown.targets.iter().any(above) { -1.0 } else { 1.0 };
        let middle = (t.span_s.0.max(first) + t.span_s.1.min(last)) / 2.0;
        TextAnnotation {
            text: format!(
                "{} {} Hz, {}",
                truncate_text(&t.name, MAX_LABEL_LETTERS),
                format_digits(t.frequency_hz, 3),
                if t.met { "met" } else { "missed" }
            ),
            colour: Colour::Black,
            at: (
                middle.clamp(place(LABEL_LIMITS.0), place(LABEL_LIMITS.1)),
                t.frequency_hz + side * LABEL_OFFSET * (top - bottom),
            ),
        }
    };
    shown.targets.iter().map(text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aimed(name: &str, frequency_hz: f64, met: bool) -> TargetFrequency {
        let name = name.to_owned();
        TargetFrequency { name, frequency_hz, frequency_sd_hz: Some(7.0), span_s: (0.2, 0.6), met }
    }

    #[test]
    fn a_target_lies_in_its_window_with_two_deviations_and_says_whether_it_is_met() {
        let shown = SpectrogramPlot {
            time_s: vec![0.1, 0.3, 0.5, 0.7],
            shown_hz: Some((0.0, 1000.0)),
            targets: vec![aimed("lowest", 359.0, true), aimed("highest", 400.0, false)],
            ..SpectrogramPlot::default()
        };
        let line = target_lines_over_map(&shown.targets).unwrap();
        assert_eq!(line.points[..3], [Some((0.2, 359.0)), Some((0.6, 359.0)), None]);
        assert_eq!(line.error_bars[0], ErrorBar::Vertical { x: 0.2, from: 345.0, to: 373.0 });
        let texts: Vec<(String, f64)> = target_names(&shown).into_iter().map(|t| (t.text, t.at.1)).collect();
        assert_eq!(
            texts,
            [("lowest 359 Hz, met".to_owned(), 309.0), ("highest 400 Hz, missed".to_owned(), 450.0)]
        );
        let labels: Vec<String> = target_lines_over_ridges(&shown.targets).map(|s| s.label).collect();
        assert_eq!(labels, ["target, met", "target, missed"]);
        assert!(target_lines_over_map(&[]).is_none() && target_lines_over_ridges(&[]).next().is_none());
    }
}
