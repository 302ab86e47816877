//! Heat maps: values of cells over two axes, and their colours.

use super::axis::{self, AxisScale, ChartAxis};
use super::colours::{ColourMap, Rgb, sample_colour_map};
use std::ops::Range;

/// Values of cells over the axes of a panel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeatMap {
    /// Quantity and unit of the values.
    pub label: String,
    /// Middles of the columns, ascending, in units of the x axis.
    pub x: Vec<f64>,
    /// Middles of the rows, ascending, in units of the y axis.
    pub y: Vec<f64>,
    /// One list a column, one value a row; `None` where there is none.
    pub values: Vec<Vec<Option<f64>>>,
    /// Values of the first and the last colour; `None` to take them from the data. Values beyond have the
    /// colour of the nearer end.
    pub range: Option<(f64, f64)>,
    /// Colours.
    pub colour_map: ColourMap,
    /// With lines of equal value at round values, where the map is fine and smooth enough for them.
    pub contours: bool,
    /// Without the bar that says what the colours mean: a neighbour on the same scale has it.
    pub without_bar: bool,
}

impl HeatMap {
    pub(super) fn finite_values(&self) -> impl Iterator<Item = f64> {
        self.values.iter().flatten().flatten().copied().filter(|v| v.is_finite())
    }

    /// Whether there is anything to colour.
    pub(super) fn has_values(&self) -> bool {
        self.value_range().is_some()
    }

    /// Values of the first and the last colour.
    pub(super) fn value_range(&self) -> Option<(f64, f64)> {
        let given = self.range.filter(|(low, high)| low.is_finite() && high.is_finite() && low < high);
        let (low, high) = given.unwrap_or_else(|| {
            self.finite_values().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
        });
        match (low < high, low.is_finite()) {
            (true, _) => Some((low, high)),
            (false, true) => Some(axis::axis_limits(&ChartAxis::default(), [low].into_iter())), // a constant
            (false, false) => None,
        }
    }

    /// Largest value of a block of cells.
    pub(super) fn max_in_block(&self, columns: &Range<usize>, rows: &Range<usize>) -> Option<f64> {
        let columns = self.values.get(columns.clone()).unwrap_or_default();
        let cells = columns.iter().flat_map(|column| column.get(rows.clone()).unwrap_or_default());
        cells.flatten().copied().filter(|v| v.is_finite()).reduce(f64::max)
    }
}

/// Edges of cells with these middles along an axis: half way between them as the axis counts, and as far out
/// at the ends. A single cell is everywhere; middles that do not rise have no edges.
#[must_use]
pub fn cell_edges(middles: &[f64], scale: AxisScale) -> Vec<f64> {
    let [first, second, ..] = middles else {
        return if middles.is_empty() { Vec::new() } else { vec![f64::NEG_INFINITY, f64::INFINITY] };
    };
    if !middles.is_sorted_by(|a, b| a < b) {
        return Vec::new();
    }
    let last = middles.len() - 1;
    let by_factors = scale == AxisScale::Log && *first > 0.0;
    let between = |a: f64, b: f64| if by_factors { (a * b).sqrt() } else { (a + b) / 2.0 };
    let beyond = |a: f64, b: f64| if by_factors { a * (a / b).sqrt() } else { a + (a - b) / 2.0 };
    let inner = middles.windows(2).map(|pair| between(pair[0], pair[1]));
    std::iter::once(beyond(*first, *second))
        .chain(inner)
        .chain(std::iter::once(beyond(middles[last], middles[last - 1])))
        .collect()
}

/// Share of the colours between two ends at which a value lies.
pub(super) fn colour_fraction((low, high): (f64, f64), value: f64) -> f64 {
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}

/// The colour at a place, in the units of the axes with these scales; `None` outside the map or without a
/// value.
pub(super) fn colour_at(heat: &HeatMap, (x, y): (AxisScale, AxisScale), at: (f64, f64)) -> Option<Rgb> {
    let holder = |middles: &[f64], scale: AxisScale, at: f64| {
        cell_edges(middles, scale).partition_point(|edge| *edge <= at).checked_sub(1)
    };
    let value =
        heat.values.get(holder(&heat.x, x, at.0)?)?.get(holder(&heat.y, y, at.1)?).copied().flatten()?;
    Some(sample_colour_map(heat.colour_map, colour_fraction(heat.value_range()?, value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_lie_half_way_as_the_axis_counts() {
        let edges = cell_edges(&[1.0, 4.0, 100.0], AxisScale::Log);
        assert!(
            edges
                .iter()
                .zip([0.5, 2.0, 20.0, 500.0])
                .all(|(found, expected)| (found / expected - 1.0).abs() < 1e-12),
            "{edges:?}"
        );
    }

    #[test]
    fn the_colours_span_the_finite_values() {
        let heat = |values: Vec<Option<f64>>| HeatMap { values: vec![values], ..HeatMap::default() };
        assert_eq!(
            heat(vec![Some(1.0), None, Some(f64::INFINITY), Some(f64::NAN), Some(-2.0)]).value_range(),
            Some((-2.0, 1.0))
        );
        assert_eq!(heat(vec![None, Some(f64::NAN)]).value_range(), None);
        let (low, high) = heat(vec![Some(5.0)]).value_range().unwrap();
        assert!(low < 5.0 && high > 5.0);
        assert_eq!(
            HeatMap { range: Some((0.0, 3.0)), ..heat(vec![Some(5.0)]) }.value_range(),
            Some((0.0, 3.0))
        );
        assert_eq!(
            heat(vec![Some(1.0), Some(4.0), Some(f64::INFINITY), Some(9.0)]).max_in_block(&(0..1), &(0..3)),
            Some(4.0)
        );
    }
}
