//! The table of the plugin Manual Tracking: whole pixels, a row a click.

use crate::import::error::ImportError;
use crate::import::formats::imagej::header::{facts, wrong};
use crate::import::reader::{Document, Facts, Layout, Order, PointCells, Row, Table, TrackFile, Unit};

/// Starts of the two columns that are named with a degree sign, which comes in any encoding or is lost.
const TRACK: &str = "Track n";
const SLICE: &str = "Slice n";
/// Characters that such a name has at most: the degree sign may have become two.
const LONGEST: usize = TRACK.len() + 3;

fn at(names: &[&str], start: &str) -> Option<usize> {
    names.iter().position(|name| name.starts_with(start) && name.chars().count() <= LONGEST)
}

pub(crate) fn is_header(names: &[&str]) -> bool {
    at(names, TRACK).is_some() && at(names, SLICE).is_some()
}

pub(crate) fn read<'a>(
    document: &'a Document,
    table: &'a Table,
    row: &Row,
) -> Result<TrackFile<'a>, ImportError> {
    let names = row.texts();
    let named = |name: &str| names.iter().position(|other| *other == name);
    let (Some(track), Some(slice), Some(x), Some(y)) =
        (at(&names, TRACK), at(&names, SLICE), named("X"), named("Y"))
    else {
        let advice = "save the plugin's results table as it is, with all its columns";
        return Err(wrong(table, row, format!("the columns {}", names.join(", ")), "also X and Y", advice));
    };
    let layout = Layout {
        start: 1,
        width: [track, slice, x, y].into_iter().max().unwrap_or(0) + 1,
        most: row.filled(),
        frame: Some(slice),
        key: vec![track],
        order: Order::Any,
        points: vec![PointCells::new("", x, Some(y))],
        ..Layout::default()
    };
    let why = "Manual Tracking writes X and Y in whole pixels; its calibration is in Distance and Velocity \
        only, which are not read"
        .to_owned();
    layout.read(document, table, Facts { unit: Some((Unit::Pixel, why)), ..facts() })
}
