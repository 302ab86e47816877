//! The linkage drawn to scale at selected instants of the reversal; it shows how the blade flips over.

use super::about;
use crate::compare::ConditionComparison;
use crate::figures::{Drawing, FigureBlock, FigureText, subtitle};
use crate::model::Linkage;
use crate::recording::channel::InstantKind;
use crate::simulate::mode::TipMode;
use crate::simulate::{ModelSample, RunMotion};
use crate::text;
use crate::text::{format_decimals, format_short, join_with_and};
use plain_charts::{
    ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, MarkerShape, Panel, Series, TextAnnotation,
};
use portable_math as math;

/// Pose of the blade at an instant.
#[derive(Debug, Clone, Copy)]
pub struct ReversalPose {
    /// Name of the event, such as `upright`.
    pub name: &'static str,
    /// Time after the reversal of the head, s.
    pub after_turn_s: f64,
    /// State of the model.
    pub sample: ModelSample,
    /// Velocity of the head, m/s.
    pub head_m_per_s: f64,
}

/// Longest allowed time between a hold and the reversal, as a fraction of the duration of the run.
const NEAR_TURN: f64 = 0.05;
/// Ratio of the deflection at the pose `half way` to the deflection at the start of the hold.
const HALF_WAY: f64 = 0.5;

/// Poses before, during and after the first reversal; empty if the head does not turn.
pub(crate) fn reversal_poses(motion: &RunMotion) -> Vec<ReversalPose> {
    let samples = &motion.samples;
    let Some(turn) = motion.turn() else { return Vec::new() };
    let turn_s = samples[turn].time_s;
    let mut chosen = vec![("head turns", turn)];
    if let Some([hold_s, release_s]) = rest_span_s(motion, turn_s) {
        let length = release_s - hold_s;
        let from = |t: f64| samples.partition_point(|s| s.time_s < t);
        let (held, released, last) = (from(hold_s), from(release_s), samples.len() - 1);
        chosen.extend([("before", from(hold_s - length).min(last)), ("tip stops", held.min(last))]);
        chosen.extend(head_over_tip_index(samples, held, HALF_WAY).map(|at| ("half way", at)));
        chosen.extend(head_over_tip_index(samples, held, 0.0).map(|at| ("upright", at)));
        // a tip that sticks until the run ends is not released
        if samples.get(released).is_some_and(|s| released < last || s.mode != TipMode::Stick) {
            let (slip, after) = (first_slip(motion, released), from(release_s + length).min(last));
            chosen.push(("stick ends", released.saturating_sub(1)));
            chosen.extend(slip.map(|at| ("first slip", at)));
            chosen.extend((slip != Some(after)).then_some(("after", after)));
        }
    }
    chosen.sort_by_key(|(_, at)| *at);
    chosen.into_iter().map(|(name, at)| build_pose(samples, name, at, turn_s)).collect()
}

fn build_pose(samples: &[ModelSample], name: &'static str, at: usize, turn_s: f64) -> ReversalPose {
    let (before, after) = (at.saturating_sub(1), (at + 1).min(samples.len() - 1));
    let (x, t) =
        (samples[after].head_x_m - samples[before].head_x_m, samples[after].time_s - samples[before].time_s);
    ReversalPose {
        name,
        after_turn_s: samples[at].time_s - turn_s,
        sample: samples[at],
        head_m_per_s: if t > 0.0 { x / t } else { 0.0 },
    }
}

/// Start and end, s, of the longest stick of the tip at or near the reversal of the head.
fn rest_span_s(motion: &RunMotion, turn_s: f64) -> Option<[f64; 2]> {
    let span = motion.samples.last()?.time_s - motion.samples.first()?.time_s;
    let near =
        |[start, end]: &&[f64; 2]| *start < turn_s + NEAR_TURN * span && *end > turn_s - NEAR_TURN * span;
    motion.stick_s.iter().filter(near).max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0]))).copied()
}

/// Index of the first sample, from index `from` on, whose deflection is at most `share` times the deflection
/// of sample `from`.
fn head_over_tip_index(samples: &[ModelSample], from: usize, share: f64) -> Option<usize> {
    let deflection = |s: &ModelSample| s.tip_x_m - s.head_x_m;
    let after = samples.get(from..)?;
    let first = deflection(after.first()?);
    after.iter().position(|s| deflection(s) * first <= share * first * first).map(|at| from + at)
}

/// Index of the fastest slipping sample between the release and the next stick or flight.
fn first_slip(motion: &RunMotion, released: usize) -> Option<usize> {
    let samples = &motion.samples;
    let slips = |at: &usize| matches!(samples[*at].mode, TipMode::SlipForward | TipMode::SlipBackward);
    let starts = motion.stick_s.iter().map(|[start, _]| samples.partition_point(|s| s.time_s < *start));
    let again = starts.into_iter().find(|start| *start > released);
    let speed = |at: &usize| samples[*at].tip_velocity_m_per_s.abs();
    (released..again.unwrap_or(samples.len())).take_while(slips).max_by(|a, b| speed(a).total_cmp(&speed(b)))
}

/// Head, hinge and tip: each with its position along the sweep and its height above the glass, m.
pub(crate) fn joint_positions(linkage: &Linkage, sample: &ModelSample) -> [(f64, f64); 3] {
    let head = (sample.head_x_m, linkage.upright_height_m() - sample.head_drop_m);
    let below = |(x, y): (f64, f64), angle: f64, length: f64| {
        (x + length * math::sin(angle), y - length * math::cos(angle))
    };
    let hinge = below(head, sample.pose.theta, linkage.l1_m);
    [head, hinge, below(hinge, sample.pose.phi, linkage.l2_m)]
}

/// Data of the figure.
#[derive(Debug, Clone)]
pub struct PoseSequence {
    /// Heading.
    pub title: String,
    /// Line under the heading.
    pub subtitle: String,
    /// Links of the blade.
    pub linkage: Linkage,
    /// The instants, in order of time.
    pub poses: Vec<ReversalPose>,
    /// Start and end of the stick around the reversal, s.
    pub rest_s: Option<[f64; 2]>,
    /// Time from the reversal to the release, s, by the definition that a fit uses: the tip has left its
    /// position by more than the noise. `None` if it was not determined.
    pub released_after_s: Option<f64>,
}

impl PoseSequence {
    /// The poses of a motion; `None` if its head does not turn.
    #[must_use]
    pub fn from_motion(motion: &RunMotion, title: &str, subtitle: String) -> Option<Self> {
        Some(Self {
            title: title.to_owned(),
            subtitle,
            linkage: motion.linkage,
            poses: reversal_poses(motion),
            rest_s: rest_span_s(motion, motion.turn_s()?),
            released_after_s: None,
        })
    }
}

/// The figure of a condition; `None` if the head of its model does not turn.
pub(crate) fn figure_block(case: &ConditionComparison) -> Option<FigureBlock> {
    let subtitle = subtitle(case.is_synthetic(), "drawn from the fitted model");
    let model = case.model_side();
    let released_after_s = model
        .instant_s(InstantKind::Release)
        .zip(model.instant_s(InstantKind::Reversal))
        .map(|(to, from)| to - from);
    let shown = PoseSequence {
        released_after_s,
        ..PoseSequence::from_motion(&case.model.motion, &case.figure_title(), subtitle)?
    };
    let words = FigureText { caption: figure_caption(&shown), details: figure_details(&shown) };
    Some(case.model_figure_block("poses", words, Drawing::Chart(draw_figure(&shown))))
}

/// The main result in one sentence, with its numbers.
fn claim_sentence(shown: &PoseSequence) -> String {
    match describe_rest(shown) {
        Some((time, way)) => format!("The tip rests for {time} while the head moves by {way}"),
        None if shown.rest_s.is_some() => "The tip rests until the run ends".to_owned(),
        None => "The tip does not rest while the head turns".to_owned(),
    }
}

/// Caption: one sentence on the figure.
pub(crate) fn figure_caption(shown: &PoseSequence) -> String {
    let at = |name: &str| shown.poses.iter().find(|p| p.name == name);
    let rest = |(time, way)| format!(": its tip rests for {time} while the head moves by {way}");
    let rests = describe_rest(shown).map(rest);
    let leans = at("before").zip(at("after")).map(|(before, after)| {
        let lean = |p: &ReversalPose| format_short(p.sample.pose.theta.to_degrees());
        let joint = if rests.is_some() { ", and the" } else { ": its" };
        format!("{joint} neck leans over from {}\u{b0} to {}\u{b0}", lean(before), lean(after))
    });
    format!(
        "The blade through the reversal, to scale{}{}.",
        rests.unwrap_or_default(),
        leans.unwrap_or_default()
    )
}

/// Duration of the stick around the reversal, and path of the head during it.
fn describe_rest(shown: &PoseSequence) -> Option<(String, String)> {
    let at = |name: &str| shown.poses.iter().find(|p| p.name == name);
    let ([from, to], (stops, leaves)) = shown.rest_s.zip(at("tip stops").zip(at("stick ends")))?;
    let way_m = (leaves.sample.head_x_m - stops.sample.head_x_m).abs();
    let (unit, factor) = text::choose_prefix("m", [way_m]);
    let way = format!("{} {unit}", format_short(way_m * factor));
    Some((format!("{} ms", format_short(1e3 * (to - from))), way))
}

/// Sentences on the arrows, and on drawings with the tip off the glass.
pub(crate) fn figure_details(shown: &PoseSequence) -> String {
    let longest = ArrowScale::from_poses(&shown.poses);
    let arrows = format!(
        "Arrows: velocity of the head, up to {} m/s, and friction on the tip, up to {} N.",
        format_short(longest.speed_m_per_s),
        format_short(longest.force_n)
    );
    let flights = shown.poses.iter().filter(|p| p.sample.tip_height_m > 0.0);
    let flights: Vec<String> = flights.map(|p| format!("\u{201c}{}\u{201d}", p.name)).collect();
    if flights.is_empty() {
        arrows
    } else {
        format!("{arrows} The tip is off the glass in {}.", join_with_and(&flights))
    }
}

// One drawing per pose: head, links, glass and arrows.

/// Height of a drawing, mm.
const HEIGHT_MM: f64 = 40.0;

// The following constants are in lengths of the upright blade, so that every blade fits its drawing.

/// Smallest half width of a drawing, in lengths of the upright blade.
const HALF_WIDTH: f64 = 0.5;
/// Margin next to the tip if the blade leans farther than the smallest half width, in lengths of the upright
/// blade.
const BESIDE_TIP: f64 = 0.1;
/// Half width of the glass, in lengths of the upright blade.
const GLASS: f64 = 0.85;
/// Height of the lower end of a drawing above the glass, in lengths of the upright blade.
const FOOT: f64 = -0.5;
/// Height of the upper end of a drawing above the glass, in lengths of the upright blade.
const TOP: f64 = 1.34;
/// Half width and height of the drawn head, in lengths of the upright blade.
const HEAD: (f64, f64) = (0.16, 0.14);
/// Length of the longest arrow, in lengths of the upright blade.
const ARROW: f64 = 0.36;
/// Size of the barbs of an arrow, in lengths of the upright blade.
const BARB: f64 = 0.06;
/// Height above the glass at which the velocity arrow is drawn, in lengths of the upright blade.
const VELOCITY_AT: f64 = 1.24;
/// Height above the glass at which the friction arrow is drawn, in lengths of the upright blade.
const FRICTION_AT: f64 = -0.13;
/// Height of the time label above the glass, in lengths of the upright blade.
const TEXT_AT: f64 = -0.28;
/// Distance of the state label below the time label in a drawing of the smallest width, in lengths of the
/// upright blade.
const TEXT_APART: f64 = 0.13;
/// Maximum length of the scale bar, its height above the glass, and the distance of its label above it, in
/// lengths of the upright blade.
const SCALE_BAR: (f64, f64, f64) = (0.4, 0.55, 0.09);
/// Spacing and depth of the hatching of the glass, in lengths of the upright blade.
const HATCHING: (f64, f64) = (0.08, 0.06);
/// Arrows shorter than this fraction of the longest arrow are not drawn; only their barbs would show.
const LEAST_ARROW: f64 = 0.25;

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &PoseSequence) -> Figure {
    let longest = ArrowScale::from_poses(&shown.poses);
    let poses = shown.poses.iter().enumerate();
    let panels = poses.map(|(i, pose)| draw_panel(shown, &longest, pose, i == 0));
    Figure {
        title: claim_sentence(shown),
        subtitle: about(&shown.title, &shown.subtitle),
        watermarked: false,
        description:
            "Head, neck and lip of the model on the glass, to scale, at instants through the reversal."
                .to_owned(),
        width_mm: FULL_WIDTH_MM,
        columns: 4,
        panels: panels.collect(),
    }
}

/// Speed of the head, m/s, and friction force, N, that an arrow of the maximum length represents.
pub(super) struct ArrowScale {
    pub speed_m_per_s: f64,
    pub force_n: f64,
}

impl ArrowScale {
    pub(crate) fn from_poses(poses: &[ReversalPose]) -> Self {
        let most =
            |value: &dyn Fn(&ReversalPose) -> f64| poses.iter().map(|p| value(p).abs()).fold(0.0, f64::max);
        Self { speed_m_per_s: most(&|p| p.head_m_per_s), force_n: most(&|p| p.sample.friction_n) }
    }
}

fn draw_panel(shown: &PoseSequence, longest: &ArrowScale, pose: &ReversalPose, first: bool) -> Panel {
    let length_m = shown.linkage.upright_height_m();
    let unit_mm = 1e3 * length_m;
    // positions along the sweep relative to the head, and heights above the glass, in lengths of the upright
    // blade
    let [head, hinge, tip] = joint_positions(&shown.linkage, &pose.sample)
        .map(|(x, y)| ((x - pose.sample.head_x_m) / length_m, y / length_m));
    let lean = |p: &ReversalPose| (p.sample.tip_x_m - p.sample.head_x_m).abs() / length_m;
    let farthest = shown.poses.iter().map(lean).fold(0.0, f64::max);
    let half = HALF_WIDTH.max(farthest + BESIDE_TIP);
    let line = |label: &str, colour, mark, points: Vec<Option<(f64, f64)>>| {
        let in_mm = points.into_iter().map(|p| p.map(|(x, y)| (x * unit_mm, y * unit_mm)));
        Series::new(label, colour, mark, in_mm)
    };
    let along = |value: f64, most: f64| if most > 0.0 { ARROW * value / most } else { 0.0 };
    let velocity = arrow_points((0.0, VELOCITY_AT), along(pose.head_m_per_s, longest.speed_m_per_s));
    let force = along(pose.sample.friction_n, longest.force_n);
    let friction = arrow_points((tip.0 - force, FRICTION_AT), force); // the arrow ends where the force acts
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
    let text = |text: String, (x, y): (f64, f64)| {
        TextAnnotation::new(text, Colour::Black, (x * unit_mm, y * unit_mm))
    };
    // a wider drawing has a smaller scale, but letters keep their size
    let apart = TEXT_APART * half / HALF_WIDTH;
    let state = pose.sample.mode.name().replace('-', "\u{2212}");
    // one decimal, since samples are about a tenth of a millisecond apart
    let time = format!("{} ms", format_decimals(1e3 * pose.after_turn_s, 1));
    let mut texts = vec![text(time, (0.0, TEXT_AT)), text(state, (0.0, TEXT_AT - apart))];
    if first {
        let (most, height, over) = SCALE_BAR;
        let bar_mm = scale_bar_mm(most * unit_mm);
        let end = -HALF_WIDTH.copysign(tip.0); // on the side away from the tip
        let bar = (end, end - (bar_mm / unit_mm).copysign(end));
        series.push(line("", Colour::Black, Mark::Thick, vec![Some((bar.0, height)), Some((bar.1, height))]));
        texts.push(text(format!("{} mm", format_short(bar_mm)), ((bar.0 + bar.1) / 2.0, height + over)));
    }
    let [x, y] = [(-half, half), (FOOT, TOP)]
        .map(|(low, high)| ChartAxis::linear("").with_range(low * unit_mm, high * unit_mm));
    Panel {
        title: pose.name.to_owned(),
        annotations: texts,
        equal_aspect: true,
        bare: true,
        ..Panel::new(x, y, HEIGHT_MM, series)
    }
}

/// The largest length of the form 1, 2 or 5 times a power of ten that is at most `most_mm`.
fn scale_bar_mm(most_mm: f64) -> f64 {
    let power = math::powi(10.0, math::log10(most_mm).floor() as i32);
    [5.0, 2.0, 1.0].into_iter().map(|m| m * power).find(|bar| *bar <= most_mm).unwrap_or(power)
}

/// A horizontal arrow; empty if it would be too short.
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
    use super::*;
    use crate::simulate::scene::Scene;
    use plain_charts::Medium;

    pub(super) fn motion() -> RunMotion {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scenes/actual-blade.toml");
        RunMotion::simulate(
            &Scene::parse("actual-blade.toml", &std::fs::read_to_string(path).unwrap()).unwrap(),
        )
    }

    #[test]
    fn the_drawn_tip_is_where_the_model_has_it() {
        let motion = motion();
        assert!(!motion.samples.is_empty());
        for sample in &motion.samples {
            let [head, _, (x, y)] = joint_positions(&motion.linkage, sample);
            assert!(
                (x - sample.tip_x_m).abs() < 1e-9 && (y - sample.tip_height_m).abs() < 1e-9,
                "{sample:?}"
            );
            assert_eq!(head.0, sample.head_x_m);
        }
    }

    #[test]
    fn the_poses_follow_the_reversal() {
        let motion = motion();
        let poses = reversal_poses(&motion);
        let names: Vec<&str> = poses.iter().map(|p| p.name).collect();
        assert_eq!(
            names,
            ["before", "tip stops", "head turns", "half way", "upright", "stick ends", "first slip", "after"]
        );
        let modes: Vec<TipMode> = poses[1..7].iter().map(|p| p.sample.mode).collect();
        assert_eq!(
            modes,
            [
                TipMode::Stick,
                TipMode::Stick,
                TipMode::Stick,
                TipMode::Stick,
                TipMode::Stick,
                TipMode::SlipBackward
            ]
        );
        let deflection = |p: &ReversalPose| p.sample.tip_x_m - p.sample.head_x_m;
        assert!((deflection(&poses[3]) / deflection(&poses[1]) - 0.5).abs() < 2e-3);
        assert!(deflection(&poses[0]) * deflection(&poses[7]) < 0.0 && deflection(&poses[4]).abs() < 1e-5);
        assert!(
            poses[0].head_m_per_s > 0.0 && poses[7].head_m_per_s < 0.0 && poses[2].head_m_per_s.abs() < 1e-3
        );
    }

    #[test]
    fn a_run_that_ends_in_the_rest_shows_no_release_and_a_tip_that_flies_does_not_slip() {
        let whole = motion();
        let turn_s = whole.turn_s().unwrap();
        let [from_s, to_s] = rest_span_s(&whole, turn_s).unwrap();
        let names = |motion: &RunMotion| reversal_poses(motion).iter().map(|p| p.name).collect::<Vec<_>>();
        let mut held = whole.clone();
        let end_s = from_s + 0.9 * (to_s - from_s);
        held.samples.retain(|s| s.time_s <= end_s);
        held.stick_s.retain(|[start, _]| *start <= end_s);
        held.stick_s.last_mut().unwrap()[1] = held.samples.last().unwrap().time_s;
        assert_eq!(names(&held), ["before", "tip stops", "head turns", "half way", "upright"]);
        let mut flies = whole;
        flies.samples.iter_mut().filter(|s| s.time_s >= to_s).for_each(|s| s.mode = TipMode::Flight);
        assert_eq!(names(&flies).last_chunk(), Some(&["stick ends", "after"]));
    }

    #[test]
    fn a_head_that_does_not_turn_gives_no_poses() {
        let mut motion = motion();
        let turn = motion.turn().unwrap();
        motion.samples.truncate(turn);
        assert!(reversal_poses(&motion).is_empty());
        motion.samples.clear();
        assert!(reversal_poses(&motion).is_empty());
    }

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
