//! Points far from the prediction by their neighbours: the tracker jumps away for one frame or for several
//! and comes back.
//!
//! A single point is an outlier if all three conditions hold. The conditions exclude fast chatter, and
//! kinks, jumps and flips of the blade:
//! - its distance from the cubic through its four neighbours exceeds what noise and step explain;
//! - it lies on the same side of two straight lines, through the two points before and the two points after
//!   it (at a kink it lies on one of them), and both lines agree on its place (at a jump they do not);
//! - the points around it are much closer to their own cubics (in chatter or strong noise they are not).
//!
//! A single point is not judged if a frame within two frames of it is missing. Several points in a row are
//! outliers between two jumps of about the same size in opposite directions, if no other jump of more than a
//! quarter of this size is near and the point afterwards continues its earlier path.

use super::measurement::ChannelQuality;
use crate::recording::noise::differences::difference_at;

/// Weight of the two nearer neighbours in the cubic through four points; the two further ones have the weight
/// -1.
const NEARER: f64 = 4.0;
/// Sum of the four weights of the neighbours in the cubic.
const WEIGHTS: f64 = 6.0;
/// Standard deviation of the miss (the distance from the cubic) in white noise of standard deviation 1:
/// `sqrt(1 + (16 + 16 + 1 + 1)/36)`.
const MISS_SD: f64 = 1.394_433_377_556_792_8;
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
/// Three standard deviations of the difference between the values of the two lines in white noise of standard
/// deviation 1: `3 sqrt(2 (4 + 1))`.
const LINES_SD: f64 = 9.5;
/// Smallest ratio of an outlier's distance from its cubic to the largest such distance of the points around
/// it. In white noise, the largest of six such distances reaches 3 standard deviations once in 60 cases.
const MORE_THAN_AROUND: f64 = 4.0;
/// Distances, in frames, from an outlier to the points around it: the nearest points whose own cubic does not
/// use the outlier.
const AROUND: std::ops::RangeInclusive<usize> = 3..=5;
/// Standard deviation of a third difference of white noise of standard deviation 1: `sqrt(1 + 9 + 9 + 1)`.
const THIRD_DIFFERENCE_SD: f64 = 4.472_135_954_999_58;
/// Largest number of frames between a jump away and the jump back. Motion of the blade itself moves it away
/// and back in a longer time.
const LONGEST_ABSENCE: usize = 30;
/// Smallest size of the third difference next to a jump, as a fraction of the third difference at the jump.
/// Without noise, this fraction is 0.5.
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
    let least_m = (BEYOND_NOISE * MISS_SD * noise_m).max(by_step).max(by_pixel).max(LEAST_MISS_M);
    let candidates =
        samples.windows(5).enumerate().filter_map(|(before, w)| Some((before + 2, distance_from_cubic(w)?)));
    let far = candidates.filter(|(_, miss)| miss.abs() > least_m);
    let isolated = far.filter(|&(frame, miss)| {
        lies_off_both_lines(samples, frame, miss, noise_m).unwrap_or(false)
            && is_calm_around(samples, frame, miss)
    });
    let mut frames: Vec<usize> = isolated.map(|(frame, _)| frame).collect();
    let least_third_m = (BEYOND_NOISE * THIRD_DIFFERENCE_SD * noise_m).max(2.0 * least_m);
    frames.extend(find_absences(samples, least_third_m).into_iter().flatten());
    frames.sort_unstable();
    frames.dedup();
    frames
}

/// Smallest movement between neighbouring frames that is not zero. It is used as the step of a column that
/// moves too rarely for a common divisor.
fn smallest_movement(samples: &[Option<f64>]) -> Option<f64> {
    let moves = samples.windows(2).filter_map(|w| Some((w[1]? - w[0]?).abs()));
    moves.filter(|&size| size > 0.0).reduce(f64::min)
}

/// Runs of two and more frames between a jump away and the jump back. A jump of size 1 from one frame to the
/// next gives third differences of 1, -2 and 1.
fn find_absences(samples: &[Option<f64>], least_m: f64) -> Vec<std::ops::RangeInclusive<usize>> {
    let third = |frame: usize| difference_at(samples, frame + 2, 3);
    let size = |frame: usize| third(frame).map_or(0.0, f64::abs);
    let is_jump =
        |&i: &usize| size(i) > least_m && size(i) >= size(i + 1) && size(i) >= size(i.wrapping_sub(1));
    let returns = |away: usize, back: usize| {
        let (out, home) = (third(away)?, third(back)?);
        let least = out.abs().min(home.abs());
        let is_beside = |outer: f64, jump: f64| (BESIDE_JUMP..1.0 - BESIDE_JUMP).contains(&(-outer / jump));
        let before = away.saturating_sub(CALM_FRAMES)..away - 1;
        let mut others = before.chain(away + 2..back.saturating_sub(1)).chain(back + 2..back + CALM_FRAMES);
        Some(
            (2..=LONGEST_ABSENCE).contains(&(back - away))
                && (out + home).abs() <= BOTH_SIDES * least
                && is_beside(third(away - 1)?, out)
                && is_beside(third(back + 1)?, home)
                && others.all(|frame| MORE_THAN_AROUND * size(frame) < least),
        )
    };
    let jumps: Vec<usize> = (1..samples.len()).filter(is_jump).collect();
    let (mut absences, mut last) = (vec![], 0);
    for pair in jumps.windows(2) {
        // (after a jump back, the point is tracked until it jumps away again)
        if pair[0] > last && returns(pair[0], pair[1]).unwrap_or(false) {
            absences.push(pair[0] + 1..=pair[1]);
            last = pair[1];
        }
    }
    absences
}

/// Distance of the middle one of five frames from the cubic through the others.
fn distance_from_cubic(five: &[Option<f64>]) -> Option<f64> {
    match *five {
        [Some(a), Some(b), Some(c), Some(d), Some(e)] => Some(c - (NEARER * (b + d) - (a + e)) / WEIGHTS),
        _ => None,
    }
}

fn lies_off_both_lines(samples: &[Option<f64>], frame: usize, miss_m: f64, noise_m: f64) -> Option<bool> {
    let at = |index: Option<usize>| *samples.get(index?)?;
    let x = at(Some(frame))?;
    let before = 2.0 * at(frame.checked_sub(1))? - at(frame.checked_sub(2))?;
    let after = 2.0 * at(frame.checked_add(1))? - at(frame.checked_add(2))?;
    let off = |line: f64| (x - line) * miss_m.signum() >= BOTH_SIDES * miss_m.abs();
    let agree = (before - after).abs() <= BOTH_SIDES * miss_m.abs() + LINES_SD * noise_m;
    Some(off(before) && off(after) && agree)
}

/// Whether all points around a frame are much closer to their own cubics than the distance `miss_m` of the
/// frame's point from its cubic; false if no point around it has a cubic.
fn is_calm_around(samples: &[Option<f64>], frame: usize, miss_m: f64) -> bool {
    let miss = |at: Option<usize>| distance_from_cubic(samples.get(at?.checked_sub(2)?..at? + 3)?);
    let around = AROUND.flat_map(|apart| [frame.checked_sub(apart), frame.checked_add(apart)]);
    let largest = around.filter_map(miss).map(f64::abs).reduce(f64::max);
    largest.is_some_and(|largest| miss_m.abs() > MORE_THAN_AROUND * largest)
}
