//! Noise of a tracker whose frames resemble their neighbours: an autoregressive process, and the map that
//! makes it white.

mod autoregressive;
mod whitener;

pub use autoregressive::{Ar, MOST_COEFFICIENTS, NotStationary};
pub use whitener::Whitener;
