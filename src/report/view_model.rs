//! The rows of a report's tables.

use crate::fit;
use crate::recording::quality::{self, Grade, Quality, QualityFinding};
use serde::Serialize;

/// A recording with its quality.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordingLine {
    pub name: String,
    /// Whether the recording is synthetic.
    pub synthetic: bool,
    /// Names of the exports from which the recording was imported; empty if it was not imported.
    pub exports: Vec<String>,
    /// Grade according to the most severe finding.
    pub grade: Grade,
    /// Measurements on the traces of the recording.
    pub measurements: Quality,
    /// Findings on the recording, the most severe first.
    pub findings: Vec<QualityFinding>,
    /// The findings, as `wiperlab inspect` prints them.
    pub verdict: Vec<String>,
}

impl RecordingLine {
    /// Adds findings that follow from the files in the folder of the recording.
    pub(crate) fn add_findings(&mut self, more: impl IntoIterator<Item = QualityFinding>) {
        let kept = std::mem::take(&mut self.findings);
        self.findings = more.into_iter().chain(kept).collect();
        // stable, so that the order is kept within a severity
        self.findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        self.grade = quality::grade_findings(&self.findings);
        self.verdict = quality::verdict_lines(&self.measurements, &self.findings);
    }
}

/// A product of powers of the parameters.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct CombinationLine {
    /// The product in words, such as `friction.c friction.a^0.31`.
    pub words: String,
    /// Whether the features determine the product.
    pub determined: bool,
    /// Standard deviation of the natural logarithm of the product. For an undetermined product, this is the
    /// largest value that the bounds of the search allow.
    pub sd_relative: f64,
}

/// Outcome of the search.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SearchLine {
    /// Status at the end of the search; `None` before a search.
    pub status: Option<fit::result::FitStatus>,
    /// Whether the search had converged.
    pub converged: bool,
    /// Number of evaluations of the model.
    pub evaluations: usize,
    /// Numbers of failed evaluations, by reason.
    pub failed: Vec<FailureCount>,
    pub local_searches: usize,
    /// Sum of squared residuals at the estimates.
    pub cost: f64,
    /// Rise of the cost at the ends of a 95 % interval.
    pub threshold: f64,
    /// Number of twins (synthetic data sets of the best model) that were fitted.
    pub twins: usize,
    /// Number of combinations of the parameters that the features determine at the estimates.
    pub rank: usize,
    /// Ratio of the largest to the smallest singular value of the matrix of sensitivities; `None` if a
    /// singular value is zero.
    pub condition: Option<f64>,
}

impl SearchLine {
    /// Whether the search came to its end; also if there was none.
    pub(crate) fn has_ended(&self) -> bool {
        self.status.is_none_or(fit::result::FitStatus::has_ended)
    }
}

/// Number of evaluations that failed for one reason.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FailureCount {
    /// The reason, such as `contact-lost`.
    pub reason: String,
    pub count: usize,
}

/// Result of the identifiability check before the search (the gate) at one point of the search box.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ProbeLine {
    /// Number of features that the model showed at that point.
    pub features_seen: usize,
    /// Number of combinations of the parameters that these features determine at that point.
    pub rank: usize,
    /// Ratio of the largest to the smallest singular value of the sensitivities; `None` if one of them is
    /// zero.
    pub condition: Option<f64>,
    /// Parameters that these features determine individually.
    pub determines: Vec<String>,
    /// Reason why the model failed at that point, if it did.
    pub failure: Option<String>,
}

/// Files, version and commands from which the numbers were obtained.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Seed of the search.
    pub seed: Option<u64>,
    /// Fingerprint of problem, data and program.
    pub fingerprint: String,
    /// Files with their hashes.
    pub files: Vec<SourceFile>,
    /// Commands that reproduce this report.
    pub commands: Vec<String>,
}

/// A file from which a report was made.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SourceFile {
    /// Kind of the file, such as `job`, `result`, `scene`, `trace`, `description`, `export`.
    pub kind: String,
    pub name: String,
    pub sha256: String,
    /// Whether the file contains a synthetic motion.
    pub synthetic: bool,
}
