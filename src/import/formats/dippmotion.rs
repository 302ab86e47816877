//! Reads exports of DIPP-MOTION (DITECT): the data of an X-Y graph as a table in the encoding CP932, below a
//! header of varying length.

use crate::import::error::{ImportError, ImportResult, TextLocation};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{
    Column, CoordinateUnit, DelimitedTable, Document, Fact, Facts, PointCells, TableLayout, TextRow,
    TimeUnit, TrackFile, layout, new_finding,
};
use crate::recording::quality::{Check, QualityFinding, Severity};

/// Beginning of the first line of the file.
const MARK: &str = "DIPP-MOTION";
/// Beginning of the name of the first column: "time" in Japanese.
const TIME: &str = "\u{6642}\u{9593}";
/// Names of the settings for the units of x and y: "unit of the horizontal axis" and "unit of the vertical
/// axis" in Japanese.
const UNITS: [&str; 2] = ["\u{6a2a}\u{8ef8}\u{5358}\u{4f4d}", "\u{7e26}\u{8ef8}\u{5358}\u{4f4d}"];
/// Part of the name of a graph of positions: "coordinate value" in Japanese.
const COORDINATE: &str = "\u{5ea7}\u{6a19}\u{5024}";
/// Endings of the names of the two columns of a point, for x and y.
const AXES: [&str; 2] = ["(X)", "(Y)"];
/// Units of time: symbol in the name of the time column, and length in seconds.
const TIME_UNITS: [(&str, f64); 4] = [("s", 1.0), ("sec", 1.0), ("ms", 1e-3), ("\u{79d2}", 1.0)];
/// If no coordinate of a point is larger than this in absolute value, in units of the file, the point is the
/// origin of a local coordinate system. Rounding errors of 1e-11 occur.
const AT_ORIGIN: f64 = 1e-6;
/// Advice on saving the table that contains the positions.
const MENU: &str = "save the data of the graph of X coordinate against Y coordinate of the points as CSV";

pub(crate) struct DippMotion;

impl FileFormat for DippMotion {
    fn name(&self) -> &'static str {
        "dippmotion"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let start = document.text.trim_start().trim_start_matches('"');
        start.starts_with(MARK).then(|| format!("line 1 starts with `{MARK}`"))
    }

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        refuse_other_graph(table)?;
        let header = find_header(table)?;
        let row = &table.head[header];
        let points = point_columns(table, row)?;
        let facts = Facts { unit: coordinate_unit(table)?, time: time_unit(table, row)?, ..Facts::default() };
        let width = points.iter().flat_map(|point| &point.y).max().map_or(0, |last| last + 1);
        let layout = TableLayout { time: Some(0), ..TableLayout::new(header + 1, width, points) };
        let mut export = layout.read_tracks(document, table, facts)?;
        let origin = local_origin_finding(&export);
        export.findings.extend(origin);
        Ok(export)
    }
}

/// Refuses every graph except that of the coordinate X against the coordinate Y, for example a graph of
/// speeds. A header line in square brackets names the graph.
fn refuse_other_graph(table: &DelimitedTable) -> ImportResult<()> {
    let mut rows = table.head.iter().map(|row| (row.line, row.first_cell()));
    match rows.find(|(_, cell)| cell.starts_with('[') && cell.contains("] - [")) {
        Some((line, graph)) if graph.matches(COORDINATE).count() != 2 => {
            Err(graph_error(table.location(line, 1), format!("the graph {graph}")))
        }
        _ => Ok(()),
    }
}

fn graph_error(place: TextLocation, found: String) -> ImportError {
    ImportError::wrong_table(place, found, "the X and Y coordinates of points over time", MENU)
}

/// Index of the row of column names, whose first cell names the time.
fn find_header(table: &DelimitedTable) -> ImportResult<usize> {
    let names_time = |row: &TextRow| {
        row.first_cell().starts_with(TIME) && row.cells.iter().skip(1).any(|cell| !cell.is_empty())
    };
    table.head.iter().position(names_time).ok_or_else(|| {
        let problem =
            format!("found no row that starts with `{TIME}` and names the points as NAME(X) and NAME(Y)");
        let advice = format!("{MENU}; if the Japanese characters are damaged, add --encoding shift_jis");
        ImportError::columns(table.file, table.first_line(), problem, advice)
    })
}

fn point_columns(table: &DelimitedTable, row: &TextRow) -> ImportResult<Vec<PointCells>> {
    let names: Vec<&str> = row.texts().into_iter().take(row.used_width()).collect();
    layout::read_point_pairs(&names, 1, AXES, str::trim).map_err(|column| {
        let found = format!("the column `{}` without a pair NAME(X), NAME(Y)", names[column]);
        graph_error(table.cell_location(row.line, column), found)
    })
}

/// The unit of x and y; `None` if the header does not contain it. Different units for x and y are refused.
fn coordinate_unit(table: &DelimitedTable) -> ImportResult<Fact<CoordinateUnit>> {
    let named = |name: &str| table.head.iter().find(|row| row.first_cell() == name);
    let [Some(x), Some(y)] = UNITS.map(named) else { return Ok(None) };
    let (unit, other) = (x.cell(1), y.cell(1));
    let refuse = |row: &TextRow, found: String, expected: &str| {
        ImportError::wrong_table(table.cell_location(row.line, 1), found, expected, MENU)
    };
    if unit != other {
        return Err(refuse(y, format!("the unit `{other}` for y and `{unit}` for x"), "one unit for both"));
    }
    match CoordinateUnit::parse(unit) {
        Some(named) => Ok(Some((named, format!("line {} names the unit {unit}", x.line)))),
        None if unit.is_empty() => Ok(None),
        None => Err(refuse(x, format!("the unit `{unit}`"), "a unit of length or pixels")),
    }
}

/// The unit in the name of the time column. If the name contains no unit, seconds are assumed.
fn time_unit(table: &DelimitedTable, row: &TextRow) -> ImportResult<TimeUnit> {
    let name = row.first_cell().trim_start_matches(TIME);
    let sign = name.trim_matches(|c: char| {
        c.is_whitespace() || matches!(c, '(' | ')' | '[' | ']' | '\u{ff08}' | '\u{ff09}')
    });
    match TIME_UNITS.iter().find(|unit| unit.0 == sign) {
        Some(unit) => Ok(TimeUnit::Seconds(unit.1)),
        None if sign.is_empty() => Ok(TimeUnit::AssumedSeconds),
        None => Err(ImportError::wrong_table(
            table.location(row.line, 1),
            format!("times in `{sign}`"),
            "seconds or milliseconds",
            "save the graph with times in seconds",
        )),
    }
}

/// Finding about a point that is always at (0, 0), because it is the origin of a local coordinate system.
fn local_origin_finding(export: &TrackFile) -> Option<QualityFinding> {
    let near = |column: &Column| {
        column.has_values() && column.iter().flatten().all(|value| value.abs() <= AT_ORIGIN)
    };
    let origin = export.tracks.iter().find(|track| near(&track.x) && track.y.as_ref().is_some_and(near))?;
    let found = format!(
        "{}: `{}` stays at (0, 0): all positions are relative to it, in a local system that may also turn with the \
         object",
        export.file, origin.name
    );
    let advice = "tip minus head is right as long as both points are of this file; the head's own motion needs an \
        export in fixed coordinates";
    Some(new_finding(Check::RelativePositions, Severity::Caution, (AT_ORIGIN, ""), found, advice))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time(name: &str) -> Result<TimeUnit, ImportError> {
        let text = format!("{TIME}{name},a(X),a(Y)\n0,1,2\n1,2,3\n");
        let table = DelimitedTable::parse("a.csv", &text).unwrap();
        time_unit(&table, &table.head[0])
    }

    #[test]
    fn times_are_seconds_unless_their_column_says_otherwise() {
        assert_eq!(time(""), Ok(TimeUnit::AssumedSeconds));
        assert_eq!(time("[ms]"), Ok(TimeUnit::Seconds(1e-3)));
        assert_eq!(time(" (\u{79d2})"), Ok(TimeUnit::Seconds(1.0)));
        assert!(
            time("[min]")
                .unwrap_err()
                .to_string()
                .starts_with("a.csv:1:1: found times in `min`, expected seconds")
        );
    }
}
