//! Reads the rows of a table one by one. This is the only file that uses `csv`.

use super::dialect::{Delimiter, NumberedLine, is_comment};
use crate::import::error::{ImportError, ImportResult};
use csv::{ReaderBuilder, StringRecord};
use std::borrow::Cow;

/// A row of a table. Its cells are trimmed and have no quotation marks around them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TextRow {
    pub line: usize,
    pub cells: Vec<String>,
    /// Byte offset in the text at which the row starts.
    pub(crate) start: usize,
}

impl TextRow {
    /// Number of cells up to the last one that is not empty.
    pub(crate) fn used_width(&self) -> usize {
        self.cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1)
    }

    /// Text of the cell with this index; empty if the row has no such cell.
    pub(crate) fn cell(&self, index: usize) -> &str {
        self.cells.get(index).map_or("", String::as_str)
    }

    /// Text of the first cell; empty if the row has no cells.
    pub(crate) fn first_cell(&self) -> &str {
        self.cell(0)
    }

    /// Index of the first cell whose text is `text`.
    pub(crate) fn position(&self, text: &str) -> Option<usize> {
        self.cells.iter().position(|cell| cell == text)
    }

    /// Whether the row has a cell whose text is `text`.
    pub(crate) fn has(&self, text: &str) -> bool {
        self.position(text).is_some()
    }

    pub(crate) fn texts(&self) -> Vec<&str> {
        self.cells.iter().map(String::as_str).collect()
    }
}

/// A row of a table whose cells are borrowed from the text.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowView<'r> {
    pub line: usize,
    cells: &'r [Cow<'r, str>],
}

impl<'r> RowView<'r> {
    /// Texts of all cells, trimmed and without the quotation marks around them.
    pub(crate) fn cells(&self) -> Vec<String> {
        self.cells.iter().map(|cell| trim_cell(cell).to_owned()).collect()
    }

    /// Text of the cell with this index, trimmed and without the quotation marks around it; empty if the row
    /// has no such cell.
    pub(crate) fn cell(&self, index: usize) -> &'r str {
        self.cells.get(index).map_or("", |cell| trim_cell(cell))
    }

    pub(crate) fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether all cells of the row are empty.
    pub(crate) fn is_empty(&self) -> bool {
        self.used_width() == 0
    }

    /// Number of cells up to the last one that is not empty.
    pub(crate) fn used_width(&self) -> usize {
        self.cells.iter().rposition(|cell| !trim_cell(cell).is_empty()).map_or(0, |last| last + 1)
    }
}

/// Number of line feeds in `bytes`.
pub(crate) fn count_lines(bytes: &[u8]) -> usize {
    bytes.iter().filter(|byte| **byte == b'\n').count()
}

/// Removes the blanks and the quotation marks around the text of a cell.
fn trim_cell(cell: &str) -> &str {
    let plain = |byte: Option<&u8>| byte.is_some_and(|b| b.is_ascii_graphic() && *b != b'"');
    if plain(cell.as_bytes().first()) && plain(cell.as_bytes().last()) {
        return cell; // (nearly every cell has nothing to remove)
    }
    let trimmed = cell.trim();
    trimmed.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).map_or(trimmed, str::trim)
}

/// Reads the rows of a table one by one.
pub(crate) struct RowReader<'t> {
    file: &'t str,
    text: &'t str,
    delimiter: Delimiter,
    /// Byte offset at which the current row starts.
    pub start: usize,
    /// Byte offset of the next line, and its number.
    next: usize,
    next_line: usize,
    cells: Vec<Cow<'t, str>>,
    /// Reader for rows with quotation marks, and the byte offset at which it started. It is used again as
    /// long as such rows follow one another.
    quoted: Option<(usize, csv::Reader<&'t [u8]>)>,
}

impl<'t> RowReader<'t> {
    /// Makes a reader of the rows of `text` from byte `start` on. Error messages name `file`.
    pub(crate) fn new(file: &'t str, text: &'t str, delimiter: Delimiter, start: usize) -> Self {
        let next_line = count_lines(&text.as_bytes()[..start.min(text.len())]) + 1;
        Self { file, text, delimiter, start, next: start, next_line, cells: vec![], quoted: None }
    }

    /// The next row; `None` after the last one. Comments and empty lines are skipped; rows whose cells are
    /// all empty are not.
    ///
    /// # Errors
    /// [`ImportError::Other`] if a quoted cell continues in the next line.
    #[allow(clippy::should_implement_trait)] // (no `Iterator`: a row is valid until the next call)
    pub(crate) fn next_row(&mut self) -> ImportResult<Option<RowView<'_>>> {
        let text = self.text;
        while let Some(rest) = text.get(self.next..).filter(|rest| !rest.is_empty()) {
            let end = rest.find('\n').unwrap_or(rest.len());
            let (row, line) = (rest[..end].trim_end_matches('\r'), self.next_line);
            self.start = self.next;
            (self.next, self.next_line) = (self.next + end + 1, line + 1);
            if row.is_empty() || is_comment(row) {
                continue;
            }
            let lines = self.split_row(row);
            if lines > 1 {
                return Err(ImportError::format(
                    format!("{}:{line}:1", self.file),
                    format!("a quoted cell that runs over {lines} lines"),
                    "it to end in its own",
                    "close the quotation mark, or export again",
                ));
            }
            return Ok(Some(RowView { line, cells: &self.cells }));
        }
        Ok(None)
    }

    /// Splits a row into cells. Returns the number of lines that the row occupies; a quoted cell may contain
    /// line ends.
    fn split_row(&mut self, row: &'t str) -> usize {
        self.cells.clear();
        let Some(byte) = self.delimiter.byte() else {
            self.cells.extend(row.split_whitespace().map(Cow::Borrowed));
            return 1;
        };
        if !row.contains('"') {
            self.cells.extend(row.split(char::from(byte)).map(Cow::Borrowed));
            return 1;
        }
        let (text, start) = (self.text, self.start);
        let is_next = |(from, reader): &(usize, csv::Reader<&[u8]>)| {
            let between = text.get(from + reader.position().byte() as usize..start);
            between.is_some_and(|between| between.bytes().all(|byte| matches!(byte, b'\n' | b'\r')))
        };
        let (from, mut reader) = self.quoted.take().filter(is_next).unwrap_or_else(|| {
            let mut builder = ReaderBuilder::new();
            builder.delimiter(byte).has_headers(false).flexible(true);
            (start, builder.from_reader(&text.as_bytes()[start..]))
        });
        let mut record = StringRecord::new();
        // (reading cannot fail: the text is UTF-8, and rows may differ in length)
        let _ = reader.read_record(&mut record);
        self.cells.extend(record.iter().map(|cell| Cow::Owned(cell.to_owned())));
        let used = text.get(start..from + reader.position().byte() as usize).unwrap_or_default();
        self.quoted = Some((from, reader));
        count_lines(used.trim_end_matches(['\n', '\r']).as_bytes()) + 1
    }
}

/// Splits lines into rows of cells.
pub(crate) fn parse_rows(lines: &[NumberedLine], delimiter: Delimiter) -> Vec<TextRow> {
    let parse = |(line, text): &NumberedLine| {
        let cells = RowReader::new("", text, delimiter, 0).next_row().ok()??.cells();
        Some(TextRow { line: *line, cells, start: 0 })
    };
    lines.iter().filter_map(parse).collect()
}
