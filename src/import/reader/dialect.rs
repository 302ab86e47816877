//! Finds the delimiter between the cells of a table and the decimal mark of its numbers: the two that fit the
//! rows of the whole file best.

use super::spreadsheet;
use crate::import::error::{ImportError, ImportResult};
use crate::import::reader::number::{CellNumber, parse_number};
use crate::import::reader::rows::{TextRow, count_lines, parse_rows};

/// Number of lines at the start of a file from which its dialect (delimiter and decimal mark) is found. Up to
/// as many lines are added from the rest of the file, at even distances.
const SAMPLE_LINES: usize = 1000;
/// Maximum size of each of the two parts of the sample (start and rest of the file), bytes. It limits the
/// memory: a cell of one digit needs thirty times its size.
const SAMPLE_BYTES: usize = 1 << 20;
/// Maximum number of columns of a table, enough for x and y of ten thousand points.
const MOST_COLUMNS: usize = 20_000;
/// The commas of a table without a header are decimal marks if a leading zero follows a comma, as in `1,05`,
/// in more than one row of this number. By chance, one decimal fraction in ten has a leading zero; a whole
/// number in a cell of its own has none.
const ROWS_PER_FRACTION: usize = 10;
/// A row counts as data if the fraction of its cells that are numbers is above this value.
const MOSTLY_NUMBERS: f64 = 0.5;
/// Lower limit that replaces [`MOSTLY_NUMBERS`] if no row of the file exceeds it. An example is a row with
/// three cells that name a picture and two cells with the coordinates of a labelled point.
const FEW_NUMBERS: f64 = 1.0 / 3.0;
/// Minimum number of cells in a row for which the limit [`FEW_NUMBERS`] is used. A sentence that contains a
/// number splits into fewer cells.
const FEWEST_CELLS: usize = 5;
/// Delimiter and decimal mark of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Dialect {
    pub delimiter: Delimiter,
    /// Decimal mark, `.` or `,`.
    pub decimal: char,
}

impl Dialect {
    /// Text for the report on delimiter and decimal mark.
    pub(crate) fn describe(&self) -> String {
        format!(", delimiter {}, decimal mark `{}`", self.delimiter.word(), self.decimal)
    }

    /// Finds the delimiter that gives the most rows of numbers with an equal number of cells, and then the
    /// decimal mark.
    ///
    /// # Errors
    /// [`ImportError`] if no delimiter splits the rows into columns, if there are no numbers, if the comma is
    /// both delimiter and decimal mark, or if the decimal mark separates thousands.
    pub(crate) fn find(file: &str, text: &str) -> ImportResult<Self> {
        let declared = declared_delimiter(text);
        let of_the_table = |line: &NumberedLine| !(is_comment(line.1) || (declared.is_some() && line.0 == 1));
        let lines: Vec<NumberedLine> = sample_lines(text).into_iter().filter(of_the_table).collect();
        refuse_too_many_columns(file, &lines)?;
        let candidates = declared.map_or(DELIMITERS.to_vec(), |(delimiter, _)| vec![delimiter]);
        let best = |least: f64, cells: usize| {
            let scored = candidates.iter().map(|&delimiter| {
                (delimiter_score(&parse_rows(&lines, delimiter), delimiter, (least, cells)), delimiter)
            });
            let best = scored.reduce(|best, next| if next.0 > best.0 + 1e-9 { next } else { best });
            best.filter(|best| best.0 > 0.0)
        };
        let found = best(MOSTLY_NUMBERS, 2)
            .or_else(|| best(FEW_NUMBERS, FEWEST_CELLS).filter(|(_, delimiter)| delimiter.separates_words()));
        let Some((_, delimiter)) = found else { return Err(no_columns_error(file, &lines)) };
        let rows = parse_rows(&lines, delimiter);
        if delimiter == Delimiter::Comma {
            refuse_double_comma(file, &rows)?;
        }
        let decimal = decimal_mark(&rows, delimiter);
        refuse_thousands(file, &rows, decimal)?;
        Ok(Self { delimiter, decimal })
    }
}

/// The first lines of a text that are not blank, and lines at even distances in the rest of the text.
fn sample_lines(text: &str) -> Vec<NumberedLine<'_>> {
    let mut lines: Vec<NumberedLine> = vec![];
    let (mut number, mut at) = (0, 0);
    for line in text.split_inclusive('\n') {
        if lines.len() == SAMPLE_LINES || at > SAMPLE_BYTES {
            break;
        }
        (number, at) = (number + 1, at + line.len());
        if !line.trim().is_empty() {
            lines.push((number, line.trim_end_matches(['\n', '\r'])));
        }
    }
    let bytes = text.as_bytes();
    let mean_line = at / lines.len().max(1) + 1;
    let of_the_rest = SAMPLE_LINES.min(SAMPLE_BYTES / mean_line + 1);
    let stride = text.len().saturating_sub(at) / of_the_rest + 1;
    let line_end = |from: usize| {
        bytes.get(from..).and_then(|rest| rest.iter().position(|b| *b == b'\n')).map(|end| from + end + 1)
    };
    while let Some(start) = line_end(at + stride) {
        number += count_lines(&bytes[at..start]);
        at = start;
        let line = text.get(start..).and_then(|rest| rest.lines().next()).unwrap_or_default();
        if !line.trim().is_empty() {
            lines.push((number + 1, line));
        }
    }
    lines
}

/// Refuses a table with too many columns before its rows are split into cells, which would fill the memory.
fn refuse_too_many_columns(file: &str, lines: &[NumberedLine]) -> ImportResult<()> {
    let columns = |text: &str, mark: u8| text.bytes().filter(|byte| *byte == mark).count() + 1;
    let most = |text: &str| {
        DELIMITERS.iter().filter_map(|delimiter| Some(columns(text, delimiter.byte()?))).max().unwrap_or(0)
    };
    match lines.iter().find(|(_, text)| text.len() >= MOST_COLUMNS && most(text) > MOST_COLUMNS) {
        Some((line, text)) => {
            let found = format!("a row of {} columns", most(text));
            let advice = "export the tracks of tip and head alone, with a row a frame";
            Err(ImportError::format(
                format!("{file}:{line}:1"),
                found,
                format!("at most {MOST_COLUMNS}"),
                advice,
            ))
        }
        None => Ok(()),
    }
}

/// Measures how well `delimiter` fits the rows: the fraction of cells that are numbers, summed over all rows
/// whose number of cells is the median. Rows with fewer than `cells` cells or a fraction of at most `least`
/// are left out, also for the median.
fn delimiter_score(rows: &[TextRow], delimiter: Delimiter, (least, cells): (f64, usize)) -> f64 {
    let measured = rows.iter().map(|row| (row.cells.len(), numeric_share(&row.cells, delimiter)));
    let numeric: Vec<(usize, f64)> =
        measured.filter(|(count, share)| *count >= cells && *share > least).collect();
    let mut counts: Vec<usize> = numeric.iter().map(|(count, _)| *count).collect();
    counts.sort_unstable();
    let usual = counts.get(counts.len() / 2).copied().unwrap_or(0);
    let always_empty = |i: usize| rows.iter().all(|row| row.cells.get(i).is_none_or(String::is_empty));
    if delimiter == Delimiter::Space && (1..usual.saturating_sub(1)).any(always_empty) {
        return 0.0; // (a column that is always empty: the spaces only align the columns)
    }
    numeric.iter().filter(|(count, _)| *count == usual).map(|(_, share)| share).sum()
}

/// Refuses a column in which the decimal mark separates thousands: `1,020` below `980`. Each mark stands
/// before groups of three digits, and the numbers go on more evenly without it.
fn refuse_thousands(file: &str, rows: &[TextRow], decimal: char) -> ImportResult<()> {
    /// Fewest numbers with such a mark.
    const FEWEST_MARKED: usize = 2;
    let width = rows.iter().map(|row| row.cells.len()).max().unwrap_or(0);
    for column in 0..width {
        let cells =
            rows.iter().map(|row| (row.line, row.cell(column))).filter(|(_, cell)| is_value(cell, decimal));
        let cells: Vec<(usize, &str)> = cells.collect();
        let marked = || cells.iter().filter(|(_, cell)| cell.contains(decimal));
        if marked().count() < FEWEST_MARKED || !marked().all(|(_, cell)| is_grouped(cell, decimal)) {
            continue;
        }
        let as_decimals = |cell: &str| parse_number(cell, decimal).value();
        let as_thousands = |cell: &str| parse_number(&cell.replace(decimal, ""), '.').value();
        let apart = |read: &dyn Fn(&str) -> Option<f64>, pair: &[(usize, &str)]| {
            Some((read(pair[1].1)? - read(pair[0].1)?).abs())
        };
        // (only where a number with the mark and one without it meet do the two ways of reading differ)
        let borders =
            cells.windows(2).filter(|pair| pair[0].1.contains(decimal) != pair[1].1.contains(decimal));
        let (mut fits_thousands, mut fits_decimals) = (0, 0);
        for pair in borders {
            let (Some(decimals), Some(thousands)) = (apart(&as_decimals, pair), apart(&as_thousands, pair))
            else {
                continue;
            };
            if thousands < decimals { fits_thousands += 1 } else { fits_decimals += 1 }
        }
        if fits_thousands > fits_decimals {
            let (line, cell) = *marked().next().unwrap_or(&cells[0]);
            let found = format!("`{cell}` in column {}, next to numbers without `{decimal}`", column + 1);
            let expected = format!("one meaning of `{decimal}`, which seems to separate thousands here");
            let advice = "export again without separators of thousands";
            return Err(ImportError::format(format!("{file}:{line}:1"), found, expected, advice));
        }
    }
    Ok(())
}

/// Whether a number consists of groups of three digits with `mark` between them, such as `-12,345,678`.
fn is_grouped(text: &str, mark: char) -> bool {
    let digits = |group: &str| group.chars().all(|c| c.is_ascii_digit());
    let mut groups = text.trim_start_matches(['+', '-', '\u{2212}']).split(mark);
    let first = groups
        .next()
        .is_some_and(|group| (1..=3).contains(&group.len()) && digits(group) && !group.starts_with('0'));
    let rest: Vec<&str> = groups.collect();
    first && !rest.is_empty() && rest.iter().all(|group| group.len() == 3 && digits(group))
}

/// Whether a cell is a number whose thousands are separated by blanks: `12 345.6`.
fn has_blank_thousands(cell: &str) -> bool {
    let whole = cell.split(['.', ',']).next().unwrap_or_default();
    [' ', '\u{a0}', '\u{202f}'].into_iter().any(|blank| is_grouped(whole, blank))
        && cell.chars().all(|c| c.is_ascii_digit() || " \u{a0}\u{202f}.,+-".contains(c))
}

/// Fraction of the cells of a row that are numbers; missing values are not counted. A number with blanks
/// between its thousands counts too: it is refused later, with its place.
fn numeric_share(cells: &[String], delimiter: Delimiter) -> f64 {
    let is_number = |text: &str| {
        is_value(text, '.')
            || (delimiter != Delimiter::Comma && is_value(text, ','))
            || has_blank_thousands(text)
    };
    let present: Vec<&String> =
        cells.iter().filter(|cell| parse_number(cell, '.') != CellNumber::Missing).collect();
    if present.is_empty() {
        0.0
    } else {
        present.iter().filter(|cell| is_number(cell)).count() as f64 / present.len() as f64
    }
}

fn is_value(text: &str, decimal: char) -> bool {
    parse_number(text, decimal).value().is_some()
}

/// The decimal mark that occurs in more of the numbers, point or comma. If the delimiter is a comma, it is
/// the point.
fn decimal_mark(rows: &[TextRow], delimiter: Delimiter) -> char {
    if delimiter == Delimiter::Comma {
        return '.';
    }
    let cells = || rows.iter().flat_map(|row| &row.cells);
    let numbers = |mark: char| cells().filter(|cell| cell.contains(mark) && is_value(cell, mark)).count();
    if numbers(',') > numbers('.') { ',' } else { '.' }
}

fn is_numeric(row: &&TextRow) -> bool {
    row.cells.first().is_some_and(|cell| is_value(cell, '.'))
}

/// Refuses rows in which the comma is both delimiter and decimal mark, such as `1,5,2,5` under a header of
/// two names.
fn refuse_double_comma(file: &str, rows: &[TextRow]) -> ImportResult<()> {
    let text = |cell: &String| cell.is_empty() || parse_number(cell, '.') != CellNumber::Missing;
    // (the first cell may be empty, because several programs give the column of row numbers no name)
    let is_word = |cell: &String| parse_number(cell, '.') == CellNumber::Text;
    let first = |row: &TextRow| row.cells.iter().find(|cell| !cell.is_empty()).is_some_and(is_word);
    let named = |row: &&TextRow| row.cells.iter().all(text) && first(row);
    let numeric: Vec<&TextRow> = rows.iter().filter(is_numeric).collect();
    let Some(header) = rows.iter().take_while(|row| !is_numeric(row)).filter(named).last() else {
        return refuse_split_numbers(file, &numeric);
    };
    let expected = header.used_width();
    let whole =
        |row: &TextRow| row.used_width() > expected && row.cells.iter().all(|cell| !cell.contains('.'));
    let long: Vec<&TextRow> = numeric.iter().copied().filter(|row| whole(row)).collect();
    match long.first() {
        Some(row) if 2 * long.len() > numeric.len() => {
            Err(double_comma_error(file, row, format!("under a header of {expected}")))
        }
        _ => Ok(()),
    }
}

/// Refuses rows such as `0,000,10,050` without a header. If only every second cell has leading zeros, these
/// cells are the digits after a decimal comma at which numbers were cut in two.
fn refuse_split_numbers(file: &str, rows: &[&TextRow]) -> ImportResult<()> {
    let fraction = |cell: &String| {
        cell.strip_prefix('0').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
    };
    let even = |row: &&&TextRow| {
        row.cells.len().is_multiple_of(2) && !row.cells.iter().any(|cell| cell.contains('.'))
    };
    let fits = |row: &&&TextRow| even(row) && !row.cells.iter().step_by(2).any(fraction);
    let shown = rows.iter().filter(|row| row.cells.iter().skip(1).step_by(2).any(fraction)).count();
    match rows.first() {
        Some(row) if ROWS_PER_FRACTION * shown > rows.len() && rows.iter().all(|row| fits(&row)) => {
            let instead = format!("that look like {} numbers cut in two", row.cells.len() / 2);
            Err(double_comma_error(file, row, instead))
        }
        _ => Ok(()),
    }
}

fn double_comma_error(file: &str, row: &TextRow, instead: String) -> ImportError {
    ImportError::format(
        format!("{file}:{}:1", row.line),
        format!("{} cells {instead}: the comma is both delimiter and decimal mark", row.cells.len()),
        "one use of it",
        "export again with a tab or semicolon as delimiter, or with decimal points",
    )
}

const POINT_EXPECTED: &str = "a decimal point where commas stand between the cells: the comma within may be a \
    decimal mark or separate thousands";
const POINT_ADVICE: &str = "export again with decimal points and without separators of thousands, or with semicolons \
    or tabs between the cells";
const COLUMNS_EXPECTED: &str = "columns separated by tabs, semicolons, commas or spaces";
const COLUMNS_ADVICE: &str = "export again with one of these delimiters, and without units or brackets next to the \
    numbers";

/// Error for a text that no delimiter splits into rows of numbers.
fn no_columns_error(file: &str, lines: &[NumberedLine]) -> ImportError {
    let starts_like_data = |line: &&NumberedLine| {
        line.1.trim_start_matches(['"', '-', '\u{2212}', ' ']).starts_with(|c: char| c.is_ascii_digit())
    };
    match (lines.iter().find(starts_like_data), lines.last()) {
        (Some((line, text)), _) => {
            let place = format!("{file}:{line}:1");
            if let Some(cell) = find_quoted_comma(text) {
                return ImportError::format(
                    place,
                    format!("`{cell}` in quotes"),
                    POINT_EXPECTED,
                    POINT_ADVICE,
                );
            }
            let found: String = text.trim().chars().take(60).collect();
            ImportError::format(place, format!("`{found}`"), COLUMNS_EXPECTED, COLUMNS_ADVICE)
        }
        (None, Some((line, _))) => ImportError::header_only(file, *line),
        (None, None) => ImportError::empty(file),
    }
}

/// Finds a number in quotation marks that contains a comma. This comma is a decimal mark or separates
/// thousands.
fn find_quoted_comma(line: &str) -> Option<String> {
    let is_number = |part: &&str| {
        part.contains(',')
            && (is_value(part, ',')
                || part.chars().all(|c| c.is_ascii_digit() || matches!(c, ',' | '.' | '-')))
    };
    let starts_number = |part: &&str| part.starts_with(|c: char| c.is_ascii_digit() || c == '-');
    line.split('"').skip(1).step_by(2).find(is_number).filter(starts_number).map(str::to_owned)
}

// Delimiters and comments.

/// What separates the cells of a row: one character, or a run of blanks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Delimiter {
    Tab,
    Semicolon,
    Comma,
    /// One space; two consecutive spaces enclose an empty cell.
    Space,
    /// Any run of spaces or tabs.
    Blanks,
}

/// The delimiters, in order of preference if several fit a file equally well. The comma comes after tab and
/// semicolon because it may be a decimal mark; spaces come last because they may only align columns.
pub(crate) const DELIMITERS: [Delimiter; 5] =
    [Delimiter::Tab, Delimiter::Semicolon, Delimiter::Comma, Delimiter::Space, Delimiter::Blanks];
/// Beginning of a first line such as `sep=;`, in which spreadsheets declare the delimiter.
const DELIMITER_DECLARATION: &str = "sep=";
/// Text of a cell that means a missing value, although it begins like a comment.
const NOT_COMMENT: &str = "#n/a";
/// Delimiters that end the first cell of a row; used if the row begins like a comment.
const CELL_ENDS: [char; 3] = [',', ';', '\t'];
/// Marks at the start of a line that make it a comment.
const COMMENTS: [&str; 4] = ["#", "//", "***", "%"];

/// Number of a line, counted from 1, and its text.
pub(crate) type NumberedLine<'a> = (usize, &'a str);

impl Delimiter {
    /// The delimiter as a byte; `None` for a run of blanks.
    pub(crate) fn byte(self) -> Option<u8> {
        match self {
            Self::Tab => Some(b'\t'),
            Self::Semicolon => Some(b';'),
            Self::Comma => Some(b','),
            Self::Space => Some(b' '),
            Self::Blanks => None,
        }
    }

    /// Whether the delimiter is a tab, semicolon or comma. The other delimiters are blanks, which also
    /// separate the words of a sentence.
    pub(crate) fn separates_words(self) -> bool {
        matches!(self, Self::Tab | Self::Semicolon | Self::Comma)
    }

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

/// Whether a line is a comment: it starts with `#`, `//`, `***` or `%`. A line that starts with `#N/A` is not
/// a comment. Nor is a line whose first cell a spreadsheet has damaged, such as `#####` or `#REF!`, if
/// numbers follow.
pub(crate) fn is_comment(line: &str) -> bool {
    if line.starts_with(|c: char| c.is_ascii_digit() || c == '-') {
        return false; // (nearly every line is a row of numbers)
    }
    let start = line.trim_start_matches([' ', '"']);
    let missing =
        || start.get(..NOT_COMMENT.len()).is_some_and(|word| word.eq_ignore_ascii_case(NOT_COMMENT));
    COMMENTS.iter().any(|mark| start.starts_with(mark)) && !missing() && !starts_with_damage(start)
}

/// Whether a line is a row of numbers whose first cell a spreadsheet has damaged.
fn starts_with_damage(line: &str) -> bool {
    line.split_once(CELL_ENDS).is_some_and(|(cell, rest)| {
        let cell = cell.trim_matches(['"', ' ']);
        (spreadsheet::is_hidden(cell) || spreadsheet::is_error(cell))
            && rest.contains(|c: char| c.is_ascii_digit())
    })
}

/// The delimiter that the first line declares (`sep=;`), and the length of that line in bytes; `None` if the
/// first line declares none.
pub(crate) fn declared_delimiter(text: &str) -> Option<(Delimiter, usize)> {
    let first = text.lines().next()?;
    let mark = first.trim_matches('"').strip_prefix(DELIMITER_DECLARATION)?.bytes().next()?;
    let delimiter = DELIMITERS.into_iter().find(|d| d.byte() == Some(mark))?;
    Some((delimiter, text.find('\n').map_or(text.len(), |end| end + 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dialect(text: &str) -> (Delimiter, char) {
        let found = Dialect::find("a.txt", text).unwrap();
        (found.delimiter, found.decimal)
    }

    #[test]
    fn dialects_are_found_by_consistency() {
        assert_eq!(dialect("t\tx\n0.0\t1.5\n0.1\t1.6\n"), (Delimiter::Tab, '.'));
        assert_eq!(dialect("t\tx\n0,0\t1,5\n0,1\t1,6\n"), (Delimiter::Tab, ','));
        assert_eq!(dialect("t;x\n0,0;1,5\n0,1;1,6\n"), (Delimiter::Semicolon, ','));
        assert_eq!(dialect("t, x\n0.0, 1.5\n0.1, 1.6\n"), (Delimiter::Comma, '.'));
        assert_eq!(dialect("t x\n0,0 1,5\n0,1 1,6\n"), (Delimiter::Space, ','));
        assert_eq!(dialect("t x y\n0.0  1\n0.1 2 1\n0.2 3 2\n"), (Delimiter::Space, '.'));
        assert_eq!(dialect("   t     x\n 0.0   1.5\n 0.1  11.6\n"), (Delimiter::Blanks, '.'));
        assert_eq!(dialect("sep=;\nt;x\n1;2\n3;4\n"), (Delimiter::Semicolon, '.'));
        assert_eq!(dialect("\"t\",\"a,b\"\n\"1\",\"2\"\n"), (Delimiter::Comma, '.'));
    }

    #[test]
    fn rows_that_are_mostly_words_are_rows_where_there_are_no_others() {
        assert_eq!(
            dialect("scorer,,,me,me\nlabeled-data,run,img1.png,1.5,2.5\nlabeled-data,run,img2.png,1.5,2.5\n"),
            (Delimiter::Comma, '.')
        );
        assert!(Dialect::find("a.txt", "found 3 points and 4 more in 5 pictures 6 7\n").is_err());
        assert!(Dialect::find("a.txt", "dear,reader,3\n").is_err());
    }

    #[test]
    fn the_rest_of_a_long_file_counts_as_much_as_its_start() {
        let whole = (0..2000).map(|i| format!("{i};1\n"));
        let fractions = (0..4000).map(|i| format!("{i};1,5\n"));
        assert_eq!(dialect(&whole.chain(fractions).collect::<String>()), (Delimiter::Semicolon, ','));
    }

    #[test]
    fn sampled_lines_keep_their_numbers() {
        let text: String = (1..=5000).map(|i| format!("line {i}\r\n")).collect();
        let lines = sample_lines(&text);
        assert!(lines.len() > SAMPLE_LINES + SAMPLE_LINES / 2, "{}", lines.len());
        assert!(lines.iter().all(|(number, line)| *line == format!("line {number}")));
    }

    #[test]
    fn refusals_name_the_place_and_the_remedy() {
        let says = |text: &str| Dialect::find("a.txt", text).unwrap_err().to_string();
        let unnamed = says(",y,frame\n0,1,5,0\n1,1,6,1\n");
        assert!(
            unnamed.starts_with(
                "a.txt:2:1: found 4 cells under a header of 3: the comma is both delimiter and decimal mark"
            ),
            "{unnamed}"
        );
        for (cell, line) in [("1,5", "\"1,5\",\"2,5\""), ("-1,234.5", "0,\"-1,234.5\",\"2,345.5\"")] {
            let quoted = says(&format!("x,y\n{line}\n{line}\n"));
            assert!(
                quoted.starts_with(&format!(
                    "a.txt:2:1: found `{cell}` in quotes, expected a decimal point where commas stand between"
                )),
                "{quoted}"
            );
        }
        assert_eq!(
            says("t|x\n0.0|1.5\n0.1|1.6\n"),
            "a.txt:2:1: found `0.0|1.5`, expected columns separated by tabs, semicolons, commas or spaces; \
             export again with one of these delimiters, and without units or brackets next to the numbers"
        );
        assert!(says("t,x\n0,0,1,5\n0,1,1,6\n").starts_with(
            "a.txt:2:1: found 4 cells under a header of 2: the comma is both delimiter and decimal mark"
        ));
        for halves in
            ["0,000,10,050\n0,001,10,150\n", "0,000000E+00,1,500000E+01\n1,000000E-03,1,600000E+01\n"]
        {
            assert!(
                says(halves).starts_with(
                    "a.txt:1:1: found 4 cells that look like 2 numbers cut in two: the comma is both"
                ),
                "{halves}"
            );
        }
        for whole in
            ["0,512,10,50\n1,513,10,50\n", "0001,512,300,40\n0002,513,300,40\n", "0.5,0,1\n1.5,00,1\n"]
        {
            assert_eq!(dialect(whole).0, Delimiter::Comma, "{whole}");
        }
        assert!(says("t\tx\ty\n\n").starts_with("a.txt:1:1: found no rows of numbers"));
    }
}
