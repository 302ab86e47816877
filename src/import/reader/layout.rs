//! The layout of a table: the meaning of each cell of a row. Every format describes its table by a
//! [`TableLayout`], and the same code then reads the rows of all formats.

use super::Document;
use super::cut_numbers::cut_numbers_finding;
use super::number::CellNumber;
use super::rows::RowView;
use super::table::DelimitedTable;
use super::track_file::{Fact, Facts, TrackFile};
use crate::import::error::{ImportError, ImportResult};
use crate::import::reader::column::CoordinateUnit;
use crate::import::reader::instances::{
    InstanceFields, PointFields, RowOrder, RowPosition, RowStamp, TrackCollector,
};
use crate::import::source::base_name;
use crate::recording::quality::{Check, QualityFinding, Severity};
use portable_math as math;

/// Indices of the cells of a row that give the position of a point. A coordinate is the sum of its cells, for
/// example of a reference position and a displacement.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PointCells {
    /// Name of the point; empty if the track is named after its instance (the group of rows to which the row
    /// belongs).
    pub name: String,
    pub x: Vec<usize>,
    /// Indices of the cells of y; empty if the table has no y.
    pub y: Vec<usize>,
    pub confidence: Option<usize>,
    /// Units of x and y, where the header states them.
    pub units: [Fact<CoordinateUnit>; 2],
}

impl PointCells {
    /// Name of the point, and whether it has y and confidence, in the form that [`TrackCollector`] needs.
    pub(crate) fn fields(&self) -> PointFields {
        PointFields {
            name: self.name.clone(),
            has_y: !self.y.is_empty(),
            has_confidence: self.confidence.is_some(),
            units: self.units.clone(),
        }
    }

    pub(crate) fn new(name: impl Into<String>, x: usize, y: Option<usize>) -> Self {
        Self { name: name.into(), x: vec![x], y: y.into_iter().collect(), ..Self::default() }
    }
}

/// A rule by which numbers in a row show that the point was lost in that frame.
#[derive(Clone, Copy)]
pub(crate) struct LostRule {
    /// Index of the cell whose number is tested; `None` if x and y of the position are tested.
    pub cell: Option<usize>,
    /// Returns true if the point was lost. Its arguments are x and y of the position; if `cell` is given,
    /// both arguments are the number in that cell.
    pub is: fn(f64, f64) -> bool,
    /// The rule in words for messages, e.g. `at exactly (0, 0)`.
    pub words: &'static str,
}

#[derive(Clone)]
pub(crate) struct TableLayout {
    /// Index in `DelimitedTable::head` of the first row of data.
    pub start: usize,
    /// Minimum number of cells in a row.
    pub width: usize,
    /// Maximum number of cells in a row; any further cells must be empty.
    pub most: usize,
    pub frame: Option<usize>,
    pub time: Option<usize>,
    /// Whether the cell of the frame contains the name of a picture, which ends in the frame number.
    pub names_pictures: bool,
    /// Frame number of the first row. It is used if the table has neither frame numbers nor times, so that
    /// every row is a frame.
    pub first_frame: f64,
    /// Indices of the cells whose texts name the instance (track) of a row; empty if the table has only one
    /// instance.
    pub key: Vec<usize>,
    /// Whether rows whose `key` cells are empty are left out.
    pub skip_nameless: bool,
    pub order: RowOrder,
    /// Whether the table has several clocks, of which this layout reads one. Rows in which this clock and all
    /// its positions are empty are then skipped.
    pub of_others: bool,
    pub points: Vec<PointCells>,
    pub lost: Vec<LostRule>,
}

impl Default for TableLayout {
    fn default() -> Self {
        Self {
            start: 0,
            width: 0,
            most: usize::MAX,
            frame: None,
            time: None,
            names_pictures: false,
            first_frame: 0.0,
            key: vec![],
            skip_nameless: false,
            of_others: false,
            order: RowOrder::AsWritten,
            points: vec![],
            lost: vec![],
        }
    }
}

/// Reads the points of a table whose columns, from index `first` on, come in pairs of x and y. The two column
/// names of a pair end in `ends[0]` and `ends[1]`; `rename` makes the name of the track from their common
/// beginning.
///
/// # Errors
/// The index of the first column that has no partner.
pub(crate) fn read_point_pairs(
    names: &[&str],
    first: usize,
    ends: [&str; 2],
    rename: impl Fn(&str) -> &str,
) -> Result<Vec<PointCells>, usize> {
    let pair = |at: usize| {
        let y = names.get(at + 1).and_then(|name| name.strip_suffix(ends[1]));
        let name = names[at].strip_suffix(ends[0]).filter(|name| y == Some(*name)).ok_or(at)?;
        Ok(PointCells::new(rename(name), at, Some(at + 1)))
    };
    (first..names.len()).step_by(2).map(pair).collect()
}

impl TableLayout {
    /// Layout of a table with rows of exactly `width` cells. The first row of data has the index `start` in
    /// `DelimitedTable::head`.
    pub(crate) fn new(start: usize, width: usize, points: Vec<PointCells>) -> Self {
        Self { start, width, most: width, points, ..Self::default() }
    }

    /// Reads every row of data into clocks and tracks.
    ///
    /// # Errors
    /// [`ImportError`] for a row with a wrong number of cells, and for a cell that is not a number.
    pub(crate) fn read_tracks<'a>(
        &self,
        document: &'a Document,
        table: &'a DelimitedTable,
        facts: Facts,
    ) -> ImportResult<TrackFile<'a>> {
        let mut collector = TrackCollector::new(self.instance_fields());
        let RowCounts { lost, nameless, time_decimals } = self.collect_rows(table, &mut collector)?;
        let (mut clocks, tracks) = collector.finish(document.file, self.order)?;
        let digit = time_decimals.map_or(0.0, |decimals| math::powi(10.0, -decimals));
        clocks.iter_mut().for_each(|clock| clock.digit = digit);
        let mut export = TrackFile {
            table: Some(table),
            clocks,
            tracks,
            facts,
            findings: self.lost_point_findings(&lost),
            texts: table.head.iter().take(self.start).flat_map(|row| row.cells.iter().cloned()).collect(),
            ..TrackFile::for_document(document)
        };
        export.findings.extend(cut_numbers_finding(table, self.start, &self.number_cells())?);
        if nameless > 0 {
            export.notes.push(format!("{nameless} rows belong to no track and are left out"));
        }
        Ok(export)
    }

    /// Whether the table has neither frame numbers nor times, so that every row is a frame.
    fn counts_rows(&self) -> bool {
        self.frame.is_none() && self.time.is_none()
    }

    fn collect_rows(
        &self,
        table: &DelimitedTable,
        collector: &mut TrackCollector,
    ) -> ImportResult<RowCounts> {
        let (mut lost, mut nameless, mut time_decimals) = (vec![0; self.lost.len()], 0, None);
        let (mut counted, mut last_line, mut key) = (0.0, 0, String::new());
        let mut positions = vec![RowPosition::default(); self.points.len()];
        let mut rows = table.rows(self.start);
        while let Some(record) = rows.next_row()? {
            if self.counts_rows() && last_line > 0 && record.line > last_line + 1 {
                return Err(blank_line_error(table, last_line + 1));
            }
            last_line = record.line;
            if (record.is_empty() && !self.counts_rows())
                || (self.of_others
                    && self.number_cells().into_iter().all(|cell| record.cell(cell).is_empty()))
            {
                continue;
            }
            table.check_row_length(&record, self.width, self.most)?;
            self.write_key(&record, &mut key);
            if self.skip_nameless && key.is_empty() && !self.key.is_empty() {
                nameless += 1;
                continue;
            }
            for (position, cells) in positions.iter_mut().zip(&self.points) {
                *position = self.read_position(table, &record, cells, &mut lost)?;
            }
            let frame = if self.counts_rows() {
                Some(self.first_frame + counted)
            } else if let (true, Some(cell)) = (self.names_pictures, self.frame) {
                Some(picture_number(table, &record, cell)?)
            } else {
                table.optional_number_at(&record, self.frame, "frame")?
            };
            let time = table.optional_number_at(&record, self.time, "time")?;
            if let (Some(_), Some(cell)) = (time, self.time) {
                time_decimals =
                    time_decimals.max(Some(count_decimals(record.cell(cell), table.dialect.decimal)));
            }
            counted += 1.0;
            collector.add_row(&key, RowStamp { line: record.line, frame, time }, &positions);
        }
        Ok(RowCounts { lost, nameless, time_decimals })
    }

    /// Indices of all cells with a frame number, a time or a coordinate, each once and in increasing order.
    fn number_cells(&self) -> Vec<usize> {
        let of_points = self.points.iter().flat_map(|point| point.x.iter().chain(&point.y).copied());
        let mut cells: Vec<usize> = self.frame.into_iter().chain(self.time).chain(of_points).collect();
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    fn instance_fields(&self) -> InstanceFields {
        InstanceFields {
            has_frame: self.frame.is_some() || self.counts_rows(),
            has_time: self.time.is_some(),
            clock_cell: self.frame.or(self.time).unwrap_or(0),
            points: self.points.iter().map(PointCells::fields).collect(),
        }
    }

    fn write_key(&self, record: &RowView, key: &mut String) {
        key.clear();
        for &cell in &self.key {
            if !key.is_empty() {
                key.push(':');
            }
            key.push_str(record.cell(cell));
        }
    }

    fn read_position(
        &self,
        table: &DelimitedTable,
        record: &RowView,
        cells: &PointCells,
        lost: &mut [usize],
    ) -> ImportResult<RowPosition> {
        let sum = |parts: &[usize], axis: &str| -> ImportResult<Option<f64>> {
            let mut total = 0.0;
            for &part in parts {
                match table.parse_cell(record.cell(part)) {
                    CellNumber::Value(value) => total += value,
                    CellNumber::Missing => return Ok(None),
                    CellNumber::Text => {
                        // (the name of the coordinate is composed only for an error, to save time)
                        let name = axis_name(axis, &cells.name);
                        return Err(table.not_a_number_error(record.line, part, record.cell(part), &name));
                    }
                }
            }
            Ok((!parts.is_empty()).then_some(total))
        };
        let confidence = table.optional_number_at(record, cells.confidence, "confidence")?;
        let mut position = RowPosition { x: sum(&cells.x, "x")?, y: sum(&cells.y, "y")?, confidence };
        for (rule, count) in self.lost.iter().zip(lost) {
            let asked = match rule.cell {
                Some(cell) => table.number_at(record, cell, "status")?.map(|value| (value, value)),
                None => position.x.zip(position.y),
            };
            if asked.is_some_and(|(x, y)| (rule.is)(x, y)) && position.x.is_some() {
                *count += 1;
                position = RowPosition { x: None, y: None, confidence };
            }
        }
        Ok(position)
    }

    fn lost_point_findings(&self, lost: &[usize]) -> Vec<QualityFinding> {
        let counted = self.lost.iter().zip(lost).filter(|(_, count)| **count > 0);
        let finding = |(rule, count): (&LostRule, &usize)| {
            let words = rule.words;
            let found =
                format!("{count} positions {words} count as missing, as this format writes lost points");
            QualityFinding::new(Check::LostPoints, Severity::Note, *count as f64, "", found)
        };
        counted.map(finding).collect()
    }
}

/// Counts over the rows of a table.
struct RowCounts {
    /// Number of positions that each rule marks as lost.
    lost: Vec<usize>,
    /// Number of rows that do not name their instance.
    nameless: usize,
    /// Largest number of decimals of a time; `None` if no row has a time.
    time_decimals: Option<i32>,
}

/// Frame number at the end of the name of a picture in a cell.
fn picture_number(table: &DelimitedTable, record: &RowView, cell: usize) -> ImportResult<f64> {
    let path = record.cell(cell);
    trailing_number(base_name(path)).ok_or_else(|| {
        let remedy = (
            "a picture whose name ends in its frame number, such as img0042.png",
            "rename the pictures by their frames in the table, or import the table of analyze_videos, which numbers \
             the frames",
        );
        ImportError::cell(table.cell_location(record.line, cell), ("picture", path), remedy)
    })
}

/// The number at the end of a file name, before the extension.
fn trailing_number(name: &str) -> Option<f64> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let digits = stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    stem.get(digits..)?.parse::<u32>().ok().map(f64::from)
}

fn blank_line_error(table: &DelimitedTable, line: usize) -> ImportError {
    let expected = "one row a frame: the table does not number its frames";
    let advice =
        "write NaN for a lost point; if no frame is missing here, import a copy without the empty line";
    ImportError::format(table.location(line, 1), "an empty line", expected, advice)
}

/// Name of a coordinate in messages: `x of tip`, or only `x` if `point` is empty.
fn axis_name(axis: &str, point: &str) -> String {
    if point.is_empty() { axis.to_owned() } else { format!("{axis} of {point}") }
}

// Tables with a clock for each track: the clocks are compared, and tracks whose clocks differ are read
// separately.

/// A column of times or frame numbers. Its values are multiplied by `unit` before clocks are compared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ClockCell {
    pub cell: usize,
    pub unit: f64,
}

/// A row in which two clocks differ.
pub(crate) struct ClockDifference {
    pub line: usize,
    /// Index of the cell of the second clock.
    pub cell: usize,
    /// Texts in the cells of the two clocks; empty if the row lacks that clock.
    pub texts: [String; 2],
}

/// Finds the first row in which two clocks differ by more than the rounding of their numbers. `start` is the
/// index in `DelimitedTable::head` of the first row of data.
///
/// # Errors
/// [`ImportError`] for rows that cannot be read, and for clocks that are not numbers.
pub(crate) fn find_clock_difference(
    table: &DelimitedTable,
    start: usize,
    first: ClockCell,
    other: ClockCell,
) -> ImportResult<Option<ClockDifference>> {
    table.find_in_rows(start, |record| {
        let differs = match (read_clock(table, record, first)?, read_clock(table, record, other)?) {
            (Some((a, a_digit)), Some((b, b_digit))) => (a - b).abs() > (a_digit + b_digit) * (1.0 + 1e-6),
            (one, two) => one.is_some() != two.is_some(),
        };
        let texts = || [first, other].map(|clock| record.cell(clock.cell).to_owned());
        Ok(differs.then(|| ClockDifference { line: record.line, cell: other.cell, texts: texts() }))
    })
}

/// Value of a clock in a row, and the size of one unit of its last written digit, both multiplied by the unit
/// of the clock; `None` if the value is missing.
fn read_clock(
    table: &DelimitedTable,
    record: &RowView,
    clock: ClockCell,
) -> ImportResult<Option<(f64, f64)>> {
    let digit = math::powi(10.0, -count_decimals(record.cell(clock.cell), table.dialect.decimal));
    let value = table.number_at(record, clock.cell, "time")?;
    Ok(value.map(|value| (value * clock.unit, digit * clock.unit)))
}

/// Number of decimals of a written number: 3 for `0.017`, 2 for `1.7e-1`, and -2 for `1e2`.
fn count_decimals(text: &str, decimal: char) -> i32 {
    let (mantissa, exponent) = match text.bytes().position(|byte| matches!(byte, b'e' | b'E' | b'd' | b'D')) {
        Some(at) => (&text[..at], text[at + 1..].replace('\u{2212}', "-").parse().unwrap_or(0)),
        None => (text, 0),
    };
    let is_mark = |byte: u8| char::from(byte) == decimal; // (decimal marks are ASCII)
    let decimals = mantissa.bytes().position(is_mark).map_or(0, |at| mantissa.len() - at - 1);
    i32::try_from(decimals).unwrap_or(0).saturating_sub(exponent)
}

/// Reads the tracks of a table with several clocks, with one layout per clock. For each clock, rows in which
/// the clock and its positions are empty are skipped.
///
/// # Errors
/// The errors of [`TableLayout::read_tracks`].
pub(crate) fn read_clocks_apart<'a>(
    layouts: Vec<TableLayout>,
    document: &'a Document,
    table: &'a DelimitedTable,
    facts: Facts,
) -> ImportResult<TrackFile<'a>> {
    let mut all = TrackFile { table: Some(table), facts: facts.clone(), ..TrackFile::for_document(document) };
    for layout in layouts {
        let mut part =
            TableLayout { of_others: true, ..layout }.read_tracks(document, table, facts.clone())?;
        part.tracks.iter_mut().for_each(|track| track.clock += all.clocks.len());
        all.clocks.append(&mut part.clocks);
        all.tracks.append(&mut part.tracks);
        all.findings.append(&mut part.findings);
        all.texts = part.texts;
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_are_one_as_far_as_their_digits_show() {
        let line = |text: &str, unit: f64| {
            let table = DelimitedTable::parse("a.txt", text).unwrap();
            let clock = |cell: usize, unit: f64| ClockCell { cell, unit };
            find_clock_difference(&table, 1, clock(0, 1.0), clock(1, unit)).unwrap().map(|found| found.line)
        };
        assert_eq!(line("t,u\n0,0\n0.5,0.5\n1,1\n", 1.0), None);
        assert_eq!(line("t,u\n0,0\n0.5,500\n1,1000.0\n", 1e-3), None);
        assert_eq!(line("t,u\n0,0\n0.333,0.3333\n0.667,6.667E-1\n", 1.0), None);
        assert_eq!(line("t,u\n0,0\n0.500,0.501\n0.700,0.930\n", 1.0), Some(4));
        assert_eq!(line("t,u\n0,0\n0.5,\n1,1\n", 1.0), Some(3));
    }

    #[test]
    fn the_end_of_a_pictures_name_is_its_frame() {
        for (name, frame) in [
            ("img0042.png", Some(42.0)),
            ("img7.tif", Some(7.0)),
            ("run2_000.png", Some(0.0)),
            ("12", Some(12.0)),
        ] {
            assert_eq!(trailing_number(name), frame, "{name}");
        }
        for name in ["img.png", "img12_crop.png", "", "img99999999999999999999.png", "é.png"] {
            assert_eq!(trailing_number(name), None, "{name}");
        }
    }
}
