//! Tracking exports: text in, a [`Recording`] and a report out. Nothing that a file does not say is assumed:
//! the rate, the scale and the direction of y have no defaults.
//!
//! Coordinates keep the file's origin: they are only scaled and, where y points down, mirrored (`y` becomes
//! `-y`). A new format is one file with one `Format` and one row in `FORMATS`.

mod animalta;
mod assemble;
pub mod beside;
mod checks;
mod collect;
mod deeplabcut;
pub mod dialect;
mod dice;
mod dippmotion;
mod dltdv;
pub mod encoding;
mod error;
mod export;
mod fasttrack;
mod framedias;
mod generic;
mod idtracker;
mod imagej;
mod kinds;
mod kinovea;
mod known;
mod layout;
mod motion_analysis;
mod named;
pub mod number;
mod on_grid;
mod options;
mod plain;
mod points;
mod sleap;
pub mod table;
mod timing;
mod tracker;
mod trackmate;
mod trackpy;
mod trc;
mod trex;
mod wiperlab;

pub use assemble::{kept_files, sha256};
pub use error::{CellProblem, ImportError, Place};
pub use options::{COLUMN_KEYS, ColumnName, Columns, Options, Scale, TimeColumn};

use crate::recording::Recording;
use crate::recording::files::{OneOrMany, RecordingFile, Source as SourceTable};
use crate::recording::quality::{Finding, Severity};
use crate::toml_file;
use encoding::Decoded;
use export::Export;
use table::Table;

/// Formats that are read, in the order in which the content is asked.
static FORMATS: &[&dyn Format] = &[
    &wiperlab::Wiperlab,
    &dippmotion::DippMotion,
    &dice::Dice,
    &kinovea::Kinovea,
    &deeplabcut::DeepLabCut,
    &dltdv::Dltdv,
    &trackmate::TrackMate,
    &sleap::Sleap,
    &tracker::Tracker,
    &trc::Trc,
    &imagej::ImageJ,
    &fasttrack::FastTrack,
    &trackpy::Trackpy,
    &idtracker::IdTracker,
    &animalta::AnimalTa,
    &trex::Trex,
    &motion_analysis::MotionAnalysis,
    &framedias::FrameDias,
    &plain::Plain,
    &generic::Generic,
];

/// Programs whose layout is published nowhere: their tables are read as plain ones.
const UNDOCUMENTED: [&str; 5] = ["movias", "movias-neo", "tema", "proanalyst", "xcitex"];

/// A file to import.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Path or name as given by the user; its last part names the copy in the recording.
    pub name: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Files beside it that say more of it: see [`beside::candidates`].
    pub beside: Vec<Beside>,
}

/// A file that lies beside an export and belongs to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Beside {
    /// Its path or name.
    pub name: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

impl Source {
    /// A file with nothing beside it.
    #[must_use]
    pub fn alone(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self { name: name.into(), bytes, beside: vec![] }
    }
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
    /// What only the export could show: it is kept in `recording.toml`.
    pub findings: Vec<Finding>,
}

impl ImportReport {
    /// The report as lines for reading.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let first = format!("format: {} ({})", self.format, self.reason);
        let notes = self.notes.iter().map(|note| format!("note: {note}"));
        std::iter::once(first).chain(notes).chain(self.findings.iter().map(Finding::line)).collect()
    }

    /// What may be wrong, in words.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let graver = self.findings.iter().filter(|finding| finding.severity > Severity::Note);
        graver.map(|finding| {
            if finding.advice.is_empty() {
                finding.found.clone()
            } else {
                format!("{}; {}", finding.found, finding.advice)
            }
        })
    }
}

/// A decoded file as the formats see it.
struct Document<'a> {
    /// File as named by the user.
    file: &'a str,
    /// Its name without folders and extension.
    stem: &'a str,
    /// Its text, without a byte-order mark.
    text: &'a str,
    /// The text as a table, or why it is none.
    table: Result<Table<'a>, ImportError>,
    /// The texts of the files beside it, with their names.
    beside: Vec<(&'a str, String)>,
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
    /// What in the content shows it, if anything does; also for tables of the same program that hold no
    /// positions, which [`Format::read`] then refuses.
    fn recognises(&self, document: &Document) -> Option<String>;
    /// Its rows and tracks, in the file's own units.
    fn read<'a>(&self, document: &'a Document<'a>, options: &Options) -> Result<Export<'a>, ImportError>;
}

/// Imports one recording from one or more files that share its frame grid.
///
/// # Errors
/// [`ImportError`] with the place, what was found, what was expected and what to do.
pub fn import(sources: &[Source], options: &Options) -> Result<Import, ImportError> {
    options::check(options)?;
    check_names(sources)?;
    // (hashing takes as long as a third of the reading)
    let (hashes, imported) = rayon::join(|| assemble::hashes(sources), || read(sources, options));
    let mut imported = imported?;
    imported.file.source =
        imported.file.source.map(|source| SourceTable { sha256: OneOrMany::from(hashes), ..source });
    Ok(imported)
}

fn read(sources: &[Source], options: &Options) -> Result<Import, ImportError> {
    let decoded = sources
        .iter()
        .map(|s| encoding::decode(&s.name, &s.bytes, options.encoding.as_deref()))
        .collect::<Result<Vec<Decoded>, _>>()?;
    let documents: Vec<Document> =
        sources.iter().zip(&decoded).map(|(source, decoded)| document(source, decoded)).collect();
    let (format, reason) = choose_format(&documents, options)?;
    let exports =
        documents.iter().map(|document| format.read(document, options)).collect::<Result<Vec<_>, _>>()?;
    let mut report = ImportReport { format: format.name().to_owned(), reason, ..ImportReport::default() };
    for (document, decoded) in documents.iter().zip(&decoded) {
        let dialect = document.table.as_ref().ok().map(|table| table.dialect);
        let words = dialect.map_or_else(String::new, |d| {
            format!(", delimiter {}, decimal mark `{}`", d.delimiter.word(), d.decimal)
        });
        report.notes.push(format!("{}: {}{words}", document.file, decoded.encoding));
    }
    assemble::assemble(sources, &decoded, exports, options, report)
}

/// Last part of a path, whichever way its slashes lean.
fn base_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

fn document<'a>(source: &'a Source, decoded: &'a Decoded) -> Document<'a> {
    let base = base_name(&source.name);
    let stem = base.rsplit_once('.').map_or(base, |(stem, _)| stem);
    let beside = source.beside.iter().filter_map(|file| {
        Some((file.name.as_str(), encoding::decode(&file.name, &file.bytes, None).ok()?.text.into_owned()))
    });
    let table = kinds::of_text(&source.name, &decoded.text)
        .map_or_else(|| Table::read(&source.name, &decoded.text), Err);
    Document { file: &source.name, stem, text: &decoded.text, table, beside: beside.collect() }
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

fn choose_format(
    documents: &[Document],
    options: &Options,
) -> Result<(&'static dyn Format, String), ImportError> {
    match options.format.as_deref() {
        None | Some("auto") => detect(documents, options),
        Some(name) => match FORMATS.iter().copied().find(|format| format.name() == name) {
            Some(format) => Ok((format, "as given with --format".to_owned())),
            None => Err(unknown_format(name)),
        },
    }
}

fn detect(documents: &[Document], options: &Options) -> Result<(&'static dyn Format, String), ImportError> {
    if options.columns.is_some() {
        // (these lose samples and are filtered, whoever names their columns)
        let format: &'static dyn Format =
            if documents.iter().all(kinovea::is_window) { &kinovea::Kinovea } else { &generic::Generic };
        return Ok((format, "--columns names the columns".to_owned()));
    }
    let recognised = |document: &Document| {
        FORMATS.iter().copied().find_map(|format| format.recognises(document).map(|reason| (format, reason)))
    };
    let mut found: Option<(&'static dyn Format, String)> = None;
    for document in documents {
        let Some((format, reason)) = recognised(document) else { return Err(unrecognised(document)) };
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

/// The names of all formats, in the order of detection.
#[must_use]
pub fn format_names() -> Vec<&'static str> {
    FORMATS.iter().map(|format| format.name()).collect()
}

fn unknown_format(name: &str) -> ImportError {
    let mut names = format_names();
    names.push("auto");
    let undocumented = UNDOCUMENTED.contains(&name.to_lowercase().replace([' ', '_'], "-").as_str());
    ImportError::Format {
        place: "--format".to_owned(),
        found: format!("the format {name}"),
        expected: format!("one of {}", names.join(", ")),
        advice: if undocumented {
            "its layout is not published: export the points as text and say what its columns are, e.g. --columns time=1,tip-x=2,tip-y=3,head-x=4,head-y=5"
                .to_owned()
        } else {
            format!("{}; any other table is read with --columns", toml_file::nearest(name, &names))
        },
    }
}

/// A file that no format recognises: its own problem, or a plain table whose columns have no names yet.
fn unrecognised(document: &Document) -> ImportError {
    document.table().map_or_else(|error| error, generic::unnamed)
}
