//! Spectrogram: amplitude over time and frequency as colours, with the ridge that was followed, and the ridge
//! over the speed of the tip.

pub(crate) mod caption;
mod compared;
mod targets;

use crate::math;
pub use crate::spectrum::time_frequency::SpeedPoint;
pub use compared::{SpectrogramComparison, SpectrogramSide, draw_comparison};

use crate::chart::{
    ChartAxis, Colour, ErrorBar, FULL_WIDTH_MM, Figure, HeatMap, Mark, MarkerShape, Panel, Series,
    VerticalLine,
};
use crate::figures::subtitle;
use crate::spectrum::time_frequency;
use crate::spectrum::time_frequency::course::DYNAMIC_RANGE_DB;

/// A frequency followed over time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpectrogramRidgePoint {
    /// Instant, s.
    pub time_s: f64,
    /// Frequency, Hz; `None` where no ridge stands out.
    pub frequency_hz: Option<f64>,
}

/// A frequency that is sought in a window.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TargetFrequency {
    /// What it is.
    pub name: String,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Its standard deviation, Hz, where known.
    pub frequency_sd_hz: Option<f64>,
    /// Start and end of the window, s.
    pub span_s: (f64, f64),
    /// Whether the model has it.
    pub met: bool,
}

/// What a spectrogram shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpectrogramPlot {
    /// Heading.
    pub title: String,
    /// Quantity, such as "deflection".
    pub quantity: String,
    /// How it was made, such as the length of the sliding window; empty for none.
    pub note: String,
    /// Whether the motion is one that no camera took.
    pub synthetic: bool,
    /// Middles of the sliding window, ascending, s.
    pub time_s: Vec<f64>,
    /// Frequencies, ascending, Hz.
    pub frequency_hz: Vec<f64>,
    /// Amplitude of a sine, m: one list an instant, one value a frequency; `None` where the record has too
    /// little to say.
    pub amplitude_m: Vec<Vec<Option<f64>>>,
    /// Whether the frequency axis is logarithmic.
    pub log_frequency: bool,
    /// Frequencies shown, Hz; `None` for all (above zero on a logarithmic axis).
    pub shown_hz: Option<(f64, f64)>,
    /// The ridge in order of time.
    pub ridge: Vec<SpectrogramRidgePoint>,
    /// Named instants, s.
    pub instants: Vec<(String, f64)>,
    /// The frequencies that are sought, each in its window.
    pub targets: Vec<TargetFrequency>,
    /// The ridge over the speed of the tip; empty for no such panel.
    pub over_speed: Vec<SpeedPoint>,
}

/// Heights of the two panels, mm.
const HEIGHT_MM: f64 = 72.0;
const SPEED_HEIGHT_MM: f64 = 38.0;
/// Share of the cells that lie under the first colour: what noise alone leaves there is not worth a colour.
const UNDER_COLOURS: f64 = 0.1;
/// The colours start and end at multiples of this, dB.
const STEP_DB: f64 = 5.0;
/// Amplitude of 0 dB, m.
const REFERENCE_M: f64 = 1e-6;
const MILLIMETRES: f64 = 1e3;

/// The figure.
#[must_use]
pub fn draw_figure(shown: &SpectrogramPlot) -> Figure {
    let mut panels = vec![draw_map(shown)];
    if !shown.over_speed.is_empty() {
        panels.push(draw_over_speed(&shown.over_speed));
    }
    Figure {
        title: shown.title.clone(),
        subtitle: subtitle(shown.synthetic, &shown.note),
        watermarked: shown.synthetic,
        description: format!(
            "Spectrogram of {}: amplitude of a sine over time and frequency, in dB re 1 \u{b5}m; light grey \
             where there is no value. \
             The line is the ridge that was followed; it has gaps where nothing stands out, and where \
             segments do not agree on a frequency.",
            shown.quantity
        ),
        width_mm: FULL_WIDTH_MM,
        panels,
        ..Figure::default()
    }
}

/// Every amplitude in dB.
fn decibel_map(amplitude_m: &[Vec<Option<f64>>]) -> Vec<Vec<Option<f64>>> {
    amplitude_m.iter().map(|column| column.iter().map(|a| a.and_then(amplitude_decibels)).collect()).collect()
}

/// The colours, with ridge and instants over them.
fn draw_map(shown: &SpectrogramPlot) -> Panel {
    let values = decibel_map(&shown.amplitude_m);
    let heat = HeatMap {
        label: format!("amplitude of {}, dB re 1 \u{b5}m", shown.quantity),
        x: shown.time_s.clone(),
        y: shown.frequency_hz.clone(),
        range: colour_range_db(&values),
        values,
        ..HeatMap::default()
    };
    let y = if shown.log_frequency {
        ChartAxis::log("frequency, Hz")
    } else {
        ChartAxis::linear("frequency, Hz")
    };
    let rule = |(label, at): &(String, f64)| VerticalLine {
        label: label.clone(),
        colour: Colour::White,
        mark: Mark::Dashed,
        at: *at,
        above: None,
    };
    Panel {
        x: limit_axis(ChartAxis::time(), time_span(&shown.time_s)),
        y: limit_axis(y, shown.shown_hz.or_else(|| frequency_range(shown))),
        height_mm: HEIGHT_MM,
        series: targets::target_lines_over_map(&shown.targets)
            .into_iter()
            .chain(ridge_series(&shown.ridge))
            .collect(),
        vertical_lines: shown.instants.iter().map(rule).collect(),
        annotations: targets::target_names(shown),
        heat_map: Some(heat),
        ..Panel::default()
    }
}

/// Amplitude, m, in dB; an amplitude of zero lies under every colour.
fn amplitude_decibels(amplitude_m: f64) -> Option<f64> {
    (amplitude_m.is_finite() && amplitude_m >= 0.0)
        .then(|| 20.0 * math::log10((amplitude_m / REFERENCE_M).max(f64::MIN_POSITIVE)))
}

/// Values of the first and the last colour, dB.
fn colour_range_db(values: &[Vec<Option<f64>>]) -> Option<(f64, f64)> {
    let mut all: Vec<f64> = values.iter().flatten().flatten().copied().collect();
    let peak = all.iter().copied().reduce(f64::max)?;
    let under = (all.len() as f64 * UNDER_COLOURS) as usize;
    let low = *all.select_nth_unstable_by(under, f64::total_cmp).1;
    let high = (peak / STEP_DB).ceil() * STEP_DB;
    let low = (low.max(high - DYNAMIC_RANGE_DB) / STEP_DB).floor() * STEP_DB;
    Some((low, high.max(low + STEP_DB)))
}

fn limit_axis(axis: ChartAxis, ends: Option<(f64, f64)>) -> ChartAxis {
    match ends {
        Some((low, high)) => axis.with_range(low, high),
        None => axis,
    }
}

/// From the start of the first column to the end of the last; of a single one, around it.
fn time_span(middles: &[f64]) -> Option<(f64, f64)> {
    let ([first, second, ..], [.., before, last]) = (middles, middles) else { return None };
    Some((first - (second - first) / 2.0, last + (last - before) / 2.0))
}

/// All frequencies; on a logarithmic axis those above zero.
fn frequency_range(shown: &SpectrogramPlot) -> Option<(f64, f64)> {
    let lowest = shown.frequency_hz.iter().find(|f| **f > 0.0 || !shown.log_frequency)?;
    Some((*lowest, *shown.frequency_hz.last()?))
}

/// The line of the ridge; nothing where it has no point at all.
fn ridge_series(points: &[SpectrogramRidgePoint]) -> Option<Series> {
    let drawn: Vec<Option<(f64, f64)>> =
        points.iter().map(|p| p.frequency_hz.map(|f| (p.time_s, f))).collect();
    drawn.iter().any(Option::is_some).then(|| Series {
        label: "ridge".to_owned(),
        colour: Colour::Vermilion,
        mark: Mark::Edged,
        points: drawn,
        error_bars: Vec::new(),
    })
}

/// Frequency of the ridge over the speed of the tip.
fn draw_over_speed(points: &[SpeedPoint]) -> Panel {
    let place = |p: &SpeedPoint| (p.tip_speed_m_per_s * MILLIMETRES, p.frequency_hz);
    let bar = |p: &SpeedPoint| {
        let (x, f) = place(p);
        p.frequency_sd_hz.map(|sd| ErrorBar::Vertical { x, from: f - 2.0 * sd, to: f + 2.0 * sd })
    };
    let series = Series {
        label: "ridge over speed \u{b1} 2 sd".to_owned(),
        colour: Colour::Blue,
        mark: Mark::Hollow(MarkerShape::Disc),
        points: points.iter().map(|p| Some(place(p))).collect(),
        error_bars: points.iter().filter_map(bar).collect(),
    };
    Panel {
        x: ChartAxis::linear("speed of the tip, mm/s"),
        y: ChartAxis::linear("ridge, Hz"),
        height_mm: SPEED_HEIGHT_MM,
        series: vec![series],
        ..Panel::default()
    }
}

/// In how many of how many segments a ridge is drawn, and why not in others where it stands out of the noise.
pub(crate) fn describe_ridge_segments(
    drawn: &[Vec<time_frequency::RidgePoint>],
    ridge: &time_frequency::Ridge,
    of: &time_frequency::Spectrogram,
) -> String {
    let (drawn, followed) = (drawn.iter().map(Vec::len).sum::<usize>(), ridge.points.len());
    let without = match followed - drawn {
        0 => String::new(),
        without => {
            format!(" (in {without} more it stands out of the noise, but jumps, or lies below the colours)")
        }
    };
    format!("in {drawn} of {} segments{without}", of.time_s.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Medium;

    fn as_svg(shown: &SpectrogramPlot) -> String {
        draw_figure(shown).to_svg(Medium::Screen)
    }

    fn shown() -> SpectrogramPlot {
        let column =
            |i: usize| (0..40).map(|j| (i != 3).then(|| if j == 10 + i { 1e-5 } else { 1e-8 })).collect();
        SpectrogramPlot {
            time_s: (0..10).map(|i| f64::from(i) * 0.01).collect(),
            frequency_hz: (0..40).map(|j| f64::from(j) * 25.0).collect(),
            amplitude_m: (0..10).map(column).collect(),
            ridge: (0..10)
                .map(|i| SpectrogramRidgePoint {
                    time_s: f64::from(i) * 0.01,
                    frequency_hz: (i != 3).then(|| f64::from(250 + 25 * i)),
                })
                .collect(),
            instants: vec![("release".to_owned(), 0.02)],
            over_speed: vec![SpeedPoint {
                tip_speed_m_per_s: 0.08,
                frequency_hz: 400.0,
                frequency_sd_hz: Some(5.0),
            }],
            ..SpectrogramPlot::default()
        }
    }

    #[test]
    fn the_colours_have_a_stated_scale_of_round_ends() {
        // 10 um are 20 dB re 1 um; a hundredth of a micrometre is -40 dB
        let values = |a: &[f64]| vec![a.iter().map(|a| amplitude_decibels(*a)).collect::<Vec<_>>()];
        assert_eq!(colour_range_db(&values(&[1e-5, 1e-8])), Some((-40.0, 20.0)));
        assert_eq!(colour_range_db(&values(&[0.9e-5, 1e-12])), Some((-40.0, 20.0)));
        assert_eq!(colour_range_db(&values(&[1e-6])), Some((0.0, 5.0)));
        assert_eq!(colour_range_db(&values(&[f64::NAN, f64::INFINITY, -1.0])), None);
        assert!(as_svg(&shown()).contains("dB re 1 \u{b5}m"));
    }

    #[test]
    fn a_ridge_is_interrupted_where_there_is_none() {
        let drawn = as_svg(&shown());
        let lines = |svg: &str| {
            svg.lines()
                .filter(|l| l.contains("fill=\"none\" stroke=\"#D55E00\""))
                .map(|l| l.matches('M').count())
                .sum::<usize>()
        };
        assert_eq!(lines(&drawn), 3); // two pieces and the sample in the legend
        assert_eq!(lines(&as_svg(&SpectrogramPlot { ridge: Vec::new(), ..shown() })), 0);
    }

    #[test]
    fn the_ridge_over_speed_is_a_second_panel() {
        assert!(as_svg(&shown()).contains("speed of the tip, mm/s"));
        assert!(!as_svg(&SpectrogramPlot { over_speed: Vec::new(), ..shown() }).contains("speed of the tip"));
    }

    #[test]
    fn the_time_axis_holds_whole_columns() {
        assert_eq!(time_span(&[0.0, 1.0, 2.0, 4.0]), Some((-0.5, 5.0)));
        assert_eq!(
            [time_span(&[0.0, 1.0]), time_span(&[0.0, 1.0, 3.0])],
            [Some((-0.5, 1.5)), Some((-0.5, 4.0))]
        );
        assert_eq!([time_span(&[1.0]), time_span(&[])], [None, None]);
    }
}
