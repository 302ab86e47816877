//! Heat maps: cells over two axes as colours, and the bar that says what the colours mean.

use super::axis::{self, Axis, Mapped, Scale};
use super::canvas::{Anchor, Canvas, Lettering, Rgb};
use super::colours::colour;
use super::panel::{FRAME, tick_length};
use super::path::Area;
use super::text::{shortened, text_width};
use super::{LINE_MM, TEXT_MM, TICK_MM, UNITS, Y_TICKS_MM};
use std::ops::Range;

/// Values of cells over the axes of a panel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Heat {
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
    pub map: Colours,
    /// Without the bar that says what the colours mean: a neighbour on the same scale has it.
    pub without_bar: bool,
}

/// Colours of a heat map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Colours {
    /// Viridis: from little to much.
    #[default]
    Rising,
    /// From blue over white to vermilion: below and above a middle.
    Diverging,
}

/// Distance of the bar from the axes, its width, and the height of the point at an end beyond which there are
/// values, mm.
const BAR_GAP_MM: f64 = 2.5;
const BAR_MM: f64 = 3.0;
const POINT_MM: f64 = 2.0;

impl Heat {
    fn finite(&self) -> impl Iterator<Item = f64> {
        self.values.iter().flatten().flatten().copied().filter(|v| v.is_finite())
    }

    /// Whether there is anything to colour.
    pub(super) fn has_values(&self) -> bool {
        self.ends().is_some()
    }

    /// Values of the first and the last colour.
    pub(super) fn ends(&self) -> Option<(f64, f64)> {
        let given = self.range.filter(|(low, high)| low.is_finite() && high.is_finite() && low < high);
        let (low, high) = given.unwrap_or_else(|| {
            self.finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
        });
        match (low < high, low.is_finite()) {
            (true, _) => Some((low, high)),
            (false, true) => Some(axis::ends(&Axis::default(), [low].into_iter())), // a constant
            (false, false) => None,
        }
    }

    /// Largest value of a block of cells.
    pub(super) fn largest(&self, columns: &Range<usize>, rows: &Range<usize>) -> Option<f64> {
        let columns = self.values.get(columns.clone()).unwrap_or_default();
        let cells = columns.iter().flat_map(|column| column.get(rows.clone()).unwrap_or_default());
        cells.flatten().copied().filter(|v| v.is_finite()).reduce(f64::max)
    }
}

/// Edges of the cells: half way between the middles as the axis counts, and as far out at the ends; a single
/// cell is everywhere. None for middles out of order.
pub(super) fn edges(middles: &[f64], scale: Scale) -> Vec<f64> {
    let [first, second, ..] = middles else {
        return if middles.is_empty() { Vec::new() } else { vec![f64::NEG_INFINITY, f64::INFINITY] };
    };
    if !middles.is_sorted_by(|a, b| a < b) {
        return Vec::new();
    }
    let last = middles.len() - 1;
    let by_factors = scale == Scale::Log && *first > 0.0;
    let between = |a: f64, b: f64| if by_factors { (a * b).sqrt() } else { (a + b) / 2.0 };
    let beyond = |a: f64, b: f64| if by_factors { a * (a / b).sqrt() } else { a + (a - b) / 2.0 };
    let inner = middles.windows(2).map(|pair| between(pair[0], pair[1]));
    std::iter::once(beyond(*first, *second))
        .chain(inner)
        .chain(std::iter::once(beyond(middles[last], middles[last - 1])))
        .collect()
}

/// Share of the colours between two ends at which a value lies.
pub(super) fn share((low, high): (f64, f64), value: f64) -> f64 {
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}

/// The colour at a place, in the units of the axes with these scales; `None` outside the map or without a
/// value.
pub(super) fn colour_at(heat: &Heat, (x, y): (Scale, Scale), at: (f64, f64)) -> Option<Rgb> {
    let holder = |middles: &[f64], scale: Scale, at: f64| {
        edges(middles, scale).partition_point(|edge| *edge <= at).checked_sub(1)
    };
    let value =
        heat.values.get(holder(&heat.x, x, at.0)?)?.get(holder(&heat.y, y, at.1)?).copied().flatten()?;
    Some(colour(heat.map, share(heat.ends()?, value)))
}

/// Near white and near black, which are the same in the light and the dark.
pub(super) const LIGHT: Rgb = (0xFE, 0xFE, 0xFE);
const DEEP: Rgb = (0x01, 0x01, 0x01);

/// The one of the two that has the higher contrast on a colour (relative luminance of WCAG 2.2; the two meet
/// at 0.18).
pub(super) fn readable_on((red, green, blue): Rgb) -> Rgb {
    let linear = |part: u8| (f64::from(part) / 255.0).powf(2.2);
    let luminance = 0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue);
    if luminance > 0.18 { DEEP } else { LIGHT }
}

/// The bar's axis between two places.
fn scale(ends: (f64, f64), from: f64, to: f64) -> Mapped {
    Mapped { scale: Scale::Linear, low: ends.0, high: ends.1, from, to }
}

/// Room that the bar takes beside the axes, mm.
pub(super) fn bar_width_mm(heat: &Heat, height_mm: f64) -> f64 {
    let Some(ends) = heat.ends().filter(|_| !heat.without_bar) else { return 0.0 };
    BAR_GAP_MM + BAR_MM + TICK_MM + 0.6 + widest_mm(&scale(ends, 0.0, height_mm), Y_TICKS_MM) + LINE_MM
}

/// Width of the widest label of a bar whose ticks are that far apart.
fn widest_mm(scale: &Mapped, apart: f64) -> f64 {
    /// Digits and signs are wider than the mean letter.
    const DIGITS: f64 = 1.2;
    scale
        .ticks(apart)
        .iter()
        .filter_map(|t| t.label.as_deref())
        .map(|l| DIGITS * text_width(l, TEXT_MM))
        .fold(0.0, f64::max)
}

/// The bar of colours beside the axes, with ticks and label; pointed where values lie beyond its end.
pub(super) fn bar(canvas: &mut Canvas, heat: &Heat, axes: &Area) {
    let Some((low, high)) = heat.ends() else { return };
    let left = axes.right + BAR_GAP_MM * UNITS;
    let right = left + BAR_MM * UNITS;
    let point = |beyond: bool| if beyond { POINT_MM * UNITS } else { 0.0 };
    let (over, under) = (point(heat.finite().any(|v| v > high)), point(heat.finite().any(|v| v < low)));
    let (top, bottom) = (axes.top + over, axes.bottom - under);
    let middle = (left + right) / 2.0;
    gradient(canvas, &Area { left, right, top, bottom }, heat.map);
    if over > 0.0 {
        canvas.polygon(&[(left, top), (middle, axes.top), (right, top)], colour(heat.map, 1.0), 1.0);
    }
    if under > 0.0 {
        canvas.polygon(&[(left, bottom), (middle, axes.bottom), (right, bottom)], colour(heat.map, 0.0), 1.0);
    }
    canvas.line(
        &[
            (left, bottom),
            (left, top),
            (middle, axes.top),
            (right, top),
            (right, bottom),
            (middle, axes.bottom),
            (left, bottom),
        ],
        FRAME,
        3,
    );
    let scale = scale((low, high), bottom, top);
    for tick in scale.ticks(Y_TICKS_MM * UNITS) {
        let Some(y) = scale.place(tick.value) else { continue };
        canvas.line(&[(right, y), (right + tick_length(&tick), y)], FRAME, 3);
        if let Some(label) = &tick.label {
            canvas.text(label, (right + (TICK_MM + 0.6) * UNITS, y), Lettering::plain(TEXT_MM, Anchor::Left));
        }
    }
    let beside = right + (TICK_MM + 0.6 + widest_mm(&scale, Y_TICKS_MM * UNITS) + LINE_MM / 2.0) * UNITS;
    let upwards = Lettering { upwards: true, ..Lettering::plain(TEXT_MM, Anchor::Centre) };
    let label = shortened(&heat.label, TEXT_MM, (axes.bottom - axes.top) / UNITS);
    canvas.text(&label, (beside, (axes.top + axes.bottom) / 2.0), upwards);
}

/// The colours from bottom to top; every stripe reaches to the top, so that no gap shows between them.
fn gradient(canvas: &mut Canvas, area: &Area, map: Colours) {
    const STRIPES: u32 = 64;
    for stripe in 0..STRIPES {
        let share = f64::from(stripe) / f64::from(STRIPES);
        let bottom = (area.bottom - share * (area.bottom - area.top)).round();
        canvas.rectangle(
            &Area { bottom, ..*area },
            colour(map, f64::from(stripe) / f64::from(STRIPES - 1)),
            1.0,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_lie_half_way_as_the_axis_counts() {
        let edges = edges(&[1.0, 4.0, 100.0], Scale::Log);
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
        let heat = |values: Vec<Option<f64>>| Heat { values: vec![values], ..Heat::default() };
        assert_eq!(
            heat(vec![Some(1.0), None, Some(f64::INFINITY), Some(f64::NAN), Some(-2.0)]).ends(),
            Some((-2.0, 1.0))
        );
        assert_eq!(heat(vec![None, Some(f64::NAN)]).ends(), None);
        let (low, high) = heat(vec![Some(5.0)]).ends().unwrap();
        assert!(low < 5.0 && high > 5.0);
        assert_eq!(Heat { range: Some((0.0, 3.0)), ..heat(vec![Some(5.0)]) }.ends(), Some((0.0, 3.0)));
        assert_eq!(
            heat(vec![Some(1.0), Some(4.0), Some(f64::INFINITY), Some(9.0)]).largest(&(0..1), &(0..3)),
            Some(4.0)
        );
    }
}
