//! Reads the flat table of DLTdv and Argus: one row per frame, without frame numbers, and columns
//! `NAME_cam1_X`, `NAME_cam1_Y`, ...

use super::{FIRST_PIXEL, SEVERAL_CAMERAS, camera_track_name, pixel_facts};
use crate::import::error::{ImportError, ImportResult};
use crate::import::reader::{DelimitedTable, Document, PointCells, TableLayout, TextRow, TrackFile};
use crate::recording::files::YAxis;

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

pub(super) fn recognise_flat_table(table: &DelimitedTable) -> Option<String> {
    let (_, row) = find_header(table)?;
    Some(format!("line {} names points in cameras as DLTdv and Argus do", row.line))
}

pub(super) fn read_flat_table<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
) -> ImportResult<TrackFile<'a>> {
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
    let (mut rows, mut count) = (table.rows(header), -1.0);
    while let Some(record) = rows.next_row()? {
        // (the first row is the header)
        if count >= 0.0 && !record.is_empty() {
            break;
        }
        count += 1.0;
    }
    Ok(f64::max(count, 0.0))
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
