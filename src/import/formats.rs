//! The formats that are read, and which of them a file is in. A new format is one file in this folder and its
//! line in [`FORMATS`].

mod deeplabcut;
mod dice;
mod dippmotion;
mod dltdv;
mod framedias;
mod generic;
mod imagej;
mod kinovea;
mod motion_analysis;
mod plain;
mod sleap;
mod tracker;
mod trackmate;
mod trackpy;
mod trc;
mod wiperlab;

use super::error::ImportError;
use super::options::ImportOptions;
use super::reader::Document;
use super::reader::track_file::TrackFile;
use crate::import::reader::new_finding;
use crate::recording::quality::{Check, QualityFinding, Severity};
use crate::toml_file;

/// Formats that are read, in the order in which the content is asked.
static FORMATS: &[&dyn FileFormat] = &[
    &wiperlab::Wiperlab,
    &dippmotion::DippMotion,
    &dice::Dice,
    &kinovea::Kinovea,
    &deeplabcut::DeepLabCut,
    &dltdv::Dltdv,
    &trackmate::TrackMate,
    &sleap::Sleap,
    &tracker::TrackerFormat,
    &trc::Trc,
    &imagej::ImageJ,
    &trackpy::Trackpy,
    &motion_analysis::MotionAnalysis,
    &framedias::FrameDias,
    &plain::PlainFormat,
    &generic::GenericFormat,
];

/// Programs whose layout is not published: their tables are read as plain ones.
const UNDOCUMENTED: [&str; 5] = ["movias", "movias-neo", "tema", "proanalyst", "xcitex"];

pub(crate) fn choose_format(
    documents: &[Document],
    options: &ImportOptions,
) -> Result<(&'static dyn FileFormat, String), ImportError> {
    match options.format.as_deref() {
        None | Some("auto") => detect_format(documents, options),
        Some(name) => match FORMATS.iter().copied().find(|format| format.name() == name) {
            Some(format) => {
                refuse_other_programs(format, documents, options)?;
                Ok((format, "as given with --format".to_owned()))
            }
            None => Err(unknown_format_error(name)),
        },
    }
}

fn detect_format(
    documents: &[Document],
    options: &ImportOptions,
) -> Result<(&'static dyn FileFormat, String), ImportError> {
    if options.columns.is_some() {
        // (these lose samples and are filtered, whoever names their columns)
        let format: &'static dyn FileFormat = if documents.iter().all(kinovea::is_window) {
            &kinovea::Kinovea
        } else {
            &generic::GenericFormat
        };
        return Ok((format, "--columns names the columns".to_owned()));
    }
    let mut found: Option<(&'static dyn FileFormat, String)> = None;
    for document in documents {
        let Some((format, reason)) = recognise_document(document, options)? else {
            return Err(unrecognised_error(document));
        };
        match &found {
            Some((first, _)) if first.name() != format.name() => {
                return Err(mixed_formats_error(document, format, *first));
            }
            Some(_) => {}
            None => found = Some((format, reason)),
        }
    }
    found.ok_or(ImportError::NoSource)
}

/// The format of a document and what shows it: the first that recognises it. Where several do, one that says
/// that its program wrote no positions here is believed.
fn recognise_document(
    document: &Document,
    options: &ImportOptions,
) -> Result<Option<(&'static dyn FileFormat, String)>, ImportError> {
    let mut found = recognising_formats(document);
    let Some(first) = found.next() else {
        return Ok(plain::PlainFormat
            .recognises(document)
            .map(|reason| (&plain::PlainFormat as &dyn FileFormat, reason)));
    };
    match found.find_map(|(other, _)| refusal_by(other, document, options)) {
        Some(refusal) => Err(refusal),
        None => Ok(Some(first)),
    }
}

/// The formats of programs that recognise a document, with what shows it; a plain table is nobody's.
fn recognising_formats<'d>(
    document: &'d Document,
) -> impl Iterator<Item = (&'static dyn FileFormat, String)> + 'd {
    FORMATS
        .iter()
        .copied()
        .filter(|format| format.name() != plain::PLAIN_NAME)
        .filter_map(|format| format.recognises(document).map(|reason| (format, reason)))
}

/// Why `format`, which recognises a document, says that it holds no positions over time, if it does.
fn refusal_by(format: &dyn FileFormat, document: &Document, options: &ImportOptions) -> Option<ImportError> {
    format.read(document, options).err().filter(|error| matches!(error, ImportError::WrongTable { .. }))
}

/// A document that the program which wrote it calls no positions over time is not read as another format's,
/// whatever --format says.
fn refuse_other_programs(
    chosen: &'static dyn FileFormat,
    documents: &[Document],
    options: &ImportOptions,
) -> Result<(), ImportError> {
    if options.columns.is_some() {
        return Ok(()); // (who names the columns answers for them, and reads what the program says)
    }
    documents.iter().find_map(|document| refusal_by_others(chosen, document, options)).map_or(Ok(()), Err)
}

fn refusal_by_others(
    chosen: &dyn FileFormat,
    document: &Document,
    options: &ImportOptions,
) -> Option<ImportError> {
    recognising_formats(document)
        .filter(|(format, _)| format.name() != chosen.name())
        .find_map(|(format, _)| refusal_by(format, document, options))
}

/// Named columns of tables that their own program calls no positions over time.
pub(crate) fn find_doubtful_columns(
    chosen: &dyn FileFormat,
    documents: &[Document],
    options: &ImportOptions,
) -> Vec<QualityFinding> {
    let doubt = |document: &Document| {
        let refusal = refusal_by_others(chosen, document, options)?;
        let found = format!("--columns names columns of a table that would be refused without it: {refusal}");
        let advice = "make sure that these columns are positions over time";
        Some(new_finding(Check::OtherTable, Severity::Caution, (0.0, ""), found, advice))
    };
    options.columns.iter().flat_map(|_| documents.iter().filter_map(doubt)).collect()
}

fn mixed_formats_error(document: &Document, found: &dyn FileFormat, first: &dyn FileFormat) -> ImportError {
    ImportError::format(
        document.file,
        format!("the format {}", found.name()),
        format!("{} as in the first file", first.name()),
        "export both tracks in one format, or name it with --format",
    )
}

/// The names of all formats, in the order of detection.
pub fn format_names() -> Vec<&'static str> {
    FORMATS.iter().map(|format| format.name()).collect()
}

fn unknown_format_error(name: &str) -> ImportError {
    let mut names = format_names();
    names.push("auto");
    let undocumented = UNDOCUMENTED.contains(&name.to_lowercase().replace([' ', '_'], "-").as_str());
    ImportError::format(
        "--format",
        format!("the format {name}"),
        format!("one of {}", names.join(", ")),
        if undocumented {
            "its layout is not published: export the points as text and say what its columns are, e.g. \
             --columns time=1,tip-x=2,tip-y=3,head-x=4,head-y=5"
                .to_owned()
        } else {
            format!("{}; any other table is read with --columns", toml_file::suggest_key(name, &names))
        },
    )
}

/// A file that no format recognises: its own problem, or a plain table whose columns have no names yet.
fn unrecognised_error(document: &Document) -> ImportError {
    document.table().map_or_else(|error| error, generic::unnamed_columns_error)
}

// What a file format has to say: one implementation a file in `formats/`.

pub(crate) trait FileFormat: Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;
    /// What in the content shows it, if anything does; also for tables of the same program that hold no
    /// positions, which [`FileFormat::read`] then refuses.
    fn recognises(&self, document: &Document) -> Option<String>;
    /// Its rows and tracks, in the file's own units.
    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError>;
}
