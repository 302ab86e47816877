//! Turns of the head, and the rest of the tip around them.

use super::{
    TrackPoints, index_at_frame, median_filter, median_of_three, median_position, noise_sd_m, value_range,
};
use portable_math as math;

/// Smallest distance that the head must move towards an extremum and away from it for the extremum to count
/// as a turn, m: one pixel of the usual size, 20 um. Jitter of a resting head is smaller.
pub(super) const LEAST_RETURN_M: f64 = 20e-6;
/// Smallest distance that the head must move towards a turn and away from it, in standard deviations of the
/// tracking noise. The largest and the smallest of 1e5 values of white noise differ by about 9 standard
/// deviations.
const RETURN_NOISES: f64 = 12.0;
/// Smallest distance that the head must move towards a turn and away from it, as a fraction of the head's
/// whole travel; vibration of the drive is smaller.
const RETURN_TRAVEL: f64 = 0.005;
/// Smallest distance that the head must move towards a turn and away from it, in steps of its positions: at
/// rest, a position flickers between two or three neighbouring values.
const RETURN_STEPS: f64 = 2.5;
/// The time of a turn comes from a parabola. It is fitted to the frames in which the head is near the
/// extremum: within this multiple of the smallest movement that counts as a turn.
const FIT_RETURNS: f64 = 4.0;

/// A turn of the head: its time in frames, and the first and last frame of the fitted parabola that gives
/// this time.
pub(super) struct HeadTurn {
    pub frame: f64,
    pub first: usize,
    pub last: usize,
}

/// Finds the extrema from which the head returns by more than noise, jitter and vibration.
pub(super) fn find_turns(head: &TrackPoints) -> Vec<HeadTurn> {
    let smooth = median_filter(&head.points);
    let (low, high) = value_range(&smooth);
    let of_errors = (RETURN_NOISES * head.noise_m).max(RETURN_STEPS * head.step_m);
    let least = LEAST_RETURN_M.max(of_errors).max(RETURN_TRAVEL * (high - low));
    let extrema = alternating_extrema(&smooth, least).into_iter();
    extrema.map(|index| time_extremum(head, &smooth, index, FIT_RETURNS * least)).collect()
}

/// Indices of alternating maxima and minima. Before and after each extremum, the values move away from it by
/// at least `least`.
fn alternating_extrema(values: &[f64], least: f64) -> Vec<usize> {
    let Some(first) = values.first() else { return Vec::new() };
    let (mut top, mut bottom) = ((0, *first), (0, *first));
    let mut rising = None;
    let mut found = Vec::new();
    for (index, &x) in values.iter().enumerate() {
        if x > top.1 {
            top = (index, x);
        }
        if x < bottom.1 {
            bottom = (index, x);
        }
        if rising != Some(false) && top.1 - x >= least {
            if rising == Some(true) {
                found.push(top.0);
            }
            (rising, bottom) = (Some(false), (index, x));
        } else if rising != Some(true) && x - bottom.1 >= least {
            if rising == Some(false) {
                found.push(bottom.0);
            }
            (rising, top) = (Some(true), (index, x));
        }
    }
    found
}

/// Finds the time of an extremum: the vertex of a least-squares parabola through the adjacent frames whose
/// positions are within `reach_m` of the extremum.
fn time_extremum(head: &TrackPoints, smooth: &[f64], index: usize, reach_m: f64) -> HeadTurn {
    let near = |i: &usize| (smooth[*i] - smooth[index]).abs() <= reach_m;
    let first = (0..=index).rev().take_while(near).last().unwrap_or(index);
    let last = (index..smooth.len()).take_while(near).last().unwrap_or(index);
    let points = &head.points[first..=last];
    let (start, end) = (head.points[first].0, head.points[last].0);
    let plain = HeadTurn { frame: head.points[index].0 as f64, first: start, last: end };
    match parabola_vertex(points) {
        Some(frame) if frame >= start as f64 && frame <= end as f64 => HeadTurn { frame, ..plain },
        _ => plain,
    }
}

/// Frame number (a real number) of the vertex of the least-squares parabola through the points.
fn parabola_vertex(points: &[(usize, f64)]) -> Option<f64> {
    let (first, last) = (points.first()?.0 as f64, points.last()?.0 as f64);
    let (centre, half) = ((first + last) / 2.0, (last - first) / 2.0);
    if points.len() < 5 || half <= 0.0 {
        return None;
    }
    let mut normal = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    for (frame, x) in points {
        let s = (*frame as f64 - centre) / half;
        let row = nalgebra::Vector3::new(1.0, s, s * s);
        normal += row * row.transpose();
        right += row * *x;
    }
    let fit = normal.cholesky()?.solve(&right);
    let s = -fit[1] / (2.0 * fit[2]);
    s.is_finite().then_some(centre + half * s)
}

/// Tolerance of the tip's position during a hold (a rest of the tip), in standard deviations of the noise.
/// White noise exceeds this tolerance in one frame of 2 million.
const HOLD_NOISES: f64 = 5.0;
/// Smallest tolerance of the tip's position during a hold, m: a hundredth of a pixel of 20 um. No tracker is
/// that accurate.
const LEAST_TOLERANCE_M: f64 = 0.2e-6;
/// Tolerance of the tip's position during a hold, in steps of the tracker, if the noise is zero: whole-pixel
/// tracking flickers between two adjacent values.
const HOLD_STEPS: f64 = 1.1;
/// Number of consecutive frames outside the tolerance, all on the same side, that end a hold; fewer frames
/// are outliers of the tracker.
const LEFT_FRAMES: usize = 3;
/// The search for a hold starts at the turn and at this number of frames on either side of it. These frames
/// are spread evenly over the frames of the parabola that gives the time of the turn.
const SEEDS: isize = 4;
/// The first estimate of the position of a hold is the median over the starting frame and this number of
/// frames on either side of it.
const SEED_HALF: usize = 5;
/// Smallest travel of the head during a hold, in tolerances of the tip's position. If the tip only follows a
/// slow head, it leaves the tolerance before the head has travelled two tolerances; noise adds less than two
/// to this travel.
const HEAD_TOLERANCES: f64 = 6.0;
/// Maximum number of frames from the first point outside a hold back to the extrapolated start or end of the
/// hold.
const MOST_EXTRAPOLATED: f64 = 5.0;
/// Exponent of the tip's path after release: the tip's acceleration starts at zero, so the path grows as the
/// cube of time.
const RELEASE_POWER: f64 = 3.0;
/// Exponent of the tip's path before a hold: the tip decelerates to rest along a parabola.
const HOLD_POWER: f64 = 2.0;

/// An interval in which the tip rests, in frames (real numbers). An end is `None` if it lies outside the
/// recording, or if the tip rests up to the neighbouring turn of the head.
pub(super) struct TipHold {
    pub start: Option<f64>,
    pub end: Option<f64>,
    points: usize,
}

/// The longest rest of the tip around a turn. `lean_m` is twice the usual size of the deflection, m, and
/// `turns` are the frames of the turns before and after, between which the tip may rest.
pub(super) fn longest_hold(
    head: &TrackPoints,
    tip: &TrackPoints,
    turn: &HeadTurn,
    lean_m: f64,
    [last_turn, next_turn]: [f64; 2],
) -> Option<TipHold> {
    let tolerance_m = hold_tolerance_m(tip, turn);
    let half = (turn.last - turn.first) as f64 / 2.0;
    let seeds = (-SEEDS..=SEEDS).map(|k| turn.frame + half * k as f64 / SEEDS as f64);
    let holds = seeds.filter_map(|seed| hold_around(head, tip, tip.index_at_frame(seed), tolerance_m));
    let mut hold = holds.reduce(|best, hold| if hold.points > best.points { hold } else { best })?;
    let block_m = (BLOCK_TOLERANCES * tolerance_m).max(BLOCK_SHARE * lean_m);
    if let Some(end) = hold.end {
        let [head, tip] = [head, tip].map(|track| track.points_between(last_turn, next_turn));
        let rest = MarkerRest { head, tip, tolerance_m, block_m };
        hold.end = rest.find_departure(end, next_turn, RELEASE_POWER);
    }
    if let Some(start) = hold.start {
        // the same backwards in time
        let [head, tip] = [head, tip].map(|track| track.points_between(last_turn, next_turn));
        let origin = head.iter().chain(tip).map(|(frame, _)| *frame).max().unwrap_or(0);
        let reversed = [head, tip]
            .map(|points| points.iter().rev().map(|(frame, x)| (origin - frame, *x)).collect::<Vec<_>>());
        let rest = MarkerRest { head: &reversed[0], tip: &reversed[1], tolerance_m, block_m };
        let origin = origin as f64;
        let found = rest.find_departure(origin - start, origin - last_turn, HOLD_POWER);
        hold.start = found.map(|frame| origin - frame);
    }
    Some(hold)
}

/// Tolerance of the tip's position during a hold, m, from the noise in the middle third of the frames of the
/// turn's parabola, where the head is slow.
fn hold_tolerance_m(tip: &TrackPoints, turn: &HeadTurn) -> f64 {
    let sixth = (turn.last - turn.first) as f64 / 6.0;
    let near = &tip.points[tip.index_at_frame(turn.frame - sixth)..tip.index_at_frame(turn.frame + sixth)];
    let local = Some(noise_sd_m(near)).filter(|_| near.len() >= 4 * SEED_HALF);
    let noise_m = local.map_or(tip.noise_m, |local| local.min(tip.noise_m));
    let by_step = if noise_m == 0.0 { HOLD_STEPS * tip.step_m.min(LEAST_RETURN_M * 2.0) } else { 0.0 };
    LEAST_TOLERANCE_M.max(HOLD_NOISES * noise_m).max(by_step)
}

fn hold_around(head: &TrackPoints, tip: &TrackPoints, seed: usize, tolerance_m: f64) -> Option<TipHold> {
    let nearby = seed.saturating_sub(SEED_HALF)..(seed + SEED_HALF + 1).min(tip.points.len());
    let place = median_position(tip.points.get(nearby)?)?;
    let (first, last) = hold_extent(tip, seed.min(tip.points.len() - 1), place, tolerance_m);
    let place = median_position(&tip.points[first..=last])?;
    let (first, last) = hold_extent(tip, first + (last - first) / 2, place, tolerance_m);
    let [from, to] = [tip.points[first].0 as f64, tip.points[last].0 as f64 + 1.0];
    let (low, high) =
        value_range(&median_filter(&head.points[head.index_at_frame(from)..head.index_at_frame(to)]));
    let head_moves = high - low >= HEAD_TOLERANCES * tolerance_m;
    let (before, after) = (first.checked_sub(1), Some(last + 1).filter(|i| *i < tip.points.len()));
    let departure = |outside, next, power| departure_frame(&tip.points, outside, next, place, power);
    let start = before.map(|outside| departure(outside, outside.checked_sub(1), HOLD_POWER));
    let end = after.map(|outside| departure(outside, Some(outside + 1), RELEASE_POWER));
    head_moves.then_some(TipHold { start, end, points: last - first + 1 })
}

/// First and last point of the interval around `seed` in which the tip stays within `tolerance_m` of `place`.
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

/// Start or end of a hold, in frames: the time `t0` of the path `distance = c |t - t0|^power` through two
/// points outside the hold, where `distance` is measured from the position of the hold.
fn departure_frame(tip: &[(usize, f64)], outside: usize, next: Option<usize>, place: f64, power: f64) -> f64 {
    let (frame, x) = tip[outside];
    let frame = frame as f64;
    let Some((next_frame, next_x)) = next.and_then(|i| tip.get(i)) else { return frame };
    let [root, next_root] = [x, *next_x].map(|x| math::powf((x - place).abs(), 1.0 / power));
    let towards_hold = if *next_frame as f64 > frame { -1.0 } else { 1.0 };
    let frames_back = root / (next_root - root) * (*next_frame as f64 - frame).abs();
    let frames_back =
        if next_root > root && frames_back.is_finite() { frames_back.min(MOST_EXTRAPOLATED) } else { 1.0 };
    frame + towards_hold * frames_back
}

// A marker beside the edge of the lip turns with the lip. So it moves while the tip rests: slowly while the
// head moves, and quickly where the blade flips. It never moves nearly as far as the head.

/// Motion of the head in a block, in tolerances of the tip's position: noise then adds little to the motion
/// of the tip.
const BLOCK_TOLERANCES: f64 = 20.0;
/// Smallest motion of the head in a block, as a share of twice the usual deflection: it is longer than a
/// cycle of stick and slip.
const BLOCK_SHARE: f64 = 0.03;
/// The tip rests in a block if it moves by less than this share of the motion of the head.
const RESTS: f64 = 0.3;
/// Number of blocks after the supposed end of a rest in which the tip is compared with the head.
const COMPARED_BLOCKS: usize = 8;

/// Tracks of head and tip between two turns: frame and position, m. They show whether the tip still rests
/// although its marker moves a little.
struct MarkerRest<'a> {
    head: &'a [(usize, f64)],
    tip: &'a [(usize, f64)],
    tolerance_m: f64,
    /// Motion of the head in a block, m.
    block_m: f64,
}

/// Points of the tip in a block.
struct RestBlock {
    first: usize,
    end: usize,
    rests: bool,
}

impl MarkerRest<'_> {
    fn head_at(&self, i: usize) -> f64 {
        let at = index_at_frame(self.head, self.tip[i].0 as f64);
        median_of_three(self.head, at.min(self.head.len() - 1))
    }

    fn tip_at(&self, i: usize) -> f64 {
        median_of_three(self.tip, i)
    }

    /// Whether the tip moves between two points by less than [`RESTS`] of the motion of the head.
    fn rests_between(&self, first: usize, end: usize) -> bool {
        (self.tip_at(end) - self.tip_at(first)).abs()
            < RESTS * (self.head_at(end) - self.head_at(first)).abs()
    }

    /// Blocks of points from one point to another, in each of which the head moves by `block_m`.
    fn blocks(&self, from: usize, to: usize) -> impl Iterator<Item = RestBlock> + '_ {
        let mut first = from;
        std::iter::from_fn(move || {
            let start_m = self.head_at(first);
            let end = (first + 1..to).find(|i| (self.head_at(*i) - start_m).abs() >= self.block_m)?;
            let block = RestBlock { first, end, rests: self.rests_between(first, end) };
            first = end;
            Some(block)
        })
    }

    /// Frame at which the tip leaves: the frame `end`, where its marker leaves its place, or a later one if
    /// the tip rests on. `None` if it rests up to the frame `last`.
    fn find_departure(&self, end: f64, last: f64, power: f64) -> Option<f64> {
        if self.head.is_empty() || self.tip.is_empty() {
            return Some(end);
        }
        let points = self.tip.len();
        let from = index_at_frame(self.tip, end).min(points - 1);
        let to = index_at_frame(self.tip, last.max(0.0)).min(points);
        let near: Vec<RestBlock> = self.blocks(from, to).take(COMPARED_BLOCKS).collect();
        let still = near.iter().filter(|block| block.rests).count();
        let is_rest = near.len() == COMPARED_BLOCKS
            && 2 * still > COMPARED_BLOCKS
            && self.rests_between(from, near[COMPARED_BLOCKS - 1].end);
        if !is_rest {
            return Some(end);
        }
        // the tip leaves where most blocks before are rests, and most blocks after are not
        let blocks: Vec<RestBlock> = self.blocks(from, to).collect();
        let mut wrong = blocks.iter().filter(|block| block.rests).count();
        let (mut fewest, mut leaves) = (wrong, 0);
        for (k, block) in blocks.iter().enumerate() {
            wrong = if block.rests { wrong - 1 } else { wrong + 1 };
            if wrong < fewest {
                (fewest, leaves) = (wrong, k + 1);
            }
        }
        let after = blocks.get(leaves)?;
        let moves_on =
            blocks.get(leaves + COMPARED_BLOCKS).or(blocks.last()).map_or(to - 1, |block| block.end);
        if self.rests_between(after.first, moves_on) {
            return Some(end);
        }
        // the marker moves along a line with the head; the tip leaves where the marker leaves the line
        let start = blocks[leaves.saturating_sub(2)].first;
        let middle = blocks[leaves.saturating_sub(1)].first.midpoint(after.first).max(start + 2);
        let line = self.fit_line(start, middle.min(points));
        let off = |i: usize| {
            let off = self.tip[i].1 - line(self.head_at(i));
            if off.abs() <= self.tolerance_m { 0.0 } else { off.signum() }
        };
        let left = |i: &usize| {
            let side = off(*i);
            side != 0.0 && (1..LEFT_FRAMES).all(|k| i + k >= points || off(i + k) == side)
        };
        let Some(outside) = (middle..points).find(left) else { return Some(end) };
        let place = line(self.head_at(outside));
        Some(departure_frame(self.tip, outside, Some(outside + 1), place, power))
    }

    /// Least-squares line of the position of the tip over that of the head.
    fn fit_line(&self, first: usize, end: usize) -> impl Fn(f64) -> f64 {
        let pairs = || (first..end).map(|i| (self.head_at(i), self.tip[i].1));
        let count = (end - first).max(1) as f64;
        let mean = pairs().fold([0.0; 2], |sum, (h, x)| [sum[0] + h / count, sum[1] + x / count]);
        let moments = pairs().fold([0.0; 2], |sum, (h, x)| {
            let h = h - mean[0];
            [sum[0] + h * h, sum[1] + h * (x - mean[1])]
        });
        let slope = if moments[0] > 0.0 { moments[1] / moments[0] } else { 0.0 };
        move |h| mean[1] + slope * (h - mean[0])
    }
}
