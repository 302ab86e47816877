//! Reads tables of the program motion-analysis-2d (Saga University): one row per frame, times with four
//! decimals.

use crate::import::error::{ImportError, ImportResult};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{DelimitedTable, Document, Facts, TableLayout, TrackFile, layout};

/// Names of the first two columns, which contain the frame number and the time.
const CLOCK: [&str; 2] = ["frame_no", "time"];
/// Endings of the names of the two columns of a point, for x and y.
const AXES: [&str; 2] = ["-x", "-y"];
/// Endings of the names of columns with angles. These columns come after those of the points. A wrong
/// encoding often damages the Greek letter.
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

    fn read<'a>(&self, document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        let table = document.table()?;
        let row = table.head.first().filter(|row| row.texts().starts_with(&CLOCK));
        let row = row.ok_or_else(|| no_header_error(table))?;
        let names: Vec<&str> = row.texts().into_iter().take(row.used_width()).collect();
        let is_angle = |name: &&str| ANGLES.iter().any(|end| name.ends_with(end));
        let angles = names.iter().position(is_angle).unwrap_or(names.len());
        let points = layout::read_point_pairs(&names[..angles], CLOCK.len(), AXES, |name| name);
        let points = points.map_err(|column| {
            ImportError::wrong_table(
                table.cell_location(row.line, column),
                format!("the column `{}`", names[column]),
                "columns in pairs called NAME-x and NAME-y",
                "export again without changing the columns, or name them with --columns",
            )
        })?;
        if points.is_empty() {
            return Err(ImportError::wrong_table(
                table.location(row.line, 1),
                "a table of angles alone",
                "points as NAME-x and NAME-y",
                "export with the trackers of the tip and the head",
            ));
        }
        let several = points.len() > 2;
        let layout = TableLayout::new(1, names.len(), points);
        let layout = TableLayout { frame: Some(0), time: Some(1), ..layout };
        let mut export = layout.read_tracks(document, table, Facts::default())?;
        if angles < names.len() {
            let first = angles + 1;
            export.notes.push(format!("columns from {first} on are angles and distances: they are left out"));
        } else if several {
            let note =
                "the program writes a distance between two points like a point: choose tip and head by name";
            export.notes.push(note.to_owned());
        }
        Ok(export)
    }
}

fn no_header_error(table: &DelimitedTable) -> ImportError {
    let found = table.first_texts().join(" | ");
    let problem = format!("found `{found}`, expected `frame_no`, `time` and points as NAME-x and NAME-y");
    let advice = "export the tracking data as CSV again, or leave --format out";
    ImportError::columns(table.file, table.first_line(), problem, advice)
}
