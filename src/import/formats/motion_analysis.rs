//! motion-analysis-2d (Saga University): one row a frame, times with four decimals.

use super::FileFormat;
use crate::import::error::ImportError;
use crate::import::options::ImportOptions;
use crate::import::reader::{DelimitedTable, Document, Facts, PointCells, TableLayout, TextRow, TrackFile};

/// Names of the first columns.
const CLOCK: [&str; 2] = ["frame_no", "time"];
/// Ends of the column names of a point.
const AXES: [&str; 2] = ["-x", "-y"];
/// Ends of the column names of angles, which stand behind the points; the sign is often lost with its
/// encoding.
const ANGLES: [&str; 3] = ["-\u{3b8}", "-\u{3f4}", "-theta"];

pub(crate) struct MotionAnalysis;

impl FileFormat for MotionAnalysis {
    fn name(&self) -> &'static str {
        "motion-analysis-2d"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let row = document.table.as_ref().ok()?.head.first()?;
        let names = row.texts();
        let others = names.get(CLOCK.len()..)?;
        let of_program = |name: &&str| AXES.iter().chain(&ANGLES).any(|end| name.ends_with(end));
        (names.starts_with(&CLOCK) && !others.is_empty() && others.iter().all(of_program))
            .then(|| format!("line {} names frame_no, time and points as NAME-x and NAME-y", row.line))
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        _options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        let table = document.table()?;
        let row = table
            .head
            .first()
            .filter(|row| row.texts().starts_with(&CLOCK))
            .ok_or_else(|| no_header_error(table))?;
        let names: Vec<&str> = row.texts().into_iter().take(row.used_width()).collect();
        let is_angle = |name: &&str| ANGLES.iter().any(|end| name.ends_with(end));
        let angles = names.iter().position(is_angle).unwrap_or(names.len());
        let points = point_columns(table, row, &names[..angles])?;
        if points.is_empty() {
            return Err(no_points_error(table, row));
        }
        let several = points.len() > 2;
        let layout = TableLayout {
            start: 1,
            width: names.len(),
            most: names.len(),
            frame: Some(0),
            time: Some(1),
            points,
            ..TableLayout::default()
        };
        let mut export = layout.read_tracks(document, table, Facts::default())?;
        if angles < names.len() {
            export
                .notes
                .push(format!("columns from {} on are angles and distances: they are left out", angles + 1));
        } else if several {
            export.notes.push(
                "the program writes a distance between two points like a point: choose tip and head by name"
                    .to_owned(),
            );
        }
        Ok(export)
    }
}

fn point_columns(
    table: &DelimitedTable,
    row: &TextRow,
    names: &[&str],
) -> Result<Vec<PointCells>, ImportError> {
    let mut points = vec![];
    let mut rest = names.iter().enumerate().skip(CLOCK.len());
    while let Some((column, name)) = rest.next() {
        let track = name.strip_suffix(AXES[0]);
        let pair = rest.next().and_then(|(_, name)| name.strip_suffix(AXES[1]));
        let Some(track) = track.filter(|track| pair == Some(*track)) else {
            return Err(unpaired_column_error(table, row, column, name));
        };
        points.push(PointCells::new(track, column, Some(column + 1)));
    }
    Ok(points)
}

fn no_header_error(table: &DelimitedTable) -> ImportError {
    let first = table.head.first();
    ImportError::columns(
        table.file,
        first.map_or(1, |row| row.line),
        format!(
            "found `{}`, expected `frame_no`, `time` and points as NAME-x and NAME-y",
            first.map(TextRow::texts).unwrap_or_default().join(" | ")
        ),
        "export the tracking data as CSV again, or leave --format out",
    )
}

fn no_points_error(table: &DelimitedTable, row: &TextRow) -> ImportError {
    ImportError::wrong_table(
        table.location(row.line, 1),
        "a table of angles alone",
        "points as NAME-x and NAME-y",
        "export with the trackers of the tip and the head",
    )
}

fn unpaired_column_error(table: &DelimitedTable, row: &TextRow, column: usize, name: &str) -> ImportError {
    ImportError::wrong_table(
        table.location(row.line, table.text_column(row.line, column)),
        format!("the column `{name}`"),
        "columns in pairs called NAME-x and NAME-y",
        "export again without changing the columns, or name them with --columns",
    )
}
