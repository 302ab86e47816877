//! Reads the flat table of DLTdv and Argus: one row per frame, without frame numbers, and columns
//! `NAME_cam1_X`, `NAME_cam1_Y`, ...

use super::{FIRST_PIXEL, SEVERAL_CAMERAS, camera_track_name, pixel_facts};
use crate::import::error::{ImportError, ImportResult};
use crate::import::reader::{DelimitedTable, Document, Fact, PointCells, TableLayout, TextRow, TrackFile};
use crate::recording::files::YAxis;

/// Text in a column name between the name of the point and the number of the camera.
const CAMERA: &str = "_cam";
/// Endings of the names of the x and y columns of a point, and the program that writes these endings.
const AXES: [(&str, &str, DltdvWriter); 4] = [
    ("_U", "_V", DltdvWriter::Version8),
    ("_X", "_Y", DltdvWriter::Unknown),
    ("_x", "_y", DltdvWriter::Argus),
    ("_u", "_v", DltdvWriter::Unknown),
];

#[derive(Clone, Copy, PartialEq, Eq)]
enum DltdvWriter {
    /// DLTdv 8.4, which counts y downwards.
    Version8,
    /// Argus, which counts y upwards.
    Argus,
    /// Several programs write these endings, and they differ in the direction of y.
    Unknown,
}

/// Parts of a column name such as `tip_cam1_X`: point, camera and axis.
#[derive(Clone, Copy, PartialEq)]
struct DltdvColumn<'t> {
    point: &'t str,
    camera: &'t str,
    axes: usize,
    is_x: bool,
}

impl<'t> DltdvColumn<'t> {
    /// Splits a column name at its last `_cam`; `None` if it is not the name of a coordinate.
    fn parse(name: &'t str) -> Option<Self> {
        let ends =
            AXES.iter().enumerate().flat_map(|(axes, (x, y, _))| [(axes, *x, true), (axes, *y, false)]);
        let (axes, is_x, rest) =
            ends.into_iter().find_map(|(axes, end, is_x)| Some((axes, is_x, name.strip_suffix(end)?)))?;
        let (point, camera) = rest.rsplit_once(CAMERA)?;
        let camera = camera.strip_prefix('_').unwrap_or(camera); // (Argus writes `_cam_1_x`)
        let is_number = !camera.is_empty() && camera.bytes().all(|byte| byte.is_ascii_digit());
        is_number.then_some(Self { point, camera, axes, is_x })
    }
}

fn find_header<'t>(table: &'t DelimitedTable) -> Option<(usize, &'t TextRow)> {
    table.find_row(2, |row| row.cells.iter().any(|cell| DltdvColumn::parse(cell).is_some()))
}

pub(crate) fn recognise_flat_table(table: &DelimitedTable) -> Option<String> {
    let (_, row) = find_header(table)?;
    let name = row.cells.iter().find(|cell| DltdvColumn::parse(cell).is_some())?;
    Some(format!("line {} names `{name}`, a point in a camera as DLTdv and Argus do", row.line))
}

pub(crate) fn read_flat_table<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
) -> ImportResult<TrackFile<'a>> {
    let Some((index, row)) = find_header(table) else {
        let shown = table.first_texts().into_iter().take(8).collect::<Vec<_>>().join(", ");
        return Err(columns_error(table, table.first_line(), &format!("`{shown}`")));
    };
    let columns: Vec<Option<DltdvColumn>> = row.cells.iter().map(|cell| DltdvColumn::parse(cell)).collect();
    let mut cameras = columns.iter().flatten().map(|column| column.camera);
    let first = cameras.next();
    let several = cameras.any(|camera| Some(camera) != first);
    let points = point_columns(table, row, &columns, several)?;
    let first_frame = count_empty_rows(table, index)?;
    let layout = TableLayout { first_frame, ..TableLayout::new(index + 1, row.used_width(), points) };
    let mut export = layout.read_tracks(document, table, pixel_facts(y_axis_of_writer(&columns)))?;
    export.notes.push(format!("rows are frames, the first one frame 0; {FIRST_PIXEL}"));
    let unread = row.texts().into_iter().zip(&columns).filter(|(_, column)| column.is_none());
    let ignored: Vec<&str> = unread.map(|(name, _)| name).filter(|name| !name.is_empty()).collect();
    if !ignored.is_empty() {
        export.notes.push(format!("columns that are not read: {}", ignored.join(", ")));
    }
    if several {
        export.notes.push(SEVERAL_CAMERAS.to_owned());
    }
    Ok(export)
}

/// Finds the points of a table. Each x column must be directly followed by the y column of the same point and
/// camera.
fn point_columns(
    table: &DelimitedTable,
    row: &TextRow,
    columns: &[Option<DltdvColumn>],
    several: bool,
) -> ImportResult<Vec<PointCells>> {
    let mut points = vec![];
    let mut at = 0;
    while let Some(column) = columns.get(at) {
        let Some(x) = column else {
            at += 1;
            continue;
        };
        let y = columns.get(at + 1).copied().flatten();
        let partner = DltdvColumn { is_x: false, ..*x };
        if !x.is_x || y != Some(partner) {
            let found = format!("`{}` in cell {} without its partner", row.cells[at], at + 1);
            return Err(columns_error(table, row.line, &found));
        }
        points.push(PointCells::new(camera_track_name(x.point, x.camera, several), at, Some(at + 1)));
        at += 2;
    }
    Ok(points)
}

/// Number of rows directly below the header whose cells are all empty; they count as frames.
fn count_empty_rows(table: &DelimitedTable, header: usize) -> ImportResult<f64> {
    let mut rows = table.rows(header);
    let (mut count, mut in_data) = (0.0, false);
    while let Some(record) = rows.next_row()? {
        match (in_data, record.is_empty()) {
            (false, _) => in_data = true, // (this row is the header)
            (true, true) => count += 1.0,
            (true, false) => break,
        }
    }
    Ok(count)
}

const VERSION_8_PIXELS: &str =
    "columns that end in _U and _V are those of DLTdv 8, which counts pixels from the top of the picture";
const ARGUS_PIXELS: &str =
    "columns that end in _x and _y are those of Argus, which counts pixels from the bottom of the picture";

fn y_axis_of_writer(columns: &[Option<DltdvColumn>]) -> Fact<YAxis> {
    let mut writers = columns.iter().flatten().map(|column| AXES[column.axes].2);
    let first = writers.next()?;
    let (axis, why) = match first {
        _ if writers.any(|writer| writer != first) => None,
        DltdvWriter::Version8 => Some((YAxis::Down, VERSION_8_PIXELS)),
        DltdvWriter::Argus => Some((YAxis::Up, ARGUS_PIXELS)),
        DltdvWriter::Unknown => None,
    }?;
    Some((axis, why.to_owned()))
}

fn columns_error(table: &DelimitedTable, line: usize, found: &str) -> ImportError {
    let problem = format!("found {found}, expected pairs of columns such as tip_cam1_X and tip_cam1_Y");
    let advice = "import the file that ends in xypts.csv (TrackFile points in DLTdv), with its header row as it was \
        written";
    ImportError::columns(table.file, line, problem, advice)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_camera_of_a_columns_name_counts() {
        let named = |name| DltdvColumn::parse(name).map(|column| (column.point, column.camera, column.is_x));
        assert_eq!(named("pt1_cam1_X"), Some(("pt1", "1", true)));
        assert_eq!(named("lip_cam_left_cam12_V"), Some(("lip_cam_left", "12", false)));
        assert_eq!(named("Track 1_cam_2_y"), Some(("Track 1", "2", false)));
        for name in ["pt1_X", "pt1_cam_X", "pt1_camA_X", "cam1_offset", "pt1_cam1_Z", "x", ""] {
            assert_eq!(named(name), None, "{name}");
        }
    }
}
