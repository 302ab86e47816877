//! The flip: at a turn of the head, the deflection passes from one side to the other.

use super::{index_at_frame, median_of_three, median_position};
use std::ops::Range;

/// Fraction of the change of the deflection at which the flip starts; 5 % is usual for rise times and far
/// above tracking noise.
const START_SHARE: f64 = 0.05;
/// Fraction of the change of the deflection at which the flip ends.
const END_SHARE: f64 = 0.95;
/// The level of the deflection before a turn of the head is a median. At least this number of tracked frames
/// on either side of the turn enter it.
const NEAR_TURN: usize = 5;
/// Minimum number of tracked frames for the level of the deflection after the turn: the median of fewer
/// frames is dominated by noise.
const FEWEST_POINTS: usize = 8;
/// Smallest change of the deflection that counts as a flip, in standard deviations of its noise. The largest
/// and the smallest of 1e5 values of white noise differ by about 9 standard deviations.
const CHANGE_NOISES: f64 = 12.0;

/// Passage of the deflection from its level before a turn of the head to its level after the turn, as two
/// times of the recording.
///
/// The level before is the median deflection from the stop of the tip to the turn of the head. The level
/// after is the median over a time that begins at the release and is as long as the tip's rest, so that
/// oscillations about this level average out. The flip starts when the deflection last leaves the first 5 %
/// of the change, and ends when it first reaches 95 %. A zero crossing would not serve as a criterion,
/// because zero depends on the choice of the tracked points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flip {
    /// Time at which the deflection leaves its level before the turn, s.
    pub start_s: f64,
    /// Time at which the deflection reaches its level after the turn, s.
    pub end_s: f64,
}

/// Frame numbers (real numbers) of a turn, of the start and end of the tip's rest around it, and of the next
/// turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct TurnNeighbourhood {
    pub turn: f64,
    pub hold: Option<f64>,
    pub release: f64,
    /// The next turn; infinite if there is none.
    pub next_turn: f64,
}

/// Start and end of the flip, frames; `points` are the tracked frames of the deflection. `None` if too few
/// frames are tracked or if the change is within the noise.
pub(super) fn find_flip(
    points: &[(usize, f64)],
    noise_m: f64,
    around: &TurnNeighbourhood,
) -> Option<(f64, f64)> {
    let before_m = median_position(points.get(level_before(points, around))?)?;
    let after = points.get(level_after(points, around))?;
    let change_m = median_position(after)? - before_m;
    if after.len() < FEWEST_POINTS || change_m.abs() <= CHANGE_NOISES * noise_m {
        return None;
    }
    let share = |index: usize| (median_of_three(points, index) - before_m) / change_m;
    let from = index_at_frame(points, around.turn);
    let end = (from..points.len()).find(|index| share(*index) >= END_SHARE)?;
    let start = (0..end).rev().find(|index| share(*index) <= START_SHARE)?;
    let start = interpolate_crossing(points, &share, start, START_SHARE).max(around.hold.unwrap_or(0.0));
    Some((start, interpolate_crossing(points, &share, end.checked_sub(1)?, END_SHARE)))
}

/// Indices of the points between the stop of the tip and the turn of the head (either may come first), and of
/// at least [`NEAR_TURN`] points on either side of the turn.
fn level_before(points: &[(usize, f64)], around: &TurnNeighbourhood) -> Range<usize> {
    let frames = [around.turn, around.hold.unwrap_or(around.turn)];
    let [turn, hold] = frames.map(|frame| index_at_frame(points, frame));
    turn.min(hold).min(turn.saturating_sub(NEAR_TURN))
        ..turn.max(hold).max((turn + NEAR_TURN).min(points.len()))
}

/// Indices of the points after the release of the tip, for as long as the tip rested, but not past the next
/// turn.
fn level_after(points: &[(usize, f64)], around: &TurnNeighbourhood) -> Range<usize> {
    let rested = around.release - around.hold.unwrap_or(around.turn).min(around.turn);
    let from = index_at_frame(points, around.release);
    from..index_at_frame(points, (around.release + rested).min(around.next_turn)).max(from)
}

/// Frame number (a real number) at which the fraction `share` of the change passes `level` between the point
/// `index` and the next point, by linear interpolation.
fn interpolate_crossing(
    points: &[(usize, f64)],
    share: &impl Fn(usize) -> f64,
    index: usize,
    level: f64,
) -> f64 {
    let next = (index + 1).min(points.len() - 1);
    let (frame, next_frame) = (points[index].0 as f64, points[next].0 as f64);
    let (low, high) = (share(index), share(next));
    let part = if high > low { ((level - low) / (high - low)).clamp(0.0, 1.0) } else { 1.0 };
    frame + part * (next_frame - frame)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::channel::{Reversal, ReversalInstants, phase_windows};
    use crate::recording::{FrameGrid, Recording, Traces};
    use portable_math::StandardNormal;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use std::f64::consts::{PI, TAU};

    const RATE_HZ: f64 = 10_000.0;
    const AMPLITUDE_M: f64 = 0.018;
    /// Size of the deflection while the tip trails the head, m.
    const TRAILS_M: f64 = 1.1e-3;
    const HOLD_BEFORE_S: f64 = 0.02;

    /// Head on a cosine of 0.5 Hz, with turns at 1, 2, 3 s ...
    fn head(t: f64) -> f64 {
        AMPLITUDE_M * (1.0 - (PI * t).cos())
    }

    /// Time after a turn, s, at which the head, on its way back, is `back_m` beyond the position that it had
    /// when the tip stopped.
    fn back_s(back_m: f64) -> f64 {
        ((PI * HOLD_BEFORE_S).cos() - back_m / AMPLITUDE_M).acos() / PI
    }

    /// A tip that trails, stops before each turn, sticks until the blade is deflected as far to the other
    /// side, and trails again; after the release it swings about its path by `swing_m` at 80 Hz.
    fn tip(t: f64, swing_m: f64) -> f64 {
        let since = (t - 0.5).rem_euclid(1.0) - 0.5; // time since the nearest turn
        let turn = t - since;
        let sign = if turn.round() as i64 % 2 == 0 { -1.0 } else { 1.0 };
        let release_s = back_s(2.0 * TRAILS_M);
        if since < -HOLD_BEFORE_S {
            head(t) - sign * TRAILS_M
        } else if since < release_s {
            head(turn - HOLD_BEFORE_S) - sign * TRAILS_M
        } else {
            head(t) + sign * (TRAILS_M + swing_m * (TAU * 80.0 * (since - release_s)).sin())
        }
    }

    fn stroke(
        start_s: f64,
        stop_s: f64,
        [noise_m, swing_m]: [f64; 2],
        missing: impl Fn(usize) -> bool,
    ) -> Recording {
        let frames = ((stop_s - start_s) * RATE_HZ).round() as usize;
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(11);
        let mut column = |place: &dyn Fn(f64) -> f64| -> Vec<Option<f64>> {
            let noisy = |i: usize| {
                place(start_s + i as f64 / RATE_HZ) + noise_m * generator.sample::<f64, _>(StandardNormal)
            };
            (0..frames).map(noisy).enumerate().map(|(i, x)| (!missing(i)).then_some(x)).collect()
        };
        let traces = Traces {
            head_x_m: column(&head),
            tip_x_m: column(&|t| tip(t, swing_m)),
            tip_y_m: vec![None; frames],
            head_y_m: vec![None; frames],
            ..Traces::default()
        };
        Recording::new("r", FrameGrid { start_s, frame_rate_hz: RATE_HZ, frames }, traces, true).unwrap()
    }

    fn find(recording: &Recording) -> Vec<Reversal> {
        ReversalInstants::find_instants(recording).reversals
    }

    /// Times, s, at 5 % and 95 % of the change of the deflection to the new side. The change starts at the
    /// median of the deflection from the stop of the tip to the turn, which is its value half-way in time.
    fn expected_s(turn_s: f64) -> [f64; 2] {
        let excursion_m = head(1.0 - HOLD_BEFORE_S / 2.0) - head(1.0 - HOLD_BEFORE_S);
        let change_m = 2.0 * TRAILS_M + excursion_m;
        [0.05, 0.95].map(|share| turn_s + back_s(share * change_m - excursion_m))
    }

    fn assert_flip(found: &Reversal, turn_s: f64, frames: f64) {
        let flip = found.flip.unwrap_or_else(|| panic!("no flip at {turn_s} s: {found:?}"));
        for (found_s, expected_s) in [flip.start_s, flip.end_s].into_iter().zip(expected_s(turn_s)) {
            assert!(
                (found_s - expected_s).abs() * RATE_HZ <= frames,
                "found {found_s} s, expected {expected_s} s"
            );
        }
    }

    #[test]
    fn the_flip_lasts_from_5_to_95_percent_of_the_change() {
        let found = find(&stroke(0.8, 2.4, [0.0, 0.0], |_| false));
        assert_eq!(found.len(), 2);
        assert_flip(&found[0], 1.0, 2.0);
        assert_flip(&found[1], 2.0, 2.0);
        assert!(found[0].settling_time_s().unwrap() >= found[0].flip.unwrap().end_s);
    }

    #[test]
    fn noise_and_gaps_move_it_by_a_few_frames() {
        let gappy = |i: usize| i % 7 == 3 || (1900..2100).contains(&i) || (2355..2380).contains(&i);
        // the noise of the deflection, 3 um, is the distance that the head moves in 4 frames where the flip
        // starts; a gap at the turn hides the larger deflections before the turn, which moves their median by
        // 10 um, or 16 frames of the head's motion
        for (missing, frames) in [(&(|_| false) as &dyn Fn(usize) -> bool, 12.0), (&gappy, 30.0)] {
            let found = find(&stroke(0.8, 1.4, [2e-6, 0.0], missing));
            assert_eq!(found.len(), 1);
            assert_flip(&found[0], 1.0, frames);
        }
    }

    #[test]
    fn what_swings_about_the_new_side_does_not_move_it() {
        let found = find(&stroke(0.8, 1.4, [2e-6, 0.15e-3], |_| false));
        assert_eq!(found.len(), 1);
        assert_flip(&found[0], 1.0, 20.0);
    }

    #[test]
    fn an_outlier_on_the_new_side_is_no_flip() {
        let calm = stroke(0.8, 1.4, [0.0, 0.0], |_| false);
        let mut traces = calm.traces().clone();
        traces.tip_x_m[2100] = traces.tip_x_m[2100].map(|x| x + 3e-3);
        let outlying = Recording::new("r", calm.grid(), traces, true).unwrap();
        assert_eq!(find(&outlying), find(&calm));
    }

    #[test]
    fn without_a_release_there_is_no_flip() {
        let found = find(&stroke(0.8, 1.04, [2e-6, 0.0], |_| false));
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].release_s, found[0].flip, found[0].settling_time_s()), (None, None, None));
    }

    #[test]
    fn a_deflection_that_was_not_tracked_after_the_release_has_no_flip() {
        let released = 2000 + (back_s(2.0 * TRAILS_M) * RATE_HZ) as usize;
        let found = find(&stroke(0.8, 0.8 + (released + 5) as f64 / RATE_HZ, [0.0, 0.0], |_| false));
        assert_eq!(found.len(), 1);
        assert!(found[0].release_s.is_some() && found[0].flip.is_none(), "{found:?}");
    }

    #[test]
    fn the_windows_of_a_stroke_follow_one_another_to_its_ends() {
        let recording = stroke(0.8, 2.4, [2e-6, 0.1e-3], |i| i % 11 == 4);
        let windows = phase_windows(&recording, &ReversalInstants::find_instants(&recording));
        assert_eq!(
            windows.iter().map(|w| w.name.as_str()).collect::<Vec<_>>(),
            ["before", "stick", "flip", "after", "stick[2]", "flip[2]", "after[2]"]
        );
        assert_eq!((windows[0].frames.start, windows[6].frames.end), (0, recording.grid().frames));
        assert!(windows.windows(2).all(|pair| pair[0].frames.end == pair[1].frames.start), "{windows:?}");
    }

    #[test]
    fn a_change_within_the_noise_is_no_flip() {
        let points: Vec<(usize, f64)> = (0..400).map(|i| (i, if i < 200 { 0.0 } else { 1.0 })).collect();
        let around =
            TurnNeighbourhood { turn: 100.0, hold: Some(90.0), release: 250.0, next_turn: f64::INFINITY };
        assert_eq!(find_in(&points, 0.05, &around), Some((199.05, 199.95)));
        assert_eq!(find_in(&points, 0.1, &around), None);
        assert_eq!(find_in(&[], 0.0, &around), None);
    }

    fn find_in(points: &[(usize, f64)], noise_m: f64, around: &TurnNeighbourhood) -> Option<(f64, f64)> {
        super::find_flip(points, noise_m, around)
    }
}
