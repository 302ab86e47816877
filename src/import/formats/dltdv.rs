//! DLTdv (versions 5 to 8) and Argus: positions in pixels, as a table with two columns a point and camera or
//! as triplets.

mod flat;
mod pixels;
mod siblings;
mod sparse;

use crate::import::error::ImportError;
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{Document, TrackFile};

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
        of_positions().or_else(|| siblings::recognise_sibling(document).map(|(_, reason)| reason))
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
        let refused = siblings::recognise_sibling(document).map(|(refusal, _)| refusal);
        refused.map_or_else(|| flat::read_flat_table(document, document.table()?), Err)
    }
}
