//! The same input gives the same bytes.

#[path = "../common/ringing.rs"]
mod ringing;

mod readers;
mod resume;
mod structure;
