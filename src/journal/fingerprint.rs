//! What tells two problems apart.

use serde::Serialize;
use serde_json::Value;
use sha2::{Digest, Sha256};

/// SHA-256 over the canonical JSON of a problem, in hexadecimal: keys sorted, numbers as the shortest
/// decimals that give the same bits back. Equal values have equal fingerprints, however their files are
/// written.
#[must_use]
pub fn fingerprint(problem: &impl Serialize) -> String {
    // a problem holds finite numbers and keys that are strings: nothing that cannot be written
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
