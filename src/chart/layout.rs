//! Where everything of a figure stands: heading, legend, panels and the labels over them. Lengths in mm until
//! the panels.

mod columns;
mod labels;
mod legend;
mod line_breaks;
mod placed;
mod ranges;
mod ticks;

pub(super) use columns::PanelColumns;
pub(super) use labels::{label_span, shorten_to_panel};
pub(super) use legend::{LegendEntry, legend_text};
pub(super) use line_breaks::{subtitle_lines, title_lines, y_label_lines};
pub(super) use placed::PanelLayout;
pub(super) use ticks::{SMALL_LINE_MM, widest_label_mm};

use super::axis::CanvasAxis;
use super::elements::Panel;
use super::figure::Figure;
use super::sizes::{LINE_MM, SMALL_MM};
use labels::assign_label_rows;
use legend::place_legend;
use line_breaks::PANEL_GAP_MM;
use ranges::x_ranges;
use ticks::MOST_NAMES;

/// Height of a row of labels over a panel, mm.
const LABEL_ROW_MM: f64 = SMALL_MM + 0.6;

/// Letters of the panels; a figure of more panels has none, as has one of a single panel.
const PANEL_LETTERS: &str = "abcdefghijklmnopqrstuvwxyz";
const MAX_LETTERED_PANELS: usize = PANEL_LETTERS.len();

/// Everything of a figure in its place.
pub(super) struct FigureLayout<'a> {
    pub height: f64,
    pub legend: Vec<(LegendEntry<'a>, f64, f64)>,
    pub panels: Vec<PanelLayout<'a>>,
}

impl<'a> FigureLayout<'a> {
    pub(super) fn new(figure: &'a Figure) -> Self {
        let (legend, mut top) = place_legend(figure);
        let lettered = (2..=MAX_LETTERED_PANELS).contains(&figure.panels.len());
        let columns = PanelColumns::new(figure);
        let ranges = x_ranges(&figure.panels, columns.count);
        let mut panels: Vec<PanelLayout<'a>> = Vec::new();
        for (index, row) in figure.panels.chunks(columns.count).enumerate() {
            let first = index * columns.count;
            let numbered = || row.iter().enumerate().map(|(column, panel)| (first + column, panel));
            let mapped: Vec<CanvasAxis> = numbered()
                .map(|(at, panel)| columns.x_axis(figure, at % columns.count, panel.x.scale, ranges[at]))
                .collect();
            let rows: Vec<_> =
                row.iter().zip(&mapped).map(|(panel, x)| assign_label_rows(panel, x)).collect();
            // (under another panel there is room for a letter next to its ticks)
            let alone = lettered && index == 0;
            let over = |(panel, rows): (&Panel, &Vec<Option<usize>>)| {
                let title = panel.title.lines().count().max(usize::from(alone));
                let labels = rows.iter().flatten().max().map_or(title, |row| title.max(row + 1));
                labels as f64 * LABEL_ROW_MM
            };
            top += row.iter().zip(&rows).map(over).fold(0.0, f64::max) + 0.5;
            let mut under = 0.0_f64;
            for (((at, panel), x), rows) in numbered().zip(mapped).zip(rows) {
                let last = figure.panels.get(at + columns.count).is_none_or(|next| next.x != panel.x);
                let mut placed = PanelLayout::new(panel, (x, ranges[at]), top, last, rows);
                placed.names_mm = MOST_NAMES * figure.width_mm / columns.count as f64;
                placed.column_mm = figure.width_mm * (at % columns.count) as f64 / columns.count as f64;
                placed.letter = PANEL_LETTERS.chars().nth(at).filter(|_| lettered);
                under = under.max(panel.height_mm + placed.under_mm);
                panels.push(placed);
            }
            top += under + PANEL_GAP_MM;
        }
        Self { height: top.max(LINE_MM), legend, panels }
    }
}
