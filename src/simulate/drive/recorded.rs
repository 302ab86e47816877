//! The head's motion from a recording.

use super::Spline;
use crate::recording::Recording;

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
    Ok(Spline::smoothed(&recording.grid(), &points))
}
