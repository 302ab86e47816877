//! Why a job is refused, and the checks that many keys share.

use crate::fit::scale::BoundsError;
use crate::toml_file::{self, TomlError};
use std::collections::HashSet;

/// Why a job was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum JobError {
    /// It is not TOML of the right shape.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// The bounds of a parameter are no bounds.
    #[error("{file}: parameter `{name}`: {problem}")]
    Bounds {
        /// File as named by the user.
        file: String,
        /// Name of the parameter.
        name: String,
        /// What is wrong with them.
        problem: BoundsError,
    },
    /// A value that cannot be used.
    #[error("{file}: {key}: {problem}")]
    Value {
        /// File as named by the user.
        file: String,
        /// The key, with the entry that it belongs to.
        key: String,
        /// What was found, what was expected, and what to do.
        problem: String,
    },
}

/// A refusal that does not know its file yet.
pub(super) enum JobRefusal {
    Value { key: String, problem: String },
    Bounds { name: String, problem: BoundsError },
}

impl JobRefusal {
    pub(super) fn in_file(self, file: &str) -> JobError {
        let file = file.to_owned();
        match self {
            Self::Value { key, problem } => JobError::Value { file, key, problem },
            Self::Bounds { name, problem } => JobError::Bounds { file, name, problem },
        }
    }
}

impl From<toml_file::KeyRefusal> for JobRefusal {
    fn from((key, problem): toml_file::KeyRefusal) -> Self {
        Self::Value { key, problem }
    }
}

pub(super) fn refuse<T>(key: impl Into<String>, problem: impl Into<String>) -> Result<T, JobRefusal> {
    Err(JobRefusal::Value { key: key.into(), problem: problem.into() })
}

pub(super) fn check_non_empty(key: &str, found: &str, expected: &str) -> Result<String, JobRefusal> {
    if found.trim().is_empty() {
        return refuse(key, format!("found \"{found}\", expected {expected}"));
    }
    Ok(found.to_owned())
}

pub(super) fn check_above_zero(key: impl Into<String>, found: f64) -> Result<f64, JobRefusal> {
    Ok(toml_file::check_above_zero(key, found)?)
}

pub(super) fn find_repeated<'a>(mut names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let mut met = HashSet::new();
    names.find(|name| !met.insert(*name))
}
