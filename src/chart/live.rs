//! What the script of a page has to know of a panel over time: where its axes are, and what belongs to what.

use super::axis::AxisScale;
use super::elements::{SampledSeries, Series};
use super::layout::PanelLayout;
use crate::text::make_printable;
use html_escape::encode_safe;
use std::fmt::Write;

/// What lies inside the axes and moves with their ends.
pub(super) const WITHIN_AXES_CLASS: &str = "class=\"within\"";
/// The ticks of the axis of time.
pub(super) const TICKS_CLASS: &str = "class=\"ticks\"";
/// What stands over the axes at an instant, and does not move.
pub(super) const OVER_AXES_CLASS: &str = "class=\"over\"";

/// Attributes of the group of a panel over time: the edges of its axes on the canvas, their ends, and the
/// name of the other quantity; `None` for any other panel.
pub(super) fn panel_attributes(placed: &PanelLayout) -> Option<String> {
    let (panel, area, x, y) = (placed.panel, &placed.area, &placed.x, &placed.y);
    let timed =
        panel.x.is_time() && !panel.bare && [x.low, x.high, y.low, y.high].iter().all(|end| end.is_finite());
    let scale = if y.scale == AxisScale::Log { "log" } else { "linear" };
    timed.then(|| {
        format!(
            "class=\"plot\" data-area=\"{} {} {} {}\" data-x=\"{} {}\" data-y=\"{} {} {scale}\" \
             data-label=\"{}\"{}",
            area.left,
            area.top,
            area.right,
            area.bottom,
            x.low,
            x.high,
            y.low,
            y.high,
            encode_safe(&make_printable(&panel.y.label)),
            if panel.heat_map.is_some() { " data-heat=\"1\"" } else { "" },
        )
    })
}

/// Attributes of the group of a series, with all of its values where it has more than are drawn.
pub(super) fn series_attributes(index: usize, series: &Series, placed: &PanelLayout) -> String {
    let label = encode_safe(&make_printable(&series.label)).into_owned();
    let detail = placed.panel.sampled_series.get(index).and_then(Option::as_ref);
    let detail = detail.map_or_else(String::new, |detail| sample_attributes(detail, placed));
    format!("class=\"series\" data-label=\"{label}\"{detail}")
}

/// Steps of a value between the ends of an axis: an enlarged curve is as fine as a screen.
const VALUE_STEPS: f64 = 1e4;

/// Start, step, the value of zero and of one; then every value as a difference to the one before, a dash for
/// a missing one.
fn sample_attributes(detail: &SampledSeries, placed: &PanelLayout) -> String {
    let (low, one) = (placed.y.low, (placed.y.high - placed.y.low) / VALUE_STEPS);
    let mut before = 0_i64;
    let mut values = String::new();
    for value in &detail.values {
        match value {
            Some(value) => {
                let now = ((value - low) / one).round() as i64;
                let _ = write!(values, "{} ", now - before); // (a string takes everything)
                before = now;
            }
            None => values.push_str("- "),
        }
    }
    format!(
        " data-grid=\"{} {} {low} {one}\" data-values=\"{}\"",
        detail.start,
        detail.step,
        values.trim_end()
    )
}
