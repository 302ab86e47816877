//! Jumps of the tracks from one frame to the next: tip and head that change places, and frames that are
//! missing although the frame numbers go on.
//!
//! The head is driven smoothly, so a jump of the head that does not go back is no motion. The tip may jump by
//! itself when it slips.

use super::finding::{Check, QualityFinding, Severity};
use super::measurement::{ChannelQuality, Quality};
use super::outliers::smallest_movement;
use super::untracked::UntrackedFrames;
use crate::recording::noise::differences::{difference_across, difference_at, fraction_beside_jump};
use crate::recording::{Recording, Traces};
use portable_math as math;
use std::collections::VecDeque;
use std::ops::Range;

/// Smallest jump, in standard deviations of the noise. The third difference at a jump is twice the jump; that
/// of white noise has 4.5 standard deviations and exceeds 28 at one of 1e9 frames.
const BEYOND_NOISE: f64 = 14.0;
/// Smallest jump, in steps of the positions: a slow point moves by one step at a time.
const BEYOND_STEPS: f64 = 4.0;
/// Smallest ratio of the third difference at a jump to those of the frames around it. A vibration or a slip
/// that shakes the head lasts for several frames.
const MORE_THAN_AROUND: f64 = 4.0;
/// Smallest ratio of a jump to the longest movement between two frames around it: a camera that loses one or
/// two frames is not reported.
const MORE_THAN_STEPS: f64 = 3.0;
/// Number of frames before and after a jump with which it is compared.
const AROUND: usize = 30;
/// Minimum number of frames around a jump, on either side, that have a third difference.
const FEWEST_AROUND: usize = 8;
/// Allowed size of the third differences next to a jump, as fractions of that at the jump
/// ([`fraction_beside_jump`]).
const BESIDE_JUMP: Range<f64> = 0.35..0.65;
/// A point jumps together with the head if it jumps by more than this fraction of the jump of the head.
const TOGETHER: f64 = 0.25;
/// Points change places if their distances from the path of the other point are below this fraction of their
/// distances from their own path.
const CROSSED: f64 = 0.2;
/// A length is certainly below a limit if the sum of its parts is below this fraction of the limit, in spite
/// of rounding.
const SURELY_SHORTER: f64 = 0.999;
/// Longest gap, in frames, over which the paths of the points are continued.
const LONGEST_GAP: usize = 5;
/// Maximum number of jumps that a finding lists.
const NAMED_JUMPS: usize = 4;

/// Frames from which tip and head have changed places, each until the next one; none in a recording whose
/// frames lie on no grid.
pub(super) fn find_exchanges(recording: &Recording, measured: &Quality) -> Vec<usize> {
    let traces = recording.traces();
    if recording.is_resampled() {
        return vec![];
    }
    let sizes = [&measured.tip_x, &measured.head_x, &measured.tip_y, &measured.head_y];
    let least_m = sizes.into_iter().map(least_jump_m).fold(0.0, f64::max);
    let has_heights = [&traces.tip_y_m, &traces.head_y_m].iter().all(|y| y.iter().any(Option::is_some));
    let mut exchanges = vec![];
    // the last two frames with both points, after exchanged points are put back, and the distances of the
    // points from their own and from each other's continued paths
    let mut last: [Option<(usize, PointPair)>; 2] = [None; 2];
    let mut misses: VecDeque<[PointPair; 2]> = VecDeque::new();
    for frame in 0..traces.tip_x_m.len() {
        let Some(mut points) = both_points(traces, frame, has_heights) else { continue };
        if exchanges.len() % 2 == 1 {
            points.swap(0, 1);
        }
        if last[1].is_some_and(|(before, _)| frame - before > LONGEST_GAP) {
            (last, misses) = ([None; 2], VecDeque::new());
        }
        if let [Some((first, from)), Some((second, to))] = last {
            let ahead = (frame - second) as f64 / (second - first) as f64;
            let path =
                |point: usize, axis: usize| to[point][axis] + ahead * (to[point][axis] - from[point][axis]);
            let miss = |points: PointPair| {
                [0, 1].map(|point| [0, 1].map(|axis| points[point][axis] - path(point, axis)))
            };
            let (own, other) = (miss(points), miss([points[1], points[0]]));
            // (most frames are on their paths, and need no root)
            let may_jump = own.iter().any(|[x, y]| x.abs() + y.abs() > SURELY_SHORTER * least_m);
            if may_jump && misses.len() >= FEWEST_AROUND {
                let miss_m = |[own, other]: &[PointPair; 2]| largest_length(own).min(largest_length(other));
                let usual_m = misses.iter().map(miss_m).fold(0.0, f64::max);
                let own_m = largest_length(&own);
                let jumps = own_m > least_m && own_m > MORE_THAN_AROUND * usual_m;
                if jumps && largest_length(&other) < CROSSED * own_m {
                    exchanges.push(frame);
                    points.swap(0, 1);
                }
            }
            misses.push_back([own, other]);
        }
        last = [last[1], Some((frame, points))];
        if misses.len() > AROUND {
            misses.pop_front();
        }
    }
    exchanges
}

/// x and y of tip and head.
type PointPair = [[f64; 2]; 2];

fn largest_length([tip, head]: &PointPair) -> f64 {
    math::hypot(tip[0], tip[1]).max(math::hypot(head[0], head[1]))
}

/// Positions of tip and head in a frame. In a recording without heights, they count as equal.
fn both_points(traces: &Traces, frame: usize, has_heights: bool) -> Option<PointPair> {
    let height = |column: &[Option<f64>]| if has_heights { column[frame] } else { Some(0.0) };
    let [tip_y, head_y] = [height(&traces.tip_y_m)?, height(&traces.head_y_m)?];
    Some([[traces.tip_x_m[frame]?, tip_y], [traces.head_x_m[frame]?, head_y]])
}

/// The traces with tip and head put back between every other pair of exchanges.
pub(super) fn put_back_exchanged(mut traces: Traces, exchanges: &[usize]) -> Traces {
    let Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, .. } = &mut traces;
    for (tip, head) in [(tip_x_m, head_x_m), (tip_y_m, head_y_m)] {
        for pair in exchanges.chunks(2) {
            let end = pair.get(1).copied().unwrap_or(tip.len());
            tip[pair[0]..end].swap_with_slice(&mut head[pair[0]..end]);
        }
    }
    traces
}

/// Finding on points that change places within the recording.
pub(super) fn check_exchanges(exchanges: &[usize]) -> Option<QualityFinding> {
    let found = format!("tip and head change places {}", name_frames(exchanges));
    let advice = "the tracker took one point for the other: track these frames again";
    let kind = (Check::SwappedPoints, Severity::Caution);
    let count = exchanges.len();
    (count > 0).then(|| QualityFinding::advise(kind, (count as f64, ""), found, advice))
}

/// The frames before and after each jump, in words.
fn name_frames(jumps: &[usize]) -> String {
    let named =
        jumps.iter().take(NAMED_JUMPS).map(|frame| format!("between frames {} and {frame}", frame - 1));
    let more = jumps.len().saturating_sub(NAMED_JUMPS);
    let more = if more > 0 { format!(" and at {more} more places") } else { String::new() };
    format!("{}{more}", named.collect::<Vec<_>>().join(", "))
}

/// A jump of the head that does not go back.
pub(super) struct HeadJump {
    /// The first frame after the jump.
    pub frame: usize,
    head_m: f64,
    tip_m: f64,
}

impl HeadJump {
    /// Whether the tip jumps with the head.
    pub(super) fn is_of_both(&self) -> bool {
        self.tip_m / self.head_m > TOGETHER
    }
}

/// Jumps of the head between neighbouring frames, apart from the frames in which it was not tracked; none in
/// a recording whose frames lie on no grid.
pub(super) fn find_head_jumps(
    recording: &Recording,
    measured: &Quality,
    untracked: &[UntrackedFrames],
) -> Vec<HeadJump> {
    let traces = recording.traces();
    if recording.is_resampled() {
        return vec![];
    }
    let of_head = || untracked.iter().filter(|found| found.concerns("head"));
    let is_tracked = |frame: usize| {
        let mut runs = of_head().flat_map(|found| &found.runs);
        !runs.any(|run| (run.start..=run.end).contains(&frame))
    };
    let frames = jump_frames(&traces.head_x_m, least_jump_m(&measured.head_x));
    let [head_m, tip_m] = [&traces.head_x_m, &traces.tip_x_m]
        .map(|samples| move |frame| difference_across(samples, frame).map_or(0.0, |size| -0.5 * size));
    let tracked = frames.into_iter().filter(|frame| is_tracked(*frame));
    tracked.map(|frame| HeadJump { frame, head_m: head_m(frame), tip_m: tip_m(frame) }).collect()
}

fn least_jump_m(channel: &ChannelQuality) -> f64 {
    BEYOND_NOISE * channel.noise_m.unwrap_or(0.0) + BEYOND_STEPS * channel.step_m.unwrap_or(0.0)
}

/// First frames after a jump of a column.
fn jump_frames(samples: &[Option<f64>], least_m: f64) -> Vec<usize> {
    let least_m = least_m.max(BEYOND_STEPS * smallest_movement(samples).unwrap_or(0.0));
    let third = |frame: usize| difference_across(samples, frame);
    let usual = |frames: Range<usize>| {
        let rough: Vec<f64> = frames.clone().filter_map(third).map(f64::abs).collect();
        let steps = frames.filter_map(|frame| difference_at(samples, frame, 1)).map(f64::abs);
        let most = rough.iter().copied().fold(0.0, f64::max);
        let least = (MORE_THAN_AROUND * most).max(2.0 * MORE_THAN_STEPS * steps.fold(0.0, f64::max));
        (rough.len() >= FEWEST_AROUND).then_some(least)
    };
    let is_jump = |frame: usize| {
        let size_m = third(frame)?.abs();
        if size_m < 2.0 * least_m {
            return Some(false);
        }
        let is_beside = |beside: usize| {
            let fraction = fraction_beside_jump(samples, frame, beside);
            fraction.is_some_and(|fraction| BESIDE_JUMP.contains(&fraction))
        };
        let before = || usual(frame.saturating_sub(AROUND)..frame - 1);
        let after = || usual(frame + 2..(frame + AROUND).min(samples.len()));
        Some(is_beside(frame - 1) && is_beside(frame + 1) && size_m > before()?.max(after()?))
    };
    (2..samples.len()).filter(|frame| is_jump(*frame).unwrap_or(false)).collect()
}

/// Finding on jumps of the head: where the tip jumps too, frames are lost; otherwise perhaps those of the
/// head's track alone.
pub(super) fn check_head_jumps(jumps: &[HeadJump]) -> Option<QualityFinding> {
    let largest = jumps.iter().reduce(|a, b| if b.head_m.abs() > a.head_m.abs() { b } else { a })?;
    let [tip_mm, head_mm] = [largest.tip_m, largest.head_m].map(|m| 1e3 * m.abs());
    let (who, lost) = if largest.is_of_both() {
        (
            format!("both points jump (the head by {head_mm:.3} mm, the tip by {tip_mm:.3} mm)"),
            "frames are missing",
        )
    } else {
        (format!("the head jumps by {head_mm:.3} mm"), "frames of the head or of both points are missing")
    };
    let frames: Vec<usize> = jumps.iter().map(|jump| jump.frame).collect();
    let found = format!("{who} {}", name_frames(&frames));
    let advice = format!(
        "{lost} there and were closed up, the tracker went over to another place, or the camera was moved: \
         export with the frame numbers of the video, or choose windows on one side"
    );
    let kind = (Check::LostFrames, Severity::Caution);
    Some(QualityFinding::advise(kind, (1e-3 * head_mm, "m"), found, advice))
}

/// The traces without the frames outside the longest stretch between two jumps.
pub(super) fn keep_longest_stretch(mut traces: Traces, jumps: &[HeadJump]) -> Traces {
    let frames = traces.tip_x_m.len();
    let starts = std::iter::once(0).chain(jumps.iter().map(|jump| jump.frame));
    let ends = jumps.iter().map(|jump| jump.frame).chain([frames]);
    let longest = starts.zip(ends).max_by_key(|(start, end)| end - start).unwrap_or((0, frames));
    let Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, .. } = &mut traces;
    for column in [tip_x_m, tip_y_m, head_x_m, head_y_m] {
        column[..longest.0].fill(None);
        column[longest.1..].fill(None);
    }
    traces
}
