//! DLTdv (versions 5 to 8) and Argus: positions in pixels, as a table with two columns a point and camera or
//! as triplets.

mod flat;
mod sparse;

use super::FileFormat;
use crate::import::base_name;
use crate::import::error::ImportError;
use crate::import::options::ImportOptions;
use crate::import::reader::{CoordinateUnit, Document, Fact, Facts, TextRow, TrackFile};
use crate::recording::files::YAxis;

/// Tables of digitized points.
pub(crate) struct Dltdv;

impl FileFormat for Dltdv {
    fn name(&self) -> &'static str {
        "dltdv"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let of_positions = || {
            document.table.as_ref().ok().and_then(|table| {
                flat::recognise_flat_table(table).or_else(|| sparse::recognise_sparse_table(table))
            })
        };
        of_positions().or_else(|| recognise_sibling(document).map(|(_, reason)| reason))
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        _options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
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

// What all tables of DLTdv and Argus share: pixels, cameras, and who counts y from where.

/// What decides the direction of y where the table does not.
pub(crate) const Y_AXIS_QUESTION: &str = "DLTdv 8 counts pixels from the top of the picture (down), DLTdv 5 to 7 and \
    Argus from its bottom (up), and this table does not tell which of them wrote it";
pub(crate) const FIRST_PIXEL: &str =
    "the first pixel of a picture is number 1 as in MATLAB; the coordinates are kept as they are";
pub(crate) const SEVERAL_CAMERAS: &str = "several cameras: tip and head have to come from one of them; rows \
    are frames of the first camera, from which the others may be offset";

/// Pixels, with y as it is said or, where nothing says it, as the user has to.
pub(crate) fn pixel_facts(y_axis: Fact<YAxis>) -> Facts {
    let y_axis_open = y_axis.is_none().then_some(Y_AXIS_QUESTION);
    Facts {
        y_axis,
        y_axis_open,
        unit: Some((CoordinateUnit::Pixel, "DLTdv and Argus write pixels".to_owned())),
        ..Facts::default()
    }
}

/// A point's name; with its camera where there are several.
pub(crate) fn camera_track_name(point: &str, camera: &str, several: bool) -> String {
    if several { format!("{point}_cam{camera}") } else { point.to_owned() }
}

// Files that DLTdv writes next to the positions and that hold none: each is refused with the one to import.

/// End of a file's name, what is in it.
const SIBLING_KINDS: [(&str, &str); 5] = [
    ("xyzpts", "positions in space, reconstructed from several cameras"),
    ("xyzres", "residuals of a reconstruction"),
    ("offsets", "offsets between the frames of several cameras"),
    ("dltCoefs", "coefficients of a calibration"),
    ("pointNames", "names of points"),
];
/// Index of the calibration among them, whose content is numbers alone.
const COEFFICIENTS_KIND: usize = 3;
/// Rows of a file of calibration coefficients.
const COEFFICIENTS: usize = 11;

/// The refusal of such a file, and why it is one.
pub(crate) fn recognise_sibling(document: &Document) -> Option<(ImportError, String)> {
    if document.text.starts_with("PointNames_to_go_with") {
        return Some((
            sibling_error(document, 1, 4),
            "line 1 says that it is a list of DLTdv's point names".to_owned(),
        ));
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
    if let Some(kind) = kind {
        return Some((
            sibling_error(document, row.line, kind),
            format!("line {} names the columns of DLTdv's {} file", row.line, SIBLING_KINDS[kind].0),
        ));
    }
    let kind = kind_by_name(document)?;
    Some((
        sibling_error(document, row.line, kind),
        format!("its name ends in {} as that of a file of DLTdv does", SIBLING_KINDS[kind].0),
    ))
}

/// Columns in threes that end in `_X`, `_Y`, `_Z`.
fn has_space_columns(row: &TextRow) -> bool {
    let of_point = |cells: &[String]| {
        let names: Vec<Option<&str>> =
            cells.iter().zip(["_X", "_Y", "_Z"]).map(|(cell, end)| cell.strip_suffix(end)).collect();
        names.len() == 3 && names[0].is_some() && names.iter().all(|name| *name == names[0])
    };
    !row.cells.is_empty() && row.cells.chunks(3).all(of_point)
}

/// Names alone show it only where the content cannot be another program's: triplets and plain numbers.
fn kind_by_name(document: &Document) -> Option<usize> {
    let table = document.table.as_ref().ok()?;
    let stem = base_name(document.stem).to_lowercase();
    let kind = SIBLING_KINDS.iter().position(|(end, _)| stem.ends_with(&end.to_lowercase()))?;
    let title = table.head.first()?.texts().join(" ").to_lowercase();
    (title.starts_with("sparse format") || (kind == COEFFICIENTS_KIND && table.head.len() == COEFFICIENTS))
        .then_some(kind)
}

fn sibling_error(document: &Document, line: usize, kind: usize) -> ImportError {
    let (name, what) = SIBLING_KINDS[kind];
    ImportError::wrong_table(
        format!("{}:{line}:1", document.file),
        format!("{what} (DLTdv's {name} file)"),
        "positions in the picture of a camera",
        "import the file of the same export that ends in xypts.csv or xypts.tsv",
    )
}
