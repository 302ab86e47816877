//! Axes: ranges, mapping of values to the canvas, ticks and labels.

use super::style::{TICK_MM, UNITS_PER_MM};
use crate::number::{format_decimals, format_scientific, to_superscript};
use portable_math as math;

/// Scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AxisScale {
    /// Linear: equal differences between values have equal lengths on the axis.
    #[default]
    Linear,
    /// Logarithmic; values of zero or less are not drawn.
    Log,
}

/// An axis of a panel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ChartAxis {
    /// Quantity and unit; empty for none.
    pub label: String,
    /// Linear or logarithmic.
    pub scale: AxisScale,
    /// Low and high end, in axis units; `None` to fit them to the data.
    pub range: Option<(f64, f64)>,
    /// Positions and names of the ticks of a categorical axis; empty for a numerical axis.
    pub categories: Vec<(f64, String)>,
}

/// Label of every time axis. A linear axis with this label is treated as a time axis.
const TIME_LABEL: &str = "time, s";

impl ChartAxis {
    /// A linear axis that fits the data.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: AxisScale::Linear, ..Self::default() }
    }

    /// A linear time axis, s; all panels of a web page with a time axis share one cursor.
    pub fn time() -> Self {
        Self::linear(TIME_LABEL)
    }

    /// Whether this is a time axis.
    pub(super) fn is_time(&self) -> bool {
        self.label == TIME_LABEL && self.scale == AxisScale::Linear
    }

    /// Scale by which the script of a web page moves its cursor along this axis: `"time"` for a time axis,
    /// `"linear"` or `"log"` for a frequency axis, and `None` for any other axis, which has no cursor.
    pub(super) fn cursor_scale(&self) -> Option<&'static str> {
        match self.scale {
            AxisScale::Linear if self.is_time() => Some("time"),
            _ if !self.label.starts_with("frequency") => None,
            AxisScale::Linear => Some("linear"),
            AxisScale::Log => Some("log"),
        }
    }

    /// A logarithmic axis that fits the data.
    pub fn log(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: AxisScale::Log, ..Self::default() }
    }

    /// A categorical axis with one name at every whole number from 0 and a margin of half a step.
    pub fn categorical(label: impl Into<String>, names: impl IntoIterator<Item = String>) -> Self {
        let categories: Vec<(f64, String)> =
            names.into_iter().enumerate().map(|(i, name)| (i as f64, name)).collect();
        let end = categories.len().max(1) as f64 - 0.5;
        Self { categories, ..Self::linear(label).with_range(-0.5, end) }
    }

    /// This axis with its ends fixed at `low` and `high`.
    pub fn with_range(self, low: f64, high: f64) -> Self {
        self.with_ends(Some((low, high)))
    }

    /// This axis with its ends fixed, or fitted to the data for `None`.
    pub fn with_ends(self, range: Option<(f64, f64)>) -> Self {
        Self { range, ..self }
    }
}

/// A tick and its label; a minor tick has no label.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub value: f64,
    pub label: Option<String>,
}

impl Tick {
    /// Length of the tick mark, canvas units; minor ticks are half as long.
    pub(crate) fn length(&self) -> f64 {
        if self.label.is_some() { TICK_MM * UNITS_PER_MM } else { TICK_MM / 2.0 * UNITS_PER_MM }
    }
}

/// An axis with known ends and a mapping of values to canvas coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CanvasAxis {
    pub scale: AxisScale,
    pub low: f64,
    pub high: f64,
    /// Canvas coordinate of the low end.
    pub from: f64,
    /// Canvas coordinate of the high end.
    pub to: f64,
}

/// Margin beyond the data at each end of a linear axis, as a fraction of the range of the data.
const LINEAR_ROOM: f64 = 0.05;
/// Smallest allowed margin at each end of a linear axis, as a fraction of the largest absolute value of the
/// data. Smaller differences between values are rounding errors, which tick labels could not show.
const MIN_RELATIVE_SPAN: f64 = 1e-4;
/// Margin at each end of a linear axis whose data are all zero, in axis units.
const SINGLE_VALUE_ROOM: f64 = 1.0;
/// Factor by which a logarithmic axis extends below and above the data.
const LOG_ROOM: f64 = 1.4;
/// Maximum number of decades below the largest value on a logarithmic axis that fits the data; smaller values
/// are rounding errors.
const MOST_DECADES: i32 = 6;

/// Largest allowed distance of a point from the low end of an axis, in axis lengths. Points farther away are
/// moved to this distance, so that clipping a line cannot overflow.
const FARTHEST_POSITION: f64 = 1e6;

/// Ends of an axis: the given ones, or those of the data with a margin. They are finite, ordered and
/// distinct, and above zero on a logarithmic axis.
pub(super) fn axis_limits(axis: &ChartAxis, values: impl Iterator<Item = f64>) -> (f64, f64) {
    let log = axis.scale == AxisScale::Log;
    let usable = |x: &f64| x.is_finite() && (!log || *x > 0.0);
    if let Some((low, high)) = axis.range.filter(|(low, high)| usable(low) && usable(high) && low < high) {
        return (low, high);
    }
    let (low, high) = value_span(values.filter(usable));
    if low > high {
        return if log { (0.1, 10.0) } else { (0.0, 1.0) };
    }
    if log {
        let low = low.max(high * math::powi(10.0, -MOST_DECADES)) / LOG_ROOM;
        return (low.max(f64::MIN_POSITIVE), high * LOG_ROOM);
    }
    let room = ((high - low) * LINEAR_ROOM).max(low.abs().max(high.abs()) * MIN_RELATIVE_SPAN);
    let room = if room > 0.0 { room } else { SINGLE_VALUE_ROOM };
    (low - room, high + room)
}

/// Smallest and largest value; `(inf, -inf)` if there are no values.
pub fn value_span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

impl CanvasAxis {
    /// Canvas coordinate of a value; `None` if the value is not finite, or is zero or less on a logarithmic
    /// axis.
    pub(crate) fn canvas_position(&self, value: f64) -> Option<f64> {
        let share = match self.scale {
            AxisScale::Linear => (value - self.low) / (self.high - self.low),
            AxisScale::Log if value > 0.0 => math::ln(value / self.low) / math::ln(self.high / self.low),
            AxisScale::Log => return None,
        };
        let near = share.clamp(-FARTHEST_POSITION, FARTHEST_POSITION);
        share.is_finite().then_some(self.from + near * (self.to - self.from))
    }

    /// As `canvas_position`, but values of zero or less map to the low end of a logarithmic axis.
    pub(crate) fn canvas_position_or_low(&self, value: f64) -> Option<f64> {
        let low = self.scale == AxisScale::Log && value <= 0.0;
        if low { Some(self.from) } else { self.canvas_position(value) }
    }

    /// The value at a canvas coordinate.
    pub(crate) fn value_at(&self, place: f64) -> f64 {
        let share = (place - self.from) / (self.to - self.from);
        match self.scale {
            AxisScale::Linear => self.low + share * (self.high - self.low),
            AxisScale::Log => self.low * math::exp(share * math::ln(self.high / self.low)),
        }
    }

    /// Ticks of the axis. Neighbouring labelled ticks are at least about `apart` canvas units apart.
    pub(crate) fn ticks(&self, apart: f64) -> Vec<Tick> {
        let most = ((self.to - self.from).abs() / apart).clamp(2.0, 12.0) as usize;
        let length = (self.to - self.from).abs();
        match self.scale {
            AxisScale::Linear => add_minor_ticks(linear_ticks(self.low, self.high, most), self, length),
            AxisScale::Log => {
                let decade = length / math::log10(self.high / self.low);
                log_ticks(self.low, self.high, most, decade / apart)
            }
        }
    }
}

/// Smallest allowed distance, in canvas units, between minor ticks; closer ticks would merge in print.
const MIN_MINOR_TICK_SPACING: f64 = 1.0 * UNITS_PER_MM;

/// Adds minor ticks to the labelled ticks of a linear axis if there is room: four between two neighbouring
/// labelled ticks, or three if their distance is 2 times a power of ten.
fn add_minor_ticks(mut ticks: Vec<Tick>, axis: &CanvasAxis, length: f64) -> Vec<Tick> {
    let [first, second, ..] = ticks.as_slice() else { return ticks };
    let (start, step) = (first.value, second.value - first.value);
    let leading = (step / math::powf(10.0, math::log10(step).floor())).round();
    let parts = if leading == 2.0 { 4 } else { 5 };
    let share = step / f64::from(parts) / (axis.high - axis.low);
    let apart = share * length;
    if apart.is_nan() || apart < MIN_MINOR_TICK_SPACING {
        return ticks;
    }
    let fine = step / f64::from(parts);
    let (low, high) = ((axis.low - start) / fine, (axis.high - start) / fine);
    let between = (low.ceil() as i64..=high.floor() as i64).filter(|k| k % i64::from(parts) != 0);
    ticks.extend(between.map(|k| Tick { value: start + k as f64 * fine, label: None }));
    ticks
}

/// Ticks of a categorical axis, with `shown(name)` as their labels.
pub(super) fn category_ticks(axis: &ChartAxis, shown: impl Fn(&str) -> String) -> Vec<Tick> {
    axis.categories.iter().map(|(value, name)| Tick { value: *value, label: Some(shown(name)) }).collect()
}

/// Smallest allowed ratio of the tick distance to the requested distance. If a step gives a smaller ratio,
/// the next coarser step is chosen.
const TICK_SPACING_SLACK: f64 = 0.8;

/// Ticks at the multiples of a step of 1, 2 or 5 times a power of ten.
fn linear_ticks(low: f64, high: f64, most: usize) -> Vec<Tick> {
    let rough = (high - low) / most as f64;
    let mut exponent = math::log10(rough).floor() as i32;
    let wide = |m: &i32| f64::from(*m) * math::powi(10.0, exponent) >= rough * TICK_SPACING_SLACK;
    let leading = [1, 2, 5].into_iter().find(wide);
    let leading = leading.unwrap_or_else(|| {
        exponent += 1;
        1
    });
    let value = |k: i64| {
        let multiple = (k * i64::from(leading)) as f64;
        let power = math::powi(10.0, exponent.abs());
        if exponent < 0 { multiple / power } else { multiple * power }
    };
    let step = value(1);
    let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
    if !(step.is_normal() && first.abs() < 1e15 && last.abs() < 1e15) {
        return [low, high].map(|value| Tick { value, label: Some(format_scientific(value, 2)) }).to_vec();
    }
    let plain = (-5..6).contains(&exponent);
    let decimals = usize::try_from(-exponent).unwrap_or(0);
    // enough digits to distinguish neighbouring ticks
    let digits = |v: f64| {
        let decades = (math::log10(v.abs()).floor() as i32).saturating_sub(exponent);
        decades.clamp(2, 15) as usize
    };
    let label = |v: f64| if plain { format_decimals(v, decimals) } else { format_scientific(v, digits(v)) };
    (first as i64..=last as i64).map(|k| Tick { value: value(k), label: Some(label(value(k))) }).collect()
}

/// Lists of multiples of a power of ten that may be labelled in every decade. Each list is followed by its
/// smallest distance between neighbouring multiples, in decades. The first list whose labels fit is used.
const LOG_LABEL_MULTIPLES: [(&[i32], f64); 2] = [(&[1, 2, 3, 5, 7], 0.154), (&[1, 2, 5], 0.301)];

/// Ticks at the powers of ten and their multiples, some of them labelled. `room` is the ratio of the length
/// of a decade to the smallest allowed distance between labels. If the axis contains fewer than two powers of
/// ten, at least 1, 2 and 5 times each power are labelled; if fewer than two of these values lie on the axis,
/// it has the ticks of a linear axis.
fn log_ticks(low: f64, high: f64, most: usize, room: f64) -> Vec<Tick> {
    let decades = (math::log10(low).floor() as i32)..=(math::log10(high).ceil() as i32);
    let inside = |v: &f64| *v >= low * (1.0 - 1e-9) && *v <= high * (1.0 + 1e-9);
    let power = |e: i32| if e < 0 { 1.0 / math::powi(10.0, -e) } else { math::powi(10.0_f64, e) };
    let count = |leading: &[i32]| {
        let all = decades.clone().flat_map(|e| leading.iter().map(move |m| f64::from(*m) * power(e)));
        all.filter(inside).count()
    };
    let (labelled, every): (&[i32], i32) = match (count(&[1]), count(&[1, 2, 5])) {
        (0 | 1, 0 | 1) => return linear_ticks(low, high, most.min(5)),
        (decades, _) => match LOG_LABEL_MULTIPLES.iter().find(|(_, apart)| apart * room >= 1.0) {
            Some((multiples, _)) => (multiples, 1),
            None if decades < 2 => (&[1, 2, 5], 1),
            None => (&[1], (decades as i32 + most as i32 - 1) / most as i32),
        },
    };
    let tick = |m: i32, e: i32| {
        let value = f64::from(m) * power(e);
        let shown = labelled.contains(&m) && e.rem_euclid(every.max(1)) == 0;
        inside(&value).then(|| Tick { value, label: shown.then(|| log_label(m, e)) })
    };
    decades.clone().flat_map(|e| (1..10).filter_map(move |m| tick(m, e))).collect()
}

/// The label of `m 10^e`: plain digits for `e` from -3 to 4, otherwise a power of ten.
fn log_label(m: i32, e: i32) -> String {
    match e {
        0..=4 => format!("{m}{}", "0".repeat(e as usize)),
        -3..=-1 => format!("{:.*}", (-e) as usize, f64::from(m) / math::powi(10.0, -e)),
        _ if m == 1 => format!("10{}", to_superscript(e)),
        _ => format!("{m}\u{b7}10{}", to_superscript(e)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().filter_map(|t| t.label.as_deref()).collect()
    }

    #[test]
    fn linear_ticks_are_round_numbers_without_rounding_noise() {
        assert_eq!(
            labels(&linear_ticks(-0.25, 0.32, 6)),
            ["\u{2212}0.2", "\u{2212}0.1", "0.0", "0.1", "0.2", "0.3"]
        );
        assert_eq!(
            labels(&linear_ticks(0.0, 1.0e-4, 5)),
            ["0.00000", "0.00002", "0.00004", "0.00006", "0.00008", "0.00010"]
        );
        assert_eq!(
            labels(&linear_ticks(0.0, 4.0e-7, 4)),
            [
                "0",
                "1\u{b7}10\u{207b}\u{2077}",
                "2\u{b7}10\u{207b}\u{2077}",
                "3\u{b7}10\u{207b}\u{2077}",
                "4\u{b7}10\u{207b}\u{2077}"
            ]
        );
        assert_eq!(labels(&linear_ticks(950.0, 2100.0, 3)), ["1000", "1500", "2000"]);
    }

    #[test]
    fn a_log_axis_is_labelled_at_any_width() {
        assert_eq!(labels(&log_ticks(0.05, 2000.0, 8, 1.0)), ["0.1", "1", "10", "100", "1000"]);
        assert_eq!(labels(&log_ticks(30.0, 300.0, 8, 1.0)), ["50", "100", "200"]);
        assert_eq!(labels(&log_ticks(310.0, 480.0, 8, 1.0)), ["350", "400", "450"]);
        assert_eq!(
            labels(&log_ticks(1e-8, 1e-5, 8, 1.0)),
            ["10\u{207b}\u{2078}", "10\u{207b}\u{2077}", "10\u{207b}\u{2076}", "10\u{207b}\u{2075}"]
        );
    }

    #[test]
    fn multiples_of_a_decade_are_labelled_where_there_is_room() {
        assert_eq!(labels(&log_ticks(100.0, 1000.0, 8, 6.6)), ["100", "200", "300", "500", "700", "1000"]);
        assert_eq!(labels(&log_ticks(100.0, 1000.0, 8, 4.0)), ["100", "200", "500", "1000"]);
        assert_eq!(labels(&log_ticks(100.0, 1000.0, 8, 3.0)), ["100", "1000"]);
    }

    #[test]
    fn a_linear_axis_has_ticks_between_its_labels_where_there_is_room() {
        let minor = |high: f64, length_mm: f64| {
            let axis = CanvasAxis {
                scale: AxisScale::Linear,
                low: 0.0,
                high,
                from: 0.0,
                to: length_mm * UNITS_PER_MM,
            };
            let ticks = axis.ticks(18.0 * UNITS_PER_MM);
            ticks.iter().filter(|t| t.label.is_none()).map(|t| t.value).collect::<Vec<_>>()
        };
        assert_eq!(
            minor(400.0, 100.0),
            [
                20.0, 40.0, 60.0, 80.0, 120.0, 140.0, 160.0, 180.0, 220.0, 240.0, 260.0, 280.0, 320.0, 340.0,
                360.0, 380.0
            ]
        );
        assert_eq!(minor(400.0, 7.0), [0.0; 0]);
        assert_eq!(minor(800.0, 80.0)[..3], [50.0, 100.0, 150.0]);
    }

    #[test]
    fn ends_are_apart_and_finite_whatever_the_data() {
        let linear = ChartAxis::linear("x");
        assert_eq!(axis_limits(&linear, [].into_iter()), (0.0, 1.0));
        assert_eq!(axis_limits(&linear, [f64::NAN, f64::INFINITY].into_iter()), (0.0, 1.0));
        let (low, high) = axis_limits(&linear, [3.0, 3.0].into_iter());
        assert!(low < 3.0 && high > 3.0);
        assert_eq!(axis_limits(&linear, [0.0, 0.0].into_iter()), (-1.0, 1.0));
        assert_eq!(axis_limits(&ChartAxis::log("x"), [-1.0, 0.0].into_iter()), (0.1, 10.0));
        assert_eq!(
            axis_limits(&ChartAxis::linear("x").with_range(2.0, 1.0), [0.0, 1.0].into_iter()),
            (-0.05, 1.05)
        );
    }

    #[test]
    fn values_that_differ_by_rounding_have_labels_that_differ() {
        let (low, high) = axis_limits(&ChartAxis::linear("x"), [0.9, 0.9 + 1e-16, 0.9 - 2e-16].into_iter());
        let ticks = linear_ticks(low, high, 5);
        let labels = labels(&ticks);
        let small = linear_ticks(1.23e-4, 1.2301e-4, 5);
        let apart = small.windows(2).all(|pair| pair[0].label != pair[1].label);
        assert!(apart && labels.len() > 2 && labels.windows(2).all(|pair| pair[0] != pair[1]), "{labels:?}");
    }

    #[test]
    fn a_log_axis_has_no_place_for_zero() {
        let axis = CanvasAxis { scale: AxisScale::Log, low: 1.0, high: 100.0, from: 0.0, to: 10.0 };
        assert_eq!(axis.canvas_position(0.0), None);
        assert_eq!(axis.canvas_position(10.0), Some(5.0));
        assert_eq!(
            [
                axis.canvas_position_or_low(-1.0),
                axis.canvas_position_or_low(10.0),
                axis.canvas_position_or_low(f64::NAN)
            ],
            [Some(0.0), Some(5.0), None]
        );
        assert!(
            (axis.value_at(5.0) - 10.0).abs() < 1e-12
                && (CanvasAxis { scale: AxisScale::Linear, ..axis }.value_at(5.0) - 50.5).abs() < 1e-12
        );
    }
}
