//! Time histories of a condition, with their caption.

use super::{TimeHistory, draw_figure, thin_frames};
use crate::compare::condition::{FitWindow, group_fit_windows};
use crate::compare::{ConditionComparison, TimedRecording};
use crate::figures::evidence::NOTHING_LEFT;
use crate::figures::{FigureBlock, FigureText, OPPOSED};
use crate::recording::channel::{Channel, InstantKind};
use crate::recording::motion_traces::MotionTraces;
use crate::simulate::RunStatus;
use crate::text::{
    capitalise, format_decimals, format_digits, format_length, format_percent, format_times, join_with_and,
};

/// If there are at most this many reversals, all are marked. Otherwise only the first is marked, since the
/// labels need room.
const MOST_TURNS: usize = 4;
/// Maximum number of windows drawn.
const MOST_WINDOWS: usize = 10;

/// The figure of a condition.
pub(crate) fn figure_block(case: &ConditionComparison) -> FigureBlock {
    let history = build_history(case);
    case.figure_block("history", figure_text(case, &history.title), draw_figure(&history))
}

fn build_history(case: &ConditionComparison) -> TimeHistory {
    let shown = case.measured_or_model();
    let grid = shown.recording.grid();
    let whole_s = (grid.start_s, grid.time_s(grid.frames.saturating_sub(1)));
    let light = |traces: MotionTraces| thin_frames(traces, whole_s);
    // the motions are thinned one after the other, so that only one full motion is in memory
    let measured = case.measured_motion.clone().map(light);
    let model = light(MotionTraces::from_model(&case.model.view.recording, &case.alignment));
    let windows = fit_window_spans(case).into_iter().enumerate();
    let windows = windows.map(|(i, (_, from, to))| ((i + 1).to_string(), from, to));
    TimeHistory {
        title: motion_title(case),
        synthetic: case.is_synthetic(),
        measured,
        model: Some(model),
        residual: case.residual.clone().map(light),
        stick_s: case.sticks_on_clock(),
        frame_s: 1.0 / grid.frame_rate_hz,
        instants: turn_instants(&shown),
        windows: windows.collect(),
    }
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
        Some((served, grid.time_s(frames.start), grid.time_s(frames.end)))
    };
    let mut found: Vec<_> = group_fit_windows(case.job, case.condition).iter().filter_map(place).collect();
    found.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
    found.truncate(MOST_WINDOWS);
    found
}

fn figure_text(case: &ConditionComparison, claim: &str) -> FigureText {
    let windows = fit_window_spans(case);
    let windows: Vec<String> =
        windows.iter().enumerate().map(|(i, (name, ..))| format!("{} {name}", i + 1)).collect();
    let bars = format!("Bars are windows of the fit: {}.", windows.join("; "));
    let opposed = case.alignment.opposite_turn.then(|| format!("{OPPOSED}."));
    let said = [opposed, describe_early_end(case), (!windows.is_empty()).then_some(bars)];
    let details = said.into_iter().flatten().collect::<Vec<_>>().join(" ");
    FigureText { caption: format!("{claim}."), details }
}

/// The main result in one sentence, with its number.
fn motion_title(case: &ConditionComparison) -> String {
    if case.alignment.opposite_turn {
        return "The recorded head turns the other way than the model's".to_owned();
    }
    let channels = [Channel::Deflection, Channel::TipX, Channel::HeadX];
    let rms =
        |residual: &MotionTraces| channels.into_iter().find_map(|of| Some((of, residual.rms_m(of, None)?)));
    let Some((of, rms_m)) = case.residual.as_ref().and_then(rms) else {
        let (stick_s, samples) = (&case.model.motion.stick_s, &case.model.motion.samples);
        let whole_s = samples.last().zip(samples.first()).map_or(0.0, |(b, a)| b.time_s - a.time_s);
        let stuck_s: f64 = stick_s.iter().map(|[from, to]| to - from).sum();
        let share = format_percent(stuck_s / whole_s.max(f64::MIN_POSITIVE));
        return if stick_s.is_empty() {
            "The model's tip never sticks: 0 % of the time".to_owned()
        } else {
            format!("The model's tip sticks {}, {share} of the time", format_times(stick_s.len()))
        };
    };
    let ratio = case.noise_m(of).map(|noise_m| rms_m / noise_m);
    let claim = match ratio {
        Some(ratio) if ratio <= NOTHING_LEFT => {
            format!("the model follows the {} to {}, within its noise", of.label(), format_length(rms_m))
        }
        Some(ratio) => format!(
            "the model misses the {} by {}, {} times the noise",
            of.label(),
            format_length(rms_m),
            format_digits(ratio, 2)
        ),
        None => format!("the model misses the {} by {}", of.label(), format_length(rms_m)),
    };
    if case.restarted.is_some() { format!("In one run {claim}") } else { capitalise(&claim) }
}

/// Sentence on a run that ended early.
fn describe_early_end(case: &ConditionComparison) -> Option<String> {
    let run = &case.model.motion.run;
    let at = format_decimals(run.stopped_at_s + case.alignment.shift_s, 4);
    (run.status != RunStatus::Completed)
        .then(|| format!("The model's run ended early, at {at} s: {}.", run.status.meaning()))
}
