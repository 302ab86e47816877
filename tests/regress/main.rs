//! The same input gives the same bytes.

#[path = "../common/ringing.rs"]
mod ringing;

mod resume;
mod structure;
