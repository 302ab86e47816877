//! trackpy: its table of linked features, saved with `to_csv`. y stands before x, and the unnamed index may
//! come first.

use super::FileFormat;
use crate::import::error::ImportError;
use crate::import::options::ImportOptions;
use crate::import::reader::{
    DelimitedTable, Document, Facts, PointCells, RowOrder, TableLayout, TextRow, TrackFile,
};

const PARTICLE: &str = "particle";
const FRAME: &str = "frame";
/// Properties of a feature that nothing else calls so all together.
const FEATURE_PROPERTIES: [&str; 6] = ["mass", "ecc", "signal", "raw_mass", "ep", "size"];
/// Features that a table of one's own may not have by chance.
const MIN_FEATURE_PROPERTIES: usize = 3;

/// Rows at the top that may hold the names: the first, unless a line of somebody's own was put above it.
const HEADER_ROWS: usize = 3;

pub(crate) struct Trackpy;

/// The first row whose cells `names` accepts, with its index.
fn find_header<'t>(
    table: &'t DelimitedTable,
    names: impl Fn(&[&str]) -> bool,
) -> Option<(usize, &'t TextRow)> {
    table.head.iter().enumerate().take(HEADER_ROWS).find(|(_, row)| names(&row.texts()))
}

/// Whether a row names a table of features, linked or not.
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
        let (_, row) = find_header(document.table.as_ref().ok()?, is_feature_header)?;
        Some(format!("line {} names frame, x, y and the properties of features as trackpy does", row.line))
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        _options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let plain = |names: &[&str]| names.contains(&"x") && names.contains(&"y");
        let (header, row) = find_header(table, plain).ok_or_else(|| {
            no_column_error(table, table.head.first(), "save the table with its column names")
        })?;
        let at = |name: &str| row.cells.iter().position(|cell| cell == name);
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
        strip_zero_fraction(&mut export);
        Ok(export)
    }
}

/// The refusal of a table without a column that trackpy always writes.
fn no_column_error(table: &DelimitedTable, row: Option<&TextRow>, advice: &str) -> ImportError {
    let names = row.map(TextRow::texts).unwrap_or_default();
    let found = names.into_iter().take(12).collect::<Vec<_>>().join(", ");
    let problem = format!("found the columns {found}, expected frame, particle, y and x");
    ImportError::columns(table.file, row.map_or(1, |row| row.line), problem, advice)
}

/// The column of the frames. Where it is the index too it stands twice, and both have to say the same in every
/// row.
///
/// # Errors
/// [`ImportError::Columns`] for two such columns that differ, with the first such line.
fn find_frame_column(
    table: &DelimitedTable,
    header: usize,
    names: &TextRow,
) -> Result<Option<usize>, ImportError> {
    let mut at = names.cells.iter().enumerate().filter(|(_, cell)| *cell == FRAME).map(|(index, _)| index);
    let Some(first) = at.next() else { return Ok(None) };
    for other in at {
        if let Some(line) = first_difference(table, header + 1, [first, other])? {
            return Err(ImportError::columns(
                table.file,
                line,
                format!(
                    "found two columns `{FRAME}` (numbers {} and {}) that differ, expected the same in both",
                    first + 1,
                    other + 1
                ),
                "export again with one of them, or give the number of the right one with --columns",
            ));
        }
    }
    Ok(Some(first))
}

/// Line of the first row in which two cells do not say the same.
fn first_difference(
    table: &DelimitedTable,
    start: usize,
    cells: [usize; 2],
) -> Result<Option<usize>, ImportError> {
    let mut rows = table.rows(start);
    while let Some(record) = rows.next_row()? {
        let [first, other] = cells.map(|cell| table.parse_cell(record.cell(cell)));
        if first != other {
            return Ok(Some(record.line));
        }
    }
    Ok(None)
}

/// The refusal of features that belong to no particle.
fn unlinked_error(table: &DelimitedTable, line: usize) -> ImportError {
    ImportError::wrong_table(
        table.location(line, 1),
        "trackpy's table of features that are not linked (no particle)",
        "linked features with the columns frame, particle, y and x",
        "link them with trackpy.link(features, ...) and save its result with to_csv",
    )
}

/// Particles are numbers, which pandas writes as `0.0` where one was missing.
fn strip_zero_fraction(export: &mut TrackFile) {
    for track in &mut export.tracks {
        if let Some(whole) = track.name.strip_suffix(".0") {
            track.name = whole.to_owned();
        }
    }
}
