//! Panels side by side, and the room that each leaves next to its axes.

use super::line_breaks::y_label_lines;
use super::ranges::visible_y_values;
use super::ticks::{HALF_LABEL_MM, MOST_NAMES, widest_label_mm, y_axis_ticks};
use crate::chart::axis::{self, AxisScale, CanvasAxis};
use crate::chart::elements::Panel;
use crate::chart::figure::Figure;
use crate::chart::heat_bar;
use crate::chart::sizes::{EDGE_MM, LINE_MM, TICK_MM, UNITS_PER_MM};

/// Least width of the axes of a panel with neighbours at its side, and of one without axes, mm.
const MIN_PANEL_WIDTH_MM: f64 = 30.0;
const MIN_BARE_WIDTH_MM: f64 = 18.0;

/// How many panels stand side by side, and the room that each leaves next to its axes.
pub(in crate::chart) struct PanelColumns {
    pub count: usize,
    /// Room on the left and on the right of the axes of a column, mm.
    margins: Vec<(f64, f64)>,
}

impl PanelColumns {
    /// As many as the figure asks for and its width has room for.
    pub fn new(figure: &Figure) -> Self {
        let most = figure.columns.clamp(1, figure.panels.len().max(1));
        let least =
            if figure.panels.iter().all(|panel| panel.bare) { MIN_BARE_WIDTH_MM } else { MIN_PANEL_WIDTH_MM };
        let fits =
            |columns: &Self| (0..columns.count).all(|column| columns.width_mm(figure, column) >= least);
        (1..=most)
            .rev()
            .map(|count| Self::with_count(figure, count))
            .find(fits)
            .unwrap_or_else(|| Self::with_count(figure, 1))
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

    /// The x axis of a panel in a column.
    pub fn x_axis(
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

/// Room for the widest label of a y axis and its title, mm.
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

/// Room on the right of a panel, mm: for the half of the last label of its x axis, or for the colour bar of a
/// heat map.
fn right_margin(panel: &Panel) -> f64 {
    if panel.bare {
        return EDGE_MM / 2.0;
    }
    EDGE_MM
        + panel
            .heat_map
            .as_ref()
            .map_or(0.0, |heat| heat_bar::colour_bar_width_mm(heat, panel.height_mm))
            .max(HALF_LABEL_MM)
}
