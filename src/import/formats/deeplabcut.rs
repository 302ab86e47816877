//! DeepLabCut and Lightning Pose: tables under three header rows (four with individuals), and tables of
//! labels set by hand.

use super::FileFormat;
use crate::import::error::{CellProblem, ImportError};
use crate::import::options::ImportOptions;
use crate::import::reader::findings::picked_frames_finding;
use crate::import::reader::{
    CellNumber, DelimitedTable, Document, Facts, InstanceFields, PointCells, PointFields, RowOrder,
    RowPosition, RowStamp, RowView, TableLayout, TextRow, TrackCollector, TrackFile, new_finding,
};
use crate::recording::quality::{Check, QualityFinding, Severity};

/// Parts of a file's name or of a scorer's that tell of smoothed positions: DeepLabCut's filtered predictions
/// and the ensemble Kalman smoother of Lightning Pose.
const SMOOTHED: [&str; 3] = ["filtered", "smoother", "smoothed"];
/// Columns of the lengths and angles between body parts.
const SKELETON: [&str; 3] = ["length", "orientation", "likelihood"];

/// Tables of DeepLabCut and of programs that write its layout.
pub(crate) struct DeepLabCut;

impl FileFormat for DeepLabCut {
    fn name(&self) -> &'static str {
        "deeplabcut"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let table = document.table.as_ref().ok()?;
        if let Some(row) = find_skeleton_row(table) {
            return Some(format!(
                "line {} names lengths and orientations as DeepLabCut's skeleton does",
                row.line
            ));
        }
        let rows: Vec<&TextRow> = table
            .head
            .iter()
            .take(ROW_NAMES.len())
            .filter(|row| ROW_NAMES.contains(&row.first_cell()))
            .collect();
        let described: Vec<String> =
            rows.iter().map(|row| format!("line {} starts with `{}`", row.line, row.first_cell())).collect();
        (rows.len() > 1 || rows.first().is_some_and(|row| row.first_cell() == ROW_NAMES[0]))
            .then(|| described.join(", "))
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        _options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        if let Some(row) = find_skeleton_row(table) {
            return Err(skeleton_table_error(table, row));
        }
        let header = DeepLabCutHeader::find(table)?;
        let mut export = if header.index_cells > 1 || names_images(table, &header) {
            read_labels(document, table, &header, facts())?
        } else {
            let layout = TableLayout {
                start: header.start,
                width: header.cells,
                most: header.cells,
                frame: Some(0),
                points: header.points.clone(),
                ..TableLayout::default()
            };
            let mut export = layout.read_tracks(document, table, facts())?;
            if header.points.iter().all(|point| point.confidence.is_none()) {
                // (predictions have a likelihood; what has none may be labels)
                export.findings.extend(
                    export.clocks.iter().filter_map(|clock| picked_frames_finding(document.file, clock)),
                );
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

/// Whether the rows are named by pictures instead of being numbered.
fn names_images(table: &DelimitedTable, header: &DeepLabCutHeader) -> bool {
    table.head.get(header.start).is_some_and(|row| {
        table.parse_cell(row.first_cell()) == CellNumber::Text && row.first_cell().contains('.')
    })
}

fn find_skeleton_row<'t>(table: &'t DelimitedTable) -> Option<&'t TextRow> {
    let names = |row: &&TextRow| SKELETON.iter().all(|name| row.cells.iter().any(|cell| cell == name));
    table.head.iter().take(ROW_NAMES.len()).find(names)
}

fn skeleton_table_error(table: &DelimitedTable, row: &TextRow) -> ImportError {
    let cell = row.cells.iter().position(|cell| cell == SKELETON[0]).unwrap_or(0);
    ImportError::wrong_table(
        table.location(row.line, table.text_column(row.line, cell)),
        "lengths and orientations of a skeleton",
        "a table of body parts with the columns x, y and likelihood",
        "import the CSV that analyze_videos writes with save_as_csv=True, the one without \
            `_skeleton` in its name",
    )
}

/// Positions that went through a low-pass filter have lost part of what a spectrum is to show.
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
    Some(new_finding(
        Check::Filtered,
        Severity::Caution,
        (1.0, ""),
        found,
        "import the unfiltered table (without `_filtered` in its name) if chatter or noise matters",
    ))
}

// The rows above the numbers: who predicted, which individual, which body part, which coordinate.

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

// Labels set by hand: rows are named by the pictures taken from a video, whose names end in the frame
// number.

/// Reads every picture's row; a video's pictures come in any order and leave most frames out.
pub(crate) fn read_labels<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
    header: &DeepLabCutHeader,
    facts: Facts,
) -> Result<TrackFile<'a>, ImportError> {
    let point = |p: &PointCells| PointFields {
        name: p.name.clone(),
        has_y: true,
        has_confidence: p.confidence.is_some(),
    };
    let image_cell = header.index_cells - 1;
    let shape = InstanceFields {
        has_frame: true,
        has_time: false,
        clock_cell: image_cell,
        points: header.points.iter().map(point).collect(),
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
        check_same_video(table, &record, video.get_or_insert_with(|| folder.clone()), &folder)?;
        let frame =
            frame_number(image).ok_or_else(|| unnumbered_picture_error(table, &record, image_cell))?;
        for (position, cells) in positions.iter_mut().zip(&header.points) {
            *position = read_label(table, &record, cells)?;
        }
        collector.add_row("", RowStamp { line: record.line, frame: Some(frame), time: None }, &positions);
        count += 1;
    }
    let video = video.unwrap_or_default();
    let (clocks, tracks) =
        collector.finish(document.file, RowOrder::Any).map_err(|error| name_video_in_error(error, &video))?;
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

fn read_label(
    table: &DelimitedTable,
    record: &RowView,
    cells: &PointCells,
) -> Result<RowPosition, ImportError> {
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

/// The folder of a row's picture (its video's name) and the picture's name.
fn split_picture_path<'r>(record: &RowView<'r>, index_cells: usize) -> (String, &'r str) {
    if index_cells > 1 {
        return (record.cell(index_cells - 2).to_owned(), record.cell(index_cells - 1));
    }
    let path = record.cell(0);
    let (folder, image) = path.rsplit_once(['/', '\\']).unwrap_or(("", path));
    (folder.rsplit(['/', '\\']).next().unwrap_or("").to_owned(), image)
}

/// The number in which a picture's name ends, without its extension.
fn frame_number(image: &str) -> Option<f64> {
    let stem = image.rsplit_once('.').map_or(image, |(stem, _)| stem);
    let digits = stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    stem.get(digits..)?.parse::<u32>().ok().map(f64::from)
}

fn check_same_video(
    table: &DelimitedTable,
    record: &RowView,
    video: &str,
    folder: &str,
) -> Result<(), ImportError> {
    if video == folder {
        return Ok(());
    }
    Err(ImportError::wrong_table(
        table.location(record.line, 1),
        format!("a picture of the video `{folder}` after those of `{video}`"),
        "the labels of one video",
        "import the CollectedData file in the folder of one video, not the merged data set",
    ))
}

fn unnumbered_picture_error(table: &DelimitedTable, record: &RowView, cell: usize) -> ImportError {
    ImportError::Cell {
        place: table.location(record.line, table.text_column(record.line, cell)),
        problem: CellProblem::NotAFrame,
        name: "picture".to_owned(),
        found: record.cell(cell).chars().take(60).collect::<String>().into(),
        expected: "a picture whose name ends in its frame number, such as img0042.png",
        advice: "rename the pictures by their frames in the table, or import the table of analyze_videos, \
            which numbers the frames",
    }
}

/// The track of all points of a picture has no name: a refusal names the video.
fn name_video_in_error(error: ImportError, video: &str) -> ImportError {
    match error {
        ImportError::DuplicateRow { place, what, found, first, .. } => {
            ImportError::DuplicateRow { place, what, found, first, track: video.to_owned() }
        }
        other => other,
    }
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
