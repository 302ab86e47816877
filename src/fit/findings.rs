//! Findings on recordings that a fit does not explain, as `result.json` lists them.

use serde::{Deserialize, Serialize};

/// Origin of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FindingSource {
    /// A check of the recording alone.
    Recording,
    /// Evidence against the model.
    Misfit,
    /// A hypothesis with which the model explains the recordings, or fits them much better.
    Hypothesis,
}

/// A reason why the model does not explain the recordings, known or tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitFinding {
    /// Origin of the finding.
    pub source: FindingSource,
    /// The finding in words.
    pub sentence: String,
    /// Name of the hypothesis, such as `frame-rate`; `None` for the other sources.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hypothesis: Option<String>,
    /// Whether the model explains the recordings under this hypothesis; `None` for the other sources.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub explains: Option<bool>,
    /// Factor on the frame rate, the lengths or the constant of the hypothesis that the data prefer; `None`
    /// without such a factor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// Standard deviation of the factor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor_sd: Option<f64>,
    /// Chi2 per degree of freedom under the hypothesis, in segments of the longest length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chi2_per_dof: Option<f64>,
}

impl FitFinding {
    /// Whether the finding adds to the reasons of the misfit.
    pub(crate) fn adds_to_misfit(&self) -> bool {
        self.source != FindingSource::Misfit
    }

    pub(super) fn new(source: FindingSource, sentence: String) -> Self {
        let (hypothesis, explains, factor, factor_sd, chi2_per_dof) = (None, None, None, None, None);
        Self { source, sentence, hypothesis, explains, factor, factor_sd, chi2_per_dof }
    }
}
