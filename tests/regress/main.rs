//! The same input gives the same bytes.

#[path = "../common/ringing.rs"]
mod ringing;

mod portable;
mod readers;
mod resume;
mod structure;
