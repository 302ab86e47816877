//! A recording that a fit can read without a blade: a deflection that rings about a mean.

use wiperlab::fit::evaluation::{FailureReason, RunFailure};
use wiperlab::recording::{FrameGrid, Recording, Traces};

/// So many frames at 1000 frames/s of a tone of 1 mm; head and heights rest.
pub fn ringing(frames: usize, mean_m: f64, frequency_hz: f64) -> Result<Recording, RunFailure> {
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz: 1000.0, frames };
    let at = |i| mean_m + 1e-3 * (std::f64::consts::TAU * frequency_hz * grid.time_s(i)).sin();
    let still = vec![Some(0.0); frames];
    let tip_x_m = (0..frames).map(|i| Some(at(i))).collect();
    let traces = Traces {
        tip_x_m,
        tip_y_m: still.clone(),
        head_x_m: still.clone(),
        head_y_m: still,
        ..Traces::default()
    };
    Recording::new("model", grid, traces, true)
        .map_err(|e| RunFailure::new(FailureReason::NotFinite, e.to_string(), 1.0))
}
