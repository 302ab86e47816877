//! Bytes to text, and the kinds of file that are no table: the only file that names `encoding_rs`.

use super::error::ImportError;
use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

/// Text of an export with the encoding it was in; line ends are `\n`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Decoded {
    /// The text, without a byte-order mark.
    pub text: String,
    /// Name of the encoding, as in the WHATWG standard.
    pub encoding: &'static str,
}

/// First bytes, what such a file is, and what to do instead.
const KINDS: [(&[u8], &str, &str); 8] = [
    (b"PK\x03\x04", "a zip archive (an .xlsx workbook or a Tracker .trz project)", "save the sheet as CSV, or in Tracker use File > Export > Data"),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook (.xls)", "save the sheet as CSV"),
    (b"%PDF", "a PDF document", "export the numbers from the tracking program"),
    (b"\x89HDF", "an HDF5 file", "export the tracks as CSV"),
    (b"\x1f\x8b", "a gzip archive", "unpack it first"),
    (b"\x80\x04\x95", "a Python pickle", "save the array as CSV"),
    (b"\x89PNG", "a picture", "export the numbers from the tracking program"),
    (b"RIFF", "a video", "track the points first, then export their table"),
];
const TRACKER_PROJECT: &str =
    "a .trk file is Tracker's project, not its data: open it and use File > Export > Data; from other programs export the tracks as CSV";

/// Decodes `bytes`: byte-order mark, then strict UTF-8, then Windows-1252, unless an encoding is `wanted`.
///
/// # Errors
/// [`ImportError`] for files that are not text, unknown encodings and bytes that the wanted one does not have.
pub fn decode(file: &str, bytes: &[u8], wanted: Option<&str>) -> Result<Decoded, ImportError> {
    if bytes.is_empty() {
        return Err(ImportError::Empty { file: file.to_owned() });
    }
    let wrong = |found, advice| ImportError::WrongKind { file: file.to_owned(), found, advice };
    if let Some((_, found, advice)) = KINDS.iter().find(|kind| bytes.starts_with(kind.0)) {
        return Err(wrong(found, advice));
    }
    let (text, encoding) = match wanted {
        Some(name) => decode_as(file, bytes, named(name)?)?,
        None => detect(file, bytes)?,
    };
    if text.contains('\0') {
        return Err(wrong("binary data (zero bytes)", "export the tracks as text, e.g. CSV; for UTF-16 without a byte-order mark add --encoding utf-16le"));
    }
    // a tab in front is an empty cell: what follows is the name of a track
    let start: String = text.trim_start_matches([' ', '\r', '\n']).chars().take(200).collect::<String>().to_lowercase();
    if start.starts_with("<!doctype html") || start.starts_with("<html") {
        return Err(wrong("a web page", "save the table itself, not the page around it"));
    }
    if start.starts_with('<') {
        return Err(wrong("XML (a project file)", TRACKER_PROJECT));
    }
    if text.trim().is_empty() {
        return Err(ImportError::Empty { file: file.to_owned() });
    }
    Ok(Decoded { text: text.replace("\r\n", "\n").replace('\r', "\n"), encoding })
}

fn named(name: &str) -> Result<&'static Encoding, ImportError> {
    Encoding::for_label(name.as_bytes()).ok_or_else(|| ImportError::UnknownEncoding { found: name.to_owned() })
}

fn detect(file: &str, bytes: &[u8]) -> Result<(String, &'static str), ImportError> {
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return decode_as(file, bytes, if bytes.starts_with(b"\xff\xfe") { UTF_16LE } else { UTF_16BE });
    }
    decode_as(file, bytes, UTF_8).or_else(|_| decode_as(file, bytes, WINDOWS_1252))
}

fn decode_as(file: &str, bytes: &[u8], encoding: &'static Encoding) -> Result<(String, &'static str), ImportError> {
    let (text, malformed) = encoding.decode_with_bom_removal(bytes);
    if malformed {
        return Err(ImportError::Encoding { file: file.to_owned(), encoding: encoding.name().to_owned() });
    }
    Ok((text.into_owned(), encoding.name()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(bytes: &[u8]) -> (String, &'static str) {
        let decoded = decode("a.txt", bytes, None).unwrap();
        (decoded.text, decoded.encoding)
    }

    #[test]
    fn encodings_are_told_apart() {
        assert_eq!(decoded("t\u{2212}1".as_bytes()), ("t\u{2212}1".to_owned(), "UTF-8"));
        assert_eq!(decoded(b"\xef\xbb\xbft,x\r\n1,2\r3"), ("t,x\n1,2\n3".to_owned(), "UTF-8"));
        assert_eq!(decoded(b"\xff\xfet\0\t\0x\0"), ("t\tx".to_owned(), "UTF-16LE"));
        assert_eq!(decoded(b"Track n\xb0"), ("Track n\u{b0}".to_owned(), "windows-1252"));
    }

    #[test]
    fn files_that_are_no_table_say_what_to_export() {
        let says = |bytes: &[u8]| decode("a.bin", bytes, None).unwrap_err().to_string();
        assert!(says(b"PK\x03\x04").starts_with("a.bin:1:1: found a zip archive"));
        assert!(says(b"<?xml version=\"1.0\"?>").contains("File > Export > Data"));
        assert!(says(b"<!DOCTYPE html>").contains("a web page"));
        assert!(says(b"t\0x\0").contains("zero bytes"));
        assert!(says(b"%PDF-1.4").contains("a PDF document"));
        assert_eq!(says(b""), "a.bin:1:1: the file is empty, expected a table; export the track data again");
        assert_eq!(says(b"\r\n \n"), "a.bin:1:1: the file is empty, expected a table; export the track data again");
    }

    #[test]
    fn an_encoding_that_does_not_fit_is_refused() {
        assert!(matches!(decode("a", b"n\xb0", Some("utf-8")), Err(ImportError::Encoding { .. })));
        assert!(matches!(decode("a", b"n", Some("utf-99")), Err(ImportError::UnknownEncoding { .. })));
        assert_eq!(decode("a", b"\x8e\x9e\x8a\xd4", Some("shift_jis")).unwrap().text, "\u{6642}\u{9593}");
    }
}
