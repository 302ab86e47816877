//! Recognises files that are not tables of points over time, such as projects, workbooks and archives. Each
//! is refused with advice on what to export instead.

use crate::import::error::ImportError;

/// Name of a kind of file, and advice to a user who tries to import such a file.
type FileKind = (&'static str, &'static str);

const PICTURE: FileKind = ("a picture", "track the points in the tracking program and export their table");
const VIDEO: FileKind =
    ("a video", "track the points first, e.g. with Tracker or Kinovea, then export their table");
const CINE: &str = "track the points first, e.g. with Phantom's PCC or Tracker, then export their table";
const PICKLE: FileKind =
    ("a Python pickle (.pkl, .pickle)", "save the array as CSV (numpy.savetxt, or pandas: to_csv)");
const SHEET: &str = "save the sheet as CSV (File > Save As) and import that";
const MATLAB: &str = "write the points as CSV (writematrix)";
const NUMPY: &str = "save the array as CSV (numpy.savetxt with a header)";
const RICH_TEXT: &str = "save it as plain text, or export the tracks as CSV";
const HDF5: FileKind = (
    "an HDF5 file (SLEAP's .slp, DeepLabCut's .h5)",
    "export the tracks as CSV: in SLEAP File > Export Analysis CSV, in DeepLabCut analyze_videos with save_as_csv=True",
);
const UNPACK: &str = "unpack it first";
const NUMBERS: &str = "export the numbers from the tracking program";
const TRACKER_DATA: &str = "open it in Tracker and use File > Export > Data";
const ZIP: FileKind = (
    "a zip archive (an .xlsx workbook or a Tracker .trz project)",
    "save the sheet as CSV, or in Tracker use File > Export > Data",
);
const CAMERA_RECORD: FileKind = (
    "a Photron camera's record, not a table",
    "import the tracked points and keep this file in their folder under the same name (run7.csv, run7.cih): the \
     recording rate is read from it",
);
const LABVIEW: FileKind = (
    "a measurement file of LabVIEW (.lvm)",
    "write the channels as CSV with a column of times (in LabVIEW: Write Delimited Spreadsheet; in Python: \
     lvm_read and numpy.savetxt)",
);
const MTRACKJ: FileKind = (
    "a project of MTrackJ (.mdf)",
    "open it in MTrackJ, press Measure with `Display point measurements` ticked, and save that table",
);
const UNIVERSAL_FILE: FileKind = (
    "a universal file of vibration measurements (.uff, .unv)",
    "write the channels as CSV with a column of times (in Python: pyuff and numpy.savetxt)",
);
const WEB_PAGE: FileKind = ("a web page", "save the table itself, not the page around it");
const KINOVEA: FileKind =
    ("a project of Kinovea (.kva)", "open it in Kinovea and use File > Export > CSV trajectories");
const KINOVEA_JSON: FileKind = ("Kinovea's JSON", "in Kinovea use File > Export > CSV trajectories instead");
const ISBI: FileKind = (
    "tracks in the layout of the ISBI challenge",
    "in TrackMate choose the action `TrackFile tracks to XML file` instead",
);
const TRACKMATE: FileKind = (
    "a project of TrackMate",
    "in TrackMate choose the action `TrackFile tracks to XML file`, or save the spots table as CSV",
);
const XML: FileKind = (
    "XML (a project file)",
    "a .trk file is Tracker's project, not its data: open it and use File > Export > Data; from other programs export the \
     tracks as CSV",
);

/// Kinds of files that are recognised by their first bytes.
const BY_BYTES: [(FileKind, &[&[u8]]); 19] = [
    (("an empty zip archive", "export the tracks as CSV"), &[b"PK\x05\x06"]),
    (("an old Excel workbook (.xls)", SHEET), &[b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"]),
    (("a PDF document", NUMBERS), &[b"%PDF"]),
    (("a text document with formatting (RTF)", RICH_TEXT), &[b"{\\rtf"]),
    (HDF5, &[b"\x89HDF"]),
    (("a MATLAB file (.mat)", MATLAB), &[b"MATLAB 5.0"]),
    (("a MATLAB file (.mat, version 7.3)", MATLAB), &[b"MATLAB 7.3"]),
    (("a NumPy array (.npy)", NUMPY), &[b"\x93NUMPY"]),
    (("a Parquet table", "save the table as CSV (pandas: to_csv)"), &[b"PAR1"]),
    (("an SQLite database", "export the table of positions as CSV"), &[b"SQLite format 3"]),
    (("a gzip archive", UNPACK), &[b"\x1f\x8b"]),
    (("a 7-Zip archive", UNPACK), &[b"7z\xbc\xaf\x27\x1c"]),
    (("a RAR archive", UNPACK), &[b"Rar!\x1a\x07"]),
    (("an xz archive", UNPACK), &[b"\xfd7zXZ\x00"]),
    (("a Zstandard archive", UNPACK), &[b"\x28\xb5\x2f\xfd"]),
    (("a bzip2 archive", UNPACK), &[b"BZh91AY&SY"]),
    (PICTURE, &[b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"II*\0", b"MM\0*"]),
    (("a Phantom recording (.cine)", CINE), &[b"CI\x2c\x00"]),
    (
        VIDEO,
        &[
            b"RIFF",
            b"\x1a\x45\xdf\xa3",
            b"\x30\x26\xb2\x75\x8e\x66\xcf\x11",
            b"\0\0\x01\xba",
            b"\0\0\x01\xb3",
        ],
    ),
];

/// Kinds of zip archives that are recognised by a name or a part of a name inside them. The first entry of
/// this list whose name occurs decides; the empty name in the last entry always occurs.
const IN_ZIP: [(&[u8], FileKind); 6] = [
    (b"opendocument.spreadsheet", ("an OpenDocument workbook (.ods)", SHEET)),
    (b"xl/", ("an Excel workbook (.xlsx)", SHEET)),
    (b".trk", ("a Tracker project (.trz)", TRACKER_DATA)),
    (b".npy", ("NumPy arrays (.npz)", NUMPY)),
    (b".csv", ("a zip archive", UNPACK)),
    (b"", ZIP),
];
/// Number of bytes at each end of a file that are searched for names such as those in `IN_ZIP`. A zip archive
/// has its first entries at the start and its directory at the end.
const SEARCHED_BYTES: usize = 65_536;
/// Types that the first box (block of data) of an MP4 or QuickTime file can have.
const MP4_BOXES: [&[u8]; 5] = [b"ftyp", b"moov", b"mdat", b"wide", b"free"];
/// Versions of Python's pickle protocol. The second byte of a pickle file is its version.
const PICKLES: std::ops::RangeInclusive<u8> = 2..=5;
/// Second byte of a C3D file, a format for motion capture. `C3D_BLOCK` is the length of its blocks, bytes;
/// `C3D_PROCESSORS` are the possible values of the byte in its parameter section that gives the type of
/// processor.
const C3D: u8 = 0x50;
const C3D_BLOCK: usize = 512;
const C3D_PROCESSORS: std::ops::RangeInclusive<u8> = 84..=86;

/// Kinds of files that are recognised by the beginning of their text, here in lower case.
const BY_TEXT: [(&str, FileKind); 6] = [
    ("labview measurement", LABVIEW),
    ("<!doctype html", WEB_PAGE),
    ("<html", WEB_PAGE),
    ("#camera information header", CAMERA_RECORD),
    ("mtrackj ", MTRACKJ),
    ("%!ps", ("a PostScript document", NUMBERS)),
];
/// Kinds of XML files that are recognised by a text near their start, here in lower case. The first entry of
/// this list whose text occurs decides; the text of the last entry occurs in every XML file.
const IN_MARKUP: [(&str, FileKind); 6] = [
    ("<cih>", CAMERA_RECORD),
    ("kinoveavideoanalysis", KINOVEA),
    ("org.opensourcephysics", ("a project of Tracker (.trk)", TRACKER_DATA)),
    ("trackcontestisbi", ISBI),
    ("<trackmate", TRACKMATE),
    ("<", XML),
];
/// Kinds of JSON files that are recognised by a text near their start, here in lower case. The first entry of
/// this list whose text occurs decides; the empty text of the last entry always occurs.
const IN_JSON: [(&str, FileKind); 3] = [
    ("captureframerate", KINOVEA_JSON),
    ("videoframerate", KINOVEA_JSON),
    ("", ("JSON", "export the tracks as CSV")),
];
/// Number of characters at the start of a file that are searched for texts that show its kind.
const SEARCHED_CHARACTERS: usize = 4000;

/// Error for a file whose bytes show that it is not a table in text form; `None` for any other file.
pub(crate) fn refuse_bytes(file: &str, bytes: &[u8]) -> Option<ImportError> {
    let found = BY_BYTES.iter().find(|(_, starts)| starts.iter().any(|start| bytes.starts_with(start)));
    let found = found.map(|kind| kind.0);
    let found = found.or_else(|| kind_of_zip(bytes)).or_else(|| kind_by_layout(bytes));
    let start = bytes.get(..SEARCHED_BYTES).unwrap_or(bytes);
    let found = found.or_else(|| contains_bytes(start, b"<cih>").then_some(CAMERA_RECORD));
    found.map(|kind| wrong_kind_error(file, 1, kind))
}

fn kind_of_zip(bytes: &[u8]) -> Option<FileKind> {
    if !bytes.starts_with(b"PK\x03\x04") {
        return None;
    }
    let last = &bytes[bytes.len().saturating_sub(SEARCHED_BYTES)..];
    let ends = [bytes.get(..SEARCHED_BYTES).unwrap_or(bytes), last];
    IN_ZIP.iter().find(|kind| ends.iter().any(|end| contains_bytes(end, kind.0))).map(|kind| kind.1)
}

fn contains_bytes(bytes: &[u8], name: &[u8]) -> bool {
    name.is_empty() || bytes.windows(name.len()).any(|part| part == name)
}

/// Kind of a file that is not recognised by its first bytes alone: MP4, pickle, C3D or bitmap.
fn kind_by_layout(bytes: &[u8]) -> Option<FileKind> {
    let at = |index: usize| bytes.get(index).copied();
    if at(0) == Some(0) && bytes.get(4..8).is_some_and(|kind| MP4_BOXES.contains(&kind)) {
        return Some(VIDEO);
    }
    if at(0) == Some(0x80) && at(1).is_some_and(|protocol| PICKLES.contains(&protocol)) {
        return Some(PICKLE);
    }
    let control = |byte: &u8| *byte > 0 && *byte < b' ' && !matches!(byte, b'\t' | b'\n' | b'\r');
    let block = at(0).filter(|byte| control(byte) && at(1) == Some(C3D));
    let block = block.map(|block| (usize::from(block) - 1) * C3D_BLOCK);
    if block.and_then(|start| at(start + 3)).is_some_and(|processor| C3D_PROCESSORS.contains(&processor)) {
        return Some(("a C3D file", "export the markers as TRC or CSV from the program that reads it"));
    }
    let size = bytes.get(2..6).and_then(|size| size.try_into().ok()).map(u32::from_le_bytes);
    (bytes.starts_with(b"BM") && size == u32::try_from(bytes.len()).ok() && bytes.get(6..10) == Some(&[0; 4]))
        .then_some(PICTURE)
}

/// Error for a text that is not a table, such as a web page, XML or JSON; `None` for any other text.
pub(crate) fn refuse_text(file: &str, text: &str) -> Option<ImportError> {
    // (leading tabs are kept: they are empty cells, after which `<` starts the name of a track and not XML)
    let start = text.trim_start_matches([' ', '\r', '\n']).chars();
    let start = start.take(SEARCHED_CHARACTERS).collect::<String>().to_lowercase();
    let inside =
        |kinds: &[(&str, FileKind)]| kinds.iter().find(|kind| start.contains(kind.0)).map(|kind| kind.1);
    let mut lines = start.lines().map(str::trim);
    let universal = lines.next() == Some("-1") && lines.next().is_some_and(is_dataset_number);
    let found = universal.then_some(UNIVERSAL_FILE);
    let found = found.or_else(|| BY_TEXT.iter().find(|kind| start.starts_with(kind.0)).map(|kind| kind.1));
    let found = found.or_else(|| if start.starts_with('<') { inside(&IN_MARKUP) } else { None });
    let json = start.starts_with('{')
        || start.strip_prefix('[').is_some_and(|rest| rest.trim_start().starts_with(['{', '[']));
    let found = found.or_else(|| if json { inside(&IN_JSON) } else { None });
    found.map(|kind| wrong_kind_error(file, 1, kind))
}

/// Whether a text is the number of a data set of a universal file, such as `58` or `58b`.
fn is_dataset_number(text: &str) -> bool {
    let digits = text.split_whitespace().next().unwrap_or_default().trim_end_matches('b');
    !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit())
}

/// Error for a text with a zero byte; `before` is the text before that byte.
pub(crate) fn refuse_zero_bytes(file: &str, before: &str) -> ImportError {
    let line = before.matches('\n').count() + 1;
    let advice =
        "export the tracks as text, e.g. CSV; for UTF-16 without a byte-order mark add --encoding utf-16le";
    wrong_kind_error(file, line, ("binary data (zero bytes)", advice))
}

fn wrong_kind_error(file: &str, line: usize, (found, advice): FileKind) -> ImportError {
    ImportError::format(format!("{file}:{line}:1"), found, "a table exported as text", advice)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::reader::encoding::decode_text;

    fn says(bytes: &[u8]) -> String {
        decode_text("a.bin", bytes, None).map_or_else(
            |error| error.to_string(),
            |decoded| refuse_text("a.bin", &decoded.text).map_or(String::new(), |e| e.to_string()),
        )
    }

    #[test]
    fn binary_files_say_what_to_export() {
        let c3d = [&[2, C3D][..], &[0; 510], &[1, 80, 10, 84], &[0; 100]].concat();
        let bitmap = [&b"BM"[..], &60_u32.to_le_bytes(), &[0; 54]].concat();
        let cases: [(&[u8], &str); 22] = [
            (b"PK\x03\x04\x14\0[Content_Types].xml...xl/workbook.xml", "an Excel workbook (.xlsx)"),
            (
                b"PK\x03\x04\x14\0mimetypeapplication/vnd.oasis.opendocument.spreadsheet",
                "an OpenDocument workbook",
            ),
            (
                b"PK\x03\x04\x14\0run.trk",
                "a Tracker project (.trz), expected a table exported as text; open it in Tracker and use \
                 File > Export > Data",
            ),
            (b"PK\x03\x04\x14\0points.npy", "(.npz)"),
            (b"PK\x03\x04", "a zip archive (an .xlsx workbook or a Tracker .trz project)"),
            (
                b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
                "an old Excel workbook (.xls), expected a table exported as text; save the sheet as CSV",
            ),
            (b"%PDF-1.4", "a PDF document"),
            (
                b"\x89HDF\r\n\x1a\n",
                "in SLEAP File > Export Analysis CSV, in DeepLabCut analyze_videos with save_as_csv=True",
            ),
            (b"MATLAB 5.0 MAT-file", "a MATLAB file (.mat)"),
            (b"MATLAB 7.3 MAT-file", "version 7.3"),
            (b"\x80\x04\x95\x01", "a Python pickle"),
            (b"\x80\x02}q\0.", "a Python pickle"),
            (b"\x93NUMPY\x01", "a NumPy array"),
            (b"\x1f\x8b\x08", "a gzip archive"),
            (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive"),
            (b"Rar!\x1a\x07\x01", "a RAR archive"),
            (b"CI\x2c\x00\x02\x00", "a Phantom recording (.cine)"),
            (b"\x00\x00\x00\x18ftypmp42", "a video"),
            (b"RIFF....AVI ", "a video"),
            (b"\xff\xd8\xff\xe0", "a picture"),
            (&c3d, "a C3D file"),
            (&bitmap, "a picture"),
        ];
        for (bytes, part) in cases {
            let message = says(bytes);
            assert!(message.starts_with("a.bin:1:1: found ") && message.contains(part), "{part}: {message}");
        }
        assert!(says(b"t\n1\0x\0").starts_with("a.bin:2:1: found binary data (zero bytes)"));
    }

    #[test]
    fn projects_and_pages_say_which_menu_writes_the_table() {
        let cases = [
            ("<?xml version=\"1.0\"?>", "File > Export > Data"),
            (
                "<?xml version=\"1.0\"?><object \
                 class=\"org.opensourcephysics.cabrillo.tracker.TrackerPanel\">",
                "a project of Tracker (.trk)",
            ),
            (
                "<?xml version=\"1.0\"?>\n<KinoveaVideoAnalysis>",
                "a project of Kinovea (.kva), expected a table exported as text; open it in Kinovea and use \
                 File > Export",
            ),
            (
                "<?xml version=\"1.0\"?>\n<root>\n<TrackContestISBI2012 snr=\"4\">",
                "layout of the ISBI challenge",
            ),
            ("{\n \"captureFramerate\": 1000", "in Kinovea use File > Export > CSV"),
            ("[{\"x\":1}]", "found JSON"),
            ("\n <!DOCTYPE html>", "a web page"),
            ("#Camera Information Header\nDate : 2020/1/1\n", "a Photron camera's record"),
            ("\u{1}\u{2}x<cih>\n<recordInfo>", "keep this file in their folder"),
            (
                "MTrackJ 1.5.1 Data File\nAssembly 1 FF0000\n",
                "a project of MTrackJ (.mdf), expected a table exported as text; open it in MTrackJ, press \
                 Measure",
            ),
        ];
        for (text, part) in cases {
            assert!(says(text.as_bytes()).contains(part), "{part}: {}", says(text.as_bytes()));
        }
    }

    #[test]
    fn tables_are_no_other_kind() {
        for text in [
            "\t<script>\t\nt\tx\n",
            "CI,x\n1,2\n",
            "BM,x,y\n1,2,3\n",
            "xP,y\n1,2\n",
            "[1]P,2\n",
            "PK,x\n1,2\n",
            "II*,x\n",
            "moov\tftyp\n",
        ] {
            assert_eq!(says(text.as_bytes()), "", "{text}");
        }
    }
}
