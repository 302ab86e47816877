//! The bar that says what the colours of a heat map mean.

use super::axis::{AxisScale, CanvasAxis};
use super::canvas::{Canvas, Lettering, TextAnchor};
use super::colours::{ColourMap, FRAME, sample_colour_map};
use super::heat::HeatMap;
use super::path::CanvasArea;
use super::sizes::{LINE_MM, TEXT_MM, TICK_MM, UNITS_PER_MM, Y_TICKS_MM};
use super::text::{text_width, truncate_text};

/// Distance of the bar from the axes, its width, and the height of the point at an end beyond which there are
/// values, mm.
const BAR_GAP_MM: f64 = 2.5;
const BAR_MM: f64 = 3.0;
const POINT_MM: f64 = 2.0;

/// The bar's axis between two places.
fn colour_bar_axis(ends: (f64, f64), from: f64, to: f64) -> CanvasAxis {
    CanvasAxis { scale: AxisScale::Linear, low: ends.0, high: ends.1, from, to }
}

/// Room that the bar takes next to the axes, mm.
pub(super) fn colour_bar_width_mm(heat: &HeatMap, height_mm: f64) -> f64 {
    let Some(ends) = heat.value_range().filter(|_| !heat.without_bar) else { return 0.0 };
    BAR_GAP_MM
        + BAR_MM
        + TICK_MM
        + 0.6
        + widest_bar_label_mm(&colour_bar_axis(ends, 0.0, height_mm), Y_TICKS_MM)
        + LINE_MM
}

/// Width of the widest label of a bar whose ticks are that far apart.
fn widest_bar_label_mm(scale: &CanvasAxis, apart: f64) -> f64 {
    /// Digits and signs are wider than the mean letter.
    const DIGITS: f64 = 1.2;
    scale
        .ticks(apart)
        .iter()
        .filter_map(|t| t.label.as_deref())
        .map(|l| DIGITS * text_width(l, TEXT_MM))
        .fold(0.0, f64::max)
}

/// The bar of colours next to the axes, with ticks and label; pointed where values lie beyond its end.
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
    if over > 0.0 {
        canvas.fill_polygon(
            &[(left, top), (middle, axes.top), (right, top)],
            sample_colour_map(heat.colour_map, 1.0),
            1.0,
        );
    }
    if under > 0.0 {
        canvas.fill_polygon(
            &[(left, bottom), (middle, axes.bottom), (right, bottom)],
            sample_colour_map(heat.colour_map, 0.0),
            1.0,
        );
    }
    canvas.draw_line(
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
    let scale = colour_bar_axis((low, high), bottom, top);
    for tick in scale.ticks(Y_TICKS_MM * UNITS_PER_MM) {
        let Some(y) = scale.canvas_position(tick.value) else { continue };
        canvas.draw_line(&[(right, y), (right + tick.length(), y)], FRAME, 3);
        if let Some(label) = &tick.label {
            canvas.draw_text(
                label,
                (right + (TICK_MM + 0.6) * UNITS_PER_MM, y),
                Lettering::plain(TEXT_MM, TextAnchor::Left),
            );
        }
    }
    let label_x = right
        + (TICK_MM + 0.6 + widest_bar_label_mm(&scale, Y_TICKS_MM * UNITS_PER_MM) + LINE_MM / 2.0)
            * UNITS_PER_MM;
    let upwards = Lettering { upwards: true, ..Lettering::plain(TEXT_MM, TextAnchor::Centre) };
    let label = truncate_text(&heat.label, TEXT_MM, (axes.bottom - axes.top) / UNITS_PER_MM);
    canvas.draw_text(&label, (label_x, (axes.top + axes.bottom) / 2.0), upwards);
}

/// The colours from bottom to top; every stripe reaches to the top, so that no gap shows between them.
fn draw_gradient(canvas: &mut Canvas, area: &CanvasArea, map: ColourMap) {
    const STRIPES: u32 = 64;
    for stripe in 0..STRIPES {
        let share = f64::from(stripe) / f64::from(STRIPES);
        let bottom = (area.bottom - share * (area.bottom - area.top)).round();
        canvas.fill_rectangle(
            &CanvasArea { bottom, ..*area },
            sample_colour_map(map, f64::from(stripe) / f64::from(STRIPES - 1)),
            1.0,
        );
    }
}
