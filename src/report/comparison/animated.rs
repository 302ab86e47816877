//! The animation of a condition: the model's reversal sampled finely, with what was measured on the same
//! clock.

use super::Best;
use super::aligned::{Aligned, is_tracked};
use super::pair::Pair;
use crate::recording::Recording;
use crate::recording::channel::Channel;
use crate::report::figure::animation::pace::Pace;
use crate::report::figure::animation::{self, Animation, Tracked};
use crate::report::figure::poses::turn_s;
use crate::report::{Drawing, FigureBlock};
use crate::simulate::mode::Mode;
use crate::simulate::outputs::Sampler;
use crate::simulate::{Sample, run};
use crate::text::decimals;

/// States over what is shown: some twenty-five in a cycle of 1 kHz over the tenth of a second that a reversal
/// and its release take.
const SAMPLES: usize = 2500;

/// The animations, run by run; none of a model whose tip never sticks.
pub(super) fn blocks(pairs: &[Pair]) -> Vec<FigureBlock> {
    let block = |pair: &Pair| {
        let (shared, shown) = (pair.shared.as_deref()?, animation(pair)?);
        let drawing = Drawing::Moving(animation::svg(&shown));
        Some(FigureBlock {
            file: pair.file("animation"),
            caption: pair.captioned(format!("{}{shared}", caption(&shown, pair))),
            details: String::new(),
            drawing,
        })
    };
    pairs.iter().filter_map(block).collect()
}

fn animation(pair: &Pair) -> Option<Animation> {
    let (best, shift) = (pair.best, pair.aligned.shift_s);
    let known = &best.motion;
    let hold = known.stick_s.iter().copied().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
    let pace = Pace::around(hold, [known.samples.first()?.time_s, known.samples.last()?.time_s])?;
    let span = pace.span_s();
    let samples = sampled(best, span).into_iter().map(|s| Sample { time_s: s.time_s + shift, ..s });
    let interval = |[from, to]: [f64; 2]| [from + shift, to + shift];
    let stick = known.stick_s.iter().filter(|[from, to]| *to > span[0] && *from < span[1]);
    Some(Animation {
        title: pair.name(),
        synthetic: pair.synthetic(),
        turns: turn_s(known).is_some_and(|turn_s| turn_s >= span[0] && turn_s <= span[1]),
        linkage: known.linkage,
        samples: samples.collect(),
        modes: modes(best, span).into_iter().map(|(since, mode)| (since + shift, mode)).collect(),
        stick_s: stick.map(|s| interval(*s)).collect(),
        hold_s: interval(hold),
        measured: pair
            .recording()
            .map(|recording| tracked(recording, &pair.aligned, span.map(|t| t + shift))),
        pace: pace.later(shift),
    })
}

/// The frames of a span, with one more on either side, from the origin of the model.
fn tracked(recording: &Recording, aligned: &Aligned, [from_s, to_s]: [f64; 2]) -> Tracked {
    let grid = recording.grid();
    let place = |t: f64| ((t - grid.start_s) * grid.frame_rate_hz).clamp(0.0, grid.frames as f64);
    let frames = (place(from_s).floor() as usize)..(place(to_s).ceil() as usize + 1).min(grid.frames);
    let of = |channel: Channel, origin_m: f64| {
        let samples = channel.samples(recording);
        samples.get(frames.clone()).unwrap_or_default().iter().map(|x| x.map(|x| x - origin_m)).collect()
    };
    Tracked {
        time_s: frames.clone().map(|i| grid.time_s(i)).collect(),
        tip_x_m: of(Channel::TipX, aligned.along_m),
        head_x_m: of(Channel::HeadX, aligned.along_m),
        head_drop_m: of(Channel::HeadDrop, aligned.drop_m),
    }
}

/// The model over a span of its own time: run once more, as the span is known from the first run; that is a
/// hundredth of what a report takes.
fn sampled(best: &Best, [from_s, to_s]: [f64; 2]) -> Vec<Sample> {
    let times = (0..SAMPLES).map(|i| from_s + (to_s - from_s) * i as f64 / (SAMPLES - 1) as f64);
    let mut samples = Vec::with_capacity(SAMPLES);
    run(&best.scene, &mut Sampler::new(times, |sample: &Sample| samples.push(*sample)));
    samples
}

/// The mode at the start of a span, and every later one of it with its first instant.
fn modes(best: &Best, [from_s, to_s]: [f64; 2]) -> Vec<(f64, Mode)> {
    let first = best.motion.samples.iter().rfind(|s| s.time_s <= from_s).map(|s| (from_s, s.mode));
    let inside = best.motion.transitions.iter().filter(|t| t.time_s > from_s && t.time_s <= to_s);
    first.into_iter().chain(inside.map(|t| (t.time_s, t.to))).collect()
}

/// Which points of a recording are drawn, and how they came to their places.
fn crosses(recording: &Recording, pair: &Pair) -> String {
    let traces = recording.traces();
    let points =
        match (is_tracked(&traces.tip_x_m), is_tracked(&traces.head_x_m) && is_tracked(&traces.head_y_m)) {
            (true, false) => "tip",
            (false, true) => "head",
            _ => "tip and head",
        };
    let how = match pair.aligned {
        Aligned { opposed: true, .. } => {
            "brought together at the turn of the head, which turns the other way in the model".to_owned()
        }
        Aligned { by, .. } => format!("aligned by the path of the {}", by.name()),
    };
    format!(
        " Crosses: {points} of {}, clock and origin {how}; the tip's height is that of the glass.",
        pair.source()
    )
}

/// What is seen, with the numbers of the hold.
fn caption(shown: &Animation, pair: &Pair) -> String {
    let [from_s, to_s] = shown.hold_s;
    let at = |time_s: f64| shown.samples.iter().rfind(|s| s.time_s <= time_s).or(shown.samples.first());
    let held = at(from_s).zip(at(to_s)).map(|(from, to)| {
        let mm = |x: f64| decimals(1e3 * x, 2);
        let deflection = |s: &Sample| mm(s.tip_x_m - s.head_x_m);
        format!(
            " The model's tip sticks for {:.1} ms while its head moves by {} mm and its deflection goes from {} to {} mm.",
            1e3 * (to_s - from_s),
            mm(to.head_x_m - from.head_x_m),
            deflection(from),
            deflection(to)
        )
    });
    let points = pair.recording().map_or_else(
        || " The model alone: no traces are published.".to_owned(),
        |recording| crosses(recording, pair),
    );
    format!(
        "Animation: the linkage of the fitted model through {}, its links to scale, {}; the size of the head's block is no measurement. \
         Right: the tip enlarged, and its velocity, over the slowest part.{points}{}",
        shown.part(),
        animation::in_words(&shown.pace),
        held.unwrap_or_default()
    )
}
