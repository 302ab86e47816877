//! Reads the rows of a table one by one. This is the only file that uses `csv`.

use super::dialect::{Delimiter, NumberedLine, is_comment};
use crate::import::error::{ImportError, ImportResult};
use csv::{ReaderBuilder, StringRecord};

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

/// A row of a table whose cells are borrowed from the reader.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowView<'r> {
    pub line: usize,
    cells: &'r StringRecord,
}

impl<'r> RowView<'r> {
    /// Texts of all cells, trimmed and without the quotation marks around them.
    pub(crate) fn cells(&self) -> Vec<String> {
        self.cells.iter().map(|cell| trim_cell(cell).to_owned()).collect()
    }

    /// Text of the cell with this index, trimmed and without the quotation marks around it; empty if the row
    /// has no such cell.
    pub(crate) fn cell(&self, index: usize) -> &'r str {
        self.cells.get(index).map_or("", trim_cell)
    }

    pub(crate) fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether all cells of the row are empty.
    pub(crate) fn is_empty(&self) -> bool {
        self.cells.iter().all(|cell| trim_cell(cell).is_empty())
    }

    /// Number of cells up to the last one that is not empty.
    pub(crate) fn used_width(&self) -> usize {
        (0..self.len()).rev().find(|&index| !self.cell(index).is_empty()).map_or(0, |last| last + 1)
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
    source: RecordReader<'t>,
    /// Byte offset in the text at which `source` starts.
    base: usize,
    /// Byte offset up to which lines have been counted; `line` is the line number there.
    counted: usize,
    line: usize,
    /// Byte offset at which the current row starts.
    pub start: usize,
    record: StringRecord,
}

enum RecordReader<'t> {
    Csv(Box<csv::Reader<&'t [u8]>>),
    Blanks(&'t str, usize),
}

impl<'t> RecordReader<'t> {
    fn new(text: &'t str, delimiter: Delimiter) -> Self {
        match delimiter.byte() {
            Some(byte) => Self::Csv(Box::new(
                ReaderBuilder::new()
                    .delimiter(byte)
                    .has_headers(false)
                    .flexible(true)
                    .from_reader(text.as_bytes()),
            )),
            None => Self::Blanks(text, 0),
        }
    }

    /// Reads the next row into `record`. Returns the range of bytes that was read, which includes the line
    /// ends before the row; 0 is the start of this reader's text. `None` after the last row.
    fn read_record(&mut self, record: &mut StringRecord) -> Option<(usize, usize)> {
        match self {
            Self::Csv(reader) => {
                let from = reader.position().byte() as usize;
                // (reading cannot fail: the text is UTF-8, and rows may differ in length)
                reader.read_record(record).unwrap_or(false).then(|| (from, reader.position().byte() as usize))
            }
            Self::Blanks(text, at) => {
                let from = *at;
                let rest = text.get(from..)?;
                let line = rest.split_inclusive('\n').next()?;
                *at += line.len();
                record.clear();
                line.split_whitespace().for_each(|cell| record.push_field(cell));
                Some((from, *at))
            }
        }
    }
}

impl<'t> RowReader<'t> {
    /// Makes a reader of the rows of `text` from byte `start` on. Error messages name `file`.
    pub(crate) fn new(file: &'t str, text: &'t str, delimiter: Delimiter, start: usize) -> Self {
        Self {
            file,
            text,
            delimiter,
            source: RecordReader::new(text.get(start..).unwrap_or_default(), delimiter),
            base: start,
            counted: start,
            line: count_lines(&text.as_bytes()[..start.min(text.len())]) + 1,
            start,
            record: StringRecord::new(),
        }
    }

    /// The next row; `None` after the last one. Comments and empty lines are skipped; rows whose cells are
    /// all empty are not.
    ///
    /// # Errors
    /// [`ImportError::Other`] if a quoted cell continues in the next line.
    #[allow(clippy::should_implement_trait)] // (no `Iterator`: a row is valid until the next call)
    pub(crate) fn next_row(&mut self) -> ImportResult<Option<RowView<'_>>> {
        let text = self.text;
        while let Some((from, to)) = self.source.read_record(&mut self.record) {
            let span = text.get(self.base + from..self.base + to).unwrap_or_default();
            let is_end = |byte: &&u8| matches!(**byte, b'\n' | b'\r');
            let before = span.as_bytes().iter().take_while(is_end).count();
            let after = span.as_bytes()[before..].iter().rev().take_while(is_end).count();
            self.start = self.base + from + before;
            // (line ends within a row are not counted: such a row is refused or, if it is a comment, reading
            // restarts after its first line)
            self.line += count_lines(&text.as_bytes()[self.counted..self.start]);
            self.counted = self.start + span.len() - before - after;
            let row = &span[before..span.len() - after];
            if row.is_empty() {
                continue;
            }
            if is_comment(row) {
                if let Some(end) = row.find('\n') {
                    self.restart_at(self.start + end); // (a quotation mark in a comment is plain text)
                }
                continue;
            }
            if row.as_bytes().contains(&b'\n') {
                let lines = count_lines(row.as_bytes()) + 1;
                return Err(ImportError::format(
                    format!("{}:{}:1", self.file, self.line),
                    format!("a quoted cell that runs over {lines} lines"),
                    "it to end in its own",
                    "close the quotation mark, or export again",
                ));
            }
            return Ok(Some(RowView { line: self.line, cells: &self.record }));
        }
        Ok(None)
    }

    /// Continues reading at byte `at` of the text, which must be a line end.
    fn restart_at(&mut self, at: usize) {
        self.source = RecordReader::new(self.text.get(at..).unwrap_or_default(), self.delimiter);
        (self.base, self.counted) = (at, at);
    }
}

/// Splits lines into rows of cells. A row with an open quotation mark continues in the next line.
pub(crate) fn parse_rows(lines: &[NumberedLine], delimiter: Delimiter) -> Vec<TextRow> {
    let text: String = lines.iter().flat_map(|(_, line)| [*line, "\n"]).collect();
    let mut source = RecordReader::new(&text, delimiter);
    let (mut record, mut rows, mut line) = (StringRecord::new(), vec![], 0);
    while let Some((from, to)) = source.read_record(&mut record) {
        let number = lines.get(line).map_or(0, |line| line.0);
        rows.push(TextRow {
            line: number,
            cells: RowView { line: number, cells: &record }.cells(),
            start: from,
        });
        line += count_lines(text.as_bytes().get(from..to).unwrap_or_default());
    }
    rows
}
