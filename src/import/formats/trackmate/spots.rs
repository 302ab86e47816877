//! Reads TrackMate's table of spots. It has one to four header rows and no quotation marks, and its rows may
//! be in any order.

use super::{EXPORT_ADVICE, Spot, TrackMateFile, Trajectory};
use crate::import::error::{ImportError, ImportResult};
use crate::import::reader::{CellNumber, DelimitedTable, Document, RowView, TextRow};
use std::collections::HashMap;

/// Number of rows at the top that are searched for the column names: old versions write one header row, later
/// ones up to four.
const HEADER_ROWS: usize = 4;
/// Names of columns that occur only in TrackMate's tables of edges or of tracks, each with the name of its
/// table.
const OTHER_TABLES: [(&str, &str); 5] = [
    ("SPOT_SOURCE_ID", "edges"),
    ("EDGE_TIME", "edges"),
    ("LINK_COST", "edges"),
    ("NUMBER_SPOTS", "tracks"),
    ("TRACK_DURATION", "tracks"),
];
const POSITION: [&str; 2] = ["POSITION_X", "POSITION_Y"];
const FRAME: &str = "FRAME";
const TRACK: &str = "TRACK_ID";

/// Text on the feature that shows that a table is one of TrackMate's; `None` for any other table.
pub(crate) fn recognise_spots(table: &DelimitedTable) -> Option<String> {
    if let Some(row) = find_header(table) {
        return Some(format!("line {} names POSITION_X and FRAME as TrackMate does", row.1.line));
    }
    find_other_table(table).map(|(row, cell, what)| {
        format!("line {} names {} as TrackMate's table of {what} does", row.line, row.cells[cell])
    })
}

fn find_header<'t>(table: &'t DelimitedTable) -> Option<(usize, &'t TextRow)> {
    let named = |row: &TextRow| row.has(POSITION[0]) && (row.has(FRAME) || row.has(TRACK));
    table.find_row(HEADER_ROWS, named)
}

/// Finds a column that occurs only in TrackMate's tables of edges or tracks. Returns its header row, the
/// index of its cell, and the name of the table.
fn find_other_table<'t>(table: &'t DelimitedTable) -> Option<(&'t TextRow, usize, &'static str)> {
    let shows = |row: &'t TextRow| {
        let tracks = row.has(TRACK);
        OTHER_TABLES
            .iter()
            .filter(|_| tracks)
            .find_map(|(name, what)| Some((row, row.position(name)?, *what)))
    };
    table.head.iter().take(HEADER_ROWS).find_map(shows)
}

fn wrong_table_error(table: &DelimitedTable) -> ImportError {
    let (place, found) = match find_other_table(table) {
        Some((row, cell, what)) => (
            table.cell_location(row.line, cell),
            format!("TrackMate's table of {what} (column {})", row.cells[cell]),
        ),
        None => (table.location(table.first_line(), 1), "a table without POSITION_X and FRAME".to_owned()),
    };
    let expected = "its table of spots with POSITION_X, POSITION_Y, FRAME and TRACK_ID";
    ImportError::wrong_table(place, found, expected, EXPORT_ADVICE)
}

/// Indices of the columns of a table of spots.
struct SpotCells {
    id: Option<usize>,
    track: usize,
    name: Option<usize>,
    frame: usize,
    time: Option<usize>,
    position: [usize; 2],
    quality: bool,
    /// Number of cells in every row.
    width: usize,
}

impl SpotCells {
    fn find(table: &DelimitedTable, row: &TextRow) -> ImportResult<Self> {
        let at = |name: &str| row.position(name);
        let needed = |name: &str| at(name).ok_or_else(|| no_column_error(table, row, name));
        Ok(Self {
            id: at("ID"),
            track: needed(TRACK)?,
            name: at("TRACK_NAME"),
            frame: needed(FRAME)?,
            time: at("POSITION_T"),
            position: [needed(POSITION[0])?, needed(POSITION[1])?],
            quality: at("QUALITY").is_some(),
            width: row.cells.len(),
        })
    }
}

fn no_column_error(table: &DelimitedTable, row: &TextRow, name: &str) -> ImportError {
    let problem = format!(
        "found TrackMate's spots without the column {name}, expected POSITION_X, POSITION_Y, FRAME and TRACK_ID"
    );
    let unlinked = "spots that are not linked have no tracks: run the tracking, then ";
    let advice = format!("{}{EXPORT_ADVICE}", if name == TRACK { unlinked } else { "" });
    ImportError::columns(table.file, row.line, problem, advice)
}

pub(crate) fn read_spot_table<'a>(document: &'a Document<'a>) -> ImportResult<TrackMateFile<'a>> {
    let table = document.table()?;
    let (above, row) = find_header(table).ok_or_else(|| wrong_table_error(table))?;
    let cells = SpotCells::find(table, row)?;
    let start = table.first_numeric_row(above + 1, &[cells.id.unwrap_or(cells.frame), cells.position[0]]);
    let last_line = table.head.last().map_or(1, |row| row.line);
    let start = start.ok_or_else(|| ImportError::header_only(table.file, last_line))?;
    let mut found = TrackMateFile {
        table: Some(table),
        clock_cell: cells.frame,
        has_quality: cells.quality,
        ..TrackMateFile::default()
    };
    let bracketed = |row: &&TextRow| row.cell(cells.position[0]).starts_with('(');
    if let Some(units) = table.head.get(start - 1).filter(bracketed) {
        let unit = |cell: usize| units.cells.get(cell).filter(|unit| !unit.is_empty()).cloned();
        found.space_unit =
            unit(cells.position[0]).map(|text| (text, format!("the row of units, line {}", units.line)));
        found.time_unit = cells.time.and_then(unit);
    }
    table.refuse_comment_names(row.line, "a label", "rename the spot in TrackMate and export again")?;
    read_rows(table, start, &cells, &mut found)?;
    Ok(found)
}

fn read_rows(
    table: &DelimitedTable,
    start: usize,
    cells: &SpotCells,
    found: &mut TrackMateFile,
) -> ImportResult<()> {
    let mut known: HashMap<String, usize> = HashMap::new();
    let mut unlinked = 0_usize;
    let mut rows = table.rows(start);
    while let Some(record) = rows.next_row()? {
        if record.is_empty() {
            continue;
        }
        check_shift(table, &record, cells)?;
        let track = record.cell(cells.track);
        if table.parse_cell(track) == CellNumber::Missing {
            unlinked += 1;
            continue;
        }
        let value = |cell: usize, name: &str| table.number_at(&record, cell, name);
        let time = table.optional_number_at(&record, cells.time, "POSITION_T")?;
        let [x, y] = [value(cells.position[0], POSITION[0])?, value(cells.position[1], POSITION[1])?];
        let spot = Spot { line: record.line, frame: value(cells.frame, FRAME)?, time, x, y };
        let index = *known.entry(track.to_owned()).or_insert_with(|| {
            let name = cells.name.map(|cell| record.cell(cell)).filter(|name| !name.is_empty());
            let name = name.unwrap_or(track);
            found.trajectories.push(Trajectory { name: name.to_owned(), spots: vec![] });
            found.trajectories.len() - 1
        });
        if let Some(trajectory) = found.trajectories.get_mut(index) {
            trajectory.spots.push(spot);
        }
    }
    if unlinked > 0 {
        found.notes.push(format!("{unlinked} spots belong to no track and are left out"));
    }
    Ok(())
}

/// Refuses a row in which a comma within a name has shifted the cells after it. TrackMate writes names
/// without quotation marks.
fn check_shift(table: &DelimitedTable, record: &RowView, cells: &SpotCells) -> ImportResult<()> {
    let whole = |cell: usize| record.cell(cell).parse::<i64>().is_ok();
    if record.len() == cells.width && cells.id.is_none_or(whole) {
        return Ok(());
    }
    let advice = if record.len() < cells.width {
        "complete the row or export again"
    } else {
        "a comma in a name moves the cells after it, as TrackMate quotes nothing: rename the spot or track without \
         commas and export again"
    };
    let id = cells.id.map_or(String::new(), |cell| format!(" and `{}` as ID", record.cell(cell)));
    let (found, expected) = (record.len(), cells.width);
    let problem = format!("found {found} cells{id}, expected {expected} and a whole number");
    Err(ImportError::columns(table.file, record.line, problem, advice))
}
