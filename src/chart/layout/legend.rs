//! The legend: its entries, and where they stand.

use super::line_breaks::{subtitle_lines, title_lines};
use crate::chart::elements::HatchPattern;
use crate::chart::figure::Figure;
use crate::chart::sizes::{EDGE_MM, LINE_MM, TEXT_MM};
use crate::chart::style::{Colour, Mark};
use crate::chart::text::{text_width, truncate_text};

/// An entry of the legend.
#[derive(Clone, Copy, PartialEq)]
pub(in crate::chart) enum LegendEntry<'a> {
    Series(&'a str, Colour, Mark),
    /// Filled, or outlined.
    Area(&'a str, Colour, bool),
    Hatch(&'a str, HatchPattern),
}

/// The entries of the legend with their places, and where the first panel may start; the legend stands over
/// the panels and covers nothing.
pub(super) fn place_legend(figure: &Figure) -> (Vec<(LegendEntry<'_>, f64, f64)>, f64) {
    let mut entries: Vec<LegendEntry<'_>> = Vec::new();
    for panel in &figure.panels {
        let series = panel.series.iter().map(|s| LegendEntry::Series(&s.label, s.colour, s.mark));
        let ribbons = panel.ribbons.iter().map(|r| LegendEntry::Area(&r.label, r.colour, false));
        let bands = panel.shaded_spans.iter().map(|b| LegendEntry::Area(&b.label, b.colour, b.outlined));
        let hatches = panel.hatches.iter().map(|h| LegendEntry::Hatch(&h.label, h.pattern));
        for entry in series.chain(ribbons).chain(bands).chain(hatches) {
            if !entry.label().is_empty() && !entries.contains(&entry) {
                entries.push(entry);
            }
        }
    }
    let mut y = EDGE_MM + (title_lines(figure).len() + subtitle_lines(figure).len()) as f64 * LINE_MM;
    let mut x = EDGE_MM;
    let mut placed = Vec::new();
    for entry in entries {
        let width = LEGEND_SAMPLE_MM + text_width(&legend_text(entry.label(), figure), TEXT_MM) + 3.0;
        if x > EDGE_MM && x + width > figure.width_mm - EDGE_MM {
            (x, y) = (EDGE_MM, y + LINE_MM);
        }
        placed.push((entry, x, y + LINE_MM / 2.0));
        x += width;
    }
    let end = if placed.is_empty() { y } else { y + LINE_MM };
    (placed, end + 1.0)
}

/// Room for the sample before an entry of the legend, mm.
const LEGEND_SAMPLE_MM: f64 = 8.0;

/// What stands in the legend: the label, as far as one line has room for it.
pub(in crate::chart) fn legend_text(label: &str, figure: &Figure) -> String {
    truncate_text(label, TEXT_MM, figure.width_mm - 2.0 * EDGE_MM - LEGEND_SAMPLE_MM)
}

impl<'a> LegendEntry<'a> {
    pub fn label(&self) -> &'a str {
        match self {
            Self::Series(label, ..) | Self::Area(label, ..) | Self::Hatch(label, _) => label,
        }
    }
}
