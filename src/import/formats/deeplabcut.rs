//! Reads tables of DeepLabCut and Lightning Pose: predicted positions below three header rows (four if there
//! are several animals), and labels that were set by hand.

use crate::import::error::{CellProblem, ImportError, ImportResult};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::findings::picked_frames_finding;
use crate::import::reader::{
    CellNumber, DelimitedTable, Document, Facts, InstanceFields, PointCells, RowOrder, RowPosition, RowStamp,
    RowView, TableLayout, TextRow, TrackCollector, TrackFile, new_finding,
};
use crate::recording::quality::{Check, QualityFinding, Severity};

/// Words in the name of a file or of its scorer (the trained model) that show that its positions were
/// smoothed. They occur in DeepLabCut's filtered predictions and in the output of Lightning Pose's ensemble
/// Kalman smoother.
const SMOOTHED: [&str; 3] = ["filtered", "smoother", "smoothed"];
/// Columns of DeepLabCut's skeleton table, which contains lengths and angles between body parts instead of
/// positions.
const SKELETON: [&str; 3] = ["length", "orientation", "likelihood"];

pub(crate) struct DeepLabCut;

impl FileFormat for DeepLabCut {
    fn name(&self) -> &'static str {
        "deeplabcut"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let table = document.table.as_ref().ok()?;
        if let Some(row) = find_skeleton_row(table) {
            let line = row.line;
            return Some(format!("line {line} names lengths and orientations as DeepLabCut's skeleton does"));
        }
        let rows = table.head.iter().take(ROW_NAMES.len());
        let rows: Vec<&TextRow> = rows.filter(|row| ROW_NAMES.contains(&row.first_cell())).collect();
        let described: Vec<String> =
            rows.iter().map(|row| format!("line {} starts with `{}`", row.line, row.first_cell())).collect();
        (rows.len() > 1 || rows.first().is_some_and(|row| row.first_cell() == ROW_NAMES[0]))
            .then(|| described.join(", "))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        if let Some(row) = find_skeleton_row(table) {
            return Err(skeleton_table_error(table, row));
        }
        let header = DeepLabCutHeader::find(table)?;
        let mut export = if header.index_cells > 1 || names_images(table, &header) {
            read_labels(document, table, &header, facts())?
        } else {
            let layout = TableLayout::new(header.start, header.cells, header.points.clone());
            let layout = TableLayout { frame: Some(0), ..layout };
            let mut export = layout.read_tracks(document, table, facts())?;
            if header.points.iter().all(|point| point.confidence.is_none()) {
                // (predictions have a likelihood; positions without a likelihood may be labels that were set
                // by hand)
                let picked =
                    export.clocks.iter().filter_map(|clock| picked_frames_finding(document.file, clock));
                export.findings.extend(picked);
            }
            export
        };
        export.notes.extend(header.ignored_columns_note());
        export.findings.extend(filtering_finding(document, &header));
        Ok(export)
    }
}

fn facts() -> Facts {
    Facts::pixels_down("DeepLabCut writes image pixels, y downwards")
}

/// Whether the first cell of each row is the name of a picture instead of a frame number.
fn names_images(table: &DelimitedTable, header: &DeepLabCutHeader) -> bool {
    table.head.get(header.start).is_some_and(|row| {
        table.parse_cell(row.first_cell()) == CellNumber::Text && row.first_cell().contains('.')
    })
}

fn find_skeleton_row<'t>(table: &'t DelimitedTable) -> Option<&'t TextRow> {
    table.head.iter().take(ROW_NAMES.len()).find(|row| SKELETON.iter().all(|name| row.has(name)))
}

fn skeleton_table_error(table: &DelimitedTable, row: &TextRow) -> ImportError {
    ImportError::wrong_table(
        table.cell_location(row.line, row.position(SKELETON[0]).unwrap_or(0)),
        "lengths and orientations of a skeleton",
        "a table of body parts with the columns x, y and likelihood",
        "import the CSV that analyze_videos writes with save_as_csv=True, the one without `_skeleton` in its name",
    )
}

/// Finding about positions that went through a low-pass filter, which weakens the high frequencies.
fn filtering_finding(document: &Document, header: &DeepLabCutHeader) -> Option<QualityFinding> {
    let tells = |name: &str| SMOOTHED.iter().any(|word| name.to_lowercase().contains(word));
    let who = if tells(document.stem) {
        Some("the name of the file")
    } else {
        header.scorers.iter().any(|scorer| tells(scorer)).then_some("its scorer")
    }?;
    let found = format!(
        "{}: {who} says that the positions were filtered: fast motion is weakened and noise looks smaller \
         than it is",
        document.file
    );
    let advice = "import the unfiltered table (without `_filtered` in its name) if chatter or noise matters";
    Some(new_finding(Check::Filtered, Severity::Caution, (1.0, ""), found, advice))
}

// The header rows of a table: scorer, individual, body part, coordinate.

/// Texts in the first cells of the header rows. A table of one animal has no row `individuals`.
const ROW_NAMES: [&str; 4] = ["scorer", "individuals", "bodyparts", "coords"];
/// Name in the row `individuals` for points that occur only once in a picture and belong to no animal.
const UNIQUE_INDIVIDUAL: &str = "single";
/// Possible numbers of cells before the coordinates in a row: one for a frame number or the path of a
/// picture, or three for a path that is split into folder, video and picture.
const INDEX_CELLS: [usize; 2] = [1, 3];
const HEADER_ADVICE: &str = "the rows above the numbers are scorer, bodyparts, coords, with individuals in \
    second place if there are several; restore them as DeepLabCut wrote them, or have it write the table \
    again";

const PART_EXPECTED: &str = "x and y of every body part";

/// What the header rows say about the columns of a table.
pub(crate) struct DeepLabCutHeader {
    /// Index in `DelimitedTable::head` of the first row of numbers.
    pub start: usize,
    /// Number of cells before the coordinates.
    pub index_cells: usize,
    /// Number of cells in a row.
    pub cells: usize,
    pub points: Vec<PointCells>,
    pub scorers: Vec<String>,
    /// Names in the row `coords` of the columns that are not read.
    ignored: Vec<String>,
}

/// A body part of an individual.
#[derive(PartialEq)]
struct BodyPart<'t> {
    scorer: &'t str,
    individual: &'t str,
    name: &'t str,
}

/// Indices of the columns with x, y and likelihood of a body part; `None` for a column that is missing.
#[derive(Default)]
struct BodyPartCells([Option<usize>; 3]);

const COORDINATES: [&str; 3] = ["x", "y", "likelihood"];

impl DeepLabCutHeader {
    pub(crate) fn find(table: &DelimitedTable) -> ImportResult<Self> {
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
            return Err(header_error(table, coordinates, "no column named x or y", PART_EXPECTED));
        }
        Ok(header)
    }

    /// Adds the column `cell` to the body part that the header rows name for it.
    fn add_column<'t>(
        &mut self,
        table: &DelimitedTable,
        rows: &[&'t TextRow],
        cell: usize,
        parts: &mut Vec<(BodyPart<'t>, BodyPartCells)>,
    ) -> ImportResult<()> {
        let text = |row: usize| rows.get(row).map_or("", |row| row.cell(cell));
        let last = rows.len() - 1;
        let coordinate = text(last);
        let line = rows[last].line;
        if coordinate == "z" {
            return Err(ImportError::wrong_table(
                table.cell_location(line, cell),
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
            let found = format!("no name in cell {}", cell + 1);
            let expected = "the name of a body part above each coordinate";
            return Err(header_error(table, rows[last - 1], &found, expected));
        }
        let at = parts.iter().position(|(known, _)| *known == part).unwrap_or(parts.len());
        if at == parts.len() {
            parts.push((part, BodyPartCells::default()));
        }
        if parts[at].1.0[kind].replace(cell).is_some() {
            let found = format!("a second {coordinate} of `{}` in cell {}", parts[at].0.name, cell + 1);
            let expected = "each coordinate of a body part once (of several animals: a row `individuals`)";
            return Err(header_error(table, rows[last], &found, expected));
        }
        Ok(())
    }

    pub(crate) fn ignored_columns_note(&self) -> Option<String> {
        (!self.ignored.is_empty()).then(|| format!("columns that are not read: {}", self.ignored.join(", ")))
    }
}

/// The three or four header rows, in the order of the file.
fn header_rows<'t>(table: &'t DelimitedTable) -> ImportResult<Vec<&'t TextRow>> {
    let several = table.head.get(1).is_some_and(|row| row.first_cell() == ROW_NAMES[1]);
    let expected = ROW_NAMES.iter().filter(|name| several || **name != ROW_NAMES[1]);
    let row = |(index, name): (usize, &&str)| {
        let row =
            table.head.get(index).or(table.head.last()).ok_or_else(|| ImportError::empty(table.file))?;
        let found = format!("a row that starts with `{}`", row.first_cell());
        let refuse = || header_error(table, row, &found, &format!("the row `{name}`"));
        Some(row).filter(|row| row.first_cell() == *name).ok_or_else(refuse)
    };
    expected.enumerate().map(row).collect()
}

fn count_index_cells(table: &DelimitedTable, coordinates: &TextRow) -> ImportResult<usize> {
    let count =
        coordinates.cells.iter().skip(1).position(|cell| !cell.is_empty()).map_or(0, |ahead| ahead + 1);
    if INDEX_CELLS.contains(&count) {
        return Ok(count);
    }
    let expected = "x and y after one cell (frame number or picture) or after three (folder, video, picture)";
    let found =
        if count == 0 { "no coordinates" } else { &format!("{count} cells in front of the coordinates") };
    Err(header_error(table, coordinates, found, expected))
}

fn point_cells(
    table: &DelimitedTable,
    coordinates: &TextRow,
    name: String,
    BodyPartCells([x, y, confidence]): &BodyPartCells,
) -> ImportResult<PointCells> {
    let (Some(x), Some(y)) = (*x, *y) else {
        let found = format!("`{name}` with {} alone", if x.is_some() { "x" } else { "y" });
        return Err(header_error(table, coordinates, &found, PART_EXPECTED));
    };
    Ok(PointCells { confidence: *confidence, ..PointCells::new(name, x, Some(y)) })
}

fn header_error(table: &DelimitedTable, row: &TextRow, found: &str, expected: &str) -> ImportError {
    ImportError::columns(table.file, row.line, format!("found {found}, expected {expected}"), HEADER_ADVICE)
}

// Labels that were set by hand. Each row names a picture of a video, and the name of the picture ends in the
// frame number.

/// What the cell with the name of a picture should contain, and what the user can do if it does not.
const PICTURE_REMEDY: (&str, &str) = (
    "a picture whose name ends in its frame number, such as img0042.png",
    "rename the pictures by their frames in the table, or import the table of analyze_videos, which numbers the \
     frames",
);

/// Reads a table with one row for each labelled picture. The rows may be in any order, and most frames of the
/// video have no row.
pub(crate) fn read_labels<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
    header: &DeepLabCutHeader,
    facts: Facts,
) -> ImportResult<TrackFile<'a>> {
    let image_cell = header.index_cells - 1;
    let shape = InstanceFields {
        has_frame: true,
        has_time: false,
        clock_cell: image_cell,
        points: header.points.iter().map(PointCells::fields).collect(),
    };
    let mut collector = TrackCollector::new(shape);
    let (mut video, mut count): (Option<String>, usize) = (None, 0);
    let mut positions = vec![RowPosition::default(); header.points.len()];
    let mut rows = table.rows(header.start);
    while let Some(record) = rows.next_row()? {
        if record.is_empty() {
            continue;
        }
        table.check_row_length(&record, header.cells, header.cells)?;
        let (folder, image) = split_picture_path(&record, header.index_cells);
        let video = video.get_or_insert_with(|| folder.clone());
        if *video != folder {
            return Err(ImportError::wrong_table(
                table.location(record.line, 1),
                format!("a picture of the video `{folder}` after those of `{video}`"),
                "the labels of one video",
                "import the CollectedData file in the folder of one video, not the merged data set",
            ));
        }
        let unnumbered = || {
            let place = table.cell_location(record.line, image_cell);
            let picture = ("picture", record.cell(image_cell));
            ImportError::cell(place, CellProblem::NotAFrame, picture, PICTURE_REMEDY)
        };
        let frame = frame_number(image).ok_or_else(unnumbered)?;
        for (position, cells) in positions.iter_mut().zip(&header.points) {
            *position = read_label(table, &record, cells)?;
        }
        collector.add_row("", RowStamp { line: record.line, frame: Some(frame), time: None }, &positions);
        count += 1;
    }
    let video = video.unwrap_or_default();
    // (all rows belong to one instance without a name, so the error names the video instead)
    let name_video = |error| match error {
        ImportError::DuplicateRow { place, what, found, first, .. } => {
            ImportError::DuplicateRow { place, what, found, first, track: video.clone() }
        }
        other => other,
    };
    let (clocks, tracks) = collector.finish(document.file, RowOrder::Any).map_err(name_video)?;
    let findings = clocks.iter().filter_map(|clock| picked_frames_finding(document.file, clock)).collect();
    Ok(TrackFile {
        table: Some(table),
        findings,
        clocks,
        tracks,
        facts,
        notes: vec![format!(
            "labels of {count} pictures of the video `{video}`; the names of the pictures give the frames"
        )],
        texts: table.head.iter().take(header.start).flat_map(|row| row.cells.iter().cloned()).collect(),
        ..TrackFile::for_document(document)
    })
}

fn read_label(table: &DelimitedTable, record: &RowView, cells: &PointCells) -> ImportResult<RowPosition> {
    let value = |cell: Option<usize>, axis: &str| {
        table.optional_number_at(record, cell, &format!("{axis} of {}", cells.name))
    };
    let [x, y] = [&cells.x, &cells.y].map(|cells| cells.first().copied());
    Ok(RowPosition {
        x: value(x, "x")?,
        y: value(y, "y")?,
        confidence: value(cells.confidence, "likelihood")?,
    })
}

/// Name of the folder of the picture in a row, and name of the picture. The folder has the name of the video.
fn split_picture_path<'r>(record: &RowView<'r>, index_cells: usize) -> (String, &'r str) {
    if index_cells > 1 {
        return (record.cell(index_cells - 2).to_owned(), record.cell(index_cells - 1));
    }
    let path = record.cell(0);
    let (folder, image) = path.rsplit_once(['/', '\\']).unwrap_or(("", path));
    (folder.rsplit(['/', '\\']).next().unwrap_or("").to_owned(), image)
}

/// The number at the end of a picture's name, before the extension; `None` if the name does not end in a
/// number.
fn frame_number(image: &str) -> Option<f64> {
    let stem = image.rsplit_once('.').map_or(image, |(stem, _)| stem);
    let digits = stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    stem.get(digits..)?.parse::<u32>().ok().map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_a_pictures_name_is_its_frame() {
        for (name, frame) in [
            ("img0042.png", Some(42.0)),
            ("img7.tif", Some(7.0)),
            ("run2_000.png", Some(0.0)),
            ("12", Some(12.0)),
        ] {
            assert_eq!(frame_number(name), frame, "{name}");
        }
        for name in ["img.png", "img12_crop.png", "", "img99999999999999999999.png", "é.png"] {
            assert_eq!(frame_number(name), None, "{name}");
        }
    }
}
