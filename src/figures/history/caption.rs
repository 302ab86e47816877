//! Time histories of a condition, whole and at the release, with their captions.

use super::{TimeHistory, draw_enlarged, draw_figure, thin_frames};
use crate::compare::condition::{FitWindow, group_fit_windows};
use crate::compare::{ConditionComparison, TimedRecording};
use crate::feature::{Reading, ReversalInterval};
use crate::figures::{FigureBlock, FigureText, OPPOSED};
use crate::recording::alignment::{AlignmentPoint, is_tracked};
use crate::recording::channel::{Channel, InstantKind};
use crate::recording::motion_traces::{MOTION_CHANNELS, MotionTraces};
use crate::simulate::RunStatus;
use crate::simulate::mode::TipMode;
use crate::text::{
    capitalise, format_decimals, format_digits, format_length, format_milliseconds, format_percent,
    format_times, join_with_and,
};

/// The enlarged part begins by the first time, s, before the release and ends by the second time, s, after
/// it; it shows a few cycles of the high component.
const ZOOM_S: (f64, f64) = (0.005, 0.03);
/// If there are at most this many reversals, all are marked. Otherwise only the first is marked, since the
/// labels need room.
const MOST_TURNS: usize = 4;
/// Maximum number of windows drawn.
const MOST_WINDOWS: usize = 10;

/// The figures of a condition: the whole motion and, if there is a release, the enlarged part around it.
pub(crate) fn figure_blocks(case: &ConditionComparison) -> Vec<FigureBlock> {
    let history = build_history(case);
    let whole = case.figure_block("history", whole_text(case, &history), draw_figure(&history));
    let part = draw_enlarged(&history)
        .map(|figure| case.figure_block("release", enlarged_text(case, &history), figure));
    std::iter::once(whole).chain(part).collect()
}

fn build_history(case: &ConditionComparison) -> TimeHistory {
    let shown = case.measured_or_model();
    let grid = shown.recording.grid();
    let whole_s = (grid.start_s, grid.time_s(grid.frames.saturating_sub(1)));
    let zoom_s = release_s(&shown);
    let light = |traces: MotionTraces| thin_frames(traces, whole_s, zoom_s);
    // the motions are thinned one after the other, so that only one full motion is in memory
    let measured = case.measured_motion.clone().map(light);
    let model = light(MotionTraces::from_model(&case.model.view.recording, &case.alignment));
    let windows = fit_window_spans(case).into_iter().enumerate();
    let windows = windows.map(|(i, (_, from, to))| ((i + 1).to_string(), from, to));
    TimeHistory {
        title: motion_title(case),
        enlarged_title: enlarged_title(&shown),
        synthetic: case.is_synthetic(),
        measured,
        model: Some(model),
        residual: case.residual.clone().map(light),
        stick_s: case.sticks_on_clock(),
        instants: turn_instants(&shown),
        windows: windows.collect(),
        zoom_s,
    }
}

/// Time interval, s, from shortly before to shortly after the release of the tip, limited to the recording.
fn release_s(shown: &TimedRecording) -> Option<(f64, f64)> {
    let (grid, release_s) = (shown.recording.grid(), shown.instant_s(InstantKind::Release)?);
    let last_s = grid.time_s(grid.frames.saturating_sub(1));
    Some(((release_s - ZOOM_S.0).max(grid.start_s), (release_s + ZOOM_S.1).min(last_s)))
}

/// Named instants of the reversals; only those of the first reversal if there are more than [`MOST_TURNS`].
fn turn_instants(shown: &TimedRecording) -> Vec<(String, f64)> {
    let turns = shown.instants.reversals.len();
    let marked = if turns > MOST_TURNS { 1 } else { turns };
    let all = (1..=marked).flat_map(|k| {
        [InstantKind::Hold, InstantKind::Reversal, InstantKind::Release].map(|anchor| (anchor, k))
    });
    let named = |(anchor, k): (InstantKind, usize)| {
        let name = if turns > 1 { format!("{}[{k}]", anchor.name()) } else { anchor.name().to_owned() };
        shown.instants.time_s(anchor, k).ok().map(|t| (name, t))
    };
    all.filter_map(named).collect()
}

/// The windows of the fit that the recording contains, in order of time: features, start, s, and end, s.
fn fit_window_spans(case: &ConditionComparison) -> Vec<(String, f64, f64)> {
    let (shown, grid) = (case.measured_or_model(), case.measured_or_model().recording.grid());
    let place = |l: &FitWindow| {
        let frames = shown.window_frames(&l.window)?;
        let served = match l.targets.as_slice() {
            [first, _, _, ..] => format!("{} and {} more", first.feature.name, l.targets.len() - 1),
            _ => join_with_and(&l.feature_names()),
        };
        let name = format!("{served} ({})", l.channel.label());
        Some((name, grid.time_s(frames.start), grid.time_s(frames.end)))
    };
    let mut found: Vec<_> = group_fit_windows(case.job, case.condition).iter().filter_map(place).collect();
    found.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
    found.truncate(MOST_WINDOWS);
    found
}

fn whole_text(case: &ConditionComparison, history: &TimeHistory) -> FigureText {
    let first =
        format!("Tip, head, deflection (tip minus head) and head drop over time: {}", describe_overlay(case));
    let said = [
        Some(first),
        Some(describe_sticks(history)),
        describe_flights(case),
        describe_early_end(case),
        describe_release(case),
    ];
    let mut details: Vec<String> = said.into_iter().flatten().chain(describe_residuals(case, None)).collect();
    let windows = fit_window_spans(case);
    let windows: Vec<String> =
        windows.iter().enumerate().map(|(i, (name, ..))| format!("{} {name}", i + 1)).collect();
    if !windows.is_empty() {
        details.push(format!("Bars: windows that the fit read, {}.", windows.join("; ")));
    }
    let agreement = describe_agreement(case, None);
    let caption = format!("Motion of tip and head over time, {}{agreement}.", whose_motion(case));
    FigureText { caption, details: details.join(" ") }
}

fn enlarged_text(case: &ConditionComparison, history: &TimeHistory) -> FigureText {
    let release_s = case.measured_or_model().instant_s(InstantKind::Release);
    let span = release_s.zip(history.zoom_s).map_or_else(String::new, |(at_s, (from_s, to_s))| {
        let [before, after] = [at_s - from_s, to_s - at_s].map(format_milliseconds);
        format!(", from {before} before it to {after} after it")
    });
    let mut details = vec![format!("The release of the tip{span}: {}", describe_overlay(case))];
    details.extend(history.zoom_s.map(|(from_s, to_s)| {
        let sticks = history.stick_s.iter().filter(|(from, to)| *to > from_s && *from < to_s).count();
        match sticks {
            0 => "The model's tip does not stick in it.".to_owned(),
            sticks => format!("The model's tip sticks {} in it.", format_times(sticks)),
        }
    }));
    details.extend(describe_residuals(case, history.zoom_s));
    let agreement = describe_agreement(case, history.zoom_s);
    let caption = format!("The release of the tip enlarged, {}{agreement}.", whose_motion(case));
    FigureText { caption, details: details.join(" ") }
}

/// Clause that names the drawn motions: the recording over the model, or the model without a recording.
fn whose_motion(case: &ConditionComparison) -> String {
    match case.recording() {
        Some(_) if case.restarted.is_some() => {
            format!("{} over one run of the fitted model", case.source_kind())
        }
        Some(_) => format!("{} over the fitted model", case.source_kind()),
        None => case.source_kind().to_owned(),
    }
}

/// The compared channel, the root mean square of its residual, m, and the ratio of that value to the root
/// mean square of the noise.
fn rms_difference(
    case: &ConditionComparison,
    within_s: Option<(f64, f64)>,
) -> Option<(Channel, f64, Option<f64>)> {
    let residual = case.residual.as_ref().filter(|_| !case.alignment.opposite_turn)?;
    let channels = [Channel::Deflection, Channel::TipX, Channel::HeadX];
    let (of, rms_m) = channels.into_iter().find_map(|of| Some((of, residual.rms_m(of, within_s)?)))?;
    Some((of, rms_m, case.noise_m(of).map(|noise_m| rms_m / noise_m)))
}

/// Clause on the misfit: "the model misses the deflection by 7.4 um, 2.6 times the noise".
fn describe_miss((of, rms_m, over_noise): (Channel, f64, Option<f64>)) -> String {
    let noise =
        over_noise.map_or_else(String::new, |ratio| format!(", {} times the noise", format_digits(ratio, 2)));
    format!("the model misses the {} by {}{noise}", of.label(), format_length(rms_m))
}

/// Heading of the whole motion.
fn motion_title(case: &ConditionComparison) -> String {
    match rms_difference(case, None) {
        Some(found) if case.restarted.is_some() => format!("In one run {}", describe_miss(found)),
        Some(found) => capitalise(&describe_miss(found)),
        None if case.alignment.opposite_turn => {
            "The recorded head turns the other way than the model's".into()
        }
        None => {
            let (stick_s, samples) = (&case.model.motion.stick_s, &case.model.motion.samples);
            let whole_s = samples.last().zip(samples.first()).map_or(0.0, |(b, a)| b.time_s - a.time_s);
            let stuck_s: f64 = stick_s.iter().map(|[from, to]| to - from).sum();
            let share = format_percent(stuck_s / whole_s.max(f64::MIN_POSITIVE));
            format!("The model's tip sticks {}, {share} of the time", format_times(stick_s.len()))
        }
    }
}

/// Heading of the enlarged part.
fn enlarged_title(shown: &TimedRecording) -> String {
    let after_s = shown.instant_s(InstantKind::Release).zip(shown.instant_s(InstantKind::Reversal));
    let when = after_s.map(|(release_s, turn_s)| format_turn_offset(release_s - turn_s));
    when.map_or("The tip is released".to_owned(), |when| format!("The tip is released {when} the head turns"))
}

/// Clause on the agreement of model and recording.
fn describe_agreement(case: &ConditionComparison, within_s: Option<(f64, f64)>) -> String {
    if case.residual.is_none() {
        return format!(": its tip sticks {}", format_times(case.model.motion.stick_s.len()));
    }
    if case.alignment.opposite_turn {
        return ": the recorded head turns the other way, so that nothing with a sign can agree".to_owned();
    }
    let Some((of, rms_m, over_noise)) = rms_difference(case, within_s) else { return String::new() };
    let noise = over_noise
        .map_or_else(String::new, |ratio| format!(", {} times the tracking noise", format_digits(ratio, 2)));
    format!(": they differ by {} in the {} (root mean square){noise}", format_length(rms_m), of.label())
}

/// Sentence on the drawn motions and their alignment.
fn describe_overlay(case: &ConditionComparison) -> String {
    let (source, alignment) = (case.source_name(), case.alignment);
    let Some(recording) = case.recording() else { return format!("{source}.") };
    let both = format!("{source} against the fitted model through the same camera");
    if alignment.opposite_turn {
        return format!("{both}, together at the turn of the head. {OPPOSED}.");
    }
    let Some(shift_sd_s) = alignment.shift_sd_s else {
        return format!("{both}, each on its own clock: they show no path in common.");
    };
    let headless = if alignment.followed == AlignmentPoint::Tip { ", as no head was tracked" } else { "" };
    let drop = Some(alignment.drop_m).filter(|_| is_tracked(&recording.traces().head_y_m));
    let drop = drop.map_or_else(String::new, |m| format!(", the head drop by {}", format_length(m)));
    format!(
        "{both}. The model's clock and origin are those that bring its {} closest to the recorded one \
         (least squares{headless}): its clock is moved by {}{}, head and tip by {} along the sweep{drop}.",
        alignment.followed.name(),
        format_milliseconds(alignment.shift_s),
        describe_clock_uncertainty(case, shift_sd_s),
        format_length(alignment.along_m),
    )
}

/// Clause on the uncertainty of the time shift between the clocks; empty if the uncertainty is below half a
/// frame.
fn describe_clock_uncertainty(case: &ConditionComparison, shift_sd_s: f64) -> String {
    let frame_s = 1.0 / case.measured_or_model().recording.grid().frame_rate_hz;
    match shift_sd_s {
        sd if sd < 0.5 * frame_s => String::new(),
        sd if sd.is_finite() => format!(
            " (give or take {}, one standard deviation: its speed changes too little to say more)",
            format_milliseconds(sd)
        ),
        _ => " (which a path of constant speed does not fix)".to_owned(),
    }
}

/// Sentence on the number and duration of the sticks that are shown.
fn describe_sticks(history: &TimeHistory) -> String {
    let shown = history.measured.as_ref().or(history.model.as_ref());
    let shown = shown.and_then(|m| Some((*m.time_s.first()?, *m.time_s.last()?)));
    let (from_s, to_s) = shown.unwrap_or_default();
    let stuck_s = history.stick_s.iter().map(|(from, to)| to.min(to_s) - from.max(from_s));
    let stuck_s: Vec<f64> = stuck_s.filter(|s| *s > 0.0).collect();
    if history.stick_s.is_empty() {
        return "The model's tip never sticks.".to_owned();
    }
    if stuck_s.is_empty() {
        return "The model's tip does not stick in what is shown.".to_owned();
    }
    let share = stuck_s.iter().sum::<f64>() / (to_s - from_s).max(f64::MIN_POSITIVE);
    format!(
        "Shaded: the model's tip sticks {}, {} of the time; cycles too short to stand apart are one band.",
        format_times(stuck_s.len()),
        format_percent(share)
    )
}

/// Sentence on the number of flights; `None` without one.
fn describe_flights(case: &ConditionComparison) -> Option<String> {
    let takes_off = |from: TipMode, to: TipMode| from != TipMode::Flight && to == TipMode::Flight;
    let count = case.model.motion.transitions.iter().filter(|t| takes_off(t.from, t.to)).count();
    (count > 0).then(|| format!("In its whole run it leaves the glass {}.", format_times(count)))
}

/// Sentence on a run that ended early.
fn describe_early_end(case: &ConditionComparison) -> Option<String> {
    let run = &case.model.motion.run;
    let at = format_decimals(run.stopped_at_s + case.alignment.shift_s, 4);
    (run.status != RunStatus::Completed)
        .then(|| format!("The model's run ended early, at {at} s: {}.", run.status.meaning()))
}

/// Sentence on the release. Its values are those of the fit, so that all pages agree; if the fit has no
/// feature for the release, they are measured in the recording or in the model.
fn describe_release(case: &ConditionComparison) -> Option<String> {
    const RELEASE: Reading =
        Reading::Interval { interval: ReversalInterval::ReleaseAfterReversal, reversal: 1 };
    let read = case.targets().find(|aim| aim.feature.reading == RELEASE);
    let all = || case.result.features.iter().chain(&case.result.held_out);
    let found = read.and_then(|aim| all().find(|feature| feature.name == aim.feature.name));
    let shown = case.measured_or_model();
    let own_s = || Some(shown.instant_s(InstantKind::Release)? - shown.instant_s(InstantKind::Reversal)?);
    let Some(found) = found else {
        return Some(format!("The tip is released {} the head turns.", format_turn_offset(own_s()?)));
    };
    let same_side =
        |s: f64| if s < 0.0 || found.target < 0.0 { format_turn_offset(s) } else { format_milliseconds(s) };
    let model =
        found.model.map_or_else(|| "the model's is not".to_owned(), |s| format!("model: {}", same_side(s)));
    Some(format!(
        "The tip is released {} the head turns ({model}): it has left its place by more than the noise, a little \
         after its longest stick ends.",
        format_turn_offset(found.target)
    ))
}

/// An instant relative to the turn of the head, in words: "4.2 ms after" or "4.2 ms before".
fn format_turn_offset(after_s: f64) -> String {
    format!("{} {}", format_milliseconds(after_s.abs()), if after_s < 0.0 { "before" } else { "after" })
}

/// Sentence on the residual of each channel and on the tracking noise.
fn describe_residuals(case: &ConditionComparison, within_s: Option<(f64, f64)>) -> Option<String> {
    let residual = case.residual.as_ref()?;
    let one = |channel: Channel| {
        Some(format!("{} ({})", format_length(residual.rms_m(channel, within_s)?), channel.label()))
    };
    let rms: Vec<String> = MOTION_CHANNELS.into_iter().filter_map(one).collect();
    let noise = |m: f64| format!("; the tracking noise of the head is {}", format_length(m));
    let noise = case.noise_m(Channel::HeadX).map_or_else(String::new, noise);
    (!rms.is_empty())
        .then(|| format!("Root mean square of measured minus model: {}{noise}.", join_with_and(&rms)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_release_is_before_or_after_the_turn_and_no_time_is_negative() {
        assert_eq!(
            [format_turn_offset(0.0661), format_turn_offset(-0.0482)],
            ["66.1 ms after", "48.2 ms before"]
        );
    }

    #[test]
    fn a_tip_that_sticks_outside_what_is_shown_is_not_said_never_to_stick() {
        let shown = |stick_s: Vec<(f64, f64)>| {
            let measured = Some(MotionTraces { time_s: vec![1.0, 1.1], ..MotionTraces::default() });
            describe_sticks(&TimeHistory { measured, stick_s, ..TimeHistory::default() })
        };
        assert_eq!(shown(vec![(0.2, 0.3)]), "The model's tip does not stick in what is shown.");
        assert_eq!(shown(Vec::new()), "The model's tip never sticks.");
        assert!(shown(vec![(1.0, 1.01)]).contains("sticks once, 10 % of the time"));
    }
}
