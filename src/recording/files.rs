//! `trace.csv` and `recording.toml`, the files in the folder of a recording.

mod description;
mod trace;

pub use super::video::{PixelMapping, VideoEntry};
pub use description::{CameraEntry, LevelEntry, OneOrMany, RecordingFile, SourceEntry, YAxis};
pub use trace::{HEADER, parse_trace_csv, parse_trace_csv_at, push_trace_row, trace_blocks, trace_csv};

use crate::recording::Recording;
use crate::toml_file::TomlError;

/// Name of the file of traces in a recording's folder.
pub(crate) const TRACE_FILE: &str = "trace.csv";
/// Name of the description in a recording's folder.
pub(crate) const DESCRIPTION_FILE: &str = "recording.toml";

/// Why a recording's files were refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FilesError {
    /// `recording.toml` is not TOML, or has a key or value that the format does not allow.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// A key of `[video]` has a value that cannot be used.
    #[error("{file}: key `video.{key}`: {problem}")]
    Video {
        /// File as named by the user.
        file: String,
        /// The key in `[video]`.
        key: &'static str,
        /// What was found, what was expected and what to do.
        problem: String,
    },
    /// Another fault, with its place in the file, what was found, what was expected and what to do.
    #[error("{file}{problem}")]
    Refused {
        /// File as named by the user.
        file: String,
        /// The rest of the message; it begins with the line or the key.
        problem: String,
    },
}

impl FilesError {
    fn refuse(file: &str, problem: impl Into<String>) -> Self {
        Self::Refused { file: file.to_owned(), problem: problem.into() }
    }
}

/// Reads a recording from the text of its `trace.csv` and its description. Without a description, the frame
/// rate is estimated from the times, and the recording counts as taken by a camera. A trace is refused if its
/// hash differs from the hash in the description.
///
/// # Errors
/// [`FilesError`] naming `file`, the file of the traces, and the place at fault.
pub fn read_recording(
    name: &str,
    file: &str,
    trace: &str,
    description: Option<&RecordingFile>,
) -> Result<Recording, FilesError> {
    let (grid, traces) = match description {
        Some(description) => {
            description.check_trace(file, trace)?;
            parse_trace_csv_at(file, trace, description.camera.frame_rate_hz)?
        }
        None => parse_trace_csv(file, trace)?,
    };
    let synthetic = description.is_some_and(|d| d.synthetic);
    Recording::new(name, grid, traces, synthetic)
        .map_err(|problem| FilesError::refuse(file, format!(": {problem}")))
}
