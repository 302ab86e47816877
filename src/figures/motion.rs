//! Figure of a simulated run: motion of head and tip, deflection, and normal force.

use super::history;
use super::history::TimeHistory;
use crate::figures::history::thin_points;
use crate::recording::motion_traces::MotionTraces;
use crate::simulate::ModelSample;
use crate::simulate::RunMotion;
use crate::text::{format_short, pluralise};
use plain_charts::{ChartAxis, Colour, Figure, Mark, Panel, Series, VerticalLine};

/// Height of the panel of the normal force, mm.
const FORCE_MM: f64 = 24.0;

pub(crate) fn draw_figure(title: &str, motion: &RunMotion) -> Figure {
    let history = TimeHistory {
        model: Some(motion_traces(motion)),
        stick_s: motion.stick_s.iter().map(|[from, to]| (*from, *to)).collect(),
        instants: motion.turn_s().map(|at| ("head turns".to_owned(), at)).into_iter().collect(),
        ..TimeHistory::default()
    };
    let mut figure = history::draw_figure(&history);
    figure.watermarked = true;
    figure.title = summarise_motion(motion);
    figure.subtitle = format!("simulation; {title}");
    figure.description = format!("A simulated run: {}.", figure.title);
    figure.panels.extend(draw_force_panel(motion, &history));
    // thin lines, since no measured points are drawn on top
    figure.panels.iter_mut().flat_map(|panel| &mut panel.series).for_each(|series| series.mark = Mark::Thin);
    figure
}

fn motion_traces(motion: &RunMotion) -> MotionTraces {
    let column = |of: fn(&ModelSample) -> f64| motion.samples.iter().map(|sample| Some(of(sample))).collect();
    MotionTraces {
        time_s: motion.samples.iter().map(|sample| sample.time_s).collect(),
        tip_x_m: column(|s| s.tip_x_m),
        head_x_m: column(|s| s.head_x_m),
        deflection_m: column(|s| s.tip_x_m - s.head_x_m),
        head_drop_m: if motion.linkage.is_slider() {
            vec![None; motion.samples.len()]
        } else {
            column(|s| s.head_drop_m)
        },
    }
}

/// Heading, such as `218 sticks in 12.3 % of the time, least normal force 3.21 N`.
fn summarise_motion(motion: &RunMotion) -> String {
    let span_s = motion.samples.last().zip(motion.samples.first()).map_or(0.0, |(b, a)| b.time_s - a.time_s);
    let stuck_s: f64 = motion.stick_s.iter().map(|[from, to]| to - from).sum();
    let share = if span_s > 0.0 { 100.0 * stuck_s / span_s } else { 0.0 };
    let sticks = motion.stick_s.len();
    let sticks = format!("{sticks} {}", pluralise("stick", sticks));
    let force = motion.extremes.min_normal_force_n;
    let force = force.map_or_else(String::new, |n| format!(", least normal force {} N", format_short(n)));
    format!("{sticks} in {} % of the time{force}", format_short(share))
}

/// The normal force against time, with impacts as vertical lines.
fn draw_force_panel(motion: &RunMotion, history: &TimeHistory) -> Option<Panel> {
    let span_s = (motion.samples.first()?.time_s, motion.samples.last()?.time_s);
    let points: Vec<_> = motion.samples.iter().map(|s| Some((s.time_s, s.normal_n))).collect();
    let most = points.iter().flatten().map(|(_, force)| *force).fold(0.0, f64::max);
    let flights = motion.impacts.iter().map(|impact| impact.time_s);
    let rule = |at| VerticalLine::new("", Colour::Purple, Mark::Dotted, at);
    let (x, y) = (ChartAxis::time().with_ends(Some(span_s)), ChartAxis::linear("normal force, N"));
    let series = Series::new("model", Colour::Vermilion, Mark::Line, thin_points(&points, span_s));
    (most > 0.0 && span_s.0 < span_s.1).then(|| Panel {
        shaded_spans: history::stick_spans(&history.stick_s, span_s, history.frame_s),
        vertical_lines: flights.map(rule).collect(),
        ..Panel::new(x, y.with_range(0.0, 1.05 * most), FORCE_MM, [series])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::scene::Scene;

    #[test]
    fn a_run_shows_its_motion_and_its_force_from_zero_on() {
        let scene = Scene::parse("s", include_str!("../../data/scenes/light-blade.toml")).unwrap();
        let motion = RunMotion::simulate(&scene);
        let drawn = draw_figure(scene.title(), &motion);
        let labels: Vec<&str> = drawn.panels.iter().map(|panel| panel.y.label.as_str()).collect();
        assert_eq!(labels.len(), 5);
        assert_eq!(labels[4], "normal force, N");
        assert_eq!(drawn.panels[4].y.range.map(|(low, _)| low), Some(0.0));
        assert!(drawn.subtitle.starts_with("simulation; ") && drawn.title.contains("% of the time"));
        assert_eq!(drawn.panels[0].vertical_lines[0].label, "head turns");
    }
}
