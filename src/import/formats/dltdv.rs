//! DLTdv (versions 5 to 8) and Argus: positions in pixels, as a table with two columns a point and camera or
//! as triplets.

mod flat;
mod pixels;
mod siblings;
mod sparse;

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::Options;
use crate::import::reader::{Document, TrackFile};

/// Tables of digitized points.
pub(crate) struct Dltdv;

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

    fn read<'a>(&self, document: &'a Document<'a>, _options: &Options) -> Result<TrackFile<'a>, ImportError> {
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
