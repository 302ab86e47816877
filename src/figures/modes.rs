//! Natural modes of a blade: compliance of the tip against frequency, and mode shapes.

use crate::model::Linkage;
use crate::model::modes::{NaturalMode, TipConstraint, natural_modes, tip_compliance};
use crate::text::{format_digits, join_with_and};
use plain_charts::{
    ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, MarkerShape, Panel, Series, VerticalLine,
};
use portable_math as math;

/// Number of frequencies of the compliance curve.
const POINTS: usize = 600;
/// The frequency axis begins at the lowest mode divided by this factor and ends at the highest mode
/// multiplied by it.
const BEYOND: f64 = 4.0;
/// Height, mm, of the panel of the compliance.
const ANSWER_MM: f64 = 52.0;
/// Height, mm, of the panel of a mode shape.
const SHAPE_MM: f64 = 44.0;
/// Angle from the vertical, rad, of that link of a drawn mode shape which is inclined more.
const SWING: f64 = 0.35;
/// Half width of the panel of a mode shape, in lengths of the blade.
const HALF_WIDTH: f64 = 0.5;

/// The figures of the compliance of the tip and of the mode shapes.
pub(crate) fn draw_figures(title: &str, blade: &Linkage) -> [Figure; 2] {
    let sides: &[bool] = if blade.shoulder.is_some() { &[false, true] } else { &[false] };
    let of = |on: bool| natural_modes(blade, TipConstraint::Free, on);
    let found: Vec<f64> = sides.iter().flat_map(|on| of(*on)).filter_map(|mode| mode.frequency_hz).collect();
    let low = found.iter().copied().fold(f64::INFINITY, f64::min);
    let high = found.iter().copied().fold(0.0, f64::max);
    let range = if low <= high { (low / BEYOND, high * BEYOND) } else { (1.0, 1e4) };
    let shapes = sides.iter().flat_map(|&on| {
        of(on).into_iter().enumerate().map(move |(number, mode)| draw_mode_shape(blade, on, number, &mode))
    });
    let words = found.iter().map(|hz| format!("{hz:.1} Hz")).collect::<Vec<_>>().join(", ");
    let figure = |claim: String, description: &str, panels| Figure {
        title: claim,
        subtitle: format!("{title}; linearised about the upright blade, tip sliding without friction"),
        watermarked: false,
        description: format!("{description}; modes at {words}."),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels,
    };
    let frequencies = found.iter().map(|hz| format_digits(*hz, 3)).collect();
    let resonance = claim_sentence(frequencies, "The tip answers most at", "Hz");
    let stable = of(false).into_iter().filter(|mode| mode.frequency_hz.is_some());
    let ratios = stable.map(|mode| format_digits(mode.lip_over_neck.abs(), 2)).collect();
    let swing = claim_sentence(ratios, "The lip swings", "times as far as the neck");
    let answer = vec![draw_receptance_panel(blade, sides, range)];
    let answer = figure(resonance, "How far a force on the tip moves it", answer);
    [Figure { columns: 1, ..answer }, figure(swing, "The links at both ends of a swing", shapes.collect())]
}

/// The main result with its numbers, or the statement that there is no stable mode.
fn claim_sentence(numbers: Vec<String>, before: &str, after: &str) -> String {
    if numbers.is_empty() {
        return "The blade has no stable mode".to_owned();
    }
    format!("{before} {} {after}", join_with_and(&numbers))
}

fn side_name(on_shoulder: bool) -> &'static str {
    if on_shoulder { "neck on the shoulder" } else { "neck free" }
}

/// Tip compliance (ratio of displacement to force) against frequency.
fn draw_receptance_panel(blade: &Linkage, sides: &[bool], (low, high): (f64, f64)) -> Panel {
    let at = |i: usize| low * math::powf(high / low, i as f64 / (POINTS - 1) as f64);
    let mm_per_n = |on: bool, hz: f64| {
        let found = tip_compliance(blade, on, hz);
        1e3 * math::hypot(found.re, found.im)
    };
    let styles = [(Colour::Blue, Mark::Line), (Colour::Vermilion, Mark::Dashed)];
    let series = sides.iter().zip(styles).map(|(&on, (colour, mark))| {
        Series::new(side_name(on), colour, mark, (0..POINTS).map(at).map(|hz| (hz, mm_per_n(on, hz))))
    });
    let (x, y) =
        (ChartAxis::log("frequency, Hz").with_range(low, high), ChartAxis::log("tip over force, mm/N"));
    let rules = sides.iter().zip(styles).flat_map(|(&on, (colour, _))| {
        natural_modes(blade, TipConstraint::Free, on).into_iter().filter_map(move |mode| {
            let at = mode.frequency_hz?;
            Some(VerticalLine::new(format!("{at:.0} Hz"), colour, Mark::Dotted, at))
        })
    });
    Panel { vertical_lines: rules.collect(), ..Panel::new(x, y, ANSWER_MM, series) }
}

/// The links at the two extreme positions of a mode, drawn to scale over the upright blade.
fn draw_mode_shape(blade: &Linkage, on_shoulder: bool, number: usize, mode: &NaturalMode) -> Panel {
    let largest = mode.lip_over_neck.abs().max(1.0);
    let (neck, lip) = (SWING / largest, SWING * mode.lip_over_neck / largest);
    let half_mm = HALF_WIDTH * 1e3 * blade.upright_height_m();
    let line = |sign: f64| {
        let (l1, l2) = (1e3 * blade.l1_m, 1e3 * blade.l2_m);
        let head = (0.0, l1 + l2);
        let hinge = (l1 * math::sin(sign * neck), head.1 - l1 * math::cos(sign * neck));
        let tip = (hinge.0 + l2 * math::sin(sign * lip), hinge.1 - l2 * math::cos(sign * lip));
        [head, hinge, tip]
    };
    let frequency = mode.frequency_hz.map_or_else(|| "unstable".to_owned(), |hz| format!("{hz:.1} Hz"));
    let x = ChartAxis::linear("along the glass, mm").with_range(-half_mm, half_mm);
    let joined = Mark::Joined(MarkerShape::Disc);
    let series = [
        Series::new("upright", Colour::Grey, Mark::Dashed, line(0.0)),
        Series::new("one end of the swing", Colour::Blue, joined, line(1.0)),
        Series::new("the other", Colour::Orange, joined, line(-1.0)),
    ];
    Panel {
        title: format!("{}, mode {}: {frequency}", side_name(on_shoulder), number + 1),
        equal_aspect: true,
        ..Panel::new(x, ChartAxis::linear("over the glass, mm"), SHAPE_MM, series)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::scene::Scene;
    use plain_charts::Medium;

    #[test]
    fn a_blade_with_a_shoulder_has_two_answers_and_four_shapes() {
        let scene = Scene::parse("s", include_str!("../../data/scenes/actual-blade.toml")).unwrap();
        let [answer, shapes] = draw_figures(scene.title(), &scene.linkage);
        assert_eq!((answer.panels[0].series.len(), answer.panels[0].vertical_lines.len()), (2, 4));
        assert_eq!(shapes.panels.len(), 4);
        assert_eq!(shapes.panels[0].title, "neck free, mode 1: 115.2 Hz");
        assert!(answer.to_svg(Medium::Screen).contains("115 Hz"));
        assert_eq!(answer.title, "The tip answers most at 115, 745, 385 and 1250 Hz");
        assert_eq!(shapes.title, "The lip swings 2.3 and 7.8 times as far as the neck");
        let plain = Scene::parse("s", include_str!("../../data/scenes/light-blade.toml")).unwrap();
        let [answer, shapes] = draw_figures(plain.title(), &plain.linkage);
        assert_eq!((answer.panels[0].series.len(), shapes.panels.len()), (1, 2));
    }
}
