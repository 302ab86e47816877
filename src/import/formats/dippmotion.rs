//! DIPP-MOTION (DITECT): the table behind an X-Y graph, in CP932, under a header of varying length.

use super::FileFormat;
use crate::import::error::ImportError;
use crate::import::options::ImportOptions;
use crate::import::reader::{
    Column, CoordinateUnit, DelimitedTable, Document, Fact, Facts, PointCells, TableLayout, TextRow,
    TimeUnit, TrackFile, new_finding,
};
use crate::recording::quality::{Check, QualityFinding, Severity};

/// Start of the first line.
const MARK: &str = "DIPP-MOTION";
/// "Time": the first column.
const TIME: &str = "\u{6642}\u{9593}";
/// "Unit of the horizontal axis" and "unit of the vertical axis": x and y of the graph.
const UNITS: [&str; 2] = ["\u{6a2a}\u{8ef8}\u{5358}\u{4f4d}", "\u{7e26}\u{8ef8}\u{5358}\u{4f4d}"];
/// "Coordinate": part of the name of a graph of positions.
const COORDINATE: &str = "\u{5ea7}\u{6a19}\u{5024}";
/// Ends of the column names of a point.
const AXES: [&str; 2] = ["(X)", "(Y)"];
/// Units of time by their sign in a column's name.
const TIME_UNITS: [(&str, f64); 4] = [("s", 1.0), ("sec", 1.0), ("ms", 1e-3), ("\u{79d2}", 1.0)];
/// Largest distance of a point from (0, 0), in units of the file, that is the rounding of a local origin:
/// some 1e-11 are seen.
const AT_ORIGIN: f64 = 1e-6;
/// The table that has the positions.
const MENU: &str = "save the data of the graph of X coordinate against Y coordinate of the points as CSV";

pub(crate) struct DippMotion;

impl FileFormat for DippMotion {
    fn name(&self) -> &'static str {
        "dippmotion"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        document
            .text
            .trim_start()
            .trim_start_matches('"')
            .starts_with(MARK)
            .then(|| format!("line 1 starts with `{MARK}`"))
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        _options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        refuse_other_graph(table)?;
        let header = find_header(table)?;
        let row = &table.head[header];
        let points = point_columns(table, row)?;
        let facts = Facts { unit: coordinate_unit(table)?, time: time_unit(table, row)?, ..Facts::default() };
        let width = points.iter().flat_map(|point| &point.y).max().map_or(0, |last| last + 1);
        let layout = TableLayout {
            start: header + 1,
            width,
            most: width,
            time: Some(0),
            points,
            ..TableLayout::default()
        };
        let mut export = layout.read_tracks(document, table, facts)?;
        let origin = local_origin_finding(&export);
        export.findings.extend(origin);
        Ok(export)
    }
}

/// A bracketed line names the graph: one of speeds or of one coordinate over time has no positions.
fn refuse_other_graph(table: &DelimitedTable) -> Result<(), ImportError> {
    let named = table
        .head
        .iter()
        .filter_map(|row| Some((row, row.cells.first()?)))
        .find(|(_, cell)| cell.starts_with('[') && cell.contains("] - ["));
    match named {
        Some((row, graph)) if graph.matches(COORDINATE).count() != 2 => {
            Err(graph_error(table.location(row.line, 1).to_string(), format!("the graph {graph}")))
        }
        _ => Ok(()),
    }
}

fn graph_error(place: String, found: String) -> ImportError {
    ImportError::wrong_table(place, found, "the X and Y coordinates of points over time", MENU)
}

/// The row that names the columns is the one that starts with the time.
fn find_header(table: &DelimitedTable) -> Result<usize, ImportError> {
    let names_time = |row: &TextRow| {
        row.cells.first().is_some_and(|cell| cell.starts_with(TIME))
            && row.cells.iter().skip(1).any(|cell| !cell.is_empty())
    };
    table.head.iter().position(names_time).ok_or_else(|| {
        ImportError::columns(
            table.file,
            table.head.first().map_or(1, |row| row.line),
            format!("found no row that starts with `{TIME}` and names the points as NAME(X) and NAME(Y)"),
            format!("{MENU}; if the Japanese characters are damaged, add --encoding shift_jis"),
        )
    })
}

fn point_columns(table: &DelimitedTable, row: &TextRow) -> Result<Vec<PointCells>, ImportError> {
    let names: Vec<&str> = row.texts().into_iter().take(row.used_width()).collect();
    let mut points = vec![];
    let mut rest = names.iter().enumerate().skip(1);
    while let Some((column, name)) = rest.next() {
        let track = name.strip_suffix(AXES[0]);
        let pair = rest.next().and_then(|(_, name)| name.strip_suffix(AXES[1]));
        let Some(track) = track.filter(|track| pair == Some(*track)) else {
            return Err(graph_error(
                table.location(row.line, table.text_column(row.line, column)).to_string(),
                format!("the column `{name}` without a pair NAME(X), NAME(Y)"),
            ));
        };
        points.push(PointCells::new(track.trim(), column, Some(column + 1)));
    }
    Ok(points)
}

/// The unit of both axes, where the header has it.
fn coordinate_unit(table: &DelimitedTable) -> Result<Fact<CoordinateUnit>, ImportError> {
    let named = |name: &str| table.head.iter().find(|row| row.cells.first().is_some_and(|cell| cell == name));
    let [Some(x), Some(y)] = UNITS.map(named) else { return Ok(None) };
    let of = |row: &TextRow| row.cells.get(1).cloned().unwrap_or_default();
    let (unit, other) = (of(x), of(y));
    let refuse = |row: &TextRow, found: String, expected: &str| {
        ImportError::wrong_table(
            table.location(row.line, table.text_column(row.line, 1)),
            found,
            expected,
            MENU,
        )
    };
    if unit != other {
        return Err(refuse(y, format!("the unit `{other}` for y and `{unit}` for x"), "one unit for both"));
    }
    match CoordinateUnit::parse(&unit) {
        Some(named) => Ok(Some((named, format!("line {} names the unit {unit}", x.line)))),
        None if unit.is_empty() => Ok(None),
        None => Err(refuse(x, format!("the unit `{unit}`"), "a unit of length or pixels")),
    }
}

/// Seconds, unless the column names another unit.
fn time_unit(table: &DelimitedTable, row: &TextRow) -> Result<TimeUnit, ImportError> {
    let name = row.cells.first().map_or("", |cell| cell.trim_start_matches(TIME));
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

/// A point that never leaves (0, 0) is the origin of a local system, and all others are measured from it.
fn local_origin_finding(export: &TrackFile) -> Option<QualityFinding> {
    let near = |column: &Column| {
        column.has_values() && column.iter().flatten().all(|value| value.abs() <= AT_ORIGIN)
    };
    let origin = export.tracks.iter().find(|track| near(&track.x) && track.y.as_ref().is_some_and(near))?;
    let name = &origin.name;
    Some(new_finding(
        Check::RelativePositions,
        Severity::Caution,
        (AT_ORIGIN, ""),
        format!(
            "{}: `{name}` stays at (0, 0): all positions are relative to it, in a local system that may also \
             turn with the object",
            export.file
        ),
        "tip minus head is right as long as both points are of this file; the head's own motion needs an \
         export in fixed coordinates",
    ))
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
