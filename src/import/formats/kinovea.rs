//! Reads the exports of Kinovea: trajectories as CSV and as TXT, and the tables of its kinematics windows.
//! Projects (`.kva`) and tables of chronometers are refused with advice on the export that contains the
//! positions.

mod text;

use super::plain::GENERIC;
use crate::import::error::{ImportError, ImportResult};
use crate::import::format::FileFormat;
use crate::import::options::ImportOptions;
use crate::import::reader::{
    CellNumber, DelimitedTable, Document, Facts, TableLayout, TextRow, TimeUnit, TrackFile, layout,
    new_finding,
};
use crate::recording::quality::{Check, QualityFinding, Severity};
use text::TITLE;

/// Beginning of the root element of a Kinovea project.
const PROJECT: &str = "<KinoveaVideoAnalysis";
/// Number of characters at the start of a file that are searched for the root element of a project.
const PROJECT_START_CHARACTERS: usize = 1000;
/// Name of the first column in the table of the trajectories, in every language of the program.
const TIME: &str = "Time";
/// Endings of the names of the two columns of a point, for x and y.
const AXES: [&str; 2] = ["/X", "/Y"];
/// Name of the only point of a plain track, as in the column name `tip/0/X`.
const PLAIN_TRACK_KEY: &str = "0";
/// Endings of the row names in a table of Kinovea's chronometers.
const CHRONOMETER: [&str; 2] = ["(Cumulative)", "(Duration)"];
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
        let line = document.table.as_ref().map_or(1, DelimitedTable::first_line);
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

    fn read<'a>(&self, document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
        match file_kind(document) {
            Some(KinoveaFileKind::Project) => {
                Err(no_positions_error(document.file, "a Kinovea project (.kva)"))
            }
            Some(KinoveaFileKind::Text) => text::read_text_export(document),
            Some(KinoveaFileKind::Trajectories) => read_trajectories(document, document.table()?),
            Some(KinoveaFileKind::Window) => read_window(document, document.table()?, options),
            Some(KinoveaFileKind::Chronometer) => {
                let place = document.table()?.location(1, 1);
                Err(no_positions_error(place, "the durations of Kinovea's chronometers"))
            }
            None => Err(unknown_table_error(document.table()?)),
        }
    }
}

/// Whether a file is a table of Kinovea's kinematics windows, which needs `--columns`.
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
    let chronometer = |row: &TextRow| CHRONOMETER.iter().any(|end| row.first_cell().ends_with(end));
    if names.first() == Some(&"") && table.head.get(1).is_some_and(chronometer) {
        return Some(KinoveaFileKind::Chronometer);
    }
    is_window_header(table, &names).then_some(KinoveaFileKind::Window)
}

fn no_positions_error(place: impl std::fmt::Display, found: &str) -> ImportError {
    ImportError::wrong_table(place, found, "the positions of tracked points over time", EXPORT_MENU)
}

fn unknown_table_error(table: &DelimitedTable) -> ImportError {
    let problem = format!(
        "found `{}`, expected `{TIME}` and pairs of columns called NAME/POINT/X and NAME/POINT/Y",
        table.first_texts().join(" | ")
    );
    let advice = format!("{EXPORT_MENU}, or leave --format out");
    ImportError::columns(table.file, table.first_line(), problem, advice)
}

/// Reads the CSV of the trajectories: one row per frame, with empty cells where a track has no position.
fn read_trajectories<'a>(document: &'a Document, table: &'a DelimitedTable) -> ImportResult<TrackFile<'a>> {
    let Some(header) = table.head.first() else { return Err(unknown_table_error(table)) };
    let names: Vec<&str> = header.texts().into_iter().take(header.used_width()).collect();
    let points = layout::read_point_pairs(&names, 1, AXES, track_name).map_err(|column| {
        ImportError::wrong_table(
            table.cell_location(header.line, column),
            format!("the column `{}`", names[column]),
            "columns in pairs called NAME/POINT/X and NAME/POINT/Y",
            "export again without changing the columns, or name them with --columns",
        )
    })?;
    let start = table.first_numeric_row(1, &[0]).unwrap_or(1);
    if let Some(row) = table.head.get(1).filter(|_| start > 1) {
        return Err(table.not_a_number_error(row.line, 0, row.first_cell(), "time"));
    }
    let layout = TableLayout { time: Some(0), ..TableLayout::new(start, names.len(), points) };
    let mut export = layout.read_tracks(document, table, kinovea_facts())?;
    export.notes.push(PREFERENCES_NOTE.to_owned());
    Ok(export)
}

/// Name of a track, from a column name without the axis. `tip/0` is a plain track called `tip`; in `Angle
/// 1/o`, object and point are both kept.
fn track_name(path: &str) -> &str {
    match path.rsplit_once('/') {
        Some((name, PLAIN_TRACK_KEY)) if !name.is_empty() => name,
        _ => path.trim_start_matches('/'),
    }
}

/// Advice on the export that contains the positions.
const EXPORT_MENU: &str = "in Kinovea use File > Export and there the CSV of the trajectories";

/// Note on the units and the direction of y, which depend on Kinovea's preferences and are not in its tables.
const PREFERENCES_NOTE: &str = "Kinovea writes times in the unit of its preferences, and positions \
    with y up in the calibrated unit or, if its preferences say so, in image pixels with y down; the file \
    does not say which";

pub(crate) fn kinovea_facts() -> Facts {
    Facts { time: TimeUnit::Unknown, ..Facts::default() }
}

// Tables of Kinovea's kinematics windows: one filtered series per column, times in whole milliseconds.

/// Ending of the name of the first column in a table of the kinematics windows, in every language of the
/// program.
const MILLISECONDS: &str = "(ms)";
/// Frame rate, 1/s, above which several samples have the same time in whole milliseconds; Kinovea then writes
/// only the last of them.
const HIGHEST_RATE_HZ: f64 = 1000.0;
/// Names of the time column that are used by other programs and not by Kinovea.
const OTHER_TIME_NAMES: [&str; 2] = ["t", "T"];

/// Whether a table looks like one of Kinovea's kinematics windows: its times are whole milliseconds, and the
/// names of its series are not names of coordinates.
pub(crate) fn is_window_header(table: &DelimitedTable, names: &[&str]) -> bool {
    let Some((time, series)) = names.split_first() else { return false };
    let word = time.strip_suffix(MILLISECONDS).map(str::trim);
    let of_time = word.is_some_and(|word| !word.is_empty() && !OTHER_TIME_NAMES.contains(&word));
    let text = |name: &&str| table.parse_cell(name) == CellNumber::Text;
    of_time
        && !series.is_empty()
        && series.iter().all(|name| text(name) && !is_coordinate(name))
        && !has_coordinate_pair(series)
        && is_whole_column(table, 0)
}

/// Whether the list contains two names that differ only in x and y, such as `tipX` and `tipY`.
fn has_coordinate_pair(series: &[&str]) -> bool {
    let names: Vec<String> = series.iter().map(|name| name.to_lowercase()).collect();
    names.iter().any(|name| name.contains('x') && names.contains(&name.replace('x', "y")))
}

fn is_coordinate(name: &str) -> bool {
    name.to_lowercase()
        .split(|c: char| !c.is_alphanumeric())
        .any(|word| matches!(word, "x" | "y" | "z" | "px" | "py" | "frame"))
}

/// Reads a table of Kinovea's kinematics windows. It needs `--columns`, because it does not say what its
/// series are.
pub(crate) fn read_window<'a>(
    document: &'a Document<'a>,
    table: &DelimitedTable,
    options: &ImportOptions,
) -> ImportResult<TrackFile<'a>> {
    if options.columns.is_none() {
        return Err(unnamed_window_error(table));
    }
    if let Some(rate) = options.frame_rate_hz.filter(|rate| *rate > HIGHEST_RATE_HZ) {
        return Err(samples_lost_error(table, rate));
    }
    let mut export = GENERIC.read(document, options)?;
    export.facts.time = TimeUnit::Seconds(1e-3);
    let found = format!(
        "{}: Kinovea's kinematics windows write positions after a low-pass filter of its own choice",
        document.file
    );
    let advice =
        "components near and above its cut-off are weakened; export the trajectories instead (File > Export)";
    export.findings.push(new_finding(Check::Filtered, Severity::Caution, (0.0, ""), found, advice));
    let lost = lost_samples_finding(&export).filter(|_| options.frame_rate_hz.is_none());
    export.findings.extend(lost);
    Ok(export)
}

fn unnamed_window_error(table: &DelimitedTable) -> ImportError {
    let found = format!(
        "a table of Kinovea's kinematics windows ({}): filtered, and without a word on whether its series are x, y \
         or speeds",
        table.first_texts().join(", ")
    );
    let advice = format!(
        "{EXPORT_MENU}; if these are positions along the sweep and nothing else is left, say so: --columns \
         time-ms=1,tip-x=2,..."
    );
    let place = table.location(table.first_line(), 1);
    ImportError::wrong_table(place, found, "positions as x and y", advice)
}

fn samples_lost_error(table: &DelimitedTable, rate_hz: f64) -> ImportError {
    ImportError::wrong_table(
        table.location(table.first_line(), 1),
        format!(
            "times in whole milliseconds for {rate_hz} frames/s: Kinovea's kinematics windows keep one \
             sample a millisecond and drop the others"
        ),
        format!("at most {HIGHEST_RATE_HZ} frames/s in such a table"),
        format!("{EXPORT_MENU}; if another program wrote this table, add --format generic"),
    )
}

/// Finding about a table with one row per millisecond. Either the camera recorded at 1000 frames/s, or it was
/// faster and samples were lost.
fn lost_samples_finding(export: &TrackFile) -> Option<QualityFinding> {
    let times = export.clocks.first()?.times();
    let every = times.len() > 1 && times.windows(2).all(|pair| pair[1] - pair[0] == 1.0);
    let found = format!(
        "{}: a row every millisecond: a camera faster than 1000 frames/s has lost samples in this table",
        export.file
    );
    let advice =
        "export the trajectories instead (File > Export), unless the camera recorded at 1000 frames/s";
    let value = (HIGHEST_RATE_HZ, "1/s");
    every.then(|| new_finding(Check::SamplesLost, Severity::Serious, value, found, advice))
}

/// Whether a column contains only whole numbers in the rows of `DelimitedTable::head` below the header.
fn is_whole_column(table: &DelimitedTable, column: usize) -> bool {
    let whole = |row: &TextRow| {
        let number = row.cells.get(column).map(|cell| table.parse_cell(cell));
        matches!(number, Some(CellNumber::Value(value)) if value.fract() == 0.0)
    };
    table.head.len() > 1 && table.head.iter().skip(1).all(whole)
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

    #[test]
    fn tables_with_coordinates_are_those_of_other_programs() {
        let is = |header: &str| {
            let cells = header.split(';').count();
            let row = |value: &str| [value; 8][..cells].join(";");
            let text = format!("{header}\n{}\n{}\n", row("1"), row("2"));
            let table = DelimitedTable::parse("a.csv", &text).unwrap();
            is_window_header(&table, &table.head[0].texts())
        };
        for header in ["Time (ms);tip;head", "Zeit (ms);Spitze", "\u{6642}\u{9593} (ms);1a"] {
            assert!(is(header), "{header}");
        }
        for header in [
            "t (ms);tip;head",
            "Time (s);tip",
            "Time (ms);tipX;tipY",
            "Time (ms);tip_x;tip_y",
            "Time (ms);x (mm)",
            "Time (ms);1;2",
            "frame;tip",
        ] {
            assert!(!is(header), "{header}");
        }
        assert!(!is_window_header(
            &DelimitedTable::parse("a.csv", "Time (ms);tip\n0,5;1\n1;2\n").unwrap(),
            &["Time (ms)", "tip"]
        ));
    }
}
