//! DLTdv (versions 5 to 8) and Argus: positions in pixels, as a table with two columns a point and camera or
//! as triplets.

mod flat;
mod siblings;
mod sparse;

use super::error::ImportError;
use super::export::{Export, Said, Says, Unit};
use super::options::Options;
use super::{Document, Format};
use crate::recording::files::YAxis;

/// What decides the direction of y where the table does not.
const Y_OPEN: &str = "DLTdv 8 counts pixels from the top of the picture (down), DLTdv 5 to 7 and Argus from its bottom (up), and this table does not tell which of them wrote it";
const FIRST_PIXEL: &str =
    "the first pixel of a picture is number 1 as in MATLAB; the coordinates are kept as they are";
const SEVERAL_CAMERAS: &str = "several cameras: tip and head have to come from one of them; rows are frames of the first camera, from which the others may be offset";

/// Tables of digitized points.
pub struct Dltdv;

impl Format for Dltdv {
    fn name(&self) -> &'static str {
        "dltdv"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let of_positions = || {
            document
                .table
                .as_ref()
                .ok()
                .and_then(|table| flat::recognises(table).or_else(|| sparse::recognises(table)))
        };
        of_positions().or_else(|| siblings::recognises(document).map(|(_, reason)| reason))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &Options) -> Result<Export<'a>, ImportError> {
        if let Ok(table) = &document.table {
            if sparse::recognises(table).is_some() {
                return sparse::read(document, table);
            }
            if flat::recognises(table).is_some() {
                return flat::read(document, table);
            }
        }
        let refused = siblings::recognises(document).map(|(refusal, _)| refusal);
        refused.map_or_else(|| flat::read(document, document.table()?), Err)
    }
}

/// Pixels, with y as it is said or, where nothing says it, as the user has to.
fn says(y_axis: Said<YAxis>) -> Says {
    let y_axis_open = y_axis.is_none().then_some(Y_OPEN);
    Says {
        y_axis,
        y_axis_open,
        unit: Some((Unit::Pixel, "DLTdv and Argus write pixels".to_owned())),
        ..Says::default()
    }
}

/// A point's name; with its camera where there are several.
fn track_name(point: &str, camera: &str, several: bool) -> String {
    if several { format!("{point}_cam{camera}") } else { point.to_owned() }
}
