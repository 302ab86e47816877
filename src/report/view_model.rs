//! The rows of a report's tables.

use crate::fit;
use crate::recording::quality::{self, Grade, Quality, QualityFinding};
use serde::Serialize;

/// A recording and what it can show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordingLine {
    pub name: String,
    /// Whether no camera took it.
    pub synthetic: bool,
    /// The exports that it was imported from; none for one that never was.
    pub exports: Vec<String>,
    /// The gravest finding as a grade.
    pub grade: Grade,
    /// What was measured on its traces.
    pub measurements: Quality,
    /// What was found on it, the gravest first.
    pub findings: Vec<QualityFinding>,
    /// The same as `wiperlab inspect` says it.
    pub verdict: Vec<String>,
}

impl RecordingLine {
    /// The same with findings that only its folder could show.
    pub(crate) fn add_findings(&mut self, more: impl IntoIterator<Item = QualityFinding>) {
        let kept = std::mem::take(&mut self.findings);
        self.findings = more.into_iter().chain(kept).collect();
        // stable: the order above within a severity
        self.findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        self.grade = quality::grade_findings(&self.findings);
        self.verdict = quality::verdict_lines(&self.measurements, &self.findings);
    }
}

/// A product of powers of the parameters.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct CombinationLine {
    /// Such as `friction.c friction.a^0.31`.
    pub words: String,
    /// Whether the features determine it.
    pub determined: bool,
    /// Standard deviation of its logarithm; for one that is left open, that of which the box allows.
    pub sd_relative: f64,
}

/// How the search ended.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SearchLine {
    /// How; `None` before a search.
    pub status: Option<fit::result::FitStatus>,
    /// Whether it had converged.
    pub converged: bool,
    /// Evaluations of the model.
    pub evaluations: usize,
    /// Those that failed, by reason.
    pub failed: Vec<FailureCount>,
    pub local_searches: usize,
    /// Sum of squared residuals at the estimates.
    pub cost: f64,
    /// Rise in cost that bounds a 95 % interval.
    pub threshold: f64,
    /// Twins of the best model that were fitted again.
    pub twins: usize,
    /// Number of combinations of the parameters that the features determine at the estimates.
    pub rank: usize,
    /// Largest singular value of the sensitivities over the smallest; `None` where one is zero.
    pub condition: Option<f64>,
}

/// Evaluations that failed for one reason.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FailureCount {
    /// The reason, such as `contact-lost`.
    pub reason: String,
    pub count: usize,
}

/// What the gate found at one place of the box.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ProbeLine {
    /// Features that the model showed there.
    pub features_seen: usize,
    /// Number of combinations of the parameters that they determine there.
    pub rank: usize,
    /// Largest singular value over the smallest; `None` where one is zero.
    pub condition: Option<f64>,
    /// Parameters that they determine by themselves.
    pub determines: Vec<String>,
    /// Why the model failed there, if it did.
    pub failure: Option<String>,
}

/// Files, version and commands behind the numbers.
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
    /// Commands that make this report again.
    pub commands: Vec<String>,
}

/// A file that went into a report.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SourceFile {
    /// What it is, such as `job`, `result`, `scene`, `trace`, `description`, `export`.
    pub kind: String,
    pub name: String,
    pub sha256: String,
    /// Whether it holds a motion that no camera took.
    pub synthetic: bool,
}
