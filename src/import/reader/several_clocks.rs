//! Tables with a clock for each track: whether the clocks are one, and the tracks of each where they are not.

use crate::import::error::ImportError;
use crate::import::reader::document::Document;
use crate::import::reader::layout::TableLayout;
use crate::import::reader::number::CellNumber;
use crate::import::reader::rows::RowView;
use crate::import::reader::table::DelimitedTable;
use crate::import::reader::track_file::{Facts, TrackFile};
use crate::math;

/// A column of times or frame numbers, and how much one of its numbers is in the unit that is compared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ClockCell {
    pub cell: usize,
    pub unit: f64,
}

/// A row in which two clocks differ.
pub(crate) struct ClockDifference {
    pub line: usize,
    /// Cell of the second clock.
    pub cell: usize,
    /// What the two say, in the table's own words; empty where a row has only one of them.
    pub texts: [String; 2],
}

/// The first row from row `start` of the head on in which `other` says another time than `first`, as far as
/// their digits show.
///
/// # Errors
/// [`ImportError`] for rows that cannot be read, and for clocks that are no numbers.
pub(crate) fn find_clock_difference(
    table: &DelimitedTable,
    start: usize,
    first: ClockCell,
    other: ClockCell,
) -> Result<Option<ClockDifference>, ImportError> {
    let mut rows = table.rows(start);
    while let Some(record) = rows.next_row()? {
        let [one, two] = [first, other].map(|clock| read_clock(table, &record, clock));
        let (one, two) = (one?, two?);
        let differs = match (one, two) {
            (Some((a, a_digit)), Some((b, b_digit))) => (a - b).abs() > (a_digit + b_digit) * (1.0 + 1e-6),
            (None, None) => false,
            _ => true,
        };
        if differs {
            let texts = [first, other].map(|clock| record.cell(clock.cell).to_owned());
            return Ok(Some(ClockDifference { line: record.line, cell: other.cell, texts }));
        }
    }
    Ok(None)
}

/// What a clock says in a row, and what its last digit is worth.
fn read_clock(
    table: &DelimitedTable,
    record: &RowView,
    clock: ClockCell,
) -> Result<Option<(f64, f64)>, ImportError> {
    let text = record.cell(clock.cell);
    match table.parse_cell(text) {
        CellNumber::Value(value) => {
            Ok(Some((value * clock.unit, last_digit_value(text, table.dialect.decimal) * clock.unit)))
        }
        CellNumber::Missing => Ok(None),
        CellNumber::Text => Err(table.not_a_number_error(record.line, clock.cell, text, "time")),
    }
}

/// What the last digit of a written number is worth.
fn last_digit_value(text: &str, decimal: char) -> f64 {
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let decimals = mantissa.split_once(decimal).map_or(0, |(_, decimals)| decimals.len());
    let exponent: i32 = exponent.replace('\u{2212}', "-").parse().unwrap_or(0);
    math::powi(10.0, exponent - i32::try_from(decimals).unwrap_or(0))
}

/// The tracks of each clock of a table in one file: rows that hold nothing of a clock are not its own.
///
/// # Errors
/// As [`TableLayout::read_tracks`].
pub(crate) fn read_clocks_apart<'a>(
    layouts: Vec<TableLayout>,
    document: &'a Document,
    table: &'a DelimitedTable,
    facts: Facts,
) -> Result<TrackFile<'a>, ImportError> {
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
}
