//! The meaning of the columns of a plain table, from its header or from `--columns`.

use super::TableColumns;
use crate::import::format::*;
use crate::import::options::{ColumnMap, ColumnName, ROW_COLUMN};
use crate::import::reader::layout::ClockDifference;
use crate::toml_file::suggest_key;

/// Number of rows at the top of a table that are searched for the column names.
const HEADER_ROWS: usize = 48;
/// If at least this number of rows of numbers is directly above a row of words, the words are not the header.
const DATA_ABOVE: usize = 3;
/// Keys of `--columns` for each point: x, y and confidence.
const POINT_KEYS: [(&str, [&str; 3]); 3] = [
    ("tip", ["tip-x", "tip-y", "tip-confidence"]),
    ("head", ["head-x", "head-y", "head-confidence"]),
    ("", ["x", "y", "confidence"]),
];
const ADVICE: &str = "say which columns are meant by their numbers (from 1): --columns frame=A,tip-x=B,tip-y=C,head-x=D,head-y=E \
     with numbers for A to E";
const NUMBER_ADVICE: &str = "correct the column number; columns count from 1";
/// Maximum number of cells of a row that an error message shows.
const MOST_SHOWN: usize = 16;
/// Maximum number of characters of a cell that an error message shows.
const LONGEST_SHOWN: usize = 24;

// Tables whose header names the columns.

/// Index of the first row that names a clock and a coordinate.
pub(super) fn find_header(table: &DelimitedTable) -> Option<usize> {
    let names = |row: &TextRow| {
        let meanings = || row.cells.iter().map(|cell| ColumnMeaning::parse(cell));
        meanings().any(|m| matches!(m, ColumnMeaning::Frame | ColumnMeaning::Time(_)))
            && meanings().any(|m| matches!(m, ColumnMeaning::Coordinate { .. }))
    };
    table.find_row(HEADER_ROWS, names).map(|(row, _)| row)
}

/// Reads the meaning of every column from the header.
pub(super) fn find_header_columns(table: &DelimitedTable) -> ImportResult<TableColumns> {
    let header = find_header(table).ok_or_else(|| no_header_error(table))?;
    let names = NamedColumns::read(table, header);
    refuse_two_units(table, names.row, names.units, 0..names.row.cells.len())?;
    let frame = names.only(|meaning| *meaning == ColumnMeaning::Frame, "numbers of the frames")?;
    let time = names.time_column()?;
    let points = names.point_cells()?;
    let track = if points.iter().all(|point| point.name.is_empty()) {
        names.only(|meaning| *meaning == ColumnMeaning::Key, "names of the object of a row")?
    } else {
        None
    };
    let units = names.units;
    let mut columns =
        TableColumns { by_header: true, header: Some(header), units, start: 0, frame, time, track, points };
    let clock = columns.clock().next().unwrap_or(0);
    columns.start = first_data_row(table, header, clock)?;
    Ok(columns)
}

/// Index of the first row of data below the names. One row without numbers directly below the names is
/// skipped. Further down, a row without numbers counts as damaged.
fn first_data_row(table: &DelimitedTable, header: usize, clock: usize) -> ImportResult<usize> {
    let below = header + 1;
    let line = table.head[header].line;
    let row = table.head.get(below).ok_or_else(|| ImportError::header_only(table.file, line))?;
    let words = !row.cells.iter().any(|cell| table.is_value(cell)) && !row.cell(clock).contains(':');
    Ok(if words && table.head.len() > below + 1 { below + 1 } else { below })
}

/// The names of the columns with their meanings.
struct NamedColumns<'t> {
    table: &'t DelimitedTable<'t>,
    row: &'t TextRow,
    meanings: Vec<ColumnMeaning>,
    /// Index in `DelimitedTable::head` of the row of units below the names, if there is one.
    units: Option<usize>,
}

impl<'t> NamedColumns<'t> {
    fn read(table: &'t DelimitedTable, header: usize) -> Self {
        let row = &table.head[header];
        let mut meanings: Vec<_> = row.cells.iter().map(|cell| ColumnMeaning::parse(cell)).collect();
        let mut units = None;
        if let Some(below) = table.head.get(header + 1).filter(|row| is_row_of_words(table, row)) {
            let are_units = below.cells.iter().any(|cell| ColumnUnit::parse(cell).is_some());
            for (meaning, cell) in meanings.iter_mut().zip(&below.cells) {
                let is_taken = meaning.take_unit(cell);
                if is_taken && are_units && *meaning == ColumnMeaning::Time(TimeUnit::Unknown) {
                    *meaning = ColumnMeaning::Time(TimeUnit::Unreadable);
                }
                if is_taken || ColumnUnit::parse(cell).is_some() {
                    units = Some(header + 1);
                }
            }
        }
        Self { table, row, meanings, units }
    }

    /// Indices of the columns with the wanted meaning.
    fn columns_where(&self, wanted: impl Fn(&ColumnMeaning) -> bool) -> Vec<usize> {
        self.meanings.iter().enumerate().filter(|(_, meaning)| wanted(meaning)).map(|(at, _)| at).collect()
    }

    /// Index of the column with the wanted meaning; `None` if there is none. Refuses a header with several
    /// such columns.
    fn only(&self, wanted: impl Fn(&ColumnMeaning) -> bool, what: &str) -> ImportResult<Option<usize>> {
        let found = self.columns_where(wanted);
        if found.len() > 1 { Err(self.ambiguous_error(&found, what)) } else { Ok(found.first().copied()) }
    }

    /// The first column of times, with its unit. Refuses a header with several columns of times whose units
    /// are equal or unknown. Columns with different known units are compared later.
    fn time_column(&self) -> ImportResult<Option<(usize, TimeUnit)>> {
        let unit = |at: usize| match self.meanings.get(at) {
            Some(ColumnMeaning::Time(unit)) => *unit,
            _ => TimeUnit::AssumedSeconds,
        };
        // (times in an unknown unit count only where there are no others)
        let mut times = self.columns_where(|meaning| matches!(meaning, ColumnMeaning::Time(_)));
        if times.iter().any(|at| unit(*at) != TimeUnit::Unreadable) {
            times.retain(|at| unit(*at) != TimeUnit::Unreadable);
        }
        let doubtful = |at: &usize| {
            times.iter().any(|other| {
                other != at && (unit(*other) == unit(*at) || !matches!(unit(*other), TimeUnit::Seconds(_)))
            })
        };
        if times.iter().any(doubtful) {
            return Err(self.ambiguous_error(&times, "times"));
        }
        Ok(times.first().map(|&at| (at, unit(at))))
    }

    /// The cells of every point that the columns name.
    fn point_cells(&self) -> ImportResult<Vec<PointCells>> {
        let mut names: Vec<&str> = vec![];
        for meaning in &self.meanings {
            if let ColumnMeaning::Coordinate { point, .. } = meaning
                && !names.contains(&point.as_str())
            {
                names.push(point);
            }
        }
        names.into_iter().map(|name| self.cells_of(name)).collect()
    }

    fn cells_of(&self, name: &str) -> ImportResult<PointCells> {
        let called = if name.is_empty() { String::new() } else { format!(" of `{name}`") };
        let axis = |wanted: usize, letter: &str| {
            let is = |meaning: &ColumnMeaning| match meaning {
                ColumnMeaning::Coordinate { point, axis, .. } => point == name && *axis == wanted,
                _ => false,
            };
            self.only(is, &format!("the {letter}{called}"))
        };
        let (x, y) = (axis(0, "x")?, axis(1, "y")?);
        let confidence = self.only(
            |meaning| matches!(meaning, ColumnMeaning::Confidence { point } if point == name),
            &format!("the confidence{called}"),
        )?;
        let Some(x) = x else { return Err(self.header_error(format!("a y{called} and no x"), "both")) };
        let units = [Some(x), y].map(|column| column.and_then(|column| self.unit(column)));
        Ok(PointCells { confidence, units, ..PointCells::new(name, x, y) })
    }

    /// Unit of a column of coordinates, with its source.
    fn unit(&self, column: usize) -> Fact<CoordinateUnit> {
        let ColumnMeaning::Coordinate { unit: Some(unit), .. } = self.meanings[column] else { return None };
        Some((unit, unit_source(self.table, self.row, self.units, column)))
    }

    fn ambiguous_error(&self, columns: &[usize], what: &str) -> ImportError {
        let named: Vec<String> =
            columns.iter().map(|at| format!("{} (`{}`)", at + 1, self.row.cell(*at))).collect();
        self.header_error(format!("columns {} that could all be {what}", named.join(", ")), "one")
    }

    fn header_error(&self, found: String, expected: &str) -> ImportError {
        let problem = format!("found {found}, expected {expected}");
        ImportError::columns(self.table.file, self.row.line, problem, ADVICE)
    }
}

/// Refuses a column whose name and whose cell in the row of units give different units.
fn refuse_two_units(
    table: &DelimitedTable,
    header: &TextRow,
    units: Option<usize>,
    columns: impl IntoIterator<Item = usize>,
) -> ImportResult<()> {
    let Some(row) = units.and_then(|row| table.head.get(row)) else { return Ok(()) };
    let differs = |column: &usize| {
        let below = ColumnUnit::parse(row.cell(*column));
        below.is_some_and(|below| ColumnUnit::in_name(header.cell(*column)).is_some_and(|unit| unit != below))
    };
    let Some(column) = columns.into_iter().find(differs) else { return Ok(()) };
    let problem = format!(
        "column {} is called `{}`, but line {} gives `{}` for it; expected one unit",
        column + 1,
        header.cell(column),
        row.line,
        row.cell(column)
    );
    Err(ImportError::columns(table.file, row.line, problem, "correct the wrong one in a copy of the file"))
}

/// Text on where the unit of a column was found.
fn unit_source(table: &DelimitedTable, header: &TextRow, units: Option<usize>, column: usize) -> String {
    let (number, name) = (column + 1, header.cell(column));
    match units.and_then(|row| table.head.get(row)).filter(|_| ColumnUnit::in_name(name).is_none()) {
        Some(row) => format!("line {} gives `{}` for column {number} (`{name}`)", row.line, row.cell(column)),
        None => format!("column {number} is called `{name}`"),
    }
}

fn is_row_of_words(table: &DelimitedTable, row: &TextRow) -> bool {
    !row.cells.iter().any(|cell| table.is_value(cell))
}

fn no_header_error(table: &DelimitedTable) -> ImportError {
    let problem = format!(
        "found `{}` and no row that names the columns, expected a clock such as frame or time_s, and coordinates \
         such as tip_x, tip_y",
        table.first_texts().join(" ")
    );
    ImportError::columns(table.file, table.first_line(), problem, ADVICE)
}

// Tables whose columns `--columns` names or numbers.

/// Reads the meaning of the columns from `--columns`, and their units from the header.
pub(super) fn find_mapped_columns(table: &DelimitedTable, map: &ColumnMap) -> ImportResult<TableColumns> {
    let every_row = ("frame", ColumnName::Name(ROW_COLUMN.to_owned()));
    let used = || map.0.iter().filter(|column| **column != every_row);
    let names: Vec<&str> = used()
        .filter_map(|(_, column)| match column {
            ColumnName::Name(name) => Some(name.as_str()),
            ColumnName::Number(_) => None,
        })
        .collect();
    let named = table.head.iter().position(|row| names.iter().all(|name| row.has(name)));
    if named.is_none() && !names.is_empty() {
        return Err(no_such_column_error(table, &names));
    }
    let position = |column: &ColumnName| match column {
        ColumnName::Number(number) => Ok(number - 1),
        ColumnName::Name(name) => find_column(table, named.unwrap_or(0), name),
    };
    let positions =
        used().map(|(key, column)| Ok((*key, position(column)?))).collect::<ImportResult<Vec<_>>>()?;
    let mapped = MappedColumns { table, positions };
    mapped.check_width()?;
    let header = named.filter(|_| !names.is_empty()).or_else(|| mapped.find_header());
    mapped.check_distinct(header)?;
    let start = mapped.first_data_row(header)?;
    let units = header.and_then(|header| mapped.units_row(header, start));
    mapped.read(header, units, start)
}

fn find_column(table: &DelimitedTable, header: usize, name: &str) -> ImportResult<usize> {
    let row = &table.head[header];
    let mut at = row.cells.iter().enumerate().filter(|(_, cell)| *cell == name).map(|(index, _)| index);
    match (at.next(), at.next()) {
        (Some(first), None) => Ok(first),
        (Some(first), Some(second)) => {
            let (first, second) = (first + 1, second + 1);
            let problem = format!("found the column name `{name}` at {first} and {second}, expected it once");
            let advice = "give the number of the column instead of its name";
            Err(ImportError::columns(table.file, row.line, problem, advice))
        }
        _ => Err(no_such_column_error(table, &[name])),
    }
}

/// The columns that `--columns` gives, with their keys.
struct MappedColumns<'t> {
    table: &'t DelimitedTable<'t>,
    positions: Vec<(&'static str, usize)>,
}

impl MappedColumns<'_> {
    fn column(&self, key: &str) -> Option<usize> {
        self.positions.iter().find(|(known, _)| *known == key).map(|(_, at)| *at)
    }

    fn check_width(&self) -> ImportResult<()> {
        let table = self.table;
        let cells = table.head.iter().map(|row| row.cells.len()).max().unwrap_or(0);
        let Some((key, at)) = self.positions.iter().find(|(_, at)| *at >= cells) else { return Ok(()) };
        let problem = format!(
            "--columns {key}={number}: found a table of {cells} columns (delimiter: {}), expected at least {number}",
            table.dialect.delimiter.word(),
            number = at + 1
        );
        Err(ImportError::columns(table.file, table.first_line(), problem, NUMBER_ADVICE))
    }

    /// Refuses a column that is used for two keys. Only the keys of confidences may share a column, because
    /// some trackers give one confidence for all points.
    fn check_distinct(&self, header: Option<usize>) -> ImportResult<()> {
        for (index, (first, at)) in self.positions.iter().enumerate() {
            let may_share = |key: &str| first.ends_with("confidence") && key.ends_with("confidence");
            let same = self.positions[..index].iter().find(|(key, other)| other == at && !may_share(key));
            if let Some((second, _)) = same {
                let problem = format!(
                    "--columns {second}={number} and {first}={number}: found one column for both, expected a \
                     column of its own for each",
                    number = at + 1
                );
                let line = header.and_then(|header| self.table.head.get(header)).map_or(1, |row| row.line);
                let advice = "correct one of the two, or leave out what the table does not have";
                return Err(ImportError::columns(self.table.file, line, problem, advice));
            }
        }
        Ok(())
    }

    fn number(&self, row: &TextRow, at: usize) -> CellNumber {
        self.table.parse_cell(row.cell(at))
    }

    /// Indices of the columns with numbers: first the clock (or the first x column if every row is a frame),
    /// then the other columns.
    fn numeric_columns(&self) -> Vec<usize> {
        let clock =
            ["frame", "time", "time-ms", "tip-x", "head-x", "x"].into_iter().find_map(|key| self.column(key));
        let others = self.positions.iter().filter(|(key, at)| *key != "track" && Some(*at) != clock);
        clock.into_iter().chain(others.map(|(_, at)| *at)).collect()
    }

    /// Whether a row has numbers in the clock and in another column, and no text in any of them.
    fn is_data(&self, row: &TextRow) -> bool {
        let cells: Vec<CellNumber> =
            self.numeric_columns().into_iter().map(|at| self.number(row, at)).collect();
        let is_value = |cell: &CellNumber| matches!(cell, CellNumber::Value(_));
        cells.first().is_some_and(is_value) && !cells.contains(&CellNumber::Text)
    }

    /// Index of the row of column names: the first row with text in all columns of numbers, if the texts are
    /// not all equal. Lines of settings above this row may contain numbers. If a block of data is above it,
    /// the row is not the header.
    fn find_header(&self) -> Option<usize> {
        let columns = self.numeric_columns();
        let names = |row: &TextRow| {
            let differ = columns.len() < 2 || columns.iter().any(|at| row.cell(*at) != row.cell(columns[0]));
            differ && columns.iter().all(|at| self.number(row, *at) == CellNumber::Text)
        };
        let (header, _) = self.table.find_row(HEADER_ROWS, names)?;
        let above = self.table.head[..header].iter().rev().take_while(|row| self.is_data(row)).count();
        (above < DATA_ABOVE).then_some(header)
    }

    /// Index of the first row of data: the first row below the header that has a number in the column of the
    /// clock. If a row before it has numbers in most of the other columns, its clock is damaged, and the
    /// table is refused.
    fn first_data_row(&self, header: Option<usize>) -> ImportResult<usize> {
        let (table, columns) = (self.table, self.numeric_columns());
        let clock = columns.first().copied().unwrap_or(0);
        for (index, row) in table.head.iter().enumerate().skip(header.map_or(0, |header| header + 1)) {
            if matches!(self.number(row, clock), CellNumber::Value(_)) {
                return Ok(index);
            }
            let kinds: Vec<CellNumber> = columns.iter().skip(1).map(|at| self.number(row, *at)).collect();
            let values = kinds.iter().filter(|kind| matches!(kind, CellNumber::Value(_))).count();
            if 2 * values > kinds.len() && !kinds.contains(&CellNumber::Text) {
                let key = self.positions.iter().find(|(_, at)| *at == clock).map_or("frame", |(key, _)| key);
                return Err(table.not_a_number_error(row.line, clock, row.cell(clock), key));
            }
        }
        Err(ImportError::header_only(table.file, table.head.last().map_or(1, |row| row.line)))
    }

    /// Index of the row of units between the names and the numbers.
    fn units_row(&self, header: usize, start: usize) -> Option<usize> {
        let is_unit = |at: usize, row: &TextRow| ColumnUnit::parse(row.cell(at)).is_some();
        (header + 1..start).find(|&row| {
            let row = &self.table.head[row];
            self.positions.iter().any(|(_, at)| is_unit(*at, row))
        })
    }

    /// Unit of a column, from its name or from the row of units, with its source. `in_name` reads the name.
    fn unit(
        &self,
        rows: [Option<usize>; 2],
        at: usize,
        in_name: fn(&str) -> Option<ColumnUnit>,
    ) -> Option<(ColumnUnit, String)> {
        let [header, units] = rows.map(|row| row.and_then(|row| self.table.head.get(row)));
        let (header, name) = (header?, header?.cell(at));
        let unit = in_name(name).or_else(|| ColumnUnit::parse(units?.cell(at)))?;
        Some((unit, unit_source(self.table, header, rows[1], at)))
    }

    /// Checks that the units in the header fit the keys of `--columns`, and collects the columns to read.
    fn read(&self, header: Option<usize>, units: Option<usize>, start: usize) -> ImportResult<TableColumns> {
        if let Some(names) = header.and_then(|row| self.table.head.get(row)) {
            refuse_two_units(self.table, names, units, self.positions.iter().map(|(_, at)| *at))?;
        }
        let unit = |at: usize| self.unit([header, units], at, ColumnUnit::in_name);
        let name = |at: usize| header.map_or("", |row| self.table.head[row].cell(at));
        let refuse = |key: &str, at: usize, found: &str, expected: &str| {
            let problem = format!("--columns {key}={}: found {found}, expected {expected}", at + 1);
            let line = header.map_or(self.table.first_line(), |row| self.table.head[row].line);
            Err(ImportError::columns(self.table.file, line, problem, NUMBER_ADVICE))
        };
        let mut time = None;
        for key in ["time", "time-ms"] {
            let Some(at) = self.column(key) else { continue };
            let stated = self.unit([header, units], at, ColumnUnit::of_times);
            let known = if key == "time-ms" { TimeUnit::Seconds(1e-3) } else { TimeUnit::AssumedSeconds };
            let seconds = match &stated {
                None => known,
                Some((ColumnUnit::Time(unit), _)) if key == "time" || *unit == known => *unit,
                Some((_, why)) => {
                    let expected = if key == "time" { "a time" } else { "a time in ms" };
                    return refuse(key, at, &format!("another unit ({why})"), expected);
                }
            };
            time = Some((at, seconds));
        }
        if let Some((at, why)) = self.column("frame").and_then(|at| Some((at, unit(at)?.1))) {
            return refuse(
                "frame",
                at,
                &format!("a unit ({why})"),
                "frame numbers; times are named by time=",
            );
        }
        let mut points = vec![];
        for (point, [x, y, confidence]) in POINT_KEYS {
            let Some(x_at) = self.column(x) else { continue };
            let mut of_point = [None, None];
            for (index, key) in [x, y].into_iter().enumerate() {
                let Some(at) = self.column(key) else { continue };
                if ColumnMeaning::parse_clock(name(at)).is_some() {
                    return refuse(key, at, &format!("the clock `{}`", name(at)), "a position");
                }
                of_point[index] = match unit(at) {
                    None => None,
                    Some((ColumnUnit::Coordinate(unit), why)) => Some((unit, why)),
                    Some((_, why)) => {
                        return refuse(key, at, &format!("a unit that is no length ({why})"), "a position");
                    }
                };
            }
            let called = if point.is_empty() && self.column("track").is_none() { "point" } else { point };
            let cells = PointCells::new(called, x_at, self.column(y));
            points.push(PointCells { confidence: self.column(confidence), units: of_point, ..cells });
        }
        let (frame, track) = (self.column("frame"), self.column("track"));
        Ok(TableColumns { by_header: false, header, units, start, frame, time, track, points })
    }
}

// Errors.

/// Error for a table whose columns are not named; it shows the first row, with the numbers of the columns.
pub(in super::super) fn unnamed_columns_error(table: &DelimitedTable) -> ImportError {
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

/// Error for a second clock that differs from the first; `names` are the names of the two columns.
pub(super) fn clock_difference_error(
    table: &DelimitedTable,
    first: usize,
    names: [&str; 2],
    found: &ClockDifference,
) -> ImportError {
    let [one, two] = &found.texts;
    let problem = format!(
        "column {} `{}` is a clock of its own: in line {} it says `{two}` where column {} `{}` says `{one}`; \
         expected one clock for all points",
        found.cell + 1,
        names[1],
        found.line,
        first + 1,
        names[0]
    );
    let advice = "leave --columns out where the format reads a clock for each track, or export the tracks with one clock";
    ImportError::columns(table.file, found.line, problem, advice)
}
