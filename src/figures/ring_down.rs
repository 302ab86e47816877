//! Ring-down: data with the fit, the residual, and the decaying component alone.

use super::full_figure;
use super::history::{length_unit, thin_points};
use crate::text::format_with_sd;
use plain_charts::{ChartAxis, Colour, Figure, Mark, Panel, Ribbon, Series};
use short_spectra::Component;

/// Displacement as a function of time; both columns have the same length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RingDownTrace {
    /// Instants, s, on the clock of the recording.
    pub time_s: Vec<f64>,
    /// Displacement, m; `None` interrupts the curve.
    pub displacement_m: Vec<Option<f64>>,
}

/// One decaying component alone.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ComponentDecay {
    /// Name, such as `78.4(2) Hz, damping 5.0(3) %`.
    pub name: String,
    /// The fitted component.
    pub fitted: RingDownTrace,
    /// Upper envelope of the component.
    pub envelope: RingDownTrace,
    /// The data minus the trend and the other components.
    pub data: RingDownTrace,
}

/// Data of a ring-down figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RingDown {
    /// Heading.
    pub title: String,
    /// Quantity, such as "deflection".
    pub quantity: String,
    /// Window and fitted terms, for the line under the heading; empty for none.
    pub note: String,
    /// Whether the motion is synthetic.
    pub synthetic: bool,
    /// The data.
    pub data: RingDownTrace,
    /// Sum of trend and decaying sinusoids, sampled for drawing.
    pub fitted: RingDownTrace,
    /// The trend alone; empty for none.
    pub trend: RingDownTrace,
    /// Data minus fit.
    pub residual: RingDownTrace,
    /// Standard deviation of the noise, m.
    pub noise_sd_m: Option<f64>,
    /// The component that is drawn alone.
    pub decay: Option<ComponentDecay>,
}

/// Height, mm, of the panel of data and fit.
const HEIGHT_MM: f64 = 48.0;
/// Height, mm, of the panel of the residual.
const RESIDUAL_HEIGHT_MM: f64 = 24.0;
/// Height, mm, of the panel of the decaying component.
const DECAY_HEIGHT_MM: f64 = 42.0;

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &RingDown) -> Figure {
    let mut panels = vec![draw_whole_panel(shown), draw_residual_panel(shown)];
    panels.extend(shown.decay.as_ref().map(draw_decay_panel));
    let ends = time_span(shown);
    panels.iter_mut().for_each(|panel| panel.x = ChartAxis::time().with_ends(ends));
    full_figure(
        &shown.title,
        shown.synthetic,
        &shown.note,
        format!(
            "Ring-down of {}: data, the sum of trend and decaying sinusoids, and the rest.",
            shown.quantity
        ),
        panels,
    )
}

/// Heading: frequency and damping of a component.
pub(crate) fn figure_title(quantity: &str, component: &Component) -> String {
    let frequency = format_with_sd(component.frequency_hz, component.frequency_sd_hz);
    let damping = component.damping_ratio.zip(component.damping_ratio_sd);
    let words = |(ratio, sd)| format!(" with a damping ratio of {}", format_with_sd(ratio, sd));
    let damping = damping.map_or_else(String::new, words);
    format!("The {quantity} rings at {frequency} Hz{damping}")
}

/// Start and end of data and fit, s.
fn time_span(shown: &RingDown) -> Option<(f64, f64)> {
    let times = || shown.data.time_s.iter().chain(&shown.fitted.time_s).copied().filter(|t| t.is_finite());
    let (first, last) = (times().reduce(f64::min)?, times().reduce(f64::max)?);
    (first < last).then_some((first, last))
}

/// A panel of traces in a suitable unit, with the factor from metres to that unit.
fn draw_traces(name: &str, height_mm: f64, traces: &[(&str, Colour, Mark, &RingDownTrace)]) -> (Panel, f64) {
    let values = traces.iter().flat_map(|(.., t)| t.displacement_m.iter().flatten().copied());
    let (unit, factor) = length_unit(values.filter(|x| x.is_finite()));
    let series = |(label, colour, mark, trace): &(&str, Colour, Mark, &RingDownTrace)| {
        Series::new(*label, *colour, *mark, thin_trace(trace, factor))
    };
    let drawn = traces.iter().filter(|(.., t)| !t.time_s.is_empty()).map(series);
    let y = ChartAxis::linear(format!("{name}, {unit}"));
    (Panel::new(ChartAxis::default(), y, height_mm, drawn), factor)
}

/// The points in the unit of the axis, thinned to what a figure can show.
fn thin_trace(trace: &RingDownTrace, factor: f64) -> Vec<Option<(f64, f64)>> {
    let points = trace.time_s.iter().zip(&trace.displacement_m);
    let points: Vec<_> = points.map(|(t, x)| x.map(|x| (*t, x * factor))).collect();
    match (trace.time_s.first(), trace.time_s.last()) {
        (Some(first), Some(last)) => thin_points(&points, (*first, *last)),
        _ => points,
    }
}

/// Dots if neighbouring dots are distinct at the width of a journal column; otherwise a line, which also
/// makes a smaller file.
fn frame_mark(trace: &RingDownTrace) -> Mark {
    const MOST_DOTS: usize = 400;
    if trace.time_s.len() > MOST_DOTS { Mark::Thin } else { Mark::Dots }
}

fn draw_whole_panel(shown: &RingDown) -> Panel {
    let traces = [
        ("data", Colour::Grey, frame_mark(&shown.data), &shown.data),
        // this curve is not called a fit, since the sum is not a model of the blade
        ("trend + oscillations", Colour::Vermilion, Mark::Line, &shown.fitted),
        ("trend", Colour::Blue, Mark::ThinDashed, &shown.trend),
    ];
    draw_traces(&shown.quantity, HEIGHT_MM, &traces).0
}

/// Data minus fit, with a band for the noise.
fn draw_residual_panel(shown: &RingDown) -> Panel {
    let trace = ("", Colour::Grey, frame_mark(&shown.residual), &shown.residual);
    let (mut panel, factor) = draw_traces("rest", RESIDUAL_HEIGHT_MM, &[trace]);
    let width = shown.noise_sd_m.filter(|sd| sd.is_finite() && *sd > 0.0).map(|sd| 2.0 * sd * factor);
    if let Some((width, (first, last))) = width.zip(time_span(shown)) {
        let points = [first, last].map(|t| (t, -width, width));
        panel.ribbons.push(Ribbon::new("noise \u{b1} 2 sd", Colour::SkyBlue, points));
    }
    panel
}

/// The component alone, between its two envelopes.
fn draw_decay_panel(shown: &ComponentDecay) -> Panel {
    let below = RingDownTrace {
        displacement_m: shown.envelope.displacement_m.iter().map(|x| x.map(|x| -x)).collect(),
        ..shown.envelope.clone()
    };
    let traces = [
        ("data without the rest", Colour::Grey, frame_mark(&shown.data), &shown.data),
        ("envelope", Colour::Blue, Mark::Dashed, &shown.envelope),
        ("", Colour::Blue, Mark::Dashed, &below),
        (shown.name.as_str(), Colour::Vermilion, Mark::Line, &shown.fitted),
    ];
    draw_traces("component", DECAY_HEIGHT_MM, &traces).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use plain_charts::Medium;

    fn as_svg(shown: &RingDown) -> String {
        draw_figure(shown).to_svg(Medium::Screen)
    }

    fn trace(amplitude_m: f64) -> RingDownTrace {
        let time_s: Vec<f64> = (0..100).map(|i| 0.5 + f64::from(i) * 1e-3).collect();
        RingDownTrace {
            displacement_m: time_s.iter().map(|t| Some(amplitude_m * (490.0 * t).sin())).collect(),
            time_s,
        }
    }

    fn example_ring_down() -> RingDown {
        RingDown {
            quantity: "deflection".to_owned(),
            data: trace(1e-3),
            fitted: trace(1e-3),
            residual: trace(1e-6),
            noise_sd_m: Some(1e-6),
            ..RingDown::default()
        }
    }

    #[test]
    fn every_panel_has_its_own_unit() {
        let drawn = as_svg(&example_ring_down());
        assert!(
            drawn.contains("deflection, mm")
                && drawn.contains("rest, \u{b5}m")
                && drawn.contains("noise \u{b1} 2 sd")
        );
        assert!(!as_svg(&RingDown { noise_sd_m: Some(f64::NAN), ..example_ring_down() }).contains("noise"));
    }

    #[test]
    fn many_frames_are_a_line_and_few_bytes() {
        let long = |value: fn(i32) -> f64| RingDownTrace {
            time_s: (0..8000).map(|i| f64::from(i) * 1e-4).collect(),
            displacement_m: (0..8000).map(|i| Some(1e-5 * value(i))).collect(),
        };
        let (noisy, smooth, slow) = (
            long(|i| f64::from(i * 7919 % 100)),
            long(|i| (f64::from(i) * 0.1).sin()),
            long(|i| 1.0 - f64::from(i) * 1e-4),
        );
        let decay = ComponentDecay {
            fitted: smooth.clone(),
            envelope: slow.clone(),
            data: noisy.clone(),
            ..ComponentDecay::default()
        };
        let drawn = RingDown {
            data: noisy.clone(),
            fitted: smooth,
            trend: slow,
            residual: noisy,
            decay: Some(decay),
            ..RingDown::default()
        };
        assert_eq!(
            [&drawn, &example_ring_down()].map(|shown| draw_figure(shown).panels[0].series[0].mark),
            [Mark::Thin, Mark::Dots]
        );
        assert!(as_svg(&drawn).len() < 200_000, "{}", as_svg(&drawn).len());
    }

    #[test]
    fn the_component_alone_is_a_third_panel_under_one_axis() {
        let decay = ComponentDecay {
            name: "78.4(2) Hz".to_owned(),
            fitted: trace(1e-5),
            envelope: trace(1e-5),
            data: trace(1e-5),
        };
        let drawn = as_svg(&RingDown { decay: Some(decay), ..example_ring_down() });
        assert!(
            drawn.contains("component, \u{b5}m")
                && drawn.contains("78.4(2) Hz")
                && drawn.contains("envelope")
        );
        assert_eq!(drawn.matches("\ntime, s\n").count(), 1);
    }
}
