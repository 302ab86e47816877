//! Spectrogram: amplitude against time and frequency as colours, with the ridge against time and against tip
//! speed.

pub mod caption;
mod comparison;

use crate::figures::full_figure;
use crate::text::{format_digits, truncate_text};
pub use comparison::{SpectrogramComparison, SpectrogramSide, draw_comparison};
use plain_charts::{
    ChartAxis, Colour, ErrorBar, Figure, HeatMap, Mark, MarkerShape, Panel, Series, TextAnnotation,
    VerticalLine,
};
use portable_math as math;
use short_spectra::time_frequency;
use short_spectra::time_frequency::RidgePoint;
pub use short_spectra::time_frequency::SpeedPoint;
use short_spectra::time_frequency::course::DYNAMIC_RANGE_DB;

/// A point of a ridge.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpectrogramRidgePoint {
    /// Instant, s.
    pub time_s: f64,
    /// Frequency, Hz; `None` if no ridge stands out.
    pub frequency_hz: Option<f64>,
}

/// A target frequency and its window.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TargetFrequency {
    /// Name of the feature.
    pub name: String,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz; `None` if unknown.
    pub frequency_sd_hz: Option<f64>,
    /// Start and end of the window, s.
    pub span_s: (f64, f64),
    /// Whether the model meets the target.
    pub met: bool,
}

/// Data of a spectrogram.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpectrogramPlot {
    /// Heading.
    pub title: String,
    /// Quantity, such as "deflection".
    pub quantity: String,
    /// Note on the settings of the spectrogram, such as the length of the sliding window; empty for none.
    pub note: String,
    /// Whether the motion is synthetic.
    pub synthetic: bool,
    /// Centres of the sliding window, ascending, s.
    pub time_s: Vec<f64>,
    /// Frequencies, ascending, Hz.
    pub frequency_hz: Vec<f64>,
    /// Amplitude of a sine, m: one list per instant, with one value per frequency; `None` if too few frames
    /// are tracked around that instant.
    pub amplitude_m: Vec<Vec<Option<f64>>>,
    /// Whether the frequency axis is logarithmic.
    pub log_frequency: bool,
    /// Frequencies shown, Hz; `None` for all (above zero on a logarithmic axis).
    pub shown_hz: Option<(f64, f64)>,
    /// The ridge in order of time.
    pub ridge: Vec<SpectrogramRidgePoint>,
    /// Lines that follow from the ridge, such as its double or its sidebands, each with its name.
    pub related: Vec<(String, Vec<SpectrogramRidgePoint>)>,
    /// Natural frequencies of the model in Hz, each with its name.
    pub natural_hz: Vec<(String, f64)>,
    /// Named instants, s.
    pub instants: Vec<(String, f64)>,
    /// The target frequencies, each with its window.
    pub targets: Vec<TargetFrequency>,
    /// The ridge against the speed of the tip; if empty, this panel is left out.
    pub over_speed: Vec<SpeedPoint>,
}

/// Height, mm, of the map.
const HEIGHT_MM: f64 = 72.0;
/// Height, mm, of the panel of the ridge against tip speed.
const SPEED_HEIGHT_MM: f64 = 38.0;
/// The first colour of the scale is chosen so that this fraction of the cells has smaller amplitudes; these
/// cells contain only noise.
const UNDER_COLOURS: f64 = 0.1;
/// The colour scale begins and ends at multiples of this level, dB.
const STEP_DB: f64 = 5.0;
/// Amplitude of 0 dB, m.
const REFERENCE_M: f64 = 1e-6;
const MILLIMETRES: f64 = 1e3;

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &SpectrogramPlot) -> Figure {
    let mut panels = vec![draw_map(shown)];
    if !shown.over_speed.is_empty() {
        let series = speed_series("ridge over speed", Colour::Blue, MarkerShape::Disc, &shown.over_speed);
        let (x, y) = (ChartAxis::linear("speed of the tip, mm/s"), ChartAxis::linear("ridge, Hz"));
        panels.push(Panel::new(x, y, SPEED_HEIGHT_MM, [series]));
    }
    full_figure(
        &shown.title,
        shown.synthetic,
        &shown.note,
        format!(
            "Spectrogram of {}: amplitude of a sine over time and frequency, in dB re 1 \u{b5}m; light grey \
             where there is no value. \
             The line is the ridge that was followed; it has gaps where nothing stands out, and where \
             segments do not agree on a frequency.",
            shown.quantity
        ),
        panels,
    )
}

/// All amplitudes in dB; see [`amplitude_decibels`].
fn decibel_map(amplitude_m: &[Vec<Option<f64>>]) -> Vec<Vec<Option<f64>>> {
    amplitude_m.iter().map(|column| column.iter().map(|a| a.and_then(amplitude_decibels)).collect()).collect()
}

/// The map with targets, ridge and instants.
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
    let y = if shown.log_frequency { ChartAxis::log } else { ChartAxis::linear }("frequency, Hz");
    let y = y.with_ends(shown.shown_hz.or_else(|| frequency_range(shown)));
    let rule = |(label, at): &(String, f64)| VerticalLine::new(label, Colour::White, Mark::Dashed, *at);
    // lines with an edge are visible on every colour
    let targets = target_lines(&shown.targets, "target \u{b1} 2 sd", Colour::Black, Mark::Edged);
    let ridge = Series::new("ridge", Colour::Vermilion, Mark::Edged, ridge_points(&shown.ridge));
    let related = shown
        .related
        .iter()
        .map(|(name, points)| Series::new(name, Colour::Orange, Mark::ThinDashed, ridge_points(points)));
    let lines = related.chain([targets, ridge]).filter(|s| s.points.iter().any(Option::is_some));
    let lines: Vec<Series> = natural_lines(shown).chain(lines).collect();
    let mut annotations = target_names(shown);
    annotations.extend(natural_names(shown));
    Panel {
        vertical_lines: shown.instants.iter().map(rule).collect(),
        annotations,
        heat_map: Some(heat),
        ..Panel::new(ChartAxis::time().with_ends(time_span(&shown.time_s)), y, HEIGHT_MM, lines)
    }
}

/// A line across the map for each natural frequency.
fn natural_lines(shown: &SpectrogramPlot) -> impl Iterator<Item = Series> {
    let span_s = time_span(&shown.time_s).unwrap_or_default();
    let line = move |(_, hz): &(String, f64)| {
        Series::new("natural frequency", Colour::SkyBlue, Mark::Dotted, [(span_s.0, *hz), (span_s.1, *hz)])
    };
    shown.natural_hz.iter().map(line)
}

/// Names of the natural frequencies, at the right end of their lines.
fn natural_names(shown: &SpectrogramPlot) -> Vec<TextAnnotation> {
    let (Some((bottom, top)), Some((first, last))) =
        (shown.shown_hz.or_else(|| frequency_range(shown)), time_span(&shown.time_s))
    else {
        return Vec::new();
    };
    let at = |hz: f64| (first + NAME_POSITION * (last - first), hz + 0.5 * LABEL_OFFSET * (top - bottom));
    let inside = shown.natural_hz.iter().filter(|(_, hz)| *hz > bottom && *hz < top);
    inside.map(|(name, hz)| TextAnnotation::new(name.clone(), Colour::White, at(*hz))).collect()
}

/// An amplitude, m, in dB re 1 um; zero gives a value below every colour.
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

/// Start of the first column and end of the last column, s; `None` for fewer than two columns.
fn time_span(middles: &[f64]) -> Option<(f64, f64)> {
    let ([first, second, ..], [.., before, last]) = (middles, middles) else { return None };
    Some((first - (second - first) / 2.0, last + (last - before) / 2.0))
}

/// Lowest and highest frequency; the lowest is above zero on a logarithmic axis.
fn frequency_range(shown: &SpectrogramPlot) -> Option<(f64, f64)> {
    let lowest = shown.frequency_hz.iter().find(|f| **f > 0.0 || !shown.log_frequency)?;
    Some((*lowest, *shown.frequency_hz.last()?))
}

fn ridge_points(ridge: &[SpectrogramRidgePoint]) -> impl Iterator<Item = Option<(f64, f64)>> {
    ridge.iter().map(|p| p.frequency_hz.map(|f| (p.time_s, f)))
}

/// Frequencies against the speed of the tip, mm/s, as symbols with error bars of two standard deviations.
pub(super) fn speed_series(label: &str, colour: Colour, shape: MarkerShape, points: &[SpeedPoint]) -> Series {
    let place = |p: &SpeedPoint| (p.speed_m_per_s * MILLIMETRES, p.frequency_hz);
    let bar = |p: &SpeedPoint| {
        let ((x, f), sd) = (place(p), p.frequency_sd_hz?);
        Some(ErrorBar::Vertical { x, from: f - 2.0 * sd, to: f + 2.0 * sd })
    };
    Series {
        error_bars: points.iter().filter_map(bar).collect(),
        ..Series::new(format!("{label} \u{b1} 2 sd"), colour, Mark::Hollow(shape), points.iter().map(place))
    }
}

/// Clause on the number of segments in which a ridge is drawn, and on the number of segments whose ridge
/// point is left out.
pub(crate) fn describe_ridge_segments(
    drawn: &[Vec<RidgePoint>],
    ridge: &time_frequency::Ridge,
    of: &time_frequency::Spectrogram,
) -> String {
    let (drawn, followed) = (drawn.iter().map(Vec::len).sum::<usize>(), ridge.points.len());
    let without = match followed - drawn {
        0 => String::new(),
        n => format!(" (in {n} more it stands out of the noise, but jumps, or lies below the colours)"),
    };
    format!("in {drawn} of {} segments{without}", of.time_s.len())
}

// Data of a spectrogram and of its ridge.

/// Copies times, frequencies and amplitudes of a spectrogram to a plot, up to the given number of frequency
/// bins. Also copies the parts of its ridge, with gaps between them.
pub(super) fn fill_map(
    plot: SpectrogramPlot,
    spectrogram: &time_frequency::Spectrogram,
    ridge: &[Vec<RidgePoint>],
    start_s: f64,
    bins: usize,
) -> SpectrogramPlot {
    let column = |column: &Option<Vec<f64>>| match column {
        Some(column) => column.iter().take(bins).copied().map(Some).collect(),
        None => vec![None; bins],
    };
    let gap = SpectrogramRidgePoint { time_s: start_s, frequency_hz: None };
    let place = |p: &RidgePoint| SpectrogramRidgePoint {
        time_s: start_s + p.time_s,
        frequency_hz: Some(p.frequency_hz),
    };
    SpectrogramPlot {
        time_s: spectrogram.time_s.iter().map(|t| start_s + t).collect(),
        frequency_hz: spectrogram.frequency_hz.iter().take(bins).copied().collect(),
        amplitude_m: spectrogram.amplitude_m.iter().map(column).collect(),
        ridge: ridge.iter().flat_map(|part| std::iter::once(gap).chain(part.iter().map(place))).collect(),
        ..plot
    }
}

// Target frequencies as lines over their windows, with error bars of two standard deviations.

/// Position of the name of a natural frequency along the time axis, as a fraction of the width of the map.
const NAME_POSITION: f64 = 0.93;
/// Number of letters after which a name is cut in a map.
const MAX_LABEL_LETTERS: usize = 14;
/// Distance of a name from its line, as a fraction of the height of the map.
const LABEL_OFFSET: f64 = 0.05;
/// If two lines are closer than this fraction of the height of the map, the name of the lower line is below
/// that line.
const CLOSE_TARGETS: f64 = 0.1;
/// Limits for the position of the middle of a name along the time axis, as fractions of the width of the map;
/// they keep the name inside the axes.
const LABEL_LIMITS: (f64, f64) = (0.3, 0.7);

fn target_lines(targets: &[TargetFrequency], label: &str, colour: Colour, mark: Mark) -> Series {
    let line = |t: &TargetFrequency| {
        let (from_s, to_s) = t.span_s;
        [Some((from_s, t.frequency_hz)), Some((to_s, t.frequency_hz)), None]
    };
    let ends = |t: &TargetFrequency| {
        let (half, f) = (2.0 * t.frequency_sd_hz.unwrap_or(0.0), t.frequency_hz);
        [t.span_s.0, t.span_s.1].map(|x| ErrorBar::Vertical { x, from: f - half, to: f + half })
    };
    Series {
        error_bars: targets.iter().filter(|t| t.frequency_sd_hz.is_some()).flat_map(ends).collect(),
        ..Series::new(label, colour, mark, targets.iter().flat_map(line))
    }
}

/// Labels such as "high 908 Hz, met" above the lines; a label is below its line if another line is close
/// above it.
pub(super) fn target_names(shown: &SpectrogramPlot) -> Vec<TextAnnotation> {
    let Some((bottom, top)) = shown.shown_hz.or_else(|| frequency_range(shown)) else { return Vec::new() };
    let Some((first, last)) = time_span(&shown.time_s) else { return Vec::new() };
    let place = |share: f64| first + share * (last - first);
    let text = |t: &TargetFrequency| {
        let above = |other: &TargetFrequency| {
            other.frequency_hz > t.frequency_hz
                && other.frequency_hz - t.frequency_hz < CLOSE_TARGETS * (top - bottom)
        };
        let side = if shown.targets.iter().any(above) { -1.0 } else { 1.0 };
        let middle = (t.span_s.0.max(first) + t.span_s.1.min(last)) / 2.0;
        TextAnnotation::new(
            format!(
                "{} {} Hz, {}",
                truncate_text(&t.name, MAX_LABEL_LETTERS),
                format_digits(t.frequency_hz, 3),
                if t.met { "met" } else { "missed" }
            ),
            Colour::Black,
            (
                middle.clamp(place(LABEL_LIMITS.0), place(LABEL_LIMITS.1)),
                t.frequency_hz + side * LABEL_OFFSET * (top - bottom),
            ),
        )
    };
    shown.targets.iter().map(text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use plain_charts::Medium;

    fn as_svg(shown: &SpectrogramPlot) -> String {
        draw_figure(shown).to_svg(Medium::Screen)
    }

    fn example_spectrogram() -> SpectrogramPlot {
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
                speed_m_per_s: 0.08,
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
        assert!(as_svg(&example_spectrogram()).contains("dB re 1 \u{b5}m"));
    }

    #[test]
    fn a_ridge_is_interrupted_where_there_is_none() {
        let drawn = as_svg(&example_spectrogram());
        let lines = |svg: &str| {
            svg.lines()
                .filter(|l| l.contains("fill=\"none\" stroke=\"#D55E00\""))
                .map(|l| l.matches('M').count())
                .sum::<usize>()
        };
        assert_eq!(lines(&drawn), 3); // two pieces, and the sample line in the legend
        assert_eq!(lines(&as_svg(&SpectrogramPlot { ridge: Vec::new(), ..example_spectrogram() })), 0);
    }

    #[test]
    fn the_ridge_over_speed_is_a_second_panel() {
        assert!(as_svg(&example_spectrogram()).contains("speed of the tip, mm/s"));
        assert!(
            !as_svg(&SpectrogramPlot { over_speed: Vec::new(), ..example_spectrogram() })
                .contains("speed of the tip")
        );
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

    fn aimed(name: &str, frequency_hz: f64, met: bool) -> TargetFrequency {
        let name = name.to_owned();
        TargetFrequency { name, frequency_hz, frequency_sd_hz: Some(7.0), span_s: (0.2, 0.6), met }
    }

    #[test]
    fn a_target_lies_in_its_window_with_two_deviations_and_says_whether_it_is_met() {
        let shown = SpectrogramPlot {
            time_s: vec![0.1, 0.3, 0.5, 0.7],
            shown_hz: Some((0.0, 1000.0)),
            targets: vec![aimed("lowest", 359.0, true), aimed("highest", 400.0, false)],
            ..SpectrogramPlot::default()
        };
        let line = target_lines(&shown.targets, "target", Colour::Black, Mark::Edged);
        assert_eq!(line.points[..3], [Some((0.2, 359.0)), Some((0.6, 359.0)), None]);
        assert_eq!(line.error_bars[0], ErrorBar::Vertical { x: 0.2, from: 345.0, to: 373.0 });
        let texts: Vec<(String, f64)> = target_names(&shown).into_iter().map(|t| (t.text, t.at.1)).collect();
        assert_eq!(
            texts,
            [("lowest 359 Hz, met".to_owned(), 309.0), ("highest 400 Hz, missed".to_owned(), 450.0)]
        );
    }
}
