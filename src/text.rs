//! Text as every page, figure, caption and terminal shows it: numbers with units and deviations, lists of
//! words, and names without characters that steer. Knows nothing of what the numbers mean.
//!
//! A value with its standard deviation is always written `78.40(3)`: 78.40 with a standard deviation of 0.03,
//! which stands in units of the last digit shown (JCGM 100:2008, 7.2.2).

mod deviation;
mod hash;
mod number;
mod phrase;
mod printable;
mod unit;

pub use deviation::with_sd;
pub use hash::{TextHash, sha256, text_sha256};
pub use number::{ascii, digits, number, rounded, short, typed};
pub use phrase::{interval, listed, plural, wrapped};
pub use printable::{escaped, printable};
pub use unit::degrees;

pub(crate) use number::{decimals, or_dash, scientific, superscript, trimmed};
pub(crate) use phrase::{capitalised, panic_message, shortened, times};
pub(crate) use unit::{length, milliseconds, percent, signed_percent, speed, unit, with_unit};

/// What stands for a missing value.
pub(crate) const DASH: &str = "\u{2013}";
