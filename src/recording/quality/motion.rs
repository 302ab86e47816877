//! Checks of both points together: repeated frames, common frames, scale, direction of y, and the turns of
//! the head.

use super::finding::{Check, QualityFinding, Severity};
use super::measurement::{ChannelQuality, Quality, measured_columns};
use crate::recording::channel::ReversalInstants;
use crate::recording::{FrameGrid, Recording, Traces};
use std::f64::consts::PI;

/// Share of repeated frames from which frequencies are wrong rather than a few samples.
const MANY_REPEATED: f64 = 0.01;
/// Repeats that rounding alone may bring are beyond this many times their expected number, and this many
/// more.
const BY_ROUNDING: f64 = 3.0;
/// Expected number of repeats by rounding that is none.
const NO_REPEATS: f64 = 0.01;
/// Probability of a repeat by rounding from which repeats are not judged: noise below the step then rests for
/// frames on end.
const LIKELY_REPEAT: f64 = 1e-3;
/// Noise of a column that noise moves, m: below a picometre is the rounding of arithmetic on a point at rest.
const LEAST_NOISE_M: f64 = 1e-12;
/// Share of the frames that only one point may have at the ends before it is more than a late start of a
/// track.
const MANY_ALONE: f64 = 0.1;
/// Travel that no camera's view shows while it still resolves a lip, m: at 1,000 pixels a lip of 5 mm would
/// be 10 pixels high.
const LARGEST_VIEW_M: f64 = 0.5;
/// Travel beyond any wiper's sweep, m: the longest blades reach about 1.5 m along their arc.
const LARGEST_SWEEP_M: f64 = 2.0;
/// Travel below which nothing moved, m: five pixels of the usual 20 um.
const LEAST_TRAVEL_M: f64 = 1e-4;
/// Most positions looked at for a travel; a stroke is smooth on a thousandth of it.
const MOST_POSITIONS: usize = 20_000;
/// Share of positions at either end that do not count for a travel, so that outliers do not.
const TRIMMED: f64 = 0.01;
/// Distance between tip and head that is a blade's height and not two origins, m: neck and lip of a wiper are
/// some 5 to 10 mm high.
const LEAST_HEIGHT_M: f64 = 1e-3;

/// Everything that takes both points.
pub(super) fn check_motion(recording: &Recording, measured: &Quality) -> Vec<QualityFinding> {
    let (traces, grid) = (recording.traces(), recording.grid());
    let found = [
        check_repeated_frames(traces, measured),
        check_overlap(traces, grid),
        check_travel(traces),
        check_head_above_tip(traces),
    ];
    found.into_iter().flatten().collect()
}

/// Frames in which nothing has moved since the one before, where noise otherwise moves everything.
fn check_repeated_frames(traces: &Traces, measured: &Quality) -> Option<QualityFinding> {
    let by_chance = repeat_probability(traces, measured)?;
    let axes = [&traces.tip_x_m, &traces.tip_y_m, &traces.head_x_m, &traces.head_y_m];
    let still = |frame: usize| {
        let same = |axis: &Vec<Option<f64>>| axis[frame] == axis[frame - 1];
        let tracked = traces.tip_x_m[frame].is_some() && traces.head_x_m[frame].is_some();
        tracked && axes.into_iter().all(same)
    };
    let frames = traces.tip_x_m.len();
    let (count, first) = (1..frames)
        .filter(|&frame| still(frame))
        .fold((0_usize, None), |(n, first), frame| (n + 1, first.or(Some(frame))));
    let expected = by_chance * frames as f64;
    let allowed = if expected < NO_REPEATS { 0.0 } else { BY_ROUNDING * (1.0 + expected) };
    let first = first.filter(|_| count as f64 > allowed)?;
    let share = count as f64 / frames as f64;
    let severity = if share > MANY_REPEATED { Severity::Serious } else { Severity::Caution };
    let words = format!(
        "{count} frames ({:.1} %) repeat the one before exactly, the first is frame {first}",
        100.0 * share
    );
    let advice = "the video was converted or frames were doubled: track the file that the camera wrote";
    Some(
        QualityFinding::new(Check::FrozenFrames, severity, count as f64, "frames", words).with_advice(advice),
    )
}

/// Probability that noise, rounded to the step of each column, leaves every column in its place: `q/(2
/// sqrt(pi) s)` each, the density at zero of the difference of two values of standard deviation `s`. `None`
/// where noise does not move both points, or a step hides it.
fn repeat_probability(traces: &Traces, measured: &Quality) -> Option<f64> {
    let moved = |channel: &ChannelQuality| channel.noise_m.is_some_and(|noise| noise > LEAST_NOISE_M);
    let unchanged = |channel: &ChannelQuality| {
        (channel.step_m.unwrap_or(0.0) / (2.0 * PI.sqrt() * channel.noise_m?)).min(1.0).into()
    };
    let columns = measured_columns(traces, measured);
    let probability: f64 = columns
        .iter()
        .filter(|column| moved(column.quality))
        .filter_map(|column| unchanged(column.quality))
        .product();
    (probability < LIKELY_REPEAT && moved(&measured.tip_x) && moved(&measured.head_x)).then_some(probability)
}

/// First and last frame of a column.
fn tracked_span(samples: &[Option<f64>]) -> Option<(usize, usize)> {
    Some((samples.iter().position(Option::is_some)?, samples.iter().rposition(Option::is_some)?))
}

/// The frames that both tracks reach over.
fn check_overlap(traces: &Traces, grid: FrameGrid) -> Option<QualityFinding> {
    let (tip, head) = (tracked_span(&traces.tip_x_m)?, tracked_span(&traces.head_x_m)?);
    let (first, last) = (tip.0.max(head.0), tip.1.min(head.1));
    let both = (last + 1).saturating_sub(first);
    if both == 0 {
        let words = format!(
            "the tip is tracked from frame {} to {}, the head from {} to {}",
            tip.0, tip.1, head.0, head.1
        );
        let advice = "track both points in the same frames, or check the frame offset of the two files";
        return Some(
            QualityFinding::new(Check::Overlap, Severity::Serious, 0.0, "frames", words).with_advice(advice),
        );
    }
    let words = format!(
        "both tracks run from frame {first} to {last} ({:.6} s to {:.6} s)",
        grid.time_s(first),
        grid.time_s(last)
    );
    let found =
        |severity| QualityFinding::new(Check::Overlap, severity, both as f64, "frames", words.clone());
    let alone = tip.0.abs_diff(head.0) + tip.1.abs_diff(head.1);
    let advice = "one point is tracked longer: there is no deflection outside these frames";
    match alone {
        0 => Some(found(Severity::Note)),
        _ if alone as f64 > MANY_ALONE * grid.frames as f64 => {
            Some(found(Severity::Caution).with_advice(advice))
        }
        _ => Some(found(Severity::Note).with_advice(advice)),
    }
}

/// Travel of whichever point moves more, m.
fn largest_travel_m(traces: &Traces) -> Option<f64> {
    let travel = |samples: &[Option<f64>]| {
        let mut positions: Vec<f64> =
            samples.iter().step_by(samples.len() / MOST_POSITIONS + 1).flatten().copied().collect();
        positions.sort_unstable_by(f64::total_cmp);
        let trimmed = (TRIMMED * positions.len() as f64) as usize;
        Some(positions.get(positions.len().checked_sub(1 + trimmed)?)? - positions.get(trimmed)?)
    };
    let travels = [travel(&traces.tip_x_m), travel(&traces.head_x_m)];
    travels.into_iter().flatten().reduce(f64::max)
}

/// A travel that is no wiper's: pixels taken for a length, or the reverse.
fn check_travel(traces: &Traces) -> Option<QualityFinding> {
    let travel_m = largest_travel_m(traces)?;
    let found = |severity, words: &str, advice: &str| {
        let words = format!("tip and head travel {travel_m:.3e} m along the sweep, {words}");
        Some(QualityFinding::new(Check::Scale, severity, travel_m, "m", words).with_advice(advice))
    };
    let pixels = "check --scale: pixels may have been taken for millimetres";
    match travel_m {
        m if m > LARGEST_SWEEP_M => found(Severity::Serious, "more than any wiper sweeps", pixels),
        m if m > LARGEST_VIEW_M => {
            found(Severity::Caution, "more than a camera's view that still resolves the lip", pixels)
        }
        m if m < LEAST_TRAVEL_M => {
            let advice = "check --scale: millimetres may have been taken for pixels (or nothing moves)";
            found(Severity::Caution, "a few pixels of a usual view", advice)
        }
        _ => found(Severity::Note, "as a wiper's stroke in a camera's view may", "")
            .map(|finding| finding.with_advice("")),
    }
}

/// Median height of the head above the tip, m, over frames with both heights.
pub(super) fn head_height_m(traces: &Traces) -> Option<f64> {
    let apart =
        traces.tip_y_m.iter().zip(&traces.head_y_m).filter_map(|(tip, head)| Some((*head)? - (*tip)?));
    let mut apart: Vec<f64> = apart.step_by(traces.tip_y_m.len() / MOST_POSITIONS + 1).collect();
    let middle = apart.len() / 2;
    (!apart.is_empty()).then(|| *apart.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The blade stands on its lip, so the tip is the lower point; a tip above the head means that y points the
/// other way.
fn check_head_above_tip(traces: &Traces) -> Option<QualityFinding> {
    let height_m = -head_height_m(traces)?;
    if height_m < LEAST_HEIGHT_M {
        return None;
    }
    let words = format!("the tip lies {:.3} mm above the head", 1e3 * height_m);
    let advice = "a blade stands on its lip: check --y-axis (image coordinates point down), and which point \
        is the tip; no matter if the camera stood on its head";
    Some(QualityFinding::new(Check::YDirection, Severity::Caution, height_m, "m", words).with_advice(advice))
}

/// Turns of the head that windows can be named after.
pub(super) fn check_turns(instants: &ReversalInstants) -> Option<QualityFinding> {
    let count = instants.reversals.len();
    let found =
        |words: String| QualityFinding::new(Check::Reversals, Severity::Note, count as f64, "", words);
    if count == 0 {
        let advice = "windows cannot be named after hold, reversal or release: give them in seconds";
        return Some(found("the head does not turn in the recording".to_owned()).with_advice(advice));
    }
    let resting =
        instants.reversals.iter().filter(|turn| turn.hold_s.is_some() || turn.release_s.is_some()).count();
    Some(found(match (count, resting) {
        (1, 0) => "the head turns once; the tip does not visibly stop or slip again there".to_owned(),
        (1, _) => "the head turns once, and the tip visibly stops or slips again there".to_owned(),
        _ => {
            format!("the head turns {count} times; at {resting} of them the tip visibly stops or slips again")
        }
    }))
}
