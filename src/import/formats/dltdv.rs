//! Reads the exports of DLTdv (versions 5 to 8) and Argus: positions in pixels, either as two columns for
//! each point and camera, or as triplets of row, column and value.

mod flat;
mod sparse;

use crate::import::error::{ImportError, ImportResult};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{CoordinateUnit, Document, Fact, Facts, TextRow, TrackFile};
use crate::import::source::base_name;
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
        positions.or_else(|| recognise_sibling(document).map(|(_, reason)| reason))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        if let Ok(table) = &document.table {
            if sparse::recognise_sparse_table(table).is_some() {
                return sparse::read_sparse_table(document, table);
            }
            if flat::recognise_flat_table(table).is_some() {
                return flat::read_flat_table(document, table);
            }
        }
        let refused = recognise_sibling(document).map(|(refusal, _)| refusal);
        refused.map_or_else(|| flat::read_flat_table(document, document.table()?), Err)
    }
}

/// Text on what the direction of y depends on, for a table that does not show it.
pub(crate) const Y_AXIS_QUESTION: &str = "DLTdv 8 counts pixels from the top of the picture (down), DLTdv 5 to 7 and \
    Argus from its bottom (up), and this table does not tell which of them wrote it";
pub(crate) const FIRST_PIXEL: &str =
    "the first pixel of a picture is number 1 as in MATLAB; the coordinates are kept as they are";
pub(crate) const SEVERAL_CAMERAS: &str = "several cameras: tip and head have to come from one of them; rows \
    are frames of the first camera, from which the others may be offset";

/// Facts about coordinates in pixels. If the direction of y is `None`, the user is asked for it.
pub(crate) fn pixel_facts(y_axis: Fact<YAxis>) -> Facts {
    let y_axis_open = y_axis.is_none().then_some(Y_AXIS_QUESTION);
    Facts {
        y_axis,
        y_axis_open,
        unit: Some((CoordinateUnit::Pixel, "DLTdv and Argus write pixels".to_owned())),
        ..Facts::default()
    }
}

/// Name of the track of a point. If there are several cameras, it contains the number of the camera.
pub(crate) fn camera_track_name(point: &str, camera: &str, several: bool) -> String {
    if several { format!("{point}_cam{camera}") } else { point.to_owned() }
}

// Files of DLTdv that contain no positions. Each is refused with advice on the file to import instead.

/// Kinds of files without positions: ending of the file's name, and contents in words.
const SIBLING_KINDS: [(&str, &str); 5] = [
    ("xyzpts", "positions in space, reconstructed from several cameras"),
    ("xyzres", "residuals of a reconstruction"),
    ("offsets", "offsets between the frames of several cameras"),
    ("dltCoefs", "coefficients of a calibration"),
    ("pointNames", "names of points"),
];
/// Index of the calibration in `SIBLING_KINDS`; it is recognised by its file name, because it has no header.
const COEFFICIENTS_KIND: usize = 3;
/// Number of rows in a file of calibration coefficients.
const COEFFICIENTS: usize = 11;

/// Error for a file of DLTdv without positions, and the feature that identifies the file.
fn recognise_sibling(document: &Document) -> Option<(ImportError, String)> {
    if document.text.starts_with("PointNames_to_go_with") {
        let reason = "line 1 says that it is a list of DLTdv's point names".to_owned();
        return Some((sibling_error(document, 1, 4), reason));
    }
    let row = document.table.as_ref().ok()?.head.first()?;
    let all = |is: fn(&str) -> bool| !row.cells.is_empty() && row.cells.iter().all(|cell| is(cell));
    let kind = if has_space_columns(row) {
        Some(0)
    } else if all(|cell| cell.ends_with("_dltres")) {
        Some(1)
    } else if all(|cell| cell.starts_with("cam") && cell.ends_with("_offset")) {
        Some(2)
    } else {
        None
    };
    let line = row.line;
    if let Some(kind) = kind {
        let reason = format!("line {line} names the columns of DLTdv's {} file", SIBLING_KINDS[kind].0);
        return Some((sibling_error(document, line, kind), reason));
    }
    let kind = kind_by_name(document)?;
    let reason = format!("its name ends in {} as that of a file of DLTdv does", SIBLING_KINDS[kind].0);
    Some((sibling_error(document, line, kind), reason))
}

/// Whether the columns come in groups of three whose names end in `_X`, `_Y` and `_Z`.
fn has_space_columns(row: &TextRow) -> bool {
    let of_point = |cells: &[String]| {
        let [x, y, z] = cells else { return false };
        let names = [x.strip_suffix("_X"), y.strip_suffix("_Y"), z.strip_suffix("_Z")];
        names[0].is_some() && names.iter().all(|name| *name == names[0])
    };
    !row.cells.is_empty() && row.cells.chunks(3).all(of_point)
}

/// Index in [`SIBLING_KINDS`] of the kind that the name of a file shows; `None` if its contents are neither
/// triplets nor a calibration.
fn kind_by_name(document: &Document) -> Option<usize> {
    let table = document.table.as_ref().ok()?;
    let stem = base_name(document.stem).to_lowercase();
    let kind = SIBLING_KINDS.iter().position(|(end, _)| stem.ends_with(&end.to_lowercase()))?;
    let title = table.first_texts().join(" ").to_lowercase();
    (title.starts_with("sparse format") || (kind == COEFFICIENTS_KIND && table.head.len() == COEFFICIENTS))
        .then_some(kind)
}

fn sibling_error(document: &Document, line: usize, kind: usize) -> ImportError {
    let (name, what) = SIBLING_KINDS[kind];
    let (place, found) = (format!("{}:{line}:1", document.file), format!("{what} (DLTdv's {name} file)"));
    let advice = "import the file of the same export that ends in xypts.csv or xypts.tsv";
    ImportError::wrong_table(place, found, "positions in the picture of a camera", advice)
}
