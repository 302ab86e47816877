//! Natural modes of a blade: how its tip answers a force, and how the links swing.

use crate::blade::Linkage;
use crate::blade::modes::{NaturalMode, Tip, modes, tip_compliance};
use crate::chart::{Axis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Rule, Series, Shape};
use crate::math;
use crate::text::{digits, listed};

/// Frequencies of the answer.
const POINTS: usize = 600;
/// The axis goes this far beyond the lowest and the highest mode.
const BEYOND: f64 = 4.0;
/// Height of the answer, mm, and of a shape.
const ANSWER_MM: f64 = 52.0;
const SHAPE_MM: f64 = 44.0;
/// Largest angle of a drawn shape, rad.
const SWING: f64 = 0.35;
/// Half the width of a shape, in lengths of the blade.
const HALF_WIDTH: f64 = 0.5;

/// What the tip answers, and the shapes of the modes.
#[must_use]
pub fn figures(title: &str, blade: &Linkage) -> [Figure; 2] {
    let sides: &[bool] = if blade.shoulder.is_some() { &[false, true] } else { &[false] };
    let of = |on: bool| modes(blade, Tip::Free, on);
    let found: Vec<f64> = sides.iter().flat_map(|on| of(*on)).filter_map(|mode| mode.frequency_hz).collect();
    let low = found.iter().copied().fold(f64::INFINITY, f64::min);
    let high = found.iter().copied().fold(0.0, f64::max);
    let range = if low <= high { (low / BEYOND, high * BEYOND) } else { (1.0, 1e4) };
    let shapes = sides.iter().flat_map(|&on| {
        of(on).into_iter().enumerate().map(move |(number, mode)| shape(blade, on, number, &mode))
    });
    let words = found.iter().map(|hz| format!("{hz:.1} Hz")).collect::<Vec<_>>().join(", ");
    let figure = |claim: String, description: &str, panels| Figure {
        title: claim,
        subtitle: format!("{title}; linearised about the upright blade, tip sliding without friction"),
        synthetic: false,
        description: format!("{description}; modes at {words}."),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels,
    };
    let answer = vec![answer(blade, sides, range)];
    [
        Figure { columns: 1, ..figure(resonances(&found), "How far a force on the tip moves it", answer) },
        figure(swings(&of(false)), "The links at both ends of a swing", shapes.collect()),
    ]
}

/// The claim with its numbers: where a force moves the tip farthest.
fn resonances(found_hz: &[f64]) -> String {
    let found: Vec<String> = found_hz.iter().map(|hz| digits(*hz, 3)).collect();
    if found.is_empty() {
        return "The blade has no stable mode".to_owned();
    }
    format!("The tip answers most at {} Hz", listed(&found))
}

/// The claim with its numbers: how far the lip swings with the neck free.
fn swings(found: &[NaturalMode]) -> String {
    let stable = found.iter().filter(|mode| mode.frequency_hz.is_some());
    let ratios: Vec<String> = stable.map(|mode| digits(mode.lip_over_neck.abs(), 2)).collect();
    if ratios.is_empty() {
        return "The blade has no stable mode".to_owned();
    }
    format!("The lip swings {} times as far as the neck", listed(&ratios))
}

fn words(on_shoulder: bool) -> &'static str {
    if on_shoulder { "neck on the shoulder" } else { "neck free" }
}

/// Displacement of the tip over the force on it.
fn answer(blade: &Linkage, sides: &[bool], (low, high): (f64, f64)) -> Panel {
    let at = |i: usize| low * math::powf(high / low, i as f64 / (POINTS - 1) as f64);
    let mm_per_n = |on: bool, hz: f64| {
        let found = tip_compliance(blade, on, hz);
        1e3 * math::hypot(found.re, found.im)
    };
    let styles = [(Colour::Blue, Mark::Line), (Colour::Vermilion, Mark::Dashed)];
    let series = sides.iter().zip(styles).map(|(&on, (colour, mark))| Series {
        label: words(on).to_owned(),
        colour,
        mark,
        points: (0..POINTS).map(at).map(|hz| Some((hz, mm_per_n(on, hz)))).collect(),
        ..Series::default()
    });
    let rules = sides.iter().zip(styles).flat_map(|(&on, (colour, _))| {
        modes(blade, Tip::Free, on).into_iter().filter_map(move |mode| {
            let at = mode.frequency_hz?;
            Some(Rule { label: format!("{at:.0} Hz"), colour, mark: Mark::Dotted, at, above: None })
        })
    });
    Panel {
        x: Axis::log("frequency, Hz").between(low, high),
        y: Axis::log("tip over force, mm/N"),
        height_mm: ANSWER_MM,
        series: series.collect(),
        rules: rules.collect(),
        ..Panel::default()
    }
}

/// The links at both ends of a swing, over the upright blade, to scale.
fn shape(blade: &Linkage, on_shoulder: bool, number: usize, mode: &NaturalMode) -> Panel {
    let largest = mode.lip_over_neck.abs().max(1.0);
    let (neck, lip) = (SWING / largest, SWING * mode.lip_over_neck / largest);
    let half_mm = HALF_WIDTH * 1e3 * (blade.l1_m + blade.l2_m);
    let line = |sign: f64| {
        let (l1, l2) = (1e3 * blade.l1_m, 1e3 * blade.l2_m);
        let head = (0.0, l1 + l2);
        let hinge = (l1 * math::sin(sign * neck), head.1 - l1 * math::cos(sign * neck));
        let tip = (hinge.0 + l2 * math::sin(sign * lip), hinge.1 - l2 * math::cos(sign * lip));
        vec![Some(head), Some(hinge), Some(tip)]
    };
    let drawn = |label: &str, colour, mark, points| Series {
        label: label.to_owned(),
        colour,
        mark,
        points,
        ..Series::default()
    };
    let frequency = mode.frequency_hz.map_or_else(|| "unstable".to_owned(), |hz| format!("{hz:.1} Hz"));
    Panel {
        title: format!("{}, mode {}: {frequency}", words(on_shoulder), number + 1),
        x: Axis::linear("along the glass, mm").between(-half_mm, half_mm),
        y: Axis::linear("over the glass, mm"),
        height_mm: SHAPE_MM,
        series: vec![
            drawn("upright", Colour::Grey, Mark::Dashed, line(0.0)),
            drawn("one end of the swing", Colour::Blue, Mark::Joined(Shape::Disc), line(1.0)),
            drawn("the other", Colour::Orange, Mark::Joined(Shape::Disc), line(-1.0)),
        ],
        equal: true,
        ..Panel::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Medium;
    use crate::simulate::scene::Scene;

    #[test]
    fn a_blade_with_a_shoulder_has_two_answers_and_four_shapes() {
        let scene = Scene::parse("s", include_str!("../../data/scenes/actual-blade.toml")).unwrap();
        let [answer, shapes] = figures(scene.title(), &scene.linkage);
        assert_eq!((answer.panels[0].series.len(), answer.panels[0].rules.len()), (2, 4));
        assert_eq!(shapes.panels.len(), 4);
        assert_eq!(shapes.panels[0].title, "neck free, mode 1: 115.2 Hz");
        assert!(answer.svg(Medium::Screen).contains("115 Hz"));
        assert_eq!(answer.title, "The tip answers most at 115, 745, 385 and 1250 Hz");
        assert_eq!(shapes.title, "The lip swings 2.3 and 7.8 times as far as the neck");
        let plain = Scene::parse("s", include_str!("../../data/scenes/light-blade.toml")).unwrap();
        let [answer, shapes] = figures(plain.title(), &plain.linkage);
        assert_eq!((answer.panels[0].series.len(), shapes.panels.len()), (1, 2));
    }
}
