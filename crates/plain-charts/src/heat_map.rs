//! Heat maps: values of cells over two axes, and their colours.

use super::axis;
use super::axis::{AxisScale, CanvasAxis, ChartAxis};
use super::canvas::{Canvas, Lettering, TextAnchor};
use super::path::CanvasArea;
use super::style::{
    ColourMap, FRAME, LINE_MM, NO_VALUE, Rgb, TEXT_MM, TICK_MM, UNITS_PER_MM, Y_TICKS_MM, sample_colour_map,
};
use super::text::{text_width, truncate_text};
use png::{BitDepth, ColorType, Compression, Encoder};
use std::ops::Range;

/// Values of cells over the axes of a panel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeatMap {
    /// Quantity and unit of the values.
    pub label: String,
    /// Centres of the columns, ascending, in units of the x axis.
    pub x: Vec<f64>,
    /// Centres of the rows, ascending, in units of the y axis.
    pub y: Vec<f64>,
    /// One list per column, one value per row; `None` for a missing value.
    pub values: Vec<Vec<Option<f64>>>,
    /// Values of the first and the last colour of the colour map; `None` takes them from the data. A value
    /// outside this range has the colour of the nearer end.
    pub range: Option<(f64, f64)>,
    /// Colours.
    pub colour_map: ColourMap,
    /// Whether contours at round values are drawn; coarse or noisy maps have no contours in either case.
    pub contours: bool,
    /// Whether the colour bar is left out, for example because a neighbouring map has the same one.
    pub without_bar: bool,
}

impl HeatMap {
    pub(super) fn finite_values(&self) -> impl Iterator<Item = f64> {
        self.values.iter().flatten().flatten().copied().filter(|v| v.is_finite())
    }

    /// Whether the map has a finite value.
    pub(super) fn has_values(&self) -> bool {
        self.value_range().is_some()
    }

    /// Values of the first and the last colour; `None` if no value is finite.
    pub(super) fn value_range(&self) -> Option<(f64, f64)> {
        let given = self.range.filter(|(low, high)| low.is_finite() && high.is_finite() && low < high);
        let (low, high) = given.unwrap_or_else(|| axis::value_span(self.finite_values()));
        match (low < high, low.is_finite()) {
            (true, _) => Some((low, high)),
            (false, true) => Some(axis::axis_limits(&ChartAxis::default(), [low].into_iter())), // all equal
            (false, false) => None,
        }
    }

    /// Largest finite value in a block of cells; `None` if the block has no finite value.
    pub(super) fn max_in_block(&self, columns: &Range<usize>, rows: &Range<usize>) -> Option<f64> {
        let columns = self.values.get(columns.clone()).unwrap_or_default();
        let cells = columns.iter().flat_map(|column| column.get(rows.clone()).unwrap_or_default());
        cells.flatten().copied().filter(|v| v.is_finite()).reduce(f64::max)
    }
}

/// Edges of cells from their centres: halfway between neighbouring centres on the scale of the axis, and half
/// a spacing beyond the first and the last centre. The edges of a single cell are infinite; the list is empty
/// if the centres do not ascend.
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
    let end = beyond(middles[last], middles[last - 1]);
    std::iter::once(beyond(*first, *second)).chain(inner).chain([end]).collect()
}

/// Position of a value in the range of the colours: 0 at the first colour, 1 at the last.
pub(super) fn colour_fraction((low, high): (f64, f64), value: f64) -> f64 {
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}

/// The colour at a point in axis units; `None` outside the map or in a cell without a value.
pub(super) fn colour_at(heat: &HeatMap, (x, y): (AxisScale, AxisScale), at: (f64, f64)) -> Option<Rgb> {
    let holder = |middles: &[f64], scale: AxisScale, at: f64| {
        cell_edges(middles, scale).partition_point(|edge| *edge <= at).checked_sub(1)
    };
    let value =
        heat.values.get(holder(&heat.x, x, at.0)?)?.get(holder(&heat.y, y, at.1)?).copied().flatten()?;
    Some(sample_colour_map(heat.colour_map, colour_fraction(heat.value_range()?, value)))
}

// The cells, drawn as an indexed PNG: a picture is much smaller than one vector shape per cell.

/// Width and height of the picture, pixels. A pixel that covers several cells has the largest of their
/// values, so that thin lines stay visible.
const PIXELS: [usize; 2] = [440, 220];
/// Number of colours for values; one more colour marks missing values. A tenth of the range has 12 colours,
/// so that the eye sees no steps.
const COLOURS: u8 = 120;

/// The cells within the axes as a PNG of [`PIXELS`]; `None` if the map has no finite value.
pub(super) fn encode_cells(heat: &HeatMap, x: &CanvasAxis, y: &CanvasAxis) -> Option<Vec<u8>> {
    let ends = heat.value_range()?;
    let last = f64::from(COLOURS - 1);
    let columns = resample_cells(&heat.x, x, PIXELS[0]);
    let rows = resample_cells(&heat.y, y, PIXELS[1]);
    let level = |column: &Option<Range<usize>>, row: &Option<Range<usize>>| {
        let value = heat.max_in_block(column.as_ref()?, row.as_ref()?)?;
        Some((colour_fraction(ends, value) * last).round() as u8)
    };
    // the first row of a picture is at the top, the high end of the y axis
    let pixels: Vec<u8> = rows
        .iter()
        .rev()
        .flat_map(|row| columns.iter().map(|column| level(column, row).unwrap_or(COLOURS)))
        .collect();
    let palette = (0..COLOURS).map(|level| sample_colour_map(heat.colour_map, f64::from(level) / last));
    let palette: Vec<u8> =
        palette.chain([NO_VALUE]).flat_map(|(red, green, blue)| [red, green, blue]).collect();
    let mut bytes = Vec::new();
    let [width, height] = PIXELS;
    let mut encoder = Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(ColorType::Indexed);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_palette(palette);
    encoder.set_compression(Compression::High);
    let mut writer = encoder.write_header().ok()?;
    writer.write_image_data(&pixels).ok()?;
    writer.finish().ok()?;
    Some(bytes)
}

/// The cells that each of `count` equal steps along an axis shows, from the low end of the axis: the cells
/// with centres in the step if there are at least two, otherwise the cell at the middle of the step. `None`
/// for a step whose middle is outside all cells.
fn resample_cells(middles: &[f64], axis: &CanvasAxis, count: usize) -> Vec<Option<Range<usize>>> {
    let edges = cell_edges(middles, axis.scale);
    let step = (axis.to - axis.from) / count as f64;
    let value = |k: f64| axis.value_at(axis.from + k * step);
    let of = |k: usize| {
        if edges.is_empty() {
            return None;
        }
        let at = k as f64;
        let [first, end] = [at, at + 1.0].map(|at| middles.partition_point(|m| *m < value(at)));
        let middle = edges.partition_point(|e| *e <= value(at + 0.5)).checked_sub(1);
        let holder = middle.filter(|cell| *cell < middles.len());
        // a cell wider than a step ends at its own edges, so only the middle of the step decides
        if end > first + 1 { Some(first..end) } else { holder.map(|cell| cell..cell + 1) }
    };
    (0..count).map(of).collect()
}

// Colour bar.

/// Distance of the colour bar from the axes, mm.
const BAR_GAP_MM: f64 = 2.5;
/// Width of the colour bar, mm.
const BAR_MM: f64 = 3.0;
/// Height of a pointed end of the colour bar, mm.
const POINT_MM: f64 = 2.0;

/// The linear axis of the colour bar: its low end is at the position `from`, its high end at `to`.
fn colour_bar_axis(ends: (f64, f64), from: f64, to: f64) -> CanvasAxis {
    CanvasAxis { scale: AxisScale::Linear, low: ends.0, high: ends.1, from, to }
}

/// Width, mm, that the colour bar needs next to the axes.
pub(super) fn colour_bar_width_mm(heat: &HeatMap, height_mm: f64) -> f64 {
    let Some(ends) = heat.value_range().filter(|_| !heat.without_bar) else { return 0.0 };
    let label_mm = widest_bar_label_mm(&colour_bar_axis(ends, 0.0, height_mm), Y_TICKS_MM);
    BAR_GAP_MM + BAR_MM + TICK_MM + 0.6 + label_mm + LINE_MM
}

/// Width, mm, of the widest label of a colour bar with ticks at this distance.
fn widest_bar_label_mm(scale: &CanvasAxis, apart: f64) -> f64 {
    /// Ratio of the width of digits and signs to the mean width of letters.
    const DIGITS: f64 = 1.2;
    let labels = scale.ticks(apart).into_iter().filter_map(|t| t.label);
    labels.map(|l| DIGITS * text_width(&l, TEXT_MM)).fold(0.0, f64::max)
}

/// Draws the colour bar with ticks and label; an end of the bar is pointed if the map has values beyond it.
pub(super) fn draw_colour_bar(canvas: &mut Canvas, heat: &HeatMap, axes: &CanvasArea) {
    let Some((low, high)) = heat.value_range() else { return };
    let left = axes.right + BAR_GAP_MM * UNITS_PER_MM;
    let right = left + BAR_MM * UNITS_PER_MM;
    let point = |beyond: bool| if beyond { POINT_MM * UNITS_PER_MM } else { 0.0 };
    let (over, under) =
        (point(heat.finite_values().any(|v| v > high)), point(heat.finite_values().any(|v| v < low)));
    let (top, bottom) = (axes.top + over, axes.bottom - under);
    let middle = (left + right) / 2.0;
    draw_gradient(canvas, &CanvasArea { left, right, top, bottom }, heat.colour_map);
    for (room, from, to, share) in [(over, top, axes.top, 1.0), (under, bottom, axes.bottom, 0.0)] {
        if room > 0.0 {
            let colour = sample_colour_map(heat.colour_map, share);
            canvas.fill_polygon(&[(left, from), (middle, to), (right, from)], colour, 1.0);
        }
    }
    let upper = [(left, bottom), (left, top), (middle, axes.top), (right, top)];
    let lower = [(right, bottom), (middle, axes.bottom), (left, bottom)];
    canvas.draw_line(&[&upper[..], &lower].concat(), FRAME, 3);
    let scale = colour_bar_axis((low, high), bottom, top);
    for tick in scale.ticks(Y_TICKS_MM * UNITS_PER_MM) {
        let Some(y) = scale.canvas_position(tick.value) else { continue };
        canvas.draw_line(&[(right, y), (right + tick.length(), y)], FRAME, 3);
        if let Some(label) = &tick.label {
            let x = right + (TICK_MM + 0.6) * UNITS_PER_MM;
            canvas.draw_text(label, (x, y), Lettering::plain(TEXT_MM, TextAnchor::Left));
        }
    }
    let widest_mm = widest_bar_label_mm(&scale, Y_TICKS_MM * UNITS_PER_MM);
    let label_x = right + (TICK_MM + 0.6 + widest_mm + LINE_MM / 2.0) * UNITS_PER_MM;
    let upwards = Lettering { upwards: true, ..Lettering::plain(TEXT_MM, TextAnchor::Centre) };
    let label = truncate_text(&heat.label, TEXT_MM, (axes.bottom - axes.top) / UNITS_PER_MM);
    canvas.draw_text(&label, (label_x, (axes.top + axes.bottom) / 2.0), upwards);
}

/// Draws the colours of the bar from bottom to top as stripes. Every stripe reaches to the top and is covered
/// by the next ones, so that there are no gaps.
fn draw_gradient(canvas: &mut Canvas, area: &CanvasArea, map: ColourMap) {
    const STRIPES: u32 = 64;
    for stripe in 0..STRIPES {
        let share = f64::from(stripe) / f64::from(STRIPES);
        let bottom = (area.bottom - share * (area.bottom - area.top)).round();
        let colour = sample_colour_map(map, f64::from(stripe) / f64::from(STRIPES - 1));
        canvas.fill_rectangle(&CanvasArea { bottom, ..*area }, colour, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::AxisScale;

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

    fn axis(low: f64, high: f64) -> CanvasAxis {
        CanvasAxis { scale: AxisScale::Linear, low, high, from: 0.0, to: 40.0 }
    }

    #[test]
    fn every_step_of_an_axis_has_its_cells() {
        let covered = |middles: &[f64], count| resample_cells(middles, &axis(0.0, 4.0), count);
        let some = |r: Range<usize>| Some(r);
        // the cells cover 0.5 to 3.5, each 1 wide; steps outside contain no cell
        assert_eq!(
            covered(&[1.0, 2.0, 3.0], 8),
            [None, some(0..1), some(0..1), some(1..2), some(1..2), some(2..3), some(2..3), None]
        );
        assert_eq!(covered(&[0.1, 0.2, 0.3, 3.9], 2), [some(0..3), some(3..4)]);
        assert_eq!(covered(&[7.0], 2), [some(0..1), some(0..1)]);
        assert_eq!((covered(&[], 1), covered(&[2.0, 1.0], 1)), (vec![None], vec![None]));
    }

    fn decode(png: &[u8]) -> Vec<u8> {
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        pixels
    }

    #[test]
    fn a_picture_has_the_colours_of_its_cells_and_the_low_end_of_the_axis_below() {
        let heat = HeatMap {
            x: vec![0.5, 1.5, 2.5, 3.5],
            y: vec![1.0, 3.0],
            values: vec![vec![Some(0.0), Some(1.0)], vec![None; 2], vec![Some(0.5); 2], vec![Some(2.0); 2]],
            ..HeatMap::default()
        };
        let (x, y) = (axis(0.0, 4.0), CanvasAxis { from: 40.0, to: 0.0, ..axis(0.0, 4.0) });
        let pixels = decode(&encode_cells(&heat, &x, &y).unwrap());
        let at = |column: usize, row: usize| pixels[row * PIXELS[0] + column];
        let [right, bottom] = [PIXELS[0] - 1, PIXELS[1] - 1];
        let corners =
            [at(0, 0), at(0, bottom), at(right / 2 - 50, bottom), at(right / 2 + 50, 0), at(right, 0)];
        assert_eq!(corners, [60, 0, COLOURS, 30, COLOURS - 1]);
        assert!(encode_cells(&HeatMap::default(), &x, &y).is_none());
    }

    #[test]
    fn noise_of_any_size_stays_small() {
        let column = |i: usize| (0..400).map(|j| Some(((i * 7919 + j * 104_729) % 997) as f64)).collect();
        let heat = HeatMap {
            x: (0..2000).map(f64::from).collect(),
            y: (0..400).map(f64::from).collect(),
            values: (0..2000).map(column).collect(),
            ..HeatMap::default()
        };
        let (x, y) = (axis(0.0, 2000.0), CanvasAxis { from: 40.0, to: 0.0, ..axis(0.0, 400.0) });
        assert!(encode_cells(&heat, &x, &y).unwrap().len() < 110_000);
    }
}
