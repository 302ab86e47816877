//! Reads numbers as they are spelled in tables: with decimal point or comma, with typographic minus signs, or
//! as a word that means a missing value.

use crate::text::parse_finite;

/// Texts of a cell that mean a missing value, in lower case.
const MISSING_WORDS: [&str; 9] = ["", "nan", "na", "none", "-", "*", "null", "#n/a", "n/a"];
/// Maximum length of a number with a decimal comma or a typographic minus sign, bytes. A number with 17
/// digits and an exponent is shorter.
const MAX_NUMBER_BYTES: usize = 64;

/// Contents of a cell: a number, a missing value or other text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum CellNumber {
    /// The cell is empty, or contains a word for a missing value.
    Missing,
    Value(f64),
    Text,
}

impl CellNumber {
    /// The number; `None` for a missing value and for other text.
    pub(crate) fn value(self) -> Option<f64> {
        if let Self::Value(value) = self { Some(value) } else { None }
    }
}

/// Reads the text of a cell, which must have no blanks at its ends. `decimal` is the decimal mark, `.` or
/// `,`.
pub(crate) fn parse_number(text: &str, decimal: char) -> CellNumber {
    if decimal == '.'
        && let Some(value) = parse_finite(text)
    {
        return CellNumber::Value(value);
    }
    if is_missing(text) { CellNumber::Missing } else { parse_spelled(text, decimal) }
}

fn is_missing(text: &str) -> bool {
    MISSING_WORDS.iter().any(|word| text.eq_ignore_ascii_case(word))
        || (is_minus(text.chars().next()) && text.chars().count() == 1)
}

/// Whether a character is used as a minus sign. Some locales use the mathematical minus, a hyphen or a dash.
fn is_minus(c: Option<char>) -> bool {
    matches!(c, Some('-' | '\u{2212}' | '\u{2010}'..='\u{2013}'))
}

fn parse_spelled(text: &str, decimal: char) -> CellNumber {
    let mut plain = [0_u8; MAX_NUMBER_BYTES];
    let mut length = 0;
    for c in text.chars() {
        let byte = match c {
            c if is_minus(Some(c)) => b'-',
            c if c == decimal => b'.',
            '0'..='9' | '+' | 'e' | 'E' => c as u8,
            // (Fortran writes the exponent of a double with D)
            'd' | 'D' if plain.contains(&b'.') => b'e',
            _ => return CellNumber::Text,
        };
        let Some(place) = plain.get_mut(length) else { return CellNumber::Text };
        *place = byte;
        length += 1;
    }
    let text = std::str::from_utf8(&plain[..length]).unwrap_or_default(); // (all bytes are ASCII)
    // (`12,` is a number with a stray delimiter after it)
    if decimal == ',' && text.ends_with('.') {
        return CellNumber::Text;
    }
    parse_finite(text).map_or(CellNumber::Text, CellNumber::Value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_every_spelling() {
        assert_eq!(parse_number("\u{2212}1,25E\u{2212}1", ','), CellNumber::Value(-0.125));
        assert_eq!(parse_number("-1.25D-01", '.'), CellNumber::Value(-0.125));
        for (text, value) in [
            ("1.234E0", 1.234),
            ("5", 5.0),
            ("-5", -5.0),
            (".5", 0.5),
            ("5.", 5.0),
            ("+1e-3", 1e-3),
            ("\u{2013}2.5", -2.5),
        ] {
            assert_eq!(parse_number(text, '.'), CellNumber::Value(value), "{text}");
        }
        for word in ["", "NaN", "nan", "NA", "None", "-", "*", "null", "#N/A", "N/A", "\u{2212}", "\u{2013}"]
        {
            assert_eq!(parse_number(word, '.'), CellNumber::Missing, "{word}");
            assert_eq!(parse_number(word, ','), CellNumber::Missing, "{word}");
        }
        for word in [
            "1,5",
            "inf",
            "1e999",
            "x",
            "1.2.3",
            "0x10",
            "2D4",
            "1'000.0",
            "1\u{a0}000",
            "+",
            "e",
            ".",
            "--1",
            "infinity",
            "1-",
        ] {
            assert_eq!(parse_number(word, '.'), CellNumber::Text, "{word}");
        }
        for word in ["1.5", "12,", "1,2,3", "1 000,5", ","] {
            assert_eq!(parse_number(word, ','), CellNumber::Text, "{word}");
        }
        assert_eq!(parse_number(&format!("1,{}", "0".repeat(MAX_NUMBER_BYTES)), ','), CellNumber::Text);
    }
}
