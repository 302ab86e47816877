//! Reads the sparse table of DLTdv 8, whose rows contain frame, column and value. The names of the points are
//! in a companion file.

use super::{FIRST_PIXEL, SEVERAL_CAMERAS, camera_track_name, pixel_facts};
use crate::import::error::{CellProblem, ImportError, ImportResult};
use crate::import::reader::{
    Clock, DelimitedTable, Document, Fact, RowView, TextRow, Track, TrackFile, clock_lines,
};
use crate::recording::files::YAxis;
use std::collections::BTreeMap;

/// Beginning of the first line of a table of positions in pictures. Tables of positions in space and of
/// residuals begin differently.
const TITLE: &str = "sparse format camera coordinates";
const EXPORT_AGAIN: &str = "the file was cut short or edited: export it again";

/// Positions of one point in one camera (a pair of columns x and y), by row number from 1.
type SparseFrames = BTreeMap<u64, SparsePosition>;

#[derive(Default)]
struct SparsePosition {
    line: usize,
    x: Option<f64>,
    y: Option<f64>,
}

/// Numbers in the second line of the file: rows and columns of the full table, and the number of values that
/// follow.
struct SparseTableSize {
    line: usize,
    rows: u64,
    columns: u64,
    values: u64,
}

pub(crate) fn recognise_sparse_table(table: &DelimitedTable) -> Option<String> {
    let title = table.first_texts().join(" ");
    let is_title = title.to_lowercase().starts_with(TITLE);
    is_title.then(|| format!("line {} is `{}`", table.first_line(), title.trim_end()))
}

pub(crate) fn read_sparse_table<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
) -> ImportResult<TrackFile<'a>> {
    let size = read_size(table)?;
    let names = SparsePointNames::find(document, &size)?;
    let mut pairs: BTreeMap<u64, SparseFrames> = BTreeMap::new();
    let mut rows = table.rows(2);
    let mut count = 0_u64;
    while let Some(record) = rows.next_row()? {
        if !record.is_empty() {
            let (row, column, value) = read_triplet(table, &record, &size)?;
            let entry = pairs.entry((column - 1) / 2).or_default().entry(row).or_default();
            let coordinate = if column % 2 == 1 { &mut entry.x } else { &mut entry.y };
            if coordinate.is_some() {
                return Err(ImportError::DuplicateRow {
                    place: table.location(record.line, 1),
                    what: "row",
                    found: row as f64,
                    track: format!("column {column}"),
                    first: entry.line,
                });
            }
            // (the value 0 means a missing coordinate)
            *coordinate = value.filter(|value| *value != 0.0);
            entry.line = record.line;
            count += 1;
        }
    }
    if count != size.values {
        let found = format!("{} values announced and {count} below", size.values);
        return Err(sparse_table_error(table, size.line, found, "as many as announced"));
    }
    let facts = pixel_facts(names.y_axis());
    let mut export = TrackFile { table: Some(table), facts, ..TrackFile::for_document(document) };
    for (pair, frames) in pairs {
        let name = names.name_of_pair(pair);
        add_track(&mut export, name, &frames);
    }
    export.notes.push(format!("row 1 is frame 0; {FIRST_PIXEL}"));
    export.notes.extend(names.notes());
    Ok(export)
}

/// Adds the track of a pair of columns to `export`; every track has its own clock.
fn add_track(export: &mut TrackFile, name: String, frames: &SparseFrames) {
    let lines = clock_lines(frames.values().map(|entry| entry.line));
    let numbers = frames.keys().map(|row| Some((row - 1) as f64)).collect();
    let x = frames.values().map(|entry| entry.x).collect();
    let y = Some(frames.values().map(|entry| entry.y).collect());
    export.tracks.push(Track { name, clock: export.clocks.len(), x, y, ..Track::default() });
    export.clocks.push(Clock { lines, frame: Some(numbers), ..Clock::default() });
}

fn read_size(table: &DelimitedTable) -> ImportResult<SparseTableSize> {
    let row = table.head.get(1);
    let line = row.map_or(1, |row| row.line);
    let cells = row.map(TextRow::texts).unwrap_or_default();
    let whole = |cell: usize| cells.get(cell).and_then(|text| text.parse::<u64>().ok());
    let expected = "rows, columns and values of the table as three whole numbers, with two columns a point and \
        camera";
    let refuse = |found: String| sparse_table_error(table, line, found, expected);
    let (Some(rows), Some(columns), Some(values)) = (whole(0), whole(1), whole(2)) else {
        return Err(refuse(format!("`{}`", cells.join(" "))));
    };
    if columns == 0 || columns % 2 == 1 {
        return Err(refuse(format!("{columns} columns")));
    }
    Ok(SparseTableSize { line, rows, columns, values })
}

fn read_triplet(
    table: &DelimitedTable,
    record: &RowView,
    size: &SparseTableSize,
) -> ImportResult<(u64, u64, Option<f64>)> {
    if record.used_width() != 3 {
        return Err(table.ragged_error(record.line, record.used_width(), 3));
    }
    let index =
        |cell: usize, name: &str, most: u64, expected: &'static str| match record.cell(cell).parse::<u64>() {
            Ok(index) if (1..=most).contains(&index) => Ok(index),
            _ => {
                let found = (name, record.cell(cell));
                let place = table.cell_location(record.line, cell);
                Err(ImportError::cell(place, CellProblem::NotAFrame, found, (expected, EXPORT_AGAIN)))
            }
        };
    let row = index(0, "row", size.rows, "a whole number from 1 to the rows that line 2 announces")?;
    let column =
        index(1, "column", size.columns, "a whole number from 1 to the columns that line 2 announces")?;
    Ok((row, column, table.number_at(record, 2, "value")?))
}

/// Names of the points, from which the names of the pairs of columns are made.
struct SparsePointNames {
    points: Vec<String>,
    /// Number of cameras that filmed each point; `None` if there is no list of names.
    cameras: Option<u64>,
    /// Whether DLTdv 8 wrote the list of names.
    version_8: bool,
    pairs: u64,
}

impl SparsePointNames {
    fn find(document: &Document, size: &SparseTableSize) -> ImportResult<Self> {
        let pairs = size.columns / 2;
        let mut companions = document.companions.iter();
        let list = companions.find(|(_, text)| text.to_lowercase().starts_with("pointnames"));
        let Some((file, text)) = list else {
            return Ok(Self { points: vec![], cameras: None, version_8: false, pairs });
        };
        let mut lines = text.trim_end().lines();
        let title = lines.next().unwrap_or_default();
        let points: Vec<String> = lines.map(|line| line.trim().to_owned()).collect();
        let count = points.len() as u64;
        if !pairs.is_multiple_of(count) {
            return Err(ImportError::wrong_table(
                format!("{file}:{}:1", points.len() + 1),
                format!("{count} names of points for {pairs} pairs of columns"),
                "as many names as points, each with one pair a camera",
                "put the list of names that was exported with it into its folder, or move this list \
                    and choose by columns",
            ));
        }
        Ok(Self { points, cameras: Some(pairs / count), version_8: title.contains("DLTdv8"), pairs })
    }

    /// Name of the track in a pair of columns; `pair` counts from 0. The pairs of all cameras for the first
    /// point come first, then those for the second point.
    fn name_of_pair(&self, pair: u64) -> String {
        let Some(cameras) = self.cameras else {
            let columns = format!("columns{}-{}", 2 * pair + 1, 2 * pair + 2);
            return if self.pairs == 1 { "pt1".to_owned() } else { columns };
        };
        let point = usize::try_from(pair / cameras).ok().and_then(|point| self.points.get(point));
        let name = point.filter(|name| !name.is_empty());
        let name = name.cloned().unwrap_or_else(|| format!("pt{}", pair / cameras + 1));
        camera_track_name(&name, &(pair % cameras + 1).to_string(), cameras > 1)
    }

    fn y_axis(&self) -> Fact<YAxis> {
        let why = "the list of names in its folder is one of DLTdv 8, which counts pixels from the top of the \
            picture";
        self.version_8.then(|| (YAxis::Down, why.to_owned()))
    }

    fn notes(&self) -> Option<String> {
        let no_list = "no list of names (the file whose name has pointNames in place of xypts) lies in its folder: \
            tracks are called by their columns, which are x and y of the first point in every camera, then of the \
            second";
        match self.cameras {
            None => Some(no_list.to_owned()),
            Some(1) => None,
            Some(_) => Some(SEVERAL_CAMERAS.to_owned()),
        }
    }
}

fn sparse_table_error(table: &DelimitedTable, line: usize, found: String, expected: &str) -> ImportError {
    ImportError::wrong_table(table.location(line, 1), found, expected, EXPORT_AGAIN)
}
