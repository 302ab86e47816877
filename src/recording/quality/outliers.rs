//! Points far from the prediction by their neighbours: the tracker jumps away for one frame or for several
//! and comes back.
//!
//! A single point is an outlier if all three conditions hold. The conditions exclude fast chatter, and kinks,
//! jumps and flips of the blade:
//! - its distance from the cubic through its four neighbours exceeds what noise and step explain;
//! - it lies on the same side of two straight lines, through the two points before and the two points after
//!   it (at a kink it lies on one of them), and both lines agree on its place (at a jump they do not);
//! - the points around it are much closer to their own cubics (in chatter or strong noise they are not).
//!
//! The neighbours of a single point are the two tracked points before it and the two after it. It is not
//! judged if they span more than [`LONGEST_SPAN`] frames. Several points in a row are outliers between two
//! jumps of about the same size in opposite directions, if no other jump of more than a quarter of this size
//! is near and the point afterwards continues its earlier path.

use super::measurement::ChannelQuality;
use crate::recording::noise::differences::{difference_across, fraction_beside_jump};
use std::ops::Range;

/// Largest number of frames from the first to the last of the four neighbours of a point: without a gap there
/// are four. Over a longer time the motion is no cubic.
const LONGEST_SPAN: usize = 9;
/// Smallest distance of an outlier from the cubic through its neighbours, in standard deviations of this
/// distance in white noise. White noise exceeds it at 2 of 1e9 points.
const BEYOND_NOISE: f64 = 6.0;
/// Smallest distance of an outlier from the cubic through its neighbours, in steps of the positions: flicker
/// between adjacent values is not an outlier.
const BEYOND_STEPS: f64 = 2.0;
/// Smallest distance of an outlier from the cubic through its neighbours, m: a tenth of a pixel of the usual
/// size, 20 um. No tracker is that accurate in every frame.
const LEAST_MISS_M: f64 = 2e-6;
/// Smallest distance of an outlier from the cubic through its neighbours, in pixels, if the scale is known.
const LEAST_MISS_PX: f64 = 0.1;
/// The distance of an outlier from each of the two straight lines through its neighbours is at least this
/// fraction of its distance from the cubic. The values of the two lines differ by at most this fraction, plus
/// noise.
const BOTH_SIDES: f64 = 0.5;
/// Largest difference between the values of the two lines that noise explains, in standard deviations of this
/// difference in white noise.
const LINES_AGREE: f64 = 3.0;
/// Smallest ratio of an outlier's distance from its cubic to the largest such distance of the points around
/// it. In white noise, the largest of six such distances reaches 3 standard deviations once in 60 cases.
const MORE_THAN_AROUND: f64 = 4.0;
/// Distances, in tracked points, from an outlier to the points around it: the nearest points whose own cubic
/// does not use the outlier.
const AROUND: std::ops::RangeInclusive<usize> = 3..=5;
/// Standard deviation of a third difference of white noise of standard deviation 1: `sqrt(1 + 9 + 9 + 1)`.
const THIRD_DIFFERENCE_SD: f64 = 4.472_135_954_999_58;
/// Largest number of frames between a jump away and the jump back. Motion of the blade itself moves it away
/// and back in a longer time.
const LONGEST_ABSENCE: usize = 30;
/// Smallest size of the third difference next to a jump, as a fraction of the third difference at the jump
/// ([`fraction_beside_jump`]).
const BESIDE_JUMP: f64 = 0.25;
/// Number of frames before a jump away, and after the jump back, in which no other jump may occur.
const CALM_FRAMES: usize = 4;

/// Frames of the outliers in a column, in order; `metres_per_pixel` is given if known.
pub fn outlier_frames(
    samples: &[Option<f64>],
    channel: &ChannelQuality,
    metres_per_pixel: Option<f64>,
) -> Vec<usize> {
    let Some(noise_m) = channel.noise_m else { return vec![] };
    let by_step = BEYOND_STEPS * channel.step_m.or_else(|| smallest_movement(samples)).unwrap_or(0.0);
    let by_pixel = LEAST_MISS_PX * metres_per_pixel.unwrap_or(0.0);
    let at_least_m = |noise_m: f64| (BEYOND_NOISE * noise_m).max(by_step).max(by_pixel).max(LEAST_MISS_M);
    let points = TrackedPoints::new(samples);
    let far = (0..points.values.len()).filter_map(|point| {
        let (miss, sd) = points.distance_from_cubic(point)?;
        (miss.abs() > at_least_m(sd * noise_m)).then_some((point, miss))
    });
    let isolated = far.filter(|&(point, miss)| {
        points.lies_off_both_lines(point, miss, noise_m).unwrap_or(false)
            && points.is_calm_around(point, miss)
    });
    let mut frames: Vec<usize> = isolated.map(|(point, _)| points.frames[point]).collect();
    let least_third_m =
        (BEYOND_NOISE * THIRD_DIFFERENCE_SD * noise_m).max(2.0 * at_least_m(UNBROKEN_SD * noise_m));
    frames.extend(find_absences(samples, least_third_m).into_iter().flatten());
    frames.sort_unstable();
    frames.dedup();
    frames
}

/// Smallest movement between neighbouring frames that is not zero. It is used as the step of a column that
/// moves too rarely for a common divisor.
pub(super) fn smallest_movement(samples: &[Option<f64>]) -> Option<f64> {
    let moves = samples.windows(2).filter_map(|w| Some((w[1]? - w[0]?).abs()));
    moves.filter(|&size| size > 0.0).reduce(f64::min)
}

/// Runs of two and more frames between a jump away and the jump back.
fn find_absences(samples: &[Option<f64>], least_m: f64) -> Vec<Range<usize>> {
    let third = |frame: usize| difference_across(samples, frame);
    let size = |frame: usize| third(frame).map_or(0.0, f64::abs);
    let is_jump = |frame: &usize| {
        let own = size(*frame);
        own > least_m && own >= size(frame + 1) && own >= size(frame - 1)
    };
    let is_beside = |jump: usize, outer: usize| {
        let fraction = fraction_beside_jump(samples, jump, outer);
        fraction.is_some_and(|fraction| (BESIDE_JUMP..1.0 - BESIDE_JUMP).contains(&fraction))
    };
    let returns = |away: usize, back: usize| {
        let (out, home) = (third(away)?, third(back)?);
        let least = out.abs().min(home.abs());
        let before = away.saturating_sub(CALM_FRAMES)..away - 1;
        let mut others = before.chain(away + 2..back - 1).chain(back + 2..back + CALM_FRAMES);
        Some(
            (2..=LONGEST_ABSENCE).contains(&(back - away))
                && (out + home).abs() <= BOTH_SIDES * least
                && is_beside(away, away - 1)
                && is_beside(back, back + 1)
                && others.all(|frame| MORE_THAN_AROUND * size(frame) < least),
        )
    };
    let jumps: Vec<usize> = (2..samples.len()).filter(is_jump).collect();
    let (mut absences, mut last) = (vec![], 0);
    for pair in jumps.windows(2) {
        // (after a jump back, the point is tracked until it jumps away again)
        if pair[0] > last && returns(pair[0], pair[1]).unwrap_or(false) {
            absences.push(pair[0]..pair[1]);
            last = pair[1];
        }
    }
    absences
}

/// Standard deviation of the distance of a point from the cubic through its neighbours, without a gap, in
/// white noise of standard deviation 1: `sqrt(1 + (16 + 16 + 1 + 1)/36)`.
const UNBROKEN_SD: f64 = 1.394_433_377_556_792_8;

/// The tracked positions of a column, with their frames.
struct TrackedPoints {
    frames: Vec<usize>,
    values: Vec<f64>,
    /// Weights for a point without a gap around it.
    unbroken: CubicWeights,
}

/// Distances in frames from a point to its two neighbours on either side, without a gap.
const UNBROKEN: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];

/// Weights of the neighbours of a point in the value of the cubic through them.
#[derive(Clone, Copy)]
struct CubicWeights {
    weights: [f64; 4],
    /// Standard deviation of the distance of the point from the cubic in white noise of standard deviation 1.
    sd: f64,
}

impl CubicWeights {
    /// Weights of neighbours with the distances `at` from the point, in frames.
    fn new(at: [f64; 4]) -> Self {
        let weight = |i: usize| {
            let others = (0..4).filter(|other| *other != i);
            others.map(|other| at[other] / (at[other] - at[i])).product::<f64>()
        };
        let weights = [0, 1, 2, 3].map(weight);
        Self { weights, sd: weights.iter().fold(1.0, |variance, weight| variance + weight * weight).sqrt() }
    }
}

impl TrackedPoints {
    fn new(samples: &[Option<f64>]) -> Self {
        let (mut frames, mut values) = (Vec::with_capacity(samples.len()), Vec::with_capacity(samples.len()));
        for (frame, x) in samples.iter().enumerate().filter_map(|(frame, x)| Some((frame, (*x)?))) {
            frames.push(frame);
            values.push(x);
        }
        Self { frames, values, unbroken: CubicWeights::new(UNBROKEN) }
    }

    /// Distances in frames from a point to its two neighbours on either side; `None` if they span too much.
    fn neighbours(&self, point: usize) -> Option<[f64; 4]> {
        let (first, last) = (point.checked_sub(2)?, point + 2);
        let span = self.frames.get(last)? - self.frames[first];
        let apart = |other: usize| self.frames[other] as f64 - self.frames[point] as f64;
        (span <= LONGEST_SPAN).then(|| [apart(first), apart(point - 1), apart(point + 1), apart(last)])
    }

    /// Distance of a point from the cubic through its neighbours, and the standard deviation of this distance
    /// in white noise of standard deviation 1.
    fn distance_from_cubic(&self, point: usize) -> Option<(f64, f64)> {
        let is_unbroken = self.frames.get(point + 2)? - self.frames[point.checked_sub(2)?] == 4;
        let own = || self.neighbours(point).map(CubicWeights::new);
        let CubicWeights { weights, sd } = if is_unbroken { self.unbroken } else { own()? };
        let values = [point - 2, point - 1, point + 1, point + 2].map(|neighbour| self.values[neighbour]);
        let cubic = values.iter().zip(weights).fold(0.0, |cubic, (value, weight)| cubic + weight * value);
        Some((self.values[point] - cubic, sd))
    }

    fn lies_off_both_lines(&self, point: usize, miss_m: f64, noise_m: f64) -> Option<bool> {
        let [far_before, before, after, far_after] = self.neighbours(point)?;
        // value of the line through two neighbours, and its variance in white noise of variance 1
        let line = |(far, far_value): (f64, f64), (near, near_value): (f64, f64)| {
            let share = far / (far - near);
            (share * near_value + (1.0 - share) * far_value, share * share + (1.0 - share) * (1.0 - share))
        };
        let values = &self.values;
        let earlier = line((far_before, values[point - 2]), (before, values[point - 1]));
        let later = line((far_after, values[point + 2]), (after, values[point + 1]));
        let off = |line: f64| (values[point] - line) * miss_m.signum() >= BOTH_SIDES * miss_m.abs();
        let by_noise = LINES_AGREE * (earlier.1 + later.1).sqrt() * noise_m;
        let agree = (earlier.0 - later.0).abs() <= BOTH_SIDES * miss_m.abs() + by_noise;
        Some(off(earlier.0) && off(later.0) && agree)
    }

    /// Whether all points around a point are much closer to their own cubics than this point is to its cubic,
    /// from which it has the distance `miss_m`; false if no point around it has a cubic. Motion misses the
    /// cubic in proportion to the product of the distances of the neighbours, so a miss with nearer
    /// neighbours counts for more.
    fn is_calm_around(&self, point: usize, miss_m: f64) -> bool {
        let reach = |point: usize| Some(self.neighbours(point)?.iter().product::<f64>().abs());
        let Some(own) = reach(point) else { return false };
        let around = AROUND.flat_map(|apart| [point.checked_sub(apart), point.checked_add(apart)]);
        let misses = around.filter_map(|other| {
            Some(self.distance_from_cubic(other?)?.0.abs() * (own / reach(other?)?).max(1.0))
        });
        misses.reduce(f64::max).is_some_and(|largest| miss_m.abs() > MORE_THAN_AROUND * largest)
    }
}
