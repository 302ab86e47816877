//! What an evaluation was made for.

use serde::{Deserialize, Serialize};

/// What an evaluation was made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EvaluationStage {
    /// Probes of what the features can determine, before the search.
    Gate,
    /// Clouds of points over the whole box.
    Global,
    /// From one of the best points downhill.
    Local,
    /// Differences around the best point.
    Sensitivity,
    /// Along one parameter, the others following.
    Profile,
    /// A twin of the best model fitted again.
    Bootstrap,
    /// At other values of a parameter that is about to be called identified.
    Elsewhere,
}

impl EvaluationStage {
    /// The word in files and on a terminal.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Gate => "gate",
            Self::Global => "global",
            Self::Local => "local",
            Self::Sensitivity => "sensitivity",
            Self::Profile => "profile",
            Self::Bootstrap => "bootstrap",
            Self::Elsewhere => "elsewhere",
        }
    }
}
