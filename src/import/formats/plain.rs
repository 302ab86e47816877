//! Plain tables, as scripts write them, whose header names a clock and the coordinates of points.

mod header;

use crate::import::error::{ImportError, ImportResult};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::layout::ClockCell;
use crate::import::reader::{
    CoordinateUnit, DelimitedTable, Document, Facts, PointCells, RowOrder, TableLayout, TextRow, TimeUnit,
    TrackFile, layout,
};
use header::ColumnMeaning;

pub(crate) const PLAIN_NAME: &str = "plain";
/// Number of rows at the top in which the column names are sought.
const HEADER_ROWS: usize = 6;
const ADVICE: &str = "say which columns are meant by their numbers (from 1): --columns frame=A,tip-x=B,tip-y=C,head-x=D,head-y=E \
     with numbers for A to E";

/// Column of the frame numbers, and column and unit of the times.
type ClockColumns = (Option<usize>, Option<(usize, TimeUnit)>);

pub(crate) struct PlainFormat;

impl FileFormat for PlainFormat {
    fn name(&self) -> &'static str {
        PLAIN_NAME
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let header = PlainHeader::find(document.table.as_ref().ok()?)?;
        Some(format!("line {} names a clock and coordinates", header.row.line))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        let header = PlainHeader::find(table).ok_or_else(|| no_header_error(table))?;
        let (frame, time) = header.clock_columns()?;
        let points = header.all_point_cells()?;
        let unit = header.coordinate_unit()?;
        let start = header.first_data_row(table)?;
        header.compare_times(table, start)?;
        let key = if points.iter().all(|point| point.name.is_empty()) {
            header.only_column(|meaning| *meaning == ColumnMeaning::Key, "names of the object of a row")?
        } else {
            None
        };
        let key: Vec<usize> = key.into_iter().collect();
        if key == [0] {
            let advice = "rename it; if the line is a comment, move it above the header";
            table.refuse_comment_names(header.row.line, "the name of an object", advice)?;
        }
        let name = |mut point: PointCells| {
            if point.name.is_empty() && key.is_empty() {
                document.stem.clone_into(&mut point.name);
            }
            point
        };
        let of_points =
            points.iter().flat_map(|point| point.x.iter().chain(&point.y).copied().chain(point.confidence));
        let last = of_points.chain(frame).chain(time.map(|time| time.0)).max();
        let layout = TableLayout {
            start,
            width: last.map_or(0, |last| last + 1),
            most: header.row.used_width(),
            frame,
            time: time.map(|time| time.0),
            order: if key.is_empty() { RowOrder::AsWritten } else { RowOrder::Any },
            skip_nameless: true,
            points: points.into_iter().map(name).collect(),
            key,
            ..TableLayout::default()
        };
        let facts =
            Facts { unit, time: time.map_or(TimeUnit::AssumedSeconds, |time| time.1), ..Facts::default() };
        let mut export = layout.read_tracks(document, table, facts)?;
        export.notes.extend(header.column_notes(&layout));
        Ok(export)
    }
}

/// The row of column names, and the meanings of the names.
struct PlainHeader<'t> {
    file: &'t str,
    index: usize,
    row: &'t TextRow,
    meanings: Vec<ColumnMeaning>,
    /// The row of units below the names, if there is one.
    units: Option<&'t TextRow>,
}

impl<'t> PlainHeader<'t> {
    /// The first row that names a clock and a coordinate.
    fn find(table: &'t DelimitedTable) -> Option<Self> {
        table.head.iter().take(HEADER_ROWS).enumerate().find_map(|(index, row)| {
            let meanings: Vec<_> = row.cells.iter().map(|cell| ColumnMeaning::parse(cell)).collect();
            let clock = meanings.iter().any(|m| matches!(m, ColumnMeaning::Frame | ColumnMeaning::Time(_)));
            let coordinate = meanings.iter().any(|m| matches!(m, ColumnMeaning::Coordinate { .. }));
            (clock && coordinate)
                .then_some(Self { file: table.file, index, row, meanings, units: None }.with_units(table))
        })
    }

    /// Takes the units from a separate row below the names, if there is one.
    fn with_units(mut self, table: &'t DelimitedTable) -> Self {
        let words = |row: &&TextRow| !row.cells.iter().any(|cell| table.is_value(cell));
        let Some(row) = table.head.get(self.index + 1).filter(words) else { return self };
        for (meaning, cell) in self.meanings.iter_mut().zip(&row.cells) {
            if meaning.take_unit(cell) {
                self.units = Some(row);
            }
        }
        self
    }

    /// Indices of the columns with the wanted meaning.
    fn columns_where(&self, wanted: impl Fn(&ColumnMeaning) -> bool) -> Vec<usize> {
        self.meanings.iter().enumerate().filter(|(_, meaning)| wanted(meaning)).map(|(at, _)| at).collect()
    }

    /// Index of the only column with the wanted meaning, if there is one; refuses several.
    fn only_column(
        &self,
        wanted: impl Fn(&ColumnMeaning) -> bool,
        what: &str,
    ) -> ImportResult<Option<usize>> {
        let found = self.columns_where(wanted);
        if found.len() > 1 { Err(self.ambiguous_error(&found, what)) } else { Ok(found.first().copied()) }
    }

    /// The columns of frame numbers and of times. If there are several columns of times, the first is used,
    /// and [`Self::compare_times`] refuses the table if they differ.
    fn clock_columns(&self) -> ImportResult<ClockColumns> {
        let frame = self.only_column(|meaning| *meaning == ColumnMeaning::Frame, "numbers of the frames")?;
        let times = self.columns_where(|meaning| matches!(meaning, ColumnMeaning::Time(_)));
        let unit = |at: usize| match self.meanings.get(at) {
            Some(ColumnMeaning::Time(unit)) => *unit,
            _ => TimeUnit::AssumedSeconds,
        };
        let doubtful = |at: &usize| {
            times.iter().any(|other| {
                other != at && (unit(*other) == unit(*at) || !matches!(unit(*other), TimeUnit::Seconds(_)))
            })
        };
        if times.iter().any(doubtful) {
            return Err(self.ambiguous_error(&times, "times"));
        }
        Ok((frame, times.first().map(|&at| (at, unit(at)))))
    }

    /// Refuses a table in which columns of times differ in any row.
    fn compare_times(&self, table: &DelimitedTable, start: usize) -> ImportResult<()> {
        let clock = |(cell, meaning): (usize, &ColumnMeaning)| match meaning {
            ColumnMeaning::Time(TimeUnit::Seconds(unit)) => Some(ClockCell { cell, unit: *unit }),
            ColumnMeaning::Time(_) => Some(ClockCell { cell, unit: 1.0 }),
            _ => None,
        };
        let clocks: Vec<ClockCell> = self.meanings.iter().enumerate().filter_map(clock).collect();
        let [first, others @ ..] = clocks.as_slice() else { return Ok(()) };
        for other in others {
            if let Some(found) = layout::find_clock_difference(table, start, *first, *other)? {
                let place = table.cell_location(found.line, found.cell);
                let [one, two] = &found.texts;
                let (first, other) = (self.column_name(first.cell), self.column_name(other.cell));
                let found = format!("`{two}` in `{other}` where `{first}` says `{one}`");
                return Err(ImportError::format(place, found, "one time of a row in both", ADVICE));
            }
        }
        Ok(())
    }

    /// The cells of every point that the columns name.
    fn all_point_cells(&self) -> ImportResult<Vec<PointCells>> {
        let mut names: Vec<&str> = vec![];
        for meaning in &self.meanings {
            if let ColumnMeaning::Coordinate { point, .. } = meaning
                && !names.contains(&point.as_str())
            {
                names.push(point);
            }
        }
        names.into_iter().map(|name| self.point_cells(name)).collect()
    }

    fn point_cells(&self, name: &str) -> ImportResult<PointCells> {
        let called = if name.is_empty() { String::new() } else { format!(" of `{name}`") };
        let axis = |wanted: usize, letter: &str| {
            let is = |meaning: &ColumnMeaning| match meaning {
                ColumnMeaning::Coordinate { point, axis, .. } => point == name && *axis == wanted,
                _ => false,
            };
            self.only_column(is, &format!("the {letter}{called}"))
        };
        let (x, y) = (axis(0, "x")?, axis(1, "y")?);
        let confidence = self.only_column(
            |meaning| matches!(meaning, ColumnMeaning::Confidence { point } if point == name),
            &format!("the confidence{called}"),
        )?;
        match x {
            Some(x) => Ok(PointCells { confidence, ..PointCells::new(name, x, y) }),
            None => Err(self.header_error(format!("a y{called} and no x"), "both")),
        }
    }

    /// The unit of all coordinates; refuses different units.
    fn coordinate_unit(&self) -> ImportResult<Option<(CoordinateUnit, String)>> {
        let mut units = self.meanings.iter().enumerate().filter_map(|(at, meaning)| match meaning {
            ColumnMeaning::Coordinate { unit, .. } => Some((at, *unit)),
            _ => None,
        });
        let Some((first, unit)) = units.next() else { return Ok(None) };
        match units.find(|(_, other)| *other != unit) {
            Some((other, _)) => Err(self.ambiguous_error(&[first, other], "coordinates, in different units")),
            None => Ok(unit.map(|unit| (unit, self.unit_source(first)))),
        }
    }

    /// Text on where the unit of a column was found.
    fn unit_source(&self, at: usize) -> String {
        let (number, name) = (at + 1, self.column_name(at));
        let below = self.units.and_then(|row| Some((row.line, row.cells.get(at)?)));
        match below.filter(|_| ColumnMeaning::parse(name) != self.meanings[at]) {
            Some((line, unit)) => format!("line {line} gives `{unit}` for column {number} (`{name}`)"),
            None => format!("column {number} is called `{name}`"),
        }
    }

    fn column_name(&self, at: usize) -> &str {
        self.row.cell(at)
    }

    /// Index of the first row of numbers. A row without numbers directly below the names is skipped.
    fn first_data_row(&self, table: &DelimitedTable) -> ImportResult<usize> {
        let below = self.index + 1;
        let row = table.head.get(below).ok_or_else(|| ImportError::header_only(table.file, self.row.line))?;
        let words = !row.cells.iter().any(|cell| table.is_value(cell));
        Ok(if words && table.head.len() > below + 1 { below + 1 } else { below })
    }

    /// Note on the clock, the units and the columns that were not read.
    fn column_notes(&self, layout: &TableLayout) -> Vec<String> {
        let clock = layout.frame.iter().chain(&layout.time);
        let clock: Vec<String> = clock.map(|&at| format!("`{}`", self.column_name(at))).collect();
        let units = match self.units {
            Some(row) => format!("; line {} names the units", row.line),
            None if layout.start > self.index + 1 => {
                "; the row below the names holds no numbers and is left out".to_owned()
            }
            None => String::new(),
        };
        let other = self.columns_where(|meaning| *meaning == ColumnMeaning::Other).into_iter();
        let other: Vec<&str> = other.map(|at| self.column_name(at)).filter(|name| !name.is_empty()).collect();
        let other =
            if other.is_empty() { String::new() } else { format!("; not read: {}", other.join(", ")) };
        vec![format!("the rows are placed by {}{units}{other}", clock.join(" and "))]
    }

    fn ambiguous_error(&self, columns: &[usize], what: &str) -> ImportError {
        let named: Vec<String> =
            columns.iter().map(|at| format!("{} (`{}`)", at + 1, self.column_name(*at))).collect();
        self.header_error(format!("columns {} that could all be {what}", named.join(", ")), "one")
    }

    fn header_error(&self, found: String, expected: &str) -> ImportError {
        ImportError::columns(self.file, self.row.line, format!("found {found}, expected {expected}"), ADVICE)
    }
}

fn no_header_error(table: &DelimitedTable) -> ImportError {
    let problem = format!(
        "found `{}` and no row that names the columns, expected a clock such as frame or time_s, and coordinates \
         such as tip_x, tip_y",
        table.first_texts().join(" ")
    );
    ImportError::columns(table.file, table.first_line(), problem, ADVICE)
}
