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
    // (the count of 255 bytes fits into a byte, so that the processor counts in many bytes at once)
    let count = |part: &[u8]| part.iter().map(|byte| u8::from(*byte == b'\n')).sum::<u8>();
    bytes.chunks(255).map(|part| usize::from(count(part))).sum()
}

/// Number of bytes that [`mark_bytes`] compares at once.
const CHUNK: usize = 8;

/// Marks the bytes of a chunk that are equal to `wanted`: the highest bit of byte i of the result is 1 if
/// byte i of the chunk is equal.
fn mark_bytes(chunk: &[u8], wanted: u8) -> u64 {
    const ONES: u64 = u64::MAX / 255;
    const LOW_BITS: u64 = 0x7f * ONES;
    let word = match chunk.try_into() {
        Ok(bytes) => u64::from_le_bytes(bytes),
        // (the end of a text; zero is no byte that is looked for)
        Err(_) => chunk.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte)),
    };
    let difference = word ^ (u64::from(wanted) * ONES);
    // (the sum carries into the highest bit of a byte unless its other bits are zero)
    !(((difference & LOW_BITS) + LOW_BITS) | difference | LOW_BITS)
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
            let (row, has_quotes) = self.split_line(rest);
            let line = self.next_line;
            self.start = self.next;
            (self.next, self.next_line) = (self.next + row.len() + 1, line + 1);
            let row = row.trim_end_matches('\r');
            if row.is_empty() || is_comment(row) {
                continue;
            }
            let lines = if has_quotes { self.split_quoted_row() } else { 1 };
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

    /// Splits the first line of a text into cells, as far as they are not in quotation marks. Returns the
    /// line, and whether a delimiter other than blanks separates its cells and one of them has quotation
    /// marks.
    fn split_line(&mut self, text: &'t str) -> (&'t str, bool) {
        self.cells.clear();
        let Some(delimiter) = self.delimiter.byte() else {
            let line = text.split('\n').next().unwrap_or_default();
            self.cells.extend(line.split_whitespace().map(Cow::Borrowed));
            return (line, false);
        };
        let (mut start, mut end, mut has_quotes) = (0, text.len(), false);
        'line: for (index, chunk) in text.as_bytes().chunks(CHUNK).enumerate() {
            let mut marks =
                [delimiter, b'\n', b'"'].iter().fold(0, |all, mark| all | mark_bytes(chunk, *mark));
            while marks != 0 {
                let at = CHUNK * index + marks.trailing_zeros() as usize / 8;
                match text.as_bytes()[at] {
                    b'\n' => {
                        end = at;
                        break 'line;
                    }
                    b'"' => has_quotes = true,
                    _ => {
                        self.cells.push(Cow::Borrowed(&text[start..at]));
                        start = at + 1;
                    }
                }
                marks &= marks - 1;
            }
        }
        self.cells.push(Cow::Borrowed(text[start..end].trim_end_matches('\r')));
        (&text[..end], has_quotes)
    }

    /// Splits the current row, which has cells in quotation marks, into cells. Returns the number of lines
    /// that the row occupies; a quoted cell may contain line ends.
    fn split_quoted_row(&mut self) -> usize {
        let Some(byte) = self.delimiter.byte() else { return 1 };
        self.cells.clear();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_found_wherever_they_are() {
        for length in 0..=CHUNK {
            for chunk in
                [vec![b','; length], vec![b'+'; length], vec![0xac; length], (0x28..).take(length).collect()]
            {
                let found = mark_bytes(&chunk, b',');
                let is_marked = |at: usize| found >> (8 * at) & 0xff;
                let expected = |at: usize| if chunk.get(at) == Some(&b',') { 0x80 } else { 0 };
                assert!((0..CHUNK).all(|at| is_marked(at) == expected(at)), "{chunk:?} {found:x}");
            }
        }
    }

    #[test]
    fn lines_are_counted_in_long_texts() {
        for lines in [0, 1, 254, 255, 256, 1000] {
            assert_eq!(count_lines("\n".repeat(lines).as_bytes()), lines);
            assert_eq!(count_lines("ab\n".repeat(lines).as_bytes()), lines);
        }
    }
}
