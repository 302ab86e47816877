//! ImageJ's Results table: a row a measurement.

use crate::import::error::ImportError;
use crate::import::formats::imagej::header::{header_error, imagej_facts};
use crate::import::reader::{
    DelimitedTable, Document, PointCells, RowOrder, TableLayout, TextRow, TrackFile,
};

/// Columns that name a point: its centroid, or else its centre of mass. `BX` and `BY` are a corner.
const POSITIONS: [[&str; 2]; 2] = [["X", "Y"], ["XM", "YM"]];
const SLICE: &str = "Slice";
const FRAME: &str = "Frame";
/// Number of the counter of the multi-point tool that a point belongs to.
const COUNTER: &str = "Counter";
/// Measurements that tables of other programs hardly have together with a nameless first column.
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

/// A nameless column of row numbers and ImageJ's measurements, or positions with a slice.
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
) -> Result<TrackFile<'a>, ImportError> {
    let at = |name: &str| row.cells.iter().position(|cell| cell == name);
    let frame = clock_column(table, row)?;
    let Some([x, y]) = POSITIONS.iter().find_map(|[x, y]| Some([at(x)?, at(y)?])) else {
        let advice = "tick `Centroid` and `Stack position` in Analyze > Set Measurements and measure again";
        return Err(header_error(
            table,
            row,
            "a Results table without X and Y".to_owned(),
            "the columns X, Y and Slice",
            advice,
        ));
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
        table.refuse_comment_names(
            row.line,
            "a label",
            "rename the image, or untick `Display label` in Analyze > Set Measurements, and measure again",
        )?;
    }
    let counted = !layout.key.is_empty();
    let mut export = layout
        .read_tracks(document, table, imagej_facts())
        .map_err(|error| several_points_error(error, counted))?;
    if counted {
        export.notes.push("the tracks are the counters of the multi-point tool".to_owned());
    }
    Ok(export)
}

/// The slice, or the frame of a hyperstack: of two the one that counts up.
fn clock_column(table: &DelimitedTable, row: &TextRow) -> Result<usize, ImportError> {
    let at = |name: &str| row.cells.iter().position(|cell| cell == name);
    match (at(SLICE), at(FRAME)) {
        (Some(slice), Some(frame)) => match (column_varies(table, slice)?, column_varies(table, frame)?) {
            (true, true) => {
                let advice = "the table mixes depths and times: keep the rows of one depth, or say which \
                    column counts: --columns frame=Frame,tip-x=X,tip-y=Y";
                Err(header_error(
                    table,
                    row,
                    "a table in which both Slice and Frame change".to_owned(),
                    "one of them to count the frames",
                    advice,
                ))
            }
            (true, false) => Ok(slice),
            _ => Ok(frame),
        },
        (Some(one), None) | (None, Some(one)) => Ok(one),
        (None, None) => {
            let advice = "tick `Stack position` in Analyze > Set Measurements and measure again";
            Err(header_error(
                table,
                row,
                "a Results table without Slice".to_owned(),
                "a column that says in which slice a point was measured",
                advice,
            ))
        }
    }
}

/// Whether a column has more than one text in it.
fn column_varies(table: &DelimitedTable, cell: usize) -> Result<bool, ImportError> {
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

/// Several points in a slice: the table does not say which of them is which.
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
