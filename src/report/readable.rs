//! Numbers and units as figures and captions show them: few digits, and a prefix that saves the zeros.

use super::chart::superscript;

/// Powers of ten that are written in plain digits.
const PLAIN: std::ops::RangeInclusive<i32> = -3..=4;

/// Three significant digits, with a true minus sign; a power of ten where plain digits would be long.
#[must_use]
pub fn short(value: f64) -> String {
    if !value.is_finite() {
        return "?".to_owned();
    }
    let written = format!("{value:.2e}");
    let (digits, power) = written.split_once('e').unwrap_or((&written, "0"));
    let power: i32 = power.parse().unwrap_or(0);
    let text = if PLAIN.contains(&power) {
        let plain = format!("{value:.*}", (2 - power).max(0) as usize);
        if plain.contains('.') { plain.trim_end_matches('0').trim_end_matches('.').to_owned() } else { plain }
    } else {
        format!("{digits}\u{b7}10{}", superscript(power))
    };
    text.replace('-', "\u{2212}")
}

/// Prefixes with their factors, the smallest last.
const PREFIXES: [(&str, f64); 3] = [("", 1.0), ("m", 1e3), ("\u{b5}", 1e6)];
/// Units that take no prefix here, or are known better by another name.
const OTHERWISE: [(&str, &str, f64); 5] =
    [("1", "", 1.0), ("", "", 1.0), ("kg", "g", 1e3), ("kg m2", "g mm\u{b2}", 1e9), ("s/m", "s/m", 1.0)];
/// Least value, in the unit as shown, that is still without a prefix: 0.2 N is read as easily as 200 mN.
const LEAST: f64 = 0.1;

/// A unit with the prefix that makes the largest of some values readable, and the factor to it; nothing for a
/// plain number.
#[must_use]
pub fn unit(unit: &str, values: impl IntoIterator<Item = f64>) -> (String, f64) {
    if let Some((_, shown, factor)) = OTHERWISE.iter().find(|(name, ..)| *name == unit) {
        return ((*shown).to_owned(), *factor);
    }
    let largest = values.into_iter().filter(|v| v.is_finite()).map(f64::abs).fold(0.0, f64::max);
    let fits = |(_, factor): &&(&str, f64)| largest == 0.0 || largest * factor >= LEAST;
    let (prefix, factor) = PREFIXES.iter().find(fits).unwrap_or(&PREFIXES[PREFIXES.len() - 1]);
    (format!("{prefix}{unit}"), *factor)
}

/// A name with its unit, as an axis has it.
#[must_use]
pub fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}, {unit}") }
}

/// The first letters of a text, with an ellipsis where some are left out.
#[must_use]
pub fn shortened(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let kept: String = text.chars().take(most.saturating_sub(1)).collect();
    format!("{}\u{2026}", kept.trim_end())
}

/// "a, b and c".
#[must_use]
pub fn listed(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [all @ .., last] => format!("{} and {last}", all.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_are_kept_whatever_the_size() {
        assert_eq!(
            [0.0, 1.0, 0.0326, 848.83, 12345.0, -0.5].map(short),
            ["0", "1", "0.0326", "849", "12345", "\u{2212}0.5"]
        );
        assert_eq!([7.18e-6, 2.0e7].map(short), ["7.18\u{b7}10\u{207b}\u{2076}", "2.00\u{b7}10\u{2077}"]);
        assert_eq!([f64::NAN, 0.9996, 99_999.0].map(short), ["?", "1", "1.00\u{b7}10\u{2075}"]);
    }

    #[test]
    fn prefixes_save_zeros_where_the_unit_takes_one() {
        let of = |name: &str, value: f64| unit(name, [value, value / 1e9]);
        assert_eq!(of("N m/rad", 0.0019), ("mN m/rad".to_owned(), 1e3));
        assert_eq!(of("N", -0.2), ("N".to_owned(), 1.0));
        assert_eq!(of("m", 2e-5), ("\u{b5}m".to_owned(), 1e6));
        assert_eq!(of("N m s/rad", 1e-12), ("\u{b5}N m s/rad".to_owned(), 1e6));
        assert_eq!(
            [of("s/m", 1e-3), of("1", 1e-3), of("kg", 1e-4)],
            [("s/m".to_owned(), 1.0), (String::new(), 1.0), ("g".to_owned(), 1e3)]
        );
        assert_eq!(unit("Hz", [0.0]), ("Hz".to_owned(), 1.0));
    }

    #[test]
    fn long_names_end_in_an_ellipsis() {
        assert_eq!(
            [shortened("deflection after", 12), shortened("release", 12), shortened("\u{e9}\u{e9}\u{e9}", 2)],
            ["deflection\u{2026}", "release", "\u{e9}\u{2026}"]
        );
        assert_eq!(listed(&["a".to_owned(), "b".to_owned(), "c".to_owned()]), "a, b and c");
    }
}
