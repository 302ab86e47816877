//! Fitting a scene's parameters to recordings or to published components.

pub mod journal;
pub mod ledger;
pub mod objective;
pub mod scale;
pub mod search;
