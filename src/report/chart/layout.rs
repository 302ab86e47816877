//! Where everything of a figure stands: heading, legend, panels and the labels over them. Lengths in mm until the panels.

use super::axis::{self, Mapped};
use super::path::Area;
use super::{Colour, EDGE_MM, Figure, LINE_MM, Mark, Panel, Rule, SMALL_MM, TEXT_MM, TICK_MM, UNITS, Y_TICKS_MM};

/// Mean width of a letter of a sans-serif face over its size; widths of text can only be estimated.
const LETTER: f64 = 0.58;
const GAP_MM: f64 = 2.5;
/// Rows of labels over a panel; further labels are left out, their lines stay.
const MOST_ROWS: usize = 4;

/// Estimated width of text, mm.
fn text_width(text: &str, size_mm: f64) -> f64 {
    text.chars().count() as f64 * LETTER * size_mm
}

/// A panel with its place; lengths in mm.
pub(super) struct Placed<'a> {
    pub panel: &'a Panel,
    pub x: Mapped,
    pub y: Mapped,
    pub area: Area,
    /// Whether the ticks of the x axis are labelled here.
    pub last: bool,
    /// Row over the panel of every rule's label.
    pub rows: Vec<Option<usize>>,
}

pub(super) struct Layout<'a> {
    pub height: f64,
    pub legend: Vec<(Entry<'a>, f64, f64)>,
    pub panels: Vec<Placed<'a>>,
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Entry<'a> {
    Series(&'a str, Colour, Mark),
    Band(&'a str, Colour),
}

impl<'a> Layout<'a> {
    pub(super) fn of(figure: &'a Figure) -> Self {
        let (legend, mut top) = legend(figure);
        let ranges = x_ranges(&figure.panels);
        let left = left_margin(figure);
        let mut panels = Vec::new();
        for (index, (panel, (low, high))) in figure.panels.iter().zip(&ranges).enumerate() {
            let (from, to) = ((left * UNITS).round(), ((figure.width_mm - EDGE_MM - 2.0) * UNITS).round());
            let x = Mapped { scale: panel.x.scale, low: *low, high: *high, from, to };
            let rows = label_rows(panel, &x);
            top += rows.iter().flatten().max().map_or(0.0, |row| (row + 1) as f64 * (SMALL_MM + 0.6)) + 0.5;
            let area = Area { left: from, right: to, top: (top * UNITS).round(), bottom: ((top + panel.height_mm) * UNITS).round() };
            let (y_low, y_high) = axis::ends(&panel.y, visible(panel, *low, *high));
            let y = Mapped { scale: panel.y.scale, low: y_low, high: y_high, from: area.bottom, to: area.top };
            let last = figure.panels.get(index + 1).is_none_or(|next| next.x != panel.x);
            top += panel.height_mm + GAP_MM + if last { 2.0 * LINE_MM } else { 0.0 };
            panels.push(Placed { panel, x, y, area, last, rows });
        }
        Self { height: top.max(LINE_MM), legend, panels }
    }
}

/// Values of y within the ends of x.
fn visible(panel: &Panel, low: f64, high: f64) -> impl Iterator<Item = f64> {
    let points = panel.series.iter().flat_map(|s| s.points.iter().flatten());
    points.filter(move |(x, _)| *x >= low && *x <= high).map(|(_, y)| *y)
}

/// Ends of the x axis of every panel, common to neighbours that share it.
fn x_ranges(panels: &[Panel]) -> Vec<(f64, f64)> {
    let values = |p: &'_ Panel| p.series.iter().flat_map(|s| s.points.iter().flatten().map(|(x, _)| *x)).collect::<Vec<_>>();
    let groups = panels.chunk_by(|a, b| a.x == b.x);
    groups
        .flat_map(|group| {
            let all = group.iter().flat_map(values);
            let (low, high) = group.first().map_or((0.0, 1.0), |first| axis::ends(&first.x, all));
            vec![(low, high); group.len()]
        })
        .collect()
}

/// Room for the widest label of a y axis and its title, mm.
fn left_margin(figure: &Figure) -> f64 {
    let widest = |panel: &Panel| {
        let (low, high) = axis::ends(&panel.y, visible(panel, f64::NEG_INFINITY, f64::INFINITY));
        let ticks = Mapped { scale: panel.y.scale, low, high, from: 0.0, to: panel.height_mm }.ticks(Y_TICKS_MM);
        ticks.iter().filter_map(|t| t.label.as_deref()).map(|l| text_width(l, TEXT_MM)).fold(0.0, f64::max)
    };
    figure.panels.iter().map(widest).fold(6.0, f64::max) + TICK_MM + LINE_MM + EDGE_MM + 1.0
}

/// The entries of the legend with their places, and where the first panel may start; the legend stands over the panels and covers nothing.
fn legend(figure: &Figure) -> (Vec<(Entry<'_>, f64, f64)>, f64) {
    const SAMPLE_MM: f64 = 8.0;
    let mut entries: Vec<Entry<'_>> = Vec::new();
    for panel in &figure.panels {
        let series = panel.series.iter().map(|s| Entry::Series(&s.label, s.colour, s.mark));
        for entry in series.chain(panel.bands.iter().map(|b| Entry::Band(&b.label, b.colour))) {
            if !entry.label().is_empty() && !entries.contains(&entry) {
                entries.push(entry);
            }
        }
    }
    let mut y = EDGE_MM + LINE_MM + if figure.subtitle.is_empty() { 0.0 } else { LINE_MM };
    let mut x = EDGE_MM;
    let mut placed = Vec::new();
    for entry in entries {
        let width = SAMPLE_MM + text_width(entry.label(), TEXT_MM) + 3.0;
        if x > EDGE_MM && x + width > figure.width_mm - EDGE_MM {
            (x, y) = (EDGE_MM, y + LINE_MM);
        }
        placed.push((entry, x, y + LINE_MM / 2.0));
        x += width;
    }
    let end = if placed.is_empty() { y } else { y + LINE_MM };
    (placed, end + 1.0)
}

impl<'a> Entry<'a> {
    pub(super) fn label(&self) -> &'a str {
        match self {
            Self::Series(label, ..) | Self::Band(label, _) => label,
        }
    }
}

/// Row of every rule's label such that none overlaps another.
fn label_rows(panel: &Panel, x: &Mapped) -> Vec<Option<usize>> {
    let mut order: Vec<(usize, f64)> =
        panel.rules.iter().enumerate().filter_map(|(i, rule)| x.place(rule.at).filter(|at| *at >= x.from && *at <= x.to).map(|at| (i, at))).collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut ends = [f64::NEG_INFINITY; MOST_ROWS];
    let mut rows = vec![None; panel.rules.len()];
    for (index, _) in order {
        let rule = &panel.rules[index];
        if rule.label.is_empty() {
            continue;
        }
        let (left, right) = label_span(rule, x);
        if let Some(row) = ends.iter().position(|end| *end < left) {
            ends[row] = right + UNITS;
            rows[index] = Some(row);
        }
    }
    rows
}

/// Left and right end of a rule's label: centred on the rule, moved inside the axes.
pub(super) fn label_span(rule: &Rule, x: &Mapped) -> (f64, f64) {
    let width = text_width(&rule.label, SMALL_MM) * UNITS;
    let left = (x.place(rule.at).unwrap_or(x.from) - width / 2.0).min(x.to - width).max(x.from);
    (left, left + width)
}
