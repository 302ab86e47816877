//! Plain tables whose columns the user names or numbers with `--columns`.

use crate::import::error::{ImportError, ImportResult};
use crate::import::format::FileFormat;
use crate::import::options::{COLUMN_KEYS, ColumnMap, ColumnName, ImportOptions, ROW_COLUMN};
use crate::import::reader::layout::{ClockCell, find_clock_difference};
use crate::import::reader::{
    CellNumber, DelimitedTable, Document, Facts, PointCells, RowOrder, TableLayout, TextRow, TimeUnit,
    TrackFile,
};
use crate::toml_file::suggest_key;

/// Keys of clocks, in order of preference.
const CLOCKS: [&str; 3] = ["frame", "time", "time-ms"];

pub(crate) struct GenericFormat;

impl FileFormat for GenericFormat {
    fn name(&self) -> &'static str {
        "generic"
    }

    /// Never recognises a table: without `--columns` nothing gives the columns a meaning.
    fn recognises(&self, _document: &Document) -> Option<String> {
        None
    }

    fn read<'a>(&self, document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        let columns = options.columns.as_ref().ok_or_else(|| unnamed_columns_error(table))?;
        let named = ColumnPositions::find(table, columns)?;
        let start = named.first_data_row(table)?;
        if let Some(header) = named.header.or(start.checked_sub(1)).and_then(|at| table.head.get(at)) {
            check_unused_clocks(table, header, start, &named.columns)?;
        }
        let time = named.column_of("time-ms").map_or(TimeUnit::AssumedSeconds, |_| TimeUnit::Seconds(1e-3));
        let facts = Facts { time, ..Facts::default() };
        let mut export = named.table_layout(table, start).read_tracks(document, table, facts)?;
        if let Some(row) = table.head.get(start).filter(|_| start > 0) {
            let (line, with) = (row.line, named.header.map_or("", |_| ", with the named columns"));
            export.notes.push(format!("the data start at line {line}; header rows above: {start}{with}"));
        }
        Ok(export)
    }
}

const NUMBER_ADVICE: &str = "correct the column number; columns count from 1";
/// Maximum number of cells of a row in an error message.
const MOST_SHOWN: usize = 16;
/// Maximum number of characters of such a cell.
const LONGEST_SHOWN: usize = 24;

/// Error for a table whose columns are not named; it shows the first row, with the numbers of the columns.
pub(crate) fn unnamed_columns_error(table: &DelimitedTable) -> ImportError {
    let first = table.head.first();
    let shown = |(at, cell): (usize, &String)| {
        format!("{}: {}", at + 1, cell.chars().take(LONGEST_SHOWN).collect::<String>())
    };
    let mut cells: Vec<String> =
        first.iter().flat_map(|row| &row.cells).take(MOST_SHOWN).enumerate().map(shown).collect();
    if first.is_some_and(|row| row.cells.len() > MOST_SHOWN) {
        cells.push("...".to_owned());
    }
    let problem = format!(
        "found a plain table that starts with `{}`, expected --columns to say what its columns are",
        cells.join(" | ")
    );
    let advice = "name or number them (from 1): --columns time=A,tip-x=B,tip-y=C,head-x=D,head-y=E with names or \
        numbers for A to E";
    ImportError::columns(table.file, table.first_line(), problem, advice)
}

/// Columns, counted from 0, with their keys.
struct ColumnPositions {
    columns: Vec<(&'static str, usize)>,
    /// Index of the row with the names in the head of the table.
    header: Option<usize>,
}

impl ColumnPositions {
    /// Finds the named columns in the header row, which is the first row that has all of them.
    fn find(table: &DelimitedTable, columns: &ColumnMap) -> ImportResult<Self> {
        let every_row = ("frame", ColumnName::Name(ROW_COLUMN.to_owned()));
        let used = || columns.0.iter().filter(|column| **column != every_row);
        let names: Vec<&str> = used()
            .filter_map(|(_, column)| match column {
                ColumnName::Name(name) => Some(name.as_str()),
                ColumnName::Number(_) => None,
            })
            .collect();
        let header = table.head.iter().position(|row| names.iter().all(|name| row.has(name)));
        if header.is_none() && !names.is_empty() {
            return Err(no_such_column_error(table, &names));
        }
        let header = header.filter(|_| !names.is_empty());
        let position = |column: &ColumnName| match column {
            ColumnName::Number(number) => Ok(number - 1),
            ColumnName::Name(name) => Self::find_column(table, header.unwrap_or(0), name),
        };
        let columns =
            used().map(|(key, column)| Ok((*key, position(column)?))).collect::<ImportResult<Vec<_>>>()?;
        let named = Self { columns, header };
        named.check_width(table)?;
        named.check_distinct(table)?;
        Ok(named)
    }

    fn find_column(table: &DelimitedTable, header: usize, name: &str) -> ImportResult<usize> {
        let row = &table.head[header];
        let mut at = row.cells.iter().enumerate().filter(|(_, cell)| *cell == name).map(|(index, _)| index);
        match (at.next(), at.next()) {
            (Some(first), None) => Ok(first),
            (Some(first), Some(second)) => {
                let (first, second) = (first + 1, second + 1);
                let problem =
                    format!("found the column name `{name}` at {first} and {second}, expected it once");
                let advice = "give the number of the column instead of its name";
                Err(ImportError::columns(table.file, row.line, problem, advice))
            }
            _ => Err(no_such_column_error(table, &[name])),
        }
    }

    fn check_width(&self, table: &DelimitedTable) -> ImportResult<()> {
        let cells = table.head.iter().map(|row| row.cells.len()).max().unwrap_or(0);
        let Some((key, at)) = self.columns.iter().find(|(_, at)| *at >= cells) else { return Ok(()) };
        let problem = format!(
            "--columns {key}={number}: found a table of {cells} columns (delimiter: {}), expected at least {number}",
            table.dialect.delimiter.word(),
            number = at + 1
        );
        Err(ImportError::columns(table.file, table.first_line(), problem, NUMBER_ADVICE))
    }

    /// Refuses a column that is used for two keys.
    fn check_distinct(&self, table: &DelimitedTable) -> ImportResult<()> {
        let pairs = self.columns.iter().enumerate().flat_map(|(index, first)| {
            self.columns.iter().skip(index + 1).map(move |second| (first, second))
        });
        // (some trackers give one confidence for all points of a frame)
        let may_share = |keys: [&str; 2]| keys.iter().all(|key| key.ends_with("confidence"));
        let same =
            pairs.into_iter().find(|(first, second)| first.1 == second.1 && !may_share([first.0, second.0]));
        let Some(((first, at), (second, _))) = same else { return Ok(()) };
        let problem = format!(
            "--columns {first}={number} and {second}={number}: found one column for both, expected a column of its \
             own for each",
            number = at + 1
        );
        let line = self.header.and_then(|header| table.head.get(header)).map_or(1, |row| row.line);
        let advice = "correct one of the two, or leave out what the table does not have";
        Err(ImportError::columns(table.file, line, problem, advice))
    }

    fn column_of(&self, key: &str) -> Option<usize> {
        self.columns.iter().find(|(known, _)| *known == key).map(|(_, at)| *at)
    }

    /// The column of the clock; if every row is a frame, the first column of a point.
    fn clock_column(&self) -> usize {
        let positions = ["tip-x", "head-x", "x"];
        CLOCKS.iter().chain(&positions).find_map(|key| self.column_of(key)).unwrap_or(0)
    }

    /// Index of the first row below the header whose clock is a number. A row before it that contains
    /// positions is damaged, and is refused.
    fn first_data_row(&self, table: &DelimitedTable) -> ImportResult<usize> {
        let from = self.header.map_or(0, |header| header + 1);
        let number = |row: &TextRow, at: usize| {
            row.cells.get(at).map_or(CellNumber::Missing, |cell| table.parse_cell(cell))
        };
        let clock = self.clock_column();
        for (index, row) in table.head.iter().enumerate().skip(from) {
            match number(row, clock) {
                CellNumber::Value(_) => return Ok(index),
                _ if self.is_row_of_numbers(number, row) => {
                    let key = self.columns.iter().find(|(_, known)| *known == clock);
                    let key = key.map_or(COLUMN_KEYS[0], |(key, _)| key);
                    return Err(table.not_a_number_error(row.line, clock, row.cell(clock), key));
                }
                _ => {}
            }
        }
        Err(ImportError::header_only(table.file, table.head.last().map_or(1, |row| row.line)))
    }

    /// Whether the used cells, except clock and track, are numbers or empty, with at least one number. Lines
    /// of settings above a table also contain text.
    fn is_row_of_numbers(&self, number: impl Fn(&TextRow, usize) -> CellNumber, row: &TextRow) -> bool {
        let others = self.columns.iter().filter(|(key, at)| *key != "track" && *at != self.clock_column());
        let found: Vec<CellNumber> = others.map(|(_, at)| number(row, *at)).collect();
        found.iter().any(|found| matches!(found, CellNumber::Value(_))) && !found.contains(&CellNumber::Text)
    }

    fn table_layout(&self, table: &DelimitedTable, start: usize) -> TableLayout {
        let widest = self.columns.iter().map(|(_, at)| at + 1).max().unwrap_or(0);
        let filled = table.head.get(start).map_or(0, TextRow::used_width).max(widest);
        let header = self.header.and_then(|header| table.head.get(header)).map_or(0, |row| row.cells.len());
        let point = |name: &str, [x, y, confidence]: [&str; 3]| {
            let cells = self.column_of(x).map(|x| PointCells::new(name, x, self.column_of(y)));
            cells.map(|cells| PointCells { confidence: self.column_of(confidence), ..cells })
        };
        let track = self.column_of("track");
        let points = [
            point("tip", ["tip-x", "tip-y", "tip-confidence"]),
            point("head", ["head-x", "head-y", "head-confidence"]),
            point(if track.is_some() { "" } else { "point" }, ["x", "y", "confidence"]),
        ];
        TableLayout {
            start,
            width: widest,
            most: filled.max(header),
            frame: self.column_of("frame"),
            time: self.column_of("time").or(self.column_of("time-ms")),
            key: track.into_iter().collect(),
            skip_nameless: true,
            order: if track.is_some() { RowOrder::Any } else { RowOrder::AsWritten },
            points: points.into_iter().flatten().collect(),
            ..TableLayout::default()
        }
    }
}

/// Error for names of columns that no single row contains; it shows the row that contains most of them.
fn no_such_column_error(table: &DelimitedTable, names: &[&str]) -> ImportError {
    let hits = |row: &TextRow| names.iter().filter(|name| row.has(name)).count();
    // (reversed, because `max_by_key` returns the last of equal rows)
    let best = table.head.iter().rev().max_by_key(|row| hits(row));
    let header: Vec<&str> =
        best.map(|row| row.texts().into_iter().filter(|text| !text.is_empty()).collect()).unwrap_or_default();
    let missing: Vec<&str> = names.iter().copied().filter(|name| !header.contains(name)).collect();
    let problem =
        format!("found the columns {}, expected also `{}`", header.join(", "), missing.join("`, `"));
    let nearest = suggest_key(missing.first().unwrap_or(&""), &header);
    let advice =
        nearest.replace("known keys here", "name one of these") + " or give the number of the column";
    ImportError::columns(table.file, best.map_or(1, |row| row.line), problem, advice)
}

// Clocks that `--columns` leaves unused or mistakes for positions.

/// Words at the end of the name of a clock; a unit may follow.
const TIME_WORDS: [&str; 2] = ["t", "time"];
const FRAME_WORDS: [&str; 2] = ["frame", "frames"];
const TIME_UNIT_WORDS: [&str; 4] = ["s", "sec", "seconds", MILLISECONDS];
const MILLISECONDS: &str = "ms";

#[derive(Clone, Copy, PartialEq)]
enum ClockKind {
    Frames,
    /// Times, with their unit in seconds.
    Times(f64),
}

/// Refuses a position whose column is named like a clock. Also refuses an unused clock directly before a
/// column of a point if it differs from the named clock.
///
/// # Errors
/// [`ImportError`] naming the column and the row.
pub(super) fn check_unused_clocks(
    table: &DelimitedTable,
    header: &TextRow,
    start: usize,
    columns: &[(&'static str, usize)],
) -> ImportResult<()> {
    let name = |at: usize| header.cell(at);
    let positions = columns.iter().filter(|(key, _)| key.ends_with('x') || key.ends_with('y'));
    for (key, at) in positions {
        if clock_kind(name(*at)).is_some() {
            let (number, name) = (at + 1, name(*at));
            let problem = format!("--columns {key}={number}: found the clock `{name}`, expected a position");
            return Err(ImportError::columns(table.file, header.line, problem, NUMBER_ADVICE));
        }
        let unused = |before: &usize| columns.iter().all(|(_, used)| used != before);
        if let Some(before) = at.checked_sub(1).filter(unused) {
            compare_clock(table, header.line, start, columns, (before, name(before)))?;
        }
    }
    Ok(())
}

/// Refuses the unused clock `other` if it differs from the named clock.
fn compare_clock(
    table: &DelimitedTable,
    line: usize,
    start: usize,
    columns: &[(&'static str, usize)],
    (other, name): (usize, &str),
) -> ImportResult<()> {
    let clocks = columns.iter().find_map(|(key, at)| match (*key, clock_kind(name)?) {
        ("frame", ClockKind::Frames) => Some((*at, 1.0, 1.0)),
        ("time", ClockKind::Times(other)) => Some((*at, 1.0, other)),
        ("time-ms", ClockKind::Times(other)) => Some((*at, 1e-3, other)),
        _ => None,
    });
    let Some((used, unit, other_unit)) = clocks else { return Ok(()) };
    let (first, second) = (ClockCell { cell: used, unit }, ClockCell { cell: other, unit: other_unit });
    let Some(found) = find_clock_difference(table, start, first, second)? else { return Ok(()) };
    let [one, two] = found.texts;
    let problem = format!(
        "column {} `{name}` is a clock of its own: in line {} it says `{two}` where column {} says `{one}`; \
         expected one clock for all points",
        other + 1,
        found.line,
        used + 1
    );
    let advice = "leave --columns out where the format reads a clock for each track, or export the tracks with one clock";
    Err(ImportError::columns(table.file, line, problem, advice))
}

fn clock_kind(name: &str) -> Option<ClockKind> {
    let lower = name.to_lowercase();
    let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
    let last = words.iter().rfind(|word| !TIME_UNIT_WORDS.contains(word))?;
    let unit = if words.contains(&MILLISECONDS) { 1e-3 } else { 1.0 };
    match last {
        last if TIME_WORDS.contains(last) => Some(ClockKind::Times(unit)),
        last if FRAME_WORDS.contains(last) => Some(ClockKind::Frames),
        _ => None,
    }
}
