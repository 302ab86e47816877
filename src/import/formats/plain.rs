//! Reads tables with a clock and coordinates, as scripts write them. The header names the columns, or
//! `--columns` names or numbers them; in both cases the header gives the units of the columns.

mod columns;

use self::columns::{clock_difference_error, find_header_columns, find_mapped_columns};
use crate::import::format::*;
use crate::import::reader::layout::{self, ClockCell};
use crate::import::reader::rate::EVEN_FRAMES;
use crate::recording::clock::{median_step_s, number_frames};
pub(super) use columns::unnamed_columns_error;
use portable_math as math;

/// Format whose header names the columns.
pub(super) static PLAIN: PlainFormat = PlainFormat { name: "plain" };
/// Format whose columns `--columns` names or numbers.
pub(super) static GENERIC: PlainFormat = PlainFormat { name: "generic" };

pub(super) struct PlainFormat {
    name: &'static str,
}

impl FileFormat for PlainFormat {
    fn name(&self) -> &'static str {
        self.name
    }

    /// Recognises a table whose header names a clock and a coordinate. The format `generic` is never
    /// recognised, because only an option selects it.
    fn recognises(&self, document: &Document) -> Option<String> {
        let table = document.table.as_ref().ok().filter(|_| self.name == PLAIN.name)?;
        let header = columns::find_header(table)?;
        Some(format!("line {} names a clock and coordinates", table.head[header].line))
    }

    fn read<'a>(&self, document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        let mut columns = match &options.columns {
            Some(map) => find_mapped_columns(table, map)?,
            None if self.name == PLAIN.name => find_header_columns(table)?,
            None => return Err(unnamed_columns_error(table)),
        };
        columns.drop_or_refuse_unreadable_times(table)?;
        columns.refuse_other_clocks(table)?;
        let objects = columns.check_unread_objects(table)?;
        let (layout, start) = (columns.table_layout(table, document.stem), columns.start);
        if layout.key == [0] {
            let advice = "rename it; if the line is a comment, move it above the header";
            let line = table.head.get(start.saturating_sub(1)).map_or(0, |row| row.line);
            table.refuse_comment_names(line, "the name of an object", advice)?;
        }
        let time = columns.time.map_or(TimeUnit::AssumedSeconds, |time| time.1);
        let unit = columns.unit_above(table);
        let mut export = layout.read_tracks(document, table, Facts { time, unit, ..Facts::default() })?;
        export.notes.push(columns.describe(table));
        export.findings.extend(columns.unused_clock_finding(table)?.into_iter().chain(objects));
        Ok(export)
    }
}

/// The columns that are read from a table. Columns and rows are counted from 0.
pub(super) struct TableColumns {
    /// Whether the header gives the meaning of the columns; otherwise `--columns` gives it.
    by_header: bool,
    /// Index in `DelimitedTable::head` of the row of column names, if there is one.
    header: Option<usize>,
    /// Index in `DelimitedTable::head` of the row of units below the names, if there is one.
    units: Option<usize>,
    /// Index in `DelimitedTable::head` of the first row of data.
    start: usize,
    frame: Option<usize>,
    time: Option<(usize, TimeUnit)>,
    /// Column that names the object of a row.
    track: Option<usize>,
    points: Vec<PointCells>,
}

impl TableColumns {
    /// The row of column names.
    fn header_row<'t>(&self, table: &'t DelimitedTable) -> Option<&'t TextRow> {
        self.header.and_then(|row| table.head.get(row))
    }

    fn name<'t>(&self, table: &'t DelimitedTable, column: usize) -> &'t str {
        self.header_row(table).map_or("", |row| row.cell(column))
    }

    fn clock(&self) -> impl Iterator<Item = usize> {
        self.frame.into_iter().chain(self.time.map(|time| time.0))
    }

    /// All columns that are read.
    fn used_columns(&self) -> Vec<usize> {
        let of_points = self
            .points
            .iter()
            .flat_map(|point| point.x.iter().chain(&point.y).copied().chain(point.confidence));
        self.clock().chain(self.track).chain(of_points).collect()
    }

    /// Columns of times or frame numbers that are not read, with their meaning.
    fn unused_clocks(&self, table: &DelimitedTable) -> Vec<(usize, ColumnMeaning)> {
        let used = self.used_columns();
        let names = self.header_row(table).map_or(&[][..], |row| &row.cells);
        let meanings = names.iter().enumerate().filter(|(column, _)| !used.contains(column));
        meanings.filter_map(|(column, name)| Some((column, ColumnMeaning::parse_clock(name)?))).collect()
    }

    /// Leaves out times whose unit is not known if the rows have frame numbers, and refuses them otherwise.
    fn drop_or_refuse_unreadable_times(&mut self, table: &DelimitedTable) -> ImportResult<()> {
        let Some((column, _)) = self.time.filter(|(_, unit)| *unit == TimeUnit::Unreadable) else {
            return Ok(());
        };
        if self.frame.is_some() {
            self.time = None;
            return Ok(());
        }
        let line = self.header_row(table).map_or(1, |row| row.line);
        let below = self.units.and_then(|row| table.head.get(row)).map_or("", |row| row.cell(column));
        let below = if below.is_empty() { String::new() } else { format!(", `{below}`") };
        let problem = format!(
            "found times in a unit that is not known (column {}: `{}`{below}), expected s, ms, us, ns, min, h or d",
            column + 1,
            self.name(table, column)
        );
        let advice = "correct the unit in a copy of the file, with the times converted, or name a column that counts \
                      frames (--columns frame=...)";
        Err(ImportError::columns(table.file, line, problem, advice))
    }

    /// The unit of length that a setting above the table states, with its source.
    fn unit_above(&self, table: &DelimitedTable) -> Fact<CoordinateUnit> {
        /// Names of the setting, in lower case and without separators.
        const NAMES: [&str; 6] = [
            "lengthunit",
            "lengthunits",
            "unitoflength",
            "coordinateunit",
            "coordinateunits",
            "positionunits",
        ];
        let settings = table.head.iter().take(self.header.unwrap_or(self.start));
        settings.flat_map(|row| row.cells.windows(2).map(move |pair| (row.line, pair))).find_map(
            |(line, pair)| {
                NAMES.contains(&squeeze_name(&pair[0]).as_str()).then_some(())?;
                Some((
                    CoordinateUnit::parse(&pair[1])?,
                    format!("line {line}: `{}` is `{}`", pair[0], pair[1]),
                ))
            },
        )
    }

    /// The column that seems to name the objects of a table whose rows become one track. It is not read,
    /// has few values, each in rows that follow one another, and the point jumps where the value changes.
    fn find_unread_objects(&self, table: &DelimitedTable) -> ImportResult<Option<ObjectColumn>> {
        let ([point], None) = (&self.points[..], self.track) else { return Ok(None) };
        let (used, width) = (self.used_columns(), self.header_row(table).map_or(0, TextRow::used_width));
        let unused = (0..width).filter(|column| !used.contains(column));
        let mut candidates: Vec<ObjectColumn> = unused.map(ObjectColumn::new).collect();
        let coordinates: Vec<usize> = point.x.iter().chain(&point.y).copied().collect();
        let (mut last, mut steps): (Option<Vec<f64>>, _) = (None, vec![]);
        let start = if candidates.is_empty() { table.head.len() } else { self.start };
        table.find_in_rows(start, |record| {
            let numbers = coordinates.iter().map(|cell| table.parse_cell(record.cell(*cell)).value());
            let Some(now) = numbers.collect::<Option<Vec<f64>>>() else { return Ok(None::<()>) };
            let apart = last.iter().flatten().zip(&now).map(|(last, now)| (now - last).abs());
            let step = apart.fold(0.0, f64::max);
            last = Some(now);
            steps.push(step);
            candidates.retain_mut(|column| column.add_row(record.cell(column.at), step, record.line));
            Ok(candidates.is_empty().then_some(()))
        })?;
        let place = (ObjectColumn::QUANTILE * steps.len().saturating_sub(1) as f64) as usize;
        let step = if steps.is_empty() { 0.0 } else { math::select_number(&mut steps, place) };
        Ok(candidates.into_iter().find(|column| column.names_objects(step, steps.len())))
    }

    /// Refuses a table of several objects that would become one track. If `--columns` names the columns, this
    /// is a finding.
    fn check_unread_objects(&self, table: &DelimitedTable) -> ImportResult<Option<QualityFinding>> {
        let Some(found) = self.find_unread_objects(table)? else { return Ok(None) };
        let (number, name) = (found.at + 1, self.name(table, found.at));
        let problem = format!(
            "column {number} (`{name}`) is not read, but the point jumps where its value changes from `{}` to `{}`, \
             as if it named the object of a row",
            found.values[0], found.values[1]
        );
        if !self.by_header {
            let value = (found.values.len() as f64, "objects");
            let advice = format!("if it does, add track={number} to --columns");
            return Ok(Some(QualityFinding::advise(
                (Check::Points, Severity::Caution),
                value,
                problem,
                &advice,
            )));
        }
        let advice = format!(
            "if it does, add --columns frame=A,x=B,y=C,track={number} with the numbers of the other columns; to read \
             all rows as one track, give --columns without track="
        );
        Err(ImportError::columns(table.file, found.line, problem, advice))
    }

    /// Refuses a table with another clock that differs from the one that is read.
    fn refuse_other_clocks(&self, table: &DelimitedTable) -> ImportResult<()> {
        let first_x: Vec<usize> = self.points.iter().filter_map(|point| point.x.first().copied()).collect();
        for (column, meaning) in self.unused_clocks(table) {
            let pair = match meaning {
                ColumnMeaning::Frame => self.frame.map(|cell| (ClockCell { cell, unit: 1.0 }, 1.0)),
                ColumnMeaning::Time(unit) if unit != TimeUnit::Unreadable => self.time.map(|(cell, used)| {
                    (ClockCell { cell, unit: used.seconds_or_one() }, unit.seconds_or_one())
                }),
                _ => None,
            };
            // (frame numbers, and with `--columns` every clock, are compared only if they are directly before
            // x of a point: then they may be the clock of that point)
            let of_table = self.by_header && meaning != ColumnMeaning::Frame;
            if let Some((clock, unit)) = pair.filter(|_| of_table || first_x.contains(&(column + 1))) {
                let other = ClockCell { cell: column, unit };
                if let Some(found) = layout::find_clock_difference(table, self.start, clock, other)? {
                    let names = [clock.cell, column].map(|cell| self.name(table, cell));
                    return Err(clock_difference_error(table, clock.cell, names, &found));
                }
            }
        }
        Ok(())
    }

    fn table_layout(&self, table: &DelimitedTable, stem: &str) -> TableLayout {
        let name = |mut point: PointCells| {
            if point.name.is_empty() && self.track.is_none() {
                stem.clone_into(&mut point.name);
            }
            point
        };
        let named = self.header_row(table).map_or(0, TextRow::used_width);
        // (in some of the first rows the last cell may be blank, so the most common width is used)
        let filled = table.head.iter().skip(self.start).map(TextRow::used_width).collect::<Vec<_>>();
        TableLayout {
            start: self.start,
            width: self.used_columns().into_iter().max().map_or(0, |last| last + 1),
            most: named.max(usual_width(filled)),
            frame: self.frame,
            time: self.time.map(|time| time.0),
            key: self.track.into_iter().collect(),
            skip_nameless: true,
            order: if self.track.is_some() { RowOrder::Any } else { RowOrder::AsWritten },
            points: self.points.iter().cloned().map(name).collect(),
            ..TableLayout::default()
        }
    }

    /// Note on the header, the clock, the units and the columns that are not read.
    fn describe(&self, table: &DelimitedTable) -> String {
        let line = |row: usize| table.head.get(row).map_or(1, |row| row.line);
        let Some(header) = self.header else { return format!("the data start at line {}", line(self.start)) };
        let clock: Vec<String> = self.clock().map(|cell| format!("`{}`", self.name(table, cell))).collect();
        let clock = if clock.is_empty() { "their order".to_owned() } else { clock.join(" and ") };
        let units = match self.units {
            Some(row) => format!("; line {} names the units", line(row)),
            None if self.start > header + 1 => {
                "; what stands between the names and the numbers is left out".to_owned()
            }
            None => String::new(),
        };
        let used = self.used_columns();
        let names = table.head[header].cells.iter().enumerate();
        let other: Vec<&str> = names
            .filter(|(column, name)| !used.contains(column) && !name.is_empty())
            .map(|(_, name)| name.as_str())
            .collect();
        let other =
            if other.is_empty() { String::new() } else { format!("; not read: {}", other.join(", ")) };
        format!("line {} names the columns; the rows are placed by {clock}{units}{other}", line(header))
    }

    /// Finding about a column of times with uneven steps that is not read, because every row counts as a
    /// frame.
    fn unused_clock_finding(&self, table: &DelimitedTable) -> ImportResult<Option<QualityFinding>> {
        let unused = self.unused_clocks(table).into_iter().find(|(_, kind)| *kind != ColumnMeaning::Frame);
        let Some((column, _)) = unused.filter(|_| self.clock().next().is_none()) else { return Ok(None) };
        let mut times = vec![];
        table.find_in_rows(self.start, |record| {
            times.extend(table.parse_cell(record.cell(column)).value());
            Ok(None::<()>)
        })?;
        let fit = median_step_s(&times).and_then(|step_s| number_frames(&times, step_s));
        let Some(fit) =
            fit.filter(|fit| fit.worst_frames > EVEN_FRAMES || fit.frames.last() != Some(&(times.len() - 1)))
        else {
            return Ok(None);
        };
        let (number, name) = (column + 1, self.name(table, column));
        let found = format!(
            "--columns frame=row takes every row for a frame, but the times in column {number} (`{name}`) depart \
             from even frames, by up to {:.1} frames in row {}",
            fit.worst_frames.max(1.0),
            fit.worst_row + 1
        );
        let advice = "name that column: --columns time=...; frequencies and times are wrong without it";
        let value = (fit.worst_frames, "frames");
        Ok(Some(QualityFinding::advise((Check::UnevenClock, Severity::Serious), value, found, advice)))
    }
}

/// A column that is not read, and whose values may name the objects of the rows.
struct ObjectColumn {
    at: usize,
    /// The different values, in order.
    values: Vec<String>,
    /// Smallest step of the point where the value changes.
    smallest_jump: f64,
    /// Line of the first change.
    line: usize,
}

impl ObjectColumn {
    /// Quantile of the steps from row to row with which the steps at the changes are compared.
    const QUANTILE: f64 = 0.9;
    /// Ratio of the two steps from which the point jumps.
    const JUMP: f64 = 10.0;
    /// Smallest number of rows of an object on average.
    const LEAST_ROWS: usize = 3;
    /// Largest number of objects: there are not more tracked points.
    const MOST_VALUES: usize = 20;

    fn new(at: usize) -> Self {
        Self { at, values: vec![], smallest_jump: f64::INFINITY, line: 0 }
    }

    /// Adds a row, where the point has moved by `step` since the row before. Returns whether the column may
    /// still name objects: the value of a flag comes back, and that of a measurement changes in every row.
    fn add_row(&mut self, text: &str, step: f64, line: usize) -> bool {
        if self.values.last().is_some_and(|last| last == text) {
            return true;
        }
        match self.values.len() {
            0 => {}
            1 => (self.smallest_jump, self.line) = (step, line),
            _ => self.smallest_jump = self.smallest_jump.min(step),
        }
        let is_new = self.values.iter().all(|value| value != text) && self.values.len() < Self::MOST_VALUES;
        self.values.push(text.to_owned());
        is_new
    }

    /// Whether the values name objects, if the point usually moves by `step` from row to row.
    fn names_objects(&self, step: f64, rows: usize) -> bool {
        let several = self.values.len() > 1 && rows >= Self::LEAST_ROWS * self.values.len();
        several && step > 0.0 && self.smallest_jump > Self::JUMP * step
    }
}

/// The most common of the widths, or the largest of several equally common ones; 0 if there are no widths.
fn usual_width(mut widths: Vec<usize>) -> usize {
    widths.sort_unstable();
    let runs = widths.chunk_by(|a, b| a == b).max_by_key(|run| run.len());
    runs.and_then(|run| run.first()).copied().unwrap_or(0)
}
