//! How a table is written: its delimiter, its decimal mark, its words for "missing".

use super::error::{CellProblem, ImportError, Place};

/// What stands between cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delimiter {
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

/// In order of preference where several explain a file equally well: a comma may be a decimal mark, a space may pad.
const DELIMITERS: [Delimiter; 5] = [Delimiter::Tab, Delimiter::Semicolon, Delimiter::Comma, Delimiter::Space, Delimiter::Blanks];
/// Lines that are looked at to find the dialect.
const SAMPLE_LINES: usize = 2000;
/// Words for a missing value, in lower case.
const MISSING: [&str; 8] = ["", "nan", "na", "none", "-", "*", "null", "#n/a"];
/// What belongs in a cell, by the decimal mark of the file.
const POINT_NUMBER: &str = "a number with a decimal point as in the rest of the file, or an empty cell";
const COMMA_NUMBER: &str = "a number with a decimal comma as in the rest of the file, or an empty cell";
/// One row in so many shows the leading zeros of a fraction if every second cell is one: a tenth do in each, by chance alone.
const FRACTIONS: usize = 10;
/// First line with which spreadsheets declare their delimiter.
const DECLARATION: &str = "sep=";
/// Tracker's mark of a file with several tracks; other lines that start so are comments.
pub const MULTI: &str = "#multi:";

impl Delimiter {
    fn splits(self, c: char) -> bool {
        match self {
            Self::Tab => c == '\t',
            Self::Semicolon => c == ';',
            Self::Comma => c == ',',
            Self::Space => c == ' ',
            Self::Blanks => c == ' ' || c == '\t',
        }
    }

    /// The word for it.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Tab => "tab",
            Self::Semicolon => "semicolon",
            Self::Comma => "comma",
            Self::Space => "space",
            Self::Blanks => "blanks",
        }
    }
}

/// A cell of a row, trimmed and without its quotes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell<'a> {
    /// Its text.
    pub text: &'a str,
    /// 1-based column of its first character.
    pub column: usize,
}

/// A row of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row<'a> {
    /// 1-based line.
    pub line: usize,
    /// Its cells.
    pub cells: Vec<Cell<'a>>,
}

/// What a cell says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Number {
    /// One of the words for a missing value.
    Missing,
    /// A finite number.
    Value(f64),
    /// Something else.
    Text,
}

/// A delimited file, comments and blank rows left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table<'a> {
    /// File as named by the user.
    pub file: &'a str,
    /// Its rows, header rows included.
    pub rows: Vec<Row<'a>>,
    /// Its delimiter.
    pub delimiter: Delimiter,
    /// Its decimal mark, `.` or `,`.
    pub decimal: char,
    /// Whether it starts with [`MULTI`].
    pub multi: bool,
}

impl<'a> Table<'a> {
    /// Reads a table, finding its dialect by which delimiter makes the most rows of numbers of one length.
    ///
    /// # Errors
    /// [`ImportError`] when no delimiter makes columns, when there are no numbers, or when commas are both.
    pub fn read(file: &'a str, text: &'a str) -> Result<Self, ImportError> {
        let (lines, declared) = content(text);
        let multi = text.lines().next().is_some_and(|line| line.trim() == MULTI);
        let candidates: Vec<Delimiter> = declared.map_or(DELIMITERS.to_vec(), |d| vec![d]);
        let scored = candidates.into_iter().map(|d| (score(&lines, d), d));
        let best = scored.reduce(|best, next| if next.0 > best.0 + 1e-9 { next } else { best });
        let Some((_, delimiter)) = best.filter(|best| best.0 > 0.0) else { return Err(no_columns(file, &lines)) };
        let rows: Vec<Row> = lines.iter().map(|&(line, text)| Row { line, cells: split(text, delimiter) }).collect();
        let rows: Vec<Row> = rows.into_iter().filter(|row| row.cells.iter().any(|cell| !cell.text.is_empty())).collect();
        let decimal = decimal_mark(&rows, delimiter);
        let table = Self { file, rows, delimiter, decimal, multi };
        table.refuse_double_comma()?;
        Ok(table)
    }

    /// What `cell` says in the table's decimal mark.
    #[must_use]
    pub fn number(&self, cell: &Cell) -> Number {
        number(cell.text, self.decimal)
    }

    /// A number or `None` for a missing one; `name` is that of the column.
    ///
    /// # Errors
    /// [`ImportError::Cell`] for anything else.
    pub fn value(&self, line: usize, cell: &Cell, name: &str) -> Result<Option<f64>, ImportError> {
        match self.number(cell) {
            Number::Value(value) => Ok(Some(value)),
            Number::Missing => Ok(None),
            Number::Text => Err(self.not_a_number(line, cell, name)),
        }
    }

    /// The refusal of a cell that is no number.
    #[must_use]
    pub fn not_a_number(&self, line: usize, cell: &Cell, name: &str) -> ImportError {
        let other = if self.decimal == '.' { ',' } else { '.' };
        let advice = match number(cell.text, other) {
            Number::Value(_) => {
                "the file mixes decimal marks, as spreadsheets do when they take numbers for dates: go back to the tracking program's own export"
            }
            _ => "correct the cell, or empty it if the point was lost",
        };
        ImportError::Cell {
            place: self.place(line, cell.column),
            problem: CellProblem::NotANumber,
            name: name.to_owned(),
            found: cell.text.into(),
            expected: if self.decimal == ',' { COMMA_NUMBER } else { POINT_NUMBER },
            advice,
        }
    }

    /// A place in this file.
    #[must_use]
    pub fn place(&self, line: usize, column: usize) -> Place {
        Place { file: self.file.to_owned(), line, column }
    }

    /// `1,5,2,5` under a header of two: digits on both sides of every second comma.
    fn refuse_double_comma(&self) -> Result<(), ImportError> {
        if self.delimiter != Delimiter::Comma {
            return Ok(());
        }
        let named = |row: &&Row| {
            row.cells.iter().all(|cell| self.number(cell) != Number::Missing || cell.text.is_empty()) && self.number(&row.cells[0]) == Number::Text
        };
        let Some(header) = self.rows.iter().take_while(|row| !self.is_numeric(row)).filter(named).last() else { return self.refuse_halves() };
        let expected = header.cells.iter().rposition(|cell| !cell.text.is_empty()).map_or(0, |last| last + 1);
        let whole = |row: &&Row| row.cells.len() > expected && row.cells.iter().all(|cell| !cell.text.contains('.'));
        let rows: Vec<&Row> = self.rows.iter().filter(|row| self.is_numeric(row)).collect();
        let long: Vec<&Row> = rows.iter().copied().filter(whole).filter(|row| row.cells[expected..].iter().any(|cell| !cell.text.is_empty())).collect();
        match long.first() {
            Some(row) if 2 * long.len() > rows.len() => {
                let instead = format!("under a header of {expected}");
                Err(ImportError::DecimalComma { place: self.place(row.line, 1), found: row.cells.len(), instead })
            }
            _ => Ok(()),
        }
    }

    /// `0,000,10,050` without a header: every second cell has the leading zeros of a fraction, as no whole number does.
    fn refuse_halves(&self) -> Result<(), ImportError> {
        let rows: Vec<&Row> = self.rows.iter().filter(|row| self.is_numeric(row)).collect();
        let fraction = |cell: &Cell| cell.text.len() > 1 && cell.text.starts_with('0') && cell.text[1..].starts_with(|c: char| c.is_ascii_digit());
        let fits = |row: &&&Row| {
            row.cells.len().is_multiple_of(2) && !row.cells.iter().any(|cell| cell.text.contains('.')) && !row.cells.iter().step_by(2).any(fraction)
        };
        let shows = |row: &&Row| row.cells.iter().skip(1).step_by(2).any(fraction);
        let shown = rows.iter().filter(|row| shows(row)).count();
        match rows.first() {
            Some(row) if FRACTIONS * shown > rows.len() && rows.iter().filter(fits).count() == rows.len() => {
                let found = row.cells.len();
                Err(ImportError::DecimalComma { place: self.place(row.line, 1), found, instead: format!("that look like {} numbers cut in two", found / 2) })
            }
            _ => Ok(()),
        }
    }

    fn is_numeric(&self, row: &Row) -> bool {
        row.cells.first().is_some_and(|cell| matches!(self.number(cell), Number::Value(_)))
    }
}

/// Lines with something in them that are no comment, and the delimiter that the file declares.
fn content(text: &str) -> (Vec<(usize, &str)>, Option<Delimiter>) {
    let declared = text.lines().next().and_then(|first| first.trim_end_matches(['\n', ' ']).strip_prefix(DECLARATION));
    let declared = declared.and_then(|mark| DELIMITERS.into_iter().find(|d| mark.chars().next().is_some_and(|c| d.splits(c))));
    let numbered = text.lines().enumerate().map(|(index, line)| (index + 1, line));
    let comment = |line: &str| {
        let line = line.trim_start();
        (line.starts_with('#') && !line.to_lowercase().starts_with("#n/a")) || line.starts_with("//") || line.starts_with("***")
    };
    let declaration = |number: usize, line: &str| number == 1 && line.starts_with(DECLARATION);
    let kept = numbered.filter(|&(number, line)| !(line.trim().is_empty() || comment(line) || declaration(number, line)));
    (kept.collect(), declared)
}

/// How well `delimiter` explains the lines: the share of numbers, summed over rows of the usual length that are mostly numbers.
fn score(lines: &[(usize, &str)], delimiter: Delimiter) -> f64 {
    let rows: Vec<Vec<Cell>> = lines.iter().take(SAMPLE_LINES).map(|(_, line)| split(line, delimiter)).collect();
    let numeric: Vec<(usize, f64)> =
        rows.iter().map(|cells| (cells.len(), numeric_share(cells, delimiter))).filter(|(count, share)| *count > 1 && *share > 0.5).collect();
    let mut counts: Vec<usize> = numeric.iter().map(|(count, _)| *count).collect();
    counts.sort_unstable();
    let usual = counts.get(counts.len() / 2).copied().unwrap_or(0);
    let padded =
        delimiter == Delimiter::Space && (1..usual.saturating_sub(1)).any(|i| rows.iter().all(|cells| cells.get(i).is_none_or(|cell| cell.text.is_empty())));
    if padded {
        return 0.0;
    }
    numeric.iter().filter(|(count, _)| *count == usual).map(|(_, share)| share).sum()
}

/// Share of numbers among the cells that are not missing.
fn numeric_share(cells: &[Cell], delimiter: Delimiter) -> f64 {
    let is_number =
        |text: &str| matches!(number(text, '.'), Number::Value(_)) || (delimiter != Delimiter::Comma && matches!(number(text, ','), Number::Value(_)));
    let present: Vec<&Cell> = cells.iter().filter(|cell| number(cell.text, '.') != Number::Missing).collect();
    if present.is_empty() { 0.0 } else { present.iter().filter(|cell| is_number(cell.text)).count() as f64 / present.len() as f64 }
}

/// The mark that more of the numbers need; a comma that delimits cannot be one.
fn decimal_mark(rows: &[Row], delimiter: Delimiter) -> char {
    if delimiter == Delimiter::Comma {
        return '.';
    }
    let numbers = |mark: char| {
        let cells = rows.iter().flat_map(|row| &row.cells);
        cells.filter(|cell| cell.text.contains(mark) && matches!(number(cell.text, mark), Number::Value(_))).count()
    };
    if numbers(',') > numbers('.') { ',' } else { '.' }
}

/// Reads a number with the decimal mark `decimal`; typographic minus signs count as minus.
fn number(text: &str, decimal: char) -> Number {
    if MISSING.contains(&text.to_lowercase().as_str()) {
        return Number::Missing;
    }
    let minus = |c: char| matches!(c, '\u{2212}' | '\u{2010}'..='\u{2013}');
    let plain: String = text.chars().map(|c| if minus(c) { '-' } else { c }).collect();
    if plain == "-" {
        return Number::Missing;
    }
    let allowed = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | 'e' | 'E') || c == decimal;
    if !plain.chars().all(allowed) || (decimal == ',' && plain.ends_with(decimal)) {
        return Number::Text;
    }
    match plain.replace(decimal, ".").parse::<f64>() {
        Ok(value) if value.is_finite() => Number::Value(value),
        _ => Number::Text,
    }
}

/// Cells of a line; a delimiter between double quotes does not divide.
fn split(line: &str, delimiter: Delimiter) -> Vec<Cell<'_>> {
    let (mut cells, mut start, mut start_column, mut quoted) = (vec![], 0, 1, false);
    for (index, (offset, c)) in line.char_indices().enumerate() {
        if c == '"' {
            quoted = !quoted;
        } else if !quoted && delimiter.splits(c) {
            cells.push(cell(&line[start..offset], start_column));
            (start, start_column) = (offset + c.len_utf8(), index + 2);
        }
    }
    cells.push(cell(&line[start..], start_column));
    if delimiter == Delimiter::Blanks {
        cells.retain(|cell| !cell.text.is_empty());
    }
    cells
}

fn cell(text: &str, column: usize) -> Cell<'_> {
    let blanks = text.chars().take_while(|c| c.is_whitespace()).count();
    let trimmed = text.trim();
    let inner = trimmed.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    Cell { text: inner.map_or(trimmed, str::trim), column: column + blanks }
}

/// The refusal where no delimiter makes rows of numbers.
fn no_columns(file: &str, lines: &[(usize, &str)]) -> ImportError {
    let starts_like_data = |line: &&(usize, &str)| line.1.trim_start_matches(['"', '-', '\u{2212}', ' ']).starts_with(|c: char| c.is_ascii_digit());
    match (lines.iter().find(starts_like_data), lines.last()) {
        (Some((line, text)), _) => {
            let place = Place { file: file.to_owned(), line: *line, column: 1 };
            ImportError::Delimiter { place, found: text.trim().chars().take(60).collect() }
        }
        (None, Some((line, _))) => ImportError::HeaderOnly { file: file.to_owned(), line: *line },
        (None, None) => ImportError::Empty { file: file.to_owned() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dialect(text: &str) -> (Delimiter, char, usize) {
        let table = Table::read("a.txt", text).unwrap();
        (table.delimiter, table.decimal, table.rows.last().unwrap().cells.len())
    }

    #[test]
    fn dialects_are_found_by_consistency() {
        assert_eq!(dialect("t\tx\n0.0\t1.5\n0.1\t1.6\n"), (Delimiter::Tab, '.', 2));
        assert_eq!(dialect("t\tx\n0,0\t1,5\n0,1\t1,6\n"), (Delimiter::Tab, ',', 2));
        assert_eq!(dialect("t;x\n0,0;1,5\n0,1;1,6\n"), (Delimiter::Semicolon, ',', 2));
        assert_eq!(dialect("t, x\n0.0, 1.5\n0.1, 1.6\n"), (Delimiter::Comma, '.', 2));
        assert_eq!(dialect("t x\n0,0 1,5\n0,1 1,6\n"), (Delimiter::Space, ',', 2));
        assert_eq!(dialect("t x y\n0.0  1\n0.1 2 1\n0.2 3 2\n"), (Delimiter::Space, '.', 3));
        assert_eq!(dialect("   t     x\n 0.0   1.5\n 0.1  11.6\n"), (Delimiter::Blanks, '.', 2));
        assert_eq!(dialect("sep=;\nt;x\n1;2\n3;4\n"), (Delimiter::Semicolon, '.', 2));
        assert_eq!(dialect("\"t\",\"a,b\"\n\"1\",\"2\"\n"), (Delimiter::Comma, '.', 2));
    }

    #[test]
    fn numbers_in_every_spelling() {
        assert_eq!(number("\u{2212}1,25E\u{2212}1", ','), Number::Value(-0.125));
        assert_eq!(number("1.234E0", '.'), Number::Value(1.234));
        for word in ["", "NaN", "NA", "None", "-", "*", "null", "#N/A", "\u{2212}"] {
            assert_eq!(number(word, '.'), Number::Missing, "{word}");
        }
        for word in ["1,5", "inf", "1e999", "x", "1.2.3", "0x10", "1'000.0"] {
            assert_eq!(number(word, '.'), Number::Text, "{word}");
        }
    }

    #[test]
    fn refusals_name_the_place_and_the_remedy() {
        let says = |text: &str| Table::read("a.txt", text).unwrap_err().to_string();
        assert_eq!(
            says("t|x\n0.0|1.5\n0.1|1.6\n"),
            "a.txt:2:1: found `0.0|1.5`, expected columns separated by tabs, semicolons, commas or spaces; export again with one of these delimiters"
        );
        assert!(says("t,x\n0,0,1,5\n0,1,1,6\n").starts_with("a.txt:2:1: found 4 cells under a header of 2: the comma is both delimiter and decimal mark"));
        for halves in ["0,000,10,050\n0,001,10,150\n", "0,000000E+00,1,500000E+01\n1,000000E-03,1,600000E+01\n"] {
            assert!(says(halves).starts_with("a.txt:1:1: found 4 cells that look like 2 numbers cut in two: the comma is both"), "{halves}");
        }
        for whole in ["0,512,10,50\n1,513,10,50\n", "0001,512,300,40\n0002,513,300,40\n", "0.5,0,1\n1.5,00,1\n"] {
            assert_eq!(dialect(whole).0, Delimiter::Comma, "{whole}");
        }
        assert!(says("t\tx\ty\n\n").starts_with("a.txt:1:1: found no rows of numbers"));
    }
}
