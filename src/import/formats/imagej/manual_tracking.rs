//! The table of the plugin Manual Tracking: whole pixels, a row a click.

use crate::import::error::ImportError;
use crate::import::formats::imagej::header::{header_error, imagej_facts};
use crate::import::reader::{
    CoordinateUnit, DelimitedTable, Document, Facts, PointCells, RowOrder, TableLayout, TextRow, TrackFile,
};

/// Starts of the two columns that are named with a degree sign, which comes in any encoding or is lost.
const MANUAL_TRACK: &str = "Track n";
const MANUAL_SLICE: &str = "Slice n";
/// Characters that such a name has at most: the degree sign may have become two.
const MANUAL_NAME_LENGTH: usize = MANUAL_TRACK.len() + 3;

fn find_numbered_column(names: &[&str], start: &str) -> Option<usize> {
    names.iter().position(|name| name.starts_with(start) && name.chars().count() <= MANUAL_NAME_LENGTH)
}

pub(crate) fn is_manual_tracking_header(names: &[&str]) -> bool {
    find_numbered_column(names, MANUAL_TRACK).is_some() && find_numbered_column(names, MANUAL_SLICE).is_some()
}

pub(crate) fn read_manual_tracking<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
    row: &TextRow,
) -> Result<TrackFile<'a>, ImportError> {
    let names = row.texts();
    let named = |name: &str| names.iter().position(|other| *other == name);
    let (Some(track), Some(slice), Some(x), Some(y)) = (
        find_numbered_column(&names, MANUAL_TRACK),
        find_numbered_column(&names, MANUAL_SLICE),
        named("X"),
        named("Y"),
    ) else {
        let advice = "save the plugin's results table as it is, with all its columns";
        return Err(header_error(
            table,
            row,
            format!("the columns {}", names.join(", ")),
            "also X and Y",
            advice,
        ));
    };
    let layout = TableLayout {
        start: 1,
        width: [track, slice, x, y].into_iter().max().unwrap_or(0) + 1,
        most: row.used_width(),
        frame: Some(slice),
        key: vec![track],
        order: RowOrder::Any,
        points: vec![PointCells::new("", x, Some(y))],
        ..TableLayout::default()
    };
    let why = "Manual Tracking writes X and Y in whole pixels; its calibration is in Distance and Velocity \
        only, which are not read"
        .to_owned();
    layout.read_tracks(document, table, Facts { unit: Some((CoordinateUnit::Pixel, why)), ..imagej_facts() })
}
