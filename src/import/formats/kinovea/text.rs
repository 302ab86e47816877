//! Kinovea's text export, made for gnuplot: a block of rows a track, each with its own times.

use crate::import::error::{CellProblem, ImportError, Place};
use crate::import::formats::kinovea::preferences::{PREFERENCES, facts};
use crate::import::reader::table::column_of_word;
use crate::import::reader::{
    Clock, Collector, Document, Number, Order, PointShape, Position, Shape, Stamp, TimeUnit, Track,
    TrackFile, number,
};
use crate::math;

/// First line of the text export.
pub(crate) const TITLE: &str = "#Kinovea";
/// Line that names the columns.
const COLUMNS: &str = "#T X Y";
/// Cells of a row with one point.
const CELLS: usize = 3;
/// Parts of a time code, hours to fractions of a second.
const CODE_PARTS: usize = 4;
/// Longest part of a time code, digits: more are no time.
const CODE_DIGITS: usize = 9;

/// Reads the blocks.
pub(crate) fn read<'a>(document: &'a Document<'a>) -> Result<TrackFile<'a>, ImportError> {
    let style = Style::find(document.text);
    let mut reader =
        Reader { file: document.file, style, block: None, clocks: vec![], tracks: vec![], unnamed: 0 };
    let mut last = 1;
    for (index, line) in document.text.lines().enumerate() {
        reader.line(index + 1, line)?;
        last = if line.trim().is_empty() { last } else { index + 1 };
    }
    reader.close()?;
    if reader.clocks.is_empty() {
        return Err(ImportError::HeaderOnly { file: document.file.to_owned(), line: last });
    }
    let mut facts = facts();
    facts.time = if style.code { TimeUnit::Seconds(1.0) } else { TimeUnit::Unknown };
    let notes = style.notes(reader.unnamed).into_iter().chain([PREFERENCES.to_owned()]).collect();
    let Reader { clocks, tracks, .. } = reader;
    Ok(TrackFile { clocks, tracks, facts, notes, ..TrackFile::of(document) })
}

/// How the numbers of a file are written. Old versions take the decimal mark of the times from elsewhere than
/// that of the positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Style {
    /// Whether times are `h:mm:ss:cc`.
    code: bool,
    time_mark: char,
    position_mark: char,
}

impl Style {
    fn find(text: &str) -> Self {
        let rows = || text.lines().filter(|line| !line.trim_start().starts_with('#'));
        let mark = |c: char| matches!(c, '.' | ',');
        let time = || rows().filter_map(|row| row.split_whitespace().next());
        let positions = rows().flat_map(|row| row.split_whitespace().skip(1));
        Self {
            code: time().next().is_some_and(|cell| cell.contains(':')),
            time_mark: time().flat_map(str::chars).find(|c| mark(*c)).unwrap_or('.'),
            position_mark: positions.flat_map(str::chars).find(|c| mark(*c)).unwrap_or('.'),
        }
    }

    fn notes(self, unnamed: usize) -> Vec<String> {
        let marks = format!(
            "the decimal mark of the times is `{}`, that of the positions `{}`",
            self.time_mark, self.position_mark
        );
        let code = "the times are time codes, cut off to their last digit";
        let names = format!("{unnamed} tracks have no name; they are numbered from the top of the file");
        let notes = [
            (self.time_mark != self.position_mark && !self.code, marks),
            (self.code, code.to_owned()),
            (unnamed > 0, names),
        ];
        notes.into_iter().filter_map(|(holds, note)| holds.then_some(note)).collect()
    }

    fn time(self, cell: &str) -> Number {
        if self.code {
            code_s(cell).map_or(Number::Text, Number::Value)
        } else {
            number(cell, self.time_mark)
        }
    }
}

/// Seconds of `h:mm:ss:cc`; the last part has as many digits as the fraction.
fn code_s(cell: &str) -> Option<f64> {
    let (sign, digits) = cell.strip_prefix('-').map_or((1.0, cell), |rest| (-1.0, rest));
    let parts: Vec<&str> = digits.split(':').collect();
    let plain = |part: &&str| {
        (1..=CODE_DIGITS).contains(&part.len()) && part.bytes().all(|byte| byte.is_ascii_digit())
    };
    if parts.len() != CODE_PARTS || !parts.iter().all(plain) {
        return None;
    }
    let value = |index: usize| parts.get(index).and_then(|part| part.parse::<f64>().ok());
    let divisor = math::powi(10.0, i32::try_from(parts.get(CODE_PARTS - 1)?.len()).ok()?);
    let seconds = (value(0)? * 60.0 + value(1)?) * 60.0 + value(2)?;
    Some(sign * (seconds * divisor + value(3)?) / divisor)
}

struct Reader<'f> {
    file: &'f str,
    style: Style,
    block: Option<Block>,
    clocks: Vec<Clock>,
    tracks: Vec<Track>,
    /// Tracks without a name so far.
    unnamed: usize,
}

/// Rows of one track.
struct Block {
    name: String,
    /// Cells of its rows, once there is one, and the rows.
    rows: Option<(usize, Collector)>,
}

impl Reader<'_> {
    fn line(&mut self, line: usize, text: &str) -> Result<(), ImportError> {
        let trimmed = text.trim();
        if trimmed.is_empty() {
            // a blank line ends a track; some stand before its first row
            return if self.block.as_ref().is_some_and(|block| block.rows.is_some()) {
                self.close()
            } else {
                Ok(())
            };
        }
        let Some(name) = trimmed.strip_prefix('#') else { return self.row(line, text) };
        if trimmed.starts_with(TITLE) || trimmed == COLUMNS {
            return Ok(());
        }
        self.close()?;
        self.block = Some(Block { name: name.trim().to_owned(), rows: None });
        Ok(())
    }

    fn row(&mut self, line: usize, text: &str) -> Result<(), ImportError> {
        let style = self.style;
        let block = self.block.get_or_insert_with(|| Block { name: String::new(), rows: None });
        let cells: Vec<&str> = text.split_whitespace().collect();
        let expected = block.rows.as_ref().map_or(CELLS, |rows| rows.0);
        let right = if block.rows.is_some() {
            cells.len() == expected
        } else {
            cells.len() >= CELLS && cells.len() % 2 == 1
        };
        if !right {
            return Err(ImportError::Ragged { place: self.place(line, 1), found: cells.len(), expected });
        }
        let (_, collector) = block
            .rows
            .get_or_insert_with(|| (cells.len(), Collector::new(shape(&block.name, cells.len() / 2))));
        let refuse = |cell: usize| {
            not_a_number(self.file, (line, text), cell, cells.get(cell).copied().unwrap_or_default(), style)
        };
        let value = |cell: usize, found: Number| match found {
            Number::Value(value) => Ok(Some(value)),
            Number::Missing => Ok(None),
            Number::Text => Err(refuse(cell)),
        };
        let numbers = cells.iter().enumerate().map(|(at, cell)| {
            value(at, if at == 0 { style.time(cell) } else { number(cell, style.position_mark) })
        });
        let numbers = numbers.collect::<Result<Vec<_>, _>>()?;
        let Some((time, positions)) = numbers.split_first() else { return Ok(()) };
        let positions: Vec<Position> = positions
            .chunks(2)
            .map(|pair| Position { x: pair[0], y: pair.get(1).copied().flatten(), confidence: None })
            .collect();
        collector.push("", Stamp { line, frame: None, time: *time }, &positions);
        Ok(())
    }

    /// Ends the track that is being read.
    fn close(&mut self) -> Result<(), ImportError> {
        let Some(Block { name, rows: Some((_, collector)) }) = self.block.take() else { return Ok(()) };
        let (clocks, mut tracks) = collector.finish(self.file, Order::AsWritten)?;
        let number = self.clocks.len() + 1;
        for track in &mut tracks {
            track.clock += self.clocks.len();
            if name.is_empty() {
                track.name = format!("track{number}{}", track.name);
            }
        }
        self.unnamed += usize::from(name.is_empty());
        self.clocks.extend(clocks);
        self.tracks.extend(tracks);
        Ok(())
    }

    fn place(&self, line: usize, column: usize) -> Place {
        Place { file: self.file.to_owned(), line, column }
    }
}

/// A track is called by its name; the points of an object are numbered, because this export does not name
/// them.
fn shape(name: &str, points: usize) -> Shape {
    let called = |index: usize| if points == 1 { name.to_owned() } else { format!("{name}/{}", index + 1) };
    let points = (0..points)
        .map(|index| PointShape { name: called(index), has_y: true, has_confidence: false })
        .collect();
    Shape { has_frame: false, has_time: true, clock_cell: 0, points }
}

fn not_a_number(
    file: &str,
    (line, text): (usize, &str),
    cell: usize,
    found: &str,
    style: Style,
) -> ImportError {
    let mark = if cell == 0 { style.time_mark } else { style.position_mark };
    let other = if mark == '.' { ',' } else { '.' };
    let (expected, advice) = match number(found, other) {
        Number::Value(_) => (
            "the decimal mark of the column's other numbers",
            "the decimal mark changes within the column, or a mark separates thousands: export again with one \
             format of numbers",
        ),
        _ if cell == 0 && style.code => {
            ("a time code such as 0:00:01:25, as in the first row", "export again, or correct the cell")
        }
        _ => ("a number", "export again, or write NaN if the point was lost"),
    };
    let name = if cell == 0 {
        "T"
    } else if cell % 2 == 1 {
        "X"
    } else {
        "Y"
    };
    ImportError::Cell {
        place: Place { file: file.to_owned(), line, column: column_of_word(text, cell) },
        problem: CellProblem::NotANumber,
        name: name.to_owned(),
        found: found.chars().take(60).collect::<String>().into(),
        expected,
        advice,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_codes_are_seconds() {
        assert_eq!(code_s("0:00:00:03"), Some(0.03));
        assert_eq!(code_s("1:02:03:250"), Some(3723.25));
        assert_eq!(code_s("-0:00:01:50"), Some(-1.5));
        for text in ["0:00:03", "0:00:00:", "0:00:0x:03", "1:2:3:4:5", "0:0:0:1234567890", "0.03"] {
            assert_eq!(code_s(text), None, "{text}");
        }
    }

    #[test]
    fn marks_are_found_for_times_and_positions_apart() {
        let style = Style::find("#Kinovea 1.5\n# a,b\n0.008 1 -2,5\n");
        assert_eq!(style, Style { code: false, time_mark: '.', position_mark: ',' });
    }
}
