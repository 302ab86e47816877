//! The bar that says what the colours of a heat map mean.

use super::axis::{Mapped, Scale};
use super::canvas::{Anchor, Canvas, Lettering};
use super::colours::{Colours, FRAME, colour};
use super::heat::Heat;
use super::path::Area;
use super::sizes::{LINE_MM, TEXT_MM, TICK_MM, UNITS, Y_TICKS_MM};
use super::text::{shortened, text_width};

/// Distance of the bar from the axes, its width, and the height of the point at an end beyond which there are
/// values, mm.
const BAR_GAP_MM: f64 = 2.5;
const BAR_MM: f64 = 3.0;
const POINT_MM: f64 = 2.0;

/// The bar's axis between two places.
fn scale(ends: (f64, f64), from: f64, to: f64) -> Mapped {
    Mapped { scale: Scale::Linear, low: ends.0, high: ends.1, from, to }
}

/// Room that the bar takes next to the axes, mm.
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

/// The bar of colours next to the axes, with ticks and label; pointed where values lie beyond its end.
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
        canvas.line(&[(right, y), (right + tick.length(), y)], FRAME, 3);
        if let Some(label) = &tick.label {
            canvas.text(label, (right + (TICK_MM + 0.6) * UNITS, y), Lettering::plain(TEXT_MM, Anchor::Left));
        }
    }
    let label_x = right + (TICK_MM + 0.6 + widest_mm(&scale, Y_TICKS_MM * UNITS) + LINE_MM / 2.0) * UNITS;
    let upwards = Lettering { upwards: true, ..Lettering::plain(TEXT_MM, Anchor::Centre) };
    let label = shortened(&heat.label, TEXT_MM, (axes.bottom - axes.top) / UNITS);
    canvas.text(&label, (label_x, (axes.top + axes.bottom) / 2.0), upwards);
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
