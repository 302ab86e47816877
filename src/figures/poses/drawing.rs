//! One drawing a pose: head, links, glass and arrows.

use super::{PoseSequence, ReversalPose, claim_sentence, joint_positions};
use crate::chart::{
    ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, MarkerShape, Panel, Series, TextAnnotation,
};
use crate::figures::about;
use crate::math;
use crate::text::{format_decimals, format_short};

/// Height of a drawing, mm.
const HEIGHT_MM: f64 = 40.0;

// What follows is in lengths of the upright blade, so that every blade fits its drawing.

/// Half the width that a drawing needs, and the room next to the tip of a blade that leans farther; half the
/// glass, as far as there is room.
const HALF_WIDTH: f64 = 0.5;
const BESIDE_TIP: f64 = 0.1;
const GLASS: f64 = 0.85;
/// Foot below the glass and top.
const FOOT: f64 = -0.5;
const TOP: f64 = 1.34;
/// Half the width and the height of the head, which hangs in guides that are not drawn.
const HEAD: (f64, f64) = (0.16, 0.14);
/// Longest arrow, its barbs, and the heights of those of velocity and friction.
const ARROW: f64 = 0.36;
const BARB: f64 = 0.06;
const VELOCITY_AT: f64 = 1.24;
const FRICTION_AT: f64 = -0.13;
/// Height of the time, and how far the state stands under it in a drawing of the least width.
const TEXT_AT: f64 = -0.28;
const TEXT_APART: f64 = 0.13;
/// Longest scale bar, its height, and that of its length over it.
const SCALE_BAR: (f64, f64, f64) = (0.4, 0.55, 0.09);
/// Distance and depth of the hatching of the glass.
const HATCHING: (f64, f64) = (0.08, 0.06);
/// Arrows shorter than this share of the longest are not drawn: only barbs would show.
const LEAST_ARROW: f64 = 0.25;

/// The figure.
#[must_use]
pub fn draw_figure(shown: &PoseSequence) -> Figure {
    let longest = ArrowScale::from_poses(&shown.poses);
    Figure {
        title: claim_sentence(shown),
        subtitle: about(&shown.title, &shown.subtitle),
        watermarked: false,
        description:
            "Head, neck and lip of the model on the glass, to scale, at instants through the reversal."
                .to_owned(),
        width_mm: FULL_WIDTH_MM,
        columns: 4,
        panels: shown
            .poses
            .iter()
            .enumerate()
            .map(|(i, pose)| draw_panel(shown, &longest, pose, i == 0))
            .collect(),
    }
}

/// What the longest arrows stand for.
pub(super) struct ArrowScale {
    pub speed_m_per_s: f64,
    pub force_n: f64,
}

impl ArrowScale {
    pub fn from_poses(poses: &[ReversalPose]) -> Self {
        let most =
            |value: &dyn Fn(&ReversalPose) -> f64| poses.iter().map(|p| value(p).abs()).fold(0.0, f64::max);
        Self { speed_m_per_s: most(&|p| p.head_m_per_s), force_n: most(&|p| p.sample.friction_n) }
    }
}

fn draw_panel(shown: &PoseSequence, longest: &ArrowScale, pose: &ReversalPose, first: bool) -> Panel {
    let length_m = shown.linkage.l1_m + shown.linkage.l2_m;
    let unit_mm = 1e3 * length_m;
    // the head stays in the middle; lengths of the blade upright until the axes
    let [head, hinge, tip] = joint_positions(&shown.linkage, &pose.sample)
        .map(|(x, y)| ((x - pose.sample.head_x_m) / length_m, y / length_m));
    let farthest = shown
        .poses
        .iter()
        .map(|p| (p.sample.tip_x_m - p.sample.head_x_m).abs() / length_m)
        .fold(0.0, f64::max);
    let half = HALF_WIDTH.max(farthest + BESIDE_TIP);
    let line = |label: &str, colour, mark, points: Vec<Option<(f64, f64)>>| Series {
        label: label.to_owned(),
        colour,
        mark,
        points: points.into_iter().map(|p| p.map(|(x, y)| (x * unit_mm, y * unit_mm))).collect(),
        ..Series::default()
    };
    let along = |value: f64, most: f64| if most > 0.0 { ARROW * value / most } else { 0.0 };
    let velocity = arrow_points((0.0, VELOCITY_AT), along(pose.head_m_per_s, longest.speed_m_per_s));
    let force = along(pose.sample.friction_n, longest.force_n);
    let friction = arrow_points((tip.0 - force, FRICTION_AT), force); // it ends where it acts
    let mut series = vec![
        line("", Colour::Grey, Mark::Thin, head_hatch_lines()),
        line("", Colour::Black, Mark::Line, vec![Some((-GLASS, 0.0)), Some((GLASS, 0.0))]),
        line("", Colour::Black, Mark::Line, head_outline(head)),
        line("neck", Colour::Blue, Mark::Thick, vec![Some(head), Some(hinge)]),
        line("lip", Colour::Orange, Mark::Thick, vec![Some(hinge), Some(tip)]),
        line("", Colour::Black, Mark::Hollow(MarkerShape::Disc), vec![Some(head), Some(hinge)]),
        line("velocity of the head", Colour::Green, Mark::Line, velocity),
        line("friction on the tip", Colour::Vermilion, Mark::Line, friction),
    ];
    let text = |text: String, (x, y): (f64, f64)| TextAnnotation {
        text,
        colour: Colour::Black,
        at: (x * unit_mm, y * unit_mm),
    };
    // the wider the drawing, the smaller its scale, but letters keep their size
    let apart = TEXT_APART * half / HALF_WIDTH;
    let state = pose.sample.mode.name().replace('-', "\u{2212}");
    let mut texts =
        vec![text(format_tenths_ms(pose.after_turn_s), (0.0, TEXT_AT)), text(state, (0.0, TEXT_AT - apart))];
    if first {
        let (most, height, over) = SCALE_BAR;
        let bar_mm = scale_bar_mm(most * unit_mm);
        let end = -HALF_WIDTH.copysign(tip.0); // where the blade does not lean
        let bar = (end, end - (bar_mm / unit_mm).copysign(end));
        series.push(line("", Colour::Black, Mark::Thick, vec![Some((bar.0, height)), Some((bar.1, height))]));
        texts.push(text(format!("{} mm", format_short(bar_mm)), ((bar.0 + bar.1) / 2.0, height + over)));
    }
    Panel {
        title: pose.name.to_owned(),
        x: ChartAxis::linear("").with_range(-half * unit_mm, half * unit_mm),
        y: ChartAxis::linear("").with_range(FOOT * unit_mm, TOP * unit_mm),
        height_mm: HEIGHT_MM,
        series,
        annotations: texts,
        equal_aspect: true,
        bare: true,
        ..Panel::default()
    }
}

/// A time in tenths of a millisecond: the samples of a motion are about as far apart.
fn format_tenths_ms(time_s: f64) -> String {
    format!("{} ms", format_decimals(1e3 * time_s, 1))
}

/// The largest of 1, 2 and 5 times a power of ten that is not longer.
fn scale_bar_mm(most_mm: f64) -> f64 {
    let power = math::powi(10.0, math::log10(most_mm).floor() as i32);
    [5.0, 2.0, 1.0].into_iter().map(|m| m * power).find(|bar| *bar <= most_mm).unwrap_or(power)
}

/// A level arrow of this length; none where it would be all barbs.
fn arrow_points((x, y): (f64, f64), length: f64) -> Vec<Option<(f64, f64)>> {
    if length.abs() < LEAST_ARROW * ARROW {
        return Vec::new();
    }
    let (end, back) = (x + length, BARB.copysign(length));
    let barb = |side: f64| Some((end - back, y + side * BARB / 2.0));
    vec![Some((x, y)), Some((end, y)), None, barb(1.0), Some((end, y)), barb(-1.0)]
}

fn head_outline((x, y): (f64, f64)) -> Vec<Option<(f64, f64)>> {
    let (half, height) = HEAD;
    [(-half, 0.0), (-half, height), (half, height), (half, 0.0), (-half, 0.0)]
        .map(|(dx, dy)| Some((x + dx, y + dy)))
        .to_vec()
}

fn head_hatch_lines() -> Vec<Option<(f64, f64)>> {
    let (apart, depth) = HATCHING;
    let count = (2.0 * GLASS / apart) as usize;
    let stroke = |i: usize| {
        let x = -GLASS + (i as f64 + 0.8) * apart;
        [Some((x, 0.0)), Some((x - depth, -depth)), None]
    };
    (0..count).flat_map(stroke).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::motion;
    use super::*;
    use crate::chart::Medium;

    #[test]
    fn the_scale_bar_is_a_round_length() {
        assert_eq!([2.2, 0.7, 5.0, 0.19].map(scale_bar_mm), [2.0, 0.5, 5.0, 0.1]);
    }

    #[test]
    fn the_arrows_point_where_velocity_and_friction_do() {
        let motion = motion();
        let shown = PoseSequence::from_motion(&motion, "t", String::new()).unwrap();
        let figure = draw_figure(&shown);
        let direction = |panel: &Panel, label: &str| {
            let arrow = panel.series.iter().find(|s| s.label == label).unwrap();
            arrow
                .points
                .first()
                .copied()
                .flatten()
                .zip(arrow.points.get(1).copied().flatten())
                .map(|(a, b)| (b.0 - a.0).signum())
        };
        assert_eq!(direction(&figure.panels[0], "velocity of the head"), Some(1.0));
        assert_eq!(direction(&figure.panels[0], "friction on the tip"), Some(-1.0));
        assert_eq!(direction(&figure.panels[7], "velocity of the head"), Some(-1.0));
        assert_eq!(direction(&figure.panels[7], "friction on the tip"), Some(1.0));
        assert!(figure.to_svg(Medium::Column).contains("velocity of the head"));
    }
}
