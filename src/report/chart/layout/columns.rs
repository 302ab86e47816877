//! Panels beside each other, the room that each leaves beside its axes, and the ends that they share.

use super::placed::y_ticks;
use super::{MOST_NAMES, y_label_lines};
use crate::report::chart::axis::{self, Mapped, Scale, Tick};
use crate::report::chart::heat;
use crate::report::chart::text::text_width;
use crate::report::chart::{Bar, EDGE_MM, Figure, LINE_MM, Panel, SMALL_MM, TEXT_MM, TICK_MM, UNITS};

/// Least width of the axes of a panel that has neighbours beside it, and of one without axes, mm.
const LEAST_PANEL_MM: f64 = 30.0;
const LEAST_BARE_MM: f64 = 18.0;

/// Room for a label of five digits, whose middle stands at the end of the axis.
pub(super) const HALF_LABEL_MM: f64 = 2.0;

/// Panels beside each other: how many, and the room that each leaves beside its axes.
pub(super) struct Columns {
    pub count: usize,
    /// Room on the left and on the right of the axes of a column, mm.
    margins: Vec<(f64, f64)>,
}

impl Columns {
    /// As many as the figure asks for and its width has room for.
    pub fn of(figure: &Figure) -> Self {
        let most = figure.columns.clamp(1, figure.panels.len().max(1));
        let least = if figure.panels.iter().all(|panel| panel.bare) { LEAST_BARE_MM } else { LEAST_PANEL_MM };
        let fits =
            |columns: &Self| (0..columns.count).all(|column| columns.width_mm(figure, column) >= least);
        (1..=most)
            .rev()
            .map(|count| Self::with(figure, count))
            .find(fits)
            .unwrap_or_else(|| Self::with(figure, 1))
    }

    fn with(figure: &Figure, count: usize) -> Self {
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
    pub fn x(&self, figure: &Figure, column: usize, scale: Scale, (low, high): (f64, f64)) -> Mapped {
        let left = figure.width_mm * column as f64 / self.count as f64 + self.margins[column].0;
        Mapped {
            scale,
            low,
            high,
            from: (left * UNITS).round(),
            to: ((left + self.width_mm(figure, column)) * UNITS).round(),
        }
    }
}

/// Values of y within the ends of x.
pub(super) fn visible(panel: &Panel, low: f64, high: f64) -> impl Iterator<Item = f64> {
    let points = panel.series.iter().flat_map(|s| s.points.iter().flatten());
    let bars = panel.series.iter().flat_map(|s| &s.bars).flat_map(|bar| match bar {
        Bar::Vertical { x, from, to } => [(*x, *from), (*x, *to)],
        Bar::Horizontal { y, from, to } => [(*from, *y), (*to, *y)],
    });
    let ribbons = panel
        .ribbons
        .iter()
        .flat_map(|r| r.points.iter().flatten())
        .flat_map(|(x, low, high)| [(*x, *low), (*x, *high)]);
    let all = points.copied().chain(bars).chain(ribbons);
    all.filter(move |(x, _)| *x >= low && *x <= high)
        .map(|(_, y)| y)
        .chain(panel.heat.iter().flat_map(|h| h.y.iter().copied()))
}

/// Ends of the x axis of every panel, common to those one below the other that share it.
pub(super) fn x_ranges(panels: &[Panel], columns: usize) -> Vec<(f64, f64)> {
    let values = |p: &'_ Panel| {
        let points = p.series.iter().flat_map(|s| s.points.iter().flatten().map(|(x, _)| *x));
        let ribbons = p.ribbons.iter().flat_map(|r| r.points.iter().flatten().map(|(x, ..)| *x));
        points.chain(ribbons).chain(p.heat.iter().flat_map(|h| h.x.iter().copied())).collect::<Vec<_>>()
    };
    let mut ranges = vec![(0.0, 1.0); panels.len()];
    for column in 0..columns {
        let own: Vec<usize> = (column..panels.len()).step_by(columns).collect();
        for group in own.chunk_by(|a, b| panels[*a].x == panels[*b].x) {
            let range = axis::ends(&panels[group[0]].x, group.iter().flat_map(|at| values(&panels[*at])));
            group.iter().for_each(|at| ranges[*at] = range);
        }
    }
    ranges
}

/// Room for the widest label of a y axis and its title, mm.
fn left_margin(panel: &Panel, column_mm: f64) -> f64 {
    if panel.bare {
        return EDGE_MM / 2.0;
    }
    let (low, high) = axis::ends(&panel.y, visible(panel, f64::NEG_INFINITY, f64::INFINITY));
    let y = Mapped { scale: panel.y.scale, low, high, from: 0.0, to: panel.height_mm * UNITS };
    widest_mm(&y_ticks(panel, &y, MOST_NAMES * column_mm))
        + TICK_MM
        + y_label_lines(panel).len() as f64 * LINE_MM
        + EDGE_MM
        + 1.0
}

/// Width of the widest label of a y axis, mm.
pub(in crate::report::chart) fn widest_mm(ticks: &[Tick]) -> f64 {
    let width = |label: &str| match label.split_once('\n') {
        Some((first, second)) => text_width(first, SMALL_MM).max(text_width(second, SMALL_MM)),
        None => text_width(label, TEXT_MM),
    };
    ticks.iter().filter_map(|t| t.label.as_deref()).map(width).fold(6.0, f64::max)
}

/// Room beside a panel, mm: for the half of the last label of its x axis, or for the colour bar of a heat
/// map.
fn right_margin(panel: &Panel) -> f64 {
    if panel.bare {
        return EDGE_MM / 2.0;
    }
    EDGE_MM
        + panel.heat.as_ref().map_or(0.0, |heat| heat::bar_width_mm(heat, panel.height_mm)).max(HALF_LABEL_MM)
}
