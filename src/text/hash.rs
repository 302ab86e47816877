//! SHA-256 of bytes and of texts, independent of line endings.

use sha2::{Digest, Sha256};

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// SHA-256 of a text that arrives in pieces. A byte-order mark at its start is ignored, and CRLF counts as
/// LF, so that a checkout that changes line endings does not change the hash. Without byte-order mark and
/// CRLF, it equals the SHA-256 of the bytes.
#[derive(Debug, Clone, Default)]
pub struct TextHash {
    digest: Sha256,
    /// The first bytes, kept until they show whether they are a byte-order mark.
    start: Vec<u8>,
    started: bool,
    /// Whether the last byte was a CR; the next byte shows whether a LF follows.
    ends_in_cr: bool,
}

impl TextHash {
    /// Adds bytes.
    pub(crate) fn update(&mut self, mut bytes: &[u8]) {
        if !self.started {
            let missing = BYTE_ORDER_MARK.len() - self.start.len();
            let (first, rest) = bytes.split_at(missing.min(bytes.len()));
            self.start.extend_from_slice(first);
            if self.start.len() < BYTE_ORDER_MARK.len() {
                return;
            }
            self.check_byte_order_mark();
            bytes = rest;
        }
        self.hash_lines(bytes);
    }

    /// The hash as 64 hexadecimal digits.
    pub(crate) fn finish(mut self) -> String {
        if !self.started {
            self.check_byte_order_mark();
        }
        if self.ends_in_cr {
            self.digest.update(b"\r");
        }
        self.digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn check_byte_order_mark(&mut self) {
        self.started = true;
        let start = std::mem::take(&mut self.start);
        if start != BYTE_ORDER_MARK {
            self.hash_lines(&start);
        }
    }

    fn hash_lines(&mut self, bytes: &[u8]) {
        let Some(first) = bytes.first() else { return };
        if std::mem::take(&mut self.ends_in_cr) && *first != b'\n' {
            self.digest.update(b"\r");
        }
        let mut rest = bytes;
        // (`contains` compares many bytes at once)
        while rest.contains(&b'\r')
            && let Some(at) = rest.iter().position(|byte| *byte == b'\r')
        {
            self.digest.update(&rest[..at]);
            rest = &rest[at + 1..];
            match rest.first() {
                Some(b'\n') => {}
                Some(_) => self.digest.update(b"\r"),
                None => self.ends_in_cr = true,
            }
        }
        self.digest.update(rest);
    }
}

/// SHA-256 of bytes, as 64 hexadecimal digits.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Whether the hash of a text by [`TextHash`] is that of its bytes: it has no byte-order mark and no CRLF.
#[must_use]
pub fn is_hashed_as_bytes(text: &[u8]) -> bool {
    !text.starts_with(BYTE_ORDER_MARK) && !text.contains(&b'\r')
}

/// SHA-256 of a complete text, as computed by [`TextHash`].
#[must_use]
pub fn text_sha256(text: impl AsRef<[u8]>) -> String {
    let mut hash = TextHash::default();
    hash.update(text.as_ref());
    hash.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_ends_and_a_byte_order_mark_do_not_count_and_everything_else_does() {
        // FIPS 180-4 example
        assert_eq!(text_sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        let plain = text_sha256("a,b\n1,2\n");
        assert_eq!(text_sha256("\u{feff}a,b\r\n1,2\r\n"), plain);
        for other in ["a,b\n1,3\n", "a,b\n1,2", "a,b\r1,2\n", "a,b\n1,2\n\r", "\n\u{feff}a,b\n1,2\n"] {
            assert_ne!(text_sha256(other), plain, "{other:?}");
        }
    }

    #[test]
    fn where_the_pieces_end_does_not_matter() {
        let text = "\u{feff}a\r\n\rb\r\r\n".as_bytes();
        let mut plain = Sha256::new();
        plain.update("a\n\rb\r\n");
        let expected: String = plain.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        for cut in 0..=text.len() {
            let mut hash = TextHash::default();
            hash.update(&text[..cut]);
            hash.update(&text[cut..]);
            assert_eq!(hash.finish(), expected, "{cut}");
        }
    }
}
