//! What an import gives back: the recording, its description, and a report for the user.

use crate::recording::Recording;
use crate::recording::files::RecordingFile;
use crate::recording::quality::{QualityFinding, Severity};

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
    pub findings: Vec<QualityFinding>,
}

impl ImportReport {
    /// The report as lines for reading.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let first = format!("format: {} ({})", self.format, self.reason);
        let notes = self.notes.iter().map(|note| format!("note: {note}"));
        std::iter::once(first).chain(notes).chain(self.findings.iter().map(QualityFinding::to_line)).collect()
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
