//! Phase portraits: after the release of the tip, and where the head is fastest, or the tip, if it rests
//! there.

use super::{
    CentralDifference, MAX_VELOCITY_NOISE, PhasePoint, PhasePortrait, PortraitPart, draw_figure,
    swing_m_per_s,
};
use crate::compare::{ConditionComparison, TimedRecording};
use crate::figures::{FigureBlock, Words};
use crate::recording::channel::{Channel, InstantKind};
use crate::recording::quality::noise_floor;
use crate::simulate::ModelSample;
use crate::text::{format_digits, format_milliseconds, format_percent, format_speed, join_with_and};

/// Cycles that stay readable over each other: of the low component, which move on, and of the high one, which
/// repeat.
const LOW_CYCLES: f64 = 3.0;
const HIGH_CYCLES: f64 = 12.0;
/// Longest part, s, and its length where no frequency is known: some tens of cycles of the high component at
/// most.
const LONGEST_S: f64 = 0.06;
/// Fewest samples of the model between a place and the one that its velocity is taken from, so that a
/// straight line from sample to sample is its path.
const SAMPLES_APART: f64 = 2.0;
/// Share of a part in which the tip may stick.
const MOST_STUCK: f64 = 0.8;

/// Less noise than this is the rounding of numbers, m: far below what any camera tells apart.
const ROUNDING_M: f64 = 1e-12;

/// A part of the shown motion: its name for the panel and for the caption, from when to when, s.
struct PortraitSpan {
    name: String,
    said: String,
    from_s: f64,
    to_s: f64,
    /// Frequency of its cycles, Hz.
    cycles_hz: Option<f64>,
}

/// The figure; none where the motion is too short.
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

/// The claim with its number: how far the velocity swings in the last part.
fn figure_title(parts: &[PortraitPart]) -> String {
    let last = parts.last().and_then(|part| Some((&part.name, swing_m_per_s(&part.model)?)));
    last.map_or_else(
        || "The model shows no velocity".to_owned(),
        |(name, swing)| {
            let name = if name.starts_with(|c: char| c.is_ascii_digit()) {
                format!("in {name}")
            } else {
                name.clone()
            };
            format!("The tip swings through {} {name}", format_speed(swing))
        },
    )
}

fn portrait_spans(case: &ConditionComparison) -> Vec<PortraitSpan> {
    let shown = case.measured_or_model();
    let grid = shown.recording.grid();
    let start_s = shown.instant_s(InstantKind::Release).unwrap_or(grid.start_s);
    let last_s = grid.time_s(grid.frames.saturating_sub(1));
    let end_s = shown.instants.time_s(InstantKind::Hold, 2).unwrap_or(last_s);
    let low_hz = case.frequency_comparisons().map(|m| m.target.frequency_hz).reduce(f64::min);
    let high_hz = case.frequency_comparisons().map(|m| m.target.frequency_hz).reduce(f64::max);
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
    let late = high_hz
        .map(|hz| (hz, (HIGH_CYCLES / hz).min(LONGEST_S)))
        .filter(|(_, length_s)| end_s - length_s > start_s + first_s);
    let late = late.and_then(|(hz, length_s)| {
        let rest_s = (start_s + first_s, end_s);
        let starts = |at_s: f64| (at_s - length_s / 2.0).clamp(rest_s.0, rest_s.1 - length_s);
        let of_head =
            peak_velocity(case, rest_s, |s| case.model.scene.drive.motion_at(s.time_s).velocity_m_per_s)?;
        // a tip that rests there shows no cycles
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

/// When a velocity of the model is greatest between two times of what is shown, s, and how great, m/s.
fn peak_velocity(
    case: &ConditionComparison,
    (from_s, to_s): (f64, f64),
    velocity: impl Fn(&ModelSample) -> f64,
) -> Option<(f64, f64)> {
    let of = |s: &ModelSample| (s.time_s + case.alignment.shift_s, velocity(s).abs());
    let inside = case.model.motion.samples.iter().map(of).filter(|(t, _)| *t >= from_s && *t <= to_s);
    inside.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// For how long the model's tip sticks from a time of what is shown on, s.
fn stick_duration_s(case: &ConditionComparison, from_s: f64, length_s: f64) -> f64 {
    let from_s = from_s - case.alignment.shift_s;
    case.model
        .motion
        .stick_s
        .iter()
        .map(|[start, end]| (end.min(from_s + length_s) - start.max(from_s)).max(0.0))
        .sum()
}

/// How the velocities of both sides are taken, and what that rests on.
struct VelocityEstimate {
    difference: CentralDifference,
    /// Noise of the recorded tip, m.
    noise_m: Option<f64>,
    /// Least swing of the model's velocity in a part, m/s: that of a recording holds its noise.
    swing_m_per_s: Option<f64>,
    fastest_hz: Option<f64>,
}

fn estimate_velocities(case: &ConditionComparison, spans: &[PortraitSpan]) -> VelocityEstimate {
    let rate_hz = case.measured_or_model().recording.grid().frame_rate_hz;
    let noise_m = case
        .recording()
        .and_then(|recording| noise_floor(&recording.traces().tip_x_m))
        .filter(|noise_m| *noise_m > ROUNDING_M);
    let swing = |span: &PortraitSpan| {
        swing_m_per_s(&recorded_states(
            &case.model_side(),
            model_clock_span(case, span),
            CentralDifference::of_neighbouring_frames(rate_hz),
        ))
    };
    let swing_m_per_s = spans.iter().filter_map(swing).reduce(f64::min);
    let fastest_hz = spans.iter().filter_map(|span| span.cycles_hz).reduce(f64::max);
    let known = noise_m.zip(swing_m_per_s);
    let difference = known.map_or(CentralDifference::of_neighbouring_frames(rate_hz), |(noise_m, swing)| {
        CentralDifference::for_noise(rate_hz, noise_m, swing, fastest_hz)
    });
    VelocityEstimate { difference, noise_m, swing_m_per_s, fastest_hz }
}

/// When a part is on the model's clock, s.
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
    let model = match &measured {
        Some(_) => differenced_states(case, model_clock_span(case, span), difference)
            .unwrap_or_else(|| recorded_states(&case.model_side(), model_clock_span(case, span), difference)),
        None => model_states(case, model_clock_span(case, span)),
    };
    PortraitPart { name: span.name.clone(), measured: measured.unwrap_or_default(), model }
}

/// States of the model with velocities that are the same difference of its path as those of the recording, at
/// every sample instead of every frame; `None` where its samples are too far apart for that.
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

/// States of the model itself.
fn model_states(case: &ConditionComparison, (from_s, to_s): (f64, f64)) -> Vec<PhasePoint> {
    let state = |s: &ModelSample| Some((s.tip_x_m - s.head_x_m, s.tip_velocity_m_per_s));
    case.model.motion.fine_samples_between([from_s, to_s]).iter().map(state).collect()
}

/// States as the frames of a camera give them.
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
) -> Words {
    let said: Vec<String> = spans.iter().map(|span| span.said.clone()).collect();
    let source = match case.recording() {
        Some(_) if !measured => format!(
            "the fitted model alone, as {} shows no velocity with its deflection there",
            case.source_name()
        ),
        _ => case.source_name(),
    };
    let details = format!("Velocity of the tip over deflection in {}: {source}", join_with_and(&said));
    let details = match case.recording().filter(|_| measured) {
        Some(_) => format!("{details} and the fitted model through the same camera. {}", taken.describe()),
        None => format!("{details}; its own states, with no camera between."),
    };
    let whose = if measured {
        format!("{} over the fitted model", case.source_kind())
    } else {
        "the fitted model alone".to_owned()
    };
    let caption = format!(
        "Velocity of the tip over deflection, {whose}: every loop is a cycle, and loops that lie over each \
         other repeat."
    );
    Words { caption, details }
}

impl VelocityEstimate {
    /// How the velocities were taken, and how far the noise moves them.
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
            let why = match self.fastest_hz {
                Some(_) => "a longer difference would be quieter, but not follow the fastest component",
                None => {
                    "a longer difference would be quieter, but no frequency is known that it has to follow"
                }
            };
            if noise > MAX_VELOCITY_NOISE * swing {
                format!("{share}, which is more than {}: {why}", format_percent(MAX_VELOCITY_NOISE))
            } else {
                share
            }
        });
        format!(
            "; the tracking noise of the recorded tip makes that uncertain by {} (one standard \
             deviation){of_swing}",
            format_speed(noise)
        )
    }
}
