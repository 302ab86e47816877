//! The steps that all formats share to get from the bytes of a file to tracks on a frame grid: text encoding,
//! dialect (delimiter and decimal mark), table of cells, meaning of the columns, and timing.

pub(crate) mod calibration;
pub(crate) mod column;
pub(crate) mod companion;
pub(crate) mod cut_numbers;
pub(crate) mod dialect;
pub(crate) mod encoding;
pub(crate) mod file_type;
pub(crate) mod findings;
pub(crate) mod grid;
pub(crate) mod instances;
pub(crate) mod layout;
pub(crate) mod number;
pub(crate) mod rate;
pub(crate) mod rows;
pub(crate) mod spreadsheet;
pub(crate) mod table;
pub(crate) mod timing;
pub(crate) mod track_choice;
pub(crate) mod track_file;

use super::error::ImportResult;
use super::source::{ImportSource, base_name};
pub(crate) use column::{ColumnMeaning, ColumnUnit, CoordinateUnit, TimeUnit, squeeze_name};
use encoding::DecodedText;
pub(crate) use instances::{InstanceFields, PointFields, RowOrder, RowPosition, RowStamp, TrackCollector};
pub(crate) use layout::{LostRule, PointCells, TableLayout};
pub(crate) use number::{CellNumber, parse_number};
pub(crate) use rows::{RowView, TextRow};
pub(crate) use table::DelimitedTable;
pub(crate) use track_file::{Clock, Column, Fact, Facts, Track, TrackFile, clock_lines};

/// A decoded file, with its table and the texts of its companion files.
pub(crate) struct Document<'a> {
    /// Path of the file as the user gave it.
    pub file: &'a str,
    /// Name of the file, without folders and extension.
    pub stem: &'a str,
    /// Text of the file, without a byte-order mark.
    pub text: &'a str,
    /// The text as a table, or the error that says why it is not a table.
    pub table: ImportResult<DelimitedTable<'a>>,
    /// Name and text of each companion file.
    pub companions: Vec<(&'a str, String)>,
}

impl<'a> Document<'a> {
    pub(crate) fn new(source: &'a ImportSource, decoded: &'a DecodedText) -> Self {
        let base = base_name(&source.name);
        let stem = base.rsplit_once('.').map_or(base, |(stem, _)| stem);
        let companions = source.companions.iter().filter_map(|file| {
            let decoded = encoding::decode_text(&file.name, &file.bytes, None).ok()?;
            Some((file.name.as_str(), decoded.text.into_owned()))
        });
        let table = file_type::refuse_text(&source.name, &decoded.text)
            .map_or_else(|| DelimitedTable::parse(&source.name, &decoded.text), Err);
        Self { file: &source.name, stem, text: &decoded.text, table, companions: companions.collect() }
    }

    pub(crate) fn table(&self) -> ImportResult<&DelimitedTable<'_>> {
        self.table.as_ref().map_err(Clone::clone)
    }

    /// Note for the report on encoding, delimiter and decimal mark.
    pub(crate) fn encoding_note(&self, decoded: &DecodedText) -> String {
        let dialect = self.table.as_ref().map_or_else(|_| String::new(), |table| table.dialect.describe());
        format!("{}: {}{dialect}", self.file, decoded.encoding)
    }
}
