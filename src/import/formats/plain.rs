//! Plain tables whose header names everything: a clock and the coordinates of points, as scripts write them.

mod header;

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::Options;
use crate::import::reader::several_clocks::{self, ClockCell};
use crate::import::reader::{
    Document, Facts, Layout, Number, Order, PointCells, Row, Table, TimeUnit, TrackFile, Unit,
};
use header::Meaning;

/// Its name on the command line.
pub(crate) const NAME: &str = "plain";
/// Rows above the data that may hold the names.
const HEADER_ROWS: usize = 6;
/// What a table with doubtful names needs.
const ADVICE: &str = "say which columns are meant by their numbers (from 1): --columns frame=A,tip-x=B,tip-y=C,head-x=D,head-y=E \
     with numbers for A to E";

/// Columns of the frames' numbers, and of their times with the unit.
type Clocks = (Option<usize>, Option<(usize, TimeUnit)>);

/// Plain tables with a telling header.
pub(crate) struct Plain;

impl Format for Plain {
    fn name(&self) -> &'static str {
        NAME
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let header = Header::find(document.table.as_ref().ok()?)?;
        Some(format!("line {} names a clock and coordinates", header.row.line))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &Options) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let header = Header::find(table).ok_or_else(|| no_header(table))?;
        let (frame, time) = header.clock()?;
        let points = header.points()?;
        let unit = header.unit()?;
        let start = header.first_data_row(table)?;
        header.compare_times(table, start)?;
        let key = if points.iter().all(|point| point.name.is_empty()) {
            header.one(|meaning| *meaning == Meaning::Key, "names of the object of a row")?
        } else {
            None
        };
        let key: Vec<usize> = key.into_iter().collect();
        if key == [0] {
            table.refuse_comments(
                header.row.line,
                "the name of an object",
                "rename it; if the line is a comment, move it above the header",
            )?;
        }
        let name = |mut point: PointCells| {
            if point.name.is_empty() && key.is_empty() {
                document.stem.clone_into(&mut point.name);
            }
            point
        };
        let layout = Layout {
            start,
            width: header.widest(&points, [frame, time.map(|time| time.0)]),
            most: header.row.filled(),
            frame,
            time: time.map(|time| time.0),
            order: if key.is_empty() { Order::AsWritten } else { Order::Any },
            skip_nameless: true,
            points: points.into_iter().map(name).collect(),
            key,
            ..Layout::default()
        };
        let facts = Facts { unit, time: time.map_or(TimeUnit::Usual, |time| time.1), ..Facts::default() };
        let mut export = layout.read(document, table, facts)?;
        export.notes.extend(header.note(&layout));
        Ok(export)
    }
}

/// The row of names and what they mean.
struct Header<'t> {
    file: &'t str,
    index: usize,
    row: &'t Row,
    meanings: Vec<Meaning>,
    /// The row of units below the names, where there is one.
    units: Option<&'t Row>,
}

impl<'t> Header<'t> {
    /// The first row that names a clock and a coordinate.
    fn find(table: &'t Table) -> Option<Self> {
        table.head.iter().take(HEADER_ROWS).enumerate().find_map(|(index, row)| {
            let meanings: Vec<Meaning> = row.cells.iter().map(|cell| Meaning::of(cell)).collect();
            let clock = meanings.iter().any(|meaning| matches!(meaning, Meaning::Frame | Meaning::Time(_)));
            let coordinate = meanings.iter().any(|meaning| matches!(meaning, Meaning::Coordinate { .. }));
            (clock && coordinate)
                .then_some(Self { file: table.file, index, row, meanings, units: None }.with_units(table))
        })
    }

    /// Units that stand in a row of their own below the names.
    fn with_units(mut self, table: &'t Table) -> Self {
        let words = |row: &&Row| row.cells.iter().all(|cell| !matches!(table.number(cell), Number::Value(_)));
        let Some(row) = table.head.get(self.index + 1).filter(words) else { return self };
        let taken = self
            .meanings
            .iter_mut()
            .zip(&row.cells)
            .filter_map(|(meaning, cell)| meaning.take_unit(cell).then_some(()))
            .count();
        self.units = Some(row).filter(|_| taken > 0);
        self
    }

    /// The columns that mean what is wanted.
    fn all(&self, wanted: impl Fn(&Meaning) -> bool) -> Vec<usize> {
        self.meanings.iter().enumerate().filter(|(_, meaning)| wanted(meaning)).map(|(at, _)| at).collect()
    }

    /// The only column that means what is wanted, if any does.
    fn one(&self, wanted: impl Fn(&Meaning) -> bool, what: &str) -> Result<Option<usize>, ImportError> {
        let found = self.all(wanted);
        if found.len() > 1 { Err(self.ambiguous(&found, what)) } else { Ok(found.first().copied()) }
    }

    /// The columns of frames and of times. Times in several units are the same times, which
    /// [`Self::compare_times`] makes sure of: the first column counts.
    fn clock(&self) -> Result<Clocks, ImportError> {
        let frame = self.one(|meaning| *meaning == Meaning::Frame, "numbers of the frames")?;
        let times = self.all(|meaning| matches!(meaning, Meaning::Time(_)));
        let unit = |at: usize| {
            if let Some(Meaning::Time(unit)) = self.meanings.get(at) { *unit } else { TimeUnit::Usual }
        };
        let doubtful = |at: &usize| {
            times.iter().any(|other| {
                other != at && (unit(*other) == unit(*at) || !matches!(unit(*other), TimeUnit::Seconds(_)))
            })
        };
        if times.iter().any(doubtful) {
            return Err(self.ambiguous(&times, "times"));
        }
        Ok((frame, times.first().map(|&at| (at, unit(at)))))
    }

    /// Refuses times in several units that are not the same times.
    fn compare_times(&self, table: &Table, start: usize) -> Result<(), ImportError> {
        let clock = |(cell, meaning): (usize, &Meaning)| match meaning {
            Meaning::Time(TimeUnit::Seconds(unit)) => Some(ClockCell { cell, unit: *unit }),
            Meaning::Time(_) => Some(ClockCell { cell, unit: 1.0 }),
            _ => None,
        };
        let clocks: Vec<ClockCell> = self.meanings.iter().enumerate().filter_map(clock).collect();
        let [first, others @ ..] = clocks.as_slice() else { return Ok(()) };
        for other in others {
            if let Some(found) = several_clocks::difference(table, start, *first, *other)? {
                let place = table.place(found.line, table.column(found.line, found.cell));
                let [one, two] = &found.texts;
                let (first, other) = (self.name(first.cell), self.name(other.cell));
                return Err(ImportError::format(
                    place,
                    format!("`{two}` in `{other}` where `{first}` says `{one}`"),
                    "one time of a row in both",
                    ADVICE,
                ));
            }
        }
        Ok(())
    }

    /// Every named point with its cells.
    fn points(&self) -> Result<Vec<PointCells>, ImportError> {
        let mut names: Vec<&str> = vec![];
        for meaning in &self.meanings {
            if let Meaning::Coordinate { point, .. } = meaning
                && !names.contains(&point.as_str())
            {
                names.push(point);
            }
        }
        names.into_iter().map(|name| self.point(name)).collect()
    }

    fn point(&self, name: &str) -> Result<PointCells, ImportError> {
        let called = if name.is_empty() { String::new() } else { format!(" of `{name}`") };
        let axis = |wanted: usize, letter: &str| {
            let is = |meaning: &Meaning| match meaning {
                Meaning::Coordinate { point, axis, .. } => point == name && *axis == wanted,
                _ => false,
            };
            self.one(is, &format!("the {letter}{called}"))
        };
        let (x, y) = (axis(0, "x")?, axis(1, "y")?);
        let confidence = self.one(
            |meaning| matches!(meaning, Meaning::Confidence { point } if point == name),
            &format!("the confidence{called}"),
        )?;
        match x {
            Some(x) => Ok(PointCells { confidence, ..PointCells::new(name, x, y) }),
            None => Err(self.refuse(format!("a y{called} and no x"), "both")),
        }
    }

    /// The unit that all coordinates name.
    fn unit(&self) -> Result<Option<(Unit, String)>, ImportError> {
        let units: Vec<(usize, Option<Unit>)> =
            self.meanings
                .iter()
                .enumerate()
                .filter_map(|(at, meaning)| {
                    if let Meaning::Coordinate { unit, .. } = meaning { Some((at, *unit)) } else { None }
                })
                .collect();
        let Some((first, unit)) = units.first().copied() else { return Ok(None) };
        match units.iter().find(|(_, other)| *other != unit) {
            Some((other, _)) => Err(self.ambiguous(&[first, *other], "coordinates, in different units")),
            None => Ok(unit.map(|unit| (unit, self.says_unit(first)))),
        }
    }

    /// Where the unit of a column stands.
    fn says_unit(&self, at: usize) -> String {
        match self
            .units
            .and_then(|row| Some((row.line, row.cells.get(at)?)))
            .filter(|_| Meaning::of(self.name(at)) != self.meanings[at])
        {
            Some((line, unit)) => {
                format!("line {line} gives `{unit}` for column {} (`{}`)", at + 1, self.name(at))
            }
            None => format!("column {} is called `{}`", at + 1, self.name(at)),
        }
    }

    fn name(&self, at: usize) -> &str {
        self.row.cells.get(at).map_or("", String::as_str)
    }

    /// The first row of numbers; a row of units may stand above it.
    fn first_data_row(&self, table: &Table) -> Result<usize, ImportError> {
        let below = self.index + 1;
        let words = |row: &Row| row.cells.iter().all(|cell| !matches!(table.number(cell), Number::Value(_)));
        match table.head.get(below) {
            None => Err(ImportError::HeaderOnly { file: table.file.to_owned(), line: self.row.line }),
            Some(row) if words(row) && table.head.len() > below + 1 => Ok(below + 1),
            Some(_) => Ok(below),
        }
    }

    /// Cells that every row must have.
    fn widest(&self, points: &[PointCells], clock: [Option<usize>; 2]) -> usize {
        let of_points =
            points.iter().flat_map(|point| point.x.iter().chain(&point.y).copied().chain(point.confidence));
        of_points.chain(clock.into_iter().flatten()).max().map_or(0, |last| last + 1)
    }

    /// Which columns were read, and which were not.
    fn note(&self, layout: &Layout) -> Vec<String> {
        let clock: Vec<String> =
            layout.frame.iter().chain(&layout.time).map(|&at| format!("`{}`", self.name(at))).collect();
        let units = match self.units {
            Some(row) => format!("; line {} names the units", row.line),
            None if layout.start > self.index + 1 => {
                "; the row below the names holds no numbers and is left out".to_owned()
            }
            None => String::new(),
        };
        let other: Vec<&str> = self
            .all(|meaning| *meaning == Meaning::Other)
            .into_iter()
            .map(|at| self.name(at))
            .filter(|name| !name.is_empty())
            .collect();
        let other =
            if other.is_empty() { String::new() } else { format!("; not read: {}", other.join(", ")) };
        vec![format!("the rows are placed by {}{units}{other}", clock.join(" and "))]
    }

    fn ambiguous(&self, columns: &[usize], what: &str) -> ImportError {
        let named: Vec<String> =
            columns.iter().map(|at| format!("{} (`{}`)", at + 1, self.name(*at))).collect();
        self.refuse(format!("columns {} that could all be {what}", named.join(", ")), "one")
    }

    fn refuse(&self, found: String, expected: &str) -> ImportError {
        ImportError::columns(self.file, self.row.line, format!("found {found}, expected {expected}"), ADVICE)
    }
}

fn no_header(table: &Table) -> ImportError {
    let row = table.head.first();
    ImportError::columns(
        table.file,
        row.map_or(1, |row| row.line),
        format!(
            "found `{}` and no row that names the columns, expected a clock such as frame or time_s, and \
             coordinates such as tip_x, tip_y",
            row.map(Row::texts).unwrap_or_default().join(" ")
        ),
        ADVICE,
    )
}
