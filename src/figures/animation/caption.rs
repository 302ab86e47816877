//! The animation of a condition: the model's reversal in fine steps, with what was measured on the same
//! clock.

use super::pace::PlaybackPace;
use super::{Animation, TrackedMotion, describe_pace, render_svg};
use crate::compare::ConditionComparison;
use crate::figures::{Drawing, FigureBlock, Words};
use crate::recording::Recording;
use crate::recording::alignment::Alignment;
use crate::recording::alignment::is_tracked;
use crate::recording::channel::Channel;
use crate::simulate::ModelSample;
use crate::simulate::RunMotion;
use crate::simulate::mode::TipMode;
use crate::text::format_decimals;

/// Most states over what is shown: some twenty-five in a cycle of 1 kHz over the tenth of a second that a
/// reversal and its release take.
const MOST_SAMPLES: usize = 2500;

/// The animation; none of a model whose tip never sticks.
pub(crate) fn figure_block(case: &ConditionComparison) -> Option<FigureBlock> {
    let shown = build_animation(case)?;
    let drawing = Drawing::Moving(render_svg(&shown));
    Some(case.model_figure_block("animation", figure_text(&shown, case), drawing))
}

fn build_animation(case: &ConditionComparison) -> Option<Animation> {
    let (motion, shift) = (&case.model.motion, case.alignment.shift_s);
    let hold = motion.longest_stick_s()?;
    let pace =
        PlaybackPace::around_hold(hold, [motion.samples.first()?.time_s, motion.samples.last()?.time_s])?;
    let span = pace.span_s();
    let interval = |[from, to]: [f64; 2]| [from + shift, to + shift];
    let stick = motion.stick_s.iter().filter(|[from, to]| *to > span[0] && *from < span[1]);
    Some(Animation {
        title: case.figure_title(),
        synthetic: case.is_synthetic(),
        turns: motion.turn_s().is_some_and(|turn_s| turn_s >= span[0] && turn_s <= span[1]),
        linkage: motion.linkage,
        samples: thin_samples(motion, span, shift),
        modes: contact_modes(motion, span).into_iter().map(|(since, mode)| (since + shift, mode)).collect(),
        stick_s: stick.map(|s| interval(*s)).collect(),
        hold_s: interval(hold),
        measured: case
            .recording()
            .map(|recording| tracked_motion(recording, &case.alignment, span.map(|t| t + shift))),
        pace: pace.shift_by(shift),
    })
}

/// The states of a span from its first to its last, on a clock that is this far ahead.
fn thin_samples(motion: &RunMotion, span_s: [f64; 2], shift_s: f64) -> Vec<ModelSample> {
    let fine = motion.fine_samples_between(span_s);
    let every = fine.len().div_ceil(MOST_SAMPLES).max(1);
    let last = fine.last().filter(|_| !(fine.len() - 1).is_multiple_of(every));
    let chosen = fine.iter().step_by(every).chain(last);
    chosen.map(|s| ModelSample { time_s: s.time_s + shift_s, ..*s }).collect()
}

/// The frames of a span, with one more on either side, from the origin of the model.
fn tracked_motion(recording: &Recording, alignment: &Alignment, [from_s, to_s]: [f64; 2]) -> TrackedMotion {
    let grid = recording.grid();
    let place = |t: f64| ((t - grid.start_s) * grid.frame_rate_hz).clamp(0.0, grid.frames as f64);
    let frames = (place(from_s).floor() as usize)..(place(to_s).ceil() as usize + 1).min(grid.frames);
    let of = |channel: Channel, origin_m: f64| {
        let samples = channel.samples(recording);
        samples.get(frames.clone()).unwrap_or_default().iter().map(|x| x.map(|x| x - origin_m)).collect()
    };
    TrackedMotion {
        time_s: frames.clone().map(|i| grid.time_s(i)).collect(),
        tip_x_m: of(Channel::TipX, alignment.along_m),
        head_x_m: of(Channel::HeadX, alignment.along_m),
        head_drop_m: of(Channel::HeadDrop, alignment.drop_m),
    }
}

/// The mode at the start of a span, and every later one of it with its first instant.
fn contact_modes(motion: &RunMotion, [from_s, to_s]: [f64; 2]) -> Vec<(f64, TipMode)> {
    let first = motion.samples.iter().rfind(|s| s.time_s <= from_s).map(|s| (from_s, s.mode));
    let inside = motion.transitions.iter().filter(|t| t.time_s > from_s && t.time_s <= to_s);
    first.into_iter().chain(inside.map(|t| (t.time_s, t.to))).collect()
}

/// Which points of a recording are drawn, and how they came to their places.
fn describe_crosses(recording: &Recording, case: &ConditionComparison) -> String {
    let traces = recording.traces();
    let points =
        match (is_tracked(&traces.tip_x_m), is_tracked(&traces.head_x_m) && is_tracked(&traces.head_y_m)) {
            (true, false) => "tip",
            (false, true) => "head",
            _ => "tip and head",
        };
    let how = match case.alignment {
        Alignment { opposite_turn: true, .. } => {
            "brought together at the turn of the head, which turns the other way in the model".to_owned()
        }
        Alignment { followed, .. } => format!("aligned by the path of the {}", followed.name()),
    };
    format!(
        " Crosses: {points} of {}, clock and origin {how}; the tip's height is that of the glass.",
        case.source_name()
    )
}

/// What is shown, with the numbers of the hold.
fn figure_text(shown: &Animation, case: &ConditionComparison) -> Words {
    let [from_s, to_s] = shown.hold_s;
    let at = |time_s: f64| shown.samples.iter().rfind(|s| s.time_s <= time_s).or(shown.samples.first());
    let mm = |x: f64| format_decimals(1e3 * x, 2);
    let deflection = |s: &ModelSample| mm(s.tip_x_m - s.head_x_m);
    let held = at(from_s).zip(at(to_s)).map(|(from, to)| {
        let stuck = format!(
            "tip sticks for {:.1} ms while its head moves by {} mm",
            1e3 * (to_s - from_s),
            mm(to.head_x_m - from.head_x_m)
        );
        (stuck, format!(" and its deflection goes from {} to {} mm.", deflection(from), deflection(to)))
    });
    let points = case.recording().map_or_else(
        || " The model alone: no traces are published.".to_owned(),
        |r| describe_crosses(r, case),
    );
    let caption = match &held {
        Some((stuck, _)) => {
            format!("The fitted model in motion through {}, slowed down: the {stuck}.", shown.part_name())
        }
        None => format!("The fitted model in motion through {}, slowed down.", shown.part_name()),
    };
    let held = held.map_or_else(String::new, |(stuck, bends)| format!(" The model's {stuck}{bends}"));
    let details = format!(
        "Animation: the linkage of the fitted model through {}, its links to scale, {}; the size of the \
         head's block is no measurement. \
         Right: the tip enlarged, and its velocity, over the slowest part.{points}{held}",
        shown.part_name(),
        describe_pace(&shown.pace),
    );
    Words { caption, details }
}
