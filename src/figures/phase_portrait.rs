//! Phase portraits: tip velocity against deflection, measured and of the model.

use super::{FigureBlock, FigureText};
use crate::compare::{ConditionComparison, TimedRecording};
use crate::figures::full_figure;
use crate::recording::channel::{Channel, InstantKind};
use crate::simulate::ModelSample;
use crate::text::{format_digits, format_milliseconds, format_percent, format_speed, join_with_and};
use plain_charts::{ChartAxis, Colour, Figure, Mark, Panel, Series, value_span};
use portable_math as math;

/// Deflection, m, and tip velocity, m/s; `None` interrupts the line.
pub(crate) type PhasePoint = Option<(f64, f64)>;

/// A part of the motion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PortraitPart {
    /// Title of the panel.
    pub name: String,
    /// Measured states in order of time; empty if there are none.
    pub measured: Vec<PhasePoint>,
    /// States of the model in order of time, close enough together for a line.
    pub model: Vec<PhasePoint>,
}

/// Data of a phase portrait.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PhasePortrait {
    /// Heading.
    pub title: String,
    /// Further text for the line under the heading; empty for none.
    pub note: String,
    /// Whether the measured motion is synthetic.
    pub synthetic: bool,
    /// The parts, side by side.
    pub parts: Vec<PortraitPart>,
}

/// Height of a panel, mm; with it, two panels side by side are square.
const HEIGHT_MM: f64 = 62.0;

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &PhasePortrait) -> Figure {
    Figure {
        columns: 2,
        ..full_figure(
            &shown.title,
            shown.synthetic,
            &shown.note,
            "Phase portrait: velocity of the tip over deflection.",
            shown.parts.iter().map(|part| draw_panel(part, frame_mark(&shown.parts))),
        )
    }
}

/// Maximum number of measured states of a part that are drawn as circles. If a part has more, all parts have
/// dots, which do not overlap in a narrow figure.
const MOST_CIRCLES: usize = 80;

/// Symbol of the measured states, the same in all parts. A line from frame to frame would mostly show the
/// noise of the velocity.
fn frame_mark(parts: &[PortraitPart]) -> Mark {
    let most = parts.iter().map(|part| part.measured.iter().flatten().count()).max();
    if most.is_none_or(|most| most <= MOST_CIRCLES) { Mark::Circles } else { Mark::Dots }
}

fn draw_panel(part: &PortraitPart, frames: Mark) -> Panel {
    let series = |label, colour, mark, points: &[PhasePoint]| {
        Series::new(label, colour, mark, points.iter().map(|p| p.map(|(x, v)| (x * 1e3, v * 1e3))))
    };
    let model = series("model", Colour::Vermilion, Mark::Line, &part.model);
    let measured = series("measured", Colour::Black, frames, &part.measured);
    let drawn = [model, measured].into_iter().filter(|s| !s.points.is_empty());
    let x = ChartAxis::linear("deflection, mm").with_ends(Some(deflection_limits_mm(part)));
    let y = ChartAxis::linear("tip velocity, mm/s");
    Panel { title: part.name.clone(), ..Panel::new(x, y, HEIGHT_MM, drawn) }
}

/// Ends of the deflection axis of a part, mm. Each part has its own limits, so that stacked panels share no
/// axis.
fn deflection_limits_mm(part: &PortraitPart) -> (f64, f64) {
    const AXIS_MARGIN: f64 = 0.05;
    // smallest allowed margin of the axis, as a fraction of the largest absolute value; a smaller margin
    // would be rounding error and too small for tick labels
    const LEAST_SPAN: f64 = 1e-4;
    let all = part.measured.iter().chain(&part.model).flatten().map(|(x, _)| x * 1e3);
    let (low, high) = value_span(all.filter(|x| x.is_finite()));
    let room = (AXIS_MARGIN * (high - low)).max(LEAST_SPAN * low.abs().max(high.abs()));
    (low - room, high + room)
}

/// Largest allowed ratio of the standard deviation of the velocity noise to the velocity range of a part.
/// With less noise than this, neighbouring cycles remain distinct.
pub(crate) const MAX_VELOCITY_NOISE: f64 = 0.1;
/// Longest time allowed between the two frames of a central difference, in periods of the fastest component.
/// A fifth of a period reduces the velocity amplitude by 6 %, in recording and model alike; at 900 Hz with 2
/// um of position noise, the velocity noise is 13 mm/s. With a twentieth of a period, the reduction would be
/// only 0.4 %, but the velocity noise 51 mm/s, a quarter of a typical velocity range.
const MAX_DIFFERENCE_PERIODS: f64 = 0.2;

/// Central difference: the velocity in a frame, from the positions in one frame before it and one equally far
/// after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CentralDifference {
    /// Number of frames from the middle frame to either of the two frames.
    pub half_frames: usize,
    /// Frame rate, 1/s.
    pub frame_rate_hz: f64,
}

impl CentralDifference {
    /// The central difference between the frames directly before and after.
    pub(crate) fn of_neighbouring_frames(frame_rate_hz: f64) -> Self {
        Self { half_frames: 1, frame_rate_hz }
    }

    /// The central difference over the shortest time for which the velocity noise is below
    /// [`MAX_VELOCITY_NOISE`] times the velocity range `swing_m_per_s`; `noise_m` is the standard deviation
    /// of the white position noise. The time between the two frames is at most a fifth of a period of
    /// `fastest_hz`, even if the noise is then larger. For an unknown `fastest_hz`, returns the difference
    /// between neighbouring frames.
    pub(crate) fn for_noise(rate_hz: f64, noise_m: f64, swing_m_per_s: f64, fastest_hz: Option<f64>) -> Self {
        let shortest = Self::of_neighbouring_frames(rate_hz);
        let least = (shortest.noise_m_per_s(noise_m) / (MAX_VELOCITY_NOISE * swing_m_per_s)).ceil();
        let quiet = if noise_m > 0.0 { least } else { 1.0 };
        let longest = fastest_hz.map_or(1.0, |hz| (MAX_DIFFERENCE_PERIODS * rate_hz / hz / 2.0).floor());
        Self { half_frames: quiet.min(longest).max(1.0) as usize, ..shortest }
    }

    /// Time between the two frames, s.
    pub(crate) fn frame_gap_s(&self) -> f64 {
        2.0 * self.half_frames as f64 / self.frame_rate_hz
    }

    /// Standard deviation, m/s, of the noise of the velocity: `sqrt(2)` times the standard deviation of the
    /// white position noise, m, divided by the time between the two frames, s.
    pub(crate) fn noise_m_per_s(&self, noise_m: f64) -> f64 {
        noise_m * std::f64::consts::SQRT_2 / self.frame_gap_s()
    }

    /// Ratio of the velocity amplitude that the central difference gives to the true amplitude, for an
    /// oscillation at the given frequency, Hz: `sin(x)/x`, where `x` is pi times the frequency times the time
    /// between the two frames.
    pub(crate) fn velocity_gain(&self, frequency_hz: f64) -> f64 {
        let x = std::f64::consts::PI * frequency_hz * self.frame_gap_s();
        if x > 0.0 { math::sin(x) / x } else { 1.0 }
    }

    /// Time from the middle frame to either of the two frames, s.
    pub(crate) fn half_width_s(&self) -> f64 {
        self.half_frames as f64 / self.frame_rate_hz
    }

    /// Deflection and tip velocity of each frame that has a frame `half_frames` before and after it; `None`
    /// if a value is missing.
    pub(crate) fn phase_points(
        &self,
        deflection_m: &[Option<f64>],
        tip_x_m: &[Option<f64>],
    ) -> Vec<PhasePoint> {
        let (half, apart_s) = (self.half_frames, self.frame_gap_s());
        let middle = |(deflection, tip): (&Option<f64>, &[Option<f64>])| {
            let (before, after) = (tip.first().copied().flatten()?, tip.last().copied().flatten()?);
            tip[half].and(deflection.map(|x| (x, (after - before) / apart_s)))
        };
        deflection_m.iter().skip(half).zip(tip_x_m.windows(2 * half + 1)).map(middle).collect()
    }
}

/// Largest minus smallest tip velocity, m/s, of the given states; `None` if there is no state.
pub(crate) fn swing_m_per_s(states: &[PhasePoint]) -> Option<f64> {
    let velocities = || states.iter().flatten().map(|(_, v)| *v).filter(|v| v.is_finite());
    velocities().reduce(f64::max).zip(velocities().reduce(f64::min)).map(|(high, low)| high - low)
}

// Parts of the portrait: one after the release, and one at the top speed of the head. If the tip sticks at
// that time, the second part is at the top speed of the tip.

/// Number of cycles of the low component that are drawn; few, since its loops shift from cycle to cycle.
const LOW_CYCLES: f64 = 3.0;
/// Number of cycles of the high component that are drawn; more, since its loops repeat.
const HIGH_CYCLES: f64 = 12.0;
/// Longest duration of a part, s: some tens of cycles of the high component. A part has this duration if no
/// frequency is known.
const LONGEST_S: f64 = 0.06;
/// Minimum number of samples of the model in the time from the middle frame of a central difference to either
/// of its two frames. Linear interpolation between them then follows the path of the model.
const SAMPLES_APART: f64 = 2.0;
/// Largest allowed fraction of the duration of a part in which the tip sticks.
const MOST_STUCK: f64 = 0.8;

/// Position noise below this value, m, is rounding error: it is far below the resolution of a camera.
const ROUNDING_M: f64 = 1e-12;

/// A part of the motion, with its name in the panel, its name in the caption, and its start and end, s.
struct PortraitSpan {
    name: String,
    said: String,
    from_s: f64,
    to_s: f64,
    /// Frequency of the cycles in the part, Hz.
    cycles_hz: Option<f64>,
}

/// The figure of a condition; empty if the motion is too short.
pub(crate) fn figure_blocks(case: &ConditionComparison) -> Vec<FigureBlock> {
    let spans = portrait_spans(case);
    let taken = estimate_velocities(case, &spans);
    let parts: Vec<PortraitPart> = spans
        .iter()
        .map(|span| build_part(case, span, taken.difference))
        .filter(|part| !part.model.is_empty())
        .collect();
    if parts.is_empty() {
        return Vec::new();
    }
    let measured = parts.iter().any(|part| !part.measured.is_empty());
    let figure = draw_figure(&PhasePortrait {
        title: figure_title(&parts),
        note: case.heading_note("phase portrait"),
        synthetic: case.is_synthetic(),
        parts,
    });
    vec![case.figure_block("phase-portrait", figure_text(case, &spans, &taken, measured), figure)]
}

/// Heading: the velocity range of the last part.
fn figure_title(parts: &[PortraitPart]) -> String {
    let last = parts.last().and_then(|part| Some((&part.name, swing_m_per_s(&part.model)?)));
    let Some((name, swing)) = last else { return "The model shows no velocity".to_owned() };
    let within = if name.starts_with(|c: char| c.is_ascii_digit()) { "in " } else { "" };
    format!("The tip swings through {} {within}{name}", format_speed(swing))
}

fn portrait_spans(case: &ConditionComparison) -> Vec<PortraitSpan> {
    let shown = case.measured_or_model();
    let grid = shown.recording.grid();
    let start_s = shown.instant_s(InstantKind::Release).unwrap_or(grid.start_s);
    let last_s = grid.time_s(grid.frames.saturating_sub(1));
    let end_s = shown.instants.time_s(InstantKind::Hold, 2).unwrap_or(last_s);
    let sought_hz = || case.frequency_comparisons().map(|m| m.target.frequency_hz);
    let (low_hz, high_hz) = (sought_hz().reduce(f64::min), sought_hz().reduce(f64::max));
    let first_s = low_hz.map_or(LONGEST_S, |hz| LOW_CYCLES / hz).min(LONGEST_S).min(end_s - start_s);
    let after =
        if shown.instant_s(InstantKind::Release).is_some() { "after the release" } else { "from the start" };
    let cycles = low_hz.map_or_else(String::new, |hz| {
        format!(" ({} cycles at {} Hz)", format_digits(first_s * hz, 2), format_digits(hz, 3))
    });
    let first = PortraitSpan {
        name: format!("{} {after}", format_milliseconds(first_s)),
        said: format!("the first {} {after}{cycles}", format_milliseconds(first_s)),
        from_s: start_s,
        to_s: start_s + first_s,
        cycles_hz: low_hz,
    };
    let late = high_hz.map(|hz| (hz, (HIGH_CYCLES / hz).min(LONGEST_S)));
    let late = late.filter(|(_, length_s)| end_s - length_s > start_s + first_s).and_then(|(hz, length_s)| {
        let rest_s = (start_s + first_s, end_s);
        let starts = |at_s: f64| (at_s - length_s / 2.0).clamp(rest_s.0, rest_s.1 - length_s);
        let of_head =
            peak_velocity(case, rest_s, |s| case.model.scene.drive.motion_at(s.time_s).velocity_m_per_s)?;
        // a tip that sticks there shows no cycles
        let rests = stick_duration_s(case, starts(of_head.0), length_s) > MOST_STUCK * length_s;
        let (whose, (at_s, top)) = if rests {
            ("tip", peak_velocity(case, rest_s, |s| s.tip_velocity_m_per_s)?)
        } else {
            ("head", of_head)
        };
        let from_s = starts(at_s);
        let (length, cycles) = (format_milliseconds(length_s), format_digits(length_s * hz, 2));
        Some(PortraitSpan {
            name: format!("{length} at the {whose}'s top speed"),
            said: format!(
                "{length} about the greatest speed of the model's {whose} ({} at {} s; {cycles} cycles at {} \
                 Hz)",
                format_speed(top),
                format_digits(at_s, 3),
                format_digits(hz, 3)
            ),
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
    case.model.motion.stick_s.iter().map(inside_s).sum()
}

/// The chosen central difference, and the values from which it was chosen.
struct VelocityEstimate {
    difference: CentralDifference,
    /// Standard deviation of the position noise of the recorded tip, m.
    noise_m: Option<f64>,
    /// Velocity range of the model, m/s, in the part in which it is smallest. The range in a recording would
    /// include noise.
    swing_m_per_s: Option<f64>,
    fastest_hz: Option<f64>,
}

fn estimate_velocities(case: &ConditionComparison, spans: &[PortraitSpan]) -> VelocityEstimate {
    let rate_hz = case.measured_or_model().recording.grid().frame_rate_hz;
    let shortest = CentralDifference::of_neighbouring_frames(rate_hz);
    let noise_m = case.noise_m(Channel::TipX);
    let noise_m = noise_m.filter(|noise_m| *noise_m > ROUNDING_M);
    let model = case.model_side();
    let swing =
        |span: &PortraitSpan| swing_m_per_s(&recorded_states(&model, model_clock_span(case, span), shortest));
    let swing_m_per_s = spans.iter().filter_map(swing).reduce(f64::min);
    let fastest_hz = spans.iter().filter_map(|span| span.cycles_hz).reduce(f64::max);
    let known = noise_m.zip(swing_m_per_s);
    let difference = known.map_or(shortest, |(noise_m, swing)| {
        CentralDifference::for_noise(rate_hz, noise_m, swing, fastest_hz)
    });
    VelocityEstimate { difference, noise_m, swing_m_per_s, fastest_hz }
}

/// Start and end of a part on the model's clock, s.
fn model_clock_span(case: &ConditionComparison, span: &PortraitSpan) -> (f64, f64) {
    (span.from_s - case.alignment.shift_s, span.to_s - case.alignment.shift_s)
}

fn build_part(
    case: &ConditionComparison,
    span: &PortraitSpan,
    difference: CentralDifference,
) -> PortraitPart {
    let measured =
        case.measured_side().map(|side| recorded_states(&side, (span.from_s, span.to_s), difference));
    let measured = measured.filter(|states| states.iter().any(Option::is_some));
    let model_s = model_clock_span(case, span);
    let state = |s: &ModelSample| Some((s.tip_x_m - s.head_x_m, s.tip_velocity_m_per_s));
    let model = match &measured {
        Some(_) => differenced_states(case, model_s, difference)
            .unwrap_or_else(|| recorded_states(&case.model_side(), model_s, difference)),
        None => case.model.motion.fine_samples_between(model_s.into()).iter().map(state).collect(),
    };
    PortraitPart { name: span.name.clone(), measured: measured.unwrap_or_default(), model }
}

/// States of the model at every sample. Their velocities come from the same central difference as those of
/// the recording. `None` if the samples are too far apart.
fn differenced_states(
    case: &ConditionComparison,
    (from_s, to_s): (f64, f64),
    difference: CentralDifference,
) -> Option<Vec<PhasePoint>> {
    let fine = &case.model.motion.fine;
    let half_s = difference.half_width_s();
    let [first, second, ..] = fine.as_slice() else { return None };
    if SAMPLES_APART * (second.time_s - first.time_s) > half_s {
        return None;
    }
    let place_m = |time_s: f64| {
        let next = fine.partition_point(|s| s.time_s < time_s);
        let (a, b) = (fine.get(next.checked_sub(1)?)?, fine.get(next)?);
        let share = (time_s - a.time_s) / (b.time_s - a.time_s);
        Some(a.tip_x_m + share * (b.tip_x_m - a.tip_x_m))
    };
    let state = |s: &ModelSample| {
        let way_m = place_m(s.time_s + half_s)? - place_m(s.time_s - half_s)?;
        Some((s.tip_x_m - s.head_x_m, way_m / (2.0 * half_s)))
    };
    Some(case.model.motion.fine_samples_between([from_s, to_s]).iter().map(state).collect())
}

/// States from the frames of a recording.
fn recorded_states(
    side: &TimedRecording,
    span_s: (f64, f64),
    difference: CentralDifference,
) -> Vec<PhasePoint> {
    let frames = side.frames_between(span_s);
    let (deflection, tip) = (side.samples(Channel::Deflection), side.samples(Channel::TipX));
    let part = |samples: &[Option<f64>]| samples.get(frames.clone()).unwrap_or_default().to_vec();
    difference.phase_points(&part(&deflection), &part(&tip))
}

fn figure_text(
    case: &ConditionComparison,
    spans: &[PortraitSpan],
    taken: &VelocityEstimate,
    measured: bool,
) -> FigureText {
    let said: Vec<String> = spans.iter().map(|span| span.said.clone()).collect();
    let mut source = case.source_name();
    if case.recording().is_some() && !measured {
        source = format!("the fitted model alone, as {source} shows no velocity with its deflection there");
    }
    let details = format!("Velocity of the tip over deflection in {}: {source}", join_with_and(&said));
    let details = match case.recording().filter(|_| measured) {
        Some(_) => format!("{details} and the fitted model through the same camera. {}", taken.describe()),
        None => format!("{details}; its own states, with no camera between."),
    };
    let alone = || "the fitted model alone".to_owned();
    let whose = if measured { format!("{} over the fitted model", case.source_kind()) } else { alone() };
    let caption = format!(
        "Velocity of the tip over deflection, {whose}: every loop is a cycle, and loops that lie over each \
         other repeat."
    );
    FigureText { caption, details }
}

impl VelocityEstimate {
    /// Sentences on the chosen central difference and on the velocity noise.
    fn describe(&self) -> String {
        let CentralDifference { half_frames, .. } = self.difference;
        let frames = if half_frames == 1 {
            "in the frames before and after".to_owned()
        } else {
            format!("{half_frames} frames before and after")
        };
        let passes = self.fastest_hz.map_or_else(String::new, |hz| {
            format!(
                ", which leaves {} of a velocity that swings at {} Hz",
                format_percent(self.difference.velocity_gain(hz)),
                format_digits(hz, 3)
            )
        });
        let apart_ms = format_digits(1e3 * self.difference.frame_gap_s(), 2);
        format!(
            "Both velocities are the difference of the tip's places {frames}, {apart_ms} ms apart{passes}{}.",
            self.describe_noise()
        )
    }

    fn describe_noise(&self) -> String {
        let Some(noise_m) = self.noise_m else { return String::new() };
        let noise = self.difference.noise_m_per_s(noise_m);
        let of_swing = self.swing_m_per_s.map_or_else(String::new, |swing| {
            let share = format!(", {} of the least of the model's swings", format_percent(noise / swing));
            if noise <= MAX_VELOCITY_NOISE * swing {
                return share;
            }
            let why = match self.fastest_hz {
                Some(_) => "not follow the fastest component",
                None => "no frequency is known that it has to follow",
            };
            let most = format_percent(MAX_VELOCITY_NOISE);
            format!("{share}, which is more than {most}: a longer difference would be quieter, but {why}")
        });
        format!(
            "; the tracking noise of the recorded tip makes that uncertain by {} (one standard \
             deviation){of_swing}",
            format_speed(noise)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plain_charts::Medium;

    #[test]
    fn the_velocity_is_the_central_difference_and_gaps_stay_gaps() {
        let tip: Vec<Option<f64>> = (0..8).map(|i| (i != 4).then(|| f64::from(i * i))).collect();
        let deflection: Vec<Option<f64>> = (0..8).map(|i| (i != 2).then(|| f64::from(i))).collect();
        let expected = [Some((1.0, 20.0)), None, None, Some((4.0, 80.0)), None, Some((6.0, 120.0))];
        let states = |half_frames, deflection: &[_], tip: &[_]| {
            CentralDifference { half_frames, frame_rate_hz: 10.0 }.phase_points(deflection, tip)
        };
        assert_eq!(states(1, &deflection, &tip)[..3], expected[..3]);
        assert_eq!(states(1, &deflection, &tip)[4..], expected[4..]);
        // the frame itself is missing, so it has no state, although its neighbours would give a velocity
        assert_eq!(states(1, &deflection, &tip)[3], None);
        assert_eq!(states(2, &deflection, &tip), [None, Some((3.0, 60.0)), None, Some((5.0, 100.0))]);
        assert_eq!(states(1, &[Some(0.0); 2], &[Some(0.0); 2]), []);
    }

    const FASTEST_HZ: f64 = 900.0;

    /// Positions, m, of a tip that oscillates with the given amplitude, m, with added white noise of the
    /// given standard deviation, m; and the exact velocities, m/s.
    fn swinging(rate_hz: f64, amplitude_m: f64, noise_m: f64, frames: u32) -> (Vec<Option<f64>>, Vec<f64>) {
        let mut state = 7_u64;
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt()
        };
        let angular = std::f64::consts::TAU * FASTEST_HZ;
        let phase = |i| angular * f64::from(i) / rate_hz;
        let tip = (0..frames).map(|i| Some(amplitude_m * phase(i).sin() + noise_m * draw())).collect();
        (tip, (0..frames).map(|i| amplitude_m * angular * phase(i).cos()).collect())
    }

    /// Root mean square, m/s, of the differenced velocities minus `share` times the exact velocities.
    fn off(difference: CentralDifference, tip: &[Option<f64>], exact: &[f64], share: f64) -> f64 {
        let found = difference.phase_points(tip, tip);
        let squares: Vec<f64> = found
            .iter()
            .flatten()
            .zip(&exact[difference.half_frames..])
            .map(|((_, v), e)| (v - share * e).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    #[test]
    fn a_sine_loses_what_the_difference_takes_and_the_longest_takes_little() {
        let (tip, exact) = swinging(2e5, 1e-4, 0.0, 2000);
        for half_frames in [1, 2, 5, 40] {
            let difference = CentralDifference { half_frames, frame_rate_hz: 2e5 };
            let error = off(difference, &tip, &exact, difference.velocity_gain(FASTEST_HZ));
            assert!(error < 1e-9, "{half_frames}: {error}");
        }
        let longest = CentralDifference::for_noise(2e5, 1.0, 1e-9, Some(FASTEST_HZ));
        assert!(
            longest.frame_gap_s() <= MAX_DIFFERENCE_PERIODS / FASTEST_HZ && longest.half_frames == 22,
            "{longest:?}"
        );
        assert!(longest.velocity_gain(FASTEST_HZ) > 0.935, "{}", longest.velocity_gain(FASTEST_HZ));
    }

    #[test]
    fn noise_is_kept_below_a_tenth_of_the_swing_by_the_shortest_difference_that_does() {
        const NOISE_M: f64 = 2e-6;
        for (rate_hz, half_frames) in [(5e3, 1), (4e4, 1), (1e5, 2), (2e5, 3)] {
            let (tip, exact) = swinging(rate_hz, 1e-4, NOISE_M, 40_000);
            let swing = 2.0 * exact[0];
            let chosen = CentralDifference::for_noise(rate_hz, NOISE_M, swing, Some(FASTEST_HZ));
            assert_eq!(chosen.half_frames, half_frames, "at {rate_hz} Hz");
            let noise = off(chosen, &tip, &exact, chosen.velocity_gain(FASTEST_HZ));
            assert!(
                (noise / chosen.noise_m_per_s(NOISE_M) - 1.0).abs() < 0.03
                    && noise < MAX_VELOCITY_NOISE * swing,
                "{noise} of {swing}"
            );
        }
        // with a velocity range of 0.1 m/s, every permitted difference gives too much noise, so the longest
        // permitted one is chosen
        let drowned = CentralDifference::for_noise(2e5, NOISE_M, 0.1, Some(FASTEST_HZ));
        assert_eq!(drowned.half_frames, 22);
        assert!(drowned.noise_m_per_s(NOISE_M) > MAX_VELOCITY_NOISE * 0.1);
        assert_eq!(CentralDifference::for_noise(2e5, NOISE_M, 0.1, None).half_frames, 1);
        assert_eq!(CentralDifference::for_noise(2e5, 0.0, 0.0, Some(FASTEST_HZ)).half_frames, 1);
    }

    #[test]
    fn the_swing_is_from_the_least_to_the_greatest_velocity() {
        assert_eq!(swing_m_per_s(&[Some((0.0, -0.2)), None, Some((1.0, 0.3)), Some((1.0, 0.1))]), Some(0.5));
        assert_eq!(swing_m_per_s(&[None]), None);
    }

    #[test]
    fn measured_states_are_points_and_never_a_line() {
        let measured = |count: usize| {
            let part = PortraitPart { measured: vec![Some((1e-3, 0.1)); count], ..PortraitPart::default() };
            draw_figure(&PhasePortrait { parts: vec![part], ..PhasePortrait::default() }).panels[0].series[0]
                .mark
        };
        assert_eq!([measured(10), measured(200)], [Mark::Circles, Mark::Dots]);
    }

    #[test]
    fn parts_stand_side_by_side_and_what_was_not_measured_has_no_entry() {
        let part = PortraitPart {
            name: "late".to_owned(),
            model: vec![Some((1e-3, 0.1)), Some((2e-3, 0.2))],
            ..PortraitPart::default()
        };
        let drawn = draw_figure(&PhasePortrait {
            parts: vec![part.clone(), part],
            synthetic: true,
            ..PhasePortrait::default()
        });
        assert_eq!((drawn.panels.len(), drawn.columns), (2, 2));
        assert_eq!(drawn.panels[0].series[0].mark, Mark::Line);
        let svg = drawn.to_svg(Medium::Screen);
        assert!(
            svg.contains("synthetic recording") && svg.contains("\nmodel\n") && !svg.contains("\nmeasured\n")
        );
    }
}
