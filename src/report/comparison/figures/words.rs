//! Numbers and names in captions.

use crate::recording::channel::Channel;

/// So many significant digits, without an exponent.
pub(super) fn digits(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return "?".to_owned();
    }
    // of the first digit once rounded: 0.0999 with two digits is 0.10
    let rounded = format!("{value:.*e}", (digits - 1).max(0) as usize);
    let power: i32 = rounded.split_once('e').and_then(|(_, power)| power.parse().ok()).unwrap_or(0);
    let unit = 10.0_f64.powi(power + 1 - digits);
    let decimals = (digits - 1 - power).max(0) as usize;
    format!("{:.*}", decimals, (value / unit).round() * unit).replace('-', "\u{2212}")
}

/// A channel in a sentence.
pub(super) fn channel(channel: Channel) -> String {
    channel.name().replace('-', " ")
}

/// A length in the unit in which it reads best, with two digits.
pub(super) fn length(metres: f64) -> String {
    if metres.abs() < 1e-3 {
        format!("{} \u{b5}m", digits(metres * 1e6, 2))
    } else {
        format!("{} mm", digits(metres * 1e3, 3))
    }
}

/// A speed, mm/s.
pub(super) fn speed(metres_per_s: f64) -> String {
    format!("{} mm/s", digits(metres_per_s * 1e3, 3))
}

/// A time, ms, to a tenth; no sign of zero. One that is a clock's, and no length of a motion, in seconds.
pub(super) fn milliseconds(seconds: f64) -> String {
    const CLOCK_S: f64 = 10.0;
    if seconds.abs() >= CLOCK_S {
        return format!("{seconds:.4} s").replace('-', "\u{2212}");
    }
    let text = format!("{:.1}", seconds * 1e3);
    format!("{} ms", if text == "-0.0" { "0.0".to_owned() } else { text.replace('-', "\u{2212}") })
}

/// A share, per cent.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", digits(100.0 * share, 2))
}

/// "once", "twice", "14 times".
pub(super) fn times(count: usize) -> String {
    match count {
        1 => "once".to_owned(),
        2 => "twice".to_owned(),
        n => format!("{n} times"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_they_are_worth() {
        assert_eq!(
            [digits(0.0, 2), digits(3.456, 2), digits(-0.09996, 3), digits(1234.0, 2), digits(f64::NAN, 2)],
            ["0.0", "3.5", "\u{2212}0.100", "1200", "?"]
        );
        assert_eq!(
            [length(3.2e-6), length(1.234e-3), speed(0.0071), milliseconds(-0.00014)],
            ["3.2 \u{b5}m", "1.23 mm", "7.10 mm/s", "\u{2212}0.1 ms"]
        );
        assert_eq!(
            [milliseconds(-0.00004), milliseconds(0.00004), milliseconds(-86400.0)],
            ["0.0 ms", "0.0 ms", "\u{2212}86400.0000 s"]
        );
        assert_eq!([percent(0.314), times(1), times(14)], ["31 %", "once", "14 times"]);
    }
}
