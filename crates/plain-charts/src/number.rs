//! Formatting of numbers: with a given number of digits, a true minus sign, and a power of ten instead of
//! many zeros.

use portable_math as math;

/// Sign for a missing value.
pub const DASH: &str = "\u{2013}";
/// Exponents of ten for which a number is written in plain digits.
const PLAIN_POWERS: std::ops::RangeInclusive<i32> = -3..=4;
const MINUS: &str = "\u{2212}";
const TIMES_TEN: &str = "\u{b7}10";

/// A number with four significant digits.
#[must_use]
pub fn format_number(value: f64) -> String {
    format_digits(value, 4)
}

/// A number with three significant digits, without trailing zeros.
#[must_use]
pub fn format_short(value: f64) -> String {
    format_trimmed(value, 3)
}

/// Rounds to `count` significant digits.
#[must_use]
pub fn round_to_digits(value: f64, count: usize) -> f64 {
    format!("{value:.*e}", count.saturating_sub(1)).parse().unwrap_or(value)
}

/// A number with all of its digits, as typed in a file, and with a power of ten instead of many zeros.
#[must_use]
pub fn format_plain(value: f64) -> String {
    const WITHOUT_POWER: std::ops::Range<f64> = 1e-3..1e6;
    if value == 0.0 || WITHOUT_POWER.contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// A formatted value, or a dash for a missing one.
pub fn format_or_dash<T>(value: Option<T>, written: impl FnOnce(T) -> String) -> String {
    value.map_or_else(|| DASH.to_owned(), written)
}

/// A number with `count` significant digits, trailing zeros included; all digits before the decimal point are
/// shown. A dash for a number that is not finite.
#[must_use]
pub fn format_digits(value: f64, count: usize) -> String {
    format_significant(value, count, |plain| plain)
}

/// As [`format_digits`], but without trailing zeros after the decimal point unless a power of ten follows.
pub fn format_trimmed(value: f64, count: usize) -> String {
    format_significant(value, count, trim_zeros)
}

fn trim_zeros(plain: &str) -> &str {
    if plain.contains('.') { plain.trim_end_matches('0').trim_end_matches('.') } else { plain }
}

fn format_significant(value: f64, count: usize, shorten: impl Fn(&str) -> &str) -> String {
    if !value.is_finite() {
        return DASH.to_owned();
    }
    let last = count.saturating_sub(1);
    // the power of ten after rounding: 0.0999 with two digits is 0.10
    let scientific = format!("{value:.last$e}");
    match split_exponent(&scientific) {
        Some((_, power)) if PLAIN_POWERS.contains(&power) => {
            let decimals = usize::try_from(last as i32 - power).unwrap_or(0);
            typeset(shorten(&format!("{value:.decimals$}")))
        }
        _ => typeset(&scientific),
    }
}

/// A number with a fixed number of decimals; a dash for a number that is not finite.
pub fn format_decimals(value: f64, count: usize) -> String {
    if value.is_finite() { typeset(&format!("{value:.count$}")) } else { DASH.to_owned() }
}

/// A number as digits, with at most `count` decimals and no trailing zeros, times a power of ten.
pub fn format_scientific(value: f64, count: usize) -> String {
    let written = format!("{value:.count$e}");
    match split_exponent(&written) {
        _ if value == 0.0 => "0".to_owned(),
        Some((digits, power)) => typeset(&format!("{}e{power}", trim_zeros(digits))),
        None => DASH.to_owned(),
    }
}

/// Typesets a number in program notation such as `-1.5e-7`: with a true minus sign (none before zero) and a
/// power of ten.
pub fn typeset(written: &str) -> String {
    let (digits, power) = match split_exponent(written) {
        Some((digits, power)) => (digits, format!("{TIMES_TEN}{}", to_superscript(power))),
        None => (written, String::new()),
    };
    match digits.strip_prefix('-') {
        Some(zero) if zero.chars().all(|c| matches!(c, '0' | '.')) => format!("{zero}{power}"),
        Some(positive) => format!("{MINUS}{positive}{power}"),
        None => format!("{digits}{power}"),
    }
}

fn split_exponent(scientific: &str) -> Option<(&str, i32)> {
    let (digits, power) = scientific.split_once('e')?;
    Some((digits, power.parse().ok()?))
}

const SUPERSCRIPTS: [char; 11] = [
    '\u{2070}', '\u{b9}', '\u{b2}', '\u{b3}', '\u{2074}', '\u{2075}', '\u{2076}', '\u{2077}', '\u{2078}',
    '\u{2079}', '\u{207b}',
];

/// An exponent in superscript.
pub fn to_superscript(exponent: i32) -> String {
    let raised =
        |c: char| SUPERSCRIPTS[c.to_digit(10).map_or(SUPERSCRIPTS.len() - 1, |digit| digit as usize)];
    exponent.to_string().chars().map(raised).collect()
}

/// A typeset number in ASCII: `-1.5e-7`, and `-` for a missing value.
#[must_use]
pub fn to_ascii(printed: &str) -> String {
    let letter = |c: char| match SUPERSCRIPTS.iter().position(|raised| *raised == c) {
        Some(digit) => char::from_digit(digit as u32, 10).unwrap_or('-'),
        None if matches!(c, '\u{2212}' | '\u{2013}') => '-',
        None => c,
    };
    printed.replace(TIMES_TEN, "e").chars().map(letter).collect()
}

// A value with its standard deviation.

/// Maximum number of decimals of a value with a standard deviation; no measurement here is more accurate. A
/// standard deviation below the last decimal is shown as 1 in that decimal.
const MOST_DECIMALS: i32 = 6;
/// Exponents of ten for which a value and its standard deviation are both written in plain digits. The
/// exponent is that of the larger of the two.
const PLAIN_POWERS_WITH_SD: std::ops::RangeInclusive<i32> = -4..=6;

/// A value with one digit of its standard deviation, in units of the last digit shown: `78.40(3)` for 78.40
/// with 0.03 (JCGM 100:2008, 7.2.2). A value without a deviation (missing, zero or not finite) has four
/// significant digits; a value that is not finite is a dash.
pub fn format_with_sd(value: f64, sd: impl Into<Option<f64>>) -> String {
    if !value.is_finite() {
        return DASH.to_owned();
    }
    let Some(sd) = sd.into().filter(|sd| sd.is_finite() && *sd > 0.0) else { return format_number(value) };
    let larger = math::log10(value.abs().max(sd)).floor() as i32;
    if PLAIN_POWERS_WITH_SD.contains(&larger) {
        return format_digits_with_sd(value, sd);
    }
    let unit = math::powi(10.0, larger);
    format!("{}\u{b7}10{}", format_digits_with_sd(value / unit, sd / unit), to_superscript(larger))
}

fn format_digits_with_sd(value: f64, sd: f64) -> String {
    let power = power_of_first_digit(sd);
    if power > 0 {
        let unit = math::powi(10.0, power);
        let rounded = |x: f64| (x / unit).round() * unit;
        return format!("{}({:.0})", typeset(&format!("{:.0}", rounded(value))), rounded(sd));
    }
    let decimals = (-power).min(MOST_DECIMALS);
    let last = if -power > MOST_DECIMALS { 1.0 } else { (sd * math::powi(10.0, decimals)).round() };
    format!("{}({last:.0})", typeset(&format!("{value:.*}", decimals as usize)))
}

/// Exponent of ten of the first significant digit of `sd` after rounding to one digit: 0.096 rounds to 0.1.
fn power_of_first_digit(sd: f64) -> i32 {
    let power = math::log10(sd).floor() as i32;
    if (sd / math::powi(10.0, power)).round() >= 10.0 { power + 1 } else { power }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits_and_true_minus_signs() {
        assert_eq!(
            [78.4, 900.0, 0.0, -0.0123456].map(format_number),
            ["78.40", "900.0", "0.000", "\u{2212}0.01235"]
        );
        assert_eq!(format_number(-1.23456e-7), "\u{2212}1.235\u{b7}10\u{207b}\u{2077}");
        assert_eq!([format_number(f64::NAN), format_or_dash(None, format_number)], ["\u{2013}", "\u{2013}"]);
    }

    #[test]
    fn numbers_have_the_digits_that_they_are_worth() {
        assert_eq!(
            [
                format_digits(0.0, 2),
                format_digits(3.456, 2),
                format_digits(-0.09996, 3),
                format_digits(1234.0, 2),
                format_digits(f64::NAN, 2)
            ],
            ["0.0", "3.5", "\u{2212}0.100", "1234", "\u{2013}"]
        );
        assert_eq!([format_decimals(-0.04, 1), format_decimals(-0.05001, 1)], ["0.0", "\u{2212}0.1"]);
    }

    #[test]
    fn three_digits_are_kept_at_any_size() {
        assert_eq!(
            [0.0, 1.0, 0.0326, 848.83, 12345.0, -0.5].map(format_short),
            ["0", "1", "0.0326", "849", "12345", "\u{2212}0.5"]
        );
        assert_eq!(
            [7.18e-6, 2.0e7].map(format_short),
            ["7.18\u{b7}10\u{207b}\u{2076}", "2.00\u{b7}10\u{2077}"]
        );
        assert_eq!([f64::NAN, 0.9996, 99_999.0].map(format_short), ["\u{2013}", "1", "1.00\u{b7}10\u{2075}"]);
        assert_eq!(
            [78.4, 900.0, 12.567, 1234.6, 0.51].map(|value| format_trimmed(value, 4)),
            ["78.4", "900", "12.57", "1235", "0.51"]
        );
    }

    #[test]
    fn a_terminal_reads_the_same_number() {
        let read = |value: f64| to_ascii(&format_digits(value, 5)).parse::<f64>().unwrap();
        for value in [-1.2345e-7, 1.2345e12, 0.5, -12.345, 0.0] {
            assert_eq!(read(value), value);
        }
        assert_eq!(to_ascii(DASH), "-");
    }

    #[test]
    fn the_deviation_stands_in_units_of_the_last_digit() {
        let cases = [
            (78.4, 0.03, "78.40(3)"),
            (100.0, 0.1, "100.0(1)"),
            (78.4046, 0.0349, "78.40(3)"),
            (74.8165, 0.4, "74.8(4)"),
            (78.4, 1.4, "78(1)"),
            (899.96, 0.25, "900.0(3)"), // half a digit is rounded away from zero
            (900.0, 29.0, "900(30)"),
            (1234.0, 23.0, "1230(20)"),
            (1250.0, 470.0, "1300(500)"),
            (3.0, 5.0, "3(5)"),
            (-2.04, 0.1, "\u{2212}2.0(1)"),
            (0.0, 0.02, "0.00(2)"),
            (-0.001, 0.02, "0.00(2)"),
            (0.00051, 0.00002, "0.00051(2)"),
            (1e-9, 1e-10, "1.0(1)\u{b7}10\u{207b}\u{2079}"),
            (78.4, 3e8, "0(3)\u{b7}10\u{2078}"),
        ];
        for (value, sd, expected) in cases {
            assert_eq!(format_with_sd(value, sd), expected);
        }
    }

    #[test]
    fn a_deviation_that_rounds_up_to_ten_moves_the_digit() {
        assert_eq!(
            [
                format_with_sd(78.4, 0.096),
                format_with_sd(78.4, 0.96),
                format_with_sd(78.4, 9.6),
                format_with_sd(1234.0, 96.0)
            ],
            ["78.4(1)", "78(1)", "80(10)", "1200(100)"]
        );
        assert_eq!(format_with_sd(78.4, 0.094), "78.40(9)");
    }

    #[test]
    fn no_deviation_gives_four_digits_and_no_number_a_dash() {
        assert_eq!([0.0, -1.0, f64::NAN, f64::INFINITY].map(|sd| format_with_sd(78.4123, sd)), ["78.41"; 4]);
        assert_eq!(format_with_sd(78.4, None), "78.40");
        assert_eq!([f64::NAN, f64::INFINITY].map(|value| format_with_sd(value, 0.1)), ["\u{2013}"; 2]);
    }

    #[test]
    fn extremes_stay_short() {
        assert_eq!(format_with_sd(78.4, 1e-9), "78.400000(1)");
        assert_eq!(format_with_sd(78.4, 2.6e-6), "78.400000(3)");
        assert_eq!(format_with_sd(78.4, f64::MIN_POSITIVE), "78.400000(1)");
        assert!(format_with_sd(f64::MAX, f64::MAX).len() < 24 && format_with_sd(1e12, 1e6).len() < 24);
    }
}
