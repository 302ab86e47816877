//! What of the data decides the ends of axes.

use crate::chart::axis;
use crate::chart::elements::{ErrorBar, Panel};

/// Values of y within the ends of x.
pub(super) fn visible_y_values(panel: &Panel, low: f64, high: f64) -> impl Iterator<Item = f64> {
    let points = panel.series.iter().flat_map(|s| s.points.iter().flatten());
    let bars = panel.series.iter().flat_map(|s| &s.error_bars).flat_map(|bar| match bar {
        ErrorBar::Vertical { x, from, to } => [(*x, *from), (*x, *to)],
        ErrorBar::Horizontal { y, from, to } => [(*from, *y), (*to, *y)],
    });
    let ribbons = panel
        .ribbons
        .iter()
        .flat_map(|r| r.points.iter().flatten())
        .flat_map(|(x, low, high)| [(*x, *low), (*x, *high)]);
    let all = points.copied().chain(bars).chain(ribbons);
    all.filter(move |(x, _)| *x >= low && *x <= high)
        .map(|(_, y)| y)
        .chain(panel.heat_map.iter().flat_map(|h| h.y.iter().copied()))
}

/// Ends of the x axis of every panel, common to those one below the other that share it.
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
