//! Stick and slip of the tip: its velocity over time, the friction on it over its velocity together with the
//! friction law, and the friction over the deflection.

use super::central_difference::CentralDifference;
use super::{FigureBlock, FigureText, history};
pub use crate::compare::inverse_dynamics::TipFriction;
use crate::compare::inverse_dynamics::measure_cycle;
use crate::compare::{ConditionComparison, TimedRecording};
use crate::figures::full_figure;
use crate::recording::channel::{Channel, InstantKind};
use crate::simulate::ModelSample;
use crate::text::{format_digits, format_milliseconds, format_speed};
use plain_charts::{ChartAxis, Colour, Figure, Mark, Panel, Series, ShadedSpan, value_span};

/// Times, s, and velocities of the tip, m/s; `None` interrupts the curve.
pub(crate) type VelocityCurve = Vec<Option<(f64, f64)>>;

/// A part of the motion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StickSlipPart {
    /// Title of the panels.
    pub name: String,
    /// Start and end, s.
    pub span_s: (f64, f64),
    /// Measured velocity of the tip.
    pub measured: VelocityCurve,
    /// Velocity of the model's tip; from the same central differences as the measured one, if there is one.
    pub model: VelocityCurve,
    /// States of the model in order of time; `None` interrupts the curve.
    pub friction: Vec<Option<TipFriction>>,
    /// Friction computed from the recorded motion, one entry per frame; empty if it cannot be computed.
    pub measured_friction: Vec<Option<TipFriction>>,
    /// Friction law at the mean normal force of the part: velocity, m/s, and friction, N.
    pub law: Vec<Option<(f64, f64)>>,
    /// Shaded spans in which the model's tip sticks, or sticks and slips.
    pub sticks: Vec<ShadedSpan>,
}

/// Data of the figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StickSlipSheet {
    /// Heading.
    pub title: String,
    /// Further text for the line under the heading; empty for none.
    pub note: String,
    /// Whether the measured motion is synthetic.
    pub synthetic: bool,
    /// Entry of the friction in the legend.
    pub friction_label: String,
    /// The parts, side by side.
    pub parts: Vec<StickSlipPart>,
}

/// Height, mm, of a panel with velocities.
const VELOCITY_HEIGHT_MM: f64 = 38.0;
/// Height, mm, of a panel with friction.
const FRICTION_HEIGHT_MM: f64 = 48.0;
const MILLI: f64 = 1e3;

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &StickSlipSheet) -> Figure {
    let frames = frame_mark(&shown.parts);
    let velocity = shown.parts.iter().map(|part| draw_velocity(part, frames));
    let over_velocity = shown.parts.iter().map(|part| draw_over_velocity(part, &shown.friction_label));
    let over_deflection = shown.parts.iter().map(|part| draw_over_deflection(part, &shown.friction_label));
    Figure {
        columns: 2,
        ..full_figure(
            &shown.title,
            shown.synthetic,
            &shown.note,
            "Velocity of the tip over time; friction on the tip over its velocity, with the friction law; friction \
             over deflection.",
            velocity.chain(over_velocity).chain(over_deflection),
        )
    }
}

/// Maximum number of measured velocities of a part that are drawn as circles. If a part has more, all parts
/// have dots, which do not overlap in a narrow figure.
const MOST_CIRCLES: usize = 80;

/// Symbol of the measured velocities, the same in all parts. A line from frame to frame would mostly show
/// noise.
fn frame_mark(parts: &[StickSlipPart]) -> Mark {
    let most = parts.iter().map(|part| part.measured.iter().flatten().count()).max();
    if most.is_none_or(|most| most <= MOST_CIRCLES) { Mark::Circles } else { Mark::Dots }
}

fn draw_velocity(part: &StickSlipPart, frames: Mark) -> Panel {
    let series = |label, colour, mark, curve: &VelocityCurve| {
        Series::new(label, colour, mark, curve.iter().map(|p| p.map(|(t, v)| (t, v * MILLI))))
    };
    let model = series("model", Colour::Vermilion, Mark::Line, &part.model);
    let measured = series("measured", Colour::Black, frames, &part.measured);
    let drawn = [model, measured].into_iter().filter(|s| !s.points.is_empty());
    let time = ChartAxis::time().with_ends(Some(part.span_s));
    Panel {
        title: part.name.clone(),
        shaded_spans: part.sticks.clone(),
        ..Panel::new(time, ChartAxis::linear("tip velocity, mm/s"), VELOCITY_HEIGHT_MM, drawn)
    }
}

/// Friction over velocity, together with the friction law.
fn draw_over_velocity(part: &StickSlipPart, label: &str) -> Panel {
    let law = part.law.iter().map(|p| p.map(|(v, friction_n)| (v * MILLI, friction_n * MILLI)));
    let law = Series::new("law at the mean normal force", Colour::Grey, Mark::Dashed, law);
    let [cycle, measured] = friction_series(part, label, |state| state.velocity_m_per_s);
    let x = ChartAxis::linear("tip velocity, mm/s").with_ends(axis_limits(&cycle));
    let drawn = [cycle, law, measured].into_iter().filter(|s| !s.points.is_empty());
    Panel::new(x, ChartAxis::linear("friction, mN"), FRICTION_HEIGHT_MM, drawn)
}

fn draw_over_deflection(part: &StickSlipPart, label: &str) -> Panel {
    let [cycle, measured] = friction_series(part, label, |state| state.deflection_m);
    let x = ChartAxis::linear("deflection, mm").with_ends(axis_limits(&cycle));
    let drawn = [cycle, measured].into_iter().filter(|s| !s.points.is_empty());
    Panel::new(x, ChartAxis::linear("friction, mN"), FRICTION_HEIGHT_MM, drawn)
}

/// Friction of the model and of the recorded motion.
fn friction_series(part: &StickSlipPart, label: &str, over: fn(&TipFriction) -> f64) -> [Series; 2] {
    let point =
        |state: &Option<TipFriction>| state.map(|state| (over(&state) * MILLI, state.friction_n * MILLI));
    [
        Series::new(label, Colour::Vermilion, Mark::Thin, part.friction.iter().map(point)),
        Series::new(
            "friction, measured",
            Colour::Black,
            Mark::Dots,
            part.measured_friction.iter().map(point),
        ),
    ]
}

/// Ends of the x axis of a part. Each part has its own limits, so that stacked panels share no axis.
fn axis_limits(drawn: &Series) -> Option<(f64, f64)> {
    const AXIS_MARGIN: f64 = 0.05;
    // smallest allowed margin of the axis, as a fraction of the largest absolute value; tick labels could not
    // show a smaller one
    const LEAST_SPAN: f64 = 1e-4;
    let all = drawn.points.iter().flatten().map(|(x, _)| *x).filter(|x| x.is_finite());
    let (low, high) = value_span(all);
    let room = (AXIS_MARGIN * (high - low)).max(LEAST_SPAN * low.abs().max(high.abs()));
    Some((low - room, high + room))
}

// Parts of the figure: one after the release, and one at the top speed of the head. If the tip sticks at that
// time, the second part is at the top speed of the tip.

/// Number of cycles of the low component that are drawn; few, since its curve shifts from cycle to cycle.
const LOW_CYCLES: f64 = 3.0;
/// Number of cycles of the high component that are drawn; more, since its curve repeats.
const HIGH_CYCLES: f64 = 12.0;
/// Longest duration of a part, s: some tens of cycles of the high component. The first part has this duration
/// if no frequency is known.
const LONGEST_S: f64 = 0.06;
/// Minimum number of samples of the model in the time from the middle frame of a central difference to either
/// of its two frames. Linear interpolation between them then follows the path of the model.
const SAMPLES_APART: f64 = 2.0;
/// Largest allowed fraction of the duration of a part in which the tip sticks.
const MOST_STUCK: f64 = 0.8;

/// Position noise below this value, m, is rounding error: it is far below the resolution of a camera.
const ROUNDING_M: f64 = 1e-12;

/// A part of the motion, with its name in the panels, and its start and end, s.
struct SheetSpan {
    name: String,
    from_s: f64,
    to_s: f64,
    /// Frequency of the cycles in the part, Hz.
    cycles_hz: Option<f64>,
}

/// The figure of a condition; `None` if the motion is too short.
pub(crate) fn figure_block(case: &ConditionComparison) -> Option<FigureBlock> {
    let spans = sheet_spans(case);
    let difference = choose_difference(case, &spans);
    let cycles: Vec<_> = spans.iter().map(|span| measure_cycle(case, (span.from_s, span.to_s))).collect();
    let parts = spans.iter().zip(&cycles).map(|(span, cycle)| StickSlipPart {
        measured_friction: cycle.as_ref().map_or_else(Vec::new, |cycle| cycle.states.clone()),
        ..build_part(case, span, difference)
    });
    let parts: Vec<StickSlipPart> = parts.filter(|part| !part.model.is_empty()).collect();
    let title = figure_title(parts.last()?)?;
    let inferred = case.restarted.is_some();
    let friction_label =
        if inferred { "friction, inferred with the model" } else { "friction, model" }.to_owned();
    let shown = StickSlipSheet {
        title: title.clone(),
        note: case.heading_note(""),
        synthetic: case.is_synthetic(),
        friction_label,
        parts,
    };
    let sd_n = cycles.iter().flatten().map(|cycle| cycle.sd_n).reduce(f64::max);
    let words = figure_text(case, &shown, &title, sd_n);
    Some(case.figure_block("stick-slip", words, draw_figure(&shown)))
}

/// Largest minus smallest velocity of a curve, m/s; `None` for a curve without a finite velocity.
fn velocity_range(curve: &VelocityCurve) -> Option<f64> {
    let velocities = || curve.iter().flatten().map(|(_, v)| *v).filter(|v| v.is_finite());
    velocities().reduce(f64::max).zip(velocities().reduce(f64::min)).map(|(high, low)| high - low)
}

/// Heading: the velocity range of a part.
fn figure_title(part: &StickSlipPart) -> Option<String> {
    let within = if part.name.starts_with(|c: char| c.is_ascii_digit()) { "in " } else { "" };
    let range = format_speed(velocity_range(&part.model)?);
    Some(format!("The tip swings through {range} {within}{}", part.name))
}

fn sheet_spans(case: &ConditionComparison) -> Vec<SheetSpan> {
    let shown = case.measured_or_model();
    let grid = shown.recording.grid();
    let start_s = shown.instant_s(InstantKind::Release).unwrap_or(grid.start_s);
    let last_s = grid.time_s(grid.frames.saturating_sub(1));
    let end_s = shown.instants.time_s(InstantKind::Hold, 2).unwrap_or(last_s);
    let sought_hz = || case.frequency_comparisons().map(|m| m.target.frequency_hz);
    let followed_hz = || case.ridges.measured.as_ref().or(case.ridges.model.as_ref())?.frequency_range_hz();
    let low_hz = sought_hz().reduce(f64::min);
    let high_hz = sought_hz().reduce(f64::max).or_else(|| followed_hz().map(|(_, high)| high));
    let first_s = low_hz.map_or(LONGEST_S, |hz| LOW_CYCLES / hz).min(LONGEST_S).min(end_s - start_s);
    let after =
        if shown.instant_s(InstantKind::Release).is_some() { "after the release" } else { "from the start" };
    let first = SheetSpan {
        name: format!("{} {after}", format_milliseconds(first_s)),
        from_s: start_s,
        to_s: start_s + first_s,
        cycles_hz: low_hz,
    };
    let late = high_hz.map(|hz| (hz, (HIGH_CYCLES / hz).min(LONGEST_S)));
    let late =
        late.filter(|(_, length_s)| end_s - length_s > start_s + first_s).and_then(|(hz, length_s)| {
            let rest_s = (start_s + first_s, end_s);
            let starts = |at_s: f64| (at_s - length_s / 2.0).clamp(rest_s.0, rest_s.1 - length_s);
            let of_head =
                peak_velocity(case, rest_s, |s| case.model.scene.drive.motion_at(s.time_s).velocity_m_per_s)?;
            // a tip that sticks there shows no cycles
            let rests = stick_duration_s(case, starts(of_head.0), length_s) > MOST_STUCK * length_s;
            let (whose, (at_s, _)) = if rests {
                ("tip", peak_velocity(case, rest_s, |s| s.tip_velocity_m_per_s)?)
            } else {
                ("head", of_head)
            };
            let from_s = starts(at_s);
            Some(SheetSpan {
                name: format!("{} at the {whose}'s top speed", format_milliseconds(length_s)),
                from_s,
                to_s: from_s + length_s,
                cycles_hz: Some(hz),
            })
        });
    std::iter::once(first).chain(late).filter(|span| span.to_s > span.from_s).collect()
}

/// Instant, s, and magnitude, m/s, of the largest velocity of the model between two instants.
fn peak_velocity(
    case: &ConditionComparison,
    (from_s, to_s): (f64, f64),
    velocity: impl Fn(&ModelSample) -> f64,
) -> Option<(f64, f64)> {
    let of = |s: &ModelSample| (s.time_s + case.alignment.shift_s, velocity(s).abs());
    let inside = case.model.motion.samples.iter().map(of).filter(|(t, _)| *t >= from_s && *t <= to_s);
    inside.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Total time, s, for which the tip sticks within `length_s` after an instant.
fn stick_duration_s(case: &ConditionComparison, from_s: f64, length_s: f64) -> f64 {
    let from_s = from_s - case.alignment.shift_s;
    let inside_s = |[start, end]: &[f64; 2]| (end.min(from_s + length_s) - start.max(from_s)).max(0.0);
    case.states.stick_s.iter().map(inside_s).sum()
}

/// The central difference that suits the noise of the recorded tip. The velocity range with which the noise
/// is compared is that of the model, since that of a recording would include noise. Of the parts, the one
/// with the smallest range counts.
fn choose_difference(case: &ConditionComparison, spans: &[SheetSpan]) -> CentralDifference {
    let rate_hz = case.measured_or_model().recording.grid().frame_rate_hz;
    let shortest = CentralDifference::of_neighbouring_frames(rate_hz);
    let noise_m = case.noise_m(Channel::TipX).filter(|noise_m| *noise_m > ROUNDING_M);
    let model = case.model_side();
    let range = |span: &SheetSpan| {
        velocity_range(&recorded_velocities(&model, model_clock_span(case, span), shortest, 0.0))
    };
    let range = spans.iter().filter_map(range).reduce(f64::min);
    let fastest_hz = spans.iter().filter_map(|span| span.cycles_hz).reduce(f64::max);
    noise_m.zip(range).map_or(shortest, |(noise_m, range)| {
        CentralDifference::for_noise(rate_hz, noise_m, range, fastest_hz)
    })
}

/// Start and end of a part on the model's clock, s.
fn model_clock_span(case: &ConditionComparison, span: &SheetSpan) -> (f64, f64) {
    (span.from_s - case.alignment.shift_s, span.to_s - case.alignment.shift_s)
}

fn build_part(case: &ConditionComparison, span: &SheetSpan, difference: CentralDifference) -> StickSlipPart {
    let span_s = (span.from_s, span.to_s);
    let measured = case.measured_side().map(|side| recorded_velocities(&side, span_s, difference, 0.0));
    let measured = measured.filter(|velocities| velocities.iter().any(Option::is_some));
    let (model_s, shift_s) = (model_clock_span(case, span), case.alignment.shift_s);
    let (mut model, mut friction, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    for states in case.states.states_between(model_s.into()) {
        let velocity = |s: &ModelSample| Some((s.time_s + shift_s, s.tip_velocity_m_per_s));
        match measured {
            Some(_) => model.extend(differenced_velocities(states, difference, shift_s)),
            None => model.extend(states.iter().map(velocity)),
        }
        friction.extend(states.iter().map(|s| Some(tip_friction(s))));
        normals.extend(states.iter().map(|s| s.normal_n));
        model.push(None);
        friction.push(None);
    }
    if !model.iter().any(Option::is_some) {
        model = recorded_velocities(&case.model_side(), model_s, difference, shift_s);
    }
    let frame_s = 1.0 / case.measured_or_model().recording.grid().frame_rate_hz;
    let mean_n = normals.iter().sum::<f64>() / normals.len().max(1) as f64;
    StickSlipPart {
        name: span.name.clone(),
        span_s,
        measured_friction: Vec::new(),
        law: law_curve(case, &friction, mean_n),
        measured: measured.unwrap_or_default(),
        sticks: history::stick_spans(&case.sticks_on_clock(), span_s, frame_s),
        model,
        friction,
    }
}

fn tip_friction(state: &ModelSample) -> TipFriction {
    TipFriction {
        velocity_m_per_s: state.tip_velocity_m_per_s,
        deflection_m: state.tip_x_m - state.head_x_m,
        friction_n: -state.friction_n,
    }
}

/// The friction law times a normal force, N, over the velocities of the given states: velocity, m/s, and
/// friction, N. Each direction of motion has its own branch, unless the tip hardly moves in it.
fn law_curve(
    case: &ConditionComparison,
    states: &[Option<TipFriction>],
    normal_n: f64,
) -> Vec<Option<(f64, f64)>> {
    const POINTS: usize = 60;
    const LEAST_SHARE: f64 = 0.02;
    let (low, high) = value_span(states.iter().flatten().map(|state| state.velocity_m_per_s));
    let law = case.model.scene.linkage.friction;
    let branch = |end: f64| {
        let point = move |i: usize| {
            let v = end * i as f64 / POINTS as f64;
            Some((v, normal_n * law.dynamic_coefficient(v.abs(), end.signum()) * end.signum()))
        };
        (0..=POINTS).map(point).chain([None])
    };
    let moves = |end: &f64| end.abs() > LEAST_SHARE * (high - low);
    [low.min(0.0), high.max(0.0)].into_iter().filter(moves).flat_map(branch).collect()
}

/// Velocities of the model from the same central difference as those of the recording, at the states of one
/// run; empty if the states are too far apart.
fn differenced_velocities(
    states: &[ModelSample],
    difference: CentralDifference,
    shift_s: f64,
) -> VelocityCurve {
    let half_s = difference.half_width_s();
    let [first, second, ..] = states else { return Vec::new() };
    if SAMPLES_APART * (second.time_s - first.time_s) > half_s {
        return Vec::new();
    }
    let place_m = |time_s: f64| {
        let next = states.partition_point(|s| s.time_s < time_s);
        let (a, b) = (states.get(next.checked_sub(1)?)?, states.get(next)?);
        let share = (time_s - a.time_s) / (b.time_s - a.time_s);
        Some(a.tip_x_m + share * (b.tip_x_m - a.tip_x_m))
    };
    let velocity = |s: &ModelSample| {
        let way_m = place_m(s.time_s + half_s)? - place_m(s.time_s - half_s)?;
        Some((s.time_s + shift_s, way_m / (2.0 * half_s)))
    };
    states.iter().map(velocity).collect()
}

/// Velocities of the tip in the frames of a recording; `shift_s` is added to the times.
fn recorded_velocities(
    side: &TimedRecording,
    span_s: (f64, f64),
    difference: CentralDifference,
    shift_s: f64,
) -> VelocityCurve {
    let (frames, grid) = (side.frames_between(span_s), side.recording.grid());
    let tip = side.samples(Channel::TipX);
    let found = difference.velocities(tip.get(frames.clone()).unwrap_or_default()).into_iter().enumerate();
    let time_s = |i: usize| grid.time_s(frames.start + difference.half_frames + i) + shift_s;
    found.map(|(i, v)| Some((time_s(i), v?))).collect()
}

/// Caption; `sd_n` is the largest standard deviation of the measured friction, N, if it was measured.
fn figure_text(
    case: &ConditionComparison,
    shown: &StickSlipSheet,
    title: &str,
    sd_n: Option<f64>,
) -> FigureText {
    let forces = shown.parts.last().into_iter().flat_map(|part| part.friction.iter().flatten());
    let (low, high) = value_span(forces.map(|state| MILLI * state.friction_n));
    let whose = if case.recording().is_some() { "" } else { " (model alone)" };
    let [low, high] = [low, high].map(|mn| format_digits(mn, 3));
    let caption = format!("{title}; the friction force on the tip lies between {low} and {high} mN{whose}.");
    let details = sd_n.map_or_else(String::new, |sd_n| {
        let sd = format_digits(MILLI * sd_n, 2);
        format!("The noise of the tip gives each measured friction a standard deviation of at most {sd} mN.")
    });
    FigureText { caption, details }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plain_charts::Medium;

    #[test]
    fn the_range_is_from_the_least_to_the_greatest_velocity() {
        let curve = vec![Some((0.0, -0.2)), None, Some((1.0, 0.3)), Some((1.0, 0.1))];
        assert_eq!([velocity_range(&curve), velocity_range(&vec![None])], [Some(0.5), None]);
    }

    #[test]
    fn measured_velocities_are_points_and_never_a_line() {
        let measured = |count: usize| {
            let measured = vec![Some((1e-3, 0.1)); count];
            let part = StickSlipPart { measured, span_s: (0.0, 1.0), ..StickSlipPart::default() };
            draw_figure(&StickSlipSheet { parts: vec![part], ..StickSlipSheet::default() }).panels[0].series
                [0]
            .mark
        };
        assert_eq!([measured(10), measured(200)], [Mark::Circles, Mark::Dots]);
    }

    #[test]
    fn parts_stand_side_by_side_and_what_was_not_measured_has_no_entry() {
        let state = |v: f64| Some(TipFriction { velocity_m_per_s: v, deflection_m: 1e-3, friction_n: 0.04 });
        let part = StickSlipPart {
            name: "late".to_owned(),
            span_s: (0.0, 1.0),
            model: vec![Some((0.1, 0.1)), Some((0.2, 0.2))],
            friction: vec![state(0.1), state(0.2)],
            ..StickSlipPart::default()
        };
        let drawn = draw_figure(&StickSlipSheet {
            parts: vec![part.clone(), part],
            synthetic: true,
            friction_label: "friction, model".to_owned(),
            ..StickSlipSheet::default()
        });
        assert_eq!((drawn.panels.len(), drawn.columns), (6, 2));
        assert_eq!(drawn.panels[2].series[0].points[1], Some((200.0, 40.0)));
        let svg = drawn.to_svg(Medium::Screen);
        assert!(
            svg.contains("synthetic recording") && svg.contains("\nmodel\n") && !svg.contains("\nmeasured\n")
        );
    }
}
