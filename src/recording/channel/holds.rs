//! Where the tip keeps its place while the head turns.

use super::tracked::{TrackPoints, median_filter, median_position, noise_sd_m, value_range};
use super::turns::{HeadTurn, LEAST_RETURN_M};
use crate::math;

/// The tip holds while it stays this many noises near its place: one frame in 2 million of white noise lies
/// outside.
const HOLD_NOISES: f64 = 5.0;
/// Smallest tolerance of a hold, m: a hundredth of a pixel of 20 um, which no tracker resolves.
const LEAST_TOLERANCE_M: f64 = 0.2e-6;
/// Whole-pixel tracking flickers between neighbours: this many steps still count as the same place.
const HOLD_STEPS: f64 = 1.1;
/// Frames in a row, on one side, that end a hold; fewer are outliers of the tracker.
const LEFT_FRAMES: usize = 3;
/// Seeds of a hold on either side of a turn, spread over the parabola's frames.
const SEEDS: isize = 4;
/// Half the number of frames whose median seeds the place of a hold.
const SEED_HALF: usize = 5;
/// The head covers at least this many tolerances during a hold: a tip that follows a slow head stays within
/// two, and noise adds less than two.
const HEAD_TOLERANCES: f64 = 6.0;
/// Bound on the extrapolation back to the start or end of a hold, frames.
const MOST_EXTRAPOLATED: f64 = 5.0;
/// After release the tip's speed grows as the square of time (its acceleration starts at zero), so its path
/// as the cube.
const RELEASE_POWER: f64 = 3.0;
/// Before a hold the tip decelerates to rest, so its path is a parabola.
const HOLD_POWER: f64 = 2.0;

/// An interval in which the tip keeps its place, in frames (real numbers); an end outside the recording is
/// `None`.
pub(super) struct TipHold {
    pub start: Option<f64>,
    pub end: Option<f64>,
    points: usize,
}

pub(super) fn longest_hold(head: &TrackPoints, tip: &TrackPoints, turn: &HeadTurn) -> Option<TipHold> {
    let tolerance_m = hold_tolerance_m(tip, turn);
    let half = (turn.last - turn.first) as f64 / 2.0;
    let seeds = (-SEEDS..=SEEDS).map(|k| turn.frame + half * k as f64 / SEEDS as f64);
    let holds = seeds.filter_map(|seed| hold_around(head, tip, tip.index_at_frame(seed), tolerance_m));
    holds.reduce(|best, hold| if hold.points > best.points { hold } else { best })
}

/// How far the tip may stray from its place: by the noise in the middle third about the turn, where the drive
/// is slow and the tip calm.
fn hold_tolerance_m(tip: &TrackPoints, turn: &HeadTurn) -> f64 {
    let sixth = (turn.last - turn.first) as f64 / 6.0;
    let near = &tip.points[tip.index_at_frame(turn.frame - sixth)..tip.index_at_frame(turn.frame + sixth)];
    let local = Some(noise_sd_m(near)).filter(|_| near.len() >= 4 * SEED_HALF);
    let noise_m = local.map_or(tip.noise_m, |local| local.min(tip.noise_m));
    LEAST_TOLERANCE_M.max(HOLD_NOISES * noise_m).max(if noise_m == 0.0 {
        HOLD_STEPS * tip.step_m.min(LEAST_RETURN_M * 2.0)
    } else {
        0.0
    })
}

fn hold_around(head: &TrackPoints, tip: &TrackPoints, seed: usize, tolerance_m: f64) -> Option<TipHold> {
    let nearby =
        tip.points.get(seed.saturating_sub(SEED_HALF)..(seed + SEED_HALF + 1).min(tip.points.len()))?;
    let place = median_position(nearby)?;
    let (first, last) = hold_extent(tip, seed.min(tip.points.len() - 1), place, tolerance_m);
    let place = median_position(&tip.points[first..=last])?;
    let (first, last) = hold_extent(tip, first + (last - first) / 2, place, tolerance_m);
    if !head_covers(head, tip.points[first].0, tip.points[last].0, HEAD_TOLERANCES * tolerance_m) {
        return None;
    }
    let (before, after) = (first.checked_sub(1), Some(last + 1).filter(|i| *i < tip.points.len()));
    let start =
        before.map(|outside| departure_frame(tip, outside, outside.checked_sub(1), place, HOLD_POWER));
    let end = after.map(|outside| departure_frame(tip, outside, Some(outside + 1), place, RELEASE_POWER));
    Some(TipHold { start, end, points: last - first + 1 })
}

/// First and last point of the interval around `seed` in which the tip stays near `place`.
fn hold_extent(tip: &TrackPoints, seed: usize, place: f64, tolerance_m: f64) -> (usize, usize) {
    let outside = |i: usize| {
        let off = tip.points[i].1 - place;
        if off.abs() <= tolerance_m { 0.0 } else { off.signum() }
    };
    let left = |i: usize, along: &dyn Fn(usize, usize) -> Option<usize>| {
        let side = outside(i);
        side != 0.0 && (1..LEFT_FRAMES).all(|k| along(i, k).is_none_or(|j| outside(j) == side))
    };
    let later = |i: usize, k: usize| Some(i + k).filter(|j| *j < tip.points.len());
    let earlier = |i: usize, k: usize| i.checked_sub(k);
    let last = (seed..tip.points.len()).take_while(|i| !left(*i, &later)).last().unwrap_or(seed);
    let first = (0..=seed).rev().take_while(|i| !left(*i, &earlier)).last().unwrap_or(seed);
    (first, last)
}

fn head_covers(head: &TrackPoints, first: usize, last: usize, least_m: f64) -> bool {
    let during = median_filter(
        &head.points[head.index_at_frame(first as f64)..head.index_at_frame(last as f64 + 1.0)],
    );
    let (low, high) = value_range(&during);
    high - low >= least_m
}

/// Where the path `distance = c |t - t0|^power` through two points outside the hold starts, frames.
fn departure_frame(tip: &TrackPoints, outside: usize, next: Option<usize>, place: f64, power: f64) -> f64 {
    let (frame, x) = tip.points[outside];
    let frame = frame as f64;
    let Some((next_frame, next_x)) = next.and_then(|i| tip.points.get(i)) else { return frame };
    let (root, next_root) =
        (math::powf((x - place).abs(), 1.0 / power), math::powf((next_x - place).abs(), 1.0 / power));
    let towards_hold = if *next_frame as f64 > frame { -1.0 } else { 1.0 };
    let frames_back = root / (next_root - root) * (*next_frame as f64 - frame).abs();
    let frames_back =
        if next_root > root && frames_back.is_finite() { frames_back.min(MOST_EXTRAPOLATED) } else { 1.0 };
    frame + towards_hold * frames_back
}
