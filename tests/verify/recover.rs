//! What is put into synthetic data is found again.

#[path = "../common/ringing.rs"]
mod ringing;

mod camera;
mod frequencies;
mod search;
mod trace;
mod twin;
mod valleys;
