//! Kinovea: trajectories as CSV and as TXT. Projects (`.kva`), tables of chronometers and of the kinematics
//! windows are refused with advice on the export that contains the positions.

use super::layouts::{PLAIN_ROW, PointColumns, ProgramTable};
use crate::import::format::*;
use crate::import::reader::column::ColumnMeaning;
use crate::import::reader::table::column_of_word;

/// Beginning of the root element of a Kinovea project.
const PROJECT: &str = "<KinoveaVideoAnalysis";
/// Number of characters at the start of a file that are searched for the root element of a project.
const PROJECT_START_CHARACTERS: usize = 1000;
/// Name of the only point of a plain track.
const PLAIN_TRACK_KEY: &str = "0";
/// Endings of the row names in a table of Kinovea's chronometers.
const CHRONOMETER: [&str; 2] = ["(Cumulative)", "(Duration)"];
/// Ending of the name of the first column of a kinematics window, in every language of the program.
const MILLISECONDS: &str = "(ms)";
/// Advice on the export that contains the positions.
const EXPORT_MENU: &str = "in Kinovea use File > Export and there the CSV of the trajectories";
/// Note on the units and the direction of y, which depend on Kinovea's preferences and are not in its tables.
const PREFERENCES_NOTE: &str = "Kinovea writes times in the unit of its preferences, and positions \
    with y up in the calibrated unit or, if its preferences say so, in image pixels with y down; the file \
    does not say which";

/// The CSV of the trajectories: one row a frame, with empty cells where a track has no position.
static TRAJECTORIES: ProgramTable = ProgramTable {
    name: "kinovea",
    time: Some("Time"),
    points: PointColumns::Pairs { ends: ["/X", "/Y"], rest: &[], rename: track_name },
    facts: || Facts { time: TimeUnit::Unknown, ..Facts::default() },
    note: PREFERENCES_NOTE,
    advice: EXPORT_MENU,
    ..PLAIN_ROW
};

pub(super) const FORMAT: FormatParser =
    FormatParser { name: TRAJECTORIES.name, recognises: recognise_export, read: read_export };

fn recognise_export(document: &Document) -> Option<String> {
    if document.text.trim_start().starts_with(TITLE) {
        return Some(format!("line 1 starts with `{TITLE}`"));
    }
    let other = || other_export(document).map(|(_, found)| found.to_owned());
    TRAJECTORIES.recognises(document).or_else(other)
}

fn read_export<'a>(document: &'a Document<'a>, options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
    if document.text.trim_start().starts_with(TITLE) {
        return read_text_export(document);
    }
    if let Some((place, found)) = other_export(document) {
        let advice = format!(
            "{EXPORT_MENU}; if a table has positions along the sweep and nothing else is left, leave --format \
             out and say so: --columns time-ms=1,tip-x=2,..."
        );
        return Err(ImportError::wrong_table(place, found, "positions of tracked points as x and y", advice));
    }
    TRAJECTORIES.read(document, options)
}

/// Place and contents of a Kinovea export that has no x and y of points; `None` for any other file.
fn other_export(document: &Document) -> Option<(String, &'static str)> {
    if document.text.chars().take(PROJECT_START_CHARACTERS).collect::<String>().contains(PROJECT) {
        return Some((document.file.to_owned(), "a Kinovea project (.kva)"));
    }
    let table = document.table.as_ref().ok()?;
    let place = table.location(table.first_line(), 1).to_string();
    let chronometer = |row: &TextRow| CHRONOMETER.iter().any(|end| row.first_cell().ends_with(end));
    if table.first_texts().first() == Some(&"") && table.head.get(1).is_some_and(chronometer) {
        return Some((place, "the durations of Kinovea's chronometers"));
    }
    let window = "a table of Kinovea's kinematics windows, which are filtered, keep at most one sample a \
        millisecond, and do not say whether a series is x, y or a speed";
    is_window_table(table).then_some((place, window))
}

/// Whether a table has times in whole milliseconds, and series whose names are not those of coordinates.
fn is_window_table(table: &DelimitedTable) -> bool {
    let names = table.first_texts();
    let Some((time, series)) = names.split_first() else { return false };
    // (other programs call the times `t`)
    let word = time.strip_suffix(MILLISECONDS).map(str::trim);
    let of_time = word.is_some_and(|word| !word.is_empty() && !word.eq_ignore_ascii_case("t"));
    let is_series = |name: &&str| {
        table.parse_cell(name) == CellNumber::Text && ColumnMeaning::parse(name) == ColumnMeaning::Other
    };
    let is_whole = |number| matches!(number, CellNumber::Value(value) if value.fract() == 0.0);
    let whole = |row: &TextRow| is_whole(table.parse_cell(row.first_cell()));
    of_time
        && !series.is_empty()
        && series.iter().all(is_series)
        && table.head.len() > 1
        && table.head.iter().skip(1).all(whole)
}

/// Name of a track, from a column name without the axis. `tip/0` is a plain track called `tip`; in `Angle
/// 1/o`, object and point are both kept.
fn track_name(path: &str) -> &str {
    match path.rsplit_once('/') {
        Some((name, PLAIN_TRACK_KEY)) if !name.is_empty() => name,
        _ => path.trim_start_matches('/'),
    }
}

// Reads Kinovea's text export, which is made for gnuplot. It has a block of rows for each track, and each
// block has its own times.

/// Beginning of the first line of the text export.
const TITLE: &str = "#Kinovea";
/// Line that names the columns.
const COLUMNS: &str = "#T X Y";
/// Number of cells in a row with one point: time, x and y.
const CELLS: usize = 3;

/// Rows of one track.
#[derive(Default)]
struct TrackBlock {
    name: String,
    /// Number of cells in a row, and the rows of the track; `None` until its first row is read.
    rows: Option<(usize, TrackCollector)>,
}

fn read_text_export<'a>(document: &'a Document<'a>) -> ImportResult<TrackFile<'a>> {
    let facts = Facts { time: TimeUnit::Unknown, ..Facts::default() };
    let mut export = TrackFile { facts, ..TrackFile::for_document(document) };
    let marks = find_decimal_marks(document.text);
    let (mut block, mut last) = (TrackBlock::default(), 1);
    for (index, line) in document.text.lines().enumerate() {
        let trimmed = line.trim();
        last = if trimmed.is_empty() { last } else { index + 1 };
        if let Some(name) = trimmed.strip_prefix('#') {
            if !trimmed.starts_with(TITLE) && trimmed != COLUMNS {
                let next = TrackBlock { name: name.trim().to_owned(), rows: None };
                std::mem::replace(&mut block, next).finish(&mut export)?;
            }
        } else if !trimmed.is_empty() {
            let place = TextLocation { file: document.file.to_owned(), line: index + 1, column: 1 };
            block.read_row(place, line, marks)?;
        } else if block.rows.is_some() {
            // (a blank line ends a track, unless it is above the first row)
            std::mem::take(&mut block).finish(&mut export)?;
        }
    }
    block.finish(&mut export)?;
    if export.clocks.is_empty() {
        return Err(ImportError::header_only(document.file, last));
    }
    if marks[0] != marks[1] {
        let [times, positions] = marks;
        let note = format!("the decimal mark of the times is `{times}`, that of the positions `{positions}`");
        export.notes.push(note);
    }
    export.notes.push(PREFERENCES_NOTE.to_owned());
    Ok(export)
}

/// The decimal marks of the times and of the positions, which differ in files of old versions.
fn find_decimal_marks(text: &str) -> [char; 2] {
    let rows = || text.lines().filter(|line| !line.trim_start().starts_with('#'));
    let first_mark = |cells: Vec<&str>| {
        cells.into_iter().flat_map(str::chars).find(|c| matches!(c, '.' | ',')).unwrap_or('.')
    };
    let times = rows().filter_map(|row| row.split_whitespace().next()).collect();
    [first_mark(times), first_mark(rows().flat_map(|row| row.split_whitespace().skip(1)).collect())]
}

impl TrackBlock {
    fn read_row(&mut self, place: TextLocation, text: &str, marks: [char; 2]) -> ImportResult<()> {
        let cells: Vec<&str> = text.split_whitespace().collect();
        let found = cells.len();
        let expected = self.rows.as_ref().map_or(CELLS, |rows| rows.0);
        let first = self.rows.is_none() && found > CELLS && found % 2 == 1;
        if found != expected && !first {
            return Err(ImportError::ragged_row(place, found, expected));
        }
        let mut numbers = vec![];
        for (at, cell) in cells.iter().enumerate() {
            numbers.push(match parse_number(cell, marks[at.min(1)]) {
                CellNumber::Value(value) => Some(value),
                CellNumber::Missing => None,
                CellNumber::Text => {
                    let remedy = (
                        "a number with the decimal mark of the column's other numbers",
                        "export again with one format of numbers, or the CSV of the trajectories; a lost point is NaN",
                    );
                    let name = ["T", "X", "Y"][if at == 0 { 0 } else { 2 - at % 2 }];
                    let place = TextLocation { column: column_of_word(text, at), ..place };
                    return Err(ImportError::cell(place, (name, cell), remedy));
                }
            });
        }
        let name = &self.name;
        let (_, collector) =
            self.rows.get_or_insert_with(|| (found, TrackCollector::new(fields(name, found / 2))));
        let position = |pair: &[Option<f64>]| RowPosition { x: pair[0], y: pair[1], confidence: None };
        let positions: Vec<RowPosition> = numbers[1..].chunks_exact(2).map(position).collect();
        collector.add_row("", RowStamp { line: place.line, frame: None, time: numbers[0] }, &positions);
        Ok(())
    }

    /// Adds the tracks of the block to the export. A block without a name is called by its number.
    fn finish(self, export: &mut TrackFile) -> ImportResult<()> {
        let Some((_, collector)) = self.rows else { return Ok(()) };
        let (clocks, mut tracks) = collector.finish(export.file, RowOrder::AsWritten)?;
        for track in &mut tracks {
            track.clock += export.clocks.len();
            if self.name.is_empty() {
                track.name = format!("track{}{}", export.clocks.len() + 1, track.name);
            }
        }
        export.clocks.extend(clocks);
        export.tracks.extend(tracks);
        Ok(())
    }
}

/// Fields of the rows of a block. The points of an object are numbered, because this export does not name
/// them.
fn fields(name: &str, points: usize) -> InstanceFields {
    let called = |index: usize| if points == 1 { name.to_owned() } else { format!("{name}/{}", index + 1) };
    let points = (0..points)
        .map(|index| PointFields { name: called(index), has_y: true, ..PointFields::default() })
        .collect();
    InstanceFields { has_frame: false, has_time: true, clock_cell: 0, points }
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
            is_window_table(&table)
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
        let table = DelimitedTable::parse("a.csv", "Time (ms);tip\n0,5;1\n1;2\n").unwrap();
        assert!(!is_window_table(&table));
    }
}
