//! Decodes the bytes of a file to text. This is the only file that uses `encoding_rs`.

use crate::import::error::{ImportError, ImportResult};
use crate::import::reader::file_type;
use encoding_rs::{Encoding, SHIFT_JIS, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};
use std::borrow::Cow;

/// Text of an export, and the encoding in which the file stores it. Lines of the text end in `\n` or `\r\n`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct DecodedText<'a> {
    /// The text, without a byte-order mark.
    pub text: Cow<'a, str>,
    /// Name of the encoding in the WHATWG standard.
    pub encoding: &'static str,
}

/// Decodes `bytes` from the encoding `wanted`. If `wanted` is `None`, the encoding is detected. A byte-order
/// mark decides; without one, UTF-8 is tried first. If the bytes are not valid UTF-8, they are decoded as
/// CP932 if they look Japanese, otherwise as Windows-1252.
///
/// # Errors
/// [`ImportError`] for files that are not text, for unknown encodings, and for bytes that are not valid in
/// the encoding.
pub(crate) fn decode_text<'a>(
    file: &str,
    bytes: &'a [u8],
    wanted: Option<&str>,
) -> ImportResult<DecodedText<'a>> {
    if let Some(error) = file_type::refuse_bytes(file, bytes) {
        return Err(error);
    }
    let padding = bytes.iter().rev().take_while(|byte| **byte == 0).count();
    let (text, encoding) = match wanted {
        Some(name) => decode_as(file, bytes, encoding_by_name(name)?)?,
        None if has_utf16_mark(bytes) => {
            decode_as(file, bytes, if bytes.starts_with(b"\xff\xfe") { UTF_16LE } else { UTF_16BE })?
        }
        None => detect_encoding(file, &bytes[..bytes.len() - padding])?,
    };
    if let Some(offset) = text.find('\0') {
        return Err(file_type::refuse_zero_bytes(file, &text[..offset]));
    }
    if text.trim().is_empty() {
        return Err(ImportError::empty(file));
    }
    Ok(DecodedText { text: normalise_line_ends(text), encoding })
}

/// Replaces every carriage return that has no line feed after it by a line feed. Old Macintosh programs end
/// lines with a carriage return.
fn normalise_line_ends(text: Cow<str>) -> Cow<str> {
    if !text.contains('\r') {
        return text;
    }
    let bytes = text.as_bytes();
    let alone = |(at, byte): (usize, &u8)| *byte == b'\r' && bytes.get(at + 1) != Some(&b'\n');
    if bytes.iter().enumerate().any(alone) {
        text.replace("\r\n", "\n").replace('\r', "\n").into()
    } else {
        text
    }
}

fn encoding_by_name(name: &str) -> ImportResult<&'static Encoding> {
    let label = if name.eq_ignore_ascii_case("cp932") { "shift_jis" } else { name };
    let expected = "a name such as utf-8, utf-16le, windows-1252 or shift_jis";
    let refuse = || ImportError::option("--encoding", name, expected);
    Encoding::for_label(label.as_bytes()).ok_or_else(refuse)
}

fn has_utf16_mark(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff")
}

fn detect_encoding<'a>(file: &str, bytes: &'a [u8]) -> ImportResult<(Cow<'a, str>, &'static str)> {
    // (the standard library checks a long file several times as fast as the decoder does)
    if let Ok(text) = std::str::from_utf8(bytes) {
        return Ok((text.strip_prefix('\u{feff}').unwrap_or(text).into(), UTF_8.name()));
    }
    decode_as(file, bytes, if looks_japanese(bytes) { SHIFT_JIS } else { WINDOWS_1252 })
}

/// Whether bytes that are not UTF-8 are probably CP932. Nearly any bytes are valid CP932, so this alone
/// proves nothing. Kana and the common kanji are pairs of bytes that start with 0x81 to 0x9f; in
/// Windows-1252, these bytes are quotation marks and dashes. At least half of the characters outside ASCII
/// must be such pairs.
fn looks_japanese(bytes: &[u8]) -> bool {
    let (mut pairs, mut others, mut at) = (0, 0, 0);
    while let Some(&byte) = bytes.get(at) {
        let trail = bytes.get(at + 1).is_some_and(|next| matches!(next, 0x40..=0x7e | 0x80..=0xfc));
        match byte {
            0x81..=0x9f if trail => (pairs, at) = (pairs + 1, at + 1),
            0xe0..=0xfc if trail => (others, at) = (others + 1, at + 1),
            0x80.. => others += 1,
            _ => {}
        }
        at += 1;
    }
    pairs > 0
        && pairs >= others
        && SHIFT_JIS.decode_without_bom_handling_and_without_replacement(bytes).is_some()
}

fn decode_as<'a>(
    file: &str,
    bytes: &'a [u8],
    encoding: &'static Encoding,
) -> ImportResult<(Cow<'a, str>, &'static str)> {
    let (text, malformed) = encoding.decode_with_bom_removal(bytes);
    if malformed {
        let found = format!("bytes that are not {}", encoding.name());
        let advice = "name another encoding with --encoding, e.g. utf-8, utf-16le, windows-1252, shift_jis";
        return Err(ImportError::format(file, found, "text", advice));
    }
    Ok((text, encoding.name()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(bytes: &[u8]) -> (String, &'static str) {
        let decoded = decode_text("a.txt", bytes, None).unwrap();
        (decoded.text.into_owned(), decoded.encoding)
    }

    #[test]
    fn encodings_are_told_apart() {
        assert_eq!(decoded("t\u{2212}1".as_bytes()), ("t\u{2212}1".to_owned(), "UTF-8"));
        assert_eq!(decoded(b"\xef\xbb\xbft,x\r1,2\r3"), ("t,x\n1,2\n3".to_owned(), "UTF-8"));
        assert_eq!(decoded(b"t,x\r\n1,2\r\n"), ("t,x\r\n1,2\r\n".to_owned(), "UTF-8"));
        assert_eq!(decoded(b"\xff\xfet\0\t\0x\0"), ("t\tx".to_owned(), "UTF-16LE"));
        assert_eq!(decoded(b"Track n\xb0"), ("Track n\u{b0}".to_owned(), "windows-1252"));
        assert_eq!(decoded(b"m\xe9tatarses,\xb5m"), ("m\u{e9}tatarses,\u{b5}m".to_owned(), "windows-1252"));
        assert_eq!(decoded(b"\x93tip\x94"), ("\u{201c}tip\u{201d}".to_owned(), "windows-1252"));
        assert_eq!(decoded(b"\x8e\x9e\x8a\xd4,P 1(X)"), ("\u{6642}\u{9593},P 1(X)".to_owned(), "Shift_JIS"));
        assert_eq!(decoded(b"t,x\n1,2\n\0\0\0"), ("t,x\n1,2\n".to_owned(), "UTF-8"));
    }

    #[test]
    fn an_encoding_that_does_not_fit_is_refused() {
        let says = |bytes: &[u8], name| decode_text("a", bytes, Some(name)).unwrap_err().to_string();
        assert!(
            says(b"n\xb0", "utf-8").starts_with("a: found bytes that are not UTF-8, expected text; name")
        );
        assert!(
            says(b"n", "utf-99").starts_with("--encoding: found `utf-99`, expected a name such as utf-8, ")
        );
        assert_eq!(decode_text("a", b"\x8e\x9e\x8a\xd4", Some("cp932")).unwrap().text, "\u{6642}\u{9593}");
    }

    #[test]
    fn nothing_but_blanks_is_empty() {
        for bytes in [&b""[..], b"\r\n \n", b"\0\0"] {
            let message = decode_text("a.bin", bytes, None).unwrap_err().to_string();
            assert_eq!(
                message,
                "a.bin:1:1: the file is empty, expected a table; export the track data again"
            );
        }
    }
}
