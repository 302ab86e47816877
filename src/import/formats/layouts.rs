//! Formats that are each described by a [`ProgramTable`]: how the file is recognised, what its columns mean,
//! and what the file or the documentation of its program states. The same code reads all these formats.

use crate::import::format::*;
use crate::import::reader::layout::read_point_pairs;
use crate::import::reader::rate::RATE_AGREEMENT;

/// Layout of the table of a program. If a column name in this description ends in `*`, the name in the file
/// may continue with a unit or another sign.
pub(crate) struct ProgramTable {
    /// Name of the format.
    pub name: &'static str,
    /// Text with which the file starts; empty if the column names identify the format.
    pub mark: &'static str,
    /// Column of the frame numbers.
    pub frame: Option<&'static str>,
    /// Column of the times.
    pub time: Option<&'static str>,
    /// Columns that name the track of a row; only the last one must exist.
    pub key: &'static [&'static str],
    pub points: PointColumns,
    /// A minimum number, and the names of other columns of the program. The format is recognised if the table
    /// has at least this number of these columns.
    pub others: (usize, &'static [&'static str]),
    /// Two texts for the table of a graph. The line that contains the first text names the quantities on the
    /// two axes. Both must be positions, so this line must contain the second text exactly twice.
    pub axes: Option<[&'static str; 2]>,
    /// Settings above the table that name the units of x and y: one setting for each, or one for both.
    pub units: &'static [CellPlace],
    /// Settings above the table with the rate of the rows, 1/s. The first one must exist; the others may be
    /// missing.
    pub rates: &'static [CellPlace],
    /// Setting with the number of rows.
    pub rows: Option<CellPlace>,
    /// What the documentation of the program states.
    pub facts: fn() -> Facts,
    /// Note for the user; empty if there is none.
    pub note: &'static str,
    /// Advice for the user on how to export the table of positions.
    pub advice: &'static str,
}

/// How the columns of the points are found.
pub(crate) enum PointColumns {
    /// One point in a row, with x and y in the columns with these names.
    Named([&'static str; 2]),
    /// Pairs of columns after the columns of the clock. The names of a pair are NAME with the two endings
    /// `ends`, for x and y. The first column with an ending in `rest`, and all columns after it, are not
    /// read. `rename` makes the name of the track from NAME.
    Pairs { ends: [&'static str; 2], rest: &'static [&'static str], rename: fn(&str) -> &str },
    /// Groups of three columns (X, Y and Z) after the columns of the clock. The name of the point is above
    /// the first column of its group.
    Triples,
    /// A table without column names, in which every row is a frame with x and y of each point. Its first row
    /// has the number of rows, the number of points and the time from row to row, s.
    Counted,
}

/// Place of a setting above the table.
#[derive(Clone, Copy)]
pub(crate) enum CellPlace {
    /// In the cell to the right of the cell with the given name.
    RightOf(&'static str),
    /// In the cell below the cell with the given name.
    Below(&'static str),
}

/// Default values for the description of a format. Each description replaces some of them.
pub(crate) const PLAIN_ROW: ProgramTable = ProgramTable {
    name: "",
    mark: "",
    frame: None,
    time: None,
    key: &[],
    points: PointColumns::Triples,
    others: (0, &[]),
    axes: None,
    units: &[],
    rates: &[],
    rows: None,
    facts: Facts::default,
    note: "",
    advice: "export again without changing the columns, or name them with --columns",
};

/// The formats that a [`ProgramTable`] describes completely.
pub(super) static LAYOUTS: [ProgramTable; 5] = [
    // the data of an X-Y graph of DIPP-MOTION (DITECT) in CP932; the Japanese words are "time", "coordinate
    // value", "unit of the horizontal axis" and "unit of the vertical axis"
    ProgramTable {
        name: "dippmotion",
        mark: "DIPP-MOTION",
        time: Some("\u{6642}\u{9593}*"),
        points: PointColumns::Pairs { ends: ["(X)", "(Y)"], rest: &[], rename: str::trim },
        axes: Some(["] - [", "\u{5ea7}\u{6a19}\u{5024}"]),
        units: &[
            CellPlace::RightOf("\u{6a2a}\u{8ef8}\u{5358}\u{4f4d}"),
            CellPlace::RightOf("\u{7e26}\u{8ef8}\u{5358}\u{4f4d}"),
        ],
        advice: "save the data of the graph of X coordinate against Y coordinate of the points as CSV; if \
            Japanese characters are damaged, add --encoding shift_jis",
        ..PLAIN_ROW
    },
    // TRC of motion-capture programs: lines of settings, then the names of the markers
    ProgramTable {
        name: "trc",
        mark: "PathFileType",
        frame: Some("Frame*"),
        time: Some("Time*"),
        units: &[CellPlace::Below("Units")],
        rates: &[CellPlace::Below("DataRate"), CellPlace::Below("CameraRate")],
        rows: Some(CellPlace::Below("NumFrames")),
        facts: || Facts { time: TimeUnit::Seconds(1.0), ..Facts::default() },
        note: "x and y of the markers are taken and z is left out; for another plane number the columns, e.g. \
            --columns frame=1,tip-x=3,tip-y=5",
        advice: "export the TRC file again from the program that tracked the markers, or number the columns \
            with --columns",
        ..PLAIN_ROW
    },
    // linked features of trackpy, saved with to_csv; an index column without a name may come first
    ProgramTable {
        name: "trackpy",
        frame: Some("frame"),
        key: &["particle"],
        points: PointColumns::Named(["x", "y"]),
        others: (3, &["mass", "ecc", "signal", "raw_mass", "ep", "size"]),
        facts: || Facts::pixels_down("trackpy writes image coordinates, y along the rows of the image"),
        advice: "link the features with trackpy.link(features, ...) and save its result with to_csv",
        ..PLAIN_ROW
    },
    // motion-analysis-2d (Saga University); angles, whose Greek letter is often damaged, follow the points
    ProgramTable {
        name: "motion-analysis-2d",
        frame: Some("frame_no"),
        time: Some("time"),
        points: PointColumns::Pairs {
            ends: ["-x", "-y"],
            rest: &["-\u{3b8}", "-\u{3f4}", "-theta"],
            rename: |name| name,
        },
        note: "the program writes a distance between two points like a point: choose tip and head by name",
        ..PLAIN_ROW
    },
    // coordinates of Frame-DIAS (DKH), two-dimensional
    ProgramTable {
        name: "framedias",
        points: PointColumns::Counted,
        facts: || Facts { time: TimeUnit::Seconds(1.0), ..Facts::default() },
        note: "the points are called `point1`, `point2`, ... in the order of the columns",
        advice: "save the two-dimensional coordinates (.rd) again: three-dimensional ones (.3d) are another file",
        ..PLAIN_ROW
    },
];

/// Number of rows at the top of a table that are searched for the column names, if these names identify the
/// format. A user may have added lines above them.
const HEADER_ROWS: usize = 3;
/// Largest allowed time from row to row, s, in the first line of a table without column names. If the third
/// number of this line is larger, it has another meaning.
const LONGEST_STEP_S: f64 = 10.0;
/// File extension of a table without column names.
const COUNTED_EXTENSION: &str = ".rd";
/// Largest magnitude of the coordinates of a point that counts as the origin, in units of the file. Rounding
/// errors of 1e-11 occur.
const AT_ORIGIN: f64 = 1e-6;

impl FileFormat for ProgramTable {
    fn name(&self) -> &'static str {
        self.name
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let table = document.table.as_ref().ok()?;
        let line = table.first_line();
        if let PointColumns::Counted = self.points {
            let [rows, points, step_s] = read_counts(table)?;
            let cells = table.head.get(1)?.used_width() as f64;
            // (a row of three cells may be another row of counts)
            let fits = cells == 2.0 * points && cells != 3.0;
            return (fits || document.file.to_lowercase().ends_with(COUNTED_EXTENSION))
                .then(|| format!("line {line} counts {rows} frames of {points} points, {step_s} s apart"));
        }
        if !self.mark.is_empty() {
            let start = document.text.trim_start().trim_start_matches('"');
            return start.starts_with(self.mark).then(|| format!("line {line} starts with {}", self.mark));
        }
        let (_, row) = self.find_header(table)?;
        Some(format!("line {} names {}", row.line, self.describe_columns()))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        let counts = read_counts(table).filter(|_| matches!(self.points, PointColumns::Counted));
        let mut facts = (self.facts)();
        let layout = match (&self.points, counts) {
            (PointColumns::Counted, counts) => self.counted_layout(table, counts)?,
            _ => {
                self.refuse_other_axes(table)?;
                self.read_settings(table, &mut facts)?;
                self.named_layout(table, &mut facts)?
            }
        };
        let mut export = layout.read_tracks(document, table, facts)?;
        if let (true, Some(name)) = (export.tracks.is_empty(), self.key.last()) {
            return Err(self.refusal(table.location(table.first_line(), 1), format!("no row with a {name}")));
        }
        // (pandas writes whole numbers as `0.0` if any of them is missing)
        for track in export.tracks.iter_mut().filter(|_| !self.key.is_empty()) {
            track.name = track.name.strip_suffix(".0").unwrap_or(&track.name).to_owned();
        }
        let place = table.location(table.first_line(), 1);
        let rows = match self.rows {
            Some(setting) => Some(self.read_number(table, setting)?),
            None => counts.map(|[rows, ..]| (rows, place)),
        };
        let read = export.clocks.first().map_or(0, Clock::len);
        if let Some((rows, place)) = rows.filter(|(rows, _)| *rows != read as f64) {
            let advice = "the file is cut short or was edited: export it again";
            let found = format!("{read} rows of positions");
            return Err(ImportError::wrong_table(place, found, format!("{rows} as this line says"), advice));
        }
        if let Some([_, _, step_s]) = counts.filter(|[_, _, step_s]| *step_s > 0.0) {
            for clock in &mut export.clocks {
                let time_s = |frame: Option<f64>| frame.map(|frame| frame * step_s);
                clock.time = clock.frame.as_ref().map(|frames| frames.iter().map(time_s).collect());
            }
        }
        export.findings.extend(local_origin_finding(&export));
        export.notes.extend((!self.note.is_empty()).then(|| self.note.to_owned()));
        Ok(export)
    }
}

impl ProgramTable {
    fn clocks(&self) -> impl Iterator<Item = &'static str> {
        self.frame.into_iter().chain(self.time)
    }

    /// The columns that the format needs, for messages.
    fn describe_columns(&self) -> String {
        let names = self.clocks().chain(self.key.iter().copied());
        let names: Vec<&str> = names.map(|name| name.trim_end_matches('*')).collect();
        let points = match self.points {
            PointColumns::Named([x, y]) => format!("{} and {}", x.trim_end_matches('*'), y.trim_end_matches('*')),
            PointColumns::Pairs { ends: [x, y], .. } => format!("columns in pairs called NAME{x} and NAME{y}"),
            PointColumns::Triples => "a name above every third column".to_owned(),
            PointColumns::Counted => {
                "the numbers of frames and points and the seconds from frame to frame, then x and y of every point"
                    .to_owned()
            }
        };
        if names.is_empty() { points } else { format!("{}, {points}", names.join(", ")) }
    }

    fn refusal(&self, place: TextLocation, found: String) -> ImportError {
        ImportError::wrong_table(place, found, self.describe_columns(), self.advice)
    }

    /// The row of column names.
    fn find_header<'t>(&self, table: &'t DelimitedTable) -> Option<(usize, &'t TextRow)> {
        let rows = if self.mark.is_empty() { HEADER_ROWS } else { usize::MAX };
        let is_clock = |row: &TextRow| {
            let first = self.clocks().enumerate().all(|(at, name)| is_named(row.cell(at), name));
            first && row.used_width() > self.clocks().count()
        };
        table.find_row(rows, |row| {
            let has = |name: &str| find_column(row, name).is_some();
            match &self.points {
                PointColumns::Named(names) => {
                    let others = self.others.1.iter().filter(|name| row.has(name)).count();
                    self.clocks().chain(*names).all(has) && others >= self.others.0
                }
                PointColumns::Pairs { ends, rest, .. } if self.mark.is_empty() => {
                    let known = |cell: &String| ends.iter().chain(*rest).any(|end| cell.ends_with(end));
                    is_clock(row) && row.cells[self.clocks().count()..row.used_width()].iter().all(known)
                }
                _ => is_clock(row),
            }
        })
    }

    /// Layout of a table with column names. Adds the unit of the times to the facts.
    fn named_layout(&self, table: &DelimitedTable, facts: &mut Facts) -> ImportResult<TableLayout> {
        let Some((header, row)) = self.find_header(table) else {
            let found = format!("`{}` and no row that names the columns", table.first_texts().join(" | "));
            return Err(self.refusal(table.location(table.first_line(), 1), found));
        };
        let [frame, time] = [self.frame, self.time].map(|name| find_column(row, name?));
        check_repeated_frames(table, header, frame, self.frame)?;
        let counts_frames = self.read_column_units(table, row, facts)?;
        let (frame, time) = if counts_frames { (time, None) } else { (frame, time) };
        let (points, width) = self.point_columns(table, row)?;
        let mut start = header + 1;
        if let PointColumns::Triples = self.points {
            let first = table.first_numeric_row(start, &[0]);
            start = first.ok_or_else(|| ImportError::header_only(table.file, row.line))?;
        }
        let key: Vec<Option<usize>> = self.key.iter().map(|name| find_column(row, name)).collect();
        if key.last() == Some(&None) {
            let found = format!("a table without {}", self.key[key.len() - 1]);
            return Err(self.refusal(table.location(row.line, 1), found));
        }
        let order = if key.is_empty() { RowOrder::AsWritten } else { RowOrder::Any };
        let key = key.into_iter().flatten().collect();
        let layout = TableLayout::new(start, width, points);
        Ok(TableLayout { frame, time, key, order, skip_nameless: true, ..layout })
    }

    /// Reads the units that follow the column names of the times and of x and y. Returns whether the column
    /// of times contains frame numbers.
    fn read_column_units(
        &self,
        table: &DelimitedTable,
        row: &TextRow,
        facts: &mut Facts,
    ) -> ImportResult<bool> {
        let unit_of = |name: &str| {
            let rest = row.cell(find_column(row, name)?).get(name.trim_end_matches('*').len()..)?;
            Some(rest.trim_matches(|c: char| c.is_whitespace() || "()[]\u{ff08}\u{ff09}".contains(c)))
        };
        if let PointColumns::Named([x, y]) = self.points {
            let [x, y] = [x, y].map(|name| unit_of(name).unwrap_or_default());
            if x != y {
                let found = format!("x in `{x}` and y in `{y}`");
                let (place, expected) = (table.location(row.line, 1), "one unit of length");
                return Err(ImportError::wrong_table(place, found, expected, self.advice));
            }
            let named = CoordinateUnit::parse(x).map(|unit| (unit, format!("the header says [{x}]")));
            facts.unit = facts.unit.take().or(named);
        }
        let unit = self.time.and_then(unit_of).filter(|unit| !unit.is_empty());
        facts.time = unit.map_or(facts.time, |unit| TimeUnit::parse(unit).unwrap_or(TimeUnit::Unknown));
        Ok(unit.is_some_and(|unit| unit.starts_with("frame")))
    }

    /// The points, and the number of cells in a row.
    fn point_columns(&self, table: &DelimitedTable, row: &TextRow) -> ImportResult<(Vec<PointCells>, usize)> {
        let (first, width) = (self.clocks().count(), row.used_width());
        let names: Vec<&str> = row.texts().into_iter().take(width).collect();
        match &self.points {
            PointColumns::Named(names) => {
                let [x, y] = names.map(|name| find_column(row, name));
                let point = x.map(|x| PointCells::new("", x, y));
                Ok((point.into_iter().collect(), width))
            }
            PointColumns::Pairs { ends, rest, rename } => {
                let is_rest = |name: &&str| rest.iter().any(|end| name.ends_with(end));
                let last = names.iter().position(is_rest).unwrap_or(width);
                let points = read_point_pairs(&names[..last], first, *ends, rename).map_err(|column| {
                    let place = table.cell_location(row.line, column);
                    self.refusal(place, format!("the column `{}`", names[column]))
                })?;
                if points.is_empty() {
                    return Err(self.refusal(table.location(row.line, 1), "no points".to_owned()));
                }
                Ok((points, width))
            }
            _ => {
                let named = names.iter().enumerate().skip(first).filter(|(_, name)| !name.is_empty());
                let points: Vec<PointCells> =
                    named.map(|(at, name)| PointCells::new(*name, at, Some(at + 1))).collect();
                let misplaced = |(index, point): &(usize, &PointCells)| point.x[0] != first + 3 * index;
                match points.iter().enumerate().find(misplaced) {
                    None => Ok((points.clone(), first + 3 * points.len())),
                    Some((_, PointCells { name, x, .. })) => {
                        let found = format!("the name `{name}` above column {}", x[0] + 1);
                        Err(self.refusal(table.cell_location(row.line, x[0]), found))
                    }
                }
            }
        }
    }

    /// Layout of a table without names.
    fn counted_layout(&self, table: &DelimitedTable, counts: Option<[f64; 3]>) -> ImportResult<TableLayout> {
        let Some([_, count, _]) = counts else {
            let found = format!("`{}`", table.first_texts().join(","));
            return Err(self.refusal(table.location(table.first_line(), 1), found));
        };
        let row = table.head.get(1).ok_or_else(|| ImportError::header_only(table.file, 1))?;
        let width = row.used_width();
        if width as f64 != 2.0 * count {
            let found = format!("{width} coordinates in the row for {count} points");
            return Err(self.refusal(table.location(row.line, 1), found));
        }
        let point =
            |index: usize| PointCells::new(format!("point{}", index + 1), 2 * index, Some(2 * index + 1));
        let lost = LostRule { cell: None, is: |x, y| x == 0.0 && y == 0.0, words: "at exactly (0, 0)" };
        let layout = TableLayout::new(1, width, (0..width / 2).map(point).collect());
        Ok(TableLayout { lost: vec![lost], ..layout })
    }

    /// Refuses the table of a graph with an axis that is no position.
    fn refuse_other_axes(&self, table: &DelimitedTable) -> ImportResult<()> {
        let Some([mark, word]) = self.axes else { return Ok(()) };
        match table.head.iter().find(|row| row.first_cell().contains(mark)) {
            Some(row) if row.first_cell().matches(word).count() != 2 => {
                Err(self.refusal(table.location(row.line, 1), format!("the graph {}", row.first_cell())))
            }
            _ => Ok(()),
        }
    }

    /// Reads unit and rate from the settings; refuses settings that contradict each other.
    fn read_settings(&self, table: &DelimitedTable, facts: &mut Facts) -> ImportResult<()> {
        let units: Vec<_> = self.units.iter().filter_map(|setting| find_setting(table, *setting)).collect();
        if let Some((unit, place)) = units.first().filter(|_| units.len() == self.units.len()) {
            if let Some((other, place)) = units.iter().find(|(other, _)| other != unit) {
                let found = format!("the unit `{other}` for y and `{unit}` for x");
                return Err(ImportError::wrong_table(place, found, "one unit for both", self.advice));
            }
            let known = CoordinateUnit::parse(unit);
            if known.is_none() && !unit.is_empty() {
                let (found, expected) = (format!("the unit `{unit}`"), "a unit of length or pixels");
                return Err(ImportError::wrong_table(place, found, expected, self.advice));
            }
            facts.unit = known.map(|known| (known, format!("{place} names the unit {unit}")));
        }
        let Some((first, others)) = self.rates.split_first() else { return Ok(()) };
        let (rate_hz, place) = self.read_number(table, *first)?;
        for other in others.iter().filter(|other| find_setting(table, **other).is_some()) {
            let (other_hz, place) = self.read_number(table, *other)?;
            if (other_hz / rate_hz - 1.0).abs() > RATE_AGREEMENT {
                let found = format!("{other_hz} frames/s of the camera and {rate_hz} rows a second");
                let expected = "one rate: rows that were resampled lack or fold what lies above their rate";
                return Err(ImportError::wrong_table(place, found, expected, self.advice));
            }
        }
        facts.frame_rate_hz = Some((rate_hz, format!("the settings in {place}")));
        Ok(())
    }

    /// Value and place of a setting that has to be a number above 0.
    fn read_number(&self, table: &DelimitedTable, setting: CellPlace) -> ImportResult<(f64, TextLocation)> {
        let (CellPlace::RightOf(name) | CellPlace::Below(name)) = setting;
        let found = find_setting(table, setting);
        let (text, place) = found.unwrap_or_else(|| ("", table.location(table.first_line(), 1)));
        let Some(value) = table.parse_cell(text).value().filter(|value| *value > 0.0) else {
            let found = format!("{name} `{}`", text.chars().take(40).collect::<String>());
            return Err(ImportError::wrong_table(place, found, "a number above 0", self.advice));
        };
        Ok((value, place))
    }
}

/// Whether the text of a cell is `name`. If `name` ends in `*`, a unit or a sign may follow in the cell.
fn is_named(cell: &str, name: &str) -> bool {
    match name.strip_suffix('*').map(|start| cell.strip_prefix(start)) {
        Some(rest) => rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_alphanumeric())),
        None => cell == name,
    }
}

fn find_column(row: &TextRow, name: &str) -> Option<usize> {
    row.cells.iter().position(|cell| is_named(cell, name))
}

/// Text and place of a setting.
fn find_setting<'t>(table: &'t DelimitedTable, setting: CellPlace) -> Option<(&'t str, TextLocation)> {
    let (row, at) = match setting {
        CellPlace::RightOf(name) => (table.head.iter().find(|row| row.first_cell() == name)?, 1),
        CellPlace::Below(name) => {
            let (index, names) = table.find_row(usize::MAX, |row| row.has(name))?;
            (table.head.get(index + 1)?, names.position(name)?)
        }
    };
    Some((row.cell(at), table.cell_location(row.line, at)))
}

/// The numbers of rows and points and the time from row to row, s, in the first row of a table without names.
fn read_counts(table: &DelimitedTable) -> Option<[f64; 3]> {
    let row = table.head.first().filter(|row| row.used_width() == 3)?;
    let value = |cell: usize| table.parse_cell(row.cell(cell)).value();
    let counts = [value(0)?, value(1)?, value(2)?];
    let is_count = |value: f64| value >= 1.0 && value.fract() == 0.0;
    (is_count(counts[0]) && is_count(counts[1]) && (0.0..=LONGEST_STEP_S).contains(&counts[2]))
        .then_some(counts)
}

/// Refuses a second column with the name of the frame numbers that differs from the first in any row.
fn check_repeated_frames(
    table: &DelimitedTable,
    header: usize,
    first: Option<usize>,
    name: Option<&str>,
) -> ImportResult<()> {
    let (Some(first), Some(name)) = (first, name) else { return Ok(()) };
    let names = &table.head[header];
    for other in (first + 1..names.cells.len()).filter(|at| is_named(names.cell(*at), name)) {
        let line = table.find_in_rows(header + 1, |record| {
            let [one, two] = [first, other].map(|cell| table.parse_cell(record.cell(cell)));
            Ok((one != two).then_some(record.line))
        })?;
        if let Some(line) = line {
            let columns = format!("(numbers {} and {})", first + 1, other + 1);
            let found = format!("two columns `{}` {columns} that differ", names.cell(first));
            let advice = "export again with one of them, or give the number of the right one with --columns";
            return Err(ImportError::format(table.location(line, 1), found, "the same in both", advice));
        }
    }
    Ok(())
}

/// Finding about a point that is always at (0, 0), because it is the origin of a local coordinate system.
fn local_origin_finding(export: &TrackFile) -> Option<QualityFinding> {
    let near = |column: &Column| {
        column.has_values() && column.iter().flatten().all(|value| value.abs() <= AT_ORIGIN)
    };
    let origin = export.tracks.iter().find(|track| near(&track.x) && track.y.as_ref().is_some_and(near))?;
    let found = format!(
        "{}: `{}` stays at (0, 0): all positions are relative to it, in a local system that may also turn with the \
         object",
        export.file, origin.name
    );
    let advice = "tip minus head is right as long as both points are of this file; the head's own motion needs an \
        export in fixed coordinates";
    Some(QualityFinding::advise(
        (Check::RelativePositions, Severity::Caution),
        (AT_ORIGIN, ""),
        found,
        advice,
    ))
}
