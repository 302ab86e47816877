//! Text as every page, figure, caption and terminal shows it: numbers with units and deviations, lists of
//! words, and names without characters that steer. Knows nothing of what the numbers mean.
//!
//! A value with its standard deviation is always written `78.40(3)`: 78.40 with a standard deviation of 0.03,
//! which stands in units of the last digit shown (JCGM 100:2008, 7.2.2).

mod hash;
mod number;
mod phrase;
mod unit;

pub use hash::{TextHash, sha256, text_sha256};
pub(crate) use number::format_with_sd;
pub use number::{format_digits, format_number, format_plain, format_short, round_to_digits, to_ascii};
pub use phrase::{escape_controls, make_printable};
pub(crate) use phrase::{format_interval, join_with_and, pluralise, wrap_words};
pub(crate) use unit::format_degrees;

pub(crate) use number::{format_decimals, format_or_dash, format_scientific, format_trimmed, to_superscript};
pub(crate) use phrase::{capitalise, format_times, panic_message, truncate_text};
pub(crate) use unit::{
    choose_prefix, format_length, format_milliseconds, format_percent, format_signed_percent, format_speed,
    label_with_unit,
};

/// What stands for a missing value.
pub(crate) const DASH: &str = "\u{2013}";
