//! The head's motion from a recording.

use super::HeadSpline;
use crate::recording::Recording;

/// Time over which frames are averaged before they are smoothed, and between knots of the spline, s. The
/// noise of a tracker is correlated over a few frames (vibration, sub-pixel bias), and cross-validation would
/// take what is common to neighbours for motion. A head moves smoothly over it.
const BLOCK_S: f64 = 4e-3;
/// Fewest frames with the head: cross-validation needs a few times as many points as a curve has freedoms.
const FEWEST_FRAMES: usize = 10;

/// Time at either end of a recording in which the acceleration of its head is less certain by a factor of
/// ten, s: a run keeps away from it.
pub const UNCERTAIN_END_S: f64 = 0.01;
/// Share of the greatest speed of a head from which a tip slides evenly enough for a run to start there.
pub const EVEN_SPEED_SHARE: f64 = 0.2;

/// Steps in which an even motion is looked for, s.
const EVEN_SEARCH_STEP_S: f64 = 1e-3;

/// Why a recording does not give the head's motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HeadMotionError {
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
/// [`HeadSpline::covariance_times`] says how well it is known; less so within [`UNCERTAIN_END_S`] of either end.
///
/// # Errors
/// [`HeadMotionError`] when the head is tracked in too few frames.
pub fn smooth_head_motion(recording: &Recording) -> Result<HeadSpline, HeadMotionError> {
    let points: Vec<(usize, f64)> = recording
        .traces()
        .head_x_m
        .iter()
        .enumerate()
        .filter_map(|(frame, x)| Some((frame, (*x)?)))
        .collect();
    if points.len() < FEWEST_FRAMES {
        return Err(HeadMotionError::Few {
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
    Ok(HeadSpline::from_points(&grid, &points, block, &knots))
}

/// The first time at which a head moves fast enough for a run to start in steady slip, s, behind the
/// uncertain start of its motion.
#[must_use]
pub fn even_motion_start_s(motion: &HeadSpline) -> f64 {
    let [first_s, last_s] = motion.span_s();
    let count = ((last_s - first_s) / EVEN_SEARCH_STEP_S) as usize;
    let times = || (0..=count).map(|step| first_s + UNCERTAIN_END_S + step as f64 * EVEN_SEARCH_STEP_S);
    let times = || times().take_while(|time_s| *time_s < last_s - UNCERTAIN_END_S);
    let speed = |time_s: f64| motion.motion_at(time_s).velocity_m_per_s.abs();
    let greatest = times().map(speed).fold(0.0, f64::max);
    times().find(|time_s| speed(*time_s) >= EVEN_SPEED_SHARE * greatest).unwrap_or(last_s)
}
