//! The head's motion from a recording.

use super::Spline;
use crate::recording::Recording;

/// Time over which frames are averaged before they are smoothed, and between knots of the spline, s. The
/// noise of a tracker is correlated over a few frames (vibration, sub-pixel bias), and cross-validation would
/// take what is common to neighbours for motion. A head moves smoothly over it.
const BLOCK_S: f64 = 4e-3;
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

/// The head's `x` as a smooth curve through the frames in which it was tracked.
///
/// [`Spline::covariance_times`] says how well it is known. Within some ten milliseconds of either end of the
/// recording the acceleration is less certain by a factor of ten, so a run should keep away from them.
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
    let grid = recording.grid();
    let block = (BLOCK_S * grid.frame_rate_hz).round() as usize;
    let (first, last) = (points[0].0, points[points.len() - 1].0);
    let block = if block < 3 || (last - first) / block < FEWEST_FRAMES { 1 } else { block };
    let knots: Vec<usize> =
        (first..last).step_by(block).filter(|knot| last - knot > block / 2).chain([last]).collect();
    Ok(Spline::smoothed(&grid, &points, block, &knots))
}
