//! What stands between cells, and which lines are no rows.

use crate::import::reader::spreadsheet;

/// What stands between cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Delimiter {
    /// A tab.
    Tab,
    /// A semicolon.
    Semicolon,
    /// A comma.
    Comma,
    /// One space; two in a row enclose an empty cell.
    Space,
    /// Any run of spaces or tabs.
    Blanks,
}

/// In order of preference where several explain a file equally well: a comma may be a decimal mark, a space
/// may pad.
pub(crate) const DELIMITERS: [Delimiter; 5] =
    [Delimiter::Tab, Delimiter::Semicolon, Delimiter::Comma, Delimiter::Space, Delimiter::Blanks];
/// First line with which spreadsheets declare their delimiter.
const DELIMITER_DECLARATION: &str = "sep=";
/// A word for "missing" that starts like a comment.
const NOT_COMMENT: &str = "#n/a";
/// What ends the first cell of a row that starts like a comment.
const CELL_ENDS: [char; 3] = [',', ';', '\t'];
/// Marks of lines for people.
const COMMENTS: [&str; 4] = ["#", "//", "***", "%"];

/// A line with its 1-based number.
pub(crate) type NumberedLine<'a> = (usize, &'a str);

impl Delimiter {
    /// Its byte, where it is one.
    pub(crate) fn byte(self) -> Option<u8> {
        match self {
            Self::Tab => Some(b'\t'),
            Self::Semicolon => Some(b';'),
            Self::Comma => Some(b','),
            Self::Space => Some(b' '),
            Self::Blanks => None,
        }
    }

    /// Whether it never stands between the words of a sentence as often as between cells.
    pub(crate) fn separates_words(self) -> bool {
        matches!(self, Self::Tab | Self::Semicolon | Self::Comma)
    }

    /// The word for it.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Tab => "tab",
            Self::Semicolon => "semicolon",
            Self::Comma => "comma",
            Self::Space => "space",
            Self::Blanks => "blanks",
        }
    }
}

/// Whether a line is for people: `#`, `//`, `***` or `%` in front, but not the word `#N/A`, and no cell of a
/// spreadsheet such as `#####` or `#REF!` before numbers.
pub(crate) fn is_comment(line: &str) -> bool {
    if line.starts_with(|c: char| c.is_ascii_digit() || c == '-') {
        return false; // nearly every line there is
    }
    let start = line.trim_start_matches([' ', '"']);
    let missing =
        || start.get(..NOT_COMMENT.len()).is_some_and(|word| word.eq_ignore_ascii_case(NOT_COMMENT));
    COMMENTS.iter().any(|mark| start.starts_with(mark)) && !missing() && !starts_with_damage(start)
}

/// Whether a spreadsheet wrote the first cell of a row of numbers.
fn starts_with_damage(line: &str) -> bool {
    line.split_once(CELL_ENDS).is_some_and(|(cell, rest)| {
        let cell = cell.trim_matches(['"', ' ']);
        (spreadsheet::is_hidden(cell) || spreadsheet::is_error(cell))
            && rest.contains(|c: char| c.is_ascii_digit())
    })
}

/// The delimiter that the first line declares, and the length of that line in bytes.
pub(crate) fn declared_delimiter(text: &str) -> Option<(Delimiter, usize)> {
    let first = text.lines().next()?;
    let mark = first.trim_matches('"').strip_prefix(DELIMITER_DECLARATION)?.bytes().next()?;
    let delimiter = DELIMITERS.into_iter().find(|d| d.byte() == Some(mark))?;
    Some((delimiter, text.find('\n').map_or(text.len(), |end| end + 1)))
}
