//! The head's motion from a recording.

use super::Spline;
use crate::recording::Recording;
use crate::recording::quality::quality;

/// Why a recording does not give the head's motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HeadError {
    /// The noise of the head's positions cannot be measured.
    #[error(
        "the recording `{recording}` tracks the head's x in {found} of {frames} frames, too few in a row to measure their noise; expected at least 8 runs of four neighbouring frames: track the head through the whole stroke"
    )]
    Noise {
        /// Name of the recording.
        recording: String,
        /// Frames with the head's x.
        found: usize,
        /// Frames.
        frames: usize,
    },
}

/// The head's `x` as a smoothing spline over the frames in which it was tracked; a gap is bridged by one cubic.
///
/// The residuals are those of the recording's own noise, [as measured](crate::recording::quality::noise_floor), or of rounding to the step
/// in which the positions are written where that is coarser.
///
/// # Errors
/// [`HeadError`] when the noise cannot be measured.
pub fn head_motion(recording: &Recording) -> Result<Spline, HeadError> {
    let head_x = quality(recording, None).head_x;
    let points: Vec<(usize, f64)> = recording.traces().head_x_m.iter().enumerate().filter_map(|(frame, x)| Some((frame, (*x)?))).collect();
    let Some(noise_m) = head_x.noise_m else {
        return Err(HeadError::Noise { recording: recording.name().to_owned(), found: points.len(), frames: recording.grid().frames });
    };
    // rounding to a step is uniform over it
    let rounding_m = head_x.step_m.unwrap_or(0.0) / 12f64.sqrt();
    Ok(Spline::smoothed(&recording.grid(), &points, noise_m.max(rounding_m)))
}
