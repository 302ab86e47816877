//! Published numbers are met.

mod published;
