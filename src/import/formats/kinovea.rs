//! Kinovea: trajectories as CSV and as TXT, and the tables of its kinematics windows. Its own files (`.kva`)
//! and its chronometers are refused with the export that has the positions.

mod preferences;
mod text;
mod window;

use crate::import::error::ImportError;
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{DelimitedTable, Document, PointCells, TableLayout, TextRow, TrackFile};
use preferences::{EXPORT_MENU, PREFERENCES_NOTE, kinovea_facts};
use text::TITLE;

/// Root of a project.
const PROJECT: &str = "<KinoveaVideoAnalysis";
/// Characters at the start of a file in which the root of a project stands.
const PROJECT_START_CHARACTERS: usize = 1000;
/// First column of the trajectories, in every language of the program.
const TIME: &str = "Time";
/// Ends of the column names of a point.
const AXES: [&str; 2] = ["/X", "/Y"];
/// Key of the only point of a plain track.
const PLAIN_TRACK_KEY: &str = "0";
/// Ends of the row names of chronometers.
const CHRONOMETER: [&str; 2] = ["(Cumulative)", "(Duration)"];
/// Kinovea's tables.
pub(crate) struct Kinovea;

enum KinoveaFileKind {
    Project,
    Text,
    Trajectories,
    Window,
    Chronometer,
}

impl FileFormat for Kinovea {
    fn name(&self) -> &'static str {
        "kinovea"
    }

    fn recognises(&self, document: &Document) -> Option<String> {
        let line =
            document.table.as_ref().ok().and_then(|table| table.head.first()).map_or(1, |row| row.line);
        Some(match file_kind(document)? {
            KinoveaFileKind::Project => format!("it starts with `{PROJECT}`"),
            KinoveaFileKind::Text => format!("line 1 starts with `{TITLE}`"),
            KinoveaFileKind::Trajectories => {
                format!("line {line} names `{TIME}` and points as NAME/POINT/X and NAME/POINT/Y")
            }
            KinoveaFileKind::Window => format!(
                "line {line} has a time in whole ms and one column a series, as Kinovea's kinematics windows \
                 write them"
            ),
            KinoveaFileKind::Chronometer => format!("the rows below line {line} are those of chronometers"),
        })
    }

    fn read<'a>(
        &self,
        document: &'a Document<'a>,
        options: &ImportOptions,
    ) -> Result<TrackFile<'a>, ImportError> {
        match file_kind(document) {
            Some(KinoveaFileKind::Project) => {
                Err(no_positions_error(document.file.to_owned(), "a Kinovea project (.kva)", EXPORT_MENU))
            }
            Some(KinoveaFileKind::Text) => text::read_text_export(document),
            Some(KinoveaFileKind::Trajectories) => read_trajectories(document, document.table()?),
            Some(KinoveaFileKind::Window) => window::read_window(document, document.table()?, options),
            Some(KinoveaFileKind::Chronometer) => {
                let place = document.table()?.location(1, 1).to_string();
                Err(no_positions_error(place, "the durations of Kinovea's chronometers", EXPORT_MENU))
            }
            None => Err(unknown_table_error(document.table()?)),
        }
    }
}

/// Whether a file is a table of the kinematics windows, which is read with `--columns`.
pub(crate) fn is_window(document: &Document) -> bool {
    matches!(file_kind(document), Some(KinoveaFileKind::Window))
}

fn file_kind(document: &Document) -> Option<KinoveaFileKind> {
    if document.text.chars().take(PROJECT_START_CHARACTERS).collect::<String>().contains(PROJECT) {
        return Some(KinoveaFileKind::Project);
    }
    if document.text.trim_start().starts_with(TITLE) {
        return Some(KinoveaFileKind::Text);
    }
    let table = document.table.as_ref().ok()?;
    let header = table.head.first()?;
    let names = header.texts();
    let pair = |pair: &[&str]| pair[0].ends_with(AXES[0]) && pair[1].ends_with(AXES[1]);
    if names.first() == Some(&TIME) && names.windows(2).any(pair) {
        return Some(KinoveaFileKind::Trajectories);
    }
    let chronometer = |row: &TextRow| {
        row.cells.first().is_some_and(|cell| CHRONOMETER.iter().any(|end| cell.ends_with(end)))
    };
    if names.first() == Some(&"") && table.head.get(1).is_some_and(chronometer) {
        return Some(KinoveaFileKind::Chronometer);
    }
    window::is_window_header(table, &names).then_some(KinoveaFileKind::Window)
}

fn no_positions_error(place: String, found: &str, advice: &str) -> ImportError {
    let expected = "the positions of tracked points over time".to_owned();
    ImportError::wrong_table(place, found, expected, advice)
}

fn unknown_table_error(table: &DelimitedTable) -> ImportError {
    let first = table.head.first().map(TextRow::texts).unwrap_or_default();
    ImportError::columns(
        table.file,
        table.head.first().map_or(1, |row| row.line),
        format!(
            "found `{}`, expected `{TIME}` and pairs of columns called NAME/POINT/X and NAME/POINT/Y",
            first.join(" | ")
        ),
        format!("{EXPORT_MENU}, or leave --format out"),
    )
}

/// Rows are frames of all tracks; a track without a position in one has empty cells there.
fn read_trajectories<'a>(
    document: &'a Document,
    table: &'a DelimitedTable,
) -> Result<TrackFile<'a>, ImportError> {
    let Some(header) = table.head.first() else { return Err(unknown_table_error(table)) };
    let names: Vec<&str> = header.texts().into_iter().take(header.used_width()).collect();
    let mut points = vec![];
    let mut rest = names.iter().enumerate().skip(1);
    while let Some((column, name)) = rest.next() {
        let track = name.strip_suffix(AXES[0]);
        let pair = rest.next().and_then(|(_, name)| name.strip_suffix(AXES[1]));
        let Some(track) = track.filter(|track| pair == Some(*track)) else {
            return Err(unpaired_column_error(table, header, column, name));
        };
        points.push(PointCells::new(track_name(track), column, Some(column + 1)));
    }
    let start = table.first_numeric_row(1, &[0]).unwrap_or(1);
    if let Some(row) = table.head.get(1).filter(|_| start > 1) {
        let cell = row.cells.first().map_or("", String::as_str);
        return Err(table.not_a_number_error(row.line, 0, cell, "time"));
    }
    let layout = TableLayout {
        start,
        width: names.len(),
        most: names.len(),
        time: Some(0),
        points,
        ..TableLayout::default()
    };
    let mut export = layout.read_tracks(document, table, kinovea_facts())?;
    export.notes.push(PREFERENCES_NOTE.to_owned());
    Ok(export)
}

/// A plain track is called by its name, a point of an object by both.
fn track_name(path: &str) -> &str {
    match path.rsplit_once('/') {
        Some((name, PLAIN_TRACK_KEY)) if !name.is_empty() => name,
        _ => path.trim_start_matches('/'),
    }
}

fn unpaired_column_error(table: &DelimitedTable, header: &TextRow, column: usize, name: &str) -> ImportError {
    ImportError::wrong_table(
        table.location(header.line, table.text_column(header.line, column)),
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
