//! Isolated points far from what their neighbours predict: the tracker has jumped away for one frame and come
//! back.
//!
//! A point counts when all of this holds, so that neither chatter within a few frames of a cycle nor a kink,
//! a jump or a flip of the blade does:
//! - it misses the cubic through its four neighbours by more than the noise and the step explain;
//! - it lies on the same side of the straight lines through the two points before and the two points after it
//!   (a kink lies on one of them), and these agree about its place (on either side of a jump they do not);
//! - the points around it do not miss their own neighbours nearly as much (in chatter and where the noise is
//!   high they do).
//!
//! A point with a missing frame within two frames of it is not judged.

use super::finding::{Check, QualityFinding, Severity};
use super::measurement::{ChannelQuality, MeasuredColumn, Optics};
use crate::recording::FrameGrid;

/// Weight of the nearer two neighbours in the cubic through four, of 6; the further two have -1.
const NEARER: f64 = 4.0;
/// Sum of the weights.
const WEIGHTS: f64 = 6.0;
/// Standard deviation of a miss in white noise of standard deviation 1: `sqrt(1 + (16 + 16 + 1 + 1)/36)`.
const MISS_SD: f64 = 1.394_433_377_556_792_8;
/// Misses of white noise beyond this many of their standard deviations: 2 in 1e9 points.
const BEYOND_NOISE: f64 = 6.0;
/// Steps that rounding may move a point: flicker between neighbouring values is none of an outlier.
const BEYOND_STEPS: f64 = 2.0;
/// Least miss, m: a tenth of a pixel of the usual 20 um, which no tracker holds in every frame.
const LEAST_MISS_M: f64 = 2e-6;
/// Least miss in pixels, where the scale is known.
const LEAST_MISS_PX: f64 = 0.1;
/// Part of the miss by which the lines from both sides must be missed, and within which they must agree.
const BOTH_SIDES: f64 = 0.5;
/// Standard deviation of the difference of the two lines in white noise: `sqrt(2 (4 + 1))`, taken three
/// times.
const LINES_SD: f64 = 9.5;
/// Times by which it must miss more than any point around it: six misses of white noise reach 3 of their
/// standard deviations once in 60.
const MORE_THAN_AROUND: f64 = 4.0;
/// Frames before and after whose own neighbours do not include the point.
const AROUND: std::ops::RangeInclusive<usize> = 3..=5;
/// Share of outliers that a spectrum does not notice; each is an impulse that lifts all of its noise.
const MANY_OUTLIERS: f64 = 1e-3;

/// Frames of the outliers in a column, in order; `metres_per_pixel` where known.
pub fn outlier_frames(
    samples: &[Option<f64>],
    channel: &ChannelQuality,
    metres_per_pixel: Option<f64>,
) -> Vec<usize> {
    let Some(noise_m) = channel.noise_m else { return vec![] };
    let by_step = BEYOND_STEPS * channel.step_m.unwrap_or(0.0);
    let by_pixel = LEAST_MISS_PX * metres_per_pixel.unwrap_or(0.0);
    let least_m = (BEYOND_NOISE * MISS_SD * noise_m).max(by_step).max(by_pixel).max(LEAST_MISS_M);
    let candidates =
        samples.windows(5).enumerate().filter_map(|(before, w)| Some((before + 2, distance_from_cubic(w)?)));
    let far = candidates.filter(|(_, miss)| miss.abs() > least_m);
    far.filter(|&(frame, miss)| is_isolated(samples, frame, miss, noise_m)).map(|(frame, _)| frame).collect()
}

/// How far the middle of five frames is from the cubic through the others.
fn distance_from_cubic(five: &[Option<f64>]) -> Option<f64> {
    match *five {
        [Some(a), Some(b), Some(c), Some(d), Some(e)] => Some(c - (NEARER * (b + d) - (a + e)) / WEIGHTS),
        _ => None,
    }
}

fn is_isolated(samples: &[Option<f64>], frame: usize, miss_m: f64, noise_m: f64) -> bool {
    lies_off_both_lines(samples, frame, miss_m, noise_m).unwrap_or(false)
        && is_calm_around(samples, frame, miss_m)
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

/// Whether every point around is well predicted by its own neighbours; false where none can be judged.
fn is_calm_around(samples: &[Option<f64>], frame: usize, miss_m: f64) -> bool {
    let miss_at =
        |centre: Option<usize>| distance_from_cubic(samples.get(centre?.checked_sub(2)?..centre? + 3)?);
    let around =
        AROUND.flat_map(|apart| [frame.checked_sub(apart), frame.checked_add(apart)]).filter_map(miss_at);
    let largest = around.map(f64::abs).reduce(f64::max);
    largest.is_some_and(|largest| miss_m.abs() > MORE_THAN_AROUND * largest)
}

/// The outliers of a column as a finding.
pub(super) fn check_outliers(
    column: &MeasuredColumn,
    grid: FrameGrid,
    optics: &Optics,
) -> Option<QualityFinding> {
    let frames = outlier_frames(column.samples, column.quality, optics.metres_per_pixel);
    let first = *frames.first()?;
    let many = frames.len() as f64 > MANY_OUTLIERS * grid.frames as f64;
    let severity = if many { Severity::Caution } else { Severity::Note };
    let words = format!(
        "{} isolated outliers, the first in frame {first} at {:.6} s",
        frames.len(),
        grid.time_s(first)
    );
    let advice = "the tracker jumped away and came back: correct these points in it, or delete them there";
    Some(
        QualityFinding::new(Check::Outliers, severity, frames.len() as f64, "frames", words)
            .with_advice(advice)
            .on_channel(column.name),
    )
}
