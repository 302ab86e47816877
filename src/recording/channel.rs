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
pub use instants::{Anchor, Instants, NoInstant, Reversal};
pub use named_windows::{NamedWindow, named_windows};
pub use phase::Phase;
pub use speed::mean_speed_m_per_s;

pub use window::{Window, WindowEnd, WindowError};
