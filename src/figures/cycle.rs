//! The stick-slip cycle over the speed of the tip, measured and of the model, with natural frequencies and
//! targets as lines.

pub(crate) mod caption;

pub use crate::spectrum::Target;
pub use crate::spectrum::time_frequency::SpeedPoint;

use crate::chart::{
    ChartAxis, Colour, ErrorBar, FULL_WIDTH_MM, Figure, Mark, MarkerShape, Panel, Ribbon, Series,
    TextAnnotation,
};
use crate::figures::subtitle;
use crate::text::{format_digits, truncate_text};

/// What the figure shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CycleOverSpeed {
    /// Heading: the claim with its number.
    pub title: String,
    /// More to say; empty for none.
    pub note: String,
    /// Whether the measured motion is one that no camera took.
    pub synthetic: bool,
    /// The measured cycle; empty without a recording.
    pub measured: Vec<SpeedPoint>,
    /// That of the model.
    pub model: Vec<SpeedPoint>,
    /// Natural frequencies of the model by their names, Hz.
    pub natural_hz: Vec<(String, f64)>,
    /// Measured or published frequencies that are to be met.
    pub targets: Vec<Target>,
}

/// Height of the panel, mm.
const HEIGHT_MM: f64 = 72.0;
const MILLIMETRES: f64 = 1e3;
/// The axes end this far beyond what is shown.
const AXIS_MARGIN: f64 = 1.12;
/// Places of the names along the lines, shares of the width: one after the other where lines are close.
const LABEL_POSITIONS: [f64; 3] = [0.24, 0.52, 0.79];
/// Letters of a name that have room there.
const MAX_LABEL_LETTERS: usize = 12;
/// Lines this close have their names at different places, share of the height.
const CLOSE_LEVELS: f64 = 0.09;
/// Distance of a name from its line, share of the height.
const LABEL_OFFSET: f64 = 0.022;

/// The figure.
#[must_use]
pub fn draw_figure(shown: &CycleOverSpeed) -> Figure {
    let points = || shown.measured.iter().chain(&shown.model);
    let fastest = points().map(|p| p.tip_speed_m_per_s * MILLIMETRES).fold(0.0, f64::max);
    let highest = points()
        .map(|p| p.frequency_hz)
        .chain(shown.targets.iter().map(|t| t.frequency_hz))
        .fold(0.0, f64::max);
    let (right, top) = if fastest > 0.0 && highest > 0.0 {
        (AXIS_MARGIN * fastest, AXIS_MARGIN * highest)
    } else {
        (1.0, 1.0)
    };
    let mut lines: Vec<(String, f64, Colour)> = shown
        .natural_hz
        .iter()
        .map(|(name, hz)| (format!("{name} {} Hz", format_digits(*hz, 3)), *hz, Colour::Green))
        .chain(shown.targets.iter().map(|t| {
            (
                format!(
                    "{} {} Hz",
                    truncate_text(&t.name, MAX_LABEL_LETTERS),
                    format_digits(t.frequency_hz, 3)
                ),
                t.frequency_hz,
                Colour::Blue,
            )
        }))
        .filter(|(_, hz, _)| *hz > 0.0 && *hz < top)
        .collect();
    lines.sort_by(|a, b| a.1.total_cmp(&b.1));
    let panel = Panel {
        x: ChartAxis::linear("tip speed, mm/s").with_range(0.0, right),
        y: ChartAxis::linear("frequency, Hz").with_range(0.0, top),
        height_mm: HEIGHT_MM,
        series: level_lines(&lines, right).into_iter().chain(cycle_series(shown)).collect(),
        ribbons: shown.targets.iter().filter_map(|t| deviation_ribbon(t, right)).collect(),
        annotations: level_names(&lines, (right, top)),
        ..Panel::default()
    };
    Figure {
        title: shown.title.clone(),
        subtitle: subtitle(shown.synthetic, &shown.note),
        watermarked: shown.synthetic,
        description: "Frequency of the stick-slip cycle over the speed of the tip, with natural frequencies \
                      and targets as lines."
            .to_owned(),
        width_mm: FULL_WIDTH_MM,
        panels: vec![panel],
        ..Figure::default()
    }
}

/// Lines across the axes.
fn level_lines(lines: &[(String, f64, Colour)], right: f64) -> Vec<Series> {
    let line = |(_, hz, colour): &(String, f64, Colour)| Series {
        label: if *colour == Colour::Blue { "target" } else { "natural frequency" }.to_owned(),
        colour: *colour,
        mark: if *colour == Colour::Blue { Mark::Dashed } else { Mark::Dotted },
        points: vec![Some((0.0, *hz)), Some((right, *hz))],
        ..Series::default()
    };
    lines.iter().map(line).collect()
}

/// Two deviations either side of a target.
fn deviation_ribbon(target: &Target, right: f64) -> Option<Ribbon> {
    let sd_hz = target.frequency_sd_hz?;
    let (low, high) = (target.frequency_hz - 2.0 * sd_hz, target.frequency_hz + 2.0 * sd_hz);
    Some(Ribbon {
        label: "target \u{b1} 2 sd".to_owned(),
        colour: Colour::Blue,
        points: vec![Some((0.0, low, high)), Some((right, low, high))],
    })
}

/// The names over their lines, those of close lines next to each other.
fn level_names(lines: &[(String, f64, Colour)], (right, top): (f64, f64)) -> Vec<TextAnnotation> {
    let (mut place, mut before) = (0, f64::NEG_INFINITY);
    let mut named = Vec::new();
    for (name, hz, colour) in lines {
        place = if hz - before < CLOSE_LEVELS * top { (place + 1) % LABEL_POSITIONS.len() } else { 0 };
        before = *hz;
        let at = (LABEL_POSITIONS[place] * right, hz + LABEL_OFFSET * top);
        named.push(TextAnnotation { text: name.clone(), colour: *colour, at });
    }
    named
}

/// Both cycles, the recording's on top.
fn cycle_series(shown: &CycleOverSpeed) -> Vec<Series> {
    let place = |p: &SpeedPoint| (p.tip_speed_m_per_s * MILLIMETRES, p.frequency_hz);
    let bar = |p: &SpeedPoint| {
        let ((x, f), sd) = (place(p), p.frequency_sd_hz?);
        Some(ErrorBar::Vertical { x, from: f - 2.0 * sd, to: f + 2.0 * sd })
    };
    let series = |(label, colour, shape, points): (&str, Colour, MarkerShape, &Vec<SpeedPoint>)| Series {
        label: format!("{label} \u{b1} 2 sd"),
        colour,
        mark: Mark::Hollow(shape),
        points: points.iter().map(|p| Some(place(p))).collect(),
        error_bars: points.iter().filter_map(bar).collect(),
    };
    [
        ("model", Colour::Vermilion, MarkerShape::Square, &shown.model),
        ("measured", Colour::Black, MarkerShape::Disc, &shown.measured),
    ]
    .into_iter()
    .map(series)
    .filter(|s| !s.points.is_empty())
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown() -> CycleOverSpeed {
        let point =
            |v: f64, f: f64| SpeedPoint { tip_speed_m_per_s: v, frequency_hz: f, frequency_sd_hz: Some(2.0) };
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
        let panel = &draw_figure(&shown()).panels[0];
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
}
