//! `trace.csv` and `recording.toml`: a recording as its folder keeps it.

mod description;
mod trace;

pub use super::video::{PixelMapping, VideoEntry};
pub use description::{CameraEntry, LevelEntry, OneOrMany, RecordingFile, SourceEntry, YAxis};
pub use trace::parse_trace_csv_at;
pub use trace::{HEADER, parse_trace_csv, push_trace_row, trace_blocks, trace_csv};

use crate::recording::{Recording, RecordingError};
use crate::toml_file::TomlError;

/// Name of the traces in a recording's folder.
pub(crate) const TRACE_FILE: &str = "trace.csv";
/// Name of the description in a recording's folder.
pub(crate) const DESCRIPTION_FILE: &str = "recording.toml";

/// Why a recording's files were refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FilesError {
    /// `recording.toml` is not what it should be.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// `[video]` is not what it should be.
    #[error("{file}: key `video.{key}`: {problem}")]
    Video {
        /// File as named by the user.
        file: String,
        /// The key.
        key: &'static str,
        /// What was found, what was expected and what to do.
        problem: String,
    },
    /// `trace.csv` holds no rows.
    #[error(
        "{file}: found no rows of numbers, expected the header `{HEADER}` and a row a frame; import the \
         recording again"
    )]
    Empty {
        /// File as named by the user.
        file: String,
    },
    /// The header of `trace.csv` is another one.
    #[error(
        "{file}:1:1: found the header `{found}`, expected `{HEADER}` and optionally \
         `,tip_confidence,head_confidence`; any other table is read by `wiperlab import --columns`"
    )]
    Header {
        /// File as named by the user.
        file: String,
        /// Its first line.
        found: String,
    },
    /// A row has more or fewer cells than the header.
    #[error(
        "{file}:{line}:1: found {found} cells, expected {expected} as in the header; complete the row (a \
         missing value is an empty cell)"
    )]
    Cells {
        /// File as named by the user.
        file: String,
        /// 1-based line.
        line: u64,
        /// Cells in it.
        found: usize,
        /// Cells in the header.
        expected: usize,
    },
    /// A cell is not a finite number.
    #[error(
        "{file}:{line}: column {column}: found `{found}`, expected {expected}; correct the cell or import \
         the recording again"
    )]
    Cell {
        /// File as named by the user.
        file: String,
        /// 1-based line.
        line: u64,
        /// Name of the column.
        column: String,
        /// Text of the cell.
        found: String,
        /// What belongs there.
        expected: &'static str,
    },
    /// The times do not lie on one frame grid.
    #[error(
        "{file}:{line}: column time_s: found {found_s} s, {off_frames:.2} frames off the grid of \
         {frame_rate_hz} frames/s, expected at most {} frames; check the rate in recording.toml or import \
         the recording again",
        crate::recording::clock::OFF_GRID_LIMIT_FRAMES
    )]
    OffGrid {
        /// File as named by the user.
        file: String,
        /// 1-based line.
        line: u64,
        /// The time, s.
        found_s: f64,
        /// Its distance from the nearest frame, frames.
        off_frames: f64,
        /// Rate of the grid, 1/s.
        frame_rate_hz: f64,
    },
    /// Nearly all frames have no row.
    #[error(
        "{file}: column time_s: the times span {frames} frames, and only {rows} of them have a row; expected one continuous recording: correct the times, or the rate in recording.toml"
    )]
    Sparse {
        /// File as named by the user.
        file: String,
        /// Rows of numbers.
        rows: usize,
        /// Frames from the first time to the last.
        frames: usize,
    },
    /// The times span more frames than any recording has.
    #[error(
        "{file}: column time_s: the times span more than {} frames; expected one continuous recording: \
         correct the times or import it again",
        crate::recording::clock::MAX_FRAMES
    )]
    TooLong {
        /// File as named by the user.
        file: String,
    },
    /// The traces are not those that the description was written for.
    #[error(
        "{file}: found SHA-256 {found}..., expected {expected}... as the {DESCRIPTION_FILE} next to it says: \
         one of the two was changed or replaced; import the export again with --force or, where the change \
         of the trace is intended, copy it alone into a folder of its own"
    )]
    OtherTrace {
        /// File as named by the user.
        file: String,
        /// First digits of its hash.
        found: String,
        /// First digits of the hash in the description.
        expected: String,
    },
    /// The description names a rate that no camera has.
    #[error("{file}: key `camera.{key}`: found {found}, expected a finite number above 0")]
    Description {
        /// File as named by the user.
        file: String,
        /// The key.
        key: &'static str,
        /// Its value.
        found: f64,
    },
    /// The rotation that levelled the recording is no number.
    #[error("{file}: key `level.{key}`: found {found}, expected a finite number; import the recording again")]
    Level {
        /// File as named by the user.
        file: String,
        /// The key.
        key: &'static str,
        /// Its value.
        found: f64,
    },
    /// A description that cannot be written as TOML.
    #[error(
        "recording.toml cannot be written: {problem}; shorten or remove the value under [conditions] or \
         [twin]"
    )]
    Unwritable {
        /// What the writer said.
        problem: String,
    },
    /// The traces are not a recording.
    #[error("{file}: {problem}")]
    Recording {
        /// File as named by the user.
        file: String,
        /// Why not.
        problem: RecordingError,
    },
}

/// A recording from the text of its `trace.csv` and, where there is one, its description; without one the
/// frame rate is estimated from the times and the recording counts as taken by a camera. A trace that is not
/// the one that the description was written for is refused.
///
/// # Errors
/// [`FilesError`] naming `file` (that of the traces) and the place at fault.
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
        .map_err(|problem| FilesError::Recording { file: file.to_owned(), problem })
}
