//! Channels derived from a recording, and the windows and instants that cut them.

mod channels;
mod flip;
mod holds;
mod instants;
mod named_windows;
mod phase;
mod speed;
mod tracked;
mod turns;
mod window;
mod window_text;

pub use channels::{Channel, UnknownChannel};
pub use flip::Flip;
pub use instants::{InstantKind, InstantNotFound, Reversal, ReversalInstants};
pub use named_windows::{PhaseWindow, phase_windows};
pub use phase::ReversalPhase;
pub use speed::mean_speed_m_per_s;

pub use window::{Window, WindowEnd, WindowError};
