//! Errors of an import: the place, what was found, what was expected, and what to do.

use crate::recording::files::FilesError;
use crate::toml_file::TomlError;
use std::fmt::{self, Display};

/// A place in a text file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextLocation {
    /// File as named by the user.
    pub file: String,
    /// Line number, counted from 1.
    pub line: usize,
    /// Column number, counted from 1 in characters.
    pub column: usize,
}

impl Display for TextLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

/// Problem with a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellProblem {
    /// Text where a number belongs.
    NotANumber,
    /// A row without a time or frame number.
    NoTime,
    /// A frame number with a fraction, or larger than that of any recording.
    NotAFrame,
    /// The same time as in the row above.
    Duplicate,
    /// A time earlier than that of the row above.
    Backwards,
    /// A time between two frames.
    OffGrid,
    /// A frame or time so far from the others that nearly all frames between them have no row.
    FarAway,
}

/// Reason for refusing an import.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ImportError {
    /// No file was given.
    #[error("no file to import: name the exported table")]
    NoSource,
    /// A file name that occurs twice, or that is the name of a file of the recording itself.
    #[error(
        "{file}: found the file name `{name}`, expected one that no other file of the recording has; rename \
         the export"
    )]
    Name {
        /// File as named by the user.
        file: String,
        /// File name without its folders.
        name: String,
    },
    /// Two rows of one track in the same frame.
    #[error(
        "{place}: found {what} {found} of track `{track}` a second time (first in line {first}), expected \
         every {what} once in a track; see in the tracking program which of the two is right and export again, or split the track where it merges with \
         another"
    )]
    DuplicateRow {
        /// Place of the second row.
        place: TextLocation,
        /// `frame` or `time`.
        what: &'static str,
        /// The frame number or the time.
        found: f64,
        /// Name of the track.
        track: String,
        /// Line number of the first row.
        first: usize,
    },
    /// A table or a file without positions over time, such as another table of the same program.
    #[error("{place}: found {found}, expected {expected}; {advice}")]
    WrongTable {
        /// The file, or the place in the file that shows the problem.
        place: String,
        /// Contents of the file.
        found: String,
        /// Contents that are expected instead.
        expected: String,
        /// How to export the expected table from the program.
        advice: String,
    },
    /// A row with more or fewer cells than the others.
    #[error(
        "{place}: found {found} cells, expected {expected} as in the rest of the table; complete \
         the row from what the tracking program shows (a missing value is an empty cell), or export again"
    )]
    Ragged {
        /// Place of the row.
        place: TextLocation,
        /// Number of cells in the row.
        found: usize,
        /// Number of cells in the other rows.
        expected: usize,
    },
    /// A cell that cannot be used.
    #[error("{place}: column {name}: found `{found}`, expected {expected}; {advice}")]
    Cell {
        /// Place of the cell.
        place: TextLocation,
        /// Problem with the cell.
        problem: CellProblem,
        /// Name of the column.
        name: String,
        /// Text of the cell.
        found: Box<str>,
        /// What the cell should contain.
        expected: &'static str,
        /// What to do.
        advice: &'static str,
    },
    /// A file or a value that cannot be used.
    #[error("{place}: found {found}, expected {expected}; {advice}")]
    Format {
        /// The file, with line and column if they are known, or the option.
        place: String,
        /// What was found.
        found: String,
        /// What was expected.
        expected: String,
        /// What to do.
        advice: String,
    },
    /// A file that cannot be used, with the reason as one sentence.
    #[error("{place}: {problem}")]
    Unusable {
        /// The file, with line and column if they are known.
        place: String,
        /// What was found and expected, and what to do.
        problem: String,
    },
    /// A point was not named, or not found.
    #[error("--point {point}: found {found}, expected {expected}; {advice}")]
    Point {
        /// `tip` or `head`.
        point: &'static str,
        /// What was found.
        found: String,
        /// What was expected.
        expected: String,
        /// The tracks that were found, and the one with the most similar name.
        advice: String,
    },
    /// Options that are missing for facts that the file does not contain, such as the frame rate.
    #[error("{files}: read as {format}, which does not say all of how it was recorded, and no default is \
        safe; give\n  {}", .missing.join("\n  "))]
    MissingOptions {
        /// Files as named by the user.
        files: String,
        /// Format of the files.
        format: String,
        /// Each missing option, with its reason and the value that the file suggests.
        missing: Vec<String>,
    },
    /// An option with an unusable value.
    #[error("{option}: found `{found}`, expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Value of the option.
        found: String,
        /// Values that are allowed.
        expected: String,
    },
    /// The file's times contradict the declared rate.
    #[error(
        "{file}: the times imply {implied_hz:.6} frames/s, but --frame-rate-hz says {declared_hz} (a factor \
         of {factor:.4}). Usually the times are those of playback, and every frequency would be wrong by \
         that factor: check the camera's record. If {declared_hz} is right and the time column only counts \
         frames, add --time playback{step}{milliseconds}",
        factor = .declared_hz / .implied_hz,
        step = .step.map_or(String::new(), |n| format!("; if only one frame in {n} was tracked and the times \
            are real, add --frame-step {n}")),
        milliseconds = if (.declared_hz / .implied_hz / 1000.0 - 1.0).abs() < 0.01 { "; if the times are \
            milliseconds, add --time ms" } else { "" }
    )]
    RateMismatch {
        /// File as named by the user.
        file: String,
        /// Frame rate that the times imply, 1/s.
        implied_hz: f64,
        /// Declared frame rate, 1/s.
        declared_hz: f64,
        /// Number of frames from row to row, if the declared rate is right and the times are real.
        step: Option<usize>,
    },
    /// The camera's own record contradicts the declared rate.
    #[error(
        "--frame-rate-hz: found {declared_hz}, but {record} has {recorded_hz} frames/s; leave the option out if \
         that is the rate at which this video was recorded, or move the record away if it belongs to another \
         one"
    )]
    RecordedRateMismatch {
        /// Declared frame rate, 1/s.
        declared_hz: f64,
        /// The camera's record with another rate.
        record: String,
        /// Frame rate in the record, 1/s.
        recorded_hz: f64,
    },
    /// The specification of the twin is not valid TOML.
    #[error(transparent)]
    Twin(#[from] TomlError),
    /// The description of the recording cannot be written.
    #[error(transparent)]
    Files(#[from] FilesError),
}

/// Result of a step of an import.
pub(crate) type ImportResult<T> = Result<T, ImportError>;

/// Maximum number of characters of a cell in an error message.
const LONGEST_CELL: usize = 60;

impl ImportError {
    pub(crate) fn wrong_table(
        place: impl Display,
        found: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        let (found, expected, advice) = (found.into(), expected.into(), advice.into());
        Self::WrongTable { place: place.to_string(), found, expected, advice }
    }

    pub(crate) fn format(
        place: impl Display,
        found: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        let (found, expected, advice) = (found.into(), expected.into(), advice.into());
        Self::Format { place: place.to_string(), found, expected, advice }
    }

    pub(crate) fn unusable(place: impl Display, problem: impl Display) -> Self {
        Self::Unusable { place: place.to_string(), problem: problem.to_string() }
    }

    /// Error in the columns of a table, with a line that shows it.
    pub(crate) fn columns(file: &str, line: usize, problem: impl Display, advice: impl Display) -> Self {
        Self::unusable(format!("{file}:{line}:1"), format!("{problem}; {advice}"))
    }

    /// Error for an empty file.
    pub(crate) fn empty(file: &str) -> Self {
        let problem = "the file is empty, expected a table; export the track data again";
        Self::unusable(format!("{file}:1:1"), problem)
    }

    /// Error for a table with column names but no numbers; `line` is the last line that is not empty.
    pub(crate) fn header_only(file: &str, line: usize) -> Self {
        let (found, expected) = ("no rows of numbers after the header", "one a frame");
        Self::format(format!("{file}:{line}:1"), found, expected, "export again with the data rows selected")
    }

    /// Error for files or tracks that do not share a frame grid.
    pub(crate) fn grid_mismatch(file: &str, found: &str, expected: &str, other: &str) -> Self {
        let advice = "export both tracks from one clip with the same time settings";
        Self::format(file, found, format!("{expected} as in {other}"), advice)
    }

    /// Error for a cell that cannot be used, with what it should contain and what to do.
    pub(crate) fn cell(
        place: TextLocation,
        problem: CellProblem,
        (name, found): (&str, &str),
        (expected, advice): (&'static str, &'static str),
    ) -> Self {
        let found = found.chars().take(LONGEST_CELL).collect::<String>().into();
        Self::Cell { place, problem, name: name.to_owned(), found, expected, advice }
    }

    pub(crate) fn point(point: &'static str, found: String, expected: &str, advice: String) -> Self {
        Self::Point { point, found, expected: expected.to_owned(), advice }
    }

    pub(crate) fn option(option: &'static str, found: impl Display, expected: impl Into<String>) -> Self {
        Self::Option { option, found: found.to_string(), expected: expected.into() }
    }
}
