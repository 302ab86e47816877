//! Units with metric prefixes, and fractions as percentages.

use plain_charts::number::{format_decimals, format_digits, format_short, format_with_sd, to_ascii, typeset};

/// Prefixes, from the largest to the smallest, each with the factor from the unit without a prefix.
const PREFIXES: [(&str, f64); 3] = [("", 1.0), ("m", 1e3), ("\u{b5}", 1e6)];
/// Units that get no prefix or have another name in text: name in files, name in text, and factor.
const UNPREFIXED_UNITS: [(&str, &str, f64); 5] =
    [("1", "", 1.0), ("", "", 1.0), ("kg", "g", 1e3), ("kg m2", "g mm\u{b2}", 1e9), ("s/m", "s/m", 1.0)];
/// The larger unit is kept if the number in that unit is at least this: 0.2 N is as readable as 200 mN.
const LEAST_UNPREFIXED: f64 = 0.1;

/// A unit with the prefix that makes the largest of some values readable, and the factor to that unit; the
/// unit is empty for a plain number.
pub(crate) fn choose_prefix(unit: &str, values: impl IntoIterator<Item = f64>) -> (String, f64) {
    if let Some((_, shown, factor)) = UNPREFIXED_UNITS.iter().find(|(name, ..)| *name == unit) {
        return ((*shown).to_owned(), *factor);
    }
    let largest = values.into_iter().filter(|v| v.is_finite()).map(f64::abs).fold(0.0, f64::max);
    let fits = |(_, factor): &&(&str, f64)| largest == 0.0 || largest * factor >= LEAST_UNPREFIXED;
    let (prefix, factor) = PREFIXES.iter().find(fits).unwrap_or(&PREFIXES[PREFIXES.len() - 1]);
    (format!("{prefix}{unit}"), *factor)
}

/// A name with its unit, as in the label of an axis.
pub(crate) fn label_with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}, {unit}") }
}

/// A length, m, as micrometres with two digits or as millimetres with three.
pub(crate) fn format_length(metres: f64) -> String {
    if metres.abs() < 1e-3 {
        format!("{} \u{b5}m", format_digits(metres * 1e6, 2))
    } else {
        format!("{} mm", format_digits(metres * 1e3, 3))
    }
}

/// A speed, m/s, as mm/s with three digits.
pub(crate) fn format_speed(metres_per_s: f64) -> String {
    format!("{} mm/s", format_digits(metres_per_s * 1e3, 3))
}

/// A rate with at most seven significant digits, without trailing zeros.
pub(crate) fn format_rate(hz: f64) -> String {
    format!("{:.6e}", hz).parse::<f64>().map_or_else(|_| hz.to_string(), |rounded| rounded.to_string())
}

/// A time, s, as milliseconds with one decimal. A time of 10 s or more, such as the time of a clock, stays in
/// seconds.
pub(crate) fn format_milliseconds(seconds: f64) -> String {
    const CLOCK_S: f64 = 10.0;
    if seconds.abs() >= CLOCK_S {
        format!("{} s", format_decimals(seconds, 4))
    } else {
        format!("{} ms", format_decimals(1e3 * seconds, 1))
    }
}

/// A fraction as a percentage with three digits, without trailing zeros: 0.02 becomes `2 %`.
pub(crate) fn format_percent(share: f64) -> String {
    format!("{} %", format_short(100.0 * share))
}

/// A relative error as a signed percentage.
pub(crate) fn format_signed_percent(share: f64) -> String {
    let written = format!("{:+.2}", 100.0 * share);
    let written = if written[1..] == *"0.00" { "0.00" } else { &written };
    format!("{} %", typeset(written))
}

/// A standard deviation of an angle that is smaller than this value, degrees, is shown as this value; 0.0001
/// degrees move a point at 6 mm by 0.01 um.
const LEAST_SHOWN_DEGREES: f64 = 1e-4;

/// An angle with its standard deviation, both in rad, as degrees in ASCII: `0.300(1) degrees`.
pub(crate) fn format_degrees(angle_rad: f64, sd_rad: f64) -> String {
    let sd = sd_rad.to_degrees().max(LEAST_SHOWN_DEGREES);
    format!("{} degrees", to_ascii(&format_with_sd(angle_rad.to_degrees(), sd)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_save_zeros_where_the_unit_takes_one() {
        let of = |name: &str, value: f64| choose_prefix(name, [value, value / 1e9]);
        assert_eq!(of("N m/rad", 0.0019), ("mN m/rad".to_owned(), 1e3));
        assert_eq!(of("N", -0.2), ("N".to_owned(), 1.0));
        assert_eq!(of("m", 2e-5), ("\u{b5}m".to_owned(), 1e6));
        assert_eq!(of("N m s/rad", 1e-12), ("\u{b5}N m s/rad".to_owned(), 1e6));
        assert_eq!(
            [of("s/m", 1e-3), of("1", 1e-3), of("kg", 1e-4)],
            [("s/m".to_owned(), 1.0), (String::new(), 1.0), ("g".to_owned(), 1e3)]
        );
        assert_eq!(choose_prefix("Hz", [0.0]), ("Hz".to_owned(), 1.0));
    }

    #[test]
    fn quantities_have_the_unit_in_which_they_read_best() {
        assert_eq!(
            [
                format_length(3.2e-6),
                format_length(1.234e-3),
                format_speed(0.0071),
                format_milliseconds(-0.00014)
            ],
            ["3.2 \u{b5}m", "1.23 mm", "7.10 mm/s", "\u{2212}0.1 ms"]
        );
        assert_eq!(
            [format_milliseconds(-0.00004), format_milliseconds(0.00004), format_milliseconds(-86400.0)],
            ["0.0 ms", "0.0 ms", "\u{2212}86400.0000 s"]
        );
    }

    #[test]
    fn shares_are_percentages() {
        assert_eq!(
            [0.0123, -0.2, 0.0, -1e-6].map(format_signed_percent),
            ["+1.23 %", "\u{2212}20.00 %", "0.00 %", "0.00 %"]
        );
        assert_eq!(
            [0.02, 0.005, 0.0, 0.314, 1e-9].map(format_percent),
            ["2 %", "0.5 %", "0 %", "31.4 %", "1.00\u{b7}10\u{207b}\u{2077} %"]
        );
    }
}
