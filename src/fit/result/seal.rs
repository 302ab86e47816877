//! The hash that a result carries of itself: a digit that changes by accident is found whatever it means.

use crate::text::text_sha256;

/// The key, which is the last one of the file.
const HASH_KEY: &str = "\n  \"sha256\": \"";
const HASH_DIGITS: usize = 64;
/// Digits of a hash in a refusal.
const SHORT_HASH_DIGITS: usize = 12;

/// A pretty-printed JSON object with the hash of itself as its last key: SHA-256 of the whole text with zeros
/// for the digits of the hash.
pub(super) fn append_hash(object: &str) -> String {
    let open = object.trim_end().trim_end_matches('}').trim_end();
    let with = |digits: &str| format!("{open},{HASH_KEY}{digits}\"\n}}\n");
    with(&text_sha256(with(&zero_digits())))
}

/// Holds a text against the hash of itself that it carries.
///
/// # Errors
/// What is wrong.
pub(super) fn check_hash(text: &str) -> Result<(), String> {
    let line_feeds = text.replace("\r\n", "\n");
    let Some(at) = line_feeds.rfind(HASH_KEY) else {
        return Err("found no `sha256` as its last key, expected the SHA-256 of the file itself".to_owned());
    };
    let (before, rest) = line_feeds.split_at(at + HASH_KEY.len());
    let (carried, after) = rest.split_once('"').unwrap_or((rest, ""));
    let found = text_sha256(format!("{before}{}\"{after}", zero_digits()));
    if found == carried {
        return Ok(());
    }
    let short = |hash: &str| hash.chars().take(SHORT_HASH_DIGITS).collect::<String>();
    Err(format!(
        "found SHA-256 {}..., expected {}... as its last key says: the file was changed after the fit wrote it",
        short(&found),
        short(carried)
    ))
}

fn zero_digits() -> String {
    "0".repeat(HASH_DIGITS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_carries_its_own_hash_and_no_other_text_does() {
        let text = append_hash("{\n  \"a\": 1.5,\n  \"b\": []\n}");
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert!(value["a"] == 1.5 && value["sha256"].as_str().unwrap().len() == HASH_DIGITS);
        assert_eq!(check_hash(&text), Ok(()));
        assert_eq!(check_hash(&text.replace('\n', "\r\n")), Ok(()), "a checkout changes line ends");
        assert!(check_hash("{\n  \"a\": 1.5\n}\n").unwrap_err().contains("found no `sha256`"));
        let key = text.find(HASH_KEY).map_or(0..0, |at| at..at + HASH_KEY.len());
        let digits = text.bytes().enumerate().filter(|(at, byte)| byte.is_ascii_digit() && !key.contains(at));
        for (at, byte) in digits {
            let mut other = text.clone();
            other.replace_range(at..=at, if byte == b'9' { "8" } else { "9" });
            assert!(check_hash(&other).unwrap_err().contains("changed after the fit wrote it"), "{other}");
        }
    }
}
