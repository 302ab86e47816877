//! Stability of sliding: the speeds at which a blade vibrates by itself, and what changes them.
//!
//! Steady sliding is unstable at the speeds at which a mode of small vibrations grows ([`steady_sliding`]).
//! A stick-slip cycle, once it exists, can go on at higher speeds, at which steady sliding is stable. So
//! chatter can end at a higher speed than the instability: where the branch of the cycle ([`cycle_branch`])
//! turns back.

pub mod changes;
pub mod chatter;
pub mod cycle_branch;
pub mod journal;
pub mod outputs;
pub mod shooting;
pub mod speed_intervals;
pub mod steady_sliding;
pub mod study;
