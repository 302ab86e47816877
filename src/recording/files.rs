//! `trace.csv` and `recording.toml`, the files in the folder of a recording.

mod description;
mod trace;

pub use super::video::{PixelMapping, VideoEntry};
pub use description::{CameraEntry, FrameClock, LevelEntry, OneOrMany, RecordingFile, SourceEntry, YAxis};
pub use trace::{HEADER, parse_trace_csv, push_trace_row, trace_blocks, trace_csv};

use crate::recording::{Recording, RecordingError};
use crate::toml_file::TomlError;
use trace::TraceTable;

/// Name of the file of traces in a recording's folder.
pub(crate) const TRACE_FILE: &str = "trace.csv";
/// Name of the description in a recording's folder.
pub(crate) const DESCRIPTION_FILE: &str = "recording.toml";

/// Largest relative difference between the stated mean rate and that of the true times: a rate that was
/// written with seven digits passes, one that was changed does not.
const SAME_RATE: f64 = 1e-6;

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
/// rate is estimated from the times, and the recording counts as taken by a camera; times that lie on no grid
/// are kept. A trace is refused if its hash differs from the hash in the description.
///
/// # Errors
/// [`FilesError`] naming `file`, the file of the traces, and the place at fault.
pub fn read_recording(
    name: &str,
    file: &str,
    trace: &str,
    description: Option<&RecordingFile>,
) -> Result<Recording, FilesError> {
    description.map(|d| d.check_trace(file, trace)).transpose()?;
    let (table, camera) = (TraceTable::parse(file, trace)?, description.map(|d| &d.camera));
    let synthetic = description.is_some_and(|d| d.synthetic);
    let recording =
        if camera.map_or_else(|| table.is_uneven(), |camera| camera.clock == Some(FrameClock::Times)) {
            let (times_s, traces) = table.keep_times();
            Recording::from_times(name, times_s, traces, synthetic)
        } else {
            let (grid, traces) = match camera {
                Some(camera) => table.place_at_rate(file, camera.frame_rate_hz)?,
                None => table.place_at_fitted_rate(file)?,
            };
            Recording::new(name, grid, traces, synthetic)
        };
    let refuse = |problem: RecordingError| FilesError::refuse(file, format!(": {problem}"));
    let recording = recording.map_err(refuse)?;
    let (mean_hz, Some(camera)) = (recording.grid().frame_rate_hz, camera) else { return Ok(recording) };
    if (camera.frame_rate_hz / mean_hz - 1.0).abs() > SAME_RATE {
        let found = format!(": column time_s: found a mean rate of {mean_hz} frames/s");
        let expected =
            format!("expected the `frame_rate_hz` of {DESCRIPTION_FILE}; write the mean rate there");
        return Err(FilesError::refuse(file, format!("{found}, {expected}")));
    }
    recording.with_frame_rate_sd(camera.frame_rate_sd_hz).map_err(refuse)
}
