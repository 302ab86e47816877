//! Reasons for which a scene is refused.

use crate::toml_file::TomlError;

/// Why a scene was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// The file is not TOML, or not in this format.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// A key is unknown, missing, doubled or has a value out of range.
    #[error("{place}: key `{key}`: found {found}, expected {expected}; {advice}")]
    Key {
        /// File, and the line if there is one.
        place: String,
        /// Table and key.
        key: String,
        /// What was found in the file.
        found: String,
        /// What was expected.
        expected: String,
        /// What to do.
        advice: String,
    },
    /// The recording that drives the head cannot be read or used.
    #[error("{place}: key `drive.recording`: {problem}")]
    Recording {
        /// File and line.
        place: String,
        /// The message with which the recording was refused.
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
