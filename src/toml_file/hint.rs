//! Advice on common mistakes.

use crate::text::round_to_digits;
use toml::de::DeValue;

/// Number of digits to which a converted number is rounded; the product of two decimal numbers may have many
/// more.
const DIGITS: usize = 6;

/// Prefixes of units with their factors.
const PREFIXES: [(&str, f64); 9] = [
    ("", 1.0),
    ("k", 1e3),
    ("M", 1e6),
    ("c", 1e-2),
    ("m", 1e-3),
    ("u", 1e-6),
    ("\u{b5}", 1e-6),
    ("\u{3bc}", 1e-6),
    ("n", 1e-9),
];

/// Units: name, ending of the keys that have this unit, and size of the unit in the unit of the key.
const UNITS: [(&str, &str, f64); 15] = [
    ("Hz", "_hz", 1.0),
    ("hz", "_hz", 1.0),
    ("fps", "_hz", 1.0),
    ("m", "_m", 1.0),
    ("s", "_s", 1.0),
    ("g", "_kg", 1e-3),
    ("N", "_n", 1.0),
    ("rad", "_rad", 1.0),
    ("deg", "_rad", std::f64::consts::PI / 180.0),
    ("\u{b0}", "_rad", std::f64::consts::PI / 180.0),
    ("deg", "_deg", 1.0),
    ("\u{b0}", "_deg", 1.0),
    ("%", "_ratio", 1e-2),
    ("%", "_relative", 1e-2),
    ("%", "_fraction", 1e-2),
];

/// Advice on a value of the wrong type; `kinds` are the types that the key accepts.
pub(super) fn suggest_value(key: &str, value: &DeValue<'_>, kinds: &[&str]) -> Option<String> {
    let takes = |kind: &str| kinds.contains(&kind);
    let is_numeric = takes("number") || takes("integer");
    Some(match value {
        DeValue::String(text) if is_numeric => return suggest_number(key, text),
        DeValue::String(text) if takes("array") => format!("write [\"{text}\"]"),
        DeValue::Array(list) if is_numeric && list.len() == 2 => {
            "a decimal number has a point, no comma".to_owned()
        }
        DeValue::Table(_) if takes("array") => {
            format!("write `[[{key}]]`: a list of tables has double brackets")
        }
        DeValue::Array(_) if takes("object") => format!("write `[{key}]` with single brackets"),
        DeValue::Integer(_) | DeValue::Float(_) | DeValue::Boolean(_) if takes("string") => {
            "a text stands between double quotes".to_owned()
        }
        _ => return None,
    })
}

/// Advice on a number in quotes.
fn suggest_number(key: &str, text: &str) -> Option<String> {
    let text = text.trim();
    if text.parse::<f64>().is_ok() {
        return Some(format!("write {text} without quotes"));
    }
    let pointed = text.replacen(',', ".", 1);
    if pointed.parse::<f64>().is_ok() {
        return Some(format!("write {pointed}: a decimal number has a point, no comma, and no quotes"));
    }
    suggest_without_unit(key, text)
}

/// Advice on a number followed by a unit.
fn suggest_without_unit(key: &str, text: &str) -> Option<String> {
    // (the longest number at the start: in `1e3Hz` this includes the exponent, in `10e` there is none)
    let number = |text: &str| text.trim().replacen(',', ".", 1).parse::<f64>().ok();
    let (value, unit) =
        (1..=text.len()).rev().find_map(|end| Some((number(text.get(..end)?)?, &text[end..])))?;
    let unit = unit.trim();
    if unit.is_empty() {
        return None;
    }
    // (a key of a quotient, such as `_n_per_m`, ends in the unit of its denominator, so the number is not
    // converted)
    let mut prefixes = PREFIXES.iter().filter(|_| !key.contains("_per_"));
    let size = prefixes.find_map(|(prefix, factor)| {
        let rest = unit.strip_prefix(prefix)?;
        let of_key = |(name, end, _): &&(&str, &str, f64)| *name == rest && key.ends_with(end);
        UNITS.iter().find(of_key).map(|(_, _, size)| factor * size)
    });
    let without_unit = |size: f64| {
        format!("write {:?} without a unit: the key says it", round_to_digits(value * size, DIGITS))
    };
    let alone = || "write the number alone, in the unit that the key ends in".to_owned();
    Some(size.map_or_else(alone, without_unit))
}

/// Description of a key or table that is defined twice.
pub(super) fn describe_duplicate(line: &str) -> String {
    let line = line.split('#').next().unwrap_or_default().trim();
    if let Some(table) = line.strip_prefix('[') {
        let name = table.trim_matches(['[', ']']).trim();
        return format!(
            "table `{name}`: found a second time, expected it once; where several are meant, all of them have \
             double brackets: `[[{name}]]`"
        );
    }
    let key = line.split('=').next().unwrap_or_default().trim();
    format!("key `{key}`: found a second time, expected it once; remove one of the two")
}

/// Description of a line that is not TOML, for common mistakes.
pub(super) fn describe_bad_line(line: &str) -> Option<String> {
    let line = line.split('#').next().unwrap_or_default().trim();
    let Some((key, value)) = line.split_once('=') else {
        let is_table = line.is_empty() || line.starts_with(['[', ']', '{', '}', '"', '\'']);
        return (!is_table).then(|| format!("found `{line}`, expected `key = value`"));
    };
    let (key, value) = (key.trim(), value.trim());
    let said = |hint: String| format!("key `{key}`: found {value}, expected a value as TOML has it; {hint}");
    if value.is_empty() {
        return Some(format!("key `{key}`: found nothing after `=`, expected a value"));
    }
    if value.starts_with('"') && value.contains('\\') {
        let hint = "a backslash between double quotes starts an escape: write the path with `/`, or between single quotes";
        return Some(said(hint.to_owned()));
    }
    if value.starts_with(['"', '\'', '[', '{']) {
        return None;
    }
    let last = key.rsplit('.').next().unwrap_or(key);
    if value.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+' || c == '.' || c == ',') {
        let hint = match value.replacen(',', ".", 1).parse::<f64>() {
            Ok(number) => {
                Some(format!("write {number:?}: a decimal number has a point with digits on both sides"))
            }
            Err(_) => suggest_without_unit(last, value),
        };
        return hint.map(said);
    }
    let is_word = value.chars().all(|c| c.is_alphanumeric() || "-_./ :".contains(c));
    is_word.then(|| said(format!("write \"{value}\": a text stands between double quotes")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_with_a_unit_is_written_in_that_of_its_key() {
        for (key, text, written) in [
            ("sample_rate_hz", "10 kHz", "10000.0"),
            ("lip_length_m", "1,6 mm", "0.0016"),
            ("noise_m", "2 \u{b5}m", "2e-6"),
            ("exposure_s", "50us", "5e-5"),
            ("head_mass_kg", "1.4g", "0.0014"),
            ("lip_damping_ratio", "4.9 %", "0.049"),
            ("tilt_sd_deg", "0.3\u{b0}", "0.3"),
        ] {
            assert!(
                suggest_without_unit(key, text).unwrap().starts_with(&format!("write {written} without")),
                "{text}"
            );
        }
        // no conversion for a key with a quotient, or for a unit that the table lacks
        for (key, text) in [("head_stiffness_n_per_m", "25 mm"), ("noise_px", "0.1 px"), ("stop_s", "1 min")]
        {
            assert!(suggest_without_unit(key, text).unwrap().starts_with("write the number alone"), "{text}");
        }
        assert_eq!(
            (suggest_without_unit("stop_s", "soon"), suggest_without_unit("stop_s", "1.0")),
            (None, None)
        );
    }
}
