//! Published numbers are met.

#[path = "../validate/published.rs"]
mod published;
#[path = "../validate/section.rs"]
mod section;
