//! Any plain table whose columns the user names or numbers.

use super::FileFormat;
use crate::import::error::ImportError;
use crate::import::options::{COLUMN_KEYS, ColumnMap, ColumnName, ImportOptions, ROW_COLUMN};
use crate::import::reader::layout::{ClockCell, find_clock_difference};
use crate::import::reader::{
    CellNumber, DelimitedTable, Document, Facts, PointCells, RowOrder, TableLayout, TextRow, TimeUnit,
    TrackFile,
};
use crate::toml_file::suggest_key;

/// Seconds in a millisecond.
const MILLI: f64 = 1e-3;
/// Columns that number or time the rows, in the order in which they are trusted.
const CLOCKS: [&str; 3] = ["frame", "time", "time-ms"];

/// A plain table with `--columns`.
pub(crate) struct GenericFormat;

impl FileFormat for GenericFormat {
    fn name(&self) -> &'static str {
        "generic"
    }

    /// Never from the content: a plain table means nothing before its columns are named.
    fn recognises(&self, _document: &Document) -> Option<String> {
        None
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let columns = options.columns.as_ref().ok_or_else(|| unnamed_columns_error(table))?;
        let named = ColumnPositions::find(table, columns)?;
        let start = named.first_data_row(table)?;
        if let Some(header) = named.header.or(start.checked_sub(1)).and_then(|at| table.head.get(at)) {
            check_unused_clocks(table, header, start, &named.columns)?;
        }
        let facts = Facts {
            time: if named.column_of("time-ms").is_some() {
                TimeUnit::Seconds(MILLI)
            } else {
                TimeUnit::AssumedSeconds
            },
            ..Facts::default()
        };
        let mut export = named.table_layout(table, start).read_tracks(document, table, facts)?;
        if let Some(row) = table.head.get(start).filter(|_| start > 0) {
            let with = named.header.map_or("", |_| ", with the named columns");
            export
                .notes
                .push(format!("the data start at line {}; header rows above: {start}{with}", row.line));
        }
        Ok(export)
    }
}

/// Most cells of a row that a refusal shows.
const MOST_SHOWN: usize = 16;
/// Most characters of a cell that it shows.
const LONGEST_SHOWN: usize = 24;

/// The refusal of a table whose columns nobody names: its first row with the numbers to name them by.
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
    ImportError::columns(
        table.file,
        first.map_or(1, |row| row.line),
        format!(
            "found a plain table that starts with `{}`, expected --columns to say what its columns are",
            cells.join(" | ")
        ),
        "name or number them (from 1): --columns time=A,tip-x=B,tip-y=C,head-x=D,head-y=E with names or numbers \
         for A to E",
    )
}

/// 0-based positions of the columns that are used, with their keys.
struct ColumnPositions {
    columns: Vec<(&'static str, usize)>,
    /// Row of the head that has the names.
    header: Option<usize>,
}

impl ColumnPositions {
    /// Finds the named columns in the header row, which is the first row that has all of them.
    fn find(table: &DelimitedTable, columns: &ColumnMap) -> Result<Self, ImportError> {
        let used = columns
            .0
            .iter()
            .filter(|(key, column)| !(*key == "frame" && *column == ColumnName::Name(ROW_COLUMN.to_owned())));
        let used: Vec<&(&'static str, ColumnName)> = used.collect();
        let names: Vec<&str> = used
            .iter()
            .filter_map(
                |(_, column)| if let ColumnName::Name(name) = column { Some(name.as_str()) } else { None },
            )
            .collect();
        let has = |row: &TextRow, name: &str| row.cells.iter().any(|cell| cell == name);
        let header = if names.is_empty() {
            None
        } else {
            Some(
                table
                    .head
                    .iter()
                    .position(|row| names.iter().all(|name| has(row, name)))
                    .ok_or_else(|| no_such_column_error(table, &names))?,
            )
        };
        let position = |column: &ColumnName| match column {
            ColumnName::Number(number) => Ok(number - 1),
            ColumnName::Name(name) => Self::find_column(table, header.unwrap_or(0), name),
        };
        let columns = used
            .iter()
            .map(|(key, column)| Ok((*key, position(column)?)))
            .collect::<Result<Vec<_>, ImportError>>()?;
        let named = Self { columns, header };
        named.check_width(table)?;
        named.check_distinct(table)?;
        Ok(named)
    }

    fn find_column(table: &DelimitedTable, header: usize, name: &str) -> Result<usize, ImportError> {
        let row = &table.head[header];
        let mut at = row.cells.iter().enumerate().filter(|(_, cell)| *cell == name).map(|(index, _)| index);
        match (at.next(), at.next()) {
            (Some(first), None) => Ok(first),
            (Some(first), Some(second)) => Err(ImportError::columns(
                table.file,
                row.line,
                format!(
                    "found the column name `{name}` at {} and {}, expected it once",
                    first + 1,
                    second + 1
                ),
                "give the number of the column instead of its name",
            )),
            _ => Err(no_such_column_error(table, &[name])),
        }
    }

    fn min_row_width(&self) -> usize {
        self.columns.iter().map(|(_, at)| at + 1).max().unwrap_or(0)
    }

    fn check_width(&self, table: &DelimitedTable) -> Result<(), ImportError> {
        let cells = table.head.iter().map(|row| row.cells.len()).max().unwrap_or(0);
        match self.columns.iter().find(|(_, at)| *at >= cells) {
            None => Ok(()),
            Some((key, at)) => Err(ImportError::columns(
                table.file,
                table.head.first().map_or(1, |row| row.line),
                format!(
                    "--columns {key}={}: found a table of {cells} columns (delimiter: {}), expected at least \
                     {}",
                    at + 1,
                    table.dialect.delimiter.word(),
                    at + 1
                ),
                "correct the column number; columns count from 1",
            )),
        }
    }

    /// A column is one thing: the same numbers for two of them make a motion that nobody measured.
    fn check_distinct(&self, table: &DelimitedTable) -> Result<(), ImportError> {
        let pairs = self.columns.iter().enumerate().flat_map(|(index, first)| {
            self.columns.iter().skip(index + 1).map(move |second| (first, second))
        });
        match pairs
            .into_iter()
            .find(|(first, second)| first.1 == second.1 && !may_share_column(first.0, second.0))
        {
            None => Ok(()),
            Some((first, second)) => Err(ImportError::columns(
                table.file,
                self.header.and_then(|header| table.head.get(header)).map_or(1, |row| row.line),
                format!(
                    "--columns {}={number} and {}={number}: found one column for both, expected a column of \
                     its own for each",
                    first.0,
                    second.0,
                    number = first.1 + 1
                ),
                "correct one of the two, or leave out what the table does not have",
            )),
        }
    }

    fn column_of(&self, key: &str) -> Option<usize> {
        self.columns.iter().find(|(known, _)| *known == key).map(|(_, at)| *at)
    }

    /// The column that numbers or times the rows; where every row is a frame, that of the first point.
    fn clock_column(&self) -> usize {
        let positions = ["tip-x", "head-x", "x"];
        CLOCKS.iter().chain(&positions).find_map(|key| self.column_of(key)).unwrap_or(0)
    }

    /// The first row below the header whose clock is a number; a row above it that holds positions is damage,
    /// not a header.
    fn first_data_row(&self, table: &DelimitedTable) -> Result<usize, ImportError> {
        let from = self.header.map_or(0, |header| header + 1);
        let number = |row: &TextRow, at: usize| {
            row.cells.get(at).map_or(CellNumber::Missing, |cell| table.parse_cell(cell))
        };
        for (index, row) in table.head.iter().enumerate().skip(from) {
            match number(row, self.clock_column()) {
                CellNumber::Value(_) => return Ok(index),
                _ if self.is_row_of_numbers(number, row) => {
                    let cell = row.cells.get(self.clock_column()).map_or("", String::as_str);
                    return Err(table.not_a_number_error(
                        row.line,
                        self.clock_column(),
                        cell,
                        self.key_of_column(self.clock_column()),
                    ));
                }
                _ => {}
            }
        }
        Err(ImportError::HeaderOnly {
            file: table.file.to_owned(),
            line: table.head.last().map_or(1, |row| row.line),
        })
    }

    /// Whether the named cells next to the clock hold nothing but numbers; lines of settings above a table
    /// hold some.
    fn is_row_of_numbers(&self, number: impl Fn(&TextRow, usize) -> CellNumber, row: &TextRow) -> bool {
        let others = self.columns.iter().filter(|(key, at)| *key != "track" && *at != self.clock_column());
        let found: Vec<CellNumber> = others.map(|(_, at)| number(row, *at)).collect();
        found.iter().any(|found| matches!(found, CellNumber::Value(_))) && !found.contains(&CellNumber::Text)
    }

    fn key_of_column(&self, at: usize) -> &'static str {
        self.columns.iter().find(|(_, known)| *known == at).map_or(COLUMN_KEYS[0], |(key, _)| key)
    }

    fn table_layout(&self, table: &DelimitedTable, start: usize) -> TableLayout {
        let widest = self.min_row_width();
        let filled = table.head.get(start).map_or(0, TextRow::used_width).max(widest);
        let header = self.header.and_then(|header| table.head.get(header)).map_or(0, |row| row.cells.len());
        let point = |name: &str, [x, y, confidence]: [&str; 3]| {
            let confidence = self.column_of(confidence);
            self.column_of(x)
                .map(|x| PointCells { confidence, ..PointCells::new(name, x, self.column_of(y)) })
        };
        let named = [
            point("tip", ["tip-x", "tip-y", "tip-confidence"]),
            point("head", ["head-x", "head-y", "head-confidence"]),
        ];
        let listed =
            point(if self.column_of("track").is_some() { "" } else { "point" }, ["x", "y", "confidence"]);
        TableLayout {
            start,
            width: widest,
            most: filled.max(header),
            frame: self.column_of("frame"),
            time: self.column_of("time").or(self.column_of("time-ms")),
            key: self.column_of("track").into_iter().collect(),
            skip_nameless: true,
            order: if self.column_of("track").is_some() { RowOrder::Any } else { RowOrder::AsWritten },
            points: named.into_iter().chain([listed]).flatten().collect(),
            ..TableLayout::default()
        }
    }
}

/// Whether two keys may name one column: some trackers give one confidence for all points of a frame.
fn may_share_column(first: &str, second: &str) -> bool {
    first.ends_with("confidence") && second.ends_with("confidence")
}

/// The refusal of names that no row has together: the row that has most of them is taken for the header.
fn no_such_column_error(table: &DelimitedTable, names: &[&str]) -> ImportError {
    let hits =
        |row: &TextRow| names.iter().filter(|name| row.cells.iter().any(|cell| cell == **name)).count();
    let best = table
        .head
        .iter()
        .enumerate()
        .max_by_key(|(index, row)| (hits(row), usize::MAX - index))
        .map(|(_, row)| row);
    let header: Vec<&str> =
        best.map(|row| row.texts().into_iter().filter(|text| !text.is_empty()).collect()).unwrap_or_default();
    let missing: Vec<&str> = names.iter().copied().filter(|name| !header.contains(name)).collect();
    ImportError::columns(
        table.file,
        best.map_or(1, |row| row.line),
        format!("found the columns {}, expected also `{}`", header.join(", "), missing.join("`, `")),
        format!(
            "{} or give the number of the column",
            suggest_key(missing.first().unwrap_or(&""), &header)
                .replace("known keys here", "name one of these")
        ),
    )
}

// Clocks in a table that `--columns` passes over or takes for positions.

/// Words with which the name of a clock ends, and units that may follow them.
const TIME_WORDS: [&str; 2] = ["t", "time"];
const FRAME_WORDS: [&str; 2] = ["frame", "frames"];
const TIME_UNIT_WORDS: [&str; 4] = ["s", "sec", "seconds", MILLISECONDS];
const MILLISECONDS: &str = "ms";

/// What a column counts by its name.
#[derive(Clone, Copy, PartialEq)]
enum ClockKind {
    Frames,
    /// Times, and how many seconds one of their units is.
    Times(f64),
}

/// Refuses a position whose column is named as a clock, and a second clock before the columns of a point that
/// says another time than the named one.
///
/// # Errors
/// [`ImportError`] naming the column and the row.
pub(super) fn check_unused_clocks(
    table: &DelimitedTable,
    header: &TextRow,
    start: usize,
    columns: &[(&'static str, usize)],
) -> Result<(), ImportError> {
    let name = |at: usize| header.cells.get(at).map_or("", String::as_str);
    let positions = columns.iter().filter(|(key, _)| key.ends_with('x') || key.ends_with('y'));
    for (key, at) in positions {
        if clock_kind(name(*at)).is_some() {
            return Err(ImportError::columns(
                table.file,
                header.line,
                format!("--columns {key}={}: found the clock `{}`, expected a position", at + 1, name(*at)),
                "correct the column number; columns count from 1",
            ));
        }
        let Some(before) = at.checked_sub(1).filter(|before| columns.iter().all(|(_, used)| used != before))
        else {
            continue;
        };
        compare_clock(table, header.line, start, columns, (before, name(before)))?;
    }
    Ok(())
}

/// Compares a clock that is passed over with the named one.
fn compare_clock(
    table: &DelimitedTable,
    line: usize,
    start: usize,
    columns: &[(&'static str, usize)],
    (other, name): (usize, &str),
) -> Result<(), ImportError> {
    let Some((used, unit, other_unit)) =
        columns.iter().find_map(|(key, at)| match (*key, clock_kind(name)?) {
            ("frame", ClockKind::Frames) => Some((*at, 1.0, 1.0)),
            ("time", ClockKind::Times(other)) => Some((*at, 1.0, other)),
            ("time-ms", ClockKind::Times(other)) => Some((*at, 1e-3, other)),
            _ => None,
        })
    else {
        return Ok(());
    };
    let (first, second) = (ClockCell { cell: used, unit }, ClockCell { cell: other, unit: other_unit });
    let Some(found) = find_clock_difference(table, start, first, second)? else { return Ok(()) };
    let [one, two] = found.texts;
    Err(ImportError::columns(
        table.file,
        line,
        format!(
            "column {} `{name}` is a clock of its own: in line {} it says `{two}` where column {} says `{one}`; \
             expected one clock for all points",
            other + 1,
            found.line,
            used + 1
        ),
        "leave --columns out where the format reads a clock for each track, or export the tracks with one clock",
    ))
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
