//! What tables with one row of column names share: finding the columns, and judging times next to frame
//! numbers.

use crate::import::error::ImportError;
use crate::import::options::Options;
use crate::import::reader::column::Column;
use crate::import::reader::findings::finding;
use crate::import::reader::rounding::RATE_AGREEMENT;
use crate::import::reader::rows::Row;
use crate::import::reader::table::Table;
use crate::import::reader::track_file::{Clock, TrackFile};
use crate::recording::quality::{Check, Severity};

/// Rows at the top that may hold the names: the first, unless a line of somebody's own was put above it.
const HEADER_ROWS: usize = 3;

/// The first row whose cells `names` accepts, with its index.
pub(crate) fn header<'t>(table: &'t Table, names: impl Fn(&[&str]) -> bool) -> Option<(usize, &'t Row)> {
    table.head.iter().enumerate().take(HEADER_ROWS).find(|(_, row)| names(&row.texts()))
}

/// The refusal of a table without a column that the format always has.
pub(crate) fn no_column(table: &Table, line: Option<usize>, wanted: &str, advice: &str) -> ImportError {
    let line = line.unwrap_or_else(|| table.head.first().map_or(1, |row| row.line));
    let found = table.head.iter().find(|row| row.line == line).map(Row::texts).unwrap_or_default();
    let problem = format!(
        "found the columns {}, expected {wanted}",
        found.iter().take(12).copied().collect::<Vec<_>>().join(", ")
    );
    ImportError::columns(table.file, line, problem, advice)
}

/// The column `name` of the header row `row`. Where it stands twice, both have to say the same in every
/// row.
///
/// # Errors
/// [`ImportError::Columns`] for two columns of that name that differ, with the first such line.
pub(crate) fn column(table: &Table, row: usize, name: &str) -> Result<Option<usize>, ImportError> {
    let Some(header) = table.head.get(row) else { return Ok(None) };
    let mut at = header.cells.iter().enumerate().filter(|(_, cell)| *cell == name).map(|(index, _)| index);
    let Some(first) = at.next() else { return Ok(None) };
    for other in at {
        if let Some(line) = first_difference(table, row + 1, [first, other])? {
            return Err(ImportError::columns(
                table.file,
                line,
                format!(
                    "found two columns `{name}` (numbers {} and {}) that differ, expected the same in both",
                    first + 1,
                    other + 1
                ),
                "export again with one of them, or give the number of the right one with --columns",
            ));
        }
    }
    Ok(Some(first))
}

/// Line of the first row in which two cells do not say the same.
fn first_difference(table: &Table, start: usize, cells: [usize; 2]) -> Result<Option<usize>, ImportError> {
    let mut rows = table.rows(start);
    while let Some(record) = rows.next()? {
        let [first, other] = cells.map(|cell| table.number(record.cell(cell)));
        if first != other {
            return Ok(Some(record.line));
        }
    }
    Ok(None)
}

/// Leaves out times that cannot check the rate: frame numbers count, and these times are disordered, or
/// rounded to `quantum_s` over too short a record to contradict what is declared.
pub(crate) fn leave_out_useless_times(export: &mut TrackFile, options: &Options, quantum_s: f64) {
    let (mut broken, mut coarse) = (0_usize, 0_usize);
    for clock in &mut export.clocks {
        let (Some(frames), Some(times)) = (&clock.frame, &clock.time) else { continue };
        let disordered = backward_steps(frames, times);
        if disordered > 0 {
            broken += disordered;
            clock.time = None;
        } else if options.frame_rate_hz.is_some_and(|rate_hz| only_rounding(clock, rate_hz, quantum_s)) {
            coarse += 1;
            clock.time = None;
        }
    }
    if broken > 0 {
        let found = format!(
            "{}: the times go back {broken} times while the frames go on; they are left out",
            export.file
        );
        let advice = "the frame numbers count; check --frame-rate-hz against the camera's record, as these \
            times cannot";
        export.findings.push(finding(
            Check::BrokenTimes,
            Severity::Caution,
            (broken as f64, ""),
            found,
            advice,
        ));
    }
    if coarse > 0 {
        let found = format!(
            "{}: the times are rounded to {quantum_s} s and agree with the declared rate only as near as \
             that; the frame numbers count",
            export.file
        );
        export.findings.push(finding(Check::RoundedTimes, Severity::Note, (quantum_s, "s"), found, ""));
    }
}

/// Rows whose time is before that of a row with a lower frame.
fn backward_steps(frames: &Column, times: &Column) -> usize {
    let pairs: Vec<(f64, f64)> =
        frames.iter().zip(times.iter()).filter_map(|(frame, time)| frame.zip(time)).collect();
    pairs.windows(2).filter(|pair| pair[1].0 > pair[0].0 && pair[1].1 < pair[0].1).count()
}

/// Whether first and last time contradict the rate by no more than their rounding explains.
fn only_rounding(clock: &Clock, rate_hz: f64, quantum_s: f64) -> bool {
    let span = |column: &Option<Column>| {
        let column = column.as_ref()?;
        Some(column.get(column.len().checked_sub(1)?)? - column.get(0)?)
    };
    let (Some(frames), Some(span_s)) = (span(&clock.frame), span(&clock.time)) else { return false };
    let expected_s = frames / rate_hz;
    let apart_s = (span_s - expected_s).abs();
    apart_s > RATE_AGREEMENT * span_s.abs() && apart_s <= quantum_s + RATE_AGREEMENT * expected_s.abs()
}
