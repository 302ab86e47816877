//! Reads the exports of DLTdv (versions 5 to 8) and Argus: positions in pixels, either as two columns for
//! each point and camera, or as triplets of row, column and value.

use crate::import::format::*;
use std::collections::BTreeMap;

pub(super) const FORMAT: FormatParser =
    FormatParser { name: "dltdv", recognises: recognise_export, read: read_export };

fn recognise_export(document: &Document) -> Option<String> {
    let table = document.table.as_ref().ok();
    let flat = table.and_then(recognise_flat_table);
    let positions = flat.or_else(|| table.and_then(recognise_sparse_table));
    positions.or_else(|| find_other_content(document).map(|what| format!("line 1 is that of DLTdv's {what}")))
}

fn read_export<'a>(document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
    if let Some(what) = find_other_content(document) {
        let advice = "import the file of the same export that ends in xypts.csv or xypts.tsv";
        let (place, found) = (format!("{}:1:1", document.file), format!("DLTdv's {what}"));
        return Err(ImportError::wrong_table(place, found, "positions in the picture of a camera", advice));
    }
    let table = document.table()?;
    match recognise_sparse_table(table) {
        Some(_) => read_sparse_table(document, table),
        None => read_flat_table(document, table),
    }
}

/// Contents of a DLTdv file that has no positions in pictures; `None` for any other file.
fn find_other_content(document: &Document) -> Option<&'static str> {
    let start = document.text.lines().next()?.to_lowercase();
    if start.starts_with("pointnames") {
        return Some("list of point names");
    }
    if start.starts_with("sparse format") && !start.starts_with(TITLE) {
        return Some("sparse table of other values than positions in pictures");
    }
    let row = document.table.as_ref().ok()?.head.first().filter(|row| row.used_width() > 0)?;
    let all = |is: fn(&str) -> bool| row.cells.iter().all(|cell| is(cell));
    let in_space = |point: &[String]| {
        let names: Vec<_> =
            point.iter().zip(["_X", "_Y", "_Z"]).map(|(cell, end)| cell.strip_suffix(end)).collect();
        names.len() == 3 && names[0].is_some() && names.iter().all(|name| *name == names[0])
    };
    if row.cells.chunks(3).all(in_space) {
        return Some("positions in space (xyzpts)");
    }
    if all(|cell| cell.ends_with("_dltres")) {
        return Some("residuals of a reconstruction (xyzres)");
    }
    all(|cell| cell.starts_with("cam") && cell.ends_with("_offset")).then_some("offsets between cameras")
}

/// Explains what the direction of y depends on, if the table does not show it.
const Y_AXIS_QUESTION: &str = "DLTdv 8 counts pixels from the top of the picture (down), DLTdv 5 to 7 and \
    Argus from its bottom (up), and this table does not tell which of them wrote it";
const FIRST_PIXEL: &str =
    "the first pixel of a picture is number 1 as in MATLAB; the coordinates are kept as they are";
const SEVERAL_CAMERAS: &str = "several cameras: tip and head have to come from one of them; rows \
    are frames of the first camera, from which the others may be offset";

/// Facts about coordinates in pixels; if the direction of y is unknown, the user is asked for it.
fn pixel_facts(y_axis: Fact<YAxis>) -> Facts {
    let y_axis_open = y_axis.is_none().then_some(Y_AXIS_QUESTION);
    let unit = Some((CoordinateUnit::Pixel, "DLTdv and Argus write pixels".to_owned()));
    Facts { y_axis, y_axis_open, unit, ..Facts::default() }
}

/// Name of the track of a point, with the camera if there are several.
fn camera_track_name(point: &str, camera: &str, several: bool) -> String {
    if several { format!("{point}_cam{camera}") } else { point.to_owned() }
}

// Reads the flat table of DLTdv and Argus: one row per frame, without frame numbers, and columns
// `NAME_cam1_X`, `NAME_cam1_Y`, ...

/// Text in a column name between the name of the point and the number of the camera.
const CAMERA: &str = "_cam";
/// Endings of the names of x and y columns.
const ENDS: [[&str; 2]; 4] = [["_U", "_V"], ["_x", "_y"], ["_X", "_Y"], ["_u", "_v"]];
/// Direction of y, and the reason for it, for the first two pairs of endings. Only one program writes each of
/// these pairs.
const WRITERS: [(YAxis, &str); 2] = [
    (
        YAxis::Down,
        "columns that end in _U and _V are those of DLTdv 8, which counts pixels from the top of the picture",
    ),
    (
        YAxis::Up,
        "columns that end in _x and _y are those of Argus, which counts pixels from the bottom of the picture",
    ),
];

/// Parts of a column's name.
#[derive(Clone, Copy, PartialEq)]
struct DltdvColumn<'t> {
    point: &'t str,
    camera: &'t str,
    /// Index in [`ENDS`].
    ends: usize,
    /// 0 for x, 1 for y.
    axis: usize,
}

impl<'t> DltdvColumn<'t> {
    /// Splits a column name at its last `_cam`; `None` if it is not the name of a coordinate.
    fn parse(name: &'t str) -> Option<Self> {
        let ends = (0..ENDS.len()).flat_map(|ends| [(ends, 0), (ends, 1)]);
        let found = |(ends, axis): (usize, usize)| Some((ends, axis, name.strip_suffix(ENDS[ends][axis])?));
        let (ends, axis, rest) = { ends }.find_map(found)?;
        let (point, camera) = rest.rsplit_once(CAMERA)?;
        let camera = camera.strip_prefix('_').unwrap_or(camera); // (Argus writes `_cam_1_x`)
        let is_number = !camera.is_empty() && camera.bytes().all(|byte| byte.is_ascii_digit());
        is_number.then_some(Self { point, camera, ends, axis })
    }
}

fn find_header<'t>(table: &'t DelimitedTable) -> Option<(usize, &'t TextRow)> {
    table.find_row(2, |row| row.cells.iter().any(|cell| DltdvColumn::parse(cell).is_some()))
}

fn recognise_flat_table(table: &DelimitedTable) -> Option<String> {
    let (_, row) = find_header(table)?;
    Some(format!("line {} names points in cameras as DLTdv and Argus do", row.line))
}

fn read_flat_table<'a>(document: &'a Document, table: &'a DelimitedTable) -> ImportResult<TrackFile<'a>> {
    let Some((index, row)) = find_header(table) else {
        return Err(columns_error(
            table,
            table.first_line(),
            &format!("`{}`", table.first_texts().join(", ")),
        ));
    };
    let columns: Vec<Option<DltdvColumn>> = row.cells.iter().map(|cell| DltdvColumn::parse(cell)).collect();
    let all: Vec<(usize, DltdvColumn)> =
        columns.iter().enumerate().filter_map(|(at, column)| Some((at, (*column)?))).collect();
    let several = all.iter().any(|(_, column)| column.camera != all[0].1.camera);
    let mut points = vec![];
    for pair in all.chunks(2) {
        let (at, x) = pair[0];
        if x.axis != 0 || pair.get(1) != Some(&(at + 1, DltdvColumn { axis: 1, ..x })) {
            let found = format!("`{}` in cell {} without its partner", row.cells[at], at + 1);
            return Err(columns_error(table, row.line, &found));
        }
        points.push(PointCells::new(camera_track_name(x.point, x.camera, several), at, Some(at + 1)));
    }
    let one_writer = all.iter().all(|(_, column)| column.ends == all[0].1.ends);
    let writer = WRITERS.get(all[0].1.ends).filter(|_| one_writer);
    let y_axis = writer.map(|(axis, why)| (*axis, (*why).to_owned()));
    let first_frame = count_empty_rows(table, index)?;
    let layout = TableLayout { first_frame, ..TableLayout::new(index + 1, row.used_width(), points) };
    let mut export = layout.read_tracks(document, table, pixel_facts(y_axis))?;
    export.notes.push(format!("rows are frames, the first one frame 0; {FIRST_PIXEL}"));
    export.notes.extend(several.then(|| SEVERAL_CAMERAS.to_owned()));
    Ok(export)
}

/// Number of rows directly below the header whose cells are all empty; they count as frames.
fn count_empty_rows(table: &DelimitedTable, header: usize) -> ImportResult<f64> {
    let (mut rows, mut count) = (table.rows(header), 0);
    rows.next_row()?; // (the header)
    while rows.next_row()?.is_some_and(|record| record.is_empty()) {
        count += 1;
    }
    Ok(f64::from(count))
}

fn columns_error(table: &DelimitedTable, line: usize, found: &str) -> ImportError {
    let problem = format!("found {found}, expected pairs of columns such as tip_cam1_X and tip_cam1_Y");
    let advice = "import the file that ends in xypts.csv (TrackFile points in DLTdv), with its header row as it was \
        written";
    ImportError::columns(table.file, line, problem, advice)
}

// Reads the sparse table of DLTdv 8, whose rows contain frame, column and value. The names of the points are
// in a companion file.

/// First line of a table of positions in pictures, in lower case.
const TITLE: &str = "sparse format camera coordinates";
const EXPORT_AGAIN: &str = "the file was cut short or edited: export it again";

/// Positions in a pair of columns. The key is the row number, which counts frames; the value contains the
/// line number in the file, and x and y.
type SparseFrames = BTreeMap<u64, (usize, [Option<f64>; 2])>;

fn recognise_sparse_table(table: &DelimitedTable) -> Option<String> {
    let title = table.first_texts().join(" ");
    let is_title = title.to_lowercase().starts_with(TITLE);
    is_title.then(|| format!("line {} is `{}`", table.first_line(), title.trim_end()))
}

fn read_sparse_table<'a>(document: &'a Document, table: &'a DelimitedTable) -> ImportResult<TrackFile<'a>> {
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
                ImportError::cell(place, (name, found), remedy)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_camera_of_a_columns_name_counts() {
        let named =
            |name| DltdvColumn::parse(name).map(|column| (column.point, column.camera, column.axis == 0));
        assert_eq!(named("pt1_cam1_X"), Some(("pt1", "1", true)));
        assert_eq!(named("lip_cam_left_cam12_V"), Some(("lip_cam_left", "12", false)));
        assert_eq!(named("Track 1_cam_2_y"), Some(("Track 1", "2", false)));
        for name in ["pt1_X", "pt1_cam_X", "pt1_camA_X", "cam1_offset", "pt1_cam1_Z", "x", ""] {
            assert_eq!(named(name), None, "{name}");
        }
    }
}
