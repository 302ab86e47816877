//! Time histories: the whole and the release of the tip, with what lies between measurement and model.

use super::aims::looked;
use super::pair::{Pair, Side};
use crate::recording::Recording;
use crate::recording::channel::{Anchor, Channel};
use crate::recording::quality::noise_floor;
use crate::report::FigureBlock;
use crate::report::OPPOSED;
use crate::report::comparison::aligned::{Followed, is_tracked};
use crate::report::figure::history::{self, History, Motion, QUANTITIES};
use crate::simulate::Status;
use crate::simulate::mode::Mode;
use crate::text::{decimals, length, listed, milliseconds, percent, times};

/// How long before and after the tip's release the enlarged part lasts, s: a few cycles of the high
/// component.
const ZOOM_S: (f64, f64) = (0.005, 0.03);
/// Most turns of the head whose instants are marked: their labels stand side by side.
const MOST_TURNS: usize = 4;
/// Most windows that are drawn.
const MOST_WINDOWS: usize = 10;

/// The figures of the motion over time.
pub(super) fn blocks(pair: &Pair) -> Vec<FigureBlock> {
    let (history, left) = history(pair);
    let whole = pair.block("history", whole_caption(pair, &history, left.whole), history::figure(&history));
    let release = history::enlarged(&history)
        .map(|figure| pair.block("release", release_caption(pair, &history, left.enlarged), figure));
    std::iter::once(whole).chain(release).collect()
}

/// What is left between measurement and model, in words.
struct Left {
    whole: Option<String>,
    enlarged: Option<String>,
}

fn history(pair: &Pair) -> (History, Left) {
    let (aligned, shown) = (pair.aligned, pair.shown());
    let (grid, zoom_s) = (shown.recording.grid(), zoom_s(&shown));
    let whole_s = (grid.start_s, grid.time_s(grid.frames.saturating_sub(1)));
    let light = |motion| history::lightened(motion, whole_s, zoom_s);
    // one after the other: each is lighter before the next is made
    let residual = pair.recording().map(|r| residual(pair, r));
    let left = Left {
        whole: left(pair, residual.as_ref(), None),
        enlarged: zoom_s.and_then(|zoom_s| left(pair, residual.as_ref(), Some(zoom_s))),
    };
    let residual = residual.map(light);
    let measured = pair.recording().map(motion).map(light);
    let model = moved(
        motion(&pair.view().recording),
        &[aligned.along_m, aligned.along_m, 0.0, aligned.drop_m],
        aligned.shift_s,
    );
    let windows =
        windows(pair).into_iter().enumerate().map(|(i, (_, from, to))| ((i + 1).to_string(), from, to));
    let history = History {
        title: "Motion".to_owned(),
        synthetic: pair.synthetic(),
        measured,
        model: Some(light(model)),
        residual,
        stick_s: pair
            .view()
            .stick_s
            .iter()
            .map(|[from, to]| (from + aligned.shift_s, to + aligned.shift_s))
            .collect(),
        instants: instants(&shown),
        windows: windows.collect(),
        zoom_s,
    };
    (history, left)
}

/// The part that is enlarged, as far as there are frames.
fn zoom_s(shown: &Side) -> Option<(f64, f64)> {
    let (grid, release_s) = (shown.recording.grid(), shown.instant_s(Anchor::Release)?);
    Some((
        (release_s - ZOOM_S.0).max(grid.start_s),
        (release_s + ZOOM_S.1).min(grid.time_s(grid.frames.saturating_sub(1))),
    ))
}

fn motion(recording: &Recording) -> Motion {
    let grid = recording.grid();
    Motion {
        time_s: (0..grid.frames).map(|i| grid.time_s(i)).collect(),
        tip_x_m: Channel::TipX.samples(recording),
        head_x_m: Channel::HeadX.samples(recording),
        deflection_m: Channel::Deflection.samples(recording),
        head_drop_m: Channel::HeadDrop.samples(recording),
    }
}

/// A motion on another clock, each of its columns from another origin.
fn moved(mut motion: Motion, [tip_m, head_m, deflection_m, drop_m]: &[f64; 4], shift_s: f64) -> Motion {
    motion.time_s.iter_mut().for_each(|t| *t += shift_s);
    let columns = [
        (&mut motion.tip_x_m, tip_m),
        (&mut motion.head_x_m, head_m),
        (&mut motion.deflection_m, deflection_m),
        (&mut motion.head_drop_m, drop_m),
    ];
    for (column, by_m) in columns {
        column.iter_mut().flatten().for_each(|x| *x += by_m);
    }
    motion
}

/// Measured minus model, frame by frame of the recording; missing where either is.
fn residual(pair: &Pair, recording: &Recording) -> Motion {
    let (aligned, view, grid) = (pair.aligned, &pair.view().recording, recording.grid());
    let of = |of: Channel, by_m: f64| -> Vec<Option<f64>> {
        let model = of.samples(view);
        let at = |(i, measured): (usize, Option<f64>)| {
            Some(measured? - view.at(&model, grid.time_s(i) - aligned.shift_s)? - by_m)
        };
        of.samples(recording).into_iter().enumerate().map(at).collect()
    };
    Motion {
        time_s: (0..grid.frames).map(|i| grid.time_s(i)).collect(),
        tip_x_m: of(Channel::TipX, aligned.along_m),
        head_x_m: of(Channel::HeadX, aligned.along_m),
        deflection_m: of(Channel::Deflection, 0.0),
        head_drop_m: of(Channel::HeadDrop, aligned.drop_m),
    }
}

/// Instants of the first turns, or of the first alone where there are many.
fn instants(shown: &Side) -> Vec<(String, f64)> {
    let turns = shown.instants.reversals.len();
    let marked = if turns > MOST_TURNS { 1 } else { turns };
    let all = (1..=marked)
        .flat_map(|k| [Anchor::Hold, Anchor::Reversal, Anchor::Release].map(|anchor| (anchor, k)));
    let named = |(anchor, k): (Anchor, usize)| {
        let name = if turns > 1 { format!("{}[{k}]", anchor.name()) } else { anchor.name().to_owned() };
        shown.instants.time_s(anchor, k).ok().map(|t| (name, t))
    };
    all.filter_map(named).collect()
}

/// The windows of the fit on what is shown, in order of time, with what they serve; those that it does not
/// show are left out.
fn windows(pair: &Pair) -> Vec<(String, f64, f64)> {
    let (shown, grid) = (pair.shown(), pair.shown().recording.grid());
    let place = |l: &super::aims::Looked| {
        let frames = shown.frames(&l.window)?;
        let served = match l.aims.as_slice() {
            [first, _, _, ..] => format!("{} and {} more", first.feature.name, l.aims.len() - 1),
            _ => listed(&l.names()),
        };
        Some((
            format!("{served} ({})", l.channel.label()),
            grid.time_s(frames.start),
            grid.time_s(frames.end),
        ))
    };
    let mut found: Vec<_> = looked(pair.job, pair.condition).iter().filter_map(place).collect();
    found.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
    found.truncate(MOST_WINDOWS);
    found
}

fn whole_caption(pair: &Pair, history: &History, left: Option<String>) -> String {
    let mut said =
        vec![format!("Tip, head, deflection (tip minus head) and head drop over time: {}", seen(pair))];
    said.push(sticks(history));
    said.extend(flights(pair));
    said.extend(ended(pair));
    said.extend(released(pair));
    said.extend(left);
    if let Some(windows) = Some(windows(pair)).filter(|w| !w.is_empty()) {
        let named: Vec<String> =
            windows.iter().enumerate().map(|(i, (name, ..))| format!("{} {name}", i + 1)).collect();
        said.push(format!("Bars: windows that the fit read, {}.", named.join("; ")));
    }
    said.join(" ")
}

fn release_caption(pair: &Pair, history: &History, left: Option<String>) -> String {
    let around = history.zoom_s.zip(pair.shown().instant_s(Anchor::Release));
    let around = around.map_or_else(String::new, |((from, to), at)| {
        format!(", from {} before it to {} after it", milliseconds(at - from), milliseconds(to - at))
    });
    let mut said = vec![format!("The release of the tip{around}: {}", seen(pair))];
    if let Some(zoom_s) = history.zoom_s {
        let sticks = history.stick_s.iter().filter(|(from, to)| *to > zoom_s.0 && *from < zoom_s.1).count();
        said.push(match sticks {
            0 => "The model's tip does not stick in it.".to_owned(),
            sticks => format!("The model's tip is seen to stick {} in it.", times(sticks)),
        });
    }
    said.extend(left);
    said.join(" ")
}

/// What is drawn over what, and how it was brought there.
fn seen(pair: &Pair) -> String {
    if pair.recording().is_none() {
        return format!("{}.", pair.source());
    }
    let aligned = pair.aligned;
    if aligned.opposed {
        return format!(
            "{} against the fitted model seen by the same camera, together at the turn of the head. {OPPOSED}.",
            pair.source()
        );
    }
    let Some(shift_sd_s) = aligned.shift_sd_s else {
        return format!(
            "{} against the fitted model seen by the same camera, each on its own clock: they show no path in common.",
            pair.source()
        );
    };
    let headless = if aligned.by == Followed::Tip { ", as no head was tracked" } else { "" };
    let has_drop = pair.recording().is_some_and(|r| is_tracked(&r.traces().head_y_m));
    let drop =
        if has_drop { format!(", the head drop by {}", length(aligned.drop_m)) } else { String::new() };
    format!(
        "{} against the fitted model seen by the same camera. The model's clock and origin are those that bring its {} closest to the recorded one \
         (least squares{headless}): its clock is moved by {}{}, head and tip by {} along the sweep{drop}.",
        pair.source(),
        aligned.by.name(),
        milliseconds(aligned.shift_s),
        uncertain(pair, shift_sd_s),
        length(aligned.along_m),
    )
}

/// What is said of a clock that the path does not fix to half a frame.
fn uncertain(pair: &Pair, shift_sd_s: f64) -> String {
    let frame_s = 1.0 / pair.shown().recording.grid().frame_rate_hz;
    match shift_sd_s {
        sd if sd < 0.5 * frame_s => String::new(),
        sd if sd.is_finite() => format!(
            " (give or take {}, one standard deviation: its speed changes too little to say more)",
            milliseconds(sd)
        ),
        _ => " (which a path of constant speed does not fix)".to_owned(),
    }
}

/// How often and how long the model's tip sticks in what is shown.
fn sticks(history: &History) -> String {
    let seen = history
        .measured
        .as_ref()
        .or(history.model.as_ref())
        .and_then(|m| Some((*m.time_s.first()?, *m.time_s.last()?)));
    let (from_s, to_s) = seen.unwrap_or_default();
    let seen_s: Vec<f64> = history
        .stick_s
        .iter()
        .map(|(from, to)| to.min(to_s) - from.max(from_s))
        .filter(|s| *s > 0.0)
        .collect();
    if seen_s.is_empty() {
        let never = history.stick_s.is_empty();
        return if never {
            "The model's tip never sticks."
        } else {
            "The model's tip does not stick in what is shown."
        }
        .to_owned();
    }
    let share = seen_s.iter().sum::<f64>() / (to_s - from_s).max(f64::MIN_POSITIVE);
    format!(
        "Shaded: the model's tip sticks {}, {} of the time; cycles too short to be told apart are one band.",
        times(seen_s.len()),
        percent(share)
    )
}

/// How often the model's tip leaves the glass in its run, where it does.
fn flights(pair: &Pair) -> Option<String> {
    let count = pair
        .best
        .motion
        .transitions
        .iter()
        .filter(|t| t.from != Mode::Flight && t.to == Mode::Flight)
        .count();
    (count > 0).then(|| format!("In its whole run it leaves the glass {}.", times(count)))
}

/// How the model's run ended, where that was before its time.
fn ended(pair: &Pair) -> Option<String> {
    let run = &pair.best.motion.run;
    let at = decimals(run.stopped_at_s + pair.aligned.shift_s, 4);
    (run.status != Status::Completed)
        .then(|| format!("The model's run ended early, at {at} s: {}.", run.status.meaning()))
}

/// When the tip is released, in both.
fn released(pair: &Pair) -> Option<String> {
    let after_s = |side: &Side| Some(side.instant_s(Anchor::Release)? - side.instant_s(Anchor::Reversal)?);
    let model_s = after_s(&pair.model_side());
    let Some(side) = pair.measured_side() else {
        return Some(format!("The tip is released {} the head turns.", beside_turn(model_s?)));
    };
    let measured_s = after_s(&side)?;
    let same_side = |s: f64| if s < 0.0 || measured_s < 0.0 { beside_turn(s) } else { milliseconds(s) };
    let model = model_s.map_or_else(
        || "the model's is not".to_owned(),
        |s| format!("model, without tracking noise: {}", same_side(s)),
    );
    Some(format!("The tip is released {} the head turns ({model}).", beside_turn(measured_s)))
}

/// "4.2 ms after" or "4.2 ms before" the turn of the head.
fn beside_turn(after_s: f64) -> String {
    format!("{} {}", milliseconds(after_s.abs()), if after_s < 0.0 { "before" } else { "after" })
}

/// Root mean square of what is left, beside the noise of the tracking.
fn left(pair: &Pair, residual: Option<&Motion>, within_s: Option<(f64, f64)>) -> Option<String> {
    let (residual, recording) = (residual?, pair.recording()?);
    let inside = |t: f64| within_s.is_none_or(|(from, to)| t >= from && t <= to);
    let one = |(name, column): &history::Quantity| {
        let squares: Vec<f64> = residual
            .time_s
            .iter()
            .zip(column(residual))
            .filter(|(t, _)| inside(**t))
            .filter_map(|(_, x)| x.map(|x| x * x))
            .collect();
        let rms_m = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        (!squares.is_empty()).then(|| format!("{} ({name})", length(rms_m)))
    };
    let rms: Vec<String> = QUANTITIES.iter().filter_map(one).collect();
    let noise = noise_floor(&recording.traces().head_x_m)
        .map_or_else(String::new, |m| format!("; the tracking noise of the head is {}", length(m)));
    (!rms.is_empty()).then(|| format!("Root mean square of measured minus model: {}{noise}.", listed(&rms)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_release_is_before_or_after_the_turn_and_no_time_is_negative() {
        assert_eq!([beside_turn(0.0661), beside_turn(-0.0482)], ["66.1 ms after", "48.2 ms before"]);
    }

    #[test]
    fn a_tip_that_sticks_outside_what_is_shown_is_not_said_never_to_stick() {
        let shown = |stick_s: Vec<(f64, f64)>| {
            let measured = Some(Motion { time_s: vec![1.0, 1.1], ..Motion::default() });
            sticks(&History { measured, stick_s, ..History::default() })
        };
        assert_eq!(shown(vec![(0.2, 0.3)]), "The model's tip does not stick in what is shown.");
        assert_eq!(shown(Vec::new()), "The model's tip never sticks.");
        assert!(shown(vec![(1.0, 1.01)]).contains("sticks once, 10 % of the time"));
    }
}
