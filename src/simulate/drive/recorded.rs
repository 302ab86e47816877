//! The head's motion from a recording.

use super::Spline;
use crate::recording::Recording;
use nalgebra::{DMatrix, DVector};

/// Time over which frames are averaged into one knot, s: the noise of a tracker is correlated over a few
/// frames (vibration, sub-pixel bias), and cross-validation would take what is common to neighbours for
/// motion. A head moves smoothly over it.
const BLOCK_S: f64 = 4e-3;
/// Least share of a block's frames that makes a knot.
const LEAST_SHARE: f64 = 0.5;

/// Fewest frames with the head: cross-validation needs a few times as many points as a curve has freedoms.
const FEWEST_FRAMES: usize = 10;

/// Why a recording does not give the head's motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HeadError {
    /// The head is tracked in too few frames.
    #[error(
        "found the head's x in {found} of {frames} frames of `{recording}`, expected it in at least {FEWEST_FRAMES}: track the head through the whole run"
    )]
    Few {
        /// Name of the recording.
        recording: String,
        /// Frames with the head's x.
        found: usize,
        /// Frames.
        frames: usize,
    },
}

/// The head's `x` as a smoothing spline over the frames in which it was tracked; a gap is bridged by one
/// cubic.
///
/// The position is good to a quarter of the tracking's noise, the acceleration to a percent or two; within
/// some ten milliseconds of either end of the recording it is less certain by a factor of ten, so a run
/// should keep away from them.
///
/// # Errors
/// [`HeadError`] when the head is tracked in too few frames.
pub fn head_motion(recording: &Recording) -> Result<Spline, HeadError> {
    let points: Vec<(usize, f64)> = recording
        .traces()
        .head_x_m
        .iter()
        .enumerate()
        .filter_map(|(frame, x)| Some((frame, (*x)?)))
        .collect();
    if points.len() < FEWEST_FRAMES {
        return Err(HeadError::Few {
            recording: recording.name().to_owned(),
            found: points.len(),
            frames: recording.grid().frames,
        });
    }
    let averaged = averaged(&points, (BLOCK_S * recording.grid().frame_rate_hz).round() as usize);
    let knots = if averaged.len() < FEWEST_FRAMES { &points } else { &averaged };
    Ok(Spline::smoothed(&recording.grid(), knots))
}

/// Each block of `length` frames as one point in its middle, and one at either end of the recording, from the
/// parabola through the frames of a block's length around.
fn averaged(points: &[(usize, f64)], length: usize) -> Vec<(usize, f64)> {
    if length < 3 {
        return points.to_vec();
    }
    let half = length / 2;
    let (first, last) = (points[0].0, points[points.len() - 1].0);
    let least = (LEAST_SHARE * (2 * half + 1) as f64) as usize;
    let inner = (first + half..=last - half.min(last)).step_by(2 * half + 1).filter_map(|centre| {
        let near = between(points, centre - half, centre + half);
        (near.len() >= least).then(|| Some((centre, at(near, centre, 2)?)))?
    });
    let mut knots: Vec<(usize, f64)> = inner.collect();
    let ends = [
        (first, between(points, first, first + 2 * length)),
        (last, between(points, last.saturating_sub(2 * length), last)),
    ];
    if let Some(value) = at(ends[0].1, first, 2) {
        knots.insert(0, (first, value));
    }
    if let Some(value) = at(ends[1].1, last, 2) {
        knots.push((last, value));
    }
    knots.dedup_by_key(|knot| knot.0);
    knots
}

/// Points from one frame to another, both included.
fn between(points: &[(usize, f64)], from: usize, to: usize) -> &[(usize, f64)] {
    let place = |frame: usize| points.partition_point(|point| point.0 < frame);
    &points[place(from)..place(to + 1)]
}

/// Value at a frame of the polynomial that fits points best.
fn at(points: &[(usize, f64)], frame: usize, degree: usize) -> Option<f64> {
    let (base, span) = (points.first()?.1, points.len() as f64);
    let place = |point: &(usize, f64)| (point.0 as f64 - frame as f64) / span;
    let powers = DMatrix::from_fn(points.len(), degree + 1, |row, k| place(&points[row]).powi(k as i32));
    let values = DVector::from_iterator(points.len(), points.iter().map(|point| point.1 - base));
    // (too few points give the polynomial of least norm)
    let found = powers.svd(true, true).solve(&values, 1e-12).ok()?;
    Some(base + found[0])
}
