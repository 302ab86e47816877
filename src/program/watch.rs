//! Who watches a run of the model for the user: how far it has come, and whether it is to stop.

use crate::program::global::Global;
use crate::program::{interrupt, progress};
use crate::simulate::{Observer, Piece};
use indicatif::ProgressBar;
use std::ops::ControlFlow;

/// Pieces from one look at the clock to the next: they take microseconds each.
const PIECES_A_LOOK: u32 = 64;

/// The observer of a run that a user waits for.
pub struct Watch {
    bar: ProgressBar,
    start_s: f64,
    pieces: u32,
}

impl Watch {
    /// Of a run from one instant to another, s.
    pub fn of([start_s, stop_s]: [f64; 2], command: &'static str, global: &Global) -> Self {
        let bar = progress::bar(milliseconds(stop_s - start_s), command, "ms of the model", global.quiet);
        Self { bar, start_s, pieces: 0 }
    }
}

impl Observer for Watch {
    fn piece(&mut self, piece: &Piece<'_>) {
        self.pieces = (self.pieces + 1) % PIECES_A_LOOK;
        if self.pieces == 0 {
            self.bar.set_position(milliseconds(piece.end_s - self.start_s));
        }
    }

    fn flow(&self) -> ControlFlow<()> {
        interrupt::flow()
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

fn milliseconds(time_s: f64) -> u64 {
    (1e3 * time_s) as u64
}
