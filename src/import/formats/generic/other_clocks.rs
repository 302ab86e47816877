//! Clocks in a table that `--columns` passes over or takes for positions.

use crate::import::error::ImportError;
use crate::import::reader::several_clocks::{ClockCell, difference};
use crate::import::reader::{Row, Table};

/// Words with which the name of a clock ends, and units that may follow them.
const TIMES: [&str; 2] = ["t", "time"];
const FRAMES: [&str; 2] = ["frame", "frames"];
const UNITS: [&str; 4] = ["s", "sec", "seconds", MILLISECONDS];
const MILLISECONDS: &str = "ms";

/// What a column counts by its name.
#[derive(Clone, Copy, PartialEq)]
enum Counts {
    Frames,
    /// Times, and how many seconds one of their units is.
    Times(f64),
}

/// Refuses a position whose column is named as a clock, and a second clock before the columns of a point that
/// says another time than the named one.
///
/// # Errors
/// [`ImportError`] naming the column and the row.
pub(super) fn check(
    table: &Table,
    header: &Row,
    start: usize,
    columns: &[(&'static str, usize)],
) -> Result<(), ImportError> {
    let name = |at: usize| header.cells.get(at).map_or("", String::as_str);
    let positions = columns.iter().filter(|(key, _)| key.ends_with('x') || key.ends_with('y'));
    for (key, at) in positions {
        if counts(name(*at)).is_some() {
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
        check_clock(table, header.line, start, columns, (before, name(before)))?;
    }
    Ok(())
}

/// Compares a clock that is passed over with the named one.
fn check_clock(
    table: &Table,
    line: usize,
    start: usize,
    columns: &[(&'static str, usize)],
    (other, name): (usize, &str),
) -> Result<(), ImportError> {
    let Some((used, unit, other_unit)) = columns.iter().find_map(|(key, at)| match (*key, counts(name)?) {
        ("frame", Counts::Frames) => Some((*at, 1.0, 1.0)),
        ("time", Counts::Times(other)) => Some((*at, 1.0, other)),
        ("time-ms", Counts::Times(other)) => Some((*at, 1e-3, other)),
        _ => None,
    }) else {
        return Ok(());
    };
    let (first, second) = (ClockCell { cell: used, unit }, ClockCell { cell: other, unit: other_unit });
    let Some(found) = difference(table, start, first, second)? else { return Ok(()) };
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

fn counts(name: &str) -> Option<Counts> {
    let lower = name.to_lowercase();
    let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
    let last = words.iter().rfind(|word| !UNITS.contains(word))?;
    let unit = if words.contains(&MILLISECONDS) { 1e-3 } else { 1.0 };
    match last {
        last if TIMES.contains(last) => Some(Counts::Times(unit)),
        last if FRAMES.contains(last) => Some(Counts::Frames),
        _ => None,
    }
}
