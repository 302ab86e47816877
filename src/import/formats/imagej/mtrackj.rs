//! MTrackJ's table of points: coordinates and times with their units in the header.

use crate::import::error::ImportError;
use crate::import::formats::imagej::header::{facts, wrong};
use crate::import::reader::{
    Document, Facts, Layout, Order, PointCells, Row, Table, TimeUnit, TrackFile, Unit,
};

/// Columns that number clusters, tracks and points; a point's number starts again in each track and is no
/// frame.
const CLUSTER: &str = "CID";
const TRACK: &str = "TID";
const POINT: &str = "PID";
/// Units in which the times number the frames.
const FRAMES: [&str; 2] = ["frame", "frames"];

pub(crate) fn is_header(names: &[&str]) -> bool {
    names.first() == Some(&"Nr") && names.contains(&TRACK)
}

/// Index and unit of a column such as `x [pixel]`.
fn quantity<'r>(names: &[&'r str], wanted: &str) -> Option<(usize, &'r str)> {
    names.iter().enumerate().find_map(|(at, name)| {
        let (quantity, unit) = name
            .split_once('[')
            .map_or((*name, ""), |(quantity, unit)| (quantity, unit.trim_end_matches(']')));
        (quantity.trim() == wanted).then_some((at, unit.trim()))
    })
}

pub(crate) fn read<'a>(
    document: &'a Document,
    table: &'a Table,
    row: &Row,
) -> Result<TrackFile<'a>, ImportError> {
    let names = row.texts();
    let number = |name: &str| names.iter().position(|other| *other == name);
    let quantities = (quantity(&names, "x"), quantity(&names, "y"), quantity(&names, "t"));
    let (Some(track), Some(_), (Some((x, x_unit)), Some((y, y_unit)), Some((t, t_unit)))) =
        (number(TRACK), number(POINT), quantities)
    else {
        let advice = "in MTrackJ press Measure with `Display point measurements` ticked and save that table";
        return Err(wrong(
            table,
            row,
            "a table of MTrackJ without the x, y and t of points".to_owned(),
            "its table of point measurements",
            advice,
        ));
    };
    if x_unit != y_unit {
        let advice = "give the picture one unit of length in Image > Properties and measure again";
        return Err(wrong(
            table,
            row,
            format!("x in `{x_unit}` and y in `{y_unit}`"),
            "one unit of length",
            advice,
        ));
    }
    let counts = FRAMES.contains(&t_unit);
    let layout = Layout {
        start: 1,
        width: row.filled(),
        most: row.filled(),
        frame: counts.then_some(t),
        time: (!counts).then_some(t),
        key: number(CLUSTER).into_iter().chain([track]).collect(),
        order: Order::Any,
        points: vec![PointCells::new("", x, Some(y))],
        ..Layout::default()
    };
    let unit = Unit::named(x_unit).map(|unit| (unit, format!("MTrackJ's header says [{x_unit}]")));
    let time = TimeUnit::named(t_unit).unwrap_or(TimeUnit::Unknown);
    let mut export = layout.read(document, table, Facts { unit, time, ..facts() }).map_err(no_interval)?;
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
fn no_interval(error: ImportError) -> ImportError {
    match error {
        ImportError::Twice { place, what: "time", found, track, first } => ImportError::wrong_table(
            place,
            format!("the time {found} of track {track} a second time (first in line {first})"),
            "one row a track and time",
            "set the frame interval in Image > Properties and measure again",
        ),
        other => other,
    }
}
