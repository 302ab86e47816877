//! A finding on the quality of a recording: how grave it is, a number, and what to do.

use serde::{Deserialize, Serialize};

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Something may be wrong, or shows less than it seems.
    Caution,
    /// Frequencies, lengths or directions are probably wrong, or nothing can be shown.
    Serious,
}

impl Severity {
    /// The word for it.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Caution => "caution",
            Self::Serious => "serious",
        }
    }
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finding {
    /// Name of the check that made it, e.g. `gaps`.
    pub check: String,
    /// How much it matters.
    pub severity: Severity,
    /// The channel (`tip-x`, ...) that it concerns; absent where it is the whole recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// Its number.
    pub value: f64,
    /// Unit of the number, empty for a count or a ratio.
    pub unit: String,
    /// What was found, in words.
    pub found: String,
    /// What to do, in words; empty where there is nothing to do.
    pub advice: String,
}

impl Finding {
    /// A finding on the whole recording without advice; the other parts are added by [`Self::on`] and
    /// [`Self::advise`].
    #[must_use]
    pub fn new(check: &str, severity: Severity, value: f64, unit: &str, found: String) -> Self {
        Self {
            check: check.to_owned(),
            severity,
            channel: None,
            value,
            unit: unit.to_owned(),
            found,
            advice: String::new(),
        }
    }

    /// The same on one channel.
    #[must_use]
    pub fn on(self, channel: &str) -> Self {
        Self { channel: Some(channel.to_owned()), ..self }
    }

    /// The same with what to do.
    #[must_use]
    pub fn advise(self, advice: &str) -> Self {
        Self { advice: advice.to_owned(), ..self }
    }

    /// The finding as one line for reading.
    #[must_use]
    pub fn line(&self) -> String {
        let channel = self.channel.as_ref().map_or_else(String::new, |channel| format!("{channel}: "));
        let advice = if self.advice.is_empty() { String::new() } else { format!("; {}", self.advice) };
        format!("{}: {channel}{}{advice}", self.severity.word(), self.found)
    }
}
