//! Components as symbols with error bars, and their labels.

use super::MICROMETRES;
use crate::text::{format_trimmed, format_with_sd};
use plain_charts::{Colour, ErrorBar, Mark, MarkerShape, Series, VerticalLine};

/// A component as it is drawn: frequency and amplitude with their standard deviations, or the range of a
/// drifting frequency.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LabelledComponent {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz.
    pub frequency_sd_hz: f64,
    /// Lowest and highest frequency of a drifting component, Hz.
    pub range_hz: Option<(f64, f64)>,
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Standard deviation of the amplitude, m.
    pub amplitude_sd_m: f64,
    /// Remark after the frequency, such as `alias?`; empty for a clear component.
    pub remark: String,
}

impl LabelledComponent {
    /// Label: the frequency with its standard deviation in units of its last digit, or the range of a
    /// drifting frequency; then the remark.
    pub(crate) fn label_text(&self) -> String {
        let frequency = match self.range_hz {
            Some((low, high)) => format!("{} to {} Hz", format_trimmed(low, 4), format_trimmed(high, 4)),
            None => format!("{} Hz", format_with_sd(self.frequency_hz, self.frequency_sd_hz)),
        };
        if self.remark.is_empty() { frequency } else { format!("{frequency}, {}", self.remark) }
    }

    fn is_clear(&self) -> bool {
        self.remark.is_empty()
    }

    /// Frequency, Hz, and amplitude, micrometres, as drawn.
    fn axis_point(&self) -> (f64, f64) {
        (self.frequency_hz, self.amplitude_m * MICROMETRES)
    }

    fn error_bars(&self) -> [ErrorBar; 2] {
        let (x, y) = self.axis_point();
        let (dx, dy) = (2.0 * self.frequency_sd_hz, 2.0 * self.amplitude_sd_m * MICROMETRES);
        let (from, to) = self.range_hz.unwrap_or((x - dx, x + dx));
        [ErrorBar::Horizontal { y, from, to }, ErrorBar::Vertical { x, from: y - dy, to: y + dy }]
    }

    /// Upper end of the amplitude's error bar, m.
    pub(super) fn top_m(&self) -> f64 {
        let sd_m = if self.amplitude_sd_m.is_finite() { self.amplitude_sd_m } else { 0.0 };
        self.amplitude_m + 2.0 * sd_m
    }
}

/// Appearance of the components of one source: legend entry, colour, symbol.
type ComponentLook = (&'static str, Colour, MarkerShape);
/// Appearances of components without and with a remark, if there is only one source.
const ALONE: [ComponentLook; 2] = [
    ("component \u{b1} 2 sd", Colour::Blue, MarkerShape::Disc),
    ("component that is not clear", Colour::Vermilion, MarkerShape::Diamond),
];
/// Appearances if recording and model share a panel; the model's curve is vermilion.
const MEASURED: [ComponentLook; 2] = [
    ("measured \u{b1} 2 sd", Colour::Black, MarkerShape::Disc),
    ("measured, not clear", Colour::Black, MarkerShape::Diamond),
];
const MODEL: [ComponentLook; 2] = [
    ("model \u{b1} 2 sd", Colour::Vermilion, MarkerShape::Square),
    ("model, not clear", Colour::Vermilion, MarkerShape::InvertedTriangle),
];

/// The components of a recording and of a model as symbols with error bars.
pub(super) fn component_series(measured: &[LabelledComponent], model: &[LabelledComponent]) -> Vec<Series> {
    let styles = if model.is_empty() { ALONE } else { MEASURED };
    source_series(model, MODEL).chain(source_series(measured, styles)).collect()
}

fn source_series(
    components: &[LabelledComponent],
    [clear, not_clear]: [ComponentLook; 2],
) -> impl Iterator<Item = Series> {
    let of = |((label, colour, shape), is_clear): (ComponentLook, bool)| {
        let shown = || components.iter().filter(move |c| c.is_clear() == is_clear);
        Series {
            error_bars: shown().flat_map(LabelledComponent::error_bars).collect(),
            ..Series::new(label, colour, Mark::Hollow(shape), shown().map(|c| Some(c.axis_point())))
        }
    };
    [(clear, true), (not_clear, false)].map(of).into_iter().filter(|s| !s.points.is_empty())
}

/// Labels above the panel, with lines to their symbols. There are at most `most` labels; clear components
/// come first.
pub(super) fn component_labels(
    components: &[LabelledComponent],
    most: usize,
) -> impl Iterator<Item = VerticalLine> {
    let mut order: Vec<&LabelledComponent> = components.iter().collect();
    order.sort_by_key(|c| !c.is_clear()); // (stable, so that components otherwise keep the order of the list)
    order.into_iter().take(most).map(|c| VerticalLine {
        above: Some(c.axis_point().1),
        ..VerticalLine::new(c.label_text(), Colour::Grey, Mark::Dotted, c.frequency_hz)
    })
}
