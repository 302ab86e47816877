//! Where everything of a figure stands: heading, legend, panels and the labels over them. Lengths in mm until the panels.

use super::axis::{self, Mapped};
use super::heat;
use super::path::Area;
use super::{Bar, Colour, EDGE_MM, Figure, LINE_MM, Mark, Panel, Pattern, SMALL_MM, TEXT_MM, TICK_MM, TITLE_MM, UNITS, Y_TICKS_MM};

/// Mean width of a letter of a sans-serif face over its size; widths of text can only be estimated.
const LETTER: f64 = 0.58;
/// The same of the widest face that browsers fall back on (DejaVu Sans), and of its bold letters: lines of text must fit in it.
const WIDE_LETTER: f64 = 0.63;
const WIDE_BOLD_LETTER: f64 = 0.7;
const GAP_MM: f64 = 2.5;
/// Rows of labels over a panel; further labels are left out, their lines stay.
const MOST_ROWS: usize = 4;

/// Estimated width of text, mm.
pub(super) fn text_width(text: &str, size_mm: f64) -> f64 {
    text.chars().count() as f64 * LETTER * size_mm
}

/// The heading in lines that fit the figure; an empty one takes its line too.
pub(super) fn title_lines(figure: &Figure) -> Vec<String> {
    lines(&figure.title, WIDE_BOLD_LETTER * TITLE_MM, figure.width_mm)
}

/// The line under the heading in lines that fit; none for none.
pub(super) fn subtitle_lines(figure: &Figure) -> Vec<String> {
    if figure.subtitle.is_empty() { Vec::new() } else { lines(&figure.subtitle, WIDE_LETTER * TEXT_MM, figure.width_mm) }
}

/// Text broken at spaces; a word that is wider than a line is broken in itself.
fn lines(text: &str, letter_mm: f64, width_mm: f64) -> Vec<String> {
    let most = ((width_mm - 2.0 * EDGE_MM) / letter_mm).max(1.0) as usize;
    let mut lines = vec![String::new()];
    let mut used = 0;
    for word in text.split_inclusive(' ') {
        let length = word.trim_end().chars().count();
        if used > 0 && used + length > most {
            lines.push(String::new());
            used = 0;
        }
        for letter in word.chars() {
            if used == most && letter != ' ' {
                lines.push(String::new());
                used = 0;
            }
            if let Some(line) = lines.last_mut() {
                line.push(letter);
            }
            used += 1;
        }
    }
    lines
}

/// A panel with its place; lengths in mm.
pub(super) struct Placed<'a> {
    pub panel: &'a Panel,
    pub x: Mapped,
    pub y: Mapped,
    pub area: Area,
    /// Whether the ticks of the x axis are labelled here.
    pub last: bool,
    /// Row over the panel of the label of every rule, then of every caption.
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
    /// Filled, or outlined.
    Area(&'a str, Colour, bool),
    Hatch(&'a str, Pattern),
}

impl<'a> Layout<'a> {
    pub(super) fn of(figure: &'a Figure) -> Self {
        let (legend, mut top) = legend(figure);
        let ranges = x_ranges(&figure.panels);
        let (left, right) = (left_margin(figure), right_margin(figure));
        let mut panels = Vec::new();
        for (index, (panel, (low, high))) in figure.panels.iter().zip(&ranges).enumerate() {
            let (from, to) = ((left * UNITS).round(), ((figure.width_mm - right) * UNITS).round());
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
    let bars = panel.series.iter().flat_map(|s| &s.bars).flat_map(|bar| match bar {
        Bar::Vertical { x, from, to } => [(*x, *from), (*x, *to)],
        Bar::Horizontal { y, from, to } => [(*from, *y), (*to, *y)],
    });
    let ribbons = panel.ribbons.iter().flat_map(|r| r.points.iter().flatten()).flat_map(|(x, low, high)| [(*x, *low), (*x, *high)]);
    let all = points.copied().chain(bars).chain(ribbons);
    all.filter(move |(x, _)| *x >= low && *x <= high).map(|(_, y)| y).chain(panel.heat.iter().flat_map(|h| h.y.iter().copied()))
}

/// Ends of the x axis of every panel, common to neighbours that share it.
fn x_ranges(panels: &[Panel]) -> Vec<(f64, f64)> {
    let values = |p: &'_ Panel| {
        let points = p.series.iter().flat_map(|s| s.points.iter().flatten().map(|(x, _)| *x));
        let ribbons = p.ribbons.iter().flat_map(|r| r.points.iter().flatten().map(|(x, ..)| *x));
        points.chain(ribbons).chain(p.heat.iter().flat_map(|h| h.x.iter().copied())).collect::<Vec<_>>()
    };
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

/// Room beside the panels, mm: for the colour bar of a heat map, where there is one.
fn right_margin(figure: &Figure) -> f64 {
    let bars = figure.panels.iter().filter_map(|p| p.heat.as_ref().map(|h| heat::bar_width_mm(h, p.height_mm)));
    EDGE_MM + bars.fold(2.0, f64::max)
}

/// The entries of the legend with their places, and where the first panel may start; the legend stands over the panels and covers nothing.
fn legend(figure: &Figure) -> (Vec<(Entry<'_>, f64, f64)>, f64) {
    const SAMPLE_MM: f64 = 8.0;
    let mut entries: Vec<Entry<'_>> = Vec::new();
    for panel in &figure.panels {
        let series = panel.series.iter().map(|s| Entry::Series(&s.label, s.colour, s.mark));
        let ribbons = panel.ribbons.iter().map(|r| Entry::Area(&r.label, r.colour, false));
        let bands = panel.bands.iter().map(|b| Entry::Area(&b.label, b.colour, b.outlined));
        let hatches = panel.hatches.iter().map(|h| Entry::Hatch(&h.label, h.pattern));
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
            Self::Series(label, ..) | Self::Area(label, ..) | Self::Hatch(label, _) => label,
        }
    }
}

/// Row of every label over the panel such that none overlaps another: those of the rules, then the captions, which stand next to the panel.
fn label_rows(panel: &Panel, x: &Mapped) -> Vec<Option<usize>> {
    let captions = rows(&panel.captions.iter().map(|c| (c.label.as_str(), c.at)).collect::<Vec<_>>(), x);
    let taken = captions.iter().flatten().max().map_or(0, |row| row + 1);
    let rules = rows(&panel.rules.iter().map(|r| (r.label.as_str(), r.at)).collect::<Vec<_>>(), x);
    rules.into_iter().map(|row| row.map(|row| row + taken)).chain(captions).collect()
}

/// The lowest row for every label with its place such that none overlaps another.
fn rows(labels: &[(&str, f64)], x: &Mapped) -> Vec<Option<usize>> {
    let place = |at: f64| x.place(at).filter(|at| *at >= x.from && *at <= x.to);
    let mut order: Vec<(usize, f64)> = labels.iter().enumerate().filter_map(|(i, (_, at))| place(*at).map(|at| (i, at))).collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut ends = [f64::NEG_INFINITY; MOST_ROWS];
    let mut rows = vec![None; labels.len()];
    for (index, _) in order {
        let (label, at) = labels[index];
        if label.is_empty() {
            continue;
        }
        let (left, right) = label_span(label, at, x);
        if let Some(row) = ends.iter().position(|end| *end < left) {
            ends[row] = right + UNITS;
            rows[index] = Some(row);
        }
    }
    rows
}

/// Left and right end of a label over the panel: centred on its place, moved inside the axes.
pub(super) fn label_span(label: &str, at: f64, x: &Mapped) -> (f64, f64) {
    let width = text_width(label, SMALL_MM) * UNITS;
    let left = (x.place(at).unwrap_or(x.from) - width / 2.0).min(x.to - width).max(x.from);
    (left, left + width)
}

#[cfg(test)]
mod tests {
    use super::super::{Caption, Rule};
    use super::*;

    #[test]
    fn long_text_is_broken_at_words_and_long_words_in_themselves() {
        let width_mm = 2.0 * EDGE_MM + 10.5; // ten letters of 1 mm
        let broken = |text: &str| lines(text, 1.0, width_mm);
        assert_eq!(broken("one two three four"), ["one two ", "three four"]);
        assert_eq!(broken("abcdefghijklmno pq"), ["abcdefghij", "klmno pq"]);
        assert_eq!([broken("exactlyten"), broken("")], [[String::from("exactlyten")], [String::new()]]);
    }

    #[test]
    fn captions_stand_next_to_the_panel_and_labels_of_rules_over_them() {
        let rule = |label: &str, at| Rule { label: label.to_owned(), at, ..Rule::default() };
        let captions = vec![Caption { label: "flip".to_owned(), at: 5.0 }];
        let panel = Panel { rules: vec![rule("a", 1.0), rule("", 2.0), rule("b", 20.0)], captions, ..Panel::default() };
        let x = Mapped { scale: Default::default(), low: 0.0, high: 10.0, from: 0.0, to: 1000.0 };
        assert_eq!(label_rows(&panel, &x), [Some(1), None, None, Some(0)]);
    }
}
