//! The same input gives the same bytes.

#[path = "../common/ringing.rs"]
mod ringing;
#[path = "../common/thorough.rs"]
mod thorough;
#[path = "../common/tracked.rs"]
mod tracked;

#[path = "../../examples/reference.rs"]
mod reference_pages;

mod links;
mod portable;
mod readers;
mod reference;
mod resume;
mod structure;
mod versions;
