//! Reads the files that tracking programs export into a [`Recording`](crate::recording::Recording), and
//! reports what was found. Frame rate, scale and direction of y have no defaults: the user must give those
//! that the file does not contain.
//!
//! Coordinates keep the origin of the file. They are only scaled to metres and, if y points down in the file,
//! mirrored (`y` becomes `-y`). A new format is a row of `formats::layouts`, or a file with a `FormatParser`.

mod assemble;
mod error;
pub(crate) mod format;
mod formats;
mod options;
mod reader;
pub mod source;

use crate::import::source::{Import, ImportReport, ImportSource, check_file_names, hash_sources};
use crate::recording::files::{OneOrMany, SourceEntry};
use assemble::assemble_recording;
pub use error::{ImportError, ImportProblem, TextLocation};
pub use formats::format_names;
use formats::{choose_format, find_doubtful_columns};
pub use options::{ColumnMap, ColumnName, CoordinateScale, ImportOptions, TimeColumn};
pub(crate) use reader::companion::companion_names;
use reader::encoding::DecodedText;
use reader::{Document, encoding};

/// Imports one recording from one or more files whose rows fall on the same grid of frames.
///
/// # Errors
/// [`ImportError`], which says where the problem is, what was found there, what was expected, and what to do.
pub fn import(sources: &[ImportSource], options: &ImportOptions) -> Result<Import, ImportError> {
    options::check_options(options)?;
    check_file_names(sources)?;
    // (files are hashed and read in parallel, because hashing takes a third as long as reading)
    let (hashes, imported) = rayon::join(|| hash_sources(sources), || read_exports(sources, options));
    let mut imported = imported?;
    imported.file.source =
        imported.file.source.map(|source| SourceEntry { sha256: OneOrMany::from(hashes), ..source });
    Ok(imported)
}

fn read_exports(sources: &[ImportSource], options: &ImportOptions) -> Result<Import, ImportError> {
    let decoded = sources
        .iter()
        .map(|s| encoding::decode_text(&s.name, &s.bytes, options.encoding.as_deref()))
        .collect::<Result<Vec<DecodedText>, _>>()?;
    let documents: Vec<Document> =
        sources.iter().zip(&decoded).map(|(source, decoded)| Document::new(source, decoded)).collect();
    let (format, reason) = choose_format(&documents, options)?;
    let exports =
        documents.iter().map(|document| format.read(document, options)).collect::<Result<Vec<_>, _>>()?;
    let mut report = ImportReport { format: format.name().to_owned(), reason, ..ImportReport::default() };
    report
        .notes
        .extend(documents.iter().zip(&decoded).map(|(document, decoded)| document.encoding_note(decoded)));
    report.findings.extend(find_doubtful_columns(format, &documents, options));
    assemble_recording(sources, &decoded, exports, options, report)
}
