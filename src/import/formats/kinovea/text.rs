//! Reads Kinovea's text export, which is made for gnuplot. It has a block of rows for each track, and each
//! block has its own times.

use super::{PREFERENCES_NOTE, kinovea_facts};
use crate::import::error::{CellProblem, ImportError, ImportResult, TextLocation};
use crate::import::reader::table::column_of_word;
use crate::import::reader::{
    CellNumber, Clock, Document, InstanceFields, PointFields, RowOrder, RowPosition, RowStamp, TimeUnit,
    Track, TrackCollector, TrackFile, parse_number,
};
use portable_math as math;

/// Beginning of the first line of the text export.
pub(super) const TITLE: &str = "#Kinovea";
/// Line that names the columns.
const COLUMNS: &str = "#T X Y";
/// Number of cells in a row with one point: time, x and y.
const CELLS: usize = 3;
/// Number of parts of a time code `h:mm:ss:cc`, from hours to fractions of a second.
const CODE_PARTS: usize = 4;
/// Maximum number of digits in a part of a time code.
const CODE_DIGITS: usize = 9;

pub(crate) fn read_text_export<'a>(document: &'a Document<'a>) -> ImportResult<TrackFile<'a>> {
    let style = NumberStyle::detect(document.text);
    let (file, clocks, tracks) = (document.file, vec![], vec![]);
    let mut reader = KinoveaTextReader { file, style, block: None, clocks, tracks, unnamed: 0 };
    let mut last = 1;
    for (index, line) in document.text.lines().enumerate() {
        reader.read_line(index + 1, line)?;
        last = if line.trim().is_empty() { last } else { index + 1 };
    }
    reader.end_track()?;
    if reader.clocks.is_empty() {
        return Err(ImportError::header_only(file, last));
    }
    let mut facts = kinovea_facts();
    facts.time = if style.code { TimeUnit::Seconds(1.0) } else { TimeUnit::Unknown };
    let notes = style.notes(reader.unnamed).into_iter().chain([PREFERENCES_NOTE.to_owned()]).collect();
    let KinoveaTextReader { clocks, tracks, .. } = reader;
    Ok(TrackFile { clocks, tracks, facts, notes, ..TrackFile::for_document(document) })
}

/// The form of the numbers in a file. Old versions of Kinovea may use different decimal marks for times and
/// positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct NumberStyle {
    /// Whether times are time codes `h:mm:ss:cc`.
    code: bool,
    time_mark: char,
    position_mark: char,
}

impl NumberStyle {
    fn detect(text: &str) -> Self {
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

    fn parse_time(self, cell: &str) -> CellNumber {
        if self.code {
            time_code_s(cell).map_or(CellNumber::Text, CellNumber::Value)
        } else {
            parse_number(cell, self.time_mark)
        }
    }
}

/// Converts a time code `h:mm:ss:cc` to seconds. The digits of the last part are decimals of a second.
fn time_code_s(cell: &str) -> Option<f64> {
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

struct KinoveaTextReader<'f> {
    file: &'f str,
    style: NumberStyle,
    block: Option<TrackBlock>,
    clocks: Vec<Clock>,
    tracks: Vec<Track>,
    /// Number of tracks without a name that have been read so far.
    unnamed: usize,
}

/// Name and rows of one track.
struct TrackBlock {
    name: String,
    /// Number of cells in a row, and the rows of the track; `None` until its first row is read.
    rows: Option<(usize, TrackCollector)>,
}

impl KinoveaTextReader<'_> {
    fn read_line(&mut self, line: usize, text: &str) -> ImportResult<()> {
        let trimmed = text.trim();
        if trimmed.is_empty() {
            // (a blank line ends a track, unless the track has no rows yet)
            let begun = self.block.as_ref().is_some_and(|block| block.rows.is_some());
            return if begun { self.end_track() } else { Ok(()) };
        }
        let Some(name) = trimmed.strip_prefix('#') else { return self.read_row(line, text) };
        if trimmed.starts_with(TITLE) || trimmed == COLUMNS {
            return Ok(());
        }
        self.end_track()?;
        self.block = Some(TrackBlock { name: name.trim().to_owned(), rows: None });
        Ok(())
    }

    fn read_row(&mut self, line: usize, text: &str) -> ImportResult<()> {
        let style = self.style;
        let block = self.block.get_or_insert_with(|| TrackBlock { name: String::new(), rows: None });
        let cells: Vec<&str> = text.split_whitespace().collect();
        let len = cells.len();
        let expected = block.rows.as_ref().map_or(CELLS, |rows| rows.0);
        let fits = if block.rows.is_some() { len == expected } else { len >= CELLS && len % 2 == 1 };
        if !fits {
            let place = TextLocation { file: self.file.to_owned(), line, column: 1 };
            return Err(ImportError::Ragged { place, found: cells.len(), expected });
        }
        let (_, collector) =
            block.rows.get_or_insert_with(|| (len, TrackCollector::new(block_shape(&block.name, len / 2))));
        let number = |(at, cell): (usize, &&str)| {
            let found =
                if at == 0 { style.parse_time(cell) } else { parse_number(cell, style.position_mark) };
            match found {
                CellNumber::Value(value) => Ok(Some(value)),
                CellNumber::Missing => Ok(None),
                CellNumber::Text => Err(not_a_number_error(self.file, (line, text), at, cell, style)),
            }
        };
        let numbers = cells.iter().enumerate().map(number).collect::<Result<Vec<_>, _>>()?;
        let Some((time, positions)) = numbers.split_first() else { return Ok(()) };
        let positions: Vec<RowPosition> = positions
            .chunks(2)
            .map(|pair| RowPosition { x: pair[0], y: pair.get(1).copied().flatten(), confidence: None })
            .collect();
        collector.add_row("", RowStamp { line, frame: None, time: *time }, &positions);
        Ok(())
    }

    fn end_track(&mut self) -> ImportResult<()> {
        let Some(TrackBlock { name, rows: Some((_, collector)) }) = self.block.take() else { return Ok(()) };
        let (clocks, mut tracks) = collector.finish(self.file, RowOrder::AsWritten)?;
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
}

/// What the rows of a block contain: a time, and `points` points. If there are several points, they are
/// numbered, because this export does not name the points of an object.
fn block_shape(name: &str, points: usize) -> InstanceFields {
    let called = |index: usize| if points == 1 { name.to_owned() } else { format!("{name}/{}", index + 1) };
    let points = (0..points)
        .map(|index| PointFields { name: called(index), has_y: true, ..PointFields::default() })
        .collect();
    InstanceFields { has_frame: false, has_time: true, clock_cell: 0, points }
}

fn not_a_number_error(
    file: &str,
    (line, text): (usize, &str),
    cell: usize,
    found: &str,
    style: NumberStyle,
) -> ImportError {
    let mark = if cell == 0 { style.time_mark } else { style.position_mark };
    let other = if mark == '.' { ',' } else { '.' };
    let remedy = match parse_number(found, other) {
        CellNumber::Value(_) => (
            "the decimal mark of the column's other numbers",
            "the decimal mark changes within the column, or a mark separates thousands: export again with one \
             format of numbers",
        ),
        _ if cell == 0 && style.code => {
            ("a time code such as 0:00:01:25, as in the first row", "export again, or correct the cell")
        }
        _ => ("a number", "export again, or write NaN if the point was lost"),
    };
    let name = if cell == 0 { "T" } else { ["Y", "X"][cell % 2] };
    let place = TextLocation { file: file.to_owned(), line, column: column_of_word(text, cell) };
    ImportError::cell(place, CellProblem::NotANumber, (name, found), remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_codes_are_seconds() {
        assert_eq!(time_code_s("0:00:00:03"), Some(0.03));
        assert_eq!(time_code_s("1:02:03:250"), Some(3723.25));
        assert_eq!(time_code_s("-0:00:01:50"), Some(-1.5));
        for text in ["0:00:03", "0:00:00:", "0:00:0x:03", "1:2:3:4:5", "0:0:0:1234567890", "0.03"] {
            assert_eq!(time_code_s(text), None, "{text}");
        }
    }

    #[test]
    fn marks_are_found_for_times_and_positions_apart() {
        let style = NumberStyle::detect("#Kinovea 1.5\n# a,b\n0.008 1 -2,5\n");
        assert_eq!(style, NumberStyle { code: false, time_mark: '.', position_mark: ',' });
    }
}
