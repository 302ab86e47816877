//! The rows above the numbers: who predicted, which individual, which body part, which coordinate.

use crate::import::error::ImportError;
use crate::import::reader::{DelimitedTable, PointCells, TextRow};

/// First cells of the header rows; a table of one animal has no `individuals`.
pub(crate) const ROW_NAMES: [&str; 4] = ["scorer", "individuals", "bodyparts", "coords"];
/// Individual to which DeepLabCut counts the body parts that exist once.
const UNIQUE_INDIVIDUAL: &str = "single";
/// Cells in front of the coordinates: a frame number or the path of a picture, or that path in three parts.
const INDEX_CELLS: [usize; 2] = [1, 3];
const HEADER_ADVICE: &str = "the rows above the numbers are scorer, bodyparts, coords, with individuals in \
    second place if there are several; restore them as DeepLabCut wrote them, or have it write the table \
    again";

/// What the header says.
pub(crate) struct DeepLabCutHeader {
    /// Row of the head in which the numbers start.
    pub start: usize,
    /// Cells in front of the coordinates.
    pub index_cells: usize,
    /// Cells of a row.
    pub cells: usize,
    pub points: Vec<PointCells>,
    pub scorers: Vec<String>,
    /// Coordinates that are not read.
    ignored: Vec<String>,
}

/// A body part of an individual.
#[derive(PartialEq)]
struct BodyPart<'t> {
    scorer: &'t str,
    individual: &'t str,
    name: &'t str,
}

/// Columns of a part: x, y, likelihood.
#[derive(Default)]
struct BodyPartCells([Option<usize>; 3]);

const COORDINATES: [&str; 3] = ["x", "y", "likelihood"];

impl DeepLabCutHeader {
    pub(crate) fn find(table: &DelimitedTable) -> Result<Self, ImportError> {
        let rows = header_rows(table)?;
        let coordinates = rows[rows.len() - 1];
        let cells = coordinates.used_width();
        let index_cells = count_index_cells(table, coordinates)?;
        let mut header =
            Self { start: rows.len(), index_cells, cells, points: vec![], scorers: vec![], ignored: vec![] };
        let mut parts: Vec<(BodyPart, BodyPartCells)> = vec![];
        for cell in index_cells..cells {
            header.add_column(table, &rows, cell, &mut parts)?;
        }
        let mut individuals: Vec<&str> =
            parts.iter().map(|(part, _)| part.individual).filter(|name| *name != UNIQUE_INDIVIDUAL).collect();
        individuals.dedup();
        for (part, cells) in &parts {
            let name = if individuals.len() < 2 || part.individual == UNIQUE_INDIVIDUAL {
                part.name.to_owned()
            } else {
                format!("{}:{}", part.individual, part.name)
            };
            header.points.push(point_cells(table, coordinates, name, cells)?);
            if !header.scorers.iter().any(|scorer| scorer == part.scorer) {
                header.scorers.push(part.scorer.to_owned());
            }
        }
        if header.points.is_empty() {
            Err(header_error(
                table,
                coordinates,
                "no column named x or y".to_owned(),
                "x and y of every body part",
            ))
        } else {
            Ok(header)
        }
    }

    /// Takes a column to its body part.
    fn add_column<'t>(
        &mut self,
        table: &DelimitedTable,
        rows: &[&'t TextRow],
        cell: usize,
        parts: &mut Vec<(BodyPart<'t>, BodyPartCells)>,
    ) -> Result<(), ImportError> {
        let text = |row: usize| rows.get(row).and_then(|row| row.cells.get(cell)).map_or("", String::as_str);
        let last = rows.len() - 1;
        let coordinate = text(last);
        let line = rows[last].line;
        if coordinate == "z" {
            return Err(ImportError::wrong_table(
                table.location(line, table.text_column(line, cell)),
                "a z: positions in space from several cameras",
                "x and y of one camera's picture",
                "import the table of one camera as analyze_videos writes it",
            ));
        }
        let Some(kind) = COORDINATES.iter().position(|name| *name == coordinate) else {
            if !coordinate.is_empty() && !self.ignored.iter().any(|name| name == coordinate) {
                self.ignored.push(coordinate.to_owned());
            }
            return Ok(());
        };
        let part = BodyPart {
            scorer: text(0),
            individual: if last == 3 { text(1) } else { "" },
            name: text(last - 1),
        };
        if part.name.is_empty() {
            let row = rows[last - 1];
            return Err(header_error(
                table,
                row,
                format!("no name in cell {}", cell + 1),
                "the name of a body part above each coordinate",
            ));
        }
        let at = parts.iter().position(|(known, _)| *known == part).unwrap_or(parts.len());
        if at == parts.len() {
            parts.push((part, BodyPartCells::default()));
        }
        if parts[at].1.0[kind].replace(cell).is_some() {
            let found = format!("a second {coordinate} of `{}` in cell {}", parts[at].0.name, cell + 1);
            return Err(header_error(
                table,
                rows[last],
                found,
                "each coordinate of a body part once (of several animals: a row `individuals`)",
            ));
        }
        Ok(())
    }

    /// What is left out.
    pub(crate) fn ignored_columns_note(&self) -> Option<String> {
        (!self.ignored.is_empty()).then(|| format!("columns that are not read: {}", self.ignored.join(", ")))
    }
}

/// The header rows in their order.
fn header_rows<'t>(table: &'t DelimitedTable) -> Result<Vec<&'t TextRow>, ImportError> {
    let several = table.head.get(1).is_some_and(|row| row.first_cell() == ROW_NAMES[1]);
    let expected = ROW_NAMES.iter().filter(|name| several || **name != ROW_NAMES[1]);
    let row = |(index, name): (usize, &&str)| {
        let row = table
            .head
            .get(index)
            .or(table.head.last())
            .ok_or_else(|| ImportError::Empty { file: table.file.to_owned() })?;
        if row.first_cell() == *name {
            Ok(row)
        } else {
            Err(header_error(
                table,
                row,
                format!("a row that starts with `{}`", row.first_cell()),
                &format!("the row `{name}`"),
            ))
        }
    };
    expected.enumerate().map(row).collect()
}

fn count_index_cells(table: &DelimitedTable, coordinates: &TextRow) -> Result<usize, ImportError> {
    let count =
        coordinates.cells.iter().skip(1).position(|cell| !cell.is_empty()).map_or(0, |ahead| ahead + 1);
    let found = || {
        if count == 0 {
            "no coordinates".to_owned()
        } else {
            format!("{count} cells in front of the coordinates")
        }
    };
    let expected = "x and y after one cell (frame number or picture) or after three (folder, video, picture)";
    if INDEX_CELLS.contains(&count) {
        Ok(count)
    } else {
        Err(header_error(table, coordinates, found(), expected))
    }
}

fn point_cells(
    table: &DelimitedTable,
    coordinates: &TextRow,
    name: String,
    BodyPartCells([x, y, confidence]): &BodyPartCells,
) -> Result<PointCells, ImportError> {
    let (Some(x), Some(y)) = (*x, *y) else {
        let found = if x.is_some() { "x" } else { "y" };
        return Err(header_error(
            table,
            coordinates,
            format!("`{name}` with {found} alone"),
            "x and y of every body part",
        ));
    };
    Ok(PointCells { confidence: *confidence, ..PointCells::new(name, x, Some(y)) })
}

fn header_error(table: &DelimitedTable, row: &TextRow, found: String, expected: &str) -> ImportError {
    ImportError::columns(table.file, row.line, format!("found {found}, expected {expected}"), HEADER_ADVICE)
}
