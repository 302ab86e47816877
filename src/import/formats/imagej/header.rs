//! What all tables of ImageJ share: the direction of y, and a refusal at the header.

use crate::import::error::ImportError;
use crate::import::reader::{DelimitedTable, Facts, TextRow};
use crate::recording::files::YAxis;

/// What the documentation fixes of all three tables.
pub(crate) fn imagej_facts() -> Facts {
    let why = "ImageJ counts y from the top of the picture, unless `Invert Y coordinates` was ticked in \
        Analyze > Set Measurements"
        .to_owned();
    Facts { y_axis: Some((YAxis::Down, why)), ..Facts::default() }
}

/// The refusal of a table at its header.
pub(crate) fn header_error(
    table: &DelimitedTable,
    row: &TextRow,
    found: String,
    expected: &str,
    advice: &str,
) -> ImportError {
    ImportError::wrong_table(table.location(row.line, 1), found, expected, advice)
}
