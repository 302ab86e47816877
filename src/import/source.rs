//! The files that are imported, and the result of an import.

use crate::import::error::ImportError;
use crate::recording::Recording;
use crate::recording::files::{DESCRIPTION_FILE, RecordingFile, TRACE_FILE};
use crate::recording::quality::{QualityFinding, Severity};
use crate::text::sha256;

/// Result of an import.
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    /// The recording.
    pub recording: Recording,
    /// Contents of its `recording.toml`.
    pub file: RecordingFile,
    /// Report on what was found and decided.
    pub report: ImportReport,
}

/// Decisions and findings of an import, for the user to check.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImportReport {
    /// Name of the format that was used.
    pub format: String,
    /// Reason for choosing this format.
    pub reason: String,
    /// Notes on what was read and assumed.
    pub notes: Vec<String>,
    /// Findings on quality that only the export shows; they are stored in `recording.toml`.
    pub findings: Vec<QualityFinding>,
}

impl ImportReport {
    /// The report as lines of text.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let first = format!("format: {} ({})", self.format, self.reason);
        let notes = self.notes.iter().map(|note| format!("note: {note}"));
        std::iter::once(first).chain(notes).chain(self.findings.iter().map(QualityFinding::to_line)).collect()
    }

    /// Findings more severe than a note, with their advice.
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

/// A file to import.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImportSource {
    /// Path or name as given by the user; its last part is the name of the copy in the recording's folder.
    pub name: String,
    /// Contents of the file.
    pub bytes: Vec<u8>,
    /// Companion files, such as the record of a camera.
    pub companions: Vec<CompanionFile>,
}

/// A file in the folder of an export that belongs to the export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompanionFile {
    /// Path or name as given by the user.
    pub name: String,
    /// Contents of the file.
    pub bytes: Vec<u8>,
}

impl ImportSource {
    /// A source without companions.
    #[must_use]
    pub fn without_companions(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self { name: name.into(), bytes, companions: vec![] }
    }
}

/// Refuses file names that occur twice, because every copy in the recording's folder needs its own name.
pub(crate) fn check_file_names(sources: &[ImportSource]) -> Result<(), ImportError> {
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

/// Last part of a path with slashes or backslashes.
pub(crate) fn base_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// Names and bytes of the files that are stored with the recording, in the order of `[source]`. A companion
/// of several exports is stored once.
pub(crate) fn preserved_files(sources: &[ImportSource]) -> Vec<(&str, &[u8])> {
    let mut kept: Vec<(&str, &[u8])> =
        sources.iter().map(|source| (base_name(&source.name), source.bytes.as_slice())).collect();
    for file in sources.iter().flat_map(|source| &source.companions) {
        let name = base_name(&file.name);
        if !kept.iter().any(|(known, _)| known.eq_ignore_ascii_case(name)) {
            kept.push((name, &file.bytes));
        }
    }
    kept
}

/// SHA-256 of the stored files, in their order.
pub(crate) fn hash_sources(sources: &[ImportSource]) -> Vec<String> {
    preserved_files(sources).into_iter().map(|(_, bytes)| sha256(bytes)).collect()
}
