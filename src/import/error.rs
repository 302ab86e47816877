//! Errors of an import. Each says where the problem is, what was found, what was expected, and what to do.

use crate::recording::files::FilesError;
use crate::toml_file::TomlError;
use std::fmt::{self, Display};

/// A place in a text file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextLocation {
    /// Path of the file as the user gave it.
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

/// Reason why a cell cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellProblem {
    /// The cell contains text instead of a number.
    NotANumber,
    /// The time or the frame number of the row is missing.
    NoTime,
    /// The frame number is not a whole number, or is too large for any recording.
    NotAFrame,
    /// The time or frame number is the same as in the row above.
    Duplicate,
    /// The time or frame number is smaller than that of the row above.
    Backwards,
    /// The time is between two frames of the frame grid.
    OffGrid,
    /// The frame number or time is so far from that of the row above that nearly all frames would have no
    /// row.
    FarAway,
}

/// Reason for refusing an import.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ImportError {
    /// No file was given.
    #[error("no file to import: name the exported table")]
    NoSource,
    /// Two files have the same name, or a file has the name of one of the recording's own files, such as
    /// `trace.csv`.
    #[error(
        "{file}: found the file name `{name}`, expected one that no other file of the recording has; rename \
         the export"
    )]
    Name {
        /// Path of the file as the user gave it.
        file: String,
        /// Name of the file, without the path of its folder.
        name: String,
    },
    /// One track has two rows with the same frame number or time.
    #[error(
        "{place}: found {what} {found} of track `{track}` a second time (first in line {first}), expected \
         every {what} once in a track; see in the tracking program which of the two is right and export again, or split the track where it merges with \
         another"
    )]
    DuplicateRow {
        /// Place of the second of the two rows.
        place: TextLocation,
        /// `frame` or `time`.
        what: &'static str,
        /// The frame number or time that occurs twice.
        found: f64,
        /// Name of the track.
        track: String,
        /// Line number of the first of the two rows.
        first: usize,
    },
    /// The file does not contain positions over time. It may be another kind of table of the same program.
    #[error("{place}: found {found}, expected {expected}; {advice}")]
    WrongTable {
        /// The file, or the place in the file that shows the problem.
        place: String,
        /// Contents of the file, in words.
        found: String,
        /// Contents that are expected instead, in words.
        expected: String,
        /// How to export the expected table from the program.
        advice: String,
    },
    /// A row has more or fewer cells than the other rows of the table.
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
    /// A cell cannot be used.
    #[error("{place}: column {name}: found `{found}`, expected {expected}; {advice}")]
    Cell {
        /// Place of the cell.
        place: TextLocation,
        /// Reason why the cell cannot be used.
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
    /// A file or a value cannot be used.
    #[error("{place}: found {found}, expected {expected}; {advice}")]
    Format {
        /// The file, with line and column if they are known; or the option whose value is refused.
        place: String,
        /// What was found.
        found: String,
        /// What was expected.
        expected: String,
        /// What to do.
        advice: String,
    },
    /// A file cannot be used; the reason is given as one sentence.
    #[error("{place}: {problem}")]
    Unusable {
        /// The file, with line and column if they are known.
        place: String,
        /// What was found and expected, and what to do.
        problem: String,
    },
    /// It is not clear which track is the tip or the head: no track is named for it, or the given name fits
    /// no track or several.
    #[error("--point {point}: found {found}, expected {expected}; {advice}")]
    Point {
        /// `tip` or `head`.
        point: &'static str,
        /// What was found.
        found: String,
        /// What was expected.
        expected: String,
        /// The tracks that the files contain, and perhaps the track whose name is most similar to the given
        /// one.
        advice: String,
    },
    /// The user has to give options for facts that the file does not contain, such as the frame rate.
    #[error("{files}: read as {format}, which does not say all of how it was recorded, and no default is \
        safe; give\n  {}", .missing.join("\n  "))]
    MissingOptions {
        /// Files as named by the user.
        files: String,
        /// Format of the files.
        format: String,
        /// One text for each missing option: what it means, and which value the file suggests.
        missing: Vec<String>,
    },
    /// An option has a value that cannot be used.
    #[error("{option}: found `{found}`, expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Value that the user gave.
        found: String,
        /// Values that are allowed.
        expected: String,
    },
    /// The times in the file imply another frame rate than the user declared.
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
        /// Path of the file as the user gave it.
        file: String,
        /// Frame rate that the times imply, 1/s.
        implied_hz: f64,
        /// Frame rate that the user declared, 1/s.
        declared_hz: f64,
        /// Value of `--frame-step` that may explain the difference: if only every n-th frame was tracked, n.
        /// `None` if no small whole number explains it.
        step: Option<usize>,
    },
    /// The declared frame rate differs from the one in the camera's record or in the file.
    #[error(
        "--frame-rate-hz: found {declared_hz}, but {record} has {recorded_hz} frames/s; leave the option out if \
         that is the rate at which this video was recorded, or move the record away if it belongs to another \
         one"
    )]
    RecordedRateMismatch {
        /// Frame rate that the user declared, or else that of the first record, 1/s.
        declared_hz: f64,
        /// Source of the other frame rate, such as the name of the camera's record.
        record: String,
        /// Frame rate in that source, 1/s.
        recorded_hz: f64,
    },
    /// The specification of the twin, from which a synthetic export was made, is not valid TOML.
    #[error(transparent)]
    Twin(#[from] TomlError),
    /// A `trace.csv`, the file of a recording's positions, cannot be read.
    #[error(transparent)]
    Files(#[from] FilesError),
}

/// Result of a function of the import: a value, or an [`ImportError`].
pub(crate) type ImportResult<T> = Result<T, ImportError>;

/// Maximum number of characters that an error message shows of a cell.
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

    /// Error for a table with unsuitable columns; `line` is the line that shows the problem, usually the
    /// header.
    pub(crate) fn columns(file: &str, line: usize, problem: impl Display, advice: impl Display) -> Self {
        Self::unusable(format!("{file}:{line}:1"), format!("{problem}; {advice}"))
    }

    /// Error for an empty file.
    pub(crate) fn empty(file: &str) -> Self {
        let problem = "the file is empty, expected a table; export the track data again";
        Self::unusable(format!("{file}:1:1"), problem)
    }

    /// Error for a table with column names but no numbers; `line` is the line that the message names, usually
    /// the last line that is not empty.
    pub(crate) fn header_only(file: &str, line: usize) -> Self {
        let (found, expected) = ("no rows of numbers after the header", "one a frame");
        Self::format(format!("{file}:{line}:1"), found, expected, "export again with the data rows selected")
    }

    /// Error for files or tracks whose rows do not fall on one common grid of frames.
    pub(crate) fn grid_mismatch(file: &str, found: &str, expected: &str, other: &str) -> Self {
        let advice = "export both tracks from one clip with the same time settings";
        Self::format(file, found, format!("{expected} as in {other}"), advice)
    }

    /// Error for a cell that cannot be used. `expected` says what the cell should contain, `advice` what to
    /// do.
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
