//! The flat table: one row a frame, without its number; columns `NAME_cam1_X`, `NAME_cam1_Y`, ...

use super::{FIRST_PIXEL, SEVERAL_CAMERAS, camera_track_name, pixel_facts};
use crate::import::error::ImportError;
use crate::import::reader::{DelimitedTable, Document, Fact, PointCells, TableLayout, TextRow, TrackFile};
use crate::recording::files::YAxis;

/// Mark between the name of a point and its camera.
const CAMERA: &str = "_cam";
/// Ends of x and y columns, and which program writes them so.
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
    /// Several programs, which differ in the direction of y.
    Unknown,
}

/// What a column's name says.
#[derive(Clone, Copy)]
struct DltdvColumn<'t> {
    point: &'t str,
    camera: &'t str,
    axes: usize,
    is_x: bool,
}

impl<'t> DltdvColumn<'t> {
    /// Names may hold underscores: the last `_cam` counts.
    fn parse(name: &'t str) -> Option<Self> {
        let ends =
            AXES.iter().enumerate().flat_map(|(axes, (x, y, _))| [(axes, *x, true), (axes, *y, false)]);
        let (axes, is_x, rest) =
            ends.into_iter().find_map(|(axes, end, is_x)| Some((axes, is_x, name.strip_suffix(end)?)))?;
        let (point, camera) = rest.rsplit_once(CAMERA)?;
        let camera = camera.strip_prefix('_').unwrap_or(camera); // (Argus: `_cam_1_x`)
        let is_number = !camera.is_empty() && camera.bytes().all(|byte| byte.is_ascii_digit());
        is_number.then_some(Self { point, camera, axes, is_x })
    }
}

fn find_header<'t>(table: &'t DelimitedTable) -> Option<(usize, &'t TextRow)> {
    table
        .head
        .iter()
        .enumerate()
        .take(2)
        .find(|(_, row)| row.cells.iter().any(|cell| DltdvColumn::parse(cell).is_some()))
}

pub(crate) fn recognise_flat_table(table: &DelimitedTable) -> Option<String> {
    let (_, row) = find_header(table)?;
    let name = row.cells.iter().find(|cell| DltdvColumn::parse(cell).is_some())?;
    Some(format!("line {} names `{name}`, a point in a camera as DLTdv and Argus do", row.line))
}

pub(crate) fn read_flat_table<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
) -> Result<TrackFile<'a>, ImportError> {
    let Some((index, row)) = find_header(table) else {
        let first = table.head.first();
        let shown = first
            .map(|row| row.texts().into_iter().take(8).collect::<Vec<_>>().join(", "))
            .unwrap_or_default();
        return Err(columns_error(table, first.map_or(1, |row| row.line), format!("`{shown}`")));
    };
    let columns: Vec<Option<DltdvColumn>> = row.cells.iter().map(|cell| DltdvColumn::parse(cell)).collect();
    let several = columns
        .iter()
        .flatten()
        .any(|column| columns.iter().flatten().any(|other| other.camera != column.camera));
    let points = point_columns(table, row, &columns, several)?;
    let cells = row.used_width();
    let layout = TableLayout {
        start: index + 1,
        width: cells,
        most: cells,
        first_frame: count_empty_rows(table, index)?,
        points,
        ..TableLayout::default()
    };
    let mut export = layout.read_tracks(document, table, pixel_facts(y_axis_of_writer(&columns)))?;
    export.notes.push(format!("rows are frames, the first one frame 0; {FIRST_PIXEL}"));
    let ignored: Vec<&str> = row
        .texts()
        .into_iter()
        .zip(&columns)
        .filter(|(name, column)| column.is_none() && !name.is_empty())
        .map(|(name, _)| name)
        .collect();
    if !ignored.is_empty() {
        export.notes.push(format!("columns that are not read: {}", ignored.join(", ")));
    }
    if several {
        export.notes.push(SEVERAL_CAMERAS.to_owned());
    }
    Ok(export)
}

/// Every x has its y to the right.
fn point_columns(
    table: &DelimitedTable,
    row: &TextRow,
    columns: &[Option<DltdvColumn>],
    several: bool,
) -> Result<Vec<PointCells>, ImportError> {
    let mut points = vec![];
    let mut at = 0;
    while let Some(column) = columns.get(at) {
        let Some(x) = column else {
            at += 1;
            continue;
        };
        let y = columns.get(at + 1).copied().flatten();
        let pairs = y
            .is_some_and(|y| !y.is_x && x.is_x && (x.point, x.camera, x.axes) == (y.point, y.camera, y.axes));
        if !pairs {
            return Err(columns_error(
                table,
                row.line,
                format!("`{}` in cell {} without its partner", row.cells[at], at + 1),
            ));
        }
        points.push(PointCells::new(camera_track_name(x.point, x.camera, several), at, Some(at + 1)));
        at += 2;
    }
    Ok(points)
}

/// Rows of empty cells between the header and the first row with anything in it: they are frames too.
fn count_empty_rows(table: &DelimitedTable, header: usize) -> Result<f64, ImportError> {
    let mut rows = table.rows(header);
    let (mut count, mut in_data) = (0.0, false);
    while let Some(record) = rows.next_row()? {
        match (in_data, record.is_empty()) {
            (false, _) => in_data = true, // the header itself
            (true, true) => count += 1.0,
            (true, false) => break,
        }
    }
    Ok(count)
}

fn y_axis_of_writer(columns: &[Option<DltdvColumn>]) -> Fact<YAxis> {
    let mut writers = columns.iter().flatten().map(|column| AXES[column.axes].2);
    let first = writers.next()?;
    match first {
        _ if writers.any(|writer| writer != first) => None,
        DltdvWriter::Version8 => Some((
            YAxis::Down,
            "columns that end in _U and _V are those of DLTdv 8, which counts pixels from \
                the top of the picture"
                .to_owned(),
        )),
        DltdvWriter::Argus => Some((
            YAxis::Up,
            "columns that end in _x and _y are those of Argus, which counts \
            pixels from the bottom of the picture"
                .to_owned(),
        )),
        DltdvWriter::Unknown => None,
    }
}

fn columns_error(table: &DelimitedTable, line: usize, found: String) -> ImportError {
    ImportError::columns(
        table.file,
        line,
        format!("found {found}, expected pairs of columns such as tip_cam1_X and tip_cam1_Y"),
        "import the file that ends in xypts.csv (TrackFile points in DLTdv), with its header \
            row as it was written",
    )
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
