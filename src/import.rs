//! Tracking exports: text in, a [`Recording`] and a report out. Nothing that a file does not say is assumed: the rate, the
//! scale and the direction of y have no defaults.
//!
//! Coordinates keep the file's origin: they are only scaled and, where y points down, mirrored (`y` becomes `-y`).
//! A new format is one file with one `Format` and one row in `FORMATS`.

mod assemble;
pub mod dialect;
pub mod encoding;
mod error;
mod generic;
mod options;
mod points;
mod timing;
mod tracker;

pub use assemble::sha256;
pub use error::{CellProblem, ImportError, Place};
pub use options::{COLUMN_KEYS, ColumnName, Columns, Options, Scale, TimeColumn};

use crate::recording::Recording;
use crate::recording::files::RecordingFile;
use crate::toml_file;
use dialect::Table;
use encoding::Decoded;

/// Formats that are read, in the order in which the content is asked.
static FORMATS: [&dyn Format; 2] = [&tracker::Tracker, &generic::Generic];

/// Formats by name that are recognised, not yet read.
const NOT_READ: [&str; 9] = ["kinovea", "deeplabcut", "sleap", "trackmate", "dltdv", "dice", "imagej", "dippmotion", "auto"];

/// What the text of other programs starts with or contains near its start, and whose it is.
const OTHERS: [(&str, &str); 10] = [
    ("scorer,", "deeplabcut"),
    ("bodyparts,", "deeplabcut"),
    ("DIPP-MOTION", "dippmotion"),
    ("#Kinovea", "kinovea"),
    ("\"Time\"", "kinovea"),
    ("_cam1_", "dltdv"),
    ("Sparse format camera", "dltdv"),
    ("POSITION_X", "trackmate"),
    ("frame_idx", "sleap"),
    ("COORDINATE_X", "dice"),
];
/// Characters at the start of a file in which such a mark stands.
const START: usize = 4000;

/// A file to import.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Path or name as given by the user; its last part names the copy in the recording.
    pub name: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// An import that succeeded.
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    /// The recording.
    pub recording: Recording,
    /// Its `recording.toml`.
    pub file: RecordingFile,
    /// What was found and decided.
    pub report: ImportReport,
}

/// What was found and decided, for the user to check.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImportReport {
    /// Format that the files were read as.
    pub format: String,
    /// Why that one.
    pub reason: String,
    /// Facts worth knowing.
    pub notes: Vec<String>,
    /// What may be wrong.
    pub warnings: Vec<String>,
}

impl ImportReport {
    /// The report as lines for reading.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let first = format!("format: {} ({})", self.format, self.reason);
        let notes = self.notes.iter().map(|note| format!("note: {note}"));
        let warnings = self.warnings.iter().map(|warning| format!("warning: {warning}"));
        std::iter::once(first).chain(notes).chain(warnings).collect()
    }
}

/// A decoded file as the formats see it.
struct Document<'a> {
    file: &'a str,
    stem: &'a str,
    table: Result<Table<'a>, ImportError>,
}

impl Document<'_> {
    fn table(&self) -> Result<&Table<'_>, ImportError> {
        self.table.as_ref().map_err(Clone::clone)
    }
}

/// One file format.
trait Format: Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;
    /// What in the content shows it, if anything does.
    fn recognises(&self, document: &Document) -> Option<String>;
    /// Its rows and tracks, in the file's own units.
    fn read(&self, document: &Document, options: &Options) -> Result<Export, ImportError>;
}

/// Rows and tracks of a file, in its own units.
#[derive(Debug, Clone, PartialEq)]
struct Export {
    file: String,
    stem: String,
    stamps: Vec<Stamp>,
    tracks: Vec<Track>,
    notes: Vec<String>,
    /// Names and titles, searched for the mark of synthetic data.
    texts: Vec<String>,
}

impl Export {
    fn base(&self) -> &str {
        base_name(&self.file)
    }
}

/// When a row was taken, and where it says so.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stamp {
    line: usize,
    column: usize,
    frame: Option<f64>,
    time_s: Option<f64>,
}

/// A point over the rows of its file.
#[derive(Debug, Clone, PartialEq)]
struct Track {
    name: String,
    x: Vec<Option<f64>>,
    y: Vec<Option<f64>>,
    confidence: Option<Vec<Option<f64>>>,
}

/// Imports one recording from one or more files that share its frame grid.
///
/// # Errors
/// [`ImportError`] with the place, what was found, what was expected and what to do.
pub fn import(sources: &[Source], options: &Options) -> Result<Import, ImportError> {
    options::check(options)?;
    check_names(sources)?;
    let decoded = sources.iter().map(|s| encoding::decode(&s.name, &s.bytes, options.encoding.as_deref())).collect::<Result<Vec<Decoded>, _>>()?;
    let documents: Vec<Document> = sources.iter().zip(&decoded).map(|(source, decoded)| document(source, decoded)).collect();
    let (format, reason) = choose_format(&documents, &decoded, options)?;
    let exports = documents.iter().map(|document| format.read(document, options)).collect::<Result<Vec<_>, _>>()?;
    let mut report = ImportReport { format: format.name().to_owned(), reason, ..ImportReport::default() };
    for (document, decoded) in documents.iter().zip(&decoded) {
        if let Ok(table) = &document.table {
            report.notes.push(format!("{}: {}, delimiter {}, decimal mark `{}`", document.file, decoded.encoding, table.delimiter.word(), table.decimal));
        }
    }
    assemble::assemble(sources, &decoded, &exports, options, report)
}

/// Last part of a path, whichever way its slashes lean.
fn base_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

fn document<'a>(source: &'a Source, decoded: &'a Decoded) -> Document<'a> {
    let base = base_name(&source.name);
    let stem = base.rsplit_once('.').map_or(base, |(stem, _)| stem);
    Document { file: &source.name, stem, table: Table::read(&source.name, &decoded.text) }
}

/// Every copy in the recording's folder needs a name of its own.
fn check_names(sources: &[Source]) -> Result<(), ImportError> {
    use crate::recording::files::{DESCRIPTION_FILE, TRACE_FILE};
    if sources.is_empty() {
        return Err(ImportError::NoSource);
    }
    let mut taken = vec![TRACE_FILE, DESCRIPTION_FILE];
    for source in sources {
        let name = base_name(&source.name);
        if name.is_empty() || taken.iter().any(|other| other.eq_ignore_ascii_case(name)) {
            return Err(ImportError::Name { file: source.name.clone(), name: name.to_owned() });
        }
        taken.push(name);
    }
    Ok(())
}

fn choose_format(documents: &[Document], decoded: &[Decoded], options: &Options) -> Result<(&'static dyn Format, String), ImportError> {
    match options.format.as_deref() {
        None | Some("auto") => detect(documents, decoded, options),
        Some(name) => match FORMATS.into_iter().find(|format| format.name() == name) {
            Some(format) => Ok((format, "as given with --format".to_owned())),
            None => Err(not_read("--format", name)),
        },
    }
}

fn detect(documents: &[Document], decoded: &[Decoded], options: &Options) -> Result<(&'static dyn Format, String), ImportError> {
    if options.columns.is_some() {
        return Ok((&generic::Generic, "--columns names the columns".to_owned()));
    }
    let recognised = |document: &Document| FORMATS.into_iter().find_map(|format| format.recognises(document).map(|reason| (format, reason)));
    let mut found: Option<(&'static dyn Format, String)> = None;
    for (document, decoded) in documents.iter().zip(decoded) {
        let Some((format, reason)) = recognised(document) else { return Err(unrecognised(document, &decoded.text)) };
        match &found {
            Some((first, _)) if first.name() != format.name() => return Err(mixed(document, format, *first)),
            Some(_) => {}
            None => found = Some((format, reason)),
        }
    }
    found.ok_or(ImportError::NoSource)
}

fn mixed(document: &Document, found: &dyn Format, first: &dyn Format) -> ImportError {
    ImportError::Format {
        place: document.file.to_owned(),
        found: format!("the format {}", found.name()),
        expected: format!("{} as in the first file", first.name()),
        advice: "export both tracks in one format, or name it with --format".to_owned(),
    }
}

fn read_names() -> String {
    FORMATS.map(|format| format.name()).join(" and ")
}

fn not_read(place: &str, name: &str) -> ImportError {
    let names: Vec<&str> = FORMATS.iter().map(|format| format.name()).chain(NOT_READ).collect();
    let columns = "any plain table is read with --columns time=1,tip-x=2,tip-y=3,head-x=4,head-y=5 (numbers or names of its columns)";
    let known = NOT_READ.contains(&name);
    ImportError::Format {
        place: place.to_owned(),
        found: format!("the format {name}{}", if known { ", which this version does not read" } else { "" }),
        expected: format!("one that is read now: {}", read_names()),
        advice: if known { columns.to_owned() } else { format!("{}; {columns}", toml_file::nearest(name, &names)) },
    }
}

/// A file that no format recognises: its own problem first, then whose it is, then the way out.
fn unrecognised(document: &Document, text: &str) -> ImportError {
    let start: String = text.chars().take(START).collect();
    if let Some((_, name)) = OTHERS.iter().find(|(mark, _)| start.contains(mark)) {
        return not_read(document.file, name);
    }
    match document.table() {
        Err(error) => error,
        Ok(table) => generic::unnamed(table),
    }
}
