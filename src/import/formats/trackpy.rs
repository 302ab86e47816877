//! Reads trackpy's table of linked features, saved with `to_csv`. The column y comes before x, and an index
//! column without a name may come before both.

use crate::import::error::{ImportError, ImportResult};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{
    DelimitedTable, Document, Facts, PointCells, RowOrder, TableLayout, TextRow, TrackFile,
};

const PARTICLE: &str = "particle";
const FRAME: &str = "frame";
/// Columns with properties of a feature, by their names in trackpy.
const FEATURE_PROPERTIES: [&str; 6] = ["mass", "ecc", "signal", "raw_mass", "ep", "size"];
/// A table without the column `particle` is trackpy's if it has at least this number of the columns in
/// [`FEATURE_PROPERTIES`].
const MIN_FEATURE_PROPERTIES: usize = 3;

/// Number of rows at the top that are searched for the column names; a user may have added lines above them.
const HEADER_ROWS: usize = 3;

pub(crate) struct Trackpy;

/// Whether a row is the header of trackpy's table of features, linked to particles or not.
fn is_feature_header(names: &[&str]) -> bool {
    let at = |name: &str| names.iter().position(|known| *known == name);
    let (Some(x), Some(y), Some(_)) = (at("x"), at("y"), at(FRAME)) else { return false };
    let features = FEATURE_PROPERTIES.iter().filter(|name| names.contains(name)).count();
    if at(PARTICLE).is_some() { features > 0 || y < x } else { features >= MIN_FEATURE_PROPERTIES }
}

impl FileFormat for Trackpy {
    fn name(&self) -> &'static str {
        "trackpy"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let table = document.table.as_ref().ok()?;
        let (_, row) = table.find_row(HEADER_ROWS, |row| is_feature_header(&row.texts()))?;
        Some(format!("line {} names frame, x, y and the properties of features as trackpy does", row.line))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        let refuse = || no_column_error(table, table.head.first(), "save the table with its column names");
        let found = table.find_row(HEADER_ROWS, |row| row.has("x") && row.has("y"));
        let (header, row) = found.ok_or_else(refuse)?;
        let at = |name: &str| row.position(name);
        let particle = at(PARTICLE).ok_or_else(|| unlinked_error(table, row.line))?;
        let frame = find_frame_column(table, header, row)?;
        let (Some(frame), Some(x), Some(y)) = (frame, at("x"), at("y")) else {
            return Err(no_column_error(table, Some(row), "save the table of the linked features"));
        };
        let layout = TableLayout {
            start: header + 1,
            width: [particle, frame, x, y].into_iter().max().unwrap_or(0) + 1,
            most: row.cells.len(),
            frame: Some(frame),
            key: vec![particle],
            skip_nameless: true,
            order: RowOrder::Any,
            points: vec![PointCells::new("", x, Some(y))],
            ..TableLayout::default()
        };
        let facts = Facts::pixels_down("trackpy writes image coordinates, y along the rows of the image");
        let mut export = layout.read_tracks(document, table, facts)?;
        if export.tracks.is_empty() {
            return Err(unlinked_error(table, row.line));
        }
        // (pandas writes the number of a particle as `0.0` if the column has a missing value in any row)
        for track in &mut export.tracks {
            if let Some(whole) = track.name.strip_suffix(".0") {
                track.name = whole.to_owned();
            }
        }
        Ok(export)
    }
}

/// Error for a table that lacks one of trackpy's columns.
fn no_column_error(table: &DelimitedTable, row: Option<&TextRow>, advice: &str) -> ImportError {
    let names = row.map(TextRow::texts).unwrap_or_default();
    let found = names.into_iter().take(12).collect::<Vec<_>>().join(", ");
    let problem = format!("found the columns {found}, expected frame, particle, y and x");
    ImportError::columns(table.file, row.map_or(1, |row| row.line), problem, advice)
}

/// Index of the column of frame numbers. The table has two such columns if the frame number is also the index
/// of the rows.
///
/// # Errors
/// [`ImportError::Unusable`] if the two columns differ in a row.
fn find_frame_column(table: &DelimitedTable, header: usize, names: &TextRow) -> ImportResult<Option<usize>> {
    let mut at = names.cells.iter().enumerate().filter(|(_, cell)| *cell == FRAME).map(|(index, _)| index);
    let Some(first) = at.next() else { return Ok(None) };
    for other in at {
        if let Some(line) = first_difference(table, header + 1, [first, other])? {
            let problem = format!(
                "found two columns `{FRAME}` (numbers {} and {}) that differ, expected the same in both",
                first + 1,
                other + 1
            );
            let advice = "export again with one of them, or give the number of the right one with --columns";
            return Err(ImportError::columns(table.file, line, problem, advice));
        }
    }
    Ok(Some(first))
}

/// Line number of the first row in which the cells of two columns differ.
fn first_difference(table: &DelimitedTable, start: usize, cells: [usize; 2]) -> ImportResult<Option<usize>> {
    let mut rows = table.rows(start);
    while let Some(record) = rows.next_row()? {
        let [first, other] = cells.map(|cell| table.parse_cell(record.cell(cell)));
        if first != other {
            return Ok(Some(record.line));
        }
    }
    Ok(None)
}

/// Error for features that are not linked to particles.
fn unlinked_error(table: &DelimitedTable, line: usize) -> ImportError {
    ImportError::wrong_table(
        table.location(line, 1),
        "trackpy's table of features that are not linked (no particle)",
        "linked features with the columns frame, particle, y and x",
        "link them with trackpy.link(features, ...) and save its result with to_csv",
    )
}
