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
    /// Contents of the recording's file `recording.toml`.
    pub file: RecordingFile,
    /// Report on what was found in the files and what was decided.
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
    /// Findings about the quality of the data that only the exported file shows, such as rounded times. They
    /// are stored in `recording.toml`.
    pub findings: Vec<QualityFinding>,
}

impl ImportReport {
    /// The report as lines of text: format, notes and findings.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let first = format!("format: {} ({})", self.format, self.reason);
        let notes = self.notes.iter().map(|note| format!("note: {note}"));
        std::iter::once(first).chain(notes).chain(self.findings.iter().map(QualityFinding::to_line)).collect()
    }

    /// The findings that are more severe than a note, each as text with its advice.
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
    /// Path or name as given by the user. The copy in the recording's folder has the name after its last
    /// slash.
    pub name: String,
    /// Contents of the file.
    pub bytes: Vec<u8>,
    /// Companion files, such as the file in which the camera recorded its settings.
    pub companions: Vec<CompanionFile>,
}

/// A file that belongs to an export and is in the same folder, such as the camera's record of its settings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompanionFile {
    /// Path or name as given by the user.
    pub name: String,
    /// Contents of the file.
    pub bytes: Vec<u8>,
}

impl ImportSource {
    /// A source without companion files.
    #[must_use]
    pub fn without_companions(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self { name: name.into(), bytes, companions: vec![] }
    }
}

/// Refuses file names that occur twice or belong to the recording's own files, because every copy in the
/// recording's folder needs its own name.
pub(crate) fn check_file_names(sources: &[ImportSource]) -> Result<(), ImportError> {
    if sources.is_empty() {
        return Err(ImportError::no_source());
    }
    let mut taken = vec![TRACE_FILE, DESCRIPTION_FILE];
    for source in sources {
        let name = base_name(&source.name);
        if name.is_empty() || taken.iter().any(|other| other.eq_ignore_ascii_case(name)) {
            let (found, expected) =
                (format!("the file name `{name}`"), "one that no other file of the recording has");
            return Err(ImportError::format(&source.name, found, expected, "rename the export"));
        }
        taken.push(name);
    }
    Ok(())
}

/// The part of a path after its last slash or backslash.
pub(crate) fn base_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// Names and bytes of the files that are stored with the recording, in the order in which `[source]` lists
/// them. A companion file that belongs to several exports is stored once.
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

/// SHA-256 hashes of the files that are stored with the recording, in the order of [`preserved_files`].
pub(crate) fn hash_sources(sources: &[ImportSource]) -> Vec<String> {
    preserved_files(sources).into_iter().map(|(_, bytes)| sha256(bytes)).collect()
}
