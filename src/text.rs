//! Text for pages, figures, captions and terminals: numbers with units and standard deviations, lists of
//! words, and names without control characters. This module does not depend on the meaning of the numbers.
//!
//! A value with its standard deviation is always written `78.40(3)`: 78.40 with a standard deviation of 0.03,
//! in units of the last digit shown (JCGM 100:2008, 7.2.2).

mod hash;
mod phrase;
mod unit;

pub use hash::{TextHash, is_hashed_as_bytes, sha256, text_sha256};
pub(crate) use phrase::{
    capitalise, format_interval, format_times, join_with_and, panic_message, pluralise, truncate_text,
    wrap_words,
};
pub(crate) use plain_charts::number::{
    DASH, format_decimals, format_or_dash, format_trimmed, format_with_sd,
};
pub use plain_charts::number::{
    format_digits, format_number, format_plain, format_short, round_to_digits, to_ascii,
};
pub use plain_charts::printable::{escape_controls, make_printable};
pub(crate) use portable_math::{parse_finite, parse_positive};
pub(crate) use unit::{
    choose_prefix, format_degrees, format_length, format_milliseconds, format_percent, format_rate,
    format_signed_percent, format_speed, label_with_unit,
};
