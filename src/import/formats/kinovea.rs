//! Kinovea: trajectories as CSV and as TXT, and the tables of its kinematics windows. Its own files (`.kva`)
//! and its chronometers are refused with the export that has the positions.

mod preferences;
mod text;
mod window;

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::Options;
use crate::import::reader::{Document, Layout, PointCells, Row, Table, TrackFile};
use preferences::{MENU, PREFERENCES, facts};
use text::TITLE;

/// Root of a project.
const PROJECT: &str = "<KinoveaVideoAnalysis";
/// Characters at the start of a file in which the root of a project stands.
const START: usize = 1000;
/// First column of the trajectories, in every language of the program.
const TIME: &str = "Time";
/// Ends of the column names of a point.
const AXES: [&str; 2] = ["/X", "/Y"];
/// Key of the only point of a plain track.
const PLAIN: &str = "0";
/// Ends of the row names of chronometers.
const CHRONOMETER: [&str; 2] = ["(Cumulative)", "(Duration)"];
/// Kinovea's tables.
pub(crate) struct Kinovea;

enum Kind {
    Project,
    Text,
    Trajectories,
    Window,
    Chronometer,
}

impl Format for Kinovea {
    fn name(&self) -> &'static str {
        "kinovea"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let line =
            document.table.as_ref().ok().and_then(|table| table.head.first()).map_or(1, |row| row.line);
        Some(match kind(document)? {
            Kind::Project => format!("it starts with `{PROJECT}`"),
            Kind::Text => format!("line 1 starts with `{TITLE}`"),
            Kind::Trajectories => {
                format!("line {line} names `{TIME}` and points as NAME/POINT/X and NAME/POINT/Y")
            }
            Kind::Window => format!(
                "line {line} has a time in whole ms and one column a series, as Kinovea's kinematics windows \
                 write them"
            ),
            Kind::Chronometer => format!("the rows below line {line} are those of chronometers"),
        })
    }

    fn read<'a>(&self, document: &'a Document<'a>, options: &Options) -> Result<TrackFile<'a>, ImportError> {
        match kind(document) {
            Some(Kind::Project) => Err(wrong(document.file.to_owned(), "a Kinovea project (.kva)", MENU)),
            Some(Kind::Text) => text::read(document),
            Some(Kind::Trajectories) => trajectories(document, document.table()?),
            Some(Kind::Window) => window::read(document, document.table()?, options),
            Some(Kind::Chronometer) => {
                let place = document.table()?.place(1, 1).to_string();
                Err(wrong(place, "the durations of Kinovea's chronometers", MENU))
            }
            None => Err(unknown(document.table()?)),
        }
    }
}

/// Whether a file is a table of the kinematics windows, which is read with `--columns`.
pub(crate) fn is_window(document: &Document) -> bool {
    matches!(kind(document), Some(Kind::Window))
}

fn kind(document: &Document) -> Option<Kind> {
    if document.text.chars().take(START).collect::<String>().contains(PROJECT) {
        return Some(Kind::Project);
    }
    if document.text.trim_start().starts_with(TITLE) {
        return Some(Kind::Text);
    }
    let table = document.table.as_ref().ok()?;
    let header = table.head.first()?;
    let names = header.texts();
    let pair = |pair: &[&str]| pair[0].ends_with(AXES[0]) && pair[1].ends_with(AXES[1]);
    if names.first() == Some(&TIME) && names.windows(2).any(pair) {
        return Some(Kind::Trajectories);
    }
    let chronometer =
        |row: &Row| row.cells.first().is_some_and(|cell| CHRONOMETER.iter().any(|end| cell.ends_with(end)));
    if names.first() == Some(&"") && table.head.get(1).is_some_and(chronometer) {
        return Some(Kind::Chronometer);
    }
    window::is_header(table, &names).then_some(Kind::Window)
}

fn wrong(place: String, found: &str, advice: &str) -> ImportError {
    let expected = "the positions of tracked points over time".to_owned();
    ImportError::wrong_table(place, found, expected, advice)
}

fn unknown(table: &Table) -> ImportError {
    let first = table.head.first().map(Row::texts).unwrap_or_default();
    ImportError::columns(
        table.file,
        table.head.first().map_or(1, |row| row.line),
        format!(
            "found `{}`, expected `{TIME}` and pairs of columns called NAME/POINT/X and NAME/POINT/Y",
            first.join(" | ")
        ),
        format!("{MENU}, or leave --format out"),
    )
}

/// Rows are frames of all tracks; a track without a position in one has empty cells there.
fn trajectories<'a>(document: &'a Document, table: &'a Table) -> Result<TrackFile<'a>, ImportError> {
    let Some(header) = table.head.first() else { return Err(unknown(table)) };
    let names: Vec<&str> = header.texts().into_iter().take(header.filled()).collect();
    let mut points = vec![];
    let mut rest = names.iter().enumerate().skip(1);
    while let Some((column, name)) = rest.next() {
        let track = name.strip_suffix(AXES[0]);
        let pair = rest.next().and_then(|(_, name)| name.strip_suffix(AXES[1]));
        let Some(track) = track.filter(|track| pair == Some(*track)) else {
            return Err(unpaired(table, header, column, name));
        };
        points.push(PointCells::new(track_name(track), column, Some(column + 1)));
    }
    let start = table.first_numeric(1, &[0]).unwrap_or(1);
    if let Some(row) = table.head.get(1).filter(|_| start > 1) {
        let cell = row.cells.first().map_or("", String::as_str);
        return Err(table.not_a_number(row.line, 0, cell, "time"));
    }
    let layout =
        Layout { start, width: names.len(), most: names.len(), time: Some(0), points, ..Layout::default() };
    let mut export = layout.read(document, table, facts())?;
    export.notes.push(PREFERENCES.to_owned());
    Ok(export)
}

/// A plain track is called by its name, a point of an object by both.
fn track_name(path: &str) -> &str {
    match path.rsplit_once('/') {
        Some((name, PLAIN)) if !name.is_empty() => name,
        _ => path.trim_start_matches('/'),
    }
}

fn unpaired(table: &Table, header: &Row, column: usize, name: &str) -> ImportError {
    ImportError::wrong_table(
        table.place(header.line, table.column(header.line, column)),
        format!("the column `{name}`"),
        "columns in pairs called NAME/POINT/X and NAME/POINT/Y",
        "export again without changing the columns, or name them with --columns",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tracks_are_called_by_name_and_points_of_objects_by_both() {
        assert_eq!(
            ["tip/0", "a/b/0", "Angle 1/o", "/0", "tip"].map(track_name),
            ["tip", "a/b", "Angle 1/o", "0", "tip"]
        );
    }
}
