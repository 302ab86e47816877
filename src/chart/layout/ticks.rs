//! Ticks of a y axis, and how wide their labels are.

use crate::chart::axis::{self, AxisScale, CanvasAxis, Tick};
use crate::chart::elements::Panel;
use crate::chart::sizes::{LINE_MM, SMALL_MM, TEXT_MM, UNITS_PER_MM, Y_LOG_TICKS_MM, Y_TICKS_MM};
use crate::chart::text::{text_width, truncate_text, wrap_in_two_lines};

/// Largest share of a column that the names along a y axis, or of the height of the axes that those under an
/// x axis may take.
pub(super) const MOST_NAMES: f64 = 0.4;
/// Room for a label of five digits, whose middle stands at the end of the axis.
pub(super) const HALF_LABEL_MM: f64 = 2.0;
/// Least distance of labelled ticks on a low y axis that has only one of them otherwise, mm: that of lines of
/// text.
const CROWDED_Y_TICKS_MM: f64 = LINE_MM;
/// Height of a line of small letters that has another one over or under it, mm.
pub(in crate::chart) const SMALL_LINE_MM: f64 = SMALL_MM + 0.1;
/// Room between names of two lines: what belongs together stands closer.
const BETWEEN_NAMES_MM: f64 = 0.6;

/// Whether two ticks have numbers at least: one alone says nothing of the scale.
pub(super) fn shows_scale(ticks: &[Tick]) -> bool {
    ticks.iter().filter(|tick| tick.label.is_some()).nth(1).is_some()
}

/// Ticks of a y axis, whose names may be so wide; longer ones stand in two lines of small letters where the
/// places are that far apart.
pub(super) fn y_axis_ticks(panel: &Panel, y: &CanvasAxis, names_mm: f64) -> Vec<Tick> {
    if panel.y.categories.is_empty() {
        let usual_mm = if y.scale == AxisScale::Log { Y_LOG_TICKS_MM } else { Y_TICKS_MM };
        let [usual, crowded] = [usual_mm, CROWDED_Y_TICKS_MM].map(|mm| y.ticks(mm * UNITS_PER_MM));
        return if shows_scale(&usual) { usual } else { crowded };
    }
    let apart_mm = (y.to - y.from).abs() / UNITS_PER_MM / (y.high - y.low).max(1.0);
    let in_two = apart_mm >= 2.0 * SMALL_LINE_MM + BETWEEN_NAMES_MM;
    axis::category_ticks(&panel.y, |name| {
        if in_two { wrap_in_two_lines(name, names_mm) } else { truncate_text(name, TEXT_MM, names_mm) }
    })
}

/// Width of the widest label of a y axis, mm.
pub(in crate::chart) fn widest_label_mm(ticks: &[Tick]) -> f64 {
    let width = |label: &str| match label.split_once('\n') {
        Some((first, second)) => text_width(first, SMALL_MM).max(text_width(second, SMALL_MM)),
        None => text_width(label, TEXT_MM),
    };
    ticks.iter().filter_map(|t| t.label.as_deref()).map(width).fold(6.0, f64::max)
}
