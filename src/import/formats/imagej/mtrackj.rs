//! MTrackJ's table of points: coordinates and times with their units in the header.

use crate::import::error::ImportError;
use crate::import::formats::imagej::header::{header_error, imagej_facts};
use crate::import::reader::{
    CoordinateUnit, DelimitedTable, Document, Facts, PointCells, RowOrder, TableLayout, TextRow, TimeUnit,
    TrackFile,
};

/// Columns that number clusters, tracks and points; a point's number starts again in each track and is no
/// frame.
const MTRACKJ_CLUSTER: &str = "CID";
const MTRACKJ_TRACK: &str = "TID";
const MTRACKJ_POINT: &str = "PID";
/// Units in which the times number the frames.
const FRAME_UNITS: [&str; 2] = ["frame", "frames"];

pub(crate) fn is_mtrackj_header(names: &[&str]) -> bool {
    names.first() == Some(&"Nr") && names.contains(&MTRACKJ_TRACK)
}

/// Index and unit of a column such as `x [pixel]`.
fn find_quantity<'r>(names: &[&'r str], wanted: &str) -> Option<(usize, &'r str)> {
    names.iter().enumerate().find_map(|(at, name)| {
        let (quantity, unit) = name
            .split_once('[')
            .map_or((*name, ""), |(quantity, unit)| (quantity, unit.trim_end_matches(']')));
        (quantity.trim() == wanted).then_some((at, unit.trim()))
    })
}

pub(crate) fn read_mtrackj<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
    row: &TextRow,
) -> Result<TrackFile<'a>, ImportError> {
    let names = row.texts();
    let number = |name: &str| names.iter().position(|other| *other == name);
    let quantities = (find_quantity(&names, "x"), find_quantity(&names, "y"), find_quantity(&names, "t"));
    let (Some(track), Some(_), (Some((x, x_unit)), Some((y, y_unit)), Some((t, t_unit)))) =
        (number(MTRACKJ_TRACK), number(MTRACKJ_POINT), quantities)
    else {
        let advice = "in MTrackJ press Measure with `Display point measurements` ticked and save that table";
        return Err(header_error(
            table,
            row,
            "a table of MTrackJ without the x, y and t of points".to_owned(),
            "its table of point measurements",
            advice,
        ));
    };
    if x_unit != y_unit {
        let advice = "give the picture one unit of length in Image > Properties and measure again";
        return Err(header_error(
            table,
            row,
            format!("x in `{x_unit}` and y in `{y_unit}`"),
            "one unit of length",
            advice,
        ));
    }
    let counts = FRAME_UNITS.contains(&t_unit);
    let layout = TableLayout {
        start: 1,
        width: row.used_width(),
        most: row.used_width(),
        frame: counts.then_some(t),
        time: (!counts).then_some(t),
        key: number(MTRACKJ_CLUSTER).into_iter().chain([track]).collect(),
        order: RowOrder::Any,
        points: vec![PointCells::new("", x, Some(y))],
        ..TableLayout::default()
    };
    let unit = CoordinateUnit::parse(x_unit).map(|unit| (unit, format!("MTrackJ's header says [{x_unit}]")));
    let time = TimeUnit::parse(t_unit).unwrap_or(TimeUnit::Unknown);
    let mut export = layout
        .read_tracks(document, table, Facts { unit, time, ..imagej_facts() })
        .map_err(no_interval_error)?;
    if !counts {
        export.notes.push(
            "MTrackJ's times are slices times the frame interval of Image > Properties, which \
            may be that of playback or unset"
                .to_owned(),
        );
    }
    Ok(export)
}

/// Without a frame interval every time is 0.
fn no_interval_error(error: ImportError) -> ImportError {
    match error {
        ImportError::DuplicateRow { place, what: "time", found, track, first } => ImportError::wrong_table(
            place,
            format!("the time {found} of track {track} a second time (first in line {first})"),
            "one row a track and time",
            "set the frame interval in Image > Properties and measure again",
        ),
        other => other,
    }
}
