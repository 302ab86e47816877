//! Position of a panel on the canvas, and the ticks for which it has room.

use super::visible_y_values;
use crate::axis;
use crate::axis::{AxisScale, CanvasAxis, Tick};
use crate::elements::Panel;
use crate::path::{CanvasArea, CanvasPoint};
use crate::style::{
    EDGE_MM, LINE_MM, SMALL_MM, TEXT_MM, UNITS_PER_MM, X_LOG_TICKS_MM, X_TICKS_MM, Y_LOG_TICKS_MM, Y_TICKS_MM,
};
use crate::text::{LETTER, WIDE_LETTER, text_width, truncate_text, wrap_in_two_lines};

/// Number of ticks tried first on a narrow x axis, even if they are closer together than usual.
const LEAST_X_TICKS: f64 = 4.0;

/// A panel with its position; areas in canvas units, lengths in mm.
pub(crate) struct PanelLayout<'a> {
    pub panel: &'a Panel,
    pub x: CanvasAxis,
    pub y: CanvasAxis,
    pub area: CanvasArea,
    /// Whether the ticks of the x axis are labelled here.
    pub has_x_labels: bool,
    /// Rows of the labels above the panel: first of the vertical lines, then of the top labels.
    pub label_rows: Vec<Option<usize>>,
    /// Letter of the panel; `None` for a single panel.
    pub letter: Option<char>,
    /// Left end of the panel's column, mm from the left edge of the figure.
    pub column_mm: f64,
    /// Height of the labels below the axes, mm.
    pub(super) under_mm: f64,
    /// Largest allowed width of the names along the y axis, mm.
    pub(super) names_mm: f64,
}

impl<'a> PanelLayout<'a> {
    pub(crate) fn new(
        panel: &'a Panel,
        (x, (low, high)): (CanvasAxis, (f64, f64)),
        top_mm: f64,
        last: bool,
        rows: Vec<Option<usize>>,
    ) -> Self {
        let area = CanvasArea {
            left: x.from,
            right: x.to,
            top: (top_mm * UNITS_PER_MM).round(),
            bottom: ((top_mm + panel.height_mm) * UNITS_PER_MM).round(),
        };
        let (y_low, y_high) = axis::axis_limits(&panel.y, visible_y_values(panel, low, high));
        let mut placed = Self {
            panel,
            x,
            y: CanvasAxis { scale: panel.y.scale, low: y_low, high: y_high, from: area.bottom, to: area.top },
            area,
            has_x_labels: last && !panel.bare,
            label_rows: rows,
            letter: None,
            column_mm: 0.0,
            under_mm: 0.0,
            names_mm: 0.0,
        };
        if panel.equal_aspect {
            placed.equalise_scales();
        }
        if placed.has_x_labels {
            let label = if panel.x.label.is_empty() { 0.0 } else { LINE_MM };
            placed.under_mm = label + placed.x_names_mm().map_or(LINE_MM, |names| names + 1.0);
        }
        placed
    }

    /// Canvas coordinates of a point in axis units; `None` if an axis has no position for it, such as zero on
    /// a logarithmic axis.
    pub(crate) fn canvas_point(&self, (x, y): (f64, f64)) -> Option<CanvasPoint> {
        Some((self.x.canvas_position(x)?, self.y.canvas_position(y)?))
    }

    /// Widens the range of one axis about its middle until both axes have the same length per unit.
    fn equalise_scales(&mut self) {
        let unit = |axis: &CanvasAxis| (axis.high - axis.low) / (axis.to - axis.from).abs();
        let most = unit(&self.x).max(unit(&self.y));
        for axis in [&mut self.x, &mut self.y] {
            let (middle, half) = ((axis.low + axis.high) / 2.0, most * (axis.to - axis.from).abs() / 2.0);
            (axis.low, axis.high) = (middle - half, middle + half);
        }
    }

    /// Ticks of the x axis: names, or numbers without overlap.
    pub(crate) fn x_ticks(&self) -> Vec<Tick> {
        if !self.panel.x.categories.is_empty() {
            let most_mm = self.x_names_mm().map_or(f64::INFINITY, |_| MOST_NAMES * self.panel.height_mm);
            return axis::category_ticks(&self.panel.x, |name| truncate_text(name, TEXT_MM, most_mm));
        }
        let width = self.area.right - self.area.left;
        let usual_mm = if self.x.scale == AxisScale::Log { X_LOG_TICKS_MM } else { X_TICKS_MM };
        let mut apart = (usual_mm * UNITS_PER_MM).min(width / LEAST_X_TICKS);
        let mut ticks = self.x.ticks(apart);
        while !self.are_labels_apart(&ticks) && apart < width {
            apart *= 1.3;
            let fewer = self.x.ticks(apart);
            if !shows_scale(&fewer) {
                break;
            }
            ticks = fewer;
        }
        self.drop_crowded_labels(&mut ticks);
        ticks
    }

    /// Left and right end, in canvas units, of a tick label of the x axis.
    fn tick_label_span(&self, tick: &Tick) -> Option<(f64, f64)> {
        let at = self.x.canvas_position(tick.value)?;
        let half = text_width(tick.label.as_ref()?, TEXT_MM) * UNITS_PER_MM / 2.0;
        Some((at - half, at + half))
    }

    fn are_labels_apart(&self, ticks: &[Tick]) -> bool {
        let spans: Vec<_> = ticks.iter().filter_map(|tick| self.tick_label_span(tick)).collect();
        spans.windows(2).all(|pair| pair[0].1 + UNITS_PER_MM < pair[1].0)
    }

    /// Removes labels that would overlap the previous label or extend outside the figure.
    fn drop_crowded_labels(&self, ticks: &mut [Tick]) {
        let mut end = f64::NEG_INFINITY;
        let edge = self.area.right + (EDGE_MM + HALF_LABEL_MM) * UNITS_PER_MM;
        for tick in ticks {
            let Some((left, right)) = self.tick_label_span(tick) else { continue };
            let wide = (right - left) * (WIDE_LETTER / LETTER - 1.0) / 2.0;
            if left < end + UNITS_PER_MM || right + wide > edge {
                tick.label = None;
            } else {
                end = right;
            }
        }
    }

    /// Ticks of the y axis.
    pub(crate) fn y_ticks(&self) -> Vec<Tick> {
        y_axis_ticks(self.panel, &self.y, self.names_mm)
    }

    /// Height of vertical names below an x axis, mm; `None` if they are horizontal or there are no names.
    pub(crate) fn x_names_mm(&self) -> Option<f64> {
        let names = &self.panel.x.categories;
        let step_mm = (self.area.right - self.area.left) / UNITS_PER_MM / (self.x.high - self.x.low).max(1.0);
        let widest = names.iter().map(|(_, name)| text_width(name, TEXT_MM)).fold(0.0, f64::max);
        (widest > step_mm - 1.0 && !names.is_empty()).then(|| widest.min(MOST_NAMES * self.panel.height_mm))
    }
}

// Ticks of a y axis and the width of their labels.

/// Largest allowed fraction of the available space for names along an axis: of the column width for names
/// along a y axis, and of the height of the axes for vertical names below an x axis.
pub(super) const MOST_NAMES: f64 = 0.4;
/// Half the width, mm, of a label of five digits; such a label may be centred on the end of the axis.
pub(super) const HALF_LABEL_MM: f64 = 2.0;
/// Smallest allowed distance between labelled ticks, mm, on a y axis that would otherwise have fewer than two
/// labelled ticks: the height of a line of text.
const CROWDED_Y_TICKS_MM: f64 = LINE_MM;
/// Height, mm, of each line of a name that is wrapped to two lines of small letters.
pub(crate) const SMALL_LINE_MM: f64 = SMALL_MM + 0.1;
/// Vertical gap, mm, between neighbouring names that are wrapped to two lines.
const BETWEEN_NAMES_MM: f64 = 0.6;

/// Whether at least two ticks have labels; a single label shows no scale.
pub(super) fn shows_scale(ticks: &[Tick]) -> bool {
    ticks.iter().filter(|tick| tick.label.is_some()).nth(1).is_some()
}

/// Ticks of a y axis. Names wider than `names_mm` wrap to two lines of small letters if the ticks are far
/// enough apart.
pub(super) fn y_axis_ticks(panel: &Panel, y: &CanvasAxis, names_mm: f64) -> Vec<Tick> {
    if panel.y.categories.is_empty() {
        let usual_mm = if y.scale == AxisScale::Log { Y_LOG_TICKS_MM } else { Y_TICKS_MM };
        let [usual, crowded] = [usual_mm, CROWDED_Y_TICKS_MM].map(|mm| y.ticks(mm * UNITS_PER_MM));
        return if shows_scale(&usual) { usual } else { crowded };
    }
    let apart_mm = (y.to - y.from).abs() / UNITS_PER_MM / (y.high - y.low).max(1.0);
    let in_two = apart_mm >= 2.0 * SMALL_LINE_MM + BETWEEN_NAMES_MM;
    axis::category_ticks(&panel.y, |name| {
        if in_two { wrap_in_two_lines(name, names_mm) } else { truncate_text(name, TEXT_MM, names_mm) }
    })
}

/// Width of the widest tick label of a y axis, mm.
pub(crate) fn widest_label_mm(ticks: &[Tick]) -> f64 {
    let width = |label: &str| match label.split_once('\n') {
        Some((first, second)) => text_width(first, SMALL_MM).max(text_width(second, SMALL_MM)),
        None => text_width(label, TEXT_MM),
    };
    ticks.iter().filter_map(|t| t.label.as_deref()).map(width).fold(6.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().filter_map(|tick| tick.label.as_deref()).collect()
    }

    #[test]
    fn a_low_axis_has_two_numbers_where_there_is_room_for_lines_of_text() {
        let of = |height_mm: f64| {
            let y = CanvasAxis {
                scale: Default::default(),
                low: 13.0,
                high: 93.0,
                from: height_mm * UNITS_PER_MM,
                to: 0.0,
            };
            y_axis_ticks(&Panel::default(), &y, 0.0)
        };
        assert_eq!(numbers(&of(24.0)), ["20", "40", "60", "80"]);
        assert_eq!(numbers(&of(20.0)), ["20", "40", "60", "80"]);
    }

    #[test]
    fn numbers_that_have_room_beside_each_other_only_one_in_two_are_not_one_alone() {
        let x = CanvasAxis {
            scale: Default::default(),
            low: 0.001_851,
            high: 0.001_949,
            from: 0.0,
            to: 44.0 * UNITS_PER_MM,
        };
        let placed =
            PanelLayout::new(&Panel::default(), (x, (x.low, x.high)), 0.0, true, Vec::new()).x_ticks();
        assert_eq!(numbers(&placed), ["0.00186", "0.00190", "0.00194"]);
        // the last of these labels would extend outside the figure
        let x = CanvasAxis { high: 0.001_941, ..x };
        let placed =
            PanelLayout::new(&Panel::default(), (x, (x.low, x.high)), 0.0, true, Vec::new()).x_ticks();
        assert_eq!(numbers(&placed), ["0.00186", "0.00190"]);
    }

    #[test]
    fn long_names_along_a_y_axis_take_two_lines_where_there_is_room() {
        let name = "deflection at 0.08 m/s, before";
        let panel = Panel {
            y: axis::ChartAxis::categorical("", [name.to_owned(), "low".to_owned()]),
            ..Panel::default()
        };
        let labels = |height_mm: f64| {
            let y = CanvasAxis {
                scale: Default::default(),
                low: -0.5,
                high: 1.5,
                from: height_mm * UNITS_PER_MM,
                to: 0.0,
            };
            y_axis_ticks(&panel, &y, 26.0).into_iter().filter_map(|tick| tick.label).collect::<Vec<_>>()
        };
        assert_eq!(labels(12.0), ["deflection at\n0.08 m/s, before", "low"]);
        assert_eq!(labels(10.5), ["deflection at\u{2026}", "low"]);
    }
}
