//! Reads Kinovea's text export, which is made for gnuplot. It has a block of rows for each track, and each
//! block has its own times.

use super::PREFERENCES_NOTE;
use crate::import::error::{CellProblem, ImportError, ImportResult, TextLocation};
use crate::import::reader::table::column_of_word;
use crate::import::reader::{
    CellNumber, Document, Facts, InstanceFields, PointFields, RowOrder, RowPosition, RowStamp, TimeUnit,
    TrackCollector, TrackFile, parse_number,
};

/// Beginning of the first line of the text export.
pub(super) const TITLE: &str = "#Kinovea";
/// Line that names the columns.
const COLUMNS: &str = "#T X Y";
/// Number of cells in a row with one point: time, x and y.
const CELLS: usize = 3;

/// Rows of one track.
#[derive(Default)]
struct TrackBlock {
    name: String,
    /// Number of cells in a row, and the rows of the track; `None` until its first row is read.
    rows: Option<(usize, TrackCollector)>,
}

pub(crate) fn read_text_export<'a>(document: &'a Document<'a>) -> ImportResult<TrackFile<'a>> {
    let facts = Facts { time: TimeUnit::Unknown, ..Facts::default() };
    let mut export = TrackFile { facts, ..TrackFile::for_document(document) };
    let marks = find_decimal_marks(document.text);
    let (mut block, mut last) = (TrackBlock::default(), 1);
    for (index, line) in document.text.lines().enumerate() {
        let trimmed = line.trim();
        last = if trimmed.is_empty() { last } else { index + 1 };
        if let Some(name) = trimmed.strip_prefix('#') {
            if !trimmed.starts_with(TITLE) && trimmed != COLUMNS {
                let next = TrackBlock { name: name.trim().to_owned(), rows: None };
                std::mem::replace(&mut block, next).finish(&mut export)?;
            }
        } else if !trimmed.is_empty() {
            let place = TextLocation { file: document.file.to_owned(), line: index + 1, column: 1 };
            block.read_row(place, line, marks)?;
        } else if block.rows.is_some() {
            // (a blank line ends a track, unless it is above the first row)
            std::mem::take(&mut block).finish(&mut export)?;
        }
    }
    block.finish(&mut export)?;
    if export.clocks.is_empty() {
        return Err(ImportError::header_only(document.file, last));
    }
    if marks[0] != marks[1] {
        let [times, positions] = marks;
        let note = format!("the decimal mark of the times is `{times}`, that of the positions `{positions}`");
        export.notes.push(note);
    }
    export.notes.push(PREFERENCES_NOTE.to_owned());
    Ok(export)
}

/// The decimal marks of the times and of the positions, which differ in files of old versions.
fn find_decimal_marks(text: &str) -> [char; 2] {
    let rows = || text.lines().filter(|line| !line.trim_start().starts_with('#'));
    let first_mark = |cells: Vec<&str>| {
        cells.into_iter().flat_map(str::chars).find(|c| matches!(c, '.' | ',')).unwrap_or('.')
    };
    let times = rows().filter_map(|row| row.split_whitespace().next()).collect();
    [first_mark(times), first_mark(rows().flat_map(|row| row.split_whitespace().skip(1)).collect())]
}

impl TrackBlock {
    fn read_row(&mut self, place: TextLocation, text: &str, marks: [char; 2]) -> ImportResult<()> {
        let cells: Vec<&str> = text.split_whitespace().collect();
        let found = cells.len();
        let expected = self.rows.as_ref().map_or(CELLS, |rows| rows.0);
        let first = self.rows.is_none() && found > CELLS && found % 2 == 1;
        if found != expected && !first {
            return Err(ImportError::ragged_row(place, found, expected));
        }
        let mut numbers = vec![];
        for (at, cell) in cells.iter().enumerate() {
            numbers.push(match parse_number(cell, marks[at.min(1)]) {
                CellNumber::Value(value) => Some(value),
                CellNumber::Missing => None,
                CellNumber::Text => {
                    let remedy = (
                        "a number with the decimal mark of the column's other numbers",
                        "export again with one format of numbers, or the CSV of the trajectories; a lost point is NaN",
                    );
                    let name = ["T", "X", "Y"][if at == 0 { 0 } else { 2 - at % 2 }];
                    let place = TextLocation { column: column_of_word(text, at), ..place };
                    return Err(ImportError::cell(place, CellProblem::NotANumber, (name, cell), remedy));
                }
            });
        }
        let name = &self.name;
        let (_, collector) =
            self.rows.get_or_insert_with(|| (found, TrackCollector::new(fields(name, found / 2))));
        let position = |pair: &[Option<f64>]| RowPosition { x: pair[0], y: pair[1], confidence: None };
        let positions: Vec<RowPosition> = numbers[1..].chunks_exact(2).map(position).collect();
        collector.add_row("", RowStamp { line: place.line, frame: None, time: numbers[0] }, &positions);
        Ok(())
    }

    /// Adds the tracks of the block to the export. A block without a name is called by its number.
    fn finish(self, export: &mut TrackFile) -> ImportResult<()> {
        let Some((_, collector)) = self.rows else { return Ok(()) };
        let (clocks, mut tracks) = collector.finish(export.file, RowOrder::AsWritten)?;
        for track in &mut tracks {
            track.clock += export.clocks.len();
            if self.name.is_empty() {
                track.name = format!("track{}{}", export.clocks.len() + 1, track.name);
            }
        }
        export.clocks.extend(clocks);
        export.tracks.extend(tracks);
        Ok(())
    }
}

/// Fields of the rows of a block. The points of an object are numbered, because this export does not name
/// them.
fn fields(name: &str, points: usize) -> InstanceFields {
    let called = |index: usize| if points == 1 { name.to_owned() } else { format!("{name}/{}", index + 1) };
    let points = (0..points)
        .map(|index| PointFields { name: called(index), has_y: true, ..PointFields::default() })
        .collect();
    InstanceFields { has_frame: false, has_time: true, clock_cell: 0, points }
}
