//! Figure of a synthetic recording: the simulated motion, the frames with exposure and noise, and the lost
//! frames.

use super::FigureText;
use crate::recording::Recording;
use crate::text::{format_length, format_milliseconds, format_percent, format_short};
use plain_charts::{ChartAxis, Colour, ErrorBar, FULL_WIDTH_MM, Figure, Mark, Panel, Series, VerticalLine};

/// Number of samples of the motion per frame.
pub(crate) const MOTION_SAMPLES: f64 = 8.0;
/// Number of frames in an enlarged part.
const ENLARGED: f64 = 40.0;
/// Number of frames of an enlarged part that are before the release.
const BEFORE: f64 = 10.0;
/// A stick counts as late if it ends after this fraction of the duration of the run.
const LATE: f64 = 0.75;
/// Height of a panel, mm.
const PANEL_MM: f64 = 40.0;

/// A synthetic recording with its motion; all times are on one clock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TwinPlot<'a> {
    pub title: &'a str,
    /// The motion without exposure and noise, with about [`MOTION_SAMPLES`] samples per frame.
    pub motion: &'a Recording,
    /// The motion averaged over the exposure of each frame, without noise.
    pub seen: &'a Recording,
    pub tracked: &'a Recording,
    /// Exposure of a frame, s.
    pub exposure_s: f64,
    /// Standard deviation of the noise of a tracked coordinate, m.
    pub noise_m: f64,
    /// Intervals in which the tip sticks, s.
    pub stick_s: &'a [[f64; 2]],
}

/// Draws three panels of the deflection (the whole run, the release after the longest stick, and the release
/// after a late stick) and a panel of the errors of the camera.
pub(crate) fn draw_figure(twin: &TwinPlot) -> Figure {
    let words = figure_text(twin);
    let mut panels = vec![draw_run_panel(twin)];
    panels.extend(release_instants(twin).into_iter().map(|(name, at)| draw_enlarged_panel(twin, name, at)));
    panels.push(draw_camera_panel(twin));
    Figure {
        title: words.caption,
        subtitle: format!("{}; synthetic: no camera took it", twin.title),
        watermarked: true,
        description: words.details,
        width_mm: FULL_WIDTH_MM,
        panels,
        ..Figure::default()
    }
}

/// Caption with the main numbers, and description of the figure.
fn figure_text(twin: &TwinPlot) -> FigureText {
    let grid = twin.tracked.grid();
    let lost = lost_points(twin).len();
    let blur_m = difference_points(twin, twin.seen)
        .into_iter()
        .flatten()
        .map(|(_, blur_m)| blur_m.abs())
        .fold(0.0, f64::max);
    FigureText {
        caption: format!(
            "{} frames at {} frames/s: noise of {} on the deflection, {} of the frames lost",
            grid.frames,
            format_short(grid.frame_rate_hz),
            format_length(deflection_noise_m(twin)),
            format_percent(lost as f64 / grid.frames.max(1) as f64)
        ),
        details: format!(
            "Deflection of the simulated motion and of the frames of a camera with an exposure of {}. Level bars: the \
             exposure; upright bars: two standard deviations of the noise. The exposure blurs the deflection by up to \
             {}.",
            format_milliseconds(twin.exposure_s),
            format_length(blur_m)
        ),
    }
}

/// Standard deviation of the noise of the deflection, m; the noise of the tip and that of the head are
/// independent.
fn deflection_noise_m(twin: &TwinPlot) -> f64 {
    std::f64::consts::SQRT_2 * twin.noise_m
}

fn deflection_m(recording: &Recording, at: usize) -> Option<f64> {
    let traces = recording.traces();
    Some((*traces.tip_x_m.get(at)?)? - (*traces.head_x_m.get(at)?)?)
}

/// Times, s, and deflections, mm; `None` if head or tip is lost.
fn deflection_points(recording: &Recording) -> Vec<Option<(f64, f64)>> {
    let grid = recording.grid();
    (0..grid.frames).map(|at| Some((grid.time_s(at), 1e3 * deflection_m(recording, at)?))).collect()
}

/// Points of the motion without noise in those frames in which head or tip is lost.
fn lost_points(twin: &TwinPlot) -> Vec<Option<(f64, f64)>> {
    let tracked = deflection_points(twin.tracked);
    let seen = deflection_points(twin.seen).into_iter().zip(tracked);
    seen.filter(|(_, found)| found.is_none()).map(|(seen, _)| seen).collect()
}

/// Deflection in a recording minus the deflection of the simulated motion at the same instants, m.
fn difference_points(twin: &TwinPlot, of: &Recording) -> Vec<Option<(f64, f64)>> {
    let (grid, traces) = (of.grid(), twin.motion.traces());
    let difference = |at: usize| {
        let time_s = grid.time_s(at);
        let true_m = twin.motion.interpolate_column(&traces.tip_x_m, time_s)?
            - twin.motion.interpolate_column(&traces.head_x_m, time_s)?;
        Some((time_s, deflection_m(of, at)? - true_m))
    };
    (0..grid.frames).map(difference).collect()
}

fn draw_run_panel(twin: &TwinPlot) -> Panel {
    let rule = |(name, at): (&str, f64)| VerticalLine::new(name, Colour::Grey, Mark::Dashed, at);
    let y = ChartAxis::linear("deflection, mm");
    Panel {
        title: "whole run".to_owned(),
        vertical_lines: release_instants(twin).into_iter().map(rule).collect(),
        ..Panel::new(ChartAxis::time(), y, PANEL_MM, part_series(twin, None))
    }
}

/// Panel of a part of the run, in which single frames are visible.
fn draw_enlarged_panel(twin: &TwinPlot, name: &str, at_s: f64) -> Panel {
    let frame_s = 1.0 / twin.tracked.grid().frame_rate_hz;
    let (from, to) = (at_s - BEFORE * frame_s, at_s + (ENLARGED - BEFORE) * frame_s);
    let (x, y) = (ChartAxis::time().with_range(from, to), ChartAxis::linear("deflection, mm"));
    let panel = Panel::new(x, y, PANEL_MM, part_series(twin, Some((from, to))));
    Panel { title: format!("{name}, {} frames", ENLARGED as usize), ..panel }
}

/// Motion, tracked frames and lost frames; error bars are drawn only in an enlarged part.
fn part_series(twin: &TwinPlot, part: Option<(f64, f64)>) -> Vec<Series> {
    let tracked = deflection_points(twin.tracked);
    let sd_mm = 1e3 * deflection_noise_m(twin);
    let inside = |(time_s, _): &&(f64, f64)| part.is_some_and(|(from, to)| (from..=to).contains(time_s));
    let half_s = 0.5 * twin.exposure_s;
    let bars = tracked.iter().flatten().filter(inside).flat_map(|(time_s, y)| {
        [
            ErrorBar::Horizontal { y: *y, from: time_s - half_s, to: time_s + half_s },
            ErrorBar::Vertical { x: *time_s, from: y - 2.0 * sd_mm, to: y + 2.0 * sd_mm },
        ]
    });
    let is_seen = |bar: &ErrorBar| match bar {
        ErrorBar::Horizontal { from, to, .. } | ErrorBar::Vertical { from, to, .. } => to > from,
    };
    let bars = bars.filter(is_seen).collect();
    vec![
        Series::new("simulated motion", Colour::Blue, Mark::Thin, deflection_points(twin.motion)),
        Series { error_bars: bars, ..Series::new("frame as tracked", Colour::Black, Mark::Dots, tracked) },
        Series::new("lost frame", Colour::Vermilion, Mark::Crosses, lost_points(twin)),
    ]
}

/// Panel of the errors of the camera: due to exposure alone, and due to exposure and noise.
fn draw_camera_panel(twin: &TwinPlot) -> Panel {
    let series = |label: &str, colour, mark, of: &Recording| {
        let points = difference_points(twin, of).into_iter();
        Series::new(label, colour, mark, points.map(|p| p.map(|(time_s, y)| (time_s, 1e6 * y))))
    };
    let series = [
        series("with noise", Colour::Grey, Mark::Dots, twin.tracked),
        series("exposure alone", Colour::Orange, Mark::Thin, twin.seen),
    ];
    let title = format!("frame minus motion, noise {}", format_length(deflection_noise_m(twin)));
    let y = ChartAxis::linear("difference, \u{b5}m");
    Panel { title, ..Panel::new(ChartAxis::time(), y, 0.8 * PANEL_MM, series) }
}

/// Names and instants, s, of the ends of the longest stick and of the last late stick. A stick is ignored if
/// the enlarged part around its end would extend beyond the run.
fn release_instants(twin: &TwinPlot) -> Vec<(&'static str, f64)> {
    let grid = twin.tracked.grid();
    let (start_s, end_s) = (grid.start_s, grid.time_s(grid.frames.saturating_sub(1)));
    let frame_s = 1.0 / grid.frame_rate_hz;
    let fits = |at: &f64| *at - BEFORE * frame_s >= start_s && *at + (ENLARGED - BEFORE) * frame_s <= end_s;
    let ends = || twin.stick_s.iter().filter(|[_, end]| fits(end));
    let longest = ends().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0]))).map(|[_, end]| *end);
    let late_s = start_s + LATE * (end_s - start_s);
    let late = ends().map(|[_, end]| *end).rfind(|end| *end >= late_s && Some(*end) != longest);
    let named = [("longest stick ends", longest), ("stick-slip", late)];
    named.into_iter().filter_map(|(name, at)| Some((name, at?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};
    use crate::simulate::twin::{TrackingModel, add_tracking_noise};
    use plain_charts::Medium;

    fn recording(frame_rate_hz: f64, frames: usize, of: impl Fn(f64) -> f64) -> Recording {
        let grid = FrameGrid { start_s: 1.0, frame_rate_hz, frames };
        let column = |of: &dyn Fn(f64) -> f64| (0..frames).map(|i| Some(of(grid.time_s(i)))).collect();
        let traces = Traces {
            tip_x_m: column(&of),
            tip_y_m: column(&|_| 0.0),
            head_x_m: column(&|_| 0.0),
            head_y_m: column(&|_| 0.0),
            ..Traces::default()
        };
        Recording::new("motion", grid, traces, true).unwrap()
    }

    #[test]
    fn the_parts_are_about_releases_and_every_lost_frame_is_marked() {
        let path = |t: f64| 1e-3 * (300.0 * t).sin();
        let (motion, seen) = (recording(8000.0, 4001, path), recording(1000.0, 501, path));
        let tracking =
            TrackingModel { metres_per_pixel: 1e-5, noise_px: 0.2, dropout_fraction: 0.1, seed: 1 };
        let tracked = add_tracking_noise(&seen, "a <twin>", &tracking).unwrap();
        let stick_s = [[1.1, 1.2], [1.3, 1.31], [1.44, 1.45], [1.499, 1.4995]];
        let twin = TwinPlot {
            title: "a <twin>",
            motion: &motion,
            seen: &seen,
            tracked: &tracked,
            exposure_s: 4e-4,
            noise_m: 2e-6,
            stick_s: &stick_s,
        };
        assert_eq!(release_instants(&twin), [("longest stick ends", 1.2), ("stick-slip", 1.45)]);
        let missing = deflection_points(&tracked).iter().filter(|point| point.is_none()).count();
        assert!(missing > 50 && lost_points(&twin).iter().flatten().count() == missing);
        // these frames have no motion blur; the scatter of the tracked frames is the stated noise
        assert!(difference_points(&twin, twin.seen).into_iter().flatten().all(|(_, m)| m.abs() < 2e-7));
        let noise: Vec<f64> =
            difference_points(&twin, &tracked).into_iter().flatten().map(|(_, m)| m).collect();
        let sd = (noise.iter().map(|m| m * m).sum::<f64>() / noise.len() as f64).sqrt();
        assert!((sd / deflection_noise_m(&twin) - 1.0).abs() < 0.15, "{sd}");
        let drawn = draw_figure(&twin);
        let svg = drawn.to_svg(Medium::Screen);
        assert_eq!(drawn.panels.len(), 4);
        assert!(svg.contains("synthetic") && svg.contains("a &lt;twin&gt;") && !svg.contains("NaN"));
        assert!(drawn.title.contains("2.8 \u{b5}m"), "{}", drawn.title);
    }
}
