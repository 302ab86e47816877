//! Why a scene is refused.

use crate::toml_file::TomlError;

/// Why a scene was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// The file is not TOML of this format.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// A key is unknown, missing, doubled or out of range.
    #[error("{place}: key `{key}`: found {found}, expected {expected}; {advice}")]
    Key {
        /// File, with the line where there is one.
        place: String,
        /// Table and key.
        key: String,
        /// What the file says.
        found: String,
        /// What the key takes.
        expected: String,
        /// What to do.
        advice: String,
    },
    /// The recording that drives the head cannot be read or used.
    #[error("{place}: key `drive.recording`: {problem}")]
    Recording {
        /// File and line.
        place: String,
        /// The recording's own refusal.
        problem: String,
    },
}

pub(super) fn key_error(
    place: &str,
    key: &str,
    found: impl ToString,
    expected: &str,
    advice: &str,
) -> SceneError {
    let [place, key, expected, advice] = [place, key, expected, advice].map(str::to_owned);
    SceneError::Key { place, key, found: found.to_string(), expected, advice }
}
