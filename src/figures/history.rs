//! Time histories around a reversal: tip, head, deflection and head drop of recording and model, with
//! residuals.

pub(crate) mod caption;

use crate::figures::{NO_TRACES, full_figure};
use crate::recording::channel::Channel;
use crate::recording::motion_traces::{MOTION_CHANNELS, MotionTraces};
use plain_charts::{ChartAxis, Colour, Figure, Mark, Panel, Series, ShadedSpan, VerticalLine, value_span};
use portable_math as math;

/// Data of a time history.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TimeHistory {
    /// Heading: the main result with its number.
    pub title: String,
    /// Whether the measured motion is synthetic.
    pub synthetic: bool,
    /// Measured motion; `None` if only published numbers are known.
    pub measured: Option<MotionTraces>,
    /// Motion of the model.
    pub model: Option<MotionTraces>,
    /// Measured minus model, at the instants of the measured motion.
    pub residual: Option<MotionTraces>,
    /// Intervals in which the model's tip sticks, s.
    pub stick_s: Vec<(f64, f64)>,
    /// Time between two frames, s.
    pub frame_s: f64,
    /// Named instants, s.
    pub instants: Vec<(String, f64)>,
    /// Named windows: name, start, s, and end, s, in order of time.
    pub windows: Vec<(String, f64, f64)>,
}

/// Height, mm, of a panel of the whole motion; four quantities with their residuals and a few windows fit on
/// a page.
const HEIGHT_MM: f64 = 24.0;
/// Height, mm, of a panel with a residual.
const RESIDUAL_HEIGHT_MM: f64 = 13.0;
/// Height, mm, of the row of one window in the panel of windows.
const ROW_MM: f64 = 3.0;
/// Minimum height, mm, of the panel of windows; in a lower panel its label would not fit.
const LEAST_ROWS_MM: f64 = 12.0;
/// A quantity is drawn in micrometres if the difference between its largest and smallest value is below this,
/// m.
const MICROMETRES_BELOW_M: f64 = 2e-4;

/// Draws the whole motion.
#[must_use]
pub fn draw_figure(history: &TimeHistory) -> Figure {
    let mut panels = stack_panels(history, motion_span_s(history));
    panels.extend(draw_window_panel(history));
    let source = match (&history.measured, &history.model) {
        (Some(_), Some(_)) => "",
        (None, Some(_)) => NO_TRACES,
        (Some(_), None) => "recording alone",
        (None, None) => "nothing to show",
    };
    full_figure(
        &history.title,
        history.synthetic,
        source,
        "Time histories of tip, head, deflection and head drop.",
        panels,
    )
}

/// Start and end of the measured motion, or of the model's motion if none is measured, s.
fn motion_span_s(history: &TimeHistory) -> (f64, f64) {
    let times = history.measured.as_ref().or(history.model.as_ref()).map_or(&[][..], |m| &m.time_s);
    match (times.first(), times.last()) {
        (Some(first), Some(last)) if first < last => (*first, *last),
        _ => (0.0, 1.0),
    }
}

/// One panel per quantity, each with its residual below.
fn stack_panels(history: &TimeHistory, shown_s: (f64, f64)) -> Vec<Panel> {
    let pair = |channel: Channel| {
        let upper = draw_channel_panel(history, channel, shown_s, channel == MOTION_CHANNELS[0]);
        std::iter::once(upper).chain(draw_residual_panel(history, channel, shown_s))
    };
    MOTION_CHANNELS.into_iter().flat_map(pair).collect()
}

/// The values within a time interval, thinned to what a figure can show.
fn points_within(motion: &MotionTraces, channel: Channel, (from, to): (f64, f64)) -> Vec<Option<(f64, f64)>> {
    let inside = |t: &f64| *t >= from && *t <= to;
    let all = motion.time_s.iter().zip(motion.column(channel)).filter(|(t, _)| inside(t));
    let all: Vec<_> = all.map(|(t, x)| x.map(|x| (*t, x))).collect();
    thin_points(&all, (from, to))
}

fn scale_points(points: Vec<Option<(f64, f64)>>, factor: f64) -> Vec<Option<(f64, f64)>> {
    points.into_iter().map(|p| p.map(|(t, x)| (t, x * factor))).collect()
}

fn draw_channel_panel(history: &TimeHistory, channel: Channel, shown_s: (f64, f64), labelled: bool) -> Panel {
    let lines =
        [&history.model, &history.measured].map(|m| m.as_ref().map(|m| points_within(m, channel, shown_s)));
    let (unit, factor) = length_unit(lines.iter().flatten().flatten().flatten().map(|(_, x)| *x));
    let styles = [("model", Colour::Vermilion, Mark::Thick), ("measured", Colour::Black, Mark::Thin)];
    let series = lines.into_iter().zip(styles).filter_map(|(points, (label, colour, mark))| {
        points.map(|points| Series::new(label, colour, mark, scale_points(points, factor)))
    });
    // only the topmost panel has labels; the lines cross all panels
    let rule = |(label, at): &(String, f64)| {
        VerticalLine::new(if labelled { label } else { "" }, Colour::Blue, Mark::Dashed, *at)
    };
    let x = ChartAxis::time().with_ends(Some(shown_s));
    let y = ChartAxis::linear(format!("{}, {unit}", channel.label()));
    Panel {
        shaded_spans: stick_spans(&history.stick_s, shown_s, history.frame_s),
        vertical_lines: history.instants.iter().map(rule).collect(),
        ..Panel::new(x, y, HEIGHT_MM, series)
    }
}

/// The panel of measured minus model; `None` if there is no value.
fn draw_residual_panel(history: &TimeHistory, channel: Channel, shown_s: (f64, f64)) -> Option<Panel> {
    let points = points_within(history.residual.as_ref()?, channel, shown_s);
    points.iter().flatten().next()?; // (empty axes would show nothing)
    let (unit, factor) = length_unit(points.iter().flatten().map(|(_, x)| *x));
    let points = scale_points(points, factor);
    let x = ChartAxis::time().with_ends(Some(shown_s));
    let y = symmetric_axis(ChartAxis::linear(format!("\u{394}, {unit}")), &points);
    let series = Series::new("measured \u{2212} model", Colour::Green, Mark::Thin, points);
    Some(Panel::new(x, y, RESIDUAL_HEIGHT_MM, [series]))
}

/// An axis that is symmetric about zero. Its ends are slightly beyond a number of the form 1, 2 or 5 times a
/// power of ten, so that even a low panel has a tick on either side of zero.
pub(super) fn symmetric_axis(axis: ChartAxis, points: &[Option<(f64, f64)>]) -> ChartAxis {
    const BEYOND: f64 = 1.2;
    const MOST: f64 = 1.15;
    let most = points.iter().flatten().map(|(_, x)| x.abs()).filter(|x| x.is_finite()).fold(0.0, f64::max);
    let decade = math::powf(10.0, math::log10(most).floor());
    let end = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * decade).find(|end| MOST * end >= most);
    axis.with_ends(end.filter(|end| end.is_normal()).map(|end| (-BEYOND * end, BEYOND * end)))
}

/// The windows of the fit as bars, the first one at the top.
fn draw_window_panel(history: &TimeHistory) -> Option<Panel> {
    let rows = || history.windows.iter().rev();
    let bar = |(row, (_, start, end)): (usize, &(String, f64, f64))| {
        [Some((*start, row as f64)), Some((*end, row as f64)), None]
    };
    let points = rows().enumerate().flat_map(bar);
    let series = Series::new("window of the fit", Colour::Blue, Mark::Thick, points);
    let x = ChartAxis::time().with_ends(Some(motion_span_s(history)));
    let y = ChartAxis::categorical("windows", rows().map(|(name, ..)| name.clone()));
    let height_mm = (history.windows.len() as f64 * ROW_MM).max(LEAST_ROWS_MM);
    (!history.windows.is_empty()).then(|| Panel::new(x, y, height_mm, [series]))
}

/// The unit in which lengths of this range are shown, and the factor from metres to that unit.
pub(super) fn length_unit(values: impl Iterator<Item = f64>) -> (&'static str, f64) {
    let (low, high) = value_span(values);
    if high - low < MICROMETRES_BELOW_M && high.abs().max(low.abs()) < 10.0 * MICROMETRES_BELOW_M {
        ("\u{b5}m", 1e6)
    } else {
        ("mm", 1e3)
    }
}

// Shaded spans of the stick intervals.

/// Neighbouring sticks are drawn as one span if their durations and the gap between them are all below this
/// fraction of the shown time. On a page, this is less than a millimetre.
const MIN_STICK_GAP: f64 = 0.005;

const STICKS_LABEL: &str = "tip sticks (model)";
const CYCLES_LABEL: &str = "stick-slip cycles (model)";

/// Minimum number of frames of a stick that has a span of its own; a camera hardly shows a shorter one.
const MIN_STICK_FRAMES: f64 = 5.0;

/// Shaded spans for the sticks between two instants, s. A stick that is long enough to be seen, and has at
/// least [`MIN_STICK_FRAMES`] frames, has a span of its own. Each group of shorter sticks has one span, which
/// shows that the tip sticks and slips. `frame_s` is the time between two frames, s, or 0 for a motion
/// without a camera.
pub(crate) fn stick_spans(stick_s: &[(f64, f64)], (from, to): (f64, f64), frame_s: f64) -> Vec<ShadedSpan> {
    let shown: Vec<(f64, f64)> =
        stick_s.iter().filter(|s| s.1 > from && s.0 < to).map(|s| (s.0.max(from), s.1.min(to))).collect();
    let (seen_s, apart_s) = (MIN_STICK_GAP * (to - from), MIN_STICK_FRAMES * frame_s);
    let is_long = |s: &(f64, f64)| s.1 - s.0 > seen_s.max(apart_s);
    // sticks of neighbouring cycles belong to one group, and the slip between them may be longer than a stick
    let gap_s = seen_s.max(2.0 * apart_s);
    let groups = shown.chunk_by(|a, b| b.0 - a.1 < gap_s && !is_long(a) && !is_long(b));
    let band = |group: &[(f64, f64)]| {
        let (first, last) = (group.first()?, group.last()?);
        let is_stick = group.len() == 1 && first.1 - first.0 >= apart_s;
        // black is darker than orange in a grey print too
        let (label, colour) =
            if is_stick { (STICKS_LABEL, Colour::Black) } else { (CYCLES_LABEL, Colour::Orange) };
        Some(ShadedSpan::new(label, colour, first.0, last.1))
    };
    groups.filter_map(band).collect()
}

// Thinning of long lines.

/// Number of equal parts into which the time axis of a thinned line is divided; on a page, each part is a
/// third of a millimetre wide, about a line width.
const THINNING_PARTS: usize = 400;

/// The lowest and the highest point in each of [`THINNING_PARTS`] parts of a time interval, in order of time.
/// Lines with at most two points per part are returned unchanged. Gaps narrower than a part are closed; wider
/// gaps are kept.
pub(crate) fn thin_points(points: &[Option<(f64, f64)>], (from, to): (f64, f64)) -> Vec<Option<(f64, f64)>> {
    if points.len() <= 2 * THINNING_PARTS || from >= to {
        return points.to_vec();
    }
    let part = |t: f64| ((t - from) / (to - from) * THINNING_PARTS as f64).floor();
    let present: Vec<(f64, f64)> =
        points.iter().flatten().copied().filter(|(t, x)| t.is_finite() && x.is_finite()).collect();
    let mut kept = Vec::with_capacity(3 * THINNING_PARTS);
    let mut before = None;
    for group in present.chunk_by(|a, b| part(a.0) == part(b.0)) {
        let here = part(group[0].0);
        if before.is_some_and(|before| here > before + 1.0) {
            kept.push(None);
        }
        before = Some(here);
        let lowest = group.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
        let highest = group.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
        let mut ends: Vec<(f64, f64)> = [lowest, highest].into_iter().flatten().collect();
        math::sort_by_number(&mut ends, |a| a.0);
        ends.dedup();
        kept.extend(ends.into_iter().map(Some));
    }
    kept
}

/// Motions with at most this many frames are not thinned.
const MAX_FULL_FRAMES: usize = 20_000;

/// The frames of a long motion that its figure shows: in each of [`THINNING_PARTS`] parts of the whole
/// interval, the frames in which a column has its lowest or highest value. Three unthinned motions of a
/// million frames would need more memory than the rest of a report.
pub(super) fn thin_frames(motion: MotionTraces, (from, to): (f64, f64)) -> MotionTraces {
    let times = &motion.time_s;
    let Some(last) = times.len().checked_sub(1).filter(|_| times.len() > MAX_FULL_FRAMES && from < to) else {
        return motion;
    };
    let mut kept: Vec<bool> = (0..=last).map(|i| i == 0 || i == last).collect();
    let part = |i: &usize| ((times[*i] - from) / (to - from) * THINNING_PARTS as f64).floor();
    for channel in MOTION_CHANNELS {
        let column = motion.column(channel);
        let present: Vec<usize> =
            (0..=last).filter(|i| times[*i] >= from && times[*i] <= to && column[*i].is_some()).collect();
        for group in present.chunk_by(|a, b| part(a) == part(b)) {
            let value = |i: &&usize| column[**i].unwrap_or_default();
            let ends = [
                group.iter().min_by(|a, b| value(a).total_cmp(&value(b))),
                group.iter().max_by(|a, b| value(a).total_cmp(&value(b))),
            ];
            ends.into_iter().flatten().for_each(|i| kept[*i] = true);
        }
    }
    let of = |column: &[Option<f64>]| {
        column.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(x, _)| *x).collect()
    };
    MotionTraces {
        time_s: times.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(t, _)| *t).collect(),
        tip_x_m: of(&motion.tip_x_m),
        head_x_m: of(&motion.head_x_m),
        deflection_m: of(&motion.deflection_m),
        head_drop_m: of(&motion.head_drop_m),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plain_charts::Medium;

    fn as_svg(shown: &TimeHistory) -> String {
        draw_figure(shown).to_svg(Medium::Screen)
    }

    fn motion(amplitude_m: f64, frames: usize) -> MotionTraces {
        let time_s: Vec<f64> = (0..frames).map(|i| 0.5 * i as f64 / frames as f64).collect();
        let mut state = 7_u64;
        let mut wave = |scale: f64| {
            let value = |t: &f64| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let noise = (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
                (!state.is_multiple_of(100))
                    .then(|| scale * ((20.0 * t).sin() + 0.3 * (6000.0 * t).sin() + 0.1 * noise))
            };
            time_s.iter().map(value).collect::<Vec<_>>()
        };
        MotionTraces {
            tip_x_m: wave(amplitude_m),
            head_x_m: wave(amplitude_m),
            deflection_m: wave(amplitude_m / 10.0),
            head_drop_m: wave(amplitude_m / 1000.0),
            time_s,
        }
    }

    fn history() -> TimeHistory {
        TimeHistory { measured: Some(motion(0.01, 500)), ..TimeHistory::default() }
    }

    #[test]
    fn a_synthetic_recording_says_so_and_one_without_traces_too() {
        assert!(as_svg(&TimeHistory { synthetic: true, ..history() }).contains("synthetic recording"));
        let published =
            TimeHistory { measured: None, model: Some(motion(0.01, 500)), ..TimeHistory::default() };
        assert!(as_svg(&published).contains("model alone") && !as_svg(&published).contains(">measured"));
    }

    #[test]
    fn small_quantities_are_drawn_in_micrometres() {
        let drawn = as_svg(&history());
        assert!(drawn.contains("tip x, mm") && drawn.contains("head drop, \u{b5}m"));
    }

    #[test]
    fn every_quantity_stands_over_its_residual() {
        let shown = TimeHistory { residual: Some(motion(1e-5, 500)), ..history() };
        let labels: Vec<String> = draw_figure(&shown).panels.into_iter().map(|p| p.y.label).collect();
        assert_eq!(labels[..4], ["tip x, mm", "\u{394}, \u{b5}m", "head x, mm", "\u{394}, \u{b5}m"]);
        assert_eq!(draw_figure(&shown).panels[1].y.range, Some((-24.0, 24.0)));
        assert_eq!(labels.len(), 8);
    }

    #[test]
    fn what_was_not_tracked_leaves_no_empty_axes() {
        let headless = MotionTraces { head_x_m: vec![None; 500], ..motion(1e-5, 500) };
        let shown = TimeHistory { residual: Some(headless), ..history() };
        let labels: Vec<String> = draw_figure(&shown).panels.into_iter().map(|p| p.y.label).collect();
        assert_eq!(labels[..4], ["tip x, mm", "\u{394}, \u{b5}m", "head x, mm", "deflection, mm"]);
    }

    #[test]
    fn the_first_window_is_the_uppermost_bar() {
        let windows = vec![("1".to_owned(), 0.1, 0.2), ("2".to_owned(), 0.15, 0.3)];
        let drawn = draw_figure(&TimeHistory { windows, ..history() });
        let bars = drawn.panels.last().unwrap();
        assert_eq!(
            bars.series[0].points,
            [Some((0.15, 0.0)), Some((0.3, 0.0)), None, Some((0.1, 1.0)), Some((0.2, 1.0)), None]
        );
        assert_eq!(bars.y.categories, [(0.0, "2".to_owned()), (1.0, "1".to_owned())]);
    }

    #[test]
    fn a_million_frames_with_gaps_and_a_thousand_sticks_are_drawn_in_few_bytes() {
        let long = || Some(motion(0.01, 1_000_000));
        let instants = ["hold", "reversal", "release"].map(|name| (name.to_owned(), 0.25)).to_vec();
        let stick_s: Vec<(f64, f64)> =
            (0..1000).map(|i| (f64::from(i) * 5e-4, f64::from(i) * 5e-4 + 2e-4)).collect();
        let windows = (0..10).map(|i| (i.to_string(), 0.1, 0.2)).collect();
        let shown = TimeHistory {
            measured: long(),
            model: long(),
            residual: long(),
            stick_s,
            instants,
            windows,
            ..TimeHistory::default()
        };
        for medium in [Medium::Screen, Medium::Column, Medium::Page] {
            let bytes = draw_figure(&shown).to_svg(medium).len();
            assert!(bytes < 200_000, "{medium:?}: {bytes} bytes");
        }
        let height_mm: f64 = draw_figure(&shown).panels.iter().map(|p| p.height_mm).sum();
        assert!(height_mm < 200.0, "{height_mm} mm and the gaps between them do not fit a page");
    }

    #[test]
    fn cycles_that_cannot_be_told_apart_are_one_band_and_long_sticks_stay() {
        let mut stick_s = vec![(0.1, 0.3), (0.301, 0.302)];
        stick_s.extend((0..100).map(|i| (f64::from(500 + i) / 1000.0, f64::from(5004 + 10 * i) / 10_000.0)));
        stick_s.push((2.0, 3.0));
        let found: Vec<_> =
            stick_spans(&stick_s, (0.0, 1.0), 0.0).into_iter().map(|b| (b.label, b.from, b.to)).collect();
        let sticks = |from, to| (STICKS_LABEL.to_owned(), from, to);
        assert_eq!(found, [sticks(0.1, 0.3), sticks(0.301, 0.302), (CYCLES_LABEL.to_owned(), 0.5, 0.5994)]);
    }

    #[test]
    fn extremes_and_wide_gaps_stay() {
        // a spike in part 100, followed by a gap of ten parts
        let spike = |i: usize| if i == 2505 { 9.0 } else { 0.0 };
        let points: Vec<_> = (0..10_000)
            .map(|i| (!(3000..3250).contains(&i) && i % 7 != 3).then(|| (i as f64, spike(i))))
            .collect();
        let kept = thin_points(&points, (0.0, 10_000.0));
        assert!(kept.len() <= 3 * THINNING_PARTS && kept.contains(&Some((2505.0, 9.0))));
        assert_eq!(kept.iter().filter(|p| p.is_none()).count(), 1);
    }

    #[test]
    fn a_lighter_motion_is_drawn_alike() {
        let frames = 100_000;
        let column = |scale: f64| {
            (0..frames)
                .map(|i| (i % 7 != 3).then(|| scale * (i as f64 * 0.37).sin() * (i as f64 * 1e-4).cos()))
                .collect::<Vec<_>>()
        };
        let time_s: Vec<f64> = (0..frames).map(f64::from).collect();
        let whole = MotionTraces {
            time_s,
            tip_x_m: column(1.0),
            head_x_m: column(2.0),
            deflection_m: column(3.0),
            head_drop_m: column(4.0),
        };
        let span = (10.0, 90_000.0);
        let light = thin_frames(whole.clone(), span);
        assert!(
            light.time_s.len() < 6000 && light.time_s.last() == whole.time_s.last(),
            "{}",
            light.time_s.len()
        );
        for channel in MOTION_CHANNELS {
            let drawn = |motion: &MotionTraces, (from, to): (f64, f64)| {
                let inside = motion
                    .time_s
                    .iter()
                    .zip(motion.column(channel))
                    .filter(|(t, _)| **t >= from && **t <= to);
                thin_points(&inside.map(|(t, x)| x.map(|x| (*t, x))).collect::<Vec<_>>(), (from, to))
            };
            assert_eq!(drawn(&light, span), drawn(&whole, span), "{channel}");
        }
    }

    #[test]
    fn short_lines_are_left_as_they_are() {
        let points = [Some((0.0, 1.0)), None, Some((2.0, f64::NAN))];
        assert_eq!(thin_points(&points, (0.0, 1.0))[..2], points[..2]);
    }
}
