//! Reads tables of Tracker (Open Source Physics), from File > Export > Data or copied from its data view.

use crate::import::format::*;
use crate::import::reader::layout::{ClockCell, find_clock_difference};

/// Number of rows at the top of a table that are searched for the column names.
const HEADER_ROWS: usize = 6;
/// Columns of positions in world coordinates, with y upwards unless the axes were turned.
const WORLD: [&str; 2] = ["x", "y"];
/// Columns of positions in image pixels, with y downwards. Tracker's `px` and `py` are momentum.
const IMAGE: [&str; 2] = ["pixelx", "pixely"];
const MOMENTUM: [&str; 2] = ["px", "py"];
const TIME: &str = "t";
const FRAME: &str = "frame";

pub(super) const FORMAT: FormatParser =
    FormatParser { name: "tracker", recognises: recognise_export, read: read_export };

fn recognise_export(document: &Document) -> Option<String> {
    let table = document.table.as_ref().ok()?;
    let row = table.head.get(find_header(table)?)?;
    if table.multi {
        return Some(format!("line 1 is `#multi:` and line {} names t, x and y", row.line));
    }
    let names = row.texts();
    let positions = names.contains(&WORLD[0]) || names.contains(&IMAGE[0]);
    let momentum = MOMENTUM.iter().all(|name| names.contains(name));
    let names_of = match (positions, momentum || has_title(table)) {
        (true, _) => "t and positions as Tracker does",
        (_, true) => "t as Tracker does, and no positions",
        _ => return None,
    };
    names.contains(&TIME).then(|| format!("line {} names {names_of}", row.line))
}

fn read_export<'a>(document: &'a Document<'a>, _options: &ImportOptions) -> ImportResult<TrackFile<'a>> {
    let table = document.table()?;
    let header = find_header(table).ok_or_else(|| no_header_error(table))?;
    let row = &table.head[header];
    let columns = row.texts();
    let above = header.checked_sub(1).and_then(|above| table.head.get(above));
    let titles = above.map(TextRow::texts).unwrap_or_default();
    let pair = if columns.contains(&WORLD[0]) { WORLD } else { IMAGE };
    let mut points = find_points(&columns, &titles, pair);
    if points.is_empty() {
        return Err(no_positions_error(table, row, &columns));
    }
    let notes = name_unnamed_points(&mut points, document.stem);
    // (the unit and the axes of world coordinates are those of the user's calibration)
    let open = "Tracker's x and y point up unless its axes were turned; image pixels point down";
    let facts = if pair == WORLD {
        Facts { y_axis_open: Some(open), ..Facts::default() }
    } else {
        Facts::pixels_down("Tracker's pixelx and pixely are image pixels, y downwards")
    };
    let at = |name: &str| columns.iter().position(|column| *column == name);
    // (speeds after the positions are blank at the ends of a track, and some editors remove trailing
    // blanks)
    let layout = |((frame, time), points): (ClockColumns, Vec<PointCells>)| {
        let cells = points.iter().flat_map(|point| point.x.iter().chain(&point.y).copied());
        let width = cells.chain(time).chain(frame).max().map_or(0, |last| last + 1);
        let most = row.used_width();
        TableLayout { most, frame, time, ..TableLayout::new(header + 1, width, points) }
    };
    let mut export = if clocks_agree(table, header + 1, &columns)? {
        layout(((at(FRAME), at(TIME)), points)).read_tracks(document, table, facts)?
    } else {
        let groups = group_by_clock(table, row, &titles, points)?;
        let layouts = groups.into_iter().map(layout).collect();
        layout::read_clocks_apart(layouts, document, table, facts)?
    };
    export.notes.extend(notes);
    Ok(export)
}

/// Index of the row of column names.
fn find_header(table: &DelimitedTable) -> Option<usize> {
    let is_header = |row: &TextRow| {
        let names = row.texts();
        (names.contains(&TIME) || names.contains(&FRAME))
            && !names.iter().any(|name| name.parse::<f64>().is_ok())
    };
    table.head.iter().take(HEADER_ROWS).position(is_header)
}

/// Whether the first row contains only the name of a track.
fn has_title(table: &DelimitedTable) -> bool {
    let names = table.first_texts();
    find_header(table) == Some(1)
        && names.len() > 1
        && names.iter().filter(|name| !name.is_empty()).count() == 1
}

fn no_header_error(table: &DelimitedTable) -> ImportError {
    let problem = format!(
        "found `{}` and no row that names the columns, expected one with `t` or `frame`, `x` and `y`",
        table.first_texts().join(" ")
    );
    let advice = "export with column names, or name the columns by number: --format generic --columns \
        time=1,tip-x=2,tip-y=3,...";
    ImportError::columns(table.file, table.first_line(), problem, advice)
}

/// Index and text of the title of a column: the title directly above the column, or else the nearest title to
/// the left.
fn find_title<'t>(titles: &[&'t str], column: usize) -> Option<(usize, &'t str)> {
    titles.iter().take(column + 1).rposition(|title| !title.is_empty()).map(|at| (at, titles[at]))
}

/// Finds the points of a table. An x column belongs to the y column under the same title. Without titles, it
/// belongs to the next y column before another x column.
fn find_points(columns: &[&str], titles: &[&str], [x_name, y_name]: [&str; 2]) -> Vec<PointCells> {
    let title_of = |column: usize| find_title(titles, column);
    let (mut points, mut seen) = (vec![], vec![]);
    for (x, _) in columns.iter().enumerate().filter(|(_, name)| **name == x_name) {
        let title = title_of(x);
        if let Some((at, _)) = title {
            if seen.contains(&at) {
                continue; // (the user has added a second x under the same title)
            }
            seen.push(at);
        }
        let next_x = (x + 1..columns.len()).find(|at| columns[*at] == x_name).unwrap_or(columns.len());
        let same_track = |y: &usize| title_of(*y).map(|t| t.0) == title.map(|t| t.0);
        let y = (0..next_x).filter(|&y| columns[y] == y_name && (y > x || title.is_some())).find(same_track);
        points.push(PointCells::new(title.map_or("", |t| t.1), x, y));
    }
    points
}

/// Names the points that have no title: a single point after its file, several points `track1`, `track2`, ...
/// Returns a note on each name.
fn name_unnamed_points(points: &mut [PointCells], stem: &str) -> Vec<String> {
    let several = points.len() > 1;
    let unnamed = points.iter_mut().enumerate().filter(|(_, point)| point.name.is_empty());
    let name = |(index, point): (usize, &mut PointCells)| {
        point.name = if several { format!("track{}", index + 1) } else { stem.to_owned() };
        format!("the table does not name its tracks; column {} is called `{}`", point.x[0] + 1, point.name)
    };
    unnamed.map(name).collect()
}

fn no_positions_error(table: &DelimitedTable, row: &TextRow, columns: &[&str]) -> ImportError {
    let momentum = MOMENTUM.iter().any(|name| columns.contains(name));
    let remedy = "export again with the columns t, x and y selected";
    let other =
        "if another program wrote them as pixels, number the columns: --columns time=1,tip-x=2,tip-y=3";
    let problem =
        format!("found the columns {}, expected x and y (or pixelx and pixely)", columns.join(", "));
    let advice = if momentum {
        format!("px and py are momentum in Tracker, not pixels: {remedy}; {other}")
    } else {
        remedy.to_owned()
    };
    ImportError::columns(table.file, row.line, problem, advice)
}

// Tables with several tracks side by side, each with its own clock.

/// Columns of frame numbers and of times.
type ClockColumns = (Option<usize>, Option<usize>);

fn find_columns(columns: &[&str], name: &str) -> Vec<usize> {
    columns.iter().enumerate().filter(|(_, column)| **column == name).map(|(at, _)| at).collect()
}

/// Whether all columns of times are equal in every row within their rounding, and all columns of frame
/// numbers too.
fn clocks_agree(table: &DelimitedTable, start: usize, columns: &[&str]) -> ImportResult<bool> {
    for clocks in [find_columns(columns, TIME), find_columns(columns, FRAME)] {
        for other in clocks.iter().skip(1) {
            let [first, other] = [clocks[0], *other].map(|cell| ClockCell { cell, unit: 1.0 });
            if find_clock_difference(table, start, first, other)?.is_some() {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

/// Groups the points by their clock. The clock of a point is the clock under the same title, or else the
/// nearest clock to the left of the point.
fn group_by_clock(
    table: &DelimitedTable,
    row: &TextRow,
    titles: &[&str],
    points: Vec<PointCells>,
) -> ImportResult<Vec<(ClockColumns, Vec<PointCells>)>> {
    let title_of = |column: usize| find_title(titles, column).map(|(at, _)| at);
    let mut groups: Vec<(ClockColumns, Vec<PointCells>)> = vec![];
    for point in points {
        let x = point.x[0];
        let own = |name: &str| match find_columns(&row.texts(), name).as_slice() {
            [only] => Some(*only),
            several => {
                let under = |clock: &&usize| title_of(x).is_some() && title_of(**clock) == title_of(x);
                several.iter().find(under).or_else(|| several.iter().rfind(|clock| **clock < x)).copied()
            }
        };
        let clock = (own(FRAME), own(TIME));
        if clock == (None, None) {
            let found = format!("several clocks that differ, and none for the track `{}`", point.name);
            let advice = "export again from Tracker, or each track to a file of its own";
            let (place, expected) = (table.cell_location(row.line, x), "`t` or `frame` left of every track");
            return Err(ImportError::format(place, found, expected, advice));
        }
        match groups.iter_mut().find(|group| group.0 == clock) {
            Some(group) => group.1.push(point),
            None => groups.push((clock, vec![point])),
        }
    }
    Ok(groups)
}
