//! Tables of Kinovea's kinematics windows: filtered, one column a series, times rounded to whole
//! milliseconds.

use crate::import::error::ImportError;
use crate::import::format::FileFormat;
use crate::import::formats::generic::GenericFormat;
use crate::import::formats::kinovea::preferences::EXPORT_MENU;
use crate::import::options::ImportOptions;
use crate::import::reader::{
    CellNumber, Column, DelimitedTable, Document, TextRow, TimeUnit, TrackFile, new_finding,
};
use crate::recording::quality::{Check, QualityFinding, Severity};

/// End of the first column's name, in every language of the program.
const MILLISECONDS: &str = "(ms)";
/// Seconds in a millisecond.
const MILLI: f64 = 1e-3;
/// Rate above which samples share a millisecond, and the later one replaces the earlier, frames/s.
const HIGHEST_RATE_HZ: f64 = 1000.0;
/// Short names of a time that other programs use.
const OTHER_TIME_NAMES: [&str; 2] = ["t", "T"];

/// Whether a table has a time in whole milliseconds and series that are called like tracks, not like
/// coordinates.
pub(crate) fn is_window_header(table: &DelimitedTable, names: &[&str]) -> bool {
    let Some((time, series)) = names.split_first() else { return false };
    let of_time = time
        .strip_suffix(MILLISECONDS)
        .map(str::trim)
        .is_some_and(|word| !word.is_empty() && !OTHER_TIME_NAMES.contains(&word));
    let text = |name: &&str| matches!(table.parse_cell(name), CellNumber::Text);
    of_time
        && !series.is_empty()
        && series.iter().all(|name| text(name) && !is_coordinate(name))
        && !has_coordinate_pair(series)
        && is_whole_column(table, 0)
}

/// `tipX` next to `tipY`: coordinates, with any other text in the names.
fn has_coordinate_pair(series: &[&str]) -> bool {
    let names: Vec<String> = series.iter().map(|name| name.to_lowercase()).collect();
    names.iter().any(|name| name.contains('x') && names.contains(&name.replace('x', "y")))
}

fn is_coordinate(name: &str) -> bool {
    name.to_lowercase()
        .split(|c: char| !c.is_alphanumeric())
        .any(|word| matches!(word, "x" | "y" | "z" | "px" | "py" | "frame"))
}

/// The file does not say what its series are, so the user has to.
pub(crate) fn read_window<'a>(
    document: &'a Document<'a>,
    table: &DelimitedTable,
    options: &ImportOptions,
) -> Result<TrackFile<'a>, ImportError> {
    if options.columns.is_none() {
        return Err(unnamed_window_error(table));
    }
    if let Some(rate) = options.frame_rate_hz.filter(|rate| *rate > HIGHEST_RATE_HZ) {
        return Err(samples_lost_error(table, rate));
    }
    let mut export = GenericFormat.read(document, options)?;
    export.facts.time = TimeUnit::Seconds(MILLI);
    export.findings.push(new_finding(
        Check::Filtered,
        Severity::Caution,
        (0.0, ""),
        format!(
            "{}: Kinovea's kinematics windows write positions after a low-pass filter of its own choice",
            document.file
        ),
        "components near and above its cut-off are weakened; export the trajectories instead (File > Export)",
    ));
    let lost = lost_samples_finding(&export).filter(|_| options.frame_rate_hz.is_none());
    export.findings.extend(lost);
    Ok(export)
}

fn unnamed_window_error(table: &DelimitedTable) -> ImportError {
    let header = table.head.first();
    let names = header.map(TextRow::texts).unwrap_or_default();
    ImportError::wrong_table(
        table.location(header.map_or(1, |row| row.line), 1),
        format!(
            "a table of Kinovea's kinematics windows ({}): filtered, and without a word on whether its \
             series are x, y or speeds",
            names.join(", ")
        ),
        "positions as x and y",
        format!(
            "{EXPORT_MENU}; if these are positions along the sweep and nothing else is left, say so: --columns \
             time-ms=1,tip-x=2,..."
        ),
    )
}

fn samples_lost_error(table: &DelimitedTable, rate_hz: f64) -> ImportError {
    ImportError::wrong_table(
        table.location(table.head.first().map_or(1, |row| row.line), 1),
        format!(
            "times in whole milliseconds for {rate_hz} frames/s: Kinovea's kinematics windows keep one \
             sample a millisecond and drop the others"
        ),
        format!("at most {HIGHEST_RATE_HZ} frames/s in such a table"),
        format!("{EXPORT_MENU}; if another program wrote this table, add --format generic"),
    )
}

/// Rows at every millisecond are those of 1000 frames/s, or of a faster camera with samples dropped.
fn lost_samples_finding(export: &TrackFile) -> Option<QualityFinding> {
    let times: Vec<f64> = export.clocks.first()?.time.iter().flat_map(Column::iter).flatten().collect();
    let every = times.len() > 1 && times.windows(2).all(|pair| pair[1] - pair[0] == 1.0);
    every.then(|| {
        new_finding(
            Check::SamplesLost,
            Severity::Serious,
            (HIGHEST_RATE_HZ, "1/s"),
            format!(
                "{}: a row every millisecond: a camera faster than 1000 frames/s has lost samples in \
                this table",
                export.file
            ),
            "export the trajectories instead (File > Export), unless the camera recorded at 1000 frames/s",
        )
    })
}

/// Whether every cell is a whole number.
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
