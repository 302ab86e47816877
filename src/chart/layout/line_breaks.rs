//! Headings and labels in lines that fit.

use crate::chart::elements::Panel;
use crate::chart::figure::Figure;
use crate::chart::sizes::{EDGE_MM, TEXT_MM, TITLE_MM};
use crate::chart::text::{WIDE_BOLD_LETTER, WIDE_LETTER, wrap_lines};

/// Room between panels one below the other, mm.
pub(super) const PANEL_GAP_MM: f64 = 2.5;

/// The heading in lines that fit the figure; none for none.
pub(in crate::chart) fn title_lines(figure: &Figure) -> Vec<String> {
    if figure.title.is_empty() {
        Vec::new()
    } else {
        wrap_lines(&figure.title, WIDE_BOLD_LETTER * TITLE_MM, figure.width_mm - 2.0 * EDGE_MM)
    }
}

/// The line under the heading in lines that fit; none for none.
pub(in crate::chart) fn subtitle_lines(figure: &Figure) -> Vec<String> {
    if figure.subtitle.is_empty() {
        Vec::new()
    } else {
        wrap_lines(&figure.subtitle, WIDE_LETTER * TEXT_MM, figure.width_mm - 2.0 * EDGE_MM)
    }
}

/// The label of a y axis in lines that fit next to it.
pub(in crate::chart) fn y_label_lines(panel: &Panel) -> Vec<String> {
    if panel.y.label.is_empty() {
        Vec::new()
    } else {
        wrap_lines(&panel.y.label, WIDE_LETTER * TEXT_MM, panel.height_mm + PANEL_GAP_MM)
    }
}
