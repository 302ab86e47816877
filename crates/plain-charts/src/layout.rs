//! Layout of a figure: heading, legend, panels and the labels above the panels. Lengths are in mm, the areas
//! of panels in canvas units.

mod labels;
mod panel_layout;

use super::axis::{AxisScale, CanvasAxis};
use super::elements::{ErrorBar, Panel};
use super::figure::Figure;
use super::style::{EDGE_MM, LINE_MM, SMALL_MM, TEXT_MM, TICK_MM, TITLE_MM, UNITS_PER_MM};
use super::text::{WIDE_BOLD_LETTER, WIDE_LETTER, wrap_lines};
use super::{axis, heat_map};
pub(super) use labels::{LegendEntry, label_span, legend_text, shorten_to_panel};
use labels::{assign_label_rows, place_legend};
use panel_layout::{HALF_LABEL_MM, MOST_NAMES, y_axis_ticks};
pub(super) use panel_layout::{PanelLayout, SMALL_LINE_MM, widest_label_mm};

/// Height, mm, of a row of labels above a panel.
const LABEL_ROW_MM: f64 = SMALL_MM + 0.6;

/// Panel letters; figures with a single panel, or with more panels than letters, have none.
const PANEL_LETTERS: &str = "abcdefghijklmnopqrstuvwxyz";
const MAX_LETTERED_PANELS: usize = PANEL_LETTERS.len();

/// A figure with the positions of its parts.
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
            // below the first row, a letter fits next to the ticks of the panel above
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

// Reduction of panel heights so that a figure fits on a page.

/// Smallest allowed height of axes, mm: room for two labelled ticks and for equal margins beyond them.
const MIN_AXES_HEIGHT_MM: f64 = 16.0;
/// Smallest allowed height, mm, per name along a y axis: a line of text and a gap.
const MIN_CATEGORY_HEIGHT_MM: f64 = 3.0;
/// Maximum number of rounds in which heights are reduced. One round may not be enough, because labels of
/// lower panels wrap to more lines and need height again.
const MAX_HEIGHT_ROUNDS: usize = 4;

/// Reduces the heights of all panels by the same fraction of their spare height until the figure is at most
/// `most_mm` high. Text keeps its size, so a figure with very many panels may remain higher.
pub(super) fn limit_height(mut figure: Figure, most_mm: f64) -> Figure {
    for _ in 0..MAX_HEIGHT_ROUNDS {
        let over_mm = FigureLayout::new(&figure).height - most_mm;
        let rows = figure.panels.chunks(PanelColumns::new(&figure).count);
        let spare: f64 = rows.map(|row| row.iter().map(spare_height_mm).fold(0.0, f64::max)).sum();
        if over_mm <= 0.0 || spare <= 0.0 {
            break;
        }
        let share = (over_mm / spare).min(1.0);
        figure.panels.iter_mut().for_each(|panel| panel.height_mm -= share * spare_height_mm(panel));
    }
    figure
}

/// Height by which a panel can be reduced, mm.
fn spare_height_mm(panel: &Panel) -> f64 {
    let least_mm = MIN_AXES_HEIGHT_MM.max(panel.y.categories.len() as f64 * MIN_CATEGORY_HEIGHT_MM);
    (panel.height_mm - least_mm).max(0.0)
}

// Panels side by side.

/// Smallest allowed width, mm, of the axes of a panel in a row of several panels.
const MIN_PANEL_WIDTH_MM: f64 = 30.0;
/// Smallest allowed width, mm, of a panel without axes in a row of several panels.
const MIN_BARE_WIDTH_MM: f64 = 18.0;

/// Number of panels side by side, and the margins of each column of panels.
pub(crate) struct PanelColumns {
    pub count: usize,
    /// Left and right margin, mm, of the axes of each column.
    margins: Vec<(f64, f64)>,
}

impl PanelColumns {
    /// The number of columns that the figure requests, or fewer if its width does not allow them.
    pub(crate) fn new(figure: &Figure) -> Self {
        let most = figure.columns.clamp(1, figure.panels.len().max(1));
        let least =
            if figure.panels.iter().all(|panel| panel.bare) { MIN_BARE_WIDTH_MM } else { MIN_PANEL_WIDTH_MM };
        let fits =
            |columns: &Self| (0..columns.count).all(|column| columns.width_mm(figure, column) >= least);
        let mut choices = (1..=most).rev().map(|count| Self::with_count(figure, count));
        choices.find(fits).unwrap_or_else(|| Self::with_count(figure, 1))
    }

    fn with_count(figure: &Figure, count: usize) -> Self {
        let each_mm = figure.width_mm / count as f64;
        let margins = |column: usize| {
            let panels = || figure.panels.iter().skip(column).step_by(count);
            (
                panels().map(|p| left_margin(p, each_mm)).fold(0.0, f64::max),
                panels().map(right_margin).fold(0.0, f64::max),
            )
        };
        Self { count, margins: (0..count).map(margins).collect() }
    }

    fn width_mm(&self, figure: &Figure, column: usize) -> f64 {
        let (left, right) = self.margins[column];
        figure.width_mm / self.count as f64 - left - right
    }

    /// The x axis of a panel in a column, mapped to the canvas.
    pub(crate) fn x_axis(
        &self,
        figure: &Figure,
        column: usize,
        scale: AxisScale,
        (low, high): (f64, f64),
    ) -> CanvasAxis {
        let left = figure.width_mm * column as f64 / self.count as f64 + self.margins[column].0;
        CanvasAxis {
            scale,
            low,
            high,
            from: (left * UNITS_PER_MM).round(),
            to: ((left + self.width_mm(figure, column)) * UNITS_PER_MM).round(),
        }
    }
}

/// Left margin, mm: tick labels and label of the y axis.
fn left_margin(panel: &Panel, column_mm: f64) -> f64 {
    if panel.bare {
        return EDGE_MM / 2.0;
    }
    let (low, high) = axis::axis_limits(&panel.y, visible_y_values(panel, f64::NEG_INFINITY, f64::INFINITY));
    let y = CanvasAxis { scale: panel.y.scale, low, high, from: 0.0, to: panel.height_mm * UNITS_PER_MM };
    widest_label_mm(&y_axis_ticks(panel, &y, MOST_NAMES * column_mm))
        + TICK_MM
        + y_label_lines(panel).len() as f64 * LINE_MM
        + EDGE_MM
        + 1.0
}

/// Right margin, mm: half the width of the last label of the x axis, or the colour bar.
fn right_margin(panel: &Panel) -> f64 {
    if panel.bare {
        return EDGE_MM / 2.0;
    }
    let bar_mm = |heat| heat_map::colour_bar_width_mm(heat, panel.height_mm);
    EDGE_MM + panel.heat_map.as_ref().map_or(0.0, bar_mm).max(HALF_LABEL_MM)
}

// Wrapped headings and labels.

/// Vertical gap between panels, mm.
pub(super) const PANEL_GAP_MM: f64 = 2.5;

/// The heading, wrapped to the width of the figure.
pub(crate) fn title_lines(figure: &Figure) -> Vec<String> {
    lines_of_text(&figure.title, WIDE_BOLD_LETTER * TITLE_MM, figure.width_mm - 2.0 * EDGE_MM)
}

/// The subtitle, wrapped to the width of the figure.
pub(crate) fn subtitle_lines(figure: &Figure) -> Vec<String> {
    lines_of_text(&figure.subtitle, WIDE_LETTER * TEXT_MM, figure.width_mm - 2.0 * EDGE_MM)
}

/// The label of the y axis, wrapped to the height of the panel.
pub(crate) fn y_label_lines(panel: &Panel) -> Vec<String> {
    lines_of_text(&panel.y.label, WIDE_LETTER * TEXT_MM, panel.height_mm + PANEL_GAP_MM)
}

/// The lines of a wrapped text; none for an empty text.
fn lines_of_text(text: &str, letter_mm: f64, width_mm: f64) -> Vec<String> {
    if text.is_empty() { Vec::new() } else { wrap_lines(text, letter_mm, width_mm) }
}

// Data from which the ends of the axes follow.

/// y values of points, error bars and ribbons with x from `low` to `high`, and of all rows of the heat map.
pub(super) fn visible_y_values(panel: &Panel, low: f64, high: f64) -> impl Iterator<Item = f64> {
    let points = panel.series.iter().flat_map(|s| s.points.iter().flatten());
    let bars = panel.series.iter().flat_map(|s| &s.error_bars).flat_map(|bar| match bar {
        ErrorBar::Vertical { x, from, to } => [(*x, *from), (*x, *to)],
        ErrorBar::Horizontal { y, from, to } => [(*from, *y), (*to, *y)],
    });
    let ribbons = panel.ribbons.iter().flat_map(|r| r.points.iter().flatten());
    let ribbons = ribbons.flat_map(|(x, low, high)| [(*x, *low), (*x, *high)]);
    let all = points.copied().chain(bars).chain(ribbons);
    let shown = all.filter(move |(x, _)| *x >= low && *x <= high).map(|(_, y)| y);
    shown.chain(panel.heat_map.iter().flat_map(|h| h.y.iter().copied()))
}

/// Ends of the x axis of every panel; stacked panels with equal x axes have the same ends.
pub(super) fn x_ranges(panels: &[Panel], columns: usize) -> Vec<(f64, f64)> {
    let values = |p: &'_ Panel| {
        let points = p.series.iter().flat_map(|s| s.points.iter().flatten().map(|(x, _)| *x));
        let ribbons = p.ribbons.iter().flat_map(|r| r.points.iter().flatten().map(|(x, ..)| *x));
        points.chain(ribbons).chain(p.heat_map.iter().flat_map(|h| h.x.iter().copied())).collect::<Vec<_>>()
    };
    let mut ranges = vec![(0.0, 1.0); panels.len()];
    for column in 0..columns {
        let own: Vec<usize> = (column..panels.len()).step_by(columns).collect();
        for group in own.chunk_by(|a, b| panels[*a].x == panels[*b].x) {
            let range =
                axis::axis_limits(&panels[group[0]].x, group.iter().flat_map(|at| values(&panels[*at])));
            group.iter().for_each(|at| ranges[*at] = range);
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{COLUMN_WIDTH_MM, ChartAxis};

    fn figure(heights_mm: &[f64]) -> Figure {
        let panel =
            |height_mm: &f64| Panel { y: ChartAxis::linear("y"), height_mm: *height_mm, ..Panel::default() };
        Figure {
            width_mm: COLUMN_WIDTH_MM,
            panels: heights_mm.iter().map(panel).collect(),
            ..Figure::default()
        }
    }

    fn lowered(figure: &Figure, most_mm: f64) -> Vec<f64> {
        limit_height(figure.clone(), most_mm).panels.iter().map(|p| p.height_mm).collect()
    }

    #[test]
    fn a_figure_that_fits_stays_as_it_is() {
        let fits = figure(&[60.0, 40.0]);
        assert_eq!(limit_height(fits.clone(), FigureLayout::new(&fits).height), fits);
    }

    #[test]
    fn panels_give_what_they_can_spare_and_no_more() {
        let high = figure(&[56.0, 56.0, 36.0, 13.0]);
        // 40 + 40 + 20 + 0 mm to spare, half of which is used
        let most_mm = FigureLayout::new(&high).height - 50.0;
        assert_eq!(lowered(&high, most_mm), [36.0, 36.0, 26.0, 13.0]);
        assert_eq!(FigureLayout::new(&limit_height(high.clone(), most_mm)).height, most_mm);
        assert_eq!(lowered(&high, 10.0), [MIN_AXES_HEIGHT_MM, MIN_AXES_HEIGHT_MM, MIN_AXES_HEIGHT_MM, 13.0]);
    }

    #[test]
    fn rows_of_names_keep_room_for_their_letters() {
        let mut high = figure(&[90.0]);
        high.panels[0].y = ChartAxis::categorical("", (0..12).map(|i| i.to_string()));
        assert_eq!(lowered(&high, 10.0), [12.0 * MIN_CATEGORY_HEIGHT_MM]);
    }
}
