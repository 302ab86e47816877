//! Time histories around a reversal: tip, head, deflection and head drop, measured against model, and a zoom on the reversal.

use super::chart::{Axis, Band, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Rule, Series, svg};
use super::subtitle;

/// Motion over time; all columns have the length of `time_s`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Motion {
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// Lip tip along the sweep, m.
    pub tip_x_m: Vec<Option<f64>>,
    /// Head along the sweep, m.
    pub head_x_m: Vec<Option<f64>>,
    /// Deflection, m.
    pub deflection_m: Vec<Option<f64>>,
    /// Head drop, m.
    pub head_drop_m: Vec<Option<f64>>,
}

/// What a time history shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    /// Heading.
    pub title: String,
    /// Whether the measured motion is one that no camera took.
    pub synthetic: bool,
    /// Measured motion; `None` where only published numbers are known.
    pub measured: Option<Motion>,
    /// Motion of the model.
    pub model: Option<Motion>,
    /// Intervals in which the model's tip sticks, s.
    pub stick_s: Vec<(f64, f64)>,
    /// Named instants, s.
    pub instants: Vec<(String, f64)>,
    /// Interval to draw again enlarged, s.
    pub zoom_s: Option<(f64, f64)>,
}

/// Height of a panel, mm: six fit on a page.
const HEIGHT_MM: f64 = 24.0;
/// Below this span, m, a quantity is drawn in micrometres.
const MICROMETRES_BELOW_M: f64 = 2e-4;

/// One quantity of a motion: its name and how to take it.
type Quantity = (&'static str, fn(&Motion) -> &[Option<f64>]);

const QUANTITIES: [Quantity; 4] =
    [("tip x", |m| &m.tip_x_m), ("head x", |m| &m.head_x_m), ("deflection", |m| &m.deflection_m), ("head drop", |m| &m.head_drop_m)];
/// Those of the zoom: the head's path is a parabola there.
const ZOOMED: [Quantity; 3] = [QUANTITIES[0], QUANTITIES[2], QUANTITIES[3]];

/// The figure as SVG.
#[must_use]
pub fn figure(history: &History) -> String {
    let whole = span(history);
    let mut panels: Vec<Panel> = QUANTITIES.iter().map(|q| panel(history, q, whole)).collect();
    if let Some(zoom) = history.zoom_s.filter(|(from, to)| from < to) {
        panels.extend(ZOOMED.iter().map(|q| panel(history, q, zoom)));
        for panel in panels.iter_mut().take(QUANTITIES.len()) {
            panel.bands.push(Band { label: "enlarged below".to_owned(), colour: Colour::Grey, from: zoom.0, to: zoom.1, ..Band::default() });
        }
    }
    let source = match (&history.measured, &history.model) {
        (Some(_), Some(_)) => "",
        (None, Some(_)) => "model alone: no traces are published",
        (Some(_), None) => "recording alone",
        (None, None) => "nothing to show",
    };
    svg(&Figure {
        title: history.title.clone(),
        subtitle: subtitle(history.synthetic, source),
        description: "Time histories of tip, head, deflection and head drop around the reversal of the head.".to_owned(),
        width_mm: FULL_WIDTH_MM,
        panels,
    })
}

/// First and last instant of the measured motion, else of the model's.
fn span(history: &History) -> (f64, f64) {
    let times = history.measured.as_ref().or(history.model.as_ref()).map_or(&[][..], |m| &m.time_s);
    match (times.first(), times.last()) {
        (Some(first), Some(last)) if first < last => (*first, *last),
        _ => (0.0, 1.0),
    }
}

fn panel(history: &History, (name, column): &Quantity, (from, to): (f64, f64)) -> Panel {
    let shown = |m: &Motion| -> Vec<Option<(f64, f64)>> {
        let inside = |t: &f64| *t >= from && *t <= to;
        m.time_s.iter().zip(column(m)).filter(|(t, _)| inside(t)).map(|(t, x)| x.map(|x| (*t, x))).collect()
    };
    let drawn = [&history.model, &history.measured].map(|m| m.as_ref().map(shown));
    let (unit, factor) = unit(drawn.iter().flatten().flatten().flatten().map(|(_, x)| *x));
    let looks = [("model", Colour::Vermilion, Mark::Thick), ("measured", Colour::Black, Mark::Thin)];
    let scaled = |points: Vec<Option<(f64, f64)>>| points.into_iter().map(|p| p.map(|(t, x)| (t, x * factor))).collect();
    let series = drawn.into_iter().zip(looks).filter_map(|(points, (label, colour, mark))| {
        points.map(|points| Series { label: label.to_owned(), colour, mark, points: scaled(points), ..Series::default() })
    });
    let stick = |(from, to): &(f64, f64)| Band { label: "tip sticks (model)".to_owned(), colour: Colour::SkyBlue, from: *from, to: *to, ..Band::default() };
    let labelled = *name == QUANTITIES[0].0; // the labels stand over the topmost panel, their lines run through all
    let rule = |(label, at): &(String, f64)| Rule {
        label: if labelled { label.clone() } else { String::new() },
        colour: Colour::Blue,
        mark: Mark::Dashed,
        at: *at,
        above: None,
    };
    Panel {
        x: Axis::linear("time, s").between(from, to),
        y: Axis::linear(format!("{name}, {unit}")),
        height_mm: HEIGHT_MM,
        series: series.collect(),
        bands: history.stick_s.iter().map(stick).collect(),
        rules: history.instants.iter().map(rule).collect(),
        ..Panel::default()
    }
}

/// Unit in which values of that span read best, and how many of it a metre has.
pub(super) fn unit(values: impl Iterator<Item = f64>) -> (&'static str, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    if high - low < MICROMETRES_BELOW_M && high.abs().max(low.abs()) < 10.0 * MICROMETRES_BELOW_M { ("\u{b5}m", 1e6) } else { ("mm", 1e3) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(amplitude_m: f64) -> Motion {
        let time_s: Vec<f64> = (0..500).map(|i| f64::from(i) * 1e-3).collect();
        let wave = |scale: f64| time_s.iter().map(|t| Some(scale * (20.0 * t).sin())).collect::<Vec<_>>();
        Motion {
            tip_x_m: wave(amplitude_m),
            head_x_m: wave(amplitude_m),
            deflection_m: wave(amplitude_m / 10.0),
            head_drop_m: wave(amplitude_m / 1000.0),
            time_s,
        }
    }

    #[test]
    fn a_synthetic_recording_says_so_and_one_without_traces_too() {
        let twin = History { synthetic: true, measured: Some(motion(0.01)), ..History::default() };
        assert!(figure(&twin).contains("synthetic recording"));
        let published = History { model: Some(motion(0.01)), ..History::default() };
        assert!(figure(&published).contains("model alone") && !figure(&published).contains(">measured"));
    }

    #[test]
    fn small_quantities_are_drawn_in_micrometres() {
        let drawn = figure(&History { measured: Some(motion(0.01)), ..History::default() });
        assert!(drawn.contains("tip x, mm") && drawn.contains("head drop, \u{b5}m"));
    }

    #[test]
    fn a_zoom_adds_three_panels() {
        let history = History { measured: Some(motion(0.01)), zoom_s: Some((0.1, 0.2)), ..History::default() };
        assert_eq!(figure(&history).matches("deflection, mm").count(), 2);
        assert_eq!(figure(&History { zoom_s: None, ..history }).matches("deflection, mm").count(), 1);
    }
}
