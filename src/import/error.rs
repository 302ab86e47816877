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

/// What is wrong with a file or an option.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImportProblem {
    /// The file as named by the user, with line and column if they are known, or the option.
    pub place: String,
    /// What was found.
    pub found: String,
    /// What was expected; empty if `found` is a whole sentence.
    pub expected: String,
    /// What to do; empty if that is clear.
    pub advice: String,
}

impl Display for ImportProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { place, found, expected, advice } = self;
        if expected.is_empty() {
            return write!(f, "{place}: {found}");
        }
        write!(f, "{place}: found {found}, expected {expected}")?;
        if advice.is_empty() { Ok(()) } else { write!(f, "; {advice}") }
    }
}

/// Reason for refusing an import.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ImportError {
    /// The file does not contain positions over time. It may be another kind of table of the same program.
    #[error("{0}")]
    WrongTable(ImportProblem),
    /// It is not clear which track is the tip or the head: no track is named for it, or the given name fits
    /// no track or several.
    #[error("{0}")]
    Point(ImportProblem),
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
    /// Any other problem, for example with an option.
    #[error("{0}")]
    Other(ImportProblem),
    /// The specification of the twin, from which a synthetic export was made, is not valid TOML.
    #[error(transparent)]
    Twin(#[from] TomlError),
    /// A `trace.csv`, the file of a recording's positions, cannot be read.
    #[error(transparent)]
    Files(#[from] FilesError),
}

/// Result of a function of the import: a value, or an [`ImportError`].
pub(crate) type ImportResult<T> = Result<T, ImportError>;

/// Maximum number of characters of a cell that an error message shows.
const LONGEST_CELL: usize = 60;

impl ImportProblem {
    fn new(
        place: impl Display,
        found: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        let (found, expected, advice) = (found.into(), expected.into(), advice.into());
        Self { place: place.to_string(), found, expected, advice }
    }
}

impl ImportError {
    pub(crate) fn wrong_table(
        place: impl Display,
        found: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        Self::WrongTable(ImportProblem::new(place, found, expected, advice))
    }

    pub(crate) fn format(
        place: impl Display,
        found: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        Self::Other(ImportProblem::new(place, found, expected, advice))
    }

    /// Error whose text `problem` is a whole sentence: it says what was found and expected, and what to do.
    pub(crate) fn unusable(place: impl Display, problem: impl Display) -> Self {
        Self::format(place, problem.to_string(), "", "")
    }

    /// Error for a table with unsuitable columns; `line` is the line that shows the problem, usually the
    /// header.
    pub(crate) fn columns(file: &str, line: usize, problem: impl Display, advice: impl Display) -> Self {
        Self::unusable(format!("{file}:{line}:1"), format!("{problem}; {advice}"))
    }

    /// Error for an import without files.
    pub(crate) fn no_source() -> Self {
        Self::unusable("no file to import", "name the exported table")
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

    /// Error for a row with another number of cells than the table.
    pub(crate) fn ragged_row(place: TextLocation, found: usize, expected: usize) -> Self {
        let advice = "complete the row from what the tracking program shows (a missing value is an empty cell), or \
            export again";
        let expected = format!("{expected} as in the rest of the table");
        Self::format(place, format!("{found} cells"), expected, advice)
    }

    /// Error for files or tracks whose rows do not fall on one common grid of frames.
    pub(crate) fn grid_mismatch(file: &str, found: &str, expected: &str, other: &str) -> Self {
        let advice = "export both tracks from one clip with the same time settings";
        Self::format(file, found, format!("{expected} as in {other}"), advice)
    }

    /// Error for options that the user has to give for facts that the file does not contain. `missing` has
    /// one text for each of these options: what the option means, and which value the file suggests.
    pub(crate) fn missing_options(files: &str, format: &str, missing: &[String]) -> Self {
        let problem = format!(
            "read as {format}, which does not say all of how it was recorded, and no default is safe; give\n  {}",
            missing.join("\n  ")
        );
        Self::unusable(files, problem)
    }

    /// Error for times in the file that imply another frame rate than the user declared. If only every n-th
    /// frame was tracked, `step` is the n that may explain the difference.
    pub(crate) fn rate_mismatch(file: &str, implied_hz: f64, declared_hz: f64, step: Option<usize>) -> Self {
        let factor = declared_hz / implied_hz;
        let step = step.map_or(String::new(), |n| {
            format!("; if only one frame in {n} was tracked and the times are real, add --frame-step {n}")
        });
        let milliseconds = (factor / 1000.0 - 1.0).abs() < 0.01;
        let milliseconds = if milliseconds { "; if the times are milliseconds, add --time ms" } else { "" };
        let problem = format!(
            "the times imply {implied_hz:.6} frames/s, but --frame-rate-hz says {declared_hz} (a factor of \
             {factor:.4}). Usually the times are those of playback, and every frequency would be wrong by that factor: \
             check the camera's record. If {declared_hz} is right and the time column only counts frames, add --time \
             playback{step}{milliseconds}"
        );
        Self::unusable(file, problem)
    }

    /// Error for a cell that cannot be used. `expected` says what the cell should contain, `advice` what to
    /// do.
    pub(crate) fn cell(
        place: TextLocation,
        (name, found): (&str, &str),
        (expected, advice): (&str, &str),
    ) -> Self {
        let found = found.chars().take(LONGEST_CELL).collect::<String>();
        Self::format(format!("{place}: column {name}"), format!("`{found}`"), expected, advice)
    }

    /// The error, with `name` as the name of the track if it is a [`Self::DuplicateRow`].
    pub(crate) fn with_track(mut self, name: &str) -> Self {
        if let Self::DuplicateRow { track, .. } = &mut self {
            name.clone_into(track);
        }
        self
    }

    pub(crate) fn point(point: &'static str, found: String, expected: &str, advice: String) -> Self {
        Self::Point(ImportProblem::new(format!("--point {point}"), found, expected, advice))
    }

    pub(crate) fn option(option: &'static str, found: impl Display, expected: impl Into<String>) -> Self {
        Self::format(option, format!("`{found}`"), expected, "")
    }
}
