//! Instants of a stroke found in a recording: the head turns, the tip stops, the deflection flips, the tip
//! slips again.

use super::flip::{self, Around, Flip};
use super::{Anchor, Channel};
use crate::recording::Recording;

/// Least return of the head after a turn, m: one pixel of the usual 20 um, so that jitter of a resting head
/// is none.
const LEAST_RETURN_M: f64 = 20e-6;
/// Least return in units of the tracking noise: two extremes of white noise in 1e5 frames are about 9 apart.
const RETURN_NOISES: f64 = 12.0;
/// Least return as a share of the head's whole travel, so that vibration of the drive is no turn.
const RETURN_TRAVEL: f64 = 0.005;
/// Turns are timed by a parabola through the frames within this many returns of the extremum.
const FIT_RETURNS: f64 = 4.0;
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

/// The instants of one turn of the head; times in s of the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reversal {
    /// The head turns.
    pub reversal_s: f64,
    /// The tip has stopped; `None` if it did so before the recording, or not at all.
    pub hold_s: Option<f64>,
    /// The tip slips again; `None` if it does so after the recording, or did not hold.
    pub release_s: Option<f64>,
    /// The deflection changes sides; `None` where the tip is not seen to slip again or the deflection changes
    /// by no more than noise.
    pub flip: Option<Flip>,
}

impl Reversal {
    /// End of the flip and of the tip's rest, whichever is later, s: from then on the blade trails on its new
    /// side.
    #[must_use]
    pub fn settled_s(&self) -> Option<f64> {
        Some(self.flip?.end_s.max(self.release_s?))
    }
}

/// Every turn of the head that a recording shows, in order of time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Instants {
    /// The turns.
    pub reversals: Vec<Reversal>,
}

impl Instants {
    /// Finds the turns of the head and, around each, the interval in which the tip stays in its place.
    #[must_use]
    pub fn find(recording: &Recording) -> Self {
        let rate = recording.grid().frame_rate_hz;
        let head = Trace::new(&recording.traces().head_x_m);
        let tip = Trace::new(&recording.traces().tip_x_m);
        let time_s = |frame: f64| recording.grid().start_s + frame / rate;
        let turns = turns(&head);
        let next_turn = |i: usize| turns.get(i + 1).map_or(f64::INFINITY, |next| next.frame);
        let deflection = points(&Channel::Deflection.samples(recording));
        let noise_m = head.noise_m.hypot(tip.noise_m);
        let reversals = turns.iter().enumerate().map(|(i, turn)| {
            let hold = longest_hold(&head, &tip, turn);
            let (start, end) = hold.map_or((None, None), |hold| (hold.start, hold.end));
            let around =
                end.map(|release| Around { turn: turn.frame, hold: start, release, next_turn: next_turn(i) });
            let flip = around.and_then(|around| flip::find(&deflection, noise_m, &around));
            let flip = flip.map(|(start, end)| Flip { start_s: time_s(start), end_s: time_s(end) });
            Reversal {
                reversal_s: time_s(turn.frame),
                hold_s: start.map(time_s),
                release_s: end.map(time_s),
                flip,
            }
        });
        Self { reversals: reversals.collect() }
    }

    /// When the head of a recording turns first, s; `None` where it does not.
    pub(crate) fn first_turn_s(recording: &Recording) -> Option<f64> {
        Self::find(recording).time_s(Anchor::Reversal, 1).ok()
    }

    /// Time of an instant of the `reversal`-th turn (counted from 1), s.
    ///
    /// # Errors
    /// What was found instead, in words.
    pub fn time_s(&self, anchor: Anchor, reversal: usize) -> Result<f64, String> {
        let Some(found) = reversal.checked_sub(1).and_then(|index| self.reversals.get(index)) else {
            return Err(match self.reversals.len() {
                0 => "the head does not turn in it".to_owned(),
                1 => "1 reversal was found".to_owned(),
                n => format!("{n} reversals were found"),
            });
        };
        match anchor {
            Anchor::Reversal => Ok(found.reversal_s),
            Anchor::Hold => found.hold_s.ok_or_else(|| {
                "the tip does not come to rest there, or did so before the recording".to_owned()
            }),
            Anchor::Release => found.release_s.ok_or_else(|| NO_RELEASE.to_owned()),
            Anchor::Flip => found.flip.map(|flip| flip.start_s).ok_or_else(|| no_flip(found).to_owned()),
        }
    }

    /// End of the flip of the `reversal`-th turn (counted from 1) and of the tip's rest there, whichever is
    /// later, s.
    ///
    /// # Errors
    /// As [`Self::time_s`] of [`Anchor::Flip`].
    pub fn settled_s(&self, reversal: usize) -> Result<f64, String> {
        self.time_s(Anchor::Flip, reversal)?;
        let found = reversal.checked_sub(1).and_then(|index| self.reversals.get(index));
        found.and_then(Reversal::settled_s).ok_or_else(|| NO_RELEASE.to_owned())
    }
}

const NO_RELEASE: &str = "the tip does not rest there and then leave its place";

fn no_flip(found: &Reversal) -> &'static str {
    if found.release_s.is_none() {
        NO_RELEASE
    } else {
        "the deflection changes there by no more than its noise, or is tracked too little after the tip slips again"
    }
}

/// The tracked frames of a channel and what their noise is.
struct Trace {
    /// Frame and position, m.
    points: Vec<(usize, f64)>,
    noise_m: f64,
    step_m: f64,
}

impl Trace {
    fn new(samples: &[Option<f64>]) -> Self {
        let points = points(samples);
        let noise_m = noise(&points);
        let steps = points.windows(2).map(|w| (w[1].1 - w[0].1).abs()).filter(|step| *step > 0.0);
        let step_m = steps.fold(f64::INFINITY, f64::min);
        Self { points, noise_m, step_m: if step_m.is_finite() { step_m } else { 0.0 } }
    }

    /// Index of the first point at or after a frame.
    fn at(&self, frame: f64) -> usize {
        self.points.partition_point(|p| (p.0 as f64) < frame)
    }
}

/// Frame and position, m, of the tracked frames.
fn points(samples: &[Option<f64>]) -> Vec<(usize, f64)> {
    // growing it would take a fifth of the search for instants
    let mut points = Vec::with_capacity(samples.len());
    points.extend(samples.iter().enumerate().filter_map(|(frame, x)| x.map(|x| (frame, x))));
    points
}

/// Standard deviation of white noise on a smooth path, from fourth differences over frames in a row:
/// polynomials up to the third degree drop out.
fn noise(points: &[(usize, f64)]) -> f64 {
    /// Fourth differences of white noise have 1 + 16 + 36 + 16 + 1 times its variance.
    const GAIN: f64 = 70.0;
    /// Median of |x| of a standard normal variable.
    const NORMAL_MEDIAN: f64 = 0.674_489_75;
    let in_a_row = points.windows(5).filter(|w| w[4].0 - w[0].0 == 4);
    let mut differences = Vec::with_capacity(points.len());
    differences
        .extend(in_a_row.map(|w| (w[0].1 - 4.0 * w[1].1 + 6.0 * w[2].1 - 4.0 * w[3].1 + w[4].1).abs()));
    median(&mut differences).map_or(0.0, |m| m / (NORMAL_MEDIAN * GAIN.sqrt()))
}

pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// A turn of the head: its frame (a real number) and the frames of the parabola that timed it.
struct Turn {
    frame: f64,
    first: usize,
    last: usize,
}

/// Extrema from which the head returns by more than noise, jitter and vibration do.
fn turns(head: &Trace) -> Vec<Turn> {
    let smooth = smoothed(&head.points);
    let (low, high) = range(&smooth);
    let least = LEAST_RETURN_M.max(RETURN_NOISES * head.noise_m).max(RETURN_TRAVEL * (high - low));
    extrema(&smooth, least)
        .into_iter()
        .map(|index| refine(head, &smooth, index, FIT_RETURNS * least))
        .collect()
}

/// Smallest and largest; the wrong way round when there is none.
fn range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)))
}

/// Medians of three points: an outlier of a single frame cannot make an extremum, and a turn is far longer.
fn smoothed(points: &[(usize, f64)]) -> Vec<f64> {
    let value = |i: usize| points[i].1;
    let last = points.len().saturating_sub(1);
    let middle = |i: usize| {
        let (a, b, c) = (value(i.saturating_sub(1)), value(i), value((i + 1).min(last)));
        a.max(b).min(a.min(b).max(c))
    };
    (0..points.len()).map(middle).collect()
}

/// Indices of alternating maxima and minima, each followed by a return of at least `least` and preceded by an
/// approach of as much.
fn extrema(values: &[f64], least: f64) -> Vec<usize> {
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

/// Times an extremum by the vertex of a parabola through the frames within `reach_m` of it.
fn refine(head: &Trace, smooth: &[f64], index: usize, reach_m: f64) -> Turn {
    let near = |i: &usize| (smooth[*i] - smooth[index]).abs() <= reach_m;
    let first = (0..=index).rev().take_while(near).last().unwrap_or(index);
    let last = (index..smooth.len()).take_while(near).last().unwrap_or(index);
    let points = &head.points[first..=last];
    let (start, end) = (head.points[first].0, head.points[last].0);
    let plain = Turn { frame: head.points[index].0 as f64, first: start, last: end };
    match vertex(points) {
        Some(frame) if frame >= start as f64 && frame <= end as f64 => Turn { frame, ..plain },
        _ => plain,
    }
}

/// Frame of the vertex of the least-squares parabola through the points.
fn vertex(points: &[(usize, f64)]) -> Option<f64> {
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

/// An interval in which the tip keeps its place, in frames (real numbers); an end outside the recording is
/// `None`.
struct Hold {
    start: Option<f64>,
    end: Option<f64>,
    points: usize,
}

fn longest_hold(head: &Trace, tip: &Trace, turn: &Turn) -> Option<Hold> {
    let tolerance_m = tolerance(tip, turn);
    let half = (turn.last - turn.first) as f64 / 2.0;
    let seeds = (-SEEDS..=SEEDS).map(|k| turn.frame + half * k as f64 / SEEDS as f64);
    let holds = seeds.filter_map(|seed| hold_around(head, tip, tip.at(seed), tolerance_m));
    holds.reduce(|best, hold| if hold.points > best.points { hold } else { best })
}

/// How far the tip may stray from its place: by the noise in the middle third about the turn, where the drive
/// is slow and the tip calm.
fn tolerance(tip: &Trace, turn: &Turn) -> f64 {
    let sixth = (turn.last - turn.first) as f64 / 6.0;
    let near = &tip.points[tip.at(turn.frame - sixth)..tip.at(turn.frame + sixth)];
    let local = Some(noise(near)).filter(|_| near.len() >= 4 * SEED_HALF);
    let noise_m = local.map_or(tip.noise_m, |local| local.min(tip.noise_m));
    LEAST_TOLERANCE_M.max(HOLD_NOISES * noise_m).max(if noise_m == 0.0 {
        HOLD_STEPS * tip.step_m.min(LEAST_RETURN_M * 2.0)
    } else {
        0.0
    })
}

fn hold_around(head: &Trace, tip: &Trace, seed: usize, tolerance_m: f64) -> Option<Hold> {
    let nearby =
        tip.points.get(seed.saturating_sub(SEED_HALF)..(seed + SEED_HALF + 1).min(tip.points.len()))?;
    let place = median(&mut nearby.iter().map(|p| p.1).collect::<Vec<_>>())?;
    let (first, last) = stay(tip, seed.min(tip.points.len() - 1), place, tolerance_m);
    let place = median(&mut tip.points[first..=last].iter().map(|p| p.1).collect::<Vec<_>>())?;
    let (first, last) = stay(tip, first + (last - first) / 2, place, tolerance_m);
    if !head_covers(head, tip.points[first].0, tip.points[last].0, HEAD_TOLERANCES * tolerance_m) {
        return None;
    }
    let (before, after) = (first.checked_sub(1), Some(last + 1).filter(|i| *i < tip.points.len()));
    let start = before.map(|outside| leaves(tip, outside, outside.checked_sub(1), place, HOLD_POWER));
    let end = after.map(|outside| leaves(tip, outside, Some(outside + 1), place, RELEASE_POWER));
    Some(Hold { start, end, points: last - first + 1 })
}

/// First and last point of the interval around `seed` in which the tip stays near `place`.
fn stay(tip: &Trace, seed: usize, place: f64, tolerance_m: f64) -> (usize, usize) {
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

fn head_covers(head: &Trace, first: usize, last: usize, least_m: f64) -> bool {
    let during = smoothed(&head.points[head.at(first as f64)..head.at(last as f64 + 1.0)]);
    let (low, high) = range(&during);
    high - low >= least_m
}

/// Where the path `distance = c |t - t0|^power` through two points outside the hold starts, frames.
fn leaves(tip: &Trace, outside: usize, next: Option<usize>, place: f64, power: f64) -> f64 {
    let (frame, x) = tip.points[outside];
    let frame = frame as f64;
    let Some((next_frame, next_x)) = next.and_then(|i| tip.points.get(i)) else { return frame };
    let (root, next_root) = ((x - place).abs().powf(1.0 / power), (next_x - place).abs().powf(1.0 / power));
    let towards_hold = if *next_frame as f64 > frame { -1.0 } else { 1.0 };
    let frames_back = root / (next_root - root) * (*next_frame as f64 - frame).abs();
    let frames_back =
        if next_root > root && frames_back.is_finite() { frames_back.min(MOST_EXTRAPOLATED) } else { 1.0 };
    frame + towards_hold * frames_back
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};
    use std::f64::consts::TAU;

    const RATE_HZ: f64 = 10_000.0;
    const HOLD_BEFORE_S: f64 = 0.02;
    const RELEASE_AFTER_S: f64 = 0.05;

    /// A head on a cosine of 0.5 Hz (turns at 1, 2, 3 s ...) and a tip that trails by 2 mm, holds around each
    /// turn, and is then dragged along again.
    fn stroke(start_s: f64, stop_s: f64, noise_m: f64, missing: impl Fn(usize) -> bool) -> Recording {
        let frames = ((stop_s - start_s) * RATE_HZ).round() as usize;
        let head = |t: f64| 0.018 * (1.0 - (TAU * 0.5 * t).cos());
        let tip = |t: f64| {
            let (turn, sign) = (t.round(), if t.round() as i64 % 2 == 0 { -1.0 } else { 1.0 });
            let (hold, release) = (turn - HOLD_BEFORE_S, turn + RELEASE_AFTER_S);
            let place = head(hold) - sign * 2e-3;
            // it stops as a parabola and leaves as a cube, and is far away within 20 ms
            if t < hold {
                place - sign * 40.0 * (hold - t).powi(2)
            } else if t > release {
                place - sign * 3e5 * (t - release).powi(3).min(0.1)
            } else {
                place
            }
        };
        let mut state = 7_u64;
        let mut jitter = || {
            let mut sum = 0.0;
            for _ in 0..12 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
            }
            (sum - 6.0) * noise_m
        };
        let column = |f: &dyn Fn(f64) -> f64, jitter: &mut dyn FnMut() -> f64| -> Vec<Option<f64>> {
            (0..frames)
                .map(|i| (f(start_s + i as f64 / RATE_HZ) + jitter(), i))
                .map(|(x, i)| (!missing(i)).then_some(x))
                .collect()
        };
        let (head_x_m, tip_x_m) = (column(&head, &mut jitter), column(&tip, &mut jitter));
        let traces = Traces {
            tip_x_m,
            tip_y_m: vec![None; frames],
            head_x_m,
            head_y_m: vec![None; frames],
            ..Traces::default()
        };
        Recording::new("r", FrameGrid { start_s, frame_rate_hz: RATE_HZ, frames }, traces, true).unwrap()
    }

    /// Within `frames` of the truth.
    fn assert_near(found_s: Option<f64>, truth_s: f64, frames: f64) {
        let found_s = found_s.unwrap_or_else(|| panic!("nothing found near {truth_s} s"));
        assert!((found_s - truth_s).abs() * RATE_HZ <= frames, "found {found_s} s, expected {truth_s} s");
    }

    #[test]
    fn noiseless_instants_are_found_to_a_frame() {
        let found = Instants::find(&stroke(0.8, 3.2, 0.0, |_| false)).reversals;
        assert_eq!(found.len(), 3);
        for (turn, reversal) in [1.0, 2.0, 3.0].into_iter().zip(&found) {
            assert_near(Some(reversal.reversal_s), turn, 0.1);
            assert_near(reversal.hold_s, turn - HOLD_BEFORE_S, 1.0);
            assert_near(reversal.release_s, turn + RELEASE_AFTER_S, 1.0);
        }
    }

    #[test]
    fn tracking_noise_of_a_tenth_of_a_pixel_moves_them_by_a_few_frames() {
        let found = Instants::find(&stroke(0.8, 1.4, 2e-6, |_| false)).reversals;
        assert_eq!(found.len(), 1);
        assert_near(Some(found[0].reversal_s), 1.0, 5.0);
        assert_near(found[0].hold_s, 1.0 - HOLD_BEFORE_S, 4.0);
        assert_near(found[0].release_s, 1.0 + RELEASE_AFTER_S, 4.0);
    }

    #[test]
    fn gaps_do_not_hide_them() {
        let found =
            Instants::find(&stroke(0.8, 1.4, 2e-6, |i| i % 7 == 3 || (1900..2100).contains(&i))).reversals;
        assert_eq!(found.len(), 1);
        assert_near(Some(found[0].reversal_s), 1.0, 10.0);
        assert_near(found[0].release_s, 1.0 + RELEASE_AFTER_S, 5.0);
    }

    #[test]
    fn a_release_after_the_end_is_not_found() {
        let found = Instants::find(&stroke(0.8, 1.04, 2e-6, |_| false)).reversals;
        assert_eq!(found.len(), 1);
        assert!(found[0].hold_s.is_some() && found[0].release_s.is_none());
    }

    #[test]
    fn a_head_that_rests_or_jitters_does_not_turn() {
        let still = |x: f64| {
            (0..4000).map(|i| Some(x + 2e-6 * f64::from(i * 7919 % 13 - 6) / 4.0)).collect::<Vec<_>>()
        };
        let traces = Traces {
            tip_x_m: still(0.0),
            tip_y_m: vec![None; 4000],
            head_x_m: still(1.0),
            head_y_m: vec![None; 4000],
            ..Traces::default()
        };
        let recording = Recording::new(
            "r",
            FrameGrid { start_s: 0.0, frame_rate_hz: RATE_HZ, frames: 4000 },
            traces,
            true,
        )
        .unwrap();
        assert_eq!(Instants::find(&recording), Instants::default());
    }

    #[test]
    fn a_tip_that_follows_the_head_does_not_hold() {
        let traces = stroke(0.8, 1.4, 2e-6, |_| false).traces().clone();
        let follower = Traces { tip_x_m: traces.head_x_m.clone(), ..traces };
        let recording = Recording::new(
            "r",
            FrameGrid { start_s: 0.8, frame_rate_hz: RATE_HZ, frames: 6000 },
            follower,
            true,
        )
        .unwrap();
        let found = Instants::find(&recording).reversals;
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].hold_s, found[0].release_s), (None, None));
    }

    #[test]
    fn chatter_before_and_after_is_not_taken_for_the_hold() {
        let calm = stroke(0.8, 1.4, 2e-6, |_| false);
        let mut traces = calm.traces().clone();
        for (i, x) in traces.tip_x_m.iter_mut().enumerate() {
            let t = 0.8 + i as f64 / RATE_HZ;
            let since_rest = (1.0 - HOLD_BEFORE_S - t).max(t - 1.0 - RELEASE_AFTER_S - 2e-3).max(0.0);
            // sticks and slips 900 times a second, each slip 60 um, and comes to rest where the chatter ends
            *x = x.map(|x| {
                x + 60e-6 * ((since_rest * 900.0).fract() - 0.5) * f64::from(u8::from(since_rest > 0.0))
            });
        }
        let recording = Recording::new("r", calm.grid(), traces, true).unwrap();
        let found = Instants::find(&recording).reversals;
        assert_eq!(found.len(), 1);
        assert_near(found[0].hold_s, 1.0 - HOLD_BEFORE_S, 5.0);
        assert_near(found[0].release_s, 1.0 + RELEASE_AFTER_S, 5.0);
    }

    #[test]
    fn nothing_tracked_is_nothing_found() {
        let recording = stroke(0.8, 1.4, 0.0, |_| true);
        assert_eq!(Instants::find(&recording), Instants::default());
    }
}
