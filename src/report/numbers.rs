//! Numbers as tables and sentences have them: so many digits, deviations, percentages, intervals.

use super::chart::superscript;

const DASH: &str = "\u{2013}";

/// Four significant digits.
#[must_use]
pub fn number(value: f64) -> String {
    to_digits(value, 4)
}

/// So many significant digits; a power of ten where plain digits would be long.
#[must_use]
pub fn to_digits(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return DASH.to_owned();
    }
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    let written = match magnitude {
        -3..=4 => format!("{value:.*}", (digits - 1 - magnitude).max(0) as usize),
        _ => {
            let written = format!("{value:.*e}", (digits - 1).max(0) as usize);
            match written.split_once('e') {
                Some((digits, exponent)) => {
                    format!("{digits}\u{b7}10{}", superscript(exponent.parse().unwrap_or(0)))
                }
                None => written,
            }
        }
    };
    minus(&written)
}

/// A missing value is a dash.
#[must_use]
pub fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| DASH.to_owned(), number)
}

/// `74.82 ± 0.40`: the deviation with two digits, the value to the same decimal; without a deviation four
/// digits.
#[must_use]
pub fn with_deviation(value: f64, sd: Option<f64>) -> String {
    /// More decimals are not read.
    const MOST_DECIMALS: i32 = 6;
    let Some(sd) = sd.filter(|sd| sd.is_finite() && *sd > 0.0) else { return number(value) };
    let decimals = 1 - sd.log10().floor() as i32;
    match decimals {
        ..=MOST_DECIMALS => {
            minus(&format!("{value:.*} \u{b1} {sd:.*}", decimals.max(0) as usize, decimals.max(0) as usize))
        }
        _ => format!("{} \u{b1} {}", number(value), to_digits(sd, 2)),
    }
}

/// A relative error as a signed percentage.
#[must_use]
pub fn signed_percent(share: f64) -> String {
    let written = format!("{:+.2} %", 100.0 * share);
    if written[1..].starts_with("0.00") { "0.00 %".to_owned() } else { minus(&written) }
}

/// A share as a percentage without zeros at the end: a tolerance of 0.02 is `2 %`.
#[must_use]
pub fn percent(share: f64) -> String {
    let digits = format!("{:.2}", 100.0 * share);
    let digits = digits.trim_end_matches('0').trim_end_matches('.');
    if digits == "0" && share > 0.0 {
        format!("{} %", to_digits(100.0 * share, 1))
    } else {
        format!("{} %", minus(digits))
    }
}

/// `0.09656 to 0.1355`, or what an open end leaves of it.
#[must_use]
pub fn interval(lower: Option<f64>, upper: Option<f64>) -> String {
    match (lower, upper) {
        (Some(lower), Some(upper)) => format!("{} to {}", number(lower), number(upper)),
        (Some(lower), None) => format!("above {}", number(lower)),
        (None, Some(upper)) => format!("below {}", number(upper)),
        (None, None) => "open on both sides".to_owned(),
    }
}

fn minus(text: &str) -> String {
    text.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits_and_true_minus_signs() {
        assert_eq!(
            [78.4, 900.0, 0.0, -0.0123456].map(number),
            ["78.40", "900.0", "0.000", "\u{2212}0.01235"]
        );
        assert_eq!(number(-1.23456e-7), "\u{2212}1.235\u{b7}10\u{207b}\u{2077}");
        assert_eq!([number(f64::NAN), optional(None)], ["\u{2013}", "\u{2013}"]);
    }

    #[test]
    fn a_value_ends_at_the_decimal_of_its_deviation() {
        let cases = [
            (74.8165, 0.4, "74.82 \u{b1} 0.40"),
            (907.68, 4.0, "907.7 \u{b1} 4.0"),
            (900.0, 29.0, "900 \u{b1} 29"),
            (-1.1049, 0.0055, "\u{2212}1.1049 \u{b1} 0.0055"),
        ];
        for (value, sd, expected) in cases {
            assert_eq!(with_deviation(value, Some(sd)), expected);
        }
        assert_eq!(
            with_deviation(1e-9, Some(1e-10)),
            "1.000\u{b7}10\u{207b}\u{2079} \u{b1} 1.0\u{b7}10\u{207b}\u{b9}\u{2070}"
        );
        assert_eq!([with_deviation(78.4, None), with_deviation(78.4, Some(0.0))], ["78.40", "78.40"]);
    }

    #[test]
    fn shares_are_percentages() {
        assert_eq!(
            [0.0123, -0.2, 0.0, -1e-6].map(signed_percent),
            ["+1.23 %", "\u{2212}20.00 %", "0.00 %", "0.00 %"]
        );
        assert_eq!(
            [0.02, 0.005, 0.0, 1e-9].map(percent),
            ["2 %", "0.5 %", "0 %", "1\u{b7}10\u{207b}\u{2077} %"]
        );
    }

    #[test]
    fn an_open_end_is_said() {
        assert_eq!(interval(Some(1.0), Some(2.0)), "1.000 to 2.000");
        assert_eq!(
            [interval(Some(1.0), None), interval(None, Some(2.0)), interval(None, None)],
            ["above 1.000", "below 2.000", "open on both sides"]
        );
    }
}
