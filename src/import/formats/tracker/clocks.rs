//! Tables of several tracks that were put next to each other, each with its own clock.

use super::{FRAME, TIME, find_title};
use crate::import::error::ImportError;
use crate::import::reader::several_clocks::{ClockCell, find_clock_difference};
use crate::import::reader::{DelimitedTable, PointCells, TextRow};

/// A clock with its tracks.
pub(crate) struct ClockGroup {
    pub time: Option<usize>,
    pub frame: Option<usize>,
    pub points: Vec<PointCells>,
}

fn find_columns(columns: &[&str], name: &str) -> Vec<usize> {
    columns.iter().enumerate().filter(|(_, column)| **column == name).map(|(at, _)| at).collect()
}

/// Whether all columns of times, and all of frame numbers, say the same in every row.
pub(crate) fn clocks_agree(
    table: &DelimitedTable,
    start: usize,
    columns: &[&str],
) -> Result<bool, ImportError> {
    for clocks in [find_columns(columns, TIME), find_columns(columns, FRAME)] {
        let [first, others @ ..] = clocks.as_slice() else { continue };
        for other in others {
            let [first, other] = [*first, *other].map(|cell| ClockCell { cell, unit: 1.0 });
            if find_clock_difference(table, start, first, other)?.is_some() {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

/// The tracks of each clock: those under its title, or those to its right.
pub(crate) fn group_by_clock(
    table: &DelimitedTable,
    row: &TextRow,
    columns: &[&str],
    titles: &[&str],
    points: Vec<PointCells>,
) -> Result<Vec<ClockGroup>, ImportError> {
    let (times, frames) = (find_columns(columns, TIME), find_columns(columns, FRAME));
    let mut groups: Vec<ClockGroup> = vec![];
    for point in points {
        let x = point.x.first().copied().unwrap_or(0);
        let own = |clocks: &[usize]| match clocks {
            [only] => Some(*only),
            several => clock_of_column(several, titles, x),
        };
        let (time, frame) = (own(&times), own(&frames));
        if time.is_none() && frame.is_none() {
            return Err(no_clock_error(table, row, &point, x));
        }
        match groups.iter_mut().find(|group| (group.time, group.frame) == (time, frame)) {
            Some(group) => group.points.push(point),
            None => groups.push(ClockGroup { time, frame, points: vec![point] }),
        }
    }
    Ok(groups)
}

/// The clock under the title of column `x`, or the nearest on its left.
fn clock_of_column(clocks: &[usize], titles: &[&str], x: usize) -> Option<usize> {
    let title = find_title(titles, x).map(|(at, _)| at);
    let under = |clock: &&usize| title.is_some() && find_title(titles, **clock).map(|(at, _)| at) == title;
    clocks.iter().find(under).or_else(|| clocks.iter().rfind(|clock| **clock < x)).copied()
}

fn no_clock_error(table: &DelimitedTable, row: &TextRow, point: &PointCells, x: usize) -> ImportError {
    ImportError::columns(
        table.file,
        row.line,
        format!(
            "found several clocks that differ, and none for the track `{}` in column {}, expected `t` or `frame` to \
             the left of every track",
            point.name,
            x + 1
        ),
        "export again from Tracker, or each track to a file of its own",
    )
}
