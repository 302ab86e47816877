//! Reads the sparse table of DLTdv 8, whose rows contain frame, column and value. The names of the points are
//! in a companion file.

use super::{FIRST_PIXEL, SEVERAL_CAMERAS, camera_track_name, pixel_facts};
use crate::import::error::{CellProblem, ImportError, ImportResult};
use crate::import::reader::{Clock, DelimitedTable, Document, Track, TrackFile, clock_lines};
use crate::recording::files::YAxis;
use std::collections::BTreeMap;

/// First line of a table of positions in pictures, in lower case.
pub(super) const TITLE: &str = "sparse format camera coordinates";
const EXPORT_AGAIN: &str = "the file was cut short or edited: export it again";

/// Positions in a pair of columns. The key is the row number, which counts frames; the value contains the
/// line number in the file, and x and y.
type SparseFrames = BTreeMap<u64, (usize, [Option<f64>; 2])>;

pub(super) fn recognise_sparse_table(table: &DelimitedTable) -> Option<String> {
    let title = table.first_texts().join(" ");
    let is_title = title.to_lowercase().starts_with(TITLE);
    is_title.then(|| format!("line {} is `{}`", table.first_line(), title.trim_end()))
}

pub(super) fn read_sparse_table<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
) -> ImportResult<TrackFile<'a>> {
    let row = table.head.get(1).ok_or_else(|| ImportError::header_only(table.file, 1))?;
    let announced = [0, 1, 2].map(|cell| row.cell(cell).parse::<u64>().ok());
    let [Some(row_count), Some(column_count), Some(value_count)] = announced else {
        return Err(sparse_table_error(table, row.line, format!("`{}`", row.texts().join(" "))));
    };
    if column_count == 0 || column_count % 2 == 1 {
        return Err(sparse_table_error(table, row.line, format!("{column_count} columns")));
    }
    let mut pairs: BTreeMap<u64, SparseFrames> = BTreeMap::new();
    let (mut rows, mut count) = (table.rows(2), 0_u64);
    while let Some(record) = rows.next_row()? {
        if record.is_empty() {
            continue;
        }
        table.check_row_length(&record, 3, 3)?;
        let index = |cell: usize, name: &str, most: u64| {
            let found = record.cell(cell);
            found.parse::<u64>().ok().filter(|index| (1..=most).contains(index)).ok_or_else(|| {
                let place = table.cell_location(record.line, cell);
                let remedy = ("a whole number from 1 to that which line 2 announces", EXPORT_AGAIN);
                ImportError::cell(place, CellProblem::NotAFrame, (name, found), remedy)
            })
        };
        let (row, column) = (index(0, "row", row_count)?, index(1, "column", column_count)?);
        let entry = pairs.entry((column - 1) / 2).or_default().entry(row).or_default();
        let coordinate = &mut entry.1[usize::from(column % 2 == 0)];
        if coordinate.is_some() {
            let place = table.location(record.line, 1);
            let (track, first) = (format!("column {column}"), entry.0);
            return Err(ImportError::DuplicateRow { place, what: "row", found: row as f64, track, first });
        }
        // (a zero means a missing value)
        *coordinate = table.number_at(&record, 2, "value")?.filter(|value| *value != 0.0);
        entry.0 = record.line;
        count += 1;
    }
    if count != value_count {
        return Err(sparse_table_error(
            table,
            row.line,
            format!("{value_count} values announced and {count} below"),
        ));
    }
    let names = SparsePointNames::find(document, column_count / 2)?;
    let why =
        "the list of names in its folder is one of DLTdv 8, which counts pixels from the top of the picture";
    let facts = pixel_facts(names.version_8.then(|| (YAxis::Down, why.to_owned())));
    let mut export = TrackFile { table: Some(table), facts, ..TrackFile::for_document(document) };
    for (pair, frames) in pairs {
        let column = |axis: usize| frames.values().map(|entry| entry.1[axis]).collect();
        let (name, clock) = (names.name_of_pair(pair), export.clocks.len());
        export.tracks.push(Track { name, clock, x: column(0), y: Some(column(1)), ..Track::default() });
        let lines = clock_lines(frames.values().map(|entry| entry.0));
        let frame = Some(frames.keys().map(|row| Some((row - 1) as f64)).collect());
        export.clocks.push(Clock { lines, frame, ..Clock::default() });
    }
    export.notes.push(format!("row 1 is frame 0; {FIRST_PIXEL}"));
    let no_list = "no list of names (the file whose name has pointNames in place of xypts) lies in its folder: \
        tracks are called by their columns, which are x and y of the first point in every camera, then of the \
        second";
    match names.cameras {
        None => export.notes.push(no_list.to_owned()),
        Some(cameras) => export.notes.extend((cameras > 1).then(|| SEVERAL_CAMERAS.to_owned())),
    }
    Ok(export)
}

/// Names for the pairs of columns.
#[derive(Default)]
struct SparsePointNames {
    points: Vec<String>,
    /// Number of cameras that filmed each point; `None` if there is no list of names.
    cameras: Option<u64>,
    /// Whether DLTdv 8 wrote the list of names.
    version_8: bool,
}

impl SparsePointNames {
    fn find(document: &Document, pairs: u64) -> ImportResult<Self> {
        let mut companions = document.companions.iter();
        let list = companions.find(|(_, text)| text.to_lowercase().starts_with("pointnames"));
        let Some((file, text)) = list else { return Ok(Self::default()) };
        let mut lines = text.trim_end().lines();
        let version_8 = lines.next().unwrap_or_default().contains("DLTdv8");
        let points: Vec<String> = lines.map(|line| line.trim().to_owned()).collect();
        let count = points.len() as u64;
        if !pairs.is_multiple_of(count) {
            let place = format!("{file}:{}:1", count + 1);
            let found = format!("{count} names of points for {pairs} pairs of columns");
            let expected = "as many names as points, each with one pair a camera";
            let advice = "put the list of names that was exported with it into its folder, or move this list and \
                choose by columns";
            return Err(ImportError::wrong_table(place, found, expected, advice));
        }
        Ok(Self { points, cameras: Some(pairs / count), version_8 })
    }

    /// Name of the track in a pair of columns; `pair` counts from 0. The pairs of all cameras for the first
    /// point come first, then those for the second point.
    fn name_of_pair(&self, pair: u64) -> String {
        let Some(cameras) = self.cameras else { return format!("columns{}-{}", 2 * pair + 1, 2 * pair + 2) };
        let point = usize::try_from(pair / cameras).ok().and_then(|point| self.points.get(point));
        let name = point.filter(|name| !name.is_empty()).cloned();
        let name = name.unwrap_or_else(|| format!("pt{}", pair / cameras + 1));
        camera_track_name(&name, &(pair % cameras + 1).to_string(), cameras > 1)
    }
}

fn sparse_table_error(table: &DelimitedTable, line: usize, found: String) -> ImportError {
    let expected = "the numbers of rows, of columns (two a point and camera) and of values below";
    ImportError::wrong_table(table.location(line, 1), found, expected, EXPORT_AGAIN)
}
