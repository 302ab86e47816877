//! The checksum at the end of a line.
//!
//! A line is a JSON object of which `sha256` is the last key: the first digits of the SHA-256 of every byte
//! of the line before that key's comma. Whoever edits a line by hand sees that it is guarded, and whoever
//! wants to check one needs no more than `sha256sum`.

use sha2::{Digest, Sha256};

const KEY: &str = ",\"sha256\":\"";
const END: &str = "\"}";
/// Hexadecimal digits of the checksum: 64 bits, so that an accident is missed once in 2e19.
const DIGITS: usize = 16;

/// A JSON object with its checksum, as it stands in a line; for whoever writes journals by another program.
#[must_use]
pub fn sealed(object: &str) -> String {
    let content = object.strip_suffix('}').unwrap_or(object);
    format!("{content}{KEY}{}{END}", checksum(content.as_bytes()))
}

/// What the end of a line says of the rest.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Seal {
    /// The checksum holds; the object without it.
    Holds(Vec<u8>),
    /// The checksum does not hold: what stands there, and what the line has.
    Broken {
        found: String,
        computed: String,
    },
    Absent,
}

impl Seal {
    pub(super) fn of(line: &[u8]) -> Self {
        let Some((content, found)) = parts(line) else { return Self::Absent };
        let computed = checksum(content);
        match String::from_utf8_lossy(found).into_owned() {
            found if found == computed => Self::Holds([content, b"}"].concat()),
            found => Self::Broken { found, computed },
        }
    }
}

/// The bytes before the checksum, and the checksum.
fn parts(line: &[u8]) -> Option<(&[u8], &[u8])> {
    let line = line.strip_suffix(END.as_bytes())?;
    let (rest, digits) = line.split_at_checked(line.len().checked_sub(DIGITS)?)?;
    Some((rest.strip_suffix(KEY.as_bytes())?, digits))
}

fn checksum(content: &[u8]) -> String {
    Sha256::digest(content).iter().take(DIGITS / 2).map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_changed_byte_of_a_line_is_found() {
        let line = sealed("{\"index\":3,\"values\":[\"0.25\"]}");
        // printf '%s' '{"index":3,"values":["0.25"]' | sha256sum
        assert_eq!(line, "{\"index\":3,\"values\":[\"0.25\"],\"sha256\":\"3e7e4b4d0d5fce91\"}");
        assert_eq!(Seal::of(line.as_bytes()), Seal::Holds(b"{\"index\":3,\"values\":[\"0.25\"]}".to_vec()));
        for at in 0..line.len() {
            for bit in 0..8 {
                let mut changed = line.clone().into_bytes();
                changed[at] ^= 1 << bit;
                assert!(!matches!(Seal::of(&changed), Seal::Holds(_)), "byte {at}, bit {bit}");
            }
        }
        for cut in 0..line.len() {
            assert_eq!(Seal::of(&line.as_bytes()[..cut]), Seal::Absent, "cut at {cut}");
        }
    }
}
