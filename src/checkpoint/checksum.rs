//! The checksum at the end of each line of a journal, and the fingerprint of a problem.
//!
//! A line is a JSON object whose last key is `sha256`. The value of this key is the first 16 hexadecimal
//! digits of the SHA-256 of all bytes before the comma in front of the key, so that `sha256sum` can verify a
//! line.

use serde::Serialize;
use serde_json::Value;
use sha2::{Digest, Sha256};

const CHECKSUM_KEY: &str = ",\"sha256\":\"";
const LINE_END: &str = "\"}";
/// Number of hexadecimal digits of the checksum. 16 digits are 64 bits, so the probability that an accidental
/// change of a line goes unnoticed is about 1 in 2e19.
const CHECKSUM_DIGITS: usize = 16;

/// Appends the checksum to a JSON object; the result is a line of a journal without its line feed.
#[must_use]
pub fn append_checksum(object: &str) -> String {
    let content = object.strip_suffix('}').unwrap_or(object);
    format!("{content}{CHECKSUM_KEY}{}{LINE_END}", hex_checksum(content.as_bytes()))
}

/// Result of checking the checksum of a line.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum LineChecksum {
    /// The checksum is correct. The value contains the bytes of the JSON object without the checksum.
    Valid(Vec<u8>),
    /// The checksum in the line differs from the computed one.
    Broken { found: String, computed: String },
    /// The line has no checksum.
    Absent,
}

impl LineChecksum {
    pub(super) fn check(line: &[u8]) -> Self {
        let Some((content, found)) = split_checksum(line) else { return Self::Absent };
        let computed = hex_checksum(content);
        if found == computed.as_bytes() {
            return Self::Valid([content, b"}"].concat());
        }
        Self::Broken { found: String::from_utf8_lossy(found).into_owned(), computed }
    }
}

/// Splits a line into the bytes before the checksum, and the digits of the checksum.
fn split_checksum(line: &[u8]) -> Option<(&[u8], &[u8])> {
    let line = line.strip_suffix(LINE_END.as_bytes())?;
    let (rest, digits) = line.split_at_checked(line.len().checked_sub(CHECKSUM_DIGITS)?)?;
    Some((rest.strip_suffix(CHECKSUM_KEY.as_bytes())?, digits))
}

fn hex_checksum(content: &[u8]) -> String {
    Sha256::digest(content).iter().take(CHECKSUM_DIGITS / 2).map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256, in hexadecimal, of the canonical JSON of a problem: keys are sorted, and each number is the
/// shortest decimal that keeps every bit. Problems with equal values have equal fingerprints, whatever the
/// layout of their files.
pub(crate) fn fingerprint(problem: &impl Serialize) -> String {
    // serializing finite numbers and string keys cannot fail
    let value = serde_json::to_value(problem).unwrap_or_default();
    let mut text = String::new();
    write_canonical(&value, &mut text);
    Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn write_canonical(value: &Value, text: &mut String) {
    match value {
        Value::Object(map) => {
            let mut entries: Vec<_> = map.iter().collect();
            entries.sort_by_key(|(key, _)| *key);
            text.push('{');
            for (key, value) in entries {
                *text += &format!("{}:", Value::from(key.as_str()));
                write_canonical(value, text);
                text.push(',');
            }
            text.push('}');
        }
        Value::Array(values) => {
            text.push('[');
            for value in values {
                write_canonical(value, text);
                text.push(',');
            }
            text.push(']');
        }
        plain => *text += &plain.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn every_changed_byte_of_a_line_is_found() {
        let line = append_checksum("{\"index\":3,\"values\":[\"0.25\"]}");
        // checksum from `printf '%s' '{"index":3,"values":["0.25"]' | sha256sum`
        assert_eq!(line, "{\"index\":3,\"values\":[\"0.25\"],\"sha256\":\"3e7e4b4d0d5fce91\"}");
        assert_eq!(
            LineChecksum::check(line.as_bytes()),
            LineChecksum::Valid(b"{\"index\":3,\"values\":[\"0.25\"]}".to_vec())
        );
        for at in 0..line.len() {
            for bit in 0..8 {
                let mut changed = line.clone().into_bytes();
                changed[at] ^= 1 << bit;
                assert!(
                    !matches!(LineChecksum::check(&changed), LineChecksum::Valid(_)),
                    "byte {at}, bit {bit}"
                );
            }
        }
        for cut in 0..line.len() {
            assert_eq!(LineChecksum::check(&line.as_bytes()[..cut]), LineChecksum::Absent, "cut at {cut}");
        }
    }

    #[test]
    fn the_order_of_keys_does_not_matter_and_every_bit_of_a_number_does() {
        let of = |text: &str| fingerprint(&serde_json::from_str::<Value>(text).unwrap());
        assert_eq!(of("{\"a\":1.5,\"b\":[2]}"), of("{ \"b\": [2], \"a\": 1.50 }"));
        assert_eq!(of("{}").len(), 64);
        let next = f64::from_bits(0.3_f64.to_bits() + 1);
        let base = json!({ "a": 0.3, "b": ["c", "d"] });
        let others = [
            json!({ "a": next, "b": ["c", "d"] }),
            json!({ "a": 0.3, "b": ["cd"] }),
            json!({ "a": 0.3, "b": ["d", "c"] }),
            json!({ "a": 0.3, "b": "[\"c\",\"d\",]" }),
            json!({ "c": 0.3, "b": ["c", "d"] }),
        ];
        assert!(others.iter().all(|other| fingerprint(other) != fingerprint(&base)));
    }
}
