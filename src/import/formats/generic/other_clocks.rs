//! Clocks in a table that `--columns` passes over or takes for positions.

use crate::import::error::ImportError;
use crate::import::reader::several_clocks::{ClockCell, find_clock_difference};
use crate::import::reader::{DelimitedTable, TextRow};

/// Words with which the name of a clock ends, and units that may follow them.
const TIME_WORDS: [&str; 2] = ["t", "time"];
const FRAME_WORDS: [&str; 2] = ["frame", "frames"];
const TIME_UNIT_WORDS: [&str; 4] = ["s", "sec", "seconds", MILLISECONDS];
const MILLISECONDS: &str = "ms";

/// What a column counts by its name.
#[derive(Clone, Copy, PartialEq)]
enum ClockKind {
    Frames,
    /// Times, and how many seconds one of their units is.
    Times(f64),
}

/// Refuses a position whose column is named as a clock, and a second clock before the columns of a point that
/// says another time than the named one.
///
/// # Errors
/// [`ImportError`] naming the column and the row.
pub(super) fn check_unused_clocks(
    table: &DelimitedTable,
    header: &TextRow,
    start: usize,
    columns: &[(&'static str, usize)],
) -> Result<(), ImportError> {
    let name = |at: usize| header.cells.get(at).map_or("", String::as_str);
    let positions = columns.iter().filter(|(key, _)| key.ends_with('x') || key.ends_with('y'));
    for (key, at) in positions {
        if clock_kind(name(*at)).is_some() {
            return Err(ImportError::columns(
                table.file,
                header.line,
                format!("--columns {key}={}: found the clock `{}`, expected a position", at + 1, name(*at)),
                "correct the column number; columns count from 1",
            ));
        }
        let Some(before) = at.checked_sub(1).filter(|before| columns.iter().all(|(_, used)| used != before))
        else {
            continue;
        };
        compare_clock(table, header.line, start, columns, (before, name(before)))?;
    }
    Ok(())
}

/// Compares a clock that is passed over with the named one.
fn compare_clock(
    table: &DelimitedTable,
    line: usize,
    start: usize,
    columns: &[(&'static str, usize)],
    (other, name): (usize, &str),
) -> Result<(), ImportError> {
    let Some((used, unit, other_unit)) =
        columns.iter().find_map(|(key, at)| match (*key, clock_kind(name)?) {
            ("frame", ClockKind::Frames) => Some((*at, 1.0, 1.0)),
            ("time", ClockKind::Times(other)) => Some((*at, 1.0, other)),
            ("time-ms", ClockKind::Times(other)) => Some((*at, 1e-3, other)),
            _ => None,
        })
    else {
        return Ok(());
    };
    let (first, second) = (ClockCell { cell: used, unit }, ClockCell { cell: other, unit: other_unit });
    let Some(found) = find_clock_difference(table, start, first, second)? else { return Ok(()) };
    let [one, two] = found.texts;
    Err(ImportError::columns(
        table.file,
        line,
        format!(
            "column {} `{name}` is a clock of its own: in line {} it says `{two}` where column {} says `{one}`; \
             expected one clock for all points",
            other + 1,
            found.line,
            used + 1
        ),
        "leave --columns out where the format reads a clock for each track, or export the tracks with one clock",
    ))
}

fn clock_kind(name: &str) -> Option<ClockKind> {
    let lower = name.to_lowercase();
    let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
    let last = words.iter().rfind(|word| !TIME_UNIT_WORDS.contains(word))?;
    let unit = if words.contains(&MILLISECONDS) { 1e-3 } else { 1.0 };
    match last {
        last if TIME_WORDS.contains(last) => Some(ClockKind::Times(unit)),
        last if FRAME_WORDS.contains(last) => Some(ClockKind::Frames),
        _ => None,
    }
}
