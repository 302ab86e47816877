//! A finely sampled trace seen by a camera, so that a simulated trace can be held against a measured one like
//! with like.
//!
//! Between its samples the trace is a polynomial of the fifth degree through the six samples around, of which
//! the mean over the open shutter is exact. At [`LEAST_OVERSAMPLING`] samples a frame a sine of half the
//! frame rate is passed with an error of 0.12 % of its amplitude next to the sinc of its exposure, one of a
//! quarter of the frame rate with 0.002 %; what is faster than half the frame rate (and appears folded) takes
//! 8 samples a cycle for 0.12 %. A stick-slip cycle jumps in its acceleration: there the error falls with the
//! square of the time between samples, and on the bundled blade it is 2 nm at 20,000 samples/s.

mod like;

pub use like::{DropoutPattern, MatchedFilm, MatchedFilmError, film_like_recording};

use super::Camera;
use crate::recording::interpolate::{ON_FRAME_TOLERANCE, STENCIL, frame_at, lagrange_through_six};
use crate::recording::{FrameGrid, Recording, RecordingError, Traces};

/// Samples of the fine trace in the time of a frame, at least, so that the error above holds.
pub const LEAST_OVERSAMPLING: f64 = 4.0;
/// Nodes and weights of the three-point Gauss-Legendre rule on [0, 1] (Abramowitz and Stegun, table 25.4):
/// exact to the fifth degree.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Why a trace cannot be filmed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// The camera cannot film.
    #[error("camera: found {key} = {found}, expected {expected}; correct the value")]
    Camera {
        /// Which key.
        key: &'static str,
        /// Its value.
        found: f64,
        /// What it takes.
        expected: &'static str,
    },
    /// The trace has too few samples between frames.
    #[error(
        "{trace}: found {fine_hz} samples/s, expected at least {least_hz} for a camera of {frame_rate_hz} frames/s; raise [run] sample_rate_hz in the scene and simulate again"
    )]
    TooCoarse {
        /// Name of the trace.
        trace: String,
        /// Its rate, 1/s.
        fine_hz: f64,
        /// [`LEAST_OVERSAMPLING`] times the frame rate, 1/s.
        least_hz: f64,
        /// Rate of the camera, 1/s.
        frame_rate_hz: f64,
    },
    /// The trace has fewer samples than a piece of the path runs through.
    #[error(
        "{trace}: found {found} samples, expected at least {STENCIL}; raise [run] stop_s in the scene and simulate again"
    )]
    TooShort {
        /// Name of the trace.
        trace: String,
        /// Number of its samples.
        found: usize,
    },
    /// The first frame lies outside the trace.
    #[error(
        "{trace}: found a first frame at {found_s} s, expected one between {start_s} and {end_s} s, in the trace"
    )]
    Outside {
        /// Name of the trace.
        trace: String,
        /// Instant of the first frame, s.
        found_s: f64,
        /// First sample, s.
        start_s: f64,
        /// Last sample, s.
        end_s: f64,
    },
    /// The frames do not make a recording.
    #[error("{trace}: {error}")]
    Recording {
        /// Name of the trace.
        trace: String,
        /// Why.
        error: RecordingError,
    },
}

/// What `camera` sees of the trace `fine` from `start_s`, s of its time, to its end, without noise; marked
/// synthetic, with the trace's clock and name. Every frame is the mean over the exposure centred on its
/// instant; what the shutter shows beyond the ends of the trace is its outermost sample, as in
/// [`super::view`]. A frame that rests on a missing sample is missing.
///
/// A camera without exposure whose every frame falls on a sample takes those samples, at any rate.
///
/// # Errors
/// [`FilmError`].
pub fn film_trace(fine: &Recording, camera: &Camera, start_s: f64) -> Result<Recording, FilmError> {
    check_film_camera(camera)?;
    let grid = plan_frames(fine, camera, start_s)?;
    let shutter = FrameShutter::new(fine, camera, &grid);
    shutter.check_sampling(fine, camera, &grid)?;
    let seen = |column: &[Option<f64>]| -> Vec<Option<f64>> {
        (0..grid.frames).map(|frame| shutter.frame_mean(column, frame)).collect()
    };
    let traces = fine.traces();
    let traces = Traces {
        tip_x_m: seen(&traces.tip_x_m),
        tip_y_m: seen(&traces.tip_y_m),
        head_x_m: seen(&traces.head_x_m),
        head_y_m: seen(&traces.head_y_m),
        ..Traces::default()
    };
    Recording::new(fine.name(), grid, traces, true)
        .map_err(|error| FilmError::Recording { trace: fine.name().to_owned(), error })
}

fn check_film_camera(camera: &Camera) -> Result<(), FilmError> {
    let Camera { frame_rate_hz, exposure_s } = *camera;
    if !(frame_rate_hz.is_finite() && frame_rate_hz > 0.0) {
        return Err(FilmError::Camera {
            key: "frame_rate_hz",
            found: frame_rate_hz,
            expected: "a number above 0",
        });
    }
    if !(0.0..=1.0 / frame_rate_hz).contains(&exposure_s) {
        return Err(FilmError::Camera {
            key: "exposure_s",
            found: exposure_s,
            expected: "0 to the time between frames",
        });
    }
    Ok(())
}

/// The camera's frames from `start_s` to the last sample; never more than samples.
fn plan_frames(fine: &Recording, camera: &Camera, start_s: f64) -> Result<FrameGrid, FilmError> {
    let (trace, grid) = (fine.name().to_owned(), fine.grid());
    let (fine_hz, end_s) = (grid.frame_rate_hz, grid.time_s(grid.frames - 1));
    let least_hz = LEAST_OVERSAMPLING * camera.frame_rate_hz;
    if fine_hz < camera.frame_rate_hz * (1.0 - ON_FRAME_TOLERANCE) {
        return Err(FilmError::TooCoarse { trace, fine_hz, least_hz, frame_rate_hz: camera.frame_rate_hz });
    }
    let slack_s = ON_FRAME_TOLERANCE / fine_hz;
    if !(grid.start_s - slack_s..=end_s + slack_s).contains(&start_s) {
        return Err(FilmError::Outside { trace, found_s: start_s, start_s: grid.start_s, end_s });
    }
    // bounded by the samples
    let frames =
        ((end_s - start_s) * camera.frame_rate_hz + ON_FRAME_TOLERANCE).floor().max(0.0) as usize + 1;
    Ok(FrameGrid { start_s, frame_rate_hz: camera.frame_rate_hz, frames })
}

/// Where the open shutter lies on the samples, in samples (real numbers).
struct FrameShutter {
    first: f64,
    samples_per_frame: f64,
    open: f64,
    last: f64,
}

impl FrameShutter {
    fn new(fine: &Recording, camera: &Camera, grid: &FrameGrid) -> Self {
        let (start_s, rate_hz, frames) = (fine.grid().start_s, fine.grid().frame_rate_hz, fine.grid().frames);
        Self {
            first: (grid.start_s - start_s) * rate_hz,
            samples_per_frame: rate_hz / camera.frame_rate_hz,
            open: camera.exposure_s * rate_hz,
            last: (frames - 1) as f64,
        }
    }

    /// Whether the path between samples is known well enough, or not needed.
    fn check_sampling(&self, fine: &Recording, camera: &Camera, grid: &FrameGrid) -> Result<(), FilmError> {
        let trace = || fine.name().to_owned();
        if self.open == 0.0 && (0..grid.frames).all(|frame| frame_at(self.frame_centre(frame)).is_some()) {
            return Ok(());
        }
        let (fine_hz, frame_rate_hz) = (fine.grid().frame_rate_hz, camera.frame_rate_hz);
        let least_hz = LEAST_OVERSAMPLING * frame_rate_hz;
        if fine_hz < least_hz * (1.0 - ON_FRAME_TOLERANCE) {
            return Err(FilmError::TooCoarse { trace: trace(), fine_hz, least_hz, frame_rate_hz });
        }
        let found = fine.grid().frames;
        if found < STENCIL { Err(FilmError::TooShort { trace: trace(), found }) } else { Ok(()) }
    }

    fn frame_centre(&self, frame: usize) -> f64 {
        (self.first + frame as f64 * self.samples_per_frame).clamp(0.0, self.last)
    }

    /// Mean of a column over the shutter of a frame: its pieces between samples, each by a rule that is exact
    /// for it.
    fn frame_mean(&self, column: &[Option<f64>], frame: usize) -> Option<f64> {
        let centre = self.first + frame as f64 * self.samples_per_frame;
        if self.open == 0.0 {
            return interpolate_column(column, centre.clamp(0.0, self.last));
        }
        let (from, to) = (centre - self.open / 2.0, centre + self.open / 2.0);
        let (inner_from, inner_to) = (from.clamp(0.0, self.last), to.clamp(0.0, self.last));
        let mut sum = 0.0;
        let mut at = inner_from;
        while at < inner_to {
            let next = (at.floor() + 1.0).min(inner_to);
            for (node, weight) in GAUSS {
                sum += weight * (next - at) * interpolate_column(column, at + node * (next - at))?;
            }
            at = next;
        }
        if inner_from > from {
            sum += (inner_from - from) * column.first().copied().flatten()?;
        }
        if to > inner_to {
            sum += (to - inner_to) * column.last().copied().flatten()?;
        }
        Some(sum / self.open)
    }
}

/// The path at `at`, counted in samples, inside the column: the sample itself, or the polynomial through the
/// six samples around, which near the ends lie more to one side.
fn interpolate_column(column: &[Option<f64>], at: f64) -> Option<f64> {
    if let Some(sample) = frame_at(at) {
        return *column.get(sample)?;
    }
    let first = (at.floor() as usize).saturating_sub(STENCIL / 2 - 1).min(column.len().checked_sub(STENCIL)?);
    lagrange_through_six(column, first, at)
}
