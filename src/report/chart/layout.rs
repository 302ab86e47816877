//! Where everything of a figure stands: heading, legend, panels and the labels over them. Lengths in mm until
//! the panels.

mod columns;
mod height;
mod labels;
mod legend;
mod placed;

pub(super) use columns::widest_mm;
pub(super) use height::no_higher_than;
pub(super) use labels::{label_span, over_panel};
pub(super) use legend::{Entry, legend_text};
pub(super) use placed::{Placed, SMALL_LINE_MM};

use super::axis::Mapped;
use super::text::{WIDE_BOLD_LETTER, WIDE_LETTER, lines};
use super::{EDGE_MM, Figure, LINE_MM, Panel, SMALL_MM, TEXT_MM, TITLE_MM};
use columns::{Columns, x_ranges};
use labels::label_rows;
use legend::legend;

/// Room between panels one below the other, mm.
const GAP_MM: f64 = 2.5;
/// Height of such a row, mm.
const ROW_MM: f64 = SMALL_MM + 0.6;
/// Largest share of a column that the names along a y axis, or of the height of the axes that those under an
/// x axis may take.
const MOST_NAMES: f64 = 0.4;

/// The heading in lines that fit the figure; an empty one takes its line too.
pub(super) fn title_lines(figure: &Figure) -> Vec<String> {
    lines(&figure.title, WIDE_BOLD_LETTER * TITLE_MM, figure.width_mm - 2.0 * EDGE_MM)
}

/// The line under the heading in lines that fit; none for none.
pub(super) fn subtitle_lines(figure: &Figure) -> Vec<String> {
    if figure.subtitle.is_empty() {
        Vec::new()
    } else {
        lines(&figure.subtitle, WIDE_LETTER * TEXT_MM, figure.width_mm - 2.0 * EDGE_MM)
    }
}

/// The label of a y axis in lines that fit beside it.
pub(super) fn y_label_lines(panel: &Panel) -> Vec<String> {
    if panel.y.label.is_empty() {
        Vec::new()
    } else {
        lines(&panel.y.label, WIDE_LETTER * TEXT_MM, panel.height_mm + GAP_MM)
    }
}

/// Everything of a figure in its place.
pub(super) struct Layout<'a> {
    pub height: f64,
    pub legend: Vec<(Entry<'a>, f64, f64)>,
    pub panels: Vec<Placed<'a>>,
}

impl<'a> Layout<'a> {
    pub(super) fn of(figure: &'a Figure) -> Self {
        let (legend, mut top) = legend(figure);
        let columns = Columns::of(figure);
        let ranges = x_ranges(&figure.panels, columns.count);
        let mut panels: Vec<Placed<'a>> = Vec::new();
        for (index, row) in figure.panels.chunks(columns.count).enumerate() {
            let first = index * columns.count;
            let numbered = || row.iter().enumerate().map(|(column, panel)| (first + column, panel));
            let mapped: Vec<Mapped> = numbered()
                .map(|(at, panel)| columns.x(figure, at % columns.count, panel.x.scale, ranges[at]))
                .collect();
            let rows: Vec<_> = row.iter().zip(&mapped).map(|(panel, x)| label_rows(panel, x)).collect();
            let over = |(panel, rows): (&Panel, &Vec<Option<usize>>)| {
                let labels =
                    rows.iter().flatten().max().map_or(usize::from(!panel.title.is_empty()), |row| row + 1);
                labels as f64 * ROW_MM
            };
            top += row.iter().zip(&rows).map(over).fold(0.0, f64::max) + 0.5;
            let mut under = 0.0_f64;
            for (((at, panel), x), rows) in numbered().zip(mapped).zip(rows) {
                let last = figure.panels.get(at + columns.count).is_none_or(|next| next.x != panel.x);
                let mut placed = Placed::of(panel, (x, ranges[at]), top, last, rows);
                placed.names_mm = MOST_NAMES * figure.width_mm / columns.count as f64;
                under = under.max(panel.height_mm + placed.under_mm);
                panels.push(placed);
            }
            top += under + GAP_MM;
        }
        Self { height: top.max(LINE_MM), legend, panels }
    }
}
