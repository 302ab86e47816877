//! ImageJ and Fiji: the Results table, the table of the plugin Manual Tracking, and MTrackJ's table of
//! points.

mod header;
mod manual_tracking;
mod mtrackj;
mod results;

use crate::import::error::ImportError;
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{DelimitedTable, Document, TextRow, TrackFile};

/// ImageJ's tables.
pub(crate) struct ImageJ;

/// Which of them.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ImageJTableKind {
    Results,
    ManualTracking,
    MTrackJ,
}

impl FileFormat for ImageJ {
    fn name(&self) -> &'static str {
        "imagej"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let row = document.table.as_ref().ok()?.head.first()?;
        let what = match table_kind(row)? {
            ImageJTableKind::Results => "ImageJ's Results table",
            ImageJTableKind::ManualTracking => "the table of ImageJ's plugin Manual Tracking",
            ImageJTableKind::MTrackJ => "a table of ImageJ's plugin MTrackJ",
        };
        Some(format!("line {} is the header of {what}", row.line))
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        _options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let Some((row, kind)) = table.head.first().and_then(|row| Some((row, table_kind(row)?))) else {
            return Err(no_header_error(table));
        };
        match kind {
            ImageJTableKind::Results => results::read_results(document, table, row),
            ImageJTableKind::ManualTracking => manual_tracking::read_manual_tracking(document, table, row),
            ImageJTableKind::MTrackJ => mtrackj::read_mtrackj(document, table, row),
        }
    }
}

fn table_kind(row: &TextRow) -> Option<ImageJTableKind> {
    let names = row.texts();
    if manual_tracking::is_manual_tracking_header(&names) {
        Some(ImageJTableKind::ManualTracking)
    } else if mtrackj::is_mtrackj_header(&names) {
        Some(ImageJTableKind::MTrackJ)
    } else {
        results::is_results_header(&names).then_some(ImageJTableKind::Results)
    }
}

fn no_header_error(table: &DelimitedTable) -> ImportError {
    let row = table.head.first();
    ImportError::columns(
        table.file,
        row.map_or(1, |row| row.line),
        format!(
            "found `{}`, expected the header of a table of ImageJ, with X, Y and Slice",
            row.map(TextRow::texts).unwrap_or_default().join(" ")
        ),
        "switch on Edit > Options > Input/Output > Save column headers and save the table again, or \
            number the columns: --format generic --columns frame=4,tip-x=2,tip-y=3",
    )
}
