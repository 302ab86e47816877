//! The same input gives the same bytes.

#[path = "../common/ringing.rs"]
mod ringing;

#[path = "../../examples/reference.rs"]
mod reference_pages;

mod portable;
mod readers;
mod reference;
mod resume;
mod structure;
mod versions;
