//! Frequency of the stick-slip cycle against tip speed, measured and of the model, with natural frequencies
//! and targets as lines.

use super::spectrogram::speed_series;
use super::{Drawing, FigureBlock, about};
use crate::compare::{ConditionComparison, TrackedRidge};
use crate::figures::full_figure;
use crate::model::modes::named_frequencies;
use crate::text::{format_digits, format_speed, truncate_text};
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
    /// The cycles, one entry per recording.
    pub recordings: Vec<RecordedCycle>,
    /// Natural frequencies of the model in Hz, each with its name.
    pub natural_hz: Vec<(String, f64)>,
    /// Measured or published target frequencies.
    pub targets: Vec<Target>,
}

/// The stick-slip cycle in a recording and in its model.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordedCycle {
    /// Name of the recording; empty if there is only one.
    pub name: String,
    /// The measured cycle; empty without a recording.
    pub measured: Vec<SpeedPoint>,
    /// The cycle of the model.
    pub model: Vec<SpeedPoint>,
}

impl RecordedCycle {
    /// The points of the measured cycle or, if none was measured, those of the model.
    fn points(&self) -> &[SpeedPoint] {
        if self.measured.is_empty() { &self.model } else { &self.measured }
    }
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
    let points = || shown.recordings.iter().flat_map(|cycle| cycle.measured.iter().chain(&cycle.model));
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
    portable_math::sort_by_number(&mut lines, |a| a.1);
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

/// Symbols of the recordings, in the order of the recordings.
const SHAPES: [MarkerShape; 4] =
    [MarkerShape::Disc, MarkerShape::Diamond, MarkerShape::Triangle, MarkerShape::InvertedTriangle];

/// The points of the cycle in models and recordings; those of the recordings are drawn on top.
fn cycle_series(shown: &CycleOverSpeed) -> impl Iterator<Item = Series> {
    let own = |cycle: &RecordedCycle, what: &str| about(&truncate_text(&cycle.name, MAX_LABEL_LETTERS), what);
    let symbols = |of: fn(&RecordedCycle) -> &[SpeedPoint], what: &'static str, colour| {
        let shapes = shown.recordings.iter().zip(SHAPES.into_iter().cycle());
        shapes.map(move |(cycle, shape)| speed_series(&own(cycle, what), colour, shape, of(cycle)))
    };
    let model = symbols(|cycle| &cycle.model, "model", Colour::Vermilion);
    let measured = symbols(|cycle| &cycle.measured, "measured", Colour::Black);
    model.chain(measured).filter(|s| !s.points.is_empty()).collect::<Vec<_>>().into_iter()
}

// The cycle of a condition against the speed of the tip.

/// A cycle is called constant if its frequency range is below this fraction of its mean frequency.
const CONSTANT_TOLERANCE: f64 = 0.03;
/// The cycle frequency is said to rise or fall with the speed if its mean over the faster half of the points
/// differs from its mean over the slower half by more than this fraction of the frequency range.
const MIN_SPEED_TREND: f64 = 0.2;

/// The figure of some conditions; `None` if none of them shows a cycle. Targets and natural frequencies are
/// those of the first one.
pub(crate) fn figure_block(cases: &[&ConditionComparison]) -> Option<FigureBlock> {
    let over_speed = |followed: &Option<TrackedRidge>| {
        followed.as_ref().map_or_else(Vec::new, |ridge| ridge.over_speed.clone())
    };
    let cycle = |case: &&ConditionComparison| RecordedCycle {
        name: if cases.len() > 1 { case.name().to_owned() } else { String::new() },
        measured: over_speed(&case.ridges.measured),
        model: over_speed(&case.ridges.model),
    };
    let case = cases.first()?;
    let shown = CycleOverSpeed {
        title: String::new(),
        note: about(&case.figure_title(), &case.heading_note("")),
        synthetic: cases.iter().any(|case| case.is_synthetic()),
        natural_hz: named_frequencies(&case.model.scene.linkage),
        targets: case.frequency_comparisons().map(|sought| sought.target).collect::<Vec<Target>>(),
        recordings: cases.iter().map(cycle).filter(|cycle| !cycle.points().is_empty()).collect(),
    };
    let points = claimed_points(&shown);
    let claim = claim_sentence(&shown, &points)?;
    let shown = CycleOverSpeed { title: claim.clone(), ..shown };
    let speeds = || points.iter().map(|p| p.speed_m_per_s);
    let (slow, fast) = (speeds().reduce(f64::min)?, speeds().reduce(f64::max)?);
    Some(FigureBlock {
        file: "cycle.svg".to_owned(),
        caption: format!("{claim}, at tip speeds of {} to {}.", format_speed(slow), format_speed(fast)),
        details: String::new(),
        condition: None,
        drawing: Drawing::Chart(draw_figure(&shown)),
    })
}

/// The points that the claim is about: those of the recordings that show a cycle or, if none does, those of
/// the models.
fn claimed_points(shown: &CycleOverSpeed) -> Vec<SpeedPoint> {
    let is_measured = shown.recordings.iter().any(|cycle| !cycle.measured.is_empty());
    let counts = |cycle: &&RecordedCycle| !is_measured || !cycle.measured.is_empty();
    shown.recordings.iter().filter(counts).flat_map(|cycle| cycle.points().iter().copied()).collect()
}

/// The main result: the range of the frequency, and whether it rises or falls with the speed. `None` without
/// a point.
fn claim_sentence(shown: &CycleOverSpeed, points: &[SpeedPoint]) -> Option<String> {
    let is_measured = shown.recordings.iter().any(|cycle| !cycle.measured.is_empty());
    let whose = if is_measured { "The cycle" } else { "The model's cycle" };
    let hz = || points.iter().map(|p| p.frequency_hz);
    let (low, high) = (hz().reduce(f64::min)?, hz().reduce(f64::max)?);
    let [low_hz, high_hz] = [low, high].map(|hz| format_digits(hz, 3));
    let rise = frequency_rise_hz(points) / (high - low);
    Some(if points.len() == 1 {
        format!("{whose} has {low_hz} Hz in the only segment that shows it")
    } else if high - low < CONSTANT_TOLERANCE * (high + low) / 2.0 {
        format!("{whose} stays between {low_hz} and {high_hz} Hz whatever the speed of the tip")
    } else if rise > MIN_SPEED_TREND {
        format!("{whose} rises from {low_hz} to {high_hz} Hz as the tip speeds up")
    } else if rise < -MIN_SPEED_TREND {
        format!("{whose} falls from {high_hz} to {low_hz} Hz as the tip speeds up")
    } else {
        format!("{whose} runs from {low_hz} to {high_hz} Hz")
    })
}

/// Mean frequency, Hz, of the faster half of the points minus that of the slower half.
fn frequency_rise_hz(points: &[SpeedPoint]) -> f64 {
    let mut by_speed = points.to_vec();
    portable_math::sort_by_number(&mut by_speed, |a| a.speed_m_per_s);
    let (slow, fast) = by_speed.split_at(by_speed.len() / 2);
    let mean = |of: &[SpeedPoint]| of.iter().map(|p| p.frequency_hz).sum::<f64>() / of.len().max(1) as f64;
    if slow.is_empty() { 0.0 } else { mean(fast) - mean(slow) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example_cycles() -> CycleOverSpeed {
        let point =
            |v: f64, f: f64| SpeedPoint { speed_m_per_s: v, frequency_hz: f, frequency_sd_hz: Some(2.0) };
        CycleOverSpeed {
            recordings: vec![RecordedCycle {
                measured: vec![point(0.05, 910.0), point(0.2, 700.0)],
                model: vec![point(0.05, 905.0)],
                ..RecordedCycle::default()
            }],
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

    fn claim(cycles: &[(f64, f64)]) -> String {
        let point =
            |(v, f): &(f64, f64)| SpeedPoint { speed_m_per_s: *v, frequency_hz: *f, frequency_sd_hz: None };
        let measured = cycles.iter().map(point).collect();
        let recordings = vec![RecordedCycle { measured, ..RecordedCycle::default() }];
        let shown = CycleOverSpeed { recordings, ..CycleOverSpeed::default() };
        claim_sentence(&shown, &claimed_points(&shown)).unwrap()
    }

    #[test]
    fn the_claim_says_which_way_the_cycle_goes() {
        assert_eq!(
            claim(&[(0.2, 693.0), (0.05, 913.0), (0.1, 800.0)]),
            "The cycle falls from 913 to 693 Hz as the tip speeds up"
        );
        assert!(claim(&[(0.1, 359.0), (0.3, 692.0)]).contains("rises from 359 to 692 Hz"));
        assert!(claim(&[(0.1, 900.0), (0.3, 905.0)]).contains("stays between 900 and 905 Hz"));
        assert!(claim(&[(0.1, 600.0), (0.2, 800.0), (0.3, 640.0), (0.4, 760.0)]).contains("runs from 600"));
        assert_eq!(claim_sentence(&CycleOverSpeed::default(), &[]), None);
    }

    #[test]
    fn several_recordings_share_one_panel() {
        let cycle = |name: &str| RecordedCycle {
            name: name.to_owned(),
            measured: vec![SpeedPoint { speed_m_per_s: 0.1, frequency_hz: 800.0, frequency_sd_hz: None }],
            ..RecordedCycle::default()
        };
        let recordings = vec![cycle("dry"), cycle("wet")];
        let drawn = draw_figure(&CycleOverSpeed { recordings, ..CycleOverSpeed::default() });
        let labels: Vec<&str> = drawn.panels[0].series.iter().map(|s| s.label.as_str()).collect();
        assert_eq!(
            (drawn.panels.len(), labels),
            (1, vec!["dry; measured \u{b1} 2 sd", "wet; measured \u{b1} 2 sd"])
        );
    }
}
