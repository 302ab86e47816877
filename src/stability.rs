//! Stability of sliding: the speeds at which a blade vibrates by itself, and what changes them.
//!
//! Steady sliding is unstable at the speeds at which a mode of small vibrations grows ([`steady_sliding`]).
//! A stick-slip cycle, once it exists, can go on at higher speeds, at which steady sliding is stable. So
//! chatter can end at a higher speed than the instability. The speed at which the cycle ends is not computed.

pub mod changes;
pub mod outputs;
pub mod speed_intervals;
pub mod steady_sliding;
pub mod study;
