//! Motion of the head along the sweep: the paper's cosine, uniform motion, or the motion of a recorded head.

mod head_spline;
mod smoothing_spline;

use crate::model::HeadMotion;
use crate::recording::Recording;
pub use head_spline::HeadSpline;
use portable_math as math;
use serde::Serialize;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Motion of the head along the sweep, `v(t)`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Drive {
    /// Cosine `v = a (1 - cos 2 pi f (t - t0))`, the paper's drive; in the paper, `t0` is 0.
    Cosine {
        /// Amplitude `a`, m.
        amplitude_m: f64,
        /// Frequency `f`, Hz.
        frequency_hz: f64,
        /// Delay `t0`, s; a delay of 0 is not serialised, so that the hash of a scene without delay does not
        /// change.
        #[serde(skip_serializing_if = "is_zero")]
        delay_s: f64,
    },
    /// Uniform motion `v = speed * t`.
    Uniform {
        /// Speed of the head, m/s.
        speed_m_per_s: f64,
    },
    /// Motion of the head of a recording; copies of a scene share the same spline.
    Recorded(Arc<HeadSpline>),
}

impl Drive {
    /// Motion of the head at time `t`, s.
    #[inline]
    #[must_use]
    pub fn motion_at(&self, t: f64) -> HeadMotion {
        match *self {
            Self::Cosine { amplitude_m, frequency_hz, delay_s } => {
                let omega = TAU * frequency_hz;
                let (sin, cos) = math::sin_cos(omega * (t - delay_s));
                HeadMotion {
                    position_m: amplitude_m * (1.0 - cos),
                    velocity_m_per_s: amplitude_m * omega * sin,
                    acceleration_m_per_s2: amplitude_m * omega * omega * cos,
                }
            }
            Self::Uniform { speed_m_per_s } => HeadMotion {
                position_m: speed_m_per_s * t,
                velocity_m_per_s: speed_m_per_s,
                acceleration_m_per_s2: 0.0,
            },
            Self::Recorded(ref spline) => spline.motion_at(t),
        }
    }

    /// Fills `out` with the Taylor coefficients of the head's velocity about `t`, m/s^(k+1), in rising order.
    /// The series is exact from `t` to the [next break](Self::next_break).
    #[inline]
    pub(crate) fn velocity_series(&self, t: f64, out: &mut [f64]) {
        match *self {
            Self::Cosine { amplitude_m, frequency_hz, delay_s } => {
                let omega = TAU * frequency_hz;
                let (sin, cos) = math::sin_cos(omega * (t - delay_s));
                let (mut velocity, mut quadrature) = (amplitude_m * omega * sin, amplitude_m * omega * cos);
                for (k, out) in out.iter_mut().enumerate() {
                    *out = velocity;
                    let factor = omega / (k + 1) as f64;
                    (velocity, quadrature) = (factor * quadrature, -factor * velocity);
                }
            }
            Self::Uniform { speed_m_per_s } => {
                out.fill(0.0);
                out[..1].fill(speed_m_per_s);
            }
            Self::Recorded(ref spline) => {
                out.fill(0.0);
                out.iter_mut().zip(spline.velocity_series(t)).for_each(|(out, c)| *out = c);
            }
        }
    }

    /// Time at which the cosine starts, `t0`, s; 0 for other motions.
    pub(crate) fn delay_s(&self) -> f64 {
        if let Self::Cosine { delay_s, .. } = *self { delay_s } else { 0.0 }
    }

    /// The next instant after `t`, s, at which a derivative of the motion jumps; an integration step must not
    /// cross it.
    #[inline]
    #[must_use]
    pub fn next_break(&self, t: f64) -> Option<f64> {
        match self {
            Self::Cosine { .. } | Self::Uniform { .. } => None,
            Self::Recorded(spline) => spline.next_knot_s(t),
        }
    }

    /// Latest end of an integration from `t`, s: the next break, or `stop` if that is earlier.
    #[inline]
    pub(crate) fn horizon(&self, t: f64, stop: f64) -> f64 {
        self.next_break(t).map_or(stop, |next| next.min(stop))
    }
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde passes a reference
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

// Motion of a recorded head.

/// Time over which frames are averaged before smoothing, and time between knots of the spline, s. Tracking
/// noise is correlated over a few frames (vibration, sub-pixel bias), and cross-validation would mistake it
/// for motion. A head moves smoothly within this time.
const BLOCK_S: f64 = 4e-3;
/// Minimum number of frames that show the head: cross-validation needs several points per degree of freedom.
const FEWEST_FRAMES: usize = 10;

/// Duration, s, of the part at either end of a recording in which the acceleration of the head is ten times
/// less certain than in the middle. A run avoids both parts.
pub(crate) const UNCERTAIN_END_S: f64 = 0.01;
/// Smallest speed of the head at which a run may start in steady slip, as a fraction of the head's top speed.
pub(crate) const EVEN_SPEED_SHARE: f64 = 0.2;

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
        /// Number of frames with the head's x.
        found: usize,
        /// Number of frames of the recording.
        frames: usize,
    },
}

/// Smooth curve through the tracked positions `x` of the head.
///
/// The uncertainty of the curve grows towards the first and the last frame.
///
/// # Errors
/// [`HeadMotionError`] if too few frames show the head.
pub fn smooth_head_motion(recording: &Recording) -> Result<HeadSpline, HeadMotionError> {
    let recording = &*recording.resample_to_grid();
    let (grid, frames) = (recording.grid(), recording.traces().head_x_m.iter().enumerate());
    let points: Vec<(usize, f64)> = frames.filter_map(|(frame, x)| Some((frame, (*x)?))).collect();
    if points.len() < FEWEST_FRAMES {
        let (recording, found) = (recording.name().to_owned(), points.len());
        return Err(HeadMotionError::Few { recording, found, frames: grid.frames });
    }
    let block = (BLOCK_S * grid.frame_rate_hz).round() as usize;
    let (first, last) = (points[0].0, points[points.len() - 1].0);
    let block = if block < 3 || (last - first) / block < FEWEST_FRAMES { 1 } else { block };
    let knots =
        |_| (first..last).step_by(block).filter(|knot| last - knot > block / 2).chain([last]).collect();
    Ok(HeadSpline::from_points(&grid, &points, block, knots))
}

/// First time at which the head is fast enough for a start in steady slip, s. It is later than the uncertain
/// part at the start of the recording.
pub(crate) fn even_motion_start_s(motion: &HeadSpline) -> f64 {
    const STEP_S: f64 = 1e-3;
    let [first_s, last_s] = motion.span_s();
    let count = ((last_s - first_s) / STEP_S) as usize;
    let times = || (0..=count).map(|step| first_s + UNCERTAIN_END_S + step as f64 * STEP_S);
    let times = || times().take_while(|time_s| *time_s < last_s - UNCERTAIN_END_S);
    let speed = |time_s: f64| motion.motion_at(time_s).velocity_m_per_s.abs();
    let greatest = times().map(speed).fold(0.0, f64::max);
    times().find(|time_s| speed(*time_s) >= EVEN_SPEED_SHARE * greatest).unwrap_or(last_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::FrameGrid;

    /// The series about `t` gives the velocity at a slightly later time.
    #[test]
    fn the_series_is_that_of_the_velocity() {
        let grid = FrameGrid { start_s: 0.1, frame_rate_hz: 20.0, frames: 40 };
        let wave = |i: usize| 0.01 * (0.4 * i as f64).sin();
        let recorded = {
            let points: Vec<(usize, f64)> = (0..40).map(|i| (i, wave(i))).collect();
            HeadSpline::from_points(&grid, &points, 1, |_| (0..40).collect())
        };
        let drives = [
            (Drive::Cosine { amplitude_m: 0.0138, frequency_hz: 0.915, delay_s: 0.0 }, 2e-11),
            (Drive::Cosine { amplitude_m: 0.0138, frequency_hz: 0.915, delay_s: 0.3 }, 2e-11),
            (Drive::Uniform { speed_m_per_s: 0.2 }, 0.0),
            (Drive::Recorded(Arc::new(recorded)), 1e-15),
        ];
        for (drive, allowed) in drives {
            let t = 0.62;
            let mut series = [f64::NAN; 7];
            drive.velocity_series(t, &mut series);
            for x in [0.0, 0.01, 0.025] {
                let sum = series.iter().rev().fold(0.0, |sum, c| sum * x + c);
                let error = sum - drive.motion_at(t + x).velocity_m_per_s;
                assert!(error.abs() <= allowed, "{drive:?} after {x} s: {error:e} m/s");
            }
        }
    }
}
