//! Published numbers are met.

mod published;
mod section;
