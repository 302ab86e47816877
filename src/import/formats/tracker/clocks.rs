//! Tables of several tracks that were put next to each other, each with its own clock.

use super::{FRAME, TIME, title_of};
use crate::import::error::ImportError;
use crate::import::reader::several_clocks::{ClockCell, difference};
use crate::import::reader::{PointCells, Row, Table};

/// A clock with its tracks.
pub(crate) struct Group {
    pub time: Option<usize>,
    pub frame: Option<usize>,
    pub points: Vec<PointCells>,
}

fn all(columns: &[&str], name: &str) -> Vec<usize> {
    columns.iter().enumerate().filter(|(_, column)| **column == name).map(|(at, _)| at).collect()
}

/// Whether all columns of times, and all of frame numbers, say the same in every row.
pub(crate) fn are_one(table: &Table, start: usize, columns: &[&str]) -> Result<bool, ImportError> {
    for clocks in [all(columns, TIME), all(columns, FRAME)] {
        let [first, others @ ..] = clocks.as_slice() else { continue };
        for other in others {
            let [first, other] = [*first, *other].map(|cell| ClockCell { cell, unit: 1.0 });
            if difference(table, start, first, other)?.is_some() {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

/// The tracks of each clock: those under its title, or those to its right.
pub(crate) fn groups(
    table: &Table,
    row: &Row,
    columns: &[&str],
    titles: &[&str],
    points: Vec<PointCells>,
) -> Result<Vec<Group>, ImportError> {
    let (times, frames) = (all(columns, TIME), all(columns, FRAME));
    let mut groups: Vec<Group> = vec![];
    for point in points {
        let x = point.x.first().copied().unwrap_or(0);
        let own = |clocks: &[usize]| match clocks {
            [only] => Some(*only),
            several => of_column(several, titles, x),
        };
        let (time, frame) = (own(&times), own(&frames));
        if time.is_none() && frame.is_none() {
            return Err(no_clock(table, row, &point, x));
        }
        match groups.iter_mut().find(|group| (group.time, group.frame) == (time, frame)) {
            Some(group) => group.points.push(point),
            None => groups.push(Group { time, frame, points: vec![point] }),
        }
    }
    Ok(groups)
}

/// The clock under the title of column `x`, or the nearest on its left.
fn of_column(clocks: &[usize], titles: &[&str], x: usize) -> Option<usize> {
    let title = title_of(titles, x).map(|(at, _)| at);
    let under = |clock: &&usize| title.is_some() && title_of(titles, **clock).map(|(at, _)| at) == title;
    clocks.iter().find(under).or_else(|| clocks.iter().rfind(|clock| **clock < x)).copied()
}

fn no_clock(table: &Table, row: &Row, point: &PointCells, x: usize) -> ImportError {
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
