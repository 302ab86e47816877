//! Why an export was refused: the place, what was found, what was expected, what to do.

use super::assemble::LevelError;
use crate::recording::RecordingError;
use crate::recording::files::FilesError;
use crate::toml_file::TomlError;
use std::fmt;

/// A place in a text file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextLocation {
    /// File as named by the user.
    pub file: String,
    /// 1-based line.
    pub line: usize,
    /// 1-based column, in characters.
    pub column: usize,
}

impl fmt::Display for TextLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

/// What is wrong with a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellProblem {
    /// Text where a number belongs.
    NotANumber,
    /// A row without its time or frame number.
    NoTime,
    /// A frame number with a fraction or outside any recording.
    NotAFrame,
    /// The time of the row above once more.
    Duplicate,
    /// A time before that of the row above.
    Backwards,
    /// A time between two frames.
    OffGrid,
    /// A frame or time so far from the others that nearly all frames between would be empty.
    FarAway,
}

/// Why an import was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ImportError {
    /// No file was given.
    #[error("no file to import: name the exported table")]
    NoSource,
    /// Two files of one name, or a name that the recording itself needs.
    #[error(
        "{file}: found the file name `{name}`, expected one that no other file of the recording has; rename \
         the export"
    )]
    Name {
        /// File as named by the user.
        file: String,
        /// Its name without folders.
        name: String,
    },
    /// Not a table of text at all.
    #[error("{file}:{line}:1: found {found}, expected a table exported as text; {advice}")]
    WrongKind {
        /// File as named by the user.
        file: String,
        /// Line that shows it.
        line: usize,
        /// What it is.
        found: &'static str,
        /// What to export instead.
        advice: &'static str,
    },
    /// The bytes are not text in the encoding.
    #[error(
        "{file}: found bytes that are not {encoding}, expected text; name another encoding with --encoding, \
         e.g. utf-8, utf-16le, windows-1252, shift_jis"
    )]
    Encoding {
        /// File as named by the user.
        file: String,
        /// The encoding that was tried.
        encoding: String,
    },
    /// An encoding that does not exist.
    #[error(
        "--encoding: found `{found}`, expected a name such as utf-8, utf-16le, windows-1252 or shift_jis"
    )]
    UnknownEncoding {
        /// The name as given.
        found: String,
    },
    /// The file holds nothing.
    #[error("{file}:1:1: the file is empty, expected a table; export the track data again")]
    Empty {
        /// File as named by the user.
        file: String,
    },
    /// Names, but no numbers.
    #[error(
        "{file}:{line}:1: found no rows of numbers after the header, expected one a frame; export again with \
         the data rows selected"
    )]
    HeaderOnly {
        /// File as named by the user.
        file: String,
        /// Last line with anything in it.
        line: usize,
    },
    /// A single row of numbers.
    #[error(
        "{file}:{line}:1: found a single row of numbers, expected one a frame and at least two; export again \
         with all data rows selected"
    )]
    OneRow {
        /// File as named by the user.
        file: String,
        /// Its line.
        line: usize,
    },
    /// Rows, but not one position.
    #[error(
        "{file}: found no position of {points} in any row, expected some; export the table of the tracked \
         points, or name other columns"
    )]
    NoPosition {
        /// File as named by the user.
        file: String,
        /// Names of the tracks.
        points: String,
    },
    /// Times that are rounded too coarsely to tell the frames apart.
    #[error(
        "{file}: the times are rounded to {quantum_s} s, too coarsely to number the frames at {declared_hz} \
         frames/s; expected less than {limit_s:.3e} s: name a column that counts frames instead (--columns \
         frame=...), or export the times with more digits"
    )]
    CoarseTimes {
        /// File as named by the user.
        file: String,
        /// What they are multiples of, s.
        quantum_s: f64,
        /// Rate as declared, 1/s.
        declared_hz: f64,
        /// Coarsest rounding that tells the frames apart, s.
        limit_s: f64,
    },
    /// Numbers in quotes with a comma in them, between commas.
    #[error(
        "{place}: found `{found}` in quotes, expected a decimal point where commas stand between the cells: \
         the comma within may be a decimal mark or separate thousands; export again with decimal points and \
         without separators of thousands, or with semicolons or tabs between the cells"
    )]
    QuotedComma {
        /// The first row of them.
        place: TextLocation,
        /// The number.
        found: String,
    },
    /// No delimiter makes columns.
    #[error(
        "{place}: found `{found}`, expected columns separated by tabs, semicolons, commas or spaces; export \
         again with one of these delimiters, and without units or brackets next to the numbers"
    )]
    Delimiter {
        /// The first row that looks like data.
        place: TextLocation,
        /// The row.
        found: String,
    },
    /// Comma both between and within numbers.
    #[error(
        "{place}: found {found} cells {instead}: the comma is both delimiter and decimal mark, expected one \
         use of it; export again with a tab or semicolon as delimiter, or with decimal points"
    )]
    DecimalComma {
        /// The first such row.
        place: TextLocation,
        /// Its cells.
        found: usize,
        /// What they should be, in words.
        instead: String,
    },
    /// A quoted cell without its closing quote.
    #[error(
        "{place}: found a quoted cell that runs over {lines} lines, expected it to end in its own; close \
         the quotation mark, or export again"
    )]
    OpenQuote {
        /// The row.
        place: TextLocation,
        /// Lines until the next quotation mark or the end of the file.
        lines: usize,
    },
    /// A line with nothing in it where every row is a frame.
    #[error(
        "{place}: found an empty line, expected one row a frame: the table does not number its frames; write \
         NaN for a lost point; if no frame is missing here, import a copy without the empty line"
    )]
    BlankLine {
        /// The line.
        place: TextLocation,
    },
    /// Two rows of one track in one frame.
    #[error(
        "{place}: found {what} {found} of track `{track}` a second time (first in line {first}), expected \
         every {what} once in a track; see in the tracking program which of the two is right and export again, or split the track where it merges with \
         another"
    )]
    DuplicateRow {
        /// The second row.
        place: TextLocation,
        /// `frame` or `time`.
        what: &'static str,
        /// Its value.
        found: f64,
        /// Name of the track.
        track: String,
        /// Line of the first row.
        first: usize,
    },
    /// A table or a file of the same program that holds no positions over time.
    #[error("{place}: found {found}, expected {expected}; {advice}")]
    WrongTable {
        /// The file, or the place that shows it.
        place: String,
        /// What it is.
        found: String,
        /// What it should be.
        expected: String,
        /// Which menu writes the right one.
        advice: String,
    },
    /// A row with another number of cells.
    #[error(
        "{place}: found {found} cells, expected {expected} as in the rest of the table; complete \
         the row from what the tracking program shows (a missing value is an empty cell), or export again"
    )]
    Ragged {
        /// The row.
        place: TextLocation,
        /// Its cells.
        found: usize,
        /// Cells of the table.
        expected: usize,
    },
    /// A cell that cannot be used.
    #[error("{place}: column {name}: found `{found}`, expected {expected}; {advice}")]
    Cell {
        /// The cell.
        place: TextLocation,
        /// What is wrong with it.
        problem: CellProblem,
        /// Name of the column.
        name: String,
        /// Text of the cell.
        found: Box<str>,
        /// What belongs there.
        expected: &'static str,
        /// What to do.
        advice: &'static str,
    },
    /// The table lacks a column.
    #[error("{file}:{line}:1: {problem}; {advice}")]
    Columns {
        /// File as named by the user.
        file: String,
        /// Line of the header.
        line: usize,
        /// What was found and expected.
        problem: String,
        /// What to do.
        advice: String,
    },
    /// A format that this version does not read, or that the content does not show.
    #[error("{place}: found {found}, expected {expected}; {advice}")]
    Format {
        /// The file or the option.
        place: String,
        /// What was found.
        found: String,
        /// What was expected.
        expected: String,
        /// What to do.
        advice: String,
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
        /// The tracks there are, and the nearest.
        advice: String,
    },
    /// Options without which no number has a meaning.
    #[error("{files}: read as {format}, which does not say all of how it was recorded, and no default is \
        safe; give\n  {}", .missing.join("\n  "))]
    MissingOptions {
        /// Files as named by the user.
        files: String,
        /// Format that they are in.
        format: String,
        /// Each with its reason and what the file suggests.
        missing: Vec<String>,
    },
    /// The tilt of the camera cannot be taken out.
    #[error(
        "{file}: --level: {problem}; import without --level, or track the tip and the head with x and y over \
         a whole stroke"
    )]
    Level {
        /// File as named by the user.
        file: String,
        /// Why not.
        problem: LevelError,
    },
    /// An option with an unusable value.
    #[error("{option}: found `{found}`, expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        found: String,
        /// What is allowed.
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
        /// Rate of its times, 1/s.
        implied_hz: f64,
        /// Rate as declared, 1/s.
        declared_hz: f64,
        /// Frames from row to row if the declared rate is right and the times are real.
        step: Option<usize>,
    },
    /// The camera's own record contradicts the declared rate.
    #[error(
        "--frame-rate-hz: found {declared_hz}, but {record} has {recorded_hz} frames/s; leave the option out if \
         that is the rate at which this video was recorded, or move the record away if it belongs to another \
         one"
    )]
    RecordedRateMismatch {
        /// Rate as declared, 1/s.
        declared_hz: f64,
        /// The record that says otherwise.
        record: String,
        /// Its rate, 1/s.
        recorded_hz: f64,
    },
    /// Several files that do not share a frame grid.
    #[error(
        "{file}: found {found}, expected {expected} as in {other}; export both tracks from one clip with the \
         same time settings"
    )]
    GridMismatch {
        /// File as named by the user.
        file: String,
        /// What was found.
        found: String,
        /// What was expected.
        expected: String,
        /// The other file.
        other: String,
    },
    /// The traces are not a recording.
    #[error("{file}: {problem}")]
    Recording {
        /// File as named by the user.
        file: String,
        /// Why not.
        problem: RecordingError,
    },
    /// The specification of the twin is not TOML.
    #[error(transparent)]
    Twin(#[from] TomlError),
    /// The description cannot be written.
    #[error(transparent)]
    Files(#[from] FilesError),
}

impl ImportError {
    /// A table or file of the program that holds no positions over time.
    pub(crate) fn wrong_table(
        place: impl fmt::Display,
        found: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        let (found, expected, advice) = (found.into(), expected.into(), advice.into());
        Self::WrongTable { place: place.to_string(), found, expected, advice }
    }

    /// Something wrong with the columns, shown by a line of the table.
    pub(crate) fn columns(
        file: &str,
        line: usize,
        problem: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        Self::Columns { file: file.to_owned(), line, problem: problem.into(), advice: advice.into() }
    }

    /// A file that is not what its format, or a camera's record, should be.
    pub(crate) fn format(
        place: impl fmt::Display,
        found: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        let (found, expected, advice) = (found.into(), expected.into(), advice.into());
        Self::Format { place: place.to_string(), found, expected, advice }
    }

    /// An option with a value that cannot be.
    pub(crate) fn option(
        option: &'static str,
        found: impl fmt::Display,
        expected: impl Into<String>,
    ) -> Self {
        Self::Option { option, found: found.to_string(), expected: expected.into() }
    }
}
