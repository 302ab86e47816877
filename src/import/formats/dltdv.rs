//! Reads the exports of DLTdv (versions 5 to 8) and Argus: positions in pixels, either as two columns for
//! each point and camera, or as triplets of row, column and value.

mod flat;
mod sparse;

use crate::import::error::{ImportError, ImportResult};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{CoordinateUnit, Document, Fact, Facts, TrackFile};
use crate::recording::files::YAxis;

pub(crate) struct Dltdv;

impl FileFormat for Dltdv {
    fn name(&self) -> &'static str {
        "dltdv"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let table = document.table.as_ref().ok();
        let flat = table.and_then(flat::recognise_flat_table);
        let positions = flat.or_else(|| table.and_then(sparse::recognise_sparse_table));
        positions
            .or_else(|| find_other_content(document).map(|what| format!("line 1 is that of DLTdv's {what}")))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        if let Some(what) = find_other_content(document) {
            let advice = "import the file of the same export that ends in xypts.csv or xypts.tsv";
            let (place, found) = (format!("{}:1:1", document.file), format!("DLTdv's {what}"));
            return Err(ImportError::wrong_table(
                place,
                found,
                "positions in the picture of a camera",
                advice,
            ));
        }
        let table = document.table()?;
        match sparse::recognise_sparse_table(table) {
            Some(_) => sparse::read_sparse_table(document, table),
            None => flat::read_flat_table(document, table),
        }
    }
}

/// Contents of a DLTdv file that has no positions in pictures; `None` for any other file.
fn find_other_content(document: &Document) -> Option<&'static str> {
    let start = document.text.lines().next()?.to_lowercase();
    if start.starts_with("pointnames") {
        return Some("list of point names");
    }
    if start.starts_with("sparse format") && !start.starts_with(sparse::TITLE) {
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
