//! Files that are no table of points over time: projects, workbooks, archives, pages. Each is refused with what to export instead.

use super::error::ImportError;

/// First bytes, what such a file is, and what to do instead.
const BY_BYTES: [(&[u8], &str, &str); 9] = [
    (b"PK\x03\x04", "a zip archive (an .xlsx workbook or a Tracker .trz project)", "save the sheet as CSV, or in Tracker use File > Export > Data"),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook (.xls)", "save the sheet as CSV"),
    (b"%PDF", "a PDF document", "export the numbers from the tracking program"),
    (b"\x89HDF", "an HDF5 file", "export the tracks as CSV (SLEAP: File > Export Analysis CSV; DeepLabCut: analyze_videos with save_as_csv=True)"),
    (b"\x1f\x8b", "a gzip archive", "unpack it first"),
    (b"\x80\x04\x95", "a Python pickle", "save the array as CSV (numpy.savetxt)"),
    (b"MATLAB 5.0", "a MATLAB file", "write the points as CSV (writematrix)"),
    (b"\x89PNG", "a picture", "export the numbers from the tracking program"),
    (b"RIFF", "a video", "track the points first, then export their table"),
];

/// What the text of a file that no format recognises starts with, what it is, and what to do instead.
const BY_TEXT: [(&str, &str, &str); 5] = [
    ("<!doctype html", "a web page", "save the table itself, not the page around it"),
    ("<html", "a web page", "save the table itself, not the page around it"),
    ("{", "JSON", "export the tracks as CSV"),
    ("[{", "JSON", "export the tracks as CSV"),
    (
        "<",
        "XML (a project file)",
        "a .trk file is Tracker's project, not its data: open it and use File > Export > Data; from other programs export the tracks as CSV",
    ),
];
/// Characters at the start of a file in which its kind shows.
const START: usize = 400;

/// The refusal of a file whose first bytes show that it is no text.
pub(super) fn of_bytes(file: &str, bytes: &[u8]) -> Option<ImportError> {
    let found = BY_BYTES.iter().find(|kind| bytes.starts_with(kind.0))?;
    Some(wrong(file, found.1, found.2))
}

/// The refusal of a text that shows itself to be no table.
pub(super) fn of_text(file: &str, text: &str) -> Option<ImportError> {
    // a tab in front is an empty cell: what follows is the name of a track
    let start = text.trim_start_matches([' ', '\r', '\n']).chars().take(START).collect::<String>().to_lowercase();
    let found = BY_TEXT.iter().find(|kind| start.starts_with(kind.0))?;
    Some(wrong(file, found.1, found.2))
}

/// The refusal of a text with zero bytes in it, which stand behind `before`.
pub(super) fn zero_bytes(file: &str, before: &str) -> ImportError {
    let line = before.matches('\n').count() + 1;
    let advice = "export the tracks as text, e.g. CSV; for UTF-16 without a byte-order mark add --encoding utf-16le";
    ImportError::WrongKind { file: file.to_owned(), line, found: "binary data (zero bytes)", advice }
}

fn wrong(file: &str, found: &'static str, advice: &'static str) -> ImportError {
    ImportError::WrongKind { file: file.to_owned(), line: 1, found, advice }
}

#[cfg(test)]
mod tests {
    use super::super::encoding::decode;
    use super::*;

    #[test]
    fn files_that_are_no_table_say_what_to_export() {
        let says = |bytes: &[u8]| decode("a.bin", bytes, None).unwrap_err().to_string();
        assert!(says(b"PK\x03\x04").starts_with("a.bin:1:1: found a zip archive"));
        assert!(says(b"t\n1\0x\0").starts_with("a.bin:2:1: found binary data (zero bytes)"));
        assert!(says(b"%PDF-1.4").contains("a PDF document"));
        let says = |text: &str| of_text("a.bin", text).map(|error| error.to_string()).unwrap_or_default();
        assert!(says("<?xml version=\"1.0\"?>").contains("File > Export > Data"));
        assert!(says("\n <!DOCTYPE html>").contains("a web page"));
        assert_eq!(says("\t<script>\t\nt\tx\n"), "");
    }
}
