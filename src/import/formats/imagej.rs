//! Reads tables of ImageJ and Fiji: the Results table, the table of the plugin Manual Tracking, and MTrackJ's
//! table of points.

use crate::import::error::{ImportError, ImportResult};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{
    CoordinateUnit, DelimitedTable, Document, Facts, PointCells, RowOrder, TableLayout, TextRow, TimeUnit,
    TrackFile,
};
use crate::recording::files::YAxis;

pub(crate) struct ImageJ;

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

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        let found = table.head.first().and_then(|row| Some((row, table_kind(row)?)));
        let (row, kind) = found.ok_or_else(|| no_header_error(table))?;
        match kind {
            ImageJTableKind::Results => read_results(document, table, row),
            ImageJTableKind::ManualTracking => read_manual_tracking(document, table, row),
            ImageJTableKind::MTrackJ => read_mtrackj(document, table, row),
        }
    }
}

fn table_kind(row: &TextRow) -> Option<ImageJTableKind> {
    let names = row.texts();
    if is_manual_tracking_header(&names) {
        Some(ImageJTableKind::ManualTracking)
    } else if is_mtrackj_header(&names) {
        Some(ImageJTableKind::MTrackJ)
    } else {
        is_results_header(&names).then_some(ImageJTableKind::Results)
    }
}

fn no_header_error(table: &DelimitedTable) -> ImportError {
    let first = table.first_texts().join(" ");
    let problem = format!("found `{first}`, expected the header of a table of ImageJ, with X, Y and Slice");
    let advice = "switch on Edit > Options > Input/Output > Save column headers and save the table again, or number \
        the columns: --format generic --columns frame=4,tip-x=2,tip-y=3";
    ImportError::columns(table.file, table.first_line(), problem, advice)
}

// For all tables of ImageJ: the direction of y, and errors about the header.

/// Facts from ImageJ's documentation that are true for all three kinds of table.
pub(crate) fn imagej_facts() -> Facts {
    let why = "ImageJ counts y from the top of the picture, unless `Invert Y coordinates` was ticked in \
        Analyze > Set Measurements"
        .to_owned();
    Facts { y_axis: Some((YAxis::Down, why)), ..Facts::default() }
}

/// Returns an error that refuses the table and names the line of its header.
fn refuse_header<T>(
    table: &DelimitedTable,
    row: &TextRow,
    found: &str,
    expected: &str,
    advice: &str,
) -> ImportResult<T> {
    Err(ImportError::wrong_table(table.location(row.line, 1), found, expected, advice))
}

// The table of the plugin Manual Tracking: coordinates in whole pixels, one row per mouse click.

/// Beginnings of two column names (`MANUAL_TRACK`, `MANUAL_SLICE`) that end in a degree sign. The degree sign
/// is not compared, because its encoding is unknown and it may be lost.
const MANUAL_TRACK: &str = "Track n";
const MANUAL_SLICE: &str = "Slice n";
/// Maximum number of characters of the column names that end in a degree sign; a wrong encoding may turn this
/// sign into two characters.
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
) -> ImportResult<TrackFile<'a>> {
    let names = row.texts();
    let named = |name: &str| names.iter().position(|other| *other == name);
    let (Some(track), Some(slice), Some(x), Some(y)) = (
        find_numbered_column(&names, MANUAL_TRACK),
        find_numbered_column(&names, MANUAL_SLICE),
        named("X"),
        named("Y"),
    ) else {
        let advice = "save the plugin's results table as it is, with all its columns";
        return refuse_header(
            table,
            row,
            &format!("the columns {}", names.join(", ")),
            "also X and Y",
            advice,
        );
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

// MTrackJ's table of points: coordinates and times with their units in the header.

/// Names of the columns that number clusters, tracks and points. The numbers of points start again in each
/// track, so they are not frame numbers.
const MTRACKJ_CLUSTER: &str = "CID";
const MTRACKJ_TRACK: &str = "TID";
const MTRACKJ_POINT: &str = "PID";
/// Units in the name of the time column that mean that its values are frame numbers.
const FRAME_UNITS: [&str; 2] = ["frame", "frames"];

pub(crate) fn is_mtrackj_header(names: &[&str]) -> bool {
    names.first() == Some(&"Nr") && names.contains(&MTRACKJ_TRACK)
}

/// Index of the column of the quantity `wanted`, and its unit, from a column name such as `x [pixel]`.
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
) -> ImportResult<TrackFile<'a>> {
    let names = row.texts();
    let number = |name: &str| names.iter().position(|other| *other == name);
    let quantities = (find_quantity(&names, "x"), find_quantity(&names, "y"), find_quantity(&names, "t"));
    let (Some(track), Some(_), (Some((x, x_unit)), Some((y, y_unit)), Some((t, t_unit)))) =
        (number(MTRACKJ_TRACK), number(MTRACKJ_POINT), quantities)
    else {
        let advice = "in MTrackJ press Measure with `Display point measurements` ticked and save that table";
        return refuse_header(
            table,
            row,
            "a table of MTrackJ without the x, y and t of points",
            "its table of point measurements",
            advice,
        );
    };
    if x_unit != y_unit {
        let advice = "give the picture one unit of length in Image > Properties and measure again";
        return refuse_header(
            table,
            row,
            &format!("x in `{x_unit}` and y in `{y_unit}`"),
            "one unit of length",
            advice,
        );
    }
    let counts = FRAME_UNITS.contains(&t_unit);
    let layout = TableLayout {
        frame: counts.then_some(t),
        time: (!counts).then_some(t),
        key: number(MTRACKJ_CLUSTER).into_iter().chain([track]).collect(),
        order: RowOrder::Any,
        ..TableLayout::new(1, row.used_width(), vec![PointCells::new("", x, Some(y))])
    };
    let unit = CoordinateUnit::parse(x_unit).map(|unit| (unit, format!("MTrackJ's header says [{x_unit}]")));
    let time = TimeUnit::parse(t_unit).unwrap_or(TimeUnit::Unknown);
    let facts = Facts { unit, time, ..imagej_facts() };
    let mut export = layout.read_tracks(document, table, facts).map_err(no_interval_error)?;
    if !counts {
        let note = "MTrackJ's times are slices times the frame interval of Image > Properties, which may be that of \
            playback or unset";
        export.notes.push(note.to_owned());
    }
    Ok(export)
}

/// Replaces the error for a repeated time by advice to set the frame interval. Without a frame interval,
/// every time in the table is 0.
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

// ImageJ's Results table: one row per measurement.

/// Names of the columns with the position of a point: its centroid, or else its centre of mass. `BX` and
/// `BY`, a corner of its bounding box, are not read.
const POSITIONS: [[&str; 2]; 2] = [["X", "Y"], ["XM", "YM"]];
const SLICE: &str = "Slice";
const FRAME: &str = "Frame";
/// Column with the number of the counter to which a point belongs. Counters group the points of ImageJ's
/// multi-point tool.
const COUNTER: &str = "Counter";
/// Names of measurements that show that a table is ImageJ's if its first column has no name.
const MEASUREMENTS: [&str; 13] = [
    "Area",
    "Mean",
    "StdDev",
    "Mode",
    "Min",
    "Max",
    "XM",
    "YM",
    "IntDen",
    "RawIntDen",
    "Ch",
    COUNTER,
    "Label",
];

/// Whether a header is that of a Results table. Either it names positions and a slice; or its first column
/// has no name, and other columns are called like ImageJ's measurements.
pub(crate) fn is_results_header(names: &[&str]) -> bool {
    let has = |name: &str| names.contains(&name);
    let measured = MEASUREMENTS.iter().any(|name| has(name));
    let positions = has("X") && has("Y");
    (has(SLICE) && positions)
        || (names.first() == Some(&"") && measured && (positions || has(SLICE) || has("Area")))
}

pub(crate) fn read_results<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
    row: &TextRow,
) -> ImportResult<TrackFile<'a>> {
    let at = |name: &str| row.position(name);
    let frame = clock_column(table, row)?;
    let Some([x, y]) = POSITIONS.iter().find_map(|[x, y]| Some([at(x)?, at(y)?])) else {
        let advice = "tick `Centroid` and `Stack position` in Analyze > Set Measurements and measure again";
        return refuse_header(
            table,
            row,
            "a Results table without X and Y",
            "the columns X, Y and Slice",
            advice,
        );
    };
    let key = match at(COUNTER) {
        Some(counter) if column_varies(table, counter)? => vec![counter],
        _ => vec![],
    };
    let name = if key.is_empty() { document.stem } else { "" };
    let layout = TableLayout {
        start: 1,
        width: [frame, x, y].into_iter().max().unwrap_or(0) + 1,
        most: row.used_width(),
        frame: Some(frame),
        order: RowOrder::Any,
        points: vec![PointCells::new(name, x, Some(y))],
        key,
        ..TableLayout::default()
    };
    if at("Label") == Some(0) {
        let advice =
            "rename the image, or untick `Display label` in Analyze > Set Measurements, and measure again";
        table.refuse_comment_names(row.line, "a label", advice)?;
    }
    let counted = !layout.key.is_empty();
    let export = layout.read_tracks(document, table, imagej_facts());
    let mut export = export.map_err(|error| several_points_error(error, counted))?;
    if counted {
        export.notes.push("the tracks are the counters of the multi-point tool".to_owned());
    }
    Ok(export)
}

/// Index of the column that counts the frames: `Slice`, or `Frame` in a hyperstack. If the table has both,
/// the column whose values change is used; the table is refused if both change.
fn clock_column(table: &DelimitedTable, row: &TextRow) -> ImportResult<usize> {
    let at = |name: &str| row.position(name);
    match (at(SLICE), at(FRAME)) {
        (Some(slice), Some(frame)) => match (column_varies(table, slice)?, column_varies(table, frame)?) {
            (true, true) => {
                let advice = "the table mixes depths and times: keep the rows of one depth, or say which \
                    column counts: --columns frame=Frame,tip-x=X,tip-y=Y";
                refuse_header(
                    table,
                    row,
                    "a table in which both Slice and Frame change",
                    "one of them to count the frames",
                    advice,
                )
            }
            (true, false) => Ok(slice),
            _ => Ok(frame),
        },
        (Some(one), None) | (None, Some(one)) => Ok(one),
        (None, None) => {
            let advice = "tick `Stack position` in Analyze > Set Measurements and measure again";
            refuse_header(
                table,
                row,
                "a Results table without Slice",
                "a column that says in which slice a point was measured",
                advice,
            )
        }
    }
}

/// Whether a column contains at least two different texts.
fn column_varies(table: &DelimitedTable, cell: usize) -> ImportResult<bool> {
    let mut rows = table.rows(1);
    let mut first: Option<String> = None;
    while let Some(record) = rows.next_row()? {
        let text = record.cell(cell);
        match &first {
            Some(first) if first != text => return Ok(true),
            Some(_) => {}
            None => first = Some(text.to_owned()),
        }
    }
    Ok(false)
}

/// Replaces the error for two rows in one slice by an error that says that the slice contains several points,
/// which the table does not distinguish.
fn several_points_error(error: ImportError, counted: bool) -> ImportError {
    let ImportError::DuplicateRow { place, found, first, .. } = error else { return error };
    let of = if counted { " and counter" } else { "" };
    ImportError::wrong_table(
        place,
        format!("a second point in slice {found} (first in line {first})"),
        format!("one row a slice{of}: the table does not say which point is which"),
        "measure one point a slice and save a file for each point, or use Plugins > Tracking > \
            Manual Tracking or MTrackJ, which number their tracks",
    )
}
