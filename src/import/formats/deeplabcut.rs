//! Reads tables of DeepLabCut and Lightning Pose: predicted positions below three header rows (four if there
//! are several animals), and labels that were set by hand.

use crate::import::format::*;
use crate::import::reader::findings::picked_frames_finding;
use crate::import::source::base_name;

/// First cells of the header rows; a table of one animal has no row `individuals`.
const ROW_NAMES: [&str; 4] = ["scorer", "individuals", "bodyparts", "coords"];
const COORDINATES: [&str; 3] = ["x", "y", "likelihood"];
/// Name that DeepLabCut gives the individual with the body parts that occur only once in a picture.
const UNIQUE_INDIVIDUAL: &str = "single";
/// Words in the names of files or scorers that mark smoothed positions: those of DeepLabCut's filtered
/// predictions and of the ensemble Kalman smoother of Lightning Pose.
const SMOOTHED: [&str; 3] = ["filtered", "smoother", "smoothed"];
/// Columns of DeepLabCut's skeleton table, which contains lengths and angles between body parts instead of
/// positions.
const SKELETON: [&str; 3] = ["length", "orientation", "likelihood"];
const HEADER_ADVICE: &str = "the rows above the numbers are scorer, bodyparts, coords, with individuals in \
    second place if there are several; restore them as DeepLabCut wrote them, or have it write the table \
    again";
const TABLE_ADVICE: &str = "import the CSV that analyze_videos writes with save_as_csv=True for one camera, the one \
    without `_skeleton` in its name";

pub(super) const FORMAT: FormatParser =
    FormatParser { name: "deeplabcut", recognises: recognise_export, read: read_export };

fn recognise_export(document: &Document) -> Option<String> {
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

fn read_export<'a>(document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
    let table = document.table()?;
    if let Some(row) = find_skeleton_row(table) {
        let place = table.cell_location(row.line, row.position(SKELETON[0]).unwrap_or(0));
        let expected = "a table of body parts with the columns x, y and likelihood";
        let found = "lengths and orientations of a skeleton";
        return Err(ImportError::wrong_table(place, found, expected, TABLE_ADVICE));
    }
    let header = DeepLabCutHeader::find(table)?;
    let names_pictures = table.head.get(header.start).is_some_and(|row| {
        table.parse_cell(row.first_cell()) == CellNumber::Text && row.first_cell().contains('.')
    });
    let labelled = header.index_cells > 1 || names_pictures;
    let mut export = if labelled {
        read_labels(document, table, &header)?
    } else {
        let layout = TableLayout::new(header.start, header.cells, header.points.clone());
        TableLayout { frame: Some(0), ..layout }.read_tracks(document, table, pixel_facts())?
    };
    if labelled || header.points.iter().all(|point| point.confidence.is_none()) {
        // (predictions have a likelihood; positions without one may be labels set by hand)
        let picked = export.clocks.iter().filter_map(|clock| picked_frames_finding(document.file, clock));
        export.findings.extend(picked);
    }
    export.findings.extend(filtering_finding(document, &table.head[0]));
    Ok(export)
}

fn pixel_facts() -> Facts {
    Facts::pixels_down("DeepLabCut writes image pixels, y downwards")
}

fn find_skeleton_row<'t>(table: &'t DelimitedTable) -> Option<&'t TextRow> {
    table.head.iter().take(ROW_NAMES.len()).find(|row| SKELETON.iter().all(|name| row.has(name)))
}

/// Finding about positions that went through a low-pass filter, which weakens the high frequencies.
fn filtering_finding(document: &Document, scorers: &TextRow) -> Option<QualityFinding> {
    let tells = |name: &str| SMOOTHED.iter().any(|word| name.to_lowercase().contains(word));
    let who = if tells(document.stem) {
        "the name of the file"
    } else {
        scorers.cells.iter().any(|scorer| tells(scorer)).then_some("its scorer")?
    };
    let found = format!(
        "{}: {who} says that the positions were filtered: fast motion is weakened and noise looks smaller \
         than it is",
        document.file
    );
    let advice = "import the unfiltered table (without `_filtered` in its name) if chatter or noise matters";
    Some(QualityFinding::advise((Check::Filtered, Severity::Caution), (1.0, ""), found, advice))
}

/// Contents of the header rows: scorer, individual, body part, coordinate.
struct DeepLabCutHeader {
    /// Index of the first row of numbers in the head of the table.
    start: usize,
    /// Number of cells before the coordinates: one for a frame number or the path of a picture, three for a
    /// path that is split into parts.
    index_cells: usize,
    /// Number of cells in a row.
    cells: usize,
    points: Vec<PointCells>,
}

impl DeepLabCutHeader {
    fn find(table: &DelimitedTable) -> ImportResult<Self> {
        let several = table.head.get(1).is_some_and(|row| row.first_cell() == ROW_NAMES[1]);
        let expected = ROW_NAMES.iter().filter(|name| several || **name != ROW_NAMES[1]);
        let mut rows: Vec<&TextRow> = vec![];
        for (index, name) in expected.enumerate() {
            let row = table.head.get(index).or(table.head.last());
            let row = row.ok_or_else(|| ImportError::empty(table.file))?;
            if row.first_cell() != *name {
                let found = format!("a row that starts with `{}`", row.first_cell());
                return Err(header_error(table, row, &found, &format!("the row `{name}`")));
            }
            rows.push(row);
        }
        let last = rows.len() - 1;
        let (coordinates, cells) = (rows[last], rows[last].used_width());
        let index_cells = coordinates.cells.iter().skip(1).take_while(|cell| cell.is_empty()).count() + 1;
        if cells < 2 || ![1, 3].contains(&index_cells) {
            let found = format!("coordinates after {index_cells} cells");
            let expected =
                "x and y after one cell (frame number or picture) or after three (folder, video, picture)";
            return Err(header_error(table, coordinates, &found, expected));
        }
        // (for each body part: the header cells above its coordinates, and the columns of its x, y and
        // likelihood)
        let mut parts: Vec<(Vec<&str>, [Option<usize>; 3])> = vec![];
        for cell in index_cells..cells {
            let coordinate = coordinates.cell(cell);
            if coordinate == "z" {
                let (found, expected) =
                    ("a z: positions in space from several cameras", "x and y of one camera's picture");
                let place = table.cell_location(coordinates.line, cell);
                return Err(ImportError::wrong_table(place, found, expected, TABLE_ADVICE));
            }
            let Some(kind) = COORDINATES.iter().position(|name| *name == coordinate) else { continue };
            let part: Vec<&str> = rows[..last].iter().map(|row| row.cell(cell)).collect();
            if part[last - 1].is_empty() {
                let found = format!("no name in cell {}", cell + 1);
                let expected = "the name of a body part above each coordinate";
                return Err(header_error(table, rows[last - 1], &found, expected));
            }
            let known = parts.iter_mut().find(|(known, _)| *known == part);
            match known {
                None => {
                    let mut columns = [None; 3];
                    columns[kind] = Some(cell);
                    parts.push((part, columns));
                }
                Some((_, columns)) if columns[kind].is_none() => columns[kind] = Some(cell),
                Some(_) => {
                    let found = format!("a second {coordinate} of `{}` in cell {}", part[last - 1], cell + 1);
                    let expected =
                        "each coordinate of a body part once (of several animals: a row `individuals`)";
                    return Err(header_error(table, coordinates, &found, expected));
                }
            }
        }
        let individual = |part: &[&'_ str]| if several { part[1].to_owned() } else { String::new() };
        let mut individuals: Vec<String> = parts.iter().map(|(part, _)| individual(part)).collect();
        individuals.retain(|name| name != UNIQUE_INDIVIDUAL);
        individuals.dedup();
        let mut points = vec![];
        for (part, [x, y, confidence]) in &parts {
            let (name, individual) = (part[last - 1], individual(part));
            let alone = individuals.len() < 2 || individual == UNIQUE_INDIVIDUAL;
            let name = if alone { name.to_owned() } else { format!("{individual}:{name}") };
            let (Some(x), Some(y)) = (*x, *y) else {
                let found = format!("`{name}` with {} alone", if x.is_some() { "x" } else { "y" });
                return Err(header_error(table, coordinates, &found, "x and y of every body part"));
            };
            points.push(PointCells { confidence: *confidence, ..PointCells::new(name, x, Some(y)) });
        }
        if points.is_empty() {
            return Err(header_error(
                table,
                coordinates,
                "no column named x or y",
                "x and y of every body part",
            ));
        }
        Ok(Self { start: rows.len(), index_cells, cells, points })
    }
}

fn header_error(table: &DelimitedTable, row: &TextRow, found: &str, expected: &str) -> ImportError {
    ImportError::columns(table.file, row.line, format!("found {found}, expected {expected}"), HEADER_ADVICE)
}

/// Reads labels that were set by hand. Each row names a picture of a video, and the picture's name ends in
/// the frame number. The rows may be in any order, and most frames have no row.
fn read_labels<'a>(
    document: &'a Document<'a>,
    table: &'a DelimitedTable,
    header: &DeepLabCutHeader,
) -> ImportResult<TrackFile<'a>> {
    let video_of = |record: &RowView| {
        let cells: Vec<&str> = (0..header.index_cells).map(|cell| record.cell(cell)).collect();
        let path = cells.join("/");
        let (folder, _) = path.rsplit_once(['/', '\\']).unwrap_or_default();
        base_name(folder).to_owned()
    };
    let (video, other) = table.find_change(header.start, video_of)?;
    if let Some((line, other)) = other {
        let found = format!("a picture of the video `{other}` after those of `{video}`");
        let advice = "import the CollectedData file in the folder of one video, not the merged data set";
        let place = table.location(line, 1);
        return Err(ImportError::wrong_table(place, found, "the labels of one video", advice));
    }
    let layout = TableLayout::new(header.start, header.cells, header.points.clone());
    let (frame, order) = (Some(header.index_cells - 1), RowOrder::Any);
    let layout = TableLayout { frame, names_pictures: true, order, ..layout };
    let read = layout.read_tracks(document, table, pixel_facts());
    // (the tracks of the only instance have no name, so the error names the video)
    let mut export = read.map_err(|error| error.with_track(&video))?;
    export.notes.push(format!("labels of the video `{video}`; the names of the pictures give the frames"));
    Ok(export)
}
