//! Numbers with their standard deviations in few characters.

/// Most decimals shown: more are beyond any measurement here, and a deviation below them is rounded up to the
/// last one.
const MOST_DECIMALS: i32 = 6;
/// Largest power of ten of a deviation that is still written in full.
const MOST_POWER: i32 = 6;

/// A value with its standard deviation in the unit of the last digit shown, `78.40(3)` for 78.40 with 0.03
/// (JCGM 100:2008, 7.2.2), one digit of it. Without a deviation (zero or no finite number) the value has four
/// significant digits; a value that is no finite number is `?`.
#[must_use]
pub fn with_sd(value: f64, sd: f64) -> String {
    if !value.is_finite() {
        return "?".to_owned();
    }
    if !(sd.is_finite() && sd > 0.0) {
        return four_digits(value);
    }
    let power = power_of_first_digit(sd);
    if power > MOST_POWER {
        return format!("{value:.1e} \u{b1} {sd:.0e}");
    }
    if power > 0 {
        let unit = 10.0_f64.powi(power);
        return format!("{:.0}({:.0})", (value / unit).round() * unit, (sd / unit).round() * unit);
    }
    let decimals = (-power).min(MOST_DECIMALS);
    let last = sd * 10.0_f64.powi(decimals);
    let last = if -power > MOST_DECIMALS { 1.0 } else { last.round() };
    format!("{value:.*}({last:.0})", decimals as usize)
}

/// Power of ten of the first digit once rounded to it: 0.096 is 0.1.
fn power_of_first_digit(sd: f64) -> i32 {
    let power = sd.log10().floor() as i32;
    if (sd / 10.0_f64.powi(power)).round() >= 10.0 { power + 1 } else { power }
}

/// Four significant digits without an exponent, at most three decimals, no zeros at the end.
#[must_use]
pub fn four_digits(value: f64) -> String {
    let decimals = if value > 0.0 { (3 - value.log10().floor() as i32).clamp(0, 3) } else { 1 };
    let text = format!("{value:.*}", decimals as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
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
            (78.4, 1.4, "78(1)"),
            (899.96, 0.25, "900.0(3)"), // half a digit is rounded away from zero
            (1234.0, 23.0, "1230(20)"),
            (1250.0, 470.0, "1300(500)"),
            (3.0, 5.0, "3(5)"),
            (-2.04, 0.1, "-2.0(1)"),
            (0.0, 0.02, "0.00(2)"),
        ];
        for (value, sd, expected) in cases {
            assert_eq!(with_sd(value, sd), expected);
        }
    }

    #[test]
    fn a_deviation_that_rounds_up_to_ten_moves_the_digit() {
        assert_eq!(
            [with_sd(78.4, 0.096), with_sd(78.4, 0.96), with_sd(78.4, 9.6), with_sd(1234.0, 96.0)],
            ["78.4(1)", "78(1)", "80(10)", "1200(100)"]
        );
        assert_eq!(with_sd(78.4, 0.094), "78.40(9)");
    }

    #[test]
    fn no_deviation_gives_four_digits_and_no_number_a_question_mark() {
        assert_eq!([0.0, -1.0, f64::NAN, f64::INFINITY].map(|sd| with_sd(78.4123, sd)), ["78.41"; 4]);
        assert_eq!([f64::NAN, f64::INFINITY].map(|value| with_sd(value, 0.1)), ["?"; 2]);
    }

    #[test]
    fn extremes_stay_short() {
        assert_eq!(with_sd(78.4, 1e-9), "78.400000(1)");
        assert_eq!(with_sd(78.4, 2.6e-6), "78.400000(3)");
        assert_eq!(with_sd(78.4, f64::MIN_POSITIVE), "78.400000(1)");
        assert_eq!(with_sd(78.4, 3e8), "7.8e1 \u{b1} 3e8");
        assert!(with_sd(f64::MAX, f64::MAX).len() < 24 && with_sd(1e12, 1e6).len() < 24);
    }

    #[test]
    fn four_digits_are_given() {
        assert_eq!(
            [78.4, 900.0, 12.567, 1234.6, 0.51].map(four_digits),
            ["78.4", "900", "12.57", "1235", "0.51"]
        );
    }
}
