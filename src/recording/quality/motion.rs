//! Checks on both points together: frames that both tracks cover, scale, and the turns of the head.

use super::finding::{Check, QualityFinding, Severity};
use super::measurement::MOST_POSITIONS;
use crate::recording::channel::{ReversalInstants, collect_numbers, find_median, tracked_span};
use crate::recording::{FrameGrid, Recording, Traces};
use portable_math as math;

/// The finding on overlap is a caution if, at the start and the end of the recording, only one point is
/// tracked in more than this fraction of the frames. A late start of a track affects fewer frames.
const MANY_ALONE: f64 = 0.1;
/// Largest travel of a point that fits into a camera's view in which the lip is still resolved, m: if 1,000
/// pixels cover this length, a lip of 5 mm is 10 pixels high.
pub(super) const LARGEST_VIEW_M: f64 = 0.5;
/// Travel of a point that is longer than any wiper's sweep, m: the longest blades travel about 1.5 m along
/// their arc.
const LARGEST_SWEEP_M: f64 = 2.0;
/// Travel below which a point counts as at rest, m: five pixels of the usual size, 20 um.
const LEAST_TRAVEL_M: f64 = 1e-4;
/// Fraction of the positions at either end of their range that are left out when a travel is measured,
/// because they may be outliers.
const TRIMMED: f64 = 0.01;

/// Findings from the checks on both points together.
pub(super) fn check_motion(recording: &Recording) -> Vec<QualityFinding> {
    let (traces, grid) = (recording.traces(), recording.grid());
    let found = [check_overlap(traces, grid), check_travel(traces)];
    found.into_iter().flatten().collect()
}

/// Finding on the range of frames that both tracks cover.
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
        let kind = (Check::Overlap, Severity::Serious);
        return Some(QualityFinding::advise(kind, (0.0, "frames"), words, advice));
    }
    let words = format!(
        "both tracks run from frame {first} to {last} ({:.6} s to {:.6} s)",
        grid.time_s(first),
        grid.time_s(last)
    );
    let alone = tip.0.abs_diff(head.0) + tip.1.abs_diff(head.1);
    let many = alone as f64 > MANY_ALONE * grid.frames as f64;
    let severity = if many { Severity::Caution } else { Severity::Note };
    let longer = "one point is tracked longer: there is no deflection outside these frames";
    let advice = if alone > 0 { longer } else { "" };
    Some(QualityFinding::advise((Check::Overlap, severity), (both as f64, "frames"), words, advice))
}

/// Range of the positions of a column, m, without the outermost 1 % at either end.
pub(super) fn trimmed_range_m(samples: &[Option<f64>]) -> Option<f64> {
    let some = samples.iter().step_by(samples.len() / MOST_POSITIONS + 1);
    find_trimmed_ends(some.flatten().copied()).map(|[low, high]| high - low)
}

/// Smallest and largest position without the outermost 1 % at either end.
pub(super) fn find_trimmed_ends(positions: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let mut positions = collect_numbers(positions);
    let trimmed = (TRIMMED * positions.len() as f64) as usize;
    let last = positions.len().checked_sub(1 + trimmed)?;
    Some([trimmed, last].map(|rank| math::select_number(&mut positions, rank)))
}

/// Travel of the point that travels farther, m.
pub(super) fn largest_travel_m(traces: &Traces) -> Option<f64> {
    let travels = [&traces.tip_x_m, &traces.head_x_m].map(|x| trimmed_range_m(x));
    travels.into_iter().flatten().reduce(f64::max)
}

/// Finding on the travel along the sweep; an implausible travel comes from a wrong unit.
fn check_travel(traces: &Traces) -> Option<QualityFinding> {
    let travel_m = largest_travel_m(traces)?;
    let pixels = "check --scale: pixels may have been taken for millimetres";
    let metres = "check --scale: millimetres may have been taken for pixels (or nothing moves)";
    let (severity, words, advice) = match travel_m {
        m if m > LARGEST_SWEEP_M => (Severity::Serious, "more than any wiper sweeps", pixels),
        m if m > LARGEST_VIEW_M => {
            (Severity::Caution, "more than a camera's view that still resolves the lip", pixels)
        }
        m if m < LEAST_TRAVEL_M => (Severity::Caution, "a few pixels of a usual view", metres),
        _ => (Severity::Note, "as a wiper's stroke in a camera's view may", ""),
    };
    let words = format!("tip and head travel {travel_m:.3e} m along the sweep, {words}");
    Some(QualityFinding::advise((Check::Scale, severity), (travel_m, "m"), words, advice))
}

/// Median height of the head above the tip, m, over frames with both heights.
pub(super) fn head_height_m(traces: &Traces) -> Option<f64> {
    let both = traces.tip_y_m.iter().zip(&traces.head_y_m);
    let apart = both.filter_map(|(tip, head)| Some((*head)? - (*tip)?));
    find_median(apart.step_by(traces.tip_y_m.len() / MOST_POSITIONS + 1))
}

/// Finding on the number of turns of the head; windows can be named after these turns.
pub(super) fn check_turns(instants: &ReversalInstants) -> QualityFinding {
    let count = instants.reversals.len();
    let resting =
        instants.reversals.iter().filter(|turn| turn.hold_s.is_some() || turn.release_s.is_some()).count();
    let words = match (count, resting) {
        (0, _) => "the head does not turn in the recording".to_owned(),
        (1, 0) => "the head turns once; the tip does not visibly stop or slip again there".to_owned(),
        (1, _) => "the head turns once, and the tip visibly stops or slips again there".to_owned(),
        _ => {
            format!("the head turns {count} times; at {resting} of them the tip visibly stops or slips again")
        }
    };
    let unnamed = "windows cannot be named after hold, reversal or release: give them in seconds";
    let advice = if count == 0 { unnamed } else { "" };
    QualityFinding::advise((Check::Reversals, Severity::Note), (count as f64, ""), words, advice)
}
