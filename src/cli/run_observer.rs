//! Observer of a run of the model that shows progress to a waiting user.

use super::{interrupt, progress};
use crate::simulate::{Observer, SolutionSegment};
use indicatif::ProgressBar;
use std::ops::ControlFlow;

/// Number of integration segments between two updates of the progress bar; computing a segment takes
/// microseconds.
const PIECES_A_LOOK: u32 = 64;

/// Shows the progress of a run, and stops it on request.
pub(crate) struct ProgressObserver {
    bar: ProgressBar,
    start_s: f64,
    pieces: u32,
}

impl ProgressObserver {
    /// Observer of a run from `start_s` to `stop_s`, s.
    pub(crate) fn new([start_s, stop_s]: [f64; 2], command: &'static str, quiet: bool) -> Self {
        let bar = progress::start_bar(to_milliseconds(stop_s - start_s), command, "ms of the model", quiet);
        Self { bar, start_s, pieces: 0 }
    }
}

impl Observer for ProgressObserver {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.pieces = (self.pieces + 1) % PIECES_A_LOOK;
        if self.pieces == 0 {
            self.bar.set_position(to_milliseconds(piece.end_s - self.start_s));
        }
    }

    fn control_flow(&self) -> ControlFlow<()> {
        interrupt::control_flow()
    }
}

impl Drop for ProgressObserver {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

fn to_milliseconds(time_s: f64) -> u64 {
    (1e3 * time_s) as u64
}
