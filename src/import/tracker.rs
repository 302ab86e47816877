//! Tracker (Open Source Physics): tables written by File > Export > Data, and tables copied from its data view.

use super::dialect::{Cell, Row, Table};
use super::error::ImportError;
use super::options::Options;
use super::{Document, Export, Format, Stamp, Track};

/// Rows above the data that may hold names.
const HEADER_ROWS: usize = 6;
/// Positions in world coordinates, y upwards unless the axes were turned.
const WORLD: [&str; 2] = ["x", "y"];
/// Positions in image pixels, y downwards. `px` and `py` are momentum in Tracker and never positions.
const IMAGE: [&str; 2] = ["pixelx", "pixely"];
const TIME: &str = "t";
const FRAME: &str = "frame";

/// Tracker's tables.
pub struct Tracker;

impl Format for Tracker {
    fn name(&self) -> &'static str {
        "tracker"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let table = document.table.as_ref().ok()?;
        let header = header(table)?;
        let line = table.rows.get(header)?.line;
        if table.multi {
            return Some(format!("line 1 is `#multi:` and line {line} names t, x and y"));
        }
        let names = names(table.rows.get(header)?);
        (names.contains(&TIME) && (names.contains(&"x") || names.contains(&"pixelx"))).then(|| format!("line {line} names t and positions as Tracker does"))
    }

    fn read(&self, document: &Document, _options: &Options) -> Result<Export, ImportError> {
        let table = document.table()?;
        let header = header(table).ok_or_else(|| no_header(table))?;
        let layout = Layout::read(table, header, document.stem)?;
        let rows = table.rows.get(header + 1..).unwrap_or_default();
        let mut export = layout.empty_export(document, rows.len());
        for row in rows {
            layout.check_length(table, row)?;
            layout.add(table, row, &mut export)?;
        }
        Ok(export)
    }
}

/// Index of the row of column names.
fn header(table: &Table) -> Option<usize> {
    let is_header = |row: &Row| {
        let names = names(row);
        (names.contains(&TIME) || names.contains(&FRAME)) && !names.iter().any(|name| name.parse::<f64>().is_ok())
    };
    table.rows.iter().take(HEADER_ROWS).position(is_header)
}

fn names<'a>(row: &Row<'a>) -> Vec<&'a str> {
    row.cells.iter().map(|cell| cell.text).collect()
}

fn no_header(table: &Table) -> ImportError {
    let found: Vec<&str> = table.rows.first().map(names).unwrap_or_default();
    ImportError::Columns {
        file: table.file.to_owned(),
        line: table.rows.first().map_or(1, |row| row.line),
        problem: format!("found `{}` and no row that names the columns, expected one with `t` or `frame`, `x` and `y`", found.join(" ")),
        advice: "export with column names, or name the columns by number: --format generic --columns time=1,tip-x=2,tip-y=3,...".to_owned(),
    }
}

/// Where everything stands in a row.
struct Layout {
    time: Option<usize>,
    frame: Option<usize>,
    /// Cells of a data row, without a trailing delimiter.
    cells: usize,
    tracks: Vec<Place>,
    notes: Vec<String>,
    seen: Vec<String>,
}

struct Place {
    name: String,
    x: usize,
    y: Option<usize>,
}

impl Layout {
    fn read(table: &Table, header: usize, stem: &str) -> Result<Self, ImportError> {
        let row = &table.rows[header];
        let columns = names(row);
        let cells = columns.iter().rposition(|name| !name.is_empty()).map_or(0, |last| last + 1);
        let at = |name: &str| columns.iter().position(|column| *column == name);
        let titles = header.checked_sub(1).and_then(|above| table.rows.get(above)).map(names).unwrap_or_default();
        let pair = if columns.contains(&WORLD[0]) { WORLD } else { IMAGE };
        let mut layout = Self { time: at(TIME), frame: at(FRAME), cells, tracks: vec![], notes: vec![], seen: vec![] };
        layout.seen = titles.iter().filter(|title| !title.is_empty()).map(|title| (*title).to_owned()).collect();
        layout.find_tracks(&columns, &titles, pair);
        if layout.tracks.is_empty() {
            return Err(no_positions(table, row, &columns));
        }
        if pair == IMAGE {
            layout.notes.push("positions are Tracker's pixelx and pixely: image pixels, y downwards".to_owned());
        }
        layout.name_unnamed(stem);
        Ok(layout)
    }

    /// A track is an x and the next y before another x; its title stands above it or to its left.
    fn find_tracks(&mut self, columns: &[&str], titles: &[&str], [x_name, y_name]: [&str; 2]) {
        let title_of = |column: usize| titles.iter().take(column + 1).rposition(|title| !title.is_empty()).map(|at| (at, titles[at]));
        let mut seen_titles: Vec<usize> = vec![];
        for (x, _) in columns.iter().enumerate().filter(|(_, name)| **name == x_name) {
            let title = title_of(x);
            if let Some((at, _)) = title {
                if seen_titles.contains(&at) {
                    continue; // a second x under one title is a user's own column
                }
                seen_titles.push(at);
            }
            let next_x = columns.iter().skip(x + 1).position(|name| *name == x_name).map_or(columns.len(), |ahead| x + 1 + ahead);
            let same_track = |y: &usize| title_of(*y).map(|t| t.0) == title.map(|t| t.0);
            let y = (0..next_x).filter(|&y| columns[y] == y_name && (y > x || title.is_some())).find(same_track);
            self.tracks.push(Place { name: title.map_or_else(String::new, |t| t.1.to_owned()), x, y });
        }
    }

    /// Without a row of titles a single track takes the name of its file, several are numbered.
    fn name_unnamed(&mut self, stem: &str) {
        let several = self.tracks.len() > 1;
        for (index, track) in self.tracks.iter_mut().enumerate().filter(|(_, track)| track.name.is_empty()) {
            track.name = if several { format!("track{}", index + 1) } else { stem.to_owned() };
            self.notes.push(format!("the table does not name its tracks; columns {} is called `{}`", track.x + 1, track.name));
        }
    }

    fn empty_export(&self, document: &Document, rows: usize) -> Export {
        let track = |place: &Place| Track { name: place.name.clone(), x: Vec::with_capacity(rows), y: Vec::with_capacity(rows), confidence: None };
        Export {
            file: document.file.to_owned(),
            stem: document.stem.to_owned(),
            stamps: vec![],
            tracks: self.tracks.iter().map(track).collect(),
            notes: self.notes.clone(),
            texts: self.seen.clone(),
        }
    }

    /// Missing cells may not be left off, and nothing may follow the last column.
    fn check_length(&self, table: &Table, row: &Row) -> Result<(), ImportError> {
        let extra = row.cells.get(self.cells..).unwrap_or_default().iter().any(|cell| !cell.text.is_empty());
        if row.cells.len() < self.cells || extra {
            return Err(ImportError::Ragged { place: table.place(row.line, 1), found: row.cells.len(), expected: self.cells });
        }
        Ok(())
    }

    fn add(&self, table: &Table, row: &Row, export: &mut Export) -> Result<(), ImportError> {
        let cell = |at: usize| row.cells.get(at).copied().unwrap_or(Cell { text: "", column: 1 });
        let number = |at: usize, name: &str| table.value(row.line, &cell(at), name);
        let stamp = |at: Option<usize>, name| at.map_or(Ok(None), |at| number(at, name));
        let column = self.frame.or(self.time).map_or(1, |at| cell(at).column);
        export.stamps.push(Stamp { line: row.line, column, frame: stamp(self.frame, FRAME)?, time_s: stamp(self.time, TIME)? });
        for (place, track) in self.tracks.iter().zip(&mut export.tracks) {
            track.x.push(number(place.x, &format!("x of {}", place.name))?);
            track.y.push(place.y.map_or(Ok(None), |y| number(y, &format!("y of {}", place.name)))?);
        }
        Ok(())
    }
}

fn no_positions(table: &Table, row: &Row, columns: &[&str]) -> ImportError {
    let momentum = columns.contains(&"px") || columns.contains(&"py");
    let remedy = "export again with the columns t, x and y selected";
    ImportError::Columns {
        file: table.file.to_owned(),
        line: row.line,
        problem: format!("found the columns {}, expected x and y (or pixelx and pixely)", columns.join(", ")),
        advice: if momentum { format!("px and py are momentum in Tracker, not pixels: {remedy}") } else { remedy.to_owned() },
    }
}
