//! ImageJ and Fiji: the Results table, the table of the plugin Manual Tracking, and MTrackJ's table of
//! points.

mod header;
mod manual_tracking;
mod mtrackj;
mod results;

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::Options;
use crate::import::reader::{Document, Row, Table, TrackFile};

/// ImageJ's tables.
pub(crate) struct ImageJ;

/// Which of them.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Results,
    ManualTracking,
    MTrackJ,
}

impl Format for ImageJ {
    fn name(&self) -> &'static str {
        "imagej"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let row = document.table.as_ref().ok()?.head.first()?;
        let what = match kind(row)? {
            Kind::Results => "ImageJ's Results table",
            Kind::ManualTracking => "the table of ImageJ's plugin Manual Tracking",
            Kind::MTrackJ => "a table of ImageJ's plugin MTrackJ",
        };
        Some(format!("line {} is the header of {what}", row.line))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &Options) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let Some((row, kind)) = table.head.first().and_then(|row| Some((row, kind(row)?))) else {
            return Err(no_header(table));
        };
        match kind {
            Kind::Results => results::read(document, table, row),
            Kind::ManualTracking => manual_tracking::read(document, table, row),
            Kind::MTrackJ => mtrackj::read(document, table, row),
        }
    }
}

fn kind(row: &Row) -> Option<Kind> {
    let names = row.texts();
    if manual_tracking::is_header(&names) {
        Some(Kind::ManualTracking)
    } else if mtrackj::is_header(&names) {
        Some(Kind::MTrackJ)
    } else {
        results::is_header(&names).then_some(Kind::Results)
    }
}

fn no_header(table: &Table) -> ImportError {
    let row = table.head.first();
    ImportError::columns(
        table.file,
        row.map_or(1, |row| row.line),
        format!(
            "found `{}`, expected the header of a table of ImageJ, with X, Y and Slice",
            row.map(Row::texts).unwrap_or_default().join(" ")
        ),
        "switch on Edit > Options > Input/Output > Save column headers and save the table again, or \
            number the columns: --format generic --columns frame=4,tip-x=2,tip-y=3",
    )
}
