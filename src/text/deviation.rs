//! A value with its standard deviation, in one way everywhere.

use super::number::{format_number, typeset};
use super::{DASH, to_superscript};
use crate::math;

/// Most decimals shown: more are beyond any measurement here, and a deviation below them is rounded up to the
/// last one.
const MOST_DECIMALS: i32 = 6;
/// Powers of ten of the larger of value and deviation that are written in plain digits.
const PLAIN_POWERS_WITH_SD: std::ops::RangeInclusive<i32> = -4..=6;

/// A value with its standard deviation in units of the last digit shown, `78.40(3)` for 78.40 with 0.03
/// (JCGM 100:2008, 7.2.2), one digit of it. Four significant digits without a deviation (none, zero or no
/// finite number); a dash for a value that is no finite number.
#[must_use]
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

/// Power of ten of the first digit once rounded to it: 0.096 is 0.1.
fn power_of_first_digit(sd: f64) -> i32 {
    let power = math::log10(sd).floor() as i32;
    if (sd / math::powi(10.0, power)).round() >= 10.0 { power + 1 } else { power }
}

#[cfg(test)]
mod tests {
    use super::*;

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
