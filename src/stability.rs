//! Stability of sliding: the speeds at which a blade vibrates by itself, and what changes them.
//!
//! Two speeds must not be confused. Steady sliding is unstable where a mode of small vibrations grows
//! ([`steady_sliding`]). A stick-slip cycle, once it exists, may go on at speeds at which steady sliding is
//! stable again, so chatter ends later than the instability.

pub mod changes;
pub mod outputs;
pub mod speed_intervals;
pub mod steady_sliding;
pub mod study;
