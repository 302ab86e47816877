//! Overview of a recording: its named windows and the analysed part.

use super::history::length_unit;
use crate::figures::full_figure;
use plain_charts::{ChartAxis, Colour, Figure, Mark, Panel, Series, ShadedSpan, TopLabel, VerticalLine};

/// A named part of a recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WindowSpan {
    /// Name, such as `stick`.
    pub name: String,
    /// Start, s.
    pub from_s: f64,
    /// End, s.
    pub to_s: f64,
}

/// Data of the figure; all columns have the length of `time_s`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WindowOverview {
    /// Heading.
    pub title: String,
    /// Quantity that was analysed, such as "deflection".
    pub quantity: String,
    /// Further text for the line under the heading; empty for none.
    pub note: String,
    /// Whether the motion is synthetic.
    pub synthetic: bool,
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// The quantity, m.
    pub channel_m: Vec<Option<f64>>,
    /// Position of the head along the sweep, m; if empty, its panel is left out.
    pub head_x_m: Vec<Option<f64>>,
    /// The named windows.
    pub windows: Vec<WindowSpan>,
    /// Start and end of the analysed part, s.
    pub analysed_s: Option<(f64, f64)>,
    /// Named instants, s.
    pub instants: Vec<(String, f64)>,
}

/// Height, mm, of the panel of the analysed quantity.
const HEIGHT_MM: f64 = 46.0;
/// Height, mm, of the panel of the head.
const HEAD_HEIGHT_MM: f64 = 26.0;
/// Colours of the windows, in the order of the windows.
const COLOURS: [Colour; 6] =
    [Colour::SkyBlue, Colour::Orange, Colour::Vermilion, Colour::Green, Colour::Purple, Colour::Grey];

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &WindowOverview) -> Figure {
    let mut panels = vec![draw_panel(shown, &shown.quantity, &shown.channel_m, HEIGHT_MM)];
    // only the topmost panel has names; the shaded spans cross both panels
    let label = |w: &WindowSpan| TopLabel { label: w.name.clone(), at: (w.from_s + w.to_s) / 2.0 };
    panels[0].top_labels = shown.windows.iter().map(label).collect();
    if !shown.head_x_m.is_empty() {
        let mut head = draw_panel(shown, "head x", &shown.head_x_m, HEAD_HEIGHT_MM);
        head.vertical_lines.iter_mut().for_each(|r| r.label.clear());
        panels.push(head);
    }
    full_figure(
        &shown.title,
        shown.synthetic,
        &shown.note,
        format!("Time history of {} over the whole recording with its named windows shaded.", shown.quantity),
        panels,
    )
}

fn draw_panel(shown: &WindowOverview, name: &str, values_m: &[Option<f64>], height_mm: f64) -> Panel {
    let (unit, factor) = length_unit(values_m.iter().flatten().copied().filter(|x| x.is_finite()));
    let points = shown.time_s.iter().zip(values_m).map(|(t, x)| x.map(|x| (*t, x * factor)));
    let rule = |(label, at): &(String, f64)| VerticalLine::new(label, Colour::Blue, Mark::Dashed, *at);
    let x = ChartAxis::time().with_ends(shown.time_s.first().copied().zip(shown.time_s.last().copied()));
    let y = ChartAxis::linear(format!("{name}, {unit}"));
    Panel {
        shaded_spans: window_spans(shown),
        vertical_lines: shown.instants.iter().map(rule).collect(),
        ..Panel::new(x, y, height_mm, [Series::new("", Colour::Black, Mark::Thin, points)])
    }
}

/// Shaded spans of the windows, with a frame around the analysed part.
fn window_spans(shown: &WindowOverview) -> Vec<ShadedSpan> {
    let shaded =
        |(w, colour): (&WindowSpan, &Colour)| ShadedSpan::new(w.name.clone(), *colour, w.from_s, w.to_s);
    let framed = shown.analysed_s.map(|(from, to)| ShadedSpan::outline("analysed", Colour::Black, from, to));
    shown.windows.iter().zip(COLOURS.iter().cycle()).map(shaded).chain(framed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use plain_charts::Medium;

    fn as_svg(shown: &WindowOverview) -> String {
        draw_figure(shown).to_svg(Medium::Screen)
    }

    fn example_windows() -> WindowOverview {
        let time_s: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3).collect();
        let window = |name: &str, from_s, to_s| WindowSpan { name: name.to_owned(), from_s, to_s };
        WindowOverview {
            quantity: "deflection".to_owned(),
            channel_m: time_s.iter().map(|t| Some(1e-3 * (9.0 * t).sin())).collect(),
            head_x_m: time_s.iter().map(|t| Some(0.1 * t)).collect(),
            time_s,
            windows: vec![
                window("before", 0.0, 0.4),
                window("stick", 0.4, 0.45),
                window("flip", 0.45, 0.47),
                window("after", 0.47, 0.99),
            ],
            analysed_s: Some((0.5, 0.7)),
            ..WindowOverview::default()
        }
    }

    #[test]
    fn every_window_is_named_over_the_panel_and_in_the_legend() {
        let drawn = as_svg(&example_windows());
        let named = |name: &str| drawn.matches(&format!("\n{name}\n")).count();
        assert_eq!(["before", "stick", "flip", "after", "analysed"].map(named), [2, 2, 2, 2, 1]);
        assert!(drawn.contains("deflection, mm") && drawn.contains("head x, mm"));
    }

    #[test]
    fn without_a_head_there_is_one_panel() {
        assert!(!as_svg(&WindowOverview { head_x_m: Vec::new(), ..example_windows() }).contains("head x"));
    }
}
