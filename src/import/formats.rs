//! The supported formats, and the choice of the format of a file. A new format is a row of
//! [`layouts::LAYOUTS`], or, if its structure is no row, a file in this folder and a line in [`PARSERS`].

mod deeplabcut;
mod dice;
mod dltdv;
mod imagej;
mod kinovea;
mod layouts;
mod plain;
mod sleap;
mod tracker;
mod trackmate;
mod wiperlab;

use super::error::{ImportError, ImportResult};
use super::options::ImportOptions;
use super::reader::Document;
use crate::import::format::FileFormat;
use crate::recording::quality::{Check, QualityFinding, Severity};
use crate::toml_file;

/// The formats with a parser of their own, in the order of detection.
static PARSERS: [&dyn FileFormat; 9] = [
    &wiperlab::FORMAT,
    &dice::FORMAT,
    &kinovea::FORMAT,
    &deeplabcut::FORMAT,
    &dltdv::FORMAT,
    &trackmate::FORMAT,
    &sleap::FORMAT,
    &tracker::FORMAT,
    &imagej::FORMAT,
];

/// The supported formats, in the order of detection.
fn all_formats() -> impl Iterator<Item = &'static dyn FileFormat> {
    let rows = layouts::LAYOUTS.iter().map(|row| row as &dyn FileFormat);
    let plain: [&dyn FileFormat; 2] = [&plain::PLAIN, &plain::GENERIC];
    PARSERS.into_iter().chain(rows).chain(plain)
}

/// Programs whose layout is not published; their tables need `--columns`.
const UNDOCUMENTED: [&str; 5] = ["movias", "movias-neo", "tema", "proanalyst", "xcitex"];

/// A format, and a text on the feature by which it recognises a document.
type RecognisedFormat = (&'static dyn FileFormat, String);

pub(crate) fn choose_format(
    documents: &[Document],
    options: &ImportOptions,
) -> ImportResult<(&'static dyn FileFormat, String)> {
    let Some(name) = options.format.as_deref().filter(|name| *name != "auto") else {
        return detect_format(documents, options);
    };
    let format = all_formats().find(|format| format.name() == name);
    let format = format.ok_or_else(|| unknown_format_error(name))?;
    // (a table without positions is refused by the format of its own program, even if --format names another
    // format. With --columns it is not refused, because the user then says which columns are positions)
    let mut checked = documents.iter().filter(|_| options.columns.is_none());
    match checked.find_map(|document| refusal_by_others(format, document, options)) {
        Some(refusal) => Err(refusal),
        None => Ok((format, "as given with --format".to_owned())),
    }
}

fn detect_format(
    documents: &[Document],
    options: &ImportOptions,
) -> ImportResult<(&'static dyn FileFormat, String)> {
    if options.columns.is_some() {
        return Ok((&plain::GENERIC, "--columns names the columns".to_owned()));
    }
    let mut found: Option<RecognisedFormat> = None;
    for document in documents {
        let (format, reason) = recognise_document(document, options)?;
        let (first, _) = found.get_or_insert((format, reason));
        if first.name() != format.name() {
            let (name, first) =
                (format!("the format {}", format.name()), format!("{} as in the first file", first.name()));
            let advice = "export both tracks in one format, or name it with --format";
            return Err(ImportError::format(document.file, name, first, advice));
        }
    }
    found.ok_or_else(ImportError::no_source)
}

/// The first format that recognises the document. If a later format recognises it as a table of its program
/// without positions, the document is refused.
fn recognise_document(document: &Document, options: &ImportOptions) -> ImportResult<RecognisedFormat> {
    let mut found = recognising_formats(document);
    let Some(first) = found.next() else {
        let plain: &dyn FileFormat = &plain::PLAIN;
        // (the error is that of reading the table, or asks for the names of its columns)
        let refusal = || document.table().map_or_else(|error| error, plain::unnamed_columns_error);
        return plain.recognises(document).map(|reason| (plain, reason)).ok_or_else(refusal);
    };
    found.find_map(|(other, _)| refusal_by(other, document, options)).map_or(Ok(first), Err)
}

/// The formats that recognise the document. The plain format is left out, because it belongs to no program.
fn recognising_formats<'d>(document: &'d Document) -> impl Iterator<Item = RecognisedFormat> + 'd {
    let of_programs = all_formats().filter(|format| format.name() != plain::PLAIN.name());
    of_programs.filter_map(|format| format.recognises(document).map(|reason| (format, reason)))
}

/// Error with which `format` refuses the document because it contains no positions over time; `None` if it
/// has no such error. The document must be one that `format` recognises.
fn refusal_by(format: &dyn FileFormat, document: &Document, options: &ImportOptions) -> Option<ImportError> {
    format.read(document, options).err().filter(|error| matches!(error, ImportError::WrongTable(_)))
}

/// Error of the first format other than `chosen` that recognises the document but finds no positions in it.
fn refusal_by_others(
    chosen: &dyn FileFormat,
    document: &Document,
    options: &ImportOptions,
) -> Option<ImportError> {
    let others = recognising_formats(document).filter(|(format, _)| format.name() != chosen.name());
    { others }.find_map(|(format, _)| refusal_by(format, document, options))
}

/// Findings about tables that are read only because `--columns` names their columns; without it, they would
/// be refused.
pub(crate) fn find_doubtful_columns(
    chosen: &dyn FileFormat,
    documents: &[Document],
    options: &ImportOptions,
) -> Vec<QualityFinding> {
    let doubt = |document: &Document| {
        let refusal = refusal_by_others(chosen, document, options)?;
        let found = format!("--columns names columns of a table that would be refused without it: {refusal}");
        let advice = "make sure that these columns are positions over time";
        Some(QualityFinding::advise((Check::OtherTable, Severity::Caution), (0.0, ""), found, advice))
    };
    options.columns.iter().flat_map(|_| documents.iter().filter_map(doubt)).collect()
}

/// The names of all formats, in the order in which they are tried on a file.
pub fn format_names() -> Vec<&'static str> {
    all_formats().map(|format| format.name()).collect()
}

fn unknown_format_error(name: &str) -> ImportError {
    let mut names = format_names();
    names.push("auto");
    let undocumented = UNDOCUMENTED.contains(&name.to_lowercase().replace([' ', '_'], "-").as_str());
    let advice = if undocumented {
        "its layout is not published: export the points as text and say what its columns are, e.g. --columns \
         time=1,tip-x=2,tip-y=3,head-x=4,head-y=5"
            .to_owned()
    } else {
        format!("{}; any other table is read with --columns", toml_file::suggest_key(name, &names))
    };
    let expected = format!("one of {}", names.join(", "));
    ImportError::format("--format", format!("the format {name}"), expected, advice)
}
