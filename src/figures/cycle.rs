//! Frequency of the stick-slip cycle against tip speed, measured and of the model, with natural frequencies
//! and targets as lines.

use super::spectrogram::speed_series;
use super::{FigureBlock, FigureText};
use crate::compare::{ConditionComparison, TrackedRidge};
use crate::figures::full_figure;
use crate::model::modes::body_frequencies;
use crate::text::{format_digits, format_speed, join_with_and, truncate_text};
use plain_charts::{ChartAxis, Colour, Figure, Mark, MarkerShape, Panel, Ribbon, Series, TextAnnotation};
pub use short_spectra::Target;
pub use short_spectra::time_frequency::SpeedPoint;

/// Data of the figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CycleOverSpeed {
    /// Heading: the main result with its number.
    pub title: String,
    /// Further text for the line under the heading; empty for none.
    pub note: String,
    /// Whether the measured motion is synthetic.
    pub synthetic: bool,
    /// The measured cycle; empty without a recording.
    pub measured: Vec<SpeedPoint>,
    /// The cycle of the model.
    pub model: Vec<SpeedPoint>,
    /// Natural frequencies of the model in Hz, each with its name.
    pub natural_hz: Vec<(String, f64)>,
    /// Measured or published target frequencies.
    pub targets: Vec<Target>,
}

/// Height of the panel, mm.
const HEIGHT_MM: f64 = 72.0;
/// Ratio of the upper end of each axis to the largest value shown on it.
const AXIS_MARGIN: f64 = 1.12;
/// Positions of names along their horizontal lines, as fractions of the width of the axes. Names of lines
/// that are close together use these positions in turn.
const LABEL_POSITIONS: [f64; 3] = [0.24, 0.52, 0.79];
/// Number of letters after which the name of a target is cut.
const MAX_LABEL_LETTERS: usize = 12;
/// If the distance between two lines is below this fraction of the height of the axes, their names have
/// different positions along the lines.
const CLOSE_LEVELS: f64 = 0.09;
/// Distance of a name from its line, as a fraction of the height of the axes.
const LABEL_OFFSET: f64 = 0.022;

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &CycleOverSpeed) -> Figure {
    let points = || shown.measured.iter().chain(&shown.model);
    let fastest = points().map(|p| p.speed_m_per_s * 1e3).fold(0.0, f64::max);
    let sought_hz = shown.targets.iter().map(|t| t.frequency_hz);
    let highest = points().map(|p| p.frequency_hz).chain(sought_hz).fold(0.0, f64::max);
    let empty = !(fastest > 0.0 && highest > 0.0);
    let (right, top) = if empty { (1.0, 1.0) } else { (AXIS_MARGIN * fastest, AXIS_MARGIN * highest) };
    let line = |name: &str, hz: f64, colour| (format!("{name} {} Hz", format_digits(hz, 3)), hz, colour);
    let natural = shown.natural_hz.iter().map(|(name, hz)| line(name, *hz, Colour::Green));
    let name = |t: &Target| truncate_text(&t.name, MAX_LABEL_LETTERS);
    let targets = shown.targets.iter().map(|t| line(&name(t), t.frequency_hz, Colour::Blue));
    let mut lines: Vec<(String, f64, Colour)> =
        natural.chain(targets).filter(|(_, hz, _)| *hz > 0.0 && *hz < top).collect();
    lines.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (x, y) = (ChartAxis::linear("tip speed, mm/s"), ChartAxis::linear("frequency, Hz"));
    let panel = Panel {
        ribbons: shown.targets.iter().filter_map(|t| deviation_ribbon(t, right)).collect(),
        annotations: level_names(&lines, (right, top)),
        ..Panel::new(
            x.with_range(0.0, right),
            y.with_range(0.0, top),
            HEIGHT_MM,
            level_lines(&lines, right).chain(cycle_series(shown)),
        )
    };
    full_figure(
        &shown.title,
        shown.synthetic,
        &shown.note,
        "Frequency of the stick-slip cycle over the speed of the tip, with natural frequencies \
                      and targets as lines."
            .to_owned(),
        [panel],
    )
}

/// Horizontal lines across the axes.
fn level_lines(lines: &[(String, f64, Colour)], right: f64) -> impl Iterator<Item = Series> {
    lines.iter().map(move |(_, hz, colour)| {
        let (label, mark) = match colour {
            Colour::Blue => ("target", Mark::Dashed),
            _ => ("natural frequency", Mark::Dotted),
        };
        Series::new(label, *colour, mark, [(0.0, *hz), (right, *hz)])
    })
}

/// Band of two standard deviations on either side of a target.
fn deviation_ribbon(target: &Target, right: f64) -> Option<Ribbon> {
    let sd_hz = target.frequency_sd_hz?;
    let (low, high) = (target.frequency_hz - 2.0 * sd_hz, target.frequency_hz + 2.0 * sd_hz);
    Some(Ribbon::new("target \u{b1} 2 sd", Colour::Blue, [(0.0, low, high), (right, low, high)]))
}

/// The names above their lines; names of lines that are close together are placed side by side.
fn level_names(lines: &[(String, f64, Colour)], (right, top): (f64, f64)) -> Vec<TextAnnotation> {
    let (mut place, mut before) = (0, f64::NEG_INFINITY);
    let mut named = Vec::new();
    for (name, hz, colour) in lines {
        place = if hz - before < CLOSE_LEVELS * top { (place + 1) % LABEL_POSITIONS.len() } else { 0 };
        before = *hz;
        let at = (LABEL_POSITIONS[place] * right, hz + LABEL_OFFSET * top);
        named.push(TextAnnotation::new(name.clone(), *colour, at));
    }
    named
}

/// The points of the cycle in model and recording; those of the recording are drawn on top.
fn cycle_series(shown: &CycleOverSpeed) -> impl Iterator<Item = Series> {
    let model = speed_series("model", Colour::Vermilion, MarkerShape::Square, &shown.model);
    let measured = speed_series("measured", Colour::Black, MarkerShape::Disc, &shown.measured);
    [model, measured].into_iter().filter(|s| !s.points.is_empty())
}

// The cycle of a condition against the speed of the tip.

/// Two neighbouring frequencies belong to different components if the ratio of the higher to the lower one
/// exceeds this value.
const COMPONENT_RATIO: f64 = 2.5;
/// A cycle is called constant if its frequency range is below this fraction of its mean frequency.
const CONSTANT_TOLERANCE: f64 = 0.03;
/// The cycle frequency is said to rise or fall with the speed if its mean over the faster half of the points
/// differs from its mean over the slower half by more than this fraction of the frequency range.
const MIN_SPEED_TREND: f64 = 0.2;

/// The figure of a condition; `None` if neither recording nor model shows a cycle.
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

/// Lowest frequency, Hz, that counts as the stick-slip cycle. A ridge may jump between the cycle and the slow
/// swing of the head, so the frequencies are sorted and those below the highest wide gap are excluded; 0
/// without such a gap.
fn cycle_threshold_hz(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    let gap = all.windows(2).rev().find(|pair| pair[1] > COMPONENT_RATIO * pair[0]);
    gap.map_or(0.0, |pair| pair[1])
}

/// The main result, from the recording if it shows a cycle, otherwise from the model. A component below the
/// natural frequency of the neck may be the swing of the head, so it is not called a cycle.
fn claim_sentence(shown: &CycleOverSpeed, (low, high): (f64, f64)) -> String {
    let neck_hz = shown.natural_hz.iter().find(|(name, _)| name == "neck").map_or(0.0, |(_, hz)| *hz);
    let what = if high < neck_hz { "strongest component" } else { "cycle" };
    let whose = if shown.measured.is_empty() { format!("The model's {what}") } else { format!("The {what}") };
    let points = cycle_points(shown);
    let [low_hz, high_hz] = [low, high].map(|hz| format_digits(hz, 3));
    if high - low < CONSTANT_TOLERANCE * (high + low) / 2.0 {
        return format!("{whose} stays between {low_hz} and {high_hz} Hz whatever the speed of the tip");
    }
    match frequency_rise_hz(points) / (high - low) {
        r if r > MIN_SPEED_TREND => {
            format!("{whose} rises from {low_hz} to {high_hz} Hz as the tip speeds up")
        }
        r if r < -MIN_SPEED_TREND => {
            format!("{whose} falls from {high_hz} to {low_hz} Hz as the tip speeds up")
        }
        _ => format!("{whose} runs from {low_hz} to {high_hz} Hz"),
    }
}

/// The points of the measured cycle or, if none was measured, those of the cycle of the model.
fn cycle_points(shown: &CycleOverSpeed) -> &[SpeedPoint] {
    if shown.measured.is_empty() { &shown.model } else { &shown.measured }
}

/// Mean frequency, Hz, of the faster half of the points minus that of the slower half.
fn frequency_rise_hz(points: &[SpeedPoint]) -> f64 {
    let mut by_speed = points.to_vec();
    by_speed.sort_by(|a, b| a.speed_m_per_s.total_cmp(&b.speed_m_per_s));
    let (slow, fast) = by_speed.split_at(by_speed.len() / 2);
    let mean = |of: &[SpeedPoint]| of.iter().map(|p| p.frequency_hz).sum::<f64>() / of.len().max(1) as f64;
    if slow.is_empty() { 0.0 } else { mean(fast) - mean(slow) }
}

fn figure_text(case: &ConditionComparison, shown: &CycleOverSpeed, claim: &str) -> FigureText {
    let points = cycle_points(shown);
    let speeds = || points.iter().map(|p| p.speed_m_per_s);
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
    FigureText { caption, details }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example_cycles() -> CycleOverSpeed {
        let point =
            |v: f64, f: f64| SpeedPoint { speed_m_per_s: v, frequency_hz: f, frequency_sd_hz: Some(2.0) };
        CycleOverSpeed {
            measured: vec![point(0.05, 910.0), point(0.2, 700.0)],
            model: vec![point(0.05, 905.0)],
            natural_hz: vec![("neck".to_owned(), 195.0), ("lip".to_owned(), 608.0), ("far".to_owned(), 5e3)],
            targets: vec![Target {
                name: "high".to_owned(),
                frequency_hz: 640.0,
                frequency_sd_hz: Some(4.0),
            }],
            ..CycleOverSpeed::default()
        }
    }

    #[test]
    fn lines_within_the_axes_are_named_and_close_ones_next_to_each_other() {
        let panel = &draw_figure(&example_cycles()).panels[0];
        let names: Vec<&str> = panel.annotations.iter().map(|t| t.text.as_str()).collect();
        assert_eq!(names, ["neck 195 Hz", "lip 608 Hz", "high 640 Hz"]);
        assert!(panel.annotations[1].at.0 < panel.annotations[2].at.0);
        assert_eq!(panel.ribbons[0].points[0], Some((0.0, 632.0, 648.0)));
        assert_eq!(panel.series.last().unwrap().points[0], Some((50.0, 910.0)));
    }

    #[test]
    fn nothing_has_axes_of_its_own() {
        let panel = &draw_figure(&CycleOverSpeed::default()).panels[0];
        assert_eq!((panel.x.range, panel.series.len()), (Some((0.0, 1.0)), 0));
    }

    fn shown_cycles(cycles: &[(f64, f64)]) -> CycleOverSpeed {
        let point =
            |(v, f): &(f64, f64)| SpeedPoint { speed_m_per_s: *v, frequency_hz: *f, frequency_sd_hz: None };
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
        let falls = shown_cycles(&[(0.2, 693.0), (0.05, 913.0), (0.1, 800.0)]);
        assert_eq!(
            claim_sentence(&falls, (693.0, 913.0)),
            "The cycle falls from 913 to 693 Hz as the tip speeds up"
        );
        let rises = shown_cycles(&[(0.1, 359.0), (0.3, 692.0)]);
        assert!(claim_sentence(&rises, (359.0, 692.0)).contains("rises from 359 to 692 Hz"));
        assert!(
            claim_sentence(&shown_cycles(&[(0.1, 900.0), (0.3, 905.0)]), (900.0, 905.0))
                .contains("stays between")
        );
        assert!(
            claim_sentence(&shown_cycles(&[(0.1, 700.0)]), (600.0, 800.0))
                .contains("runs from 600 to 800 Hz")
        );
        let natural_hz = vec![("head".to_owned(), 20.0), ("neck".to_owned(), 195.0)];
        let swing = CycleOverSpeed { natural_hz, ..shown_cycles(&[(0.1, 77.0)]) };
        assert!(
            claim_sentence(&swing, (46.0, 79.0))
                .starts_with("The strongest component runs from 46.0 to 79.0 Hz")
        );
    }
}
