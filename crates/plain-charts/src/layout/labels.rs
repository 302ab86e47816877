//! Labels above a panel, in rows without overlap, and the legend.

use super::{subtitle_lines, title_lines};
use crate::axis::CanvasAxis;
use crate::elements::{HatchPattern, Panel};
use crate::figure::Figure;
use crate::style::{Colour, EDGE_MM, LINE_MM, Mark, SMALL_MM, TEXT_MM, UNITS_PER_MM};
use crate::text::{WIDE_BOLD_LETTER, WIDE_LETTER, text_width, truncate_text};

/// Maximum number of rows of labels above a panel. A label that fits into no row is left out, but its
/// vertical line is drawn.
const MAX_LABEL_ROWS: usize = 4;
/// Ratio of the width of bold letters to that of plain letters.
const BOLD_WIDTH_RATIO: f64 = WIDE_BOLD_LETTER / WIDE_LETTER;

/// Row of each label above a panel, chosen so that labels do not overlap: first the labels of the vertical
/// lines, then the top labels. Row 0 is next to the panel; top labels have the lowest rows. `None` if no row
/// is free.
pub(super) fn assign_label_rows(panel: &Panel, x: &CanvasAxis) -> Vec<Option<usize>> {
    let end = |line: &str| x.from + (text_width(line, SMALL_MM) * BOLD_WIDTH_RATIO + 1.0) * UNITS_PER_MM;
    let title_ends: Vec<f64> = panel.title.lines().rev().map(end).collect();
    let captions: Vec<_> = panel.top_labels.iter().map(|c| (c.label.as_str(), c.at)).collect();
    let captions = stack_labels(&captions, x, &title_ends);
    let taken = captions.iter().flatten().max().map_or(0, |row| row + 1);
    let free: &[f64] = if taken == 0 { &title_ends } else { &[] };
    let rules: Vec<_> = panel.vertical_lines.iter().map(|r| (r.label.as_str(), r.at)).collect();
    let rules = stack_labels(&rules, x, free);
    rules.into_iter().map(|row| row.map(|row| row + taken)).chain(captions).collect()
}

/// The lowest free row for every label, without overlap with the title. `title_ends` lists the right ends of
/// the title lines in canvas units, the lowest line first.
fn stack_labels(labels: &[(&str, f64)], x: &CanvasAxis, title_ends: &[f64]) -> Vec<Option<usize>> {
    let place = |at: f64| x.canvas_position(at).filter(|at| *at >= x.from && *at <= x.to);
    let mut order: Vec<(usize, f64)> =
        labels.iter().enumerate().filter_map(|(i, (_, at))| place(*at).map(|at| (i, at))).collect();
    portable_math::sort_by_number(&mut order, |a| a.1);
    let mut ends = [f64::NEG_INFINITY; MAX_LABEL_ROWS];
    ends.iter_mut().zip(title_ends).for_each(|(end, title)| *end = *title);
    let mut rows = vec![None; labels.len()];
    for (index, _) in order {
        let (label, at) = labels[index];
        if label.is_empty() {
            continue;
        }
        let (left, right) = label_span(label, at, x);
        if let Some(row) = ends.iter().position(|end| *end < left) {
            ends[row] = right + UNITS_PER_MM;
            rows[index] = Some(row);
        }
    }
    rows
}

/// Left and right end, in canvas units, of a label above the panel. The label is centred on its position, but
/// moved inside the axes.
pub(crate) fn label_span(label: &str, at: f64, x: &CanvasAxis) -> (f64, f64) {
    let width = text_width(&shorten_to_panel(label, x), SMALL_MM) * UNITS_PER_MM;
    let left = (x.canvas_position(at).unwrap_or(x.from) - width / 2.0).min(x.to - width).max(x.from);
    (left, left + width)
}

/// A label, truncated to the width of the panel.
pub(crate) fn shorten_to_panel(label: &str, x: &CanvasAxis) -> String {
    truncate_text(label, SMALL_MM, (x.to - x.from) / UNITS_PER_MM)
}

// Legend.

/// An entry of the legend.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum LegendEntry<'a> {
    Series(&'a str, Colour, Mark),
    Area(&'a str, Colour, bool),
    Hatch(&'a str, HatchPattern),
}

/// The entries of the legend with their positions in mm, and the position of the top of the first panel in
/// mm. The legend is above the panels.
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

/// Width, mm, of the graphic sample before the text of a legend entry.
const LEGEND_SAMPLE_MM: f64 = 8.0;

/// The text of a legend entry, truncated to one line.
pub(crate) fn legend_text(label: &str, figure: &Figure) -> String {
    truncate_text(label, TEXT_MM, figure.width_mm - 2.0 * EDGE_MM - LEGEND_SAMPLE_MM)
}

impl<'a> LegendEntry<'a> {
    pub(crate) fn label(&self) -> &'a str {
        match self {
            Self::Series(label, ..) | Self::Area(label, ..) | Self::Hatch(label, _) => label,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TopLabel, VerticalLine};

    #[test]
    fn captions_stand_next_to_the_panel_and_labels_of_rules_over_them() {
        let rule = |label: &str, at| VerticalLine { label: label.to_owned(), at, ..VerticalLine::default() };
        let captions = vec![TopLabel { label: "edge".to_owned(), at: 5.0 }];
        let panel = Panel {
            vertical_lines: vec![rule("a", 1.0), rule("", 2.0), rule("b", 20.0)],
            top_labels: captions,
            ..Panel::default()
        };
        let x = CanvasAxis { scale: Default::default(), low: 0.0, high: 10.0, from: 0.0, to: 1000.0 };
        assert_eq!(assign_label_rows(&panel, &x), [Some(1), None, None, Some(0)]);
    }

    #[test]
    fn labels_stand_beside_the_title_of_a_panel_or_over_it() {
        let rule = |at| VerticalLine { label: "truth".to_owned(), at, ..VerticalLine::default() };
        let panel = Panel {
            title: "identified".to_owned(),
            vertical_lines: vec![rule(1.0), rule(8.0)],
            ..Panel::default()
        };
        let x = CanvasAxis { scale: Default::default(), low: 0.0, high: 10.0, from: 0.0, to: 1000.0 };
        assert_eq!(assign_label_rows(&panel, &x), [Some(1), Some(0)]);
    }
}
