//! Reads tables of ImageJ and Fiji: the Results table, the table of the plugin Manual Tracking, and MTrackJ's
//! table of points.

use super::layouts::{PLAIN_ROW, PointColumns, ProgramTable};
use crate::import::format::*;

/// The table of the plugin Manual Tracking: one row per click. Two of the column names end in a degree sign,
/// whose encoding is unknown and which may be lost.
static MANUAL_TRACKING: ProgramTable = ProgramTable {
    name: "imagej",
    frame: Some("Slice n*"),
    key: &["Track n*"],
    points: PointColumns::Named(["X", "Y"]),
    facts: || {
        let why = "Manual Tracking writes X and Y in whole pixels; its calibration is in Distance and Velocity \
            only, which are not read";
        Facts { unit: Some((CoordinateUnit::Pixel, why.to_owned())), ..imagej_facts() }
    },
    advice: "save the plugin's results table as it is, with all its columns",
    ..PLAIN_ROW
};

/// MTrackJ's table of points, with the units in the names of its columns.
static MTRACKJ: ProgramTable = ProgramTable {
    name: "imagej",
    time: Some("t*"),
    key: &["CID", "TID"],
    points: PointColumns::Named(["x*", "y*"]),
    others: (2, &["Nr", "PID"]),
    facts: imagej_facts,
    note: "MTrackJ's times are slices times the frame interval of Image > Properties, which may be that of \
        playback or unset",
    advice: "in MTrackJ press Measure with `Display point measurements` ticked and save that table",
    ..PLAIN_ROW
};

pub(super) const FORMAT: FormatParser =
    FormatParser { name: "imagej", recognises: recognise_export, read: read_export };

fn recognise_export(document: &Document) -> Option<String> {
    if let Some(plugin) = find_plugin(document) {
        return plugin.recognises(document).or(Some("it has columns of the plugin MTrackJ".to_owned()));
    }
    let row = document.table.as_ref().ok()?.head.first()?;
    let results = is_results_header(&row.texts());
    results.then(|| format!("line {} is the header of ImageJ's Results table", row.line))
}

fn read_export<'a>(document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
    let table = document.table()?;
    if let Some(plugin) = find_plugin(document) {
        let advice = "set the frame interval in Image > Properties and measure again, if every time is 0; else \
            correct the track";
        let read = plugin.read(document, options);
        return read.map_err(|error| explain_duplicate(error, "one row a track and time", advice));
    }
    match table.head.first().filter(|row| is_results_header(&row.texts())) {
        Some(row) => read_results(document, table, row),
        None => {
            let found = format!("`{}`", table.first_texts().join(" "));
            let advice = "switch on Edit > Options > Input/Output > Save column headers and save the table again, \
                or number the columns: --format generic --columns frame=4,tip-x=2,tip-y=3";
            let expected = "the header of a table of ImageJ, with X, Y and Slice";
            Err(ImportError::format(table.location(table.first_line(), 1), found, expected, advice))
        }
    }
}

/// The layout of the plugin that wrote a table.
fn find_plugin(document: &Document) -> Option<&'static ProgramTable> {
    let row = document.table.as_ref().ok()?.head.first()?;
    let is_mtrackj = row.first_cell() == "Nr" && row.has("TID");
    let manual = || MANUAL_TRACKING.recognises(document).map(|_| &MANUAL_TRACKING);
    if is_mtrackj { Some(&MTRACKJ) } else { manual() }
}

/// Turns the error for a repeated row into one that says which table to export.
fn explain_duplicate(error: ImportError, expected: &str, advice: &str) -> ImportError {
    let ImportError::DuplicateRow { place, what, found, track, first } = error else { return error };
    let of = if track.is_empty() { track } else { format!(" of track `{track}`") };
    let found = format!("{what} {found}{of} a second time (first in line {first})");
    ImportError::wrong_table(place, found, expected, advice)
}

/// Facts from ImageJ's documentation that hold for all three kinds of tables.
fn imagej_facts() -> Facts {
    let why = "ImageJ counts y from the top of the picture, unless `Invert Y coordinates` was ticked in \
        Analyze > Set Measurements"
        .to_owned();
    Facts { y_axis: Some((YAxis::Down, why)), ..Facts::default() }
}

// The Results table: one row per measurement.

/// Names of the columns with the position of a point: its centroid, or else its centre of mass. `BX` and
/// `BY`, a corner of its bounding box, are not read.
const POSITIONS: [[&str; 2]; 2] = [["X", "Y"], ["XM", "YM"]];
const SLICE: &str = "Slice";
const FRAME: &str = "Frame";
/// Column with the number of the counter to which a point belongs. Counters group the points of ImageJ's
/// multi-point tool.
const COUNTER: &str = "Counter";
/// Names of measurements that show that a table is ImageJ's if its first column has no name.
const MEASUREMENTS: &str = "Area Mean StdDev Mode Min Max XM YM IntDen RawIntDen Ch Counter Label";

/// Whether a header belongs to a Results table. It contains positions and a slice; or its first column has no
/// name, and others have the names of ImageJ's measurements.
fn is_results_header(names: &[&str]) -> bool {
    let has = |name: &str| names.contains(&name);
    let positions = has("X") && has("Y");
    let measured = MEASUREMENTS.split(' ').any(has) && (positions || has(SLICE) || has("Area"));
    (has(SLICE) && positions) || (names.first() == Some(&"") && measured)
}

fn read_results<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
    row: &TextRow,
) -> ImportResult<TrackFile<'a>> {
    let at = |name: &str| row.position(name);
    let refuse = |found: &str, expected: &str, advice: &str| {
        Err(ImportError::wrong_table(table.location(row.line, 1), found, expected, advice))
    };
    let Some([x, y]) = POSITIONS.iter().find_map(|[x, y]| Some([at(x)?, at(y)?])) else {
        let advice = "tick `Centroid` and `Stack position` in Analyze > Set Measurements and measure again";
        return refuse("a Results table without X and Y", "the columns X, Y and Slice", advice);
    };
    let varies = |cell: Option<usize>| -> ImportResult<bool> {
        let Some(cell) = cell else { return Ok(false) };
        Ok(table.find_change(1, |record| record.cell(cell).to_owned())?.1.is_some())
    };
    let frame = match (at(SLICE), at(FRAME)) {
        (Some(_), Some(_)) if varies(at(SLICE))? && varies(at(FRAME))? => {
            let advice = "the table mixes depths and times: keep the rows of one depth, or say which column \
                counts: --columns frame=Frame,tip-x=X,tip-y=Y";
            let found = "a table in which both Slice and Frame change";
            return refuse(found, "one of them to count the frames", advice);
        }
        (Some(slice), Some(_)) if varies(at(SLICE))? => slice,
        (Some(_), Some(frame)) => frame,
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => {
            let advice = "tick `Stack position` in Analyze > Set Measurements and measure again";
            return refuse("a Results table without Slice", "the slice of every point", advice);
        }
    };
    let key: Vec<usize> = if varies(at(COUNTER))? { at(COUNTER).into_iter().collect() } else { vec![] };
    let name = if key.is_empty() { document.stem } else { "" };
    let note = (!key.is_empty()).then(|| "the tracks are the counters of the multi-point tool".to_owned());
    let width = [frame, x, y].into_iter().max().unwrap_or(0) + 1;
    let layout = TableLayout::new(1, width, vec![PointCells::new(name, x, Some(y))]);
    let (most, frame, order) = (row.used_width(), Some(frame), RowOrder::Any);
    let layout = TableLayout { most, frame, order, key, ..layout };
    if at("Label") == Some(0) {
        let advice =
            "rename the image, or untick `Display label` in Analyze > Set Measurements, and measure again";
        table.refuse_comment_names(row.line, "a label", advice)?;
    }
    let advice = "measure one point a slice and save a file for each point, or use Plugins > Tracking > \
        Manual Tracking or MTrackJ, which number their tracks";
    let expected = "one row a slice (and counter): the table does not say which point is which";
    let export = layout.read_tracks(document, table, imagej_facts());
    let mut export = export.map_err(|error| explain_duplicate(error, expected, advice))?;
    export.notes.extend(note);
    Ok(export)
}
