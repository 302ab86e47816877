//! The table of spots: one to four header rows, rows in any order, nothing quoted.

use super::{EXPORT_ADVICE, Spot, TrackMateFile, Trajectory};
use crate::import::error::ImportError;
use crate::import::reader::{CellNumber, DelimitedTable, Document, RowView, TextRow};
use std::collections::HashMap;

/// Rows above the data that may name the columns; a table of results has one, later versions up to four.
const HEADER_ROWS: usize = 4;
/// What only the tables of edges, tracks and branches name.
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

/// What in a table shows that TrackMate wrote it, whichever of its tables it is.
pub(crate) fn recognise_spots(table: &DelimitedTable) -> Option<String> {
    if let Some(row) = find_header(table) {
        return Some(format!("line {} names POSITION_X and FRAME as TrackMate does", row.1.line));
    }
    find_other_table(table).map(|(row, cell, what)| {
        format!("line {} names {} as TrackMate's table of {what} does", row.line, row.cells[cell])
    })
}

fn find_header<'t>(table: &'t DelimitedTable) -> Option<(usize, &'t TextRow)> {
    let named = |row: &TextRow| {
        row.cells.iter().any(|cell| cell == POSITION[0])
            && row.cells.iter().any(|cell| cell == FRAME || cell == TRACK)
    };
    table.head.iter().enumerate().take(HEADER_ROWS).find(|(_, row)| named(row))
}

/// The row and the cell that only another of TrackMate's tables has, and what that is a table of.
fn find_other_table<'t>(table: &'t DelimitedTable) -> Option<(&'t TextRow, usize, &'static str)> {
    let shows = |row: &'t TextRow| {
        let tracks = row.cells.iter().any(|cell| cell == TRACK);
        OTHER_TABLES
            .iter()
            .filter(|_| tracks)
            .find_map(|(name, what)| Some((row, row.cells.iter().position(|cell| cell == name)?, *what)))
    };
    table.head.iter().take(HEADER_ROWS).find_map(shows)
}

fn wrong_table_error(table: &DelimitedTable) -> ImportError {
    let (place, found) = match find_other_table(table) {
        Some((row, cell, what)) => (
            table.location(row.line, table.text_column(row.line, cell)),
            format!("TrackMate's table of {what} (column {})", row.cells[cell]),
        ),
        None => (
            table.location(table.head.first().map_or(1, |row| row.line), 1),
            "a table without POSITION_X and FRAME".to_owned(),
        ),
    };
    let expected = "its table of spots with POSITION_X, POSITION_Y, FRAME and TRACK_ID".to_owned();
    ImportError::wrong_table(place, found, expected, EXPORT_ADVICE)
}

/// Cells of a spot.
struct SpotCells {
    id: Option<usize>,
    track: usize,
    name: Option<usize>,
    frame: usize,
    time: Option<usize>,
    position: [usize; 2],
    quality: bool,
    /// Cells of every row.
    width: usize,
}

impl SpotCells {
    fn find(table: &DelimitedTable, row: &TextRow) -> Result<Self, ImportError> {
        let at = |name: &str| row.cells.iter().position(|cell| cell == name);
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
    ImportError::columns(
        table.file,
        row.line,
        format!(
            "found TrackMate's spots without the column {name}, expected POSITION_X, POSITION_Y, FRAME and \
             TRACK_ID"
        ),
        if name == TRACK {
            format!("spots that are not linked have no tracks: run the tracking, then {EXPORT_ADVICE}")
        } else {
            EXPORT_ADVICE.to_owned()
        },
    )
}

pub(crate) fn read_spot_table<'a>(document: &'a Document<'a>) -> Result<TrackMateFile<'a>, ImportError> {
    let table = document.table()?;
    let (above, row) = find_header(table).ok_or_else(|| wrong_table_error(table))?;
    let cells = SpotCells::find(table, row)?;
    let start = table.first_numeric_row(above + 1, &[cells.id.unwrap_or(cells.frame), cells.position[0]]);
    let start = start.ok_or_else(|| ImportError::HeaderOnly {
        file: table.file.to_owned(),
        line: table.head.last().map_or(1, |row| row.line),
    })?;
    let mut found = TrackMateFile {
        table: Some(table),
        clock_cell: cells.frame,
        has_quality: cells.quality,
        ..TrackMateFile::default()
    };
    let bracketed =
        |row: &&TextRow| row.cells.get(cells.position[0]).is_some_and(|unit| unit.starts_with('('));
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
) -> Result<(), ImportError> {
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
        let time = cells.time.map_or(Ok(None), |cell| value(cell, "POSITION_T"))?;
        let [x, y] = [value(cells.position[0], POSITION[0])?, value(cells.position[1], POSITION[1])?];
        let spot = Spot { line: record.line, frame: value(cells.frame, FRAME)?, time, x, y };
        let index = *known.entry(track.to_owned()).or_insert_with(|| {
            let name =
                cells.name.map(|cell| record.cell(cell)).filter(|name| !name.is_empty()).unwrap_or(track);
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

/// TrackMate quotes nothing: a comma in a name moves every cell after it.
fn check_shift(table: &DelimitedTable, record: &RowView, cells: &SpotCells) -> Result<(), ImportError> {
    let whole = |cell: usize| record.cell(cell).parse::<i64>().is_ok();
    if record.len() == cells.width && cells.id.is_none_or(whole) {
        return Ok(());
    }
    let advice = match record.len().cmp(&cells.width) {
        std::cmp::Ordering::Less => "complete the row or export again",
        _ => {
            "a comma in a name moves the cells after it, as TrackMate quotes nothing: rename the spot or \
             track without commas and export again"
        }
    };
    let id = cells.id.map_or(String::new(), |cell| format!(" and `{}` as ID", record.cell(cell)));
    Err(ImportError::columns(
        table.file,
        record.line,
        format!("found {} cells{id}, expected {} and a whole number", record.len(), cells.width),
        advice,
    ))
}
