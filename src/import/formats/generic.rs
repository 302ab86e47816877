//! Any plain table whose columns the user names or numbers.

mod other_clocks;

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::{COLUMN_KEYS, ColumnName, Columns, Options, ROW};
use crate::import::reader::{
    Document, Facts, Layout, Number, Order, PointCells, Row, Table, TimeUnit, TrackFile,
};
use crate::toml_file::nearest;

/// Seconds in a millisecond.
const MILLI: f64 = 1e-3;
/// Columns that number or time the rows, in the order in which they are trusted.
const CLOCKS: [&str; 3] = ["frame", "time", "time-ms"];

/// A plain table with `--columns`.
pub(crate) struct Generic;

impl Format for Generic {
    fn name(&self) -> &'static str {
        "generic"
    }

    /// Never from the content: a plain table means nothing before its columns are named.
    fn recognises(&self, _document: &Document) -> Option<String> {
        None
    }

    fn read<'a>(&self, document: &'a Document<'a>, options: &Options) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let columns = options.columns.as_ref().ok_or_else(|| unnamed(table))?;
        let named = Named::find(table, columns)?;
        let start = named.first_data_row(table)?;
        if let Some(header) = named.header.or(start.checked_sub(1)).and_then(|at| table.head.get(at)) {
            other_clocks::check(table, header, start, &named.columns)?;
        }
        let facts = Facts {
            time: if named.at("time-ms").is_some() { TimeUnit::Seconds(MILLI) } else { TimeUnit::Usual },
            ..Facts::default()
        };
        let mut export = named.layout(table, start).read(document, table, facts)?;
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
pub(crate) fn unnamed(table: &Table) -> ImportError {
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
struct Named {
    columns: Vec<(&'static str, usize)>,
    /// Row of the head that has the names.
    header: Option<usize>,
}

impl Named {
    /// Finds the named columns in the header row, which is the first row that has all of them.
    fn find(table: &Table, columns: &Columns) -> Result<Self, ImportError> {
        let used = columns
            .0
            .iter()
            .filter(|(key, column)| !(*key == "frame" && *column == ColumnName::Name(ROW.to_owned())));
        let used: Vec<&(&'static str, ColumnName)> = used.collect();
        let names: Vec<&str> = used
            .iter()
            .filter_map(
                |(_, column)| if let ColumnName::Name(name) = column { Some(name.as_str()) } else { None },
            )
            .collect();
        let has = |row: &Row, name: &str| row.cells.iter().any(|cell| cell == name);
        let header = if names.is_empty() {
            None
        } else {
            Some(
                table
                    .head
                    .iter()
                    .position(|row| names.iter().all(|name| has(row, name)))
                    .ok_or_else(|| no_such_column(table, &names))?,
            )
        };
        let position = |column: &ColumnName| match column {
            ColumnName::Number(number) => Ok(number - 1),
            ColumnName::Name(name) => Self::named(table, header.unwrap_or(0), name),
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

    fn named(table: &Table, header: usize, name: &str) -> Result<usize, ImportError> {
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
            _ => Err(no_such_column(table, &[name])),
        }
    }

    fn widest(&self) -> usize {
        self.columns.iter().map(|(_, at)| at + 1).max().unwrap_or(0)
    }

    fn check_width(&self, table: &Table) -> Result<(), ImportError> {
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
    fn check_distinct(&self, table: &Table) -> Result<(), ImportError> {
        let pairs = self.columns.iter().enumerate().flat_map(|(index, first)| {
            self.columns.iter().skip(index + 1).map(move |second| (first, second))
        });
        match pairs.into_iter().find(|(first, second)| first.1 == second.1 && !share(first.0, second.0)) {
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

    fn at(&self, key: &str) -> Option<usize> {
        self.columns.iter().find(|(known, _)| *known == key).map(|(_, at)| *at)
    }

    /// The column that numbers or times the rows; where every row is a frame, that of the first point.
    fn clock(&self) -> usize {
        let positions = ["tip-x", "head-x", "x"];
        CLOCKS.iter().chain(&positions).find_map(|key| self.at(key)).unwrap_or(0)
    }

    /// The first row below the header whose clock is a number; a row above it that holds positions is damage,
    /// not a header.
    fn first_data_row(&self, table: &Table) -> Result<usize, ImportError> {
        let from = self.header.map_or(0, |header| header + 1);
        let number =
            |row: &Row, at: usize| row.cells.get(at).map_or(Number::Missing, |cell| table.number(cell));
        for (index, row) in table.head.iter().enumerate().skip(from) {
            match number(row, self.clock()) {
                Number::Value(_) => return Ok(index),
                _ if self.is_row_of_numbers(number, row) => {
                    let cell = row.cells.get(self.clock()).map_or("", String::as_str);
                    return Err(table.not_a_number(row.line, self.clock(), cell, self.key_of(self.clock())));
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
    fn is_row_of_numbers(&self, number: impl Fn(&Row, usize) -> Number, row: &Row) -> bool {
        let others = self.columns.iter().filter(|(key, at)| *key != "track" && *at != self.clock());
        let found: Vec<Number> = others.map(|(_, at)| number(row, *at)).collect();
        found.iter().any(|found| matches!(found, Number::Value(_))) && !found.contains(&Number::Text)
    }

    fn key_of(&self, at: usize) -> &'static str {
        self.columns.iter().find(|(_, known)| *known == at).map_or(COLUMN_KEYS[0], |(key, _)| key)
    }

    fn layout(&self, table: &Table, start: usize) -> Layout {
        let widest = self.widest();
        let filled = table.head.get(start).map_or(0, Row::filled).max(widest);
        let header = self.header.and_then(|header| table.head.get(header)).map_or(0, |row| row.cells.len());
        let point = |name: &str, [x, y, confidence]: [&str; 3]| {
            let confidence = self.at(confidence);
            self.at(x).map(|x| PointCells { confidence, ..PointCells::new(name, x, self.at(y)) })
        };
        let named = [
            point("tip", ["tip-x", "tip-y", "tip-confidence"]),
            point("head", ["head-x", "head-y", "head-confidence"]),
        ];
        let listed = point(if self.at("track").is_some() { "" } else { "point" }, ["x", "y", "confidence"]);
        Layout {
            start,
            width: widest,
            most: filled.max(header),
            frame: self.at("frame"),
            time: self.at("time").or(self.at("time-ms")),
            key: self.at("track").into_iter().collect(),
            skip_nameless: true,
            order: if self.at("track").is_some() { Order::Any } else { Order::AsWritten },
            points: named.into_iter().chain([listed]).flatten().collect(),
            ..Layout::default()
        }
    }
}

/// Whether two keys may name one column: some trackers give one confidence for all points of a frame.
fn share(first: &str, second: &str) -> bool {
    first.ends_with("confidence") && second.ends_with("confidence")
}

/// The refusal of names that no row has together: the row that has most of them is taken for the header.
fn no_such_column(table: &Table, names: &[&str]) -> ImportError {
    let hits = |row: &Row| names.iter().filter(|name| row.cells.iter().any(|cell| cell == **name)).count();
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
            nearest(missing.first().unwrap_or(&""), &header).replace("known keys here", "name one of these")
        ),
    )
}
