//! A table in a text file with delimiters between the cells: its first rows in memory, a reader of all rows,
//! and the place of a cell for messages.

use super::dialect::{declared_delimiter, is_comment};
use crate::import::error::{ImportError, ImportResult, TextLocation};
use crate::import::reader::dialect::Dialect;
use crate::import::reader::number::{CellNumber, parse_number};
use crate::import::reader::rows::{RowReader, RowView, TextRow, count_lines, parse_rows};
use crate::import::reader::spreadsheet;

/// Maximum number of rows in [`DelimitedTable::head`], the first rows of a table, which are kept in memory to
/// find headers. The longest known header has a dozen rows.
const HEAD_ROWS: usize = 64;
/// Beginning of a typographic minus sign whose UTF-8 bytes were decoded as Windows-1252.
const BROKEN_MINUS: &str = "\u{e2}\u{2c6}";
/// Maximum number of header rows in comment lines: one with names and one with units.
const COMMENTED_ROWS: usize = 2;
/// First line that Tracker writes to a file with several tracks.
const MULTI_TRACK_MARK: &str = "#multi:";
/// What a cell should contain in a file with decimal points; `COMMA_NUMBER` says it for decimal commas.
const POINT_NUMBER: &str = "a number with a decimal point as in the rest of the file, or an empty cell";
const COMMA_NUMBER: &str = "a number with a decimal comma as in the rest of the file, or an empty cell";

/// A table in a text file with delimiters between the cells; comment lines are skipped.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct DelimitedTable<'a> {
    /// Path of the file as the user gave it.
    pub file: &'a str,
    pub dialect: Dialect,
    /// Whether the file starts with [`MULTI_TRACK_MARK`].
    pub multi: bool,
    /// The first rows that are not empty, at most [`HEAD_ROWS`], including the header.
    pub head: Vec<TextRow>,
    text: &'a str,
}

impl<'a> DelimitedTable<'a> {
    /// Finds the delimiter and the decimal mark of a table, and reads its first rows.
    ///
    /// # Errors
    /// [`ImportError`] if no delimiter splits the rows into columns, if there are no numbers, if the comma is
    /// both delimiter and decimal mark, or if one of the first rows cannot be read.
    pub(crate) fn parse(file: &'a str, text: &'a str) -> ImportResult<Self> {
        let dialect = Dialect::find(file, text)?;
        let multi = text.lines().next().is_some_and(|line| line.trim() == MULTI_TRACK_MARK);
        let mut table = Self { file, dialect, multi, head: vec![], text };
        let mut rows = table.rows_from(declared_delimiter(text).map_or(0, |(_, length)| length));
        let mut head = vec![];
        while head.len() < HEAD_ROWS
            && let Some(record) = rows.next_row()?
        {
            if !record.is_empty() {
                let (line, cells) = (record.line, record.cells());
                head.push(TextRow { line, cells, start: rows.start });
            }
        }
        let names = head.first().map(|first| table.names_in_comments(first)).unwrap_or_default();
        head.splice(..0, names);
        table.split_aligned_names(&mut head);
        table.head = head;
        Ok(table)
    }

    /// Column names, perhaps with units below them, from comment lines (`#` or `%`) directly above the first
    /// row of numbers. Such lines are written by numpy's `savetxt` and by scripts for gnuplot and MATLAB.
    /// `first` is the first row that is not a comment.
    fn names_in_comments(&self, first: &TextRow) -> Vec<TextRow> {
        let kind = |cell: &String| self.parse_cell(cell);
        let numbers = first.cells.iter().any(|cell| self.is_value(cell))
            && !first.cells.iter().any(|cell| kind(cell) == CellNumber::Text);
        let mut rows: Vec<TextRow> = vec![];
        while numbers && rows.len() < COMMENTED_ROWS {
            let Some(row) = self.comment_above(rows.last().map_or(first.start, |row| row.start)) else {
                break;
            };
            if row.cells.len() != first.cells.len()
                || !row.cells.iter().all(|cell| kind(cell) == CellNumber::Text)
            {
                break;
            }
            rows.push(row);
        }
        rows.reverse();
        rows
    }

    /// If blanks separate the names above the numbers, and another delimiter separates the numbers, splits
    /// the row of names at the blanks. It does so only if this gives as many cells as a row of numbers has.
    fn split_aligned_names(&self, head: &mut [TextRow]) {
        let numbers =
            |row: &&TextRow| row.cells.len() > 1 && row.cells.iter().all(|cell| self.is_value(cell));
        let Some(width) = head.iter().find(numbers).map(|row| row.cells.len()) else { return };
        for row in head.iter_mut().take_while(|row| !row.cells.iter().any(|cell| self.is_value(cell))) {
            let words: Vec<String> = row.first_cell().split_whitespace().map(str::to_owned).collect();
            if row.used_width() == 1 && words.len() == width {
                row.cells = words;
            }
        }
    }

    /// Cells of the line directly above byte `end` of the text, if this line starts with `#` or `%`.
    fn comment_above(&self, end: usize) -> Option<TextRow> {
        let above = self.text.get(..end)?.strip_suffix('\n')?.trim_end_matches('\r');
        let start = above.rfind('\n').map_or(0, |end| end + 1);
        let line = count_lines(&above.as_bytes()[..start]) + 1;
        let names = above.get(start..)?.strip_prefix(['#', '%'])?.trim();
        let cells = parse_rows(&[(line, names)], self.dialect.delimiter).pop()?.cells;
        Some(TextRow { line, cells, start })
    }

    /// Reader of the rows from row `from` of [`Self::head`] on. It also returns rows whose cells are all
    /// empty.
    pub(crate) fn rows(&self, from: usize) -> RowReader<'_> {
        self.rows_from(self.head.get(from).map_or(self.text.len(), |row| row.start))
    }

    /// Reader of the rows of the text from byte `start` on.
    fn rows_from(&self, start: usize) -> RowReader<'_> {
        RowReader::new(self.file, self.text, self.dialect.delimiter, start)
    }

    /// Whether the text contains `E+` or `E-`; only then can it contain numbers that were cut to the form
    /// `1.23E+05`.
    pub(crate) fn may_have_cut_numbers(&self) -> bool {
        // (a single character is found faster than two, and most texts do not contain E)
        self.text.contains('E') && (self.text.contains("E+") || self.text.contains("E-"))
    }

    /// Calls `find` for every row, from row `from` of [`Self::head`] on, and returns its first result.
    ///
    /// # Errors
    /// The errors of `find`, and an error if a row cannot be read.
    pub(crate) fn find_in_rows<T>(
        &self,
        from: usize,
        mut find: impl FnMut(&RowView) -> ImportResult<Option<T>>,
    ) -> ImportResult<Option<T>> {
        let mut rows = self.rows(from);
        while let Some(record) = rows.next_row()? {
            if let Some(found) = find(&record)? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// The text that `read` gives for row `from` of [`Self::head`], and the first row below it with another
    /// text: its line number and that text.
    ///
    /// # Errors
    /// An error if a row cannot be read.
    pub(crate) fn find_change(
        &self,
        from: usize,
        read: impl Fn(&RowView) -> String,
    ) -> ImportResult<(String, Option<(usize, String)>)> {
        let mut first: Option<String> = None;
        let change = self.find_in_rows(from, |record| {
            if record.is_empty() {
                return Ok(None);
            }
            let text = read(record);
            let differs = first.get_or_insert_with(|| text.clone()) != &text;
            Ok(differs.then_some((record.line, text)))
        })?;
        Ok((first.unwrap_or_default(), change))
    }

    /// Line number in the file of the first row of the table.
    pub(crate) fn first_line(&self) -> usize {
        self.head.first().map_or(1, |row| row.line)
    }

    /// Texts of the cells of the first row.
    pub(crate) fn first_texts(&self) -> Vec<&str> {
        self.head.first().map(TextRow::texts).unwrap_or_default()
    }

    /// The first row for which `accepts` returns true, with its index. Only the first `most` rows of
    /// [`Self::head`] are tried.
    pub(crate) fn find_row(
        &self,
        most: usize,
        accepts: impl Fn(&TextRow) -> bool,
    ) -> Option<(usize, &TextRow)> {
        self.head.iter().enumerate().take(most).find(|(_, row)| accepts(row))
    }

    /// Whether a cell contains a number.
    pub(crate) fn is_value(&self, cell: &str) -> bool {
        self.parse_cell(cell).value().is_some()
    }

    /// Reads the number in a cell, with the decimal mark of the table.
    pub(crate) fn parse_cell(&self, cell: &str) -> CellNumber {
        parse_number(cell, self.dialect.decimal)
    }

    /// Index in [`Self::head`] of the first row, from row `from` on, that has a number in each of the columns
    /// `cells`.
    pub(crate) fn first_numeric_row(&self, from: usize, cells: &[usize]) -> Option<usize> {
        let numbers = |row: &TextRow| cells.iter().all(|cell| self.is_value(row.cell(*cell)));
        (from..self.head.len()).find(|&row| numbers(&self.head[row]))
    }

    /// Number in the cell of a row; `None` if it is missing. `name` is the name of the column in messages.
    ///
    /// # Errors
    /// [`ImportError::Other`] if the cell contains other text.
    pub(crate) fn number_at(&self, record: &RowView, cell: usize, name: &str) -> ImportResult<Option<f64>> {
        match self.parse_cell(record.cell(cell)) {
            CellNumber::Value(value) => Ok(Some(value)),
            CellNumber::Missing => Ok(None),
            CellNumber::Text => Err(self.not_a_number_error(record.line, cell, record.cell(cell), name)),
        }
    }

    /// Like [`Self::number_at`], but returns `None` if `cell` is `None`, because the table does not have the
    /// column.
    pub(crate) fn optional_number_at(
        &self,
        record: &RowView,
        cell: Option<usize>,
        name: &str,
    ) -> ImportResult<Option<f64>> {
        cell.map_or(Ok(None), |cell| self.number_at(record, cell, name))
    }

    /// Refuses a row with fewer than `width` cells, or with text in a cell after the first `most` cells.
    pub(crate) fn check_row_length(&self, record: &RowView, width: usize, most: usize) -> ImportResult<()> {
        if record.len() >= width && (record.len() <= most || record.used_width() <= most) {
            return Ok(());
        }
        Err(self.ragged_error(record.line, record.len(), width.max(1)))
    }

    /// Error for a row whose number of cells differs from that of the other rows.
    pub(crate) fn ragged_error(&self, line: usize, found: usize, expected: usize) -> ImportError {
        ImportError::ragged_row(self.location(line, 1), found, expected)
    }

    /// Error for a cell that is not a number.
    pub(crate) fn not_a_number_error(&self, line: usize, cell: usize, text: &str, name: &str) -> ImportError {
        let other = if self.dialect.decimal == '.' { ',' } else { '.' };
        let advice = match parse_number(text, other) {
            CellNumber::Value(_) => {
                "the decimal mark changes within the file, or a mark separates thousands: export again with one \
                 format of numbers"
            }
            _ if text.contains(BROKEN_MINUS) => {
                "the minus sign was read in a wrong encoding before: export again, or replace it with a \
                 hyphen"
            }
            _ if text.contains(':') => {
                "export times as seconds, or name a column that counts frames (--columns frame=...)"
            }
            _ => spreadsheet::describe_damage(text).unwrap_or(
                "correct the cell from what the tracking program shows, or export again; a lost point is an \
                 empty cell",
            ),
        };
        let expected = if self.dialect.decimal == ',' { COMMA_NUMBER } else { POINT_NUMBER };
        let place = self.cell_location(line, cell);
        ImportError::cell(place, (name, text), (expected, advice))
    }

    /// Refuses a table whose first column contains names if one of its rows starts like a comment. Such a row
    /// would otherwise be skipped.
    ///
    /// # Errors
    /// [`ImportError`] that names the first such line below line `header`.
    pub(crate) fn refuse_comment_names(&self, header: usize, named: &str, advice: &str) -> ImportResult<()> {
        let Some(above) = self.text.lines().skip(header).position(is_comment) else { return Ok(()) };
        let problem = format!(
            "found {named} that starts like a comment, expected a name that starts with a letter or a number"
        );
        Err(ImportError::columns(self.file, header + above + 1, problem, advice))
    }

    /// File, line and column of the cell with the index `cell` in line `line`.
    pub(crate) fn cell_location(&self, line: usize, cell: usize) -> TextLocation {
        self.location(line, self.text_column(line, cell))
    }

    pub(crate) fn location(&self, line: usize, column: usize) -> TextLocation {
        TextLocation { file: self.file.to_owned(), line, column }
    }

    /// Position in its line of the first character of a cell, in characters counted from 1.
    pub(crate) fn text_column(&self, line: usize, cell: usize) -> usize {
        let Some(text) = self.text.lines().nth(line.saturating_sub(1)) else { return 1 };
        let Some(delimiter) = self.dialect.delimiter.byte() else { return column_of_word(text, cell) };
        let (mut quoted, mut passed) = (false, 0);
        let mut characters = text.chars().enumerate();
        if cell > 0 {
            for (_, c) in characters.by_ref() {
                quoted ^= c == '"';
                passed += usize::from(!quoted && c == char::from(delimiter));
                if passed == cell {
                    break;
                }
            }
        }
        characters
            .find(|(_, c)| !c.is_whitespace() || *c == char::from(delimiter))
            .map_or(text.chars().count() + 1, |(index, _)| index + 1)
    }
}

/// Position in `text` of the first character of a word, in characters counted from 1. Words are separated by
/// blanks; `word` is the index of the word, counted from 0.
pub(crate) fn column_of_word(text: &str, word: usize) -> usize {
    let mut before = ' ';
    let starts = text.chars().enumerate().filter(|(_, c)| {
        let starts = before.is_whitespace() && !c.is_whitespace();
        before = *c;
        starts
    });
    starts.map(|(index, _)| index + 1).nth(word).unwrap_or(text.chars().count() + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> Vec<(usize, Vec<String>)> {
        let table = DelimitedTable::parse("a.txt", text).unwrap();
        let mut rows = table.rows(0);
        let mut found = vec![];
        while let Some(record) = rows.next_row().unwrap() {
            found.push((record.line, (0..record.len()).map(|cell| record.cell(cell).to_owned()).collect()));
        }
        found
    }

    #[test]
    fn lines_are_counted_through_comments_blank_lines_and_either_line_end() {
        for end in ["\n", "\r\n"] {
            let text = ["# a \"comment", "t,x", "", "0,1", "// \"", "1,\"2\"", "", "***", "2,3"].join(end);
            let lines: Vec<usize> = rows(&text).into_iter().map(|(line, _)| line).collect();
            assert_eq!(lines, [2, 4, 6, 9], "{end:?}");
        }
        assert_eq!(
            rows("t,x\n# seen, \"at noon\n0,1\n1,2\n# and, \"later\n2,3\n")
                .iter()
                .map(|row| row.0)
                .collect::<Vec<_>>(),
            [1, 3, 4, 6]
        );
        assert_eq!(rows("t  x\n\n 0   1\n#\n1 2\n")[2], (5, vec!["1".to_owned(), "2".to_owned()]));
        assert_eq!(rows("sep=;\nt;x\n1;2\n3;4\n").len(), 3);
    }

    #[test]
    fn rows_of_empty_cells_are_rows() {
        assert_eq!(rows("t,x\n0,1\n,\n2,3\n")[2], (3, vec![String::new(), String::new()]));
    }

    #[test]
    fn quoted_cells_hold_delimiters_and_end_in_their_line() {
        assert_eq!(rows("\"t\",\"a,b\"\n \"1\" ,\"2\"\n")[0].1, ["t", "a,b"]);
        assert_eq!(rows("\"t\",\"a,b\"\n \"1\" ,\"2\"\n")[1].1, ["1", "2"]);
        let table = DelimitedTable::parse("a.txt", "t,x\n0,1\n1,2\n2,3\n3,4\n").unwrap();
        assert_eq!(table.rows(1).next_row().unwrap().map(|record| record.line), Some(2));
        let open = (0..200)
            .map(|i| if i == 150 { "150,\"2\n".to_owned() } else { format!("{i},2\n") })
            .collect::<String>();
        let table = DelimitedTable::parse("a.txt", &open).unwrap();
        let mut rows = table.rows(0);
        let error = loop {
            match rows.next_row() {
                Ok(row) => assert!(row.is_some()),
                Err(error) => break error.to_string(),
            }
        };
        assert!(error.starts_with("a.txt:151:1: found a quoted cell that runs over 50 lines"), "{error}");
    }

    #[test]
    fn cells_that_are_no_numbers_say_what_to_do() {
        let table = DelimitedTable::parse("a.txt", "t,x\n0,1\n1,2\n").unwrap();
        let says = |cell: &str| table.not_a_number_error(2, 1, cell, "x").to_string();
        assert!(says("1,234.5").contains("separators of thousands"), "{}", says("1,234.5"));
        assert!(says("1,5").contains("the decimal mark changes within the file"), "{}", says("1,5"));
        for other in ["1.2.3", "lost", "Tip 1", "a 1,2,3"] {
            assert!(says(other).contains("correct the cell from what the tracking program shows"), "{other}");
        }
        for time in ["10:00:00.5", "2021-02-03T10:00:00.0+01:00"] {
            assert!(
                says(time).contains("export times as seconds, or name a column that counts frames"),
                "{}",
                says(time)
            );
        }
    }

    #[test]
    fn a_cell_is_found_in_its_line() {
        let table = DelimitedTable::parse("a.txt", "name,\"a,b\", x\n1,\"2,5\",  3\n4,5,6\n").unwrap();
        assert_eq!([0, 1, 2].map(|cell| table.text_column(1, cell)), [1, 6, 13]);
        assert_eq!([0, 1, 2].map(|cell| table.text_column(2, cell)), [1, 3, 11]);
        let table = DelimitedTable::parse("a.txt", "  t   x\n 0   1.5\n 1   2.5\n").unwrap();
        assert_eq!((table.text_column(2, 0), table.text_column(2, 1)), (2, 6));
    }
}
