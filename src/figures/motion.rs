//! A run of a scene: where head and tip go, how the blade bends, and how it stands on the glass.

use super::history::{self, History, bands};
use crate::chart::{Axis, Colour, Figure, Mark, Panel, Rule, Series};
use crate::figures::history::thin;
use crate::recording::motion_traces::MotionTraces;
use crate::simulate::Motion;
use crate::simulate::Sample;
use crate::text::{plural, short};

/// Height of the normal force's panel, mm.
const FORCE_MM: f64 = 24.0;

/// The figure.
#[must_use]
pub fn figure(title: &str, motion: &Motion) -> Figure {
    let history = History { model: Some(traces(motion)), ..History::default() };
    let history = History {
        stick_s: motion.stick_s.iter().map(|[from, to]| (*from, *to)).collect(),
        instants: motion.turn_s().map(|at| ("head turns".to_owned(), at)).into_iter().collect(),
        ..history
    };
    let mut figure = history::figure(&history);
    figure.synthetic = true;
    figure.title = summary(motion);
    figure.subtitle = format!("simulation; {title}");
    figure.description = format!("A simulated run: {}.", figure.title);
    figure.panels.extend(force(motion, &history));
    // (thick lines are for what lies under a measurement)
    figure.panels.iter_mut().flat_map(|panel| &mut panel.series).for_each(|series| series.mark = Mark::Thin);
    figure
}

fn traces(motion: &Motion) -> MotionTraces {
    let column = |of: fn(&Sample) -> f64| motion.samples.iter().map(|sample| Some(of(sample))).collect();
    MotionTraces {
        time_s: motion.samples.iter().map(|sample| sample.time_s).collect(),
        tip_x_m: column(|s| s.tip_x_m),
        head_x_m: column(|s| s.head_x_m),
        deflection_m: column(|s| s.tip_x_m - s.head_x_m),
        head_drop_m: column(|s| s.head_drop_m),
    }
}

/// Such as `218 sticks in 12.3 % of the time, least normal force 3.21 N`.
fn summary(motion: &Motion) -> String {
    let span_s = motion.samples.last().zip(motion.samples.first()).map_or(0.0, |(b, a)| b.time_s - a.time_s);
    let stuck_s: f64 = motion.stick_s.iter().map(|[from, to]| to - from).sum();
    let share = if span_s > 0.0 { 100.0 * stuck_s / span_s } else { 0.0 };
    let sticks = motion.stick_s.len();
    let sticks = format!("{sticks} {}", plural("stick", sticks));
    let force = motion.extremes.min_normal_force_n;
    let force = force.map_or_else(String::new, |n| format!(", least normal force {} N", short(n)));
    format!("{sticks} in {} % of the time{force}", short(share))
}

/// The normal force over time, down to zero, where the tip leaves the glass.
fn force(motion: &Motion, history: &History) -> Option<Panel> {
    let span_s = (motion.samples.first()?.time_s, motion.samples.last()?.time_s);
    let points: Vec<_> = motion.samples.iter().map(|s| Some((s.time_s, s.normal_n))).collect();
    let most = points.iter().flatten().map(|(_, force)| *force).fold(0.0, f64::max);
    let flights = motion.impacts.iter().map(|impact| impact.time_s);
    let rule = |at| Rule { at, colour: Colour::Purple, mark: Mark::Dotted, ..Rule::default() };
    (most > 0.0 && span_s.0 < span_s.1).then(|| Panel {
        x: Axis::time().between(span_s.0, span_s.1),
        y: Axis::linear("normal force, N").between(0.0, 1.05 * most),
        height_mm: FORCE_MM,
        series: vec![Series {
            label: "model".to_owned(),
            colour: Colour::Vermilion,
            points: thin(&points, span_s),
            ..Series::default()
        }],
        bands: bands::of(&history.stick_s, span_s),
        rules: flights.map(rule).collect(),
        ..Panel::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::scene::Scene;

    #[test]
    fn a_run_shows_its_motion_and_its_force_from_zero_on() {
        let scene = Scene::parse("s", include_str!("../../data/scenes/light-blade.toml")).unwrap();
        let motion = Motion::of(&scene);
        let drawn = figure(scene.title(), &motion);
        let labels: Vec<&str> = drawn.panels.iter().map(|panel| panel.y.label.as_str()).collect();
        assert_eq!(labels.len(), 5);
        assert_eq!(labels[4], "normal force, N");
        assert_eq!(drawn.panels[4].y.range.map(|(low, _)| low), Some(0.0));
        assert!(drawn.subtitle.starts_with("simulation; ") && drawn.title.contains("% of the time"));
        assert_eq!(drawn.panels[0].rules[0].label, "head turns");
    }
}
