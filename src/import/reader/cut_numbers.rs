//! Finds numbers that lost digits because a spreadsheet saved only the digits that it showed.

use crate::import::error::ImportResult;
use crate::import::reader::table::DelimitedTable;
use crate::recording::quality::{Check, QualityFinding, Severity};

const CUT_NUMBER_ADVICE: &str = "a spreadsheet shows numbers so and saves what it shows: import the tracking program's own \
    export, which no spreadsheet has saved";

/// Whether a text has the form `1.23E+05`, in which a spreadsheet shows a number that is too wide for its
/// cell.
fn is_cut_number(text: &str) -> bool {
    let digits = text.strip_prefix('-').unwrap_or(text).as_bytes();
    matches!(digits, [a, b'.' | b',', b, c, b'E', b'+' | b'-', d, e]
        if [a, b, c, d, e].iter().all(|byte| byte.is_ascii_digit()))
}

/// Finding about numbers that were cut to three digits (`1.23E+05`) in a column in which other numbers have
/// all their digits. `cells` are the indices of the columns to check; `start` is the index in
/// `DelimitedTable::head` of the first row of data.
///
/// # Errors
/// An error if a row cannot be read.
pub(crate) fn cut_numbers_finding(
    table: &DelimitedTable,
    start: usize,
    cells: &[usize],
) -> ImportResult<Option<QualityFinding>> {
    if !table.may_have_cut_numbers() {
        return Ok(None);
    }
    // for each column: how many numbers are cut, line and text of the first of them, and whether other
    // numbers have all digits
    let mut found = vec![(0_usize, None, false); cells.len()];
    table.find_in_rows(start, |record| {
        for ((count, first, plain), &cell) in found.iter_mut().zip(cells) {
            let text = record.cell(cell);
            if is_cut_number(text) {
                *count += 1;
                first.get_or_insert_with(|| (record.line, text.to_owned()));
            } else if !text.contains(['e', 'E']) {
                *plain |= table.parse_cell(text).value().is_some_and(|value| value != 0.0);
            }
        }
        Ok(None::<()>)
    })?;
    let cut = found.into_iter().zip(cells).find_map(|((count, first, plain), &cell)| {
        first.filter(|_| plain).map(|(line, text)| (count, line, text, cell))
    });
    Ok(cut.map(|(count, line, text, cell)| {
        let found = format!(
            "{}: `{text}` has three digits where others of its column are written out ({count} such numbers in \
             column {})",
            table.cell_location(line, cell),
            cell + 1
        );
        let (kind, number) = ((Check::SpreadsheetRounding, Severity::Caution), (count as f64, ""));
        QualityFinding::advise(kind, number, found, CUT_NUMBER_ADVICE)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_cut_to_three_digits_among_others_are_found_at_their_place() {
        let found = |text: &str| {
            let table = DelimitedTable::parse("a.csv", text).unwrap();
            cut_numbers_finding(&table, 1, &[0, 1]).unwrap()
        };
        let cut = found("t,x\n0,101.25\n1,1.23E+05\n2,103.5\n3,1.25E+05\n").unwrap();
        assert!(cut.found.starts_with("a.csv:3:3: `1.23E+05` has three digits"), "{}", cut.found);
        assert!(cut.found.contains("(2 such numbers in column 2)"), "{}", cut.found);
        assert_eq!(found("t,x\n0,1.01E+02\n1,1.23E+05\n2,0\n"), None);
        assert_eq!(found("t,x\n0,1.013E+02\n1,5\n2,6\n"), None);
    }
}
